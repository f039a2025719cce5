"""Intervals on a circle, for pictures that show a full turn: their last column lies beside their first one.

Such a picture repeats after a number of pixels, its period. An interval (x0, x1) across the seam has x1 above the period.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.mask import decode_rle, mask_box, rle_box

Float = NDArray[np.float64]
Bounds = tuple[float, float, float, float]
Box = tuple[int, int, int, int]


def shortest_interval(starts: Float, ends: Float, period: float) -> tuple[float, float]:
    """The shortest interval of a circle that covers arcs (n,), each from its start to its end, both in [0, period), towards
    larger numbers; its end may exceed the period. (0, period) where the arcs leave no gap.
    """
    if not len(starts):
        return 0.0, period
    order = np.argsort(starts, kind="stable")
    begin, end = starts[order], (ends + period * (ends < starts))[order]
    covered = np.maximum.accumulate(np.concatenate(([end.max() - period], end)))
    gaps = np.append(begin, begin[0] + period) - covered
    gaps[0] = -np.inf  # the gap before the first arc is the one after the last arc
    widest = int(np.argmax(gaps))
    if gaps[widest] <= 0.0:
        return 0.0, period
    if widest == len(begin):
        return float(begin[0]), float(covered[widest])
    return float(begin[widest]), float(covered[widest]) + period


def interval_of_columns(is_filled: NDArray[np.bool_]) -> tuple[int, int]:
    """The shortest interval [x0, x1) of columns around a seam that holds the filled ones (W,), of which there is at least
    one. The interval starts in the picture; of equally short ones, the interval with the leftmost start.
    """
    filled = np.flatnonzero(is_filled)
    gaps = np.diff(filled, append=filled[0] + len(is_filled))
    widest = int(np.argmax(np.roll(gaps, 1)))  # the gap before each filled column
    start = int(filled[widest])
    last = int(filled[widest - 1]) + (len(is_filled) if widest else 0)
    return start, last + 1


def tight_box(box: Box, period: int | None, mask: Callable[[], NDArray[np.bool_]]) -> Box:
    """The shortest half-open box (x0, y0, x1, y1) around a mask, from the box in the picture; x1 may exceed the period.

    `mask` (H, W) is called only if the box may be shorter across the seam.
    """
    x0, y0, x1, y1 = box
    if period is None or 2 * (x1 - x0) <= period:
        return box
    x0, x1 = interval_of_columns(np.asarray(mask().any(axis=0), np.bool_))
    return x0, y0, x1, y1


def mask_bounds(mask: NDArray[np.bool_], period: int | None) -> Box | None:
    """The shortest half-open box around a mask (H, W), None if it is empty."""
    tight = mask_box(mask)
    return tight and tight_box(tight, period, lambda: mask)


def rle_bounds(height: int, width: int, counts: str, period: int | None) -> Bounds | None:
    """The same of a compressed run-length code, as floats."""
    tight = rle_box(height, width, counts)
    if tight is None:
        return None
    x0, y0, x1, y1 = tight_box(tight, period, lambda: decode_rle(height, width, counts))
    return float(x0), float(y0), float(x1), float(y1)


def part_in(box: Box, mask: NDArray[Any]) -> NDArray[Any]:
    """The part of a picture (H, W) in a box, whose columns may reach across the seam."""
    x0, y0, x1, y1 = box
    rows = mask[y0:y1]
    return rows[:, x0:x1] if x1 <= mask.shape[1] else rows.take(np.arange(x0, x1), axis=1, mode="wrap")


def united(a: Bounds, b: Bounds, period: int | None) -> Bounds:
    """The shortest box around two boxes."""
    y0, y1 = min(a[1], b[1]), max(a[3], b[3])
    if period is None:
        return min(a[0], b[0]), y0, max(a[2], b[2]), y1
    if max(a[2] - a[0], b[2] - b[0]) >= period:
        return 0.0, y0, float(period), y1
    starts, ends = (np.mod([a[n], b[n]], period) for n in (0, 2))
    x0, x1 = shortest_interval(starts, ends, float(period))
    return x0, y0, x1, y1


def turns(period: int | None) -> tuple[int, ...]:
    """The offsets of a picture's copies beside it, 0 first."""
    return (0,) if period is None else (0, period, -period)


def in_picture(start: float, end: float, period: float, width: float) -> tuple[float, float]:
    """An interval of a circle as positions in a picture of columns [0, width), which shows the circle in part.

    If both sides of the picture show the interval, the result holds both parts. If the picture does not show the interval, the
    result is the place nearest to the picture.
    """
    shift = -period * math.floor(((start + end) / 2 - width / 2) / period + 0.5)
    x0, x1 = start + shift, end + shift
    for turn in (-period, period):
        if x1 > 0 and x0 < width and x1 + turn > 0 and x0 + turn < width:
            return min(x0, x0 + turn), max(x1, x1 + turn)
    return x0, x1


def short_way(offset: Float, period: float) -> Float:
    """Offsets along a circle by its shorter way: within half a period of 0."""
    return offset - period * np.rint(offset / period)


def clip_to_turn(bounds: Bounds, height: float) -> Bounds | None:
    """The part of a 2D box inside a picture of a full turn, which ends above and below only; None if there is none."""
    x0, y0, x1, y1 = bounds
    return (x0, max(y0, 0.0), x1, min(y1, height)) if y1 > 0 and y0 < height else None
