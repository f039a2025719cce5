"""Where there is room for one thing more."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.model.scene import Matrix4
from viewsphere.sampling.placing._footprint import Footprint, footprint, standing
from viewsphere.sampling.placing._room import Room

TRIES = 2000
"""Spots that are tried for one model; the circle they lie in grows with each."""

GROWTH = 0.01

SPREAD_TRIES = 400
"""Spots of a bounded floor that are tried for one model: where fewer than one in a hundred is free, another draw finds room
sooner."""

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
        if (free is None or free.contains(own)) and room.is_clear(own, others):
            return pose
        radius = min((1 + GROWTH) * radius, widest)
    return None


def spread_spot(
    rng: np.random.Generator,
    room: Room,
    floor: Footprint,
    box: NDArray[np.float64],
    others: Sequence[Any],
    cover: Cover | None = None,
) -> Matrix4 | None:
    """A pose on a bounded floor, turned at random and uniform over all that are clear of what others cover and of the place;
    None where none is found.
    """
    draws = rng.random((SPREAD_TRIES, 3))
    spots = floor.center + (2 * draws[:, :2] - 1) * floor.half @ floor.axes
    likely = np.arange(SPREAD_TRIES) if cover else _likely(floor, box, spots, 2 * math.pi * draws[:, 2], others, room.gap)
    for i in likely.tolist():
        pose = standing(box, float(spots[i, 0]), float(spots[i, 1]), 360.0 * float(draws[i, 2]))
        own = cover(pose) if cover else footprint(box, pose)
        if floor.contains(own) and room.is_clear(own, others):
            return pose
    return None


def _likely(
    floor: Footprint, box: NDArray[np.float64], spots: NDArray[np.float64], turns: NDArray[np.float64], others: Any, gap: float
) -> NDArray[np.intp]:
    """Numbers of the spots (N, 2) at which a box, turned so, is on the floor and clear of others: all at once, as one takes
    long.
    """
    cos, sin = np.cos(turns), np.sin(turns)
    axes = np.stack([np.stack([cos, sin], axis=1), np.stack([-sin, cos], axis=1)], axis=1)
    half, middle = (box[4] - box[2])[:2] / 2, (box[4] + box[2])[:2] / 2
    centers = spots + np.einsum("nij,i->nj", axes, middle)
    reach = np.abs(np.einsum("nij,kj->nik", axes, floor.axes))  # of each own side along each side of the floor
    free = (np.abs((centers - floor.center) @ floor.axes.T) + np.einsum("nik,i->nk", reach, half) <= floor.half + 1e-9).all(
        axis=1
    )
    for other in others:
        between, turned = other.center - centers, np.abs(np.einsum("nij,kj->nik", axes, other.axes))
        own = np.abs(np.einsum("nij,nj->ni", axes, between)) - half - turned @ other.half
        its = np.abs(between @ other.axes.T) - other.half - np.einsum("nik,i->nk", turned, half)
        free &= (np.concatenate([own, its], axis=1) >= gap - 1e-9).any(axis=1)
    return np.flatnonzero(free)
