"""The furnishing habits of people: the things in each kind of room, and their positions."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from viewsphere_zoo.indoors.furnishing import Fits, Furnishing, Stand, across, extent
from viewsphere_zoo.indoors.plan import Kind, Room


def furnished(room: Room, rng: np.random.Generator) -> Furnishing:
    """The room with its furniture and the small things on it."""
    made = Furnishing(room, rng)
    HABITS[room.kind](made)
    return made


def _style(*styles: str, width: float = math.inf, depth: float = math.inf, height: float = math.inf) -> Fits:
    """Return a test for members of one of these styles (any style if none is given) within these dimensions."""

    def fits(p: Any) -> bool:
        own = extent(p)
        return (not styles or p.style in styles) and own[0] <= width and own[1] <= depth and own[2] <= height

    return fits


def _is_shut(p: Any) -> bool:
    """Return whether no door stands open."""
    return p.ajar == 0


def _seat(*kinds: str) -> Fits:
    """Return whether a chair is one of these kinds."""
    return lambda p: type(p).__name__ in kinds


def _bedroom(f: Furnishing) -> None:
    """A bed with its head at a wall, bedside tables with lamps, a wardrobe, a chest of drawers, a chair."""
    bed = f.against("bed", _style(width=0.55 * max(f.room.size)), middle=True)
    if bed is not None:
        f.under(bed.at(0.0, bed.size[1] * 0.3), bed.turn_deg, "rug", _style(width=2.6, depth=2.0))
        for right in (-1, 1):
            small = f.beside(bed, right, "cabinet", _style("bedside"))
            if small is not None:
                f.on(small, "top", "lamp", _style("table", height=0.6))
                f.scattered(small, "top", ("book", "mug"), 1)
    f.against("cabinet", _style("wardrobe"))
    _topped(f, f.against("cabinet", _style("chest")))
    f.against("chair", _seat("Armchair", "Dining"))
    f.against("plant", _style(width=0.7))


def _living_room(f: Furnishing) -> None:
    """A sofa facing the television across a low table on a rug; an armchair, a lamp, shelves and plants."""
    widest = 0.6 * max(f.room.size)
    sofa = f.against("sofa", lambda p: p.chaise == "none" and p.width < widest, middle=True)
    if sofa is not None:
        f.under(sofa.at(0.0, sofa.size[1] / 2 + 0.7), sofa.turn_deg, "rug", _style(width=3.2, depth=2.4))
        low = f.before(sofa, "table", _style("coffee"), gap=0.38, turn=0.0)
        if low is not None:
            f.scattered(low, "top", ("mug", "book", "bowl", "plate", "bottle"), int(f.rng.integers(1, 5)))
        facing = (across(sofa.turn_deg),)
        if f.rng.random() < 0.5 or f.against("television", _style("console"), facing, middle=True) is None:
            board = f.against("cabinet", _style("sideboard", height=0.85), facing, middle=True)
            if board is not None:
                f.on(board, "top", "television", _style("feet", "foot", width=1.1 * board.size[0]))
        if f.beside(sofa, 1, "lamp", _style("column", "tripod")) is None:
            f.beside(sofa, -1, "lamp", _style("column", "tripod"))
        f.before(sofa, "chair", _seat("Armchair"), gap=0.45, right=sofa.size[0] / 2 + 0.5, turn=110.0)
    _filled(f, f.against("shelf"))
    f.against("plant", _style(width=0.9))
    _filled(f, f.against("shelf"))


def _kitchen(f: Furnishing) -> None:
    """Units along a wall with the refrigerator beside them; a table with chairs."""
    units = f.against("cabinet", _style("kitchen", width=0.75 * max(f.room.size)), gap=0.0)
    if units is not None:
        if f.beside(units, 1, "refrigerator", _is_shut, gap=0.02) is None:
            f.beside(units, -1, "refrigerator", _is_shut, gap=0.02)
        f.scattered(units, "", ("bottle", "can", "bowl", "mug", "plate", "plant"), int(f.rng.integers(3, 7)))
    table = f.in_the_middle("table", _style("dining", width=1.7))
    if table is not None:
        f.around(table, "chair", _seat("Dining", "Windsor", "Shell"), int(f.rng.integers(2, 7)))
        f.scattered(table, "top", ("plate", "mug", "bottle", "bowl"), int(f.rng.integers(2, 7)))
    _filled(f, f.against("shelf", _style(width=1.0, height=1.9)))


def _office(f: Furnishing) -> None:
    """A desk with a screen, and a chair in front of it; shelves, a cabinet, a plant."""
    desk = f.against("table", _style("desk"), middle=bool(f.rng.random() < 0.5))
    if desk is not None:
        f.before(desk, "chair", _seat("Office"), gap=-0.15)
        f.on(desk, "top", "monitor" if f.rng.random() < 0.7 else "laptop")
        f.scattered(desk, "top", ("mug", "book", "can", "lamp", "plant"), int(f.rng.integers(2, 5)))
    _filled(f, f.against("shelf"))
    _topped(f, f.against("cabinet", _style("chest", "sideboard")))
    _filled(f, f.against("shelf"))
    f.against("plant", _style(width=0.8))


def _hall(f: Furnishing) -> None:
    """A narrow piece of furniture along the wall."""
    _topped(f, f.against("cabinet", _style("sideboard", "chest", depth=0.42)))


def _topped(f: Furnishing, board: Stand | None) -> None:
    """Things that people put on a low piece of furniture."""
    if board is not None:
        f.scattered(board, "top", ("plant", "book", "bowl", "box", "bottle"), int(f.rng.integers(1, 4)))


def _filled(f: Furnishing, shelf: Stand | None) -> None:
    """Books and other small things on the boards of a shelf."""
    if shelf is not None:
        f.scattered(shelf, "", ("book", "book", "book", "box", "plant", "mug", "bowl"), int(f.rng.integers(2, 5)))


HABITS: dict[Kind, Callable[[Furnishing], None]] = {
    "bedroom": _bedroom,
    "living_room": _living_room,
    "kitchen": _kitchen,
    "office": _office,
    "hall": _hall,
}
