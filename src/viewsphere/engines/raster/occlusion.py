"""Ambient occlusion: how much of the sky each place on and beside the targets can see, baked once a model.

Depths from 32 or 48 directions all over the sphere, each looked up as softly as a light that fills its part of the sphere.
"""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.raster import kernels_occlusion as kernels
from viewsphere.engines.raster.arriving import arriving
from viewsphere.engines.raster.kernels_arrive import DISTANT
from viewsphere.engines.raster.kernels_block import BLOCK, ROWS
from viewsphere.engines.raster.lights import Casters, Lights, Views, draw_views, parallel_view
from viewsphere.engines.raster.records import Float32

Float = NDArray[np.float64]
Quality = Literal["off", "fast", "fine"]

_LONGEST = {"fast": 40, "fine": 64}  # cells along the longest side
_AXES = {"fast": 16, "fine": 24}  # lines along which depths are drawn, both ways
_MAP = {"fast": 96, "fine": 128}
_MOST_CELLS = {"fast": 60_000, "fine": 260_000}
_MOST_OPEN_CELLS = 60_000  # where scenery may read any of them
_PAD, _WIDE_PAD = 3, 6  # cells around the targets, without and with scenery
_PUSH = 1.6  # cells between a surface and where it reads the volume
_FLOOR = 128  # cells of the ground's map, each way
_MOST_MARKED = 200_000  # points of surfaces at a time
_DEEPEST = 0.92  # the rest is light that objects and ground throw back and forth


class Occlusion(NamedTuple):
    """volume (layers, rows, columns, 8) float32, see `kernels_occlusion`; frame (8,): x, y, z of its first point, cells per
    length, how far from a surface it is read in cells, whether there is a volume, whether there is a ground; floor (n, n, 2):
    share of the sky's and of all light that the targets leave to what they stand on; floor_frame (6,): its cells per length,
    its corner's x and y, the z they stand on, their height, whether they stand on anything.
    """

    volume: Float32
    frame: Float32
    floor: Float32
    floor_frame: Float32


NO_OCCLUSION = Occlusion(
    np.zeros((1, 1, 1, kernels.COEFFICIENTS), np.float32),
    np.zeros(8, np.float32),
    np.ones((2, 2, 2), np.float32),
    np.zeros(6, np.float32),
)


@dataclass(frozen=True)
class _Baking:
    targets: Hashable
    has_scenery: bool
    has_ground: bool
    quality: Literal["fast", "fine"]
    casters: Casters = field(compare=False)


def bake_occlusion(casters: Casters, has_ground: bool, quality: Quality) -> Occlusion:
    """What only the targets decide; the light of lamps and sky still misses from the ground's map: `with_ground_light`.

    The last one is kept for the same `casters.targets`.
    """
    if quality == "off" or not casters.extent.triangles or not (casters.extent.high - casters.extent.low).max() > 0:
        return NO_OCCLUSION
    baking = _Baking(casters.targets, casters.scenery is not None, has_ground, quality, casters)
    return _bake.__wrapped__(baking) if casters.targets is None else _bake(baking)


@lru_cache(maxsize=1)
def _bake(baking: _Baking) -> Occlusion:
    casters = baking.casters
    directions, views = _sky_views(casters, baking.quality)
    volume, corner, cells = _volume(casters, directions, views, baking.quality)
    floor, floor_frame = NO_OCCLUSION.floor, NO_OCCLUSION.floor_frame
    if casters.extent.ground_z is not None:
        floor, floor_frame = _floor(casters, casters.extent.ground_z, directions, views)
    frame = np.array([*corner, cells, _PUSH, 1.0, baking.has_ground, 0.0], np.float32)
    return Occlusion(volume, frame, floor, floor_frame)


