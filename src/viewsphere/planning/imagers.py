"""The imager behind a recipe's cameras: the checks that it fits the recipe, and its mounting on the sensors of a rig."""

from __future__ import annotations

from collections.abc import Iterator

from viewsphere.errors import RecipeError
from viewsphere.model.channel import MOSAIC
from viewsphere.model.sensors.imager import Imager, MountedImager
from viewsphere.model.sensors.rig import Rig
from viewsphere.recipe.draws import alternatives
from viewsphere.recipe.recipe import Recipe
from viewsphere.recipe.world.finish import ViewEntry
from viewsphere.recipe.world.scene import SceneEntry

ROUNDED = 1e-6
"""Relative rounding error of a duration that a user writes."""


def with_imager(recipe: Recipe, rig: Rig) -> Rig:
    """The rig, with the recipe's imager behind every camera."""
    if recipe.camera.imager is None:
        return rig
    mounted = _mounted(recipe, recipe.camera.imager)
    sensors = (sensor.model_copy(update={"imager": mounted}) if sensor.lidar is None else sensor for sensor in rig.sensors)
    return rig.model_copy(update={"sensors": tuple(sensors)})


def _mounted(recipe: Recipe, imager: Imager) -> MountedImager:
    """The imager; in sequences with an open shutter, this is the exposure."""
    exposure, time = imager.exposure, recipe.time
    if time is not None and time.shutter and exposure == "auto":
        exposure = time.shutter / time.fps
    fields = dict(imager) | {"exposure": exposure, "fps": None if time is None else time.fps}
    return MountedImager.model_validate(fields)


def check_imager(recipe: Recipe) -> None:
    """Check that a recipe's imager is the only cause of its faults, and that its exposure fits; raises RecipeError."""
    imager = recipe.camera.imager
    if imager is None:
        if MOSAIC in recipe.channels:
            i = recipe.channels.index(MOSAIC)
            raise RecipeError(
                f"channels[{i}]: expected camera.imager beside {MOSAIC}, the digital numbers of a sensor; found none: set "
                "camera: {imager: webcam}"
            )
        return
    for name, wrong in (*_beside(recipe), *_exposure(recipe, imager)):
        raise RecipeError(f"{name}: {wrong}")


def _beside(recipe: Recipe) -> Iterator[tuple[str, str]]:
    """The fields of scenes that the imager rules out, each with the reason."""
    if "rgba" in recipe.channels:
        yield "channels", "expected rgb beside camera.imager, whose sensor measures no alpha; found rgba: leave one of them out"
    for where, scene in recipe.varied_scenes.items():
        for spec, strength in scene.effects.strengths:
            if spec.in_imager:
                yield (
                    f"{where}.effects.{spec.name}",
                    f"expected 0 beside camera.imager, which has it, too; found {strength:g}: leave one of them out",
                )
        for field in _viewed(scene):
            yield (
                f"{where}.view.{field}",
                "expected none beside camera.imager, which has its own exposure and white balance; found one: set "
                "camera.imager.compensation, or white_balance",
            )


def _viewed(scene: SceneEntry) -> Iterator[str]:
    plain = ViewEntry()
    entries = [entry for entry in alternatives(scene.view) if isinstance(entry, ViewEntry)]
    return (
        name
        for name in ("exposure", "temperature_k", "tint", "transform")
        if any(getattr(e, name) != getattr(plain, name) for e in entries)
    )


def _exposure(recipe: Recipe, imager: Imager) -> Iterator[tuple[str, str]]:
    """Reasons against the exposure time of a sequence."""
    time, fixed = recipe.time, imager.fixed_exposure
    if time is None or fixed is None:
        return
    if fixed > (1 + ROUNDED) / time.fps:
        yield (
            "camera.imager.exposure",
            f"expected at most a frame's time, {1 / time.fps:g} s at {time.fps:g} frames a second; found {fixed:g}",
        )
    if time.shutter and abs(fixed * time.fps - time.shutter) > ROUNDED:
        yield (
            "camera.imager.exposure",
            f"expected the time that time.shutter is open, {time.shutter / time.fps:g} s; found {fixed:g}: leave it out",
        )
