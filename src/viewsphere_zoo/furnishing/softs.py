"""The soft parts of furniture: cushions, pillows, cloths draped over furniture, tufted panels."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from viewsphere_zoo.joinery.members import bend, dense
from viewsphere_zoo.joinery.slabs import crowned, slab
from viewsphere_zoo.shapes.sheets import sheet
from viewsphere_zoo.shapes.solids import Float, Solid, fan, flipped, grid, join, moved, rounded_box, turned


def padded(low: ArrayLike, high: ArrayLike, rounding: float = 0.04, steps: int = 3) -> Solid:
    """An upholstered box between two corners."""
    a, b = np.asarray(low, np.float64), np.asarray(high, np.float64)
    return moved(rounded_box(b - a, rounding, steps), (a + b) / 2)


def cushion(size: tuple[float, float, float], crown: float, rounding: float = 0.04) -> Solid:
    """A loose cushion (width, depth, thickness) whose faces bulge by `crown`, its underside about z = 0."""
    x, y = size[0] / 2, size[1] / 2
    corners = bend([(-x, -y), (x, -y), (x, y), (-x, y)], 1.3 * rounding, 3, closed=True)
    outline = dense(corners, 0.2, closed=True)
    return slab(outline, crowned(outline, 0.0, -0.25 * crown), crowned(outline, size[2], crown), rounding, 3, 3)


def upright(solid: Solid, at: ArrayLike, lean_deg: float) -> Solid:
    """Return a solid at the origin set on its edge: its y upwards, its top to the front (-Y), leaning to the rear."""
    return moved(turned(solid, 0, np.pi / 2 - np.radians(lean_deg)), at)


def pillow(width: float, height: float, thickness: float, pinch: float = 0.07, count: int = 10) -> Solid:
    """A stuffed pillow about the origin: pointed corners, sides drawn in by `pinch` of its width, thickness along z."""
    s = np.sin(np.linspace(-np.pi / 2, np.pi / 2, count))
    u, v = np.meshgrid(s, s, indexing="ij")
    x = u * (1 - pinch * (1 - v * v) * np.abs(u))
    y = v * (1 - pinch * (1 - u * u) * np.abs(v))
    z = np.sqrt((1 - u**2) * (1 - v**2)) * (0.75 + 0.25 * (1 - u**2) * (1 - v**2)) + 0.03
    half = np.array((width, height, thickness)) / 2
    over, under = (np.stack([x, y, f * z], axis=-1) * half for f in (1, -1))
    return join(grid(over), flipped(grid(under)), _rim(over, under))


def _rim(over: Float, under: Float) -> Solid:
    """The narrow band between the borders of two faces."""
    return flipped(grid(np.stack([_border(under), _border(over)]), wrap=True))


def _border(face: Float) -> Float:
    """The points around a face (M, N, 3), counter-clockwise seen from its outside."""
    return np.concatenate([face[:-1, 0], face[-1, :-1], face[:0:-1, -1], face[0, :0:-1]])


def draped(
    rng: np.random.Generator,
    cloth: tuple[float, float, float, float],
    block: tuple[float, float, float, float],
    top: float,
    thickness: float,
    fold: float = 0.02,
    spacing: float = 0.09,
    floor: float = 0.03,
) -> Solid:
    """A cloth on a block, hanging over its sides.

    cloth: low x, low y, high x, high y of the cloth spread out flat; block: the same bounds of the block, whose face is at z =
    top; fold: how far the hanging folds stand out, metres; floor: the least height of the hem.
    """
    x0, y0, x1, y1 = cloth
    nx, ny = (max(4, round((b - a) / spacing)) for a, b in ((x0, x1), (y0, y1)))
    flat = np.stack(np.meshgrid(np.linspace(x0, x1, nx + 1), np.linspace(y0, y1, ny + 1), indexing="ij"), axis=-1)
    r = 0.05
    near = np.clip(flat, np.array(block[:2]) + r, np.array(block[2:]) - r)
    off = flat - near
    length = np.linalg.norm(off, axis=-1)
    out = off / np.maximum(length, 1e-9)[..., None]
    angle = np.minimum(length / r, np.pi / 2)
    hangs = np.maximum(length - r * np.pi / 2, 0)
    phase = float(rng.uniform(0, 2 * np.pi))
    along = near[..., 0] * 17 + near[..., 1] * 13 + 4 * np.arctan2(out[..., 1], out[..., 0]) + phase
    bulge = fold * np.minimum(hangs / 0.15, 1.0) * (0.9 + np.sin(along) + 0.4 * np.sin(2.3 * along + 1))
    reach = thickness / 2 + r * np.sin(angle) + bulge
    drop = r * (1 - np.cos(angle)) + hangs
    lift = _creases(rng, flat) * np.exp(-((length / r) ** 2))
    z = np.maximum(top + thickness / 2 + lift - drop, floor + thickness / 2)
    return sheet(np.concatenate([near + out * reach[..., None], z[..., None]], axis=-1), thickness)


def _creases(rng: np.random.Generator, flat: Float, depth: float = 0.006) -> Float:
    """Soft creases of a cloth that lies flat, at most about 12 mm up or down."""
    total = np.zeros(flat.shape[:2])
    for _ in range(5):
        turn, length = rng.uniform(0, np.pi), rng.uniform(0.22, 0.6)
        wave = (flat[..., 0] * np.cos(turn) + flat[..., 1] * np.sin(turn)) * 2 * np.pi / length
        total += np.sin(wave + rng.uniform(0, 2 * np.pi) + 0.8 * np.sin(0.6 * wave))
    return depth * np.clip(total / 1.6, -2, 2)


def tufted(width: float, height: float, thickness: float, columns: int, rows: int, depth: float = 0.022) -> tuple[Solid, Float]:
    """A panel about the origin, deep-buttoned on its face (+Z), and the places (N, 3) of its buttons."""
    nx, ny = 6 * columns, 5 * rows
    u, v = np.meshgrid(np.linspace(-0.5, 0.5, nx + 1), np.linspace(-0.5, 0.5, ny + 1), indexing="ij")
    spots = [
        ((i + 0.5 + 0.5 * (k % 2)) / columns - 0.5, (k + 0.5) / rows - 0.5) for k in range(rows) for i in range(columns - k % 2)
    ]
    dent = np.zeros_like(u)
    for a, b in spots:
        d = np.hypot((u - a) * columns, (v - b) * rows)
        dent = np.maximum(dent, np.exp(-((d / 0.22) ** 2)) + 0.3 * np.exp(-((d / 0.55) ** 2)))
    edge = np.minimum(0.5 - np.abs(u), (0.5 - np.abs(v)) * height / width) * width
    z = thickness / 2 - depth * np.minimum(dent, 1) - 0.6 * thickness * np.exp(-((edge / (0.35 * thickness)) ** 2))
    over = np.stack([u * width, v * height, z], axis=-1)
    under = np.stack([u * width, v * height, np.full_like(u, -thickness / 2)], axis=-1)
    places = np.array([(a * width, b * height, thickness / 2 - 0.85 * depth) for a, b in spots])
    return join(grid(over), flipped(fan(_border(under))), _rim(over, under)), places
