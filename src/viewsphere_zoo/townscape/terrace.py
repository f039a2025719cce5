"""A town building between party walls: its walls, the flats' windows, balconies, and its roof."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from viewsphere.assets.mesh import Image, Material
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import coated, linear, metal
from viewsphere_zoo.shapes.solids import Solid, join, moved, tube, turned
from viewsphere_zoo.townscape import roofs, textures
from viewsphere_zoo.townscape.lettering import lettering
from viewsphere_zoo.townscape.masonry import Joinery, Opening, facade, filled
from viewsphere_zoo.townscape.shopfront import ShopCoats, bay, shop_pieces, side_door
from viewsphere_zoo.townscape.surfaces import cuboid, prism
from viewsphere_zoo.townscape.textures import textured

if TYPE_CHECKING:
    from viewsphere_zoo.townscape.shopfront import Shop


@dataclass(frozen=True)
class Fabric:
    """The materials of one building."""

    wall: Material
    party: Material
    roof: Material
    trim: Material
    clay: Material
    rail: Material
    joinery: Joinery
    front: ShopCoats


def images(p: Shop, rng: np.random.Generator) -> list[Image]:
    """Textures of front, party walls and roof."""
    kinds = {
        "brick": lambda: textures.bricks(rng, "brick", p.wall_color, (0.7, 0.68, 0.64)),
        "stone": lambda: textures.bricks(rng, "stone", p.wall_color, (0.62, 0.6, 0.57), (3, 6), (0.012, 0.018), 0.04),
        "plaster": lambda: textures.plaster(rng, "plaster", p.wall_color),
    }
    party = textures.bricks(rng, "party", (0.55, 0.4, 0.33), (0.64, 0.62, 0.58), spread=0.14)
    flat = textures.plaster(rng, "gravel", (0.46, 0.45, 0.44), 0.2)
    return [kinds[p.wall](), party, flat if p.roof == "flat" else textures.roof_tiles(rng, p.roof_color, (9, 9), 0.1)]


def fabric(p: Shop) -> Fabric:
    """The materials for the parameters."""
    frame = Material("window_frame", linear(p.frame_color), roughness=0.4)
    glass = Material("glass", linear((0.2, 0.24, 0.27)), roughness=0.05, clearcoat=1.0)
    trim = Material("stone_trim", linear(p.trim_color), roughness=0.8)
    steel = metal("iron", (0.12, 0.12, 0.13), 0.5)
    goods = ((0.8, 0.3, 0.2), (0.85, 0.75, 0.4), (0.3, 0.5, 0.35), (0.85, 0.84, 0.8), (0.3, 0.4, 0.6))
    return Fabric(
        wall=textured("wall", 0, 1.8, 0.9),
        party=textured("party_wall", 1, 1.8, 0.92),
        roof=textured("roof", 2, 2.0, 0.85),
        trim=trim,
        clay=Material("clay", linear((0.6, 0.33, 0.22)), roughness=0.9),
        rail=steel,
        joinery=Joinery(
            frame=frame,
            glass=glass,
            curtain=Material("curtain", linear((0.62, 0.61, 0.58)), roughness=0.3, clearcoat=0.8),
            sill=trim,
            door=coated("door", p.front_color, "gloss"),
            handle=metal("brass", (0.75, 0.6, 0.35), 0.3),
            garage=frame,
            shutter=None,
            bars=p.bars,
        ),
        front=ShopCoats(
            frame=coated("shop_front", p.front_color, "gloss"),
            board=coated("fascia", p.board_color, "matte"),
            letters=Material("letters", linear(p.letter_color), roughness=0.4),
            glass=glass,
            shade=Material("awning", linear(p.awning_color), roughness=0.9),
            stripe=Material("awning_stripe", linear((0.93, 0.92, 0.88)), roughness=0.9),
            goods=tuple(Material(f"goods_{k}", linear(q), roughness=0.3, clearcoat=0.8) for k, q in enumerate(goods)),
            step=trim,
            metal=steel,
        ),
    )


def pieces(p: Shop, rng: np.random.Generator) -> list[Piece]:
    """Return the pieces of the building, its walls centred about the origin."""
    f = fabric(p)
    front = _front(p, f, rng)
    back = [Piece(q.part, q.material, turned(q.solid, 2, np.pi)) for q in _back(p, f, rng)]
    sides = [
        Piece("party_wall", f.party, turned(moved(facade(p.depth, p.height, []), (0, -p.width / 2, 0)), 2, s * np.pi / 2))
        for s in (1, -1)
    ]
    half, deep = p.width / 2 - 0.01, p.depth / 2 - 0.01
    floor = Piece("floor", f.trim, cuboid((-half, -deep, 0.0), (half, deep, 0.08)))
    return [*front, *back, *sides, floor, *_painted(p, f), *_ROOFS[p.roof](p, f, rng), *_chimneys(p, f)]


def _painted(p: Shop, f: Fabric) -> list[Piece]:
    """The shop's name, painted high on the party walls, where no neighbour hides it."""
    if not p.painted:
        return []
    wide, tall, x = 0.78 * p.depth, min(2.4, 0.36 * (p.height - p.ground)), p.width / 2
    text = lettering(p.name, 0.62 * tall, 0.004, 0.88 * wide)
    field = cuboid((-wide / 2, -0.002, -tall / 2), (wide / 2, 0.002, tall / 2))
    found: list[Piece] = []
    for part, material, solid in (("painted_sign", f.front.board, field), ("painted_sign", f.front.letters, text)):
        put = moved(solid, (0, -x, p.ground + 0.62 * (p.height - p.ground)))
        found.append(Piece(part, material, join(*(turned(put, 2, s * np.pi / 2) for s in (1, -1)))))
    return found


