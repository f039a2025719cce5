"""A furnished room."""

from __future__ import annotations

import numpy as np

from viewsphere import plugins
from viewsphere.zoo.places import Place, PlacePiece, standing


def room_random(rng: np.random.Generator) -> Place:
    draw = plugins.family("interior").draw
    while True:
        seed = int(rng.integers(1 << 31))
        p = draw(np.random.default_rng(seed))
        if len(p.rooms) == 1:
            break
    return Place((PlacePiece("interior_1", "interior", seed, "interior", standing(0, 0)),), free=(-1, -1, 1, 1))
