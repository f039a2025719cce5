"""A furnished flat: living room, kitchen, bedrooms and an office along a hall."""

from __future__ import annotations

import numpy as np

from viewsphere.model.place import Place
from viewsphere.plugins.place import PlaceSpec
from viewsphere_zoo.indoors.places import around_free_floor


def flat(seed: int = 0) -> Place:
    """The flat of this seed; its floor is z = 0, the origin in the middle of the widest free floor of a room."""
    return around_free_floor(np.random.default_rng(seed), lambda interior: len(interior.rooms) > 1)


def flat_random(rng: np.random.Generator) -> Place:
    """A flat with all parameters drawn."""
    return flat(int(rng.integers(1 << 31)))


PLACE = PlaceSpec(random=flat_random, indoors=True)
