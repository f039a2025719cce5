"""Checks that the parts of a recipe support the lenses of its sensors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from viewsphere import plugins
from viewsphere.assets.animation.clip import Timeline
from viewsphere.composing.viewpoints.poses import Poses
from viewsphere.errors import RecipeError
from viewsphere.geometry.lenses import LensOptions
from viewsphere.labels import is_channel, label_named
from viewsphere.model.channel import PASSES
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.sensors.rig import Rig
from viewsphere.model.sensors.rolling import Rolling
from viewsphere.plugins.engine import EngineSpec
from viewsphere.recipe.cameras.rig import SensorList
from viewsphere.recipe.draws import alternatives, span
from viewsphere.recipe.recipe import Recipe
from viewsphere.recipe.world.scene import SceneEntry

ROUNDING = 1e-9
"""Share by which a readout may exceed the time between two instants, as neither is a binary fraction."""


def check_lenses(recipe: Recipe, rig: Rig) -> None:
    """Check that labels, the engine, weather and effects support the lenses of the rig's sensors."""
    for name, wrong in _limits(recipe, rig):
        raise RecipeError(f"{name}: {wrong}")


def check_fill(recipe: Recipe, rig: Rig, views: Poses) -> None:
    """Check that each lens with parallel rays has one width: its own, or the one that viewpoints' filled share sets."""
    is_filled = len(views) > 0 and views.fill(0) is not None
    first = rig.sensors[0].intrinsics
    for where, options, own in _projections(recipe, rig):
        if options.is_open and not (is_filled and own == first):
            fix = "set it, or distance: {fill: ...}" if own == first else "set it"
            raise RecipeError(
                f"{where}: expected width_m beside projection: {options.projection}, the width in metres that the picture "
                f"spans; found none: {fix}"
            )
        if is_filled and own == first and own.lens.is_parallel and not options.is_open:
            raise RecipeError(
                f"viewpoints.distance: expected metres beside the width_m of projection: {options.projection}, as fill sets "
                "the width of each picture; found fill: leave one of them out"
            )


def _projections(recipe: Recipe, rig: Rig) -> Iterator[tuple[str, LensOptions, Intrinsics]]:
    """The lenses that a recipe names by `projection`: their fields, options and intrinsics."""
    entries = recipe.rig.sensors if isinstance(recipe.rig, SensorList) else {}
    for sensor in rig.sensors:
        entry = entries.get(sensor.name)
        if entry is not None and entry.projection is not None:
            yield f"rig.sensors.{sensor.name}", entry.projection, sensor.intrinsics
        elif recipe.camera.projection is not None and sensor.intrinsics.distortion == recipe.camera.intrinsics.distortion:
            yield "camera", recipe.camera.projection, sensor.intrinsics


def check_rigid(recipe: Recipe, specs: Sequence[ModelSpec], lines: Sequence[Timeline | None]) -> None:
    """Check that no model changes its shape while the rows of a rolling shutter are exposed."""
    playing = [spec.key for spec, line in zip(specs, lines, strict=True) if line is not None]
    if recipe.camera.rolling is not None and playing:
        raise RecipeError(
            f"camera.rolling: expected models that keep their shape; found the animated {playing[0]}: leave one of them out"
        )


def _limits(recipe: Recipe, rig: Rig) -> Iterator[tuple[str, str]]:
    """The recipe's fields that lenses rule out, each with the reason."""
    for sensor in rig.sensors:
        kept = sensor.kept_channels(tuple(recipe.channels))
        for name in (*kept, *recipe.annotations):
            label = label_named(name)
            reason = label.refuses(sensor.intrinsics) if label is not None and label.refuses is not None else None
            if reason is None and label is not None and label.one_pose and sensor.intrinsics.rolling is not None:
                reason = "expected no camera.rolling beside it, as it needs one pose of all rows; found one: leave it out"
            if reason is not None:
                yield "channels" if is_channel(name) else "annotations", f"{name}: {reason}"
        if sensor.intrinsics.rolling is not None:
            yield from _of_rolling(recipe, sensor.intrinsics.rolling, sensor.intrinsics)
        lens = sensor.intrinsics.lens
        if lens.is_parallel and any(name in PASSES for name in kept):
            yield from _of_pictures(recipe, lens.name)
        if lens.period is not None:
            yield from _of_full_turns(recipe, f"the {lens.name} {sensor.name}")


