"""Beds, single to king size: frames of wood, cloth or metal with mattress, duvet and pillows."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.model.annotations.keypoints import sided
from viewsphere.model.place import LevelFace
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.furnishing.casework import Leg, block, leg
from viewsphere_zoo.furnishing.coats import (
    BLACK_STEEL,
    WHITE_STEEL,
    Cloth,
    Timber,
    Wood,
    drawn_cloth,
    drawn_wood,
    furnished,
    grain,
    weave,
)
from viewsphere_zoo.furnishing.softs import draped, padded, pillow, tufted, upright
from viewsphere_zoo.joinery.coats import BRASS
from viewsphere_zoo.joinery.members import pipe
from viewsphere_zoo.joinery.slabs import level, slab
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.rods import rod
from viewsphere_zoo.shapes.solids import Solid, join, lathe, moved, turned

KEYPOINTS = {
    **sided("mattress_foot", "mattress", (1, -1, 1)),
    **sided("mattress_head", "mattress", (1, 1, 1)),
    **sided("headboard_top", "headboard", (1, 0, 1)),
    **sided("leg_foot", "leg", (1, -1, -1)),
    **sided("leg_head", "leg", (1, 1, -1)),
}
SKELETON = (
    ("mattress_foot_left", "mattress_foot_right"),
    ("mattress_head_left", "mattress_head_right"),
    ("mattress_foot_left", "mattress_head_left"),
    ("mattress_foot_right", "mattress_head_right"),
    ("mattress_head_left", "headboard_top_left"),
    ("mattress_head_right", "headboard_top_right"),
    ("headboard_top_left", "headboard_top_right"),
)

Head = Literal["panel", "slats", "arched", "upholstered", "channels", "bars"]
Foot = Literal["none", "low", "matching"]
Metal = Literal["black", "white", "brass"]
_METALS = {"black": BLACK_STEEL, "white": WHITE_STEEL, "brass": BRASS}
_BOARD = 0.05
"""Thickness of head and foot boards, metres."""


@dataclass(frozen=True)
class Bed:
    """Parameters of a bed; lengths in metres.

    width, length: of the mattress; rail: height of the top of the frame; mattress: its thickness; head: kind of headboard, and
    its height; foot: a footboard; posts: height of four posts with rails between them, 0 for none; duvet_hang: how far the
    duvet hangs over the sides; folded: width of the band that is turned back; pillows: their number, where those beyond one
    row lean on the others; cushions: small ones before them; throw: a blanket over the foot end; seed: of cloths, grain and
    folds.
    """

    width: float = 1.6
    length: float = 2.0
    rail: float = 0.32
    mattress: float = 0.22
    head: Head = "panel"
    head_height: float = 1.05
    foot: Foot = "low"
    posts: float = 0.0
    leg: Leg = "square"
    duvet_hang: float = 0.25
    folded: float = 0.35
    pillows: int = 2
    cushions: int = 0
    throw: bool = False
    metal: Metal = "black"
    wood: Wood = field(default_factory=Wood)
    board: Cloth = field(default_factory=Cloth)
    duvet: Cloth = field(default_factory=lambda: Cloth(pattern="stripes"))
    linen: Cloth = field(default_factory=lambda: Cloth((0.93, 0.92, 0.9)))
    blanket: Cloth = field(default_factory=lambda: Cloth((0.62, 0.3, 0.2)))
    seed: int = 0

    @property
    def top(self) -> float:
        """Height of the mattress's top."""
        return self.rail - 0.05 + self.mattress

    @property
    def duvet_end(self) -> float:
        """y at which the turned-back duvet ends towards the head."""
        return self.length / 2 - 0.58

    @property
    def extent(self) -> tuple[float, float, float]:
        """Greatest width, depth and height of the whole model, metres."""
        return self.width + 0.36, self.length + 0.2, max(self.head_height, self.posts)


@dataclass(frozen=True)
class _Coats:
    timber: Timber
    frame: Material
    board: Material
    duvet: Material
    linen: Material
    blanket: Material


def bed(parameters: Bed | None = None) -> Mesh:
    """The bed in metres: its foot end at -Y, the headboard at +Y, legs on z = 0, the mattress centred.

    Parts: leg, rail, headboard, mattress, duvet, duvet_fold, pillow; footboard, post, cushion and throw where fitted.
    """
    p = parameters or Bed()
    rng = np.random.default_rng(p.seed)
    cloths = (p.board, p.duvet, p.linen, p.blanket)
    images = [grain(rng, p.wood), *(weave(rng, c) for c in cloths)]
    timber = p.wood.timber(0)
    fabrics = [c.material(k, n) for k, (c, n) in enumerate(zip(cloths, ("board", "duvet", "linen", "blanket"), strict=True), 1)]
    frame = {"bars": _METALS[p.metal], "upholstered": fabrics[0], "channels": fabrics[0]}.get(p.head, timber.along)
    coats = _Coats(timber, frame, *fabrics)
    return furnished(
        [*_frame(p, coats), *_headboard(p, coats), *_footboard(p, coats), *_bedding(p, coats, rng)],
        images,
        whole=("pillow", "cushion"),
    )