def columns(p: Shop) -> list[float]:
    """x of the windows' middles."""
    count = max(2, round(p.width / p.pitch))
    return [float((k - (count - 1) / 2) * p.width / count) for k in range(count)]


def _front(p: Shop, f: Fabric, rng: np.random.Generator) -> list[Piece]:
    """The front with its shop below and its flats above."""
    b = bay(p)
    door = side_door(p)
    flats: list[Opening] = []
    for k in range(p.storeys - 1):
        tall = (0.66 if p.balconies else 0.56) * p.storey * (1 - 0.06 * k)
        foot = p.ground + k * p.storey + (0.12 if p.balconies else 0.3 * p.storey)
        flats += [Opening(x, foot, p.window, tall) for x in columns(p)]
    holes = [Opening(b.x, 0.0, b.width, b.height), *([door] if door else []), *flats]
    items = [Piece("wall", f.wall, facade(p.width, p.height, holes))]
    for o in [*flats, *([door] if door else [])]:
        items += filled(o, f.joinery, rng)
    items += shop_pieces(p, f.front, rng)
    if p.surrounds:
        items.append(Piece("surround", f.trim, join(*(bar for o in flats for bar in _surround(o)))))
    if p.courses:
        levels = [p.ground + k * p.storey - 0.05 for k in range(1, p.storeys - 1)]
        bands = [cuboid((-p.width / 2, -0.05, z), (p.width / 2, 0.02, z + 0.14)) for z in levels]
        items += [Piece("course", f.trim, join(*bands))] if bands else []
    if p.quoins:
        items.append(Piece("quoin", f.trim, _quoins(p)))
    if p.balconies:
        items += _balconies(p, flats, f)
    return [Piece(q.part, q.material, moved(q.solid, (0, -p.depth / 2, 0))) for q in items]


def _surround(o: Opening) -> list[Solid]:
    """A moulded frame around a window, a ledge over it."""
    w, t = o.width / 2, 0.13
    low, high = o.z, o.z + o.height
    sides = [cuboid((o.x + s * (w + t / 2) - t / 2, -0.035, low), (o.x + s * (w + t / 2) + t / 2, 0.02, high)) for s in (-1, 1)]
    head = cuboid((o.x - w - t, -0.035, high), (o.x + w + t, 0.02, high + 0.16))
    return [*sides, head, cuboid((o.x - w - t - 0.04, -0.1, high + 0.16), (o.x + w + t + 0.04, 0.02, high + 0.22))]


def _quoins(p: Shop) -> Solid:
    """Blocks of two lengths up both edges of the front."""
    places = np.arange(p.ground + 0.1, p.height - 0.5, 0.42)
    solids: list[Solid] = []
    for k, z in enumerate(places):
        w = 0.42 if k % 2 else 0.28
        solids += [
            cuboid((-p.width / 2, -0.03, z), (-p.width / 2 + w, 0.02, z + 0.38)),
            cuboid((p.width / 2 - w, -0.03, z), (p.width / 2, 0.02, z + 0.38)),
        ]
    return join(*solids)


