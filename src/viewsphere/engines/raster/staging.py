"""The raster engine's stage: everything baked, ready to be seen from any camera."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import Mesh
from viewsphere.assets.srgb import linear
from viewsphere.engines._arranged import Arranged, Arrangements
from viewsphere.engines.raster import kernels_paint
from viewsphere.engines.raster.environment import bake_surrounding, lamps_on_ground, sky_lights
from viewsphere.engines.raster.kernels_material import L_BLENDED, L_METAL, L_METAL_TEXEL, L_TRANSMISSION
from viewsphere.engines.raster.lights import Casters, Extent, bake_lights
from viewsphere.engines.raster.occlusion import bake_occlusion, with_ground_light
from viewsphere.engines.raster.options import Options, parse_options
from viewsphere.engines.raster.painting import Baked, paint
from viewsphere.engines.raster.records import Float32
from viewsphere.engines.raster.surface import pack_surfaces
from viewsphere.imaging.background import display_background
from viewsphere.imaging.finish import finished
from viewsphere.imaging.seen import seen_by
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Ground, Scene
from viewsphere.model.shot import Shot
from viewsphere.surroundings.ground import ground_albedo, ground_frame, ground_material, only_scatters
from viewsphere.surroundings.sky import even_light
from viewsphere.truth.geometry import Geometry, with_blended_colors
from viewsphere.truth.visibility import Visibility


@dataclass(frozen=True, eq=False)
class RasterStage:
    """A shot's scene baked for shading, as it was at the last instant that was asked for."""

    arrangements: Arrangements
    options: Options
    _baked: dict[Geometry, Baked] = field(default_factory=dict[Geometry, Baked])
    _canvases: dict[int, Float32] = field(default_factory=dict[int, Float32])

    @property
    def shot(self) -> Shot:
        """What is painted."""
        return self.arrangements.shot

    def of(self, shot: Shot) -> RasterStage:
        """The same for another shot, one of an equal `stage_key`."""
        return replace(self, arrangements=self.arrangements.of(shot))

    def at(self, instant: int) -> Geometry:
        """The world-space triangles at an instant, counted from 0 in the shot."""
        return self.arrangements.at(instant).geometry

    def baked(self, instant: int) -> Baked:
        """What pictures of an instant are painted from; the last one is kept."""
        arranged = self.arrangements.at(instant)
        if arranged.geometry not in self._baked:
            self._baked.clear()
            self._baked[arranged.geometry] = _baked(arranged, self.shot.scene, self.options)
        return self._baked[arranged.geometry]

    def color(self, instant: int, sensor: int, visibility: Visibility, transparent: bool) -> NDArray[np.uint8]:
        """The picture of a sensor at an instant, (H, W, 3) uint8 sRGB; with `transparent` (H, W, 4) with straight alpha.

        `visibility` is truth's buffer of this instant and camera. Raises UserError for an unreadable background image.
        """
        camera, finish, baked = self.shot.camera(instant, sensor), self.shot.finish(instant), self.baked(instant)
        finish = finish.with_background(transparent)
        background = display_background(finish.background, camera.width, camera.height)
        has_sky = background is None and not transparent
        radiance = self._canvas(camera.width * camera.height)
        paint(baked, camera, visibility, self.options.antialias == 4, has_sky, radiance)
        shape, focus = (camera.height, camera.width, 4), np.array(self.shot.instants[instant].focus)
        owner = baked.geometry.triangle_object
        seen = partial(seen_by, camera, focus, visibility.inverse_depth, visibility.triangle, owner)
        return finished(radiance.reshape(shape), background, finish, seen)

    def _canvas(self, pixels: int) -> Float32:
        """Room for the light of a picture, the same one every time: fresh memory costs as much as the sky."""
        if pixels not in self._canvases:
            self._canvases.clear()
            self._canvases[pixels] = np.empty((pixels, 4), np.float32)
        return self._canvases[pixels]


