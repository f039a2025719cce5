"""The concrete weather of a scene: fog, rain, snow, wet surfaces, and lit lamps."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Length, Portion

Amount = Annotated[float, Field(strict=True, ge=0, le=1e6)]
Light = tuple[Amount, Amount, Amount]
Exposed = Annotated[float, Field(strict=True, gt=0, le=1)]
Speed = Annotated[float, Field(strict=True, ge=-60, le=60)]

CONTRAST = 3.912
"""Optical depth at which a black thing keeps 2 % of its contrast with the horizon: Koschmieder's visibility (1924)."""


class Fog(Frozen):
    """Air that scatters light: it multiplies light from a thing by exp(-`extinction` * range), and adds its own light for the
    rest.

    With a `height`, the values hold at z = 0, and the extinction falls by a factor of e for each `height` metres above.
    """

    visibility: Annotated[float, Field(strict=True, gt=0, le=1e6)] = Field(
        default=200.0, description="distance in metres at which a black thing keeps 2 % of its contrast"
    )
    height: Length | None = Field(
        default=None, description="height in metres over which it thins by e: ground fog; by default unlimited"
    )
    color: Light = Field(default=(0.8, 0.8, 0.8), description="radiance of the fog itself: linear [r, g, b]")

    @property
    def extinction(self) -> float:
        """Optical depth of a metre, at z = 0."""
        return CONTRAST / self.visibility


class Falling(Frozen):
    """The fields that rain and snow share."""

    rate: Annotated[float, Field(strict=True, gt=0, le=200)] = Field(default=10.0, description="millimetres of water an hour")
    wind: tuple[Speed, Speed] = Field(default=(0.0, 0.0), description="wind [x, y] in metres a second")
    exposure: Exposed = Field(default=0.01, description="exposure time in seconds; longer gives longer streaks")
    color: Light = Field(default=(0.8, 0.8, 0.8), description="radiance of drops or flakes: linear [r, g, b]")
    seed: int = Field(default=0, ge=0, description="seed of the positions of drops or flakes")


class Rain(Falling):
    """Drop sizes by Marshall and Palmer (1948), speeds by Garg and Nayar (2007)."""

    exposure: Exposed = Field(default=0.004, description="exposure time in seconds; longer gives longer streaks")


class Snow(Falling):
    """Flake sizes by Gunn and Marshall (1958), which fall at about a metre a second."""


class Wet(Frozen):
    """Water on surfaces that face up, and in hollows of the ground."""

    amount: Portion = Field(default=1.0, description="0 dry, 1 soaked: darker, with a reflecting film")
    puddles: Portion = Field(default=0.3, description="share of level ground under water")
    seed: int = Field(default=0, ge=0, description="seed of the puddles' positions")


class Lamps(Frozen):
    """Lit lamps of a place: the parts named lens of its pieces."""

    strength: Amount = Field(default=90.0, description="irradiance at one metre below each")
    color: Light = Field(default=(1.0, 0.74, 0.46), description="linear [r, g, b]")
    most: Annotated[int, Field(strict=True, ge=0, le=32)] = Field(
        default=8, description="number of lamps that give light, nearest to the middle of the place first; the others only glow"
    )
    windows: Portion = Field(default=0.35, description="share of lit windows")
