"""Cranks with their spider, and pedals."""

from __future__ import annotations

from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material
from viewsphere_zoo.cycle.chain import pitch_radius
from viewsphere_zoo.cycle.coats import Coats
from viewsphere_zoo.cycle.gears import Gears
from viewsphere_zoo.cycle.layout import Layout
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.rods import ring_of, rod, shifted
from viewsphere_zoo.shapes.solids import Float, Solid, join, loft, moved, rounded_box, superellipse, turned

Pedal = Literal["platform", "cage", "rubber", "clipless"]


def crank_pieces(at: Layout, g: Gears, length: float, angle: float, arms: int, pedal: Pedal, coats: Coats) -> list[Piece]:
    """Both cranks and pedals; the right crank points towards the front, raised by `angle` radians."""
    inside = g.line + {"none": 0.012, "case": 0.022}.get(g.guard, 0.016)
    pieces: list[Piece] = []
    for side, start in ((-1, np.pi - angle), (1, -angle)):
        arm = turned(_arm(length, inside, side), 0, start)
        pieces.append(Piece(f"crank_{'left' if side > 0 else 'right'}", coats.parts, moved(arm, at.bracket)))
        tip = at.bracket + length * np.array((0.0, np.cos(start), np.sin(start)))
        pieces += _pedal(pedal, side, shifted(tip, side * (inside + 0.024), 0, 0), coats)
    spindle = rod((-inside - 0.004, 0, 0), (inside + 0.004, 0, 0), 0.0115, 16)
    pieces.append(Piece("bottom_bracket", coats.steel, moved(spindle, at.bracket)))
    if g.guard != "case":
        spider = turned(_spider(g, inside, arms), 0, np.pi - angle)
        pieces.append(Piece("crank_right", coats.parts, moved(spider, at.bracket)))
    return pieces


def _arm(length: float, inside: float, side: int) -> Solid:
    """A crank along +y, leaning outwards, with round ends."""
    f = np.array((-0.075, -0.06, -0.02, 0.06, 0.16, 0.5, 0.9, 0.97, 1.03, 1.06))
    tall = 0.5 * np.array((0.014, 0.028, 0.037, 0.034, 0.029, 0.026, 0.024, 0.025, 0.02, 0.01))
    thick = 0.5 * np.array((0.014, 0.021, 0.023, 0.021, 0.015, 0.0135, 0.0135, 0.0135, 0.0125, 0.009))
    lean = inside + 0.0085 + 0.0095 * np.clip(f, 0, 1)
    rings = np.empty((len(f), 12, 3))
    for k in range(len(f)):
        section = superellipse(thick[k], tall[k], 3.0, 12)
        rings[k] = np.column_stack([side * lean[k] + section[:, 0], np.full(12, f[k] * length), section[:, 1]])
    return loft(rings[:, ::-1])


def _spider(g: Gears, inside: float, arms: int) -> Solid:
    """Arms from the right crank to the chainring, with bolts."""
    root = pitch_radius(g.rings[0]) - 0.0115
    depth = 0.5 * (inside + 0.006 - g.line)
    f = np.array((0.0, 0.4, 0.8, 1.0))
    wide = np.array((0.011, 0.0075, 0.006, 0.007))
    x = -np.array((inside + 0.004, inside + 0.002, g.line + 0.0045, g.line + 0.0035))
    square = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    rings = np.stack(
        [
            np.column_stack(
                [x[k] + 0.35 * depth * square[:, 0], square[:, 1] * wide[k], np.full(4, 0.012 + f[k] * (root - 0.012))]
            )
            for k in range(4)
        ]
    )
    arm = loft(rings)
    bolt = rod((-g.line + 0.003, 0, root - 0.006), (-g.line - 0.0085, 0, root - 0.006), 0.005, 8)
    return ring_of(join(arm, bolt), arms, 0, 0.4)


