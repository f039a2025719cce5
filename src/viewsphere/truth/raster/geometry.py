"""Geometry: the world-space triangles of a stage, which all labels are computed from."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, lru_cache, partial
from itertools import accumulate, pairwise

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.animation.deforming import Load
from viewsphere.assets.mesh import Mesh
from viewsphere.model.scene import Floor
from viewsphere.model.thing import Thing
from viewsphere.truth.raster.alpha_masks import ENDLESS, NEVER, NO_CUTOUTS, AlphaMasks, alpha_masks_of, stack_cutouts
from viewsphere.truth.raster.sparse import Spare, zeros
from viewsphere.truth.raster.triangle_labels import TriangleLabels, ground_classes, scenery_classes

BACKGROUND = 0
"""Object, part and category id of scenery and ground, which have depth and normals but are background in every label."""

UP = np.array([0, 0, 1], np.float32)
"""The ground's normal."""

GROUND_REACH = 1000.0
"""Distance from the middle to the ground's corners, in scene sizes: as far as renderers without endless planes must draw it."""

OF_VERTICES = ("coordinates", "is_used")
STACKED = (*OF_VERTICES, "poses", "bounds", "ground")
"""Arrays of a geometry that are concatenated from its parts."""

Corner = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Geometry:
    """Triangles in the world: objects in id order, then scenery, the ground (if any) last.

    Poses are stored per thing, not per vertex, so instants and instances share everything else. poses (N, 4, 4) float64: world
    from each thing. meshes: one for each thing. coordinates (V, 3) float32: each vertex in its thing's axes (zero for the
    ground). ground (4, 3) float64: its corners in the world, (0, 3) without a ground.

    triangles (T, 3) int32. triangle_object (T,) int32: 0 for scenery and ground. single_sided (n,) int32: the triangles that a
    camera sees only from the front, see `seen_from`. labels: further numbers of triangles; except for classes of things and
    stuff, they cover only the objects, which come first, and are 0 for all others. triangle_cutout (T,) int32: -1 all surface,
    -2 never seen, -3 and -4 `alpha_masks.ENDLESS`, otherwise a row of `AlphaMasks.corners`.

    is_used (V,): whether a vertex is a corner of a triangle. bounds (N, 2, 3) float64: the lowest and the highest coordinates
    of each thing's used vertices, in world metres, infinite if it has none.

    The ground is the whole plane z = ground_z, and its two triangles are halves of that plane. The triangles do not mark a
    fixed place, because their corners move with the things above. So a point of the ground is stored as its place in the world.

    Thing i owns vertices [vertex_start[i], vertex_start[i + 1]) and triangles [triangle_start[i], triangle_start[i + 1]); both
    have one entry more than there are things. The first `object_count` of them are the objects 1, 2, ...
    """

    poses: Corner
    meshes: tuple[Mesh, ...]
    coordinates: NDArray[np.float32]
    ground: Corner
    triangles: NDArray[np.int32]
    triangle_object: NDArray[np.int32]
    triangle_cutout: NDArray[np.int32]
    alpha_masks: AlphaMasks
    single_sided: NDArray[np.int32]
    is_used: NDArray[np.bool_]
    bounds: NDArray[np.float64]
    vertex_start: tuple[int, ...]
    triangle_start: tuple[int, ...]
    object_count: int
    ground_z: float | None
    labels: TriangleLabels
    facing: _Facing
    spare: Spare

    @property
    def triangle_part(self) -> NDArray[np.int32]:
        """Parts of the objects' models; this array and the next are computed when they are first read."""
        return self.labels.part

    @property
    def triangle_category(self) -> NDArray[np.int32]:
        """Ids of the objects' categories."""
        return self.labels.category

    @property
    def triangle_class(self) -> NDArray[np.int32]:
        """Classes of all triangles."""
        return self.labels.classes[: len(self.triangles)]

    @property
    def triangle_material(self) -> NDArray[np.int32]:
        """Materials of the objects' models."""
        return self.labels.material

    @property
    def triangle_body_part(self) -> NDArray[np.int32]:
        """Parts of the objects' bodies."""
        return self.labels.body_part

    @property
    def vertices(self) -> NDArray[np.float64]:
        """World metres (V, 3), computed on each call; for a part of the vertices, use `places` or `corners`."""
        return np.concatenate([*(self.places(i) for i in range(len(self.poses))), self.ground])

    @property
    def normals(self) -> NDArray[np.float32]:
        """World unit normals of the vertices (V, 3). This array and the next two are overwritten when those of another instant
        are requested.
        """
        return self.facing.of_vertices(self)[: len(self.coordinates)]

    @property
    def triangle_normals(self) -> NDArray[np.float32]:
        """World unit normals of the triangles (T, 3), by winding; zero for a degenerate triangle."""
        return self.facing.of_triangles(self)[0][: len(self.triangle_object)]

    def triangle_normals_of(self, things: Iterable[int]) -> NDArray[np.float32]:
        """`triangle_normals`, up to date only for these things and the ground."""
        return self.facing.of_triangles(self, things)[0][: len(self.triangle_object)]

    @property
    def triangle_side(self) -> NDArray[np.int8]:
        """The side of each triangle (T,): 1 if the mean of its vertex normals agrees with the winding, -1 if it opposes it. The
        side is 2 or -2 if, in addition, all three vertex normals equal the triangle's own.
        """
        return self.facing.of_triangles(self)[1][: len(self.triangle_object)]

    @property
    def triangle_tops(self) -> NDArray[np.float64]:
        """World z (T,) of each triangle's highest corner, in metres; overwritten like `normals`."""
        return self.facing.tops(self)[: len(self.triangle_object)]

    def places(self, i: int) -> NDArray[np.float64]:
        """World vertices of thing i (n, 3); the ground's index follows that of the last thing."""
        from viewsphere.truth.raster import kernels_place as kernels

        if i == len(self.poses):
            return self.ground
        coordinates = self.coordinates[self.vertex_start[i] : self.vertex_start[i + 1]]
        placed = np.empty(coordinates.shape)
        kernels.place(self.poses[i], coordinates, placed)
        return placed

    def corners(self, chosen: NDArray[np.integer]) -> NDArray[np.float64]:
        """World corners (n, 3, 3) of triangles (n,); arbitrary for triangle -1."""
        from viewsphere.truth.raster import kernels_place as kernels

        filled = np.empty((len(chosen), 3, 3))
        starts = np.array([*self.vertex_start, len(self.coordinates)])
        kernels.corners(chosen.astype(np.int64), self.triangles, self.coordinates, starts, self.poses, self.ground, filled)
        return filled

    @property
    def has_scenery(self) -> bool:
        """Return whether there is anything besides objects and the ground."""
        return self.object_count < len(self.vertex_start) - 1

    def extent(self, things: int | None = None) -> tuple[Corner, Corner]:
        """The lowest and the highest corner (3,) of the first `things` things, or of all if it is None; the origin if there are
        none.
        """
        return _extent(self.bounds[:things])


