"""A backpack in figures: style, measures, colours."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from viewsphere_zoo.shapes.paint import Color

Style = Literal["school", "hiking", "roll_top", "flap"]


@dataclass(frozen=True)
class Backpack:
    """Parameters of a backpack; metres, colours sRGB 0..1.

    height, width, depth: of the bag without pockets; fill: 0 flat to 1 stuffed; pockets: number in front, 1 or 2; bottle: in
    the side pocket on its left; mat: a rolled mat below or on top; seed draws the folds.
    """

    style: Style = "school"
    height: float = 0.44
    width: float = 0.3
    depth: float = 0.17
    fill: float = 0.6
    pockets: int = 1
    side_pockets: bool = True
    bottle: bool = False
    mat: bool = False
    color: Color = (0.12, 0.25, 0.5)
    second: Color = (0.12, 0.25, 0.5)
    trim: Color = (0.07, 0.07, 0.08)
    accent: Color = (0.9, 0.45, 0.1)
    seed: int = 0
