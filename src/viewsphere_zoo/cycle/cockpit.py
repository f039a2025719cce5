"""Stem, handlebar, grips or tape, levers, shifters and bell, with the steering straight ahead."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material
from viewsphere_zoo.cycle.coats import Coats
from viewsphere_zoo.cycle.layout import Layout
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.rods import aimed, between, rod, shifted, smooth, swept, unit
from viewsphere_zoo.shapes.solids import Float, Solid, join, lathe, mirrored, moved, rounded_box, tube

Bar = Literal["drop", "flat", "riser", "swept"]


@dataclass(frozen=True)
class Cockpit:
    """bar: its bend; width: of the bar, metres; stem: its length, metres, and `rise` its angle above the square to the
    steering axis, degrees; quill: a slender stem out of the head tube, raised by `height` metres, else spacers of that
    height; levers: brake levers; shifters: on either side; bell: beside the stem.
    """

    bar: Bar = "drop"
    width: float = 0.42
    stem: float = 0.1
    rise: float = -8.0
    height: float = 0.02
    quill: bool = False
    levers: bool = True
    shifters: bool = True
    bell: bool = False


def clamp(at: Layout, c: Cockpit) -> Float:
    """The middle of the handlebar."""
    a = np.radians(c.rise)
    return _stem_root(at, c) + c.stem * (np.cos(a) * at.ahead + np.sin(a) * at.steering)


def _stem_root(at: Layout, c: Cockpit) -> Float:
    """The point where the stem leaves the steering axis."""
    return at.head[1] + (0.012 + c.height + (0.0 if c.quill else 0.02)) * at.steering


def bar_path(c: Cockpit) -> Float:
    """The left half of the handlebar as a path from the bar's middle, (N, 3) relative to that point."""
    w = c.width / 2
    if c.bar == "drop":
        knots = [(0, 0, 0), (0.5 * w, 0, 0), (w - 0.035, -0.002, 0), (w - 0.008, -0.022, 0), (w, -0.055, -0.001)]
        knots += [(w, -0.082, -0.014), (w, -0.095, -0.045), (w + 0.001, -0.086, -0.082), (w + 0.003, -0.058, -0.112)]
        knots += [(w + 0.006, -0.02, -0.124), (w + 0.009, 0.03, -0.129)]
    elif c.bar == "swept":
        knots = [(0, 0, 0), (0.06, -0.012, 0.004), (0.4 * w, -0.052, 0.03), (0.7 * w, -0.03, 0.06), (0.88 * w, 0.045, 0.068)]
        knots += [(0.96 * w, 0.115, 0.06), (w, 0.2, 0.048)]
    else:
        up = 0.028 if c.bar == "riser" else 0.0
        knots = [(0, 0, 0), (0.055, 0, 0), (0.25 * w, 0.002, 0.12 * up), (0.45 * w, 0.008, up), (0.7 * w, 0.019, 1.1 * up)]
        knots += [(w, 0.04, 1.15 * up)]
    return smooth(knots, 4)


@dataclass(frozen=True)
class Hold:
    """A place on the left half of the bar: point, direction towards the bar's end, and where levers stand off."""

    point: Float
    along: Float
    off: Float


def hold(at: Layout, c: Cockpit, from_end: float) -> Hold:
    """The bar at this distance from its left end, metres."""
    path = bar_path(c)[::-1]
    gone = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    here, further = (np.array([np.interp(d, gone, path[:, k]) for k in range(3)]) for d in (from_end, from_end + 0.01))
    along = unit(here - further)
    off = np.array((0.0, -0.86, -0.5)) if c.bar != "swept" else np.array((0.62, -0.42, -0.66))
    return Hold(clamp(at, c) + here, along, unit(off - along * (off @ along)))


