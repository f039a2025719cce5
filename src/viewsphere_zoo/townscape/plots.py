"""The division of the plots along a street among houses, driveways and paths, from the families' parameters alone.

x is measured from the middle of the road towards the plot; side is 1 on the right (+X) and -1 on the left.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from viewsphere_zoo.townscape.plan import PLOT

if TYPE_CHECKING:
    from viewsphere_zoo.townscape.building import House

SETBACK = 15.2
"""x of the houses' nearest wall, metres."""


@dataclass(frozen=True)
class Plot:
    """One house's plot: its middle along the street, where house, driveway and door are, metres; seed draws the house."""

    side: int
    y: float
    driveway: float
    door: float
    seed: int
    house: tuple[float, float]
    front: float
    reach: tuple[float, float]

    @property
    def turn(self) -> float:
        """Turn about z that faces a piece's front (-Y) to the road, degrees."""
        return 270.0 if self.side > 0 else 90.0

    @property
    def ends(self) -> tuple[float, float]:
        """y of the plot's borders with its neighbours."""
        return self.y - PLOT / 2, self.y + PLOT / 2


def allotted(
    side: int,
    middles: Sequence[float],
    driveways: Sequence[float],
    pool: dict[int, House],
    rng: np.random.Generator,
) -> list[Plot]:
    """A plot for each middle: a house (a seed of `pool`) different from the one next door; a garage, if any, is at the
    driveway.
    """
    plots: list[Plot] = []
    for y, driveway in zip(middles, driveways, strict=True):
        near = -side if driveway > y else side
        taken = [p.seed for p in plots[-2:]]
        fitting = [s for s, h in pool.items() if h.garage in (0, near)]
        fresh = [s for s in fitting if s not in taken]
        seed = int(rng.choice(fresh or fitting))
        plots.append(_plot(side, y, driveway, seed, pool[seed], float(rng.uniform(0, 0.7))))
    return plots


def _plot(side: int, y: float, driveway: float, seed: int, house: House, back: float) -> Plot:
    width, depth = house.footprint
    beside = y - np.sign(driveway - y) * 1.6
    middle = float(beside) if house.garage_x is None else driveway + side * house.garage_x
    front = SETBACK + back
    return Plot(
        side=side,
        y=y,
        driveway=driveway,
        door=middle - side * house.door_x,
        seed=seed,
        house=(front + depth / 2, middle),
        front=front,
        reach=(middle - width / 2, middle + width / 2),
    )