def _of_pictures(recipe: Recipe, lens: str) -> Iterator[tuple[str, str]]:
    """The fields that parts of pictures with parallel rays rule out."""
    if not plugins.load(EngineSpec, recipe.engine.name).parallel_rays:
        engine = recipe.engine.name
        yield "engine", f"expected one that paints parallel rays beside projection: {lens}; found {engine}: take raster"
    for where, scene in recipe.varied_scenes.items():
        for name in scene.precipitation:
            yield f"{where}.{name}", f"expected off beside projection: {lens}, whose rays begin far apart; found {name}"
        for spec, strength in scene.effects.strengths:
            if spec.needs_pinhole:
                reason = f"expected 0 beside projection: {lens}, as it is made for a pinhole; found {strength:g}"
                yield f"{where}.effects.{spec.name}", reason


def _of_full_turns(recipe: Recipe, sensor: str) -> Iterator[tuple[str, str]]:
    """The fields that would show the seam of a picture of a full turn."""
    for where, scene in recipe.varied_scenes.items():
        for field, found in _flat(scene):
            yield (
                f"{where}.{field}",
                f"expected none, as it would show the seam of a full turn, which {sensor} has; found {found}: leave it out, or "
                "set a smaller span",
            )
    if recipe.camera.imager is not None:
        reason = f"expected none, as its lens and its mosaic would show the seam of a full turn, which {sensor} has"
        yield "camera.imager", f"{reason}; found one: leave it out, or set a smaller span"
    if recipe.time is not None and recipe.time.shutter:
        reason = f"expected 0, as motion blur would show the seam of {sensor}; found {recipe.time.shutter:g}: leave it out"
        yield "time.shutter", reason


def _flat(scene: SceneEntry) -> Iterator[tuple[str, str]]:
    """The parts of a scene that end at the sides of the picture, with their values."""
    for spec, strength in scene.effects.strengths:
        if spec.shows_seam:
            yield f"effects.{spec.name}", f"{strength:g}"
    for name in scene.precipitation:
        yield name, "it"
    if any(value != "none" for value in alternatives(scene.smoother.kind)):
        yield "smoother", "one"
    if any(entry.image is not None or entry.images is not None for entry in scene.backgrounds):
        yield "background", "a picture"
    if any(abs(end) > 0 for end in span(scene.jitter.off_center)):
        yield "jitter.off_center", "an offset in a flat picture"


def _of_rolling(recipe: Recipe, rolling: Rolling, intrinsics: Intrinsics) -> Iterator[tuple[str, str]]:
    """The fields that a rolling shutter rules out, or requires."""
    if recipe.time is None:
        yield "camera.rolling", "expected time beside it, as still pictures have no time; found none: set time, or leave it out"
        return
    interval = 1 / recipe.time.fps
    if rolling.readout > interval * (1 + ROUNDING):
        found = f"at most {interval:g} s, the time between two instants; found {rolling.readout:g}"
        yield "camera.rolling.readout", f"expected {found}: read out faster, or set a lower time.fps"
    if not intrinsics.lens.is_linear:
        yield "camera.rolling", f"expected a pinhole camera beside it; found {intrinsics.lens.name}: leave one of them out"
    if recipe.camera.of_viewpoints:
        yield "camera.rolling", "expected a lens of the recipe beside it; found camera.of_viewpoints: set fov_deg or K instead"
    if recipe.time.shutter:
        yield "time.shutter", f"expected 0 beside camera.rolling; found {recipe.time.shutter:g}: leave one of them out"
    for where, scene in recipe.varied_scenes.items():
        wet = ["wet"] if any(value not in ("off", "auto") for value in alternatives(scene.wet)) else []
        for name in (*scene.precipitation, *wet):
            yield f"{where}.{name}", f"expected off beside camera.rolling, whose rows it does not know; found {name}"
    if not plugins.load(EngineSpec, recipe.engine.name).rolling:
        engine = recipe.engine.name
        yield "engine", f"expected one that paints rolling shutters beside camera.rolling; found {engine}: take raster"
