"""The light of a recipe's scene: the sun, the sky, and lamps. Its numbers, colours and words may be drawn."""

from __future__ import annotations

import re
from collections.abc import Mapping
from datetime import date, timedelta
from typing import Annotated, Any, Literal, cast

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag, model_validator

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Number, Strength
from viewsphere.model.scene import (
    Daylight,
    Environment,
    Sky,
    Sun,
)
from viewsphere.recipe.draws import Drawn
from viewsphere.recipe.entries import entry_of
from viewsphere.recipe.values import OrShort, shape_of, switch
from viewsphere.validation.errors import error_at, nearest, one_of, shown

SWITCH: list[Any] = [True, False, "on", "off"]
SKY_SUFFIXES = (".exr", ".hdr")
WHEN = ("date", "time", "latitude", "longitude")
_TIME = re.compile(r"(\d\d?):(\d\d)(?::(\d\d))?(?:Z|([+-])(\d\d)(?::?(\d\d))?)\Z")


def _day(value: str) -> str:
    try:
        return date.fromisoformat(value).isoformat()
    except ValueError:
        raise ValueError(f"expected a date such as '2026-06-21'; found {shown(value)}") from None


def _hours(value: Any) -> Any:
    """The hours of a time of day in UTC, below 0 or above 24 if UTC has another date; numbers are returned unchanged."""
    if not isinstance(value, str):
        return value
    match = _TIME.match(value)
    if match is None or int(match[1]) > 24 or int(match[2]) > 59:
        raise ValueError(f"expected a time and its distance from UTC, such as '14:30+02:00' or '12:30Z'; found {shown(value)}")
    hour, minute, second, sign, hours, minutes = match.groups(default="0")
    east = timedelta(hours=int(hours), minutes=int(minutes)) * (-1 if sign == "-" else 1)
    return (timedelta(hours=int(hour), minutes=int(minute), seconds=int(second)) - east) / timedelta(hours=1)


Day = Annotated[str, AfterValidator(_day)]
Hours = Annotated[float, Field(strict=True, ge=-24, le=48), BeforeValidator(_hours), OrShort({"type": "string"})]
ANGLES = ("azimuth", "elevation")


class SunEntry(entry_of(Sun, optional=ANGLES)):
    """The sun: its position, by angles or by date, time and place, and its light."""

    date: Drawn[Day] | None = Field(default=None, description="or from a date, '2026-06-21'; north is +Y")
    time: Drawn[Hours] | None = Field(
        default=None, description="with date: '14:30+02:00', with the offset from UTC, or hours of the day in UTC"
    )
    latitude: Drawn[Annotated[float, Field(strict=True, ge=-90, le=90)]] | None = Field(
        default=None, description="with date: degrees north"
    )
    longitude: Drawn[Annotated[float, Field(strict=True, ge=-180, le=180)]] | None = Field(
        default=None, description="with date: degrees east"
    )

    @model_validator(mode="after")
    def _check(self) -> SunEntry:
        given = [name for name in WHEN if getattr(self, name) is not None]
        if given and len(given) < len(WHEN):
            raise ValueError(f"expected {', '.join(WHEN)} together; found {', '.join(given)}")
        if given and any(getattr(self, name) is not None for name in ANGLES):
            raise ValueError("expected angles or date, time and place, not both; found both")
        return self


def _sun(value: Any) -> Any:
    on = switch(value)
    return value if on is None else ("on" if on else "off")


SunField = Annotated[
    Annotated[SunEntry, Tag("mapping")] | Annotated[Literal["auto", "on", "off"], Tag("text")],
    Discriminator(shape_of, custom_error_type="sun", custom_error_message="expected auto, on, off or a mapping"),
    BeforeValidator(_sun),
    OrShort({"enum": SWITCH}),
]


class GradientEntry(entry_of(Sky, without=("kind",))):
    """Ambient light from above: a vertical gradient."""


class DaylightEntry(entry_of(Daylight, without=("kind",))):
    """A sky that follows from the sun's position."""


class DaylightSky(Frozen):
    """A sky that follows from the sun's position."""

    daylight: DaylightEntry = Field(description="sky computed from the sun's position: turbidity, clouds, strength")


class NightEntry(Frozen):
    """A sky without the sun, as seen in a long exposure."""

    moon: Drawn[Strength] = Field(default=0.1, description="irradiance on a surface that faces the moon, in the sky's units")
    azimuth: Drawn[Number] = Field(default=-60.0, description="azimuth of the moon, degrees, as for cameras")
    elevation: Drawn[Annotated[float, Field(strict=True, gt=0, le=90)]] = Field(
        default=45.0, description="degrees above the horizon"
    )
    glow: Drawn[Strength] = Field(default=0.05, description="radiance of town lights at the horizon")


class NightSky(Frozen):
    """A sky of night."""

    night: NightEntry = Field(description="night sky: moon and glow")


class HdriSky(entry_of(Environment, without=("kind", "file"))):
    """Light from a picture of the whole sphere."""

    hdri: Drawn[Annotated[str, Field(min_length=1)]] = Field(
        description="an EXR or HDR file of the whole sphere (equirectangular), or a folder of them to draw from"
    )


SKIES = tuple(
    dict.fromkeys([*GradientEntry.model_fields, *DaylightSky.model_fields, *NightSky.model_fields, *HdriSky.model_fields])
)
"""The fields of all kinds of sky."""


def _sky(value: Any) -> Any:
    if isinstance(value, str):
        return {value: {}} if value in ("daylight", "night") else {"hdri": value}
    if isinstance(value, Mapping):
        for name in cast(Mapping[Any, Any], value):
            if nearest(name, SKIES) and name not in SKIES:
                with error_at(str(name)):
                    raise ValueError(one_of(name, SKIES))
    elif not isinstance(value, Frozen):
        raise ValueError(f"expected daylight, night, the path of an EXR or HDR file, or a mapping; found {shown(value)}")
    return cast(Any, value)


def _kind_of_sky(value: Any) -> str:
    if isinstance(value, Mapping):
        known = {"hdri": "an hdri", "daylight": "a daylight", "night": "a night"}
        return next((tag for name, tag in known.items() if name in value), "a gradient")
    return {HdriSky: "an hdri", DaylightSky: "a daylight", NightSky: "a night"}.get(type(value), "a gradient")


SkyField = Annotated[
    Annotated[GradientEntry, Tag("a gradient")]
    | Annotated[DaylightSky, Tag("a daylight")]
    | Annotated[NightSky, Tag("a night")]
    | Annotated[HdriSky, Tag("an hdri")],
    Discriminator(_kind_of_sky),
    BeforeValidator(_sky),
    OrShort({"type": "string"}),
]
