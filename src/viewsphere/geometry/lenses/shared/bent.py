"""Functions shared by lenses that bend lines: the box of projected triangles, and helpers for polynomials."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.lenses import Bounds

Float = NDArray[np.float64]

KNOTS = 1024
"""Number of steps, from the axis to the limit, of the table of upper bounds on how much the lens bends lines."""

RIM = 1 << 14
"""Number of directions sampled along a lens' limit when its rim is searched."""


class BentLens(NamedTuple):
    """A lens as `kernels_bent` uses it: its coefficients, its limit (inclusive) and its camera matrix."""

    is_fisheye: bool
    coefficients: tuple[float, ...]
    limit: float
    K: Float


def bent_bounds(
    bent: BentLens, R: Float, t: Float, vertices: Float, is_used: NDArray[np.bool_], triangles: NDArray[np.int32]
) -> tuple[Bounds | None, bool]:
    """The result of `viewsphere.geometry.lenses.Lens.bounds`, to 1e-5 px; triangles that cross the lens's limit are cut
    there.
    """
    from viewsphere.geometry.lenses.shared import kernels_bent

    own = (bent.is_fisheye, bent.coefficients, bent.limit)
    rim = _rim(*own, float(bent.K[0, 1] / bent.K[0, 0]))
    lens: tuple[Any, ...] = (bent.is_fisheye, np.array(bent.coefficients), bent.limit, bent.K, _bends(*own))
    room, count = np.empty((len(vertices), 6)), len(triangles)
    box, whole = kernels_bent.bent_bounds(vertices, is_used, 0, triangles, 0, count, R, t, lens, rim, room)
    return (box if box[0] <= box[2] else None), whole


@lru_cache(maxsize=64)
def _bends(fisheye: bool, k: tuple[float, ...], limit: float) -> Float:
    from viewsphere.geometry.lenses.shared import kernels_bent

    table = np.empty(KNOTS + 1)
    kernels_bent.tabulate(fisheye, np.array(k), limit, table)
    return table


@lru_cache(maxsize=64)
def _rim(fisheye: bool, k: tuple[float, ...], limit: float, skew: float) -> Float:
    """Directions (M, 3) along a lens' limit whose pixels are locally farthest left, right, up or down."""
    from viewsphere.geometry.lenses.shared import kernels_lens as kernels

    turn, within = np.linspace(0, 2 * np.pi, RIM, endpoint=False), limit * (1 - 1e-12)
    r, z = (math.sin(within), math.cos(within)) if fisheye else (within, 1.0)
    directions = np.stack([r * np.cos(turn), r * np.sin(turn), np.full(RIM, z)], axis=1)
    seen = np.empty((RIM, 2))
    (kernels.distort_fisheye if fisheye else kernels.distort_brown)(np.array(k), limit, directions, seen)
    turns = np.zeros(RIM, np.bool_)
    for along in (seen[:, 0] + skew * seen[:, 1], seen[:, 1]):
        turns |= (along > np.roll(along, 1)) != (np.roll(along, -1) > along)
    return directions[turns]


def first_positive_root(polynomial: Float) -> float:
    """Smallest positive root of a polynomial (highest power first) whose constant term is 1; infinite if there is none.

    The polynomial is solved for 1/s, so the leading coefficient is 1 even if the others are tiny.
    """
    roots = np.roots(polynomial[::-1])
    real = roots.real[(np.abs(roots.imag) <= 1e-9 * np.abs(roots)) & (roots.real > 1e-12)]
    return 1.0 / float(real.max()) if len(real) else math.inf


def padded(coefficients: tuple[float, ...], count: int) -> Float:
    """Return the coefficients, padded with zeros to this length."""
    out = np.zeros(count)
    out[: len(coefficients)] = coefficients
    return out
