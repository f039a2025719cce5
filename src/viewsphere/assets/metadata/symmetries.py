"""Detection of the symmetries of a model's surface from its triangles, and checks of declared symmetries.

Only geometry counts: a surface whose texture or materials differ after a turn is symmetric here. Invisible geometry inside of a
model counts as well.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import islice
from typing import cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from viewsphere.assets.metadata.rotation_group import largest_group
from viewsphere.assets.metadata.surface import DistanceField, Surface
from viewsphere.assets.metadata.symmetry_lines import (
    APART,
    COARSE,
    FIT,
    NICE,
    TOLERANCE,
    Line,
    are_near,
    is_symmetry,
    lines_around,
    misfit,
    nice_axis,
    turn_around,
    turns_around,
    usual_axes,
)
from viewsphere.geometry.rotation import rotation_about, transform
from viewsphere.model.annotations.symmetries import Continuous, Symmetries
from viewsphere.model.scene import Matrix4, Vector

Float = NDArray[np.float64]

ORDERS = tuple(range(2, 17))
"""The numbers of equal turns that make a full turn of a model onto itself. A prism with more sides is round within
`TOLERANCE`.
"""

PRIMES = {13: 1, 11: 1, 7: 1, 5: 8, 3: 12, 2: 18}
"""Prime orders that the search tries, each with the greatest number of axes that it collects. Every axis of one of the `ORDERS`
has a turn of a prime order. The limits cover all finite groups (an icosahedron has 6 and 10 axes, a 16-sided prism 17, and one
of an order above 5). Surfaces that are round except for noise near the tolerance appear to have hundreds of axes.
"""

GOLDEN = math.pi * (3 - math.sqrt(5))
"""Radians: multiples of this angle come near to every angle."""

TURNS = 16
"""Number of turns, by multiples of `GOLDEN`, that are tried to prove that every turn around an axis is a symmetry."""

ALIKE = 0.1
"""Two moments of the surface count as equal if they differ by at most this share of the largest moment. Then directions between
their axes are candidates, too.
"""

AXES = 40_000
"""Number of candidate directions on a half sphere, about 0.01 radians apart."""

SOLIDS = (59, 23, 11)
"""Numbers of turns of the icosahedron, the cube and the tetrahedron. A surface that is round except for noise or bumps near the
tolerance has further turns that form no group.
"""

RANKED = 128
"""Number of points for ranking the directions of the half sphere."""

STARTS = 32
"""Greatest number of half-sphere directions, best first, from which lines of one order are fitted. It is twice the 15 half
turns of an icosahedron, which has the most axes of one order. Without a limit, a nearly round surface has 500.
"""


def find(surface: Surface) -> Symmetries:
    """Return every symmetry of a surface (within `TOLERANCE`), in object axes and metres.

    A ball has the three axes of the object as continuous axes. Any other round surface has one axis, and one half turn if its
    ends are alike. For every other surface, the result is the largest group of rotations that contains all their products.
    """
    usual, lines = usual_axes(surface), list[Line]()
    round_ones = list(lines_around(surface, usual, [GOLDEN * i for i in (1, 2, 3)], lines, _as_round))
    if round_ones:
        return _turned(surface, round_ones)
    for order, candidates in _candidates(surface, usual):
        for line in islice(lines_around(surface, candidates, [2 * math.pi / order], lines, _as_it_is), PRIMES[order]):
            if not line.order:
                return _turned(surface, [line])
            lines.append(line)
            if order == line.order == 2 and _is_prism(lines):  # whose other symmetries follow
                return _finite(surface, _whole(lines))
            if sum(one.order > 5 for one in lines) > 1:  # not a finite group: round, except for noise near the tolerance
                return _finite(surface, lines)
    return _finite(surface, _whole(lines))


def _finite(surface: Surface, lines: Sequence[Line]) -> Symmetries:
    """The largest group of rotations about these lines with their orders: about all lines, or about those that fit best."""
    best = np.zeros((0, 4, 4))
    for motions in _fittest(surface, lines):
        if len(motions) > len(best):
            group = _group(surface, motions)
            best = max(best, group, key=len)
    return Symmetries(discrete=tuple(_plain_motion(surface, motion) for motion in best))


def _group(surface: Surface, motions: Float) -> Float:
    """The largest group of motions (N, 4, 4) and their products, without the identity."""
    limit = TOLERANCE * surface.diameter
    return largest_group(
        motions,
        lambda few: surface.are_near(few, limit),
        lambda few: surface.are_near(few, COARSE * limit),
        np.eye(3),
        NICE,
    )


def _fittest(surface: Surface, lines: Sequence[Line]) -> Iterator[Float]:
    """Yield the turns about all lines; if there are too many, the turns about the best lines, as many as a solid has."""
    if sum(line.order - 1 for line in lines) <= SOLIDS[0]:
        yield np.array([*_turns(lines)]).reshape(-1, 4, 4)
        return
    ranked = sorted(lines, key=lambda line: misfit(surface, line, 2 * math.pi / line.order))
    ends = np.cumsum([line.order - 1 for line in ranked])
    for most in SOLIDS:
        yield np.array([*_turns(ranked[: np.searchsorted(ends, most, "right")])]).reshape(-1, 4, 4)


def lacking(surface: Surface, declared: Symmetries) -> Iterator[str]:
    """Yield an error for each declared symmetry that a model lacks: the field, and the measured deviation."""
    limit = TOLERANCE * surface.diameter
    for name, values in (("discrete", declared.discrete), ("continuous", declared.continuous)):
        for i, value in enumerate(values):
            motions = [value.turned(angle) for angle in _angles()] if isinstance(value, Continuous) else [np.array(value)]
            if not surface.are_near([*motions, *map(np.linalg.inv, motions)], limit).all():
                off = max(_off(surface, motion) for motion in motions)
                yield (
                    f"symmetries.{name}[{i}]: expected what takes the surface to itself within {limit:.3g} m ({TOLERANCE:.0%} "
                    f"of the diameter); found points that it moves about {off:.2g} m off"
                )


def _off(surface: Surface, motion: Float) -> float:
    """The approximate greatest distance from the surface to which a motion moves a point of the surface."""
    points = surface.points[:: max(len(surface.points) // 1000, 1)]
    return max(math.sqrt(((points - moved) ** 2).sum(axis=1).min()) for moved in transform(motion, points))


def _is_prism(lines: Sequence[Line]) -> bool:
    """True if the last line is perpendicular to the only line of an order above 2."""
    along = [line.axis for line in lines if line.order > 2]
    return len(along) == 1 and abs(float((along[0] * lines[-1].axis).sum())) < math.sin(APART)


def _whole(lines: Sequence[Line]) -> Sequence[Line]:
    """The lines; for a prism, the complete set that follows from the line along it and one across."""
    along = max(lines, key=lambda one: one.order, default=None)
    across = [one for one in lines if one is not along]
    if along is None or along.order == 2 or any(one.order > 2 for one in across):
        return lines
    half_steps = (rotation_about(along.axis * (math.pi * i / along.order)) for i in range(along.order))
    return [along, *(replace(one, axis=transform(turn, one.axis)) for turn in half_steps for one in across[:1])]


def _turned(surface: Surface, lines: Sequence[Line]) -> Symmetries:
    """Return the symmetries of a surface that is round around one line, or around several lines and so around every line."""
    line = lines[0]
    offset = _metres(surface, surface.center if len(lines) > 1 else line.offset)
    if len(lines) > 1:
        return Symmetries(continuous=tuple(Continuous(axis=_plain(own), offset=offset) for own in np.eye(3)))
    least = np.eye(3)[np.abs(line.axis).argmin()]
    axis = nice_axis(least - line.axis * float((least * line.axis).sum()))
    places = (line.offset, _middle(surface, line))
    across = min((Line(axis, place, 2) for place in places), key=lambda one: misfit(surface, one, math.pi))
    flips = [*_turns([across])] if is_symmetry(surface, across, [math.pi]) else []
    discrete = tuple(_plain_motion(surface, flip) for flip in flips)
    return Symmetries(discrete=discrete, continuous=(Continuous(axis=_plain(line.axis), offset=offset),))


def _middle(surface: Surface, line: Line) -> Float:
    """The point of a line in the middle between the ends of the surface along it."""
    along = (surface.corners * line.axis).sum(axis=2)
    return line.offset + line.axis * ((along.min() + along.max()) / 2 - float((line.offset * line.axis).sum()))


def _turns(lines: Iterable[Line]) -> Iterator[Float]:
    """The rotations (4, 4) about lines of these orders, without the identity."""
    for line in lines:
        yield from (turn_around(line, 2 * math.pi * i / line.order) for i in range(1, line.order))


def _plain_motion(surface: Surface, motion: Float) -> Matrix4:
    """A motion's rows, rounded to be equal on all processors."""
    places = _metres(surface, motion[:3, 3])
    return cast("Matrix4", (*((*_plain(motion[k, :3]), places[k]) for k in range(3)), (0.0, 0.0, 0.0, 1.0)))


