"""Maps of objects and of classes in PASCAL VOC's form, which PASCAL3D+ and others also use."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from viewsphere.codecs.palette import palette
from viewsphere.codecs.size import opened
from viewsphere.errors import StoreError
from viewsphere.model.sample import Box

VOID = 255
"""The number of unlabelled (void) pixels."""

ALIKE = 0.5
"""Least overlap, intersection over union, of an object's box and the box around its pixels."""

Numbers = NDArray[np.uint8]


def check_map(file: Path, size: tuple[int, int]) -> None:
    """Raise StoreError for a map whose size is not (width, height), or whose pixels are neither numbers nor colours."""
    with opened(file) as found:
        if found.size != size or found.mode not in ("P", "L", "RGB"):
            raise StoreError(f"expected objects' numbers in {file.name}, of the picture's size; found other pixels")


def numbers_of(file: Path) -> Numbers:
    """The numbers of a map, (H, W) uint8; colours, which datumaro writes, are looked up in VOC's palette, and other colours
    are void.
    """
    with opened(file) as found:
        pixels = np.array(found)
    if pixels.ndim == 2:
        return pixels.astype(np.uint8)
    weights = np.array([1 << 16, 1 << 8, 1])
    table = dict(zip((palette() @ weights).tolist(), range(VOID), strict=False))
    colors, inverse = np.unique(pixels[..., :3] @ weights, return_inverse=True)
    return np.array([table.get(color, VOID) for color in colors.tolist()], np.uint8)[inverse].reshape(pixels.shape[:2])


def boxes_of(numbers: Numbers) -> dict[int, Box]:
    """The half-open box around the pixels of each object, by its number."""
    found: dict[int, Box] = {}
    for number in np.unique(numbers).tolist():
        if number not in (0, VOID):
            mask = numbers == number
            (rows,), (columns,) = np.nonzero(mask.any(axis=1)), np.nonzero(mask.any(axis=0))
            found[number] = (float(columns[0]), float(rows[0]), float(columns[-1] + 1), float(rows[-1] + 1))
    return found


def numbered(said: Sequence[tuple[int, Box]], found: Mapping[int, Box]) -> list[int]:
    """The number of each object in the map, 0 if none, by its place in the annotation and its box. In VOC the numbers are the
    places. datumaro counts only objects with pixels; then the boxes decide.
    """
    sure = {i: place for i, (place, box) in enumerate(said) if place in found and overlap(box, found[place]) >= ALIKE}
    for i, (_, box) in enumerate(said):
        left = [number for number in found if number not in sure.values()]
        best = max(left, key=lambda number: overlap(box, found[number]), default=0)
        if i not in sure and best and overlap(box, found[best]) >= ALIKE:
            sure[i] = best
    unsure = {i: place for i, (place, _) in enumerate(said) if place in found and place not in sure.values()}
    return [sure.get(i, unsure.get(i, 0)) for i in range(len(said))]


def unannotated(objects: Numbers, classes: Numbers, names: Sequence[str]) -> Iterator[tuple[int, str, Box]]:
    """Number, category and box of each object of a picture without an annotation; the class of most of its pixels is its
    category. Raises ValueError for a class without a name.
    """
    for number, box in boxes_of(objects).items():
        most = int(np.bincount(classes[objects == number]).argmax())
        if not 1 <= most <= len(names):
            raise ValueError(f"expected a class of labelmap.txt, 1 to {len(names)}, of object {number}; found {most}")
        yield number, names[most - 1], box


def overlap(one: Box, other: Box) -> float:
    """The boxes' intersection over union."""
    width, height = (min(one[i + 2], other[i + 2]) - max(one[i], other[i]) for i in (0, 1))
    inside = max(0.0, width) * max(0.0, height)
    areas = sum((x1 - x0) * (y1 - y0) for x0, y0, x1, y1 in (one, other))
    return inside / (areas - inside) if areas > inside else 0.0
