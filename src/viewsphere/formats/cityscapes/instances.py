"""Cityscapes' instances: their numbers, and the polygons from which Pillow draws them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from viewsphere.formats.cityscapes.classes import INSTANCES
from viewsphere.formats.shared.writing.polygons import one_ring
from viewsphere.geometry.mask import mask_polygons

Ring = NDArray[np.int64]

EACH = 1000
"""Factor of a label's id in the ids of its instances."""

INSIDE = {(1, 0): (0, 0), (0, 1): (-1, 0), (-1, 0): (-1, -1), (0, -1): (0, -1)}
"""Offset, for each step of a clockwise ring, from the corner where it begins to the inner pixel on its right."""


class Region(NamedTuple):
    """A region drawn in one go: label id, number in the instance map, mask (H, W), and rings (N, 2) in pixels."""

    label: int
    number: int
    mask: NDArray[np.bool_]
    rings: list[Ring]


def regions(labels: NDArray[np.uint8], instances: NDArray[np.integer]) -> list[Region]:
    """Return every region of a picture, in the order of drawing, from maps (H, W) of labels' ids and of objects' ids.

    Instances in several pieces come first. A line from piece to piece is drawn with them, and later regions are drawn over it.
    So an instance's number follows from its place in this order, as in Cityscapes' own tools.
    """
    apart = np.where(np.isin(labels, INSTANCES), instances, 0)
    found = [(int(labels[mask][0]), mask, _rings(mask)) for mask in (apart == i for i in np.unique(apart[apart > 0]))]
    counts: dict[int, int] = {}
    drawn: list[Region] = []
    for label, mask, rings in sorted(found, key=lambda one: len(one[2]) == 1):
        number = counts[label] = counts.get(label, -1) + 1
        whole = np.rint(one_ring([ring.ravel().tolist() for ring in rings])).astype(np.int64)
        drawn.append(Region(label, EACH * label + number, mask, [whole]))
    return drawn + list(_rest(labels, apart))


def _rest(labels: NDArray[np.uint8], apart: NDArray[np.integer]) -> Iterator[Region]:
    """Regions of labels without instances."""
    for label in np.unique(labels[apart == 0]).tolist():
        mask = (labels == label) & (apart == 0)
        yield Region(label, label, mask, _rings(mask))


def _rings(mask: NDArray[np.bool_]) -> list[Ring]:
    """The rings (N, 2) of a mask's pixels, column and row. Pillow's polygons of these rings, outlines included, reproduce the
    mask.
    """
    return [_pixels(np.array(polygon).reshape(-1, 2).astype(np.int64)) for polygon in mask_polygons(mask)]


def _pixels(corners: Ring) -> Ring:
    """The pixels along the inside of a clockwise ring of corners (N, 2), without the inner ones of straight lines."""
    moves = np.roll(corners, -1, axis=0) - corners
    lengths = np.abs(moves).sum(axis=1)
    steps = np.sign(moves)
    first = np.repeat(np.cumsum(lengths) - lengths, lengths)
    begins = (
        np.repeat(corners, lengths, axis=0) + np.repeat(steps, lengths, axis=0) * (np.arange(lengths.sum()) - first)[:, None]
    )
    inside = np.array([INSIDE[x, y] for x, y in steps.tolist()])
    path = begins + np.repeat(inside, lengths, axis=0)
    path = path[(path != np.roll(path, 1, axis=0)).any(axis=1)] if (path != path[0]).any() else path[:1]
    came, goes = path - np.roll(path, 1, axis=0), np.roll(path, -1, axis=0) - path
    turns = path[(came != goes).any(axis=1)] if len(path) > 2 else path
    return np.concatenate([turns, np.repeat(turns[-1:], max(0, 3 - len(turns)), axis=0)])
