"""Tank, seat, tail, fairing, boxes."""

from __future__ import annotations

import numpy as np

from viewsphere_zoo.motorbike.design import Coats, Motorcycle, body
from viewsphere_zoo.motorbike.engine import middle
from viewsphere_zoo.motorbike.wheels import guard
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.rods import rod, shifted
from viewsphere_zoo.shapes.sheets import sheet
from viewsphere_zoo.shapes.solids import Solid, both_sides, join, lathe, mirrored, moved, rounded_box, tube, turned


def body_pieces(p: Motorcycle, c: Coats) -> list[Piece]:
    """Return the bodywork of a motorcycle other than a scooter."""
    pieces = [*_tank(p, c), *_seat(p, c), *_tail(p, c)]
    if p.style == "sport":
        pieces += _fairing(p, c)
    if p.top_box:
        box = moved(rounded_box((0.42, 0.36, 0.3), 0.08, 3), (0, p.rear_axle[1] + 0.16, p.seat + 0.24))
        pieces.append(Piece("top_box", c.second, box))
    if p.panniers:
        case = moved(rounded_box((0.2, 0.5, 0.36), 0.06, 3), (p.tyre[1] / 2 + 0.21, p.rear_axle[1] + 0.02, p.seat - 0.2))
        lid = moved(rounded_box((0.21, 0.51, 0.03), 0.01, 1), (p.tyre[1] / 2 + 0.21, p.rear_axle[1] + 0.02, p.seat - 0.12))
        pieces += [Piece("pannier", c.second, both_sides(case)), Piece("pannier", c.steel, both_sides(lid))]
    return pieces


def _tank(p: Motorcycle, c: Coats) -> list[Piece]:
    """A drop-shaped tank with its cap and side panels below the seat."""
    start, top = p.head[1] + 0.03, p.head[2] + (0.03 if p.style != "cruiser" else -0.07)
    stop = 0.14 if p.style != "sport" else 0.1
    tall = top - p.seat + 0.12
    wide = {"cruiser": 0.14, "sport": 0.155}.get(p.style, 0.145)
    z = top - tall / 2
    knots = [
        (start, z + 0.12 * tall, 0.06, 0.2 * tall),
        (start + 0.07, z + 0.06 * tall, 0.8 * wide, 0.42 * tall),
        (start + 0.45 * (stop - start), z, wide, 0.5 * tall),
        (start + 0.8 * (stop - start), z - 0.12 * tall, 0.7 * wide, 0.4 * tall),
        (stop, z - 0.28 * tall, 0.3 * wide, 0.14 * tall),
    ]
    cap_y = start + 0.38 * (stop - start)
    cap = lathe([(0.045, -0.03), (0.045, 0.006), (0.035, 0.014), (0, 0.014)], 18)
    at = middle(p)
    panel = body(
        [
            (0.0, p.seat - 0.19, 0.1, 0.02),
            (0.1, p.seat - 0.18, 0.125, 0.09),
            (0.3, p.seat - 0.15, 0.12, 0.07),
            (0.42, p.seat - 0.12, 0.09, 0.02),
        ],
        3,
    )
    air = moved(rounded_box((0.2, 0.2, 0.16), 0.05, 2), (0, at[1] + 0.12, at[2] + 0.24))
    stripe = body([(y + 0.004, zz, w + 0.003, 0.22 * h) for y, zz, w, h in knots[1:]], 2.6)
    return [
        Piece("tank", c.paint, body(knots)),
        Piece("tank", c.stripe, stripe),
        Piece("tank", c.chrome, moved(cap, (0, cap_y, z + 0.5 * tall - 0.004))),
        Piece("side_panel", c.second if p.style == "naked" else c.paint, panel),
        Piece("engine", c.black, air),
    ]


def _seat(p: Motorcycle, c: Coats) -> list[Piece]:
    """Rider's seat and a step up to the pillion's."""
    h, end = p.seat, p.rear_axle[1] + (0.02 if p.style == "cruiser" else 0.08)
    step = {"sport": 0.09, "cruiser": 0.05}.get(p.style, 0.04)
    rider = [
        (0.05, h - 0.03, 0.07, 0.03),
        (0.14, h - 0.04, 0.12, 0.05),
        (0.28, h - 0.045, 0.15, 0.05),
        (0.4, h - 0.025, 0.13, 0.055),
        (0.46, h, 0.1, 0.03),
    ]
    rear = [
        (0.38, h + 0.2 * step, 0.1, 0.035),
        (0.45, h + 0.7 * step, 0.125, 0.05),
        (end - 0.12, h + step, 0.11, 0.045),
        (end, h + step + 0.01, 0.07, 0.02),
    ]
    return [Piece("seat", c.seat, join(body(rider, 2.8, 12), body(rear, 2.8, 12)))]


