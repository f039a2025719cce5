"""A scene under the weather of its recipe: changed light, fog, rain, snow and water."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from viewsphere.assets.appearance.wetting import darkened
from viewsphere.codecs.srgb import encoded, linear
from viewsphere.model.scene import HemisphereLight, Scene
from viewsphere.model.weather import CONTRAST, Fog, Lamps, Rain, Snow, Wet
from viewsphere.recipe.draws import RngOf, drawn
from viewsphere.recipe.entries import concrete
from viewsphere.recipe.seed_names import seed_name
from viewsphere.recipe.world.light import NightSky
from viewsphere.recipe.world.scene import SceneEntry
from viewsphere.recipe.world.weather import FogEntry, LampsEntry, RainEntry, SnowEntry, WetEntry
from viewsphere.rendering.weather.conditions import clouded, floor_light, in_fog
from viewsphere.rendering.weather.precipitation import extinction

SOAKING = 25.0
"""Millimetres of rain an hour above which surfaces do not become wetter."""

SeedOf = Callable[[str], int]


def weathered(scene: Scene, entry: SceneEntry, rng_of: RngOf, seed_of: SeedOf) -> Scene:
    """The scene with the weather drawn from its entry. `seed_of` returns an independent seed for a purpose."""
    scene = scene.model_copy(update=_lamps(entry, rng_of))
    fog, rain, snow, wet = (drawn(getattr(entry, name), rng_of, (seed_name(name),)) for name in ("fog", "rain", "snow", "wet"))
    falling = [one for one in (rain, snow) if isinstance(one, (RainEntry, SnowEntry))]
    if not falling and not isinstance(fog, FogEntry):
        return scene.model_copy(update=_wet(scene, wet, None, seed_of))
    clouds = max((one.clouds for one in falling), default=0.0)
    sun, sky = clouded(scene.sun, scene.sky, clouds)
    lights, changes = scene.lights, dict[str, Any]()
    light = floor_light(sun, sky)
    if isinstance(fog, FogEntry):
        drawn_fog: Fog = concrete(fog)
        sun, sky, spread, light = in_fog(sun, sky, drawn_fog)
        lights = lights if spread is None else (*lights, spread)
        changes["fog"] = drawn_fog if fog.color else drawn_fog.model_copy(update={"color": _triple(light)})
    for one in falling:
        own: Any = concrete(one, color=one.color or _triple(light + _even(lights)), seed=seed_of("falling"))
        changes["rain" if isinstance(own, Rain) else "snow"] = own
    if falling:
        changes["fog"] = _hazy(changes.get("fog"), [one for one in changes.values() if isinstance(one, (Rain, Snow))], light)
    return scene.model_copy(update={"sun": sun, "sky": sky, "lights": lights} | changes | _wet(scene, wet, rain, seed_of))


def through_windows(scene: Scene, outdoors: Scene) -> Scene:
    """The scene of a room: outdoor weather changes the incoming light, and its fog is visible through the windows."""
    kept = {name: getattr(outdoors, name) for name in ("sun", "sky", "lights", "lamps")}
    return scene.model_copy(update={**kept, "fog_outdoors": outdoors.fog})


def _lamps(entry: SceneEntry, rng_of: RngOf) -> dict[str, Lamps]:
    """The scene's field for lit lamps: by default, lamps are lit at night."""
    lamps = drawn(entry.lamps, rng_of, ("lamps",))
    if isinstance(lamps, LampsEntry):
        return {"lamps": concrete(lamps)}
    return {"lamps": Lamps()} if lamps == "auto" and isinstance(drawn(entry.sky, rng_of, ("sky",)), NightSky) else {}


def _hazy(fog: Fog | None, falling: list[Rain | Snow], light: np.ndarray[Any, Any]) -> Fog:
    """The fog, with the haze of drops that are too far away to be distinguished."""
    more = sum(map(extinction, falling))
    if fog is None:
        return Fog(visibility=CONTRAST / more, color=_triple(light))
    if fog.height is not None:
        return fog  # thicker than rain below, and seen through above
    return fog.model_copy(update={"visibility": CONTRAST / (fog.extinction + more)})


def _wet(scene: Scene, entry: object, rain: object, seed_of: SeedOf) -> dict[str, Any]:
    """The scene's field for water on the ground: from the entry, else from the rain."""
    if isinstance(entry, WetEntry):
        return _soaked(scene, concrete(entry, seed=seed_of("puddles")))
    if entry == "off" or not isinstance(rain, RainEntry):
        return {}
    soaked = min(rain.rate / SOAKING, 1.0)
    return _soaked(scene, Wet(amount=0.6 + 0.4 * soaked, puddles=0.45 * soaked, seed=seed_of("puddles")))


def _soaked(scene: Scene, wet: Wet) -> dict[str, Any]:
    """The scene's fields for water, and for the ground plane, which water makes darker and smoother."""
    ground = scene.ground
    if ground is None or ground.catcher:
        return {"wet": wet}
    kept = darkened(ground.roughness, ground.metallic, wet.amount)
    r, g, b = (float(f"{c:.6g}") for c in encoded(linear(ground.color) * kept).tolist())
    return {
        "wet": wet,
        "ground": ground.model_copy(update={"color": (r, g, b), "roughness": ground.roughness * (1 - 0.5 * wet.amount)}),
    }


def _even(lights: tuple[Any, ...]) -> np.ndarray[Any, Any]:
    found = [np.array(light.color) * light.strength for light in lights if isinstance(light, HemisphereLight)]
    return sum(found, np.zeros(3))


def _triple(light: np.ndarray[Any, Any]) -> tuple[float, float, float]:
    """Light as rounded numbers for records, equal on all processors."""
    r, g, b = (float(f"{value:.6g}") for value in np.maximum(light, 0).tolist())
    return r, g, b
