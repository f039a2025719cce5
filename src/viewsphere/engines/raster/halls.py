"""Which things of a scene throw light at one another."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Literal

import numpy as np

from viewsphere.engines._arranged import Arranged
from viewsphere.engines.raster.bounces import Hall
from viewsphere.engines.raster.kernels_material import L_CASTS_FROM
from viewsphere.engines.raster.lights import Casters
from viewsphere.engines.raster.records import Float32
from viewsphere.engines.raster.surface import Lengths
from viewsphere.engines.raster.tracing import cast, tree_of

LATTICE = 24
"""Places, each way, from which one looks up for a roof."""

EYES = 0.4
"""Of a place's height: from where."""

ROOFED = 0.6
"""Share of a place under a roof from which on it is indoors."""

UP = np.array([[[1e-3, 2e-3, 1]]], np.float32)
"""Nearly: no ray runs along a wall."""


def hall_of(
    arranged: Arranged,
    casters: Casters,
    floor: Float32,
    lengths: Lengths,
    has_ground: bool,
    bounces: Literal["auto", "on", "off"],
) -> Hall | None:
    """The scenery that stands still, which lights whatever else is there; in a picture without scenery all targets. None where
    light is not to bounce: it shall not, or only indoors.
    """
    if bounces == "off" or (bounces == "auto" and not arranged.has_scenery):
        return None
    geometry, surfaces = arranged.geometry, casters.surfaces
    still = _still(arranged)
    if not still:
        return None
    start = geometry.triangle_start
    which = np.concatenate([np.arange(start[i], start[i + 1], dtype=np.int32) for i in still])
    which = which[surfaces.looks[surfaces.material[which], L_CASTS_FROM] <= 1]
    if not len(which):
        return None
    things = tuple(arranged.things[i] for i in still), tuple(arranged.whole[i] for i in still)
    corners = surfaces.vertices[surfaces.triangles[which], 11:14]
    if bounces == "auto" and not _is_roofed(_Roof((things, lengths), corners)):
        return None
    low, high = (np.asarray(f(corners.reshape(-1, 3), axis=0), np.float64) for f in (np.nanmin, np.nanmax))
    height = geometry.ground_z if has_ground else None
    ground_z = None if height is None else (height - lengths.origin[2]) / lengths.unit
    key = things, lengths, ground_z, floor.tobytes()
    has_map = ground_z is not None and not arranged.has_scenery
    return Hall(key, surfaces, casters.textures, which, low, high, floor, lengths.unit, ground_z, has_map)


def _still(arranged: Arranged) -> list[int]:
    """The things that count, in their order."""
    if not arranged.has_scenery:
        return [] if arranged.is_sequence else list(range(len(arranged.things)))
    own = range(arranged.targets, len(arranged.things))
    return [i for i in own if i not in arranged.moving and len(arranged.whole[i].triangles)]


@dataclass(frozen=True)
class _Roof:
    key: Hashable
    corners: Float32 = field(compare=False)


@lru_cache(maxsize=4)
def _is_roofed(roof: _Roof) -> bool:
    """Whether most places within a scenery have the underside of something above them; within a solid thing there is none."""
    corners = roof.corners
    low, high = np.nanmin(corners, axis=(0, 1)), np.nanmax(corners, axis=(0, 1))
    # A tree of what is above is small: of a street nearly nothing is.
    at = (np.arange(LATTICE) + 0.5) / LATTICE
    x, y = np.meshgrid(*(low[k] + at * (high[k] - low[k]) for k in range(2)))
    eyes = np.float32(low[2] + EYES * (high[2] - low[2]))
    above = corners[corners[..., 2].max(axis=1) > eyes]
    if not len(above):
        return False
    places = np.stack([x, y, np.full_like(x, eyes)], axis=-1).reshape(-1, 3).astype(np.float32)
    (met,), _ = cast(tree_of(above), places, UP, np.zeros(len(places), np.int32), np.inf)
    a, b, c = above[met[met >= 0]].transpose(1, 0, 2)
    is_underside = np.cross(b - a, c - a)[:, 2] < 0
    return bool(is_underside.sum() >= ROOFED * len(places))
