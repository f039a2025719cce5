"""The checks of panoramas: lenses without z-depth, and pictures of a full turn, whose sides are one seam."""

from __future__ import annotations

from collections.abc import Iterator

from viewsphere.errors import RecipeError
from viewsphere.labels import label_named
from viewsphere.model.sensors.rig import Rig, Sensor
from viewsphere.recipe.draws import alternatives, span
from viewsphere.recipe.recipe import Recipe
from viewsphere.recipe.world.scene import SceneEntry


def check_panoramas(recipe: Recipe, rig: Rig) -> None:
    """Refuse labels that panoramas lack, and parts of a scene that would show their seam. Raises RecipeError."""
    for sensor in rig.sensors:
        lens = sensor.intrinsics.lens
        if sensor.lidar is not None or (lens.has_depth and lens.period is None):
            continue
        for name in (*sensor.kept_channels(recipe.channels), *recipe.annotations):
            label = label_named(name)
            if label is not None and not label.panoramas:
                instead = "use depth_ray, or leave it out" if name == "depth" else "leave it out"
                where = "channels" if name in recipe.channels else "annotations"
                raise RecipeError(f"{where}: expected labels that a panorama has; found {name} of {_named(sensor)}: {instead}")
        if lens.period is not None:
            for where, scene in recipe.varied_scenes.items():
                _check_seam(where, scene, sensor)
        if recipe.time is not None and recipe.time.shutter and lens.period is not None:
            raise RecipeError(
                f"time.shutter: expected 0, as motion blur would show the seam of {_named(sensor)}; found "
                f"{recipe.time.shutter:g}: leave it out"
            )


def _named(sensor: Sensor) -> str:
    return f"the {sensor.intrinsics.lens.name} {sensor.name}"


def _check_seam(where: str, scene: SceneEntry, sensor: Sensor) -> None:
    for field, found in _flat(scene):
        raise RecipeError(
            f"{where}.{field}: expected none, as it would show the seam of a full turn, which {_named(sensor)} has; found "
            f"{found}: leave it out, or set a smaller span"
        )


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
