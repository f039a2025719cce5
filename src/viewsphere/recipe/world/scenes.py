"""The entry that makes scenes of several models."""

from __future__ import annotations

from typing import Annotated, Any, Literal, cast

from pydantic import BeforeValidator, ConfigDict, Discriminator, Field, JsonValue, Tag, model_validator

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Count, Number
from viewsphere.recipe.draws import CountDrawn, CountOrNone, Distribution, span
from viewsphere.recipe.values import OrShort
from viewsphere.recipe.world.layout import LAYOUT, ON, ORIENTATION, Layout, OnField, Orientation, Spot, placer_of, spots_of


class ScenesEntry(Frozen):
    """Random scenes, each with some of the recipe's models in random places, none of them the main subject."""

    sampler: Literal["scenes"] = Field(default="scenes", description="scenes, or another sampler, beside its options")
    count: Count = Field(description="number of scenes")
    objects: CountDrawn = Field(
        default=cast(int, Distribution(uniform=(2, 5))),
        description="number of models in each: a number, [low, high] or a distribution",
    )
    distractors: CountOrNone = Field(
        default=0,
        description="number of models with labels: background among them, each any number of times: a number, [low, high]"
        " or a distribution",
    )
    repeat: bool = Field(default=False, description="allows a model more than once in a scene")
    views: Count | None = Field(default=None, description="number of viewpoints drawn for each scene; by default all")
    layout: Layout = Field(default="scatter", description=LAYOUT)
    gap: Annotated[Number, Field(ge=0)] = Field(default=0.3, description="least distance between two of them, metres")
    balance: Literal["models", "category"] = Field(
        default="models",
        description="models: draws all models equally often; category: gives all categories equal numbers of objects, to "
        "within one, over all scenes (of a split, with splits by model), as far as each category has enough "
        "models for a scene",
    )
    orientation: Orientation = Field(default="upright", description=ORIENTATION)
    surface: OnField = Field(default=None, description=ON)

    @model_validator(mode="after")
    def _check(self) -> ScenesEntry:
        if self.spots and span(self.objects) != (len(self.spots),) * 2:
            raise ValueError(
                f"expected objects: {len(self.spots)}, one for each place in the layout. Change objects, or the list of places"
            )
        return self

    @property
    def placer(self) -> str:
        """Name of the placer."""
        return placer_of(self.layout)

    @property
    def spots(self) -> tuple[Spot, ...]:
        """The places that the recipe lists."""
        return spots_of(self.layout)

    @property
    def most_objects(self) -> int:
        """Most models in one scene."""
        return int(span(self.objects)[1])


class SamplerEntry(Frozen):
    """Another sampler: its name, and options that the sampler itself checks."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, JsonValue] = Field(init=False)  # pyright: ignore[reportIncompatibleVariableOverride]

    sampler: str = Field(min_length=1, description="name of the sampler")

    @property
    def options(self) -> dict[str, JsonValue]:
        """Everything but the name."""
        return dict(self.__pydantic_extra__)


def _counted(value: Any) -> Any:
    return {"count": value} if isinstance(value, (int, float)) and not isinstance(value, bool) else value


def _kind(value: Any) -> str:
    name = value.get("sampler", "scenes") if isinstance(value, dict) else getattr(value, "sampler", "scenes")
    return "scenes" if name == "scenes" else "other"


ScenesField = Annotated[
    Annotated[ScenesEntry, Tag("scenes")] | Annotated[SamplerEntry, Tag("other")],
    Discriminator(_kind),
    BeforeValidator(_counted),
    OrShort({"type": "integer", "minimum": 1}),
]
