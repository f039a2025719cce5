"""Sofas: two to four seats, with or without a chaise longue, tufted or with loose cushions."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.model.annotations.keypoints import sided
from viewsphere.model.place import LevelFace
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.furnishing.casework import Leg, block, leg
from viewsphere_zoo.furnishing.coats import Cloth, Wood, drawn_cloth, drawn_wood, furnished, grain, weave
from viewsphere_zoo.furnishing.softs import cushion, draped, padded, pillow, tufted, upright
from viewsphere_zoo.joinery.coats import BRASS, drawn_cover
from viewsphere_zoo.joinery.slabs import box_outline
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.solids import Float, Solid, both_sides, join, lathe, loft, moved, turned

KEYPOINTS = {
    **sided("seat_front", "seat_cushion", (1, -1, 1)),
    **sided("seat_rear", "seat_cushion", (1, 1, 1)),
    **sided("back_top", "back", (1, 0, 1)),
    **sided("armrest_front", "armrest", (1, -1, 1)),
    **sided("foot_front", "leg", (1, -1, -1)),
    **sided("foot_rear", "leg", (1, 1, -1)),
}
SKELETON = (
    ("seat_front_left", "seat_front_right"),
    ("seat_rear_left", "seat_rear_right"),
    ("seat_front_left", "seat_rear_left"),
    ("seat_front_right", "seat_rear_right"),
    ("back_top_left", "back_top_right"),
    ("seat_rear_left", "back_top_left"),
    ("seat_rear_right", "back_top_right"),
    ("seat_front_left", "armrest_front_left"),
    ("seat_front_right", "armrest_front_right"),
)

Arms = Literal["track", "rolled", "sloped", "wood"]
Back = Literal["cushions", "tufted", "plain"]
Chaise = Literal["none", "left", "right"]


REACH = 0.68
"""Length of a chaise beyond the sofa's front, metres."""


@dataclass(frozen=True)
class Sofa:
    """Parameters of a sofa; lengths in metres.

    seat_width: of one seat; arm: an arm's thickness; arms: straight, rolled, sloping to the front, or of wood; lean: of the
    back cushions, degrees; chaise: a long seat at the sitter's left (+X) or right; scattered: loose pillows; throw: a blanket
    over one arm; leather: a plain smooth cover; seed: of cloth and grain.
    """

    seats: int = 3
    seat_width: float = 0.64
    depth: float = 0.92
    height: float = 0.84
    seat_height: float = 0.44
    arm: float = 0.16
    arm_height: float = 0.6
    arms: Arms = "track"
    back: Back = "cushions"
    lean: float = 12.0
    chaise: Chaise = "none"
    foot: float = 0.12
    leg: Leg = "tapered"
    scattered: int = 2
    throw: bool = False
    leather: bool = False
    cover: Cloth = field(default_factory=Cloth)
    accents: tuple[Cloth, Cloth] = field(default_factory=lambda: (Cloth((0.75, 0.55, 0.2)), Cloth(pattern="stripes")))
    wood: Wood = field(default_factory=Wood)
    seed: int = 0

    @property
    def inner(self) -> float:
        """Half the width between the arms."""
        return self.seats * self.seat_width / 2

    @property
    def width(self) -> float:
        """Width between the outsides of the arms."""
        return 2 * (self.inner + self.arm) + 0.04

    @property
    def back_front(self) -> float:
        """y of the face that the back cushions lean on, at the seat."""
        return self.depth / 2 - 0.17

    @property
    def seat_rear(self) -> float:
        """y where the free part of the seat ends."""
        return self.back_front - (0.21 if self.back == "cushions" else 0.03)


@dataclass(frozen=True)
class _Coats:
    cover: Material
    wood: Material
    accents: tuple[Material, Material]


