"""The ground of a small town: a grid of roads with junctions, and blocks with pavements between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Mesh
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.shapes.paint import Color
from viewsphere_zoo.townscape import blocks, paving, roadway
from viewsphere_zoo.townscape.surfaces import finished

Use = Literal["shops", "houses", "park"]


@dataclass(frozen=True)
class TownGround:
    """Parameters of a town's ground; metres, colours sRGB 0..1, the roads at z = 0.

    x, y: middles of the roads, ascending; uses: of each block, column by column; wear: 0 fresh to 1 worn; hills: height of the
    ridge that closes the horizon; seed draws grain and covers.
    """

    x: tuple[float, ...] = (-75.0, 0.0, 80.0)
    y: tuple[float, ...] = (-105.0, -35.0, 35.0, 110.0)
    uses: tuple[Use, ...] = ("shops", "shops", "houses", "park", "shops", "shops")
    asphalt: Color = (0.4, 0.39, 0.38)
    paving: Literal["slabs", "bricks"] = "slabs"
    paving_color: Color = (0.62, 0.6, 0.56)
    wear: float = 0.5
    hills: float = 34.0
    seed: int = 0

    @property
    def blocks(self) -> tuple[tuple[blocks.Block, Use], ...]:
        """Every block with its use."""
        return tuple(zip(blocks.blocks(self.x, self.y), self.uses, strict=True))

    @property
    def middle(self) -> tuple[float, float]:
        """The middle of the town."""
        return (self.x[0] + self.x[-1]) / 2, (self.y[0] + self.y[-1]) / 2

    @property
    def half(self) -> tuple[float, float]:
        """Half the width and length of the town with its green strip."""
        reach = blocks.HALF + blocks.BORDER
        return (self.x[-1] - self.x[0]) / 2 + reach, (self.y[-1] - self.y[0]) / 2 + reach


def town_ground(parameters: TownGround | None = None) -> Mesh:
    """The ground in metres, the roads exactly at z = 0.

    Parts: road, kerb, pavement, yard, lawn, verge, centre_line, zebra, stop_line, parking, manhole, base.
    """
    p = parameters or TownGround()
    grain, tint, lids = np.random.default_rng(p.seed).spawn(3)
    pictures = paving.images(grain, p.asphalt, p.paving, p.paving_color, p.wear)
    pieces = [*blocks.roads(p.x, p.y), *blocks.paint(p.x, p.y), roadway.manholes(_manholes(p, lids))]
    for block, use in p.blocks:
        pieces += blocks.land(block, green=use != "shops")
    return finished(pieces, pictures, paving.tints(tint, 0.0))


def town_ground_random(rng: np.random.Generator) -> Mesh:
    """A town's ground with all parameters drawn."""
    return town_ground(draw(rng))


def draw(rng: np.random.Generator) -> TownGround:
    """The parameters of a random town's ground: two by three blocks, one of them a park, one or two with houses."""
    across, along = (_lines(rng.uniform(66, 84, count).tolist()) for count in (2, 3))
    uses: list[Use] = ["park", "houses", "houses" if rng.random() < 0.4 else "shops", "shops", "shops", "shops"]
    grey = float(rng.uniform(0.35, 0.44))
    stones: tuple[Color, ...] = ((0.66, 0.62, 0.55), (0.6, 0.58, 0.55), (0.52, 0.51, 0.5))
    return TownGround(
        x=across,
        y=along,
        uses=tuple(uses[int(k)] for k in rng.permutation(6)),
        asphalt=(grey, grey * 0.985, grey * float(rng.uniform(0.94, 0.98))),
        paving="slabs" if rng.random() < 0.6 else "bricks",
        paving_color=stones[int(rng.integers(3))],
        wear=float(rng.uniform(0.1, 1.0)),
        hills=float(rng.uniform(26, 44)),
        seed=int(rng.integers(1 << 31)),
    )


def _manholes(p: TownGround, rng: np.random.Generator) -> list[tuple[float, float]]:
    """Two covers on each road along y, in its lanes."""
    found: list[tuple[float, float]] = []
    for x in p.x:
        found += [(x + s * 1.6, float(rng.uniform(p.y[0], p.y[-1]))) for s in (-1, 1)]
    return found


def _lines(gaps: Sequence[float]) -> tuple[float, ...]:
    """Middles of roads at these spacings. The second of three roads is at 0; of four, the middle of the second and the
    third.
    """
    at = np.concatenate([[0.0], np.cumsum(gaps)])
    return tuple((at - at[1] if len(gaps) == 2 else at - (at[1] + at[2]) / 2).round(2).tolist())


FAMILY = ZooFamily(
    random=town_ground_random,
    home="place",
    classes={
        "": "road",
        "stop_line": "road marking",
        "parking": "road marking",
        "yard": "pavement",
        "centre_line": "road marking",
        "zebra": "road marking",
        "kerb": "pavement",
        "pavement": "pavement",
        "lawn": "grass",
        "verge": "grass",
        "base": "grass",
    },
    draw=draw,
)