def with_ground_light(occlusion: Occlusion, lights: Lights, ambient: float) -> Occlusion:
    """The same where these lights and the sky light the ground: `ambient` is the sum over red, green and blue of the irradiance
    that the open ground has from the sky.
    """
    if not occlusion.floor_frame[5]:
        return occlusion
    cells, left, front, z, height = (float(v) for v in occlusion.floor_frame[:5])
    at = (np.arange(_FLOOR) + 0.5) / cells
    x, y = np.meshgrid(left + at, front + at)
    arrived, whole = ambient * occlusion.floor[..., 0], np.full((_FLOOR, _FLOOR), ambient)
    for k, kind in enumerate(lights.kind.tolist()):
        # What lamps give the ground around has their shadows taken off already; what lies on it keeps their light in.
        is_lamp = kind != DISTANT
        depth = 0.02 * height if is_lamp and occlusion.frame[6] else 0.0  # scenery may be the ground
        places = np.stack([x, y, np.full_like(x, z - depth)], axis=-1).reshape(-1, 3)
        irradiance, share = arriving(lights, k, places, 2 / cells)
        got = irradiance.sum(axis=1)
        arrived = arrived + (got * share).reshape(x.shape)
        whole = whole + (got * share if is_lamp else got).reshape(x.shape)
    floor = occlusion.floor.copy()
    reaching = np.minimum(arrived / np.maximum(whole, 1e-30), 1)
    floor[..., 1] = 1 - np.where(whole > 0, 1 - reaching, 0) * _window()
    return occlusion._replace(floor=floor)


def sky_directions(axes: int) -> Float32:
    """Unit vectors that share the sphere evenly, (2 * axes, 3): a Fibonacci spiral up from the horizon, then its opposites.

    Their second moments are those of the sphere, so that a surface of any tilt sees half of them with the right mean.
    """
    i = np.arange(axes)
    z = (i + 0.5) / axes
    angle = i * math.pi * (3 - math.sqrt(5))
    radius = np.sqrt(1 - z**2)
    upper = np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1)
    for _ in range(8):
        values, vectors = np.linalg.eigh(3 * upper.T @ upper / axes)
        upper = upper @ (vectors / np.sqrt(values)) @ vectors.T
        upper /= np.linalg.norm(upper, axis=1, keepdims=True)
    return np.concatenate([upper, -upper]).astype(np.float32)


def _sky_views(casters: Casters, quality: Literal["fast", "fine"]) -> tuple[Float32, Views]:
    """Depths of the targets seen from all directions, the second half of which are opposite to the first."""
    directions = sky_directions(_AXES[quality])
    low, high = casters.extent.low, casters.extent.high
    span = 1.15 * float(np.linalg.norm(high - low))
    tangent = math.tan(math.acos(1 - 2 / len(directions)))
    views = [
        replace(parallel_view(-d.astype(np.float64), (low + high) / 2, span, tangent, _MAP[quality], 4), is_fine=False)
        for d in directions[: _AXES[quality]]
    ]
    surfaces, triangles = casters.surfaces, casters.surfaces.triangles[: casters.extent.triangles]
    own = surfaces._replace(vertices=surfaces.vertices[: int(triangles.max()) + 1], triangles=triangles)
    return directions, draw_views(views, casters.alone(own), opposite=True)


def _volume(
    casters: Casters, directions: Float32, views: Views, quality: Literal["fast", "fine"]
) -> tuple[Float32, Float, float]:
    """The volume, where its first point lies and how many cells there are per length."""
    low, size = casters.extent.low, casters.extent.high - casters.extent.low
    has_scenery = casters.scenery is not None
    pad = _WIDE_PAD if has_scenery else _PAD
    most = _MOST_OPEN_CELLS if has_scenery else _MOST_CELLS[quality]
    cells = _LONGEST[quality] / float(size.max())
    while np.prod(np.ceil(size * cells) + 2 * pad + 1) > most:
        cells *= 0.9
    shape = (np.ceil(size * cells) + 2 * pad + 1).astype(int)[::-1]
    corner = low - pad / cells
    wanted = np.full(shape, True) if has_scenery else _read_points(casters, corner, cells, shape)
    points = corner + np.argwhere(wanted)[:, ::-1] / cells
    seen = _seen(points, views, directions)
    volume = np.empty((*shape, kernels.COEFFICIENTS), np.float32)
    volume[:] = [0.5, 0.0, 0.0, 0.25, 0.5, 0.0, 0.0, -0.25]
    volume[wanted] = seen
    known = wanted & (volume[..., 0] + volume[..., 4] >= kernels.HIDDEN)
    for _ in range(3):
        known = _spread(volume, known)
    return volume, corner, cells


def _seen(points: Float, views: Views, directions: Float32) -> Float32:
    """What of these directions each point (N, 3) sees, as coefficients (N, 8)."""
    seen = np.zeros((len(points), kernels.COEFFICIENTS), np.float32)
    room = np.zeros(ROWS * BLOCK, np.float32)
    kernels.see(np.ascontiguousarray(points, np.float32), views, directions, room, seen)
    return seen


