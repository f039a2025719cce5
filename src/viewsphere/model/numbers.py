"""The kinds of number that what a user writes may hold."""

from __future__ import annotations

from typing import Annotated

from pydantic import BeforeValidator, Field

LARGEST = 1e9
"""Of any number in a recipe: metres, degrees, pixels; beyond it what is meant is out of every picture."""


def _whole(value: object) -> object:
    return int(value) if isinstance(value, float) and value.is_integer() else value


Number = Annotated[float, Field(strict=True, ge=-LARGEST, le=LARGEST)]
Positive = Annotated[float, Field(strict=True, gt=0, le=LARGEST)]
Count = Annotated[int, BeforeValidator(_whole), Field(strict=True, ge=1)]
Natural = Annotated[int, BeforeValidator(_whole), Field(strict=True, ge=0)]
