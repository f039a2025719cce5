"""Points drawn at random on the surfaces of things."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from viewsphere.truth.raster.alpha_masks import NEVER
from viewsphere.truth.surface_points.points import SurfacePoints
from viewsphere.truth.view import View

Float = NDArray[np.float64]
Drawn = tuple[NDArray[np.int64], Float]
"""Triangles (n,) and barycentrics (n, 3) of points."""

ROUNDS = 100
"""Maximum number of rounds of drawing points until enough are on surface rather than in gaps of cut-outs."""


def points_on(view: View, count: int, rng: np.random.Generator, things: Sequence[int] | None = None) -> SurfacePoints:
    """Points drawn uniformly, by area, on the surfaces of a view's things; by default, on all objects that are present.

    Raises ValueError if these have no surface, or almost none.
    """
    triangles = _triangles(view, range(view.geometry.object_count) if things is None else things)
    picked, weights = _evenly(view, triangles, view.geometry.vertices, count, rng)
    if len(picked) < count:
        found = f"{len(picked)} of {count * ROUNDS} points on it" if len(picked) else "none"
        raise ValueError(f"points_on: expected things that have a surface, found {found}")
    thing = view.owners[picked]
    triangle = (picked - np.array(view.geometry.triangle_start)[thing]).astype(np.int32)
    return SurfacePoints.from_weights(view, thing, triangle, weights, np.zeros((count, 3)))


def points_on_model(view: View, i: int, count: int) -> Drawn:
    """Points drawn uniformly on the model of thing i, by area in its own axes: the same at any pose, and on all instances.
    Triangle numbers count from the thing's first. None if it has no surface, or almost none.
    """
    triangles = _triangles(view, [i])
    picked, weights = _evenly(view, triangles, view.geometry.coordinates, count, np.random.default_rng(0))
    if len(picked) < count:
        return np.zeros(0, np.int64), np.zeros((0, 3))
    return picked - view.geometry.triangle_start[i], weights


def _triangles(view: View, things: Sequence[int]) -> NDArray[np.int64]:
    """Return the triangles of things that may be visible."""
    geometry = view.geometry
    spans = [np.arange(geometry.triangle_start[i], geometry.triangle_start[i + 1]) for i in things]
    triangles = np.concatenate([np.zeros(0, np.int64), *spans])
    return triangles[geometry.triangle_cutout[triangles] != NEVER]


def _evenly(
    view: View, triangles: NDArray[np.int64], places: NDArray[np.floating], count: int, rng: np.random.Generator
) -> Drawn:
    """`count` points on triangles whose vertices are at these places; fewer if the triangles have no surface,
    or almost none.
    """
    picked, weights = np.zeros(0, np.int64), np.zeros((0, 3))
    corners = places[view.geometry.triangles[triangles]].astype(np.float64)
    x, y, z = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).T
    total = np.cumsum(np.sqrt(x * x + y * y + z * z))
    if not len(total) or total[-1] <= 0.0:
        return picked, weights
    for _ in range(ROUNDS):
        drawn, barycentrics = _drawn(triangles, total, count, rng)
        is_surface = _is_surface(view, drawn, barycentrics)
        picked = np.concatenate((picked, drawn[is_surface]))[:count]
        weights = np.concatenate((weights, barycentrics[is_surface]))[:count]
        if len(picked) == count:
            break
    return picked, weights


def _drawn(triangles: NDArray[np.int64], total: Float, count: int, rng: np.random.Generator) -> Drawn:
    """Points on triangles with these cumulative areas (Turk 1990, "Generating random points in triangles")."""
    at = np.searchsorted(total, rng.random(count) * total[-1], side="right")
    root, share = np.sqrt(rng.random(count)), rng.random(count)
    weights = np.column_stack((1.0 - root, root * (1.0 - share), root * share))
    return triangles[np.minimum(at, len(total) - 1)], weights


def _is_surface(view: View, triangles: NDArray[np.int64], weights: Float) -> NDArray[np.bool_]:
    from viewsphere.truth.surface_points import kernels_attached as kernels

    out = np.empty(len(triangles), np.bool_)
    kernels.on_surface(triangles, weights, view.geometry.triangle_cutout, view.geometry.alpha_masks.arrays, out)
    return out
