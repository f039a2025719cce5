"""The load areas of a lorry: a box, a cold box, curtains, an open bed with sides, a tipper's tub."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere.assets.mesh import Material
from viewsphere_zoo.coachwork.coats import Coats
from viewsphere_zoo.coachwork.lorry import Frame
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.rods import rod
from viewsphere_zoo.shapes.solids import Float, Solid, both_sides, grid, join, loft, moved, rounded_box, turned
from viewsphere_zoo.townscape.lettering import lettering
from viewsphere_zoo.townscape.surfaces import cuboid


@dataclass(frozen=True)
class Skin:
    """Materials of the load area's walls, of the livery painted on them, and of its edges."""

    wall: Material
    mark: Material
    trim: Material
    wood: Material


def cargo_pieces(s: Frame, c: Coats, skin: Skin) -> list[Piece]:
    """Return the pieces of the load area, of the kind that the parameters name."""
    return {"box": _box, "cold_box": _cold, "curtain": _curtain, "dropside": _dropside, "tipper": _tipper}[s.p.load](s, c, skin)


def _box(s: Frame, c: Coats, skin: Skin) -> list[Piece]:
    """Smooth walls between metal edges, a livery, two doors behind."""
    (a, b), half, z, top = s.bed, s.p.width / 2, s.floor, s.p.height
    body = moved(rounded_box((2 * half - 0.02, b - a - 0.02, top - z), 0.02, 1), (0, (a + b) / 2, (z + top) / 2))
    return [Piece("cargo_box", skin.wall, body), *_edges(s, skin), *_livery(s, skin), *_rear_doors(s, c, skin)]


def _edges(s: Frame, skin: Skin) -> list[Piece]:
    """Rails along all edges and a corner post at each corner."""
    (a, b), half, z, top = s.bed, s.p.width / 2, s.floor, s.p.height
    t = 0.07
    solids: list[Solid] = []
    for x in (-half, half - t):
        solids += [cuboid((x, a, z - 0.02), (x + t, b, z + t)), cuboid((x, a, top - t), (x + t, b, top + 0.01))]
        solids += [cuboid((x, y, z), (x + t, y + t, top)) for y in (a, b - t)]
    for y in (a, b - t):
        solids += [cuboid((-half, y, z - 0.02), (half, y + t, z + t)), cuboid((-half, y, top - t), (half, y + t, top + 0.01))]
    return [Piece("cargo_frame", skin.trim, join(*solids))]


def _livery(s: Frame, skin: Skin) -> list[Piece]:
    """Stripes and a name on both sides."""
    p, (a, b), half, z, top = s.p, s.bed, s.p.width / 2, s.floor, s.p.height
    tall, x = top - z, half - 0.012
    found: list[Solid] = []
    if p.livery in ("stripe", "both"):
        found += [_wall_bar(a, b, z + 0.2 * tall, 0.12 * tall, x), _wall_bar(a, b, z + 0.36 * tall, 0.035 * tall, x)]
    if p.livery == "wedge":
        ring = np.array([(a + 0.1, z + 0.1), (b - 0.1, z + 0.1), (b - 0.1, z + 0.4 * tall), (a + 0.1, z + 0.16 * tall)])
        found.append(_slab(ring, x))
    solids = [both_sides(solid) for solid in found]
    if p.name:
        letters = lettering(p.name, min(0.26 * tall, 0.75), 0.012, 0.8 * (b - a))
        middle = ((a + b) / 2, z + 0.62 * tall)
        solids += [moved(turned(letters, 2, np.pi / 2), (x, *middle)), moved(turned(letters, 2, -np.pi / 2), (-x, *middle))]
    return [Piece("livery", skin.mark, join(*solids))] if solids else []


def _wall_bar(a: float, b: float, z: float, tall: float, x: float) -> Solid:
    return cuboid((x - 0.01, a + 0.08, z), (x + 0.008, b - 0.08, z + tall))


def _slab(ring: Float, x: float) -> Solid:
    """A thin plate over a ring in (y, z) on the left wall."""
    return loft(np.array([np.column_stack([np.full(len(ring), h), ring]) for h in (x - 0.01, x + 0.008)]))


