"""The boards of an open box: a bottom and four sides."""

from __future__ import annotations

THICKNESS = 0.05
"""Thickness of a board, as a share of the box's shortest side."""


def boards(width: float, height: float, length: float) -> list[tuple[tuple[float, float, float], tuple[float, float, float]]]:
    """Centre and size of each of the five boards of a box with these outer dimensions, in metres. The bottom is first, and
    rests on z = 0.
    """
    t = THICKNESS * min(width, height, length)
    tall, z = height - t, t + (height - t) / 2
    return [
        ((0, 0, t / 2), (width, length, t)),
        ((width / 2 - t / 2, 0, z), (t, length, tall)),
        ((t / 2 - width / 2, 0, z), (t, length, tall)),
        ((0, length / 2 - t / 2, z), (width - 2 * t, t, tall)),
        ((0, t / 2 - length / 2, z), (width - 2 * t, t, tall)),
    ]
