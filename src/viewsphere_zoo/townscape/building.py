"""A complete house: blocks of four facades under a roof, and their fittings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Image, Material
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import Color, coated, linear, metal
from viewsphere_zoo.shapes.solids import Solid, join, moved, tube, turned
from viewsphere_zoo.townscape import roofs, textures
from viewsphere_zoo.townscape.masonry import Bars, Joinery, Opening, facade, filled
from viewsphere_zoo.townscape.surfaces import cuboid
from viewsphere_zoo.townscape.textures import textured

GARAGE = 3.4
"""Width of a garage's block, metres."""

WING = 1.3
"""Distance by which a wing projects from the front, metres."""

STOREY = 2.75
FLOOR = 0.18
"""Height of the ground floor above the ground, metres."""

SEAM = FLOOR + STOREY + 0.5
"""Height at which the upper storey's wall begins if it differs from the wall below, metres."""


Roof = Literal["gable", "front_gable", "hip", "flat"]


Wall = Literal["brick", "plaster", "boards"]


Porch = Literal["none", "canopy", "posts"]


@dataclass(frozen=True)
class House:
    """Parameters of a house; lengths in metres, colours sRGB 0..1.

    width, depth: of the main block; roof: gable has its ridge across the front, front_gable shows its gable there; slope: rise
    over run; wing: whether a narrow gabled block projects from the front; garage: 1 on the house's left (+X), -1 right, 0 none;
    upper: the wall of the upper storey or gable, None if it matches the wall below; seed draws the rest: curtains, grain.
    """

    width: float = 9.5
    depth: float = 8.0
    storeys: int = 2
    roof: Roof = "gable"
    slope: float = 0.75
    eaves: float = 0.4
    wing: bool = False
    garage: int = 1
    dormers: int = 0
    porch: Porch = "canopy"
    chimney: bool = True
    wall: Wall = "brick"
    upper: Wall | None = None
    wall_color: Color = (0.6, 0.34, 0.26)
    upper_color: Color = (0.9, 0.88, 0.83)
    roof_color: Color = (0.34, 0.2, 0.16)
    roof_wave: float = 0.35
    trim_color: Color = (0.93, 0.93, 0.91)
    door_color: Color = (0.1, 0.22, 0.16)
    bars: Bars = "cross"
    shutters: bool = False
    seed: int = 0

    @property
    def footprint(self) -> tuple[float, float]:
        """Width and depth of the outline of all walls."""
        return self.width + (GARAGE if self.garage else 0.0), self.depth + (WING if self.wing else 0.0)

    @property
    def garage_x(self) -> float | None:
        """x of the middle of the garage's door, None without one."""
        return self.garage * self.width / 2 if self.garage else None

    @property
    def door_x(self) -> float:
        """x of the middle of the front door."""
        return layout(self).door_x - self.garage * GARAGE / 2


@dataclass(frozen=True)
class Layout:
    """The positions on the front: columns of windows, the door, the wing; x from the middle of the main block, metres."""

    columns: tuple[float, ...]
    door_x: float
    wing_x: float
    wing_width: float


@dataclass(frozen=True)
class Fabric:
    """The materials of one house."""

    wall: Material
    upper: Material
    roof: Material
    trim: Material
    stone: Material
    clay: Material
    pipe: Material
    joinery: Joinery


def layout(p: House) -> Layout:
    """Columns spread evenly; the wing on the side away from the garage, the door in the column next to it."""
    count = 3 if p.width > 7.8 else 2
    pitch = p.width / count
    columns = tuple((k - (count - 1) / 2) * pitch for k in range(count))
    side = -p.garage or 1
    wing_width = min(3.7, pitch + 0.7)
    wing_x = side * (p.width / 2 - wing_width / 2 - 0.45) if p.wing else 0.0
    door_x = columns[1] if count == 3 else columns[0 if side > 0 else 1]
    return Layout(columns, door_x - side * (0.75 if p.wing else 0.0), wing_x, wing_width if p.wing else 0.0)


def images(p: House, rng: np.random.Generator) -> list[Image]:
    """Textures of wall, upper wall and roof."""
    roof = textures.plaster(rng, "gravel", (0.5, 0.49, 0.47), 0.2) if p.roof == "flat" else _tiles(p, rng)
    return [_wall_image(p.wall, p.wall_color, rng), _wall_image(p.upper or "plaster", p.upper_color, rng), roof]


def _tiles(p: House, rng: np.random.Generator) -> Image:
    return textures.roof_tiles(rng, p.roof_color, (8, 7) if p.roof_wave > 0.2 else (9, 10), p.roof_wave)


