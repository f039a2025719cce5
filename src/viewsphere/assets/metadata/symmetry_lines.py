"""Symmetry axes of a surface as lines in space, fitted to the surface."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.metadata.surface import Surface
from viewsphere.geometry.rotation import product, transform

Float = NDArray[np.float64]

TOLERANCE = 0.01
"""Greatest distance, as a share of the diameter, by which a symmetry may move a surface point off the surface."""

COARSE = 3.0
"""Allowed deviation, in tolerances, of turns around lines that are only near the true one."""

APART = 0.09
"""Greatest angle, in radians, between an axis and a candidate that represents it."""

FIT = 0.1
"""Allowed excess, in tolerances, of an order's misfit over the best order's."""

NICE = 1e-3
"""Greatest angle, in radians, at which an axis is replaced by one of the object's own axes."""

FEW = 600
"""Number of points that lines are fitted to."""

EARLY, HOPELESS = 3, 2.0
"""A fit stops after `EARLY` steps if its misfit still exceeds `HOPELESS` tolerances. Three steps bring the line of a symmetry
from 0.09 radians to well within one tolerance.
"""


@dataclass(frozen=True, eq=False)
class Line:
    """A line along `axis` (3,), of length 1, through `offset` (3,), metres; and its order: the number of equal turns that make
    a full turn, 0 if every turn is a symmetry.
    """

    axis: Float
    offset: Float
    order: int = 0


def lines_around(
    surface: Surface,
    candidates: Float,
    angles: Sequence[float],
    known: Sequence[Line],
    proved: Callable[[Surface, Line], Line | None],
) -> Iterator[Line]:
    """The lines around which turns by these angles are symmetries, near the candidate axes (N, 3), in the form that `proved`
    returns, except lines near known ones.
    """
    limit, left, found = COARSE * TOLERANCE * surface.diameter, candidates, [line.axis for line in known]
    for axis in found:
        left = left[~are_near(left, axis)]
    for angle in angles:
        left = left[surface.are_near(turns_around(left, surface.center, angle), limit)]
    while len(left):
        line = _fitting(surface, Line(left[0], surface.center), angles)
        left = left[~are_near(left, left[0])]
        is_new = not (found and are_near(np.array(found), line.axis).any())
        if is_new and (line := proved(surface, line)):
            left = left[~are_near(left, line.axis)]
            found.append(line.axis)
            yield line


def are_near(axes: Float, axis: Float) -> NDArray[np.bool_]:
    """A mask (N,) of the axes (N, 3) that are about equal to the line's axis."""
    return np.abs((axes * axis).sum(axis=1)) > math.cos(APART)


def _fitting(surface: Surface, line: Line, angles: Sequence[float]) -> Line:
    """The best-fitting line near this one; the line itself if it is a principal axis of the surface and hardly fits worse."""
    settled, limit = _settled(surface, line, angles), TOLERANCE * surface.diameter
    if not (np.abs(usual_axes(surface) - line.axis).max(axis=1) == 0).any():
        return settled
    usual, best = (sum(misfit(surface, one, angle) for angle in angles) for one in (line, settled))
    return line if usual <= best + FIT * limit * len(angles) else settled


def _settled(surface: Surface, line: Line, angles: Sequence[float]) -> Line:
    """The line near this one whose turns move points best onto tangent planes of the surface, by the Gauss-Newton method.

    Its offset is the point nearest to the surface's centroid.
    """
    points, limit = surface.points[:FEW], 2 * COARSE * TOLERANCE * surface.diameter
    for step in range(10):
        if step == EARLY and not is_symmetry(surface, line, angles, HOPELESS):
            break
        slopes, off = zip(*(_slopes(surface, line, angle, points, limit) for angle in angles), strict=True)
        slope, rest = np.concatenate(slopes, axis=1), np.concatenate(off)
        squares = np.array([[float((a * b).sum()) for b in slope] for a in slope])
        squares += np.eye(4) * (1e-9 * squares.trace() + np.finfo(float).tiny)
        u, v, s, t = np.linalg.solve(squares, (slope * rest).sum(axis=1)).tolist()
        turn = min(1.0, APART / max(math.hypot(u, v), 1e-12))
        first, second = _across(line.axis)
        line = Line(
            _unit(line.axis + turn * (u * first + v * second)), line.offset + surface.diameter * (s * first + t * second)
        )
        if max(abs(u), abs(v), abs(s), abs(t)) < 1e-11:
            break
    axis, center = nice_axis(line.axis), surface.center
    return Line(axis, line.offset + axis * float(((center - line.offset) * axis).sum()))


