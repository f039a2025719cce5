"""A table top in a furnished room: targets stand on the table."""

from __future__ import annotations

import numpy as np

from viewsphere.model.place import Place
from viewsphere.plugins.place import PlaceSpec
from viewsphere_zoo.indoors.furnishing import Stand, overlap
from viewsphere_zoo.indoors.habits import furnished
from viewsphere_zoo.indoors.places import drawn, laid_out
from viewsphere_zoo.indoors.plan import Room

LEAST = (0.9, 0.55)
"""Least width and depth of the table, metres."""

AROUND = 0.8
"""Least distance between the table and the walls, metres, as room for cameras."""


def table_top(seed: int = 0) -> Place:
    """The room of this seed with an empty table; z = 0 is its top, the origin its middle."""
    rng = np.random.default_rng(seed)
    while True:
        own, interior = drawn(rng, lambda one: len(one.rooms) == 1 and one.rooms[0].kind != "bedroom")
        stands = furnished(interior.rooms[0], rng).stands
        table = next((s for s in stands if _is_wanted(s, interior.rooms[0])), None)
        if table is not None:
            top = table.surfaces()[0]
            empty = [s for s in stands if s.z < top.height or not overlap(s.rectangle, table.rectangle)]
            x0, y0, x1, y1 = top.rectangle
            xs, ys = zip(*(table.at(x, -y) for x in (x0, x1) for y in (y0, y1)), strict=True)
            return laid_out(own, empty, (min(xs), min(ys), max(xs), max(ys)), top.height)


def _is_wanted(stand: Stand, room: Room) -> bool:
    """Return whether the table is large enough and free on all sides."""
    x0, y0, x1, y1 = stand.rectangle
    apart = min(x0 - room.low[0], y0 - room.low[1], room.high[0] - x1, room.high[1] - y1)
    return stand.family == "table" and stand.size[0] >= LEAST[0] and stand.size[1] >= LEAST[1] and apart >= AROUND


def table_top_random(rng: np.random.Generator) -> Place:
    """A table top with all parameters drawn."""
    return table_top(int(rng.integers(1 << 31)))


PLACE = PlaceSpec(random=table_top_random, indoors=True)