@dataclass(eq=False)
class _Facing:
    """The world normals of a scene's vertices and triangles.

    The arrays are overwritten when the normals of another instant are requested, so all instants share one of each.
    """

    _vertices: NDArray[np.float32] | None = None
    _triangles: tuple[NDArray[np.float32], NDArray[np.int8]] | None = None
    _tops: NDArray[np.float64] | None = None
    _shown: dict[str, _Shown] = field(default_factory=dict[str, "_Shown"])

    def of_vertices(self, geometry: Geometry) -> NDArray[np.float32]:
        """The world normals of the vertices."""
        if self._vertices is None or len(self._vertices) < len(geometry.coordinates):  # requested before without the ground
            self._vertices = np.tile(UP, (len(geometry.coordinates), 1))
            self._shown.pop("vertices", None)
        for i in self._elsewhere("vertices", geometry):
            own = slice(geometry.vertex_start[i], geometry.vertex_start[i + 1])
            _turn(geometry, i, self._vertices[own])
        return self._vertices

    def of_triangles(
        self, geometry: Geometry, things: Iterable[int] | None = None
    ) -> tuple[NDArray[np.float32], NDArray[np.int8]]:
        """The world normals and the sides of the triangles; if things are given, only theirs are sure to be up to date."""
        from viewsphere.truth.raster import kernels_place as kernels

        if self._triangles is None or len(self._triangles[1]) < len(geometry.triangles):
            count = len(geometry.triangles)
            self._triangles = np.empty((count, 3), np.float32), np.empty(count, np.int8)
            self._shown.pop("triangles", None)
            if geometry.ground_z is not None:
                start, base = geometry.triangle_start[-1], geometry.vertex_start[-1]
                normals, side = (array[start:] for array in self._triangles)
                kernels.face(geometry.ground, np.tile(UP, (4, 1)), geometry.triangles[start:], base, normals, side)
        for i in self._elsewhere("triangles", geometry, things):
            first, stop, base = *geometry.triangle_start[i : i + 2], geometry.vertex_start[i]
            normals, side = (array[first:stop] for array in self._triangles)
            turned = np.empty((geometry.vertex_start[i + 1] - base, 3), np.float32)
            _turn(geometry, i, turned)
            kernels.face(geometry.places(i), turned, geometry.triangles[first:stop], base, normals, side)
        return self._triangles

    def tops(self, geometry: Geometry) -> NDArray[np.float64]:
        """The height of each triangle's highest corner."""
        if self._tops is None or len(self._tops) < len(geometry.triangles):
            self._tops = np.empty(len(geometry.triangles))
            self._shown.pop("tops", None)
        for i in self._elsewhere("tops", geometry):
            first, stop, base = *geometry.triangle_start[i : i + 2], geometry.vertex_start[i]
            heights = geometry.places(i)[:, 2]
            np.max(heights[geometry.triangles[first:stop].T - base], axis=0, out=self._tops[first:stop])
        if geometry.ground_z is not None:
            self._tops[geometry.triangle_start[-1] :] = geometry.ground_z
        return self._tops

    def _elsewhere(self, name: str, geometry: Geometry, things: Iterable[int] | None = None) -> list[int]:
        """Return the indices of the things that have moved or deformed since these arrays were written.

        things: the things to compare; all by default.
        """
        if name not in self._shown:
            self._shown[name] = _Shown(np.full_like(geometry.poses, np.nan), list(geometry.meshes))
        shown = self._shown[name]
        if shown.all_of is geometry.poses:
            return []
        moved = (shown.poses != geometry.poses).any(axis=(1, 2)).tolist()
        every = range(len(moved)) if things is None else things
        moved_things = [i for i in every if moved[i] or shown.meshes[i] is not geometry.meshes[i]]
        shown.poses[moved_things] = geometry.poses[moved_things]
        for i in moved_things:
            shown.meshes[i] = geometry.meshes[i]
        shown.all_of = geometry.poses if things is None else None
        return moved_things


