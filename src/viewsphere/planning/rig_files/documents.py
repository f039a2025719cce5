"""YAML of calibrations: OpenCV's dialect, and standard YAML."""

from __future__ import annotations

from collections.abc import Collection
from itertools import chain
from pathlib import Path
from typing import Any, cast

import numpy as np
import yaml
from numpy.typing import NDArray

from viewsphere.composing.viewpoints.pose_files.lines import number, picture_size, read_text
from viewsphere.errors import RecipeError
from viewsphere.planning.rig_files.encoded import colmap_lines, xml_document
from viewsphere.recipe.reading.file import BoundedLoader
from viewsphere.validation.errors import shown

Float = NDArray[np.float64]


class _Loader(BoundedLoader):
    """A loader of plain data; `!!opencv-matrix` becomes a mapping, and a vector in OpenCV 5's `!!opencv-nd-matrix` becomes one
    column. It ends before values that stand, by aliases, for more than the limit of a recipe.
    """

    def get_single_node(self) -> yaml.Node | None:
        """The document's node; raises MarkedYAMLError for too many values, and for a value within itself."""
        root = super().get_single_node()
        if root is not None:
            self._count(root, {})
        return root

    def _count(self, node: yaml.Node, counted: dict[int, int]) -> int:
        """The number of values that a node stands for; `counted` has those of nodes before it, 0 for those around it."""
        if id(node) not in counted:
            counted[id(node)] = 0
            parts = node.value if isinstance(node, yaml.CollectionNode) else ()
            nodes = chain.from_iterable(parts) if isinstance(node, yaml.MappingNode) else parts
            counted[id(node)] = 1 + sum(self._count(part, counted) for part in nodes)
        if not 0 < counted[id(node)] <= self.most:
            raise self.too_many(node.start_mark)
        return counted[id(node)]


def _as_mapping(loader: yaml.SafeLoader, node: yaml.MappingNode) -> dict[Any, Any]:
    return loader.construct_mapping(node, deep=True)


def _as_columns(loader: yaml.SafeLoader, node: yaml.MappingNode) -> dict[Any, Any]:
    entry = _as_mapping(loader, node)
    sizes = entry.get("sizes")
    if not isinstance(sizes, list) or len(cast("list[Any]", sizes)) not in (1, 2):
        problem = f"sizes of a vector or a matrix were expected; found {shown(sizes)}"
        raise yaml.constructor.ConstructorError(problem=problem, problem_mark=node.start_mark)
    rows, columns = (*cast("list[Any]", sizes), 1)[:2]
    return entry | {"rows": rows, "cols": columns}


_Loader.add_constructor("tag:yaml.org,2002:opencv-matrix", _as_mapping)
_Loader.add_constructor("tag:yaml.org,2002:opencv-nd-matrix", _as_columns)


def read_document(path: Path) -> dict[str, Any]:
    """A calibration file's mapping; raises RecipeError for any other file. A .txt or .bin alone has `lines`, lists of words.

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
    except (yaml.YAMLError, RecursionError, ValueError, LookupError, AttributeError, TypeError, OverflowError) as error:
        mark = getattr(error, "problem_mark", None)
        line = f":{mark.line + 1}" if mark else ""
        problem = str(getattr(error, "problem", None) or error).partition("\n")[0]
        raise RecipeError(f"{path}{line}: expected YAML; found a mistake: {problem:.120}") from None
    if not isinstance(document, dict):
        raise RecipeError(f"{path}: expected a mapping; found {type(document).__name__}")
    return {name: value for name, value in cast("dict[str, Any]", document).items() if name != "lines"}


def _found(value: object) -> str:
    """A value for messages, in at most about 60 characters; `nothing` for None."""
    return "nothing" if value is None else shown(value)


def one_of(value: Any, known: Collection[str], where: str) -> str:
    """A name out of `known`; raises RecipeError for anything else, lists and mappings among them."""
    if not isinstance(value, str) or value not in known:
        raise RecipeError(
            f"{where}: expected one of {', '.join(filter(None, known))}; found {_found(value)}: calibrate it as one"
        )
    return value


def mapping(value: Any, where: str) -> dict[str, Any]:
    """A mapping of a document; raises RecipeError for any other value."""
    if not isinstance(value, dict):
        raise RecipeError(f"{where}: expected a mapping; found {_found(value)}")
    return cast("dict[str, Any]", value)


def matrix(value: Any, where: str, shape: tuple[int, int] | None = None) -> Float:
    """A matrix, stored as `{rows, cols, data}` or as a list of rows; raises RecipeError for another shape."""
    if isinstance(value, dict):
        entry = cast("dict[str, Any]", value)
        data = row(entry.get("data"), f"{where}.data")
        rows, columns = entry.get("rows"), entry.get("cols")
        if type(rows) is not int or type(columns) is not int or rows < 1 or rows * columns != len(data):
            values = f"{_found(rows)} x {_found(columns)} and {len(data)} numbers"
            raise RecipeError(f"{where}: expected rows x cols numbers; found {values}")
        values = np.array(data, np.float64).reshape(rows, columns)
    elif isinstance(value, list):
        lines = [row(line, where) for line in cast("list[Any]", value)]
        if len({len(line) for line in lines}) != 1:
            raise RecipeError(f"{where}: expected rows of equal length; found {shown([len(line) for line in lines])}")
        values = np.array(lines, np.float64)
    else:
        raise RecipeError(f"{where}: expected a matrix; found {_found(value)}")
    if shape is not None and values.shape != shape:
        raise RecipeError(f"{where}: expected {shape[0]} x {shape[1]} numbers; found {values.shape[0]} x {values.shape[1]}")
    return values


def row(value: Any, where: str) -> list[float]:
    """A list of finite numbers."""
    return [number(cell, where) for cell in listed(value, where, "numbers")]


def listed(value: Any, where: str, kind: str) -> list[Any]:
    """A list of a document; raises RecipeError, which names the `kind` of its members, for any other value."""
    if not isinstance(value, list):
        raise RecipeError(f"{where}: expected a list of {kind}; found {_found(value)}")
    return cast("list[Any]", value)


def size(width: Any, height: Any, where: str) -> tuple[int, int] | None:
    """The pictures' [width, height], None if the file has none; raises RecipeError for an invalid size."""
    if width is None or height is None:
        return None
    return picture_size(width, height, where)
