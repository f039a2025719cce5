"""Ambient occlusion: the share of the sky visible from each place on and beside the targets, baked once per model.

It uses depth maps from 32 or 48 directions distributed over the sphere, each looked up as softly as a light that fills its part
of the sphere.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.raster.materials.kernels_material import L_CASTS_FROM
from viewsphere.engines.raster.records import Float32
from viewsphere.engines.raster.shading.kernels_block import BLOCK, ROWS
from viewsphere.engines.raster.shadows import kernels_occlusion as kernels
from viewsphere.engines.raster.shadows.arriving import arriving
from viewsphere.engines.raster.shadows.kernels_direct_light import DISTANT
from viewsphere.engines.raster.shadows.shadow_maps import Casters, Lights, Views, draw_views, parallel_view
from viewsphere.geometry.rotation import product, transform
from viewsphere.rendering.kept_light import kept_light

Float = NDArray[np.float64]
Quality = Literal["off", "fast", "fine"]

_LONGEST = {"fast": 40, "fine": 64}  # cells along the longest side
_AXES = {"fast": 16, "fine": 24}  # lines along which depths are drawn, in both directions
_MAP = {"fast": 96, "fine": 128}
_MOST_CELLS = {"fast": 60_000, "fine": 260_000}
_MOST_OPEN_CELLS = 60_000  # if scenery may read any of them
_PAD, _WIDE_PAD = 3, 6  # cells around the targets, without and with scenery
_PUSH = 1.6  # cells between a surface and the place where it reads the volume
_FLOOR = 128  # cells of the ground's map, each way
_SIDES = 1 << 16  # triangles measured at once: all 2 million of a crowd at once take 200 MB
_MOST_MARKED = 200_000  # points of surfaces at a time
_MOST_MARKS = 50_000_000  # points of all surfaces; for more of them, all points of the volume are computed instead
_DEEPEST = 0.92  # the rest is light reflected between objects and ground


class Occlusion(NamedTuple):
    """N volumes and maps, one of each for all targets of a still picture, or for each target of a sequence.

    volume (cells, 8) float32, see `kernels_occlusion`, all volumes one after another; grid (N, 4) int64: the start of each, its
    layers, rows and columns; frame (N, 8): x, y, z of its first point, cells per length, distance from a surface at which it is
    read in cells, whether there is a volume, whether there is a ground; floor (N, n, n, 2): the shares of the sky's light and
    of all light that the targets leave to the surface below them; floor_frame (N, 7): its cells per length, its corner's x and
    y, the z of that surface, the targets' height, whether there is such a surface, whether the targets do not darken places
    high above. All of these are in the axes of baking. pose (N, 12): rows of the (3, 4) matrix from the stage to these axes,
    which is rigid; reach (N, 6): lowest and highest x, lowest and highest y and z in the stage at which anything can be hidden.
    """

    volume: Float32
    grid: NDArray[np.int64]
    frame: Float32
    floor: Float32
    floor_frame: Float32
    pose: Float32
    reach: Float32


NO_OCCLUSION = Occlusion(
    np.zeros((1, kernels.COEFFICIENTS), np.float32),
    np.zeros((0, 4), np.int64),
    np.zeros((0, 8), np.float32),
    np.ones((0, 2, 2, 2), np.float32),
    np.zeros((0, 7), np.float32),
    np.zeros((0, 12), np.float32),
    np.zeros((0, 6), np.float32),
)
IN_PLACE = np.eye(4)
"""World from the axes of baking, in the stage's unit, for things that are baked in place."""


class Hidden(NamedTuple):
    """The occlusion by some targets, in the axes of baking: an `Occlusion` of one volume and map, without pose and reach.

    volume (layers, rows, columns, 8); floor (n, n): the sky's share alone.
    """

    volume: Float32
    frame: Float32
    floor: Float32
    floor_frame: Float32


class Fineness(NamedTuple):
    """quality: the numbers of directions and cells; most: maximum number of cells of a volume; floor: cells of the ground's map
    in each direction; is_open: whether other things may be near, which may read any of the cells.
    """

    quality: Literal["fast", "fine"]
    most: int
    floor: int
    is_open: bool


@dataclass(frozen=True)
class _Baking:
    targets: Hashable
    has_ground: bool
    fineness: Fineness
    casters: Casters = field(compare=False)
    is_alone: bool = field(compare=False)