@dataclass(eq=False)
class _Shown:
    """The poses (N, 4, 4) and meshes last written for each thing; all_of: the geometry's poses, if they are the same."""

    poses: Corner
    meshes: list[Mesh]
    all_of: Corner | None = None


def _turn(geometry: Geometry, i: int, turned: NDArray[np.float32]) -> None:
    """Write the world normals of thing i's vertices."""
    from viewsphere.truth.raster import kernels_place as kernels

    kernels.turn(geometry.poses[i], read_only(geometry.meshes[i].normals), turned)


def placed_meshes(things: Sequence[Thing], load: Load) -> list[Mesh]:
    """The model of each thing at rest; each model is loaded once."""
    loaded = {spec: load(spec) for spec in dict.fromkeys(p.model for p in things)}
    return [loaded[p.model] for p in things]


def present(things: Sequence[Thing], meshes: Sequence[Mesh]) -> list[Mesh]:
    """The meshes of still things. An absent thing has a mesh without triangles, but with all materials."""
    return [mesh if thing.is_there else mesh.emptied() for thing, mesh in zip(things, meshes, strict=True)]


def build_geometry(
    things: Sequence[Thing],
    meshes: Sequence[Mesh],
    ground: bool,
    label_alpha: float,
    floor: Floor | None = None,
    keeps_scenery: bool = True,
) -> Geometry:
    """Place the meshes in the world and, if requested, lay the ground at their lowest point (z = 0 if there are none), or at
    the height of `floor`: a jumping thing leaves it.

    `meshes[i]` is the normalised model of `things[i]`; ids are 1..N in order, then 0 for scenery. A BLEND material is surface
    if alpha >= label_alpha, a MASK material if alpha >= its cutoff; transmission always counts as surface. Fully transparent
    triangles (no texel is surface) are kept but never seen. Raises ValueError for other ids.

    The latest scenery is cached, unless no other geometry could use it; so it is not placed again while only objects change.
    """
    count = sum(p.id > 0 for p in things)
    if [p.id for p in things] != [*range(1, count + 1), *[BACKGROUND] * (len(meshes) - count)]:
        raise ValueError(f"things: expected ids 1..N in order, then 0, got {[p.id for p in things]}")
    parts = [_placed(tuple(things[:count]), tuple(meshes[:count]), label_alpha)]
    if count < len(meshes):
        placed = _scenery if keeps_scenery else _placed
        parts.append(placed(tuple(things[count:]), tuple(meshes[count:]), label_alpha))
    return _stacked([*parts, _ground(np.concatenate([part.bounds for part in parts]), floor)] if ground else parts)


