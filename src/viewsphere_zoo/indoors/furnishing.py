"""Placement of furniture in a room: against walls, beside, in front of and on other furniture, clear of doors and windows."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import numpy as np

from viewsphere.model.place import LevelFace
from viewsphere_zoo import drawing_of
from viewsphere_zoo import family as zoo_family
from viewsphere_zoo.indoors.plan import SIDES, Room, Side

DRAWS = 400
"""Members of a family to draw until one meets the test."""

STANDOFF = 0.9
"""Distance between the free floor and the walls, as room for cameras, metres."""

SEATED = 0.7
"""Space around a table for seated people, up to other furniture, metres."""

SPOTS = 30
"""Number of spots to try for a small thing on a surface."""

FACING = ("book", "laptop", "monitor", "television")
"""Small things that face their user."""

LAYER = 0.25
"""Least distance between two boards of a shelf, metres."""

STEP = 0.05
"""Distance between the spots to try along a wall, metres."""

SWING, DRAPE, SIGHT = 0.95, 0.2, 0.7
"""Depth into the room, metres: of the floor for doors, of curtains and radiators, and of the free space at windows."""

Rectangle = tuple[float, float, float, float]
"""Lowest x and y, highest x and y."""

Fits = Callable[[Any], bool]


@dataclass(frozen=True)
class Stand:
    """A family's member with its place: its origin, and its counter-clockwise turn."""

    family: str
    seed: int
    parameters: Any
    x: float
    y: float
    turn_deg: float = 0.0
    z: float = 0.0

    @property
    def size(self) -> tuple[float, float, float]:
        """Width, depth and height, metres."""
        return extent(self.parameters)

    @property
    def rectangle(self) -> Rectangle:
        """The floor area of the member, in a box along the axes."""
        w, d, _ = self.size
        c, s = abs(math.cos(math.radians(self.turn_deg))), abs(math.sin(math.radians(self.turn_deg)))
        a, b = (w * c + d * s) / 2, (w * s + d * c) / 2
        return self.x - a, self.y - b, self.x + a, self.y + b

    def at(self, right: float, ahead: float) -> tuple[float, float]:
        """The point this far to the right of the member's middle, seen by a viewer facing its front, and this far ahead of
        it.
        """
        c, s = math.cos(math.radians(self.turn_deg)), math.sin(math.radians(self.turn_deg))
        return self.x + right * c + ahead * s, self.y + right * s - ahead * c

    def surfaces(self) -> tuple[LevelFace, ...]:
        """The level faces for things to stand on, in the member's axes."""
        found = zoo_family(self.family).surfaces
        return () if found is None else found(self.parameters)


def extent(parameters: Any) -> tuple[float, float, float]:
    """Width, depth and height of a family's member, metres, from its parameters: its `extent`, or its single measures."""
    own: tuple[float, float, float] | None = getattr(parameters, "extent", None)
    if own is not None:
        return own
    width: float = parameters.width if hasattr(parameters, "width") else 2 * parameters.radius
    return width, getattr(parameters, "depth", width), parameters.height


def across(turn_deg: float) -> Side:
    """The side of the room that furniture with this turn faces, its back to the wall."""
    return SIDES[(round(-turn_deg / 90) + 2) % 4]


def overlap(a: Rectangle, b: Rectangle, gap: float = 0.0) -> bool:
    """Return whether two rectangles overlap or are nearer than `gap`."""
    return a[0] < b[2] + gap and b[0] < a[2] + gap and a[1] < b[3] + gap and b[1] < a[3] + gap


