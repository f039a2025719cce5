"""The stage of Blender's renderers: truth's geometry in this process, and the same triangles in a Blender that paints."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.animation.deforming import Load
from viewsphere.assets.mesh import Mesh
from viewsphere.blender.interpreter import GRAPHICS, find_blender
from viewsphere.blender.process import BlenderProcess
from viewsphere.codecs.npz import load_array
from viewsphere.engines.shared.arranged import Arrangements
from viewsphere.engines.shared.blender.backdrop import Backdrop, lay_sky, veil
from viewsphere.engines.shared.blender.border import border_of
from viewsphere.engines.shared.blender.file_frame import FileFrame
from viewsphere.engines.shared.blender.lens import Sweeping, is_rendered, resampled, views_of
from viewsphere.engines.shared.blender.options import AnyOptions, options_of
from viewsphere.engines.shared.blender.requests import Request, kinds_of, materials_request, members_of, scene_request, staged
from viewsphere.engines.shared.blender.scripts import script_request
from viewsphere.engines.shared.blender.texels import Kind, Levels
from viewsphere.engines.shared.metering import Meter
from viewsphere.engines.shared.passes import shading_of
from viewsphere.errors import BlenderDied, BlenderError, ModelError, RecipeError, UserError
from viewsphere.geometry.lenses import BlenderLens
from viewsphere.model.channel import LIGHT_PASSES, MATERIAL_PASSES, lacks_background, painted_together
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Thing
from viewsphere.rendering.background import display_background, shows_sky
from viewsphere.rendering.finish import pictures
from viewsphere.rendering.seen import seen_by
from viewsphere.rendering.weather.falling import fall_in
from viewsphere.truth.raster.geometry import Geometry
from viewsphere.truth.raster.visibility import Visibility, rasterize

_SHARP = {"pixel_filter_type": "GAUSSIAN", "filter_width": 0.01}
"""Settings of Cycles that make it sample only the middles of pixels."""

STAGE_SECONDS = 600.0
"""Seconds after which a Blender that has not built its scene counts as hung."""

FRAME_SECONDS = 3600.0
"""Seconds for one picture; a Blender that hangs is killed after this time."""

FIRST_SECONDS = 900.0
"""Seconds after which a renderer that has not drawn its first, tiny picture counts as hung. It compiles its shaders first,
which takes from seconds to minutes without a graphics card.
"""

NEAREST, FARTHEST = 1e-3, 1e7
"""Clipping range of cameras that trace rays (Cycles), metres."""

SPARE = 4.0
"""Factor by which the clipping range of cameras that draw exceeds the visible depths at pixel centres, at both ends."""

COMPONENTS = {"picture": 4, "light": 12, "objects": 3, "materials": 2}
"""Results of a render, with their values per pixel: radiance and alpha; albedo, diffuse light, all other light and emission;
the albedo, from a render without the ground; roughness and metallic, from a render of the pixels' centres.
"""

Float32 = NDArray[np.float32]

Clip = tuple[float, float]
"""Clipping range of a camera: minimum and maximum depth, in metres."""

AllLevels = tuple[Levels, ...]
"""Halvings of the textures of each kind of model."""

Answer = TypeVar("Answer")

Bounds = tuple[Path, ...] | None
"""The folders that Blender may read if it opens a user's .blend file; None (no restriction) if it opens none."""