def _tail(p: Motorcycle, c: Coats) -> list[Piece]:
    """Cowl or mudguard behind, lamp, plate, indicators."""
    rear, h = p.rear_axle, p.seat
    pieces: list[Piece] = []
    if p.style == "cruiser":
        pieces.append(Piece("mudguard_rear", c.paint, guard(rear, p.radius[1] + 0.04, p.tyre[1] + 0.05, 62, 172)))
        tip = np.array((0.0, rear[1] + 0.33, rear[2] + 0.24))
    else:
        lift = 0.1 if p.style == "sport" else 0.02
        cowl = [
            (0.3, h - 0.06, 0.11, 0.05),
            (rear[1] - 0.1, h - 0.02 + 0.4 * lift, 0.12, 0.06),
            (rear[1] + 0.18, h + 0.02 + lift, 0.07, 0.03),
        ]
        pieces.append(Piece("tail", c.paint, body(cowl, 3, 12)))
        pieces.append(Piece("mudguard_rear", c.black, guard(rear, p.radius[1] + 0.05, p.tyre[1], 95, 165)))
        tip = np.array((0.0, rear[1] + 0.19, h + 0.015 + lift))
    lens = moved(rounded_box((0.13, 0.05, 0.06), 0.02, 2), tip)
    drop = 0.2 if p.style != "cruiser" else 0.14
    plate = moved(turned(rounded_box((0.2, 0.008, 0.15), 0.004, 1), 0, 0.3), shifted(tip, 0, 0.05, -drop))
    arm = tube([tip - (0, 0.06, 0.02), shifted(tip, 0, 0.02, -0.6 * drop), shifted(tip, 0, 0.045, -drop)], 0.016, 6)
    blinker = moved(
        turned(lathe([(0, -0.03), (0.026, -0.015), (0.03, 0.01), (0, 0.02)], 12), 0, -np.pi / 2), shifted(tip, 0.15, 0, -0.05)
    )
    stalk = rod(shifted(tip, 0, -0.02, -0.05), shifted(tip, 0.14, -0.01, -0.05), 0.008, 6)
    pieces += [
        Piece("taillight", c.red_lamp, lens),
        Piece("licence_plate", c.plate, plate),
        Piece("tail", c.black, join(arm, both_sides(stalk))),
        Piece("indicator_rear_left", c.amber, blinker),
        Piece("indicator_rear_right", c.amber, mirrored(blinker)),
    ]
    return pieces


def _fairing(p: Motorcycle, c: Coats) -> list[Piece]:
    """A sports motorcycle's shell: nose with two lamps and a screen, flanks down to a belly pan."""
    head, at = p.head, middle(p)
    nose = head[1] - 0.27
    knots = [
        (nose, head[2] - 0.06, 0.04, 0.03),
        (nose + 0.1, head[2] - 0.05, 0.14, 0.1),
        (nose + 0.25, head[2] - 0.04, 0.2, 0.13),
        (nose + 0.38, head[2] - 0.07, 0.21, 0.11),
    ]
    flank = _flank(p, nose, at[2])
    lower = [
        (at[1] - 0.32, at[2] - 0.16, 0.08, 0.05),
        (at[1] - 0.2, at[2] - 0.14, 0.17, 0.1),
        (at[1] + 0.2, at[2] - 0.16, 0.14, 0.06),
        (at[1] + 0.32, at[2] - 0.16, 0.06, 0.03),
    ]
    lamps = [moved(turned(rounded_box((0.11, 0.03, 0.05), 0.02, 2), 2, -0.55), (0.08, nose + 0.055, head[2] - 0.05))]
    x, v = np.linspace(-1, 1, 9), np.linspace(0, 1, 6)
    screen = np.empty((9, 6, 3))
    screen[..., 0] = x[:, None] * (0.15 - 0.05 * v**2)
    screen[..., 1] = nose + 0.14 + 0.1 * x[:, None] ** 2 + 0.2 * v
    screen[..., 2] = head[2] + 0.03 + 0.19 * v - 0.06 * x[:, None] ** 2
    return [
        Piece("fairing", c.paint, join(body(knots, 2.5), both_sides(flank[0]))),
        Piece("fairing", c.stripe, both_sides(flank[1])),
        Piece("fairing", c.second, body(lower, 3)),
        Piece("headlight", c.white_lamp, both_sides(join(*lamps))),
        Piece("windscreen", c.glass, sheet(screen, 0.006)),
    ]


def _flank(p: Motorcycle, nose: float, low: float) -> tuple[Solid, Solid]:
    """The left side panel from the nose to the belly, and a stripe on it."""
    top = p.head[2] - 0.1
    v = np.linspace(0, 1, 9)
    ahead = np.interp(v, (0, 0.45, 1), (-0.3, -0.36, nose + 0.18))
    behind = np.interp(v, (0, 0.45, 0.8, 1), (0.25, 0.06, -0.1, nose + 0.5))
    share = np.linspace(0, 1, 8)[:, None]
    y = ahead + share * (behind - ahead)
    z = np.broadcast_to(low - 0.2 + v * (top - low + 0.2), y.shape)
    x = (0.13 + 0.1 * np.sin(np.pi * (0.25 + 0.6 * v))) * (0.72 + 0.28 * np.sin(np.pi * (0.18 + 0.6 * share)))
    points = np.stack([x, y, z], axis=-1)
    band = points[:, 3:5] + (0.007, 0, 0)
    return sheet(points, 0.008), sheet(band, 0.004)
