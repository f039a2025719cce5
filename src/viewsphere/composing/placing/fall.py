"""Dropped on the floor, or on things already there, and come to rest; or caught while they fall."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from pydantic import Field

from viewsphere.composing.physics import Board
from viewsphere.composing.placing import Draws, Footprint, Room, Shape, Way, draws_of, footprint
from viewsphere.composing.placing.shared.dropping import Drop, Ground, Matter, poses_of, ways_of
from viewsphere.geometry.box3d import Box3d
from viewsphere.model.fields.numbers import Length
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import IDENTITY, Matrix4
from viewsphere.model.sensors.camera import Camera
from viewsphere.plugins.placer import PlacerSpec
from viewsphere.recipe.draws import Drawn, drawn

LOOSE = 2.0
"""Floor area over which things are dropped, in multiples of their boxes' total."""

TOP = 0.03
"""Thickness of a surface above the floor, metres."""


class _Options(Matter):
    """The options for falling things."""

    spread: tuple[Drawn[Length], Drawn[Length]] | None = Field(
        default=None,
        description="[x, y]: floor area in metres above which things are released; by default twice the area of their boxes",
    )
    moment: Literal["rest", "mid"] = Field(
        default="rest", description="rest: after all lie still; mid: at a random moment before the last one lands"
    )


def _place(
    cast: Sequence[ModelSpec], room: Room, shapes: Sequence[Shape], views: Sequence[Camera], rng: Draws, options: _Options
) -> Sequence[Matrix4]:
    """Poses at rest, or in flight; raises RecipeError if things do not come to rest on the free surface."""
    return poses_of(_fallen(cast, room, shapes, rng, options))


def _ways(cast: Sequence[ModelSpec], room: Room, shapes: Sequence[Shape], rng: Draws, options: _Options) -> Sequence[Way]:
    """Return the path of each falling thing; empty where things are caught in flight."""
    return ways_of(_fallen(cast, room, shapes, rng, options)) if options.moment == "rest" else ()


def _fallen(cast: Sequence[ModelSpec], room: Room, shapes: Sequence[Shape], rng: Draws, options: _Options) -> dict[str, Any]:
    def made() -> dict[str, Any]:
        region = _region(room, shapes, rng, options)
        boards = (_top(room.free, room.below),) if room.free is not None and room.below else ()
        drop = Drop(cast, room, shapes, rng, options, Ground(boards, room.free), region)
        return drop.rested() if options.moment == "rest" else drop.caught()

    return room.memory(made)


def _region(room: Room, shapes: Sequence[Shape], rng: Draws, options: _Options) -> Footprint:
    """The part of the free floor over which things are dropped."""
    if options.spread is not None:
        wide, long = drawn(options.spread, draws_of(rng))
    else:
        around = [*room.prints, *(footprint(shape.box, IDENTITY) for shape in shapes)]
        wide = long = math.sqrt(LOOSE * sum(float(4 * own.half.prod()) for own in around))
    if room.free is None:
        return footprint(Box3d.between((-wide / 2, -long / 2, 0.0), (wide / 2, long / 2, 0.0)).corners, IDENTITY)
    return Footprint(room.free.center, room.free.axes, np.minimum((wide / 2, long / 2), room.free.half))


def _top(free: Footprint, below: float) -> Board:
    """The board of a surface."""
    half, (x, y) = min(TOP, below) / 2, free.center.tolist()
    turn = math.atan2(free.axes[0, 1], free.axes[0, 0])
    return Board((x, y, -half), (float(free.half[0]), float(free.half[1]), half), turn)


PLACER = PlacerSpec(options=_Options, place=_place, ways=_ways, is_slow=True, packages=("mujoco", "scipy"))
