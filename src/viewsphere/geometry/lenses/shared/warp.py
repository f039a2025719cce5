"""Maps of the plane that a lens's coefficients describe, and their inverse by a safeguarded Newton's method.

A map is used within a disc around the axis in which its Jacobian's symmetric part is positive definite. The disc is convex, so
(F(p) - F(q)) . (p - q) > 0 for all points p, q of it, and no two of them share a position (the criterion of Noshiro and
Warschawski). Beyond the disc's rim the map is continued along each radius, steeply enough to keep this property in the whole
plane. The continued map takes each position exactly once, so Newton's method with step halving has one solution to find, and a
solution beyond the rim means that the lens shows nothing there.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]

ANGLES = 128
"""Number of directions around the axis in which the Jacobian is examined."""

SLACK = 1 + 1e-12
"""Factor of the limit up to which positions have images, so that rounding puts none of the outermost rays beyond it."""

RADII = 1024
"""Number of radii at which the Jacobian is examined, before the first one that fails is located by bisection."""

KNOTS = 4096
"""Number of radii in the table from which Newton's method starts."""

BETWEEN = 3e-3
"""Share of the variation around a circle by which the Jacobian may be worse between the examined directions. The variation has
at most the third harmonic for the terms of lenses, so its true share is (3 pi / 128)^2 / 4 = 1.4e-3.
"""

FLAT = 1e-9
"""Least slope of a map that counts as rising, relative to a slope of 1 at the axis."""

FARTHEST = math.tan(1.57)
"""The largest radius in the plane z = 1 that is examined: 89.95 degrees off the axis."""

STEEPEST = 1e3
"""The slope, beside a slope of 1 at the axis, at which a map ends: near a rational map's pole, positions lose their digits."""

NEAREST = 0.02
"""The smallest radius, radians or focal lengths, within which a usable map is one-to-one: 1.1 degrees."""

STEPS = 100
"""Maximum number of Newton's steps; 4 to 6 are usual."""

SMALLEST = 2.0**-30
"""The smallest fraction of a step that is tried, where rounding makes further steps useless."""

ROUNDED = 4e-16
"""Residual, relative to 1 + |position|, that further steps hardly improve: two units in the last place."""

EXACT = 1e-13
"""Largest residual of a solution, relative to 1 + |position|; ten times the rounding error of a polynomial of degree 13."""

CHUNK = 1 << 14
"""Number of positions that are solved at once, so that their arrays stay in a processor's cache."""


class Bent(NamedTuple):
    """Images (u, v) of positions (x, y) under a map, and its Jacobian: ux is the derivative of u by x."""

    u: Float
    v: Float
    ux: Float
    uy: Float
    vx: Float
    vy: Float


Map = Callable[[tuple[float, ...], Float, Float], Bent]
"""A map with its coefficients. It is the identity to first order at the axis."""


def check_unfolded(bend: Map, k: tuple[float, ...], farthest: float = FARTHEST) -> None:
    """Raise ValueError for coefficients with which a map is one-to-one nowhere but close to the axis."""
    check_limit(warp_of(bend, k, farthest).limit)


def check_limit(limit: float) -> None:
    """Raise ValueError for a lens that is one-to-one within `limit`, radians or focal lengths, if that is no usable picture."""
    if not limit > NEAREST:
        raise ValueError(
            f"expected coefficients that show {math.degrees(NEAREST):.1f} degrees around the axis; these fold the picture back "
            f"at {math.degrees(limit):.2g} degrees"
        )


@lru_cache(maxsize=64)
def warp_of(bend: Map, k: tuple[float, ...], farthest: float = FARTHEST) -> Warp:
    """The map with these coefficients, within the largest disc, of radius `farthest` at most, in which it is one-to-one."""
    with np.errstate(all="ignore"):
        return Warp(bend, k, _limit(bend, k, farthest))


def _limit(bend: Map, k: tuple[float, ...], farthest: float) -> float:
    turn = np.linspace(0.0, 2 * np.pi, ANGLES, endpoint=False)
    cosine, sine = np.cos(turn), np.sin(turn)

    def is_one_to_one(r: Float) -> NDArray[np.bool_]:
        """Return whether the Jacobian's symmetric part is positive definite on circles of radius r (N,)."""
        at = bend(k, np.outer(r, cosine).ravel(), np.outer(r, sine).ravel())
        half, shear = (at.ux - at.vy) / 2, (at.uy + at.vx) / 2
        middle, spread = (at.ux + at.vy) / 2, np.sqrt(half * half + shear * shear)
        least = (middle - spread).reshape(len(r), ANGLES)
        low, high = least.min(axis=1), least.max(axis=1)
        is_rising = low - BETWEEN * (high - low) > FLAT * (1 if farthest <= math.pi else 1 / (1 + r * r))
        return is_rising & ((middle + spread).reshape(len(r), ANGLES).max(axis=1) < STEEPEST)

    radii = np.tan(np.linspace(0.0, math.atan(farthest), RADII))[1:]
    radii[-1] = farthest
    good = np.concatenate([is_one_to_one(part) for part in np.array_split(radii, 16)])
    if good.all():
        return farthest
    first = int(np.argmin(good))
    low, high = float(radii[first - 1]) if first else 0.0, float(radii[first])
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if is_one_to_one(np.array([middle]))[0] else (low, middle)
    return low


