"""Calibrations in binary and in XML, as the same documents as those in text."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

from viewsphere import files
from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.readers.shared.xml_tree import parse_xml
from viewsphere.errors import ModelError, RecipeError
from viewsphere.geometry.lenses.shared.programs.colmap import NAMES, PARAMETERS
from viewsphere.validation.errors import shown


def colmap_lines(path: Path) -> list[list[str]]:
    """The words CAMERA_ID MODEL WIDTH HEIGHT PARAMS of each camera of COLMAP's cameras.bin."""
    try:
        data, at, lines = files.read_bytes(path, "MAX_RIG_BYTES"), 8, list[list[str]]()
        for _ in range(struct.unpack_from("<Q", data)[0]):
            number, model, width, height = struct.unpack_from("<IiQQ", data, at)
            if model not in NAMES:
                raise RecipeError(f"{path}: expected one of {', '.join(PARAMETERS)}; found the model with number {model}")
            count = len(PARAMETERS[NAMES[model]][1].split())
            values = struct.unpack_from(f"<{count}d", data, at + 24)
            lines.append([str(number), NAMES[model], str(width), str(height), *map(repr, values)])
            at += 24 + 8 * count
    except OSError as error:
        raise RecipeError(f"{path}: expected a readable file of a calibration; found: {error.strerror or error}") from None
    except struct.error:
        raise RecipeError(f"{path}: expected COLMAP's cameras.bin; found a file that is cut off") from None
    return lines


def xml_document(path: Path, text: str) -> dict[str, Any]:
    """The mapping of OpenCV's FileStorage in XML: numbers, texts, and matrices of rows, cols and data."""
    try:
        root = parse_xml(ModelFolder(path), text.encode())
    except ModelError as error:
        raise RecipeError(str(error).partition("\n")[0]) from None
    if root.tag != "opencv_storage":
        raise RecipeError(f"{path}: expected OpenCV's opencv_storage; found {shown(root.tag)}")
    return {child.tag: _value(child) for child in root if child.tag != "lines"}


def _value(entry: Element) -> Any:
    if (data := entry.find("data")) is None:
        words = (entry.text or "").split()
        return _number(words[0]) if len(words) == 1 else [_number(word) for word in words]
    rows, columns = (_number((entry.findtext(name) or "").strip()) for name in ("rows", "cols"))
    return {"rows": rows, "cols": columns, "data": [_number(word) for word in (data.text or "").split()]}


def _number(word: str) -> int | float | str:
    """The number of a word, or the word itself."""
    for kind in (int, float):
        try:
            return kind(word)
        except ValueError:
            continue
    return word
