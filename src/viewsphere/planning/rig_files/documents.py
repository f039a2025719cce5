"""YAML of calibrations: OpenCV's dialect, and standard YAML."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np
import yaml
from numpy.typing import NDArray

from viewsphere.composing.viewpoints.pose_files.lines import number, read_text
from viewsphere.errors import RecipeError
from viewsphere.planning.rig_files.encoded import colmap_lines, xml_document
from viewsphere.recipe.reading.file import ShallowLoader

Float = NDArray[np.float64]


class _Loader(ShallowLoader):
    """A loader of plain data; `!!opencv-matrix` becomes a mapping, and a vector in OpenCV 5's `!!opencv-nd-matrix` becomes one
    column.
    """


def _as_mapping(loader: yaml.SafeLoader, node: yaml.MappingNode) -> dict[Any, Any]:
    return loader.construct_mapping(node, deep=True)


def _as_columns(loader: yaml.SafeLoader, node: yaml.MappingNode) -> dict[Any, Any]:
    entry = _as_mapping(loader, node)
    sizes = entry.get("sizes")
    if not isinstance(sizes, list) or len(cast("list[Any]", sizes)) not in (1, 2):
        problem = f"sizes of a vector or a matrix were expected; found {sizes!r:.40}"
        raise yaml.constructor.ConstructorError(problem=problem, problem_mark=node.start_mark)
    rows, columns = (*cast("list[Any]", sizes), 1)[:2]
    return entry | {"rows": rows, "cols": columns}


_Loader.add_constructor("tag:yaml.org,2002:opencv-matrix", _as_mapping)
_Loader.add_constructor("tag:yaml.org,2002:opencv-nd-matrix", _as_columns)


def read_document(path: Path) -> dict[str, Any]:
    """A calibration file's mapping; raises RecipeError for any other file. A .txt or .bin has `lines`, lists of words.

    OpenCV writes `%YAML:1.0`, which is not a valid YAML directive (https://docs.opencv.org/4.x/da/d56/group__core__xml.html).
    """
    if path.suffix.lower() == ".bin":
        return {"lines": colmap_lines(path)}
    text = read_text(path, "a calibration", "MAX_RIG_BYTES")
    if path.suffix.lower() == ".txt":
        lines = (line.split() for line in text.splitlines() if not line.lstrip().startswith("#"))
        return {"lines": [words for words in lines if words]}
    if path.suffix.lower() == ".xml":
        return xml_document(path, text)
    if text.startswith("%YAML:"):
        text = text.partition("\n")[2]
    try:
        document = yaml.load(text, _Loader)  # safe: the loader makes plain data alone
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        mark = getattr(error, "problem_mark", None)
        line = f":{mark.line + 1}" if mark else ""
        raise RecipeError(f"{path}{line}: expected YAML; found a mistake: {getattr(error, 'problem', error)}") from None
    if not isinstance(document, dict):
        raise RecipeError(f"{path}: expected a mapping; found {type(document).__name__}")
    return cast("dict[str, Any]", document)


def matrix(value: Any, where: str, shape: tuple[int, int] | None = None) -> Float:
    """A matrix, stored as `{rows, cols, data}` or as a list of rows; raises RecipeError for another shape."""
    if isinstance(value, dict):
        entry = cast("dict[str, Any]", value)
        data = row(entry.get("data"), f"{where}.data")
        rows, columns = entry.get("rows"), entry.get("cols")
        if not isinstance(rows, int) or not isinstance(columns, int) or rows < 1 or rows * columns != len(data):
            values = f"{rows!r:.40} x {columns!r:.40} and {len(data)} numbers"
            raise RecipeError(f"{where}: expected rows x cols numbers; found {values}")
        values = np.array(data, np.float64).reshape(rows, columns)
    elif isinstance(value, list):
        lines = [row(line, where) for line in cast("list[Any]", value)]
        if len({len(line) for line in lines}) != 1:
            raise RecipeError(f"{where}: expected rows of equal length; found {[len(line) for line in lines]}")
        values = np.array(lines, np.float64)
    else:
        raise RecipeError(f"{where}: expected a matrix; found {'nothing' if value is None else repr(value)[:40]}")
    if shape is not None and values.shape != shape:
        raise RecipeError(f"{where}: expected {shape[0]} x {shape[1]} numbers; found {values.shape[0]} x {values.shape[1]}")
    return values


def row(value: Any, where: str) -> list[float]:
    """A list of finite numbers."""
    if not isinstance(value, list):
        raise RecipeError(f"{where}: expected a list of numbers; found {'nothing' if value is None else repr(value)[:40]}")
    return [number(cell, where) for cell in cast("Sequence[object]", value)]


def size(width: Any, height: Any, where: str) -> tuple[int, int] | None:
    """The pictures' [width, height], None if the file has none; raises RecipeError for an invalid size."""
    if width is None or height is None:
        return None
    sides = number(width, where), number(height, where)
    if min(sides) < 1 or any(side != int(side) for side in sides):
        raise RecipeError(f"{where}: expected whole numbers of pixels above 0; found {width} and {height}")
    return int(sides[0]), int(sides[1])
