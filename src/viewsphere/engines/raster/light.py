"""Sun, sky and shadows of a stage, baked once."""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.srgb import linear
from viewsphere.engines.raster import kernels_shadow as kernels
from viewsphere.engines.raster.records import Float32, Light, Surfaces, Textures
from viewsphere.engines.raster.surface import CASTS_FROM
from viewsphere.geometry.camera import orbit_center
from viewsphere.model.scene import Scene

Float = NDArray[np.float64]

_CELLS = 128  # of the ground's light map, each way
_FINE = 4  # samples a cell, each way
_DIRECTIONS = 12
_DEEPEST = 0.88  # the rest is light that objects and ground throw back and forth
_MARGIN = 8  # empty texels around the shadow map
_ROUND_TARGETS = 2.0  # times the targets: the shadow map's width where there is scenery
_WIDER = 8.0  # each wide map, over the one before
_MOST_WIDE = 3
_NO_MAPS = (
    np.zeros((0, kernels.BLOCK, kernels.BLOCK), np.float32),
    np.zeros((0, 1, 1), np.float32),
    np.zeros((0, 1, 1), np.float32),
    np.zeros((0, 3, 4), np.float32),
)
_SURROUNDINGS = 0.3  # reflectance of what lies below the horizon when there is no ground


@dataclass(frozen=True, eq=False)
class Extent:
    """The targets' bounds, low and high (3,), and the z they stand on or None, in the units of `Surfaces`; how many triangles
    they have, which come first; half the size of all there is.
    """

    low: Float
    high: Float
    ground_z: float | None
    triangles: int
    reach: float


def bake_light(
    scene: Scene,
    extent: Extent,
    surfaces: Surfaces,
    textures: Textures,
    exposure: float,
    resolution: int,
    scenery: Hashable = None,
) -> Light:
    """All that depends on scene and objects but not on the camera; `resolution` is the shadow maps' width.

    `scenery` stands for all that is scenery, None if there is none: where it is equal, the triangles beyond the targets are.
    """
    strength = exposure * scene.sky.strength
    zenith, horizon = (strength * np.array(c) for c in (scene.sky.zenith, scene.sky.horizon))
    sky = _sky_on_white(zenith, horizon)
    direction, irradiance = np.array([0.0, 0.0, 1.0]), np.zeros(3)
    shadow, matrix = np.full((kernels.BLOCK, kernels.BLOCK), np.inf, np.float32), np.zeros((3, 4))
    wide = _NO_MAPS
    if scene.sun is not None and scene.sun.strength > 0:
        direction = orbit_center(math.radians(scene.sun.azimuth_deg), math.radians(scene.sun.elevation_deg), 1.0)
        irradiance = exposure * scene.sun.strength * np.array(scene.sun.color)
        shadow, matrix = _shadow_map(direction, extent, surfaces, textures, resolution)
        if scenery is not None:
            x, y, z = direction.tolist()
            span = 2.0 ** math.ceil(math.log2(float(np.linalg.norm(extent.high - extent.low)) or 1.0))
            part = _part(surfaces, extent.triangles)
            wide = _wide_maps(_Backdrop(scenery, (x, y, z), span, extent.reach, resolution, part, textures))
    low, high = kernels.depth_bounds(shadow)
    from_sky, from_sun = sky.sum(axis=0), irradiance * direction[2] / math.pi
    albedo = linear(scene.ground.color) if scene.ground else np.full(3, _SURROUNDINGS)
    ground, frame = np.ones((2, 2, 2), np.float32), np.zeros(6, np.float32)
    if extent.ground_z is not None:
        total = float((from_sky + from_sun).sum())
        sun_share = float(from_sun.sum()) / total if total > 0 else 0.0
        ground, frame = _ground_light(extent, extent.ground_z, surfaces, textures, shadow, matrix, sun_share)
    return Light(
        sun=direction.astype(np.float32),
        sun_color=irradiance.astype(np.float32),
        sky=np.ascontiguousarray(sky, np.float32),
        zenith=zenith.astype(np.float32),
        horizon=horizon.astype(np.float32),
        earth=(albedo * (from_sky + from_sun)).astype(np.float32),
        shadow=shadow,
        shadow_low=low,
        shadow_high=high,
        shadow_from_world=np.ascontiguousarray(matrix, np.float32),
        wide=wide[0],
        wide_low=wide[1],
        wide_high=wide[2],
        wide_from_world=wide[3],
        ground=ground,
        ground_frame=frame,
    )


