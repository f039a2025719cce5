"""Brakes: calipers and V-brakes on the rim, calipers of disc brakes, and the cables."""

from __future__ import annotations

from typing import Literal

import numpy as np

from viewsphere_zoo.cycle.coats import Coats
from viewsphere_zoo.cycle.cockpit import Cockpit, clamp, hold
from viewsphere_zoo.cycle.layout import Layout
from viewsphere_zoo.cycle.wheels import Wheel
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.rods import aimed, basis, bezier, rod, shifted, smooth, unit
from viewsphere_zoo.shapes.solids import Float, Solid, both_sides, join, moved, rounded_box, tube

Brake = Literal["caliper", "v", "disc", "hub"]


def rim_brake(kind: Brake, w: Wheel, axle: Float, toward: Float, behind: float, name: str, coats: Coats) -> list[Piece]:
    """A rim brake where the wheel meets the blades or stays that run in the direction `toward` from the axle.

    behind: how far the brake's arms stand off these blades or stays, metres along the world's y.
    """
    if kind not in ("caliper", "v"):
        return []
    pad_x, track = w.rim_width / 2 + 0.0055, w.bead - 0.002
    pads = both_sides(moved(rounded_box((0.009, 0.05, 0.011), 0.003, 1), (pad_x, 0.0, track)))
    stems = both_sides(rod((pad_x, behind, track), (pad_x + 0.013, behind, track), 0.0045, 8))
    holders = both_sides(moved(rounded_box((0.005, abs(behind) + 0.01, 0.009), 0.0015, 1), (pad_x + 0.003, behind / 2, track)))
    arms, steel = (_caliper if kind == "caliper" else _v_arms)(w, pad_x, track, behind)
    pieces = ((coats.rubber, pads), (coats.parts, join(arms, holders)), (coats.steel, join(stems, steel)))
    return [Piece(name, material, aimed(solid, axle, toward)) for material, solid in pieces]


def _caliper(w: Wheel, pad_x: float, track: float, behind: float) -> tuple[Solid, Solid]:
    """Two bent arms that cross above the tyre, on one bolt."""
    over = w.radius + 0.02
    wide = max(w.tyre / 2 + 0.012, pad_x + 0.012)
    right = smooth(
        [
            (0.012, behind, over + 0.006),
            (-0.6 * wide, behind, over),
            (-wide, behind, over - 0.02),
            (-pad_x - 0.008, behind, track),
        ],
        4,
    )
    left = smooth(
        [
            (-0.028, behind * 1.25, over + 0.014),
            (0.4 * wide, behind * 1.25, over + 0.006),
            (wide, behind, over - 0.02),
            (pad_x + 0.008, behind, track),
        ],
        4,
    )
    arms = join(
        tube(right, np.linspace(0.0085, 0.0065, len(right)), 10), tube(left, np.linspace(0.0085, 0.0065, len(left)), 10)
    )
    bolt = rod((0, behind * 1.7, over + 0.004), (0, -0.006 * np.sign(behind), over + 0.004), 0.005, 8)
    wire = rod((-0.026, behind * 1.25, over + 0.014), (-0.03, behind * 1.25, over + 0.045), 0.0032, 6)
    return arms, join(bolt, wire)


def _v_arms(w: Wheel, pad_x: float, track: float, behind: float) -> tuple[Solid, Solid]:
    """Two upright arms from bosses below the rim to above the tyre, joined by a wire."""
    wide = max(w.tyre / 2 + 0.014, pad_x + 0.012)
    over = w.radius + 0.022
    line = np.array(
        [
            (wide, behind, track - 0.03),
            (wide - 0.001, behind, track),
            (wide + 0.001, behind, over - 0.02),
            (wide - 0.006, behind, over),
        ]
    )
    arm = tube(line, (0.0085, 0.0075, 0.0065, 0.006), 10)
    boss = rod((wide, behind * 1.3, track - 0.03), (wide, -0.004 * np.sign(behind), track - 0.03), 0.0085, 10)
    wire = rod((-wide, behind, over - 0.003), (wide, behind, over - 0.003), 0.0016, 6)
    noodle = tube(
        smooth(
            [
                (-wide - 0.004, behind, over - 0.003),
                (-wide - 0.022, behind, over + 0.005),
                (-wide - 0.02, behind, over + 0.035),
            ],
            4,
        ),
        0.0028,
        6,
    )
    reach = rod((pad_x + 0.006, behind, track), (wide, behind, track), 0.0055, 8)
    return join(both_sides(join(arm, boss, reach)), noodle), wire


