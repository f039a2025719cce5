"""Front and rear faces: lamps, grille, intakes, licence plates."""

from __future__ import annotations

from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material
from viewsphere_zoo.coachwork.coats import Coats
from viewsphere_zoo.coachwork.shape import Shape
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.panels import Surface, in_quad, panel, raised, ribbon
from viewsphere_zoo.shapes.solids import Float, Solid, join, mirrored, moved, rounded_box, tube

Lamps = Literal["swept", "round", "slim", "block"]
Grille = Literal["bars", "mesh", "wide", "slim"]


def _pair(part: str, material: Material, solid: Solid) -> list[Piece]:
    """A piece on the left and its mirror image on the right."""
    return [Piece(f"{part}_left", material, solid), Piece(f"{part}_right", material, mirrored(solid))]


def _shrunk(corners: Float, left: float, right: float, low: float, high: float) -> Float:
    """The part of a quad between these fractions of its width and height, (4, 2)."""
    return in_quad(corners, np.array([[left, low], [right, low], [right, high], [left, high]]))


def headlights(shape: Shape, style: Lamps, coats: Coats) -> list[Piece]:
    """Lamps on the front corners: dark housing, bright lenses, an indicator."""
    hull = shape.hull
    half = shape.width / 2
    reach = {"swept": 0.42, "round": 0.2, "slim": 0.32, "block": 0.22}[style]
    tall = {"swept": 0.15, "round": 0.19, "slim": 0.085, "block": 0.19}[style] * (0.85 + 0.1 * shape.height)
    inner = float(hull.outline.u_at_x((0.58 if style == "round" else 0.5) * half))
    outer = float(hull.outline.u_at_y(shape.y(0) + reach + hull.outline.bow[0]))
    top = shape.nose_top(np.array([inner, outer])) - 0.005
    slope = {"swept": 0.45, "round": 0.0, "slim": 0.15, "block": 0.0}[style] * tall
    quad = np.array([[inner, top[0] - tall], [outer, top[1] - tall + slope], [outer, top[1]], [inner, top[0] - 0.2 * slope]])
    surface = hull.surface
    round_ = {"swept": 0.22, "round": 0.5, "slim": 0.3, "block": 0.16}[style]
    pieces = _pair("headlight", coats.black, panel(surface, quad, 0.004, round_, 6, corner=2))
    lens = _shrunk(quad, 0.06, 0.94, 0.1, 0.9)
    pieces += _pair("headlight", coats.white_lamp, panel(surface, lens, 0.009, round_, 6, depth=0.008, corner=2))
    for share in (0.3,) if style == "round" else (0.16, 0.42):
        size = 0.34 if style == "round" else 0.22
        eye = _shrunk(quad, share, share + size, 0.22, 0.8)
        pieces += _pair("headlight", coats.chrome, panel(surface, eye, 0.012, 0.5, 1, 0.008, 1, 2))
    mark = _shrunk(quad, 0.8, 0.93, 0.15, 0.85)
    return pieces + _pair("indicator", coats.amber_lamp, panel(surface, mark, 0.011, 0.3, 2, 0.008, 1, 1))


def taillights(shape: Shape, style: Lamps, coats: Coats) -> list[Piece]:
    """Lamps on the rear corners; upright on vans, pickups and boxy bodies, else horizontal."""
    hull = shape.bed if shape.body == "pickup" else shape.hull
    upright = shape.body in ("van", "pickup") or style in ("block", "round")
    half, surface = shape.width / 2, hull.surface
    tall = (0.36 if upright else {"swept": 0.16, "slim": 0.09}.get(style, 0.14)) * (0.6 + 0.28 * shape.height)
    outer = float(hull.outline.u_at_y(hull.outline.rear - (0.16 if upright else 0.3) - hull.outline.bow[1]))
    inner = float(hull.outline.u_at_x((0.74 if upright else 0.5) * half, rear=True))
    top = hull.top(np.array([outer, inner]))[1] - hull.edge - 0.01
    tuck = 0.0 if upright else 0.25 * tall
    proud = 0.006 if upright else 0.0  # the width at a corner that is nearly square
    quad = np.array([[outer, top[0] - tall + tuck], [inner, top[1] - tall], [inner, top[1]], [outer, top[0]]])
    pieces = _pair("taillight", coats.black, panel(surface, quad, 0.004 + proud, 0.14, 6, rings=2, corner=2))
    red = _shrunk(quad, 0.04, 0.96, 0.34 if upright else 0.06, 0.96 if upright else 0.94)
    pieces += _pair("taillight", coats.red_lamp, panel(surface, red, 0.009 + proud, 0.14, 6, 0.008, corner=2))
    amber = _shrunk(quad, 0.06, 0.94, 0.19, 0.31) if upright else _shrunk(quad, 0.7, 0.93, 0.55, 0.88)
    white = _shrunk(quad, 0.06, 0.94, 0.05, 0.16) if upright else _shrunk(quad, 0.7, 0.93, 0.14, 0.45)
    pieces += _pair("indicator_rear", coats.amber_lamp, panel(surface, amber, 0.011 + proud, 0.2, 3, 0.008, 1, 1))
    return pieces + _pair("reversing_light", coats.white_lamp, panel(surface, white, 0.011 + proud, 0.2, 3, 0.008, 1, 1))