def _slopes(surface: Surface, line: Line, angle: float, points: Float, limit: float) -> tuple[Float, Float]:
    """The derivatives (4, N) of the turned points' distances from the surface with respect to the line's tilt and shift, and
    these distances (N,); both are 0 beyond the limit.
    """
    motion, step = turn_around(line, angle), 1e-6
    squares, there, normals = surface.closest(points, motion, limit)
    normals = normals * np.isfinite(squares)[:, None]
    moved = transform(motion, points)
    others = [Line(_unit(line.axis + step * way), line.offset) for way in _across(line.axis)]
    others += [Line(line.axis, line.offset + step * surface.diameter * way) for way in _across(line.axis)]
    slopes = [((transform(turn_around(other, angle), points) - moved) * normals).sum(axis=1) / step for other in others]
    return np.array(slopes), ((there - moved) * normals).sum(axis=1)


def misfit(surface: Surface, line: Line, angle: float) -> float:
    """The root mean square distance of turned points from the surface, metres, each clipped to the tolerance."""
    limit = TOLERANCE * surface.diameter
    squares = surface.closest(surface.points[:FEW], turn_around(line, angle), limit)[0]
    return math.sqrt(float(np.minimum(squares, limit * limit).mean()))


def is_symmetry(surface: Surface, line: Line, angles: Iterable[float], tolerances: float = 1.0) -> bool:
    """True if all turns by these angles, in both directions, are symmetries within this many tolerances."""
    limit = tolerances * TOLERANCE * surface.diameter
    return all(surface.are_near([turn_around(line, angle), turn_around(line, -angle)], limit).all() for angle in angles)


def usual_axes(surface: Surface) -> Float:
    """The object's own axes and the principal axes of the surface, (6, 3)."""
    return np.array([*np.eye(3), *map(nice_axis, np.linalg.eigh(surface.spread)[1].T)])


def turn_around(line: Line, angle: float) -> Float:
    """The turn (4, 4) around a line."""
    return turns_around(line.axis[None], line.offset, angle)[0]


def turns_around(axes: Float, offset: Float, angle: float) -> Float:
    """The turns (N, 4, 4) around axes (N, 3) through one point: Rodrigues' formula."""
    x, y, z = axes.T
    cross = np.array([[0 * x, -z, y], [z, 0 * x, -x], [-y, x, 0 * x]]).transpose(2, 0, 1)
    turns = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * product(cross, cross)
    motions = np.tile(np.eye(4), (len(axes), 1, 1))
    motions[:, :3, :3], motions[:, :3, 3] = turns, offset - (turns * offset).sum(axis=2)
    return motions


def _across(axis: Float) -> tuple[Float, Float]:
    """Two directions perpendicular to an axis and to each other."""
    own = np.eye(3)[np.abs(axis).argmin()]
    first = _unit(own - axis * float((own * axis).sum()))
    return first, np.cross(axis, first)


def nice_axis(axis: Float) -> Float:
    """The axis with its largest component positive, or the object's axis if they hardly differ."""
    axis = _unit(axis)
    longest = np.abs(axis).argmax()
    own = np.eye(3)[longest]
    axis = axis * np.sign(axis[longest])
    return own if np.abs(axis - own).max() < NICE else _unit(axis.round(9))


def _unit(vector: Float) -> Float:
    return vector / math.sqrt((vector * vector).sum())
