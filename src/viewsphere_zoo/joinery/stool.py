"""Stools: four legs of wood or steel, three legs, or a column on a plate."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material
from viewsphere_zoo.joinery.coats import (
    BRASS,
    CHROME,
    RUBBER,
    WOODS,
    Cover,
    drawn_color,
    drawn_cover,
    drawn_wood,
    lacquered,
    timber,
)
from viewsphere_zoo.joinery.members import bar, hoop, pipe, spindle
from viewsphere_zoo.joinery.slabs import Height, box_outline, crowned, polygon, seam, slab
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import Color
from viewsphere_zoo.shapes.rods import circle, ring_of, rod
from viewsphere_zoo.shapes.solids import Float, Solid, both_sides, curve, join, lathe

Base = Literal["wood", "steel", "three", "column"]
Seat = Literal["round", "square", "saddle"]


@dataclass(frozen=True)
class Stool:
    """Parameters of a stool; lengths in metres.

    height: of the seat; seat_width: its diameter or side; splay: run of the legs per metre of height; back: height of a low
    back above the seat, 0 for none; padded: upholstered; metal: colour of the steel, None for chrome.
    """

    height: float = 0.74
    seat_width: float = 0.36
    seat: Seat = "round"
    base: Base = "wood"
    splay: float = 0.1
    back: float = 0.0
    padded: bool = False
    footrest: float = 0.26
    metal: Color | None = None
    brass: bool = False
    wood: Color = WOODS["oak"]
    cover: Cover = field(default_factory=Cover)

    @property
    def under(self) -> float:
        """Height of the seat's underside."""
        return self.height - (0.07 if self.padded else 0.036)

    @property
    def sag(self) -> float:
        """The rise of the seat's sides, per metre of x squared."""
        return 0.9 if self.seat == "saddle" else 0.0

    @property
    def steel(self) -> Material:
        """The coating of the metal."""
        return BRASS if self.brass else CHROME if self.metal is None else lacquered(self.metal)


def pieces(p: Stool) -> list[Piece]:
    """Return the pieces of a stool; feet on z = 0."""
    base = {"wood": _wooden, "steel": _steel, "three": _three, "column": _column}[p.base]
    return [*_seat(p), *base(p), *_back(p)]


def _outline(p: Stool) -> Float:
    """The seat's plan."""
    r = p.seat_width / 2
    if p.seat == "round":
        return circle(r, 64)
    if p.seat == "square":
        return box_outline(2 * r, 2 * r * 0.94, 0.05, 0.02)
    return polygon(
        [
            (-1.15 * r, -0.72 * r),
            (0, -0.8 * r),
            (1.15 * r, -0.72 * r),
            (1.15 * r, 0.72 * r),
            (0, 0.8 * r),
            (-1.15 * r, 0.72 * r),
        ],
        0.06,
        0.02,
    )


def _seat(p: Stool) -> list[Piece]:
    """Solid wood, hollowed a little, or a pad on a board."""
    outline, wood = _outline(p), timber(p.wood)

    def bent(height: float, crown: float) -> Height:
        face = crowned(outline, height, crown)

        def sagging(x: Float, y: Float) -> Float:
            return face(x, y) + p.sag * x**2

        return sagging

    if not p.padded:
        return [Piece("seat", wood[1], slab(outline, bent(p.under, 0), bent(p.height - 0.013 * p.sag, -0.01), 0.012, 8))]
    board = slab(outline * 0.97, bent(p.under, 0), bent(p.under + 0.022, 0), 0.005, 6)
    top = bent(p.height - 0.016, 0.016)
    pad = slab(outline, bent(p.under + 0.016, 0), top, 0.026, 9, 5)
    coat = p.steel if p.base in ("steel", "column") else wood[0]
    return [
        Piece("seat", coat, board),
        Piece("seat_pad", p.cover.material, pad),
        Piece("seat_pad", p.cover.piping, seam(outline, top, 0.026)),
    ]


def _corners(p: Stool) -> tuple[Float, Float]:
    """Feet and tops of two left legs, front and rear, (2, 3) each."""
    r = p.seat_width / 2
    x, y = (0.62 * r, 0.6 * r) if p.seat == "round" else (0.92 * r, 0.58 * r) if p.seat == "saddle" else (0.8 * r, 0.76 * r)
    z = p.under + 0.012 + p.sag * x**2
    top = np.array([(x, -y, z), (x, y, z)])
    out = p.splay * p.under
    return np.array([(x + out, -y - out, 0), (x + out, y + out, 0)]), top


