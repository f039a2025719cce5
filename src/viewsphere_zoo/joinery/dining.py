"""Dining chairs with four posts: the rear legs continue up into the back."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from viewsphere.assets.mesh import Material
from viewsphere_zoo.joinery.coats import WOODS, Cover, drawn_cover, drawn_wood, timber
from viewsphere_zoo.joinery.members import bar, hoop, line, spindle
from viewsphere_zoo.joinery.slabs import crowned, level, on, polygon, seam, slab
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import Color
from viewsphere_zoo.shapes.solids import Float, Solid, both_sides, curve, join

Back = Literal["slats", "ladder", "cross", "splat", "padded"]
Legs = Literal["square", "tapered", "turned"]
Seat = Literal["wood", "padded", "rush"]
Stretchers = Literal["none", "sides", "box", "h"]

_TURNED = ((0.0, 0.011), (0.02, 0.014), (0.1, 0.012), (0.16, 0.018), (0.19, 0.014), (0.22, 0.018), (0.25, 0.014))
_TURNED_TOP = ((0.5, 0.017), (0.7, 0.021), (0.74, 0.015), (0.77, 0.021), (0.8, 0.016), (1.0, 0.016))


@dataclass(frozen=True)
class Dining:
    """Parameters of a wooden dining chair; lengths in metres.

    width: of the seat at its front; taper: the seat's width at its rear as a fraction of `width`; rungs: slats or rungs in the
    back; rake: how far the top of the back is behind its foot; hollow: how far the middle of the rails bows to the rear;
    arch: rise of the crest rail in its middle; cover: of a padded seat or back.
    """

    width: float = 0.45
    depth: float = 0.43
    seat_height: float = 0.45
    height: float = 0.88
    taper: float = 0.88
    back: Back = "slats"
    rungs: int = 5
    legs: Legs = "tapered"
    seat: Seat = "wood"
    stretchers: Stretchers = "sides"
    arms: bool = False
    rake: float = 0.09
    hollow: float = 0.02
    arch: float = 0.02
    wood: Color = WOODS["oak"]
    cover: Cover = field(default_factory=Cover)

    @property
    def front(self) -> tuple[float, float]:
        """x (positive) and y of the front legs."""
        return self.width / 2 - 0.03, -self.depth / 2 + 0.03

    @property
    def rear(self) -> tuple[float, float]:
        """x (positive) and y of the rear posts at the seat."""
        return self.taper * self.width / 2 - 0.018, self.depth / 2 - 0.02

    @property
    def under(self) -> float:
        """Height of the top of legs and aprons."""
        return self.seat_height - {"wood": 0.022, "padded": 0.05, "rush": -0.004}[self.seat]

    def post(self, z: ArrayLike) -> Float:
        """y of the rear posts at these heights."""
        y = self.rear[1]
        return curve(
            z, [(0, y + 0.05), (self.seat_height - 0.08, y), (self.seat_height + 0.06, y), (self.height, y + self.rake)]
        )

    def across(self, z: float, arch: float) -> Float:
        """The path of a rail of the back at this height, from right to left."""
        side = np.linspace(-1, 1, 13)
        bow = 1 - side**2
        up = min(1.0, (z - self.seat_height) / 0.25)
        return np.column_stack([side * self.rear[0], self.post(z) + self.hollow * up * bow, z + arch * bow])

    def lean(self, z: float) -> tuple[float, float, float]:
        """The direction of the posts at this height."""
        return 0.0, float(self.post(z + 0.01) - self.post(z - 0.01)) / 0.02, 1.0

    @property
    def extent(self) -> tuple[float, float, float]:
        """Greatest width, depth and height of the whole model, metres."""
        return self.width + 0.07, self.depth + 0.19, self.height + 0.05


def pieces(p: Dining) -> list[Piece]:
    """Return the pieces of a dining chair; feet on z = 0, left and right alike."""
    wood = timber(p.wood)
    return [*_legs(p, wood), *_aprons(p, wood), *_seat(p, wood), *_stretchers(p, wood), *_back(p, wood), *_arms(p, wood)]


def _legs(p: Dining, wood: tuple[Material, ...]) -> list[Piece]:
    """Front legs and rear posts."""
    x, y = p.front
    top = p.under - 0.002
    if p.legs == "turned":
        block = bar(line((x, y, 0.8 * top), (x, y, top)), (0.042, 0.042), 0.003, (1, 0, 0))
        leg = join(spindle((x, y, 0), (x, y, 0.82 * top), [(f, 1.05 * r) for f, r in (*_TURNED, *_TURNED_TOP)]), block)
    else:
        foot = 0.038 if p.legs == "square" else 0.025
        size = np.linspace(foot, 0.04, 5)
        leg = bar(line((x, y, 0), (x, y, top), 5), np.stack([size, size], axis=1), 0.005, (1, 0, 0))
    z = np.linspace(0, p.height, 22)
    deep = curve(z, [(0, 0.028), (p.seat_height - 0.05, 0.042), (p.seat_height + 0.05, 0.038), (p.height, 0.024)])
    wide = curve(z, [(0, 0.028), (p.seat_height - 0.1, 0.036), (p.height, 0.03)])
    post = bar(np.column_stack([np.full(22, p.rear[0]), p.post(z), z]), np.stack([wide, deep], axis=1), 0.008, (1, 0, 0))
    return [Piece("leg_front", wood[0], both_sides(leg)), Piece("leg_rear", wood[0], both_sides(post))]


def _aprons(p: Dining, wood: tuple[Material, ...]) -> list[Piece]:
    """The rails under the seat; a woven seat has its own."""
    if p.seat == "rush":
        return []
    (xf, yf), (xr, yr) = p.front, p.rear
    z, size = p.under - 0.036, (0.06, 0.02)
    front, rear = (bar(line((-x, y, z), (x, y, z)), size, 0.003, (0, 0, 1)) for x, y in ((xf, yf), (xr, yr)))
    side = bar(line((xf, yf, z), (xr, yr, z)), size, 0.003, (0, 0, 1))
    return [Piece("apron", wood[2], join(front, rear, both_sides(side)))]


def _outline(p: Dining, over: float) -> Float:
    """The seat's plan; `over` is how far it stands beyond the front legs."""
    x, xr = p.front[0] + 0.03 + over, p.rear[0] + 0.018 + 0.5 * over
    front, rear = p.front[1] - 0.03 - over, p.rear[1] + 0.004
    return polygon(
        [(-x, front), (-0.4 * x, front - 0.008), (0.4 * x, front - 0.008), (x, front), (xr, rear), (-xr, rear)], 0.035
    )