def _balconies(p: Shop, flats: list[Opening], f: Fabric) -> list[Piece]:
    """Iron rails in front of the tall windows, some on slabs."""
    rails: list[Solid] = []
    slabs: list[Solid] = []
    for o in flats:
        half, out, z = o.width / 2 + 0.12, p.balconies, o.z
        slabs.append(cuboid((o.x - half - 0.03, -out - 0.03, z - 0.12), (o.x + half + 0.03, 0.02, z - 0.02)))
        for h in (0.08, 0.95):
            rails.append(cuboid((o.x - half, -out, z + h), (o.x + half, -out + 0.03, z + h + 0.035)))
            rails += [
                cuboid((o.x + s * half - 0.015, -out, z + h), (o.x + s * half + 0.015, 0.0, z + h + 0.03)) for s in (-1, 1)
            ]
        places = np.linspace(o.x - half + 0.01, o.x + half - 0.01, max(5, round(2 * half / 0.27)))
        rails += [cuboid((x - 0.011, -out + 0.004, z - 0.03), (x + 0.011, -out + 0.026, z + 0.96)) for x in places]
    return [Piece("balcony", f.trim, join(*slabs)), Piece("balcony", f.rail, join(*rails))]


def _back(p: Shop, f: Fabric, rng: np.random.Generator) -> list[Piece]:
    """A plain rear with small windows and a yard door."""
    plain = replace(f.joinery, bars="sash")
    spots = [x for x in (-p.width / 4, p.width / 4)]
    openings = [Opening(x, p.ground + k * p.storey + 0.9, 0.95, 1.3) for k in range(p.storeys - 1) for x in spots]
    openings += [Opening(spots[0], 0.12, 1.0, 2.1, "door"), Opening(spots[1], 1.1, 1.0, 1.2)]
    items = [Piece("wall_rear", f.party, facade(p.width, p.height, openings))]
    for o in openings:
        items += filled(o, plain, rng)
    board = cuboid((-0.42 * p.width, -0.06, p.ground - 0.82), (0.42 * p.width, 0.02, p.ground + 0.06))
    name = moved(lettering(p.name, 0.6, 0.02, 0.78 * p.width), (0, -0.06, p.ground - 0.38))
    items += [Piece("sign_rear", f.front.board, board), Piece("sign_rear", f.front.letters, name)]
    pipe = tube([(0, -0.06, p.height - 0.2), (0, -0.06, 0.05)], 0.045, 6)
    items.append(Piece("downpipe", f.rail, pipe))
    return [Piece(q.part, q.material, moved(q.solid, (0, -p.depth / 2, 0))) for q in items]


def _cornice(p: Shop, f: Fabric, z: float) -> list[Piece]:
    """Stepped mouldings that project over the street, with blocks below them."""
    half, y = p.width / 2, -p.depth / 2
    steps = [
        cuboid((-half, y - d, z + h), (half, y + 0.02, z + h + 0.1)) for d, h in ((0.1, -0.36), (0.2, -0.12), (0.3, -0.03))
    ]
    blocks: list[Solid] = []
    if p.dentils:
        places = np.linspace(-half + 0.12, half - 0.12, round(p.width / 0.5))
        blocks = [cuboid((x - 0.07, y - 0.18, z - 0.26), (x + 0.07, y + 0.02, z - 0.11)) for x in places]
    return [Piece("cornice", f.trim, join(*steps, *blocks))]


def _flat(p: Shop, f: Fabric, rng: np.random.Generator) -> list[Piece]:
    """Gravel behind a parapet."""
    cover = roofs.flat(p.width, p.depth, 0.0, f.roof, f.trim)
    high = [
        Piece(
            "parapet" if q.part == "fascia" else q.part,
            q.material,
            moved(Solid(q.solid.vertices * (1, 1, 1 if q.part == "roof" else 1.8), q.solid.triangles), (0, 0, p.height)),
        )
        for q in cover
    ]
    hut = cuboid((-0.9, 0.2 * p.depth, p.height), (0.9, 0.2 * p.depth + 1.9, p.height + 2.1)) if p.hut else None
    return [*high, *_cornice(p, f, p.height), *([Piece("roof_hut", f.party, hut)] if hut else [])]


