"""The surfaces of a model on which things can stand: its level faces, as data."""

from __future__ import annotations

import math

from viewsphere.model.place import LevelFace


def shrunk(name: str, half: tuple[float, float], height: float, margin: float = 0.02, clearance: float = math.inf) -> LevelFace:
    """The face of a centred rectangle of these half widths, `margin` inside its border."""
    x, y = (max(h - margin, 0.01) for h in half)
    return LevelFace(name, (-x, -y, x, y), height, clearance)