def _plain(numbers: ArrayLike, digits: int = 9) -> Vector:
    """Numbers rounded to be equal on all processors, without negative zeros."""
    return cast("Vector", tuple((np.asarray(numbers, np.float64).round(digits) + 0.0).tolist()))


def _metres(surface: Surface, numbers: ArrayLike) -> Vector:
    """Lengths rounded to a millionth of the diameter, or finer."""
    return _plain(numbers, 6 - math.floor(math.log10(surface.diameter)))


def _angles() -> list[float]:
    return [GOLDEN * i for i in range(1, TURNS + 1)]


def _as_round(surface: Surface, line: Line) -> Line | None:
    """The line, if every turn around it is a symmetry."""
    return replace(line, order=0) if is_symmetry(surface, line, _angles()) else None


def _as_it_is(surface: Surface, line: Line) -> Line | None:
    """The line with its order, or None if it has none: the largest order that fits as well as any other. For many sides,
    neighbouring orders are within the tolerance, too.
    """
    limit = TOLERANCE * surface.diameter
    off = {n: misfit(surface, line, 2 * math.pi / n) for n in ORDERS if is_symmetry(surface, line, [2 * math.pi / n])}
    if not off:
        return None
    return _as_round(surface, line) or replace(line, order=max(n for n in off if off[n] <= min(off.values()) + FIT * limit))


