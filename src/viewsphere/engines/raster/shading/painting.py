"""A picture of a stage: its visible samples, shaded once each, and the sky behind them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.raster.antialiasing import kernels_chosen
from viewsphere.engines.raster.antialiasing.samples import Layer, Marks, Samples, differs_behind, edge_samples, layers
from viewsphere.engines.raster.indirect.bounces import BounceScene
from viewsphere.engines.raster.indirect.gathering.near_field_gather import with_near
from viewsphere.engines.raster.materials.kernels_material import L_BENDS
from viewsphere.engines.raster.materials.surface import Rows
from viewsphere.engines.raster.records import Bounces, Float32, Int32, PictureRays, Surfaces, Textures
from viewsphere.engines.raster.reflections.glass import NO_GLASS, Glass
from viewsphere.engines.raster.reflections.tracing import Tree
from viewsphere.engines.raster.shading import kernels_paint, kernels_split
from viewsphere.engines.raster.shadows.occlusion import Occlusion
from viewsphere.engines.raster.shadows.shadow_maps import Lights
from viewsphere.engines.raster.sky.environment import Surrounding, sky_behind
from viewsphere.geometry.camera import inverse_camera_matrix
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.sensors.rolling import RowPoses
from viewsphere.model.weather import Fog
from viewsphere.rendering.weather.fog import Air
from viewsphere.truth.raster.geometry import Geometry
from viewsphere.truth.raster.rolling import owners_of, ways_of_rows
from viewsphere.truth.raster.visibility import Visibility, lens_rays

_NO_RAYS = np.zeros((0, 3), np.float32)
_NO_PLACES = np.zeros((0, 2), np.float32)
_NARROWS = np.full((2, 3), -1, np.float32)
"""`PictureRays.lens` of panoramas, whose pixels narrow towards the poles."""
NO_SPLIT = np.zeros((0, 0), np.float32)


@dataclass(frozen=True, eq=False)
class Baked:
    """The data from which pictures are painted; lengths are in `unit`s, relative to `origin`.

    floor (13,): the ground's texture repeats per length, its texture coordinates at the origin, its material, 1 if the ground
    only scatters or 2 if it is a shadow catcher, its colour; the middle of all things, and one over half their size; its slabs
    in a repeat, 0 for none. kind (T + 1,) uint8: the kind of each triangle, see `kernels_paint`; owner (T,) int32: equal for
    neighbouring triangles that look alike; see_through (T + 1,). blended: `with_blended_colors`. bounce_scene: the surfaces
    that reflect the light of `bounces`, None if no light bounces; tree: that of the bounce scene's triangles; is_fine: whether
    rays from each sample find near surfaces, and the reflections in rough mirrors.
    """

    geometry: Geometry
    origin: NDArray[np.float64]
    unit: float
    surfaces: Surfaces
    rows: Rows
    textures: Textures
    floor: Float32
    surrounding: Surrounding
    lights: Lights
    occlusion: Occlusion
    bounces: Bounces
    kind: NDArray[np.uint8]
    owner: Int32
    see_through: NDArray[np.bool_]
    blended: Geometry
    glass: Glass
    bounce_scene: BounceScene | None
    tree: Tree | None
    is_fine: bool

    @property
    def catches(self) -> bool:
        """Return whether the ground is a shadow catcher."""
        return bool(self.floor[4] == 2)


def paint(
    baked: Baked,
    camera: Camera,
    visibility: Visibility,
    antialias: bool,
    has_sky: bool,
    radiance: Float32,
    split: Float32 = NO_SPLIT,
    fog: Fog | None = None,
    is_outdoors: bool = False,
    more: Callable[[Float32], None] | None = None,
) -> None:
    """Fill `radiance` (H * W, 4) float32: scene-linear, premultiplied; alpha is the covered share of the pixel.

    Everything is seen through `fog`; if the fog `is_outdoors` of a room, it covers only sky and ground. `more` adds mirrored
    light to the light of the pixels' centres.

    Edge pixels are the mean of four samples. Uncovered pixels show the sky if `has_sky`, otherwise 0. `split`, if it is not
    empty, is filled with the parts of this light, (H * W, 6 or 9) float32 as in `kernels_split`; it must be 0 before.
    """
    baked.rows.write_seen(camera, visibility, baked.geometry)
    triangle, depth = visibility.triangle.reshape(-1), visibility.inverse_depth.reshape(-1)
    air = None if fog is None else Air.for_camera(fog, camera, is_outdoors=is_outdoors)
    stack = shade_all(baked, camera, visibility, triangle, depth, radiance, split, air=air, more=more)
    if has_sky:
        _lay_sky(view_of(baked, camera), baked.surrounding, radiance, air)
    if not antialias:
        return
    behind = differs_behind(visibility, stack, baked.owner, baked.surfaces.normals, radiance)
    if len(baked.glass.corners) and stack:
        bent = _nearest_glass(baked, stack, len(triangle)) < len(stack)
        kernels_chosen.compare_bent(bent.reshape(visibility.triangle.shape), radiance, behind)
    samples = edge_samples(baked.geometry, camera, visibility, baked.owner, behind)
    if samples is not None:
        _smooth(baked, camera, visibility, samples, behind, has_sky, radiance, split, fog, is_outdoors)


def materials(baked: Baked, camera: Camera, visibility: Visibility) -> Float32:
    """Roughness and metallic at a camera's pixel centres, (H * W, 2) float32; 0 for no surface and for a shadow catcher."""
    baked.rows.write_seen(camera, visibility, baked.geometry)
    triangle, depth = visibility.triangle.reshape(-1), visibility.inverse_depth.reshape(-1)
    view, out = view_of(baked, camera, triangle=triangle), np.zeros((visibility.triangle.size, 2), np.float32)
    is_floor = baked.kind[triangle] == kernels_paint.FLOOR
    for is_ground, shown in ((False, (triangle >= 0) & ~is_floor), (True, is_floor)):
        slots = np.flatnonzero(shown).astype(np.int32)
        if len(slots) and not (is_ground and baked.catches):
            surfaces = baked.surfaces, baked.textures, baked.floor
            kernels_split.substance(view, *surfaces, is_ground, slots, triangle, depth, out)
    return out


