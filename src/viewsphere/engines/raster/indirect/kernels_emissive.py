"""Light of emissive surfaces at probes and at the ground's map.

Few or none of a probe's rays hit a small lamp, so a distant lamp is sampled by points distributed over it. Nearby, the rays
that hit it are more accurate. The apparent size of the part that a point represents selects between the two, so that each part
counts once.
"""

from __future__ import annotations

import numba as nb
import numpy as np

from viewsphere.engines.raster.indirect.kernels_views import add_view
from viewsphere.engines.raster.reflections.kernels_trace import DEEP, nearest
from viewsphere.kernels.jit import inner, njit

f4 = nb.float32
U = nb.uintp
# Columns of an emissive triangle's points: its place, its normal, radiance times the area it represents, the square of the
# distance beyond which it counts.
POINT_X, NORMAL_X, POWER_R, FROM, POINT_COLUMNS = 0, 3, 6, 9, 10


@inner
def shine_from(tree, point, p, off, stack):
    """The direction to a point of an emissive triangle, and the factor of its power; 0 if the point is hidden or near."""
    d = point[POINT_X] - p[0], point[POINT_X + 1] - p[1], point[POINT_X + 2] - p[2]
    squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
    along = d[0] * point[NORMAL_X] + d[1] * point[NORMAL_X + 1] + d[2] * point[NORMAL_X + 2]
    if squared <= point[FROM] or along == f4(0):
        return d, f4(0)
    # Slightly off the visible side, so that the point's own surface hides nothing.
    side = -off if along > f4(0) else off
    way = (
        d[0] + side * point[NORMAL_X],
        d[1] + side * point[NORMAL_X + 1],
        d[2] + side * point[NORMAL_X + 2],
    )
    found, _ = nearest(tree, p, way, f4(1), True, stack)
    if found >= 0:
        return d, f4(0)
    per = f4(1) / np.sqrt(squared)
    return (d[0] * per, d[1] * per, d[2] * per), abs(along) * per / squared


@njit(_nrt=True)
def shine_at_probes(tree, places, turn, own, turns, points, squares, off, per, fold, light, views):
    """Add to rows `own` (N,) of light (N, 28) and views (N, NODES, 4) the light that arrives at probes (N, 3) from every
    `turns`-th of the points (J, POINT_COLUMNS), beginning with the point of the probe's turn.

    squares (9,): factors of the terms of irradiance / pi; per: a ray's share of the sphere; fold: see `kernels_views`.
    """
    stack = np.empty((DEEP, 2), np.float32)
    for i in range(places.shape[0]):
        p, at = (places[i, 0], places[i, 1], places[i, 2]), own[i]
        for j in range(turn[i], points.shape[0], turns):
            (x, y, z), factor = shine_from(tree, points[j], p, off, stack)
            if factor <= f4(0):
                continue
            t = (f4(1), y, z, x, x * y, y * z, f4(3) * z * z - f4(1), x * z, x * x - y * y)
            for c in range(3):
                power = points[j, POWER_R + c] * factor
                for k in range(9):
                    light[at, 3 * k + c] += power * squares[k] * t[k]
            q = points[j, POWER_R : POWER_R + 3]
            add_view(views[at], fold, x, y, z, q[0] * factor / per, q[1] * factor / per, q[2] * factor / per, f4(0))


@njit
def shine_near(ids, far, turn, own, weights, directions, froms, emitted, fold, light, views):
    """Add to light (N, 28) and views (N, NODES, 4) the light that arrives along rays that hit nearby emissive triangles.

    froms (M,): the square of the distance from which points represent a patch, 0 for patches that are not emissive; emitted (M,
    3); the others as in `kernels_probes.send` and `kernels_views`.
    """
    for k in range(ids.shape[0]):
        for i in range(ids.shape[1]):
            met = ids[k, i]
            if met < 0 or not far[k, i] * far[k, i] <= froms[met]:
                continue
            at, which = own[i], turn[i]
            x, y, z = directions[which, k, 0], directions[which, k, 1], directions[which, k, 2]
            for c in range(3):
                for j in range(9):
                    light[at, 3 * j + c] += weights[which, k, j] * emitted[met, c]
            add_view(views[at], fold, x, y, z, emitted[met, 0], emitted[met, 1], emitted[met, 2], f4(0))


@njit(_nrt=True)
def shine_at(tree, places, normals, step, share, points, ids, far, froms, emitted, off, light):
    """Add to light (N, 3 or more) the radiance of white matt surfaces at places (N, 3), lit by emissive triangles: by every
    `step`-th point, with weight `share`, and by cosine-weighted rays (K, N).
    """
    stack = np.empty((DEEP, 2), np.float32)
    per = f4(1) / f4(ids.shape[0])
    for i in range(places.shape[0]):
        p = places[i, 0], places[i, 1], places[i, 2]
        for j in range(i % step, points.shape[0], step):
            d, factor = shine_from(tree, points[j], p, off, stack)
            along = d[0] * normals[i, 0] + d[1] * normals[i, 1] + d[2] * normals[i, 2]
            if along > f4(0) and factor > f4(0):
                for c in range(3):
                    light[i, c] += points[j, POWER_R + c] * factor * along * share * f4(1 / np.pi)
        for k in range(ids.shape[0]):
            met = ids[k, i]
            if met >= 0 and far[k, i] * far[k, i] <= froms[met]:
                for c in range(3):
                    light[i, c] += emitted[met, c] * per
