"""Close together, turned at random: one after another, uniform in a circle that grows until there is room."""

from __future__ import annotations

from collections.abc import Sequence

from viewsphere.composing.placing import Draws, Room, Shape
from viewsphere.composing.placing.shared.scattered import Gaps, scattered
from viewsphere.composing.placing.shared.spot import free_spot
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Matrix4
from viewsphere.model.sensors.camera import Camera
from viewsphere.plugins.placer import PlacerSpec


class _Options(Gaps):
    """Options of how closely models stand."""


def _place(
    cast: Sequence[ModelSpec], room: Room, shapes: Sequence[Shape], views: Sequence[Camera], rng: Draws, options: _Options
) -> Sequence[Matrix4]:
    """Poses near the middle, or near things already in place; raises RecipeError if no spot is found for a model."""
    return scattered(cast, room, shapes, rng, options, free_spot)


PLACER = PlacerSpec(options=_Options, place=_place)
