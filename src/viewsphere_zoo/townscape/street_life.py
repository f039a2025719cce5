"""The traffic of places with roads: parked vehicles in their bays, people on their pavements."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from viewsphere.model.place import Bay, Lane, standing, stretches
from viewsphere.model.scene import Matrix4
from viewsphere_zoo.families.car import SIZES, Car

CLEAR = 10.0
"""Radius around the origin in which bays stay empty for models and cameras, metres."""

PERSON = 0.6
"""Radius around a walking person's middle, metres, including arms and stride."""

BUMPERS = 0.1
"""Greatest length that bumpers add to a car's body, metres; 0.05 among 40 of the zoo's cars."""

TRIES = 50
"""Number of spots to try for one person; a person without room is left out."""

MIRROR = 0.1
"""Distance by which a car with its mirrors extends beyond its bay on each side, metres."""

TUFT = 0.2
"""Distances by which leaves hang below a crown's lower edge and roof racks rise above a roof, metres."""

Crown = tuple[float, float, float, float]
"""A tree's crown: x, y, radius, and height of its lower edge above the ground of the bays, metres."""

Disc = tuple[float, float, float]
"""A thing beside the road: x, y and radius, metres."""


def parked(
    rng: np.random.Generator,
    bays: Sequence[Bay],
    share: float,
    design: Callable[[], tuple[int, Car]],
    crowns: Sequence[Crown] = (),
) -> Iterator[tuple[int, Matrix4]]:
    """The car of each occupied bay, and world from car: nearly in the bay's middle, with the bay's heading. `design` draws
    a car's seed and parameters. Bays stay empty if a tree's crown would reach into their car.
    """
    for bay in bays:
        frame = bay.world_from_bay
        if rng.random() < share and math.hypot(frame[0][3], frame[1][3]) > CLEAR:
            aside, along = rng.normal(0, (0.08, 0.25)).tolist()
            seed, car = design()
            size = [given or usual for given, usual in zip((car.length, car.height), SIZES[car.body][::2], strict=True)]
            most = max((bay.size[1] - size[0] - BUMPERS) / 2, 0.0)
            if not any(_reaches_into(bay, crown, size[1]) for crown in crowns):
                yield seed, _moved(frame, aside, min(max(along, -most), most))


def _reaches_into(bay: Bay, crown: Crown, height: float) -> bool:
    """Return whether a crown reaches into a car of this height in a bay."""
    x, y, radius, clear = crown
    frame, (width, length) = bay.world_from_bay, bay.size
    dx, dy = x - frame[0][3], y - frame[1][3]
    along, aside = abs(dx * frame[0][1] + dy * frame[1][1]), abs(dx * frame[0][0] + dy * frame[1][0])
    apart = math.hypot(max(along - length / 2, 0.0), max(aside - width / 2 - MIRROR, 0.0))
    return apart < radius and clear - TUFT < height


def walkers(rng: np.random.Generator, pavements: Sequence[Lane], count: int, others: Sequence[Disc]) -> Iterator[Matrix4]:
    """World from person for people on pavements, walking either way, uniform along them and clear of obstacles and of one
    another.
    """
    if not count or not pavements:
        return
    parts = np.array([part for lane in pavements for part in stretches(lane)])
    lengths = np.hypot(*(parts[:, 3:5] - parts[:, :2]).T)
    taken = np.array([*others, (math.inf, math.inf, 0.0)])
    for _ in range(count):
        for _ in range(TRIES):
            x0, y0, z, x1, y1, width = parts[int(rng.choice(len(parts), p=lengths / lengths.sum()))].tolist()
            along, aside, way = rng.random(3).tolist()
            away = math.atan2(y1 - y0, x1 - x0) + math.pi / 2
            off = (aside - 0.5) * width
            x, y = x0 + along * (x1 - x0) + off * math.cos(away), y0 + along * (y1 - y0) + off * math.sin(away)
            if (np.hypot(taken[:, 0] - x, taken[:, 1] - y) > taken[:, 2] + PERSON).all():
                taken = np.vstack([taken, (x, y, PERSON)])
                yield standing(x, y, math.degrees(away) % 360.0 + (180.0 if way < 0.5 else 0.0), z)
                break


def _moved(frame: Matrix4, x: float, y: float) -> Matrix4:
    """A frame with its origin moved to x and y of another frame."""
    rows: list[tuple[float, float, float, float]] = [(a, b, c, t + a * x + b * y) for a, b, c, t in frame[:3]]
    return (*rows, frame[3])  # type: ignore[return-value]
