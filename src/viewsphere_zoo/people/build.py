"""The build of a person."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Build:
    """`height` in metres; `male` from 0 (a woman's shape) to 1 (a man's); `weight` from -1 (lean) to 1 (heavy); `leg`: height
    of the hip's joint as a share of the height.
    """

    height: float = 1.75
    male: float = 1.0
    weight: float = 0.0
    leg: float = 0.523
