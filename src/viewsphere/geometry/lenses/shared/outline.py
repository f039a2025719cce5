"""The box of triangles seen through any lens, for lenses without `bounds`: found by projecting points of the edges."""

from __future__ import annotations

from functools import lru_cache
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Flags = NDArray[np.bool_]
Bounds = tuple[float, float, float, float]

TOLERANCE = 1e-4
"""Pixels by which an edge may exceed the box before it is halved: ten times finer than box2d_projected's proof needs."""

HALVINGS = 40
"""Number of halvings of an edge that the lens shows in part; they locate its visible end to 1e-12 of its length."""

FEWEST = 4
"""Minimum number of halvings of an edge, into sixteenths; no lens bends a piece this short back and forth."""

MOST = 1 << 16
"""Maximum number of combinations of triangles and rim directions that are compared at once."""


class _Shows(Protocol):
    """The parts of `viewsphere.geometry.lenses.Lens` that the search uses."""

    @property
    def has_unit_rays(self) -> bool: ...
    def project(self, points: Float) -> tuple[Float, Flags]: ...
    def directions(self) -> Float: ...


def bounds(
    lens: _Shows, R: Float, t: Float, vertices: Float, is_used: Flags, triangles: NDArray[np.int32]
) -> tuple[Bounds | None, bool]:
    """The result of `viewsphere.geometry.lenses.Lens.bounds`.

    Edges are halved until they cannot leave the box. If the lens shows a triangle in part, or a triangle may surround the
    direction behind the camera, the box also includes the outermost pixels that show it.
    """
    points = vertices @ R.T + t
    corners, shown = lens.project(points)
    whole = bool(shown[is_used].all())
    box = _grown((np.inf, np.inf, -np.inf, -np.inf), corners[is_used & shown])
    edges = np.unique(np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])), axis=0)
    box, are_whole = _followed(lens, box, points[edges], corners[edges])
    whole = whole and are_whole
    if not whole or (lens.has_unit_rays and (points[is_used, 2] < 0).any()):
        box = _grown(box, _rim_inside(lens, points[triangles]))
    return (box if box[0] <= box[2] else None), whole


def _grown(box: Bounds, pixels: Float) -> Bounds:
    if not len(pixels):
        return box
    (x0, y0), (x1, y1) = pixels.min(axis=0).tolist(), pixels.max(axis=0).tolist()
    return min(box[0], x0), min(box[1], y0), max(box[2], x1), max(box[3], y1)


def _followed(lens: _Shows, box: Bounds, ends: Float, pixels: Float) -> tuple[Bounds, bool]:
    """The box grown by edges (n, 2, 3) whose ends have the given positions, and whether the lens shows all of them."""
    whole = True
    for depth in range(HALVINGS):
        middle = ends.mean(axis=1)
        seen, shown = lens.project(middle)
        box, whole = _grown(box, seen[shown]), whole and bool(shown.all())
        states = np.column_stack((~np.isnan(pixels[:, :, 0]), shown))
        out = np.abs(2 * seen - pixels.sum(axis=1))[:, None]  # twice as far as the edge bends at its middle
        reach = np.concatenate((pixels - out, pixels + out), axis=1)
        with np.errstate(invalid="ignore"):
            leaves = (reach < np.array(box[:2]) - TOLERANCE) | (reach > np.array(box[2:]) + TOLERANCE)
        is_split = np.where(states.all(axis=1), leaves.any(axis=(1, 2)), states.any(axis=1))
        if depth < FEWEST:
            is_split[:] = True
        if not is_split.any():
            break
        first = np.stack((ends[is_split, 0], middle[is_split]), axis=1)
        second = np.stack((middle[is_split], ends[is_split, 1]), axis=1)
        ends = np.concatenate((first, second))
        at = seen[is_split]
        pixels = np.concatenate((np.stack((pixels[is_split, 0], at), axis=1), np.stack((at, pixels[is_split, 1]), axis=1)))
    return box, whole


@lru_cache(maxsize=16)
def _rim(lens: _Shows) -> tuple[Float, Float]:
    """The rays (M, 3) of the outermost pixels with a ray in each row and column of the picture, and their centres (M, 2)."""
    directions = lens.directions()
    has_ray: Flags = ~np.isnan(directions[..., 0])
    rows, columns = np.flatnonzero(has_ray.any(axis=1)), np.flatnonzero(has_ray.any(axis=0))
    first, last = has_ray.argmax(axis=1)[rows], has_ray.shape[1] - 1 - has_ray[:, ::-1].argmax(axis=1)[rows]
    top, bottom = has_ray.argmax(axis=0)[columns], has_ray.shape[0] - 1 - has_ray[::-1].argmax(axis=0)[columns]
    down, across = np.concatenate((rows, rows, top, bottom)), np.concatenate((first, last, columns, columns))
    return directions[down, across], np.stack((across, down), axis=-1) + np.float64(0.5)


def _rim_inside(lens: _Shows, triangles: Float) -> Float:
    """The positions of those `_rim` pixels whose rays hit one of the triangles (n, 3, 3) in camera axes."""
    rim, centres = _rim(lens)
    meets = np.zeros(len(rim), np.bool_)
    step = max(MOST // max(len(rim), 1), 1)
    for begin in range(0, len(triangles), step):
        a, b, c = triangles[begin : begin + step].transpose(1, 0, 2)
        volumes = np.stack([np.cross(p, q) @ rim.T for p, q in ((b, c), (c, a), (a, b))])
        whole = np.einsum("ni,ni->n", a, np.cross(b, c))[:, None]
        meets |= ((volumes * np.sign(whole) >= 0).all(axis=0) & (whole != 0)).any(axis=0)
    return centres[meets]