def _spread(volume: Float32, known: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Give unknown points beside known ones their mean, once; returns what is known then."""
    own = np.concatenate([volume, np.ones((*known.shape, 1), np.float32)], axis=-1)
    own[~known] = 0
    total = np.zeros_like(own)
    for axis in range(3):
        beside, here = np.moveaxis(own, axis, 0), np.moveaxis(total, axis, 0)
        here[1:] += beside[:-1]
        here[:-1] += beside[1:]
    fresh = ~known & (total[..., -1] > 0)
    volume[fresh] = total[fresh, :-1] / total[fresh, -1:]
    return known | fresh


def _read_points(casters: Casters, corner: Float, cells: float, shape: NDArray[np.int_]) -> NDArray[np.bool_]:
    """The points of the volume that samples of the targets will read, on both sides of their surfaces.

    corner (3,): where the first point lies; cells: per length.
    """
    triangles = casters.surfaces.triangles[: casters.extent.triangles].T
    vertices = casters.surfaces.vertices.T
    # Where and which way: lengths in cells.
    known = np.concatenate([(vertices[11:14] - corner[:, None]) * cells, vertices[:3]], dtype=np.float32)
    a, b, c = (known[:3, corners] for corners in triangles)
    longest = np.sqrt(np.max([(d * d).sum(axis=0) for d in (b - a, c - b, a - c)], axis=0))
    parts = np.maximum(np.ceil(1.5 * longest), 1)
    is_first = np.zeros(shape, np.bool_)
    is_corner = np.zeros(vertices.shape[1], np.bool_)
    is_corner[triangles[:, parts == 1]] = True
    _mark(known[:, is_corner], is_first)
    for n in np.unique(parts[parts > 1]).astype(int).tolist():
        f, g = np.mgrid[: n + 1, : n + 1].reshape(2, -1)[:, :, None].astype(np.float32) / n
        f, g = f[f + g < 1 + 0.5 / n], g[f + g < 1 + 0.5 / n]
        whole = triangles[:, parts == n]
        step = max(_MOST_MARKED // len(f), 1)
        for start in range(0, whole.shape[1], step):
            p, q, r = (known[:, None, corners[start : start + step]] for corners in whole)
            _mark((p + f[:, None] * (q - p) + g[:, None] * (r - p)).reshape(6, -1), is_first)
    for axis in range(3):
        along = np.moveaxis(is_first, axis, 0)
        along[1:] |= along[:-1].copy()
    return is_first


def _mark(known: Float32, is_first: NDArray[np.bool_]) -> None:
    """Mark the first of the eight points around where surface points (6, N) of this place and normal read the volume."""
    place, normal = known[:3], known[3:]
    off = normal * (_PUSH / np.maximum(np.sqrt((normal * normal).sum(axis=0)), 1e-6))
    layers, rows, columns = is_first.shape
    for read in (place - off, place + off):
        with np.errstate(invalid="ignore"):
            column, row, layer = read.astype(np.int32)
        inside = (column >= 0) & (row >= 0) & (layer >= 0) & (column < columns) & (row < rows) & (layer < layers)
        is_first[layer[inside], row[inside], column[inside]] = True


def _floor(casters: Casters, z: float, directions: Float32, views: Views) -> tuple[Float32, Float32]:
    """Share of the sky's light that the targets leave to what they stand on, and where it lies."""
    low, high = casters.extent.low, casters.extent.high
    height = float(high[2]) - z
    half = float(max((high - low)[:2].max() / 2, 1e-3) + 0.9 * height)
    corner = (low + high)[:2] / 2 - half
    cells = _FLOOR / (2 * half)
    at = (np.arange(_FLOOR) + 0.5) / cells
    x, y = np.meshgrid(corner[0] + at, corner[1] + at)
    points = np.stack([x, y, np.full_like(x, z)], axis=-1).reshape(-1, 3)
    upper = len(directions) // 2
    seen = _seen(points, views, directions[:upper])
    share = (seen[:, 3] / directions[:upper, 2].mean()).reshape(x.shape)
    floor = np.empty((_FLOOR, _FLOOR, 2), np.float32)
    floor[:] = (1 - (1 - np.clip(share, 0, 1)) * _DEEPEST * _window())[..., None]
    return floor, np.array([cells, *corner, z, max(height, 1e-6), 1.0], np.float32)


def _window() -> Float:
    """1 within the ground's map, falling to 0 at its border."""
    inward = np.minimum(np.arange(_FLOOR) + 0.5, _FLOOR - np.arange(_FLOOR) - 0.5) / (0.15 * _FLOOR)
    return np.clip(np.minimum(inward[:, None], inward), 0, 1)
