"""Numbers of a scene's triangles that follow from the thing and the model they belong to."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import Mesh
from viewsphere.assets.metadata.stuff import stuff_of
from viewsphere.model.annotations.classes import GROUND, thing_class
from viewsphere.model.thing import Thing

Int32 = NDArray[np.int32]


@dataclass(eq=False)
class TriangleLabels:
    """Numbers of triangles, (T,) int32 each, computed when they are first read and then kept for all instants. Most recipes
    read at most one of the five, and a thousand instances have millions of triangles.

    things and meshes: those of the objects, which come first. classes_behind: the classes of the scenery and the ground, which
    follow.
    """

    things: tuple[Thing, ...]
    meshes: tuple[Mesh, ...]
    classes_behind: tuple[Callable[[], Int32], ...] = ()

    @cached_property
    def part(self) -> Int32:
        """Parts of models, from 1."""
        return self._filled(lambda _, mesh: mesh.triangle_part + 1)

    @cached_property
    def category(self) -> Int32:
        """Ids of categories."""
        return self._filled(lambda thing, _: thing.model.category_id)

    @cached_property
    def material(self) -> Int32:
        """Materials of models, from 1."""
        return self._filled(lambda _, mesh: mesh.triangle_material + 1)

    @cached_property
    def body_part(self) -> Int32:
        """Parts of bodies; 0 if a triangle belongs to none."""
        return self._filled(lambda _, mesh: 0 if mesh.triangle_body_part is None else mesh.triangle_body_part)

    @cached_property
    def classes(self) -> Int32:
        """Classes of things, then those of the scenery and the ground; see `model.annotations.classes`."""
        own = self._filled(lambda thing, _: thing_class(thing.model.category_id))
        return np.concatenate([own, *(classes() for classes in self.classes_behind)])

    def _filled(self, number: Callable[[Thing, Mesh], Int32 | int]) -> Int32:
        ends = list(accumulate((len(mesh.triangles) for mesh in self.meshes), initial=0))
        numbers = np.empty(ends[-1], np.int32)
        for thing, mesh, first, stop in zip(self.things, self.meshes, ends, ends[1:], strict=False):
            numbers[first:stop] = number(thing, mesh)
        return numbers


def scenery_classes(things: Sequence[Thing], meshes: Sequence[Mesh]) -> Int32:
    """Class of each triangle of scenery, (T,)."""
    classes = [
        np.array(stuff_of(thing.model.category, mesh.parts), np.int32)[mesh.triangle_part]
        for thing, mesh in zip(things, meshes, strict=True)
    ]
    return np.concatenate([np.empty(0, np.int32), *classes])


def ground_classes() -> Int32:
    """Class of the ground's two triangles."""
    return np.full(2, GROUND, np.int32)