def _smooth(
    baked: Baked,
    camera: Camera,
    visibility: Visibility,
    samples: Samples,
    behind: Marks,
    has_sky: bool,
    radiance: Float32,
    split: Float32,
    fog: Fog | None,
    is_outdoors: bool,
) -> None:
    """Set edge pixels to the mean of their samples. Samples are shaded only if they look like no neighbouring pixel's centre,
    or are in pixels marked in `behind`.
    """
    shown, centres = (samples.triangle, samples.inverse_depth), (visibility.triangle, visibility.inverse_depth)
    surfaces = baked.owner, baked.surfaces.normals
    like, rows = kernels_paint.shared_samples(samples.pixels, *shown, *centres, *surfaces, behind, radiance)
    count = 4 * len(rows)
    is_other, places, triangle, inverse = (
        np.empty(count, np.bool_),
        np.empty((count, 2), np.float32),
        np.empty(count, np.int32),
        np.empty(count, np.float32),
    )
    kernels_paint.own_samples(rows, like, samples.position, *shown, places, triangle, inverse, is_other)
    rays = samples.rays.reshape(-1, 4, 3)[rows].reshape(-1, 3) if len(samples.rays) else samples.rays
    own = Samples(samples.pixels[rows], places, rays, triangle, inverse)
    colors, parts = np.empty((count, 4), np.float32), np.zeros((count if len(split) else 0, split.shape[1]), np.float32)
    air = None if fog is None else Air.for_camera(fog, camera, _rays(camera, own), is_outdoors, own.position)
    shade_all(baked, camera, visibility, own.triangle, own.inverse_depth, colors, parts, own, air)
    if has_sky:
        colors[is_other, 3] = 1  # the sky need not be looked up for these
        _lay_sky(view_of(baked, camera, own), baked.surrounding, colors, air)
    if len(split):
        kernels_split.average_split(samples.pixels, like, colors, radiance, parts, split)
    glints, means = kernels_paint.average_samples(samples.pixels, like, colors, radiance)
    kernels_paint.brighten_lines(samples.pixels[glints], means, camera.width, radiance)


