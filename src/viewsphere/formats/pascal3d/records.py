"""Records of PASCAL3D+'s annotations from other sources."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from viewsphere.codecs.mat import Struct, read_mat
from viewsphere.files import read_bytes
from viewsphere.geometry.rotation import quaternion_from_matrix
from viewsphere.limits import limits
from viewsphere.model.sample import Box

Float = NDArray[np.float64]

FARTHEST = 1e6
"""Limit of all numbers of an annotation: pixels, degrees or lengths."""

MOST_ID = 10**6
"""Largest id in an imported record; larger ones are mistakes."""
FLAGS = ("truncated", "occluded", "difficult")
VIEW = ("azimuth", "elevation", "theta", "distance", "focal", "viewport", "px", "py")
COARSE = ("azimuth_coarse", "elevation_coarse")


@dataclass(frozen=True)
class Seen:
    """An object of a record: the record's file, and its place there from 1; its half-open box; the number of its CAD model
    from 1, 0 without one; the given values of its viewpoint; flags; anchors, each with its position (None if unknown) and its
    status. In viewsphere's own files also its id and RT (3, 4), None elsewhere.
    """

    file: Path
    place: int
    kind: str
    box: Box
    cad: int
    view: Mapping[str, float]
    flags: Mapping[str, int]
    anchors: Mapping[str, tuple[tuple[float, float] | None, int]]
    id: int | None
    motion: Float | None

    @property
    def is_fine(self) -> bool:
        """Return whether the object's viewpoint is more than a coarse one."""
        return self.view.get("distance", 0.0) > 0


@dataclass(frozen=True)
class Record:
    """A picture's objects, the problems of invalid ones, and, in viewsphere's own files, K (3, 3) in pixels from the picture's
    corner. Its file's name and its size (width, height) are None if not given.
    """

    objects: Sequence[Seen]
    problems: Sequence[str]
    lens: Float | None
    filename: str | None
    size: tuple[int, int] | None


def variables(file: Path) -> dict[str, Any]:
    """The variables of a file. Raises ValueError for anything but a MATLAB file, StoreError for a file that is too large."""
    return read_mat(read_bytes(file, "MAX_ANNOTATION_BYTES"), limits.MAX_ANNOTATION_BYTES)


def structs_of(value: Any, what: str) -> Struct:
    """A struct array; raises ValueError for anything else."""
    if isinstance(value, np.ndarray) and not value.size:
        return []
    rows = cast(list[Any], value) if isinstance(value, list) else [None]
    if not all(isinstance(row, dict) for row in rows):
        raise ValueError(f"expected {what}; found another")
    return cast(Struct, rows)


def read_record(file: Path) -> Record:
    """A picture's record. Raises ValueError if there is none, or if it has too many objects."""
    found = variables(file)
    if "record" not in found:
        raise ValueError("expected a struct `record`; found none")
    rows = structs_of(found["record"], "a struct `record`")
    if len(rows) != 1:
        raise ValueError(f"expected one struct `record`; found {len(rows)}")
    said = structs_of(rows[0].get("objects", np.zeros(0)), "a struct array `record.objects`")
    if len(said) > limits.MAX_IMPORTED_OBJECTS:
        told = f"{limits.MAX_IMPORTED_OBJECTS:,} objects (limit MAX_IMPORTED_OBJECTS)"
        raise ValueError(f"expected at most {told}; found {len(said):,}")
    objects, problems = list[Seen](), list[str]()
    for place, one in enumerate(said, 1):
        try:
            objects.append(_seen(file, place, one))
        except ValueError as error:
            problems.append(f"{file}: object {place}: {error}")
    name, lens = rows[0].get("filename"), _lens(rows[0]["K"]) if "K" in rows[0] else None
    return Record(objects, problems, lens, name if isinstance(name, str) and name else None, _size(rows[0].get("imgsize")))


def _size(value: Any) -> tuple[int, int] | None:
    """The width and height at the start of a record's size; None if there are none."""
    if _is_nothing(value):
        return None
    if not isinstance(value, np.ndarray) or value.size < 2:
        raise ValueError("expected imgsize width height; found another")
    width, height = _numbers(value.ravel()[:2], "imgsize", 2).tolist()
    if not (width >= 1 and height >= 1 and width == int(width) and height == int(height)):
        raise ValueError(f"expected imgsize of whole pixels; found {width:g} {height:g}")
    return int(width), int(height)


