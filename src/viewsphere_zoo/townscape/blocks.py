"""A town's grid: roads between blocks with rounded corners, their pavements and painted lines; metres, the road at z = 0.

Roads run along lines x = const and y = const. From a road's middle outwards: a lane, a parking strip, the kerb, the pavement.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np

from viewsphere.assets.mesh import Material
from viewsphere.model.place import Bay, Lane, standing
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.solids import Float, Solid, fan, flipped, grid, join
from viewsphere_zoo.townscape import STEP
from viewsphere_zoo.townscape.paving import ASPHALT, GRASS, PAINT, PAVING, STONE
from viewsphere_zoo.townscape.roadway import PAINT_TOP, slab
from viewsphere_zoo.townscape.surfaces import cuboid

EARTH = Material("earth", (0.03, 0.022, 0.015, 1.0), roughness=1.0)

LANE, BAY = 3.4, 2.1
"""Width of a lane, and of the strip beside it where cars park."""

HALF = LANE + BAY
"""Half the width of a road."""

CORNER = 5.0
"""Radius of a block's corners."""

PAVED = 2.8
"""Width of the pavement with its kerb."""

KERB = 0.15

BORDER = 14.0
"""Width of the green strip around the town."""

ZEBRA = (1.6, 4.4)
"""Start and end of a junction's zebra crossings, beyond the corners' curves."""

SPACE = 5.8
"""Length of a parking space."""

WALK = (1.4, 0.5)
"""Distance from the kerb to the middle of the walking lane, between lamp posts and benches, and the lane's width, metres."""


@dataclass(frozen=True)
class Block:
    """The land between four roads: its number, and lowest and highest x and y of its kerbs."""

    column: int
    row: int
    low: tuple[float, float]
    high: tuple[float, float]

    @property
    def middle(self) -> tuple[float, float]:
        """The block's middle."""
        return (self.low[0] + self.high[0]) / 2, (self.low[1] + self.high[1]) / 2

    @property
    def size(self) -> tuple[float, float]:
        """Size along x and y."""
        return self.high[0] - self.low[0], self.high[1] - self.low[1]


def blocks(x: Sequence[float], y: Sequence[float]) -> Iterator[Block]:
    """The blocks between roads along these lines, column by column."""
    for (i, (a, b)), (k, (c, d)) in product(enumerate(pairwise(x)), enumerate(pairwise(y))):
        yield Block(i, k, (a + HALF, c + HALF), (b - HALF, d - HALF))


def ring(block: Block, inset: float, steps: int = 8) -> Float:
    """A block's border, this far inside (outside where it is below 0): counter-clockwise, corners rounded, (N, 2)."""
    radius = max(CORNER - inset, 0.05)
    arc = np.linspace(0, np.pi / 2, steps + 1)
    corners: list[Float] = []
    for quarter, (sx, sy) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1))):
        x = (block.high[0] - inset - radius) if sx > 0 else (block.low[0] + inset + radius)
        y = (block.high[1] - inset - radius) if sy > 0 else (block.low[1] + inset + radius)
        angle = arc + quarter * np.pi / 2
        corners.append(np.stack([x + radius * np.cos(angle), y + radius * np.sin(angle)], axis=1))
    return np.concatenate(corners)


def _at(points: Float, z: float) -> Float:
    return np.column_stack([points, np.full(len(points), z)])


def land(block: Block, green: bool) -> list[Piece]:
    """A block's kerb, its pavement, and the area behind it: grass or paving."""
    edge = ((0.0, 0.0), (0.0, STEP - 0.02), (0.02, STEP), (KERB, STEP))
    kerb = np.array([_at(ring(block, inset), z) for inset, z in edge])
    paved = np.array([_at(ring(block, inset), STEP) for inset in (KERB, KERB + 1.3, PAVED)])
    middle = np.array([*block.middle, STEP])
    shares = np.linspace(0, 0.9, 8)[:, None, None]
    inner = paved[-1] * (1 - shares) + middle * shares
    behind = join(flipped(grid(inner, wrap=True)), fan(inner[-1]))
    return [
        Piece("kerb", STONE, flipped(grid(kerb, wrap=True))),
        Piece("pavement", PAVING, flipped(grid(paved, wrap=True))),
        Piece("lawn" if green else "yard", GRASS if green else PAVING, behind),
    ]


def roads(x: Sequence[float], y: Sequence[float]) -> list[Piece]:
    """The asphalt under all roads, the green strip around them, and the faces that close the ground below."""
    low, high = (x[0] - HALF, y[0] - HALF), (x[-1] + HALF, y[-1] + HALF)
    lines = [np.linspace(a, b, max(2, round((b - a) / 6)) + 1) for a, b in zip(low, high, strict=True)]
    gx, gy = np.meshgrid(*lines, indexing="ij")
    asphalt = grid(np.stack([gx, gy, 0 * gx], axis=-1))
    around = Block(0, 0, low, high)
    rings = [(0.0, 0.0), (0.0, STEP), (-0.15, STEP), (-5.0, STEP), (-BORDER, STEP)]
    strips = np.array([_at(_square(around, inset), z) for inset, z in rings])
    base = cuboid((low[0] - BORDER, low[1] - BORDER, -0.6), (high[0] + BORDER, high[1] + BORDER, -0.3))
    return [
        Piece("road", ASPHALT, asphalt),
        Piece("kerb", STONE, grid(strips[:3], wrap=True)),
        Piece("verge", GRASS, grid(strips[2:], wrap=True)),
        Piece("base", EARTH, base),
    ]


