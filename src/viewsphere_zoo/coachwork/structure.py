"""The pieces of a car's shell: hull, cabin, bed, wheels."""

from __future__ import annotations

import numpy as np

from viewsphere.assets.mesh import Material
from viewsphere_zoo.coachwork.coats import Coats
from viewsphere_zoo.coachwork.greenhouse import Cell
from viewsphere_zoo.coachwork.hull import LOWER, Hull, follow
from viewsphere_zoo.coachwork.shape import Shape
from viewsphere_zoo.coachwork.wheels import Wheel, rim, tyre
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.solids import both_sides, flipped, grid, mirrored, moved, rounded_box


def hull_pieces(hull: Hull, track: float, coats: Coats, bumpers: tuple[str, str]) -> list[Piece]:
    """Walls, bumpers and sills, underside with wheel houses, their inner walls at x = track; `bumpers` names the lower ends of
    front and rear.
    """
    wall = hull.wall()
    y = wall[:, 0, 1]
    arches = hull.arches
    first = int(np.searchsorted(y, arches[0].y - arches[0].radius * 1.035))
    last = int(np.searchsorted(y, arches[-1].y + arches[-1].radius * 1.035)) - 1
    lower = slice(0, LOWER + 1)
    return [
        Piece("body", coats.paint, both_sides(grid(wall[:, LOWER:]))),
        Piece(bumpers[0], coats.cladding, both_sides(grid(wall[: first + 1, lower]))),
        Piece("sill", coats.cladding, both_sides(grid(wall[first : last + 1, lower]))),
        Piece(bumpers[1], coats.cladding, both_sides(grid(wall[last:, lower]))),
        Piece("underbody", coats.under, both_sides(hull.underside(track))),
    ]


def arch_trims(hull: Hull, coats: Coats, flare: float) -> list[Piece]:
    """A raised lip around each opening; flare is its height, metres."""
    pieces: list[Piece] = []
    angle = np.linspace(0.0, np.pi, 21)
    for arch in hull.arches:
        grow = np.array([0.0, 0.004, 0.03 + flare, 0.044 + flare, 0.047 + flare])
        height = np.array([-0.004, flare, flare, 0.6 * flare, -0.012])
        r = arch.radius + grow[:, None]
        cos = np.cos(angle)
        y = arch.y - r * cos
        z = arch.z + r * (1 - np.abs(cos) ** 2.3) ** (1 / 2.3)
        u = hull.outline.u_at_y(y)
        points = hull.surface(u, z) + height[:, None, None] * np.append(hull.outline.normal(u), np.zeros((*u.shape, 1)), -1)
        pieces.append(Piece("wheel_arch", coats.cladding, both_sides(flipped(grid(points)))))
    return pieces


def cabin_pieces(shape: Shape, coats: Coats, cells: tuple[Cell, ...], black_pillars: bool, rear_window: bool) -> list[Piece]:
    """Roof, pillars, panes and their seals."""
    cabin = shape.cabin
    pieces = [Piece("roof", coats.roof, cabin.roof_solid())]
    front = Cell(-0.94, 0.94, "windshield", (0.04, 0.04, 0.018, 0.015))
    rear = Cell(3.12, 4.88, "window_tailgate" if rear_window else "", (0.07, 0.07, 0.05, 0.05))
    for cell in (front, rear):
        pieces += _cell_pieces(shape, cell, coats, coats.paint, mirror=False)
    for cell in cells:
        pillar = coats.black if black_pillars and cell.name else coats.paint
        pieces += _cell_pieces(shape, cell, coats, pillar, mirror=True)
    return pieces


def _cell_pieces(shape: Shape, cell: Cell, coats: Coats, material: Material, mirror: bool) -> list[Piece]:
    """A cell's frame, seal and pane, on request on both sides."""
    name = cell.name
    if not cell.name:
        wall = shape.cabin.wall(cell)
        return [Piece("body", material, both_sides(wall) if mirror else wall)]
    around, seal, pane = shape.cabin.framed(cell)
    if not mirror:
        return [Piece("body", material, around), Piece("seal", coats.black, seal), Piece(name, coats.glass, pane)]
    return [
        Piece("body", material, both_sides(around)),
        Piece("seal", coats.black, both_sides(seal)),
        Piece(f"{name}_left", coats.glass, pane),
        Piece(f"{name}_right", coats.glass, mirrored(pane)),
    ]


def bed_pieces(shape: Shape, coats: Coats) -> list[Piece]:
    """A pickup's load bed: outer walls, rails, inner walls, floor, wheel boxes."""
    hull, opening = shape.bed, shape.bed_inner
    u = hull.stations
    inner = follow(hull, opening, 1.0)
    floor = shape.z(0.34)
    heights = np.linspace(0, 1, 3)
    top = hull.deck(inner[:, 0], inner[:, 1])
    z = top[:, None] * (1 - heights) + floor * heights
    walls = np.concatenate([np.broadcast_to(inner[:, None], (len(u), 3, 2)), z[..., None]], axis=-1)
    middle = np.stack([np.zeros(len(u)), inner[:, 1], np.full(len(u), floor)], axis=1)
    ground = grid(np.stack([walls[:, -1], middle], axis=1))
    arch = hull.arches[0]
    top_z, inside = arch.z + arch.radius + 0.04, shape.width / 2 - shape.wheel.width - 0.13
    box = rounded_box((shape.width / 2 - 0.06 - inside, 2 * arch.radius + 0.12, top_z - floor + 0.05), 0.06)
    box = moved(box, ((shape.width / 2 - 0.06 + inside) / 2, arch.y, (top_z + floor - 0.05) / 2))
    ribs = [
        moved(
            rounded_box((0.05, opening.rear - opening.front - 0.1, 0.02), 0.008, 2),
            (x, (opening.front + opening.rear) / 2, floor + 0.004),
        )
        for x in np.linspace(-0.6, 0.6, 9)
    ]
    low, high = shape.z(0.22), float(hull.deck(0.0, hull.outline.front)) - 0.12
    bridge = moved(
        rounded_box((shape.width - 0.25, 0.12, high - low), 0.01, 1), (0, hull.outline.front - 0.01, (low + high) / 2)
    )
    return [
        *hull_pieces(hull, shape.track, coats, ("cargo_bed", "bumper_rear")),
        Piece("underbody", coats.under, bridge),
        Piece("cargo_bed", coats.paint, both_sides(hull.deck_to(inner, 1))),
        Piece("cargo_bed", coats.rubber, both_sides(grid(walls))),
        Piece("cargo_bed", coats.rubber, both_sides(ground)),
        Piece("cargo_bed", coats.rubber, both_sides(box)),
        *(Piece("cargo_bed", coats.under, rib) for rib in ribs),
    ]


def wheel_pieces(shape: Shape, wheel: Wheel, coats: Coats, phase: float) -> list[Piece]:
    """Four wheels on the ground."""
    rubber = tyre(wheel)
    pieces: list[Piece] = []
    for end, arch, turn in (("front", shape.arches[0], 0.0), ("rear", shape.arches[1], 1.3)):
        alloy, disc, inside = rim(wheel, phase + turn)
        at = (shape.width / 2 - 0.022 - wheel.width / 2, arch.y, wheel.radius)
        for side, place in (("left", None), ("right", mirrored)):
            for name, material, solid in (
                ("tyre", coats.rubber, rubber),
                ("rim", coats.rims, alloy),
                ("rim", coats.steel, disc),
                ("rim", coats.under, inside),
            ):
                here = moved(solid, at)
                pieces.append(Piece(f"wheel_{end}_{side}_{name}", material, place(here) if place else here))
    return pieces