def _seen(file: Path, place: int, said: Mapping[str, Any]) -> Seen:
    kind = said.get("class")
    if not isinstance(kind, str) or not kind or not kind.isprintable():
        raise ValueError(f"expected a class; found {kind!r:.60}")
    x0, y0, x1, y1 = _numbers(said.get("bbox"), "bbox", 4).tolist()
    if not (x0 <= x1 and y0 <= y1):
        raise ValueError(f"expected bbox x1 y1 x2 y2; found {x0:g} {y0:g} {x1:g} {y1:g}")
    cad, own = _whole(said, "cad_index", MOST_ID), _whole(said, "id", MOST_ID)
    flags = {name: value for name in FLAGS if (value := _whole(said, name, 1)) is not None}
    motion = said.get("RT")
    return Seen(
        file=file,
        place=place,
        kind=kind,
        box=(x0 - 1, y0 - 1, x1, y1),
        cad=cad or 0,
        view=_view(said.get("viewpoint")),
        flags=flags,
        anchors=_anchors(said.get("anchors")),
        id=own or None,
        motion=None if _is_nothing(motion) else _rigid(motion),
    )


def _is_nothing(value: Any) -> bool:
    """Return whether a field is missing or []."""
    return value is None or (isinstance(value, np.ndarray) and not value.size)


def _numbers(value: Any, name: str, count: int) -> Float:
    if not isinstance(value, np.ndarray) or value.size != count or not (np.abs(value.astype(np.float64)) < FARTHEST).all():
        raise ValueError(f"expected {name}, {'a number' if count == 1 else f'{count} numbers'} below {FARTHEST:,.0f}")
    return value.astype(np.float64).ravel(order="F")


def _whole(said: Mapping[str, Any], name: str, most: int) -> int | None:
    """A whole number of at least 0; None if it is missing."""
    if _is_nothing(said.get(name)):
        return None
    number = float(_numbers(said[name], name, 1)[0])
    if not (0 <= number <= most and number == int(number)):
        raise ValueError(f"expected {name} 0 to {most:,}; found {number:g}")
    return int(number)


def _view(value: Any) -> dict[str, float]:
    """Return the numbers of a viewpoint by name; empty without a viewpoint."""
    rows = structs_of(np.zeros(0) if value is None else value, "a struct `viewpoint`")
    if not rows:
        return {}
    said = {name: float(_numbers(rows[0][name], name, 1)[0]) for name in (*VIEW, *COARSE) if not _is_nothing(rows[0].get(name))}
    if said.get("distance", 0.0) > 0:
        lacking = next((name for name in VIEW if name not in said), None)
        if lacking or said["focal"] * said["viewport"] <= 0:
            raise ValueError(f"expected a viewpoint with {', '.join(VIEW)}; found no {lacking or 'focal length'}")
    return said


def _anchors(value: Any) -> dict[str, tuple[tuple[float, float] | None, int]]:
    rows = structs_of(np.zeros(0) if value is None else value, "a struct `anchors`")
    found: dict[str, tuple[tuple[float, float] | None, int]] = {}
    for name, one in rows[0].items() if rows else ():
        said = structs_of(one, f"a struct `anchors.{name:.60}`")
        for anchor in said[:1]:
            place = anchor.get("location")
            x_y = None if _is_nothing(place) else tuple(_numbers(place, f"location of {name:.60}", 2).tolist())
            found[name] = cast("tuple[float, float] | None", x_y), _whole(anchor, "status", 9) or 0
    return found


def _lens(value: Any) -> Float:
    """K with the picture's corner as origin, from a K with the first pixel's centre at (1, 1)."""
    k = _numbers(value, "record.K", 9).reshape(3, 3, order="F").copy()
    if not (k[0, 0] > 0 and k[1, 1] > 0 and k[1, 0] == 0 and (k[2] == (0, 0, 1)).all()):
        raise ValueError("expected record.K of a pinhole; found another")
    k[:2, 2] -= 0.5
    return k


def _rigid(value: Any) -> Float:
    found = _numbers(value, "RT", 12).reshape(3, 4, order="F")
    quaternion_from_matrix(found[:, :3])
    return found
