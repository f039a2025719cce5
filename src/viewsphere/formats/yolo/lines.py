"""Lines of labels, and the meaning of their numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import StoreError

Float = NDArray[np.float64]

BEYOND = 0.01
"""Share of the picture by which labels may extend beyond it, as in Ultralytics."""

MOST_POINTS = 1000


@dataclass(frozen=True)
class Kind:
    """The properties of points in data.yaml: their names (or numbers if it has no names), and their swaps in a mirror image.
    `each` point has 2 numbers, x and y, or 3, with its visibility.
    """

    names: tuple[str, ...] = ()
    each: int = 3
    flips: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class Row:
    """A line: class, and, as shares of the picture, box (centre x, y, width, height), polygon (N, 2), points (N, 3)."""

    number: int
    box: tuple[float, float, float, float] | None = None
    corners: Float | None = None
    points: Float | None = None


def kind_of(told: Mapping[str, Any], file: Path) -> Kind:
    """Return the properties of points in a data.yaml; raises StoreError for invalid ones."""
    shape, flips, names = told.get("kpt_shape"), told.get("flip_idx") or [], told.get("kpt_names") or {}
    if shape is None:
        return Kind()
    if not (_whole(shape) and len(shape) == 2 and 0 < shape[0] <= MOST_POINTS and shape[1] in (2, 3)):
        raise StoreError(f"{file}: expected kpt_shape [number, 2 or 3]; found {shape!r:.60}")
    if flips and not (_whole(flips) and sorted(flips) == list(range(shape[0]))):
        raise StoreError(f"{file}: expected flip_idx, every point's number once; found {flips!r:.60}")
    named = cast(dict[Any, Any], names) if isinstance(names, dict) else {}
    known = {tuple(map(str, own)) for own in named.values() if isinstance(own, list)}
    if not all(len({*own}) == shape[0] for own in known):
        raise StoreError(f"{file}: expected kpt_names, {shape[0]} different names for each class; found {names!r:.60}")
    numbered = tuple(map(str, range(shape[0])))
    return Kind(known.pop() if len(known) == 1 else numbered, shape[1], tuple(flips))


def _whole(values: Any) -> bool:
    return isinstance(values, list) and all(type(value) is int for value in cast(list[Any], values))


def parsed_line(text: str, kind: Kind, classes: int) -> Row:
    """Return the row of a line; raises ValueError for an invalid line."""
    try:
        number, *values = map(float, text.split())
    except ValueError:
        raise ValueError(f"expected numbers; found {text!r:.60}") from None
    if number not in range(classes):
        raise ValueError(f"expected a class from 0 to {classes - 1}; found {text.split(maxsplit=1)[0]!r:.60}")
    found = np.array(values)
    if not np.isfinite(found).all():
        raise ValueError(f"expected finite numbers; found {text!r:.60}")
    row = _row(int(number), found, kind)
    for shares in (np.array(row.box or ()), row.corners, None if row.points is None else row.points[:, :2]):
        if shares is not None and not ((shares >= -BEYOND) & (shares <= 1 + BEYOND)).all():
            raise ValueError(f"expected shares of the picture, 0 to 1; found {text!r:.60}")
    return row


def _row(number: int, values: Float, kind: Kind) -> Row:
    count, pointed = len(values), 4 + len(kind.names) * kind.each
    if count == 4 or (kind.names and count == pointed):
        x, y, width, height = values[:4].tolist()
        if width < 0 or height < 0:
            raise ValueError(f"expected a width and a height from 0 on; found {width:g}, {height:g}")
        points = values[4:].reshape(-1, kind.each) if count > 4 else None
        if points is not None and kind.each == 2:
            seen = np.where(points.any(axis=1), 2.0, 0.0)
            points = np.column_stack([points, seen])
        if points is not None and not np.isin(points[:, 2], (0, 1, 2)).all():
            raise ValueError(f"expected points that are 0, 1 or 2; found {points[:, 2].tolist()!r:.60}")
        return Row(number, (x, y, width, height), None, points)
    if kind.names:
        raise ValueError(f"expected a class and 4 or {pointed} numbers; found {count}")
    if count < 6 or count % 2:
        raise ValueError(f"expected a class and 4 numbers, or x and y of three corners or more; found {count} numbers")
    return Row(number, None, values.reshape(-1, 2))


def coco_of(row: Row, size: tuple[int, int]) -> dict[str, Any]:
    """A line as COCO's annotation, in pixels."""
    if row.corners is not None:
        corners = row.corners * size
        (x0, y0), (x1, y1) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
        turned = np.roll(corners, -1, axis=0)
        area = abs(float((corners[:, 0] * turned[:, 1] - corners[:, 1] * turned[:, 0]).sum())) / 2
        return {"bbox": [x0, y0, x1 - x0, y1 - y0], "area": area, "segmentation": [corners.ravel().tolist()]}
    assert row.box is not None
    x, y, width, height = (share * side for share, side in zip(row.box, size * 2, strict=True))
    said: dict[str, Any] = {"bbox": [x - width / 2, y - height / 2, width, height], "area": width * height}
    if row.points is not None:
        places = np.where(row.points[:, 2:] > 0, row.points[:, :2] * size - 0.5, 0.0)  # of pixels' centres, as in COCO
        marked = zip(places.tolist(), row.points[:, 2].tolist(), strict=True)
        said["keypoints"] = [number for (x, y), seen in marked for number in (x, y, int(seen))]
        said["num_keypoints"] = int((row.points[:, 2] > 0).sum())
    return said
