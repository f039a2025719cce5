"""Things on a road: painted lines, manhole covers, drains, patches. All are thin slabs, at least 3 mm apart in height."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import metal
from viewsphere_zoo.shapes.solids import Solid, join, lathe, moved
from viewsphere_zoo.townscape import HALF_LENGTH, ROAD
from viewsphere_zoo.townscape.paving import CROSSING, GUTTER, PAINT, PATCH
from viewsphere_zoo.townscape.surfaces import cuboid

PAINT_TOP, PATCH_TOP, IRON_TOP = 0.004, 0.003, 0.006
EDGE = 2.72
"""x of the middle of the edge lines, metres."""

IRON = metal("cast_iron", (0.27, 0.26, 0.25), 0.6)


def slab(x: tuple[float, float], y: tuple[float, float], top: float) -> Solid:
    """A plate on the road with its foot sunk in."""
    return cuboid((x[0], y[0], -0.02), (x[1], y[1], top))


def lines(dash: tuple[float, float], zebra: float, edge_lines: bool) -> list[Piece]:
    """Centre line, edge lines and the zebra crossing."""
    stroke, gap = dash
    start = gap / 2 + (stroke + gap) * np.arange(int(HALF_LENGTH / (stroke + gap)) + 1)
    strokes = [(s, min(s + stroke, HALF_LENGTH)) for s in start.tolist() if s < HALF_LENGTH - 0.5]
    strokes += [(-b, -a) for a, b in strokes]
    free = [(a, b) for a, b in strokes if b < zebra - 2.6 or a > zebra + 2.6]
    pieces = [Piece("centre_line", PAINT, join(*(slab((-0.06, 0.06), s, PAINT_TOP) for s in free)))]
    if edge_lines:
        runs = ((-HALF_LENGTH, zebra - 2.2), (zebra + 2.2, HALF_LENGTH))
        bands = [slab((s * EDGE - 0.05, s * EDGE + 0.05), run, PAINT_TOP) for s in (-1, 1) for run in runs]
        pieces.append(Piece("edge_line", PAINT, join(*bands)))
    bars = [slab((x - 0.25, x + 0.25), (zebra - 1.6, zebra + 1.6), PAINT_TOP) for x in np.arange(-2.5, 2.6, 1.0)]
    return [*pieces, Piece("zebra", PAINT, join(*bars))]


def fittings(covers: tuple[float, ...], crossings: tuple[tuple[float, ...], tuple[float, ...]]) -> list[Piece]:
    """Manhole covers in the lanes, and drains in the gutters away from dropped kerbs."""
    lids = manholes([((1.45, -1.55)[i % 2], y) for i, y in enumerate(covers)])
    drains: list[Solid] = []
    for side, at in zip((1, -1), crossings, strict=True):
        for y in np.arange(-85.0, 86.0, 24.0) + 5 * side:
            if all(abs(y - c) > CROSSING + 1 for c in at):
                drains.append(moved(_drain(), (side * (GUTTER + ROAD) / 2, y, 0)))
    return [lids, Piece("drain", IRON, join(*drains))]


def manholes(at: Sequence[tuple[float, float]]) -> Piece:
    """Iron covers at these points (x, y) of a road."""
    return Piece("manhole", IRON, join(*(moved(_cover(), (x, y, 0)) for x, y in at)))


def _cover() -> Solid:
    """A round iron cover: frame, gap, lid with raised studs."""
    profile = [(0.37, -0.02), (0.37, IRON_TOP), (0.335, IRON_TOP), (0.333, -0.004), (0.325, -0.004), (0.323, 0.003), (0, 0.003)]
    at = np.arange(-5, 6) * 0.055
    studs = [
        cuboid((x - 0.016, y - 0.016, 0.001), (x + 0.016, y + 0.016, IRON_TOP)) for x in at for y in at if x * x + y * y < 0.078
    ]
    return join(lathe(profile, 40), *studs)


def _drain() -> Solid:
    """An iron grating, its bars across the gutter."""
    bars = [cuboid((-0.11, y - 0.011, 0.002), (0.11, y + 0.011, IRON_TOP)) for y in np.arange(-0.2, 0.21, 0.04)]
    rims = [cuboid((x - 0.015, -0.24, 0.002), (x + 0.015, 0.24, IRON_TOP)) for x in (-0.12, 0.12)]
    ends = [cuboid((-0.135, y - 0.012, 0.002), (0.135, y + 0.012, IRON_TOP)) for y in (-0.228, 0.228)]
    return join(*bars, *rims, *ends)


def patches(rng: np.random.Generator, wear: float, zebra: float, covers: tuple[float, ...]) -> list[Piece]:
    """Mended trenches and squares in the lanes, clear of lines, zebra and covers."""
    plates: list[Solid] = []
    for _ in range(int(10 * wear)):
        side, y = float(rng.choice((-1.0, 1.0))), float(rng.uniform(-60, 60))
        long, low = float(rng.uniform(0.7, 4.0)), float(rng.uniform(0.35, 1.2))
        high = float(rng.uniform(low + 0.5, 2.5))
        if (
            min(
                abs(y - c) for c in (zebra, *covers, *(0.5 * (p.vertices[:, 1].min() + p.vertices[:, 1].max()) for p in plates))
            )
            > 6
        ):
            plates.append(slab((min(side * low, side * high), max(side * low, side * high)), (y, y + long), PATCH_TOP))
    return [Piece("patch", PATCH, join(*plates))] if plates else []
