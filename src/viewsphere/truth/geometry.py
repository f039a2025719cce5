"""Geometry: the world-space triangles of a stage, the one source of every label."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import accumulate, pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from viewsphere.assets.mesh import Mesh
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.thing import Thing
from viewsphere.truth.cutouts import ENDLESS, NO_CUTOUTS, Cutouts, mesh_cutouts, stack_cutouts

BACKGROUND = 0
"""Object, part and category id of scenery and ground: they have depth and normals but are background to every label."""

GROUND_REACH = 1000.0
"""Scene sizes from the middle to the ground's corners: as far as a renderer without endless planes has to draw it."""

STACKED = (
    "vertices",
    "normals",
    "coordinates",
    "triangle_normals",
    "triangle_side",
    "triangle_object",
    "triangle_part",
    "triangle_category",
)
"""Arrays of a geometry that are those of its parts, one after another."""


@dataclass(frozen=True, eq=False)
class Geometry:
    """World-space triangles: objects in id order, then scenery, the ground (if any) last.

    vertices (V, 3) float64 world metres; triangles (T, 3) int32; normals (V, 3) float32 world, unit; coordinates (V, 3)
    float32, each vertex in its object's axes (zero for the ground).

    triangle_normals (T, 3) float32 world, unit, by winding (zero for a degenerate triangle); triangle_side (T,) int8: 1 where
    the mean of the vertex normals agrees with the winding, -1 where it opposes it, 2 or -2 likewise where all three equal the
    triangle's own; triangle_object, triangle_part, triangle_category (T,) int32, 0 for scenery and ground; triangle_cutout
    (T,) int32: -1 all surface, -2 never seen, -3 and -4 `cutouts.ENDLESS`, else a row of `cutouts.corners`.

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
    triangle_cutout: NDArray[np.int32]
    cutouts: Cutouts
    vertex_start: tuple[int, ...]
    triangle_start: tuple[int, ...]
    object_count: int
    ground_z: float | None

    @property
    def has_scenery(self) -> bool:
        """Whether anything but objects and the ground is there."""
        return self.object_count < len(self.vertex_start) - 1

    @cached_property
    def is_used(self) -> NDArray[np.bool_]:
        """(V,): whether a vertex is a triangle's corner."""
        used = np.zeros(len(self.vertices), np.bool_)
        used[self.triangles] = True
        return used


def placed_meshes(things: Sequence[Thing], load: Callable[[ModelSpec], Mesh]) -> list[Mesh]:
    """The model of each thing; each is loaded once."""
    loaded = {spec: load(spec) for spec in dict.fromkeys(p.model for p in things)}
    return [loaded[p.model] for p in things]


def present(things: Sequence[Thing], meshes: Sequence[Mesh]) -> list[Mesh]:
    """The meshes of things that stand still; of those that are not there one without triangles, but with all materials."""
    return [mesh if thing.is_there else mesh.emptied() for thing, mesh in zip(things, meshes, strict=True)]


def build_geometry(
    things: Sequence[Thing], meshes: Sequence[Mesh], ground: bool, label_alpha: float, floor: float | None = None
) -> Geometry:
    """Place the meshes in the world and, if asked, lay the ground at their lowest point (z = 0 if there are none), or at
    `floor` where that is lower: something that jumps leaves it.

    `meshes[i]` is the normalised model of `things[i]`; ids are 1..N in order, then 0 for scenery. A BLEND material is surface
    where alpha >= label_alpha, a MASK material where alpha >= its cutoff; transmission always counts as surface. Fully
    transparent triangles (no texel is surface) are kept but never seen. Raises ValueError for other ids.

    The last scenery is kept: where only objects change, it is not placed again.
    """
    count = sum(p.id > 0 for p in things)
    if [p.id for p in things] != [*range(1, count + 1), *[BACKGROUND] * (len(meshes) - count)]:
        raise ValueError(f"things: expected ids 1..N in order, then 0, got {[p.id for p in things]}")
    parts = [_placed(tuple(things[:count]), tuple(meshes[:count]), label_alpha)]
    if count < len(meshes):
        parts.append(_scenery(tuple(things[count:]), tuple(meshes[count:]), label_alpha))
    return _stacked([*parts, _ground(parts, floor)] if ground else parts)


def without_ground(geometry: Geometry) -> Geometry:
    """The same, but there is no ground."""
    if geometry.ground_z is None:
        return geometry
    vertices, triangles = geometry.vertex_start[-1], geometry.triangle_start[-1]
    names = (*STACKED, "triangles", "triangle_cutout")
    kept = {name: getattr(geometry, name)[: triangles if name.startswith("triangle") else vertices] for name in names}
    return replace(geometry, **kept, ground_z=None)


def with_blended_colors(geometry: Geometry, meshes: Sequence[Mesh]) -> Geometry:
    """The same, but BLEND materials are surface wherever they have a colour, which labels leave out where it is faint."""
    if not any(material.alpha_mode == "BLEND" for mesh in meshes for material in mesh.materials):
        return geometry
    ground = geometry.triangle_cutout[geometry.triangle_start[-1] :]
    cutouts, rows = stack_cutouts([*(mesh_cutouts(mesh, None) for mesh in meshes), (NO_CUTOUTS, ground)])
    return replace(geometry, cutouts=cutouts, triangle_cutout=rows)


