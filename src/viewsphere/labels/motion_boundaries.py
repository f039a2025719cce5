"""motion_boundaries: pixels next to something that moves differently."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.seam import short_way
from viewsphere.labels.shared.needs import Next
from viewsphere.labels.shared.spec import ChannelLabel, Drawing, Models, Picture, channel_of, period_of
from viewsphere.model.sample import Sample

if TYPE_CHECKING:
    from viewsphere.labels.shared.context import LabelContext

APART = 1.5
"""Pixels by which flows differ at a boundary (Mayer et al. 2016, "A Large Dataset to Train Convolutional Networks for
Disparity, Optical Flow, and Scene Flow Estimation"; the paper's minimum of 10 pixels for a boundary does not apply here).
"""

COLOR = (255, 40, 170)
"""The colour of drawn boundaries, which few pictures contain."""

JOINED = 0.05
"""Maximum relative difference in 1/s for neighbouring pixels of one thing to count as one surface."""


def _compute(context: LabelContext) -> NDArray[np.uint8]:
    """1 on both sides of a boundary, else 0, (H, W).

    A boundary is between two adjacent pixels, side by side or one above the other, whose flows to the next instant differ by
    more than `APART`. They show different things, or surfaces that do not join.
    """
    out = np.zeros(context.visibility.triangle.shape, np.uint8)
    own, match = context.own_view, context.match(Next())
    if own is None or match is None:
        return out
    thing = np.append(own.owners, -1)[context.visibility.triangle]
    inverse, period = context.visibility.inverse_depth, context.camera.lens.period
    vectors, thing, inverse = (_closed(one, period) for one in (match.offset, thing, inverse))
    found = np.zeros(inverse.shape, np.uint8)
    for axis in (0, 1):
        a, b = _sides(axis)
        u, v = _apart(vectors, axis, period)
        torn = (thing[a] != thing[b]) | (np.abs(inverse[a] - inverse[b]) > JOINED * np.maximum(inverse[a], inverse[b]))
        boundary = torn & (u * u + v * v > APART * APART)
        found[a] |= boundary
        found[b] |= boundary
    return _opened(found, period)


def _closed(pixels: NDArray[Any], period: int | None) -> NDArray[Any]:
    """A picture of a full turn with its first column repeated at the end; others unchanged."""
    return pixels if period is None else np.concatenate((pixels, pixels[:, :1]), axis=1)


def _opened(marks: NDArray[Any], period: int | None) -> NDArray[Any]:
    """Marks without the repeated column, whose marks the first one also has."""
    if period is None:
        return marks
    marks[:, 0] |= marks[:, -1]
    return np.ascontiguousarray(marks[:, :-1])


def _apart(vectors: NDArray[Any], axis: int, period: int | None) -> tuple[NDArray[Any], NDArray[Any]]:
    """The differences between the flows of neighbours, right and down."""
    a, b = _sides(axis)
    u, v = (vectors[b] - vectors[a]).transpose(2, 0, 1)
    return (u if period is None else short_way(u, period)), v


def _sides(axis: int) -> tuple[tuple[slice, ...], tuple[slice, ...]]:
    """Return two slices along an axis: every pixel but the last, and every pixel but the first."""
    before = (slice(None),) * axis
    return (*before, slice(None, -1)), (*before, slice(1, None))


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """A boundary has a neighbour that moves differently."""
    boundaries, vectors = channel_of(sample, "motion_boundaries"), channel_of(sample, "flow")
    if boundaries is None or vectors is None:
        return
    period = period_of(sample)
    vectors = _closed(vectors, period)
    moves_otherwise = np.zeros(vectors.shape[:2], np.bool_)
    for axis in (0, 1):
        a, b = _sides(axis)
        differs = np.hypot(*_apart(vectors, axis, period)) > APART * (1 - 1e-5)
        moves_otherwise[a] |= differs
        moves_otherwise[b] |= differs
    wrong = (boundaries > 0) & ~_opened(moves_otherwise, period)
    if wrong.any():
        yield f"expected neighbours whose flow differs; found none at {wrong.sum()} pixels"


def _lined(picture: Picture, sample: Sample) -> Picture:
    """The picture with its boundaries as lines of one colour."""
    return np.where(sample.channels["motion_boundaries"][..., None] > 0, np.array(COLOR, np.uint8), picture)


LABEL = ChannelLabel(
    name="motion_boundaries",
    meaning="1 where a pixel beside shows something else that moves otherwise",
    needs=(Next(),),
    dtype=np.uint8,
    ids={},
    encoding="png",
    compute=_compute,
    prove=_prove,
    drawing=Drawing("motion_boundaries", pixels=_lined, key=(("motion boundaries", COLOR),)),
)
