"""Landscapes: the country around a street, out to hills that close the horizon."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere.assets.mesh import Mesh
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.townscape import country
from viewsphere_zoo.townscape.surfaces import finished, mapped


@dataclass(frozen=True)
class Landscape:
    """Parameters of the country around a street of the zoo; metres.

    hills: height of the ridge all around; reach: its distance; woods: groups of distant trees; hamlets: distant houses;
    seed draws where trees and houses stand.
    """

    hills: float = 30.0
    reach: float = 520.0
    woods: int = 46
    houses: int = 24
    seed: int = 0


def landscape(parameters: Landscape | None = None) -> Mesh:
    """The country around a street, without the street's own 60 x 200 m; the road continues at both ends.

    Parts: meadow, hill, road, thicket, wood, house.
    """
    p = parameters or Landscape()
    ground, trees, homes, tint = np.random.default_rng(p.seed).spawn(4)
    relief = country.Relief(p.hills, p.reach, tuple(ground.uniform(0, 2 * np.pi, 6).tolist()))
    pieces = [*country.ground(relief), *country.woods(relief, p.woods, trees), *country.houses(relief, p.houses, homes)]
    mesh = finished(pieces, country.images(tint), country.tints(relief, tint), crease_deg=60)
    return mapped(mesh, "thicket", country.around)


def landscape_random(rng: np.random.Generator) -> Mesh:
    """A landscape with all parameters drawn."""
    return landscape(draw(rng))


def draw(rng: np.random.Generator) -> Landscape:
    """The parameters of a random landscape."""
    return Landscape(
        hills=float(rng.uniform(26, 44)),
        reach=float(rng.uniform(430, 560)),
        woods=int(rng.integers(38, 56)),
        houses=int(rng.integers(16, 30)),
        seed=int(rng.integers(1 << 31)),
    )


FAMILY = ZooFamily(
    random=landscape_random,
    home="place",
    classes={"": "grass", "road": "road", "thicket": "vegetation", "wood": "vegetation", "house": "building"},
    draw=draw,
)