def sofa(parameters: Sofa | None = None) -> Mesh:
    """The sofa in metres: the sitter looks towards -Y, feet on z = 0, the middle of its seats at x = y = 0.

    Parts: base, seat_cushion, back, armrest, leg; back_cushion, pillow, throw, button, chaise by style.
    """
    p = parameters or Sofa()
    rng = np.random.default_rng(p.seed)
    images = [weave(rng, p.cover), grain(rng, p.wood), *(weave(rng, c) for c in p.accents)]
    cover = p.cover.material(0, "leather" if p.leather else "fabric", 0.45 if p.leather else 0.95)
    accents = p.accents[0].material(2, "accent"), p.accents[1].material(3, "accent_2")
    coats = _Coats(cover, p.wood.timber(1).upright, accents)
    pieces = [*_base(p, coats), *_seat(p, coats), *_back(p, coats), *_armrests(p, coats), *_legs(p, coats)]
    return furnished([*pieces, *_loose(p, coats, rng)], images, whole=("pillow",))


def _side(p: Sofa) -> int:
    return {"none": 0, "left": 1, "right": -1}[p.chaise]


def _base(p: Sofa, coats: _Coats) -> list[Piece]:
    """The upholstered box under the cushions."""
    x, y, top = p.inner + (0.02 if p.arms != "wood" else -0.01), p.depth / 2, p.seat_height - 0.13
    found = [Piece("base", coats.cover, padded((-x, -y + 0.03, p.foot), (x, y - 0.03, top), 0.025))]
    if s := _side(p):
        a, b = sorted((s * x, s * (p.inner - p.seat_width)))
        found.append(Piece("chaise", coats.cover, padded((a, -y - REACH + 0.03, p.foot), (b, 0, top), 0.025)))
    return found


def _seat(p: Sofa, coats: _Coats) -> list[Piece]:
    """One cushion for each seat, or one for all; a chaise's cushion is longer."""
    front, rear = -p.depth / 2, p.back_front + 0.02
    single = p.back == "plain"
    wide = 2 * p.inner if single and p.chaise == "none" else p.seat_width
    count = round(2 * p.inner / wide)
    solids = []
    for k in range(count):
        long = p.chaise != "none" and k == (count - 1 if p.chaise == "left" else 0)
        y0 = front - (REACH if long else 0)
        body = cushion((wide - 0.006, rear - y0, 0.14), 0.022, 0.045)
        solids.append(moved(body, (-p.inner + (k + 0.5) * wide, (y0 + rear) / 2, p.seat_height - 0.155)))
    return [Piece("seat_cushion", coats.cover, join(*solids))]


def _back(p: Sofa, coats: _Coats) -> list[Piece]:
    """The back's frame and the cushions in front of it."""
    x, y = p.inner + (p.arm if p.arms == "rolled" else 0.02), p.depth / 2
    frame_top = p.height - (0.09 if p.back == "cushions" else 0.0)
    low = p.foot + 0.01
    if p.arms == "rolled":
        roll = turned(_rolled(0.12, low, frame_top, 2 * x - 0.05), 2, -np.pi / 2)
        found = [Piece("back", coats.cover, moved(roll, (0, y - 0.1, 0)))]
    else:
        found = [Piece("back", coats.cover, padded((-x, p.back_front, low), (x, y, frame_top), 0.05))]
    tall = p.height - p.seat_height + 0.01
    foot = p.seat_height
    if p.back == "cushions":
        body = cushion((p.seat_width - 0.012, tall, 0.15), 0.045, 0.05)
        at = [(-p.inner + (k + 0.5) * p.seat_width, p.back_front - 0.02, foot + tall / 2) for k in range(p.seats)]
        found.append(Piece("back_cushion", coats.cover, join(*(upright(body, a, p.lean) for a in at))))
    elif p.back == "tufted":
        columns = max(4, round(2 * p.inner / 0.2))
        panel, spots = tufted(2 * p.inner - 0.01, frame_top - foot - 0.02, 0.09, columns, 3)
        at = (0, p.back_front - 0.005, (foot + frame_top) / 2 - 0.015)
        dome = lathe([(0, -0.004), (0.012, -0.004), (0.01, 0.006), (0, 0.008)], 7)
        buttons = join(*(moved(dome, spot) for spot in spots))
        found += [Piece("back", coats.cover, upright(panel, at, 4)), Piece("button", coats.cover, upright(buttons, at, 4))]
    return found