@dataclass(eq=False)
class Keeper:
    """Keeps this process's only Blender, which holds one shot's scene at a time and is replaced after some number of shots."""

    python: Path
    process: BlenderProcess | None = None
    _drawing: set[str] = field(default_factory=set[str])
    _started_for: tuple[Bounds, int] | None = None
    _stage: Arrangement | None = None
    _levels: AllLevels | None = None
    _served: int = 0

    def process_for(self, stage: Arrangement, levels: AllLevels | None = None) -> BlenderProcess:
        """A Blender that holds this stage's scene, with textures halved by `levels`; None leaves the textures unchanged."""
        if self.process is not None and self._stage is stage:
            if levels is not None and levels != self._levels:
                self._stage = None
                stage.paint(self.process, levels, self._levels)
                self._stage, self._levels = stage, levels
            return self.process
        worn = stage.options.replace_after and self._served >= stage.options.replace_after
        wanted = stage.bounds, stage.options.threads
        if worn or self._started_for != wanted:
            self.drop()
        if self.process is None:
            self.process, self._started_for = _started(self.python, *wanted), wanted
        if stage.options.uses_opengl and stage.options.renderer not in self._drawing:
            self._try_drawing(self.process, stage.options)
        self._stage, self._served = None, self._served + 1
        stage.tell(self.process, levels)
        self._stage, self._levels = stage, levels
        return self.process

    def _try_drawing(self, process: BlenderProcess, options: AnyOptions) -> None:
        """Test, once per renderer, that it can draw on this machine: without working OpenGL, Blender crashes."""
        self._stage = None
        try:
            process.ask("draw", FIRST_SECONDS, renderer=options.renderer)
        except (BlenderError, BlenderDied) as error:
            self.drop()
            raise UserError(
                f"engine: {options.title} cannot draw on this machine ({error.how}): {GRAPHICS}, or use cycles"
            ) from None
        self._drawing.add(options.renderer)

    def insist(self, ask: Callable[[], Answer], named: str) -> Answer:
        """The answer of `ask`; if Blender dies meanwhile, it is restarted once. Raises ModelError, which mentions `named`, if
        Blender dies again.
        """
        died: BlenderDied | None = None
        for _ in range(2):
            try:
                return ask()
            except BlenderDied as error:
                self.drop()
                died = error
        raise ModelError(f"{named}: {died}")

    def forget(self) -> None:
        """Mark the scene in Blender as outdated, so that Blender builds it again for the next picture."""
        self._stage = None

    def drop(self) -> None:
        """End Blender; the next picture starts a new one."""
        if self.process is not None:
            self.process.close()
        self.process, self._stage, self._served = None, None, 0


def _started(python: Path, bounds: Bounds, threads: int) -> BlenderProcess:
    process = BlenderProcess(python, readable=bounds, threads=threads)
    try:
        process.ask("hello")
    except BlenderError as error:
        process.close()
        raise UserError(f"engine.python: {python}: its Blender does not start: {error}; ask `viewsphere doctor`") from None
    return process


@cache
def keeper_of(python: Path) -> Keeper:
    """The keeper of this process's Blender for a Python interpreter; every call returns the same object."""
    return Keeper(python)


