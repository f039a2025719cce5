"""Doors' seams and handles, mirrors, wipers, roof rack, spoiler, aerial."""

from __future__ import annotations

import numpy as np

from viewsphere_zoo.coachwork.coats import Coats
from viewsphere_zoo.coachwork.hull import Hull
from viewsphere_zoo.coachwork.shape import Shape
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.panels import raised, ribbon, straight
from viewsphere_zoo.shapes.solids import Float, Solid, both_sides, join, mirrored, moved, rounded_box, tube, turned

SEAM = 0.01
"""Width of the gaps between panels, metres."""


def door_edges(shape: Shape, rear_door: bool) -> list[float]:
    """y of the doors' upright seams, front to rear."""
    doors = shape.proportions.doors
    return [shape.y(d) for d in (doors if rear_door else doors[:2])]


def seams(shape: Shape, coats: Coats, rear_door: bool) -> list[Piece]:
    """Gaps around doors, bonnet and boot."""
    hull = shape.hull
    edges = door_edges(shape, rear_door)
    sill = shape.z(shape.proportions.clearance) + 0.09
    lines = [_upright(hull, y, sill) for y in edges]
    bottom = hull.outline.u_at_y(np.linspace(edges[0], _bottom_end(hull, edges[-1], sill), 24))
    lines.append(ribbon(hull.surface, np.stack([bottom, np.full(24, sill)], axis=1), SEAM))
    pieces = [Piece("seam", coats.seam, both_sides(join(*lines)))]
    return pieces + _deck_seams(shape, coats)


def _bottom_end(hull: Hull, y: float, sill: float) -> float:
    """Return the end of a door's lower seam: at its rear edge or before the wheel's opening."""
    clear = [a.y - a.radius - 0.04 for a in hull.arches if abs(a.y - y) < a.radius + 0.04 and a.z + a.radius > sill]
    return min([y, *clear])


def _upright(hull: Hull, y: float, sill: float) -> Solid:
    """A door's vertical seam from the sill (or above the wheel's opening) to the belt."""
    u = float(hull.outline.u_at_y(y))
    low = sill
    for arch in hull.arches:
        r = arch.radius + 0.06
        low = max(low, arch.z + float(np.sqrt(max(r**2 - (y - arch.y) ** 2, 0.0)))) if abs(y - arch.y) < r else low
    top = float(hull.top(np.array([u]))[1][0]) - hull.edge
    return ribbon(hull.surface, straight((u, low), (u, top), 24)[::-1], SEAM)


def _deck_seams(shape: Shape, coats: Coats) -> list[Piece]:
    """The bonnet's sides, the outline of boot lid or tailgate, a van's sliding rail."""
    hull, half = shape.hull, shape.width / 2
    front, back = shape.y(0.0) + hull.outline.bow[0] * 0.7 + 0.12, shape.cabin.base.point(0.98)[1] - 0.05
    side = straight((0.70 * half, front), (0.80 * half, back), 20)
    solids = [both_sides(ribbon(hull.deck_surface, side[::-1], SEAM, 0.005)), _gate(shape)]
    if shape.body == "van":
        y = np.linspace(shape.y(shape.proportions.doors[2]) + 0.03, shape.y(0.955), 20)
        u = hull.outline.u_at_y(y)
        z = hull.top(u)[1] - hull.edge - 0.16
        solids.append(both_sides(ribbon(hull.surface, np.stack([u, z], axis=1), 0.028, 0.004)))
    return [Piece("seam", coats.seam, join(*solids))]


def _gate(shape: Shape) -> Solid:
    """The gaps below and beside the boot lid or tailgate."""
    hull = shape.bed if shape.body == "pickup" else shape.hull
    edge = float(hull.outline.u_at_x(0.7 * shape.width / 2, rear=True))
    low = hull.bumper_line + 0.035
    line = np.stack([np.linspace(edge, 8 - edge, 20), np.full(20, low)], axis=1)
    top = float(hull.top(np.array([edge]))[1][0]) - hull.edge
    upright = ribbon(hull.surface, straight((edge, low), (edge, top), 12), SEAM, 0.004)
    return join(ribbon(hull.surface, line, SEAM, 0.004), both_sides(upright))


def handles(shape: Shape, coats: Coats, rear_door: bool, chrome: bool) -> list[Piece]:
    """One grip at the rear edge of each door."""
    hull = shape.hull
    edges = door_edges(shape, rear_door)
    pieces: list[Piece] = []
    for name, y in zip(("front", "rear"), edges[1:], strict=False):
        u = float(hull.outline.u_at_y(y - 0.17))
        z = float(hull.top(np.array([u]))[1][0]) - hull.edge - 0.085
        at = raised(hull.surface, np.array([[u, z]]), 0.018)[0]
        grip = moved(rounded_box((0.018, 0.2, 0.028), 0.009, 1), at)
        feet = [moved(rounded_box((0.04, 0.03, 0.022), 0.0, 0), np.add(at, (-0.014, dy, 0))) for dy in (-0.08, 0.08)]
        material = coats.chrome if chrome else coats.paint
        solid = join(grip, *feet)
        pieces += [
            Piece(f"door_handle_{name}_left", material, solid),
            Piece(f"door_handle_{name}_right", material, mirrored(solid)),
        ]
    return pieces


