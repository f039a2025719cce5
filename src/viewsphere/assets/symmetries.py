"""Symmetries of a model's surface, found from its triangles, and declared ones that it does not have.

Only geometry counts: a surface that looks different after a turn, by its texture or materials, is symmetric here. What lies
inside of a model, where nobody sees it, counts as well.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from viewsphere.assets.surface import DistanceField, Surface
from viewsphere.geometry.rotation import product, rotation_about, transform
from viewsphere.geometry.rotation_group import largest_group
from viewsphere.model.scene import Matrix4, Vector
from viewsphere.model.symmetries import Continuous, Symmetries

Float = NDArray[np.float64]

TOLERANCE = 0.01
"""Share of the diameter by which a symmetry may move a point of the surface away from the surface."""

ORDERS = tuple(range(2, 17))
"""How often a turn may be repeated until the model is as it was. A prism of more sides is round, as far as `TOLERANCE` goes."""

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

COARSE = 3.0
"""Tolerances by which turns around lines may be off that are only near to the one sought."""

AXES = 40_000
"""Directions of half a ball, about 0.01 radians apart."""

APART = 0.09
"""Radians by which an axis is at most off another that stands for it."""

FIT = 0.1
"""Tolerances by which orders of an axis may fit worse than the best."""

NICE = 1e-3
"""Radians by which an axis may be off one of the object's own, which then takes its place."""

FEW = 600
"""Points that lines are fitted to."""

SOLIDS = (59, 23, 11)
"""Turns of the icosahedron, the cube and the tetrahedron. A surface that is round but for noise or bumps near the tolerance has
other turns beside these, of no group.
"""

EARLY, HOPELESS = 3, 2.0
"""A fit ends after so many steps if its line is still off by more than so many tolerances: three steps take the line of a
symmetry from 0.09 radians to well within one.
"""

RANKED = 128
"""Points by which directions of the half ball are ranked."""

STARTS = 32
"""Most directions of the half ball that lines of one order are fitted from, the best first: twice the 15 half turns of an
icosahedron, which has the most axes of one order. Without a limit, a nearly round surface has 500.
"""


@dataclass(frozen=True, eq=False)
class Line:
    """A line along `axis` (3,), of length 1, through `offset` (3,), metres; and how often a turn around it is repeated until
    all is as it was: 0 if every turn leaves it so.
    """

    axis: Float
    offset: Float
    order: int = 0


def find(surface: Surface) -> Symmetries:
    """All symmetries of a surface (within `TOLERANCE`), in object axes and metres.

    A ball has the three axes of the object as continuous ones; anything else that is round has one, and one half turn if its
    ends are alike. All else has its rotations, by axes: the largest group of them that holds all its products.
    """
    usual, lines = _usual(surface), list[Line]()
    round_ones = list(_around(surface, usual, [GOLDEN * i for i in (1, 2, 3)], lines, _as_round))
    if round_ones:
        return _turned(surface, round_ones)
    for order, candidates in _candidates(surface, usual):
        for line in islice(_around(surface, candidates, [2 * math.pi / order], lines, _as_it_is), PRIMES[order]):
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
    ranked = sorted(lines, key=lambda line: _misfit(surface, line, 2 * math.pi / line.order))
    ends = np.cumsum([line.order - 1 for line in ranked])
    for most in SOLIDS:
        yield np.array([*_turns(ranked[: np.searchsorted(ends, most, "right")])]).reshape(-1, 4, 4)


