"""Spread over the free floor, turned at random: uniform over all clear spots; on an endless floor, and for company of a model,
close together as in `heap_together`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.composing.placing import Draws, Footprint, Room, Shape, draws_of
from viewsphere.composing.placing.shared.scattered import Gaps, scattered
from viewsphere.composing.placing.shared.spot import Cover, Others, free_spot, spread_spot
from viewsphere.model.fields.numbers import Length
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Matrix4
from viewsphere.model.sensors.camera import Camera
from viewsphere.plugins.placer import PlacerSpec
from viewsphere.recipe.draws import Drawn, drawn

NEAR = 10.0
"""Radius around the middle, in metres, for models that have room there: cameras look at the middle, and a street is 200 m
long.
"""

LOOSE = 8.0
"""Ratio of the floor's area to that of the models' boxes: 20 cars in a street with furniture find room at the first draw."""


class _Options(Gaps):
    """Options: gaps between models, and their distance from the middle."""

    reach: Drawn[Length] | None = Field(
        default=None,
        description="largest distance from the middle along and across the floor, metres; default: 10, or more if the "
        "models need more room; cameras look at the middle",
    )


def _place(
    cast: Sequence[ModelSpec], room: Room, shapes: Sequence[Shape], views: Sequence[Camera], rng: Draws, options: _Options
) -> Sequence[Matrix4]:
    """Poses, no two boxes, or hulls, nearer than the room's gap; raises RecipeError if no spot is found for one."""
    if room.free is None or room.taken:
        return scattered(cast, room, shapes, rng, options, free_spot)
    if options.reach is None:
        floor = _roomy(room.free, shapes)
    else:
        floor = _within(room.free, drawn(options.reach, draws_of(rng, "reach")))

    def spot(draws: np.random.Generator, room: Room, box: NDArray[np.float64], others: Others, cover: Cover) -> Matrix4 | None:
        return spread_spot(draws, room, floor, box, others, cover)

    return scattered(cast, room, shapes, rng, options, spot, floor)


def _roomy(free: Footprint, shapes: Sequence[Shape]) -> Footprint:
    """The part of a floor around the middle that holds the models loosely; all of a smaller floor."""
    needed = LOOSE * sum(float(np.prod(shape.box[4, :2] - shape.box[2, :2])) for shape in shapes)
    reach, all_of_it = NEAR, float((np.abs(free.axes @ free.center) + free.half).max())
    floor = _within(free, reach)
    while 4 * float(np.prod(floor.half)) < needed and reach < all_of_it and (floor.half < free.half).any():
        reach *= 2
        floor = _within(free, reach)
    return floor


def _within(floor: Footprint, reach: float) -> Footprint:
    """The part of a floor within `reach` of the origin along its axes; the whole floor if all of it is farther away."""
    middle = floor.axes @ floor.center
    low, high = np.maximum(middle - floor.half, -reach), np.minimum(middle + floor.half, reach)
    if (high <= low).any():
        return floor
    return replace(floor, center=(low + high) / 2 @ floor.axes, half=(high - low) / 2)


PLACER = PlacerSpec(options=_Options, place=_place)
