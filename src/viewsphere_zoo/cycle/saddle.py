"""Saddles and seat posts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere_zoo.cycle.coats import Coats
from viewsphere_zoo.cycle.layout import Layout
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.rods import shifted, smooth
from viewsphere_zoo.shapes.solids import Float, Solid, both_sides, curve, join, loft, moved, rounded_box, tube


@dataclass(frozen=True)
class Saddle:
    """A saddle; lengths in metres. tilt: nose up, degrees; springs: two coils under its rear."""

    length: float = 0.275
    width: float = 0.145
    padding: float = 0.045
    tilt: float = 0.0
    springs: bool = False


def saddle_pieces(at: Layout, s: Saddle, coats: Coats) -> list[Piece]:
    """Parts saddle and seat_post."""
    top = at.on_seat(at.g.saddle)
    place = shifted(top, 0, 0.012, -0.006)

    def put(solid: Solid) -> Solid:
        a = np.radians(s.tilt)
        c, w = np.cos(a), np.sin(a)
        turn = np.array([(1, 0, 0), (0, c, w), (0, -w, c)])
        return moved(Solid(solid.vertices @ turn.T, solid.triangles), place)

    depth = s.padding + 0.03
    rails = smooth(
        [
            (0.012, -0.4 * s.length, -s.padding + 0.014),
            (0.021, -0.2 * s.length, -depth),
            (0.022, 0.1 * s.length, -depth),
            (0.034, 0.36 * s.length, -s.padding + 0.012),
        ],
        5,
    )
    wires = both_sides(tube(rails, 0.0036, 8))
    cradle = moved(rounded_box((0.056, 0.044, 0.02), 0.006, 2), (0, -0.012, -depth - 0.003))
    foot = shifted(place, 0, -0.012, -depth - 0.006)
    low = at.on_seat(at.g.seat_tube - 0.03)
    on_axis = at.on_seat(float((foot - at.bracket) @ at.seat) - 0.028)
    post = tube(np.array([low, on_axis, foot]), 0.0137, 16)
    pieces = [
        Piece("saddle", coats.saddle, put(loft(_rings(s)))),
        Piece("saddle", coats.steel, put(wires)),
        Piece("seat_post", coats.parts, join(post, put(cradle))),
    ]
    if s.springs:
        coil = moved(_spring(0.0145, 0.06, 4.5), (0.045, 0.3 * s.length, -depth - 0.012))
        link = tube(
            smooth([(0.022, -0.01, -depth), (0.03, 0.1, -depth - 0.006), (0.045, 0.3 * s.length, -depth - 0.014)], 4), 0.004, 8
        )
        pieces.append(Piece("saddle", coats.chrome, put(both_sides(join(coil, link)))))
    return pieces


def _rings(s: Saddle) -> Float:
    """Cross sections from the nose to the rear: a flat-topped dome with skirts that reach lowest at the sides."""
    f = np.array((0.0, 0.012, 0.04, 0.1, 0.2, 0.33, 0.46, 0.58, 0.7, 0.8, 0.88, 0.94, 0.975, 1.0))
    half = curve(
        f,
        [(0, 0.06), (0.04, 0.19), (0.12, 0.24), (0.35, 0.27), (0.55, 0.45), (0.78, 0.95), (0.88, 1.0), (0.96, 0.86), (1, 0.6)],
    )
    half = 0.5 * s.width * half
    rise = curve(f, [(0, -0.3), (0.05, -0.06), (0.3, -0.06), (0.5, -0.1), (0.75, 0.0), (0.9, 0.06), (0.97, -0.08), (1, -0.35)])
    skirt = s.padding * curve(f, [(0, 0.2), (0.06, 0.85), (0.4, 1.0), (0.7, 0.95), (0.9, 0.8), (1, 0.2)])
    a = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    cos, sin = np.cos(a), np.sin(a)
    shape_x = np.sign(cos) * np.abs(cos) ** 0.75
    rings = np.empty((len(f), 24, 3))
    for k in range(len(f)):
        over = 0.42 * skirt[k] * np.abs(np.maximum(sin, 0)) ** 0.85
        under = -0.58 * skirt[k] * np.maximum(-sin, 0) ** 0.35 * (0.45 + 0.55 * np.abs(cos) ** 0.6)
        z = rise[k] * s.padding + over + under - 0.42 * s.padding
        rings[k] = np.column_stack([half[k] * shape_x, np.full(24, (f[k] - 0.55) * s.length), z])
    return rings[:, ::-1]


def _spring(radius: float, height: float, windings: float) -> Solid:
    """A coil about z from z = 0 upwards."""
    a = np.linspace(0, windings * 2 * np.pi, int(windings * 12))
    path = np.stack([radius * np.cos(a), radius * np.sin(a), height * a / a[-1]], axis=1)
    return tube(path, 0.0028, 6)
