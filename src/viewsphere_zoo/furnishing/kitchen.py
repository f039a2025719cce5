"""A kitchen's worktop with its inserts: sink and tap, hob."""

from __future__ import annotations

import numpy as np

from viewsphere.assets.mesh import Material
from viewsphere_zoo.furnishing.casework import block
from viewsphere_zoo.joinery.coats import CHROME, STEEL
from viewsphere_zoo.joinery.members import pipe
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import linear
from viewsphere_zoo.shapes.rods import rod
from viewsphere_zoo.shapes.solids import Solid, join, lathe, moved, rounded_box
from viewsphere_zoo.townscape.surfaces import cuboid

SINK = (0.46, 0.38, 0.16)
"""Width, depth (y) and depth (z) of a basin, metres."""

HOB = (0.58, 0.5)
"""Width and depth of a hob, metres."""


def worktop(
    coat: Material, low: tuple[float, float, float], high: tuple[float, float, float], basin: float | None
) -> list[Piece]:
    """A slab with a hole for a basin, whose middle is at x = basin."""
    if basin is None:
        return [Piece("worktop", coat, block(low, high, 0.004))]
    (x0, y0, z0), (x1, y1, z1) = low, high
    a, b, c, d = basin - SINK[0] / 2, basin + SINK[0] / 2, -SINK[1] / 2, SINK[1] / 2
    parts = [((x0, y0), (a, y1)), ((b, y0), (x1, y1)), ((a, y0), (b, c)), ((a, d), (b, y1))]
    return [Piece("worktop", coat, join(*(cuboid((*p, z0), (*q, z1)) for p, q in parts)))]


def sink(x: float, top: float) -> list[Piece]:
    """A basin of steel with its rim and drain, and a tall tap behind it."""
    (w, d, deep), t = SINK, 0.004
    low = top - deep
    walls = [
        block((x - w / 2, -d / 2, low), (x + w / 2, d / 2, low + t), 0.001),
        *(block((x + s * w / 2 - t, -d / 2, low), (x + s * w / 2 + t, d / 2, top + 0.003), 0.001) for s in (-1, 1)),
        *(block((x - w / 2, s * d / 2 - t, low), (x + w / 2, s * d / 2 + t, top + 0.003), 0.001) for s in (-1, 1)),
    ]
    rim = [
        block((x + s * w / 2 - 0.012, -d / 2 - 0.012, top), (x + s * w / 2 + 0.012, d / 2 + 0.012, top + 0.004), 0.001)
        for s in (-1, 1)
    ]
    rim += [block((x - w / 2, s * d / 2 - 0.012, top), (x + w / 2, s * d / 2 + 0.012, top + 0.004), 0.001) for s in (-1, 1)]
    drain = lathe([(0, low + t), (0.04, low + t), (0.038, low + t + 0.003), (0, low + t + 0.003)], 20)
    return [
        Piece("sink", STEEL, join(*walls, *rim)),
        Piece("sink", CHROME, moved(drain, (x, 0, 0))),
        Piece("tap", CHROME, moved(_tap(), (x, d / 2 + 0.05, top))),
    ]


def _tap() -> Solid:
    """A swan neck over the basin, and its lever."""
    a = np.linspace(0, np.pi, 9)
    neck = [(0, 0, 0.0), (0, 0, 0.2), *((0, -0.085 * (1 - np.cos(b)), 0.24 + 0.085 * np.sin(b)) for b in a), (0, -0.17, 0.2)]
    foot = lathe([(0, 0), (0.028, 0), (0.026, 0.05), (0.013, 0.06), (0, 0.06)], 16)
    return join(pipe(neck, 0.011, 0.005, 9), foot, rod((0.02, 0, 0.035), (0.08, 0, 0.075), 0.006, 8))


def hob(x: float, top: float, gas: bool) -> list[Piece]:
    """Four rings in black glass, or four burners under pan supports; knobs in front."""
    glass = Material("hob_glass", linear((0.03, 0.03, 0.033)), roughness=0.08, clearcoat=1.0)
    iron = Material("iron", linear((0.07, 0.07, 0.07)), roughness=0.6)
    ring = Material("ring", linear((0.55, 0.56, 0.58)), roughness=0.4)
    w, d = HOB
    plate = moved(rounded_box((w, d, 0.01), 0.004, 1), (x, 0, top + 0.004))
    found = [Piece("hob", STEEL if gas else glass, plate)]
    for sx, sy, r in ((-1, -1, 0.085), (1, -1, 0.07), (-1, 1, 0.07), (1, 1, 0.09)):
        at = (x + sx * 0.145, 0.03 + sy * 0.115, top + 0.009)
        if gas:
            burner = lathe([(0, 0), (0.55 * r, 0), (0.55 * r, 0.012), (0.3 * r, 0.018), (0, 0.018)], 18)
            bars = [
                block((-1.15 * r, -0.005, 0.018), (1.15 * r, 0.005, 0.03), 0.001),
                block((-0.005, -1.15 * r, 0.018), (0.005, 1.15 * r, 0.0305), 0.001),
            ]
            posts = [
                block((a - 0.005, b - 0.005, -0.002), (a + 0.005, b + 0.005, 0.02), 0.001)
                for a, b in ((-1.1 * r, 0), (1.1 * r, 0), (0, -1.1 * r), (0, 1.1 * r))
            ]
            found.append(Piece("burner", iron, moved(join(burner, *bars, *posts), at)))
        else:
            line = lathe([(r - 0.003, 0), (r + 0.003, 0), (r + 0.003, 0.0012), (r - 0.003, 0.0012), (r - 0.003, 0)], 32)
            found.append(Piece("burner", ring, moved(line, at)))
    knob = lathe([(0, 0), (0.02, 0), (0.017, 0.022), (0, 0.022)], 16)
    knobs = [moved(knob, (x + k * 0.07, -d / 2 + 0.035, top + 0.009)) for k in (-1.5, -0.5, 0.5, 1.5)]
    return [*found, Piece("knob", iron if gas else ring, join(*knobs))]