def _pitched(p: Shop, f: Fabric, rng: np.random.Generator) -> list[Piece]:
    """Two slopes with the ridge along the street, party walls that rise above them."""
    half, run, rise = p.width / 2, p.depth / 2, p.slope * p.depth / 2
    profile = [(-run - 0.25, -0.25 * p.slope), (0.0, rise), (0.0, rise + 0.18), (-run - 0.25, -0.25 * p.slope + 0.18)]
    slope = prism(profile, -half + 0.02, half - 0.02, axis=0)
    back = Solid(slope.vertices * (-1, -1, 1), slope.triangles)
    gable = prism([(-run, 0.0), (run, 0.0), (0.0, rise)], -half, half, axis=0)
    caps = [(-run - 0.1, -0.1 * p.slope + 0.12), (0.0, rise + 0.18), (0.0, rise + 0.42), (-run - 0.1, -0.1 * p.slope + 0.38)]
    stand = [prism(caps, x, x + 0.3, axis=0) for x in (-half, half - 0.3)]
    stand += [Solid(s.vertices * (-1, -1, 1), s.triangles) for s in stand]
    gutter = [roofs.gutter((-half + 0.02, half - 0.02), s * (run + 0.28), -0.25 * p.slope + 0.08) for s in (-1, 1)]
    ridge = tube([(-half + 0.05, 0, rise + 0.17), (half - 0.05, 0, rise + 0.17)], 0.1, 8)
    lifted = [
        Piece("roof", f.roof, join(slope, back, ridge)),
        Piece("party_wall", f.party, join(gable, *stand)),
        Piece("gutter", f.rail, join(*gutter)),
    ]
    dormers = [q for x in columns(p)[:: 2 if p.width > 7 else 1] for q in _dormer(p, f, x, 0.55, rng)] if p.dormers else []
    return [*(Piece(q.part, q.material, moved(q.solid, (0, 0, p.height))) for q in lifted), *dormers, *_cornice(p, f, p.height)]


def _mansard(p: Shop, f: Fabric, rng: np.random.Generator) -> list[Piece]:
    """A steep slope with dormers, and a flat top."""
    half, run, tall, back = p.width / 2, p.depth / 2, 2.5, 0.8
    profile = [(-run, 0.0), (run, 0.0), (run - back, tall), (-run + back, tall)]
    body = prism(profile, -half + 0.28, half - 0.28, axis=0)
    stand = [
        prism([(-run, 0.0), (run, 0.0), (run - back + 0.12, tall + 0.2), (-run + back - 0.12, tall + 0.2)], x, x + 0.3, axis=0)
        for x in (-half, half - 0.3)
    ]
    top = cuboid((-half + 0.28, -run + back - 0.08, tall - 0.04), (half - 0.28, run - back + 0.08, tall + 0.08))
    lifted = [Piece("roof", f.roof, body), Piece("party_wall", f.party, join(*stand)), Piece("fascia", f.trim, top)]
    dormers = [q for x in columns(p) for q in _dormer(p, f, x, 0.3, rng)]
    return [*(Piece(q.part, q.material, moved(q.solid, (0, 0, p.height))) for q in lifted), *dormers, *_cornice(p, f, p.height)]


def _dormer(p: Shop, f: Fabric, x: float, foot: float, rng: np.random.Generator) -> list[Piece]:
    """A window with cheeks and a small roof, on the front slope."""
    w, h, deep = 0.62, 1.55, 1.9
    hole = Opening(0.0, 0.2, 0.9, 1.15)
    items = [Piece("dormer", f.trim, facade(2 * w, h, [hole])), *filled(hole, f.joinery, rng)]
    cheeks = [cuboid((s * w - 0.03, 0.001, 0), (s * w + 0.03, deep, h)) for s in (-1, 1)]
    lid = cuboid((-w - 0.12, -0.14, h - 0.02), (w + 0.12, deep, h + 0.1))
    if p.gabled:
        lid = prism([(h - 0.02, -w - 0.12), (h - 0.02, w + 0.12), (h + 0.4, 0.0)][::-1], -0.12, deep, axis=1)
    items += [Piece("dormer", f.roof, join(*cheeks)), Piece("dormer", f.trim if not p.gabled else f.roof, lid)]
    y = -p.depth / 2 + (0.12 if p.roof == "mansard" else foot / p.slope)
    return [Piece(q.part, q.material, moved(q.solid, (x, y, p.height + foot - 0.15))) for q in items]


def _chimneys(p: Shop, f: Fabric) -> list[Piece]:
    """Stacks on the party walls."""
    top = p.height + {"flat": 1.9, "pitched": p.slope * p.depth / 2 + 1.1, "mansard": 3.9}[p.roof]
    found: list[Piece] = []
    for side in p.chimneys:
        x = side * (p.width / 2 - 0.42)
        stack = roofs.chimney(p.height - 0.2, top, f.party, f.trim, f.clay, 1)
        found += [Piece(q.part, q.material, moved(q.solid, (x, 0.12 * p.depth, 0))) for q in stack]
    return found


_ROOFS = {"flat": _flat, "pitched": _pitched, "mansard": _mansard}
