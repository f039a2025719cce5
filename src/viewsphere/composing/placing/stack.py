"""Stacked in stable piles, each at its own spot."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.composing.physics import Touch, World, body_of
from viewsphere.composing.placing import Draws, Room, Shape, draws_of, footprint, standing
from viewsphere.composing.placing.shared.dropping import MOST_OVERLAP, Matter, poses_of
from viewsphere.composing.placing.shared.spot import Others, free_spot
from viewsphere.errors import RecipeError
from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.rotation import transform
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import IDENTITY, Matrix4
from viewsphere.model.sensors.camera import Camera
from viewsphere.plugins.placer import PlacerSpec
from viewsphere.recipe.draws import CountDrawn, drawn

Float = NDArray[np.float64]


TRIES = 12
"""Number of tried orders and turns of one pile."""

AIR = 0.001
"""Metres between one thing and the next when they are piled up."""


class _Options(Matter):
    """The options for piles."""

    high: CountDrawn = Field(
        default=3,
        description="number of models in a pile, a number, [low, high] or a distribution; fewer if more would not stay",
    )


@dataclass(frozen=True, eq=False)
class _Pile:
    """A pile: the numbers of its cast, their poses in the pile's own axes, how many of them stand, and their box."""

    slots: tuple[int, ...]
    poses: tuple[Matrix4, ...]
    standing: int
    box: Float


def _place(
    cast: Sequence[ModelSpec], room: Room, shapes: Sequence[Shape], views: Sequence[Camera], rng: Draws, options: _Options
) -> Sequence[Matrix4]:
    """Poses at rest; raises RecipeError if a pile collapses, or has no room."""
    return poses_of(room.memory(lambda: {"poses": _piled(cast, room, shapes, rng, options)}))


def _piled(cast: Sequence[ModelSpec], room: Room, shapes: Sequence[Shape], rng: Draws, options: _Options) -> list[Matrix4]:
    poses: list[Any] = [IDENTITY] * len(cast)
    others, first, highest, asked = Others(), 0, 1, 1
    for there in room.prints:
        others.add(there)
    while first < len(cast):
        high = min(drawn(options.high, draws_of(rng, "high", str(first))), len(cast) - first)
        pile = _highest(cast, shapes, range(first, first + high), rng, options)
        cover = partial(footprint, pile.box)
        spot = free_spot(rng("pile", cast[first].key, str(first)), room, pile.box, others, cover)
        if spot is None:
            raise RecipeError(f"{room.field}: expected room for piles of {len(cast)} models; found none for {cast[first].key}")
        others.add(cover(spot))
        for slot, pose in zip(pile.slots, pile.poses, strict=True):
            poses[slot] = tuple(map(tuple, (np.round(np.array(spot) @ np.array(pose), 10) + 0.0).tolist()))
        first, highest, asked = first + len(pile.slots), max(highest, len(pile.slots)), max(asked, high)
    if highest < min(asked, 2):
        raise RecipeError(
            f"{room.field}.layout: expected models of which one stays on another, such as {cast[1].key} on {cast[0].key}; "
            f"found none, in {TRIES} tries each: ask for orientation: stable, for more friction, or for models with flat sides"
        )
    return poses


def _highest(cast: Sequence[ModelSpec], shapes: Sequence[Shape], slots: range, rng: Draws, options: _Options) -> _Pile:
    """A pile of these models, or of as many of the first ones as stay on one another."""
    pile = _pile(cast, shapes, tuple(slots), rng, options)
    return pile if pile.standing == len(slots) else _highest(cast, shapes, slots[:-1], rng, options)


def _pile(cast: Sequence[ModelSpec], shapes: Sequence[Shape], slots: tuple[int, ...], rng: Draws, options: _Options) -> _Pile:
    """The first try of a pile that stands, else the try with the most standing models."""
    best: _Pile | None = None
    bodies = [_body(cast[slot], shapes[slot], slot, rng, options) for slot in slots]
    typical = float(np.median([shapes[slot].length for slot in slots]))
    world = World(bodies, [IDENTITY] * len(slots), (), typical)
    for number in range(TRIES):
        own = rng("pile try", str(number), *(cast[slot].key for slot in slots), str(slots[0]))
        pile = _tried(world, shapes, slots, own)
        if best is None or pile.standing > best.standing:
            best = pile
        if best.standing == len(slots):
            break
    assert best is not None
    return best


def _tried(world: World, shapes: Sequence[Shape], slots: tuple[int, ...], own: np.random.Generator) -> _Pile:
    """The result of releasing a pile, in an order that is mostly wide below narrow, with some randomness."""
    areas = [math.prod(np.ptp(shapes[slot].box, axis=0)[:2]) for slot in slots]
    order = sorted(range(len(slots)), key=lambda i: -areas[i] * own.uniform(0.7, 1.4))
    top, starts = 0.0, dict[int, Matrix4]()
    for i in order:
        shape = shapes[slots[i]]
        corners = shape.hull
        middle = corners.mean(axis=0)
        pose = np.array(standing(shape.box, 0.0, 0.0, 360 * own.random()))
        pose[:2, 3] -= (pose[:3, :3] @ middle)[:2]
        pose[2, 3] = top + AIR - float(corners[:, 2].min())
        top += AIR + float(np.ptp(corners[:, 2]))
        starts[i] = poses_of({"poses": [pose.tolist()]})[0]
    world.begin([starts[i] for i in range(len(slots))])

    def fallen() -> frozenset[int]:
        return frozenset(i for pair in world.touching if -1 in pair for i in pair) - {-1, order[0]}

    # Only piles of which nothing fell are used, so the fall of others is not simulated to its end.
    calm = world.settle(ends=lambda: bool(fallen())) and world.deepest <= MOST_OVERLAP
    points = np.concatenate([transform(np.array(p), shapes[s].hull) for p, s in zip(world.poses, slots, strict=True)])
    box = Box3d.around(points).corners
    return _Pile(slots, world.poses, len(slots) - len(fallen()) if calm else 1, box)


def _body(spec: ModelSpec, shape: Shape, slot: int, rng: Draws, options: _Options) -> Any:
    own = drawn(options, draws_of(rng, str(slot), spec.key))
    return body_of([shape.hull], own.density, own.mass, Touch(own.friction, own.restitution))


PLACER = PlacerSpec(options=_Options, place=_place, is_slow=True, packages=("mujoco", "scipy"))
