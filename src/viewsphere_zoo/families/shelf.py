"""Shelves: bookcases, grids of cubes, ladders and steel racks, empty or with books."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Mesh
from viewsphere.model.annotations.keypoints import sided
from viewsphere.model.place import LevelFace
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.furnishing.casework import block, footed
from viewsphere_zoo.furnishing.coats import BLACK_STEEL, WHITE_STEEL, Timber, Wood, drawn_wood, furnished, grain
from viewsphere_zoo.furnishing.stock import books, box, vase
from viewsphere_zoo.joinery.coats import BRASS, STEEL
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.rods import rod
from viewsphere_zoo.shapes.solids import join

KEYPOINTS = {
    **sided("top_front", "upright", (1, -1, 1)),
    **sided("top_rear", "upright", (1, 1, 1)),
    **sided("foot_front", "upright", (1, -1, -1)),
    **sided("foot_rear", "upright", (1, 1, -1)),
}
SKELETON = (
    ("top_front_left", "top_front_right"),
    ("top_front_left", "foot_front_left"),
    ("top_front_right", "foot_front_right"),
    ("top_rear_left", "foot_rear_left"),
    ("top_rear_right", "foot_rear_right"),
    ("foot_front_left", "foot_front_right"),
)

Style = Literal["bookcase", "cubes", "ladder", "rack"]
Metal = Literal["black", "white", "brass", "steel"]
METALS = {"black": BLACK_STEEL, "white": WHITE_STEEL, "brass": BRASS, "steel": STEEL}


@dataclass(frozen=True)
class Shelf:
    """Parameters of a shelf; lengths in metres.

    boards: levels on which things stand, the topmost included; columns: bays side by side; thickness: of boards and sides;
    back: a closed rear, or crossed braces of a rack; plinth: height of the lowest board's underside; crown: a moulding on top;
    filled: share of the bays with something in them; planked: whether a rack's boards are wooden; seed: of the grain and the
    contents.
    """

    style: Style = "bookcase"
    width: float = 0.9
    depth: float = 0.3
    height: float = 1.9
    boards: int = 6
    columns: int = 1
    thickness: float = 0.022
    back: bool = False
    plinth: float = 0.07
    crown: bool = False
    filled: float = 0.5
    metal: Metal = "black"
    planked: bool = True
    wood: Wood = field(default_factory=Wood)
    seed: int = 0

    @property
    def tops(self) -> list[float]:
        """Heights of the boards' upper faces from below."""
        low = self.plinth + self.thickness
        high = self.height - (0.08 if self.style == "rack" else 0.14 if self.style == "ladder" else 0.0)
        if self.style == "cubes":
            return np.linspace(low, high, self.boards).tolist()
        share = np.linspace(0, 1, self.boards)
        return (low + (high - low) * (share + 0.06 * np.sin(np.pi * share))).tolist()

    @property
    def edges(self) -> list[float]:
        """x of the middles of the upright boards, ascending."""
        half = (self.width - self.thickness) / 2
        return np.linspace(-half, half, self.columns + 1).tolist()

    def deep(self, level: int) -> float:
        """Depth of this board: a ladder shelf's boards get deeper downwards."""
        if self.style != "ladder":
            return self.depth - (0.02 if self.style == "rack" else 0.0)
        return self.depth * (1.0 - 0.62 * level / max(self.boards - 1, 1))


def shelf(parameters: Shelf | None = None) -> Mesh:
    """The shelf in metres: open towards -Y, feet on z = 0, centred in x and y.

    Parts: upright, board; back, brace, plinth, crown by style; book, box, vase for its contents.
    """
    p = parameters or Shelf()
    rng = np.random.default_rng(p.seed)
    images = [grain(rng, p.wood)]
    timber = p.wood.timber(0)
    return furnished([*_uprights(p, timber), *_boards(p, timber), *_rear(p, timber), *_stock(p, rng)], images)


