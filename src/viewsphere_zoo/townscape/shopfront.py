"""A shop's front on a ground floor: windows and door between pilasters, the sign above them, an awning, a hanging sign.

Like a facade, it is in y = 0 and faces -Y, its middle at x = 0, its foot at z = 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import Color
from viewsphere_zoo.shapes.rods import rod
from viewsphere_zoo.shapes.solids import Solid, join, lathe, moved, rounded_box, turned
from viewsphere_zoo.townscape.lettering import lettering
from viewsphere_zoo.townscape.masonry import REVEAL, Bars, Opening
from viewsphere_zoo.townscape.surfaces import cuboid, prism

Roof = Literal["flat", "pitched", "mansard"]


Wall = Literal["brick", "stone", "plaster"]


@dataclass(frozen=True)
class Shop:
    """Parameters of a town building; lengths in metres, colours sRGB 0..1.

    width: from party wall to party wall; storeys: with the ground floor; ground, storey: heights of the ground floor and of
    each floor above; side_door: the flats' door at the left (1, +X), right (-1) or nowhere in front (0); door, pane, riser,
    transom: the shop's door, width of its panes, height of the wall below them, bars near their top; name: on the signs,
    capitals; awning: how far it reaches out, 0 for none; balconies: their depth, 0 for none; painted: the name on the party
    walls; chimneys: sides that have one; seed draws the rest: curtains, goods, grain.
    """

    width: float = 7.0
    depth: float = 10.0
    storeys: int = 3
    ground: float = 3.9
    storey: float = 3.0
    wall: Wall = "brick"
    roof: Roof = "pitched"
    slope: float = 0.75
    dormers: bool = False
    gabled: bool = True
    hut: bool = False
    chimneys: tuple[int, ...] = (1,)
    pitch: float = 2.3
    window: float = 1.1
    bars: Bars = "sash"
    surrounds: bool = True
    courses: bool = True
    quoins: bool = False
    dentils: bool = True
    painted: bool = True
    balconies: float = 0.0
    side_door: int = 1
    door: Literal["left", "middle", "right"] = "middle"
    pane: float = 1.3
    riser: float = 0.55
    transom: bool = True
    awning: float = 1.2
    striped: bool = True
    hanging_sign: Literal["", "round", "square"] = ""
    name: str = "BAKERY"
    wall_color: Color = (0.6, 0.34, 0.26)
    trim_color: Color = (0.86, 0.84, 0.79)
    roof_color: Color = (0.33, 0.34, 0.37)
    frame_color: Color = (0.93, 0.93, 0.91)
    front_color: Color = (0.1, 0.24, 0.18)
    board_color: Color = (0.1, 0.24, 0.18)
    letter_color: Color = (0.93, 0.86, 0.6)
    awning_color: Color = (0.7, 0.1, 0.1)
    seed: int = 0

    @property
    def height(self) -> float:
        """Height of the walls, metres."""
        return self.ground + (self.storeys - 1) * self.storey


FASCIA = 0.7
"""Height of the board that bears the name, metres."""

SIDE_DOOR = 1.0
"""Width of the door to the flats, metres."""


@dataclass(frozen=True)
class ShopCoats:
    """Materials of a shop's front."""

    frame: Material
    board: Material
    letters: Material
    glass: Material
    shade: Material
    stripe: Material
    goods: tuple[Material, ...]
    step: Material
    metal: Material


@dataclass(frozen=True)
class Bay:
    """The opening for the shop's windows: its middle and width, and its height above the ground, metres."""

    x: float
    width: float
    height: float


def bay(p: Shop) -> Bay:
    """Return the bay of the shop's windows: the whole width except pilasters and the door to the flats."""
    free = p.width - 0.7 - (SIDE_DOOR + 0.45 if p.side_door else 0.0)
    return Bay((p.width - 0.7 - free) / 2 * -p.side_door, free, p.ground - FASCIA - 0.25)