def _seat(p: Dining, wood: tuple[Material, ...]) -> list[Piece]:
    """Sawn and hollowed, upholstered, or woven of rush."""
    h = p.seat_height
    if p.seat == "rush":
        return _rush(p, wood)
    outline = _outline(p, 0.008)
    if p.seat == "wood":
        return [Piece("seat", wood[1], slab(outline, level(p.under), crowned(outline, h, -0.009), 0.008, 6))]
    board = slab(outline, level(p.under - 0.001), level(p.under + 0.016), 0.005, 1)
    pad = _outline(p, 0.005)
    top = crowned(pad, h - 0.004, 0.016)
    return [
        Piece("seat", wood[0], board),
        Piece("seat_pad", p.cover.material, slab(pad, level(p.under + 0.012), top, 0.024, 7)),
        Piece("seat_pad", p.cover.piping, seam(pad, level(p.under + 0.02), 0.0, 0.0035)),
    ]


def _rush(p: Dining, wood: tuple[Material, ...]) -> list[Piece]:
    """Cords wound from rail to rail in nested frames."""
    straw = Cover((0.74, 0.6, 0.36)).material
    (xf, yf), (xr, yr) = p.front, p.rear
    z, count = p.seat_height - 0.012, 16
    corners = np.array([(-xf, yf), (xf, yf), (xr, yr), (-xr, yr)]) * (1.05, 1.05)
    middle = corners.mean(axis=0)
    step = 0.5 * float(np.ptp(corners[:, 0])) / count
    cords = []
    for k in range(count):
        share = 1 - (k + 0.3) / count
        ring = middle + (corners - middle) * share
        sides = [
            a + (b - a) * np.linspace(0, 1, 6, endpoint=False)[:, None] for a, b in zip(ring, np.roll(ring, -1, 0), strict=True)
        ]
        sag = np.tile([-0.003, 0, 0.002, 0.002, 0.002, 0], 4) - 0.006 * (1 - share)
        cords.append(hoop(np.column_stack([np.concatenate(sides), z + sag]), 0.56 * step, sides=6))
    rails = [line((-x, y, z), (x, y, z)) for x, y in ((xf, yf), (xr, yr))]
    rail = join(*(bar(r, (0.03, 0.02), 0.009, (0, 1, 0)) for r in (*rails, line((xf, yf, z), (xr, yr, z)))))
    return [Piece("seat", straw, join(*cords)), Piece("seat", wood[0], both_sides(rail))]


