"""Fittings: cleats, railings, wheels, seats, lights, fenders, a flag."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from viewsphere.assets.mesh import Material
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import Color, linear
from viewsphere_zoo.shapes.rods import aimed, rod, smooth
from viewsphere_zoo.shapes.sheets import sheet
from viewsphere_zoo.shapes.solids import Float, Solid, join, lathe, moved, rounded_box, tube, turned
from viewsphere_zoo.shipyard.coats import Coats
from viewsphere_zoo.shipyard.shell import Deck, pair

Flag = tuple[Color, Color, Color]
"""Stripes of a flag, from the lowest to the highest."""


def cleat(size: float = 0.2) -> Solid:
    """A horn cleat along y."""
    arm = np.array([(0, -0.5, 0.3), (0, -0.3, 0.26), (0, 0, 0.24), (0, 0.3, 0.26), (0, 0.5, 0.3)]) * size
    feet = [rod((0, a * size, -0.01), (0, a * size, 0.25 * size), 0.07 * size, 8) for a in (-0.14, 0.14)]
    return join(tube(arm, np.array([0.04, 0.06, 0.075, 0.06, 0.04]) * size, 8), *feet)


def cleats(deck: Deck, c: Coats, places: tuple[float, ...], inset: float = 0.12) -> list[Piece]:
    """Cleats on both sides at these t."""
    pieces: list[Piece] = []
    for t in places:
        x = max(float(deck.lines.half(t)) - inset, 0.05)
        pieces += pair("cleat", c.steel, moved(cleat(), deck.surface(x, t)))
    return pieces


def edge_path(deck: Deck, t: Float, inset: float, rise: ArrayLike) -> Float:
    """Points above the left edge of the deck, (N, 3)."""
    x = np.maximum(deck.lines.half(t) - inset, 0.0)
    points = deck.surface(x, t)
    points[:, 2] += np.asarray(rise, np.float64)
    return points


def bow_rail(deck: Deck, c: Coats, stop: float, height: float, middle: bool = False, posts: int = 4) -> list[Piece]:
    """A pulpit: a rail around the bow back to t = stop, with posts, and a second one at half the height."""
    t = 0.012 + (stop - 0.012) * np.linspace(0, 1, 26) ** 1.4
    solids: list[Solid] = []
    for share in (1.0, 0.5)[: 1 + middle]:
        rise = height * share * np.clip((stop - t) / (0.12 * stop), 0, 1) ** 0.5
        left = edge_path(deck, t, 0.07, rise + 0.004)
        solids.append(tube(np.concatenate([left[::-1], left * (-1.0, 1, 1)]), 0.0125, 8))
    for k in t[np.linspace(3, 21, posts).astype(int)]:
        foot, head = (edge_path(deck, np.array([k]), 0.07, r)[0] for r in (-0.01, height + 0.004))
        solids += [rod(foot * (s, 1, 1), head * (s, 1, 1), 0.0115, 8) for s in (1, -1)]
    return [Piece("bow_rail", c.steel, join(*solids))]


def wheel(radius: float, c: Coats, at: ArrayLike, toward: ArrayLike, spokes: int = 3, wooden: bool = False) -> list[Piece]:
    """A steering wheel with its hub at `at`, its face towards the helmsman."""
    a = np.linspace(0, 2 * np.pi, 11)
    grip = 0.017 if radius < 0.3 else 0.013
    rim = lathe(np.stack([radius + grip * np.cos(a), grip * np.sin(a)], axis=1), 36)
    angles = np.arange(spokes) * 2 * np.pi / spokes + np.pi / 2
    arms = [rod((0, 0, -0.015), (radius * np.cos(b), radius * np.sin(b), 0), 0.009, 8) for b in angles]
    hub = lathe([(0, -0.09), (0.03, -0.09), (0.035, -0.02), (0.035, 0.012), (0, 0.018)], 16)
    return [
        Piece("wheel", c.wood if wooden else c.black, aimed(rim, at, toward)),
        Piece("wheel", c.steel, aimed(join(hub, *arms), at, toward)),
    ]


def seat(c: Coats, at: ArrayLike, width: float = 0.52) -> list[Piece]:
    """A bucket seat on a pedestal; `at` is the point of the floor under it; looks forward."""
    base = moved(rounded_box((width, 0.5, 0.15), 0.055, 3), (0, 0, 0.42))
    back = moved(turned(rounded_box((width, 0.13, 0.52), 0.055, 3), 0, -0.2), (0, 0.25, 0.67))
    sides = [moved(rounded_box((0.09, 0.42, 0.24), 0.04, 2), (s * width / 2, 0.05, 0.48)) for s in (-1, 1)]
    inset = moved(turned(rounded_box((0.62 * width, 0.05, 0.36), 0.02, 2), 0, -0.2), (0, 0.195, 0.66))
    foot = lathe([(0, -0.01), (0.16, -0.01), (0.16, 0.012), (0.055, 0.03), (0.055, 0.36), (0, 0.36)], 20)
    white, accent, steel = (moved(s, at) for s in (join(base, back), join(inset, *sides), foot))
    return [Piece("seat", c.cushion, white), Piece("seat", c.accent, accent), Piece("seat", c.steel, steel)]


def bench(c: Coats, at: ArrayLike, width: float, depth: float = 0.5, height: float = 0.4, back: float = 0.42) -> list[Piece]:
    """A settee across the boat, on a locker; looks forward."""
    locker = moved(rounded_box((width, depth - 0.05, height + 0.02), 0.02, 1), (0, 0.02, height / 2 - 0.01))
    count = max(2, round(width / 0.7))
    step = width / count
    xs = (np.arange(count) - (count - 1) / 2) * step
    base = [moved(rounded_box((step - 0.008, depth, 0.13), 0.045, 3), (x, 0, height + 0.05)) for x in xs]
    rear = [
        moved(turned(rounded_box((step - 0.008, 0.12, back), 0.045, 3), 0, -0.15), (x, depth / 2, height + 0.28)) for x in xs
    ]
    return [
        Piece("bench", c.inside, moved(locker, at)),
        Piece("bench", c.cushion, moved(join(*base), at)),
        Piece("bench", c.cushion if back < 0.3 else c.accent, moved(join(*rear), at)),
    ]


def side_lights(c: Coats, at: ArrayLike) -> list[Piece]:
    """Red to port, green to starboard, on a small housing."""
    house = moved(rounded_box((0.1, 0.09, 0.06), 0.02, 2), at)
    eyes = [moved(rounded_box((0.035, 0.075, 0.045), 0.016, 2), np.add(at, (s * 0.042, -0.02, 0))) for s in (1, -1)]
    return [
        Piece("side_light", c.black, house),
        Piece("side_light_left", c.red_lamp, eyes[0]),
        Piece("side_light_right", c.green_lamp, eyes[1]),
    ]


def fenders(deck: Deck, c: Coats, places: tuple[float, ...], material: Material) -> list[Piece]:
    """Inflated cylinders that hang beside the hull on lines."""
    r, tall = 0.1, 0.5
    a = np.linspace(0, np.pi / 2, 6)
    low = np.stack([r * np.sin(a), -tall / 2 + r * (1 - np.cos(a))], axis=1)
    body = lathe(np.concatenate([low, (low * (1, -1))[::-1]]), 18)
    pieces: list[Piece] = []
    for t in places:
        top = deck.lines.sheer_line(t)
        v = deck.lines.level(t, float(top[2]) - 0.5)
        out = max(float(top[0]), float(deck.lines.point(t, v)[0])) + r + 0.03
        center = np.array([out, top[1], top[2] - 0.48])
        line = smooth(
            [
                top + np.array((-0.1, 0, 0.03)),
                top + np.array((0.01, 0, 0.025)),
                center + np.array((0, 0, tall / 2 + 0.06)),
                center + np.array((0, 0, 0.2)),
            ],
            4,
        )
        pieces += pair("fender", material, moved(body, center)) + pair("fender", c.rope, tube(line, 0.007, 6))
    return pieces


def flag(at: ArrayLike, c: Coats, colors: Flag, size: float = 0.45) -> list[Piece]:
    """A tricolour that flies aft from a raked staff."""
    staff = rod(at, np.add(at, (0, 0.28 * size, 1.9 * size)), 0.011, 8)
    y, z = np.linspace(0, size, 12), np.linspace(0, 0.62 * size, 10)
    pieces = [Piece("flag", c.wood, staff)]
    for k, color in enumerate(colors):
        band = z[3 * k : 3 * k + 4]
        wave = 0.05 * size * np.sin(7 * y / size) * (y / size)
        grid_ = np.stack(
            np.broadcast_arrays(
                wave[:, None], y[:, None] + 0.145 * (1.2 * size + band), 1.2 * size + band - 0.12 * y[:, None] ** 2
            ),
            axis=-1,
        )
        cloth = Material(f"flag_{k}", linear(color), roughness=0.8)
        pieces.append(Piece("flag", cloth, moved(sheet(grid_, 0.003), at)))
    return pieces