def _wooden(p: Stool) -> list[Piece]:
    """Tapered legs with rungs, higher at the sides than before and behind."""
    wood = timber(p.wood)
    foot, top = _corners(p)
    legs = [
        spindle(a, b, [(0, 0.0125), (0.02, 0.0145), (0.6, 0.0185), (1, 0.0165)], 20) for a, b in zip(foot, top, strict=True)
    ]

    def rung(a: Float, b: Float, share: float) -> Solid:
        ends = (leg[0] + share * (leg[1] - leg[0]) for leg in (a, b))
        return spindle(*ends, profile=[(0, 0.0085), (0.5, 0.0125), (1, 0.0085)])

    left = [np.stack([a, b]) for a, b in zip(foot, top, strict=True)]
    right = [e * (-1, 1, 1) for e in left]
    share = p.footrest / p.under if p.under > 0.55 else 0.3
    side = [rung(left[0], left[1], s) for s in ([share + 0.1, share + 0.42] if p.under > 0.55 else [share + 0.2])]
    ends = [rung(left[k], right[k], s) for k in (0, 1) for s in ([share, share + 0.3] if p.under > 0.55 else [share])]
    return [Piece("leg", wood[0], both_sides(join(*legs))), Piece("footrest", wood[2], join(both_sides(join(*side)), *ends))]


def _steel(p: Stool) -> list[Piece]:
    """Bent tubes and a foot ring."""
    foot, top = _corners(p)
    tubes = []
    for k in (0, 1):
        knee = top[k] - (0, 0, 0.014)
        tip = foot[k] + 0.02 * (knee - foot[k])
        inner = knee * (0.04, 0.04, 1) - (0, 0, p.sag * knee[0] ** 2)
        tubes.append(pipe([inner, knee, tip], 0.0115, 0.05, 16))
    rubber = [spindle(f, f + 0.05 * (t - f), [(0, 0.013), (0.2, 0.0155), (1, 0.0145)]) for f, t in zip(foot, top, strict=True)]
    share = p.footrest / p.under if p.under > 0.55 else 0.42
    at = foot + share * (top - foot)
    corner = at[1]
    if p.seat == "round":
        ring = hoop(np.column_stack([circle(float(np.hypot(*corner[:2])), 72), np.full(72, corner[2])]), 0.009, sides=12)
    else:
        plan = polygon([at[0][:2] * (-1, 1), at[0][:2], at[1][:2], at[1][:2] * (-1, 1)], 0.03, 0.03)
        ring = hoop(np.column_stack([plan, np.full(len(plan), corner[2])]), 0.009, sides=12)
    return [
        Piece("leg", p.steel, both_sides(join(*tubes))),
        Piece("foot", RUBBER, both_sides(join(*rubber))),
        Piece("footrest", p.steel, ring),
    ]


def _three(p: Stool) -> list[Piece]:
    """Three turned legs and spokes that meet below the seat."""
    wood, r = timber(p.wood), 0.3 * p.seat_width
    out = r + (p.splay + 0.08) * p.under
    share = p.footrest / p.under if p.under > 0.55 else 0.4
    leg = spindle(
        (0, -out, 0),
        (0, -r, p.under + 0.012),
        [(0, 0.013), (0.3, 0.017), (0.6, 0.021), (0.64, 0.016), (0.68, 0.022), (1, 0.016)],
        22,
    )
    spoke = spindle(
        (0, -out + share * (out - r), share * p.under), (0, 0, share * p.under), [(0, 0.009), (0.5, 0.013), (1, 0.012)]
    )
    knob = spindle(
        (0, 0, share * p.under - 0.02), (0, 0, share * p.under + 0.02), [(0, 0.012), (0.15, 0.02), (0.85, 0.02), (1, 0.012)], 24
    )
    return [Piece("leg", wood[0], ring_of(leg, 3)), Piece("footrest", wood[2], join(ring_of(spoke, 3), knob))]


