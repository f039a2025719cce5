"""Dropped into an open box of five boards, which is part of the background, and come to rest."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from pydantic import Field

from viewsphere.composing.physics import Board, body_of
from viewsphere.composing.placing import Draws, Piece, Room, Shape, Way, draws_of, footprint
from viewsphere.composing.placing.shared.dropping import Drop, Ground, Matter, poses_of, ways_of
from viewsphere.errors import RecipeError
from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.open_box import boards
from viewsphere.model.fields.numbers import Length
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import IDENTITY, Matrix4
from viewsphere.model.sensors.camera import Camera
from viewsphere.plugins.placer import PlacerSpec
from viewsphere.plugins.source import model_for
from viewsphere.recipe.draws import Drawn, drawn

FULL = 0.5
"""Largest share of a box's volume for the hulls of randomly fallen models; packings of equal models reach 0.6."""

ROOMY = 0.5
"""Share of a box's volume filled by the models' boxes, if the recipe gives no size."""


class _Options(Matter):
    """The options for things that fall into a box."""

    size: tuple[Drawn[Length], Drawn[Length], Drawn[Length]] | None = Field(
        default=None, description="[width, length, height] of the box outside, metres; by default twice its models' boxes"
    )


def _place(
    cast: Sequence[ModelSpec], room: Room, shapes: Sequence[Shape], views: Sequence[Camera], rng: Draws, options: _Options
) -> Sequence[Matrix4]:
    """Poses at rest in the box; raises RecipeError if the box is too small."""
    return poses_of(_fallen(cast, room, shapes, rng, options))


def _ways(cast: Sequence[ModelSpec], room: Room, shapes: Sequence[Shape], rng: Draws, options: _Options) -> Sequence[Way]:
    """Return the path of each falling thing."""
    return ways_of(_fallen(cast, room, shapes, rng, options))


def _around(cast: Sequence[ModelSpec], room: Room, shapes: Sequence[Shape], rng: Draws, options: _Options) -> Sequence[Piece]:
    """The box."""
    width, height, length = _size(shapes, rng, options)
    return [Piece(model_for("box"), (width, height, length), IDENTITY)]


def _fallen(cast: Sequence[ModelSpec], room: Room, shapes: Sequence[Shape], rng: Draws, options: _Options) -> dict[str, Any]:
    def made() -> dict[str, Any]:
        width, height, length = size = _size(shapes, rng, options)
        _check(cast, room, shapes, size)
        walls = [Board(at, (a / 2, b / 2, c / 2)) for at, (a, b, c) in boards(*size)]
        thick = walls[0].half[2] * 2
        inner = (width / 2 - thick, length / 2 - thick)
        within = footprint(Box3d.between((-inner[0], -inner[1], 0.0), (*inner, 0.0)).corners, IDENTITY)
        under = [Board((0.0, 0.0, -thick), (width, length, thick))] if room.below else []
        ground = Ground((*walls, *under), within, height)
        return Drop(cast, room, shapes, rng, options, ground, within).rested()

    return room.memory(made)


def _size(shapes: Sequence[Shape], rng: Draws, options: _Options) -> tuple[float, float, float]:
    """Width, height and length, outside."""
    if options.size is not None:
        width, length, height = drawn(options.size, draws_of(rng))
        return width, height, length
    volume = sum(math.prod(Box3d(shape.box).size) for shape in shapes) / ROOMY
    longest = max(shape.length for shape in shapes)
    wide = round(max((2.5 * volume) ** (1 / 3), 1.2 * longest), 3)
    return wide, round(0.5 * wide, 3), round(0.8 * wide, 3)


def _check(cast: Sequence[ModelSpec], room: Room, shapes: Sequence[Shape], size: tuple[float, float, float]) -> None:
    """Raise RecipeError if the box cannot hold the models, or does not fit into the room."""
    where, (width, height, length) = f"{room.field}.layout", size
    if room.taken:
        raise RecipeError(f"{where}: expected no container for company, as the model that it joins is not in it; set scenes")
    for half, wide in zip(room.free.half if room.free else (np.inf, np.inf), (width, length), strict=True):
        if wide > 2 * half + 1e-9:
            raise RecipeError(f"{where}: expected a box that fits on the {2 * half:g} m that are free; found one of {wide:g} m")
    longest, diagonal = max(zip((shape.length for shape in shapes), cast, strict=True), key=lambda p: p[0]), math.hypot(*size)
    if longest[0] > diagonal:
        raise RecipeError(
            f"{where}: expected a box with room for {longest[1].key}, which is {longest[0]:.3g} m long; found {width:g} x "
            f"{length:g} x {height:g} m"
        )
    held, volume = width * height * length, sum(float(body_of([shape.hull], 1.0).mass) for shape in shapes)
    if volume > FULL * held:
        raise RecipeError(
            f"{where}: expected a box of at least {volume / FULL:.3g} cubic metres for {len(cast)} models; found {held:.3g}: "
            "ask for fewer, or for a larger box"
        )


PLACER = PlacerSpec(options=_Options, place=_place, ways=_ways, around=_around, is_slow=True, packages=("mujoco", "scipy"))
