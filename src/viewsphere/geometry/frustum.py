"""The shape of what a lens shows, as lines in camera axes: a pyramid, a box, or a part of a sphere or of a cylinder."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.lenses import Lens

Float = NDArray[np.float64]

STEP = 10.0
"""Largest angle between two points of a bent line, degrees: chords of a circle then leave it by 0.4 % of its radius."""

MESH = 45.0
"""Largest angle between two lines across a bent picture, degrees: a full turn has 8 columns."""

HALVINGS = 24
"""Halvings of the line from a corner without a ray to the picture's middle: a part of 2^24 of it is below a pixel."""


class _Frustum(NamedTuple):
    """Lines (N, 3) in camera axes: the picture's upper, right, lower and left border, clockwise; lines across a bent picture;
    and the rays to its corners, with the picture's other end where rays are parallel.
    """

    border: tuple[Float, Float, Float, Float]
    across: tuple[Float, ...]
    edges: tuple[Float, ...]

    @property
    def lines(self) -> tuple[Float, ...]:
        """All lines of more than one point."""
        return tuple(line for line in (*self.border, *self.across, *self.edges) if len(line) > 1)


def frustum(lens: Lens, length: float) -> _Frustum:
    """The lines of what a lens shows. The farthest point of the picture is at `length`; where rays are parallel, all points are
    this far ahead, and the picture has its own width. Where corners have no ray, the border is that of the rays.
    """
    w, h = lens.intrinsics.width, lens.intrinsics.height
    angles = lens.field_of_view()
    u, v = (np.linspace(0, n, 2 * _parts(lens, angle, 2 * STEP) + 1) for n, angle in zip((w, h), angles, strict=True))
    columns, rows = (_parts(lens, angle, MESH) for angle in angles)
    sides = [_seen(lens, side) for side in (_line(u, 0.0), _line(w, v), _line(u[::-1], h), _line(0.0, v[::-1]))]
    inner = [_line(w * k / columns, v) for k in range(1, columns)] + [_line(u, h * k / rows) for k in range(1, rows)]
    if lens.is_parallel:
        return _box([lens.rays(side).origins for side in sides], length)
    ends = [lens.on_screen(lens.rays(line).directions) for line in (*sides, *inner)]
    ends = [line[~np.isnan(line).any(axis=1)] for line in ends]
    farthest = max((float(np.linalg.norm(line, axis=1).max()) for line in ends if len(line)), default=1.0)
    lines = [_distinct(line * (length / farthest)) for line in ends]
    return _Frustum(_four(lines), tuple(lines[4:]), tuple(np.array([np.zeros(3), side[0]]) for side in lines[:4] if len(side)))


def _box(sides: list[Float], length: float) -> _Frustum:
    """The box of parallel rays that begin on these sides of the picture."""
    ends = [side + np.array([0.0, 0.0, length]) for side in sides]
    corners = [np.array([near[0], far[0]]) for near, far in zip(sides, ends, strict=True)]
    return _Frustum(_four(ends), (), (*sides, *corners))


def _four(lines: list[Float]) -> tuple[Float, Float, Float, Float]:
    return lines[0], lines[1], lines[2], lines[3]


def _parts(lens: Lens, angle: float, most: float) -> int:
    """Number of equal parts of at most this angle, of an angle of view of a lens, degrees; 1 for straight lenses."""
    return 1 if lens.is_straight or not math.isfinite(angle) else max(1, math.ceil(angle / most - 1e-6))


def _line(u: Float | float, v: Float | float) -> Float:
    return np.column_stack(np.broadcast_arrays(u, v)).astype(np.float64)


def _seen(lens: Lens, xy: Float) -> Float:
    """Positions (M, 2) of the picture, moved towards its principal point until they have a ray; others are left out."""
    i = lens.intrinsics
    middle = np.clip((i.cx, i.cy), 0, (i.width, i.height))
    share, step = np.where(_has_ray(lens, xy), 1.0, 0.0), 0.5
    is_open = share < 1
    for _ in range(HALVINGS):
        farther = np.where(is_open, share + step, share)
        share = np.where(_has_ray(lens, middle + farther[:, None] * (xy - middle)), farther, share)
        step /= 2
    at = middle + share[:, None] * (xy - middle)
    return at[_has_ray(lens, at)]


def _has_ray(lens: Lens, xy: Float) -> NDArray[np.bool_]:
    return np.isfinite(lens.rays(xy).directions[:, 0])


def _distinct(line: Float) -> Float:
    """A line without repeated points, as at the poles of a panorama."""
    if len(line) < 2:
        return line
    is_new = np.linalg.norm(np.diff(line, axis=0), axis=1) > 1e-9
    return line[np.concatenate([[True], is_new])]
