"""Plans of interiors: rooms, their walls, and the openings in the walls; metres."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from viewsphere_zoo.indoors.coverings import PAINT, PLANKS, Floor, Wall

Kind = Literal["living_room", "bedroom", "kitchen", "office", "hall"]
Side = Literal["rear", "right", "front", "left"]
SIDES: tuple[Side, ...] = get_args(Side)
"""Walls in the order of the turns -0, -90, -180, -270 degrees that bring the rear one (+Y) there; right is +X."""

RIGHT: dict[Side, tuple[int, int]] = {"rear": (1, 0), "right": (0, -1), "front": (-1, 0), "left": (0, 1)}
"""Direction to a wall's right as seen from the room, x and y."""

INNER, OUTER = 0.12, 0.32
"""Thickness of walls between two rooms, and of outside walls."""

Opens = Literal["window", "door", "doorway", "entrance"]


@dataclass(frozen=True)
class Opening:
    """A hole in a wall as seen from the room: the offset of its middle to the right of the wall's middle, and its size.

    window: to the outside; door: to another room, its open leaf hangs in this room, at the hinge's side (-1 left, 1 right);
    doorway: the same hole seen from the other room; entrance: a door that is shut, behind which nothing is shown.
    """

    side: Side
    x: float
    width: float
    height: float
    foot: float = 0.0
    opens: Opens = "window"
    hinge: Literal[-1, 1] = 1
    ajar_deg: float = 90.0

    @property
    def span(self) -> tuple[float, float]:
        """Start and end along the wall."""
        return self.x - self.width / 2, self.x + self.width / 2


@dataclass(frozen=True)
class Room:
    """One room: lowest x and y and highest x and y of its floor, the openings in its walls, the coverings of walls and
    floor.
    """

    kind: Kind
    low: tuple[float, float]
    high: tuple[float, float]
    openings: tuple[Opening, ...] = ()
    floor: Floor = PLANKS
    wall: Wall = PAINT

    @property
    def size(self) -> tuple[float, float]:
        """Size along x and along y."""
        return self.high[0] - self.low[0], self.high[1] - self.low[1]

    def length(self, side: Side) -> float:
        """Length of a wall."""
        return self.size[0] if side in ("rear", "front") else self.size[1]

    def middle(self, side: Side) -> tuple[float, float]:
        """The foot of a wall's middle, x and y."""
        x, y = (self.low[0] + self.high[0]) / 2, (self.low[1] + self.high[1]) / 2
        return {"rear": (x, self.high[1]), "right": (self.high[0], y), "front": (x, self.low[1]), "left": (self.low[0], y)}[
            side
        ]

    def along(self, side: Side, room: Room, x: float) -> float:
        """Return a position along this room's wall on that side, from the position x to the right of the middle of another
        room's wall.
        """
        (a, b), (c, d) = room.middle(side), self.middle(side)
        right, up = RIGHT[side]
        return x + (a - c) * right + (b - d) * up

    def openings_in(self, side: Side) -> tuple[Opening, ...]:
        """Return the openings in a wall."""
        return tuple(opening for opening in self.openings if opening.side == side)
