"""Armchairs: upholstered all over, wrapped around like a tub, or loose cushions in a wooden frame."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from viewsphere_zoo.joinery.coats import BRASS, WOODS, Cover, drawn_cover, drawn_wood, timber
from viewsphere_zoo.joinery.members import bar, hoop, line, spindle
from viewsphere_zoo.joinery.slabs import Height, box_outline, crowned, cushion, leaning, level, on, polygon, seam, slab
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import Color
from viewsphere_zoo.shapes.panels import Surface
from viewsphere_zoo.shapes.rods import across
from viewsphere_zoo.shapes.solids import (
    Float,
    Solid,
    both_sides,
    curve,
    join,
    lathe,
    loft,
    moved,
    rounded_box,
    superellipse,
)

Body = Literal["track", "rolled", "sloped", "wing", "tub", "wood"]
Feet = Literal["tapered", "block", "bun", "metal"]


@dataclass(frozen=True)
class Armchair:
    """Parameters of an armchair; lengths in metres.

    body: straight, rolled or sloping arms, a wing chair, a tub whose back continues into its arms, or a wooden frame; arm: an
    arm's thickness; arm_height: height of its top; lean: run of the back to the rear per metre; buttons: columns of tufts in
    the back.
    """

    width: float = 0.8
    depth: float = 0.82
    seat_height: float = 0.44
    height: float = 0.86
    body: Body = "track"
    arm: float = 0.13
    arm_height: float = 0.61
    lean: float = 0.2
    feet: Feet = "tapered"
    foot: float = 0.13
    buttons: int = 0
    piping: bool = True
    wood: Color = WOODS["walnut"]
    cover: Cover = field(default_factory=Cover)
    seat_cover: Cover | None = None

    @property
    def inner(self) -> float:
        """Half the width between the arms."""
        return self.width / 2 - self.arm

    @property
    def back_foot(self) -> float:
        """y of the back's front where the seat cushion meets it."""
        return self.depth / 2 - 0.13 - self.lean * (self.height - self.seat_height)


def pieces(p: Armchair) -> list[Piece]:
    """Return the pieces of an armchair; feet on z = 0."""
    if p.body == "wood":
        return [*_wood_frame(p), *_loose_cushions(p)]
    body = _tub(p) if p.body == "tub" else [*_base(p), *_upholstered_arms(p), *_back(p)]
    return [*body, *_seat_cushion(p), *_feet(p)]


def _feet(p: Armchair) -> list[Piece]:
    """Four feet under the base."""
    wood, z = timber(p.wood)[0], p.foot + 0.02
    x, front, rear = p.width / 2 - (0.13 if p.body == "rolled" else 0.075), -p.depth / 2 + 0.1, p.depth / 2 - 0.16
    if p.body == "tub":
        x, front, rear = p.width / 2 - 0.2, -p.depth / 2 + 0.19, p.depth / 2 - 0.2
    feet = []
    for y, away in ((front, -1), (rear, 1)):
        if p.feet == "block":
            feet.append(moved(rounded_box((0.06, 0.06, z), 0.004, 3), (x, y, z / 2)))
        elif p.feet == "bun":
            bun = [(0, 0.022), (0.06, 0.03), (0.25, 0.04), (0.45, 0.042), (0.65, 0.036), (0.75, 0.024), (0.82, 0.03), (1, 0.03)]
            feet.append(spindle((x, y, 0), (x, y, z), bun, 28))
        else:
            slant = 0.22 * p.foot
            thin = 0.6 if p.feet == "metal" else 1.0
            shape = [(0, 0.0115 * thin), (0.03, 0.0135 * thin), (1, 0.024 * thin)]
            feet.append(spindle((x + slant, y + away * slant, 0), (x, y, z), shape, 24))
    coat = BRASS if p.feet == "metal" else wood
    return [Piece("foot", coat, both_sides(join(*feet)))]


def _base(p: Armchair) -> list[Piece]:
    """The box under the cushion."""
    top = p.seat_height - 0.12
    box = rounded_box((2 * p.inner + 0.04, p.depth - 0.14, top - p.foot), 0.022, 4)
    return [Piece("base", p.cover.material, moved(box, (0, -0.03, (top + p.foot) / 2)))]


