"""Folding chairs: crossed legs of steel tube or of slats, and the director's chair with canvas."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material
from viewsphere_zoo.joinery.coats import (
    BRASS,
    CHROME,
    PLASTICS,
    RUBBER,
    STEEL,
    WOODS,
    Cover,
    drawn_color,
    drawn_cover,
    drawn_wood,
    lacquered,
    plastic,
    timber,
)
from viewsphere_zoo.joinery.members import bar, bend, line, pipe, spindle
from viewsphere_zoo.joinery.slabs import box_outline, crowned, level, on, polygon, seam, slab
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import Color
from viewsphere_zoo.shapes.panels import Surface
from viewsphere_zoo.shapes.rods import rod
from viewsphere_zoo.shapes.solids import Float, Solid, both_sides, join, moved, rounded_box, tube

Kind = Literal["steel", "slatted", "director"]


@dataclass(frozen=True)
class Folding:
    """Parameters of a folding chair; lengths in metres.

    slats: boards in the seat of a slatted chair; back_slats: in its back; padded: cushions on a steel chair, else sheet
    plastic; metal: colour of the tubes, None for chrome; shell: colour of sheet seats.
    """

    kind: Kind = "steel"
    width: float = 0.45
    depth: float = 0.46
    seat_height: float = 0.45
    height: float = 0.8
    slats: int = 7
    back_slats: int = 2
    padded: bool = True
    metal: Color | None = None
    shell: Color = PLASTICS[1]
    wood: Color = WOODS["teak"]
    cover: Cover = field(default_factory=Cover)

    @property
    def long_leg(self) -> Float:
        """(y, z) of the legs that run from the front feet up into the back."""
        y = self.depth / 2
        return np.array([(-y + 0.01, 0.0), (0.2 * y, self.seat_height + 0.03), (0.72 * y, self.height)])

    @property
    def short_leg(self) -> Float:
        """(y, z) of the legs that run from the rear feet to the front of the seat."""
        y = self.depth / 2
        return np.array([(y - 0.01, 0.0), (-0.56 * y, self.seat_height - 0.043)])

    def at(self, leg: Float, z: float) -> float:
        """y of a leg at this height."""
        return float(np.interp(z, leg[:, 1], leg[:, 0]))


def pieces(p: Folding) -> list[Piece]:
    """Return the pieces of a folding chair; feet on z = 0."""
    return {"steel": _steel, "slatted": _slatted, "director": _director}[p.kind](p)


def _path(leg: Float, x: float) -> Float:
    """(x, y, z) of a leg."""
    return np.column_stack([np.full(len(leg), x), leg])


def _back_surface(p: Folding, hollow: float) -> Surface:
    """The plane of the long legs above the seat; u = 0 in the middle, v the height above the floor."""
    (_, low, high) = p.long_leg

    def surface(u: Float, v: Float) -> Float:
        y = low[0] + (v - low[1]) / (high[1] - low[1]) * (high[0] - low[0])
        edge = (p.width / 2) ** 2
        return np.stack([u, y + hollow * (edge - u**2), v], axis=-1)

    return surface


def _steel(p: Folding) -> list[Piece]:
    """Two bent tubes that cross, a seat and a back."""
    coat = CHROME if p.metal is None else lacquered(p.metal)
    r, x = 0.0115, p.width / 2 - 0.012
    inner = x - 2 * r - 0.004
    long, short = p.long_leg, p.short_leg
    a, b = _extended(long, -0.02), _extended(short, -0.02)
    uprights = pipe([*_path(a, -x), *_path(a[::-1], x)], r, 0.055, 16)
    legs = pipe([*_path(b, -inner), *_path(b[::-1], inner)], r, 0.03, 16)
    ties = [
        rod((-s, p.at(leg, z), z), (s, p.at(leg, z), z), 0.8 * r, 14) for s, leg, z in ((x, long, 0.1), (inner, short, 0.13))
    ]
    feet = [
        spindle((s, *a), (s, *(a + 0.05 * (b - a) / np.linalg.norm(b - a))), [(0, 0.012), (0.12, 0.0152), (1, 0.0148)])
        for s, (a, b) in ((x, long[:2]), (inner, short))
    ]
    z = _crossing(long, short)
    bolt = rod((inner - 0.02, p.at(long, z), z), (x + 0.016, p.at(long, z), z), 0.006, 12)
    rails = rod(
        (inner - 0.002, short[-1, 0] - 0.03, short[-1, 1] + 0.008),
        (x - 0.002, p.at(long, p.seat_height - 0.02), p.seat_height - 0.02),
        0.008,
        12,
    )
    return [
        Piece("leg_front", coat, uprights),
        Piece("leg_rear", coat, legs),
        Piece("stretcher", coat, join(*ties)),
        Piece("foot", RUBBER, both_sides(join(*feet))),
        Piece("hinge", STEEL, both_sides(join(bolt, rails))),
        *_steel_seat(p, inner),
    ]


def _crossing(a: Float, b: Float) -> float:
    """The height at which two legs cross."""
    z = np.linspace(0, b[-1, 1], 400)
    gap = np.interp(z, a[:, 1], a[:, 0]) - np.interp(z, b[:, 1], b[:, 0])
    return float(z[np.argmin(np.abs(gap))])


def _steel_seat(p: Folding, inner: float) -> list[Piece]:
    """Seat and back: bent sheet, or cushions on it."""
    half, front, rear = inner + 0.006, -0.4 * p.depth, 0.14 * p.depth + 0.01
    outline = polygon([(-half, front), (half, front), (0.96 * half, rear), (-0.96 * half, rear)], 0.05, 0.02)
    sheet = plastic("sheet", p.shell)

    def seat(u: Float, v: Float) -> Float:
        fall = 1.8 * np.clip(front + 0.09 - v, 0, None) ** 2
        return np.stack([u, v, p.seat_height - 0.012 - fall - 0.35 * (0.03 - u**2)], axis=-1)

    back = _back_surface(p, 0.55)
    high = p.height - 0.028
    plan = box_outline(2 * (p.width / 2 - 0.012), 0.19, 0.035, 0.02, (0, high - 0.095))
    found = [
        Piece("seat", sheet, on(seat, slab(outline, level(-0.006), level(0.006), 0.005, 9))),
        Piece("backrest", sheet, on(back, slab(plan, level(0.009), level(0.0155), 0.003, 7))),
    ]
    if p.padded:
        pad, rest = (
            outline * 0.95 + (0, 0.05 * outline[:, 1].mean()),
            (plan - (0, high - 0.095)) * (0.93, 0.88) + (0, high - 0.095),
        )
        faces = crowned(pad, 0.028, 0.012), crowned(rest, 0.03, 0.008)
        found += [
            Piece("seat_pad", p.cover.material, on(seat, slab(pad, level(0.003), faces[0], 0.018, 8))),
            Piece("seat_pad", p.cover.piping, on(seat, seam(pad, faces[0], 0.018, 0.003))),
            Piece("back_pad", p.cover.material, on(back, slab(rest, level(0.012), faces[1], 0.014, 8))),
        ]
    return found


def _slatted(p: Folding) -> list[Piece]:
    """Crossed wooden bars with slats for seat and back."""
    wood, x = timber(p.wood), p.width / 2 - 0.014
    inner = x - 0.026
    long, short = p.long_leg, p.short_leg
    size = (0.036, 0.02)
    uprights = _sawn(bar(bend(_path(_extended(long, 0.05), x), 0.12, 8), size, 0.005, (0, 1, 0)))
    legs = _sawn(bar(_path(_extended(short, 0.05), inner), size, 0.005, (0, 1, 0)))
    z = _crossing(long, short)
    bolt = rod((inner - 0.013, p.at(long, z), z), (x + 0.0135, p.at(long, z), z), 0.007, 14)
    ties = [
        bar(line((-s, p.at(leg, h), h), (s, p.at(leg, h), h)), (0.026, 0.015), 0.004, (0, 0, 1))
        for s, leg, h in ((x, long, 0.13), (inner, short, 0.12))
    ]
    top, front, rear = p.seat_height - 0.014, -0.42 * p.depth, p.at(long, p.seat_height) + 0.03
    beam = bar(
        line((inner - 0.024, front + 0.02, top - 0.022), (inner - 0.024, rear + 0.01, top - 0.028)),
        (0.03, 0.02),
        0.004,
        (0, 0, 1),
    )
    share = np.linspace(0, 1, p.slats)
    wide = 0.8 * (rear - 0.012 - front) / p.slats
    slats = []
    for k, s in enumerate(share):
        y, fall = front + wide / 2 + s * (rear - 0.035 - front - wide), -0.006 * s - 0.012 * (k == 0)
        slats.append(
            Piece(
                "seat_slat",
                wood[k % 3],
                bar(line((-inner + 0.012, y, top + fall), (inner - 0.012, y, top + fall)), (wide, 0.014), 0.004, (0, 1, 0)),
            )
        )
    pegs = rod((-x, p.at(long, top - 0.028), top - 0.028), (x, p.at(long, top - 0.028), top - 0.028), 0.007, 12)
    axle = rod((-inner, short[1, 0], short[1, 1] - 0.012), (inner, short[1, 0], short[1, 1] - 0.012), 0.007, 12)
    return [
        Piece("leg_front", wood[0], both_sides(uprights)),
        Piece("leg_rear", wood[0], both_sides(legs)),
        Piece("stretcher", wood[2], join(*ties)),
        Piece("hinge", BRASS, both_sides(bolt)),
        Piece("stretcher", wood[2], join(pegs, axle)),
        Piece("seat_rail", wood[2], both_sides(beam)),
        *slats,
        *_slatted_back(p, wood, x),
    ]


def _extended(leg: Float, share: float) -> Float:
    """The leg extended beyond its foot by this share of its first stretch."""
    return np.vstack([leg[0] - share * (leg[1] - leg[0]), leg[1:]])


def _sawn(solid: Solid) -> Solid:
    """The solid with everything below the floor pressed flat onto it."""
    return Solid(np.maximum(solid.vertices, (-np.inf, -np.inf, 0.0)), solid.triangles)


def _slatted_back(p: Folding, wood: tuple[Material, ...], x: float) -> list[Piece]:
    """Boards across the uprights, bent a little."""
    surface = _back_surface(p, 0.35)
    count = p.back_slats
    pitch = min(0.115, (p.height - p.seat_height - 0.11) / count)
    u = np.linspace(-x - 0.008, x + 0.008, 13)
    found = []
    for k in range(count):
        v = np.full(13, p.height - 0.012 - (k + 0.5) * pitch)
        path = surface(u, v) - (0, 0.012, 0)
        found.append(Piece("back_slat", wood[(k + 1) % 3], bar(path, (min(0.72 * pitch, 0.085), 0.013), 0.004, (0, 0.2, 1))))
    return found


def _director(p: Folding) -> list[Piece]:
    """Crossed legs before and behind, arms, canvas seat and back."""
    wood, (x, y) = timber(p.wood), (p.width / 2 - 0.03, p.depth / 2 - 0.05)
    rail, size = p.seat_height + 0.004, (0.034, 0.019)
    side = join(
        bar(line((x, -y - 0.045, 0.017), (x, y + 0.045, 0.017)), (0.034, 0.03), 0.006, (0, 0, 1)),
        bar(line((x, -y - 0.03, rail), (x, y + 0.03, rail)), (0.03, 0.026), 0.009, (0, 0, 1)),
    )
    crossed = []
    for at in (-y, y):
        for s in (-1, 1):
            depth = at + 0.0105 * s
            crossed.append(bar(line((-s * x, depth, 0.02), (s * x, depth, rail - 0.004)), size, 0.005, (1, 0, 0)))
    bolts = [rod((0, at - 0.0225, rail / 2 + 0.008), (0, at + 0.0225, rail / 2 + 0.008), 0.008, 16) for at in (-y, y)]
    top, arm = p.height, p.seat_height + 0.2
    posts = join(
        bar(line((x + 0.002, -y + 0.03, rail), (x + 0.002, -y + 0.03, arm)), (0.034, 0.02), 0.005, (0, 1, 0)),
        bar(
            [(x + 0.002, y - 0.02, rail), (x + 0.002, y - 0.01, arm), (x + 0.002, y + 0.02, top)],
            (0.034, 0.02),
            0.006,
            (0, 1, 0),
        ),
    )
    rest = moved(rounded_box((0.058, 2 * y + 0.07, 0.02), 0.007, 4), (x + 0.004, -0.012, arm + 0.006))
    return [
        Piece("frame", wood[0], both_sides(side)),
        Piece("leg", wood[1], join(*crossed)),
        Piece("hinge", BRASS, join(*bolts)),
        Piece("back_post", wood[0], both_sides(posts)),
        Piece("armrest", wood[2], both_sides(rest)),
        *_canvas(p, x, y, rail),
    ]


def _canvas(p: Folding, x: float, y: float, rail: float) -> list[Piece]:
    """Cloth that hangs between the rails and around the posts."""
    cloth, top = p.cover.material, p.height
    u = np.linspace(-x, x, 29)
    sag = 0.02 * (1 - (u / x) ** 2)
    path = np.column_stack([u, np.zeros(29), rail + 0.0155 - sag])
    seat = bar(path, (2 * y - 0.01, 0.004), 0.0015, (0, 1, 0), 2)
    sleeve = tube(line((x, -y + 0.005, rail), (x, y - 0.005, rail)), 0.0185, 20)
    low, high = top - 0.19, top - 0.012
    slope = 0.03 / (top - p.seat_height - 0.2)
    lean = np.array([0, slope, 1.0])
    middle = np.array([0, y + 0.02 - slope * (top - (low + high) / 2), (low + high) / 2])
    bow = np.column_stack([u, 0.022 * (1 - (u / x) ** 2) - 0.011, np.zeros(29)]) + middle
    back = bar(bow, (high - low, 0.004), 0.0015, lean, 2)
    wrap = bar(
        [middle + (x + 0.002, 0, 0) + h * lean for h in ((low - high) / 2, (high - low) / 2)], (0.043, 0.029), 0.011, (0, 1, 0)
    )
    return [
        Piece("seat", cloth, join(seat, both_sides(sleeve))),
        Piece("backrest", cloth, join(back, both_sides(wrap))),
    ]


def draw(rng: np.random.Generator) -> Folding:
    """A random folding chair."""
    kind: Kind = ("steel", "slatted", "director")[int(rng.choice(3, p=(0.36, 0.34, 0.3)))]
    director = kind == "director"
    metal, padded = rng.random(), bool(rng.random() < 0.55)
    return Folding(
        kind=kind,
        width=float(rng.uniform(0.54, 0.62) if director else rng.uniform(0.42, 0.47)),
        depth=float(rng.uniform(0.44, 0.5) if director else rng.uniform(0.46, 0.54)),
        seat_height=float(rng.uniform(0.43, 0.48)),
        height=float(rng.uniform(0.82, 0.9) if director else rng.uniform(0.76, 0.86)),
        slats=int(rng.integers(5, 10)),
        back_slats=int(rng.integers(1, 5)),
        padded=padded,
        metal=None
        if metal < 0.4
        else drawn_color(((0.09, 0.09, 0.095), (0.5, 0.51, 0.53), (0.88, 0.87, 0.84), (0.35, 0.22, 0.15)), rng),
        shell=drawn_color(((0.1, 0.1, 0.105), (0.3, 0.3, 0.31), (0.6, 0.56, 0.48)) if padded else PLASTICS, rng),
        wood=drawn_wood(rng, 0.35 if kind == "slatted" else 0.2),
        cover=drawn_cover(rng, 0.0 if director else 0.5),
    )