def cockpit_pieces(at: Layout, c: Cockpit, coats: Coats) -> list[Piece]:
    """Parts stem, handlebar, grip_*, brake_lever_*, shifter_*, bell."""
    centre = clamp(at, c)
    half = bar_path(c)
    line = np.concatenate([half[::-1] * (-1, 1, 1), half[1:]]) + centre
    far = np.abs(line[:, 0])
    radius = np.interp(far, (0.03, 0.07), (0.0155, 0.0125 if c.bar == "drop" else 0.0112))
    pieces = [Piece("handlebar", coats.parts, tube(line, radius, 12)), *_stem(at, c, coats)]
    pieces += _grips(c, centre, coats)
    if c.levers:
        pieces += _drop_levers(c, centre, coats) if c.bar == "drop" else _levers(at, c, coats)
    if c.shifters and c.bar != "drop":
        h = hold(at, c, 0.19)
        box = aimed(rounded_box((0.026, 0.02, 0.04), 0.006, 2), h.point + 0.017 * h.off, h.along, h.off)
        pieces += _sides("shifter", coats.black, join(box, _band(h, 0.0155, 0.009)))
    if c.bell:
        pieces += _bell(at, c, coats)
    return pieces


def _sides(name: str, material: Material, solid: Solid) -> list[Piece]:
    """The left part and its mirror image."""
    return [Piece(f"{name}_left", material, solid), Piece(f"{name}_right", material, mirrored(solid))]


def _band(h: Hold, radius: float, half: float) -> Solid:
    """A clamp around the bar."""
    return rod(h.point - half * h.along, h.point + half * h.along, radius, 14)


def _stem(at: Layout, c: Cockpit, coats: Coats) -> list[Piece]:
    """Quill, or spacers and clamp; the extension; the bar's clamp with its bolts."""
    up, root, centre = at.steering, _stem_root(at, c), clamp(at, c)
    top = at.head[1] + 0.012 * up
    cuff = rod(centre - (0.022, 0, 0), shifted(centre, 0.022, 0, 0), 0.0205, 18)
    out = unit(centre - root)
    across_out = np.cross((1.0, 0.0, 0.0), out)
    bolts = [
        rod(centre + (x, 0, 0) + s * 0.013 * across_out, centre + (x, 0, 0) + s * 0.013 * across_out + 0.0205 * out, 0.0032, 6)
        for x in (-0.015, 0.015)
        for s in (-1, 1)
    ]
    if c.quill:
        bend = root - 0.03 * up
        path = smooth([top - 0.01 * up, between(top, bend, 0.6), bend, between(root, centre, 0.35), centre], 5)
        nut = rod(top - 0.002 * up, top + 0.008 * up, 0.0185, 6)
        return [Piece("stem", coats.parts, join(tube(path, 0.0112, 14), cuff)), Piece("headset", coats.steel, nut)]
    spacers = [rod(top + h * up, top + (h + 0.0088) * up, 0.0165, 18) for h in np.arange(0.0, c.height - 0.004, 0.0094)]
    column = rod(top - 0.002 * up, root, 0.0143, 14)
    sleeve = rod(root - 0.0205 * up, root + 0.0205 * up, 0.0195, 18)
    cap = rod(root + 0.019 * up, root + 0.0265 * up, (0.0165, 0.015), 16)
    arm = tube([root, between(root, centre, 0.5), centre], (0.018, 0.0155, 0.0175), 14)
    return [
        Piece("stem", coats.parts, join(sleeve, arm, cuff)),
        Piece("stem", coats.black, join(column, *spacers, cap)),
        Piece("stem", coats.steel, join(*bolts)),
    ]


def _grips(c: Cockpit, centre: Float, coats: Coats) -> list[Piece]:
    """Wound tape on a drop bar, ribbed grips on the others, and end plugs."""
    path = bar_path(c)
    gone = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    long = gone[-1] - 0.45 * c.width / 2 if c.bar == "drop" else 0.13
    count = 52 if c.bar == "drop" else 27
    share = gone[-1] - long + long * np.linspace(0, 1, count)
    line = np.stack([np.interp(share, gone, path[:, k]) for k in range(3)], axis=1) + centre
    if c.bar == "drop":
        radius = 0.0152 + 0.0009 * (np.arange(count) % 3 == 1)
        ends = (0.0, 0.002)
    else:
        radius = 0.0152 + 0.0012 * (np.arange(count) % 3 == 1)
        radius[[0, 1, -2, -1]] = 0.0178
        ends = (0.0, 0.003)
    tip, out = line[-1], unit(line[-1] - line[-3])
    plug = rod(tip - ends[0] * out, tip + ends[1] * out, 0.0125, 12)
    return [*_sides("grip", coats.grip, tube(line, radius, 11)), *_sides("grip", coats.black, plug)]


