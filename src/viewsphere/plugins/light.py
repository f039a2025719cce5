"""The spec of a light: a kind of lamp in recipes, as lights that every engine renders."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, ClassVar, Self

from pydantic import Field, model_validator

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.scene import AnyLight
from viewsphere.plugins.registry import Kind
from viewsphere.plugins.spec import Spec

ALL_LAMPS = ("kind", "count", "strength", "color")
"""Fields that the options of all lights have."""


class LightSpec(Spec):
    """One kind of lamp, with its options in recipes. It shines as points, spots, areas and hemispheres of
    `viewsphere.model.scene`, so every engine renders it.
    """

    KIND: ClassVar[Kind] = "lights"

    options: type[Frozen] = Field(
        description="the class of the options, upon `Lamp`, `Placed` or `Aimed` of `viewsphere.recipe.lights`; its field "
        "`kind` has the light's name as its only value"
    )
    emitters: Callable[[Any], Sequence[AnyLight]] = Field(
        description="`emitters(lamp)`: the `PointLight`s, `SpotLight`s, `AreaLight`s and `HemisphereLight`s of one lamp, whose "
        "options are all drawn; positions are metres from the centre of the targets' box"
    )
    is_sky: bool = Field(default=False, description="whether it is light of the sky, which a .blend scene has itself")

    @model_validator(mode="after")
    def _check_options(self) -> Self:
        return self.with_fields_of("options", ALL_LAMPS)
