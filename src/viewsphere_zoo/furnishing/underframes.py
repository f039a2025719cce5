"""The frames under a table's top other than four legs: a pedestal, three feet, trestles, frames of steel tube."""

from __future__ import annotations

import numpy as np

from viewsphere.assets.mesh import Material
from viewsphere_zoo.furnishing.casework import block, grounded
from viewsphere_zoo.furnishing.coats import Timber
from viewsphere_zoo.joinery.members import bar, spindle
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.rods import ring_of, smooth
from viewsphere_zoo.shapes.solids import Solid, join, lathe


def pedestal(coat: Material, top: float, wide: float, turned: bool) -> list[Piece]:
    """A column on four feet if turned, else a stem that rises from a round plate."""
    r = 0.3 * wide
    if not turned:
        neck = 0.035 + 0.02 * wide
        profile = [(0, 0), (r, 0), (r, 0.008), (0.8 * r, 0.022), (1.5 * neck, 0.06), (neck, 0.14), (0.8 * neck, 0.4 * top)]
        profile += [(0.85 * neck, 0.7 * top), (1.4 * neck, 0.9 * top), (0.55 * r, top - 0.012), (0.6 * r, top), (0, top)]
        return [Piece("foot", coat, lathe(profile, 40))]
    shape = [(0, 0.05), (0.05, 0.055), (0.09, 0.04), (0.2, 0.038), (0.34, 0.062), (0.42, 0.068), (0.5, 0.05), (0.54, 0.034)]
    shape += [(0.6, 0.046), (0.8, 0.034), (0.9, 0.04), (0.93, 0.055), (1.0, 0.055)]
    column = spindle((0, 0, 0.2 * top), (0, 0, top - 0.02), [(f, radius * (0.6 + 0.5 * wide)) for f, radius in shape], 28)
    cleats = [block((-r, -0.035, top - 0.03), (r, 0.035, top)), block((-0.035, -r, top - 0.031), (0.035, r, top - 0.001))]
    return [Piece("column", coat, join(column, *cleats)), Piece("foot", coat, ring_of(_claw(top, 1.25 * r), 4, 2, np.pi / 4))]


def _claw(top: float, reach: float) -> Solid:
    """A bowed foot that reaches out along x."""
    path = smooth([(0.0, 0, 0.34 * top), (0.3 * reach, 0, 0.31 * top), (0.72 * reach, 0, 0.12 * top), (reach, 0, 0.024)], 4)
    sizes = np.stack([np.linspace(0.052, 0.04, len(path)), np.linspace(0.08, 0.045, len(path))], axis=1)
    return grounded(bar(path, sizes, 0.01, (0, 1, 0), 2))


def tripod(wood: Timber, top: float, radius: float) -> list[Piece]:
    """A slim turned column on three bowed feet."""
    shape = [(0, 0.02), (0.06, 0.03), (0.12, 0.024), (0.3, 0.028), (0.42, 0.036), (0.5, 0.022), (0.54, 0.03), (0.6, 0.018)]
    shape += [(0.9, 0.016), (0.94, 0.028), (1.0, 0.028)]
    column = spindle((0, 0, 0.12 * top), (0, 0, top - 0.014), shape, 20)
    plate = lathe([(0, top - 0.016), (0.35 * radius, top - 0.016), (0.35 * radius, top), (0, top)], 24)
    path = smooth([(0, 0, 0.3 * top), (0.35 * radius, 0, 0.26 * top), (0.75 * radius, 0, 0.1 * top), (radius, 0, 0.014)], 4)
    foot = bar(path, np.linspace((0.03, 0.05), (0.03, 0.026), len(path)), 0.008, (0, 1, 0), 2)
    return [
        Piece("column", wood.upright, join(column, plate)),
        Piece("foot", wood.upright, ring_of(grounded(foot), 3, 2, -np.pi / 2)),
    ]


def trestles(wood: Timber, top: float, width: float, depth: float, size: float) -> list[Piece]:
    """A post on a foot at both ends, and a stretcher between them."""
    x, y = width / 2 - 0.22 * width, depth / 2 - 0.06
    feet, posts = [], []
    for s in (-1, 1):
        feet.append(
            bar([(s * x, -y, size / 2), (s * x, 0, 0.6 * size), (s * x, y, size / 2)], (1.2 * size, size), 0.012, (1, 0, 0), 2)
        )
        posts.append(block((s * x - 0.5 * size, -y + 0.04, top - 0.07), (s * x + 0.5 * size, y - 0.04, top), 0.01))
        for t in (-1, 1):
            path = [(s * x, t * 0.42 * y, 0.6 * size), (s * x, t * 0.3 * y, top - 0.06)]
            posts.append(bar(path, (1.0 * size, 1.2 * size), 0.008, (1, 0, 0), 2))
    beam = block((-x - 0.1, -0.02, 0.3 * top), (x + 0.1, 0.02, 0.3 * top + 0.09), 0.006)
    return [
        Piece("foot", wood.upright, join(*feet)),
        Piece("column", wood.upright, join(*posts)),
        Piece("stretcher", wood.along, beam),
    ]


def sleds(steel: Material, top: float, half: tuple[float, float], open_front: bool) -> list[Piece]:
    """A closed frame of square tube at both ends, joined under the top; open_front: no rail at the sitter's knees."""
    (x, y), t = half, 0.022
    solids = []
    for s in (-1, 1):
        for z in (t, top - t):
            solids.append(block((s * x - t, -y, z - t), (s * x + t, y, z + t), 0.004))
        for e in (-1, 1):
            solids.append(block((s * x - t, e * y - t, 0.0), (s * x + t, e * y + t, top), 0.004))
    rails = [y] if open_front else [-y, y]
    solids += [block((-x, e - 0.7 * t, top - 1.7 * t), (x, e + 0.7 * t, top - 0.3 * t), 0.004) for e in rails]
    return [Piece("leg", steel, join(*solids))]