def _seat_cushion(p: Armchair) -> list[Piece]:
    """A thick loose cushion between the arms."""
    cover = p.seat_cover or p.cover
    x = p.inner + (0.004 if p.body != "tub" else -0.012)
    front, rear = -p.depth / 2 + (0.015 if p.body != "tub" else 0.05), p.back_foot + 0.035
    corners = [(-x, front), (-0.5 * x, front - 0.012), (0.5 * x, front - 0.012), (x, front), (x, rear), (-x, rear)]
    if p.body == "tub":
        wall = superellipse(x + 0.02, p.depth / 2 - p.arm + 0.01, 2.3, 56)
        corners = [(f * x, front - 0.025 * (1 - f * f)) for f in (-0.78, -0.4, 0.0, 0.4, 0.78)]
        corners += [*wall[wall[:, 1] > 0.02].tolist()]
    outline = polygon(corners, 0.06, 0.025)
    body, edge = cushion(outline, 0.135, 0.026, 0.034, 9)
    lift = (0, 0, p.seat_height - 0.148)
    found = [Piece("seat_cushion", cover.material, moved(body, lift))]
    return [*found, Piece("seat_cushion", cover.piping, moved(edge, lift))] if p.piping else found


def _upholstered_arms(p: Armchair) -> list[Piece]:
    """The arms, left and right alike."""
    x, low = p.inner + p.arm / 2, p.foot + 0.004
    front, rear = -p.depth / 2 + 0.035, p.depth / 2 - 0.1
    if p.body == "rolled":
        arm = _rolled(p, low, front, rear)
        return [Piece("armrest", p.cover.material, both_sides(arm[0])), Piece("armrest", p.cover.piping, both_sides(arm[1]))]
    drop = {"sloped": 0.1, "wing": 0.02}.get(p.body, 0.0)
    y = np.linspace(front, rear, 15)
    top = p.arm_height - drop * ((rear - y) / (rear - front)) ** 1.3
    arm = bar(
        np.column_stack([np.full(15, x), y, (top + low) / 2]),
        np.stack([top - low, np.full(15, p.arm)], axis=1),
        0.034,
        (0, 0, 1),
        5,
    )
    found = [Piece("armrest", p.cover.material, both_sides(arm))]
    if p.piping:
        found.append(Piece("armrest", p.cover.piping, both_sides(_front_seam(x, front, float(low), float(top[0]), p.arm))))
    return found


def _front_seam(x: float, y: float, low: float, top: float, wide: float) -> Solid:
    """Piping around the front face of an arm."""
    inset = 0.026
    xz = box_outline(wide - inset, top - low - inset, 0.03, middle=(x, (top + low) / 2))
    return hoop(np.column_stack([xz[:, 0], np.full(len(xz), y + 0.006), xz[:, 1]]), 0.004, (0, 1, 0))


def _rolled(p: Armchair, low: float, front: float, rear: float) -> tuple[Solid, Solid]:
    """An arm whose top is a roll that overhangs outwards, and the piping of its front."""
    r = 0.075
    cx, cz = p.width / 2 - r, p.arm_height - r
    wall = cx - 0.02
    a = np.linspace(-0.585, 1.1, 26) * np.pi
    roll = np.column_stack([cx + r * np.cos(a), cz + r * np.sin(a)])
    foot = np.array([(p.inner - 0.01, low), (wall, low), (wall, (low + cz) / 2)])
    xz = np.vstack([foot, roll, [(p.inner - 0.01, (low + cz) / 2)]])[::-1]
    y = np.array([front, front, front + 0.006, front + 0.02, *np.linspace(front + 0.08, rear, 6), rear])
    heart = np.array([wall - 0.012, cz - 0.06])  # a point from which the whole outline is visible
    size = np.array([0, 0.93, 0.975, 1, *np.ones(6), 0])[:, None, None]
    plan = heart + (xz - heart) * size
    rings = np.dstack([plan[..., 0], np.broadcast_to(y[:, None], plan.shape[:2]), plan[..., 1]])
    edge = np.column_stack([plan[2][:, 0], np.full(len(xz), front + 0.004), plan[2][:, 1]])
    return loft(rings, (False, False)), hoop(edge, 0.004, (0, 1, 0))


def _back_surface(p: Armchair) -> Surface:
    """The middle of the back, from the seat upwards."""
    return leaning(
        p.back_foot + 0.085, p.seat_height - 0.14, p.lean, 0.0 if p.body != "wing" else 0.12, 0.012, p.height - p.seat_height
    )