def _stretchers(p: Dining, wood: tuple[Material, ...]) -> list[Piece]:
    """Rails between the legs."""
    if p.stretchers == "none":
        return []
    (xf, yf), (xr, _) = p.front, p.rear
    low, high = 0.13, 0.2

    def rail(a: ArrayLike, b: ArrayLike) -> list[Piece]:
        """A rail between two points: turned if the legs are turned, else sawn."""
        if p.legs == "turned":
            return [
                Piece("stretcher", wood[0], spindle(a, b, [(0, 0.008), (0.3, 0.011), (0.5, 0.015), (0.7, 0.011), (1, 0.008)]))
            ]
        return [Piece("stretcher", wood[0], bar(line(a, b), (0.026, 0.016), 0.004, (0, 0, 1)))]

    found = [r for s in (-1, 1) for r in rail((s * xf, yf, low), (s * xr, float(p.post(low)), low))]
    if p.stretchers == "box":
        found += rail((-xf, yf, high), (xf, yf, high)) + rail((-xr, float(p.post(high)), high), (xr, float(p.post(high)), high))
    if p.stretchers == "h":
        x, y = (xf + xr) / 2, (yf + float(p.post(low))) / 2
        found += rail((-x, y, low), (x, y, low))
    return found


def _back(p: Dining, wood: tuple[Material, ...]) -> list[Piece]:
    """The slats, rungs or boards between the posts."""
    if p.back == "padded":
        return _padded(p, wood)
    if p.back == "ladder":
        low, high = p.seat_height + 0.13, p.height - 0.055
        rungs = np.linspace(low, high, min(p.rungs, 1 + int((high - low) / 0.088)))
        return [Piece("back_rung", wood[k % 3], _rail(p, float(z), 0.052, 0.016, p.arch)) for k, z in enumerate(rungs)]
    bottom, top = p.seat_height + (0.14 if p.back == "cross" else 0.1), p.height - 0.045
    found = [
        Piece("crest_rail", wood[0], _rail(p, top, 0.075, 0.024, p.arch)),
        Piece("back_rail", wood[0], _rail(p, bottom, 0.036, 0.02, 0.0)),
    ]
    if p.back == "slats":
        count = p.rungs
        wide = min(0.05, 1.2 * p.rear[0] / count)
        at = (np.arange(count) - (count - 1) / 2) * 2 * p.rear[0] / (count + 0.4)
        return found + [
            Piece("back_slat", wood[1 + k % 2], _upright(p, (x, bottom), (x, top), (wide, wide), 0.012))
            for k, x in enumerate(at)
        ]
    if p.back == "cross":
        x = p.rear[0] - 0.01
        ends = ((-x, bottom), (x, top)), ((x, bottom), (-x, top))
        arms = [_upright(p, a, b, (0.032, 0.032), t) for (a, b), t in zip(ends, (0.014, 0.017), strict=True)]
        return [*found, Piece("back_slat", wood[1], join(*arms))]
    vase = ((0, 0.11), (0.15, 0.08), (0.35, 0.12), (0.62, 0.17), (0.85, 0.11), (1, 0.14))
    widths = tuple(curve(np.linspace(0, 1, 21), vase).tolist())
    return [*found, Piece("back_splat", wood[1], _upright(p, (0, bottom), (0, top), widths, 0.012))]


def _rail(p: Dining, z: float, high: float, thick: float, arch: float) -> Solid:
    """A curved rail between the posts, higher in its middle."""
    bow = 1 - np.linspace(-1, 1, 13) ** 2
    size = np.stack([high + arch * bow, np.full(13, thick)], axis=1)
    return bar(p.across(z, arch / 2), size, 0.006, p.lean(z))


def _upright(
    p: Dining, start: tuple[float, float], stop: tuple[float, float], widths: tuple[float, ...], thick: float
) -> Solid:
    """A board of the back from one (x, z) to another, bent as the back is; widths from below upwards."""
    count = max(11, len(widths))
    share = np.linspace(0, 1, count)
    x, z = (a + share * (b - a) for a, b in zip(start, stop, strict=True))
    bow = p.hollow * (1 - (x / p.rear[0]) ** 2) * np.clip((z - p.seat_height) / 0.25, 0, 1)
    width = np.interp(share, np.linspace(0, 1, len(widths)), widths)
    slope = np.array(stop) - start
    return bar(
        np.column_stack([x, p.post(z) + bow, z]),
        np.stack([width, np.full(count, thick)], axis=1),
        0.004,
        (slope[1], 0, -slope[0]),
    )


