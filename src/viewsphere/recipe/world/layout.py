"""The recipe's entries for the places of models that share a frame.

`viewsphere.composing.placing` has the placers and their options.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, ConfigDict, Discriminator, Field, JsonValue, Tag

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Length, Metres, Number
from viewsphere.recipe.values import shape_of

Spot = tuple[Metres, Metres, Number]

Orientation = Literal["upright", "any", "stable"]

ORIENTATION = (
    "upright; any: turned at random in all directions, uniform over rotations, on the lowest point; or stable: as it may lie "
    "on a floor, each way as likely as its hull is to come to rest so"
)
LAYOUT = (
    "scatter: spread over the free floor, turned at random; heap_together: close by; row: side by side; grid; traffic: along "
    "the place's lanes; fall: dropped; container: into a box; stack; volume: in the air; another placer's name; {kind: fall, "
    "friction: 0.5}, with options of the placer; or where each stands: [x, y, azimuth in degrees]"
)


class LayoutEntry(Frozen):
    """A placer, and options that the placer itself checks."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, JsonValue] = Field(init=False)  # pyright: ignore[reportIncompatibleVariableOverride]

    kind: str = Field(min_length=1, description="scatter, row, grid, fall, container, stack, volume, or one of your own")

    @property
    def options(self) -> dict[str, JsonValue]:
        """The options of the placer."""
        return dict(self.__pydantic_extra__)


def _renamed(value: Any) -> Any:
    """The placer's present name: `random` is a former name of `scatter`. The placer of listed spots is selected only by a
    list.
    """
    if value == "listed":
        raise ValueError("expected a placer, such as scatter or row, or a list of [x, y, azimuth]; found listed without spots")
    return "scatter" if value == "random" else value


Layout = Annotated[
    Annotated[str, Tag("text")]
    | Annotated[tuple[Spot, ...], Field(min_length=1), Tag("list")]
    | Annotated[LayoutEntry, Tag("mapping")],
    Discriminator(
        shape_of,
        custom_error_type="layout",
        custom_error_message="expected a placer, such as scatter or row, or a list of [x, y, azimuth]",
    ),
    BeforeValidator(_renamed),
]


class SurfaceEntry(Frozen):
    """A visible table top in the middle of the scene, with legs if it is high enough."""

    size: tuple[Length, Length] = Field(description="[width along x, depth along y], metres")
    height: Length = Field(description="metres above the floor")


OnField = (
    Annotated[
        Annotated[str, Field(min_length=1), Tag("text")] | Annotated[SurfaceEntry, Tag("mapping")],
        Discriminator(
            shape_of,
            custom_error_type="surface",
            custom_error_message="expected the name of a surface of the place, or {size: [width, depth], height}",
        ),
    ]
    | None
)

ON = "what they stand on instead of the floor: a surface of scene.place, or {size: [1.2, 0.8], height: 0.75}, a table"


def placer_of(layout: Layout) -> str:
    """Name of the placer."""
    match layout:
        case str():
            return layout
        case LayoutEntry():
            return layout.kind
        case _:
            return "listed"


def options_of(layout: Layout) -> dict[str, JsonValue]:
    """The placer's options from the recipe."""
    return layout.options if isinstance(layout, LayoutEntry) else {}


def spots_of(layout: Layout) -> tuple[Spot, ...]:
    """The places that the recipe lists."""
    return layout if isinstance(layout, tuple) else ()