def _rolled(radius: float, low: float, top: float, length: float) -> Solid:
    """A wall along y about x = 0 whose top is a roll that overhangs to -X."""
    wall = 0.6 * radius
    a = np.linspace(-0.25, 1.25, 14) * np.pi
    roll = np.stack([-0.35 * radius + radius * 0.8 * np.cos(a), top - 0.8 * radius + 0.8 * radius * np.sin(a)], axis=1)
    xz: Float = np.vstack([[(wall, low)], roll[:0:-1][::-1], [(-wall, low)]])[::-1]
    ends = np.array([-length / 2, length / 2])
    scale = np.array([0.9, 1.0, 1.0, 0.9], np.float64)[:, None, None]
    y = np.array([ends[0], ends[0] + 0.025, ends[1] - 0.025, ends[1]])
    heart = np.array([0.0, (low + top) / 2], np.float64)
    plan = heart + (xz - heart) * scale
    depth = y[:, None] + np.zeros(len(xz))
    return loft(np.stack([plan[..., 0], depth, plan[..., 1]], axis=-1))


def _armrests(p: Sofa, coats: _Coats) -> list[Piece]:
    """Both arms."""
    x, y, low = p.inner, p.depth / 2, p.foot + 0.01
    if p.arms == "wood":
        return [Piece("armrest", coats.wood, both_sides(_wooden(p)))]
    if p.arms == "rolled":
        arm = moved(_rolled(p.arm / 1.45, low, p.arm_height, p.depth - 0.1), (-x - 0.4 * p.arm, -0.02, 0))
    elif p.arms == "sloped":
        arm = moved(_sloped(p, low), (-x - p.arm / 2, 0, 0))
    else:
        arm = padded((-x - p.arm, -y + 0.005, low), (-x, y - 0.01, p.arm_height), 0.045)
    return [Piece("armrest", coats.cover, both_sides(arm))]


def _sloped(p: Sofa, low: float) -> Solid:
    """An arm that falls towards the front."""
    share = np.linspace(0, 1, 12)
    y = -p.depth / 2 + 0.01 + share * (p.depth - 0.03)
    top = p.arm_height - 0.05 + (p.height - 0.08 - p.arm_height) * share**3
    size = np.array([0.93, *[1.0] * 10, 0.93])[:, None]
    outline = box_outline(1, 1, 0.24, 9)
    x, z = -outline[:, 0] * p.arm * size, (outline[:, 1] * size + 0.5) * (top - low)[:, None] + low
    return loft(np.dstack([x, np.broadcast_to(y[:, None], x.shape), z]))


def _wooden(p: Sofa) -> Solid:
    """An open arm of wood: two posts and a rest, at +X."""
    x, y, w = p.inner + 0.05, p.depth / 2, 0.05
    posts = [
        block((x - w / 2, at - w / 2, 0), (x + w / 2, at + w / 2, p.arm_height - 0.01), 0.008) for at in (-y + 0.06, y - 0.1)
    ]
    rest = block((x - 0.045, -y, p.arm_height - 0.035), (x + 0.045, y - 0.03, p.arm_height), 0.012)
    rail = block((x - 0.04, -y + 0.06, p.seat_height - 0.2), (x + 0.015, y - 0.08, p.seat_height - 0.13), 0.006)
    return join(*posts, rest, rail)


def _legs(p: Sofa, coats: _Coats) -> list[Piece]:
    """Feet under base and arms."""
    x = p.inner + (p.arm / 2 if p.arms != "wood" else -0.03)
    y, top = p.depth / 2 - 0.09, p.foot + 0.03
    at = [(sx * x, sy * y, sx, sy) for sx in (-1, 1) for sy in (-1, 1)]
    if s := _side(p):
        at += [(s * (p.inner - 0.08), -y - REACH, s, -1), (s * (p.inner - p.seat_width + 0.08), -y - REACH, -s, -1)]
    solids = [leg(p.leg, (a, b), top, 0.05, (u, v)) for a, b, u, v in at]
    return [Piece("leg", BRASS if p.leg == "hairpin" else coats.wood, join(*solids))]