def disc_caliper(w: Wheel, axle: Float, toward: Float, turn: float, x: float, name: str, coats: Coats) -> list[Piece]:
    """A block over the rotor's edge on the left; `turn` moves it away from the direction `toward`, radians."""
    r = w.rotor - 0.004
    t = unit(toward)
    c, s = np.cos(turn), np.sin(turn)
    out = np.array((0.0, c * t[1] - s * t[2], s * t[1] + c * t[2]))
    body = rounded_box((0.034, 0.05, 0.032), 0.008, 2)
    fins = [moved(rounded_box((0.037, 0.004, 0.02), 0.001, 1), (0, y, 0.003)) for y in (-0.016, -0.006, 0.004, 0.014)]
    place = axle + (x, 0, 0) + r * out
    mount = axle + (x + 0.006, 0, 0) + (r + 0.012) * out
    other = axle + (x + 0.006, 0, 0) + 1.15 * r * t
    lug = rod(mount, other, 0.0075, 8)
    return [
        Piece(name, coats.black, join(aimed(body, place, out), lug)),
        Piece(name, coats.alloy, aimed(join(*fins), place, out)),
    ]


def cable(start: Float, leaves: Float, end: Float, arrives: Float, slack: float) -> Solid:
    """An outer cable: a cubic Bezier that leaves and arrives in these directions; slack is its handles' length, metres."""
    return tube(bezier(start, start + slack * unit(leaves), end - slack * unit(arrives), end, 18), 0.0024, 7)


def cable_end(kind: Brake, w: Wheel, axle: Float, toward: Float, behind: float) -> tuple[Float, Float]:
    """Return the end of the front brake's cable, and the direction in which the cable arrives."""
    if kind == "disc":
        return axle + (0.05, 0.012, 0.0) + (w.rotor + 0.012) * unit(toward), -unit(toward)
    wide = max(w.tyre / 2 + 0.012, w.rim_width / 2 + 0.0175)
    place = (-0.03, 1.25 * behind, w.radius + 0.063) if kind == "caliper" else (-wide - 0.022, behind, w.radius + 0.055)
    return axle + basis(toward) @ np.array(place), -unit(toward)


def cables(
    at: Layout, c: Cockpit, entry: tuple[Float, Float], front: tuple[Float, Float] | None, angle: float, coats: Coats
) -> list[Piece]:
    """Part cable: from both sides of the bar into the frame, and to where the front brake's cable ends.

    entry, front: place and direction of arrival; the bar is turned by `angle` radians, but `front` is given for straight ahead.
    """
    centre = clamp(at, c)
    if c.bar == "drop":
        left, way, slack = shifted(centre, 0.1, -0.004, -0.011), np.array((-0.35, -1.0, -0.3)), 0.1
    else:
        h = hold(at, c, 0.17)
        left, slack = h.point + 0.02 * h.off - 0.009 * h.along, 0.13
        way = unit((-0.8, 0.1, -0.7)) if c.bar == "swept" else unit(0.5 * h.off - h.along)
    right, back = left * (-1, 1, 1), way * (-1, 1, 1)

    def turned(p: Float, d: Float) -> tuple[Float, Float]:
        return at.steered_points(p, angle), at.steered_points(p + d, angle) - at.steered_points(p, angle)

    solids: list[Solid] = []
    for start, leave, side in ((right, back, -1), (shifted(left, 0, 0, -0.004), way, 1)):
        end = shifted(entry[0], side * 0.012 * at.g.tube)
        solids.append(cable(*turned(start, leave), end, entry[1], slack))
    if front:
        solids.append(cable(*turned(shifted(left, 0, 0, 0.004), way), *turned(*front), slack))
    return [Piece("cable", coats.black, join(*solids))]
