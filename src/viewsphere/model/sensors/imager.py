"""The sensor behind a lens: the numbers that turn light into digital numbers, and these into a picture.

The model is that of EMVA standard 1288, release 4.0 (https://www.emva.org/standards-technology/emva-1288/): Poisson photon
noise, Gaussian noise of the electronics, a linear response, a converter. Exposure follows ISO 12232: a focal-plane exposure of
78 / ISO lux seconds saturates, and the light of a scene of L cd/m2 gives 0.65 L t / N^2 lux seconds at f-number N.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Count, Natural, Number, Portion, Positive, Strength
from viewsphere.validation.errors import error_at, shown

SATURATION = 120.0
"""78 / 0.65 of ISO 12232: scene-referred luminance x seconds x ISO / f-number^2 that saturates the sensor."""

SUNLIT = 1e5 / 3
"""Luminance of unit radiance, cd/m2: the default sun, of irradiance 3, then gives 100,000 lx, as a clear sky's sun does."""

GREY = 1e-3
"""Largest difference from 1 of the sum of a row of the colour matrix, so that grey stays grey."""

SINGULAR = 1e-3
"""Least determinant of a colour matrix, whose inverse gives the sensor's colours."""

READINGS = 7
"""Readings that automatic settings follow: all but exp(-3.5), 3 %, of an exponential memory."""

STEPS = 64
"""Radii at which the polynomial of the vignetting is checked."""

Row = tuple[Number, Number, Number]
Matrix3 = tuple[Row, Row, Row]
Shift = Annotated[float, Field(strict=True, ge=-0.1, le=0.1)]
Kelvin = Annotated[float, Field(strict=True, ge=1500, le=20000)]


def _kind(value: object) -> str:
    return "word" if isinstance(value, str) else "number"


OrAuto = Annotated[
    Annotated[Positive, Tag("number")] | Annotated[Literal["auto"], Tag("word")],
    Discriminator(_kind),
]
White = Annotated[
    Annotated[Kelvin, Tag("number")] | Annotated[Literal["daylight", "auto"], Tag("word")],
    Discriminator(_kind),
]

