"""Mudguards, lights, reflectors and stands."""

from __future__ import annotations

import numpy as np

from viewsphere.assets.mesh import Material
from viewsphere_zoo.cycle.coats import Coats
from viewsphere_zoo.cycle.layout import Layout
from viewsphere_zoo.cycle.wheels import Wheel
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.rods import aimed, between, rod, shifted, swept
from viewsphere_zoo.shapes.solids import Float, Solid, both_sides, join, lathe, moved, rounded_box

GAP = 0.016
"""Gap between tyre and mudguard, metres."""


def _arc(axle: Float, radius: float, start: float, stop: float) -> Float:
    """Points of an arc around the axle, its angles in degrees: 0 points to the front, 90 up, 180 to the rear."""
    a = np.radians(np.linspace(start, stop, 31))
    return axle + radius * np.stack([0 * a, -np.cos(a), np.sin(a)], axis=1)


def mudguard(
    w: Wheel, axle: Float, start: float, stop: float, name: str, material: Material, coats: Coats, half: float
) -> list[Piece]:
    """A curved strip over the tyre from one angle to the other (degrees, as in _arc), with stays to the axle."""
    path = _arc(axle, w.radius + GAP, start, stop)
    wide, thick = w.tyre / 2 + 0.009, 0.0016
    a = np.radians(np.linspace(0, 180, 9))
    outer = np.stack([wide * np.cos(a), 0.013 * np.sin(a) - 0.012], axis=1)
    inner = outer * (1 - thick / wide, 1) - (0, thick)
    ring = np.concatenate([outer, inner[::-1]])
    sections = np.broadcast_to(ring, (len(path), len(ring), 2))
    strip = swept(path, sections)
    up = np.cross(np.gradient(path, axis=0), (1.0, 0.0, 0.0))
    if float(up[15] @ (path[15] - axle)) < 0:
        strip = swept(path[::-1], sections)
    stays: list[Solid] = []
    ends = (start, stop) if stop > 190 else (start, 0.5 * (start + stop))
    for angle in (ends[1] - 28, ends[1] - 12) if stop > 150 else (ends[0] + 12,):
        tip = _arc(axle, w.radius + GAP - 0.0105, angle, angle + 1)[0]
        stays.append(rod((wide, *tip[1:]), (half, *(shifted(axle, 0, 0.0, 0.004))[1:]), 0.0021, 6))
    return [Piece(name, material, strip), Piece(name, coats.steel, both_sides(join(*stays)))]


def front_light(place: Float, back: Float, size: float, coats: Coats) -> list[Piece]:
    """A lamp at this point facing the front, on an arm from `back`; its radius is 31 mm times size."""
    shell = [(0, -0.038), (0.012, -0.036), (0.022, -0.026), (0.029, -0.006), (0.031, 0.004), (0.03, 0.012), (0.026, 0.012)]
    glass = [(0.0275, 0.0085), (0.0265, 0.012), (0.018, 0.0155), (0.0, 0.017)]
    out = (0.0, -1.0, -0.04)
    return [
        Piece("light_front", coats.chrome, aimed(lathe(size * np.array(shell), 24), place, out)),
        Piece("light_front", coats.front_lamp, aimed(lathe(size * np.array(glass), 24), place, out)),
        Piece("light_front", coats.black, rod(back, shifted(place, 0, 0.02, 0), 0.0048, 8)),
    ]


def rear_light(post: Float, along: Float, coats: Coats) -> list[Piece]:
    """A small red lamp clamped to the seat post at this point, facing the rear."""
    place = shifted(post, y=0.024)
    band = rod(post - 0.008 * along, post + 0.008 * along, 0.0155, 16)
    body = moved(rounded_box((0.03, 0.022, 0.05), 0.008, 2), place)
    glass = moved(rounded_box((0.025, 0.012, 0.042), 0.005, 2), shifted(place, 0, 0.009, 0))
    return [Piece("light_rear", coats.black, join(body, band)), Piece("light_rear", coats.rear_lamp, glass)]


def kickstand(at: Layout, coats: Coats) -> list[Piece]:
    """A leg behind the bottom bracket that reaches the ground on the left."""
    root = between(at.bracket, at.rear_axle, 0.17)
    hip = (0.052, root[1] + 0.008, root[2] - 0.022)
    foot = (0.16, root[1] + 0.05, 0.005)
    knee = between(hip, foot, 0.93)
    block = moved(rounded_box((0.07, 0.034, 0.034), 0.006, 2), (0.024, root[1] + 0.004, root[2] - 0.014))
    leg = join(rod(hip, foot, (0.0085, 0.0075), 10), rod(between(hip, foot, -0.06), hip, 0.012, 10))
    return [Piece("kickstand", coats.alloy, join(block, leg)), Piece("kickstand", coats.rubber, rod(knee, foot, 0.0098, 10))]