def _wall_image(kind: str, color: tuple[float, float, float], rng: np.random.Generator) -> Image:
    if kind == "brick":
        return textures.bricks(rng, "brick", color, (0.68, 0.66, 0.62))
    return textures.boards(rng, "boards", color, 10) if kind == "boards" else textures.plaster(rng, "plaster", color)


def fabric(p: House) -> Fabric:
    """The materials for the parameters."""
    trim = Material("trim", linear(p.trim_color), roughness=0.5)
    dark = sum(p.trim_color) < 1.5
    shutter = coated("shutter", p.door_color, "matte") if p.shutters else None
    joinery = Joinery(
        frame=Material("window_frame", linear(p.trim_color), roughness=0.4),
        glass=Material("glass", linear((0.2, 0.24, 0.27)), roughness=0.05, clearcoat=1.0),
        curtain=Material("curtain", linear((0.62, 0.61, 0.58)), roughness=0.3, clearcoat=0.8),
        sill=Material("stone", linear((0.66, 0.65, 0.62)), roughness=0.85),
        door=coated("door", p.door_color, "gloss"),
        handle=metal("brass", (0.75, 0.6, 0.35), 0.3),
        garage=coated("garage_door", (0.3, 0.31, 0.33) if dark else (0.86, 0.86, 0.84), "matte"),
        shutter=shutter,
        bars=p.bars,
    )
    wall = textured("wall", 0, 1.8, 0.9)
    return Fabric(
        wall=wall,
        upper=textured("upper_wall", 1, 1.8, 0.9) if p.upper else wall,
        roof=textured("roof", 2, 2.0, 0.85),
        trim=trim,
        stone=joinery.sill,
        clay=Material("clay", linear((0.6, 0.33, 0.22)), roughness=0.9),
        pipe=Material("pipe", linear((0.32, 0.33, 0.34) if dark else (0.86, 0.86, 0.85)), roughness=0.5),
        joinery=joinery,
    )


def pieces(p: House, rng: np.random.Generator) -> list[Piece]:
    """Return the pieces of the house, its footprint centred about the origin."""
    f, plan = fabric(p), layout(p)
    height = FLOOR + STOREY * p.storeys + 0.12
    place = _main(p, plan, f, height, rng)
    if p.wing:
        place += _wing(p, plan, f, height, rng)
    if p.garage:
        place += _garage(p, f, rng)
    place += _porch(p, plan, f)
    if p.chimney:
        place += _chimney(p, f, height)
    shift = (-p.garage * GARAGE / 2, WING / 2 * p.wing, 0.0)
    return [Piece(q.part, q.material, moved(q.solid, shift)) for q in place]


def _rows(columns: Sequence[float], storeys: int, width: float, tall: float = 1.35) -> list[Opening]:
    """Windows in columns on all storeys."""
    return [Opening(x, FLOOR + STOREY * k + 0.92, width, tall) for k in range(storeys) for x in columns]


def _main(p: House, plan: Layout, f: Fabric, height: float, rng: np.random.Generator) -> list[Piece]:
    """The main block with its openings."""
    wide = 1.6 if p.bars == "double" else 1.25
    hidden = (plan.wing_x - plan.wing_width / 2 - 0.75, plan.wing_x + plan.wing_width / 2 + 0.75) if p.wing else (9e9, 9e9)
    front = [o for o in _rows(plan.columns, p.storeys, wide) if not hidden[0] < o.x < hidden[1]]
    front = [o for o in front if o.z > STOREY or abs(o.x - plan.door_x) > 0.62 + wide / 2 + 0.15]
    front.append(Opening(plan.door_x, FLOOR, 1.02, 2.42 if p.storeys == 2 else 2.1, "door"))
    back = _rows(plan.columns, p.storeys, wide)
    back[0] = Opening(back[0].x, FLOOR, 1.8, 2.15)
    spread = (-p.depth / 4, p.depth / 4)
    sides = {s: [o for o in _rows(spread, p.storeys, 1.0, 1.2) if s != p.garage or o.z > STOREY + FLOOR + 0.5] for s in (-1, 1)}
    rise = p.slope * (p.width if p.roof == "front_gable" else p.depth) / 2
    gables = {"gable": (0.0, rise), "front_gable": (rise, 0.0)}.get(p.roof, (0.0, 0.0))
    faces = (front, sides[1], back, sides[-1])
    block = _block((p.width, p.depth, height), faces, gables, f, p.upper is not None and p.storeys == 2, rng)
    if p.roof == "gable":
        cover = roofs.gable(p.width, p.depth, p.slope, p.eaves, f.roof, f.trim)
    elif p.roof == "front_gable":
        cover = _quarter(roofs.gable(p.depth, p.width, p.slope, p.eaves, f.roof, f.trim))
    elif p.roof == "hip":
        cover = roofs.hip(p.width, p.depth, p.slope, p.eaves, f.roof, f.trim)
    else:
        cover = roofs.flat(p.width, p.depth, p.eaves, f.roof, f.trim)
    return [*block, *_raised(cover, height), *_dormers(p, plan, f, height, rng), *_downpipes(p, f, height)]