def lacking(surface: Surface, declared: Symmetries) -> Iterator[str]:
    """What a model lacks of declared symmetries: the fields, and what was found instead."""
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
    """Whether the last line lies across the only one of an order above 2."""
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
    """What is round around one line, or around more than one and so around all."""
    line = lines[0]
    offset = _metres(surface, surface.center if len(lines) > 1 else line.offset)
    if len(lines) > 1:
        return Symmetries(continuous=tuple(Continuous(axis=_plain(own), offset=offset) for own in np.eye(3)))
    least = np.eye(3)[np.abs(line.axis).argmin()]
    axis = _nice(least - line.axis * float((least * line.axis).sum()))
    places = (line.offset, _middle(surface, line))
    across = min((Line(axis, place, 2) for place in places), key=lambda one: _misfit(surface, one, math.pi))
    flips = [*_turns([across])] if _is_one(surface, across, [math.pi]) else []
    discrete = tuple(_plain_motion(surface, flip) for flip in flips)
    return Symmetries(discrete=discrete, continuous=(Continuous(axis=_plain(line.axis), offset=offset),))


def _middle(surface: Surface, line: Line) -> Float:
    """The point of a line in the middle between the ends of the surface along it."""
    along = (surface.corners * line.axis).sum(axis=2)
    return line.offset + line.axis * ((along.min() + along.max()) / 2 - float((line.offset * line.axis).sum()))


def _turns(lines: Iterable[Line]) -> Iterator[Float]:
    """The rotations (4, 4) about lines of these orders, without the identity."""
    for line in lines:
        yield from (_motion(line, 2 * math.pi * i / line.order) for i in range(1, line.order))


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


def _motion(line: Line, angle: float) -> Float:
    """The turn (4, 4) around a line."""
    return _motions(line.axis[None], line.offset, angle)[0]


def _motions(axes: Float, offset: Float, angle: float) -> Float:
    """The turns (N, 4, 4) around axes (N, 3) through one point: Rodrigues' formula."""
    x, y, z = axes.T
    cross = np.array([[0 * x, -z, y], [z, 0 * x, -x], [-y, x, 0 * x]]).transpose(2, 0, 1)
    turns = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * product(cross, cross)
    motions = np.tile(np.eye(4), (len(axes), 1, 1))
    motions[:, :3, :3], motions[:, :3, 3] = turns, offset - (turns * offset).sum(axis=2)
    return motions


def _angles() -> list[float]:
    return [GOLDEN * i for i in range(1, TURNS + 1)]


def _is_one(surface: Surface, line: Line, angles: Iterable[float], tolerances: float = 1.0) -> bool:
    """Whether all turns by these angles, and back, are symmetries within so many tolerances."""
    limit = tolerances * TOLERANCE * surface.diameter
    return all(surface.are_near([_motion(line, angle), _motion(line, -angle)], limit).all() for angle in angles)


def _as_round(surface: Surface, line: Line) -> Line | None:
    """The line, if every turn around it is a symmetry."""
    return replace(line, order=0) if _is_one(surface, line, _angles()) else None


def _as_it_is(surface: Surface, line: Line) -> Line | None:
    """The line with its order, None if it has none: the largest that fits as well as any. Of many sides, numbers near to theirs
    are within the tolerance.
    """
    limit = TOLERANCE * surface.diameter
    off = {n: _misfit(surface, line, 2 * math.pi / n) for n in ORDERS if _is_one(surface, line, [2 * math.pi / n])}
    if not off:
        return None
    return _as_round(surface, line) or replace(line, order=max(n for n in off if off[n] <= min(off.values()) + FIT * limit))


def _misfit(surface: Surface, line: Line, angle: float) -> float:
    """The root mean square of distances of points, turned, from the surface, metres, each counted up to the tolerance."""
    limit = TOLERANCE * surface.diameter
    squares = surface.closest(surface.points[:FEW], _motion(line, angle), limit)[0]
    return math.sqrt(float(np.minimum(squares, limit * limit).mean()))


def _usual(surface: Surface) -> Float:
    """The object's own axes, and those of the surface's moments, (6, 3)."""
    return np.array([*np.eye(3), *map(_nice, np.linalg.eigh(surface.spread)[1].T)])


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
    misfits = field.misfits(_motions(axes, surface.center, 2 * math.pi / order), surface.points[:RANKED])
    left = axes[np.argsort(misfits, kind="stable")[: np.isfinite(misfits).sum()]]
    best = list[Float]()
    while len(left) and len(best) < STARTS:
        best.append(left[0])
        left = left[~_near(left, left[0])]
    return np.array(best).reshape(-1, 3)