def _uprights(p: Shelf, timber: Timber) -> list[Piece]:
    """Sides and partitions, posts of a rack or a leaning ladder's rails."""
    y, t = p.depth / 2, p.thickness / 2
    if p.style == "rack":
        s = 0.014
        posts = [
            block(
                (sx * (p.width / 2 - s) - s, sy * (y - s) - s, 0),
                (sx * (p.width / 2 - s) + s, sy * (y - s) + s, p.height),
                0.002,
            )
            for sx in (-1, 1)
            for sy in (-1, 1)
        ]
        return [Piece("upright", METALS[p.metal], join(*posts))]
    if p.style == "ladder":
        rails = []
        for x in (-p.width / 2 + t, p.width / 2 - t):
            low, high = np.array((x, -y + 0.02, 0)), np.array((x, y - 0.03, p.height))
            rails += [footed(rod(low, high, 1.3 * t, 4)), block((x - t, y - 0.05, 0), (x + t, y - 0.015, p.height - 0.01))]
        return [Piece("upright", timber.upright, join(*rails))]
    boards = [
        block((x - t, -y, 0 if k in (0, p.columns) else p.plinth), (x + t, y, p.height - 0.0005)) for k, x in enumerate(p.edges)
    ]
    return [Piece("upright", timber.upright, join(*boards))]


def _boards(p: Shelf, timber: Timber) -> list[Piece]:
    """Return the boards, between the sides or over the whole width."""
    half = p.width / 2 - (0.001 if p.style in ("rack", "ladder") else 0.5 * p.thickness)
    solids = []
    for k, z in enumerate(p.tops):
        rear = p.depth / 2 - (0.01 if p.style == "rack" or p.back else 0.0)
        x = p.width / 2 if p.style in ("bookcase", "cubes") and k == p.boards - 1 else half
        solids.append(block((-x, rear - p.deep(k), z - p.thickness), (x, rear, z), 0.002))
    coat = timber.along if p.planked or p.style != "rack" else METALS[p.metal]
    found = [Piece("board", coat, join(*solids))]
    if p.crown and p.style == "bookcase":
        a, b = p.width / 2, p.depth / 2
        steps = [
            block((-a - e, -b - e, p.height - 0.075 + h), (a + e, b, p.height - 0.05 + h))
            for e, h in ((0.012, 0), (0.03, 0.024))
        ]
        found.append(Piece("crown", timber.along, join(*steps)))
    return found


def _rear(p: Shelf, timber: Timber) -> list[Piece]:
    """A back, a plinth's front, or a rack's braces."""
    x, y = p.width / 2, p.depth / 2
    if p.style == "rack":
        z = p.tops
        lines = [((-x, z[0]), (x, z[-1])), ((x, z[0]), (-x, z[-1]))] if p.back else []
        braces = [rod((a[0], y - 0.004, a[1]), (b[0], y - 0.004, b[1]), 0.004, 6) for a, b in lines]
        s = 0.01
        braces += [
            block((e * (x - 0.014) - s, -y, h - 0.04), (e * (x - 0.014) + s, y, h - 0.02), 0.002) for h in z for e in (-1, 1)
        ]
        return [Piece("brace", METALS[p.metal], join(*braces))]
    found: list[Piece] = []
    if p.style != "ladder":
        front = block((-x + p.thickness, -y + 0.02, 0), (x - p.thickness, -y + 0.036, p.plinth))
        found.append(Piece("plinth", timber.along, front))
        if p.back:
            found.append(
                Piece(
                    "back",
                    timber.upright,
                    block((-x + 0.004, y - 0.007, p.plinth), (x - 0.004, y - 0.001, p.height - 0.004), 0.001),
                )
            )
    return found


def _bays(p: Shelf) -> list[tuple[float, float, int]]:
    """Inner x range and level of all bays from below; the top of a shelf counts as bays too."""
    t = p.thickness / 2
    if p.style in ("rack", "ladder"):
        return [(-p.width / 2 + 0.04, p.width / 2 - 0.04, k) for k in range(p.boards)]
    return [(a + t, b - t, k) for k in range(p.boards - 1) for a, b in pairwise(p.edges)]


def _free(p: Shelf, level: int) -> float:
    """Free height above a board, up to the next board or to the crown's moulding."""
    if level + 1 == p.boards:
        return float("inf")
    crown = p.crown and p.style == "bookcase" and level + 2 == p.boards
    return p.tops[level + 1] - (max(p.thickness, 0.076) if crown else p.thickness) - p.tops[level]


def _taken(p: Shelf) -> dict[int, str]:
    """Return the kind of content of each filled bay, by the bay's number: books, a box, a vase."""
    rng = np.random.default_rng((p.seed, 1))
    kinds = ("books", "books", "books", "box", "vase")
    taken = {}
    for number in range(len(_bays(p))):
        draw, kind = rng.random(), kinds[int(rng.integers(5))]
        if draw < p.filled:
            taken[number] = kind
    return taken


