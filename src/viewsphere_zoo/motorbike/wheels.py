"""Wheels, mudguards, swing arm and shock absorbers."""

from __future__ import annotations

import numpy as np

from viewsphere_zoo.cycle.wheels import on_axle
from viewsphere_zoo.motorbike.design import Coats, Motorcycle
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.rods import pin, ring_of, rod
from viewsphere_zoo.shapes.sheets import sheet
from viewsphere_zoo.shapes.solids import Float, Solid, both_sides, join, lathe, loft, moved, tube, turned

SEGMENTS = 40


def wheel_pieces(p: Motorcycle, end: int, c: Coats) -> list[Piece]:
    """The front (0) or rear (1) wheel: tyre, rim, spokes, hub and brake discs."""
    name, at = ("wheel_front", p.front_axle) if end == 0 else ("wheel_rear", p.rear_axle)
    radius, tyre = p.radius[end], p.tyre[end]
    inner = radius - 0.72 * tyre
    half = 0.36 * tyre
    a = np.radians(np.linspace(-128, 128, 15))
    section = np.stack([radius - tyre / 2 + tyre / 2 * np.cos(a), tyre / 2 * np.sin(a)], axis=1)
    rubber = np.concatenate([[(inner, -0.6 * half)], section, [(inner, 0.6 * half)]])
    rim = np.array([(inner + 0.012, half), (inner - 0.004, half), (inner - 0.022, 0.5 * half), (inner - 0.022, -0.5 * half)])
    rim = np.concatenate([rim, [(inner - 0.004, -half), (inner + 0.012, -half)]])
    hub = [(0, -0.07), (0.035, -0.07), (0.045, -0.05), (0.03, -0.03), (0.03, 0.03), (0.045, 0.05), (0.035, 0.07), (0, 0.07)]
    arms = _wire(inner) if p.spokes == 0 else _cast(inner - 0.018, p.spokes, half)
    disc = lathe(
        np.array([(0.085, -0.003), (0.142, -0.003), (0.142, 0.003), (0.085, 0.003), (0.085, -0.003)]) * (inner / 0.22, 1), 30
    )
    discs = [moved(disc, (0, 0, z)) for z in ((-0.062, 0.062) if end == 0 and p.style != "scooter" else (-0.062,))]
    place = [
        (f"{name}_tyre", c.rubber, lathe(rubber, SEGMENTS)),
        (f"{name}_rim", c.rim, lathe(rim, SEGMENTS)),
        (f"{name}_rim", c.chrome if p.spokes == 0 else c.rim, arms),
        (f"{name}_hub", c.steel, lathe(hub, 18)),
        (f"{name}_disc", c.steel, join(*discs)),
    ]
    pieces = [Piece(part, material, moved(on_axle(solid), at)) for part, material, solid in place]
    return [*pieces, Piece(f"{name}_hub", c.steel, pin(at, 0.115, 0.013))]


def _cast(reach: float, count: int, half: float) -> Solid:
    """Tapered arms of a cast wheel, about z."""
    ring = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    r, wide, deep = np.array([0.025, 0.5 * reach, reach]), np.array([0.02, 0.013, 0.02]), np.array([0.03, 0.016, 0.7 * half])
    rings = np.empty((3, 4, 3))
    rings[..., 0] = r[:, None]
    rings[..., 1] = ring[:, 0] * wide[:, None]
    rings[..., 2] = ring[:, 1] * deep[:, None]
    return ring_of(loft(rings), count, 2, 0.3)


def _wire(inner: float) -> Solid:
    """Wire spokes from both flanges, about z."""
    solids: list[Solid] = []
    for k in range(36):
        side, lean = (1 if k % 2 else -1), (1 if k % 4 < 2 else -1)
        a, b = 2 * np.pi * k / 36, 2 * np.pi * k / 36 + 0.5 * lean
        r = inner - 0.018
        solids.append(
            rod((0.04 * np.cos(b), 0.04 * np.sin(b), 0.045 * side), (r * np.cos(a), r * np.sin(a), 0.008 * side), 0.0026, 4)
        )
    return join(*solids)


def guard(at: Float, radius: float, width: float, start: float, stop: float) -> Solid:
    """A mudguard around an axle; angles in degrees from the front (-Y) over the top to the rear."""
    a = np.radians(np.linspace(start, stop, 14))
    x = np.linspace(-1, 1, 7)
    r = radius - 0.35 * width * x**2
    points = np.empty((14, 7, 3))
    points[..., 0] = width / 2 * x
    points[..., 1] = at[1] - np.cos(a)[:, None] * r
    points[..., 2] = at[2] + np.sin(a)[:, None] * r
    return sheet(points[:, ::-1], 0.006)


def swing_arm(p: Motorcycle, pivot: Float, c: Coats) -> list[Piece]:
    """Two arms to the rear axle, a chain beside one of them, and twin shocks unless the style hides a single one in the
    middle.
    """
    rear = p.rear_axle
    x = p.tyre[1] / 2 + 0.035
    arm = tube(
        [(0.06, pivot[1], pivot[2]), (x, pivot[1] + 0.12, pivot[2]), (x, rear[1] + 0.03, rear[2])], (0.03, 0.026, 0.022), 8
    )
    pieces = [Piece("swing_arm", c.steel if p.bright else c.black, both_sides(arm))]
    x = -p.tyre[1] / 2 - 0.05
    chain = [
        (x, pivot[1] - 0.05, pivot[2] + 0.05),
        (x, rear[1], rear[2] + 0.09),
        (x, rear[1] + 0.09, rear[2]),
        (x, rear[1], rear[2] - 0.09),
        (x, pivot[1] - 0.05, pivot[2] - 0.04),
    ]
    sprocket = on_axle(lathe([(0, -0.004), (0.09, -0.004), (0.09, 0.004), (0, 0.004)], 24))
    pieces.append(Piece("chain", c.steel, join(tube(chain, 0.009, 5), moved(sprocket, (x, *rear[1:])))))
    if p.style in ("naked", "sport"):
        return pieces
    top = np.array((x - 0.02, rear[1] - 0.16, p.seat - 0.1))
    foot = np.array((x - 0.02, rear[1] - 0.02, rear[2] + 0.03))
    return [*pieces, *shock(foot, top, c)]


def shock(foot: Float, top: Float, c: Coats) -> list[Piece]:
    """A spring about a damper, both sides."""
    length = float(np.linalg.norm(top - foot))
    a = np.linspace(0, 2 * np.pi * 7, 7 * 9)
    coil = tube(np.stack([0.026 * np.cos(a), 0.026 * np.sin(a), length * (0.3 + 0.62 * a / a[-1])], axis=1), 0.006, 5)
    tilt = float(np.arctan2(top[1] - foot[1], top[2] - foot[2]))
    spring = moved(turned(coil, 0, -tilt), foot)
    return [
        Piece("shock", c.chrome, both_sides(spring)),
        Piece("shock", c.black, both_sides(rod(foot, top, 0.016, 8))),
    ]
