"""Random bicycles like real ones, by style and kind."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from viewsphere_zoo.cycle.coats import Colors
from viewsphere_zoo.cycle.cockpit import Cockpit
from viewsphere_zoo.cycle.design import Bicycle
from viewsphere_zoo.cycle.frames import Frame
from viewsphere_zoo.cycle.gears import Gears
from viewsphere_zoo.cycle.layout import Geometry
from viewsphere_zoo.cycle.saddle import Saddle
from viewsphere_zoo.cycle.wheels import Wheel
from viewsphere_zoo.shapes.paint import Color, Finish

T = TypeVar("T")
_SPOKES = {20: 2, 24: 2, 28: 3, 32: 3, 36: 3}
_BLACK: Color = (0.085, 0.085, 0.09)
_SILVER: Color = (0.77, 0.78, 0.79)
_TAN: Color = (0.7, 0.5, 0.3)
_CREAM: Color = (0.88, 0.83, 0.7)
_BROWN: Color = (0.42, 0.23, 0.12)
_WHITE: Color = (0.94, 0.94, 0.92)

_PAINTS: tuple[tuple[Color, Color], ...] = (
    ((0.7, 0.06, 0.08), _WHITE),
    ((0.08, 0.08, 0.085), (0.85, 0.1, 0.1)),
    ((0.93, 0.93, 0.91), (0.1, 0.25, 0.6)),
    ((0.5, 0.8, 0.74), (0.1, 0.1, 0.11)),
    ((0.08, 0.14, 0.3), (0.95, 0.5, 0.1)),
    ((0.96, 0.78, 0.06), (0.08, 0.08, 0.09)),
    ((0.62, 0.65, 0.68), (0.05, 0.3, 0.65)),
    ((0.08, 0.26, 0.16), (0.86, 0.78, 0.55)),
    ((0.95, 0.4, 0.06), _WHITE),
    ((0.42, 0.2, 0.55), (0.3, 0.85, 0.8)),
    ((0.93, 0.45, 0.6), _WHITE),
    ((0.1, 0.38, 0.75), (0.95, 0.85, 0.2)),
    ((0.3, 0.32, 0.34), (0.55, 0.9, 0.1)),
    ((0.35, 0.05, 0.1), (0.85, 0.7, 0.4)),
    ((0.42, 0.72, 0.2), (0.08, 0.08, 0.09)),
    ((0.62, 0.78, 0.9), (0.93, 0.93, 0.9)),
    ((0.84, 0.78, 0.62), (0.42, 0.2, 0.1)),
    ((0.05, 0.5, 0.52), (0.96, 0.93, 0.85)),
)


def draw(rng: np.random.Generator) -> Bicycle:
    """The parameters of a random bicycle."""
    kind = rng.choice(5, p=(0.17, 0.12, 0.11, 0.28, 0.32))
    p = (_race, _single, _touring, _mountain, _step_through)[int(kind)](rng)
    steering = float(np.clip(rng.normal(0, 6), -13, 13))
    turn = _between(rng, -70, 0) if p.kickstand else _between(rng, -180, 180)
    return replace(p, steering=steering, crank_angle=turn, canvas=_one(rng, _CANVAS))


_CANVAS: tuple[Color, ...] = ((0.1, 0.11, 0.12), (0.3, 0.33, 0.2), (0.55, 0.47, 0.33), (0.12, 0.2, 0.36), (0.55, 0.1, 0.1))


def _one(rng: np.random.Generator, choices: Sequence[T]) -> T:
    return choices[int(rng.integers(len(choices)))]


def _coin(rng: np.random.Generator, share: float) -> bool:
    return bool(rng.random() < share)


def _between(rng: np.random.Generator, low: float, high: float) -> float:
    return float(rng.uniform(low, high))


def _shade(rng: np.random.Generator, color: Color) -> Color:
    """The colour a little lighter or darker, its hue changed a little."""
    r, g, b = np.clip(np.array(color) * rng.uniform(0.85, 1.08) + rng.normal(0, 0.012, 3), 0.03, 0.96)
    return (float(r), float(g), float(b))


def _colors(rng: np.random.Generator, dark_parts: float, dark_rims: float, other_fork: float) -> Colors:
    """Paint with its accent; the numbers are probabilities of black parts, of black rims, and of a fork in another colour."""
    paint, accent = _one(rng, _PAINTS)
    frame = _shade(rng, paint)
    fork = _one(rng, (_BLACK, accent, _SILVER)) if _coin(rng, other_fork) else frame
    finish: Finish = _one(rng, ("gloss", "gloss", "matte", "metal"))
    return Colors(
        frame=frame,
        accent=accent,
        fork=fork,
        rim=_BLACK if _coin(rng, dark_rims) else _SILVER,
        parts=_BLACK if _coin(rng, dark_parts) else _SILVER,
        extra=_one(rng, (accent, _WHITE, _BLACK, frame)),
        finish=finish,
    )


def _frame_size(rng: np.random.Generator, g: Geometry, tall: float) -> Geometry:
    """The geometry for a rider of size `tall`, from 0 (short) to 1."""
    return replace(
        g,
        wheelbase=g.wheelbase + 0.045 * (tall - 0.5) + _between(rng, -0.01, 0.01),
        seat_tube=g.seat_tube + 0.085 * (tall - 0.5),
        head_tube=g.head_tube + 0.06 * (tall - 0.5),
        saddle=g.saddle + 0.105 * (tall - 0.5) + _between(rng, -0.01, 0.02),
        head_angle=g.head_angle + _between(rng, -0.8, 0.8),
        seat_angle=g.seat_angle + _between(rng, -0.7, 0.7),
    )


def _drop_bar(rng: np.random.Generator, tall: float) -> Cockpit:
    return Cockpit("drop", 0.39 + 0.05 * tall, _between(rng, 0.08, 0.12), _between(rng, -14, 6), _one(rng, (0.01, 0.02, 0.03)))


def _race(rng: np.random.Generator) -> Bicycle:
    """Thin tyres, drop bar, many gears."""
    tall, disc = float(rng.uniform()), _coin(rng, 0.45)
    steel = _coin(rng, 0.35)
    colors = _colors(rng, 0.2 if steel else 0.75, 0.15 if steel else 0.7, 0.3)
    tape = _one(rng, (_BLACK, _BLACK, _WHITE, _BROWN if steel else colors.accent))
    tan = _coin(rng, 0.45 if steel else 0.2)
    deep = 0.02 if steel else _between(rng, 0.022, 0.055)
    spokes = _one(rng, (28, 32, 36) if steel else (20, 24, 28))
    tube = 1.0 if steel else _between(rng, 1.3, 1.85)
    ring = int(rng.integers(48, 54))
    return Bicycle(
        geometry=_frame_size(rng, Geometry(0.988, 0.41, 0.07, 73, 73.5, 0.375, 0.045, 0.145, 0.53, 0.735, tube), tall),
        wheel=Wheel(
            tyre=_between(rng, 0.025, 0.03),
            rim_depth=deep,
            spokes=spokes,
            crosses=_SPOKES[spokes],
            rotor=0.07 * disc,
            band=tan,
            dashes=0 if deep < 0.034 else int(rng.integers(0, 5)),
            braked=not disc,
        ),
        frame=Frame(decor=_one(rng, ("letters", "bands", "two_tone", "plain")), bridge=not disc),
        fork="raked" if steel and not disc else "straight",
        gears=Gears((ring, ring - 15), (11, 12, 13, 14, 16, 18, 20, 23, 25 + int(rng.integers(0, 7))), int(rng.integers(3, 6))),
        cockpit=replace(_drop_bar(rng, tall), quill=steel and _coin(rng, 0.6), height=0.035 if steel else 0.015),
        saddle=Saddle(_between(rng, 0.25, 0.285), _between(rng, 0.13, 0.15)),
        brake="disc" if disc else "caliper",
        crank_arms=_one(rng, (4, 5)),
        pedal=_one(rng, ("clipless", "cage")) if steel else "clipless",
        colors=replace(colors, grip=tape, saddle=_one(rng, (_BLACK, tape)), sidewall=_TAN),
        bottles=_one(rng, (0, 1, 1, 2, 2)),
        saddle_bag=_coin(rng, 0.25),
    )


def _single(rng: np.random.Generator) -> Bicycle:
    """One gear, bare frame, deep rims in strong colours."""
    tall = float(rng.uniform())
    colors = _colors(rng, 0.4, 0.3, 0.3)
    rim = _one(rng, (colors.accent, colors.rim, _WHITE, _shade(rng, _one(rng, _PAINTS)[0])))
    grip = _one(rng, (_BLACK, _BROWN, colors.accent, _WHITE))
    bar = (
        _drop_bar(rng, tall)
        if _coin(rng, 0.35)
        else Cockpit(
            _one(rng, ("flat", "riser")),
            _between(rng, 0.5, 0.62),
            _between(rng, 0.07, 0.1),
            _between(rng, -10, 6),
            0.015,
            shifters=False,
        )
    )
    color = _one(rng, (_BLACK, _BLACK, rim, _CREAM))
    return Bicycle(
        geometry=_frame_size(rng, Geometry(0.975, 0.405, 0.062, 73.5, 74, 0.374, 0.042, 0.14, 0.55, 0.735, 1.0), tall),
        wheel=Wheel(
            tyre=_between(rng, 0.025, 0.031), rim_depth=_one(rng, (0.024, 0.042, 0.042)), spokes=32, braked=_coin(rng, 0.5)
        ),
        frame=Frame(decor=_one(rng, ("plain", "letters", "bands"))),
        fork=_one(rng, ("straight", "raked")),
        gears=Gears((int(rng.integers(44, 49)),), (int(rng.integers(15, 19)),), 0, guard=_one(rng, ("none", "none", "ring"))),
        cockpit=bar,
        saddle=Saddle(0.27, _between(rng, 0.13, 0.155)),
        pedal=_one(rng, ("cage", "platform")),
        colors=replace(colors, rim=rim, tyre=color, sidewall=color, grip=grip, saddle=_one(rng, (_BLACK, grip))),
        bottles=0,
        saddle_bag=_coin(rng, 0.15),
        lights=_coin(rng, 0.3),
    )


def _touring(rng: np.random.Generator) -> Bicycle:
    """Wider tyres, mudguards and luggage on a diamond frame, with a drop or flat bar."""
    tall, disc = float(rng.uniform()), _coin(rng, 0.6)
    colors = _colors(rng, 0.6, 0.5, 0.2)
    tape = _one(rng, (_BLACK, _BLACK, _BROWN))
    flat = Cockpit(_one(rng, ("flat", "riser")), _between(rng, 0.58, 0.66), 0.09, _between(rng, 5, 20), 0.03, bell=True)
    carrier = _coin(rng, 0.75)
    tan = _coin(rng, 0.35)
    return Bicycle(
        geometry=_frame_size(
            rng, Geometry(1.045, 0.44, 0.072, 71.5, 72.8, 0.4, 0.048, 0.165, 0.52, 0.72, _between(rng, 1, 1.5)), tall
        ),
        wheel=Wheel(
            tyre=_between(rng, 0.035, 0.042),
            rim_width=0.026,
            rim_depth=0.02,
            spokes=36,
            rotor=0.08 * disc,
            band=tan,
            braked=not disc,
        ),
        frame=Frame(decor=_one(rng, ("letters", "bands", "plain"))),
        fork=_one(rng, ("straight", "raked")),
        gears=Gears((44, 30), (11, 13, 15, 17, 20, 23, 26, 30, 34), int(rng.integers(2, 6)), 0.047, 0.075),
        cockpit=flat if _coin(rng, 0.45) else replace(_drop_bar(rng, tall), rise=6.0, height=0.03),
        saddle=Saddle(0.275, 0.16),
        brake="disc" if disc else "v",
        pedal=_one(rng, ("cage", "platform")),
        colors=replace(colors, grip=tape, saddle=tape, sidewall=_TAN),
        guards=_one(rng, ("none", "frame", "extra", "extra")),
        carrier=carrier,
        panniers=int(rng.integers(0, 3)) if carrier else 0,
        lights=_coin(rng, 0.7),
        dynamo=_coin(rng, 0.4),
        bottles=int(rng.integers(1, 3)),
        frame_bag=False,
        kickstand=_coin(rng, 0.4),
    )


def _mountain(rng: np.random.Generator) -> Bicycle:
    """Knobbly tyres and a wide bar; usually a suspension fork, often a shock. Old ones have small wheels and V-brakes."""
    return _old_mountain(rng) if _coin(rng, 0.25) else _new_mountain(rng)


def _old_mountain(rng: np.random.Generator) -> Bicycle:
    """Wheels of 26 inches, three chainrings, V-brakes."""
    rigid = _coin(rng, 0.35)
    colors = _colors(rng, 0.9, 0.45, 0.8)
    tube = _between(rng, 1.15, 1.4)
    g = Geometry(1.07, 0.428, 0.022, 71.0, 73.5, 0.43 if rigid else 0.455, 0.044, 0.12, 0.44, 0.71, tube)
    bar = Cockpit(_one(rng, ("flat", "riser")), _between(rng, 0.58, 0.66), 0.1, _between(rng, 0, 8), bell=_coin(rng, 0.3))
    return Bicycle(
        style="mountain",
        geometry=_frame_size(rng, g, float(rng.uniform())),
        wheel=Wheel(0.2795, _between(rng, 0.05, 0.055), 0.026, 0.018, 32, 3, 0.00125, True, band=_coin(rng, 0.3)),
        frame=Frame(decor=_one(rng, ("letters", "bands", "two_tone", "plain"))),
        fork=_one(rng, ("straight", "raked")) if rigid else "telescopic",
        gears=Gears((42, 32, 22), (12, 14, 16, 18, 21, 24, 28), 3, 0.05, 0.078),
        cockpit=bar,
        saddle=Saddle(0.275, 0.148, 0.048, _between(rng, -3, 3)),
        brake="v",
        pedal=_one(rng, ("platform", "cage")),
        colors=replace(colors, sidewall=_TAN),
        bottles=int(rng.integers(0, 3)),
        saddle_bag=_coin(rng, 0.2),
    )


def _new_mountain(rng: np.random.Generator) -> Bicycle:
    """Wheels of 27.5 or 29 inches, one chainring, disc brakes, long travel."""
    shock = _coin(rng, 0.45)
    bead = _one(rng, (0.311, 0.311, 0.292))
    colors = _colors(rng, 0.9, 0.85, 0.8)
    fork = 0.5 + 0.01 * (bead > 0.3) + 0.025 * shock
    tube = _between(rng, 1.5, 1.9)
    g = Geometry(1.15 + 0.03 * shock, 0.437, bead - 0.274, 67.5 - 1.8 * shock, 73.5, fork, 0.044, 0.108, 0.425, 0.71, tube)
    frame_bag = not shock and _coin(rng, 0.2)
    bar = Cockpit(_one(rng, ("flat", "riser")), _between(rng, 0.7, 0.79), _between(rng, 0.04, 0.065), _between(rng, 0, 8))
    return Bicycle(
        style="mountain",
        geometry=_frame_size(rng, g, float(rng.uniform())),
        wheel=Wheel(
            bead,
            _between(rng, 0.054, 0.063),
            0.032,
            0.018,
            32,
            3,
            0.00125,
            True,
            _between(rng, 0.08, 0.1),
            band=_coin(rng, 0.2),
            dashes=int(rng.integers(0, 7)),
            braked=False,
        ),
        frame=Frame(decor=_one(rng, ("letters", "bands", "two_tone", "plain")), shock=shock, bridge=False),
        fork="telescopic",
        gears=Gears(
            (int(rng.integers(30, 35)),), (11, 13, 15, 18, 21, 24, 28, 34, 42, 50), int(rng.integers(3, 6)), 0.053, 0.088
        ),
        cockpit=bar,
        saddle=Saddle(0.275, 0.148, 0.048, _between(rng, -3, 3)),
        brake="disc",
        crank_arms=4,
        pedal=_one(rng, ("platform", "platform", "clipless")),
        colors=replace(colors, grip=_one(rng, (_BLACK, _BLACK, colors.accent)), sidewall=_TAN),
        bottles=0 if shock or frame_bag else int(rng.integers(0, 2)),
        saddle_bag=_coin(rng, 0.2),
        frame_bag=frame_bag,
    )


def _step_through(rng: np.random.Generator) -> Bicycle:
    """A town bicycle: upright, with guards that keep clothes clean and luggage for the shopping."""
    shape = _one(rng, ("swan", "swan", "wave", "mixte"))
    colors = _colors(rng, 0.15, 0.15, 0.0)
    rubber = _one(rng, (_BLACK, _BLACK, _BLACK, _CREAM, _BROWN))
    trim = _one(rng, (_BROWN, _BLACK, _BLACK, _CREAM))
    gears = _town_gears(rng)
    carrier = _coin(rng, 0.7)
    brake = _one(rng, ("v", "v", "hub", "disc"))
    wheel = _town_wheel(rng, brake == "disc", rubber == _BLACK)
    return Bicycle(
        style="step_through",
        geometry=_town_geometry(rng, wheel, shape == "wave"),
        wheel=wheel,
        frame=Frame(shape, _one(rng, ("plain", "plain", "bands")), bridge=brake != "disc"),
        fork="straight" if shape == "wave" else "raked",
        gears=gears,
        cockpit=_town_bar(rng, shape != "wave" or _coin(rng, 0.4), gears.derailleur),
        saddle=Saddle(_between(rng, 0.25, 0.275), _between(rng, 0.18, 0.215), 0.06, springs=_coin(rng, 0.65)),
        brake=brake,
        crank=0.17,
        pedal=_one(rng, ("rubber", "rubber", "platform")),
        colors=replace(colors, tyre=rubber, sidewall=_CREAM if wheel.band else rubber, grip=trim, saddle=trim),
        guards=_one(rng, ("frame", "frame", "extra")),
        carrier=carrier,
        panniers=_one(rng, (0, 0, 1, 2)) if carrier else 0,
        basket=_one(rng, ("none", "wire", "wicker")),
        lights=_coin(rng, 0.85),
        dynamo=_coin(rng, 0.6),
        bottles=0,
        kickstand=_coin(rng, 0.85),
    )


def _town_gears(rng: np.random.Generator) -> Gears:
    """Gears in the hub behind a chain guard, or a derailleur."""
    if _coin(rng, 0.35):
        return Gears((40,), (13, 15, 17, 19, 21, 24, 28), int(rng.integers(2, 5)), 0.0475, 0.068, guard="ring")
    rings, cogs = (int(rng.integers(36, 43)),), (int(rng.integers(17, 21)),)
    return Gears(rings, cogs, 0, 0.0475, guard=_one(rng, ("half", "half", "case", "ring")))


def _town_wheel(rng: np.random.Generator, disc: bool, black: bool) -> Wheel:
    """Wide smooth tyres, black ones sometimes with bright sides."""
    return Wheel(
        _one(rng, (0.311, 0.311, 0.2795)),
        _between(rng, 0.037, 0.05),
        0.028,
        0.018,
        36,
        rotor=0.08 * disc,
        band=black and _coin(rng, 0.25),
        braked=False,
        reflectors=_one(rng, (0, 2, 2, 3)),
    )


def _town_geometry(rng: np.random.Generator, w: Wheel, beam: bool) -> Geometry:
    """An upright geometry; shorter with small wheels."""
    small = w.bead < 0.3
    base = Geometry(1.1 - 0.03 * small, 0.455, 0.03 if small else 0.065, 69, 70.5, w.radius + 0.056, 0.058, 0.21, 0.46, 0.665)
    return _frame_size(rng, replace(base, tube=1.45 if beam else _between(rng, 1.0, 1.25)), float(rng.uniform()))


def _town_bar(rng: np.random.Generator, quill: bool, shifters: bool) -> Cockpit:
    """A bar swept back to the rider, or a riser bar."""
    return Cockpit(
        "swept" if _coin(rng, 0.8) else "riser",
        _between(rng, 0.54, 0.62),
        _between(rng, 0.05, 0.08),
        _between(rng, 5, 25),
        _between(rng, 0.06, 0.11) if quill else 0.047,
        quill,
        shifters=shifters or _coin(rng, 0.6),
        bell=_coin(rng, 0.8),
    )
