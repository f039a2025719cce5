"""The search for a spot with room for one more thing."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.composing.placing.shared.crowd import Crowd, TakenMap
from viewsphere.composing.placing.shared.footprint import Footprint, Outline, standing
from viewsphere.composing.placing.shared.room import Room
from viewsphere.geometry.box3d import Box3d
from viewsphere.model.scene import IDENTITY, Matrix4

TRIES = 2000
"""Number of tried spots for one model; their circle grows with each try."""

GROWTH = 0.01  # of the radius a try: TRIES tries reach the whole floor. Chosen by that, not measured

SPREAD_TRIES = 400
"""Number of tried spots for one model on a bounded floor: if fewer than one in a hundred is free, another draw is faster."""

Float = NDArray[np.float64]
Cover = Callable[[Matrix4], Any]
"""The floor that a thing at a pose covers: a Footprint, or an Outline."""


@dataclass(frozen=True, eq=False)
class Others:
    """The things already on the floor, and maps of the blocked positions.
    If many things are to come, the maps of the largest things come last.
    """

    maps: tuple[TakenMap, ...] = ()
    crowd: Crowd = field(default_factory=Crowd)

    def add(self, cover: Footprint | Outline) -> None:
        """Add one more."""
        self.crowd.add(cover)
        for taken in self.maps:
            taken.add(cover)

    def untaken(self, cover: Cover, spots: Float, turns: Float) -> NDArray[np.intp]:
        """Numbers of the spots (N, 2) that may be clear for a thing with these turns, radians; most crowded spots are left
        out.
        """
        x, y, _, inner, _ = cover(IDENTITY).circle
        fitting = [taken for taken in self.maps if taken.slim <= inner]
        if not fitting:
            return np.arange(len(spots))
        cos, sin = np.cos(turns), np.sin(turns)
        return np.flatnonzero(~fitting[-1].are_taken(spots + np.stack([cos * x - sin * y, sin * x + cos * y], axis=1)))


def free_spot(rng: np.random.Generator, room: Room, box: Float, others: Others, cover: Cover) -> Matrix4 | None:
    """A pose on the free floor, turned at random, with its cover clear of others: uniform in a circle that grows until there is
    room; None if none is found.
    """
    draws = rng.random((TRIES, 3))
    radii = _radii(room, box, others)
    away = radii * np.sqrt(draws[:, 1])
    spots = np.stack([away * np.cos(2 * np.pi * draws[:, 0]), away * np.sin(2 * np.pi * draws[:, 0])], axis=1)
    for i in others.untaken(cover, spots, 2 * np.pi * draws[:, 2]).tolist():
        (turn, far, azimuth), radius = draws[i].tolist(), float(radii[i])
        x, y = (radius * math.sqrt(far) * f(2 * math.pi * turn) for f in (math.cos, math.sin))
        pose = standing(box, x, y, 360.0 * azimuth)
        own = cover(pose)
        if (room.free is None or room.free.contains(own)) and room.is_clear(own, others.crowd):
            return pose
    return None


def _radii(room: Room, box: Float, others: Others) -> Float:
    """Radii of the growing circle, one for each try. Boxes cannot be nearer than the first radius; hulls can, inside their
    boxes.
    """
    if not others.crowd.covers:
        return np.zeros(TRIES)
    narrowest, first = float(Box3d(box).diagonal[:2].min() / 2), others.crowd.covers[0]
    start = room.gap + (narrowest / 4 if isinstance(first, Outline) else float(first.half.min()) + narrowest)
    radii = np.multiply.accumulate(np.array([start, *[1 + GROWTH] * (TRIES - 1)]))
    if room.free is not None:
        radii[1:] = radii[1:].clip(max=float(np.linalg.norm(room.free.corners, axis=1).max()))
    return radii


def spread_spot(
    rng: np.random.Generator, room: Room, floor: Footprint, box: Float, others: Others, cover: Cover
) -> Matrix4 | None:
    """A pose on a bounded floor, turned at random and uniform over all poses that are clear of other things and of the place;
    None if none is found.
    """
    draws = rng.random((SPREAD_TRIES, 3))
    spots = floor.center + (2 * draws[:, :2] - 1) * floor.half @ floor.axes
    for i in others.untaken(cover, spots, 2 * np.pi * draws[:, 2]).tolist():
        pose = standing(box, float(spots[i, 0]), float(spots[i, 1]), 360.0 * float(draws[i, 2]))
        own = cover(pose)
        if floor.contains(own) and room.is_clear(own, others.crowd):
            return pose
    return None