def shade_all(
    baked: Baked,
    camera: Camera,
    visibility: Visibility,
    triangle: Int32,
    depth: Float32,
    radiance: Float32,
    split: Float32,
    samples: Samples | None = None,
    air: Air | None = None,
    more: Callable[[Float32], None] | None = None,
) -> list[Layer]:
    """Fill `radiance` (S, 4) with the light of the samples, surfaces behind see-through ones first, and `split`, if it is not
    empty, with its parts. Each surface is seen through the air in front of it. Returns the layers.
    """
    solid, ground = np.empty((2, len(triangle)), np.int32)
    materials = baked.surfaces.material, np.zeros(len(baked.surfaces.looks) + 1, np.uint64)
    view = view_of(baked, camera, samples, triangle)
    solids, grounds = kernels_paint.sorted_samples(triangle, baked.kind, *materials, radiance, solid, ground)
    _shade_some(baked, view, solid[:solids], False, triangle, depth, radiance, split)
    _shade_some(baked, view, ground[:grounds], True, triangle, depth, radiance, split)
    if more is not None:
        more(radiance)
    # Layers are also listed if a solid surface is in front, because a decal may be on that surface.
    pixels = None if samples is None else samples.pixels
    stack = layers(baked.blended, camera, triangle, depth, baked.see_through, pixels, visibility.corners, visibility.active)
    reached = depth if air is None else depth.copy()  # 1/depth up to which air has attenuated light
    first, behind = _nearest_glass(baked, stack, len(triangle)), triangle
    for i, layer in enumerate(stack):
        if air is not None:
            if i > 0:
                on, near = _veiled(baked, air, layer.slot, behind[layer.slot], layer.inverse_depth)
                air.veil(radiance, air.depth(reached[on], on) - air.depth(near, on), on)
            reached[layer.slot] = layer.inverse_depth
        behind, behind_depth = triangle.copy(), depth.copy()
        behind[layer.slot], behind_depth[layer.slot] = layer.triangle, layer.inverse_depth
        view = view_of(baked, camera, samples, behind, layer.slot) if camera.rows is not None else view
        is_ground, is_bent = baked.kind[layer.triangle] == kernels_paint.FLOOR, first[layer.slot] == i
        for which in (False, True):
            slots = layer.slot[(is_ground == which) & ~is_bent]
            _shade_some(baked, view, slots, which, behind, behind_depth, radiance, split)
        _shade_some(baked, view, layer.slot[is_bent], False, behind, behind_depth, radiance, split, baked.glass)
    if air is not None:
        on, far = _veiled(baked, air, np.arange(len(triangle), dtype=np.int32), triangle, reached)
        air.veil(radiance, air.depth(far, on), on)
    return stack


def _veiled(baked: Baked, air: Air, slots: Int32, behind: Int32, inverse_depth: Float32) -> tuple[Int32, Float32]:
    """Return the samples, and their `inverse_depth` (n,), that show their background, triangles (n,), through the air."""
    if not air.is_outdoors:
        return slots, inverse_depth
    is_ground = baked.kind[behind] == kernels_paint.FLOOR
    return slots[is_ground], inverse_depth[is_ground]


def _nearest_glass(baked: Baked, stack: list[Layer], count: int) -> NDArray[np.uint8]:
    """The number of the layer in which each sample (S,) first sees solid glass; the number of layers if it sees none."""
    first = np.full(count, len(stack), np.uint8)
    if len(baked.glass.corners):
        bends = baked.surfaces.looks[:, L_BENDS] > 0
        for i, layer in enumerate(stack):
            first[layer.slot[bends[baked.surfaces.material[layer.triangle]]]] = i
    return first


def _lay_sky(view: PictureRays, surrounding: Surrounding, radiance: Float32, air: Air | None) -> None:
    """Composite radiance (S, 4) over the sky, seen through fog."""
    before = None if air is None else radiance.copy()
    sky_behind(view, surrounding, radiance)
    if air is not None and before is not None:
        radiance[:, :3] = before[:, :3] + air.behind(radiance[:, :3] - before[:, :3], before[:, 3])


def _rays(camera: Camera, samples: Samples) -> NDArray[np.floating]:
    """The rays (S, 3) of samples, in the camera's axes."""
    if camera.lens.is_parallel:
        return np.tile([0.0, 0.0, 1.0], (len(samples.position), 1))
    if len(samples.rays):
        return samples.rays
    at = np.column_stack([samples.position, np.ones(len(samples.position))])
    return at @ inverse_camera_matrix(camera.intrinsics).T


def _shade_some(
    baked: Baked,
    view: PictureRays,
    slots: Int32,
    is_ground: bool,
    triangle: Int32,
    depth: Float32,
    radiance: Float32,
    split: Float32,
    glass: Glass = NO_GLASS,
) -> None:
    if len(slots) == 0:
        return
    light, seen = (baked.surrounding, baked.lights, baked.occlusion), (slots, triangle, depth)
    if is_ground and baked.catches:
        kernels_paint.catch(view, baked.floor, *light, *seen, radiance)
        return
    bounces = baked.bounces
    if baked.is_fine and baked.bounce_scene is not None and baked.tree is not None and not is_ground:
        bounces = with_near(bounces, baked.bounce_scene, baked.tree, view, *seen)
    given = view, baked.surfaces, baked.textures, baked.floor, *light, bounces, is_ground, *seen, glass
    kernels_paint.shade(*given, radiance)
    if len(split):
        kernels_split.split(*given, split)