def moved(geometry: Geometry, where: Mapping[int, tuple[Thing, Mesh]]) -> Geometry:
    """The geometry with some things moved or deformed.

    The things are given by their numbers, with their new state and their meshes, which have the same triangles. Coordinates of
    deformed things are overwritten in place.
    """
    poses, bounds, meshes = geometry.poses.copy(), geometry.bounds.copy(), list(geometry.meshes)
    for i, (thing, mesh) in where.items():
        if mesh is not meshes[i]:
            own = slice(geometry.vertex_start[i], geometry.vertex_start[i + 1])
            geometry.coordinates[own], meshes[i] = mesh.vertices, mesh
        poses[i] = thing.world_from_object
    placed = replace(geometry, poses=poses, bounds=bounds, meshes=tuple(meshes))
    for i in where:
        _bound(placed, i)
    return placed


def lay_ground(geometry: Geometry, floor: Floor | None) -> Geometry:
    """The geometry with its ground, if any, at the height where `build_geometry` lays it."""
    if geometry.ground_z is None:
        return replace(geometry)
    corners = _ground_corners(geometry.bounds, floor)
    return replace(geometry, ground=corners, ground_z=float(corners[0, 2]))


def without_ground(geometry: Geometry) -> Geometry:
    """The geometry without its ground."""
    if geometry.ground_z is None:
        return geometry
    vertices, triangles = geometry.vertex_start[-1], geometry.triangle_start[-1]
    kept = {name: getattr(geometry, name)[:vertices] for name in OF_VERTICES}
    kept |= {name: getattr(geometry, name)[:triangles] for name in ("triangle_object", "triangles", "triangle_cutout")}
    kept["ground"] = geometry.ground[:0]
    return replace(geometry, **kept, ground_z=None)


def seen_from(geometry: Geometry, q: NDArray[np.float64], base: int = 0) -> Geometry:
    """The geometry without the single-sided triangles that face away from the camera. Only those triangles are tested again. q:
    vertices from `base` on, as `truth.raster.visibility.homogeneous` gives them for the camera.

    The test uses the sign that the rasteriser computes, so nothing changes if no triangle is single-sided.
    """
    corners = geometry.triangles[geometry.single_sided] - base
    chosen = ((corners >= 0) & (corners < len(q))).all(axis=1)
    if not chosen.any():
        return geometry
    a, b, c = (q[corners[chosen, i], :3] for i in range(3))
    with np.errstate(invalid="ignore", over="ignore"):  # things outside the picture, which are left out of q
        is_turned = (np.cross(b - a, c - a) * a).sum(axis=1) > 0
    cutout = geometry.triangle_cutout.copy()
    cutout[geometry.single_sided[chosen][is_turned]] = NEVER
    return replace(geometry, triangle_cutout=cutout, single_sided=geometry.single_sided[:0])


def with_both_sides(geometry: Geometry) -> Geometry:
    """The geometry with all triangles visible from both sides, as for rays that do not come from a camera."""
    return replace(geometry, single_sided=geometry.single_sided[:0]) if len(geometry.single_sided) else geometry