def mirrors(shape: Shape, coats: Coats, tall: bool) -> list[Piece]:
    """Wing mirrors on the front corners of the front windows."""
    u = 1.17
    root = shape.cabin.surface(u, 0.1)
    height = 0.25 if tall else 0.145
    at = np.add(root, (0.155, 0.02, 0.075 if tall else 0.05))
    shell = moved(turned(rounded_box((0.21, 0.1, height), 0.048, 3), 2, -0.12), at)
    glass = moved(turned(rounded_box((0.17, 0.012, height - 0.035), 0.005, 1), 2, -0.12), np.add(at, (-0.006, 0.046, 0)))
    arm = tube([root - (0.03, 0, 0.02), np.add(root, (0.03, 0.01, 0.0)), at - (0.03, 0, 0.03)], 0.022, 8)
    pieces: list[Piece] = []
    for side, place in (("left", None), ("right", mirrored)):
        for material, solid in ((coats.paint, shell), (coats.chrome, glass), (coats.black, arm)):
            pieces.append(Piece(f"mirror_{side}", material, place(solid) if place else solid))
    return pieces


def wipers(shape: Shape, coats: Coats) -> list[Piece]:
    """A dark scuttle in front of the windshield, and two blades on the glass."""
    cabin, hull = shape.cabin, shape.hull
    u = np.linspace(-0.88, 0.88, 31)
    foot = cabin.base.point(u)
    plan = foot + cabin.base.normal(u) * 0.045
    scuttle = ribbon(hull.deck_surface, plan, 0.085, 0.003)
    blades = [_blade(shape, 0.12, 0.8, 0.05), _blade(shape, -0.62, 0.12, 0.05)]
    return [Piece("scuttle", coats.black, scuttle), Piece("wiper", coats.black, join(*blades))]


def _blade(shape: Shape, start: float, stop: float, height: float) -> Solid:
    """A wiper lying along the foot of the windshield."""
    u, v = np.linspace(start, stop, 8), np.linspace(0.03, height + 0.06, 8)
    return tube(raised(shape.cabin.surface, np.stack([u, v], axis=1), 0.016), 0.009, 6)


def roof_line(shape: Shape, x: float, y: Float, rise: float) -> Float:
    """Points (N, 3) above the roof."""
    top = shape.cabin.top
    middle, half = (top.front + top.rear) / 2, (top.rear - top.front) / 2
    k = np.maximum(np.abs(x) / top.half_width, np.abs(y - middle) / half)
    z = shape.cabin.roof_height(y) - shape.cabin.drop * k**4
    return np.stack([np.full_like(y, x), y, z + rise], axis=1)


def rack(shape: Shape, coats: Coats, bars: bool) -> list[Piece]:
    """Rails along the roof's sides and, on request, two bars across."""
    top = shape.cabin.top
    x = 0.8 * top.half_width
    span = top.rear - top.front
    y = np.linspace(top.front + 0.16 * span, top.rear - 0.12 * span, 15)
    rise = 0.035 * np.minimum(1, 6 * np.minimum(np.linspace(0, 1, 15), np.linspace(1, 0, 15))) + 0.002
    rail = roof_line(shape, x, y, 0.0)
    rail[:, 2] += rise
    solids = [both_sides(tube(rail, 0.016, 8))]
    for share in (0.25, 0.7) if bars else ():
        at = roof_line(shape, x, np.array([y[0] + share * (y[-1] - y[0])]), 0.055)[0]
        solids.append(moved(rounded_box((2 * x + 0.1, 0.06, 0.025), 0.01, 2), (0, at[1], at[2] - 0.006)))
    return [Piece("roof_rack", coats.black, join(*solids))]


def aerial(shape: Shape, coats: Coats) -> list[Piece]:
    """A shark fin near the roof's rear edge."""
    top = shape.cabin.top
    y = top.rear - 0.2 * (top.rear - top.front) * 0.7
    at = roof_line(shape, 0.0, np.array([y]), 0.0)[0]
    box = rounded_box((0.05, 0.17, 0.1), 0.024, 2)
    lean = box.vertices.copy()
    height = (lean[:, 2] + 0.05) / 0.1
    lean[:, 1] = lean[:, 1] * (1 - 0.65 * height) + 0.05 * height
    lean[:, 0] *= 1 - 0.6 * height
    return [Piece("aerial", coats.paint, moved(Solid(lean, box.triangles), np.add(at, (0, 0, 0.02))))]


def spoiler(shape: Shape, coats: Coats) -> list[Piece]:
    """A lip over the rear window with the third brake lamp."""
    top = shape.cabin.top
    at = roof_line(shape, 0.0, np.array([top.rear - 0.03]), 0.0)[0]
    wing = rounded_box((1.72 * top.half_width, 0.26, 0.045), 0.02, 3)
    bent = wing.vertices.copy()
    bent[:, 2] -= 0.05 * (np.abs(bent[:, 0]) / top.half_width) ** 2.5 + 0.12 * bent[:, 1]
    bent[:, 1] -= 0.07 * (np.abs(bent[:, 0]) / top.half_width) ** 2
    lamp = moved(rounded_box((0.3, 0.02, 0.018), 0.006, 2), np.add(at, (0, 0.166, -0.046)))
    return [
        Piece("spoiler", coats.paint, moved(Solid(bent, wing.triangles), np.add(at, (0, 0.05, -0.012)))),
        Piece("brake_light", coats.red_lamp, lamp),
    ]
