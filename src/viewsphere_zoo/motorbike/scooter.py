"""A scooter's shell: leg shield, floor, rear body over the engine, seat, lamps."""

from __future__ import annotations

import numpy as np

from viewsphere_zoo.motorbike.design import Coats, Motorcycle, body
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.rods import rod, shifted
from viewsphere_zoo.shapes.sheets import sheet
from viewsphere_zoo.shapes.solids import Float, both_sides, join, lathe, mirrored, moved, rounded_box, tube, turned


def scooter_pieces(p: Motorcycle, c: Coats) -> list[Piece]:
    """Return the pieces that do not turn with the bar, except for wheels."""
    return [*_shield(p, c), *_rear(p, c), *_lamps(p, c), *_running(p, c)]


def cover_pieces(p: Motorcycle, c: Coats) -> list[Piece]:
    """The bar's cover with the headlight: it turns with the bar."""
    at = p.head + 0.05 * p.up
    shell = body(
        [
            (at[1] - 0.13, at[2] + 0.01, 0.06, 0.05),
            (at[1] - 0.06, at[2] + 0.02, 0.13, 0.085),
            (at[1] + 0.07, at[2] + 0.02, 0.15, 0.07),
            (at[1] + 0.12, at[2] + 0.02, 0.08, 0.03),
        ],
        2.4,
        12,
    )
    lens = moved(
        turned(lathe([(0.07, -0.02), (0.07, 0.0), (0.05, 0.018), (0, 0.025)], 20), 0, np.pi / 2),
        (0, at[1] - 0.125, at[2] + 0.015),
    )
    ring = moved(
        turned(lathe([(0.082, -0.03), (0.082, 0.0), (0.07, 0.006), (0.066, -0.002)], 20), 0, np.pi / 2),
        (0, at[1] - 0.122, at[2] + 0.015),
    )
    return [Piece("cover", c.paint, shell), Piece("headlight", c.white_lamp, lens), Piece("headlight", c.chrome, ring)]


def _line(p: Motorcycle) -> Float:
    """The leg shield's middle line in (y, z), from the bar down to the floor."""
    head = p.head
    floor = 0.24
    return np.array(
        [
            (head[1] - 0.05, head[2] + 0.01),
            (head[1] - 0.03, head[2] - 0.2),
            (head[1] + 0.03, floor + 0.16),
            (head[1] + 0.1, floor + 0.03),
        ]
    )


def _shield(p: Motorcycle, c: Coats) -> list[Piece]:
    """A bowed sheet in front of the knees, and the floor behind it."""
    line = _line(p)
    t = np.linspace(0, 1, 11)
    y, z = (np.interp(t, np.linspace(0, 1, 4), line[:, k]) for k in (0, 1))
    half = np.interp(t, (0, 0.25, 0.7, 1), (0.13, 0.215, 0.23, 0.18))
    x = np.linspace(-1, 1, 11)
    points = np.empty((11, 11, 3))
    points[..., 0] = x[:, None] * half
    points[..., 1] = y + 0.09 * np.abs(x[:, None]) ** 2
    points[..., 2] = z
    shield = sheet(points[:, ::-1], 0.02)
    nose = body(
        [
            (line[1, 0] - 0.11, line[1, 1] + 0.02, 0.03, 0.06),
            (line[1, 0] - 0.04, line[1, 1] + 0.02, 0.075, 0.17),
            (line[1, 0] + 0.08, line[1, 1], 0.09, 0.2),
        ],
        2.4,
        10,
    )
    back = line[3, 0] + 0.02
    stop = 0.12
    floor = moved(rounded_box((0.4, stop - back + 0.2, 0.07), 0.03, 2), (0, (stop + back) / 2, 0.24))
    mat = moved(rounded_box((0.34, stop - back - 0.02, 0.02), 0.008, 1), (0, (stop + back) / 2, 0.275))
    horn = moved(rounded_box((0.07, 0.03, 0.16), 0.012, 1), (0, line[1, 0] - 0.1, line[1, 1] + 0.02))
    return [
        Piece("leg_shield", c.paint, join(shield, nose)),
        Piece("leg_shield", c.stripe, horn),
        Piece("floor", c.second, floor),
        Piece("floor", c.rubber, mat),
    ]