class Warp:
    """A map of the plane within `limit`, the radius up to which it is one-to-one."""

    def __init__(self, bend: Map, k: tuple[float, ...], limit: float) -> None:
        self.limit = limit
        self._bend, self._k = bend, k
        turn = np.linspace(0.0, 2 * np.pi, ANGLES, endpoint=False)
        cosine, sine = np.cos(turn), np.sin(turn)
        at = bend(k, limit * cosine, limit * sine)
        across = (-at.ux * sine + at.uy * cosine), (-at.vx * sine + at.vy * cosine)
        shear, slope = cosine * across[0] + sine * across[1], cosine * across[1] - sine * across[0]
        self._beyond = max(1.0, float((shear * shear / slope).max()))
        """Slope of the continued map along a radius. Its Jacobian's symmetric part is positive definite from a quarter of
        shear^2 / slope on."""
        self._radii = limit * np.linspace(0.0, 1.0, KNOTS)
        self._images = np.maximum.accumulate(bend(k, self._radii, np.zeros(KNOTS)).u)

    def forward(self, x: Float, y: Float) -> tuple[Float, Float]:
        """Images of positions (N,) and (N,), NaN beyond the limit."""
        inside = x * x + y * y <= self.limit * self.limit * SLACK
        with np.errstate(all="ignore"):
            at = self._bend(self._k, np.where(inside, x, np.nan), np.where(inside, y, np.nan))
        return at.u, at.v

    def inverse(self, u: Float, v: Float) -> tuple[Float, Float]:
        """The positions within the limit whose images are u and v (N,), NaN where there is none."""
        x, y = np.full(len(u), np.nan), np.full(len(u), np.nan)
        with np.errstate(all="ignore"):
            for first in range(0, len(u), CHUNK):
                part = slice(first, first + CHUNK)
                x[part], y[part] = self._solved(u[part], v[part])
        return x, y

    def _continued(self, x: Float, y: Float) -> Bent:
        """The map, continued along each radius beyond the limit."""
        r = np.sqrt(x * x + y * y)
        is_out = r > self.limit
        if not is_out.any():
            return self._bend(self._k, x, y)
        scale = np.where(is_out, self.limit / r, 1.0)
        c, s = np.where(is_out, x / r, 1.0), np.where(is_out, y / r, 0.0)
        at = self._bend(self._k, scale * x, scale * y)
        more, slope = self._beyond * (r - self.limit), self._beyond
        across_u = scale * (at.uy * c - at.ux * s) - (1 - scale) * slope * s
        across_v = scale * (at.vy * c - at.vx * s) + (1 - scale) * slope * c
        return Bent(
            np.where(is_out, at.u + more * c, at.u),
            np.where(is_out, at.v + more * s, at.v),
            np.where(is_out, slope * c * c - across_u * s, at.ux),
            np.where(is_out, slope * c * s + across_u * c, at.uy),
            np.where(is_out, slope * s * c - across_v * s, at.vx),
            np.where(is_out, slope * s * s + across_v * c, at.vy),
        )

    def _solved(self, u: Float, v: Float) -> tuple[Float, Float]:
        away = np.sqrt(u * u + v * v)
        start = np.interp(away, self._images, self._radii) / np.where(away > 0, away, 1.0)
        x, y = u * start, v * start
        at = self._continued(x, y)
        error = (u - at.u) ** 2 + (v - at.v) ** 2
        index = np.flatnonzero(np.isfinite(error))
        enough = (ROUNDED * (1 + away)) ** 2
        state = np.stack([x, y, u, v, *at, error, np.ones(len(u))])[:, index]
        for _ in range(STEPS):
            state = self._stepped(state)
            x[index], y[index], error[index] = state[0], state[1], state[10]
            going = (state[10] > enough[index]) & (state[11] > SMALLEST)
            index, state = index[going], state[:, going]
            if not len(index):
                break
        solved = np.isfinite(error) & (np.sqrt(error) <= EXACT * (1 + away))
        inside = solved & (x * x + y * y <= self.limit * self.limit)
        return np.where(inside, x, np.nan), np.where(inside, y, np.nan)

    def _stepped(self, state: Float) -> Float:
        """The state after a step of Newton's method, or with half the step if it does not come closer.

        The state's rows are x, y, the image wanted, the map there, the squared distance from the image wanted, and the share of
        the step to take.
        """
        x, y, u, v, fu, fv, ux, uy, vx, vy, error, share = state
        determinant = ux * vy - uy * vx
        du, dv = u - fu, v - fv
        nx, ny = x + share * (vy * du - uy * dv) / determinant, y + share * (ux * dv - vx * du) / determinant
        at = self._continued(nx, ny)
        after = (u - at.u) ** 2 + (v - at.v) ** 2
        is_closer = after < error
        moved = np.stack([nx, ny, u, v, *at, after, np.minimum(2 * share, 1.0)])
        state[11] = np.where((nx == x) & (ny == y), 0.0, share / 2)
        return np.where(is_closer, moved, state)
