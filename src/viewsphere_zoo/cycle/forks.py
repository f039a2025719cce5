"""Forks: rigid with straight or raked blades, and telescopic."""

from __future__ import annotations

from typing import Literal

import numpy as np

from viewsphere_zoo.cycle.coats import Coats
from viewsphere_zoo.cycle.layout import Layout
from viewsphere_zoo.cycle.wheels import Wheel, on_axle
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.rods import across, between, plate, rod, smooth
from viewsphere_zoo.shapes.solids import Float, Solid, both_sides, join, lathe, moved, rounded_box, tube, turned

Fork = Literal["straight", "raked", "telescopic"]
HALF = 0.0535
"""Half the width between the front dropouts' middles, metres."""


def fork_pieces(at: Layout, kind: Fork, w: Wheel, clearance: float, coats: Coats) -> list[Piece]:
    """Part fork, straight ahead: crown, blades, dropouts, headset; clearance is half the width of tyre and mudguard."""
    crown, up = at.crown, at.steering
    fat = at.g.tube
    low, high = at.head
    race = rod(crown - 0.002 * up, low + 0.001 * up, 0.0205 + 0.003 * (fat - 1), 20)
    cap = rod(high - 0.001 * up, high + 0.012 * up, (0.0205 + 0.003 * (fat - 1), 0.017), 20)
    headset = Piece("headset", coats.black, join(race, cap))
    if kind == "telescopic":
        return [headset, *_telescopic(at, w, coats)]
    return [headset, *_rigid(at, kind, clearance, coats)]


def _dropouts(at: Layout) -> Solid:
    """A plate and a nut on either side of the axle."""
    toward = at.crown - at.front_axle
    tilt = float(np.arctan2(toward[1], toward[2]))
    outline = [(-0.011, 0.02), (-0.013, 0.0), (-0.008, -0.012), (0.004, -0.014), (0.012, -0.004), (0.011, 0.024)]
    side = across(plate(outline, 0.006))
    nut = on_axle(lathe([(0, 0.0), (0.0105, 0.001), (0.0105, 0.006), (0.006, 0.009), (0.0055, 0.014), (0, 0.0142)], 6))
    solid = join(turned(side, 0, -tilt), moved(nut, (0.002, 0, 0)))
    return both_sides(moved(solid, (HALF, *at.front_axle[1:])))


def _rigid(at: Layout, kind: Fork, clearance: float, coats: Coats) -> list[Piece]:
    """Two tapered blades from the crown to the axle."""
    crown, axle, up = at.crown, at.front_axle, at.steering
    top = crown - 0.036 * up
    foot = axle + 0.013 * up
    fat = 0.85 + 0.15 * at.g.tube
    wide = max(clearance + 0.0145 * fat, 0.03)
    if kind == "raked":
        line = [
            top,
            top - 0.5 * (at.g.fork_length - 0.045) * up,
            top - 0.78 * (at.g.fork_length - 0.045) * up + 0.15 * at.g.rake * at.ahead,
            foot,
        ]
    else:
        line = [top, between(top, foot, 0.4), between(top, foot, 0.75), foot]
    spread = (wide, wide + 0.3 * (HALF - wide), wide + 0.75 * (HALF - wide), HALF)
    bow = ((-0.006, 0.004), (0.5 * wide, 0.004), (0.86 * wide, 0.0105))
    arch = [(x, *(crown - h * up)[1:]) for x, h in bow]
    path = smooth([*arch, *((x, *p[1:]) for x, p in zip(spread, line, strict=True))], 4)
    share = np.linspace(0, 1, len(path))
    blade = tube(path, fat * np.interp(share, (0, 0.4, 1), (0.0155, 0.0138, 0.0072)), 14)
    return [Piece("fork", coats.fork, both_sides(blade)), Piece("fork", coats.alloy, _dropouts(at))]


def _telescopic(at: Layout, w: Wheel, coats: Coats) -> list[Piece]:
    """Stanchions that dive into lowers, which an arch joins above the tyre."""
    crown, axle, up = at.crown, at.front_axle, at.steering
    wide = max(w.tyre / 2 + 0.034, 0.06)
    offset = at.g.rake * at.ahead
    line_top = crown - 0.012 * up + 0.55 * offset
    foot = axle - 0.45 * offset + 0.004 * up

    def leg(share: float) -> Float:
        p = between(line_top, foot, share)
        return np.array((wide, p[1], p[2]))

    collar = 0.3
    stanchion = rod(leg(-0.03), leg(collar + 0.1), 0.0165, 18)
    lower = tube([leg(s) for s in (collar, collar + 0.012, 0.6, 0.9, 1.0)], (0.021, 0.0225, 0.0215, 0.02, 0.016), 18)
    wiper = rod(leg(collar - 0.014), leg(collar + 0.004), 0.0195, 18)
    cap = rod(leg(-0.055), leg(-0.02), (0.015, 0.018), 16)
    boots = [rod(leg(-0.035), leg(0.075), 0.0215, 18)]
    yoke = [(wide, *leg(0.03)[1:]), (0.45 * wide, *(crown + 0.25 * offset - 0.008 * up)[1:]), (0, *(crown - 0.006 * up)[1:])]
    half = smooth(yoke, 4)
    bridge = tube(np.concatenate([half, half[-2::-1] * (-1, 1, 1)]), 0.019, 14)
    over = float((axle - line_top) @ -up) - w.radius - 0.021
    top = line_top - over * up + 0.026 * at.ahead
    knee = between(top, leg(collar + 0.04), 0.35)
    start = leg(collar + 0.04)
    arch = smooth(np.array([start, (wide, *knee[1:]), (0.6 * wide, *top[1:]), (0.0, *top[1:])]), 4)
    bow = tube(np.concatenate([arch, arch[-2::-1] * (-1, 1, 1)]), 0.0105, 10)
    shoe = moved(rounded_box((0.02, 0.034, 0.05), 0.008, 2), (0, 0, 0.008))
    shoes = both_sides(moved(turned(shoe, 0, 0.3), (HALF + 0.002, *axle[1:])))
    return [
        Piece("fork", coats.stanchion, both_sides(stanchion)),
        Piece("fork", coats.fork, join(both_sides(lower), bow, shoes)),
        Piece("fork", coats.black, join(both_sides(join(wiper, cap, *boots)), bridge)),
        Piece("fork", coats.alloy, _dropouts(at)),
    ]