def with_blended_colors(geometry: Geometry, meshes: Sequence[Mesh]) -> Geometry:
    """Return the geometry with BLEND materials as surface wherever they have a colour. Labels leave out their faint parts."""
    if not any(material.alpha_mode == "BLEND" for mesh in meshes for material in mesh.materials):
        return geometry
    ground = geometry.triangle_cutout[geometry.triangle_start[-1] :]
    alpha_masks, rows = stack_cutouts([*alpha_masks_of(meshes, None), (NO_CUTOUTS, ground)])
    return replace(geometry, alpha_masks=alpha_masks, triangle_cutout=rows)


def _placed(things: tuple[Thing, ...], meshes: tuple[Mesh, ...], label_alpha: float) -> Geometry:
    vertex_start = (0, *accumulate(len(m.vertices) for m in meshes))
    triangle_start = (0, *accumulate(len(m.triangles) for m in meshes))
    objects = sum(p.id > 0 for p in things)
    alpha_masks, rows = stack_cutouts(alpha_masks_of(meshes, label_alpha))
    part = Geometry(
        poses=np.array([thing.world_from_object for thing in things]).reshape(-1, 4, 4),
        meshes=meshes,
        coordinates=np.concatenate([np.empty((0, 3), np.float32), *(mesh.vertices for mesh in meshes)], dtype=np.float32),
        ground=np.empty((0, 3)),
        triangles=_offset_triangles([mesh.triangles for mesh in meshes], vertex_start),
        triangle_object=_objects(triangle_start, objects, triangle_start[-1]),
        triangle_cutout=rows,
        alpha_masks=alpha_masks,
        single_sided=_offset([_single_sided(*pair) for pair in zip(things, meshes, strict=True)], triangle_start),
        is_used=_are_used(meshes),
        bounds=np.empty((len(things), 2, 3)),
        vertex_start=vertex_start,
        triangle_start=triangle_start,
        object_count=objects,
        ground_z=None,
        labels=TriangleLabels(
            things[:objects], meshes[:objects], (cache(partial(scenery_classes, things[objects:], meshes[objects:])),)
        ),
        facing=_Facing(),
        spare=Spare(),
    )
    for i in range(len(things)):
        _bound(part, i)
    return part


_scenery = lru_cache(maxsize=1)(_placed)


def _stacked(parts: Sequence[Geometry]) -> Geometry:
    """The parts one after another; if the last is the ground, it remains the ground."""
    firsts = (0, *accumulate(len(part.coordinates) for part in parts))
    first_triangles = (0, *accumulate(len(part.triangles) for part in parts))
    alpha_masks, rows = stack_cutouts([(part.alpha_masks, part.triangle_cutout) for part in parts])
    arrays = {name: np.concatenate([getattr(part, name) for part in parts]) for name in STACKED}
    triangle_start = (0, *accumulate(b - a for part in parts for a, b in pairwise(part.triangle_start)))
    objects = sum(part.object_count for part in parts)
    return Geometry(
        **arrays,
        triangle_object=_objects(triangle_start, objects, first_triangles[-1]),
        triangles=_offset_triangles([part.triangles for part in parts], firsts),
        triangle_cutout=rows,
        alpha_masks=alpha_masks,
        single_sided=_offset([part.single_sided for part in parts], first_triangles),
        vertex_start=(0, *accumulate(b - a for part in parts for a, b in pairwise(part.vertex_start))),
        triangle_start=triangle_start,
        object_count=objects,
        ground_z=parts[-1].ground_z,
        meshes=tuple(mesh for part in parts for mesh in part.meshes),
        labels=TriangleLabels(
            tuple(thing for part in parts for thing in part.labels.things),
            tuple(mesh for part in parts for mesh in part.labels.meshes),
            tuple(classes for part in parts for classes in part.labels.classes_behind),
        ),
        facing=_Facing(),
        spare=Spare(),
    )


def _objects(triangle_start: Sequence[int], objects: int, count: int) -> NDArray[np.int32]:
    """The object of each of `count` triangles: objects come first, with ids from 1, and 0 is scenery and ground."""
    ids = zeros(count, np.int32)
    for i in range(objects):
        ids[triangle_start[i] : triangle_start[i + 1]] = i + 1
    return ids


def _single_sided(thing: Thing, mesh: Mesh) -> NDArray[np.int32]:
    """The triangles of a thing that a camera sees only from the front: none, unless its entry has `faces: as_file`."""
    if thing.model.faces is None:
        return np.empty(0, np.int32)
    is_single = np.array([not material.double_sided for material in mesh.materials])
    return np.flatnonzero(is_single[mesh.triangle_material]).astype(np.int32)