def _quarter(pieces: Sequence[Piece]) -> list[Piece]:
    return [Piece(q.part, q.material, turned(q.solid, 2, np.pi / 2)) for q in pieces]


def _raised(pieces: Sequence[Piece], z: float, x: float = 0.0, y: float = 0.0) -> list[Piece]:
    return [Piece(q.part, q.material, moved(q.solid, (x, y, z))) for q in pieces]


def _block(
    size: tuple[float, float, float],
    faces: Sequence[list[Opening]],
    gables: tuple[float, float],
    f: Fabric,
    two_tone: bool,
    rng: np.random.Generator,
) -> list[Piece]:
    """Four facades (front, left, back, right) with their windows; gables: height of the triangles front and sides."""
    w, d, h = size
    pieces: list[Piece] = []
    for k, openings in enumerate(faces):
        width, out = (w, d) if k % 2 == 0 else (d, w)
        wall = facade(width, h, openings, gables[k % 2], SEAM if two_tone else 0.0)
        items = [Piece("wall", f.wall, wall)]
        if two_tone:
            items = _two_tone(wall, f)
        joinery = f.joinery if k == 0 else replace(f.joinery, shutter=None)
        for o in openings:
            items += filled(o, joinery, rng)
        for q in items:
            pieces.append(Piece(q.part, q.material, turned(moved(q.solid, (0, -out / 2, 0)), 2, k * np.pi / 2)))
    foot = cuboid((-w / 2 - 0.03, -d / 2 - 0.03, 0), (w / 2 + 0.03, d / 2 + 0.03, FLOOR - 0.03))
    return [*pieces, Piece("plinth", f.stone, foot)]


def _two_tone(wall: Solid, f: Fabric) -> list[Piece]:
    """The wall in two materials, divided between the storeys."""
    above = wall.vertices[wall.triangles][:, :, 2].mean(axis=1) > SEAM
    return [
        Piece("wall", f.wall, Solid(wall.vertices, wall.triangles[~above])),
        Piece("wall", f.upper, Solid(wall.vertices, wall.triangles[above])),
    ]


def _wing(p: House, plan: Layout, f: Fabric, height: float, rng: np.random.Generator) -> list[Piece]:
    """A gabled block in front of the house; its roof runs back into the main one."""
    w, rise = plan.wing_width, 0.85 * p.slope * plan.wing_width / 2
    low = height if p.storeys == 2 else height - 0.05
    deep = WING + p.depth / 2
    openings = _rows((0.0,), p.storeys, min(1.9, w - 1.4), 1.45)
    block = _block((w, deep, low - 0.02), (openings, [], [], []), (rise, 0.0), f, p.upper is not None and p.storeys == 2, rng)
    cover = _quarter(roofs.gable(deep - 0.25, w, 0.85 * p.slope, 0.8 * p.eaves, f.roof, f.trim))
    return _raised([*block, *_raised(cover, low - 0.02)], 0.0, plan.wing_x, -p.depth / 2 - WING + deep / 2)


def _garage(p: House, f: Fabric, rng: np.random.Generator) -> list[Piece]:
    """A low block beside the house, set back a little, with a wide door."""
    deep, high = min(6.0, p.depth - 0.9), 2.75
    door = Opening(0.0, 0.04, 2.5, 2.15, "garage")
    block = _block((GARAGE, deep, high), ([door], [], [], []), (0.0, 0.0), f, False, rng)
    if p.roof == "flat":
        cover = roofs.flat(GARAGE, deep, 0.05, f.roof, f.trim)
    else:
        cover = _quarter(roofs.gable(deep, GARAGE, 0.75 * p.slope, 0.22, f.roof, f.trim))
        rise = 0.75 * p.slope * GARAGE / 2
        block += [Piece("wall", f.wall, moved(_gable_face(GARAGE, rise), (0, -deep / 2, high)))]
        back = turned(moved(_gable_face(GARAGE, rise), (0, -deep / 2, high)), 2, np.pi)
        block.append(Piece("wall", f.wall, back))
    x = p.garage * (p.width / 2 + GARAGE / 2 - 0.02)
    return _raised([*block, *_raised(cover, high)], 0.0, x, -p.depth / 2 + 0.6 + deep / 2)