def _placed(things: tuple[Thing, ...], meshes: tuple[Mesh, ...], label_alpha: float) -> Geometry:
    moves = [p.world_from_object for p in things]
    vertex_start = (0, *accumulate(len(m.vertices) for m in meshes))
    vertices = _joined([_moved(w, m.vertices, 1.0) for w, m in zip(moves, meshes, strict=True)], (0, 3), np.float64)
    triangles = _joined([m.triangles + s for m, s in zip(meshes, vertex_start, strict=False)], (0, 3), np.int32)
    normals = _joined([_moved(w, m.normals, 0.0) for w, m in zip(moves, meshes, strict=True)], (0, 3), np.float32)
    labels = _joined([_labels(p, m) for p, m in zip(things, meshes, strict=True)], (0, 3), np.int32)
    cutouts, rows = stack_cutouts([mesh_cutouts(m, label_alpha) for m in meshes])
    triangle_normals = _triangle_normals(vertices, triangles)
    return Geometry(
        vertices=vertices,
        triangles=triangles,
        normals=normals,
        coordinates=_joined([m.vertices for m in meshes], (0, 3), np.float32),
        triangle_normals=triangle_normals,
        triangle_side=_triangle_side(triangle_normals, normals[triangles]),
        triangle_object=labels[:, 0],
        triangle_part=labels[:, 1],
        triangle_category=labels[:, 2],
        triangle_cutout=rows,
        cutouts=cutouts,
        vertex_start=vertex_start,
        triangle_start=(0, *accumulate(len(m.triangles) for m in meshes)),
        object_count=sum(p.id > 0 for p in things),
        ground_z=None,
    )


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
    labels = np.full((len(mesh.triangles), 3), BACKGROUND, np.int32)
    if thing.id:
        labels[:, 0], labels[:, 1], labels[:, 2] = thing.id, mesh.triangle_part + 1, thing.model.category_id
    return labels


def _ground(parts: Sequence[Geometry], floor: float | None) -> Geometry:
    """A plane in two halves, below all that is placed and not above `floor`, counter-clockwise seen from above."""
    used = np.concatenate([part.vertices[part.is_used] for part in parts])
    low, high = (used.min(axis=0), used.max(axis=0)) if len(used) else (np.zeros(3), np.zeros(3))
    size = float(np.max(high - low)) or 1.0
    x, y = (low[:2] + high[:2]) / 2
    z = low[2] if floor is None else min(low[2], floor)
    r = GROUND_REACH * size
    corners = np.array([[x - r, y - r, z], [x + r, y - r, z], [x + r, y + r, z], [x - r, y + r, z]])
    triangles = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    up = np.tile(np.array([0, 0, 1], np.float32), (4, 1))
    normals, background = _triangle_normals(corners, triangles), np.full(2, BACKGROUND, np.int32)
    return Geometry(
        vertices=corners,
        triangles=triangles,
        normals=up,
        coordinates=np.zeros_like(up),
        triangle_normals=normals,
        triangle_side=_triangle_side(normals, up[triangles]),
        triangle_object=background,
        triangle_part=background,
        triangle_category=background,
        triangle_cutout=np.array(ENDLESS, np.int32),
        cutouts=NO_CUTOUTS,
        vertex_start=(0,),
        triangle_start=(0,),
        object_count=0,
        ground_z=float(z),
    )


def _joined(arrays: Sequence[NDArray[Any]], empty: tuple[int, ...], dtype: type) -> NDArray[Any]:
    return np.ascontiguousarray(np.concatenate([np.zeros(empty, dtype), *arrays]), dtype)


def _moved(matrix: ArrayLike, points: NDArray[np.float32], w: float) -> NDArray[np.float64]:
    """Points (w = 1) or directions (w = 0) moved; written out, because BLAS rounds differently from processor to processor."""
    m = np.asarray(matrix, np.float64)
    x, y, z = points.astype(np.float64).T
    return np.stack([m[r, 0] * x + m[r, 1] * y + m[r, 2] * z + m[r, 3] * w for r in range(3)], axis=1)


def _triangle_normals(vertices: NDArray[np.float64], triangles: NDArray[np.int32]) -> NDArray[np.float32]:
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    largest = np.abs(normal).max(axis=1, initial=0.0)
    normal /= np.where(largest > 0, largest, 1)[:, None]  # keeps the squares of tiny triangles from vanishing
    length = np.sqrt((normal * normal).sum(axis=1))
    return (normal / np.where(length > 0, length, 1)[:, None]).astype(np.float32)


def _triangle_side(own: NDArray[np.float32], corners: NDArray[np.float32]) -> NDArray[np.int8]:
    mean = corners.sum(axis=1)
    side = np.where((mean * own).sum(axis=1) < 0, -1, 1)
    same = (corners == corners[:, :1]).all(axis=(1, 2))
    flat = same & (np.abs(corners[:, 0] - side[:, None] * own).max(axis=1, initial=0) < 1e-5)
    return np.where(flat, 2 * side, side).astype(np.int8)
