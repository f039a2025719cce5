"""The weather of a recipe's scene: fog, rain, falling snow, and wet ground. Its numbers may be random."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Discriminator, Field, Tag

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Portion
from viewsphere.model.weather import Fog, Lamps, Light, Rain, Snow, Wet
from viewsphere.recipe.draws import Drawn, span
from viewsphere.recipe.entries import entry_of
from viewsphere.recipe.values import OrShort, shape_of, switch
from viewsphere.validation.errors import error_at, nearest

HEAVY = {"rain": 7.6, "snow": 2.5}
"""Millimetres of water an hour above which meteorologists call rain, and snow, heavy."""


class FogEntry(entry_of(Fog)):
    """Air that scatters light."""

    color: Drawn[Light] | None = Field(  # pyright: ignore[reportIncompatibleVariableOverride]
        default=None, description="radiance of the fog itself: linear [r, g, b]; by default from sun and sky"
    )


class _FallingEntry(Frozen):
    """The further fields that rain and snow share."""

    color: Drawn[Light] | None = Field(
        default=None, description="radiance of drops or flakes: linear [r, g, b]; by default the sky's"
    )
    clouds: Drawn[Portion] = Field(default=1.0, description="cloud cover of the sky: 1 hides the sun")


class RainEntry(entry_of(Rain, without=("seed",)), _FallingEntry):  # pyright: ignore[reportIncompatibleVariableOverride]
    """Falling rain, with an overcast sky and wet surfaces."""


class SnowEntry(entry_of(Snow, without=("seed",)), _FallingEntry):  # pyright: ignore[reportIncompatibleVariableOverride]
    """Falling snow, with an overcast sky."""


class WetEntry(entry_of(Wet, without=("seed",))):
    """Water on surfaces that face up; rain adds it by default."""


class LampsEntry(entry_of(Lamps)):
    """Lit lamps of a place."""


def _short(name: str, words: tuple[str, ...]) -> BeforeValidator:
    """A number, or a range of numbers, as a mapping with the most important field."""

    def read(value: Any) -> Any:
        if value is False:
            return "off"
        is_number = isinstance(value, (int, float, list, tuple)) and not isinstance(value, bool)
        if isinstance(value, str) and value not in words:
            raise ValueError(
                f"expected {', '.join(words)}, a number ({name}), or a mapping; found {value!r}{nearest(value, words)}"
            )
        return {name: value} if is_number else value

    return BeforeValidator(read)


Off = Annotated[Literal["off"], Tag("text")]
Auto = Annotated[Literal["off", "auto"], Tag("text")]
SHAPE, NUMBERS = Discriminator(shape_of), OrShort({"type": ["number", "array"]})
FogField = Annotated[Annotated[FogEntry, Tag("mapping")] | Off, SHAPE, _short("visibility", ("off",)), NUMBERS]
RainField = Annotated[Annotated[RainEntry, Tag("mapping")] | Off, SHAPE, _short("rate", ("off",)), NUMBERS]
SnowField = Annotated[Annotated[SnowEntry, Tag("mapping")] | Off, SHAPE, _short("rate", ("off",)), NUMBERS]
WetField = Annotated[Annotated[WetEntry, Tag("mapping")] | Auto, SHAPE, _short("amount", ("auto", "off")), NUMBERS]


def _lamps(value: Any) -> Any:
    on = switch(value)
    return value if on is None else {} if on else "off"


LampsField = Annotated[
    Annotated[LampsEntry, Tag("mapping")] | Auto, SHAPE, BeforeValidator(_lamps), OrShort({"enum": [True, False, "on"]})
]


def check_weather(rain: object, snow: object) -> None:
    """Raise ValueError for rain and snow that are both heavy, which does not occur at any temperature."""
    if isinstance(rain, RainEntry) and isinstance(snow, SnowEntry):
        least = {"rain": span(rain.rate)[0], "snow": span(snow.rate)[0]}
        if all(least[name] >= HEAVY[name] for name in HEAVY):
            with error_at("snow"):
                raise ValueError(
                    f"expected less than {HEAVY['snow']:g} mm/h beside heavy rain (from {HEAVY['rain']:g}); found "
                    f"{least['snow']:g}: sleet has little of one of them"
                )
