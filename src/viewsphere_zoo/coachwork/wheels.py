"""Wheels: tyre and rim about the x axis, outer face towards +x."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere_zoo.shapes.solids import Float, Solid, curve, join, lathe, loft, moved, turned

SEGMENTS = 28


@dataclass(frozen=True)
class Wheel:
    """A wheel's measures in metres and its rim's design.

    radius and width: the tyre's; rim: the rim's radius as a fraction of the tyre's; spokes: how many; spoke_width: at the hub,
    as a fraction of the spokes' pitch; flare: 0.5 for straight spokes, more widens them towards the rim; twist: how far spokes
    lean, radians; paired: each spoke is two.
    """

    radius: float = 0.32
    width: float = 0.215
    rim: float = 0.68
    spokes: int = 5
    spoke_width: float = 0.5
    flare: float = 0.8
    twist: float = 0.0
    paired: bool = False


def tyre(w: Wheel) -> Solid:
    """Side walls, shoulders and a tread with grooves."""
    r, q, half = w.radius, w.radius * w.rim, w.width / 2
    side = [(q, 0.84), (q + 0.006, 0.93), (q + 0.45 * (r - q), 1.0), (r - 0.022, 0.95), (r - 0.005, 0.82)]
    tread: list[tuple[float, float]] = []
    for c in (-0.32, 0.32):
        tread += [(r, c - 0.055), (r - 0.007, c), (r, c + 0.055)]
    back = [(0.0, -0.6), (q, -0.6)]
    profile = np.array([*back, *((a, -b) for a, b in side[2::2]), *tread, *side[::-1]])
    return _on_axle(lathe(profile * (1, half), SEGMENTS))


def rim(w: Wheel, phase: float) -> tuple[Solid, Solid, Solid]:
    """Alloy (lip, spokes, hub), brake disc, and the dark inside; phase turns the spokes, radians."""
    q, half = w.radius * w.rim, w.width / 2
    lip = [(q + 0.004, 0.84), (q + 0.005, 0.93), (q - 0.002, 0.95), (q - 0.012, 0.93), (q - 0.02, 0.8)]
    well = [(q - 0.02, 0.8), (q - 0.035, -0.2), (0.0, -0.2)]
    cap = [(0.19 * q, 0.3), (0.185 * q, 0.66), (0.16 * q, 0.72), (0.0, 0.74)]
    disc = [(0.66 * q, -0.1), (0.66 * q, 0.05), (0.3 * q, 0.06), (0.18 * q, 0.3)]
    bolts = lathe([(0.0065, 0.0), (0.0, 0.007)], 5)
    circle = [moved(bolts, (0.12 * q * np.cos(a), 0.12 * q * np.sin(a), 0.72 * half)) for a in np.arange(5) * 2 * np.pi / 5]
    arms = [turned(_spoke(w), 2, phase + angle) for angle in _angles(w)]
    return (
        _on_axle(join(lathe(_scaled(lip, half), SEGMENTS), lathe(_scaled(cap, half), 16), *arms, *circle)),
        _on_axle(lathe(_scaled(disc, half), 20)),
        _on_axle(lathe(_scaled(well, half), SEGMENTS)),
    )


def _scaled(profile: list[tuple[float, float]], half: float) -> Float:
    return np.array(profile) * (1, half)


def _on_axle(solid: Solid) -> Solid:
    return turned(solid, 1, np.pi / 2)


def _angles(w: Wheel) -> Float:
    """Angles at which spokes start, radians."""
    angles = np.arange(w.spokes) * 2 * np.pi / w.spokes
    spread = 0.24 * 2 * np.pi / w.spokes
    return np.concatenate([angles - spread, angles + spread]) if w.paired else angles


_SECTION = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 0.4), (0.75, 1.0), (-0.75, 1.0), (-1.0, 0.4)])


def _spoke(w: Wheel) -> Solid:
    """One spoke along +x, its face towards +z."""
    q, half = w.radius * w.rim, w.width / 2
    f = np.linspace(0, 1, 4)
    r = 0.14 * q + f * (q - 0.015 - 0.14 * q)
    pitch = 2 * np.pi * 0.3 * q / (w.spokes * (2 if w.paired else 1))
    wide = 0.5 * w.spoke_width * pitch * (1 + (w.flare * 2 - 1) * f)
    face = half * curve(f, [(0, 0.6), (0.5, 0.74), (1, 0.84)])
    thick = 0.011 - 0.002 * f
    ring = _SECTION
    lean = w.twist * f**1.5
    y = ring[:, 0] * wide[:, None]
    z = face[:, None] - thick[:, None] + ring[:, 1] * thick[:, None]
    x = np.broadcast_to(r[:, None], y.shape)
    c, s = np.cos(lean)[:, None], np.sin(lean)[:, None]
    return loft(np.stack([c * x - s * y, s * x + c * y, z], axis=-1))
