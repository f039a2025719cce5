"""Data classes of places: a layout of models around a free spot for targets, with lanes, bays, pavements and surfaces.

Frame: metres, +Z up, the floor at z = 0, the origin on a free stretch of the floor.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

from viewsphere.model.scene import Matrix4, Vector


@dataclass(frozen=True)
class PlacePiece:
    """One thing of a place: the member of a family that `seed` draws, as a `ModelSpec` of the place's source
    names it with centring and scale "as_is". Pieces of one family and seed are instances of one mesh.

    name is unique in its place; world_from_piece is rigid.
    """

    name: str
    family: str
    seed: int
    category: str
    world_from_piece: Matrix4


@dataclass(frozen=True)
class Lane:
    """A way through a place: the points of its middle in the direction of travel, two at least, and its width, metres. A closed
    lane continues from its last point to its first. name is unique in its place.
    """

    name: str
    points: tuple[Vector, ...]
    width: float
    closed: bool = False


@dataclass(frozen=True)
class Surface:
    """A level rectangle above the floor on which things may stand, such as a table's top: a frame with its origin in the middle
    and +Z up, the size along the frame's x and y, and the free height above it in metres, None if unlimited. name is unique in
    its place.
    """

    name: str
    world_from_surface: Matrix4
    size: tuple[float, float]
    clearance: float | None = None


@dataclass(frozen=True)
class LevelFace:
    """A level face of a model on which things stand, in the model's axes, metres.

    rectangle: low x, low y, high x, high y of its free part; height: its z; clearance: the free height above it, inf under the
    open sky. On cushions and bedding the mesh may be up to 3 cm above or below `height`.
    """

    name: str
    rectangle: tuple[float, float, float, float]
    height: float
    clearance: float = math.inf


@dataclass(frozen=True)
class Bay:
    """A parking space: a frame with its origin in the middle, +Z up, -Y towards the front of a parked vehicle, and its size
    along the frame's x and y, metres.
    """

    world_from_bay: Matrix4
    size: tuple[float, float]


@dataclass(frozen=True)
class Traffic:
    """A place's own traffic: the share of its bays that are taken, None for the place's usual share, and the number of people
    on its pavements. Only places with roads have traffic.
    """

    parked: float | None = None
    walkers: int = 0


USUAL = Traffic()
"""The default traffic of a place."""


@dataclass(frozen=True)
class Place:
    """A layout whose pieces are not built yet. `free`: lowest x and y, highest x and y of the floor for targets, None if
    unlimited. `lanes` are for driving, `bays` for parking, `pavements` for walking in either direction, and `surfaces` for
    things above the floor.
    """

    pieces: tuple[PlacePiece, ...]
    free: tuple[float, float, float, float] | None = None
    lanes: tuple[Lane, ...] = ()
    surfaces: tuple[Surface, ...] = ()
    bays: tuple[Bay, ...] = ()
    pavements: tuple[Lane, ...] = ()


def standing(x: float, y: float, turn_deg: float = 0.0, z: float = 0.0) -> Matrix4:
    """World from piece for a piece that stands at (x, y, z), turned counter-clockwise about the vertical seen from above.

    Exact for multiples of 90 degrees. A piece's front is -Y, so 90 makes it face +X.
    """
    quarter, rest = divmod(turn_deg, 90.0)
    if rest == 0.0:
        c, s = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[int(quarter) % 4]
    else:
        c, s = math.cos(math.radians(turn_deg)), math.sin(math.radians(turn_deg))
    return ((c, 0.0 - s, 0.0, x), (s, c, 0.0, y), (0.0, 0.0, 1.0, z), (0.0, 0.0, 0.0, 1.0))


def stretches(lane: Lane) -> Iterator[tuple[float, float, float, float, float, float]]:
    """The straight parts of a lane: start, end as x and y, and width."""
    points = [*lane.points, lane.points[0]] if lane.closed else lane.points
    for (x0, y0, z), (x1, y1, _) in pairwise(points):
        yield x0, y0, z, x1, y1, lane.width