def _candidates(surface: Surface, usual: Float) -> Iterator[tuple[int, Float]]:
    """Yield orders and candidate axes (N, 3), at least one of which is near each axis of that order.

    A symmetry leaves the moments of the surface unchanged. So its axis is a principal axis. If two moments are equal, half
    turns may also have any axis between theirs. If all are equal, any axis is possible.
    """
    values, vectors = np.linalg.eigh(surface.spread)
    low, high = np.diff(values) <= ALIKE * values[2]
    if low and high:
        field, ball = surface.field(COARSE * TOLERANCE * surface.diameter), _half_ball()
        yield from ((order, np.concatenate([usual, _best(surface, field, ball, order)])) for order in PRIMES)
        return
    yield from ((order, usual) for order in PRIMES)
    if low or high:
        one, other = vectors.T[:2] if low else vectors.T[1:]
        angles = np.arange(0, math.pi, 0.01)[:, None]
        yield 2, np.cos(angles) * one + np.sin(angles) * other


def _half_ball() -> Float:
    """Directions (N, 3) spread evenly over a half sphere, in a spiral."""
    z = (np.arange(AXES) + 0.5) / AXES
    angle, level = GOLDEN * np.arange(AXES), np.sqrt(1 - z * z)
    return np.stack([level * np.cos(angle), level * np.sin(angle), z], axis=1)


def _best(surface: Surface, field: DistanceField, axes: Float, order: int) -> Float:
    """The axes (N, 3), at most `STARTS`, around which turns of an order fit best, the best first, none of them near a better
    one.
    """
    misfits = field.misfits(turns_around(axes, surface.center, 2 * math.pi / order), surface.points[:RANKED])
    left = axes[np.argsort(misfits, kind="stable")[: np.isfinite(misfits).sum()]]
    best = list[Float]()
    while len(left) and len(best) < STARTS:
        best.append(left[0])
        left = left[~are_near(left, left[0])]
    return np.array(best).reshape(-1, 3)