def side_door(p: Shop) -> Opening | None:
    """The door to the flats."""
    x = p.side_door * (p.width / 2 - 0.35 - SIDE_DOOR / 2 - 0.05)
    return Opening(x, 0.12, SIDE_DOOR, min(2.45, p.ground - FASCIA - 0.4), "door") if p.side_door else None


def shop_pieces(p: Shop, c: ShopCoats, rng: np.random.Generator) -> list[Piece]:
    """Return the pieces of the front."""
    pieces = [*_windows(p, c, rng), *_fascia(p, c)]
    if p.awning:
        pieces += _awning(p, c)
    if p.hanging_sign:
        pieces += _hanging(p, c)
    return pieces


def _windows(p: Shop, c: ShopCoats, rng: np.random.Generator) -> list[Piece]:
    """Panes over a riser, and a glazed door at its position in the plan."""
    b = bay(p)
    x0, door = b.x - b.width / 2, 1.05
    start = x0 + {"left": 0.1, "middle": (b.width - door) / 2, "right": b.width - door - 0.1}[p.door]
    spans = [s for s in ((x0, start), (start + door, x0 + b.width)) if s[1] - s[0] > 0.5]
    riser = p.riser
    wood = [cuboid((a, 0.01, 0.0), (z, REVEAL + 0.05, riser)) for a, z in spans]
    wood += [cuboid((a + 0.12, -0.012, 0.1), (z - 0.12, 0.02, riser - 0.1)) for a, z in spans if riser > 0.3]
    wood.append(cuboid((x0, 0.0, b.height - 0.1), (x0 + b.width, REVEAL, b.height + 0.01)))
    glass, goods = [], []
    for a, z in spans:
        count = max(1, round((z - a) / p.pane))
        edge = np.linspace(a, z, count + 1)
        wood += [cuboid((e - 0.035, 0.02, riser), (e + 0.035, REVEAL, b.height)) for e in edge]
        if p.transom:
            wood.append(cuboid((a, 0.03, 0.8 * b.height), (z, REVEAL, 0.8 * b.height + 0.06)))
        glass.append(cuboid((a, REVEAL - 0.04, riser), (z, REVEAL + 0.05, b.height)))
        goods.append((a + 0.1, z - 0.1))
    leaf = [
        cuboid((start + s * (door - 0.12), 0.06, 0.1), (start + s * (door - 0.12) + 0.12, REVEAL + 0.04, b.height - 0.35))
        for s in (0, 1)
    ]
    leaf += [cuboid((start, 0.06, z), (start + door, REVEAL + 0.04, z + h)) for z, h in ((0.1, 0.3), (b.height - 0.45, 0.12))]
    pane = cuboid((start + 0.02, REVEAL - 0.03, 0.12), (start + door - 0.02, REVEAL + 0.05, b.height))
    handle = rod((start + door - 0.16, 0.02, 0.95), (start + door - 0.16, 0.02, 1.35), 0.018, 6)
    pieces = [
        Piece("shop_frame", c.frame, join(*wood)),
        Piece("shop_window", c.glass, join(*glass)),
        Piece("shop_door", c.frame, join(*leaf)),
        Piece("shop_door", c.glass, pane),
        Piece("door_handle", c.metal, handle),
        Piece("step", c.step, cuboid((start - 0.05, -0.22, 0), (start + door + 0.05, REVEAL, 0.1))),
    ]
    return [*pieces, *_goods(goods, riser, c, rng)]


def _goods(spans: list[tuple[float, float]], riser: float, c: ShopCoats, rng: np.random.Generator) -> list[Piece]:
    """Return the displayed goods, right behind the panes."""
    by_material: dict[int, list[Solid]] = {}
    for a, z in spans:
        x = a
        while x < z - 0.15:
            w, h = float(rng.uniform(0.12, 0.34)), float(rng.uniform(0.15, 0.75))
            box = cuboid((x, REVEAL - 0.05, riser), (min(x + w, z), REVEAL - 0.035, riser + h))
            by_material.setdefault(int(rng.integers(len(c.goods))), []).append(box)
            x += w + float(rng.uniform(0.03, 0.2))
    return [Piece("goods", c.goods[k], join(*solids)) for k, solids in sorted(by_material.items())]


