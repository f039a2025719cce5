"""Outskirts: the country around a town's ground, out to hills that close the horizon."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere.assets.mesh import Mesh
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.families import town_ground
from viewsphere_zoo.townscape import country
from viewsphere_zoo.townscape.surfaces import finished, mapped


@dataclass(frozen=True)
class Outskirts:
    """Parameters of the country around a town; metres.

    half: half the width and length of the town, whose area is left out; hills: height of the ridge all around; reach: its
    distance; woods: groups of distant trees; houses: distant houses; seed draws where they stand.
    """

    half: tuple[float, float] = (97.0, 126.0)
    hills: float = 34.0
    reach: float = 520.0
    woods: int = 60
    houses: int = 50
    seed: int = 0


def outskirts(parameters: Outskirts | None = None) -> Mesh:
    """The country in metres around a town whose middle is the origin. Parts: meadow, hill, thicket, wood, house."""
    p = parameters or Outskirts()
    ground, trees, homes, tint = np.random.default_rng(p.seed).spawn(4)
    phases = tuple(ground.uniform(0, 2 * np.pi, 6).tolist())
    relief = country.Relief(p.hills, p.reach, phases, p.half, road=False)
    pieces = [*country.ground(relief), *country.woods(relief, p.woods, trees), *country.houses(relief, p.houses, homes)]
    mesh = finished(pieces, country.images(tint), country.tints(relief, tint), crease_deg=60)
    return mapped(mesh, "thicket", country.around)


def outskirts_random(rng: np.random.Generator) -> Mesh:
    """A country with all parameters drawn."""
    return outskirts(draw(rng))


def draw(rng: np.random.Generator) -> Outskirts:
    """The parameters of the country around the town's ground that the same generator state draws."""
    town = town_ground.draw(rng)
    return Outskirts(half=town.half, hills=town.hills, seed=town.seed)


FAMILY = ZooFamily(
    random=outskirts_random,
    home="place",
    classes={"": "grass", "thicket": "vegetation", "wood": "vegetation", "house": "building"},
    draw=draw,
)
