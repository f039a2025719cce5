"""A furnished room: a living room, a bedroom, a kitchen or an office."""

from __future__ import annotations

import numpy as np

from viewsphere.model.place import Place
from viewsphere.plugins.place import PlaceSpec
from viewsphere_zoo.indoors.places import around_free_floor


def room(seed: int = 0) -> Place:
    """The room of this seed; its floor is z = 0, the origin in the middle of the free floor."""
    return around_free_floor(np.random.default_rng(seed), lambda interior: len(interior.rooms) == 1)


def room_random(rng: np.random.Generator) -> Place:
    """A room with all parameters drawn."""
    return room(int(rng.integers(1 << 31)))


PLACE = PlaceSpec(random=room_random, indoors=True)
