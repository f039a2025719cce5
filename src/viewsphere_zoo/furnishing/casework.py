"""Boards, legs, fronts and handles: the components of cabinets, shelves, desks and tables."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from viewsphere.assets.mesh import Material
from viewsphere_zoo.joinery.members import bar, pipe, spindle
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.rods import rod
from viewsphere_zoo.shapes.solids import Solid, join, lathe, moved, rounded_box, turned

Leg = Literal["square", "tapered", "turned", "splayed", "hairpin"]
Pull = Literal["knob", "bar", "cup", "rail", "none"]

_TURNED = (
    *((0.0, 0.3), (0.02, 0.42), (0.06, 0.36), (0.09, 0.26), (0.3, 0.36), (0.62, 0.5), (0.68, 0.34), (0.71, 0.5)),
    *((0.75, 0.32), (0.78, 0.44), (0.8, 0.48), (1.0, 0.48)),
)


def block(low: ArrayLike, high: ArrayLike, bevel: float = 0.003) -> Solid:
    """A board between two corners, with softened edges."""
    a, b = np.asarray(low, np.float64), np.asarray(high, np.float64)
    return moved(rounded_box(b - a, bevel, 1), (a + b) / 2)


def leg(kind: Leg, at: tuple[float, float], top: float, size: float, away: tuple[float, float] = (0.0, 0.0)) -> Solid:
    """A leg from the floor to z = top; size: its thickness at the top; away: direction (x, y) in which the foot is splayed."""
    x, y = at
    if kind == "turned":
        return spindle((x, y, 0), (x, y, top), [(f, r * size) for f, r in _TURNED], 16)
    if kind == "splayed":
        run = 0.16 * top
        shape = [(0, 0.27 * size), (0.02, 0.3 * size), (1, 0.52 * size)]
        return footed(spindle((x + run * away[0], y + run * away[1], 0), (x, y, top), shape, 16))
    if kind == "hairpin":
        run, gap = 0.12 * top, 0.055
        foot = np.array((x + run * away[0], y + run * away[1], 0.006))
        ends = np.array((x - gap * away[0], y, top + 0.006)), np.array((x, y - gap * away[1], top + 0.006))
        bent = pipe([ends[0], foot - (0.012 * away[0], 0, 0), foot - (0, 0.012 * away[1], 0), ends[1]], 0.006, 0.012, 7)
        return grounded(bent)
    foot = 0.6 if kind == "tapered" else 1.0
    widths = [(size * foot,) * 2, (size * (0.3 * foot + 0.7),) * 2, (size,) * 2, (size,) * 2]
    path = [(x, y, 0), (x, y, 0.6 * top), (x, y, 0.84 * top), (x, y, top)]
    return bar(path, widths, 0.004, (1, 0, 0), 2)


def footed(solid: Solid) -> Solid:
    """The solid with everything below the floor pressed flat onto it, like a slanting leg that is sawn off."""
    return Solid(np.maximum(solid.vertices, (-np.inf, -np.inf, 0.0)), solid.triangles)


def grounded(solid: Solid) -> Solid:
    """The solid moved up or down until it stands on z = 0."""
    return moved(solid, (0, 0, -float(solid.vertices[:, 2].min())))


def four(kind: Leg, half: tuple[float, float], top: float, size: float) -> Solid:
    """Four legs at the corners of a centred rectangle of these half widths."""
    return join(*(leg(kind, (sx * half[0], sy * half[1]), top, size, (sx, sy)) for sx in (-1, 1) for sy in (-1, 1)))


def pull(kind: Pull, at: tuple[float, float, float], wide: float, upright: bool = False) -> Solid | None:
    """A handle on a front that faces -Y; at: its middle on the front's face; wide: its length, along z where upright."""
    if kind == "none":
        return None
    if kind == "knob":
        dome = lathe([(0, 0), (0.006, 0), (0.006, 0.012), (0.015, 0.018), (0.016, 0.025), (0.01, 0.03), (0, 0.031)], 14)
        return moved(turned(dome, 0, np.pi / 2), at)
    if kind == "cup":
        a = np.linspace(0, np.pi / 2, 5)
        rings = [(0.0, 0.02), *zip(0.045 * np.sin(a), 0.02 * np.cos(a), strict=True)]
        half = lathe([(r, h) for r, h in rings[1:]][::-1], 16)
        return moved(turned(Solid(half.vertices * (1, 0.5, 1), half.triangles), 0, np.pi / 2), at)
    if kind == "rail":
        solid = rounded_box((wide, 0.022, 0.012), 0.004, 1)
    else:
        posts = [rod((s * 0.4 * wide, 0.011, 0), (s * 0.4 * wide, -0.02, 0), 0.004, 8) for s in (-1, 1)]
        solid = join(moved(rod((-wide / 2, 0, 0), (wide / 2, 0, 0), 0.0055, 8), (0, -0.02, 0)), *posts)
        solid = moved(solid, (0, -0.01, 0))
    return moved(turned(solid, 1, np.pi / 2) if upright else solid, (at[0], at[1] - (0.008 if kind == "rail" else 0), at[2]))


def front(
    low: tuple[float, float],
    high: tuple[float, float],
    face: float,
    wood: Material,
    part: str,
    frame: float = 0.0,
    thick: float = 0.018,
) -> list[Piece]:
    """A door's or drawer's front between (x, z) corners, its face at y = face (towards -Y).

    frame: width of a border around a recessed panel, 0 for a plain front.
    """
    (x0, z0), (x1, z1) = low, high
    if frame == 0 or min(x1 - x0, z1 - z0) < 2.6 * frame:
        return [Piece(part, wood, block((x0, face, z0), (x1, face + thick, z1), 0.002))]
    panel = block((x0 + 0.5 * frame, face + 0.009, z0 + 0.5 * frame), (x1 - 0.5 * frame, face + thick, z1 - 0.5 * frame), 0.001)
    stiles = [block((x, face, z0), (x + frame, face + thick, z1), 0.002) for x in (x0, x1 - frame)]
    rails = [block((x0 + frame, face, z), (x1 - frame, face + thick, z + frame), 0.002) for z in (z0, z1 - frame)]
    return [Piece(part, wood, join(panel, *stiles, *rails))]


def handles(part: str, coat: Material, found: list[Solid | None]) -> list[Piece]:
    """The handles as one piece; an empty list without handles."""
    solids = [s for s in found if s is not None]
    return [Piece(part, coat, join(*solids))] if solids else []