def _back(p: Armchair) -> list[Piece]:
    """The back, tufted or with a loose cushion in front of it, and wings."""
    surface, rise = _back_surface(p), np.sqrt(1 + p.lean**2)
    span = (p.height - p.seat_height + 0.13) * rise - 0.02
    x = p.width / 2 - (0.012 if p.body != "wing" else 0.05)
    if p.body in ("rolled", "sloped"):
        x = p.inner + 0.035
    crown = 0.03 if p.body in ("wing", "rolled") else 0.012
    outline = polygon([(-x, 0), (x, 0), (x, span - crown), (0.5 * x, span), (-0.5 * x, span), (-x, span - crown)], 0.06, 0.03)
    front: Height = crowned(outline, 0.06, 0.016)
    found: list[Piece] = []
    if p.buttons:
        front, spots = _tufted(outline, front, p.buttons, span)
        dome = lathe([(0, -0.004), (0.009, -0.004), (0.011, 0.0), (0.009, 0.005), (0.005, 0.007), (0, 0.0075)], 16)
        buttons = [moved(dome, (u, v, float(front(np.array(u), np.array(v))))) for u, v in spots]
        found.append(Piece("button", p.cover.piping, on(surface, join(*buttons))))
    back = slab(outline, crowned(outline, -0.06, -0.01), front, 0.045, 26 if p.buttons else 9, 5)
    found.append(Piece("back", p.cover.material, on(surface, back)))
    if p.piping:
        edges = join(seam(outline, front, 0.045), seam(outline, crowned(outline, -0.06, -0.01), 0.045, up=False))
        found.append(Piece("back", p.cover.piping, on(surface, edges)))
    if not p.buttons:
        found += _back_cushion(p, surface, span)
    return found + (_wings(p) if p.body == "wing" else [])


def _tufted(outline: Float, face: Height, columns: int, span: float) -> tuple[Height, list[tuple[float, float]]]:
    """The face drawn in at staggered buttons, and the buttons' places."""
    x = float(outline[:, 0].max())
    step = 2 * x / (columns + 0.6)
    rows = np.arange(0.24, span - 0.06, 0.85 * step)
    spots = [((k - (columns - 1 - i % 2) / 2) * step, float(v)) for i, v in enumerate(rows) for k in range(columns - i % 2)]

    def drawn(u: Float, v: Float) -> Float:
        depth = np.zeros_like(u)
        for a, b in spots:
            d = np.hypot(u - a, v - b) / step
            depth = np.maximum(depth, np.exp(-((d / 0.2) ** 2)) + 0.35 * np.exp(-((d / 0.42) ** 2)))
        return face(u, v) + 0.012 - 0.02 * np.minimum(depth, 1)

    return drawn, spots


def _back_cushion(p: Armchair, surface: Surface, span: float) -> list[Piece]:
    """A loose cushion that leans on the back."""
    cover, x = p.seat_cover or p.cover, p.inner - 0.004
    bottom = 0.115
    outline = polygon([(-x, bottom), (x, bottom), (x, span + 0.005), (-x, span + 0.005)], 0.07, 0.025)
    top = crowned(outline, 0.14, 0.035)
    pad = slab(outline, level(0.05), top, 0.044, 10, 6)
    found = [Piece("back_cushion", cover.material, on(surface, pad))]
    return [*found, Piece("back_cushion", cover.piping, on(surface, seam(outline, top, 0.044)))] if p.piping else found


def _wings(p: Armchair) -> list[Piece]:
    """Ears at both sides of the back, down to the arms."""
    low, high = p.arm_height - 0.06, p.height - 0.01
    foot, head = (p.back_foot + 0.12 + p.lean * (z - p.seat_height) for z in (low, high))
    brow = high - 0.1
    corners = [(foot, low), (foot - 0.3, low), (foot - 0.27, low + 0.08), (foot - 0.21, (low + high) / 2), (head - 0.27, brow)]
    plan = polygon([*corners, (head - 0.2, high), (head, high)][::-1], 0.05, 0.025)
    ear = across(slab(plan, level(-0.031), level(0.031), 0.029, 6, 5))
    ear.vertices[:, 0] += p.width / 2 - 0.06 + 0.03 * np.clip(ear.vertices[:, 2] - p.arm_height, 0, None)
    return [Piece("wing", p.cover.material, both_sides(ear))]


