"""Roofs over a rectangle about the origin, width along x, depth along y, eaves at z = 0; and chimneys."""

from __future__ import annotations

import numpy as np

from viewsphere.assets.mesh import Material
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.solids import Float, Solid, join, lathe, moved, tube
from viewsphere_zoo.townscape.surfaces import cuboid, prism

THICK = 0.16
"""Thickness of tiles and rafters at the eaves, metres."""


def gable(width: float, depth: float, slope: float, eaves: float, tiles: Material, trim: Material) -> list[Piece]:
    """Ridge along x; slope: rise over run; eaves: how far the roof exceeds the walls in y; in x by half of that and 0.1 m."""
    run, rise = depth / 2 + eaves, slope * depth / 2
    foot = -slope * eaves
    half = width / 2 + 0.5 * eaves + 0.1
    profile = [(-run, foot), (0.0, rise), (0.0, rise + THICK), (-run, foot + THICK)]
    slab = prism(profile, -half, half, axis=0)
    board = [(-run - 0.02, foot - 0.06), (0.0, rise - 0.04), (0.0, rise + THICK - 0.02), (-run - 0.02, foot + THICK - 0.02)]
    verge = [prism(board, s * half - 0.02, s * half + 0.02, axis=0) for s in (-1, 1)]
    front = (slab, *verge)
    back = tuple(Solid(s.vertices * (-1, -1, 1), s.triangles) for s in front)
    ridge = tube([(-half - 0.02, 0, rise + THICK - 0.02), (half + 0.02, 0, rise + THICK - 0.02)], 0.1, 8)
    return [
        Piece("roof", tiles, join(front[0], back[0], ridge)),
        Piece("fascia", trim, join(*front[1:], *back[1:])),
        Piece("gutter", trim, join(*(gutter((-half, half), s * (run + 0.05), foot + 0.05) for s in (-1, 1)))),
    ]


def gutter(x: tuple[float, float], y: float, z: float) -> Solid:
    """A round gutter along x."""
    return tube([(x[0], y, z), (x[1], y, z)], 0.06, 8)


def hip(width: float, depth: float, slope: float, eaves: float, tiles: Material, trim: Material) -> list[Piece]:
    """Four planes of one slope, the ridge along the longer side."""
    a, b = width / 2 + eaves, depth / 2 + eaves
    foot, run = -slope * eaves, min(a, b)
    top = foot + slope * run
    ends = np.array([(-(a - run), -(b - run), top), (a - run, b - run, top)])
    low = np.array([(-a, -b, foot), (a, -b, foot), (a, b, foot), (-a, b, foot)])
    ridge = [ends[0], ends[1]]
    near = [0, 1, 1, 0] if a >= b else [0, 0, 1, 1]
    faces: list[Solid] = []
    for k in range(4):
        i, j = k, (k + 1) % 4
        ring = [low[i], low[j], ridge[near[j]], ridge[near[i]]]
        faces.append(_polygon(np.add(ring, (0, 0, THICK))))
    skirt = [_polygon(np.array([low[i], low[j], low[j] + (0, 0, THICK), low[i] + (0, 0, THICK)])) for i, j in _ring4()]
    under = _polygon(low[::-1])
    hips = [tube([low[k] + (0, 0, THICK - 0.02), ridge[near[k]] + (0, 0, THICK - 0.02)], 0.085, 8) for k in range(4)]
    if abs(a - b) > 0.1:
        hips.append(tube([ridge[0] + (0, 0, THICK - 0.02), ridge[1] + (0, 0, THICK - 0.02)], 0.095, 8))
    edges = [gutter((-a, a), s * (b + 0.05), foot + 0.06) for s in (-1, 1)]
    edges += [
        Solid(g.vertices[:, (1, 0, 2)], g.triangles[:, ::-1])
        for s in (-1, 1)
        for g in [gutter((-b, b), s * (a + 0.05), foot + 0.06)]
    ]
    return [
        Piece("roof", tiles, join(*faces, *hips)),
        Piece("fascia", trim, join(*skirt, under)),
        Piece("gutter", trim, join(*edges)),
    ]


def _ring4() -> list[tuple[int, int]]:
    return [(k, (k + 1) % 4) for k in range(4)]


def _polygon(ring: Float) -> Solid:
    """A convex flat face, counter-clockwise seen from outside."""
    k = np.arange(1, len(ring) - 1)
    return Solid(ring, np.stack([0 * k, k, k + 1], axis=1))


def flat(width: float, depth: float, eaves: float, top: Material, trim: Material) -> list[Piece]:
    """A slab with a raised edge."""
    a, b = width / 2 + eaves, depth / 2 + eaves
    edge = [cuboid((-a, s * b - 0.15 * (s > 0), -0.02), (a, s * b + 0.15 * (s < 0), 0.34)) for s in (-1, 1)]
    edge += [cuboid((s * a - 0.15 * (s > 0), -b + 0.14, -0.018), (s * a + 0.15 * (s < 0), b - 0.14, 0.338)) for s in (-1, 1)]
    slab = cuboid((-a + 0.1, -b + 0.1, -0.01), (a - 0.1, b - 0.1, 0.22))
    return [Piece("roof", top, slab), Piece("fascia", trim, join(*edge))]


def chimney(foot: float, top: float, wall: Material, stone: Material, clay: Material, pots: int) -> list[Piece]:
    """A stack about the origin from foot to top, with a cap and clay pots."""
    stack = cuboid((-0.32, -0.45, foot), (0.32, 0.45, top))
    cap = join(
        cuboid((-0.4, -0.53, top - 0.02), (0.4, 0.53, top + 0.1)), cuboid((-0.36, -0.49, top - 0.3), (0.36, 0.49, top - 0.22))
    )
    pot = [(0.0, 0.25), (0.085, 0.25), (0.1, 0.42), (0.13, 0.42), (0.13, 0.36), (0.115, 0.34), (0.13, 0.05)]
    places = np.linspace(-0.22, 0.22, pots) if pots > 1 else np.zeros(1)
    solids = [moved(lathe(pot[::-1], 14), (0, y, top + 0.04)) for y in places]
    return [Piece("chimney", wall, stack), Piece("chimney", stone, cap), Piece("chimney_pot", clay, join(*solids))]
