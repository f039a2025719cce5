"""Wheels: tyre, rim, spokes and hub about the x axis, the axle at the origin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere_zoo.cycle.coats import Coats
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.rods import circle, ring_of, rod, split, washer
from viewsphere_zoo.shapes.solids import Float, Solid, join, lathe, moved, rounded_box, turned

SEGMENTS = 72


@dataclass(frozen=True)
class Wheel:
    """Measures in metres. bead: the rim's seat (0.311 is ETRTO 622: 700c and 29 inches; 0.292 584: 27.5; 0.2795 559: 26).

    tyre: its width; spokes: how many, crossing `crosses` others; spoke: their radius; rotor: radius of the disc brake's
    disc, 0 for none; band: sidewalls in a colour of their own; dashes: coloured fields on the rim; reflectors: between
    the spokes.
    """

    bead: float = 0.311
    tyre: float = 0.028
    rim_width: float = 0.023
    rim_depth: float = 0.024
    spokes: int = 28
    crosses: int = 3
    spoke: float = 0.0012
    knobs: bool = False
    rotor: float = 0.0
    band: bool = False
    dashes: int = 0
    braked: bool = True
    reflectors: int = 0

    @property
    def radius(self) -> float:
        """Radius of the tyre's tread, metres."""
        return self.bead + 0.98 * self.tyre

    @property
    def inner(self) -> float:
        """Radius of the rim's inside, where spokes end, metres."""
        return self.bead - self.rim_depth


@dataclass(frozen=True)
class Hub:
    """Half the width between the dropouts, the positions of the flanges (left, right), and the radii, metres."""

    half: float = 0.05
    left: float = 0.034
    right: float = -0.034
    flange: float = 0.02
    body: float = 0.011


def on_axle(solid: Solid) -> Solid:
    """The solid, turned so that its z axis is the axle along x."""
    return turned(solid, 1, np.pi / 2)


def wheel_pieces(w: Wheel, hub: Hub, coats: Coats, name: str, phase: float) -> list[Piece]:
    """The wheel's pieces; parts begin with `name`; phase turns it, radians."""
    pieces = [*_tyre(w, coats, name), *_rim(w, coats, name, phase)]
    spokes, nipples = _spokes(w, hub)
    pieces += [
        Piece(f"{name}_spokes", coats.steel, turned(spokes, 0, phase)),
        Piece(f"{name}_spokes", coats.alloy, turned(nipples, 0, phase)),
        Piece(f"{name}_hub", coats.parts, on_axle(lathe(_hub_profile(hub), 20))),
        Piece(f"{name}_hub", coats.steel, rod((-hub.half - 0.012, 0, 0), (hub.half + 0.012, 0, 0), 0.0048, 10)),
    ]
    if w.rotor:
        disc, carrier = _rotor(w, hub)
        pieces += [Piece(f"{name}_rotor", coats.steel, disc), Piece(f"{name}_rotor", coats.black, carrier)]
    if w.reflectors:
        one = moved(rounded_box((0.012, 0.075, 0.024), 0.004, 2), (0, 0, 0.62 * w.inner))
        pieces.append(Piece(f"{name}_reflector", coats.amber, ring_of(one, w.reflectors, 0, phase + 0.1)))
    return pieces


def _section(w: Wheel, start: float, stop: float, count: int) -> Float:
    """(radius, x) along the tyre's round section; the angle is 0 at the tread and grows towards +x, degrees."""
    a = np.radians(np.linspace(start, stop, count))
    half = w.tyre / 2
    return np.stack([w.radius - half + half * np.cos(a), half * np.sin(a)], axis=1)


def _tyre(w: Wheel, coats: Coats, name: str) -> list[Piece]:
    """Tread, side walls, and knobs or grooves."""
    edge = 52.0
    tread = _section(w, -edge, edge, 9)
    if w.tyre > 0.034 and not w.knobs:
        tread[[2, 6], 0] -= 0.0022
    foot = _section(w, 150, 210, 3)
    sides = np.concatenate([_section(w, edge, 150, 6), foot[1:2], _section(w, 210, 360 - edge, 6)])
    wall = coats.sidewall if w.band else coats.tyre
    pieces = [
        Piece(f"{name}_tyre", coats.tyre, on_axle(lathe(tread, SEGMENTS))),
        Piece(f"{name}_tyre", wall, on_axle(lathe(sides, SEGMENTS))),
    ]
    if w.knobs:
        pieces.append(Piece(f"{name}_tyre", coats.tyre, _knobs(w)))
    return pieces


def _knobs(w: Wheel) -> Solid:
    """Rows of blocks on the tread, the rows staggered."""
    count = 62
    rows: list[Solid] = []
    for tilt, stagger, size in (
        (-48, 0, (0.008, 0.013)),
        (-16, 0.5, (0.009, 0.016)),
        (16, 0, (0.009, 0.016)),
        (48, 0.5, (0.008, 0.013)),
    ):
        top, base = np.array(size) / 2, np.array(size) / 2 + 0.0015
        corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
        low = np.column_stack([corners * base, np.full(4, -0.002)])
        high = np.column_stack([corners * top, np.full(4, 0.004)])
        block = _block(low, high)
        a = np.radians(tilt)
        half = w.tyre / 2
        block = moved(turned(block, 1, a), (half * np.sin(a), 0, w.radius - half + half * np.cos(a)))
        rows.append(ring_of(block, count, 0, stagger * 2 * np.pi / count))
    return join(*rows)


