"""Random rooms and flats."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from viewsphere_zoo.indoors.coverings import Floor, FloorKind, Wall
from viewsphere_zoo.indoors.plan import INNER, SIDES, Kind, Opening, Room, Side
from viewsphere_zoo.shapes.paint import Color

SIZES: dict[Kind, tuple[tuple[float, float], tuple[float, float]]] = {
    "living_room": ((4.6, 6.2), (4.0, 5.2)),
    "bedroom": ((3.4, 4.6), (3.3, 4.3)),
    "kitchen": ((3.5, 4.8), (3.2, 4.2)),
    "office": ((3.3, 4.6), (3.1, 4.1)),
}
"""Least and greatest length along x and along y, metres."""

DOOR = (0.88, 2.03)
"""Width and height of doors inside, metres."""

HALL = 1.35
"""Width of a flat's hall, metres."""

WOODS: tuple[Color, ...] = ((0.66, 0.49, 0.32), (0.55, 0.38, 0.24), (0.72, 0.57, 0.4), (0.43, 0.29, 0.19), (0.62, 0.56, 0.48))
CARPETS: tuple[Color, ...] = ((0.55, 0.53, 0.5), (0.45, 0.47, 0.5), (0.66, 0.6, 0.5), (0.38, 0.42, 0.46), (0.5, 0.36, 0.32))
TILES: tuple[Color, ...] = ((0.8, 0.78, 0.73), (0.62, 0.6, 0.58), (0.72, 0.63, 0.52), (0.36, 0.37, 0.39), (0.86, 0.85, 0.83))
PAINTS: tuple[Color, ...] = (
    (0.92, 0.91, 0.88),
    (0.9, 0.87, 0.8),
    (0.82, 0.85, 0.84),
    (0.78, 0.83, 0.76),
    (0.86, 0.79, 0.72),
    (0.74, 0.79, 0.85),
    (0.9, 0.82, 0.62),
    (0.72, 0.6, 0.54),
)


def single(rng: np.random.Generator, kind: Kind | None = None) -> tuple[Room, ...]:
    """One room of this kind, or of any kind, its middle at the origin: one or two windows, and a shut door."""
    kind = kind or tuple(SIZES)[int(rng.integers(len(SIZES)))]
    x, y = (float(rng.uniform(*span)) for span in SIZES[kind])
    room = _covered(rng, Room(kind, (-x / 2, -y / 2), (x / 2, y / 2)))
    sides: list[Side] = [SIDES[int(k)] for k in rng.permutation(4)]
    openings = [_window(rng, room, side) for side in sides[: 2 if rng.random() < 0.4 else 1]]
    side = sides[2]
    end = float(rng.choice((-1.0, 1.0))) * (room.length(side) / 2 - DOOR[0] / 2 - float(rng.uniform(0.12, 0.35)))
    openings.append(Opening(side, end, *DOOR, opens="entrance", hinge=1 if end > 0 else -1))
    return (replace(room, openings=tuple(openings)),)


def flat(rng: np.random.Generator) -> tuple[Room, ...]:
    """A hall along x; living room and kitchen behind it, bedroom, office and perhaps another bedroom in front of it."""
    front: list[Kind] = ["bedroom", "office", "bedroom"]
    front = front[: int(rng.integers(2, 4))]
    rear: list[Kind] = ["living_room", "kitchen"]
    widths = [float(rng.uniform(3.2, 4.2)) for _ in front]
    total = sum(widths) + INNER * (len(front) - 1)
    living = total * float(rng.uniform(0.55, 0.62))
    behind = [living, total - living - INNER]
    if rng.random() < 0.5:
        rear, behind = rear[::-1], behind[::-1]
    deep = float(rng.uniform(3.9, 4.8)), float(rng.uniform(3.3, 4.2))
    rows = (("rear", rear, behind, HALL / 2 + INNER, deep[0]), ("front", front, widths, -HALL / 2 - INNER - deep[1], deep[1]))
    hall = _covered(rng, Room("hall", (-total / 2, -HALL / 2), (total / 2, HALL / 2)))
    end: Side = "left" if rng.random() < 0.5 else "right"
    ways = [Opening(end, 0.0, 0.95, 2.05, opens="entrance")]
    rooms: list[Room] = []
    for side, kinds, across, y, long in rows:
        x = -total / 2
        for kind, width in zip(kinds, across, strict=True):
            room = _covered(rng, Room(kind, (x, y), (x + width, y + long)))
            room, way = _joined(rng, room, hall, "rear" if side == "rear" else "front")
            rooms.append(room)
            ways.append(way)
            x += width + INNER
    return (*rooms, replace(hall, openings=tuple(ways)))


def _joined(rng: np.random.Generator, room: Room, hall: Room, side: Side) -> tuple[Room, Opening]:
    """A room on this side of the hall with its window and the door to the hall, and that door's opening in the hall's wall."""
    to_hall: Side = "front" if side == "rear" else "rear"
    hinge = 1 if rng.random() < 0.5 else -1
    x = hinge * (room.length(to_hall) / 2 - DOOR[0] / 2 - 0.14)
    door = Opening(to_hall, x, *DOOR, opens="door", hinge=hinge, ajar_deg=float(rng.uniform(65, 95)))
    way = Opening(side, -hall.along(to_hall, room, x), *DOOR, opens="doorway")
    return replace(room, openings=(_window(rng, room, side), door)), way


def _window(rng: np.random.Generator, room: Room, side: Side) -> Opening:
    """A window in or near the middle of a wall."""
    most = min(2.6, room.length(side) - 1.2)
    width = float(rng.uniform(0.45, 1.0)) * most
    foot = 1.05 if room.kind == "kitchen" else float(rng.choice((0.25, 0.85, 0.9)))
    spare = (room.length(side) - width) / 2 - 0.5
    x = float(rng.uniform(-0.5, 0.5)) * max(spare, 0.0)
    return Opening(side, x, width, float(rng.uniform(2.1, 2.25)) - foot, foot)


def _covered(rng: np.random.Generator, room: Room) -> Room:
    """The room with the floor and walls of its kind."""
    found: dict[Kind, Sequence[FloorKind]] = {
        "living_room": ("planks", "parquet", "carpet"),
        "bedroom": ("carpet", "planks", "parquet"),
        "kitchen": ("tiles", "planks"),
        "office": ("carpet", "planks", "tiles"),
        "hall": ("planks", "tiles"),
    }
    kinds = found[room.kind]
    kind = kinds[int(rng.integers(len(kinds)))]
    colors = {"planks": WOODS, "parquet": WOODS, "carpet": CARPETS, "tiles": TILES}[kind]
    paint = PAINTS[int(rng.integers(len(PAINTS)))]
    shade = tuple(0.93 * c for c in paint)
    striped = room.kind in ("living_room", "bedroom") and rng.random() < 0.25
    wall = Wall("stripes" if striped else "paint", paint, (shade[0], shade[1], shade[2]))
    return replace(room, floor=Floor(kind, _shaded(rng, colors[int(rng.integers(len(colors)))])), wall=wall)


def _shaded(rng: np.random.Generator, color: Color) -> Color:
    r, g, b = (np.array(color) * rng.uniform(0.9, 1.08)).clip(0.02, 0.95).tolist()
    return r, g, b