IDENTITY: Matrix3 = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class Imager(Frozen):
    """Sensor, exposure, and the lens's faults that pictures show; labels never change."""

    full_well: Positive = Field(description="electrons that saturate a pixel")
    read_noise: Strength = Field(description="sigma of the pixel's read noise in electrons, at any gain")
    adc_noise: Strength = Field(
        default=0.0, description="sigma of the converter's noise in electrons at base_iso; gain divides it"
    )
    bits: Annotated[Count, Field(ge=8, le=16)] = Field(default=12, description="bits of the converter")
    black_level: Natural = Field(default=0, description="digital number without light")
    base_iso: Positive = Field(default=100.0, description="ISO at which the full well is the largest digital number")
    pattern: Literal["rggb", "bggr", "grbg", "gbrg"] = Field(
        default="rggb", description="colour filters of the top left 2 x 2 pixels, row by row"
    )
    response: tuple[Positive, Positive, Positive] = Field(
        default=(1.0, 1.0, 1.0), description="signal [r, g, b] of white daylight (D65), green 1"
    )
    matrix: Matrix3 = Field(
        default=IDENTITY, description="3x3 matrix from the sensor's balanced colours to linear sRGB; each row adds up to 1"
    )
    exposure: OrAuto = Field(default="auto", description="exposure time in seconds, or auto")
    iso: OrAuto = Field(default="auto", description="ISO speed, base_iso or more, or auto")
    gain_db: Strength | None = Field(default=None, description="instead of iso: decibels of gain over base_iso")
    compensation: Annotated[Number, Field(ge=-10, le=10)] = Field(
        default=0.0, description="stops by which auto pictures are brighter"
    )
    longest: Positive | None = Field(
        default=None, description="longest automatic exposure, seconds; by default 1/30, in sequences at most a frame's time"
    )
    most_iso: Positive = Field(default=6400.0, description="largest automatic ISO")
    adaptation: Annotated[Strength, Field(le=60)] = Field(
        default=0.3, description="seconds in which auto exposure and white balance follow the light of a sequence; 0: at once"
    )
    f_number: Positive = Field(default=2.8, description="f-number of the lens, which sets the light on the sensor")
    luminance: Positive = Field(default=SUNLIT, description="cd/m2 of unit light; by default the default sun gives 100,000 lx")
    white_balance: White = Field(
        default="daylight", description="light that becomes neutral: daylight (D65), kelvins, or auto (the mean of the picture)"
    )
    demosaic: Literal["malvar", "bilinear"] = Field(default="malvar", description="interpolation of the missing colours")
    cos4: bool = Field(default=True, strict=True, description="natural vignetting: cos^4 of each ray's angle to the axis")
    vignetting: Annotated[tuple[Number, ...], Field(max_length=4)] = Field(
        default=(),
        description="[a1, a2, ...]: the lens's share of light is 1 + a1 r^2 + a2 r^4 + ..., with r 1 at the farthest corner",
    )
    chromatic_aberration: tuple[Shift, Shift] = Field(
        default=(0.0, 0.0), description="[red, blue]: enlargement relative to green, such as 0.001"
    )
    bloom: Portion = Field(default=0.0, description="share of the light that scatters around its place")
    bloom_size: Annotated[Positive, Field(le=0.2)] = Field(
        default=0.02, description="sigma of the scattered light, as a share of the picture's width"
    )
    flare: Portion = Field(default=0.0, description="share of the light that lens reflections add, mirrored about the axis")

    @model_validator(mode="after")
    def _check(self) -> Imager:
        for name, wrong in self._wrong():
            with error_at(name):
                raise ValueError(wrong)
        return self

    def _wrong(self) -> Iterator[tuple[str, str]]:
        """The fields that do not fit one another, each with the reason."""
        if self.black_level >= self.white_level:
            most = f"less than {self.white_level}, the largest of {self.bits} bits"
            yield "black_level", f"expected {most}; found {self.black_level}"
        for name in ("iso", "most_iso"):
            value = getattr(self, name)
            if value != "auto" and value < self.base_iso:
                yield name, f"expected base_iso, {self.base_iso:g}, or more; found {value:g}"
        if self.gain_db is not None and self.iso != "auto":
            yield "gain_db", f"expected iso or gain_db; found both, {self.iso:g} and {self.gain_db:g} dB"
        if self.response[1] != 1:
            yield "response", f"expected 1 for green, to which red and blue are relative; found {self.response[1]:g}"
        if any(abs(sum(row) - 1) > GREY for row in self.matrix):
            yield "matrix", f"expected rows that add up to 1, which keep grey; found {shown(self.matrix)}"
        if abs(_determinant(self.matrix)) < SINGULAR:
            yield "matrix", f"expected a matrix with an inverse; found {shown(self.matrix)}"
        if any(self._share(i / STEPS) <= 0 for i in range(STEPS + 1)):
            yield "vignetting", f"expected shares above 0 up to the corner; found {list(self.vignetting)}"

    def _share(self, squared: float) -> float:
        """The polynomial of the vignetting at a squared radius, 1 at the farthest corner."""
        return 1.0 + sum(a * squared ** (i + 1) for i, a in enumerate(self.vignetting))

    @property
    def white_level(self) -> int:
        """The largest digital number."""
        return 2**self.bits - 1

    @property
    def fixed_iso(self) -> float | None:
        """The ISO that the recipe sets, None if it is automatic."""
        if self.gain_db is not None:
            return self.base_iso * 10.0 ** (self.gain_db / 20)
        return None if self.iso == "auto" else self.iso

    @property
    def fixed_exposure(self) -> float | None:
        """The exposure time that the recipe sets, seconds; None if it is automatic."""
        return None if self.exposure == "auto" else self.exposure

    @property
    def is_metered(self) -> bool:
        """Return whether exposure, ISO or white balance follow from the light."""
        return self.fixed_iso is None or self.fixed_exposure is None or self.white_balance == "auto"


class MountedImager(Imager):
    """The imager of one sensor of a shot. `fps`: instants per second of a sequence, None for still pictures."""

    fps: Positive | None = None

    @property
    def longest_exposure(self) -> float:
        """The longest automatic exposure, seconds."""
        longest = 1 / 30 if self.longest is None else self.longest
        return longest if self.fps is None else min(longest, 1 / self.fps)

    def metering(self, instant: int) -> dict[int, float]:
        """The numbers of the instants of a sequence whose light sets an instant's exposure, each with its weight; empty if the
        picture's own light does.

        They are multiples of half the adaptation's time, up to now, and weigh less the older they are. The light before the
        first instant is that of the first.
        """
        frames = 0.0 if self.fps is None else self.adaptation * self.fps
        if not frames or not self.is_metered:
            return {}
        step = max(1, round(frames / 2))
        weights: dict[int, float] = {}
        for number in range(READINGS):
            at = instant - instant % step - number * step
            weights[max(at, 0)] = weights.get(max(at, 0), 0.0) + math.exp((at - instant) / frames)
        return weights


def _determinant(m: Matrix3) -> float:
    (a, b, c), (d, e, f), (g, h, i) = m
    return a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
