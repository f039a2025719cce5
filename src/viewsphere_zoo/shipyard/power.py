"""Engines on the transom: outboards, stern drives with a bathing platform."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.rods import rod
from viewsphere_zoo.shapes.sheets import sheet
from viewsphere_zoo.shapes.solids import Float, Solid, join, lathe, loft, moved, rounded_box, superellipse, turned
from viewsphere_zoo.shipyard.coats import Coats
from viewsphere_zoo.shipyard.lines import Lines


def stacked(levels: ArrayLike, exponent: float = 3.0, count: int = 28) -> Solid:
    """A closed body over (N, 4) horizontal sections: z, half width, half length, y of their middles; z grows."""
    rings: list[Float] = []
    for z, a, b, y in np.asarray(levels, np.float64):
        ring = superellipse(a, b, exponent, count)
        rings.append(np.column_stack([ring[:, 0], ring[:, 1] + y, np.full(count, z)]))
    return loft(np.array(rings))


def propeller(radius: float, at: ArrayLike) -> Solid:
    """Three twisted blades on a hub that turns about y."""
    r = np.linspace(0.16, 1, 7)[:, None] * radius
    chord = 0.5 * radius * np.sin(np.linspace(0.5, 2.75, 7))[:, None] ** 0.7
    s = np.linspace(-1, 1, 5)
    pitch = np.arctan2(0.45 * radius, r)
    blade = sheet(np.stack([s * chord * np.cos(pitch), s * chord * np.sin(pitch), np.broadcast_to(r, (7, 5))], axis=-1), 0.008)
    hub = turned(lathe([(0, -0.09), (0.04, -0.09), (0.036, 0.04), (0.02, 0.08), (0, 0.09)], 16), 0, -np.pi / 2)
    return moved(join(hub, *(turned(blade, 1, k * 2 * np.pi / 3) for k in range(3))), at)


def outboard(c: Coats, at: ArrayLike, leg: float, size: float) -> list[Piece]:
    """An outboard clamped at `at` (on the transom's face); leg: distance from `at` down to the cavitation plate, metres."""
    s, low = size, -leg
    cowl = stacked(
        [
            (0.10, 0.150, 0.235, 0.36),
            (0.13, 0.165, 0.255, 0.36),
            (0.22, 0.175, 0.275, 0.365),
            (0.42, 0.175, 0.285, 0.37),
            (0.55, 0.160, 0.270, 0.365),
            (0.62, 0.130, 0.225, 0.35),
            (0.65, 0.080, 0.150, 0.335),
        ]
        * np.full(4, s),
        3.2,
    )
    band = stacked([(0.19, 0.182, 0.282, 0.365), (0.25, 0.182, 0.284, 0.365)] * np.full(4, s), 3.2)
    mark = moved(rounded_box((0.376 * s, 0.26 * s, 0.07 * s), 0.012, 2), (0, 0.36 * s, 0.4 * s))
    pan = stacked([(-0.06, 0.1, 0.16, 0.34), (0.02, 0.15, 0.23, 0.355), (0.115, 0.155, 0.24, 0.36)] * np.full(4, s))
    shaft = stacked(
        [
            (low - 0.17 * s, 0.022, 0.1 * s, 0.31 * s),
            (low, 0.045 * s, 0.13 * s, 0.31 * s),
            (low + 0.12, 0.055 * s, 0.12 * s, 0.31 * s),
            (-0.05 * s, 0.075 * s, 0.13 * s, 0.33 * s),
        ],
        2.2,
    )
    cavitation = moved(rounded_box((0.25 * s, 0.5 * s, 0.022), 0.01, 2), (0, 0.4 * s, low))
    bracket = join(
        *(moved(rounded_box((0.035, 0.24 * s, 0.34), 0.015, 2), (x * s, 0.08 * s, -0.16)) for x in (-0.1, 0.1)),
        moved(rounded_box((0.17 * s, 0.16 * s, 0.3), 0.03, 2), (0, 0.17 * s, -0.15)),
    )
    fin = sheet(_fin(0.16 * s, 0.1 * s, low - 0.19 * s, 0.3 * s), 0.014)
    deep = low - 0.2 * s
    parts = [
        Piece("outboard_cowl", c.accent, cowl),
        Piece("outboard_cowl", c.stripe, join(band, mark)),
        Piece("outboard_leg", c.black, join(pan, shaft, cavitation, torpedo(0.062 * s, 0.5 * s, (0, 0.33 * s, deep)), fin)),
        Piece("outboard_bracket", c.black, bracket),
        Piece("propeller", c.alloy, propeller(0.17 * s, (0, 0.61 * s, deep))),
    ]
    return [Piece(p.part, p.material, moved(p.solid, at)) for p in parts]


def torpedo(radius: float, length: float, at: ArrayLike) -> Solid:
    """A gear case along y around `at`."""
    s = np.linspace(0, 1, 12)
    r = radius * np.clip(4 * s * (1 - 0.62 * s), 0, None) ** 0.5 / 1.27
    return moved(turned(lathe(np.stack([r, (s - 0.5) * length], axis=1), 18), 0, -np.pi / 2), at)


def _fin(chord: float, drop: float, top: float, y: float) -> Float:
    """The grid of a swept skeg in the plane x = 0, facing +X."""
    s, h = np.linspace(0, 1, 5)[:, None], np.linspace(0, 1, 4)
    z = top - 0.04 - drop * (1 - h) + 0 * s
    back = y - 0.5 * chord + s * chord * (0.55 + 0.45 * h) + 0.35 * chord * (1 - h)
    return np.stack([np.zeros(back.shape), back, z], axis=-1)


def stern_drive(lines: Lines, c: Coats) -> list[Piece]:
    """Drive leg, bathing platform with teak, ladder."""
    t, v = 1.0, lines.level(1.0, -0.12)
    at = lines.point(t, v) * (0, 1, 1)
    leg = stacked(
        [
            (-0.62, 0.02, 0.09, 0.28),
            (-0.45, 0.06, 0.13, 0.27),
            (-0.12, 0.08, 0.15, 0.23),
            (0.12, 0.11, 0.2, 0.18),
            (0.2, 0.09, 0.16, 0.14),
        ],
        2.4,
    )
    plate = moved(rounded_box((0.3, 0.5, 0.024), 0.01, 2), (0, 0.33, -0.3))
    drive = join(leg, plate, torpedo(0.07, 0.5, (0, 0.3, -0.52)), sheet(_fin(0.2, 0.14, -0.52, 0.28), 0.016))
    z = 0.16
    y = float(lines.point(1.0, lines.level(1.0, z))[1])
    half = 0.86 * float(lines.half_at(y - 0.02, z))
    s = np.linspace(0, 1, 9)
    reach = 0.55 * (1 - np.abs(np.linspace(-1, 1, 21)) ** 5 * 0.45)
    x = half * np.linspace(-1, 1, 21)[:, None]
    deck = sheet(np.stack([x + 0 * s, y - 0.03 + reach[:, None] * s, np.full((21, 9), z)], axis=-1), 0.05)
    slats = [moved(rounded_box((1.6 * half, 0.062, 0.014), 0.004, 1), (0, y + 0.05 + 0.078 * k, z + 0.027)) for k in range(5)]
    rails = [rod((x0, y + 0.5, z + 0.03), (x0, y + 0.53, z - 0.55), 0.012, 8) for x0 in (0.55 * half, 0.55 * half + 0.3)]
    steps = [
        rod(
            (0.55 * half, y + 0.505 + 0.013 * k, z - 0.1 - 0.2 * k),
            (0.55 * half + 0.3, y + 0.505 + 0.013 * k, z - 0.1 - 0.2 * k),
            0.014,
            8,
        )
        for k in range(3)
    ]
    return [
        Piece("stern_drive", c.black, moved(drive, at)),
        Piece("propeller", c.alloy, moved(propeller(0.19, (0, 0.56, -0.52)), at)),
        Piece("bathing_platform", c.white, deck),
        Piece("bathing_platform", c.planks, join(*slats)),
        Piece("ladder", c.steel, join(*rails, *steps)),
    ]
