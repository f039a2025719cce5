"""On roads: vehicles along the place's lanes or parked in its bays, everything else on its pavements."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.composing.placing import Draws, Footprint, Room, Shape, draws_of, footprint, standing
from viewsphere.composing.placing.shared.crowd import Crowd
from viewsphere.composing.scene.scenery import composed
from viewsphere.errors import RecipeError
from viewsphere.geometry.box3d import Box3d
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Length, Portion, Strength
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.place import Bay, Lane, stretches
from viewsphere.model.scene import Matrix4
from viewsphere.model.sensors.camera import Camera
from viewsphere.plugins.placer import PlacerSpec
from viewsphere.plugins.source import with_roads
from viewsphere.recipe.draws import Drawn, drawn

Float = NDArray[np.float64]

TRIES = 400
"""Spots along the lanes that are tried for one thing."""

VEHICLE = 1.2
"""Least length of a thing that drives, metres: bicycles and longer. Persons, bins and dogs are shorter."""

OVERHANG = 0.3
"""Metres by which a vehicle with its mirrors may be wider than its bay."""

PAVEMENT = (1.5, 2.2)
"""Metres from the right edge of a lane to the path of walkers, in places without pavements."""


class _Options(Frozen):
    """Options of traffic: vehicles that drive or park, and walkers."""

    parked: Drawn[Portion] = Field(default=0.35, description="chance of a vehicle to park, if there is room")
    bay: Drawn[Strength] | None = Field(
        default=None,
        description="width of a parking bay right of the lane, metres; 0: vehicles park at the lane's edge; default: the "
        "place's bays, or the lane's edge",
    )
    pavement: tuple[Drawn[Strength], Drawn[Strength]] | None = Field(
        default=None,
        description="[near, far]: distance of walkers from the lane's right edge, metres; default: the place's pavements,"
        " or [1.5, 2.2]",
    )
    kerb: Drawn[Strength] = Field(default=0.1, description="with `pavement`: height of the pavement above the road, metres")
    reach: Drawn[Length] = Field(
        default=15.0, description="largest distance from the middle in metres; cameras look at the middle"
    )


@dataclass(frozen=True, eq=False)
class _Roads:
    """The lanes, bays and pavements within reach, and the room around them. Lanes and pavements are straight parts."""

    room: Room
    lanes: Float
    bays: tuple[Bay, ...]
    pavements: Float


def _place(
    cast: Sequence[ModelSpec], room: Room, shapes: Sequence[Shape], views: Sequence[Camera], rng: Draws, options: _Options
) -> Sequence[Matrix4]:
    """Poses along the lanes, each in its lane's direction, walkers in either; raises RecipeError if the place has no lanes, or
    if no spot is found for a thing.
    """
    roads = _roads(room, shapes, drawn(options.reach, draws_of(rng, "reach")))
    crowd, poses = Crowd(), list[Matrix4]()
    for there in room.prints:
        crowd.add(there)
    for slot, (spec, shape) in enumerate(zip(cast, shapes, strict=True)):
        draws = rng(str(slot), spec.key)
        own = drawn(options, draws_of(rng, str(slot), spec.key))
        placed = _free(draws, roads, shape, own, crowd)
        if placed is None:
            raise RecipeError(
                f"{room.field}: expected room for {len(cast)} models along the lanes; found none for {spec.key}: ask for "
                "fewer, for a smaller gap or for a larger reach"
            )
        poses.append(placed[0])
        crowd.add(placed[1])
    return poses


def _roads(room: Room, shapes: Sequence[Shape], reach: float) -> _Roads:
    """The part of the place that is used; raises RecipeError if it has no lanes, or none within reach."""
    if not room.lanes:
        raise RecipeError(
            f"{room.field}.layout: traffic needs a scene.place with lanes, and this one has none. Use {with_roads()}, "
            "or a file with objects named lane"
        )
    lanes = _steps(room.lanes, reach)
    if not len(lanes):
        raise RecipeError(f"{room.field}.layout: no lane lies within `reach` {reach:g} m of the middle. Set a larger `reach`")
    bays = tuple(bay for bay in room.bays if max(abs(bay.world_from_bay[0][3]), abs(bay.world_from_bay[1][3])) <= reach)
    longest = max((float(np.ptp(shape.box[:, :2], axis=0).max()) for shape in shapes), default=0.0)
    around = replace(room, built=room.built or room.furniture).obstacles(shapes, reach + longest)
    return _Roads(around, lanes, bays, _steps(room.pavements, reach))


def _free(
    draws: np.random.Generator, roads: _Roads, shape: Shape, options: _Options, others: Crowd
) -> tuple[Matrix4, Footprint] | None:
    """A pose on the roads that is clear of others, and its footprint; None if none is found."""
    drives = _size(shape)[1] >= VEHICLE
    is_parked = draws.random() < options.parked
    if drives and is_parked and options.bay is None and roads.bays:
        poses, is_parked = _in_bays(draws, roads.bays, shape), False
        if (found := _clear(poses, roads.room, shape, others)) is not None:
            return found
    return _clear(_along(draws, roads, shape, options, drives, is_parked), roads.room, shape, others)


def _clear(poses: Iterator[Matrix4], room: Room, shape: Shape, others: Crowd) -> tuple[Matrix4, Footprint] | None:
    """The first pose that is clear of others, and its footprint."""
    for pose in poses:
        cover = footprint(shape.box, pose)
        if room.is_clear(cover, others):
            return pose, cover
    return None


def _in_bays(draws: np.random.Generator, bays: Sequence[Bay], shape: Shape) -> Iterator[Matrix4]:
    """Poses in the middles of bays that are large enough, in the bays' directions."""
    width, length = _size(shape)
    x, y = (-Box3d(shape.box).center[:2]).tolist()
    for i in draws.permutation(len(bays)).tolist():
        if width <= bays[i].size[0] + OVERHANG and length <= bays[i].size[1]:
            yield composed(bays[i].world_from_bay, standing(shape.box, x, y))


