"""Rain and snow in a picture: every drop has a position in the world and falls with time, so that sequences and several views
of one moment show the same drops.

Drops have a few size classes. Each class is a lattice of air cells that falls with its drops, which depend only on a seed and
the cell. A drop of width w and speed v leaves a streak of length v T during the exposure T. It covers a pixel of the streak for
a share of T: the drop's area divided by the streak's (Garg and Nayar, *Vision and Rain*, 2007). Drops beyond `REACH` are too
thin to distinguish; together they are part of the scene's fog.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.camera import pixel_rays, project
from viewsphere.model.scene import Scene
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.weather import Falling, Rain
from viewsphere.rendering.weather.precipitation import diameter, number, sizes, speed

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]

REACH = {"rain": 9.0, "snow": 14.0}
"""Distance in metres within which single drops and flakes are visible."""

FAINTEST = 0.003
"""Opacity below which a single streak changes no byte of a picture."""

NEAREST = 0.35
"""Radius in metres around the lens without drops or flakes, as if the lens were sheltered."""

SMALLEST, LARGEST = 0.8, 6.0
"""Diameters of drops, in millimetres, that are drawn."""

CLASSES = 4
"""Number of size classes, each with one speed."""

IN_A_CELL = 6.0
"""Mean number of drops in a cell."""

MOST = 400_000
"""Maximum number of drops of one class in a picture."""

APERTURE = 0.003
"""Width of the lens aperture in metres, which blurs drops nearer than `FOCUS`, metres."""

FOCUS = 8.0  # metres: near drops are blurred and far ones sharp, as in photographs of rain. Chosen by sight
SWIRL = 0.12
"""Distance in metres by which flakes swing from side to side."""


def fall_in(scene: Scene, picture: Float32, camera: Camera, seconds: float, inverse_depth: Float32) -> None:
    """Draw a scene's rain and snow with `fall`."""
    for falling in (scene.rain, scene.snow):
        if falling is not None:
            fall(picture, falling, camera, seconds, inverse_depth)


def fall(picture: Float32, falling: Falling, camera: Camera, seconds: float, inverse_depth: Float32) -> None:
    """Draw rain or snow over a picture (H, W, 4), scene-linear and premultiplied, in place, except behind nearer surfaces.

    inverse_depth (H, W): the picture's, as in `truth.raster.visibility.Visibility`.
    """
    ends, width, soft, level, inverse = (np.concatenate(rows) for rows in zip(*_classes(falling, camera, seconds), strict=True))
    order = np.argsort(inverse, kind="stable")  # the nearest last
    from viewsphere.rendering.weather import kernels_falling as kernels

    rows = (values[order] for values in (ends, width, soft, level, inverse))
    kernels.draw(*rows, np.array(falling.color, np.float32), inverse_depth, picture)


def _classes(falling: Falling, camera: Camera, seconds: float) -> Iterator[tuple[Float, Float, Float, Float, Float]]:
    """Yield the streaks of each size class: ends (N, 4), width, softness, opacity and 1/depth (N,)."""
    edges = [diameter(falling, SMALLEST, LARGEST, i / CLASSES) for i in range(CLASSES + 1)]
    for i, (low, high) in enumerate(pairwise(edges)):
        velocity = np.array([*falling.wind, -speed(falling, diameter(falling, low, high, 0.5))])
        places, shares = _there(falling, i, number(falling, low, high), velocity * seconds, camera)
        slope = sizes(falling).slope
        least, most = math.exp(-slope * low), math.exp(-slope * high)
        wide = -np.log(least - shares[:, 0] * (least - most)) / slope * sizes(falling).wide / 1000
        half = falling.exposure / 2
        before, after = (places + velocity * t + _swing(falling, shares, t) for t in (seconds - half, seconds + half))
        yield _streaks(camera, before, after, wide)


def _there(falling: Falling, kind: int, dense: float, moved: Float, camera: Camera) -> tuple[Float, Float]:
    """Positions (N, 3), in air that has `moved` so far, of the drops in front of a camera, and random shares (N, 3)."""
    from viewsphere.rendering.weather import kernels_falling as kernels

    reach, size = REACH["rain" if isinstance(falling, Rain) else "snow"], (IN_A_CELL / dense) ** (1 / 3)
    low, high = (np.floor((camera.center - moved + side * reach) / size).astype(np.int64) for side in (-1, 1))
    seed = np.uint64((falling.seed * CLASSES + kind) % 2**64)
    return kernels.scatter(
        seed, low, high, size, IN_A_CELL, moved, camera.center, camera.R[2].copy(), reach, _cone(camera), MOST
    )


def _cone(camera: Camera) -> float:
    """Cosine of the largest angle between the camera's axis and a visible direction."""
    if camera.lens.has_unit_rays:
        return -1.0
    rays = pixel_rays(camera.intrinsics)
    return float((rays[..., 2] / np.linalg.norm(rays, axis=-1)).min())


def _swing(falling: Falling, shares: Float, seconds: float) -> Float:
    """Return the displacement of flakes from their path by swinging, (N, 3)."""
    if isinstance(falling, Rain):
        return np.zeros((len(shares), 3))
    turn = 2 * math.pi * (shares[:, 1] + (0.25 + 0.5 * shares[:, 2]) * seconds)
    return SWIRL * np.stack([np.sin(turn), np.cos(turn + 7 * shares[:, 2]), 0.3 * np.sin(2 * turn)], axis=1)


def _streaks(camera: Camera, before: Float, after: Float, wide: Float) -> tuple[Float, Float, Float, Float, Float]:
    """Ends, width, softness, opacity and 1/depth of drops that move from `before` to `after` (N, 3), world metres."""
    begin, end = (points @ camera.R.T + camera.t for points in (before, after))
    (first, _), (last, _) = project(camera.intrinsics, begin), project(camera.intrinsics, end)
    middle = (begin + end) / 2
    away = np.linalg.norm(middle, axis=1)
    depth = away if camera.lens.has_unit_rays else middle[:, 2]
    focal = math.sqrt(camera.intrinsics.fx * camera.intrinsics.fy)
    with np.errstate(divide="ignore", invalid="ignore"):
        widths = focal * wide / away
        blur = focal * APERTURE * np.abs(1 / away - 1 / FOCUS)
        width = np.maximum(np.hypot(widths, blur), 1.0)
        length = np.linalg.norm(last - first, axis=1)
        area = math.pi / 4
        level = np.minimum(area * widths**2 / (area * width**2 + length * width), 1.0)
    ends = np.concatenate([first, last], axis=1)
    reach = width + 1
    x, y = ends[:, ::2], ends[:, 1::2]
    seen = (x.max(axis=1) > -reach) & (x.min(axis=1) < camera.width + reach)
    seen &= (y.max(axis=1) > -reach) & (y.min(axis=1) < camera.height + reach)
    seen &= (depth > 0) & (away > NEAREST) & (level > FAINTEST) & np.isfinite(ends).all(axis=1)
    return ends[seen], width[seen], np.maximum(blur, 1.0)[seen], level[seen], 1 / depth[seen]
