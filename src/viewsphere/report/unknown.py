"""Numbers for JSON, with null for unknown ones."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from numpy.typing import NDArray

DIGITS = 6


def number(value: float) -> float | None:
    """The value with six significant digits, as JSON takes it; None for NaN and infinities."""
    value = float(value)
    if not math.isfinite(value):
        return None
    rounded = float(f"{value:.{DIGITS}g}")
    return int(rounded) if rounded.is_integer() else rounded


def numbers(values: Iterable[float] | NDArray[Any]) -> list[float | None]:
    """Each of some values as `number` gives it."""
    return [number(v) for v in values]