def _rear_doors(s: Frame, c: Coats, skin: Skin) -> list[Piece]:
    """Two leaves with their seam, hinges and locking bars."""
    (_, b), half, z, top = s.bed, s.p.width / 2, s.floor, s.p.height
    leaf = cuboid((0.01, b - 0.03, z + 0.1), (half - 0.1, b + 0.012, top - 0.1))
    bars: list[Solid] = []
    for x in (-0.62 * half, -0.16 * half, 0.16 * half, 0.62 * half):
        bars.append(rod((x, b + 0.04, z + 0.02), (x, b + 0.04, top - 0.02), 0.018, 8))
        bars.append(cuboid((x - 0.06, b + 0.012, z + 0.95), (x + 0.22, b + 0.05, z + 1.0)))
        bars += [cuboid((x - 0.04, b + 0.01, h), (x + 0.04, b + 0.065, h + 0.09)) for h in (z + 0.15, top - 0.25)]
    hinges = [cuboid((half - 0.13, b + 0.01, h), (half - 0.02, b + 0.04, h + 0.1)) for h in np.linspace(z + 0.2, top - 0.35, 4)]
    return [
        Piece("cargo_door", skin.wall, both_sides(leaf)),
        Piece("cargo_door", c.steel, join(*bars, both_sides(join(*hinges)))),
        Piece(
            "cargo_frame", c.red_lamp, both_sides(moved(rounded_box((0.12, 0.04, 0.06), 0.01, 1), (half - 0.12, b, top - 0.04)))
        ),
    ]


def _cold(s: Frame, c: Coats, skin: Skin) -> list[Piece]:
    """A box with a cooling unit above the cab."""
    (a, _), top = s.bed, s.p.height
    tall = min(0.75, top - s.p.cab_height + 0.45)
    unit = moved(rounded_box((0.66 * s.p.width, 0.5, tall), 0.06, 2), (0, a - 0.22, top - tall / 2 - 0.05))
    vents = [
        cuboid((-0.28 * s.p.width, a - 0.5, h), (0.28 * s.p.width, a - 0.44, h + 0.03))
        for h in np.arange(top - tall + 0.05, top - 0.15, 0.08)
    ]
    return [*_box(s, c, skin), Piece("cooling_unit", skin.wall, unit), Piece("cooling_unit", c.black, join(*vents))]


def _curtain(s: Frame, c: Coats, skin: Skin) -> list[Piece]:
    """Tarpaulins that hang in shallow folds between straps."""
    (a, b), half, z, top = s.bed, s.p.width / 2, s.floor, s.p.height
    y = np.linspace(a + 0.07, b - 0.07, 60)
    fold = 0.012 * np.sin(2 * np.pi * (y - a) / 0.6)
    heights = np.array([z + 0.03, z + 0.25, (z + top) / 2, top - 0.12, top - 0.02])
    depth = np.array([0.0, 1.0, 1.0, 1.0, 0.0])
    points = np.empty((len(y), 5, 3))
    points[..., 0] = half - 0.02 + fold[:, None] * depth
    points[..., 1], points[..., 2] = y[:, None], heights
    sheet = both_sides(grid(points))
    core = cuboid((-half + 0.04, a + 0.02, z), (half - 0.04, b - 0.02, top))
    places = np.arange(a + 0.45, b - 0.2, 0.6)
    straps = [cuboid((half - 0.02, v - 0.02, z - 0.04), (half + 0.004, v + 0.02, z + 0.55)) for v in places]
    buckles = [cuboid((half - 0.02, v - 0.035, z + 0.05), (half + 0.012, v + 0.035, z + 0.16)) for v in places]
    return [
        Piece("cargo_box", skin.trim, core),
        Piece("curtain", skin.wall, sheet),
        Piece("strap", c.black, both_sides(join(*straps))),
        Piece("strap", c.steel, both_sides(join(*buckles))),
        *_edges(s, skin),
        *_livery(s, skin),
        *_rear_doors(s, c, skin),
    ]


def _bed(s: Frame, tall: float, skin: Skin, c: Coats) -> list[Piece]:
    """A floor with boards of this height around it, and a wall behind the cab."""
    (a, b), half, z = s.bed, s.p.width / 2, s.floor
    floor = cuboid((-half, a, z - 0.12), (half, b, z + 0.02))
    t = 0.04
    walls = [cuboid((x, a + 0.05, z), (x + t, b, z + tall)) for x in (-half, half - t)]
    walls.append(cuboid((-half + t, b - t, z), (half - t, b, z + tall)))
    count = max(2, round((b - a) / 2.2))
    posts = [
        cuboid((half - 0.06, y - 0.04, z - 0.1), (half + 0.02, y + 0.04, z + tall + 0.03))
        for y in np.linspace(a + 0.09, b - 0.04, count + 1)
    ]
    board = max(tall, s.p.cab_height - z - 0.35)
    head = [
        cuboid((-half, a, z), (half, a + 0.06, z + tall)),
        *(cuboid((-half, a, z + h), (half, a + 0.05, z + h + 0.09)) for h in (board - 0.09, (board + tall) / 2)),
    ]
    head += [cuboid((x - 0.05, a, z), (x + 0.05, a + 0.06, z + board)) for x in np.linspace(-half + 0.05, half - 0.05, 5)]
    return [
        Piece("cargo_bed", skin.wood, floor),
        Piece("cargo_bed", skin.wall, join(*walls)),
        Piece("cargo_frame", c.under, both_sides(join(*posts))),
        Piece("headboard", skin.trim, join(*head)),
    ]


