"""Checks that the parts of a recipe support the lenses of its sensors."""

from __future__ import annotations

from collections.abc import Iterator

from viewsphere import plugins
from viewsphere.composing.viewpoints.poses import Poses
from viewsphere.errors import RecipeError
from viewsphere.labels import is_channel, label_named
from viewsphere.model.channel import PASSES
from viewsphere.model.sensors.rig import Rig
from viewsphere.plugins.engine import EngineSpec
from viewsphere.recipe.draws import alternatives, span
from viewsphere.recipe.recipe import Recipe
from viewsphere.recipe.world.scene import SceneEntry


def check_lenses(recipe: Recipe, rig: Rig) -> None:
    """Check that labels, the engine, weather and effects support the lenses of the rig's sensors."""
    for name, wrong in _limits(recipe, rig):
        raise RecipeError(f"{name}: {wrong}")


def check_fill(recipe: Recipe, rig: Rig, views: Poses) -> None:
    """Check that no viewpoint asks for a filled share of the picture, where a picture's width does not follow from distance."""
    lens = rig.sensors[0].intrinsics.lens
    if lens.is_parallel and any(views.fill(i) is not None for i in range(min(len(views), 1))):
        raise RecipeError(
            f"viewpoints.distance: expected metres beside projection: {lens.name}, whose pictures show as much from any "
            "distance; found fill: set camera.width_m to the width that the picture spans"
        )


def _limits(recipe: Recipe, rig: Rig) -> Iterator[tuple[str, str]]:
    """The recipe's fields that lenses rule out, each with the reason."""
    for sensor in rig.sensors:
        kept = sensor.kept_channels(tuple(recipe.channels))
        for name in (*kept, *recipe.annotations):
            label = label_named(name)
            reason = label.refuses(sensor.intrinsics) if label is not None and label.refuses is not None else None
            if reason is not None:
                yield "channels" if is_channel(name) else "annotations", f"{name}: {reason}"
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
