"""Sun, sky and shadows of a stage, baked once."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.srgb import linear
from viewsphere.engines.raster import kernels_shadow as kernels
from viewsphere.engines.raster.records import Float32, Light, Surfaces, Textures
from viewsphere.geometry.camera import orbit_center
from viewsphere.model.shot import Scene

Float = NDArray[np.float64]

_CELLS = 128  # of the ground's light map, each way
_FINE = 4  # samples a cell, each way
_DIRECTIONS = 12
_DEEPEST = 0.88  # the rest is light that objects and ground throw back and forth
_MARGIN = 8  # empty texels around the shadow map
_SURROUNDINGS = 0.3  # reflectance of what lies below the horizon when there is no ground


@dataclass(frozen=True, eq=False)
class Extent:
    """The objects' bounds, low and high (3,), and the ground's z or None; the centre is 0, half the diagonal 1."""

    low: Float
    high: Float
    ground_z: float | None


def bake_light(scene: Scene, extent: Extent, surfaces: Surfaces, textures: Textures, exposure: float, resolution: int) -> Light:
    """All that depends on scene and objects but not on the camera; `resolution` is the shadow map's width."""
    strength = exposure * scene.sky.strength
    zenith, horizon = (strength * np.array(c) for c in (scene.sky.zenith, scene.sky.horizon))
    sky = _sky_on_white(zenith, horizon)
    direction, irradiance = np.array([0.0, 0.0, 1.0]), np.zeros(3)
    shadow, matrix = np.full((kernels.BLOCK, kernels.BLOCK), np.inf, np.float32), np.zeros((3, 4))
    if scene.sun is not None and scene.sun.strength > 0:
        direction = orbit_center(math.radians(scene.sun.azimuth_deg), math.radians(scene.sun.elevation_deg), 1.0)
        irradiance = exposure * scene.sun.strength * np.array(scene.sun.color)
        shadow, matrix = _shadow_map(direction, extent, surfaces, textures, resolution)
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


def _shadow_map(direction: Float, extent: Extent, surfaces: Surfaces, textures: Textures, size: int) -> tuple[Float32, Float]:
    """Nearest depths seen from the sun, fitted to the objects, and the (3, 4) matrix from the world to its texels."""
    right = np.array([-direction[1], direction[0], 0.0])
    length = float(np.linalg.norm(right))
    right = right / length if length > 1e-6 else np.array([1.0, 0.0, 0.0])
    axes = np.stack([right, np.cross(direction, right), -direction])
    points = surfaces.vertices[:, 11:14].astype(np.float64) @ axes.T
    casts = surfaces.materials[surfaces.material, 16] <= 1
    if not casts.any():
        return np.full((kernels.BLOCK, kernels.BLOCK), np.inf, np.float32), np.zeros((3, 4))
    used = points[np.unique(surfaces.triangles[casts])]
    low, high = used.min(axis=0), used.max(axis=0)
    span = float((high - low)[:2].max()) or 1.0
    scale = (size - 2 * _MARGIN) / span
    offset = np.array([size / 2, size / 2, 0.0]) - scale * (low + high) / 2
    depth = kernels.nearest_depth(points * scale + offset, surfaces, textures, size)
    return depth, np.column_stack([axes * scale, offset])


def _ground_light(
    extent: Extent,
    ground_z: float,
    surfaces: Surfaces,
    textures: Textures,
    shadow: Float32,
    matrix: Float,
    sun_share: float,
) -> tuple[Float32, Float32]:
    """What the objects leave to the ground, (n, n, 2): share of the sky's light, share of all light; and its frame."""
    height = extent.high[2] - ground_z
    half = float(max((extent.high - extent.low)[:2].max() / 2, 1e-3) + 0.9 * height)
    corner = (extent.low + extent.high)[:2] / 2 - half
    scale = _CELLS / (2 * half)
    low, high = _columns(ground_z, scale, corner, surfaces, textures)
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
