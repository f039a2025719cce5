"""The plan view of a body: a closed superellipse with bowed ends, described by one parameter."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from viewsphere_zoo.shapes.solids import Float

_SAMPLES = 80


@dataclass(frozen=True)
class Outline:
    """A loop in plan, metres: front at y = front, rear at y = rear, symmetric in x.

    u runs counter-clockwise seen from above: 0 middle of the front, 1 front left corner, 2 middle of the left side (+x),
    3 rear left corner, 4 middle of the rear; negative u is the right side. `cross` and `along` are the superellipse's
    exponents (front, rear): higher values are squarer; `bow` is how far the ends' corners are behind their middles.
    """

    front: float
    rear: float
    half_width: float
    cross: tuple[float, float] = (3.5, 3.5)
    along: tuple[float, float] = (8.0, 8.0)
    bow: tuple[float, float] = (0.1, 0.06)

    @cached_property
    def _table(self) -> tuple[Float, Float, Float]:
        """u (K,), points (K, 2) and outward normals (K, 2) of the left half."""
        front, rear = self._quarter(0), self._quarter(1)[::-1]
        points = np.concatenate([front, rear[1:]])
        u = np.concatenate([self._fraction(points[i : i + _SAMPLES]) + k for k, i in enumerate(self._starts())])
        u = np.concatenate([u.reshape(4, _SAMPLES)[:, :-1].ravel(), [4.0]])
        tangent = np.gradient(points, axis=0)
        tangent[0], tangent[-1] = (1.0, 0.0), (-1.0, 0.0)
        normal = np.stack([tangent[:, 1], -tangent[:, 0]], axis=1)
        return u, points, normal / np.linalg.norm(normal, axis=1, keepdims=True)

    @staticmethod
    def _starts() -> range:
        return range(0, 4 * (_SAMPLES - 1), _SAMPLES - 1)

    @staticmethod
    def _fraction(points: Float) -> Float:
        length = np.append(0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
        return length / length[-1]

    def _quarter(self, end: int) -> Float:
        """Points from the middle of one end to the middle of the left side, (2 K - 1, 2)."""
        n, m, a = self.cross[end], self.along[end], self.half_width
        middle = (self.front + self.rear) / 2
        sign = 1.0 if end else -1.0
        b = (self.rear - self.front) / 2
        x = np.linspace(0, a * 0.5 ** (1 / n), _SAMPLES)
        y = b * (1 - (x / a) ** n) ** (1 / m)
        y_side = np.linspace(y[-1], 0, _SAMPLES)
        x_side = a * (1 - (y_side / b) ** m) ** (1 / n)
        x, y = np.append(x, x_side[1:]), np.append(y, y_side[1:])
        y = y - self.bow[end] * (x / a) ** 2 * (y / b) ** 4
        return np.stack([x, middle + sign * y], axis=1)

    def point(self, u: ArrayLike) -> Float:
        """Points (..., 2)."""
        return self._read(u, 1)

    def normal(self, u: ArrayLike) -> Float:
        """Outward unit normals in plan (..., 2)."""
        n = self._read(u, 2)
        return n / np.linalg.norm(n, axis=-1, keepdims=True)

    def _read(self, u: ArrayLike, column: int) -> Float:
        at = (np.asarray(u, np.float64) + 4) % 8 - 4
        values = self._table[column]
        x, y = (np.interp(np.abs(at), self._table[0], values[:, k]) for k in (0, 1))
        return np.stack([np.where(at < 0, -x, x), y], axis=-1)

    def u_at_y(self, y: ArrayLike) -> Float:
        """The left side's u at this y."""
        return np.interp(np.asarray(y, np.float64), self._table[1][:, 1], self._table[0])

    def u_at_x(self, x: ArrayLike, rear: bool = False) -> Float:
        """u on the front (or rear) face at this x; negative for the right side."""
        u, points, _ = self._table
        half = np.argmax(points[:, 0])
        at = np.abs(x)
        found = np.interp(at, points[half:, 0][::-1], u[half:][::-1]) if rear else np.interp(at, points[:half, 0], u[:half])
        return np.where(np.asarray(x) < 0, -found, found)
