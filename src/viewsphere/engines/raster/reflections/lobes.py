"""Rays that share the lobe of a rough mirror."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.raster.indirect.gathering.patch_rays import axes_along
from viewsphere.engines.raster.records import Float32, Int32

Float = NDArray[np.float64]

SMOOTHEST = 1e-3
"""Squared roughness, at least."""

GOLDEN = 0.6180339887
PLASTIC = 0.7548776662, 0.5698402910
"""Steps of sequences that fill an interval, and a square, evenly (Roberts 2018)."""


def lobe_rays(
    toward: Float32, normals: Float32, roughness: Float32, pixels: Int32, columns: int, count: int
) -> tuple[Float32, Float32]:
    """Directions (count, N, 3) from which light reaches the viewer, who is `toward` (N, 3), by way of rough surfaces, and how
    much each of them counts, (count, N), 0 for those into the surface.

    GGX's visible normals (Dupuy and Benyoub, Sampling Visible GGX Normals with Spherical Caps, 2023), each weighted by its
    share that is not in shadow. normals (N, 3); roughness (N,); pixels (N,), of which there are `columns` in a row: neighbours
    have different directions.
    """
    row, column = np.divmod(pixels, columns)
    steps = np.arange(count)[:, None]
    first = ((steps + 0.5) / count + PLASTIC[0] * column + PLASTIC[1] * row) % 1.0
    second = (steps * GOLDEN + PLASTIC[1] * column + (1 - PLASTIC[0]) * row) % 1.0
    axes = axes_along(normals)
    view = np.einsum("nij,nj->ni", axes, toward).astype(np.float64)
    view[:, 2] = np.maximum(view[:, 2], 1e-4)
    alpha = np.maximum(roughness.astype(np.float64) ** 2, SMOOTHEST)
    half = _visible(view, alpha, first, second)
    ways = 2 * (view * half).sum(axis=-1, keepdims=True) * half - view
    up = np.maximum(ways[..., 2], 0)
    weights = 2 * up / (up + np.sqrt(alpha * alpha + (1 - alpha * alpha) * up * up))
    return np.einsum("nij,kni->knj", axes, ways).astype(np.float32), weights.astype(np.float32)


def _visible(view: Float, alpha: Float, first: Float, second: Float) -> Float:
    """Visible normals (K, N, 3), the surface's along z, for numbers (K, N) in 0..1; view (N, 3), alpha (N,)."""
    stretch = np.stack([alpha, alpha, np.ones_like(alpha)], axis=1)
    view = view * stretch
    view /= np.sqrt((view * view).sum(axis=1, keepdims=True))
    z = (1 - second) * (1 + view[:, 2]) - view[:, 2]
    radius, angle = np.sqrt(np.maximum(1 - z * z, 0)), 2 * math.pi * first
    half = (np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=-1) + view) * stretch
    return half / np.sqrt((half * half).sum(axis=-1, keepdims=True))
