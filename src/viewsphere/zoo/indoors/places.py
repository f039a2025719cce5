"""From furnished rooms to places: pieces around the free floor of one of the rooms."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence

import numpy as np

from viewsphere import plugins
from viewsphere.errors import UserError
from viewsphere.zoo.indoors.furnishing import Rectangle, Stand
from viewsphere.zoo.indoors.habits import furnished
from viewsphere.zoo.interior import Interior
from viewsphere.zoo.places import Place, PlacePiece, standing

TRIES = 60
"""Interiors that are furnished until one leaves enough of its floor free."""

LEAST = 1.1
"""Width of the free floor around the origin, metres, at least."""


def drawn(rng: np.random.Generator, wanted: Callable[[Interior], bool]) -> tuple[int, Interior]:
    """A seed of an interior that is as it is wanted, and its parameters."""
    draw = plugins.family("interior").draw
    while True:
        seed = int(rng.integers(1 << 31))
        if wanted(parameters := draw(np.random.default_rng(seed))):
            return seed, parameters


def around_free_floor(rng: np.random.Generator, wanted: Callable[[Interior], bool]) -> Place:
    """A furnished interior, its origin in the middle of the widest free floor."""
    for _ in range(TRIES):
        seed, parameters = drawn(rng, wanted)
        rooms = [furnished(room, rng) for room in parameters.rooms]
        spots = [spot for room in rooms if (spot := room.free(LEAST)) is not None]
        if spots:
            free = max(spots, key=lambda spot: spot[2] - spot[0])
            return laid_out(seed, [stand for room in rooms for stand in room.stands], free)
    raise UserError(f"zoo place: expected {LEAST} m of free floor in one of {TRIES} interiors; found none")


def laid_out(seed: int, stands: Sequence[Stand], free: Rectangle, z: float = 0.0) -> Place:
    """The interior of this seed with what stands in it; the origin is in the middle of what is free, at this height."""
    x, y = (free[0] + free[2]) / 2, (free[1] + free[3]) / 2
    count: Counter[str] = Counter()
    pieces = [PlacePiece("interior_1", "interior", seed, "interior", standing(-x, -y, 0.0, -z))]
    for s in stands:
        count[s.family] += 1
        pose = standing(s.x - x, s.y - y, s.turn_deg, s.z - z)
        pieces.append(PlacePiece(f"{s.family}_{count[s.family]}", s.family, s.seed, s.family.replace("_", " "), pose))
    return Place(tuple(pieces), free=(free[0] - x, free[1] - y, free[2] - x, free[3] - y))
