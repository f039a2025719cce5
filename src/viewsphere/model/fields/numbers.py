"""The kinds of number that recipes and scenes hold, with the limits of each."""

from __future__ import annotations

from typing import Annotated

from pydantic import BeforeValidator, Field

LARGEST = 1e9
"""Largest absolute value of any number in a recipe (metres, degrees, pixels): anything beyond is outside every picture."""

FARTHEST = 1e5
"""Largest distance, in metres, of anything from a scene's middle, equal to the largest model: float32 is too coarse beyond."""


def whole(value: object) -> object:
    """A float without a fraction as a whole number; anything else as it is."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


Number = Annotated[float, Field(strict=True, ge=-LARGEST, le=LARGEST)]
Positive = Annotated[float, Field(strict=True, gt=0, le=LARGEST)]
Strength = Annotated[float, Field(strict=True, ge=0, le=LARGEST)]
Amount = Annotated[float, Field(strict=True, ge=0, le=1e6)]
Portion = Annotated[float, Field(strict=True, ge=0, le=1)]
Signed = Annotated[float, Field(strict=True, ge=-1, le=1)]
Length = Annotated[float, Field(strict=True, gt=0, le=FARTHEST)]
Metres = Annotated[float, Field(strict=True, ge=-FARTHEST, le=FARTHEST)]
Count = Annotated[int, BeforeValidator(whole), Field(strict=True, ge=1)]
Natural = Annotated[int, BeforeValidator(whole), Field(strict=True, ge=0)]
