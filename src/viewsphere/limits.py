"""The limits on the resources that files may require, so that no file makes a program run out of memory or time.

The environment variable `VIEWSPHERE_<NAME>` overrides a limit for this process and its child processes. A whole number may have
a unit, such as `20 GB`. Error messages state the limit's name and value, and the value in the file.
"""

from __future__ import annotations

import math
import os
from typing import Generic, TypeVar

from viewsphere.errors import UserError

Number = TypeVar("Number", int, float)

UNITS = {"kb": 10**3, "mb": 10**6, "gb": 10**9, "tb": 10**12, "kib": 1 << 10, "mib": 1 << 20, "gib": 1 << 30, "tib": 1 << 40}
"""The units of numbers of bytes."""


class Limit(Generic[Number]):
    """A limit: each access reads its value from the environment, or else returns the default.

    Raises UserError if the variable is not a number above 0, or not a whole number although the default is one.
    """

    def __init__(self, default: Number, meaning: str) -> None:
        self.default = default
        self.meaning = meaning
        self.name = ""

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    @property
    def variable(self) -> str:
        """The environment variable that sets the limit."""
        return f"VIEWSPHERE_{self.name}"

    def __get__(self, owner: object, kind: type | None = None) -> Number:
        text, number = os.environ.get(self.variable, ""), type(self.default)
        try:
            value = parsed(text, number) if text else self.default
        except ValueError:
            value = number(0)
        if not 0 < value < math.inf:
            whole = "whole " if number is int else ""
            raise UserError(f"{self.variable}: expected a {whole}number above 0, found {text!r:.60}")
        return value


def parsed(text: str, number: type[Number]) -> Number:
    """The number in a text; a whole number may have a unit of bytes. Raises ValueError if there is none."""
    head = text.rstrip("bBkKmMgGtTi")
    unit = UNITS.get(text[len(head) :].lower())
    if unit is None or number is not int:
        return number(text)
    size = float(head) * unit
    if not math.isfinite(size):
        raise ValueError(text)
    return number(size)


class Limits:
    """The limits, in the order of the documentation."""

    MAX_READ_SECONDS = Limit(120.0, "seconds to read one model file")
    MAX_READ_BYTES = Limit(4 << 30, "bytes of memory of the process that reads one (Linux)")
    MAX_FILE_BYTES = Limit(4 << 30, "bytes of a model file, and of each that it names")
    MAX_STREAMED_BYTES = Limit(1 << 40, "bytes of a file that is read piece by piece, as exports and digests are")
    MAX_FILES = Limit(10_000, "files that a model names: textures, buffers, material libraries")
    MAX_TRIANGLES = Limit(20_000_000, "triangles of a model, all instances counted")
    MAX_BLENDER_TRIANGLES = Limit(10_000_000, "triangles that Blender makes of a file")
    MAX_LAYERS = Limit(1_000, "times that the surface of a model's triangles may be that of its box")
    MAX_VERTICES = Limit(60_000_000, "vertices while a model is read, and elements of a glTF accessor")
    MAX_INSTANCES = Limit(1_000_000, "instances of objects in a model's scene")
    MAX_NESTING = Limit(500, "nodes, objects or components within one another")
    MAX_ARCHIVE_BYTES = Limit(1 << 28, "bytes of a 3MF archive once it is unpacked")
    MAX_ZEROS = Limit(10_000_000, "elements of a glTF accessor without bytes in the file")
    MAX_TEXTURES = Limit(1_024, "textures of a model")
    MAX_PICTURE_PIXELS = Limit(100_000_000, "pixels of a texture, or of any other picture of a scene; 400 MB as RGBA")
    MAX_ALL_TEXTURE_PIXELS = Limit(1 << 29, "pixels of all textures of a model; 2 GiB as RGBA")
    MIN_SIZE = Limit(1e-4, "metres, the longest side of a model at least")
    MAX_SIZE = Limit(1e5, "metres, the longest side of a model at most")
    MAX_MODELS = Limit(100_000, "models that an entry of a recipe draws")
    MAX_ENTRIES = Limit(1_000_000, "files and folders that a folder or a pattern of `source` walks")
    MAX_RECIPE_VALUES = Limit(200_000, "values of a recipe: by aliases a few lines can stand for billions")
    MAX_RECIPE_BYTES = Limit(10_000_000, "bytes of a recipe, and of each that it extends")
    MAX_POSES_BYTES = Limit(1 << 30, "bytes of a file of poses")
    MAX_LISTED_OBJECTS = Limit(10_000, "objects of a shot in a file of shots")
    MAX_TABLE_BYTES = Limit(1 << 26, "bytes of a CSV file that a recipe or a model names: sizes, credits, points")
    MAX_PICTURE_BYTES = Limit(1 << 30, "bytes of a picture's file, of a scene or a data set")
    MAX_RIG_BYTES = Limit(1_000_000, "bytes of a rig's calibration")
    MAX_RECORD_BYTES = Limit(1 << 30, "bytes of a file that describes a data set, also an imported one, or a shot of it")
    MAX_STORED_PIXELS = Limit(1 << 28, "pixels of a picture or map of a data set, also of an imported one")
    MAX_ANNOTATION_BYTES = Limit(1 << 26, "bytes of a file of annotations of a data set that is imported, unpacked")
    MAX_MAT_ARRAYS = Limit(1_000_000, "arrays of a MATLAB file of a data set that is imported")
    MAX_IMPORTED_OBJECTS = Limit(10_000, "objects of an imported picture")
    MAX_VOXELS = Limit(100_000_000, "cells of the grid of a label voxels; 1 GB while it is computed")
    MAX_FETCHED_BYTES = Limit(10 << 30, "bytes of the folder of a recipe at a URL, which is copied to this machine")
    MAX_REMOTE_TRIES = Limit(5, "times that a URL is asked for the same, 0.2 seconds and then three times as long apart")
    CACHE_LIMIT = Limit(4 << 30, "bytes of the cache, whose entries that were used longest ago are deleted")
    MAX_REDRAWS = Limit(32, "draws of a frame, and of a scene with so many objects, until one fits; the first one included")
    MAX_REPAIRED_SHOTS = Limit(1_000_000, "shots that a repair renders because they are missing")


limits = Limits()
"""The limits of this process, such as `limits.MAX_TRIANGLES`."""


def table() -> dict[str, Limit[int] | Limit[float]]:
    """Return the limits by their names."""
    return {name: limit for name, limit in vars(Limits).items() if isinstance(limit, Limit)}