def _offset(parts: Sequence[NDArray[np.int32]], firsts: Sequence[int]) -> NDArray[np.int32]:
    """Triangle numbers that count within each part, converted to numbers in the whole."""
    moved = (part + np.int32(first) for part, first in zip(parts, firsts, strict=False))
    return np.concatenate([np.empty(0, np.int32), *moved])


def _offset_triangles(parts: Sequence[NDArray[np.int32]], firsts: Sequence[int]) -> NDArray[np.int32]:
    """Triangles (T, 3) of parts whose vertices begin at `firsts`, overwritten in place because a thousand instances are
    large.
    """
    triangles = np.empty((sum(map(len, parts)), 3), np.int32)
    stop = 0
    for part, first in zip(parts, firsts, strict=False):
        start, stop = stop, stop + len(part)
        np.add(part, np.int32(first), out=triangles[start:stop], casting="same_kind")
    return triangles


def _are_used(meshes: Sequence[Mesh]) -> NDArray[np.bool_]:
    """A mask (V,) of the vertices of these meshes that are corners of a triangle; a repeated mesh is processed once."""
    used_vertices: dict[int, NDArray[np.bool_]] = {}
    for mesh in meshes:
        if id(mesh) not in used_vertices:
            used_vertices[id(mesh)] = np.zeros(len(mesh.vertices), np.bool_)
            used_vertices[id(mesh)][mesh.triangles] = True
    return np.concatenate([np.empty(0, np.bool_), *(used_vertices[id(mesh)] for mesh in meshes)])


def _ground(bounds: NDArray[np.float64], floor: Floor | None) -> Geometry:
    """A plane in two halves, below all placed things or at the height of `floor`, counter-clockwise seen from above."""
    corners = _ground_corners(bounds, floor)
    background, none = np.full(2, BACKGROUND, np.int32), np.empty(0, np.int32)
    return Geometry(
        poses=np.empty((0, 4, 4)),
        meshes=(),
        coordinates=np.zeros((4, 3), np.float32),
        ground=corners,
        triangles=np.array([[0, 1, 2], [0, 2, 3]], np.int32),
        triangle_object=background,
        triangle_cutout=np.array(ENDLESS, np.int32),
        alpha_masks=NO_CUTOUTS,
        single_sided=none,
        is_used=np.ones(4, np.bool_),
        bounds=np.empty((0, 2, 3)),
        vertex_start=(0,),
        triangle_start=(0,),
        object_count=0,
        ground_z=float(corners[0, 2]),
        labels=TriangleLabels((), (), (ground_classes,)),
        facing=_Facing(),
        spare=Spare(),
    )


def _ground_corners(bounds: NDArray[np.float64], floor: Floor | None) -> Corner:
    """Corners (4, 3) of the ground below things with these bounds (N, 2, 3)."""
    low, high = _extent(bounds)
    x, y = (low[:2] + high[:2]) / 2
    z = low[2] if floor is None else floor.under(low[2])
    r = GROUND_REACH * (float(np.max(high - low)) or 1.0)
    return np.array([[x - r, y - r, z], [x + r, y - r, z], [x + r, y + r, z], [x - r, y + r, z]])


def _extent(bounds: NDArray[np.float64]) -> tuple[Corner, Corner]:
    low, high = bounds[:, 0].min(axis=0, initial=np.inf), bounds[:, 1].max(axis=0, initial=-np.inf)
    return (low, high) if low[0] <= high[0] else (np.zeros(3), np.zeros(3))


def _bound(geometry: Geometry, i: int) -> None:
    """Write the bounds of thing i."""
    from viewsphere.truth.raster import kernels_place as kernels

    own = slice(geometry.vertex_start[i], geometry.vertex_start[i + 1])
    kernels.bound(geometry.poses[i], geometry.coordinates[own], geometry.is_used[own], geometry.bounds[i])


def read_only(array: NDArray[np.float32]) -> NDArray[np.float32]:
    """A read-only view of the array, even if the array is read-only already, so that kernels are compiled once for both."""
    view = np.ascontiguousarray(array).view()
    view.setflags(write=False)
    return view