def _frame(p: Bed, coats: _Coats) -> list[Piece]:
    """Rails around the mattress, legs or posts."""
    x, y, t = p.width / 2 + 0.015, p.length / 2, 0.03
    low = p.rail - (0.16 if p.head != "bars" else 0.05)
    make = padded if p.head in ("upholstered", "channels") else block
    rails = [make((s * x - t / 2 + s * t / 2, -y, low), (s * x + t / 2 + s * t / 2, y + 0.02, p.rail), 0.012) for s in (-1, 1)]
    rails += [make((-x - t, -y - t, low), (x + t, -y, p.rail), 0.012), block((-x, -y, low + 0.01), (x, y, low + 0.03))]
    found = [Piece("rail", coats.frame, join(*rails))]
    at = [(sx * (x - 0.01), sy * (y - 0.02)) for sx in (-1, 1) for sy in (-1, 1)]
    metal = p.head == "bars"
    if p.posts:
        post = [
            rod((*a, 0), (*a, p.posts), 0.022, 10)
            if metal
            else block((a[0] - 0.035, a[1] - 0.035, 0), (a[0] + 0.035, a[1] + 0.035, p.posts))
            for a in at
        ]
        beams = [block((s * x - 0.022, -y, p.posts - 0.045), (s * x + 0.022, y, p.posts - 0.005)) for s in (-1, 1)]
        beams += [
            block((-x, s * (y - 0.02) - 0.02, p.posts - 0.045), (x, s * (y - 0.02) + 0.02, p.posts - 0.005)) for s in (-1, 1)
        ]
        found.append(Piece("post", coats.frame if metal else coats.timber.upright, join(*post, *beams)))
    legs = [leg(p.leg, a, low + 0.01, 0.035 if metal else 0.07, (np.sign(a[0]) * 0.5, np.sign(a[1]) * 0.5)) for a in at]
    return [*found, Piece("leg", coats.frame if metal else coats.timber.upright, join(*legs))]


def _headboard(p: Bed, coats: _Coats) -> list[Piece]:
    """The headboard at +Y."""
    return _board("headboard", p, coats, p.length / 2 + 0.03, p.head_height)


def _footboard(p: Bed, coats: _Coats) -> list[Piece]:
    """A footboard like the headboard, lower."""
    if p.foot == "none":
        return []
    high = p.top + (0.02 if p.foot == "low" else 0.22)
    return _board("footboard", p, coats, -p.length / 2 - 0.075, min(high, p.head_height - 0.15))


