"""Symmetries of a model's surface, found from its triangles, and declared ones that it does not have.

Only geometry counts: a surface that looks different after a turn, by its texture or materials, is symmetric here. What lies
inside of a model, where nobody sees it, counts as well.
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
"""The numbers of equal turns that make a full turn of a model onto itself. A prism of more sides counts as round within
`TOLERANCE`.
"""

PRIMES = {13: 1, 11: 1, 7: 1, 5: 8, 3: 12, 2: 18}
"""An axis of any of these orders has a turn of one of these, for which the search looks; and the most axes with such a turn
that it collects: at least those of a finite group (an icosahedron has 6 and 10, a 16-sided prism 17, and one of more than 5).
Surfaces that are round but for noise near the tolerance seem to have hundreds.
"""

GOLDEN = math.pi * (3 - math.sqrt(5))
"""Radians: multiples of this angle come near to every angle."""

TURNS = 16
"""Turns by multiples of `GOLDEN` that are tried of an axis around which every turn may be a symmetry."""

ALIKE = 0.1
"""Share of the largest moment by which two moments of the surface differ at most where an axis between theirs may be one."""

AXES = 40_000
"""Directions of half a ball, about 0.01 radians apart."""

SOLIDS = (59, 23, 11)
"""Turns of the icosahedron, the cube and the tetrahedron. A surface that is round but for noise or bumps near the tolerance has
other turns beside these, of no group.
"""

RANKED = 128
"""Points by which directions of the half ball are ranked."""

STARTS = 32
"""Most directions of the half ball that lines of one order are fitted from, the best first: twice the 15 half turns of an
icosahedron, which has the most axes of one order. Without a limit, a nearly round surface has 500.
"""


def find(surface: Surface) -> Symmetries:
    """Return every symmetry of a surface (within `TOLERANCE`), in object axes and metres.

    A ball has the three axes of the object as continuous axes. Any other round surface has one axis, and one half turn if its
    ends are alike. Every other surface has its rotations, by axes: the largest group that holds all its products.
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
            if order == line.order == 2 and _is_prism(lines):  # whose others follow
                return _finite(surface, _whole(lines))
            if sum(one.order > 5 for one in lines) > 1:  # of no finite group: round, but for noise near the tolerance
                return _finite(surface, lines)
    return _finite(surface, _whole(lines))


def _finite(surface: Surface, lines: Sequence[Line]) -> Symmetries:
    """The largest group of rotations about lines of these orders: of all, or of those that fit best."""
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
    """The turns about all lines; where these are too many, those about the best lines, as many as a solid has."""
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
    """About how far a motion takes a point of the surface away from all others."""
    points = surface.points[:: max(len(surface.points) // 1000, 1)]
    return max(math.sqrt(((points - moved) ** 2).sum(axis=1).min()) for moved in transform(motion, points))


def _is_prism(lines: Sequence[Line]) -> bool:
    """True if the last line lies across the only line of an order above 2."""
    along = [line.axis for line in lines if line.order > 2]
    return len(along) == 1 and abs(float((along[0] * lines[-1].axis).sum())) < math.sin(APART)


def _whole(lines: Sequence[Line]) -> Sequence[Line]:
    """The lines; of a prism, those that follow from the one along it and one across."""
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
    """A motion's rows, in numbers that are equal on all processors."""
    places = _metres(surface, motion[:3, 3])
    return cast("Matrix4", (*((*_plain(motion[k, :3]), places[k]) for k in range(3)), (0.0, 0.0, 0.0, 1.0)))


def _plain(numbers: ArrayLike, digits: int = 9) -> Vector:
    """Numbers that are equal on all processors, without a minus before zero."""
    return cast("Vector", tuple((np.asarray(numbers, np.float64).round(digits) + 0.0).tolist()))


def _metres(surface: Surface, numbers: ArrayLike) -> Vector:
    """Lengths to a millionth of the diameter, or finer."""
    return _plain(numbers, 6 - math.floor(math.log10(surface.diameter)))


def _angles() -> list[float]:
    return [GOLDEN * i for i in range(1, TURNS + 1)]


def _as_round(surface: Surface, line: Line) -> Line | None:
    """The line, if every turn around it is a symmetry."""
    return replace(line, order=0) if is_symmetry(surface, line, _angles()) else None


def _as_it_is(surface: Surface, line: Line) -> Line | None:
    """The line with its order, None if it has none: the largest that fits as well as any. Of many sides, numbers near to theirs
    are within the tolerance.
    """
    limit = TOLERANCE * surface.diameter
    off = {n: misfit(surface, line, 2 * math.pi / n) for n in ORDERS if is_symmetry(surface, line, [2 * math.pi / n])}
    if not off:
        return None
    return _as_round(surface, line) or replace(line, order=max(n for n in off if off[n] <= min(off.values()) + FIT * limit))


def _candidates(surface: Surface, usual: Float) -> Iterator[tuple[int, Float]]:
    """Orders, and axes (N, 3) of which some is near to each axis of that order.

    A symmetry leaves the moments of the surface as they are. So its axis is one of theirs; where two are alike it may also be
    anywhere between these, but then of a half turn; where all are, anywhere.
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
    """Directions (N, 3) spread evenly over half a ball, in a spiral."""
    z = (np.arange(AXES) + 0.5) / AXES
    angle, level = GOLDEN * np.arange(AXES), np.sqrt(1 - z * z)
    return np.stack([level * np.cos(angle), level * np.sin(angle), z], axis=1)


def _best(surface: Surface, field: DistanceField, axes: Float, order: int) -> Float:
    """The axes (N, 3), at most `STARTS`, around which turns of an order fit best, the best first; none near to a better one."""
    misfits = field.misfits(turns_around(axes, surface.center, 2 * math.pi / order), surface.points[:RANKED])
    left = axes[np.argsort(misfits, kind="stable")[: np.isfinite(misfits).sum()]]
    best = list[Float]()
    while len(left) and len(best) < STARTS:
        best.append(left[0])
        left = left[~are_near(left, left[0])]
    return np.array(best).reshape(-1, 3)
