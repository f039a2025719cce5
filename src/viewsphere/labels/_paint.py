"""Colours that labels are drawn in."""

from __future__ import annotations

PALETTE = ((230, 75, 60), (50, 130, 220), (45, 165, 95), (240, 170, 40), (150, 90, 200), (20, 170, 180))


def color_of(object_id: int) -> tuple[int, int, int]:
    """An object's colour, sRGB."""
    return PALETTE[(object_id - 1) % len(PALETTE)]