def _board(part: str, p: Bed, coats: _Coats, y: float, high: float) -> list[Piece]:
    """A board across the bed between y and y + its thickness, from below the rail to z = high."""
    x, low, mid = p.width / 2 + 0.045, p.rail - 0.16, y + _BOARD / 2
    if p.head == "bars":
        return [Piece(part, coats.frame, _bars(x, mid, high))]
    if p.head == "upholstered" and part == "headboard":
        panel, spots = tufted(2 * x, high - low, 0.1, max(4, round(2 * x / 0.24)), 3, 0.02)
        at = (0, mid, (high + low) / 2)
        dome = lathe([(0, -0.004), (0.013, -0.004), (0.011, 0.005), (0, 0.008)], 7)
        buttons = Piece("button", coats.frame, upright(join(*(moved(dome, s) for s in spots)), at, 0))
        return [Piece(part, coats.frame, upright(panel, at, 0)), buttons]
    if p.head in ("upholstered", "channels"):
        count = max(5, round(2 * x / 0.16)) if p.head == "channels" else 1
        edges = np.linspace(-x, x, count + 1).tolist()
        round_ = 0.035 if part == "headboard" else 0.02
        pads = [padded((a, y - 0.015, low), (b, y + _BOARD + 0.015, high), round_, 2) for a, b in pairwise(edges)]
        return [Piece(part, coats.frame, join(*pads))]
    posts = [block((s * x - 0.035, y - 0.01, 0), (s * x + 0.035, y + _BOARD + 0.01, high), 0.006) for s in (-1, 1)]
    if p.head == "slats":
        count = round(2 * x / 0.12)
        rungs = [
            block((a - 0.02, mid - 0.01, p.rail), (a + 0.02, mid + 0.01, high - 0.04))
            for a in np.linspace(-x, x, count + 1)[1:-1]
        ]
        rail = block((-x, y + 0.005, high - 0.1), (x, y + _BOARD - 0.005, high - 0.015), 0.008)
        lower = block((-x, y + 0.005, p.rail - 0.06), (x, y + _BOARD - 0.005, p.rail + 0.03), 0.006)
        return [Piece(part, coats.timber.along, join(rail, lower)), Piece(part, coats.timber.upright, join(*posts, *rungs))]
    if p.head == "arched" and part == "headboard":
        s = np.linspace(1, -1, 25)
        arch = np.stack([s * x, high - low - 0.2 * s**2 - 0.05 * s**6], axis=1)
        outline = np.concatenate([[(-x, 0), (x, 0)], arch])
        panel = moved(
            turned(slab(outline, level(0), level(_BOARD - 0.01), 0.01, 1, 2), 0, np.pi / 2), (0, y + _BOARD - 0.005, low)
        )
        rim = pipe(np.column_stack([1.0 * arch[:, 0], np.full(25, y), low + arch[:, 1] - 0.01]), 0.022, 0.01, 8)
        return [
            Piece(part, coats.timber.along, join(panel, rim)),
            Piece(part, coats.timber.upright, join(*(_cut(q, high - 0.3) for q in posts))),
        ]
    planks = 3 if part == "headboard" else 1
    edges = np.linspace(p.rail - 0.05, high - 0.03, planks + 1).tolist()
    boards = [block((-x, y + 0.012, a + 0.006), (x, y + _BOARD - 0.012, b), 0.006) for a, b in pairwise(edges)]
    cap = block((-x - 0.05, y - 0.012, high - 0.03), (x + 0.05, y + _BOARD + 0.012, high), 0.008)
    return [Piece(part, coats.timber.along, join(*boards, cap)), Piece(part, coats.timber.upright, join(*posts))]


def _cut(post: Solid, high: float) -> Solid:
    """The post shortened to this height."""
    return Solid(np.minimum(post.vertices, (np.inf, np.inf, high)), post.triangles)


def _bars(x: float, y: float, high: float) -> Solid:
    """A bent tube from floor to floor, filled with thin rods."""
    hoop = pipe([(-x, y, 0), (-x, y, high), (x, y, high), (x, y, 0)], 0.019, 0.16, 10)
    lower = rod((-x, y, 0.42 * high), (x, y, 0.42 * high), 0.012, 8)
    count = round(2 * x / 0.15)
    rods = [
        rod((a, y, 0.42 * high), (a, y, high - (0.05 if abs(a) > x - 0.1 else 0.0)), 0.008, 7)
        for a in np.linspace(-x, x, count + 1)[1:-1]
    ]
    return join(hoop, lower, *rods)


def _bedding(p: Bed, coats: _Coats, rng: np.random.Generator) -> list[Piece]:
    """Mattress, pillows, duvet with its turned-back band, blanket."""
    x, y, top, end = p.width / 2, p.length / 2, p.top, p.duvet_end
    mattress = Piece("mattress", coats.linen, padded((-x, -y + 0.01, p.rail - 0.05), (x, y - 0.01, top), 0.05))
    side = x + 0.05 + p.duvet_hang
    front = -y - (p.duvet_hang + 0.05 if p.foot == "none" else -0.01)

    def laid(low: float, high: float, half: float, under: float, thickness: float, spacing: float) -> Solid:
        # Every cloth repeats the creases of the cloth below it; otherwise the lower one would show through.
        block_ = (-x - 0.04 - under, -y - 0.04 - under, x + 0.04 + under, 9.0)
        creases = np.random.default_rng(p.seed)
        return draped(creases, (-half, low, half, high), block_, top + under, thickness, 0.02, spacing, 0.05)

    found = [mattress, Piece("duvet", coats.duvet, laid(front, end, side, 0.0, 0.045, 0.12))]
    if p.folded:
        found.append(Piece("duvet_fold", coats.linen, laid(end - p.folded, end + 0.025, side + 0.03, 0.045, 0.05, 0.14)))
    if p.throw:
        found.append(Piece("throw", coats.blanket, laid(-y + 0.22, -y + 0.78, side - 0.02, 0.047, 0.014, 0.1)))
    return [*found, *_pillows(p, coats, rng)]