def _padded(p: Dining, wood: tuple[Material, ...]) -> list[Piece]:
    """An upholstered back over the posts, and a rail below it."""
    bottom = p.seat_height + (0.02 if p.rungs > 5 else 0.15)
    span = p.height + 0.012 - bottom
    x = p.rear[0] + 0.022
    crest = [(s * x, span + p.arch * (1 - s * s)) for s in (0.75, 0.5, 0.25, 0, -0.25, -0.5, -0.75)]
    outline = polygon([(-x, 0), (x, 0), (x, span), *crest, (-x, span)], 0.03, 0.035)

    def surface(u: Float, v: Float) -> Float:
        z = bottom + v
        return np.stack([u, p.post(z) + p.hollow * (1 - (u / x) ** 2), z], axis=-1)

    faces = crowned(outline, -0.03, -0.006), crowned(outline, 0.03, 0.014)
    pad = slab(outline, *faces, 0.022, 8)
    edge = join(seam(outline, faces[1], 0.022), seam(outline, faces[0], 0.022, up=False))
    return [
        Piece("back_pad", p.cover.material, on(surface, pad)),
        Piece("back_pad", p.cover.piping, on(surface, edge)),
        Piece("back_rail", wood[0], _rail(p, bottom + 0.02, 0.04, 0.02, 0.0)),
    ]


def _arms(p: Dining, wood: tuple[Material, ...]) -> list[Piece]:
    """Armrests from the posts to a support on each side rail."""
    if not p.arms:
        return []
    z, (xf, yf), (xr, _) = p.seat_height + 0.2, p.front, p.rear
    front = yf + 0.05
    share = np.linspace(0, 1, 15)
    x = curve(share, [(0, xr), (0.3, xr + 0.03), (0.75, xf + 0.04), (1, xf + 0.035)])
    y = float(p.post(z)) + share * (front - float(p.post(z)))
    path = np.column_stack([x, y, z + 0.012 * np.sin(np.pi * share) - 0.01 * share])
    width = curve(share, [(0, 0.026), (0.5, 0.036), (0.85, 0.05), (1, 0.044)])
    rest = bar(path, np.stack([width, np.full(15, 0.022)], axis=1), 0.009, (1, 0, 0))
    foot = (xf - 0.004, front + 0.05, p.under - 0.04)
    support = bar(
        [foot, (xf + 0.02, front + 0.045, p.seat_height + 0.06), (xf + 0.035, front + 0.03, z - 0.006)],
        (0.026, 0.032),
        0.008,
        (1, 0, 0),
    )
    return [Piece("armrest", wood[0], both_sides(rest)), Piece("armrest", wood[0], both_sides(support))]


def draw(rng: np.random.Generator) -> Dining:
    """A random dining chair with posts."""
    back: Back = ("slats", "ladder", "cross", "splat", "padded")[int(rng.choice(5, p=(0.26, 0.24, 0.14, 0.12, 0.24)))]
    legs: Legs = ("square", "tapered", "turned")[int(rng.integers(3))]
    seats: tuple[Seat, ...] = (
        ("padded",) if back == "padded" else ("wood", "padded", "rush") if back == "ladder" else ("wood", "padded")
    )
    seat = seats[int(rng.integers(len(seats)))]
    size = float(rng.uniform())
    return Dining(
        width=0.42 + 0.07 * size,
        depth=0.4 + 0.05 * size,
        seat_height=float(rng.uniform(0.43, 0.475)),
        height=float(rng.uniform(0.82, 0.9) if back == "cross" else rng.uniform(0.84, 1.08)),
        taper=float(rng.uniform(0.84, 0.98)),
        back=back,
        rungs=int(rng.integers(3, 9)),
        legs=legs,
        seat=seat,
        stretchers=("none", "sides", "box", "h")[int(rng.integers(4))],
        arms=bool(rng.random() < 0.22),
        rake=float(rng.uniform(0.06, 0.13)),
        hollow=float(rng.uniform(0.008, 0.035)),
        arch=float(rng.choice((0.0, 0.02, 0.035))),
        wood=drawn_wood(rng),
        cover=drawn_cover(rng),
    )