def _pedal(kind: Pedal, side: int, tip: Float, coats: Coats) -> list[Piece]:
    """A pedal whose axle starts at the crank's tip and runs outwards."""
    name = f"pedal_{'left' if side > 0 else 'right'}"
    axle = rod((-side * 0.012, 0, 0), (side * 0.06, 0, 0), 0.006, 10)
    pieces = [(coats.steel, axle)]
    centre = side * 0.062
    if kind == "rubber":
        block = rounded_box((0.086, 0.022, 0.022), 0.007, 2)
        ribs = [moved(rounded_box((0.003, 0.024, 0.024), 0.001, 1), (x, 0, 0)) for x in np.linspace(-0.034, 0.034, 5)]
        pads = [moved(join(block, *ribs), (centre, y, 0)) for y in (-0.027, 0.027)]
        ends = [moved(rounded_box((0.006, 0.07, 0.018), 0.0025, 1), (centre + s * 0.044, 0, 0)) for s in (-1, 1)]
        lights = [moved(rounded_box((0.045, 0.004, 0.011), 0.0015, 1), (centre, y, 0)) for y in (-0.0385, 0.0385)]
        sleeve = rod((centre - 0.043, 0, 0), (centre + 0.043, 0, 0), 0.01, 12)
        pieces += [(coats.rubber, join(*pads)), (coats.alloy, join(*ends, sleeve)), (coats.amber, join(*lights))]
    elif kind == "clipless":
        body = loft(_clipless_rings())
        pieces += [(coats.black, moved(body, (centre - side * 0.016, 0, 0)))]
        pieces += [(coats.alloy, moved(rounded_box((0.034, 0.03, 0.004), 0.001, 1), (centre - side * 0.016, 0.004, 0.0085)))]
    else:
        pieces += _frame_pedal(kind, centre, coats)
    return [Piece(name, material, moved(solid, tip)) for material, solid in pieces]


def _clipless_rings() -> Float:
    """A shield-shaped body, wide at the rear, pointed at the front."""
    y = np.array((-0.046, -0.04, -0.02, 0.0, 0.02, 0.034, 0.038))
    wide = np.array((0.006, 0.014, 0.022, 0.026, 0.03, 0.03, 0.024))
    tall = np.array((0.003, 0.006, 0.008, 0.009, 0.009, 0.008, 0.005))
    return np.stack(
        [
            np.column_stack([s[:, 0], np.full(12, v), s[:, 1]])[::-1]
            for v, s in ((v, superellipse(a, b, 3.0, 12)) for v, a, b in zip(y, wide, tall, strict=True))
        ]
    )


def _frame_pedal(kind: Pedal, centre: float, coats: Coats) -> list[tuple[Material, Solid]]:
    """An open frame around the axle: a platform with pins, or a cage with teeth."""
    flat = kind == "platform"
    wide, long, tall = (0.098, 0.1, 0.015) if flat else (0.076, 0.082, 0.022)
    bars = [
        moved(rounded_box((wide, 0.011 if flat else 0.0035, tall), 0.0016, 1), (centre, s * (long / 2 - 0.005), 0))
        for s in (-1, 1)
    ]
    bars += [
        moved(rounded_box((0.009, long - 0.008, tall * 0.9), 0.0016, 1), (centre + s * (wide / 2 - 0.006), 0, 0))
        for s in (-1, 1)
    ]
    sleeve = rod((centre - wide / 2 + 0.002, 0, 0), (centre + wide / 2 - 0.002, 0, 0), 0.0105 if flat else 0.012, 12)
    pins: list[Solid] = []
    for sx in np.linspace(-0.4, 0.4, 4 if flat else 8) * wide:
        for sy in (-1, 1):
            y = sy * (long / 2 - 0.005)
            pins += [rod((centre + sx, y, -tall / 2 - 0.003), (centre + sx, y, tall / 2 + 0.003), 0.0017, 5)]
    body = coats.extra if flat else coats.alloy
    return [(body, join(*bars)), (coats.black if flat else coats.alloy, sleeve), (coats.steel, join(*pins))]