def _tub(p: Armchair) -> list[Piece]:
    """A wall that runs around from arm to arm, higher behind, on a round base."""
    t = np.linspace(-1, 1, 57)
    a = t * 0.8 * np.pi
    x, y = p.width / 2 - p.arm / 2, p.depth / 2 - p.arm / 2
    plan = np.column_stack([x * np.sin(a), y * np.cos(a)])
    plan /= (np.abs(plan[:, :1] / x) ** 2.3 + np.abs(plan[:, 1:] / y) ** 2.3) ** (1 / 2.3)
    fall = [(0.3, p.height - 0.015), (0.65, p.arm_height + 0.03), (1.0, p.arm_height - 0.03)]
    top = curve(t, [*((-a, z) for a, z in fall[::-1]), (0.0, p.height), *fall])
    low = p.foot + 0.01
    middle = np.column_stack([plan, (top + low) / 2])
    wall = bar(middle, np.stack([top - low, np.full(57, p.arm)], axis=1), 0.045, (0, 0, 1), 6)
    wall = Solid(wall.vertices + _flare(wall.vertices, p), wall.triangles)
    base = slab(superellipse(0.98 * x, 0.98 * y, 2.3, 64), level(p.foot), level(p.seat_height - 0.13), 0.02, 4)
    return [Piece("back", p.cover.material, wall), Piece("base", p.cover.material, base)]


def _flare(points: Float, p: Armchair) -> Float:
    """Return the outward lean of points on a tub's wall."""
    up = np.clip((points[:, 2] - p.seat_height) / 0.4, 0, 1)[:, None]
    plan = points[:, :2] / np.linalg.norm(points[:, :2], axis=1, keepdims=True)
    return np.column_stack([0.05 * up * plan, np.zeros(len(points))])


def _wood_frame(p: Armchair) -> list[Piece]:
    """Legs, arms, rails and a slatted back of wood."""
    wood = timber(p.wood)
    x, front, rear = p.width / 2 - 0.03, -p.depth / 2 + 0.09, p.depth / 2 - 0.2
    seat, arm = p.seat_height - 0.15, p.arm_height - 0.02
    shape = [(0, 0.013), (0.55, 0.021), (0.8, 0.018), (1, 0.015)]
    legs = [spindle((x, front - 0.02, 0), (x, front + 0.03, arm), shape, 20)]
    legs.append(spindle((x, rear + 0.09, 0), (x, rear + 0.01, arm - 0.03), shape, 20))
    share = np.linspace(0, 1, 17)
    path = np.column_stack(
        [x + 0.012 * np.sin(np.pi * share), front - 0.05 + share * (rear + 0.15 - front), arm + 0.004 - 0.035 * share**1.5]
    )
    wide = curve(share, [(0, 0.05), (0.12, 0.075), (0.5, 0.06), (1, 0.035)])
    rest = bar(path, np.stack([wide, np.full(17, 0.024)], axis=1), 0.01, (1, 0, 0), 4)
    side = bar(line((x, front, seat + 0.01), (x, rear + 0.07, seat - 0.045)), (0.06, 0.022), 0.006, (0, 0, 1))
    rails = [
        bar(line((-x, y, z), (x, y, z)), (0.055, 0.022), 0.006, (0, 0, 1))
        for y, z in ((front + 0.005, seat + 0.005), (rear + 0.055, seat - 0.04))
    ]
    surface, tall = _back_surface(p), (p.height - p.seat_height + 0.11) * np.sqrt(1 + p.lean**2)
    stiles = bar(_upwards(surface, p.inner - 0.01, -0.02, tall), (0.036, 0.024), 0.007, (1, 0, 0))
    slats = [
        bar(_upwards(surface, u, 0.0, tall - 0.02), (0.03, 0.012), 0.004, (1, 0, 0))
        for u in np.linspace(-0.8, 0.8, 7) * (p.inner - 0.02)
    ]
    rungs = [
        on(surface, moved(rounded_box((2 * p.inner, h, 0.02), 0.007, 3), (0, v, 0.0)))
        for v, h in ((tall - 0.03, 0.06), (0.012, 0.05))
    ]
    reach = p.inner
    pegs = bar(
        line((reach - 0.02, p.back_foot + 0.085 + 0.02, seat - 0.02), (x, p.back_foot + 0.1, seat - 0.02)),
        (0.03, 0.02),
        0.006,
        (0, 0, 1),
    )
    webs = [
        bar(line((-x, y, z), (x, y, z)), (0.05, 0.008), 0.003, (0, 1, 0))
        for y in np.linspace(front + 0.08, rear - 0.02, 5)
        for z in [seat + 0.012 - 0.05 * (y - front) / (rear - front)]
    ]
    return [
        Piece("leg", wood[0], both_sides(join(*legs))),
        Piece("armrest", wood[1], both_sides(rest)),
        Piece("frame", wood[0], join(both_sides(side), *rails, both_sides(stiles), *rungs, both_sides(pegs))),
        Piece("back_slat", wood[2], join(*slats)),
        Piece("seat_slat", wood[2], join(*webs)),
    ]


