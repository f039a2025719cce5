"""Geometry: the world-space triangles of a stage, the one source of every label."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import accumulate, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.deforming import Load
from viewsphere.assets.mesh import Mesh
from viewsphere.model.classes import GROUND, stuff_of, thing_class
from viewsphere.model.scene import Floor
from viewsphere.model.thing import Thing
from viewsphere.truth.cutouts import ENDLESS, NO_CUTOUTS, Cutouts, mesh_cutouts, stack_cutouts

BACKGROUND = 0
"""Object, part and category id of scenery and ground: they have depth and normals but are background to every label."""

GROUND_REACH = 1000.0
"""Scene sizes from the middle to the ground's corners: as far as a renderer without endless planes has to draw it."""

OF_VERTICES = ("vertices", "normals", "coordinates", "is_used")
OF_TRIANGLES = (
    "triangle_normals",
    "triangle_side",
    "triangle_object",
    "triangle_part",
    "triangle_category",
    "triangle_class",
    "triangle_material",
    "triangle_body_part",
)
STACKED = (*OF_VERTICES, *OF_TRIANGLES, "bounds")
"""Arrays of a geometry that are those of its parts, one after another."""

Corner = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Geometry:
    """World-space triangles: objects in id order, then scenery, the ground (if any) last.

    vertices (V, 3) float64 world metres; triangles (T, 3) int32; normals (V, 3) float32 world, unit; coordinates (V, 3)
    float32, each vertex in its object's axes (zero for the ground).

    triangle_normals (T, 3) float32 world, unit, by winding (zero for a degenerate triangle); triangle_side (T,) int8: 1 where
    the mean of the vertex normals agrees with the winding, -1 where it opposes it, 2 or -2 likewise where all three equal the
    triangle's own; triangle_object, triangle_part, triangle_category, triangle_material, triangle_body_part (T,) int32, 0 for
    scenery and ground; triangle_class (T,) int32: of things and stuff, see `model.classes`; triangle_cutout (T,) int32: -1 all
    surface, -2 never seen, -3 and -4 `cutouts.ENDLESS`, else a row of `cutouts.corners`.

    is_used (V,): whether a vertex is a triangle's corner; bounds (N, 2, 3) float64: of each thing, world metres, the lowest and
    the highest of its used vertices, infinite where it has none.

    The ground is the whole plane z = ground_z, its two triangles are halves of it. They stand for no place: under what moves
    their corners move along, so a point of the ground is kept as its place in the world.

    Thing i owns vertices [vertex_start[i], vertex_start[i + 1]) and triangles [triangle_start[i], triangle_start[i + 1]);
    both have one entry more than there are things. The first `object_count` of them are the objects 1, 2, ...
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]
    normals: NDArray[np.float32]
    coordinates: NDArray[np.float32]
    triangle_normals: NDArray[np.float32]
    triangle_side: NDArray[np.int8]
    triangle_object: NDArray[np.int32]
    triangle_part: NDArray[np.int32]
    triangle_category: NDArray[np.int32]
    triangle_class: NDArray[np.int32]
    triangle_material: NDArray[np.int32]
    triangle_body_part: NDArray[np.int32]
    triangle_cutout: NDArray[np.int32]
    cutouts: Cutouts
    is_used: NDArray[np.bool_]
    bounds: NDArray[np.float64]
    vertex_start: tuple[int, ...]
    triangle_start: tuple[int, ...]
    object_count: int
    ground_z: float | None

    @property
    def has_scenery(self) -> bool:
        """Whether anything but objects and the ground is there."""
        return self.object_count < len(self.vertex_start) - 1

    def extent(self, things: int | None = None) -> tuple[Corner, Corner]:
        """Lowest and highest corner (3,) of the first so many things, of all without a number; the origin if they have none."""
        return _extent(self.bounds[:things])


def placed_meshes(things: Sequence[Thing], load: Load) -> list[Mesh]:
    """The model of each thing as it rests; each is loaded once."""
    loaded = {spec: load(spec) for spec in dict.fromkeys(p.model for p in things)}
    return [loaded[p.model] for p in things]


def present(things: Sequence[Thing], meshes: Sequence[Mesh]) -> list[Mesh]:
    """The meshes of things that stand still; of those that are not there one without triangles, but with all materials."""
    return [mesh if thing.is_there else mesh.emptied() for thing, mesh in zip(things, meshes, strict=True)]


def build_geometry(
    things: Sequence[Thing],
    meshes: Sequence[Mesh],
    ground: bool,
    label_alpha: float,
    floor: Floor | None = None,
    keeps_scenery: bool = True,
) -> Geometry:
    """Place the meshes in the world and, if asked, lay the ground at their lowest point (z = 0 if there are none), or where
    `floor` says: something that jumps leaves it.

    `meshes[i]` is the normalised model of `things[i]`; ids are 1..N in order, then 0 for scenery. A BLEND material is surface
    where alpha >= label_alpha, a MASK material where alpha >= its cutoff; transmission always counts as surface. Fully
    transparent triangles (no texel is surface) are kept but never seen. Raises ValueError for other ids.

    The last scenery is kept, unless it is of no use to others: where only objects change, it is not placed again.
    """
    count = sum(p.id > 0 for p in things)
    if [p.id for p in things] != [*range(1, count + 1), *[BACKGROUND] * (len(meshes) - count)]:
        raise ValueError(f"things: expected ids 1..N in order, then 0, got {[p.id for p in things]}")
    parts = [_placed(tuple(things[:count]), tuple(meshes[:count]), label_alpha)]
    if count < len(meshes):
        placed = _scenery if keeps_scenery else _placed
        parts.append(placed(tuple(things[count:]), tuple(meshes[count:]), label_alpha))
    return _stacked([*parts, _ground(np.concatenate([part.bounds for part in parts]), floor)] if ground else parts)


def place(geometry: Geometry, i: int, thing: Thing, mesh: Mesh) -> None:
    """Write where thing i of a geometry is, which is built for this mesh or one with the same triangles."""
    from viewsphere.truth import kernels_place as kernels

    own = slice(geometry.vertex_start[i], geometry.vertex_start[i + 1])
    vertices, normals, is_used = geometry.vertices[own], geometry.normals[own], geometry.is_used[own]
    geometry.coordinates[own] = mesh.vertices
    read_only = (_read_only(mesh.vertices), _read_only(mesh.normals))
    kernels.place(np.array(thing.world_from_object), *read_only, is_used, vertices, normals, geometry.bounds[i])
    _face(geometry, geometry.triangle_start[i], geometry.triangle_start[i + 1])


def lay_ground(geometry: Geometry, floor: Floor | None) -> Geometry:
    """The same with its ground, if any, where `build_geometry` lays it; its corners are written in place."""
    if geometry.ground_z is None:
        return geometry
    corners = _ground_corners(geometry.bounds, floor)
    geometry.vertices[geometry.vertex_start[-1] :] = corners
    _face(geometry, geometry.triangle_start[-1], len(geometry.triangles))
    return replace(geometry, ground_z=float(corners[0, 2]))


def without_ground(geometry: Geometry) -> Geometry:
    """The same, but there is no ground."""
    if geometry.ground_z is None:
        return geometry
    vertices, triangles = geometry.vertex_start[-1], geometry.triangle_start[-1]
    kept = {name: getattr(geometry, name)[:vertices] for name in OF_VERTICES}
    kept |= {name: getattr(geometry, name)[:triangles] for name in (*OF_TRIANGLES, "triangles", "triangle_cutout")}
    return replace(geometry, **kept, ground_z=None)


def with_blended_colors(geometry: Geometry, meshes: Sequence[Mesh]) -> Geometry:
    """The same, but BLEND materials are surface wherever they have a colour, which labels leave out where it is faint."""
    if not any(material.alpha_mode == "BLEND" for mesh in meshes for material in mesh.materials):
        return geometry
    ground = geometry.triangle_cutout[geometry.triangle_start[-1] :]
    cutouts, rows = stack_cutouts([*(mesh_cutouts(mesh, None) for mesh in meshes), (NO_CUTOUTS, ground)])
    return replace(geometry, cutouts=cutouts, triangle_cutout=rows)


def _placed(things: tuple[Thing, ...], meshes: tuple[Mesh, ...], label_alpha: float) -> Geometry:
    vertex_start = (0, *accumulate(len(m.vertices) for m in meshes))
    triangles = _joined([m.triangles + s for m, s in zip(meshes, vertex_start, strict=False)], np.int32)
    labels = _joined([_labels(p, m) for p, m in zip(things, meshes, strict=True)], np.int32, 6)
    cutouts, rows = stack_cutouts([mesh_cutouts(m, label_alpha) for m in meshes])
    is_used = np.zeros(vertex_start[-1], np.bool_)
    is_used[triangles] = True
    part = Geometry(
        vertices=np.empty((vertex_start[-1], 3)),
        triangles=triangles,
        normals=np.empty((vertex_start[-1], 3), np.float32),
        coordinates=np.empty((vertex_start[-1], 3), np.float32),
        triangle_normals=np.empty((len(triangles), 3), np.float32),
        triangle_side=np.empty(len(triangles), np.int8),
        triangle_object=labels[:, 0],
        triangle_part=labels[:, 1],
        triangle_category=labels[:, 2],
        triangle_class=labels[:, 3],
        triangle_material=labels[:, 4],
        triangle_body_part=labels[:, 5],
        triangle_cutout=rows,
        cutouts=cutouts,
        is_used=is_used,
        bounds=np.empty((len(things), 2, 3)),
        vertex_start=vertex_start,
        triangle_start=(0, *accumulate(len(m.triangles) for m in meshes)),
        object_count=sum(p.id > 0 for p in things),
        ground_z=None,
    )
    for i, (thing, mesh) in enumerate(zip(things, meshes, strict=True)):
        place(part, i, thing, mesh)
    return part


_scenery = lru_cache(maxsize=1)(_placed)


def _stacked(parts: Sequence[Geometry]) -> Geometry:
    """One after another; where the last is the ground, it stays that."""
    firsts = (0, *accumulate(len(part.vertices) for part in parts))
    cutouts, rows = stack_cutouts([(part.cutouts, part.triangle_cutout) for part in parts])
    arrays = {name: np.concatenate([getattr(part, name) for part in parts]) for name in STACKED}
    return Geometry(
        **arrays,
        triangles=np.concatenate([part.triangles + np.int32(first) for part, first in zip(parts, firsts, strict=False)]),
        triangle_cutout=rows,
        cutouts=cutouts,
        vertex_start=(0, *accumulate(b - a for part in parts for a, b in pairwise(part.vertex_start))),
        triangle_start=(0, *accumulate(b - a for part in parts for a, b in pairwise(part.triangle_start))),
        object_count=sum(part.object_count for part in parts),
        ground_z=parts[-1].ground_z,
    )


def _labels(thing: Thing, mesh: Mesh) -> NDArray[np.int32]:
    """Object, part, category, class, material and part of a body of each triangle, (T, 6)."""
    labels = np.full((len(mesh.triangles), 6), BACKGROUND, np.int32)
    if thing.id:
        labels[:, 0], labels[:, 1], labels[:, 2] = thing.id, mesh.triangle_part + 1, thing.model.category_id
        labels[:, 3], labels[:, 4] = thing_class(thing.model.category_id), mesh.triangle_material + 1
        if mesh.triangle_body_part is not None:
            labels[:, 5] = mesh.triangle_body_part
    else:
        stuff = [stuff_of(thing.model.category, part) for part in mesh.parts]
        labels[:, 3] = np.array(stuff, np.int32)[mesh.triangle_part]
    return labels


def _ground(bounds: NDArray[np.float64], floor: Floor | None) -> Geometry:
    """A plane in two halves, below all that is placed, or where `floor` says, counter-clockwise seen from above."""
    corners = _ground_corners(bounds, floor)
    up, background = np.tile(np.array([0, 0, 1], np.float32), (4, 1)), np.full(2, BACKGROUND, np.int32)
    ground = Geometry(
        vertices=corners,
        triangles=np.array([[0, 1, 2], [0, 2, 3]], np.int32),
        normals=up,
        coordinates=np.zeros_like(up),
        triangle_normals=np.empty((2, 3), np.float32),
        triangle_side=np.empty(2, np.int8),
        triangle_object=background,
        triangle_part=background,
        triangle_category=background,
        triangle_class=np.full(2, GROUND, np.int32),
        triangle_material=background,
        triangle_body_part=background,
        triangle_cutout=np.array(ENDLESS, np.int32),
        cutouts=NO_CUTOUTS,
        is_used=np.ones(4, np.bool_),
        bounds=np.empty((0, 2, 3)),
        vertex_start=(0,),
        triangle_start=(0,),
        object_count=0,
        ground_z=float(corners[0, 2]),
    )
    _face(ground, 0, 2)
    return ground


def _ground_corners(bounds: NDArray[np.float64], floor: Floor | None) -> Corner:
    """Corners (4, 3) of the ground below things of these bounds (N, 2, 3)."""
    low, high = _extent(bounds)
    x, y = (low[:2] + high[:2]) / 2
    z = low[2] if floor is None else floor.under(low[2])
    r = GROUND_REACH * (float(np.max(high - low)) or 1.0)
    return np.array([[x - r, y - r, z], [x + r, y - r, z], [x + r, y + r, z], [x - r, y + r, z]])


def _extent(bounds: NDArray[np.float64]) -> tuple[Corner, Corner]:
    low, high = bounds[:, 0].min(axis=0, initial=np.inf), bounds[:, 1].max(axis=0, initial=-np.inf)
    return (low, high) if low[0] <= high[0] else (np.zeros(3), np.zeros(3))


def _face(geometry: Geometry, first: int, stop: int) -> None:
    """Write which way triangles [first, stop) face."""
    from viewsphere.truth import kernels_place as kernels

    own = slice(first, stop)
    normals, side = geometry.triangle_normals[own], geometry.triangle_side[own]
    kernels.face(geometry.vertices, geometry.normals, geometry.triangles[own], normals, side)


def _joined(arrays: Sequence[NDArray[Any]], dtype: type, width: int = 3) -> NDArray[Any]:
    """Rows of so many numbers, one after another."""
    return np.ascontiguousarray(np.concatenate([np.zeros((0, width), dtype), *arrays]), dtype)


def _read_only(array: NDArray[np.float32]) -> NDArray[np.float32]:
    """A view that cannot be written to, whatever the array is: kernels are compiled once for both."""
    view = np.ascontiguousarray(array).view()
    view.setflags(write=False)
    return view