@dataclass(frozen=True, eq=False)
class CyclesStage:
    """A shot's stage, painted by one of Blender's renderers."""

    arrangements: Arrangements
    options: AnyOptions
    keeper: Keeper
    _arranged: dict[Geometry, Arrangement] = field(default_factory=dict[Geometry, "Arrangement"])

    @property
    def shot(self) -> Shot:
        """The shot that this stage paints."""
        return self.arrangements.shot

    def for_shot(self, shot: Shot) -> CyclesStage:
        """A stage for another shot with an equal `stage_key`, which shares the loaded meshes."""
        return replace(self, arrangements=self.arrangements.for_shot(shot))

    def at(self, instant: int) -> Geometry:
        """The world-space triangles at an instant, counted from 0 in the shot."""
        return self.arrangements.at(instant).geometry

    def arrangement(self, instant: int) -> Arrangement:
        """The arrangement of all things at an instant; the stage caches the latest one."""
        now = self.arrangements.at(instant)
        if now.geometry not in self._arranged:
            self._arranged.clear()
            self._arranged[now.geometry] = Arrangement(
                self.shot, now.things, now.meshes, now.geometry, self.options, self.keeper
            )
        return self._arranged[now.geometry]

    def paint(self, instant: int, sensor: int, visibility: Visibility, names: Collection[str]) -> dict[str, NDArray[Any]]:
        """The named passes of a sensor at an instant, see `engines.Stage`.

        The light of a sharp picture is split during its rendering; for a blurred one, it is rendered again. A Blender that dies
        or hangs is restarted once. Raises ModelError if it dies again, UserError for an unreadable background image.
        """
        sweeping, painted = self._sweeping(instant, sensor), dict[str, NDArray[Any]]()
        is_lit = not set(names).isdisjoint(LIGHT_PASSES)
        for group in painted_together(names):
            wanted = ("light",) if is_lit and "light" not in painted and sweeping.is_still else ()
            painted |= self._pictures(instant, sensor, visibility, group, wanted)
        if is_lit:
            if "light" not in painted:
                background = self.shot.finish(instant, sensor).with_background(lacks_background(names)).background
                camera, is_open = self.shot.camera(instant, sensor), not shows_sky(background)
                painted |= self.arrangement(instant).rendered(camera, is_open, wanted=("light",))
            painted |= self._light(instant, sensor, visibility, painted["light"])
        if not set(names).isdisjoint(MATERIAL_PASSES):
            painted |= self._materials(instant, sensor, visibility)
        return {name: painted[name] for name in names}

    def _pictures(
        self, instant: int, sensor: int, visibility: Visibility, names: Sequence[str], wanted: Sequence[str]
    ) -> dict[str, NDArray[Any]]:
        """Pictures of one light, `rgba` or any of the others, and the other wanted results of its render (see `COMPONENTS`)."""
        camera, arranged = self.shot.camera(instant, sensor), self.arrangement(instant)
        finish = self.shot.finish(instant, sensor).with_background("rgba" in names)
        background = display_background(finish.background, camera.width, camera.height)
        is_open = not shows_sky(finish.background)
        fog = self.shot.scene.fog or self.shot.scene.fog_outdoors
        is_open = is_open or fog is not None  # whose sky is laid behind things that it has veiled
        rendered = arranged.painted(camera, is_open, visibility, self._sweeping(instant, sensor), wanted)
        if fog is not None:
            veil(rendered["picture"], fog, camera, arranged.geometry, is_outdoors=self.shot.scene.fog is None)
            if shows_sky(finish.background):
                lay_sky(rendered["picture"], fog, camera, arranged.sky)
        seconds = self.shot.instants[instant].seconds
        fall_in(self.shot.scene, rendered["picture"], camera, seconds, visibility.inverse_depth)
        focus, owner = np.array(self.shot.instants[instant].focus), arranged.geometry.triangle_object
        seen = partial(seen_by, camera, focus, visibility.inverse_depth, visibility.triangle, owner)
        metered = None
        if self._meter.follows(instant, sensor):
            metered = partial(self._meter.reading, instant, sensor, partial(self._glance, is_open))
        return rendered | pictures(names, rendered["picture"], background, finish, seen, metered)

    def _glance(self, is_open: bool, instant: int, camera: Camera) -> Float32:
        """The light (H, W, 4) that a camera sees at an instant, without motion blur, fog and weather that falls."""
        now = self.arrangements.aside(instant)
        arranged = Arrangement(self.shot, now.things, now.meshes, now.geometry, self.options, self.keeper)
        still = self.shot.model_copy(update={"shutter": 0.0, "exposures": ()})
        sharp = Sweeping(still, instant, 0, not self.options.uses_opengl)
        return arranged.painted(camera, is_open, rasterize(now.geometry, camera), sharp)["picture"]

    @cached_property
    def _meter(self) -> Meter:
        return Meter(self.shot)

    def _sweeping(self, instant: int, sensor: int) -> Sweeping:
        return Sweeping(self.shot, instant, sensor, not self.options.uses_opengl)

    def _light(self, instant: int, sensor: int, visibility: Visibility, light: Float32) -> dict[str, Float32]:
        """Return all `LIGHT_PASSES` of the rendered light, without shadow catchers, which Cycles counts in the albedo."""
        albedo, diffuse, residual, emission = np.split(light, 4, axis=-1)
        ground = self.shot.scene.ground
        if ground is not None:
            # Faded ground sends the light of the sky.
            is_far = (visibility.triangle < 0) | (visibility.triangle >= self.at(instant).triangle_start[-1])
            emission = np.where(is_far[..., None], np.float32(0), emission)
        if ground is not None and ground.catcher:
            camera = self.shot.camera(instant, sensor)
            albedo = self.arrangement(instant).rendered(camera, True, wanted=("objects",))["objects"]
        return {"albedo": albedo, "shading": shading_of(albedo, diffuse), "residual": residual, "emission": emission}

    def _materials(self, instant: int, sensor: int, visibility: Visibility) -> dict[str, Float32]:
        """Roughness and metallic at the pixels' centres."""
        made = self.arrangement(instant).rendered(self.shot.camera(instant, sensor), True, wanted=("materials",))["materials"]
        ground = self.shot.scene.ground
        if ground is not None and ground.catcher:
            made = np.where((visibility.triangle >= self.at(instant).triangle_start[-1])[..., None], np.float32(0), made)
        return {name: np.ascontiguousarray(made[..., i]) for i, name in enumerate(MATERIAL_PASSES)}