def _block(low: Float, high: Float) -> Solid:
    """A frustum over two (4, 3) rings, counter-clockwise seen from above."""
    quads = [(3, 2, 1, 0), (4, 5, 6, 7), *((i, (i + 1) % 4, 4 + (i + 1) % 4, 4 + i) for i in range(4))]
    triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return Solid(np.concatenate([low, high]), np.array(triangles, np.int64))


def _rim(w: Wheel, coats: Coats, name: str, phase: float) -> list[Piece]:
    """A closed rim: flanges, brake tracks, walls down to the spoke bed; and the valve."""
    h, out, track = w.rim_width / 2, w.bead + 0.006, w.bead - 0.009
    bed = 0.62 * h
    wall = [
        (track, h),
        (w.inner + 0.005, bed),
        (w.inner, 0.6 * bed),
        (w.inner, -0.6 * bed),
        (w.inner + 0.005, -bed),
        (track, -h),
    ]
    body = on_axle(lathe(wall, SEGMENTS))
    tracks = on_axle(lathe([(track, -h), (out, -h), (out, h), (track, h)], SEGMENTS))
    pieces = [Piece(f"{name}_rim", coats.alloy if w.braked else coats.rim, tracks)]
    if w.dashes:
        period = 2 * np.pi / w.dashes

        def in_dash(at: Float) -> np.ndarray:
            side = np.abs(at[:, 0]) > 0.6 * bed
            turn = (np.arctan2(at[:, 2], at[:, 1]) - phase) % period
            return side & (turn < 0.45 * period)

        dashes, body = split(body, in_dash)
        pieces.append(Piece(f"{name}_rim", coats.accent, dashes))
    gap = phase + np.pi / w.spokes
    out = np.array((0.0, np.cos(gap), np.sin(gap)))
    valve = rod((w.inner + 0.002) * out, (w.inner - 0.035) * out, (0.003, 0.0022), 6)
    return [*pieces, Piece(f"{name}_rim", coats.rim, body), Piece(f"{name}_rim", coats.steel, valve)]


def _spokes(w: Wheel, hub: Hub) -> tuple[Solid, Solid]:
    """Crossed lacing: on each flange neighbours lean to opposite sides. Includes the nipples at the rim."""
    a, b = spoke_ends(w, hub)
    tips = a + (b - a) * (1 - 0.013 / np.linalg.norm(b - a, axis=1))[:, None]
    wires = [rod(p, q, w.spoke, 5) for p, q in zip(a, b, strict=True)]
    nipples = [rod(p, q, 2 * w.spoke, 4) for p, q in zip(tips, b, strict=True)]
    return join(*wires), join(*nipples)


def spoke_ends(w: Wheel, hub: Hub) -> tuple[Float, Float]:
    """Return the spokes' starts at the hub and ends at the rim, (spokes, 3) each."""
    m = w.spokes // 2
    hubs: list[Float] = []
    rims: list[Float] = []
    for side, flange in enumerate((hub.left, hub.right)):
        j = np.arange(m)
        lean = np.where(j % 2, -1, 1)
        angle = 2 * np.pi * (j + 0.5 * side) / m
        reach = angle + lean * 2 * np.pi * w.crosses / m
        r = hub.flange - 0.003
        hubs.append(np.stack([flange + 0.0028 * lean, r * np.cos(angle), r * np.sin(angle)], axis=1))
        x = np.full(m, np.sign(flange) * 0.12 * w.rim_width)
        rim = w.inner + 0.003
        rims.append(np.stack([x, rim * np.cos(reach), rim * np.sin(reach)], axis=1))
    return np.concatenate(hubs), np.concatenate(rims)


def _hub_profile(hub: Hub) -> Float:
    """(radius, x) from right to left: lock nut, flange, body, flange, lock nut."""
    end = hub.half - 0.001

    def half(side: float, x: float) -> list[tuple[float, float]]:
        f, b = hub.flange, hub.body
        inner = abs(x) - 0.003
        points = [(b, inner - 0.008), (f - 0.001, inner), (f, inner + 0.001), (f, inner + 0.005), (f - 0.001, inner + 0.006)]
        points += [
            (b + 0.002, inner + 0.008),
            (0.012, max(end - 0.006, inner + 0.011)),
            (0.0105, end - 0.005),
            (0.0105, end),
            (0, end),
        ]
        return [(r, side * v) for r, v in points]

    right, left = half(-1, hub.right), half(1, hub.left)
    return np.array([*right[::-1], *left])


def _rotor(w: Wheel, hub: Hub) -> tuple[Solid, Solid]:
    """A wavy disc with holes between its arms, and the carrier on the hub, on the left."""
    a = np.linspace(0, 2 * np.pi, 72, endpoint=False)
    wave = 0.0012 * np.sin(12 * a)
    outer = circle(1, 72) * (w.rotor + wave)[:, None]
    inner = circle(1, 72) * (w.rotor - 0.015 + wave)[:, None]
    arm_outer = np.array([(0.018, -0.004), (w.rotor - 0.013, 0.012), (w.rotor - 0.013, 0.019), (0.018, 0.005)])
    levels = [np.column_stack([arm_outer, np.full(4, z)]) for z in (-0.0008, 0.0008)]
    arms = ring_of(_block(levels[0], levels[1]), 6)
    disc = join(washer(inner, outer, 0.002), arms)
    x = hub.half - 0.011
    body = lathe([(0, -0.006), (0.021, -0.005), (0.022, 0.0), (0.018, 0.004), (0, 0.0045)], 24)
    return moved(on_axle(disc), (x, 0, 0)), moved(on_axle(body), (x, 0, 0))
