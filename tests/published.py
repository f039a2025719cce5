"""Published formulas of lenses, from which the table of lenses makes its rays: nothing here calls a lens of viewsphere.

The test of a lens, `geometry/lenses/test_<name>.py`, has its `PUBLISHED`. So a new lens is in the table with its test.
"""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

FOLDER = Path(__file__).parent / "geometry" / "lenses"
STEP = math.radians(0.5)
"""Between the angles from the axis at which inverses begin: Newton's method converges from there for all shown lenses."""
TURNS = 240
"""Directions around the axis at each of these angles."""
SMALL = 1e-5
"""Radians, of central differences: the slope's errors are below 1e-9, so each step of Newton's method adds nine digits."""
CLOSE = 1e-12
"""Focal lengths by which a ray's position may miss the pixel's."""


@dataclass(frozen=True)
class Published:
    """A lens's formula and cameras that try it.

    cameras: the fields of a recipe's camera beside `size`, by words for the table. project: `project(parameters)` gives the
    function (x, y, z) -> position in focal lengths, to which K applies. ray: `ray(parameters)` gives the function (x, y) ->
    direction, for lenses whose formula is that of rays. At least one of both. is_parallel: rays begin at (x, y, 0).
    highest: of
    a panorama, whose x is an azimuth in radians, the largest y; None for others.
    """

    cameras: Mapping[str, Mapping[str, Any]]
    project: Callable[[Any], Callable[..., Any]] | None = None
    ray: Callable[[Any], Callable[..., Any]] | None = None
    is_parallel: bool = False
    highest: float | None = None