def bake_occlusion(casters: Casters, has_ground: bool, quality: Quality, is_alone: bool = False) -> Occlusion:
    """Return the occlusion that depends only on the targets; `with_ground_light` adds the light of lamps and sky to the floor.

    The last result is cached for the same `casters.targets`. is_alone: there is one target. Its result is also stored in the
    cache, since other runs have the same target; places of several targets are drawn anew.
    """
    if quality == "off" or not casters.extent.triangles or not (casters.extent.high - casters.extent.low).max() > 0:
        return NO_OCCLUSION
    has_scenery = casters.scenery is not None
    fineness = Fineness(quality, _MOST_OPEN_CELLS if has_scenery else _MOST_CELLS[quality], _FLOOR, has_scenery)
    baking = _Baking(casters.targets, has_ground, fineness, casters, is_alone)
    return _bake.__wrapped__(baking) if casters.targets is None else _bake(baking)


@lru_cache(maxsize=1)
def _bake(baking: _Baking) -> Occlusion:
    everywhere = np.array([-np.inf, np.inf] * 3)
    return joined([_hidden(baking)], [IN_PLACE], everywhere[None])


def _hidden(baking: _Baking) -> Hidden:
    """The result of `hidden_by`, from the cache if it has the result for an equal target."""
    casters, extent = baking.casters, baking.casters.extent
    triangles = casters.surfaces.triangles[: extent.triangles]
    opaque_from = casters.surfaces.looks[casters.surfaces.material[: extent.triangles], L_CASTS_FROM]
    if not baking.is_alone or casters.scenery is not None or ((opaque_from > 0) & (opaque_from <= 1)).any():
        return hidden_by(casters, baking.has_ground, baking.fineness)  # textures determine which parts are opaque
    vertices = casters.surfaces.vertices[: int(triangles.max()) + 1]
    box = extent.low, extent.high, extent.ground_z
    content = "occlusion", vertices[:, :3], vertices[:, 11:14], triangles, opaque_from, *box, baking.has_ground, baking.fineness
    return kept_light(content, lambda: hidden_by(casters, baking.has_ground, baking.fineness), (Hidden,))


def hidden_by(casters: Casters, has_ground: bool, fineness: Fineness) -> Hidden:
    """Return the occlusion of the places near the targets, and of the ground, by the targets."""
    directions, views = _sky_views(casters, fineness.quality)
    volume, corner, cells = _volume(casters, directions, views, fineness)
    floor, floor_frame = np.ones((fineness.floor, fineness.floor), np.float32), np.zeros(7, np.float32)
    if casters.extent.ground_z is not None:
        floor, floor_frame = _floor(casters, casters.extent.ground_z, directions, views, fineness.floor)
    frame = np.array([*corner, cells, _PUSH, 1.0, has_ground, 0.0], np.float32)
    return Hidden(volume, frame, floor, floor_frame)


def joined(hidden: Sequence[Hidden], poses: Sequence[Float], reach: Float, volume: Float32 | None = None) -> Occlusion:
    """Join the occlusion of several targets, each at its place.

    `poses` (4, 4) are rigid, from the axes of baking to the stage, and `reach` (N, 6) is as in `Occlusion`. volume: the result
    of `joined_volumes` for them, if already computed.
    """
    volumes = {id(each.volume): each.volume for each in hidden}
    firsts = dict(zip(volumes, np.cumsum([0, *(v[..., 0].size for v in volumes.values())]).tolist(), strict=False))
    inverse = [np.column_stack([pose[:3, :3].T, -transform(pose[:3, :3].T, pose[:3, 3])]) for pose in poses]
    return Occlusion(
        volume=joined_volumes(tuple(volumes.values())) if volume is None else volume,
        grid=np.array([[firsts[id(each.volume)], *each.volume.shape[:3]] for each in hidden], np.int64),
        frame=np.array([each.frame for each in hidden]),
        floor=np.repeat(np.array([each.floor for each in hidden])[..., None], 2, axis=3),
        floor_frame=np.array([each.floor_frame for each in hidden]),
        pose=np.array(inverse, np.float32).reshape(-1, 12),
        reach=np.asarray(reach, np.float32),
    )


def joined_volumes(volumes: Sequence[Float32]) -> Float32:
    """The distinct volumes, one after another, (cells, 8)."""
    flat = [volume.reshape(-1, kernels.COEFFICIENTS) for volume in volumes]
    return flat[0] if len(flat) == 1 else np.concatenate(flat)


def with_ground_light(occlusion: Occlusion, lights: Lights, ambient: float) -> Occlusion:
    """The occlusion with the ground lit by these lights and the sky. `ambient` is the sum over red, green and blue of the sky's
    irradiance on the open ground.
    """
    if not occlusion.floor_frame[:, 5].any():
        return occlusion
    floor = occlusion.floor.copy()
    floor[..., 1] = _all_light(occlusion, lights, ambient)
    return occlusion._replace(floor=floor)


