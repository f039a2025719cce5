"""Chairs whose legs and back are both fixed into the seat: Windsor chairs, and moulded shells on four legs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material
from viewsphere_zoo.joinery.coats import CHROME, PLASTICS, RUBBER, WOODS, Cover, drawn_color, drawn_wood, plastic, timber
from viewsphere_zoo.joinery.members import bar, spindle
from viewsphere_zoo.joinery.slabs import crowned, level, on, polygon, slab
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import Color
from viewsphere_zoo.shapes.rods import rod
from viewsphere_zoo.shapes.solids import Float, both_sides, curve, join, tube

_LEG = ((0.0, 0.01), (0.25, 0.0135), (0.45, 0.017), (0.6, 0.0165), (0.63, 0.012), (0.67, 0.019), (0.78, 0.02), (1.0, 0.013))
_STRETCHER = ((0.0, 0.008), (0.3, 0.011), (0.5, 0.0155), (0.7, 0.011), (1.0, 0.008))
_STICK = ((0.0, 0.0062), (0.3, 0.0085), (0.6, 0.007), (1.0, 0.005))


@dataclass(frozen=True)
class Windsor:
    """Parameters of a spindle-back chair; lengths in metres.

    back: a comb under a curved crest rail, or a bow around the spindles; rake: how far the top is behind the seat;
    splay: run of the legs per metre of height.
    """

    width: float = 0.45
    depth: float = 0.42
    seat_height: float = 0.45
    height: float = 0.92
    back: Literal["comb", "bow"] = "comb"
    spindles: int = 7
    rake: float = 0.12
    splay: float = 0.16
    stretchers: bool = True
    wood: Color = WOODS["cherry"]

    @property
    def extent(self) -> tuple[float, float, float]:
        """Greatest width, depth and height of the whole model, metres."""
        return self.width + 0.03, self.depth + 0.15, self.height + 0.01


@dataclass(frozen=True)
class Shell:
    """Parameters of a moulded plastic shell on four legs; lengths in metres."""

    width: float = 0.46
    depth: float = 0.44
    seat_height: float = 0.44
    height: float = 0.82
    lean: float = 0.16
    hug: float = 0.5
    metal_legs: bool = False
    color: Color = PLASTICS[0]
    wood: Color = WOODS["beech"]
    cover: Cover | None = None

    @property
    def extent(self) -> tuple[float, float, float]:
        """Greatest width, depth and height of the whole model, metres."""
        return self.width + 0.03, self.depth + 0.11, self.height + 0.01


def windsor_pieces(p: Windsor) -> list[Piece]:
    """Return the pieces of a Windsor chair."""
    wood = timber(p.wood)
    x, y = p.width / 2, p.depth / 2
    corners = [
        (-x, -0.8 * y),
        (-0.5 * x, -y),
        (0.5 * x, -y),
        (x, -0.8 * y),
        (x, 0.1 * y),
        (0.72 * x, y),
        (-0.72 * x, y),
        (-x, 0.1 * y),
    ]
    outline = polygon(corners, 0.07, 0.025)
    top = crowned(outline, p.seat_height, -0.016)
    seat = slab(outline, level(p.seat_height - 0.038), top, 0.015, 8)
    return [Piece("seat", wood[1], seat), *_undercarriage(p, wood), *_sticks(p, wood)]


def _undercarriage(p: Windsor, wood: tuple[Material, ...]) -> list[Piece]:
    """Splayed turned legs and an H of stretchers."""
    drop = p.seat_height - 0.02
    tops = np.array([(0.3 * p.width, -0.3 * p.depth), (0.26 * p.width, 0.3 * p.depth)])
    feet = tops + p.splay * drop * np.array([(0.75, -0.7), (0.75, 0.95)])
    legs = [spindle((*f, 0.0), (*t, drop), _LEG) for f, t in zip(feet, tops, strict=True)]
    found = [Piece(n, wood[0], both_sides(leg)) for n, leg in zip(("leg_front", "leg_rear"), legs, strict=True)]
    if p.stretchers:
        share = 0.4
        a, b = (np.append(f + share * (t - f), share * drop) for f, t in zip(feet, tops, strict=True))
        side, middle = spindle(a, b, _STRETCHER), (a + b) / 2
        cross = spindle(middle * (-1, 1, 1), middle, _STRETCHER)
        found.append(Piece("stretcher", wood[2], join(both_sides(side), cross)))
    return found


def _sticks(p: Windsor, wood: tuple[Material, ...]) -> list[Piece]:
    """Spindles that fan out of the seat's rear edge, and the comb or bow that holds their tops."""
    foot, head = p.seat_height - 0.02, p.height - p.seat_height
    side = np.linspace(-1, 1, p.spindles + 2)
    base = np.column_stack([0.36 * p.width * side, 0.5 * p.depth - 0.035 - 0.05 * side**2, np.full(len(side), foot)])

    def back(x: Float, z: Float) -> Float:
        """y of the back's surface at x and z."""
        return 0.5 * p.depth - 0.035 - 0.28 * x**2 / p.width + p.rake * (z - foot) / head

    if p.back == "comb":
        x = 0.5 * p.width * np.linspace(-1, 1, 17) * 1.02
        z = p.height - 0.04 - 0.012 * (x / x.max()) ** 2
        size = np.stack([curve(np.abs(x) / x.max(), [(0, 0.085), (0.8, 0.07), (1, 0.045)]), np.full(17, 0.02)], axis=1)
        crest = bar(np.column_stack([x, back(x, z), z]), size, 0.008, (0, p.rake / head, 1))
        heads = 0.45 * p.width * side
        tops = np.column_stack([heads, back(heads, np.full(len(heads), p.height - 0.05)), np.full(len(heads), p.height - 0.05)])
    else:
        t = np.linspace(0, np.pi, 41)
        bow_x = -0.44 * p.width * np.sign(np.cos(t)) * np.abs(np.cos(t)) ** 0.75 * (1 - 0.18 * (1 - np.sin(t) ** 0.8))
        bow_z = foot + (p.height - 0.012 - foot) * np.sin(t) ** 0.75
        path = np.column_stack([bow_x, back(bow_x, bow_z), bow_z])
        crest = tube(path, 0.0125, 14)
        heads = 0.36 * p.width * side[1:-1]
        z = np.interp(heads, bow_x[8:33], bow_z[8:33])
        tops = np.column_stack([heads, back(heads, z), z])
        base = base[1:-1] * (0.86, 1, 1)
    slim = [spindle(a, b, _STICK, 12) for a, b in zip(base, tops, strict=True)]
    found = [Piece("crest_rail" if p.back == "comb" else "back_bow", wood[0], crest)]
    if p.back == "comb":
        thick = [(f, 1.9 * r) for f, r in _STICK]
        slim[0], slim[-1] = (spindle(base[k], tops[k], thick, 16) for k in (0, -1))
    return [*found, *(Piece("back_spindle", wood[1 + k % 2], s) for k, s in enumerate(slim))]


