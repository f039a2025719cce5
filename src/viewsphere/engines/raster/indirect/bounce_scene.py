"""The choice of a scene's things that reflect light onto one another."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field
from functools import lru_cache
from operator import is_
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import Mesh
from viewsphere.engines.raster.indirect.bounces import BounceScene
from viewsphere.engines.raster.materials.kernels_material import L_CASTS_FROM
from viewsphere.engines.raster.materials.surface import Lengths, Rows
from viewsphere.engines.raster.records import Float32, Int32
from viewsphere.engines.raster.reflections.tracing import cast, tree_of
from viewsphere.engines.raster.shadows.shadow_maps import Casters
from viewsphere.engines.shared.arranged import Arranged
from viewsphere.model.thing import Thing

Float = NDArray[np.float64]

LATTICE = 24
"""Number of places, in each direction, at which a ray upwards tests for a roof."""

EYES = 0.4
"""Height of the viewpoint, as a share of a place's height."""

ROOFED = 0.6
"""Share of a place under a roof above which it counts as indoors."""

UP = np.array([[[1e-3, 2e-3, 1]]], np.float32)
"""The direction upwards, tilted slightly so that no ray runs along a wall."""


@dataclass(frozen=True, eq=False)
class _Throwing:
    """Still things, and the mask (T,) of a stage's triangles that reflect light, between low and high (3,)."""

    things: tuple[Thing, ...]
    meshes: tuple[Mesh, ...]
    lengths: Lengths
    triangles: NDArray[np.uint32]
    which: Int32
    low: Float
    high: Float


@dataclass(frozen=True, eq=False)
class BounceScenes:
    """Finds the things that reflect light onto one another. The latest results are cached, because the search tests all
    triangles.
    """

    _last: list[_Throwing] = field(default_factory=list[_Throwing])

    def find(
        self,
        arranged: Arranged,
        rows: Rows,
        casters: Casters,
        floor: Float32,
        ground: Hashable,
        lengths: Lengths,
        has_ground: bool,
        bounces: Literal["auto", "on", "fine", "off"],
    ) -> BounceScene | None:
        """The still scenery, which lights everything else; in a picture without scenery, all targets.

        None if light does not bounce: it is switched off, or limited to indoors. `ground` is equal for equal grounds. All calls
        have the same `bounces`.
        """
        if bounces == "off" or (bounces == "auto" and not arranged.has_scenery):
            return None
        own = self._throwing(arranged, rows, bounces == "auto")
        if not len(own.which):
            return None
        height = arranged.geometry.ground_z if has_ground else None
        ground_z = None if height is None else (height - lengths.origin[2]) / lengths.unit
        key = (own.things, own.meshes), lengths, ground_z, floor.tobytes(), ground
        has_map = ground_z is not None and not arranged.has_scenery
        limits = own.which, own.low, own.high
        surfaces = casters.surfaces._replace(normals=arranged.geometry.triangle_normals_of(_still(arranged)))
        return BounceScene(key, surfaces, casters.textures, *limits, floor, lengths.unit, ground_z, has_map, bounces == "fine")

    def _throwing(self, arranged: Arranged, rows: Rows, only_indoors: bool) -> _Throwing:
        still, surfaces, lengths = _still(arranged), rows.surfaces, rows.lengths
        things, meshes = tuple(arranged.things[i] for i in still), tuple(arranged.whole[i] for i in still)
        for last in self._last:
            same = len(last.things) == len(things) and all(map(is_, last.things, things)) and all(map(is_, last.meshes, meshes))
            if same and last.lengths == lengths and last.triangles is surfaces.triangles:
                return last
        thrown = _thrown(still, (things, meshes), rows, only_indoors)
        self._last[:] = [thrown]
        return thrown


def _thrown(still: list[int], own: tuple[tuple[Thing, ...], tuple[Mesh, ...]], rows: Rows, only_indoors: bool) -> _Throwing:
    low, high = np.zeros(3), np.zeros(3)
    casts = rows.surfaces.looks[:, L_CASTS_FROM] <= 1
    every = ((i, np.flatnonzero(casts[rows.part(i).material])) for i in still)
    parts = [(i, which) for i, which in every if len(which)]
    if parts:
        bounds = np.array([[f(_corners(rows, *part), axis=(0, 1)) for f in (np.nanmin, np.nanmax)] for part in parts])
        low, high = np.nanmin(bounds[:, 0], axis=0), np.nanmax(bounds[:, 1], axis=0)
        if only_indoors and not _is_roofed(_Roof((own, rows.lengths), low, high, [_above(rows, parts, _eyes(low, high))])):
            parts = []
    rows.write(i for i, _ in parts)
    start = rows.geometry.triangle_start
    which = np.concatenate([np.empty(0, np.int32), *((start[i] + which).astype(np.int32) for i, which in parts)])
    return _Throwing(*own, rows.lengths, rows.surfaces.triangles, which, low.astype(np.float64), high.astype(np.float64))


def _corners(rows: Rows, i: int, which: NDArray[np.intp]) -> Float32:
    """Return the places of the corners of these triangles (n,) of thing i, (n, 3, 3)."""
    part = rows.part(i)
    return part.vertices[part.triangles[which], 11:14]


def _above(rows: Rows, parts: list[tuple[int, NDArray[np.intp]]], height: np.float32) -> Float32:
    """Return the corners, (n, 3, 3), of the triangles of all parts that reach above the height."""
    every = (_corners(rows, *part) for part in parts)
    return np.concatenate([corners[corners[..., 2].max(axis=1) > height] for corners in every])


def _still(arranged: Arranged) -> list[int]:
    """The indices of the things that count, in their order."""
    if not arranged.has_scenery:
        return [] if arranged.is_sequence else list(range(len(arranged.things)))
    own = range(arranged.targets, len(arranged.things))
    return [i for i in own if i not in arranged.moving and len(arranged.whole[i].triangles)]


def _eyes(low: Float32, high: Float32) -> np.float32:
    """Return the eye height from which a viewer looks up in a place between two corners."""
    return np.float32(low[2] + EYES * (high[2] - low[2]))


@dataclass(frozen=True)
class _Roof:
    """A place between two corners (3,). above: the triangles (n, 3, 3) that reach above eye height. They are removed after the
    test: the result for a place is cached, its triangles are not.
    """

    key: Hashable
    low: Float32 = field(compare=False)
    high: Float32 = field(compare=False)
    above: list[Float32] = field(compare=False)


@lru_cache(maxsize=4)
def _is_roofed(roof: _Roof) -> bool:
    """Return whether most places within a scenery are below the underside of something; within a solid thing there is none."""
    # The tree of the triangles above is small: in a street, there are almost none.
    low, high, above, eyes = roof.low, roof.high, roof.above.pop(), _eyes(roof.low, roof.high)
    at = (np.arange(LATTICE) + 0.5) / LATTICE
    x, y = np.meshgrid(*(low[k] + at * (high[k] - low[k]) for k in range(2)))
    if not len(above):
        return False
    places = np.stack([x, y, np.full_like(x, eyes)], axis=-1).reshape(-1, 3).astype(np.float32)
    (met,), _ = cast(tree_of(above), places, UP, np.zeros(len(places), np.int32), np.inf)
    a, b, c = above[met[met >= 0]].transpose(1, 0, 2)
    is_underside = np.cross(b - a, c - a)[:, 2] < 0
    return bool(is_underside.sum() >= ROOFED * len(places))