@dataclass(frozen=True, eq=False)
class Arrangement:
    """A shot's things at an instant, as a scene that Blender builds and keeps."""

    shot: Shot
    things: Sequence[Thing]
    meshes: Sequence[Mesh]
    geometry: Geometry
    options: AnyOptions
    keeper: Keeper

    @property
    def bounds(self) -> Bounds:
        """The folders that Blender may read to build this scene."""
        blend = self.shot.scene.blend
        if blend is None:
            return None
        return (Path(blend.file).resolve().parent,) if blend.confined else (Path("/"),)

    def painted(
        self, camera: Camera, is_open: bool, visibility: Visibility, sweeping: Sweeping, wanted: Sequence[str] = ()
    ) -> dict[str, Float32]:
        """A `picture`, scene-linear, premultiplied, (H, W, 4) float32, and its other wanted results (see `COMPONENTS`); with
        `is_open`, the background stays empty.
        """
        if self.options.uses_opengl:
            return {"picture": self._drawn(camera, is_open, visibility, sweeping)}
        return self.rendered(camera, is_open, sweeping=sweeping, wanted=wanted)

    def _drawn(self, camera: Camera, is_open: bool, visibility: Visibility, sweeping: Sweeping) -> Float32:
        """The picture of a renderer that draws, with a tight clipping range because of the depth buffer's limited precision."""
        clip = clip_of(visibility, self.geometry, camera)
        if self.backdrop is None:
            return self._radiance(camera, is_open, clip, sweeping)
        colors = self._radiance(camera, True, clip, sweeping)
        return self.backdrop.behind(colors, camera, visibility, is_open)

    @property
    def backdrop(self) -> Backdrop | None:
        """The sky and the ground's fading, for Workbench, which has neither; None otherwise."""
        return self.sky if self.options.renderer == "workbench" else None

    @cached_property
    def sky(self) -> Backdrop | None:
        """The sky and the ground's fading; None if the scene is a user's own."""
        return None if self.shot.scene.blend is not None else Backdrop.for_shot(self.shot, self.geometry)

    def _radiance(
        self, camera: Camera, is_open: bool, clip: Clip = (NEAREST, FARTHEST), sweeping: Sweeping | None = None
    ) -> Float32:
        """The picture, scene-linear, premultiplied, (H, W, 4) float32; a Blender that dies is restarted once."""
        return self.rendered(camera, is_open, clip, sweeping)["picture"]

    def rendered(
        self,
        camera: Camera,
        is_open: bool,
        clip: Clip = (NEAREST, FARTHEST),
        sweeping: Sweeping | None = None,
        wanted: Sequence[str] = (),
    ) -> dict[str, Float32]:
        """A `picture`, and the other wanted results of its render; a Blender that dies is restarted once."""
        return self.keeper.insist(partial(self._rendered, camera, is_open, clip, sweeping, wanted), self.named)

    @property
    def named(self) -> str:
        """The name for error messages: the .blend file if it is the scene, otherwise the models."""
        blend = self.shot.scene.blend
        return ", ".join(sorted({p.model.key for p in self.things})) if blend is None else blend.file

    def _rendered(
        self, camera: Camera, is_open: bool, clip: Clip, sweeping: Sweeping | None, wanted: Sequence[str]
    ) -> dict[str, Float32]:
        views = views_of(camera, not self.options.uses_opengl)
        process = self.keeper.process_for(self, self._levels([view.camera for view in views]))
        swept = (sweeping and sweeping.request(i) for i in range(len(views)))
        both = zip(views, swept, strict=True)
        pictures = [self._pictures(process, view.camera, is_open, clip, sweep, wanted) for view, sweep in both]
        return {
            name: resampled(camera, views, [each[name] for each in pictures], mixed=name != "materials")
            for name in ("picture", *wanted)
        }

    def _pictures(
        self, process: BlenderProcess, camera: Camera, is_open: bool, clip: Clip, blur: Request | None, wanted: Sequence[str]
    ) -> dict[str, Float32]:
        is_empty = is_open and blur is None and self.shot.scene.ground is None and self.shot.scene.blend is None
        border = border_of(self.geometry, camera) if is_empty and camera.lens.is_linear else None
        if border is not None and (border[0] >= border[2] or border[1] >= border[3]):
            shape = camera.height, camera.width
            return {name: np.zeros((*shape, COMPONENTS[name]), np.float32) for name in ("picture", *wanted)}
        out = process.folder / "picture.npy"
        request = FileFrame.from_blend(self.shot.scene.blend).camera(camera_request(camera, clip))
        told: Request = {"transparent": is_open, "border": border, "passes": list(wanted), "blur": blur}
        told["least"] = self.shot.label_alpha
        try:
            process.ask("render", FRAME_SECONDS, camera=request, out=str(out), **told)
        except BlenderError as error:
            raise ModelError(f"{self.named}: {error.reason}") from error
        return {"picture": load_array(out)} | {name: load_array(out.with_suffix(f".{name}.npy")) for name in wanted}

    @cached_property
    def kinds(self) -> tuple[Kind, ...]:
        """The models in the scene."""
        return kinds_of(self.things, self.meshes, self.shot.scene)

    def _levels(self, cameras: Sequence[Camera]) -> AllLevels | None:
        """Halvings of the models' textures for these cameras; None for no halving.

        None is used with OpenGL, which has mip levels; in a user's .blend scene, whose mirrors, lenses or compositor may
        magnify a texture; and with a script, whose materials must not change.
        """
        if self.options.uses_opengl or self.shot.scene.blend is not None or self.options.script is not None:
            return None
        return tuple(kind.levels(cameras) for kind in self.kinds)

    def paint(self, process: BlenderProcess, levels: AllLevels, before: AllLevels | None) -> None:
        """Rebuild the materials of the models whose textures become finer or coarser."""
        changed = [i for i, level in enumerate(levels) if before is None or level != before[i]]
        looks = materials_request([self.kinds[i] for i in changed], process.put, [levels[i] for i in changed])
        process.ask("paint", STAGE_SECONDS, looks=[{"mesh": i, **look} for i, look in zip(changed, looks, strict=True)])

    def tell(self, process: BlenderProcess, levels: AllLevels | None = None) -> None:
        """Build the scene in this Blender. Raises UserError for settings or devices that the renderer lacks."""
        shot = self.shot
        request = scene_request(self.things, self.meshes, self.geometry, shot.scene, self.options, process.put, levels)
        script = script_request(self.options, shot, [self.things[i] for i in staged(self.things, shot.scene)])
        try:
            process.ask("stage", STAGE_SECONDS, **request, script=script)
        except BlenderError as error:
            raise UserError(str(error).removeprefix("ValueError: ")) from error


