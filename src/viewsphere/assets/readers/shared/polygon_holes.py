"""Conversion of polygons with holes to polygons without: a cut, traversed twice, joins each hole to the outline."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.primitive import Float, Int
from viewsphere.assets.readers.shared.polygon import flattened


def without_holes(points: Float, rings: Sequence[Int]) -> Int:
    """One ring (N,) of the corners of an outline, the first of `rings`, and of its holes; `points` (P, 3) are the corners'
    positions.

    The first and the last corner of each cut appear twice. Holes may have either orientation. If the outline has no area, no
    hole is joined.
    """
    outline, holes = rings[0], [ring for ring in rings[1:] if len(ring) > 2]
    local = points[outline] - points[outline[0]]
    normal = np.cross(local, np.roll(local, -1, axis=0)).sum(axis=0)
    flat = flattened(points[np.concatenate([outline, *holes])], normal)
    if flat is None or not holes:
        return outline
    ends = np.cumsum([len(outline), *map(len, holes)])
    places = [_clockwise(flat, np.arange(start, end)) for start, end in pairwise(ends.tolist())]
    places.sort(key=lambda ring: -float(flat[ring, 0].max()))
    ring = np.arange(len(outline))
    for i, hole in enumerate(places):
        ring = _joined(flat, ring, hole, places[i:])
    return np.concatenate([outline, *holes])[ring]


def _clockwise(flat: Float, ring: Int) -> Int:
    x, y = flat[ring].T
    return ring[::-1] if (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() > 0 else ring


def _joined(flat: Float, ring: Int, hole: Int, holes: Sequence[Int]) -> Int:
    """The ring with the hole: cut from the hole's corner of the largest x to the nearest visible corner."""
    hole = np.roll(hole, -int(np.argmax(flat[hole, 0])))
    start = flat[hole[0]]
    starts = np.concatenate([ring, *holes])
    ends = np.concatenate([np.roll(part, -1) for part in (ring, *holes)])
    nearest = np.argsort(((flat[ring] - start) ** 2).sum(axis=1), kind="stable")
    edges = flat[starts], flat[ends]
    seen = (i for i in nearest.tolist() if _opens_to(flat, ring, i, start) and not _is_cut(start, flat[ring[i]], *edges))
    at = next(seen, int(nearest[0]))
    return np.concatenate([ring[: at + 1], hole, hole[:1], ring[at:]])


def _opens_to(flat: Float, ring: Int, i: int, point: Float) -> bool:
    """Return whether a point is within the angle at a corner of a counter-clockwise ring."""
    before, corner, after = (flat[ring[k % len(ring)]] for k in (i - 1, i, i + 1))
    sides = _turn(before, corner, point) > 0, _turn(corner, after, point) > 0
    return bool(all(sides) if _turn(before, corner, after) >= 0 else any(sides))


def _is_cut(start: Float, end: Float, firsts: Float, seconds: Float) -> bool:
    """Return whether the line from start to end meets any edge that does not share an endpoint with it."""
    apart = _turn(start, end, firsts) * _turn(start, end, seconds) <= 0
    across = _turn(firsts, seconds, start) * _turn(firsts, seconds, end) <= 0
    shared: NDArray[np.bool_] = np.zeros(len(firsts), bool)
    for point in (start, end):
        for others in (firsts, seconds):
            shared |= (others == point).all(axis=1)
    return bool((apart & across & ~shared).any())


def _turn(a: Float, b: Float, c: Float) -> Float:
    """Twice the signed area of the triangles a b c."""
    return (b[..., 0] - a[..., 0]) * (c[..., 1] - b[..., 1]) - (b[..., 1] - a[..., 1]) * (c[..., 0] - b[..., 0])