def _drop_levers(c: Cockpit, centre: Float, coats: Coats) -> list[Piece]:
    """Rubber hoods on the bends, with blades that hang in front of the drops."""
    w = c.width / 2
    body = smooth(
        [
            (w, -0.05, 0.004),
            (w, -0.085, 0.006),
            (w - 0.001, -0.115, 0.012),
            (w - 0.002, -0.138, 0.028),
            (w - 0.003, -0.147, 0.046),
        ],
        4,
    )
    radius = np.interp(np.linspace(0, 1, len(body)), (0, 0.3, 0.6, 0.85, 1), (0.0165, 0.0185, 0.0165, 0.0155, 0.0085))
    line = smooth([(w, -0.135, 0.016), (w + 0.001, -0.15, -0.012), (w + 0.004, -0.142, -0.055), (w + 0.008, -0.122, -0.1)], 5)
    section = np.linspace(0, 2 * np.pi, 8, endpoint=False)
    flat = np.stack([0.0065 * np.cos(section), 0.0042 * np.sin(section)], axis=1)
    blade = swept(line * (0, 1, 1) + (w, 0, 0), np.broadcast_to(flat, (len(line), 8, 2)))
    inner = Solid(blade.vertices * (1, 1, 1) + (-0.002, 0.014, 0.002), blade.triangles)
    inner = Solid((inner.vertices - inner.vertices.mean(0)) * (0.8, 0.8, 0.6) + inner.vertices.mean(0), inner.triangles)
    pivot = rod((w - 0.013, -0.132, 0.012), (w + 0.013, -0.132, 0.012), 0.005, 10)
    return [
        *_sides("brake_lever", coats.rubber, moved(tube(body, radius, 14), centre)),
        *_sides("brake_lever", coats.parts, moved(join(blade, pivot), centre)),
        *_sides("shifter", coats.black, moved(inner, centre)),
    ]


def _levers(at: Layout, c: Cockpit, coats: Coats) -> list[Piece]:
    """Clamps with blades in front of the grips."""
    h = hold(at, c, 0.158)
    body = rod(h.point, h.point + 0.03 * h.off, (0.011, 0.009), 10)
    ahead = hold(at, c, 0.05)
    start = h.point + 0.029 * h.off - 0.008 * h.along
    knee = h.point + 0.043 * h.off + 0.026 * h.along
    blade = tube(
        smooth([start, knee, between(knee, ahead.point + 0.045 * ahead.off, 0.6), ahead.point + 0.052 * ahead.off], 4),
        0.0052,
        8,
    )
    ball = rod(ahead.point + 0.048 * ahead.off, ahead.point + 0.056 * ahead.off, 0.006, 8)
    return [
        *_sides("brake_lever", coats.black, join(_band(h, 0.0152, 0.0085), body)),
        *_sides("brake_lever", coats.alloy, join(blade, ball)),
    ]


def _bell(at: Layout, c: Cockpit, coats: Coats) -> list[Piece]:
    """A dome on the bar's left half."""
    path = bar_path(c)
    place = path[np.searchsorted(path[:, 0], 0.075)] + clamp(at, c)
    turn = np.linspace(0, np.pi / 2, 7)
    dome = [(0, 0.0), (0.024, 0.0), (0.0255, 0.002), *np.stack([0.025 * np.cos(turn), 0.005 + 0.02 * np.sin(turn)], axis=1)]
    up = unit((0.0, -0.35, 1.0))
    foot = rod(place, place + 0.018 * up, 0.006, 8)
    band = rod(place - (0.006, 0, 0), shifted(place, 0.006, 0, 0), 0.0145, 12)
    thumb = rod(place + 0.015 * up, shifted(place, 0.034, 0.004, 0.012), 0.003, 6)
    return [
        Piece("bell", coats.chrome, aimed(lathe(dome, 24), place + 0.014 * up, up)),
        Piece("bell", coats.black, join(foot, band, thumb)),
    ]