def _dropside(s: Frame, c: Coats, skin: Skin) -> list[Piece]:
    """An open bed with low sides; crates or pipes on it."""
    (a, b), half, z = s.bed, s.p.width / 2, s.floor + 0.02
    pieces = _bed(s, 0.42, skin, c)
    if s.p.goods == "crates":
        step = 1.15
        solids: list[Solid] = []
        for k, y in enumerate(np.arange(a + 0.75, b - 0.6, step)):
            for x in (-0.28 * s.p.width, 0.28 * s.p.width):
                tall = 0.75 + 0.3 * ((k * 7 + (x > 0) * 3) % 4) / 3
                solids.append(cuboid((x - 0.5, y - 0.5, z), (x + 0.5, y + 0.5, z + tall)))
                solids += [cuboid((x - 0.52, y - 0.52, z + h), (x + 0.52, y + 0.52, z + h + 0.09)) for h in (0.02, tall - 0.07)]
        pieces.append(Piece("load", skin.wood, join(*solids)))
    if s.p.goods == "pipes":
        rows = [
            (x, z + 0.16 + 0.28 * r) for r in range(3) for x in np.arange(-half + 0.25 + 0.16 * r, half - 0.2 - 0.16 * r, 0.325)
        ]
        pieces.append(Piece("load", skin.mark, join(*(rod((x, a + 0.2, h), (x, b - 0.15, h), 0.155, 12) for x, h in rows))))
    return pieces


def _tipper(s: Frame, c: Coats, skin: Skin) -> list[Piece]:
    """A ribbed tub with a heap in it, and a guard over the cab."""
    (a, b), half, z = s.bed, s.p.width / 2, s.floor
    tall, t = 1.15 if s.p.wheel_radius > 0.42 else 0.7, 0.06
    walls = [cuboid((x, a, z), (x + t, b, z + tall)) for x in (-half + 0.05, half - 0.05 - t)]
    walls += [cuboid((-half + 0.05, y, z), (half - 0.05, y + t, z + tall)) for y in (a, b - t)]
    floor = cuboid((-half + 0.05, a, z - 0.1), (half - 0.05, b, z + 0.05))
    places = np.linspace(a + 0.1, b - 0.1, max(4, round((b - a) / 0.75)))
    ribs = [cuboid((half - 0.06, y - 0.05, z - 0.05), (half + 0.02, y + 0.05, z + tall)) for y in places]
    ribs += [cuboid((half - 0.07, a - 0.01, z + tall - 0.1), (half + 0.03, b + 0.01, z + tall + 0.02))]
    rear = [cuboid((x - 0.05, b - 0.02, z), (x + 0.05, b + 0.05, z + tall)) for x in (-0.6 * half, 0.0, 0.6 * half)]
    pieces = [
        Piece("cargo_bed", skin.wall, join(*walls, floor)),
        Piece("cargo_frame", skin.wall, join(both_sides(join(*ribs)), *rear)),
    ]
    if tall > 1.0:
        shield = cuboid((-half + 0.1, a - 0.75, z + tall + 0.42), (half - 0.1, a + 0.05, z + tall + 0.48))
        wall = cuboid((-half + 0.1, a - 0.01, z + tall - 0.05), (half - 0.1, a + 0.05, z + tall + 0.45))
        pieces.append(Piece("headboard", skin.wall, join(shield, wall)))
    if s.p.goods != "none":
        pieces.append(Piece("load", skin.wood, _heap(a + t, b - t, half - 0.1, z + tall - 0.15)))
    return pieces


def _heap(a: float, b: float, half: float, z: float) -> Solid:
    """Gravel with a rounded top."""
    x, y = np.meshgrid(np.linspace(-1, 1, 13), np.linspace(-1, 1, 21))
    rise = 0.42 * (1 - x**2) * (1 - y**4) + 0.035 * np.sin(9 * x + 4 * y) * np.sin(7 * y - 2 * x)
    points = np.stack([x * half, (a + b) / 2 + y * (b - a) / 2, z + rise], axis=-1)
    return grid(points.transpose(1, 0, 2))
