"""Interiors without their furniture: one room, or a flat of several along a hall."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from viewsphere.assets.mesh import Image, Material, Mesh
from viewsphere.geometry.box3d import Box3d
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.indoors import coverings, openings
from viewsphere_zoo.indoors.draws import flat, single
from viewsphere_zoo.indoors.openings import TRIM, Joinery
from viewsphere_zoo.indoors.plan import INNER, OUTER, RIGHT, SIDES, Opening, Room, Side
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import Color, coated, lamp, linear, metal
from viewsphere_zoo.shapes.solids import Float, lathe, moved
from viewsphere_zoo.townscape.surfaces import finished

SLAB = 0.25
"""Thickness of the floor and of the ceiling, metres."""

ROOM = Room(
    "living_room",
    (-2.6, -2.1),
    (2.6, 2.1),
    (
        Opening("rear", 0.4, 2.0, 1.4, 0.85),
        Opening("left", -1.3, 0.9, 2.03, opens="entrance"),
    ),
)


@dataclass(frozen=True)
class Interior:
    """Parameters of an interior; metres, colours sRGB 0..1. Its floors lie at z = 0. seed draws textures and curtains."""

    rooms: tuple[Room, ...] = (ROOM,)
    height: float = 2.6
    paint: Color = (0.93, 0.93, 0.91)
    door: Color = (0.93, 0.92, 0.9)
    curtain: Color | None = (0.7, 0.66, 0.6)
    seed: int = 0

    @property
    def hull(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Lowest and highest x and y of the outside of its walls."""
        low = np.min([room.low for room in self.rooms], axis=0) - OUTER
        high = np.max([room.high for room in self.rooms], axis=0) + OUTER
        return (float(low[0]), float(low[1])), (float(high[0]), float(high[1]))


def interior(parameters: Interior | None = None) -> Mesh:
    """The interior in metres, its floors at z = 0.

    Parts: floor, wall, ceiling, skirting, door, door_frame, door_handle, window_frame, window_handle, sill, ceiling_lamp,
    outer_wall, and where fitted radiator, curtain, curtain_rod.
    """
    p = parameters or Interior()
    rng = np.random.default_rng(p.seed)
    joinery = _joinery(p)
    pieces, images = _outside(p), list[Image]()
    for room, own in zip(p.rooms, rng.spawn(len(p.rooms)), strict=True):
        pieces += _room(p, room, joinery, images, own)
    return finished(pieces, images, crease_deg=35)


def interior_random(rng: np.random.Generator) -> Mesh:
    """An interior with all parameters drawn."""
    return interior(draw(rng))


def draw(rng: np.random.Generator) -> Interior:
    """The parameters of a random interior: a room in three of four cases, else a flat."""
    rooms = single(rng) if rng.random() < 0.75 else flat(rng)
    paint: Color = (0.93, 0.93, 0.91) if rng.random() < 0.8 else (0.62, 0.46, 0.3)
    doors: tuple[Color, ...] = ((0.93, 0.92, 0.9), (0.6, 0.42, 0.26), (0.45, 0.3, 0.2), (0.36, 0.42, 0.45))
    cloths: tuple[Color, ...] = (
        (0.78, 0.74, 0.66),
        (0.4, 0.46, 0.52),
        (0.62, 0.36, 0.28),
        (0.5, 0.55, 0.42),
        (0.86, 0.85, 0.82),
    )
    return Interior(
        rooms=rooms,
        height=float(rng.uniform(2.45, 2.85)),
        paint=paint,
        door=doors[int(rng.integers(4))],
        curtain=cloths[int(rng.integers(5))] if rng.random() < 0.75 else None,
        seed=int(rng.integers(1 << 31)),
    )


def rooms(p: Interior) -> tuple[Float, ...]:
    """The open space of its rooms and of the doorways between them, each a box (8, 3), metres."""
    inside = [Box3d.between((*room.low, 0.0), (*room.high, p.height)).corners for room in p.rooms]
    return (*inside, *(_threshold(room, o) for room in p.rooms for o in room.openings if o.opens == "door"))


def _threshold(room: Room, o: Opening) -> Float:
    """The open space of a doorway in the wall between two rooms, (8, 3)."""
    x, y = room.middle(o.side)
    right, up = RIGHT[o.side]
    beyond = 0.1  # share of the wall's thickness: rooms and doorways overlap, so that no camera falls between them
    ends = [(x + s * right - INNER * k * up, y + s * up + INNER * k * right) for s in o.span for k in (-beyond, 1 + beyond)]
    low, high = np.min(ends, axis=0), np.max(ends, axis=0)
    return Box3d.between((*low, o.foot), (*high, o.foot + o.height)).corners


def _joinery(p: Interior) -> Joinery:
    curtain = None if p.curtain is None else Material("curtain", linear(p.curtain), roughness=0.95)
    return Joinery(
        frame=coated("frame_paint", p.paint, "matte"),
        door=Material("door_paint", linear(p.door), roughness=0.45),
        handle=metal("steel", (0.72, 0.72, 0.72), 0.3),
        sill=coated("sill", (0.92, 0.91, 0.89), "matte"),
        radiator=coated("radiator", (0.94, 0.94, 0.93), "matte"),
        curtain=curtain,
    )


