"""The raster engine's stage: all data is baked and ready for any camera."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.animation.deforming import Load
from viewsphere.engines.raster.baking import Packed, bake, pack, sequence_lengths, still_lengths
from viewsphere.engines.raster.blurring import Blur
from viewsphere.engines.raster.indirect.bounce_scene import BounceScenes
from viewsphere.engines.raster.materials.surface import Lengths
from viewsphere.engines.raster.options import Options, parse_options
from viewsphere.engines.raster.records import Float32
from viewsphere.engines.raster.reflections.glossy_reflections import NOWHERE, mirror_in_polish
from viewsphere.engines.raster.reflections.planar_reflections import mirror_in_panes
from viewsphere.engines.raster.reflections.wet_ground import mirror_in_water
from viewsphere.engines.raster.shading.painting import NO_SPLIT, Baked, materials, paint
from viewsphere.engines.raster.shadows.thing_occlusion import TargetShades
from viewsphere.engines.shared.arranged import Arranged, Arrangements
from viewsphere.engines.shared.metering import Meter
from viewsphere.engines.shared.passes import shading_of
from viewsphere.errors import RecipeError
from viewsphere.model.channel import LIGHT_PASSES, MATERIAL_PASSES, lacks_background, painted_together
from viewsphere.model.listed import LARGEST_PICTURE
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.shot import Shot
from viewsphere.model.weather import Wet
from viewsphere.rendering.background import display_background, shows_sky
from viewsphere.rendering.finish import pictures
from viewsphere.rendering.seen import seen_by
from viewsphere.rendering.weather.falling import fall_in
from viewsphere.truth.raster.geometry import Geometry
from viewsphere.truth.raster.visibility import Visibility, rasterize

Paint = Callable[[Camera, Visibility, Float32, Float32], None]
"""A function that fills the light (H * W, 4) seen by a camera, and its parts (H * W, C), which are 0 before, or (0, 0)."""


@dataclass(frozen=True, eq=False)
class RasterStage:
    """A shot's scene baked for shading, for the most recently requested instant."""

    arrangements: Arrangements
    options: Options
    _packed: list[Packed] = field(default_factory=list[Packed])
    _baked: dict[tuple[Geometry, bool], Baked] = field(default_factory=dict[tuple[Geometry, bool], Baked])
    _shades: TargetShades = field(default_factory=TargetShades)
    _halls: BounceScenes = field(default_factory=BounceScenes)
    _canvases: dict[int, Float32] = field(default_factory=dict[int, Float32])

    @property
    def shot(self) -> Shot:
        """The shot that the stage paints."""
        return self.arrangements.shot

    def for_shot(self, shot: Shot) -> RasterStage:
        """The stage for another shot with an equal `stage_key`."""
        return replace(self, arrangements=self.arrangements.for_shot(shot))

    def at(self, instant: int) -> Geometry:
        """The world-space triangles at an instant, counted from 0 in the shot."""
        return self.arrangements.at(instant).geometry

    def baked(self, instant: int) -> Baked:
        """Return the data from which pictures of an instant are painted; the stage caches the latest one."""
        arranged = self.arrangements.at(instant)
        key = arranged.geometry, arranged.is_sequence
        if key not in self._baked:
            self._baked.clear()
            self._baked[key] = bake(self._pack(arranged), self.shot.scene, self.options, self._shades, self._halls)
        return self._baked[key]

    def _pack(self, arranged: Arranged) -> Packed:
        """Return the packed materials and surfaces of arranged things, which replace those of the last instant."""
        ground, lengths = self.shot.scene.ground, self._lengths if arranged.is_sequence else still_lengths(arranged)
        self._packed[:] = [
            self._packed[0].after_moving(arranged, ground, lengths) if self._packed else pack(arranged, ground, lengths)
        ]
        return self._packed[0]

    @cached_property
    def _lengths(self) -> Lengths:
        return sequence_lengths(self.arrangements.meshes)

    def paint(self, instant: int, sensor: int, visibility: Visibility, names: Collection[str]) -> dict[str, NDArray[Any]]:
        """The named passes of a sensor at an instant, see `engines.Stage`; `visibility` is truth's buffer of this instant and
        camera. Raises UserError for an unreadable background image.
        """
        painted: dict[str, NDArray[Any]] = {}
        if not set(names).isdisjoint(LIGHT_PASSES):
            painted |= self._light(instant, sensor, visibility, names)
            together = painted_together(names)
            if (
                together
                and not self.shot.scene.weather
                and Blur(self.arrangements, instant, sensor).count(self.at(instant), visibility) == 1
            ):
                painted |= self._finished(instant, sensor, visibility, together[0])  # from the light that was split
        if not set(names).isdisjoint(MATERIAL_PASSES):
            made = materials(self.baked(instant), self.shot.camera(instant, sensor), visibility)
            painted |= dict(zip(MATERIAL_PASSES, made.T.reshape(2, *visibility.triangle.shape).copy(), strict=True))
        for wanted in painted_together(names):
            if wanted[0] not in painted:
                painted |= self._pictures(instant, sensor, visibility, wanted)
        return {name: painted[name] for name in names}

    def _light(self, instant: int, sensor: int, visibility: Visibility, names: Collection[str]) -> dict[str, Float32]:
        """Return all `LIGHT_PASSES`, with the sky if the picture has it; (H, W, 3) each."""
        camera, is_lit = self.shot.camera(instant, sensor), "shading" in names or "residual" in names
        finish = self.shot.finish(instant, sensor).with_background(lacks_background(names))
        has_sky = shows_sky(finish.background)
        radiance = self._canvas(camera.width * camera.height)
        split = np.zeros((len(radiance), 9 if is_lit else 6), np.float32)
        baked, wet = self.baked(instant), self.shot.scene.wet

        def paint_all(camera: Camera, seen: Visibility, light: Float32, parts: Float32) -> None:
            more = None if wet else partial(_mirror, baked, camera, seen, None)
            paint(baked, camera, seen, self.options.antialias > 1, has_sky, light, parts, more=more)

        _paint_finely(paint_all, self.options.times, baked.geometry, camera, visibility, radiance, split)
        shape = camera.height, camera.width, 3
        albedo, emission = (split[:, k : k + 3].reshape(shape) for k in (0, 3))
        if not is_lit:
            return {"albedo": albedo, "emission": emission}
        shading = shading_of(albedo, split[:, 6:].reshape(shape))
        residual = np.maximum(radiance[:, :3].reshape(shape) - albedo * shading, np.float32(0))
        return {"albedo": albedo, "shading": shading, "residual": residual, "emission": emission}

    def _pictures(self, instant: int, sensor: int, visibility: Visibility, names: Sequence[str]) -> dict[str, NDArray[Any]]:
        """Pictures of one light: `rgba`, or any of the others."""
        camera, background = (
            self.shot.camera(instant, sensor),
            self.shot.finish(instant, sensor).with_background("rgba" in names).background,
        )
        radiance = self._canvas(camera.width * camera.height)
        self._paint(instant, sensor, camera, visibility, shows_sky(background), radiance)
        picture, seconds = radiance.reshape(camera.height, camera.width, 4), self.shot.instants[instant].seconds
        fall_in(self.shot.scene, picture, camera, seconds, visibility.inverse_depth)
        return self._finished(instant, sensor, visibility, names)

    def _finished(self, instant: int, sensor: int, visibility: Visibility, names: Sequence[str]) -> dict[str, NDArray[Any]]:
        """Pictures made from the light that was painted last: `rgba`, or any of the others."""
        camera = self.shot.camera(instant, sensor)
        finish = self.shot.finish(instant, sensor).with_background("rgba" in names)
        background = display_background(finish.background, camera.width, camera.height)
        radiance = self._canvas(camera.width * camera.height)
        shape, focus = (camera.height, camera.width, 4), np.array(self.shot.instants[instant].focus)
        owner = self.at(instant).triangle_object
        seen = partial(seen_by, camera, focus, visibility.inverse_depth, visibility.triangle, owner)
        metered = None
        if self._meter.follows(instant, sensor):
            metered = partial(self._meter.reading, instant, sensor, partial(self._glance, shows_sky(finish.background)))
        return pictures(names, radiance.reshape(shape), background, finish, seen, metered)

    def _glance(self, has_sky: bool, instant: int, camera: Camera) -> Float32:
        """The light (H, W, 4) that a camera sees at an instant, without motion blur and weather that falls."""
        self._baked.clear()  # packed data is overwritten
        arranged = self.arrangements.aside(instant)
        baked = bake(self._pack(arranged), self.shot.scene, self.options, self._shades, self._halls)
        light = np.empty((camera.height * camera.width, 4), np.float32)
        self._paint_one(baked, camera, rasterize(arranged.geometry, camera), has_sky, light)
        return light.reshape(camera.height, camera.width, 4)

    @cached_property
    def _meter(self) -> Meter:
        return Meter(self.shot)

    def _paint(
        self, instant: int, sensor: int, camera: Camera, visibility: Visibility, has_sky: bool, radiance: Float32
    ) -> None:
        """Fill `radiance` with the light of a picture, blurred if anything moves during the exposure."""
        blur = Blur(self.arrangements, instant, sensor)

        def paint_moment(arranged: Arranged, camera: Camera, seen: Visibility, light: Float32) -> None:
            baked = bake(self._pack(arranged), self.shot.scene, self.options, self._shades, self._halls)
            self._paint_one(baked, camera, seen, has_sky, light)

        count = blur.count(self.at(instant), visibility)
        if count > 1:
            self._baked.clear()  # packed data is overwritten
            blur.paint(count, paint_moment, radiance)
        else:
            self._paint_one(self.baked(instant), camera, visibility, has_sky, radiance)

    def _paint_one(self, baked: Baked, camera: Camera, seen: Visibility, has_sky: bool, radiance: Float32) -> None:
        scene = self.shot.scene
        fog, is_outdoors = scene.fog or scene.fog_outdoors, scene.fog is None

        def paint_all(camera: Camera, seen: Visibility, light: Float32, parts: Float32) -> None:
            more = partial(_mirror, baked, camera, seen, scene.wet)
            edges = self.options.antialias > 1
            paint(baked, camera, seen, edges, has_sky, light, parts, fog=fog, is_outdoors=is_outdoors, more=more)

        _paint_finely(paint_all, self.options.times, baked.geometry, camera, seen, radiance, NO_SPLIT)

    def _canvas(self, pixels: int) -> Float32:
        """The array for the light of a picture, reused each time, because fresh memory costs as much as the sky."""
        if pixels not in self._canvases:
            self._canvases.clear()
            self._canvases[pixels] = np.empty((pixels, 4), np.float32)
        return self._canvases[pixels]