def _fascia(p: Shop, c: ShopCoats) -> list[Piece]:
    """Pilasters, the board with the name, a cornice over it."""
    low, half = p.ground - FASCIA - 0.15, p.width / 2
    board = cuboid((-half + 0.04, -0.14, low), (half - 0.04, 0.02, low + FASCIA))
    cornice = [
        cuboid((-half, -0.2 - d, low + FASCIA + z), (half, 0.02, low + FASCIA + z + 0.06))
        for d, z in ((0.0, 0.0), (0.07, 0.055))
    ]
    edges = [-half + 0.17, half - 0.17]
    if p.side_door:
        edges.append(-p.side_door * (bay(p).x * -p.side_door - bay(p).width / 2 - 0.2))
    posts = [cuboid((x - 0.14, -0.07, 0.0), (x + 0.14, 0.02, low + 0.01)) for x in edges]
    posts += [cuboid((x - 0.17, -0.1, z), (x + 0.17, 0.02, z + h)) for x in edges for z, h in ((0.0, 0.28), (low - 0.2, 0.2))]
    at = (0.0, -0.14, low + FASCIA / 2)
    text = moved(lettering(p.name, 0.64 * FASCIA, 0.03, p.width - 0.9), at)
    return [
        Piece("sign", c.board, board),
        Piece("sign", c.letters, text),
        Piece("shop_cornice", c.frame, join(*cornice)),
        Piece("pilaster", c.frame, join(*posts)),
    ]


def _awning(p: Shop, c: ShopCoats) -> list[Piece]:
    """A sloping cloth in stripes, with a valance, on two arms."""
    b, low = bay(p), p.ground - FASCIA - 0.17
    half, out, drop = b.width / 2 + 0.1, p.awning, 0.42 * p.awning
    count = max(3, round(2 * half / 0.32)) | 1
    edge = np.linspace(b.x - half, b.x + half, count + 1)
    cloth: list[list[Solid]] = [[], []]
    for k in range(count):
        top = [(-0.1, low), (-0.1, low + 0.025), (-out, low - drop + 0.025), (-out, low - drop)]
        cloth[k % 2].append(prism(top, edge[k], edge[k + 1], axis=0))
        cloth[k % 2].append(cuboid((edge[k], -out - 0.012, low - drop - 0.2), (edge[k + 1], -out + 0.008, low - drop + 0.02)))
    arms = [
        rod((x, -0.05, low - drop - 0.3), (x, -out + 0.02, low - drop - 0.01), 0.016, 6)
        for x in (b.x - half + 0.05, b.x + half - 0.05)
    ]
    return [
        Piece("awning", c.shade, join(*cloth[0])),
        Piece("awning", c.stripe if p.striped else c.shade, join(*cloth[1])),
        Piece("awning", c.metal, join(*arms)),
    ]


def _hanging(p: Shop, c: ShopCoats) -> list[Piece]:
    """A sign that stands out from the wall, above the board."""
    z, x = p.ground + 0.75, 0.36 * p.width
    arm = join(rod((x, 0.02, z + 0.32), (x, -0.85, z + 0.32), 0.018, 6), rod((x, 0.02, z), (x, -0.5, z + 0.31), 0.012, 6))
    if p.hanging_sign == "round":
        plate = turned(lathe([(0, -0.04), (0.3, -0.04), (0.3, 0.04), (0, 0.04)], 20), 1, np.pi / 2)
    else:
        plate = rounded_box((0.07, 0.55, 0.55), 0.02, 1)
    mark = join(*(moved(turned(lettering(p.name[0], 0.32, 0.012), 2, s * np.pi / 2), (s * 0.038, 0, 0)) for s in (-1, 1)))
    at = (x, -0.5, z)
    return [
        Piece("hanging_sign", c.metal, arm),
        Piece("hanging_sign", c.board, moved(plate, at)),
        Piece("hanging_sign", c.letters, moved(mark, at)),
    ]
