"""Where there is room for one thing more."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.model.scene import Matrix4
from viewsphere.sampling.placing._footprint import footprint, standing
from viewsphere.sampling.placing._room import Room

TRIES = 2000
"""Spots that are tried for one model; the circle they lie in grows with each."""

GROWTH = 0.01

Cover = Callable[[Matrix4], Any]
"""What a thing at a pose covers of the floor: a Footprint, or an Outline."""


def free_spot(
    rng: np.random.Generator, room: Room, box: NDArray[np.float64], others: Sequence[Any], cover: Cover | None = None
) -> Matrix4 | None:
    """A pose on the free floor, turned at random, where what it covers (by default a rectangle) is clear of what others
    cover: uniform in a circle that grows until there is room; None where none is found.
    """
    free = room.free
    radius = 0.0
    if others:  # boxes are no nearer than this; a hull's outline is somewhere in its box
        narrowest = float((box[4] - box[2])[:2].min() / 2)
        radius = room.gap + (narrowest / 4 if cover else float(others[0].half.min()) + narrowest)
    widest = math.inf if free is None else float(np.linalg.norm(free.corners, axis=1).max())
    for _ in range(TRIES):
        turn, far, azimuth = rng.random(3)
        x, y = (radius * math.sqrt(far) * f(2 * math.pi * turn) for f in (math.cos, math.sin))
        pose = standing(box, x, y, 360.0 * float(azimuth))
        own = cover(pose) if cover else footprint(box, pose)
        if (free is None or free.contains(own)) and all(own.apart(other, room.gap) for other in others):
            return pose
        radius = min((1 + GROWTH) * radius, widest)
    return None