def _rear(p: Motorcycle, c: Coats) -> list[Piece]:
    """The swelling body over the rear wheel, its seat, a grab rail."""
    rear, h = p.rear_axle, p.seat
    end = rear[1] + 0.28
    z = (h + 0.3) / 2
    knots = [
        (0.08, z - 0.06, 0.1, 0.2),
        (0.16, z, 0.14, 0.23),
        (rear[1] - 0.15, z + 0.06, 0.19, 0.2),
        (rear[1] + 0.08, z + 0.09, 0.19, 0.16),
        (end, z + 0.12, 0.1, 0.06),
    ]
    seat = [
        (0.1, h - 0.01, 0.08, 0.03),
        (0.18, h, 0.13, 0.05),
        (0.35, h - 0.005, 0.15, 0.05),
        (0.5, h + 0.03, 0.14, 0.05),
        (end - 0.06, h + 0.03, 0.1, 0.03),
    ]
    strip = [(y + 0.01, zz - 0.02, w + 0.003, 0.1 * t) for y, zz, w, t in knots[1:]]
    rail = tube(
        [(0.12, end - 0.2, h - 0.02), (0.13, end - 0.02, h + 0.02), (0.08, end + 0.08, h + 0.04), (0, end + 0.09, h + 0.04)],
        0.011,
        6,
    )
    pieces = [
        Piece("rear_body", c.paint, body(knots, 2.5)),
        Piece("rear_body", c.stripe, body(strip, 2.5)),
        Piece("seat", c.seat, body(seat, 2.8, 14)),
        Piece("grab_rail", c.chrome, both_sides(rail)),
    ]
    if p.top_box:
        pieces.append(Piece("top_box", c.second, moved(rounded_box((0.38, 0.34, 0.28), 0.08, 3), (0, end + 0.1, h + 0.19))))
    return pieces


def _lamps(p: Motorcycle, c: Coats) -> list[Piece]:
    """Indicators on the shield and the tail, tail light, plate."""
    end, h = p.rear_axle[1] + 0.28, p.seat
    z = (h + 0.3) / 2 + 0.12
    line = _line(p)
    front = moved(turned(rounded_box((0.07, 0.03, 0.045), 0.014, 2), 2, -0.35), (0.15, line[1, 0] + 0.02, line[1, 1] + 0.1))
    back = moved(rounded_box((0.05, 0.04, 0.045), 0.014, 2), (0.12, end - 0.04, z))
    lens = moved(rounded_box((0.13, 0.05, 0.07), 0.024, 2), (0, end, z))
    plate = moved(turned(rounded_box((0.2, 0.008, 0.16), 0.004, 1), 0, 0.25), (0, end + 0.05, z - 0.22))
    arm = tube([(0, end - 0.08, z - 0.04), (0, end + 0.03, z - 0.12), (0, end + 0.045, z - 0.22)], 0.02, 6)
    return [
        Piece("indicator_left", c.amber, front),
        Piece("indicator_right", c.amber, mirrored(front)),
        Piece("indicator_rear_left", c.amber, back),
        Piece("indicator_rear_right", c.amber, mirrored(back)),
        Piece("taillight", c.red_lamp, lens),
        Piece("licence_plate", c.plate, plate),
        Piece("mudguard_rear", c.black, arm),
    ]


def _running(p: Motorcycle, c: Coats) -> list[Piece]:
    """The engine beside the rear wheel, its muffler on the right, and the stand."""
    rear = p.rear_axle
    x = p.tyre[1] / 2 + 0.06
    case = moved(rounded_box((0.1, 0.5, 0.16), 0.05, 2), (x, rear[1] - 0.14, rear[2] + 0.01))
    drum = rod(shifted(rear, x - 0.02), shifted(rear, x + 0.06), 0.085, 18)
    pipe = tube([(-0.06, 0.15, 0.2), (-x - 0.02, 0.25, 0.19), (-x - 0.03, rear[1] - 0.15, rear[2] - 0.02)], 0.018, 8)
    can = tube(
        [
            (-x - 0.03, rear[1] - 0.18, rear[2] - 0.02),
            (-x - 0.04, rear[1] - 0.1, rear[2]),
            (-x - 0.05, rear[1] + 0.2, rear[2] + 0.06),
            (-x - 0.05, rear[1] + 0.25, rear[2] + 0.07),
        ],
        (0.03, 0.055, 0.055, 0.035),
        14,
    )
    shock = tube([(x + 0.02, rear[1] + 0.04, rear[2] + 0.05), (x + 0.02, rear[1] - 0.02, p.seat - 0.22)], 0.024, 8)
    stand = tube([(0.1, 0.2, 0.2), (0.17, 0.28, 0.012), (0.23, 0.3, 0.012)], 0.011, 6)
    return [
        Piece("engine", c.engine, join(case, drum)),
        Piece("exhaust", c.pipe, pipe),
        Piece("muffler", c.pipe, can),
        Piece("shock", c.black, shock),
        Piece("stand", c.black, stand),
    ]