def view_of(
    baked: Baked,
    camera: Camera,
    samples: Samples | None = None,
    triangle: Int32 | None = None,
    slots: Int32 | None = None,
) -> PictureRays:
    """The rays of a camera's pixel centres, or of these samples.

    Under a rolling shutter they lead to the triangles (S,) that they meet, where these are at the instant, and are there only
    where they meet one, or at these slots (n,) alone.
    """
    rays, places, shifts = _NO_RAYS, _NO_PLACES, _NO_RAYS
    if camera.rows is not None:
        rays, shifts = _rays_of_rows(baked, camera, camera.rows, samples, triangle, slots)
    table = lens_rays(camera)
    if camera.lens.is_parallel:
        shifts = _shifts(baked, camera, samples)
        rays = np.tile(np.array([0, 0, 1], np.float32), (len(shifts), 1))
    if table is not None:
        rays = (table if samples is None else samples.rays).astype(np.float32).reshape(-1, 3)
    if samples is not None and table is None and camera.rows is None:
        places = samples.position
    return PictureRays(
        ((camera.center - baked.origin) / baked.unit).astype(np.float32),
        camera.R.astype(np.float32),
        inverse_camera_matrix(camera.intrinsics)[:2].astype(np.float32) if camera.lens.has_depth else _NARROWS,
        rays,
        np.uint32(camera.width),
        np.float32(1 / np.sqrt(camera.intrinsics.fx * camera.intrinsics.fy)),
        np.float32(1 / baked.unit),
        places,
        shifts,
        camera.lens.is_parallel,
    )


_NARROWING = np.full((2, 3), -1, np.float32)


@lru_cache(maxsize=4)
def _ways(geometry: Geometry, camera: Camera) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """`ways_of_rows` of all moving things, which all parts of a picture share."""
    assert camera.rows is not None
    there = [i for i in camera.rows.moving if i < len(geometry.poses)]
    return ways_of_rows(camera, camera.rows, {i: geometry.poses[i] for i in there})


@lru_cache(maxsize=2)
def _centers(width: int, height: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """The rows (n,) and the places (n, 2) of a picture's pixel centres."""
    row, column = np.divmod(np.arange(width * height), width)
    return row, np.stack([column, row], axis=1) + 0.5


def _rays_of_rows(
    baked: Baked,
    camera: Camera,
    rows: RowPoses,
    samples: Samples | None,
    triangle: Int32 | None,
    slots: Int32 | None,
) -> tuple[Float32, Float32]:
    """Rays (S, 3) in the camera's axes at the instant, and from the eye to where they begin, (S, 3) in the stage's axes.

    A thing that moves is moved back to where it is at the instant, together with the rays that meet it.
    """
    geometry, width = baked.geometry, camera.width
    there = [i for i in rows.moving if i < len(geometry.poses)]
    turns, shifts = _ways(geometry, camera)
    slot = np.zeros(len(geometry.poses) + 2, np.int64)
    slot[there] = np.arange(1, len(there) + 1)
    if samples is None:
        row, at = _centers(width, camera.height)
    else:
        row, at = np.repeat(samples.pixels // width, 4).astype(np.int64), samples.position.astype(np.float64)
    of_triangle = np.append(slot[owners_of(geometry)], 0)  # the last one is that of the sky
    which = np.zeros(len(at), np.int64) if triangle is None else of_triangle[triangle]
    if slots is None:
        slots = np.arange(len(at), dtype=np.int32) if triangle is None else np.flatnonzero(triangle >= 0).astype(np.int32)
    out, begin = np.zeros((2, len(at), 3), np.float32)
    kernels_paint.aim_rows(slots, at, row, which, turns, (shifts / baked.unit), out, begin)
    return out, begin


def _shifts(baked: Baked, camera: Camera, samples: Samples | None) -> Float32:
    """From the eye to where the parallel rays of pixel centres, or of these samples, begin, (S, 3) in the stage's axes."""

    def begin(xy: NDArray[np.floating]) -> Float32:
        return (camera.lens.rays(xy).origins @ camera.R / baked.unit).astype(np.float32)

    if samples is not None:
        return begin(samples.position)
    # The places are linear in the picture, so those of its first row and first column give all.
    x, y = np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5
    row, column = begin(np.column_stack([x, np.full_like(x, 0.5)])), begin(np.column_stack([np.full_like(y, 0.5), y]))
    return (row + (column - column[:1])[:, None]).reshape(-1, 3).astype(np.float32, copy=False)