def _sky_on_white(zenith: Float, horizon: Float) -> Float:
    """Radiance of a white Lambert surface under the upper half of the sky, (4, 3): a cubic in its normal's z."""
    z = (np.arange(48) + 0.5) / 48
    phi = (np.arange(64) + 0.5) * (2 * np.pi / 64)
    tilt = np.linspace(-1, 1, 21)[:, None, None]
    lambert = tilt * z[:, None] + np.sqrt(1 - tilt**2) * np.sqrt(1 - z[:, None] ** 2) * np.cos(phi)
    weight = np.maximum(lambert, 0).mean(axis=2) * 2 / len(z)
    toward_zenith = 1 - (1 - z) ** 3
    share = weight @ toward_zenith
    received = horizon * (weight.sum(axis=1) - share)[:, None] + zenith * share[:, None]
    return np.linalg.lstsq(np.vander(tilt[:, 0, 0], 4, increasing=True), received, rcond=None)[0]


def _sun_axes(direction: Float) -> Float:
    """Right, up and away as the sun sees them, rows of (3, 3)."""
    right = np.array([-direction[1], direction[0], 0.0])
    length = float(np.linalg.norm(right))
    right = right / length if length > 1e-6 else np.array([1.0, 0.0, 0.0])
    return np.stack([right, np.cross(direction, right), -direction])


def _shadow_map(direction: Float, extent: Extent, surfaces: Surfaces, textures: Textures, size: int) -> tuple[Float32, Float]:
    """Nearest depths seen from the sun, fitted to the targets, and the (3, 4) matrix from the world to its texels."""
    axes = _sun_axes(direction)
    points = surfaces.vertices[:, 11:14].astype(np.float64) @ axes.T
    casts = surfaces.materials[surfaces.material, CASTS_FROM] <= 1
    targets = surfaces.triangles[: extent.triangles][casts[: extent.triangles]]
    if not casts.any() or not len(targets):
        return np.full((kernels.BLOCK, kernels.BLOCK), np.inf, np.float32), np.zeros((3, 4))
    used = points[np.unique(targets)]
    low, high = used.min(axis=0), used.max(axis=0)
    span = float((high - low)[:2].max()) or 1.0
    if surfaces.has_scenery:
        span *= _ROUND_TARGETS
    return _depth_map(axes, points, (low + high) / 2, span, surfaces, textures, size)


def _depth_map(
    axes: Float, points: Float, middle: Float, span: float, surfaces: Surfaces, textures: Textures, size: int
) -> tuple[Float32, Float]:
    scale = (size - 2 * _MARGIN) / span
    offset = np.array([size / 2, size / 2, 0.0]) - scale * middle
    return kernels.nearest_depth(points * scale + offset, surfaces, textures, size), np.column_stack([axes * scale, offset])


def _part(surfaces: Surfaces, start: int = 0, stop: int | None = None) -> Surfaces:
    """The surfaces of some triangles alone, for `nearest_depth`."""
    return surfaces._replace(triangles=surfaces.triangles[start:stop], material=surfaces.material[start:stop])


@dataclass(frozen=True)
class _Backdrop:
    """Scenery under a sun: `key` says which, how wide the narrowest map's `span` is and how far the scenery reaches."""

    key: Hashable
    direction: tuple[float, float, float]
    span: float
    reach: float
    size: int
    surfaces: Surfaces = field(compare=False)
    textures: Textures = field(compare=False)