def _mirror(baked: Baked, camera: Camera, seen: Visibility, wet: Wet | None, light: Float32) -> None:
    """Add reflections of nearby things in smooth surfaces, and those in wet ground, to the light of a picture (H * W, 4)."""
    polished = mirror_in_polish(baked, camera, seen, light) if wet is None else NOWHERE
    mirror_in_panes(baked, camera, seen, polished, light)
    if wet is not None:
        mirror_in_water(baked, camera, seen, wet, light)


def build_stage(shot: Shot, load: Load) -> RasterStage:
    """The stage of a shot, with all models loaded. Raises RecipeError for unsupported options."""
    options = parse_options(shot.engine_options)
    lenses = [sensor.intrinsics for sensor in shot.rig.sensors if sensor.lidar is None]
    longest = options.times * max((max(lens.width, lens.height) for lens in lenses), default=1)
    if longest > LARGEST_PICTURE:
        most = LARGEST_PICTURE // options.times
        found = f"at most {most:,} pixels a side, found {longest // options.times:,}"
        raise RecipeError(f"engine.antialias: {options.antialias} samples in a pixel want {found}")
    size = options.for_width(longest)
    return RasterStage(Arrangements.build(shot, load), replace(options, shadow_resolution=size))


def _paint_finely(
    paint: Paint, times: int, geometry: Geometry, camera: Camera, visibility: Visibility, radiance: Float32, split: Float32
) -> None:
    """Fill `radiance` (H * W, 4) and `split` (H * W, C) with means of the results of `paint` at `times` the resolution;
    `visibility` is truth's buffer for this camera.
    """
    if times == 1:
        paint(camera, visibility, radiance, split)
        return
    large = larger(camera, times)
    light, parts = (np.zeros((len(values) * times * times, values.shape[1]), np.float32) for values in (radiance, split))
    paint(large, rasterize(geometry, large), light, parts)
    for fine, coarse in ((light, radiance), (parts, split)):
        if len(coarse):
            _average(fine.reshape(camera.height, times, camera.width, times, -1), coarse)


def larger(camera: Camera, times: int) -> Camera:
    """The camera with the same picture at `times` the resolution in each direction."""
    lens = camera.intrinsics
    scaled = {name: times * getattr(lens, name) for name in ("width", "height", "fx", "fy", "cx", "cy", "skew")}
    return Camera(lens.model_copy(update=scaled), camera.R, camera.t, camera.rows and camera.rows.repeated(times))


def _average(fine: Float32, coarse: Float32) -> None:
    """Fill coarse (H * W, C) with means of fine (H, times, W, times, C)."""
    total = coarse.reshape(fine.shape[0], fine.shape[2], -1)
    total[:] = 0
    for down in range(fine.shape[1]):
        for across in range(fine.shape[3]):
            total += fine[:, down, :, across]
    total /= np.float32(fine.shape[1] * fine.shape[3])