def _stock(p: Shelf, rng: np.random.Generator) -> list[Piece]:
    """Return the pieces in the filled bays."""
    found: list[Piece] = []
    bays = _bays(p)
    for number, kind in _taken(p).items():
        x0, x1, level = bays[number]
        high, deep = min(_free(p, level), 0.34), p.deep(level) - (0.02 if p.back else 0.0)
        low = (x0 + 0.004, p.depth / 2 - p.deep(level) + 0.01, p.tops[level])
        wide = x1 - x0 - 0.008
        if kind == "box" and wide < 0.55 and p.style != "ladder":
            found += box(rng, low, wide, deep - 0.01, high)
        elif kind == "vase" and deep > 0.15:
            tall = min(0.8 * high, 0.26)
            found += vase(rng, ((x0 + x1) / 2, low[1] + deep / 2 - 0.01, low[2]), tall)
        else:
            share = float(rng.uniform(0.45, 1.0)) * min(1.0, 0.75 / wide)
            found += books(rng, low, wide, deep - 0.02, high, share)
    return found


def surfaces(parameters: Shelf) -> tuple[LevelFace, ...]:
    """The boards of empty bays, and the top of a shelf that ends in a board."""
    p = parameters
    taken, rear = _taken(p), p.depth / 2 - 0.02
    found = [
        LevelFace(f"board_{number}", (x0 + 0.02, rear - p.deep(level) + 0.04, x1 - 0.02, rear), p.tops[level], _free(p, level))
        for number, (x0, x1, level) in enumerate(_bays(p))
        if number not in taken and p.deep(level) > 0.14 and _free(p, level) > 0.08
    ]
    if p.style in ("bookcase", "cubes"):
        top = (-p.width / 2 + 0.02, -p.depth / 2 + 0.02, p.width / 2 - 0.02, p.depth / 2 - 0.02)
        found.append(LevelFace("top", top, p.tops[-1]))
    return tuple(found)


def shelf_random(rng: np.random.Generator) -> Mesh:
    """A shelf with parameters drawn to resemble shelves in homes and offices."""
    return shelf(draw(rng))


def draw(rng: np.random.Generator) -> Shelf:
    """The parameters of a random shelf."""
    style: Style = ("bookcase", "cubes", "ladder", "rack")[int(rng.choice(4, p=(0.42, 0.25, 0.13, 0.2)))]
    cell = float(rng.uniform(0.33, 0.4))
    columns, rows = int(rng.choice((1, 2, 2, 3))), int(rng.integers(3, 6))
    if style == "cubes":
        columns, rows = int(rng.integers(2, 5)), int(rng.integers(2, 6))
    elif style in ("ladder", "rack"):
        columns = 1
    width = columns * (cell if style == "cubes" else float(rng.uniform(0.55, 0.9) if columns == 1 else rng.uniform(0.45, 0.7)))
    height = rows * cell + 0.06 if style == "cubes" else float(rng.uniform(1.6, 2.05) if rows > 3 else rng.uniform(0.95, 1.5))
    return Shelf(
        style=style,
        width=width,
        depth=float(rng.uniform(0.36, 0.46) if style == "ladder" else rng.uniform(0.28, 0.4)),
        height=height,
        boards=rows + 1,
        columns=columns,
        thickness=float(rng.uniform(0.018, 0.038)),
        back=bool(rng.random() < (0.6 if style == "rack" else 0.04)),
        plinth=float(rng.uniform(0.12, 0.2) if style in ("rack", "ladder") else rng.uniform(0.03, 0.1)),
        crown=bool(rng.random() < 0.3),
        filled=float(rng.choice((0.0, 0.4, 0.75), p=(0.2, 0.4, 0.4))),
        metal=("black", "white", "brass", "steel")[int(rng.integers(4))],
        planked=bool(rng.random() < 0.8),
        wood=drawn_wood(rng, 0.35),
        seed=int(rng.integers(1 << 31)),
    )


FAMILY = ZooFamily(
    random=shelf_random,
    home="floor",
    classes={"": "furniture", "book": "household item", "box": "household item", "vase": "household item"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
    surfaces=surfaces,
)