def _pillows(p: Bed, coats: _Coats, rng: np.random.Generator) -> list[Piece]:
    """Pillows that lean on the headboard, in one or two rows, and small cushions before them."""
    across = 1 if p.width < 1.1 else 2
    wide = min(0.72, p.width / across - 0.04)
    found = []
    for k in range(p.pillows):
        row, column = divmod(k, across)
        x = (column - (across - 1) / 2) * (wide + 0.02) + float(rng.uniform(-0.015, 0.015))
        body = turned(pillow(wide, 0.46, 0.19), 2, float(rng.uniform(-0.05, 0.05)))
        flat = p.pillows <= across and p.seed % 2 == 0
        at = (x, p.length / 2 - (0.27 if flat else 0.14 + 0.14 * row), p.top + (0.075 if flat else 0.19))
        coat = coats.duvet if row else coats.linen
        found.append(Piece("pillow", coat, upright(body, at, 84 if flat else float(rng.uniform(30, 38)))))
    for k in range(p.cushions):
        body = pillow(0.4, 0.4, 0.14)
        at = ((k - (p.cushions - 1) / 2) * 0.36, p.duvet_end + 0.1, p.top + 0.21)
        found.append(Piece("cushion", coats.blanket, upright(body, at, 38)))
    return found


def surfaces(parameters: Bed) -> tuple[LevelFace, ...]:
    """Return the even surfaces: the blanket's top, and the duvet from its band or pillows to the blanket or foot."""
    p, x, foot = parameters, parameters.width / 2 - 0.1, -parameters.length / 2
    low, high = foot + (0.82 if p.throw else 0.12), p.duvet_end - (p.folded or 0.08) - 0.06 - (0.15 if p.cushions else 0)
    clear = p.posts - p.top - 0.1 if p.posts else float("inf")
    found = [LevelFace("duvet", (-x, low, x, high), p.top + 0.045, clear)] if high - low > 0.15 else []
    if p.throw:
        found.append(LevelFace("throw", (-x, foot + 0.25, x, foot + 0.75), p.top + 0.06, clear - 0.02))
    return tuple(found)


def bed_random(rng: np.random.Generator) -> Mesh:
    """A bed with parameters drawn to resemble beds in real bedrooms."""
    return bed(draw(rng))


def draw(rng: np.random.Generator) -> Bed:
    """The parameters of a random bed."""
    head: Head = ("panel", "slats", "arched", "upholstered", "channels", "bars")[int(rng.integers(6))]
    width = float(rng.choice((0.9, 1.2, 1.4, 1.6, 1.8), p=(0.25, 0.1, 0.2, 0.25, 0.2)))
    soft = head in ("upholstered", "channels")
    posts = float(rng.uniform(1.75, 2.05)) if head in ("panel", "slats", "bars") and rng.random() < 0.22 else 0.0
    legs: tuple[Leg, ...] = ("tapered", "square", "turned")
    across = 1 if width < 1.1 else 2
    rail = float(rng.uniform(0.28, 0.38))
    return Bed(
        width=width,
        length=float(rng.uniform(1.9, 2.05)),
        rail=rail,
        mattress=float(rng.uniform(0.18, 0.28)),
        head=head,
        head_height=float(rng.uniform(0.9, 1.3)),
        foot="none" if soft or posts else ("none", "low", "matching")[int(rng.integers(3))],
        posts=posts,
        leg=legs[int(rng.integers(3))],
        duvet_hang=float(rng.uniform(0.16, 0.34)),
        folded=float(rng.uniform(0.2, 0.42)) if rng.random() < 0.75 else 0.0,
        pillows=across * int(rng.choice((1, 2), p=(0.6, 0.4))),
        cushions=int(rng.choice((0, 1, 2), p=(0.6, 0.2, 0.2))) if across == 2 else 0,
        throw=bool(rng.random() < 0.4),
        metal=("black", "white", "brass")[int(rng.integers(3))],
        wood=drawn_wood(rng, 0.3),
        board=drawn_cloth(rng, 0.05),
        duvet=drawn_cloth(rng, 0.6),
        linen=Cloth(_LINENS[int(rng.integers(len(_LINENS)))]),
        blanket=drawn_cloth(rng, 0.4),
        seed=int(rng.integers(1 << 31)),
    )


_LINENS = ((0.94, 0.93, 0.91), (0.9, 0.88, 0.83), (0.8, 0.85, 0.9), (0.9, 0.83, 0.8), (0.93, 0.94, 0.95))


FAMILY = ZooFamily(
    random=bed_random,
    home="floor",
    classes={"": "furniture"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
    surfaces=surfaces,
)