def published(name: str) -> Published:
    """The formula of a lens, by its test."""
    spec = importlib.util.spec_from_file_location(f"published_{name}", FOLDER / f"test_{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    if not hasattr(module, "PUBLISHED"):
        raise LookupError(
            f"{spec.origin}: expected PUBLISHED, the published formula of the lens {name}, for the table of lenses"
        )
    return module.PUBLISHED


@dataclass(frozen=True, eq=False)
class Optics:
    """A lens by its published formula, with its camera matrix; in camera axes, float64."""

    formula: Published
    parameters: Any
    K: np.ndarray

    def pixels(self, points: np.ndarray) -> np.ndarray:
        """Positions (N, 2) of points (N, 3), NaN where the formula shows none."""
        with np.errstate(all="ignore"):
            if self.formula.project is None:
                return self._pixels_by_rays(points)
            x, y = self.formula.project(self.parameters)(*points.T)
        is_shown = points[:, 2] > 0 if self.formula.is_parallel else angle(points) < self.limit
        return np.where((is_shown & np.isfinite(x))[:, None], self.in_pixels(np.stack([x, y], axis=-1)), np.nan)

    def _pixels_by_rays(self, points: np.ndarray) -> np.ndarray:
        """The inverse of `ray`, by Newton's method in the plane."""
        away = points / np.linalg.norm(points, axis=1)[:, None]
        at = self._starts_of_rays()
        _, nearest = cKDTree(at[1]).query(away)
        at = at[0][nearest]
        first, second = basis(away)

        def off(at):
            direction = unit(self._ray(at))
            return np.stack([(direction * first).sum(axis=1), (direction * second).sum(axis=1)], axis=-1)

        for _ in range(30):
            at = at - solve(*(slope(off, at, k) for k in range(2)), off(at))
        shown = (np.abs(off(at)).max(axis=1) < CLOSE) & (np.hypot(*self._ray(at).T[:2]) <= self.limit)
        return np.where(shown[:, None], self.in_pixels(at), np.nan)

    @lru_cache(maxsize=1)  # noqa: B019
    def _starts_of_rays(self) -> tuple[np.ndarray, np.ndarray]:
        radius, turn = np.meshgrid(np.arange(0.01, min(self.limit, 20.0), 0.01), 2 * np.pi * np.arange(TURNS) / TURNS)
        at = np.stack([radius * np.cos(turn), radius * np.sin(turn)], axis=-1).reshape(-1, 2)
        return at, unit(self._ray(at))

    def _ray(self, at: np.ndarray) -> np.ndarray:
        """Directions (N, 3) of the formula of rays."""
        return np.stack(np.broadcast_arrays(*self.formula.ray(self.parameters)(*at.T)), axis=-1).astype(np.float64)

    def in_pixels(self, at: np.ndarray) -> np.ndarray:
        """Positions in pixels of those in focal lengths."""
        return at @ self.K[:2, :2].T + self.K[:2, 2]

    def rays(self, xy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Origins and unit directions (N, 3) of the rays through positions (N, 2), NaN without one."""
        y = (xy[:, 1] - self.K[1, 2]) / self.K[1, 1]
        at = np.stack([(xy[:, 0] - self.K[0, 2] - self.K[0, 1] * y) / self.K[0, 0], y], axis=-1)
        origins = np.zeros((len(at), 3))
        if self.formula.is_parallel:
            origins[:, :2] = at
        if self.formula.ray is None:
            return origins, self._inverse(at)
        directions = self._ray(at)
        if self.formula.project is None:
            directions[np.hypot(*directions.T[:2]) > self.limit] = np.nan
        return origins, unit(directions)

    @property
    def limit(self) -> float:
        """The angle from the axis, radians (of `ray` alone: focal lengths), up to which the formula is one-to-one."""
        return _limit(self)

    def _inverse(self, at: np.ndarray) -> np.ndarray:
        """Newton's method on the sphere, from the nearest of many projected directions."""
        project = self.formula.project(self.parameters)
        known, tree = _starts(self)
        directions = known[tree.query(at)[1]]
        left = np.arange(len(at))
        with np.errstate(all="ignore"):
            for _ in range(60):
                d, (first, second) = directions[left], basis(directions[left])

                def position(step, d=d, first=first, second=second):
                    moved = d + step[:, :1] * first + step[:, 1:] * second
                    return np.stack(project(*(moved / np.linalg.norm(moved, axis=1)[:, None]).T), axis=-1)

                zero = np.zeros((len(d), 2))
                step = solve(*(slope(position, zero, k) for k in range(2)), at[left] - position(zero))
                step *= np.minimum(1.0, 0.05 / np.linalg.norm(step, axis=1))[:, None]
                moved = d + step[:, :1] * first + step[:, 1:] * second
                directions[left] = moved / np.linalg.norm(moved, axis=1)[:, None]
                left = left[~(np.linalg.norm(step, axis=1) < 1e-15)]
                if not len(left):
                    break
            off = np.stack(project(*directions.T), axis=-1) - at
        good = (np.hypot(*off.T) < CLOSE * (1 + np.hypot(*at.T))) & (angle(directions) <= self.limit)
        return np.where(good[:, None], directions, np.nan)


def angle(points: np.ndarray) -> np.ndarray:
    """The angle of points (N, 3) from the axis, radians."""
    return np.arctan2(np.hypot(points[:, 0], points[:, 1]), points[:, 2])


def unit(vectors: np.ndarray) -> np.ndarray:
    """Vectors (N, 3) of length 1."""
    return vectors / np.linalg.norm(vectors, axis=1)[:, None]


def basis(directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors perpendicular to each unit vector (N, 3), and to each other."""
    least = np.eye(3)[np.abs(directions).argmin(axis=1)]
    first = np.cross(directions, least)
    first /= np.linalg.norm(first, axis=1)[:, None]
    return first, np.cross(directions, first)


def slope(function, at: np.ndarray, k: int) -> np.ndarray:
    """The derivative (N, 2) of a function of positions (N, 2) by their component k."""
    step = np.zeros_like(at)
    step[:, k] = SMALL
    return (function(at + step) - function(at - step)) / (2 * SMALL)


def solve(a: np.ndarray, b: np.ndarray, off: np.ndarray) -> np.ndarray:
    """x with x[0] a + x[1] b = off, for columns a and b (N, 2)."""
    determinant = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    x = off[:, 0] * b[:, 1] - off[:, 1] * b[:, 0], a[:, 0] * off[:, 1] - a[:, 1] * off[:, 0]
    return np.stack(x, axis=-1) / determinant[:, None]


def cone(theta: float) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors (TURNS, 3) at an angle from the axis, and the directions (TURNS, 2) in the picture in which they are."""
    turn = 2 * math.pi * np.arange(TURNS) / TURNS
    away = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    return np.column_stack([math.sin(theta) * away, np.full(TURNS, math.cos(theta))]), away


def is_one_to_one(project, theta: float) -> bool:
    """Return whether a formula keeps the orientation at an angle from the axis, and moves outwards as the angle grows."""
    (inner, _), (directions, away), (outer, _) = (cone(theta + d) for d in (-SMALL, 0.0, SMALL))
    with np.errstate(all="ignore"):
        low, at, high = (np.stack(project(*d.T), axis=-1) for d in (inner, directions, outer))
        around = np.roll(at, -1, axis=0) - np.roll(at, 1, axis=0)
        along = high - low
        turned = along[:, 0] * around[:, 1] - along[:, 1] * around[:, 0]
        return bool(((turned > 0) & ((along * away).sum(axis=1) > 0) & ((at * away).sum(axis=1) > 0)).all())


@lru_cache(maxsize=64)
def _limit(optics: Optics) -> float:
    if optics.formula.project is None:
        return _limit_of_rays(optics)
    if optics.formula.is_parallel or optics.formula.highest is not None:
        return math.pi + 1e-9
    project = optics.formula.project(optics.parameters)
    angles = np.arange(math.radians(2), math.pi, STEP)
    bad = next((i for i, theta in enumerate(angles) if not is_one_to_one(project, theta)), None)
    if bad is None:
        return math.pi
    low, high = float(angles[bad - 1]), float(angles[bad])
    while high - low > 1e-12:
        middle = (low + high) / 2
        low, high = (middle, high) if is_one_to_one(project, middle) else (low, middle)
    return low


def _limit_of_rays(optics: Optics) -> float:
    """The radius up to which the angle from the axis of `ray` grows."""
    ray, farthest = optics.formula.ray(optics.parameters), 50.0

    def rays(radii: np.ndarray) -> np.ndarray:
        return np.stack(np.broadcast_arrays(*ray(radii, np.zeros_like(radii))), axis=-1)

    low, width = 1e-3, 1e-3
    while width > 1e-12:
        radii = low + width * np.arange(1.0, 50.0 / 1e-3 if width == 1e-3 else 1002.0)
        falls = np.diff(angle(rays(radii))) <= 0
        if not falls.any():
            return farthest
        low, width = float(radii[max(int(np.argmax(falls)) - 1, 0)]), width / 500
    return float(np.hypot(*rays(np.array([low])).T[:2])[0])


@lru_cache(maxsize=4)
def _starts(optics: Optics) -> tuple[np.ndarray, cKDTree]:
    project = optics.formula.project(optics.parameters)
    angles = [0.002, 0.004, *np.arange(STEP, optics.limit, STEP), optics.limit - 1e-4, optics.limit - 1e-6]
    directions = np.concatenate([cone(theta)[0] for theta in angles])
    at = np.stack(project(*directions.T), axis=-1)
    near = np.hypot(*at.T) < 100.0
    return directions[near], cKDTree(at[near])