def clip_of(visibility: Visibility, geometry: Geometry, camera: Camera) -> Clip:
    """Clipping range, in metres, of all visible surfaces; the ground is included up to its corners, where Blender's ground
    ends.
    """
    inverse_depths = visibility.inverse_depth[visibility.inverse_depth > 0]
    if not len(inverse_depths):
        return NEAREST, 1 / NEAREST
    near, far = 1 / (SPARE * float(inverse_depths.max())), SPARE / float(inverse_depths.min())
    if geometry.ground_z is None:
        return near, far
    corners = geometry.ground
    return near, min(far, SPARE * float(np.linalg.norm(corners - camera.center, axis=1).max()))


def camera_request(camera: Camera, clip: Clip = (NEAREST, FARTHEST)) -> dict[str, Any]:
    """A camera that Blender has, in the form that the worker's `render` takes; a pinhole instead of other lenses."""
    blender = camera.lens.blender or BlenderLens("PERSP")
    return {
        **blender._asdict(),
        **{name: getattr(camera.intrinsics, name) for name in ("width", "height", "fx", "fy", "cx", "cy")},
        "R": camera.R.tolist(),
        "center": camera.center.tolist(),
        "near": clip[0],
        "far": clip[1],
    }


def build_stage(shot: Shot, load: Load) -> CyclesStage:
    """The stage of a shot; Blender builds the scene when the first picture is requested.

    Raises RecipeError for an option, or a ground, that its renderer does not have.
    """
    options = options_of(shot.engine, shot.engine_options)
    if options.uses_opengl and shot.scene.ground is not None and shot.scene.ground.catcher:
        raise RecipeError(
            f"scene.ground: expected on, off or a material for engine: {options.renderer}, found catcher, which auto is before "
            "background: environment: set it to off, or take engine: cycles or raster"
        )
    if options.renderer == "workbench" and shot.shutter:
        raise RecipeError("time.shutter: expected 0 with engine: workbench, which cannot blur; take raster, cycles or eevee")
    return CyclesStage(Arrangements.build(shot, load), options, keeper_of(find_blender(options.python)))


