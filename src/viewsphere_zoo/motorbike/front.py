"""The parts that turn with the handlebar: fork, bar, grips, mirrors, headlight, front wheel and its mudguard."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from viewsphere_zoo.motorbike.design import Coats, Motorcycle
from viewsphere_zoo.motorbike.wheels import guard, wheel_pieces
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.rods import rod, shifted, smooth
from viewsphere_zoo.shapes.sheets import sheet
from viewsphere_zoo.shapes.solids import Float, Solid, both_sides, join, lathe, mirrored, moved, rounded_box, tube, turned


def front_pieces(p: Motorcycle, c: Coats) -> list[Piece]:
    """The steered pieces, turned by the steering's angle about the fork's axis."""
    pieces = [*wheel_pieces(p, 0, c), *_fork(p, c), *_bar(p, c)]
    width = p.tyre[0] + 0.03
    reach = (25, 118) if p.style in ("naked", "sport") else (5, 150)
    pieces.append(Piece("mudguard_front", c.paint, guard(p.front_axle, p.radius[0] + 0.028, width, *reach)))
    if p.style in ("naked", "cruiser", "tourer"):
        pieces += headlight(shifted(p.head, 0, -0.13 - 0.04 * (p.style == "cruiser"), -0.04), 0.095, c)
    if p.style in ("naked", "cruiser", "tourer") and p.screen:
        pieces.append(Piece("windscreen", c.glass, _screen(p)))
    return steered(pieces, p)


def steered(pieces: Sequence[Piece], p: Motorcycle) -> list[Piece]:
    """The pieces turned about the fork's axis (Rodrigues' formula)."""
    a, k = np.radians(p.steering), p.up
    cross = np.array([(0, -k[2], k[1]), (k[2], 0, -k[0]), (-k[1], k[0], 0)])
    r = np.eye(3) + np.sin(a) * cross + (1 - np.cos(a)) * cross @ cross
    return [Piece(q.part, q.material, Solid((q.solid.vertices - p.head) @ r.T + p.head, q.solid.triangles)) for q in pieces]


def _fork(p: Motorcycle, c: Coats) -> list[Piece]:
    """Two legs: bright stanchions above, sliders below, joined by two yokes."""
    x, axle, up, length = p.tyre[0] / 2 + 0.045, p.front_axle, p.up, p.fork
    foot, middle, top = (shifted(axle + s * up, x) for s in (-0.02, 0.52 * length, length + 0.02))
    if p.style == "scooter":
        middle, top = (shifted(axle + s * up, x) for s in (0.2, 0.4))
    yokes = [
        moved(turned(rounded_box((2 * x + 0.07, 0.075, 0.03), 0.012, 2), 0, -np.radians(p.rake)), axle + s * up)
        for s in ((0.4,) if p.style == "scooter" else (length - 0.18, length))
    ]
    caliper = moved(rounded_box((0.035, 0.06, 0.1), 0.012, 1), shifted(axle, x - 0.012, 0.11, 0.03))
    column = rod(axle + 0.38 * up, axle + (length + 0.05) * up, 0.028, 12)
    return [
        Piece("fork", c.chrome, both_sides(rod(middle, top, 0.021, 12))),
        Piece("fork", c.steel if p.bright else c.black, both_sides(rod(foot, middle, (0.024, 0.03), 12))),
        Piece("fork", c.black, join(*yokes, column)),
        Piece("caliper", c.black, caliper if p.style == "scooter" else both_sides(caliper)),
    ]


def _bar(p: Motorcycle, c: Coats) -> list[Piece]:
    """Handlebar, grips, levers, mirrors and a clock."""
    width, rise = p.bar
    clamp = p.head + 0.03 * p.up
    end = shifted(clamp, width / 2, p.pull, rise)
    inner = shifted(clamp, width / 2 - 0.14, p.pull - 0.035, rise + 0.005)
    knee = shifted(clamp, 0.13, 0.02 - 0.02 * (rise > 0.15), 0.6 * rise)
    line = smooth([shifted(clamp, 0.0), shifted(clamp, 0.07), knee, inner, end], 4)
    tip = end - inner
    grip = rod(inner, end + 0.05 * tip, 0.0185, 12)
    lever = tube(
        [shifted(inner, -0.02, -0.03), shifted(inner, 0.03, -0.065, -0.004), shifted(end, -0.01, -0.06, -0.012)], 0.006, 6
    )
    switch = moved(rounded_box((0.06, 0.05, 0.045), 0.015, 1), shifted(inner, -0.03))
    stalk = shifted(inner, -0.02, -0.01, 0.02)
    mirror_at = shifted(stalk, 0.1, -0.02, 0.15)
    glass = turned(lathe([(0, 0.012), (0.054, 0.012), (0.058, 0.0), (0.045, -0.03), (0, -0.04)][::-1], 16), 0, -np.pi / 2 - 0.1)
    mirror = Solid(glass.vertices * (1.35, 1, 0.85), glass.triangles)
    pieces = [Piece("handlebar", c.chrome if p.bright else c.black, both_sides(tube(line, 0.0125, 8)))]
    for side, place in (("left", None), ("right", mirrored)):
        for part, material, solid in (
            ("grip", c.rubber, grip),
            ("lever", c.steel, join(lever, switch)),
            (
                "mirror",
                c.black,
                join(moved(mirror, mirror_at), tube([stalk, shifted(stalk, 0.04, -0.01, 0.1), mirror_at], 0.007, 6)),
            ),
        ):
            pieces.append(Piece(f"{part}_{side}", material, place(solid) if place else solid))
    clock = turned(lathe([(0, -0.03), (0.04, -0.03), (0.05, 0.0), (0.05, 0.025), (0.044, 0.028), (0, 0.026)], 18), 0, 0.5)
    return [*pieces, Piece("clock", c.black, moved(clock, shifted(p.head, 0, -0.06, 0.07)))]


def headlight(at: Float, radius: float, c: Coats) -> list[Piece]:
    """A round headlight, and indicators beside it."""
    shell = [
        (0, -0.11),
        (0.45 * radius, -0.1),
        (0.9 * radius, -0.05),
        (1.03 * radius, 0.0),
        (1.03 * radius, 0.018),
        (0.93 * radius, 0.022),
    ]
    lens = [(0.95 * radius, 0.012), (0.7 * radius, 0.03), (0, 0.04)]
    ahead = [moved(turned(lathe(profile, 24), 0, np.pi / 2), at) for profile in (shell, lens)]
    blinker = moved(
        turned(lathe([(0, -0.03), (0.026, -0.015), (0.03, 0.01), (0, 0.02)], 12), 0, np.pi / 2), shifted(at, 0.19, 0.03, 0.0)
    )
    stalk = rod(shifted(at, 0.05, 0.05), shifted(at, 0.18, 0.03), 0.008, 6)
    pieces = [Piece("headlight", c.chrome, ahead[0]), Piece("headlight", c.white_lamp, ahead[1])]
    for side, place in (("left", None), ("right", mirrored)):
        pieces.append(Piece(f"indicator_{side}", c.amber, place(blinker) if place else blinker))
        pieces.append(Piece(f"indicator_{side}", c.black, place(stalk) if place else stalk))
    return pieces


def _screen(p: Motorcycle) -> Solid:
    """A bent pane above the headlight."""
    x = np.linspace(-1, 1, 9)
    v = np.linspace(0, 1, 6)
    points = np.empty((9, 6, 3))
    points[..., 0] = x[:, None] * (0.22 - 0.06 * v**2)
    points[..., 1] = p.head[1] - 0.2 + 0.1 * x[:, None] ** 2 + 0.3 * p.screen * v
    points[..., 2] = p.head[2] + 0.06 + p.screen * v - 0.05 * x[:, None] ** 2 * v
    return sheet(points, 0.006)