def shell_pieces(p: Shell) -> list[Piece]:
    """A shell that is seat and back in one, and its legs."""
    rise = p.height - p.seat_height
    y = p.depth / 2
    knots = np.array(
        [
            (-y, p.seat_height - 0.025),
            (-y + 0.05, p.seat_height + 0.002),
            (0, p.seat_height - 0.02),
            (y - 0.1, p.seat_height - 0.018),
            (y - 0.02, p.seat_height + 0.035),
            (y + 0.02, p.seat_height + 0.14),
            (y + p.lean * rise, p.height),
        ]
    )
    steps = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(knots, axis=0), axis=1))])
    length = float(steps[-1])
    fine = np.linspace(0, length, 200)
    profile = np.stack([curve(fine, np.stack([steps, knots[:, k]], axis=1)) for k in (0, 1)], axis=1)
    tangent = np.gradient(profile, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)

    def surface(u: Float, v: Float) -> Float:
        at = v + length / 2
        yz, t = (np.stack([np.interp(at, fine, a[:, k]) for k in (0, 1)], axis=-1) for a in (profile, tangent))
        curl = p.hug * curve(at / length, [(0, 0.1), (0.35, 0.8), (0.6, 1.2), (1, 0.55)]) * 2.2 * np.abs(u) ** 2.4
        return np.stack([u, yz[..., 0] - curl * t[..., 1], yz[..., 1] + curl * t[..., 0]], axis=-1)

    x, v = p.width / 2, length / 2
    corners = [(-0.86 * x, -v), (0.86 * x, -v), (x, 0.05 * v), (0.84 * x, v), (-0.84 * x, v), (-x, 0.05 * v)]
    outline = polygon(corners, 0.11, 0.02)
    shell = on(surface, slab(outline, level(-0.0035), level(0.0035), 0.0035, 16, 3))
    found = [Piece("shell", plastic("plastic", p.color), shell), *_shell_legs(p)]
    if p.cover:
        pad = polygon(
            [(-0.72 * x, -0.93 * v), (0.72 * x, -0.93 * v), (0.72 * x, -0.12 * v), (-0.72 * x, -0.12 * v)], 0.07, 0.02
        )
        found.append(
            Piece("seat_pad", p.cover.material, on(surface, slab(pad, level(0.0), crowned(pad, 0.014, 0.014), 0.012, 8)))
        )
    return found