def _gable_face(width: float, rise: float) -> Solid:
    return Solid(np.array([(-width / 2, 0, 0), (width / 2, 0, 0), (0, 0, rise)], np.float64), np.array([[0, 1, 2]]))


def _dormers(p: House, plan: Layout, f: Fabric, height: float, rng: np.random.Generator) -> list[Piece]:
    """Small gabled windows on the front slope."""
    pieces: list[Piece] = []
    side = -p.garage or 1
    places = {0: (), 1: (-side * 0.22 * p.width,), 2: (-0.25 * p.width, 0.25 * p.width)}[p.dormers]
    for x in places:
        if p.wing and abs(x - plan.wing_x) < plan.wing_width / 2 + 1.2:
            continue
        deep, foot = p.depth / 2 - 1.0, 0.12 * p.depth * p.slope
        block = _block((1.7, deep, 1.5), ([Opening(0.0, 0.3, 1.05, 1.0)], [], [], []), (0.45, 0.0), f, False, rng)
        block = [q for q in block if q.part != "plinth"]
        cover = _raised(_quarter(roofs.gable(deep, 1.7, 0.53, 0.18, f.roof, f.trim)), 1.5)
        y = -p.depth / 2 + foot / p.slope + deep / 2
        pieces += _raised([*block, *cover], height + foot - 0.15, x, y)
    return pieces


def _downpipes(p: House, f: Fabric, height: float) -> list[Piece]:
    """Pipes from the gutters to the ground on the front corner away from the garage and the rear one."""
    if p.roof in ("flat", "front_gable"):
        return []
    x = -(p.garage or 1) * (p.width / 2 - 0.18)
    lines: list[Solid] = []
    for s in (-1, 1):
        y, top = s * (p.depth / 2 + 0.07), height - p.slope * p.eaves + 0.05
        out = s * (p.depth / 2 + p.eaves + 0.03)
        lines.append(tube([(x, out, top), (x, out, top - 0.1), (x, y, top - 0.38), (x, y, 0.02)], 0.038, 8))
    return [Piece("downpipe", f.pipe, join(*lines))]


def _porch(p: House, plan: Layout, f: Fabric) -> list[Piece]:
    """A roof over the front door, on posts or on brackets."""
    if p.porch == "none":
        return []
    deep, half, z = (1.5 if p.porch == "posts" else 0.95), 1.05, FLOOR + (2.55 if p.storeys == 2 else 2.3)
    front = -p.depth / 2
    slab = cuboid((-half, -deep, z - 0.1), (half, 0.05, z))
    roof = Solid(
        np.array(
            [
                (-half, -deep, z),
                (half, -deep, z),
                (half, 0.02, z + 0.32),
                (-half, 0.02, z + 0.32),
                (half, 0.02, z),
                (-half, 0.02, z),
            ]
        ),
        np.array([(0, 1, 2), (0, 2, 3), (1, 4, 2), (0, 3, 5)]),
    )
    pieces = [Piece("porch", f.trim, slab), Piece("porch", f.roof, roof)]
    if p.porch == "posts":
        posts = [cuboid((s * 0.92 - 0.06, -deep + 0.1, 0), (s * 0.92 + 0.06, -deep + 0.22, z - 0.08)) for s in (-1, 1)]
        pieces.append(Piece("porch", f.trim, join(*posts)))
        pieces.append(Piece("step", f.stone, cuboid((-half, -deep, 0), (half, 0.02, FLOOR - 0.06))))
    else:
        arms = [tube([(s * 0.85, 0.02, z - 0.75), (s * 0.85, -0.7, z - 0.06)], 0.035, 6) for s in (-1, 1)]
        pieces.append(Piece("porch", f.trim, join(*arms)))
    return _raised(pieces, 0.0, plan.door_x, front)


def _chimney(p: House, f: Fabric, height: float) -> list[Piece]:
    """A stack near the ridge."""
    across = p.roof == "front_gable"
    run = (p.width if across else p.depth) / 2
    ridge = height + p.slope * (min(run, p.width / 2) if p.roof == "hip" else run)
    at = (0.9, p.depth / 4) if across else (0.3 * p.width * (-p.garage or 1) * (0.55 if p.roof == "hip" else 1), 0.7)
    wall = f.wall if p.wall == "brick" else f.stone
    return _raised(roofs.chimney(height, ridge + 0.75, wall, f.stone, f.clay, 2), 0.0, *at)