def _column(p: Stool) -> list[Piece]:
    """A plate, a telescopic column and a footrest loop."""
    r = 0.6 * p.seat_width + 0.015
    plate = lathe(
        [(0, 0), (r - 0.004, 0), (r, 0.004), (r, 0.008), (0.6 * r, 0.02), (0.2 * r, 0.032), (0.034, 0.05), (0, 0.05)], 72
    )
    cut = 0.55 * p.under
    column = lathe(
        [
            (0, 0.04),
            (0.028, 0.04),
            (0.028, cut),
            (0.025, cut + 0.004),
            (0.019, cut + 0.006),
            (0.019, p.under - 0.03),
            (0.06, p.under - 0.012),
            (0.09, p.under + 0.006),
            (0, p.under + 0.006),
        ],
        40,
    )
    found = [Piece("base", p.steel, plate), Piece("column", p.steel, column)]
    if p.under > 0.5:
        z, reach = p.footrest + 0.02, 0.46 * p.seat_width
        loop = hoop(np.column_stack([circle(reach, 72), np.full(72, z)]) - (0, 0.4 * reach, 0), 0.009, sides=12)
        clamp = lathe(
            [(0, z - 0.02), (0.032, z - 0.02), (0.034, z - 0.018), (0.034, z + 0.018), (0.032, z + 0.02), (0, z + 0.02)], 36
        )
        struts = [rod((0, 0, z), (reach * s * 0.94, -0.4 * reach + 0.34 * reach, z), 0.007, 12) for s in (-1, 1)]
        found.append(Piece("footrest", p.steel, join(loop, clamp, *struts, rod((0, 0, z), (0, -1.4 * reach, z), 0.007, 12))))
    lever = pipe([(0, 0, p.under - 0.02), (0.1, 0, p.under - 0.024), (0.17, 0, p.under - 0.04)], 0.0045, 0.04, 10)
    return [*found, Piece("lever", p.steel, lever)]


def _back(p: Stool) -> list[Piece]:
    """A low curved back on two posts."""
    if not p.back:
        return []
    r, top = p.seat_width / 2, p.height + p.back
    t = np.linspace(-1, 1, 25)
    a = 0.95 * t
    rail = np.column_stack([1.04 * r * np.sin(a), 0.25 * r + 0.95 * r * np.cos(a), np.full(25, top - 0.045)])
    wide = curve(np.abs(t), [(0, 0.095), (0.7, 0.085), (1, 0.06)])
    thick = 0.034 if p.padded else 0.02
    crest = bar(rail, np.stack([wide, np.full(25, thick)], axis=1), 0.014 if p.padded else 0.007, (0, 0.15, 1), 5)
    wood = timber(p.wood)
    coat = p.cover.material if p.padded else wood[1]
    foot = np.array((0.5 * r, 0.62 * r, p.under + 0.01))
    if p.seat == "saddle":
        foot[1] = 0.52 * r
    head = np.array([0.62 * r, 0.25 * r + 0.95 * r * np.sqrt(1 - (0.62 / 1.04) ** 2), top - 0.06])
    if p.base in ("wood", "three"):
        post = Piece("back_post", wood[0], both_sides(spindle(foot, head, [(0, 0.012), (0.5, 0.013), (1, 0.01)])))
    else:
        low = np.array((foot[0] * 0.7, foot[1] * 0.5, p.under - 0.008))
        bent = pipe([low, np.array((head[0], 1.12 * r, p.under - 0.008)), np.add(head, (0, 0.004, 0))], 0.0095, 0.07, 14)
        post = Piece("back_post", p.steel, both_sides(bent))
    return [Piece("backrest", coat, crest), post]


def draw(rng: np.random.Generator) -> Stool:
    """A random stool; two in three are bar stools."""
    base: Base = ("wood", "steel", "three", "column")[int(rng.choice(4, p=(0.34, 0.28, 0.12, 0.26)))]
    high = base == "column" or rng.random() < 0.62
    seat: Seat = (
        "round" if base in ("three", "column") and rng.random() < 0.75 else ("round", "square", "saddle")[int(rng.integers(3))]
    )
    if base in ("three", "column") and seat == "saddle":
        seat = "square"
    metal = rng.random()
    back = float(rng.uniform(0.2, 0.3)) if high and seat != "saddle" and rng.random() < 0.45 else 0.0
    return Stool(
        height=float(rng.uniform(0.62, 0.78 - 0.25 * back) if high else rng.uniform(0.42, 0.5)),
        seat_width=float(rng.uniform(0.33, 0.4)),
        seat=seat,
        base=base,
        splay=float(rng.uniform(0.06, 0.14)),
        back=back,
        padded=base == "column" or bool(rng.random() < 0.45),
        footrest=float(rng.uniform(0.2, 0.3)),
        metal=None
        if metal < 0.4
        else drawn_color(((0.08, 0.08, 0.085), (0.9, 0.9, 0.88), (0.7, 0.16, 0.1), (0.2, 0.4, 0.42)), rng),
        brass=bool(metal > 0.85),
        wood=drawn_wood(rng, 0.3),
        cover=drawn_cover(rng, 0.5),
    )