def _shell_legs(p: Shell) -> list[Piece]:
    """Wooden dowels or steel tubes under a cross of bars."""
    z = p.seat_height - 0.05
    top, foot = np.array([(0.15, -0.12, z), (0.15, 0.11, z)]), np.array([(0.22, -0.2, 0.0), (0.21, 0.21, 0.0)])
    wood = timber(p.wood)[0]
    legs = []
    for name, a, b in zip(("leg_front", "leg_rear"), foot, top, strict=True):
        if p.metal_legs:
            tip = a + 0.04 * (b - a)
            legs += [Piece(name, CHROME, both_sides(rod(tip, b, 0.009, 14)))]
            legs += [Piece("foot", RUBBER, both_sides(spindle(a, a + 0.06 * (b - a), [(0, 0.012), (0.1, 0.0135), (1, 0.011)])))]
        else:
            legs.append(Piece(name, wood, both_sides(spindle(a, b, [(0, 0.0105), (0.02, 0.012), (1, 0.0185)]))))
    steel = plastic("bracket", (0.1, 0.1, 0.1)) if not p.metal_legs else CHROME
    mount = [rod(top[k] * (-1, 1, 1), top[k], 0.008, 12) for k in (0, 1)] + [
        rod(top[0] * s, top[1] * s, 0.008, 12) for s in ((1, 1, 1), (-1, 1, 1))
    ]
    low = foot + 0.45 * (top - foot)
    ties = [rod(low[0], low[1] * (-1, 1, 1), 0.0035, 8), rod(low[1], low[0] * (-1, 1, 1), 0.0035, 8)]
    posts = both_sides(join(*(rod(t - (0, 0, 0.005), t * (0.85, 0.85, 1) + (0, 0, 0.028), 0.013, 12) for t in top)))
    return [*legs, Piece("bracket", steel, join(*mount, posts)), Piece("stretcher", steel, join(*ties))]


def draw_windsor(rng: np.random.Generator) -> Windsor:
    """A random Windsor chair."""
    return Windsor(
        width=float(rng.uniform(0.43, 0.49)),
        depth=float(rng.uniform(0.4, 0.44)),
        seat_height=float(rng.uniform(0.43, 0.465)),
        height=float(rng.uniform(0.86, 1.04)),
        back="comb" if rng.random() < 0.5 else "bow",
        spindles=int(rng.integers(5, 10)),
        rake=float(rng.uniform(0.09, 0.16)),
        splay=float(rng.uniform(0.1, 0.22)),
        stretchers=bool(rng.random() < 0.8),
        wood=drawn_wood(rng, 0.4),
    )


def draw_shell(rng: np.random.Generator) -> Shell:
    """A random shell chair."""
    return Shell(
        width=float(rng.uniform(0.44, 0.49)),
        depth=float(rng.uniform(0.42, 0.46)),
        seat_height=float(rng.uniform(0.43, 0.46)),
        height=float(rng.uniform(0.78, 0.86)),
        lean=float(rng.uniform(0.1, 0.24)),
        hug=float(rng.uniform(0.2, 0.9)),
        metal_legs=bool(rng.random() < 0.35),
        color=drawn_color(PLASTICS, rng),
        wood=drawn_wood(rng, 0.1),
        cover=Cover(drawn_color(PLASTICS, rng)) if rng.random() < 0.3 else None,
    )