def _loose(p: Sofa, coats: _Coats, rng: np.random.Generator) -> list[Piece]:
    """Pillows that lean in the corners, and a blanket over an arm."""
    found: list[Piece] = []
    for k in range(p.scattered):
        side, size = (-1, 1)[k % 2], float(rng.uniform(0.4, 0.48))
        x = side * (p.inner - 0.25 - 0.3 * (k // 2))
        body = turned(turned(pillow(size, size, 0.16), 2, float(rng.uniform(-0.2, 0.2))), 1, side * 0.25)
        y = p.seat_rear - 0.07 - 0.08 * (k // 2)
        found.append(Piece("pillow", coats.accents[k % 2], upright(body, (x, y, p.seat_height + 0.43 * size), 24)))
    if p.throw and p.arms == "track":
        a, b = -p.inner - p.arm, -p.inner
        middle = float(rng.uniform(-0.15, 0.1))
        rect = (a - 0.3, middle - 0.22, b + 0.12, middle + 0.22)
        found.append(Piece("throw", coats.accents[0], draped(rng, rect, (a, -9, b, 9), p.arm_height, 0.012, 0.006, 0.05)))
    return found


def surfaces(parameters: Sofa) -> tuple[LevelFace, ...]:
    """Each seat from the sitter's right (-X), in front of the cushions and pillows, and the end of a chaise."""
    p, front = parameters, -parameters.depth / 2
    rear = p.seat_rear - (0.3 if p.scattered else 0.04)
    edges = [-p.inner + k * p.seat_width for k in range(p.seats)]
    found = [
        LevelFace(f"seat_{k}", (x + 0.06, front + 0.07, x + p.seat_width - 0.06, rear), p.seat_height)
        for k, x in enumerate(edges, 1)
    ]
    if s := _side(p):
        x = edges[-1] if s > 0 else edges[0]
        place = (x + 0.06, front - REACH + 0.07, x + p.seat_width - 0.06, front - 0.02)
        found.append(LevelFace("chaise", place, p.seat_height))
    return tuple(found)


def sofa_random(rng: np.random.Generator) -> Mesh:
    """A sofa with parameters drawn to resemble sofas in real living rooms."""
    return sofa(draw(rng))


def draw(rng: np.random.Generator) -> Sofa:
    """The parameters of a random sofa."""
    arms: Arms = ("track", "rolled", "sloped", "wood")[int(rng.choice(4, p=(0.4, 0.25, 0.2, 0.15)))]
    backs: tuple[Back, ...] = ("cushions", "tufted", "plain") if arms != "wood" else ("cushions",)
    back = backs[int(rng.choice(3, p=(0.55, 0.25, 0.2)))] if len(backs) == 3 else "cushions"
    chaise: Chaise = ("left", "right")[int(rng.integers(2))] if arms == "track" and rng.random() < 0.4 else "none"
    leather = bool(rng.random() < 0.3)
    height = float(rng.uniform(0.74, 0.92))
    seats = int(rng.choice((2, 3, 4), p=(0.4, 0.5, 0.1)))
    feet: tuple[Leg, ...] = ("tapered", "square", "splayed", "turned")
    return Sofa(
        seats=3 if chaise != "none" or back == "tufted" else seats,
        seat_width=float(rng.uniform(0.56, 0.74)),
        depth=float(rng.uniform(0.84, 1.0)),
        height=height,
        seat_height=float(rng.uniform(0.4, 0.46)),
        arm=float(rng.uniform(0.1, 0.24)),
        arm_height=height - float(rng.uniform(0.0, 0.03) if back == "tufted" else rng.uniform(0.15, 0.27)),
        arms=arms,
        back=back,
        lean=float(rng.uniform(8, 16)),
        chaise=chaise,
        foot=float(rng.uniform(0.05, 0.16)),
        leg=feet[int(rng.integers(4))],
        scattered=int(rng.choice((0, 1, 2, 3, 4), p=(0.2, 0.1, 0.35, 0.15, 0.2))),
        throw=bool(rng.random() < 0.3),
        leather=leather,
        cover=Cloth(drawn_cover(rng, 1.0).color) if leather else drawn_cloth(rng, 0.12),
        accents=(drawn_cloth(rng, 0.4), drawn_cloth(rng, 0.7)),
        wood=drawn_wood(rng, 0.1),
        seed=int(rng.integers(1 << 31)),
    )


FAMILY = ZooFamily(
    random=sofa_random,
    home="floor",
    classes={"": "furniture"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
    surfaces=surfaces,
)
