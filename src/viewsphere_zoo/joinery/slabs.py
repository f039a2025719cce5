"""Seats, pads and cushions: slabs over an outline, with rounded edges and crowned or hollow faces, bent onto surfaces."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from viewsphere_zoo.joinery.members import bend, dense, hoop
from viewsphere_zoo.shapes.panels import Surface, raised
from viewsphere_zoo.shapes.solids import Float, Solid, flipped, grid, join

Height = Callable[[Float, Float], Float]
"""Maps arrays x, y of one shape to heights, metres."""


def polygon(corners: ArrayLike, radius: float, spacing: float = 0.03) -> Float:
    """A closed counter-clockwise outline (N, 2) with rounded corners and sides divided for bending."""
    return dense(bend(corners, radius, 6, closed=True), spacing, closed=True)


def box_outline(
    width: float, depth: float, radius: float, spacing: float = 0.03, middle: tuple[float, float] = (0.0, 0.0)
) -> Float:
    """A rounded rectangle."""
    x, y = width / 2, depth / 2
    return polygon(np.array([(-x, -y), (x, -y), (x, y), (-x, y)]) + middle, radius, spacing)


def level(height: float) -> Height:
    """A flat face."""
    return lambda x, y: np.full_like(x, height)


def crowned(outline: Float, height: float, crown: float) -> Height:
    """A face that is at this height on the border and rises by `crown` in the middle."""
    middle, half = (outline.max(axis=0) + outline.min(axis=0)) / 2, np.ptp(outline, axis=0) / 2

    def face(x: Float, y: Float) -> Float:
        u, v = (x - middle[0]) / half[0], (y - middle[1]) / half[1]
        return height + crown * np.clip(1 - u**2, 0, 1) * np.clip(1 - v**2, 0, 1)

    return face


def slab(outline: Float, bottom: Height, top: Height, rounding: float, rings: int = 5, steps: int = 4) -> Solid:
    """The solid between two faces over a closed outline, star-shaped about its mean, with rounded edges."""
    along = np.roll(outline, -1, axis=0) - np.roll(outline, 1, axis=0)
    outward = np.stack([along[:, 1], -along[:, 0]], axis=1) / np.linalg.norm(along, axis=1, keepdims=True)
    x, y = outline.T
    r = min(rounding, 0.499 * float((top(x, y) - bottom(x, y)).min()))
    turn = np.linspace(0, np.pi / 2, steps + 1)
    edge = outline - outward * (r * (1 - np.cos(turn)))[:, None, None]
    center = edge[-1].mean(axis=0)
    inner = center + (edge[-1] - center) * np.linspace(1, 0, rings + 1)[1:, None, None]
    plan = np.concatenate([edge, inner])
    drop = np.concatenate([r - r * np.sin(turn), np.zeros(rings)])[:, None]
    over = np.dstack([plan, top(plan[..., 0], plan[..., 1]) - drop])
    under = np.dstack([plan, bottom(plan[..., 0], plan[..., 1]) + drop])
    return flipped(grid(np.concatenate([under[::-1], over]), wrap=True))


def seam(outline: Float, face: Height, rounding: float, radius: float = 0.004, up: bool = True) -> Solid:
    """Piping along the rounded edge of a slab's top or bottom face."""
    along = np.roll(outline, -1, axis=0) - np.roll(outline, 1, axis=0)
    outward = np.stack([along[:, 1], -along[:, 0]], axis=1) / np.linalg.norm(along, axis=1, keepdims=True)
    share = 1 - np.sqrt(0.5)
    xy = outline - outward * rounding * share
    z = face(xy[:, 0], xy[:, 1]) + (-1 if up else 1) * rounding * share
    return hoop(np.column_stack([xy, z]), radius)


def cushion(outline: Float, thickness: float, crown: float, rounding: float, rings: int = 7) -> tuple[Solid, Solid]:
    """A loose cushion whose border touches z = 0 and whose faces both bulge; the second solid is its piping."""
    top, bottom = crowned(outline, thickness, crown), crowned(outline, 0.0, -0.3 * crown)
    pipings = join(seam(outline, top, rounding), seam(outline, bottom, rounding, up=False))
    return slab(outline, bottom, top, rounding, rings), pipings


def on(surface: Surface, solid: Solid) -> Solid:
    """The solid laid onto a surface: x, y become u, v and z the height above it."""
    return Solid(raised(surface, solid.vertices[:, :2], solid.vertices[:, 2]), solid.triangles)


def leaning(y: float, z: float, lean: float, hollow: float = 0.0, lumbar: float = 0.0, span: float = 0.6) -> Surface:
    """A back seen from its front: u to the left, v upwards from (y, z), facing -Y.

    lean: run to the rear per metre of height; hollow: how far the sides come forward per square metre of u squared;
    lumbar: how far the middle of the height, of `span` metres, stands forward.
    """
    rise = 1 / np.sqrt(1 + lean**2)

    def surface(u: Float, v: Float) -> Float:
        belly = lumbar * np.sin(np.pi * np.clip(v / span, -0.2, 1.2))
        return np.stack([u, y + v * lean * rise - hollow * u**2 - belly, z + v * rise], axis=-1)

    return surface
