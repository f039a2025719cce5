"""In the air: anywhere in a box above the floor, without overlaps, as in FlyingThings3D (Mayer et al. 2016)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.composing.placing import Draws, Room, Shape, draws_of
from viewsphere.errors import RecipeError
from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.rotation import rigid, rotation_about, transform
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Length, Strength
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Matrix4
from viewsphere.model.sensors.camera import Camera
from viewsphere.plugins.placer import PlacerSpec
from viewsphere.recipe.draws import Drawn, drawn

Float = NDArray[np.float64]

TRIES = 500
"""Spots that are tried for one thing."""

ROOMY = 0.08
"""Share of the volume filled by the things' boxes, if the recipe gives no size."""


class _Options(Frozen):
    """The positions of things in the air."""

    size: tuple[Drawn[Length], Drawn[Length], Drawn[Length]] | None = Field(
        default=None, description="[x, y, z]: size of the box around all, metres; by default a cube of twelve times their boxes"
    )
    height: Drawn[Strength] = Field(default=0.0, description="height of that box above the floor, metres")


def _place(
    cast: Sequence[ModelSpec], room: Room, shapes: Sequence[Shape], views: Sequence[Camera], rng: Draws, options: _Options
) -> Sequence[Matrix4]:
    """Poses turned about the vertical at random, with no two turned boxes nearer than the room's gap; raises RecipeError if no
    spot is found for a thing.
    """
    size, height = _extent(shapes, rng, options)
    if room.clearance is not None and height + size[2] > room.clearance:
        raise RecipeError(
            f"{room.field}.layout: expected a volume below the {room.clearance:g} m of air there; found one up to "
            f"{height + size[2]:g} m"
        )
    boxes = [transform(np.array(pose), shape.box) for shape, pose in room.taken]
    poses: list[Matrix4] = []
    for slot, (spec, shape) in enumerate(zip(cast, shapes, strict=True)):
        pose = _pose(rng(str(slot), spec.key), room, shape.box, boxes, size, height)
        if pose is None:
            raise RecipeError(
                f"{room.field}.layout: expected room for {len(cast)} models in {size[0]:.3g} x {size[1]:.3g} x {size[2]:.3g} "
                f"m; found it for {slot}: ask for fewer, for a smaller gap, or for a larger size"
            )
        poses.append(pose)
        boxes.append(transform(np.array(pose), shape.box))
    return poses


def _extent(shapes: Sequence[Shape], rng: Draws, options: _Options) -> tuple[Float, float]:
    """Size (3,) of the box, and the height of its bottom."""
    height = drawn(options.height, draws_of(rng, "height"))
    if options.size is not None:
        return np.array(drawn(options.size, draws_of(rng, "size"))), height
    volume = sum(math.prod(Box3d(shape.box).size) for shape in shapes) / ROOMY
    longest = max(float(np.linalg.norm(Box3d(shape.box).diagonal)) for shape in shapes)
    return np.full(3, max(volume ** (1 / 3), 1.2 * longest)), height


def _pose(
    rng: np.random.Generator, room: Room, box: Float, others: Sequence[Float], size: Float, height: float
) -> Matrix4 | None:
    """A pose clear of the others and entirely in the volume; None if none is found."""
    low = np.array([-size[0] / 2, -size[1] / 2, height])
    for _ in range(TRIES):
        turn = rotation_about((0.0, 0.0, 2 * math.pi * rng.random()))
        corners = transform(turn, box)
        free = size - np.ptp(corners, axis=0)
        shift = low - corners.min(axis=0) + rng.random(3) * free
        if (free >= 0).all() and all(apart(corners + shift, other, room.gap) for other in others):
            rows: list[list[float]] = rigid(turn, shift).tolist()
            return tuple(map(tuple, rows))  # type: ignore[return-value]
    return None


def apart(a: Float, b: Float, gap: float) -> bool:
    """Return whether two oriented boxes with these corners (8, 3) are separated by at least a gap, along an axis of one box or
    a cross product of two axes (Gottschalk, Lin, Manocha 1996).
    """
    sides = [(c[1] - c[0], c[3] - c[0], c[4] - c[0]) for c in (a, b)]
    crosses = (np.cross(s, t) for s, t in product(*sides))
    for axis in (*sides[0], *sides[1], *crosses):
        length = float(np.linalg.norm(axis))
        if length > 1e-9:
            one, other = a @ axis / length, b @ axis / length
            if max(one.min() - other.max(), other.min() - one.max()) >= gap - 1e-9:
                return True
    return False


PLACER = PlacerSpec(options=_Options, place=_place)
