"""Places made of furnished rooms: pieces around the free floor of one of the rooms."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from viewsphere.errors import UserError
from viewsphere.model.place import Place, PlacePiece, Surface, standing
from viewsphere_zoo import drawing_of
from viewsphere_zoo.families.interior import Interior
from viewsphere_zoo.indoors.furnishing import Rectangle, Stand
from viewsphere_zoo.indoors.habits import furnished

TRIES = 60
"""Number of interiors to try until one leaves enough of its floor free."""

LEAST = 1.1
"""Width of the free floor around the origin, metres, at least."""


def drawn(rng: np.random.Generator, wanted: Callable[[Interior], bool]) -> tuple[int, Interior]:
    """A seed of an interior that meets the test, and its parameters."""
    draw = drawing_of("interior")
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
    """The interior of this seed with its furniture; the origin is in the middle of the free area, at this height."""
    x, y = (free[0] + free[2]) / 2, (free[1] + free[3]) / 2
    count: Counter[str] = Counter()
    pieces = [PlacePiece("interior_1", "interior", seed, "interior", standing(-x, -y, 0.0, -z))]
    for s in stands:
        count[s.family] += 1
        pose = standing(s.x - x, s.y - y, s.turn_deg, s.z - z)
        pieces.append(PlacePiece(f"{s.family}_{count[s.family]}", s.family, s.seed, s.family.replace("_", " "), pose))
    surfaces = tuple(_surfaces(stands, (x, y, z)))
    return Place(tuple(pieces), free=(free[0] - x, free[1] - y, free[2] - x, free[3] - y), surfaces=surfaces)


def _surfaces(stands: Sequence[Stand], origin: tuple[float, float, float]) -> Iterator[Surface]:
    """The level faces of furniture for things to stand on, in the axes of this origin. The first table's first face is
    `table`, its other faces are `table_shelf`, ...; the second table's are `table_2`, `table_2_shelf`.
    """
    count: Counter[str] = Counter()
    for stand in (s for s in stands if s.z == 0):
        for number, face in enumerate(stand.surfaces()):
            if number == 0:
                count[stand.family] += 1
            own = stand.family if count[stand.family] == 1 else f"{stand.family}_{count[stand.family]}"
            x0, y0, x1, y1 = face.rectangle
            x, y = stand.at((x0 + x1) / 2, -(y0 + y1) / 2)
            pose = standing(x - origin[0], y - origin[1], stand.turn_deg, face.height - origin[2])
            clear = None if math.isinf(face.clearance) else face.clearance
            yield Surface(own if number == 0 else f"{own}_{face.name}", pose, (x1 - x0, y1 - y0), clear)