def front_face(shape: Shape, style: Grille, coats: Coats) -> list[Piece]:
    """Grille with badge, lower intake with fog lamps, licence plate."""
    surface, half = shape.hull.surface, shape.width / 2
    top = float(shape.nose_top(np.array(0.0))) - 0.02
    line, low = shape.hull.bumper_line, shape.z(shape.proportions.clearance) * 1.25
    wide = {"bars": 0.42, "mesh": 0.36, "wide": 0.47, "slim": 0.46}[style] * half
    bottom = {"bars": line + 0.03, "mesh": line - 0.015, "wide": line + 0.05, "slim": top - 0.09}[style]
    u = float(shape.hull.outline.u_at_x(wide))
    pinch = 0.8 if style in ("bars", "mesh") else 0.93
    quad = np.array([[-u * pinch, bottom], [u * pinch, bottom], [u, top], [-u, top]])
    rim = panel(surface, _shrunk(quad, -0.02, 1.02, -0.06, 1.06), 0.007, 0.12, 8, corner=2)
    pieces = [
        Piece("grille", coats.chrome, rim),
        Piece("grille", coats.black, panel(surface, quad, 0.010, 0.12, 8, 0.01, corner=2)),
    ]
    rows = {"bars": 5, "mesh": 7, "wide": 3, "slim": 2}[style]
    pieces.append(Piece("grille", coats.steel, join(*_slats(surface, quad, rows, style == "mesh"))))
    badge = panel(surface, _square(shape, 0.5 * (bottom + top), 0.055), 0.017, 0.5, 1, rings=1)
    pieces.append(Piece("badge", coats.chrome, badge))
    mouth = float(shape.hull.outline.u_at_x(0.55 * half))
    duct = np.array([[-mouth * 0.92, low + 0.07], [mouth * 0.92, low + 0.07], [mouth, low + 0.16], [-mouth, low + 0.16]])
    pieces.append(Piece("intake", coats.black, panel(surface, duct, 0.011, 0.2, 7, rings=2, corner=2)))
    a, b = (float(shape.hull.outline.u_at_x(f * half)) for f in (0.66, 0.8))
    fog = np.array([[a, low + 0.09], [b, low + 0.09], [b, low + 0.16], [a, low + 0.16]])
    pieces += _pair("fog_light", coats.black, panel(surface, fog, 0.009, 0.4, 2, rings=1, corner=2))
    pieces += _pair(
        "fog_light", coats.white_lamp, panel(surface, _shrunk(fog, 0.25, 0.75, 0.15, 0.85), 0.013, 0.5, 1, 0.008, 1, 2)
    )
    return pieces + plate(surface, 0.0, 0.5 * (low + 0.16 + line) + 0.01, 1.0, coats)


def _square(shape: Shape, z: float, size: float) -> Float:
    """Corners of a square on the middle of the nose."""
    u = float(shape.hull.outline.u_at_x(size))
    return np.array([[-u, z - size], [u, z - size], [u, z + size], [-u, z + size]])


def _slats(surface: Surface, quad: Float, rows: int, upright: bool) -> list[Solid]:
    """Bars across a grille; for a mesh also bars along it."""
    solids: list[Solid] = []
    for share in (np.arange(rows) + 0.5) / rows:
        line = in_quad(quad, np.stack([np.linspace(0.04, 0.96, 11), np.full(11, share)], axis=1))
        solids.append(ribbon(surface, line, 0.014, 0.014))
    if upright:
        for share in np.linspace(0.08, 0.92, 13):
            line = in_quad(quad, np.stack([np.full(5, share), np.linspace(0.06, 0.94, 5)], axis=1))
            solids.append(ribbon(surface, line, 0.009, 0.0145))
    return solids


def plate(surface: Surface, u: float, z: float, facing: float, coats: Coats) -> list[Piece]:
    """A licence plate with a few letters, flat, at (u, z); facing 1 front, -1 rear."""
    at = raised(surface, np.array([[u, z]]), 0.014)[0]
    board = moved(rounded_box((0.5, 0.018, 0.115), 0.004, 1), at)
    rows = [-0.17, -0.11, -0.02, 0.04, 0.1, 0.17]
    marks = [moved(rounded_box((0.036, 0.004, 0.07), 0.0, 0), np.add(at, (x, -facing * 0.009, 0))) for x in rows]
    return [Piece("licence_plate", coats.plate, board), Piece("licence_plate", coats.letters, join(*marks))]


def rear_face(shape: Shape, coats: Coats, exhausts: int) -> list[Piece]:
    """Licence plate, lower apron, exhaust pipes, boot handle."""
    hull = shape.bed if shape.body == "pickup" else shape.hull
    surface, half = hull.surface, shape.width / 2
    line = hull.bumper_line
    high = shape.body in ("sedan", "hatchback")
    at = line + 0.13 if high else line - 0.072
    low = float(hull.lower_edge(np.array([4.0]))[0])
    m = 4 - float(hull.outline.u_at_x(0.6 * half, rear=True))
    apron = np.array([[4 - m, low + 0.02], [4 + m, low + 0.02], [4 + m * 0.9, low + 0.1], [4 - m * 0.9, low + 0.1]])
    pieces = [
        *plate(surface, 4.0, at, -1.0, coats),
        Piece("bumper_rear", coats.black, panel(surface, apron, 0.011, 0.2, 7, rings=2, corner=2)),
    ]
    grip = raised(surface, np.array([[4.0, at + 0.09]]), 0.006)[0]
    pieces.append(Piece("tailgate_handle", coats.chrome, moved(rounded_box((0.34, 0.02, 0.025), 0.009, 2), grip)))
    for side in (-1, 1)[2 - exhausts :]:
        x = side * 0.5 * half
        pipe = tube(
            [
                (x, hull.outline.rear - 0.5, low + 0.03),
                (x, hull.outline.rear - 0.3, low + 0.03),
                (x, hull.outline.rear - 0.085, low + 0.03),
            ],
            0.032,
            12,
        )
        pieces.append(Piece("exhaust", coats.steel, pipe))
    return pieces