def of_ground_alone(occlusion: Occlusion) -> Occlusion:
    """The occlusion for targets whose own light is known (`bounces`): only the ground is darkened, by everything that the
    targets hide.
    """
    frame, floor = occlusion.frame.copy(), occlusion.floor.copy()
    frame[:, 5] = 0
    floor[..., 0] = np.clip(1 - (1 - floor[..., 0]) / _DEEPEST, 0, 1)
    return occlusion._replace(frame=frame, floor=floor)


def _all_light(occlusion: Occlusion, lights: Lights, ambient: float) -> Float:
    """Share of all light that reaches the cells of the maps, (N, n, n)."""
    sky = occlusion.floor[..., 0]
    cells, left, front, z, height = (v[:, None, None] for v in occlusion.floor_frame.T[:5].astype(np.float64))
    at = (np.arange(sky.shape[1]) + 0.5) / cells
    pose = occlusion.pose.reshape(-1, 3, 4).astype(np.float64)
    arrived, whole = ambient * sky, np.full(sky.shape, ambient)
    for which, kind in enumerate(lights.kind.tolist()):
        # The lamps' light on the ground around already has its shadows; things on the ground keep their light in.
        is_lamp = kind != DISTANT
        depth = 0.02 * height * (occlusion.frame[:, 6, None, None] != 0) if is_lamp else 0.0  # scenery may be the ground
        places = np.stack(np.broadcast_arrays(left + at, (front + at).transpose(0, 2, 1), z - depth), axis=1)
        turned = product(pose[..., :3].transpose(0, 2, 1), places.reshape(len(sky), 3, -1) - pose[..., 3:])
        width = np.repeat(2 / cells, sky[0].size)
        irradiance, share = arriving(lights, which, turned.transpose(0, 2, 1).reshape(-1, 3), width)
        got, share = irradiance.sum(axis=1).reshape(sky.shape), share.reshape(sky.shape)
        arrived = arrived + got * share
        whole = whole + (got * share if is_lamp else got)
    reaching = np.minimum(arrived / np.maximum(whole, 1e-30), 1)
    return 1 - np.where(whole > 0, 1 - reaching, 0) * _window(sky.shape[1])


def sky_directions(axes: int) -> Float32:
    """Unit vectors distributed evenly over the sphere, (2 * axes, 3): a Fibonacci spiral up from the horizon, then its
    opposites.

    Their second moments are those of the sphere, so a surface of any tilt faces half of them, with the right mean.
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
    """Depths of the targets from all directions, the second half of which are opposite to the first."""
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


def _volume(casters: Casters, directions: Float32, views: Views, fineness: Fineness) -> tuple[Float32, Float, float]:
    """The volume, the place of its first point, and the number of cells per length."""
    low, size = casters.extent.low, casters.extent.high - casters.extent.low
    pad = _WIDE_PAD if fineness.is_open else _PAD
    cells = _LONGEST[fineness.quality] / float(size.max())
    while np.prod(np.ceil(size * cells) + 2 * pad + 1) > fineness.most:
        cells *= 0.9
    shape = (np.ceil(size * cells) + 2 * pad + 1).astype(int)[::-1]
    corner = low - pad / cells
    wanted = np.full(shape, True) if fineness.is_open else _read_points(casters, corner, cells, shape)
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
    """Return the part of these directions that is visible from each point (N, 3), as coefficients (N, 8)."""
    seen = np.zeros((len(points), kernels.COEFFICIENTS), np.float32)
    room = np.zeros(ROWS * BLOCK, np.float32)
    kernels.see(np.ascontiguousarray(points, np.float32), views, directions, room, seen)
    return seen


def _spread(volume: Float32, known: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Give unknown points beside known ones the mean of these, once; return a mask of the points that are then known."""
    weighted = np.concatenate([volume, np.ones((*known.shape, 1), np.float32)], axis=-1)
    weighted[~known] = 0
    total = np.zeros_like(weighted)
    for axis in range(3):
        beside, here = np.moveaxis(weighted, axis, 0), np.moveaxis(total, axis, 0)
        here[1:] += beside[:-1]
        here[:-1] += beside[1:]
    fresh = ~known & (total[..., -1] > 0)
    volume[fresh] = total[fresh, :-1] / total[fresh, -1:]
    return known | fresh