def _around(
    surface: Surface,
    candidates: Float,
    angles: Sequence[float],
    known: Sequence[Line],
    proved: Callable[[Surface, Line], Line | None],
) -> Iterator[Line]:
    """The lines around which turns by these angles are symmetries, near to candidates (N, 3) for their axes, as `proved` has
    them; but for those near to known ones.
    """
    limit, left, found = COARSE * TOLERANCE * surface.diameter, candidates, [line.axis for line in known]
    for axis in found:
        left = left[~_near(left, axis)]
    for angle in angles:
        left = left[surface.are_near(_motions(left, surface.center, angle), limit)]
    while len(left):
        line = _fitting(surface, Line(left[0], surface.center), angles)
        left = left[~_near(left, left[0])]
        is_new = not (found and _near(np.array(found), line.axis).any())
        if is_new and (line := proved(surface, line)):
            left = left[~_near(left, line.axis)]
            found.append(line.axis)
            yield line


def _near(axes: Float, axis: Float) -> NDArray[np.bool_]:
    """Which of the axes (N, 3) are about the same line's."""
    return np.abs((axes * axis).sum(axis=1)) > math.cos(APART)


def _fitting(surface: Surface, line: Line, angles: Sequence[float]) -> Line:
    """The line near to this one that fits best; itself, if it is one of the surface's moments and hardly fits worse."""
    settled, limit = _settled(surface, line, angles), TOLERANCE * surface.diameter
    if not (np.abs(_usual(surface) - line.axis).max(axis=1) == 0).any():
        return settled
    usual, best = (sum(_misfit(surface, one, angle) for angle in angles) for one in (line, settled))
    return line if usual <= best + FIT * limit * len(angles) else settled


def _settled(surface: Surface, line: Line, angles: Sequence[float]) -> Line:
    """The line near to this one around which turns take points best to planes of the surface: Gauss-Newton's method.

    Its offset is the point nearest to the surface's centroid.
    """
    points, limit = surface.points[:FEW], 2 * COARSE * TOLERANCE * surface.diameter
    for step in range(10):
        if step == EARLY and not _is_one(surface, line, angles, HOPELESS):
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
    axis, center = _nice(line.axis), surface.center
    return Line(axis, line.offset + axis * float(((center - line.offset) * axis).sum()))


def _slopes(surface: Surface, line: Line, angle: float, points: Float, limit: float) -> tuple[Float, Float]:
    """How points that are turned move off the surface (4, N) when the line tilts and shifts across, and how far they are off it
    (N,); both are 0 beyond the limit.
    """
    motion, step = _motion(line, angle), 1e-6
    squares, there, normals = surface.closest(points, motion, limit)
    normals = normals * np.isfinite(squares)[:, None]
    moved = transform(motion, points)
    others = [Line(_unit(line.axis + step * way), line.offset) for way in _across(line.axis)]
    others += [Line(line.axis, line.offset + step * surface.diameter * way) for way in _across(line.axis)]
    slopes = [((transform(_motion(other, angle), points) - moved) * normals).sum(axis=1) / step for other in others]
    return np.array(slopes), ((there - moved) * normals).sum(axis=1)


def _across(axis: Float) -> tuple[Float, Float]:
    """Two directions at right angles to an axis, and to one another."""
    own = np.eye(3)[np.abs(axis).argmin()]
    first = _unit(own - axis * float((own * axis).sum()))
    return first, np.cross(axis, first)


def _nice(axis: Float) -> Float:
    """The axis with its longest side positive; or that of the object that it hardly differs from."""
    axis = _unit(axis)
    longest = np.abs(axis).argmax()
    own = np.eye(3)[longest]
    axis = axis * np.sign(axis[longest])
    return own if np.abs(axis - own).max() < NICE else _unit(axis.round(9))


def _unit(vector: Float) -> Float:
    return vector / math.sqrt((vector * vector).sum())
