"""A hull's lines: sheer, keel, stem, stern, plan and sections.

The ship's frame: z = 0 is the waterline, y = 0 the stem's head, +Y aft, +X the left (port) side. A point on the left
skin has t from 0 (stem) to 1 (stern) and v from 0 (keel) to 1 (sheer).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from viewsphere_zoo.shapes.solids import Float, curve

Knots = tuple[tuple[float, float], ...]
Quad = tuple[float, float, float, float]
Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Round:
    """Round bilges. Each of bow, middle and stern: the two inner control points (x, h), (x, h) of a cubic Bezier from keel
    (0, 0) to sheer (1, 1), in half breadths and heights."""

    fore: Quad = (0.22, 0.2, 0.62, 0.55)
    middle: Quad = (0.72, 0.0, 0.98, 0.25)
    aft: Quad = (0.6, 0.08, 0.96, 0.3)

    def at(self, t: Float, v: Float) -> tuple[Float, Float]:
        """x in half breadths, h in heights."""
        a, b, c, d = (_blend(t, *k) for k in zip(self.fore, self.middle, self.aft, strict=True))
        one, two, three = 3 * v * (1 - v) ** 2, 3 * v**2 * (1 - v), v**3
        return one * a + two * c + three, one * b + two * d + three


@dataclass(frozen=True)
class Chine:
    """V bottom and sides that meet in a chine (v = 0.5). Each of bow, middle and stern: the chine's (x, h), and how hollow the
    side above it is."""

    fore: Triple = (0.3, 0.5, 0.75)
    middle: Triple = (0.87, 0.36, 0.3)
    aft: Triple = (0.92, 0.28, -0.1)

    def at(self, t: Float, v: Float) -> tuple[Float, Float]:
        """x in half breadths, h in heights."""
        x, h, hollow = (_blend(t, *k) for k in zip(self.fore, self.middle, self.aft, strict=True))
        low, up = np.clip(2 * v, None, 1.0), np.clip(2 * v - 1, 0.0, None)
        side = up - hollow * up * (1 - up)
        bottom = low + 0.12 * low * (1 - low)
        return np.where(v <= 0.5, x * bottom, x + (1 - x) * side), np.where(v <= 0.5, h * low, h + (1 - h) * up)


def _blend(t: Float, fore: float, middle: float, aft: float) -> Float:
    """The number blended from bow through the middle to the stern."""
    return curve(t, [(0, fore), (0.45, middle), (1, aft)])


@dataclass(frozen=True)
class Lines:
    """A hull's lines, metres. sheer, keel: z over t; stem, stern: how far the profile stands back from the ends of the length,
    over the height from keel 0 to sheer 1, in lengths; widest: t of the greatest beam; entry, quarter: exponents (p, q) of (1
    - s^p)^q from the greatest beam to the bow and to the stern, where the share `tuck` of the beam remains.
    """

    length: float
    beam: float
    sheer: Knots
    keel: Knots
    stem: Knots
    stern: Knots
    section: Round | Chine
    widest: float = 0.55
    entry: tuple[float, float] = (2.1, 0.95)
    quarter: tuple[float, float] = (2.2, 1.0)
    tuck: float = 0.7

    def half(self, t: ArrayLike) -> Float:
        """Half breadth at the sheer."""
        t = np.clip(np.asarray(t, np.float64), 0, 1)
        ahead, behind = np.clip(1 - t / self.widest, 0, 1), np.clip((t - self.widest) / (1 - self.widest), 0, 1)
        fore = (1 - ahead ** self.entry[0]) ** self.entry[1]
        aft = self.tuck + (1 - self.tuck) * (1 - behind ** self.quarter[0]) ** self.quarter[1]
        return self.beam / 2 * fore * aft

    def point(self, t: ArrayLike, v: ArrayLike) -> Float:
        """Points (..., 3) of the left skin; outside is d/dt x d/dv."""
        t, v = np.broadcast_arrays(np.asarray(t, np.float64), np.asarray(v, np.float64))
        x, h = self.section.at(t, v)
        low = curve(t, self.keel)
        start, stop = self.length * curve(h, self.stem), self.length * (1 - curve(h, self.stern))
        return np.stack([x * self.half(t), start + t * (stop - start), low + h * (curve(t, self.sheer) - low)], axis=-1)

    def normal(self, t: ArrayLike, v: ArrayLike, step: float = 2e-3) -> Float:
        """Outward unit normals (..., 3) of the left skin."""
        t, v = np.clip(t, step, 1 - step), np.clip(v, step, 1 - step)
        n = np.cross(self.point(t + step, v) - self.point(t - step, v), self.point(t, v + step) - self.point(t, v - step))
        return n / np.maximum(np.linalg.norm(n, axis=-1, keepdims=True), 1e-12)

    def raised(self, t: ArrayLike, v: ArrayLike, offset: ArrayLike) -> Float:
        """Points this far outside the left skin, or inside it if negative, never beyond the ship's middle."""
        points = self.point(t, v) + self.normal(t, v) * np.asarray(offset, np.float64)[..., None]
        points[..., 0] = np.maximum(points[..., 0], 0.0)
        return points

    def sheer_line(self, t: ArrayLike) -> Float:
        """The edge of the left skin, (..., 3)."""
        return self.point(t, 1.0)

    def level(self, t: float, z: float) -> float:
        """The parameter v at height z in the section at t."""
        v = np.linspace(0, 1, 101)
        return float(np.interp(z, self.point(t, v)[:, 2], v))

    def at_y(self, y: float, v: float = 1.0) -> float:
        """The parameter t of a position along the ship, by default on the sheer."""
        t = np.linspace(0, 1, 401)
        return float(np.interp(y, self.point(t, v)[:, 1], t))

    @cached_property
    def _table(self) -> tuple[Float, Float, Float]:
        """t (T, 1), v (1, V) and the left skin's points (T, V, 3)."""
        t, v = np.linspace(0, 1, 161)[:, None], np.linspace(0, 1, 81)[None]
        return t, v, self.point(t, v)

    def waterline(self, z: float) -> Float:
        """The left skin at a height: (T, 4) of x, y, t, v, from bow to stern; keel or sheer where the skin does not reach z."""
        t, v, points = self._table
        k = np.clip((points[..., 2] < z).sum(axis=1), 1, v.size - 1)
        row = np.arange(t.size)
        low, high = points[row, k - 1], points[row, k]
        share = np.clip((z - low[:, 2]) / np.maximum(high[:, 2] - low[:, 2], 1e-9), 0, 1)[:, None]
        at = low + (high - low) * share
        return np.column_stack([at[:, :2], t[:, 0], v[0, k - 1] + (v[0, k] - v[0, k - 1]) * share[:, 0]])

    def at_place(self, y: ArrayLike, z: float) -> tuple[Float, Float]:
        """t and v of the left skin at these y and this z."""
        line, at = self.waterline(z), np.asarray(y, np.float64)
        return np.interp(at, line[:, 1], line[:, 2]), np.interp(at, line[:, 1], line[:, 3])

    def half_at(self, y: ArrayLike, z: float) -> Float:
        """Half breadths of the hull at these y and this z."""
        line = self.waterline(z)
        return np.interp(np.asarray(y, np.float64), line[:, 1], line[:, 0])

    def within(self, points: Float, z: float, gap: float) -> Float:
        """The points of the left side moved to the height z, and to `gap` inside the hull if they would leave it."""
        line = self.waterline(z)
        inside = line[line[:, 0] > gap, :2]
        y = np.clip(points[..., 1], inside[0, 1] + gap, inside[-1, 1] - gap)
        x = np.minimum(points[..., 0], np.interp(y, inside[:, 1], inside[:, 0]) - gap)
        return np.stack([np.maximum(x, 0.0), y, np.full(y.shape, z)], axis=-1)


def stations(count: int, dense: float = 0.6) -> Float:
    """Values from 0 to 1 that are closer together at the ends; `dense` from 0 (even) to below 1."""
    s = np.linspace(0, 1, count)
    return s - dense * np.sin(2 * np.pi * s) / (2 * np.pi)
