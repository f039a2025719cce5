"""Laplace's equation on any region of a picture, by multigrid."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]
Mask = NDArray[np.bool_]

CYCLES = 6
SWEEPS = 1
COARSEST = 6
"""Side length, in pixels, below which plain sweeps solve the equation."""


def harmonic(values: Float32, free: Mask, fixed: Mask) -> Float32:
    """Values (H, W, C) float32 in which each free pixel (H, W) is the mean of its neighbours.

    Of the four adjacent pixels, only free or fixed ones are neighbours; other pixels and the picture's border are barriers. The
    result is exact to about a thousandth of the spread of the fixed values. Free pixels that no fixed pixel reaches get the
    mean of the fixed values.
    """
    levels = _levels(free, fixed)
    known = values[fixed]
    start = known.mean(axis=0) if len(known) else np.zeros(values.shape[2], np.float32)
    filled = np.where(fixed[..., None], values, np.where(free[..., None], start, np.float32(0)))
    planes = np.ascontiguousarray(np.pad(np.moveaxis(filled, 2, 0), ((0, 0), (1, 1), (1, 1))))
    nothing = np.zeros_like(planes)
    for _ in range(CYCLES):
        _cycle(planes, nothing, levels)
    return np.where(free[..., None], np.moveaxis(planes[:, 1:-1, 1:-1], 0, 2), values)


def _cycle(values: Float32, right: Float32, levels: list[Float32]) -> None:
    """One W-cycle, in place."""
    from viewsphere.rendering import kernels_harmonic as kernels

    inverse, *rest = levels
    if not rest:
        kernels.relax(values, right, inverse, 8 * COARSEST)
        return
    kernels.relax(values, right, inverse, SWEEPS)
    missing = np.zeros((len(values), *rest[0].shape), np.float32)
    kernels.restrict(values, right, inverse, missing)
    correction = np.zeros_like(missing)
    for _ in range(2):
        _cycle(correction, missing, rest)
    kernels.correct(correction, inverse, values)
    kernels.relax(values, right, inverse, SWEEPS)


def _levels(free: Mask, fixed: Mask) -> list[Float32]:
    """1 / (number of neighbours that are free or fixed) of free pixels, else 0, with a rim; each level half the last one's
    size.

    A coarse cell is fixed if any of its pixels is fixed, else free if any is free.
    """
    counts = np.pad(free | fixed, 1)
    around = counts[:-2, 1:-1].astype(np.float32) + counts[2:, 1:-1] + counts[1:-1, :-2] + counts[1:-1, 2:]
    inverse = np.where(free & (around > 0), np.float32(1) / np.maximum(around, np.float32(1)), np.float32(0))
    levels = [np.pad(inverse, 1)]
    if max(free.shape) > COARSEST:
        coarse_fixed = _any_of_four(fixed)
        levels += _levels(_any_of_four(free) & ~coarse_fixed, coarse_fixed)
    return levels


def _any_of_four(mask: Mask) -> Mask:
    even = np.pad(mask, ((0, mask.shape[0] % 2), (0, mask.shape[1] % 2)))
    return even[::2, ::2] | even[1::2, ::2] | even[::2, 1::2] | even[1::2, 1::2]