@dataclass(eq=False)
class Furnishing:
    """A room being furnished: its furniture, and the floor areas to keep free."""

    room: Room
    rng: np.random.Generator
    stands: list[Stand] = field(default_factory=list[Stand])

    def design(self, family: str, fits: Fits = lambda p: True) -> tuple[int, Any] | None:
        """A seed of the family and the parameters drawn from it that meet the test; None if no seed does."""
        draw = drawing_of(family)
        for _ in range(DRAWS):
            seed = int(self.rng.integers(1 << 31))
            if fits(parameters := draw(np.random.default_rng(seed))):
                return seed, parameters
        return None

    def against(
        self, family: str, fits: Fits = lambda p: True, sides: Iterable[Side] = SIDES, middle: bool = False, gap: float = 0.03
    ) -> Stand | None:
        """Place a member with its back against a wall, walls with the most room first; `middle`: as near to the wall's middle
        as possible.
        """
        found = self.design(family, fits)
        if found is None:
            return None
        seed, parameters = found
        for side in self._sides(sides):
            spots = list(self._along(family, seed, parameters, side, gap))
            if spots:
                x, y = self.room.middle(side)
                order = sorted(spots, key=lambda s: math.hypot(s.x - x, s.y - y))
                return self._add(order[0] if middle else spots[int(self.rng.integers(len(spots)))])
        return None

    def beside(self, other: Stand, right: int, family: str, fits: Fits = lambda p: True, gap: float = 0.06) -> Stand | None:
        """Place a member beside another one, at its right (1) or left (-1), with its back on the same line."""
        found = self.design(family, fits)
        if found is None:
            return None
        seed, p = found
        x, y = other.at(right * (other.size[0] / 2 + extent(p)[0] / 2 + gap), extent(p)[1] / 2 - other.size[1] / 2)
        return self._try(Stand(family, seed, p, x, y, other.turn_deg))

    def before(
        self, other: Stand, family: str, fits: Fits = lambda p: True, gap: float = 0.4, right: float = 0.0, turn: float = 180.0
    ) -> Stand | None:
        """Place a member in front of another one, turned by `turn` against it (180: face to face); a gap below 0 pushes it
        under.
        """
        found = self.design(family, fits)
        if found is None:
            return None
        seed, p = found
        x, y = other.at(right, other.size[1] / 2 + gap + extent(p)[1] / 2)
        return self._try(Stand(family, seed, p, x, y, (other.turn_deg + turn) % 360), around=other if gap < 0 else None)

    def around(self, table: Stand, family: str, fits: Fits, count: int, tuck: float = 0.12) -> None:
        """Place up to this many members of one design around a table, facing it, a little askew; fewer if there is no room."""
        found = self.design(family, fits)
        if found is None:
            return
        seed, p = found
        w, d, _ = table.size
        long = [(x, s) for s in (1, -1) for x in ((-w / 4, w / 4) if w > 1.25 else (0.0,))]
        spots = [(x, s * (d / 2 - tuck + extent(p)[1] / 2), 0.0 if s < 0 else 180.0) for x, s in long]
        spots += [(s * (w / 2 - tuck + extent(p)[1] / 2), 0.0, -90.0 * s) for s in (1, -1)]
        for right, ahead, turn in spots[:count]:
            x, y = table.at(right, ahead)
            askew = float(self.rng.normal(0, 4))
            self._try(Stand(family, seed, p, x, y, table.turn_deg + turn + askew), around=table)

    def in_the_middle(self, family: str, fits: Fits = lambda p: True) -> Stand | None:
        """Place a member as near to the room's middle as possible, with room for people seated around it."""
        found = self.design(family, fits)
        if found is None:
            return None
        seed, p = found
        (x0, y0), (x1, y1) = self.room.low, self.room.high
        turn = 90.0 if (x1 - x0 < y1 - y0) == (extent(p)[0] > extent(p)[1]) else 0.0
        x, y = (x0 + x1) / 2, (y0 + y1) / 2
        offsets = sorted(product(np.arange(-1.5, 1.6, 0.15), repeat=2), key=lambda d: math.hypot(*d))
        for dx, dy in offsets:
            made = Stand(family, seed, p, x + float(dx), y + float(dy), turn)
            a, b, c, d = made.rectangle
            others = [s for s in self.stands if s.z == 0 and s.size[2] > 0.06]
            if self._is_free(made) and not any(overlap((a, b, c, d), s.rectangle, SEATED) for s in others):
                return self._add(made)
        return None

    def on(self, other: Stand, name: str, family: str, fits: Fits = lambda p: True, turn: float = 0.0) -> Stand | None:
        """Put a thing on the middle of a surface of the piece whose name begins with this text."""
        surface = next((s for s in other.surfaces() if s.name.startswith(name)), None)
        found = self.design(family, lambda p: fits(p) and surface is not None and extent(p)[2] < surface.clearance)
        if surface is None or found is None:
            return None
        seed, p = found
        x0, y0, x1, y1 = surface.rectangle
        x, y = other.at((x0 + x1) / 2, -(y0 + y1) / 2)
        made = Stand(family, seed, p, x, y, (other.turn_deg + turn) % 360, other.z + surface.height)
        self.stands.append(made)
        return made

    def scattered(self, other: Stand, name: str, families: Sequence[str], count: int, gap: float = 0.02) -> None:
        """Place small things of these families on a surface of a member, turned at random, clear of one another and of the
        things already there; fewer if there is no room.
        """
        for surface in other.surfaces():
            if surface.name.startswith(name):
                for _ in range(count):
                    self._scatter(other, surface, families[int(self.rng.integers(len(families)))], gap)

    def _scatter(self, other: Stand, surface: LevelFace, family: str, gap: float) -> None:
        found = self.design(family, lambda p: extent(p)[2] < surface.clearance)
        if found is None:
            return
        seed, p = found
        wide, deep, _ = extent(p)
        reach = (wide / 2, deep / 2) if family in FACING else (math.hypot(wide, deep) / 2,) * 2
        x0, y0, x1, y1 = surface.rectangle
        spare = (x1 - x0) / 2 - reach[0], (y1 - y0) / 2 - reach[1]
        if min(spare) < 0:
            return
        for _ in range(SPOTS):
            u, v = (float(self.rng.uniform(-one, one)) for one in spare)
            turn = float(self.rng.normal(0, 8) if family in FACING else self.rng.uniform(0, 360))
            spot = other.at((x0 + x1) / 2 + u, -(y0 + y1) / 2 - v)
            made = Stand(family, seed, p, *spot, (other.turn_deg + turn) % 360, other.z + surface.height)
            near = [s for s in self.stands if s.z > 0 and abs(s.z - made.z) < LAYER]
            if not any(overlap(made.rectangle, s.rectangle, gap) for s in near):
                self.stands.append(made)
                return

    def under(self, middle: tuple[float, float], turn: float, family: str, fits: Fits = lambda p: True) -> Stand | None:
        """Place a rug on the floor under other furniture; None if it would not lie flat in the room."""
        found = self.design(family, fits)
        if found is None:
            return None
        made = Stand(family, *found, *middle, turn)
        if not self._inside(made.rectangle):
            return None
        self.stands.append(made)
        return made

    def free(self, least: float) -> Rectangle | None:
        """The floor square, at least this wide, that is farthest from furniture and far enough from walls for cameras; None
        without such a square.
        """
        (x0, y0), (x1, y1) = self.room.low, self.room.high
        x, y = np.arange(x0 + 0.1, x1, 0.1), np.arange(y0 + 0.1, y1, 0.1)
        at = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
        walls = np.minimum(np.minimum(at[..., 0] - x0, x1 - at[..., 0]), np.minimum(at[..., 1] - y0, y1 - at[..., 1]))
        room = walls - STANDOFF
        for a, b, c, d in [s.rectangle for s in self.stands if s.size[2] > 0.06 and s.z == 0] + self._doors():
            apart = np.maximum(np.maximum(a - at[..., 0], at[..., 0] - c), np.maximum(b - at[..., 1], at[..., 1] - d))
            room = np.minimum(room, apart)
        i, k = np.unravel_index(int(room.argmax()), room.shape)
        half = float(room[i, k])
        a, b = float(x[i]), float(y[k])
        return None if 2 * half < least else (a - half, b - half, a + half, b + half)

    def _sides(self, sides: Iterable[Side]) -> list[Side]:
        """The sides in a random order, sides without openings first."""
        chance: dict[Side, float] = {side: float(self.rng.random()) for side in sides}
        return sorted(chance, key=lambda side: (len(self.room.openings_in(side)), chance[side]))

    def _along(self, family: str, seed: int, p: Any, side: Side, gap: float) -> Iterator[Stand]:
        """Yield the free spots along a wall."""
        (x, y), turn = self.room.middle(side), -90.0 * SIDES.index(side)
        wall = Stand(family, seed, p, x, y, turn)
        w, d, _ = extent(p)
        reach = (self.room.length(side) - w) / 2 - 0.02
        for t in np.arange(-reach, reach + 1e-9, STEP) if reach >= 0 else ():
            for off in (gap, DRAPE):
                made = Stand(family, seed, p, *wall.at(float(t), d / 2 + off), turn % 360)
                if self._is_free(made):
                    yield made
                    break

    def _try(self, made: Stand, around: Stand | None = None) -> Stand | None:
        return self._add(made) if self._is_free(made, around) else None

    def _add(self, made: Stand) -> Stand:
        self.stands.append(made)
        return made

    def _inside(self, own: Rectangle) -> bool:
        (x0, y0), (x1, y1) = self.room.low, self.room.high
        return own[0] > x0 + 0.005 and own[1] > y0 + 0.005 and own[2] < x1 - 0.005 and own[3] < y1 - 0.005

    def _is_free(self, made: Stand, around: Stand | None = None) -> bool:
        """Return whether there is room for a member, clear of doors, windows and furniture, except the furniture that it
        stands `around`.
        """
        own = made.rectangle
        if not self._inside(own) or any(overlap(own, other) for other in self._doors() + self._windows(made.size[2])):
            return False
        others = [s for s in self.stands if s is not around and s.z == 0 and s.size[2] > 0.06]
        return not any(overlap(own, other.rectangle, 0.02) for other in others)

    def _doors(self) -> list[Rectangle]:
        return [self._before(o.side, o.span, SWING) for o in self.room.openings if o.opens != "window"]

    def _windows(self, height: float) -> list[Rectangle]:
        """Return the areas that stay free before windows, for things of this height."""
        found = [o for o in self.room.openings if o.opens == "window"]
        low = [self._before(o.side, (o.span[0] - 0.35, o.span[1] + 0.35), DRAPE - 0.01) for o in found]
        return low + [self._before(o.side, o.span, SIGHT) for o in found if height > o.foot + 0.15]

    def _before(self, side: Side, span: tuple[float, float], deep: float) -> Rectangle:
        """The floor in front of a part of a wall."""
        wall = Stand("", 0, None, *self.room.middle(side), -90.0 * SIDES.index(side))
        corners: Sequence[tuple[float, float]] = [wall.at(t, a) for t in span for a in (0.0, deep)]
        xs, ys = zip(*corners, strict=True)
        return min(xs), min(ys), max(xs), max(ys)