def _outside(p: Interior) -> list[Piece]:
    """The hull that is seen from outside, with holes where rooms have windows."""
    plaster = coated("outer_plaster", (0.86, 0.84, 0.79), "matte")
    low, high = p.hull
    shell = Room("hall", low, high)
    pieces = [
        Piece("outer_wall", plaster, openings.level(low, high, -SLAB, faces_up=False)),
        Piece("outer_wall", plaster, openings.level(low, high, p.height + SLAB)),
    ]
    for side in SIDES:
        found = [(room, o) for room in p.rooms for o in room.openings_in(side) if o.opens == "window"]
        holes = [replace(o, x=-shell.along(side, room, o.x), foot=o.foot + SLAB) for room, o in found]
        facade = moved(openings.wall(shell.length(side), p.height + 2 * SLAB, holes, 0.0), (0, 0, -SLAB))
        pieces.append(Piece("outer_wall", plaster, openings.on_side(facade, shell, side, outwards=True)))
    return pieces


def _room(p: Interior, room: Room, joinery: Joinery, images: list[Image], rng: np.random.Generator) -> list[Piece]:
    """Return the pieces of one room; its pictures are added to `images`."""
    floor, picture = coverings.floor(rng, room.floor, len(images))
    images.append(picture)
    paper, picture = coverings.wall(rng, room.wall, len(images))
    images.append(picture)
    white = coated("ceiling", (0.94, 0.94, 0.93), "matte")
    pieces = [
        Piece("floor", floor, openings.level(room.low, room.high, 0.0)),
        Piece("ceiling", white, openings.level(room.low, room.high, p.height, faces_up=False)),
        *_ceiling_lamp(p, room),
    ]
    for side in SIDES:
        own = [
            Piece("wall", paper, openings.wall(room.length(side), p.height, room.openings_in(side), _depth(p, room, side))),
            Piece("skirting", joinery.frame, openings.skirting(room.length(side), room.openings_in(side), TRIM)),
        ]
        for o in room.openings_in(side):
            own += [Piece(q.part, q.material, moved(q.solid, (o.x, 0, o.foot))) for q in _filled(o, joinery, rng)]
            if o.foot <= 0 and o.opens != "entrance":
                a, b = o.span
                own.append(Piece("floor", floor, openings.level((a, 0.0), (b, INNER / 2), 0.0)))
        pieces += openings.placed(own, room, side)
    return pieces


def _depth(p: Interior, room: Room, side: Side) -> float:
    """Return the depth of a room's wall: to the outside, or to the middle of the wall between it and the next room."""
    low, high = p.hull
    edge = {"rear": high[1] - room.high[1], "right": high[0] - room.high[0]}
    edge |= {"front": room.low[1] - low[1], "left": room.low[0] - low[0]}
    return OUTER if edge[side] < OUTER + 1e-6 else INNER / 2


def _filled(o: Opening, joinery: Joinery, rng: np.random.Generator) -> list[Piece]:
    match o.opens:
        case "window":
            return openings.window(o, joinery, OUTER, rng)
        case "door":
            return openings.door(o, joinery, is_open=True)
        case "entrance":
            return openings.door(o, joinery, is_open=False)
        case "doorway":
            return openings.trimmed(o, joinery)


def _ceiling_lamp(p: Interior, room: Room) -> list[Piece]:
    """A bowl of milk glass under the middle of the ceiling."""
    x, y = (room.low[0] + room.high[0]) / 2, (room.low[1] + room.high[1]) / 2
    glass = lamp("ceiling_lamp", (0.98, 0.94, 0.84), 1.2)
    plate = lathe([(0, 0), (0.12, 0), (0.12, -0.02), (0, -0.02)][::-1], 20)
    bowl = lathe([(0, -0.1), (0.08, -0.095), (0.14, -0.07), (0.165, -0.03), (0.165, -0.012), (0, -0.012)], 24)
    chrome = metal("steel", (0.72, 0.72, 0.72), 0.3)
    return [
        Piece("ceiling_lamp", chrome, moved(plate, (x, y, p.height))),
        Piece("ceiling_lamp", glass, moved(bowl, (x, y, p.height))),
    ]


FAMILY = ZooFamily(
    random=interior_random,
    home="place",
    classes={
        "": "wall",
        "floor": "floor",
        "ceiling": "ceiling",
        "outer_wall": "building",
        "door": "door",
        "door_frame": "door",
        "door_handle": "door",
        "window_frame": "window",
        "window_handle": "window",
        "sill": "window",
        "ceiling_lamp": "furniture",
        "radiator": "furniture",
        "curtain": "furniture",
        "curtain_rod": "furniture",
    },
    draw=draw,
    rooms=rooms,
)
