"""On roads: vehicles along the place's lanes or parked at their right edge, all else on the pavement beside."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.errors import RecipeError
from viewsphere.model.camera import Camera
from viewsphere.model.frozen import Frozen
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.numbers import Length, Portion, Strength
from viewsphere.model.scene import Matrix4
from viewsphere.recipe.draws import Drawn, drawn
from viewsphere.sampling.placing import Draws, Footprint, Room, Shape, draws_of, footprint, standing
from viewsphere.zoo.places import Lane

Float = NDArray[np.float64]

TRIES = 400
"""Spots along the lanes that are tried for one thing."""

VEHICLE = 1.2
"""Metres that a thing is long at least which drives: bicycles and longer. Persons, bins and dogs are shorter."""


class Options(Frozen):
    """Options of traffic: vehicles that drive or park, and walkers."""

    parked: Drawn[Portion] = Field(default=0.35, description="the chance that a vehicle is parked beside its lane")
    bay: Drawn[Strength] = Field(
        default=0.0, description="metres that a parking bay right of the lane is wide; 0: vehicles park at the lane's edge"
    )
    pavement: tuple[Drawn[Strength], Drawn[Strength]] = Field(
        default=(1.5, 2.2),
        description="[near, far]: metres from the right edge of the lane to where others walk, by default between the lamp "
        "posts and the benches of zoo:neighbourhood",
    )
    kerb: Drawn[Strength] = Field(default=0.1, description="metres that the pavement is above the road, as in the zoo's places")
    reach: Drawn[Length] = Field(default=15.0, description="metres from the middle, at most: cameras look at the middle")


def place(
    cast: Sequence[ModelSpec], room: Room, shapes: Sequence[Shape], views: Sequence[Camera], rng: Draws, options: Options
) -> Sequence[Matrix4]:
    """Poses along the lanes, each headed as its lane leads, walkers either way; raises RecipeError where the place has no lanes
    or no spot is found for one.
    """
    if not room.lanes:
        raise RecipeError(
            f"{room.field}.layout: traffic needs a scene.place with lanes, and this one has none. Use zoo:town, "
            "zoo:neighbourhood, or a file with objects named lane"
        )
    room, reach = room.obstacles(shapes), drawn(options.reach, draws_of(rng, "reach"))
    steps = _steps(room.lanes, reach)
    if not len(steps):
        raise RecipeError(f"{room.field}.layout: no lane lies within `reach` {reach:g} m of the middle. Set a larger `reach`")
    prints, poses = list(room.prints), list[Matrix4]()
    for slot, (spec, shape) in enumerate(zip(cast, shapes, strict=True)):
        draws = rng(str(slot), spec.key)
        own = drawn(options, draws_of(rng, str(slot), spec.key))
        placed = _free(draws, room, shape, steps, own, prints)
        if placed is None:
            raise RecipeError(
                f"{room.field}: expected room for {len(cast)} models along the lanes; found none for {spec.key}: ask for "
                "fewer, for a smaller gap or for a larger reach"
            )
        poses.append(placed[0])
        prints.append(placed[1])
    return poses


def _free(
    draws: np.random.Generator, room: Room, shape: Shape, steps: Float, options: Options, others: Sequence[Footprint]
) -> tuple[Matrix4, Footprint] | None:
    """A pose along a lane, and what it covers, clear of others; None where none is found."""
    width, length = (shape.box[4] - shape.box[2])[:2].tolist()
    drives, is_parked = length >= VEHICLE, draws.random() < options.parked
    near, far = options.pavement
    lengths = np.cumsum(steps[:, 2])
    for _ in range(TRIES):
        along, aside, turn = draws.random(3)
        at = int(np.searchsorted(lengths, along * lengths[-1], side="right"))
        x, y, step, cos, sin, half = steps[at]
        back = (lengths[at] - along * lengths[-1]) / step
        right = 0.0 if drives else half + near + aside * max(far - near, 0.0)
        if drives and is_parked:
            right = half + max(options.bay, width) / 2 if options.bay else half - width / 2
        heading = math.degrees(math.atan2(cos, -sin)) + (180.0 if not drives and turn < 0.5 else 0.0)
        spot = (x + (1 - back) * step * cos + right * sin, y + (1 - back) * step * sin - right * cos)
        pose = standing(shape.box, float(spot[0]), float(spot[1]), heading)
        pose = pose if drives else (*pose[:2], (*pose[2][:3], pose[2][3] + options.kerb), pose[3])
        cover = footprint(shape.box, pose)
        if room.is_clear(cover, others):
            return pose, cover
    return None


def _steps(lanes: Sequence[Lane], reach: float) -> Float:
    """The straight parts of lanes near the middle, cut to a metre at most: start x and y, length, direction, half the width."""
    found: list[tuple[float, ...]] = []
    for lane in lanes:
        points = [*lane.points, lane.points[0]] if lane.closed else list(lane.points)
        for (x0, y0, *_), (x1, y1, *_) in pairwise(points):
            length = math.hypot(x1 - x0, y1 - y0)
            parts = max(1, math.ceil(length))
            for i in range(parts if length else 0):
                x, y = x0 + (x1 - x0) * i / parts, y0 + (y1 - y0) * i / parts
                if max(abs(x), abs(y)) <= reach:
                    found.append((x, y, length / parts, (x1 - x0) / length, (y1 - y0) / length, lane.width / 2))
    return np.array(found).reshape(-1, 6)