def indices(shot: Shot, instant: int, sensor: int, load: Load) -> NDArray[np.int32] | None:
    """Ids of the objects that Cycles sees through the middles of a sensor's pixels at an instant, (H, W) int32, 0 for none;
    None for a lens that Blender lacks.

    A Blender that dies or hangs is restarted once. Raises ModelError if it dies again, UserError if Blender cannot be used, or
    cannot build the scene.
    """
    camera = shot.camera(instant, sensor)
    if not is_rendered(camera, is_traced=True):
        return None
    python = shot.engine_options.get("python") if shot.engine == "cycles" else None
    options = {"python": python, "samples": 1, "bounces": 0, "denoise": "off", "settings": _SHARP}
    stage = build_stage(shot.model_copy(update={"engine": "cycles", "engine_options": options}), load).arrangement(instant)
    view = FileFrame.from_blend(shot.scene.blend).camera(camera_request(camera))
    try:
        return stage.keeper.insist(partial(_rendered, stage, view), stage.named)
    except BlenderError as error:
        raise UserError(f"{stage.named}: {error.reason}") from error
    finally:
        stage.keeper.forget()  # the numbers are not those of the file


def _rendered(stage: Arrangement, view: dict[str, Any]) -> NDArray[np.int32]:
    """The ids in Blender's pass, for a camera."""
    process = stage.keeper.process_for(stage)
    out = process.folder / "seen.npy"
    process.ask("number", STAGE_SECONDS, members=members_of(stage.shot), alpha=stage.shot.label_alpha)
    process.ask("render", FRAME_SECONDS, camera=view, out=str(out), transparent=True, border=None, passes=["index"])
    return np.rint(load_array(out.with_suffix(".index.npy"))[..., 0]).astype(np.int32)