def _longest(points: Float32, triangles: NDArray[np.uint32]) -> Float32:
    """The longest side of each triangle (3, T) of these points (3, V)."""
    a, b, c = (points[:, corners] for corners in triangles)
    return np.sqrt(np.max([(d * d).sum(axis=0) for d in (b - a, c - b, a - c)], axis=0))


def _read_points(casters: Casters, corner: Float, cells: float, shape: NDArray[np.int_]) -> NDArray[np.bool_]:
    """The points of the volume that samples of the targets will read, on both sides of their surfaces.

    corner (3,): the place of the first point; cells: per length.
    """
    triangles = casters.surfaces.triangles[: casters.extent.triangles].T
    vertices = casters.surfaces.vertices.T
    # Place and direction: lengths in cells.
    points = np.concatenate([(vertices[11:14] - corner[:, None]) * cells, vertices[:3]], dtype=np.float32)
    blocks = (triangles[:, start : start + _SIDES] for start in range(0, triangles.shape[1], _SIDES))
    parts = np.concatenate([np.maximum(np.ceil(1.5 * _longest(points[:3], block)), 1) for block in blocks])
    if (parts * parts).sum(dtype=np.float64) > _MOST_MARKS:
        return np.ones(shape, np.bool_)
    is_first = np.zeros(shape, np.bool_)
    is_corner = np.zeros(vertices.shape[1], np.bool_)
    is_corner[triangles[:, parts == 1]] = True
    marked = np.flatnonzero(is_corner)
    for start in range(0, len(marked), _MOST_MARKED):
        _mark(points[:, marked[start : start + _MOST_MARKED]], is_first)
    for n in np.unique(parts[parts > 1]).astype(int).tolist():
        f, g = np.mgrid[: n + 1, : n + 1].reshape(2, -1)[:, :, None].astype(np.float32) / n
        f, g = f[f + g < 1 + 0.5 / n], g[f + g < 1 + 0.5 / n]
        whole = triangles[:, parts == n]
        step = max(_MOST_MARKED // len(f), 1)
        for start in range(0, whole.shape[1], step):
            p, q, r = (points[:, None, corners[start : start + step]] for corners in whole)
            _mark((p + f[:, None] * (q - p) + g[:, None] * (r - p)).reshape(6, -1), is_first)
    for axis in range(3):
        along = np.moveaxis(is_first, axis, 0)
        along[1:] |= along[:-1].copy()
    return is_first


def _mark(known: Float32, is_first: NDArray[np.bool_]) -> None:
    """Mark the first of the eight points around each place at which surface points (6, N), place and normal,
    read the volume.
    """
    place, normal = known[:3], known[3:]
    off = normal * (_PUSH / np.maximum(np.sqrt((normal * normal).sum(axis=0)), 1e-6))
    layers, rows, columns = is_first.shape
    for read in (place - off, place + off):
        with np.errstate(invalid="ignore"):
            column, row, layer = read.astype(np.int32)
        inside = (column >= 0) & (row >= 0) & (layer >= 0) & (column < columns) & (row < rows) & (layer < layers)
        is_first[layer[inside], row[inside], column[inside]] = True


def _floor(casters: Casters, z: float, directions: Float32, views: Views, size: int) -> tuple[Float32, Float32]:
    """The share of the sky's light that the targets leave to the surface below them, (size, size), and the
    place of this map.
    """
    low, high = casters.extent.low, casters.extent.high
    height = float(high[2]) - z
    half = float(max((high - low)[:2].max() / 2, 1e-3) + 0.9 * height)
    corner = (low + high)[:2] / 2 - half
    cells = size / (2 * half)
    at = (np.arange(size) + 0.5) / cells
    x, y = np.meshgrid(corner[0] + at, corner[1] + at)
    points = np.stack([x, y, np.full_like(x, z)], axis=-1).reshape(-1, 3)
    upper = len(directions) // 2
    seen = _seen(points, views, directions[:upper])
    share = (seen[:, 3] / directions[:upper, 2].mean()).reshape(x.shape)
    floor = (1 - (1 - np.clip(share, 0, 1)) * _DEEPEST * _window(size)).astype(np.float32)
    return floor, np.array([cells, *corner, z, max(height, 1e-6), 1.0, 0.0], np.float32)


def _window(size: int) -> Float:
    """A window that is 1 within the ground's map and falls to 0 at its border."""
    inward = np.minimum(np.arange(size) + 0.5, size - np.arange(size) - 0.5) / (0.15 * size)
    return np.clip(np.minimum(inward[:, None], inward), 0, 1)