def _square(block: Block, inset: float) -> Float:
    """A block's border, this far inside, with sharp corners and points every few metres, counter-clockwise."""
    (x0, y0), (x1, y1) = (np.array(block.low) + inset).tolist(), (np.array(block.high) - inset).tolist()
    t = np.linspace(0, 1, 24, endpoint=False)
    ends = [((x0, y0), (x1, y0)), ((x1, y0), (x1, y1)), ((x1, y1), (x0, y1)), ((x0, y1), (x0, y0))]
    return np.concatenate([np.outer(1 - t, a) + np.outer(t, b) for a, b in ends])


def _stretches(x: Sequence[float], y: Sequence[float]) -> Iterator[tuple[int, float, float, float]]:
    """Parts of roads between the zebra crossings at their ends: their axis, their position across it, and their start and
    end.
    """
    reach = HALF + CORNER + ZEBRA[1]
    for axis, (across, along) in enumerate(((y, x), (x, y))):
        for at, (a, b) in product(across, pairwise(along)):
            yield axis, at, a + reach, b - reach


def _turned(axis: int, along: tuple[float, float], across: tuple[float, float], top: float = PAINT_TOP) -> Solid:
    """A plate on a road that runs along this axis, 0 x or 1 y."""
    return slab(along, across, top) if axis == 0 else slab(across, along, top)


def paint(x: Sequence[float], y: Sequence[float], dash: tuple[float, float] = (3.0, 4.0)) -> list[Piece]:
    """Broken centre lines, stop lines and zebra crossings at the junctions, and the marks of the parking spaces."""
    centre: list[Solid] = []
    bars: list[Solid] = []
    stops: list[Solid] = []
    marks: list[Solid] = []
    for axis, at, start, stop in _stretches(x, y):
        centre += [
            _turned(axis, (s, min(s + dash[0], stop)), (at - 0.06, at + 0.06)) for s in np.arange(start, stop - 1, sum(dash))
        ]
        for end, s in ((start, 1), (stop, -1)):
            near, far = sorted((end - s * ZEBRA[1] + s * ZEBRA[0], end))
            bars += [_turned(axis, (near, far), (at + o - 0.25, at + o + 0.25)) for o in np.arange(-HALF + 0.6, HALF, 1.0)]
            line = sorted((end + s * 1.0, end + s * 1.4))
            lane = (at, at + LANE) if (s > 0) == (axis == 1) else (at - LANE, at)
            stops.append(_turned(axis, (line[0], line[1]), lane))
        for side, place in spaces(start, stop):
            a, b = sorted((at + side * LANE, at + side * (LANE + BAY)))
            marks += [_turned(axis, (place - SPACE / 2 - 0.05, place - SPACE / 2 + 0.05), (a, b))]
    return [
        Piece("centre_line", PAINT, join(*centre)),
        Piece("zebra", PAINT, join(*bars)),
        Piece("stop_line", PAINT, join(*stops)),
        Piece("parking", PAINT, join(*marks)),
    ]


def spaces(start: float, stop: float) -> Iterator[tuple[int, float]]:
    """Middles of the parking spaces along a stretch of road, on both sides of it (-1, 1)."""
    count = int((stop - start - 6.0) // SPACE)
    first = (start + stop) / 2 - (count - 1) * SPACE / 2
    for side in (-1, 1):
        yield from ((side, first + k * SPACE) for k in range(count))


def bays(x: Sequence[float], y: Sequence[float]) -> Iterator[Bay]:
    """Every parking space, heading like a car that drives on the right."""
    for axis, at, start, stop in _stretches(x, y):
        for side, place in spaces(start, stop):
            off = at + side * (LANE + BAY / 2)
            if axis == 0:
                yield Bay(standing(place, off, 90.0 if side < 0 else 270.0), (BAY, SPACE))
            else:
                yield Bay(standing(off, place, 180.0 if side > 0 else 0.0), (BAY, SPACE))


def pavements(x: Sequence[float], y: Sequence[float]) -> tuple[Lane, ...]:
    """The walking lane around every block."""
    inset, width = WALK
    return tuple(
        Lane(f"pavement_{block.column + 1}_{block.row + 1}", _points(ring(block, inset, 6), STEP), width, closed=True)
        for block in blocks(x, y)
    )


def _points(line: Float, z: float) -> tuple[tuple[float, float, float], ...]:
    return tuple((float(a), float(b), z) for a, b in line)


def lanes(x: Sequence[float], y: Sequence[float]) -> tuple[Lane, ...]:
    """Closed lanes, one around every block, with the block on their right, so that none meet; and straight lanes along the
    roads, to +y and -y, +x and -x.
    """
    found: list[Lane] = []
    for block in blocks(x, y):
        path = ring(block, -(BAY + LANE / 2), 6)[::-1]
        found.append(Lane(f"block_{block.column + 1}_{block.row + 1}", _points(path, 0.0), LANE, closed=True))
    for number, at in enumerate(x, 1):
        for name, side in (("up", 1), ("down", -1)):
            off, ends = at + side * LANE / 2, (y[0], y[-1])[::side]
            found.append(Lane(f"{name}_{number}", ((off, ends[0], 0.0), (off, ends[1], 0.0)), LANE))
    for number, at in enumerate(y, 1):
        for name, side in (("right", 1), ("left", -1)):
            off, ends = at - side * LANE / 2, (x[0], x[-1])[::side]
            found.append(Lane(f"{name}_{number}", ((ends[0], off, 0.0), (ends[1], off, 0.0)), LANE))
    return tuple(found)