@lru_cache(maxsize=1)
def _wide_maps(backdrop: _Backdrop) -> tuple[Float32, Float32, Float32, Float32]:
    """Maps of the scenery's shadows around the origin, their bounds and matrices; the widest ends where the scenery does.

    The last ones are kept: they do not change with the targets.
    """
    axes = _sun_axes(np.array(backdrop.direction))
    points = backdrop.surfaces.vertices[:, 11:14].astype(np.float64) @ axes.T
    span, widest = backdrop.span, 2 * backdrop.reach
    maps: list[tuple[Float32, Float]] = []
    while not maps or (span < widest and len(maps) < _MOST_WIDE):
        span = min(_WIDER * span, max(widest, backdrop.span))
        maps.append(_depth_map(axes, points, np.zeros(3), span, backdrop.surfaces, backdrop.textures, backdrop.size))
    bounds = [kernels.depth_bounds(depth) for depth, _ in maps]
    return (
        np.stack([depth for depth, _ in maps]),
        np.stack([low for low, _ in bounds]),
        np.stack([high for _, high in bounds]),
        np.stack([matrix for _, matrix in maps]).astype(np.float32),
    )


def _ground_light(
    extent: Extent,
    ground_z: float,
    surfaces: Surfaces,
    textures: Textures,
    shadow: Float32,
    matrix: Float,
    sun_share: float,
) -> tuple[Float32, Float32]:
    """What the targets leave to the ground, (n, n, 2): share of the sky's light, share of all light; and its frame."""
    height = extent.high[2] - ground_z
    half = float(max((extent.high - extent.low)[:2].max() / 2, 1e-3) + 0.9 * height)
    corner = (extent.low + extent.high)[:2] / 2 - half
    scale = _CELLS / (2 * half)
    low, high = _columns(ground_z, scale, corner, _part(surfaces, stop=extent.triangles), textures)
    left = kernels.sky_left(low, high, _DIRECTIONS, _CELLS * 0.6)
    inward = np.minimum(np.arange(_CELLS) + 0.5, _CELLS - np.arange(_CELLS) - 0.5) / (0.15 * _CELLS)
    window = np.clip(np.minimum(inward[:, None], inward), 0, 1)
    left = 1 - (1 - _smoothed(left)) * window * _DEEPEST
    fine = (np.arange(2 * _CELLS) + 0.5) / (2 * scale)
    x, y = np.meshgrid(corner[0] + fine, corner[1] + fine)
    u, v, w = (matrix[k, 0] * x + matrix[k, 1] * y + matrix[k, 2] * ground_z + matrix[k, 3] for k in range(3))
    inside = (u >= 0) & (v >= 0) & (u < len(shadow)) & (v < len(shadow))
    column, row = (np.where(inside, a, 0).astype(np.int32) for a in (u, v))
    lit = ~inside | (shadow[row, column] >= w - 1)
    lit = _smoothed(lit.reshape(_CELLS, 2, _CELLS, 2).mean(axis=(1, 3)))
    total = (1 - sun_share) * left + sun_share * (1 - (1 - lit) * window)
    frame = [scale, *corner, ground_z, max(height, 1e-6), 1.0]
    return np.ascontiguousarray(np.stack([left, total], axis=-1), np.float32), np.array(frame, np.float32)


def _columns(ground_z: float, scale: float, corner: Float, surfaces: Surfaces, textures: Textures) -> tuple[Float32, Float32]:
    """Lowest and highest surface above each cell of the ground, in cells; low is infinite where there is none."""
    points = surfaces.vertices[:, 11:14].astype(np.float64)
    points[:, :2] = (points[:, :2] - corner) * (scale * _FINE)
    points[:, 2] = (points[:, 2] - ground_z) * scale
    grids: list[Float32] = []
    for sign in (1.0, -1.0):
        points[:, 2] *= sign
        depth = kernels.nearest_depth(points, surfaces, textures, _CELLS * _FINE)
        grids.append(depth.reshape(_CELLS, _FINE, _CELLS, _FINE).min(axis=(1, 3)))
    return np.maximum(grids[0], 0), np.maximum(-grids[1], 0)


def _smoothed(grid: NDArray[np.floating]) -> NDArray[np.floating]:
    """Blurred by (1, 2, 2, 2, 1) / 8 each way, which averages tiles of four."""
    for _ in range(2):
        p = np.pad(grid, ((2, 2), (0, 0)), mode="edge")
        grid = ((p[:-4] + p[4:] + 2 * (p[1:-3] + p[2:-2] + p[3:-1])) / 8).T
    return grid