def _along(
    draws: np.random.Generator, roads: _Roads, shape: Shape, options: _Options, drives: bool, is_parked: bool
) -> Iterator[Matrix4]:
    """Poses along lanes for vehicles, along pavements for everything else."""
    on_pavement = not drives and options.pavement is None and len(roads.pavements) > 0
    steps = roads.pavements if on_pavement else roads.lanes
    near, far = options.pavement or PAVEMENT
    lengths = np.cumsum(steps[:, 2])
    for _ in range(TRIES):
        along, aside, turn = draws.random(3)
        at = int(np.searchsorted(lengths, along * lengths[-1], side="right"))
        x, y, step, cos, sin, half, z = steps[at]
        forth = step - (lengths[at] - along * lengths[-1])
        if on_pavement:
            right = half * (2 * aside - 1)
        elif drives:
            right = _beside(half, _size(shape)[0], options.bay or 0.0) if is_parked else 0.0
        else:
            right, z = half + near + aside * max(far - near, 0.0), z + options.kerb
        heading = math.degrees(math.atan2(cos, -sin)) + (180.0 if not drives and turn < 0.5 else 0.0)
        pose = standing(shape.box, float(x + forth * cos + right * sin), float(y + forth * sin - right * cos), heading)
        yield (*pose[:2], (*pose[2][:3], pose[2][3] + float(z)), pose[3])


def _beside(half: float, width: float, bay: float) -> float:
    """Metres from a lane's middle to that of a vehicle parked in a bay of this width, or at the lane's edge."""
    return half + max(bay, width) / 2 if bay else half - width / 2


def _size(shape: Shape) -> tuple[float, float]:
    """Width and length."""
    width, length = Box3d(shape.box).diagonal[:2].tolist()
    return width, length


def _steps(lanes: Sequence[Lane], reach: float) -> Float:
    """The straight parts of lanes near the middle, cut to a metre at most: start x and y, length, direction, half the width,
    height.
    """
    steps: list[tuple[float, ...]] = []
    for x0, y0, z, x1, y1, width in (part for lane in lanes for part in stretches(lane)):
        length = math.hypot(x1 - x0, y1 - y0)
        parts = max(1, math.ceil(length))
        for i in range(parts if length else 0):
            x, y = x0 + (x1 - x0) * i / parts, y0 + (y1 - y0) * i / parts
            if max(abs(x), abs(y)) <= reach:
                steps.append((x, y, length / parts, (x1 - x0) / length, (y1 - y0) / length, width / 2, z))
    return np.array(steps).reshape(-1, 7)


PLACER = PlacerSpec(options=_Options, place=_place)
