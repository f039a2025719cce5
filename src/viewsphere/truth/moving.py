"""The geometries of one scene at successive instants: moving coordinates are overwritten in place, the rest is shared."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import Mesh
from viewsphere.model.scene import Floor, Row
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Thing
from viewsphere.truth.raster.geometry import Geometry, build_geometry, lay_ground, moved, present

ROOMS = 3
"""Number of instants whose geometries exist at once: those of a picture, the one before and the one after."""

KEPT = (
    *("triangles", "triangle_material", "triangle_part", "triangle_body_part"),
    *("uv0", "uv1", "colors", "materials", "images"),
)
"""Attributes that a mesh shares with its deformed copies."""

SLACK = 1e-6
"""Rounding error, in metres and relative to the height, by which a rotated box may be higher than its content."""


@dataclass(frozen=True, eq=False)
class _Room:
    """A geometry, and the things and meshes it was made for."""

    things: Sequence[Thing]
    meshes: Sequence[Mesh]
    floor: Floor | None
    geometry: Geometry

    def changed(self, things: Sequence[Thing], meshes: Sequence[Mesh]) -> list[int]:
        """Return the indices of the things that have moved or deformed."""
        return changed(self.things, self.meshes, things, meshes)

    def fits(self, things: Sequence[Thing], meshes: Sequence[Mesh]) -> bool:
        """Return whether these are the same things, equally present or absent, made of the same triangles."""
        held = zip(self.things, self.meshes, things, meshes, strict=True)
        return all(
            (a is b and mesh is other) or (a.is_there == b.is_there and differs_in_shape_only(mesh, other))
            for a, mesh, b, other in held
        )


@dataclass(frozen=True, eq=False)
class Ring:
    """Gives the geometries of one scene's things, which differ only in poses and in the deformation of meshes. A geometry's
    coordinates are overwritten after those of three other instants were requested. Its normals are overwritten when those of
    another instant are requested (`geometry.Facing`).

    For `ground`, `label_alpha` and `keeps_scenery`, see `build_geometry`; all geometries are bitwise equal to its result.
    """

    ground: bool
    label_alpha: float
    keeps_scenery: bool = True
    _rooms: list[_Room] = field(default_factory=list[_Room])
    _passing: list[_Room] = field(default_factory=list[_Room])

    def geometry_at(self, things: Sequence[Thing], meshes: Sequence[Mesh], floor: Floor | None = None) -> Geometry:
        """The geometry of these still things; `meshes[i]` is the mesh of `things[i]` at this instant, even if the thing is
        absent.

        The same object is returned if nothing moved. If a thing appears, disappears or has other triangles, the geometry is
        rebuilt.
        """
        room = self._held(things, meshes, floor)
        if room is None:
            fitting = [room for room in self._rooms if room.fits(things, meshes)]
            room = self._made(things, meshes, floor, fitting, self._rooms.pop(0) if len(self._rooms) == ROOMS else None)
        self._rooms.append(room)  # the most recently requested comes last
        return room.geometry

    def passing(self, things: Sequence[Thing], meshes: Sequence[Mesh], floor: Floor | None = None) -> Geometry:
        """The geometry between two instants; its arrays are overwritten by the next call of this method."""
        fitting = [room for room in (*self._passing, *self._rooms) if room.fits(things, meshes)]
        room = self._made(things, meshes, floor, fitting, self._passing.pop() if self._passing else None)
        self._passing.append(room)
        return room.geometry

    def _held(self, things: Sequence[Thing], meshes: Sequence[Mesh], floor: Floor | None) -> _Room | None:
        for number, room in enumerate(self._rooms):
            if room.floor == floor and next(_changes(room.things, room.meshes, things, meshes), None) is None:
                return self._rooms.pop(number)
        return None

    def _made(
        self,
        things: Sequence[Thing],
        meshes: Sequence[Mesh],
        floor: Floor | None,
        fitting: list[_Room],
        free: _Room | None,
    ) -> _Room:
        """A geometry made from a fitting room. If the first fitting room is the free one, its coordinates are overwritten."""
        if not fitting:
            geometry = build_geometry(things, present(things, meshes), self.ground, self.label_alpha, floor, self.keeps_scenery)
            return _Room(things, meshes, floor, geometry)
        room = fitting[0] if fitting[0] is free else fitting[-1]
        geometry, others = room.geometry, [other.geometry for other in fitting if other is not room]
        is_deformed = any(a is not b for a, b in zip(room.meshes, meshes, strict=True))
        is_used = room is not free or any(other.coordinates is geometry.coordinates for other in others)
        if is_deformed and is_used:
            geometry = replace(geometry, coordinates=geometry.coordinates.copy())
        elsewhere = {i: (things[i], meshes[i]) for i in room.changed(things, meshes)}
        return _Room(things, meshes, floor, lay_ground(moved(geometry, elsewhere), floor))


def changed(before: Sequence[Thing], own: Sequence[Mesh], now: Sequence[Thing], meshes: Sequence[Mesh]) -> list[int]:
    """Return the indices of the still things that have moved, or have other meshes, between two lists of the same things."""
    return list(_changes(before, own, now, meshes))


def _changes(before: Sequence[Thing], own: Sequence[Mesh], now: Sequence[Thing], meshes: Sequence[Mesh]) -> Iterator[int]:
    """The indices of `changed`, one at a time, so the first one already shows that something changed."""
    if before is now and own is meshes:
        return
    for i, (a, m, b, n) in enumerate(zip(before, own, now, meshes, strict=True)):
        if m is not n or (a is not b and a.motion.poses != b.motion.poses):
            yield i


def differs_in_shape_only(a: Mesh, b: Mesh) -> bool:
    """Return whether meshes differ at most in the places of their vertices and in their normals."""
    return a is b or all(_is_same(getattr(a, name), getattr(b, name)) for name in KEPT)


def _is_same(a: object, b: object) -> bool:
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return a is b or np.array_equal(a, b)
    return a is b or a == b


def shot_floor(shot: Shot, meshes_at: Callable[[int], Sequence[Mesh]]) -> Floor | None:
    """Return the height of a shot's ground, None if nothing determines it.

    A fixed `scene.floor` is the height. Otherwise the ground is not above any moving thing at any instant, nor above
    `scene.floor`. So the height is the same throughout the shot; `meshes_at` gives the mesh of each thing at an instant.

    If a sequence is cut into shots, the caller sets a `scene.floor` that is fixed, or that is below all things in all shots.
    """
    floor = shot.scene.floor
    is_fixed = floor is not None and floor.is_fixed
    if is_fixed or shot.scene.ground is None or all(thing.motion.is_still for thing in shot.things):
        return floor
    lowest = math.inf if floor is None else floor.height
    models: dict[int, _Underside] = {}
    for instant in range(len(shot.instants)):
        held = zip(shot.things, shot.things_at(instant), meshes_at(instant), strict=True)
        moving = ((i, now, mesh) for i, (thing, now, mesh) in enumerate(held) if not thing.motion.is_still and now.is_there)
        for i, thing, mesh in moving:
            if i not in models or models[i].mesh is not mesh:
                models[i] = _Underside(mesh)
            lowest = models[i].lowest(thing.world_from_object[2], lowest)
    return None if lowest == math.inf else Floor(height=lowest)


@dataclass(eq=False)
class _Underside:
    """The underside of a mesh, which gives its lowest point in a pose."""

    mesh: Mesh
    _row: Row | None = None

    @cached_property
    def _corners(self) -> NDArray[np.float64]:
        """Corners of its triangles, (3, n)."""
        used = np.zeros(len(self.mesh.vertices), np.bool_)
        used[self.mesh.triangles] = True
        return self.mesh.vertices[used].astype(np.float64).T

    @cached_property
    def _box(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Centre and half the side lengths of its box."""
        low, high = self._corners.min(axis=1), self._corners.max(axis=1)
        return (low + high) / 2, (high - low) / 2

    def lowest(self, row: Row, known: float) -> float:
        """The lower of `known` and the lowest height in a pose with this third row."""
        if row == self._row or not self._corners.size:
            return known
        self._row = row
        turn, (middle, half) = np.array(row[:3]), self._box
        if float(turn @ middle - np.abs(turn) @ half) + row[3] - SLACK * (1 + abs(row[3])) >= known:
            return known
        x, y, z = self._corners
        return min(known, float((row[0] * x + row[1] * y + row[2] * z + row[3]).min()))
