"""The surfaces of a model on which things can stand: its level faces, as data."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Surface:
    """A level face of a model on which things stand, in the model's axes, metres.

    rectangle: low x, low y, high x, high y of what is free of it; height: its z; clearance: what is free above it, inf under
    the open sky. On cushions and bedding the mesh may lie up to 3 cm above or below `height`.
    """

    name: str
    rectangle: tuple[float, float, float, float]
    height: float
    clearance: float = math.inf


def shrunk(name: str, half: tuple[float, float], height: float, margin: float = 0.02, clearance: float = math.inf) -> Surface:
    """The face of a centred rectangle of these half widths, `margin` inside its border."""
    x, y = (max(h - margin, 0.01) for h in half)
    return Surface(name, (-x, -y, x, y), height, clearance)