def build_stage(shot: Shot, load: Callable[[ModelSpec], Mesh]) -> RasterStage:
    """The stage of a shot, with all models loaded."""
    options = parse_options(shot.engine_options)
    lenses = [sensor.intrinsics for sensor in shot.rig.sensors]
    size = options.for_width(max(max(lens.width, lens.height) for lens in lenses))
    return RasterStage(Arrangements.build(shot, load), replace(options, shadow_resolution=size))


def _baked(arranged: Arranged, scene: Scene, options: Options) -> Baked:
    """What pictures of these things, as they stand, are painted from.

    Lengths are in units of all there is; where there is scenery, from the world's origin, so that they stay the same when the
    targets change.
    """
    things, meshes, geometry = arranged.things, arranged.meshes, arranged.geometry
    targets = sum(not thing.scenery for thing in things)
    scenery = tuple(things[targets:])
    low, high = geometry.extent()
    origin, unit = (low + high) / 2, float(np.linalg.norm(high - low)) / 2 or 1.0
    ground_z = geometry.ground_z
    if scenery:
        origin, unit = np.zeros(3), 2.0 ** math.ceil(math.log2(unit))
    surfaces, textures = pack_surfaces(geometry, meshes, scene.ground, origin, unit, targets, things)
    reach = float(np.abs(np.stack([low, high]) - origin).max()) / unit
    if scenery:
        low, high = geometry.extent(targets)
        ground_z = float(low[2])
    floor_z = None if ground_z is None else (ground_z - float(origin[2])) / unit
    has_ground = scene.ground is not None
    extent = Extent((low - origin) / unit, (high - origin) / unit, floor_z, geometry.triangle_start[targets], reach)
    casters = Casters(
        surfaces,
        textures,
        extent,
        (scenery, tuple(meshes[targets:]), unit) if scenery else None,
        (tuple(things[:targets]), tuple(meshes[:targets]), has_ground, unit),
    )
    distant = sky_lights(scene.sky, scene.sun, has_ground)
    lights = bake_lights(distant, scene.lights, casters, unit, has_ground, options.shadow_resolution)
    floor, albedo = _floor(scene.ground, origin, unit, len(surfaces.looks) - 1)
    lamps = lamps_on_ground(lights, extent)
    surrounding = bake_surrounding(scene.sky, scene.sun, albedo, distant, even_light(scene.lights), lamps)
    occlusion = bake_occlusion(casters, has_ground, options.ambient_occlusion)
    see_through = np.append(_is_see_through(surfaces.looks)[surfaces.material], False)
    kind = np.where(see_through[:-1], kernels_paint.SEE_THROUGH, kernels_paint.SOLID).astype(np.uint8)
    kind[geometry.triangle_start[-1] :] = kernels_paint.FLOOR
    return Baked(
        geometry=geometry,
        origin=origin,
        unit=unit,
        surfaces=surfaces,
        textures=textures,
        floor=floor,
        surrounding=surrounding,
        lights=lights,
        occlusion=with_ground_light(occlusion, lights, math.pi * float(surrounding.up.sum())),
        kind=np.append(kind, np.uint8(kernels_paint.NOTHING)),
        owner=(geometry.triangle_object * len(surfaces.looks) + surfaces.material).astype(np.int32),
        see_through=see_through,
        blended=with_blended_colors(geometry, meshes),
    )


def _is_see_through(looks: Float32) -> NDArray[np.bool_]:
    """Of each material: whether anything behind it shows."""
    metal = looks[:, L_METAL] + looks[:, L_METAL_TEXEL]
    return (looks[:, L_BLENDED] > 0) | (looks[:, L_TRANSMISSION] * (1 - metal) > 0)


def _floor(
    ground: Ground | None, origin: NDArray[np.float64], unit: float, material: int
) -> tuple[Float32, NDArray[np.float64] | None]:
    """`Baked.floor`, and the ground's mean colour; zeros and None where there is none."""
    if ground is None:
        return np.zeros(8, np.float32), None
    made, images = ground_material(ground)
    how = 2.0 if ground.catcher else float(only_scatters(ground))
    color = linear(ground.color).tolist()
    frame = ground_frame(ground, made, origin, unit)
    return np.array([*frame, material, how, *color], np.float32), ground_albedo(made, images)