def _upwards(surface: Surface, u: float, low: float, high: float) -> Float:
    """A path up the back."""
    v = np.linspace(low, high, 11)
    return surface(np.full(11, u), v)


def _loose_cushions(p: Armchair) -> list[Piece]:
    """Seat and back cushion of the wooden frame."""
    cover, x = p.seat_cover or p.cover, p.inner + 0.035
    front, rear = -p.depth / 2 + 0.06, p.back_foot + 0.06
    tilt = 0.11
    base = p.seat_height - 0.15
    outline = polygon([(-x, front), (x, front), (x, rear), (-x, rear)], 0.045, 0.025)
    body, edge = cushion(outline, 0.11, 0.022, 0.03, 8)

    def sloping(u: Float, v: Float) -> Float:
        return np.stack([u, v, base + 0.027 - tilt * (v - front)], axis=-1)

    surface, span = _back_surface(p), (p.height - p.seat_height + 0.11) * np.sqrt(1 + p.lean**2)
    back = polygon([(-x, 0.13), (x, 0.13), (x, span + 0.01), (-x, span + 0.01)], 0.045, 0.025)
    leaned, leaned_edge = cushion(back, 0.11, 0.026, 0.03, 8)
    lift = (0, 0, 0.015)
    found = [
        Piece("seat_cushion", cover.material, on(sloping, body)),
        Piece("back_cushion", cover.material, on(surface, moved(leaned, lift))),
    ]
    if p.piping:
        found += [
            Piece("seat_cushion", cover.piping, on(sloping, edge)),
            Piece("back_cushion", cover.piping, on(surface, moved(leaned_edge, lift))),
        ]
    return found


def draw(rng: np.random.Generator) -> Armchair:
    """A random armchair."""
    body: Body = ("track", "rolled", "sloped", "wing", "tub", "wood")[int(rng.integers(6))]
    tall = {"wing": (0.98, 1.12), "tub": (0.72, 0.8), "wood": (0.78, 0.88)}.get(body, (0.8, 0.92))
    wide = {"tub": (0.7, 0.8), "wood": (0.64, 0.72), "wing": (0.74, 0.84)}.get(body, (0.74, 0.94))
    arm = {"tub": (0.085, 0.12), "wood": (0.05, 0.06), "wing": (0.1, 0.12), "rolled": (0.13, 0.16)}.get(body, (0.1, 0.18))
    deep = (0.7, 0.78) if body == "tub" else (0.76, 0.88)
    cover = drawn_cover(rng, 0.35)
    feet: Feet = ("tapered", "block", "bun", "metal")[int(rng.integers(4))]
    return Armchair(
        width=float(rng.uniform(*wide)),
        depth=float(rng.uniform(*deep)),
        seat_height=float(rng.uniform(0.42, 0.46)),
        height=float(rng.uniform(*tall)),
        body=body,
        arm=float(rng.uniform(*arm)),
        arm_height=float(rng.uniform(0.57, 0.65)),
        lean=float(rng.uniform(0.34, 0.46) if body == "wood" else rng.uniform(0.12, 0.26)),
        feet=feet,
        foot=float(rng.uniform(0.06, 0.09 if feet == "bun" else 0.17)),
        buttons=int(rng.integers(3, 6)) if body in ("rolled", "wing", "sloped") and rng.random() < 0.6 else 0,
        piping=bool(rng.random() < 0.7),
        wood=drawn_wood(rng, 0.08),
        cover=cover,
        seat_cover=drawn_cover(rng, 0.1) if rng.random() < 0.15 else None,
    )
