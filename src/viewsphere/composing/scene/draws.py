"""A recipe's scene made concrete: light, ground, materials and finish of a shot, finish and camera of a frame.

Every distribution has its own generator, seeded by its field, and by the model and the pose if it is drawn for these: another
field, model or pose changes no other draw.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from datetime import date
from fnmatch import fnmatchcase
from functools import cached_property, lru_cache, partial
from typing import Any

from viewsphere import materials
from viewsphere.composing.scene.pictures import Kind, Pictures
from viewsphere.composing.scene.scenery import draw_names, is_indoors
from viewsphere.composing.scene.weather import through_windows, weathered
from viewsphere.composing.seeds import Names, scene_generators, share
from viewsphere.errors import RecipeError
from viewsphere.geometry.pose_category import pose_category
from viewsphere.model.annotations.procedural_material import ProceduralMaterial
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.instant import Viewpoint
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import (
    SEED,
    WHITE,
    AnyLight,
    AnySky,
    Background,
    Daylight,
    Environment,
    Finish,
    Ground,
    Scene,
    Sky,
    Sun,
)
from viewsphere.model.thing import Repaint
from viewsphere.recipe.draws import RngOf, alternatives, drawn, is_random
from viewsphere.recipe.entries import concrete, pictures_of
from viewsphere.recipe.lights import Lamp, spec_of
from viewsphere.recipe.recipe import Recipe
from viewsphere.recipe.seed_names import seed_name
from viewsphere.recipe.world.effects import EffectsEntry
from viewsphere.recipe.world.finish import BackgroundEntry, JitterEntry, PerFrame, ViewEntry
from viewsphere.recipe.world.light import DaylightSky, HdriSky, NightEntry, NightSky, SunEntry
from viewsphere.recipe.world.surface import GroundEntry, MaterialEntry

_DAY_0 = 1721424.5
"""Julian day of midnight before day 0 of Python's calendar."""

PARTS = ("background", "smoother", "view", "effects")
"""The parts of a finish that are drawn, which have the same names in a recipe's scene."""

WEATHER = frozenset({"rain", "snow", "wet"})
"""Fields of a scene whose drops, flakes and puddles have random places."""

INDOOR_STOPS = 3.5
"""The exposure that makes a room by day as bright as a street."""


@dataclass(frozen=True, eq=False)
class Scenes:
    """The scenes of a recipe. `model` is a model's key, `pose` a pose's name; for values that all frames of a sequence share,
    it is the pose's name without its time. The name of a `variation` seeds the noise, and the draws of the scene's fields in
    `drawn_alone`.
    """

    recipe: Recipe
    pictures: Pictures
    variation: str = ""
    drawn_alone: frozenset[str] = frozenset()

    @cached_property
    def is_jittered(self) -> bool:
        """Return whether poses are moved."""
        return self.recipe.scene.jitter != JitterEntry()

    @cached_property
    def is_target_moved(self) -> bool:
        """Return whether jitter needs the poses' target, because it moves the target."""
        return self.recipe.scene.jitter.target != JitterEntry().target

    @cached_property
    def has_finish_per_frame(self) -> bool:
        """Return whether every frame has a finish of its own."""
        return self._is_noisy or any(
            self._draw(part) == "per_frame" and (is_random(part) or getattr(part, "images", None) is not None)
            for part in self._finishing
        )

    @property
    def _is_noisy(self) -> bool:
        """Return whether pictures have noise, which differs in every frame: that of effects, or of an imager."""
        return self.recipe.scene.effects.is_noisy or self.recipe.camera.imager is not None

    def scene(self, model: str, pose: str) -> Scene:
        """Light and ground for a shot, and the finish that its frames share."""
        return self._scene(draw_names(self.recipe.scene.draw, model, pose), self._names_of_finish(model, None, pose))

    def finish(self, model: str, pose: str, place: str) -> Finish:
        """The finish of one frame; `place` is the name of its pose without its time."""
        return self._finish(self._names_of_finish(model, pose, place), (model, pose))

    def repaints(self, spec: ModelSpec, model: str, pose: str) -> tuple[Repaint, ...]:
        """The changes to a target's materials in a shot of `model`; a model looks the same beside any other model."""
        entry = self.recipe.scene
        each = entry.draw in ("per_frame", "per_sequence")
        names = (spec.key, model, pose) if each else draw_names(entry.draw, spec.key, None)
        return tuple(
            self._repaint(drawn(material, self._rng_of(names), ("materials", str(i))), i, names)
            for i, material in enumerate(entry.materials)
            if fnmatchcase(spec.key, material.models)
        )

    def _repaint(self, entry: MaterialEntry, number: int, names: Names) -> Repaint:
        if entry.texture is not None:
            return concrete(entry, texture=_substance(entry.texture, 512, self._rng_of(names), ("materials", str(number))))
        if entry.images is not None:
            return concrete(entry, image=self._file("textures", entry.images, ("materials", str(number), "images"), names))
        return concrete(entry, image=None if entry.image is None else self.pictures["image", entry.image][0])

    def jitter(self, model: str, name: str) -> JitterEntry:
        """Return the jitter of a pose, with all values drawn."""
        entry = self.recipe.scene.jitter
        return drawn(entry, self._rng_of(draw_names(entry.draw, model, name)), ("jitter",))

    def jittered(self, pose: Viewpoint, model: str, name: str) -> Viewpoint:
        """The pose moved at random; it keeps its index. Without its own target, a pose keeps to the models' centre."""
        by = self.jitter(model, name)
        azimuth = pose.azimuth_deg + by.azimuth
        elevation = min(max(pose.elevation_deg + by.elevation, -90.0), 90.0)
        target = None if pose.target is None else tuple(a + b for a, b in zip(pose.target, by.target, strict=True))
        return pose.model_copy(
            update={
                "azimuth_deg": azimuth,
                "elevation_deg": elevation,
                "distance": pose.distance * (1 + by.distance),
                "tilt_deg": pose.tilt_deg + by.tilt,
                "target": target,
                "category": pose_category(azimuth, elevation, self.recipe.viewpoints.bins),
            }
        )

    def _rng_of(self, names: Names) -> RngOf:
        shared = scene_generators(self.recipe.seed, names)
        alone = scene_generators(self.recipe.seed, self._alone(names))
        seeds = frozenset(map(seed_name, self.drawn_alone))
        return lambda path: (alone if path[0] in seeds else shared)(path)

    def _alone(self, names: Names) -> Names:
        """The names that seed the draws of this variation alone."""
        return (*names, "variation", self.variation)

    def _names_of_finish(self, model: str, pose: str | None, place: str) -> tuple[Names, ...]:
        """The names for the draws of background, smoother, view and effects; empty where every frame has its own finish."""
        if pose is None and self.has_finish_per_frame:
            return ()
        draws = map(self._draw, self._finishing)
        return tuple(draw_names(draw, model, place if draw == "per_sequence" else pose) for draw in draws)

    def _draw(self, entry: object) -> str:
        """Return the draw setting of a part of the finish; a choice between several parts is drawn for every frame, or
        sequence.
        """
        if isinstance(entry, PerFrame):
            return entry.draw
        return "per_frame" if self.recipe.time is None else "per_sequence"

    @property
    def _finishing(self) -> tuple[object, ...]:
        """The entries of a finish's parts."""
        return tuple(getattr(self.recipe.scene, name) for name in PARTS)

    @cached_property
    def _is_indoors(self) -> bool:
        return is_indoors(self.recipe, self.recipe.scene.place)

    @cached_property
    def _scene(self) -> Callable[[Names, tuple[Names, ...]], Scene]:
        """The scene for the names of its draws; the last results are cached, because many shots share one."""

        @lru_cache(maxsize=64)
        def scene(names: Names, names_of_finish: tuple[Names, ...]) -> Scene:
            entry, rng_of = self.recipe.scene, self._rng_of(names)
            sun, above = drawn(entry.sun, rng_of, ("sun",)), drawn(entry.sky, rng_of, ("sky",))
            sky = self._sky(above, names)
            drawn_scene = Scene(
                sun=_moon(above.night, sun) if isinstance(above, NightSky) else _sun(sun, sky),
                sky=sky.model_copy(update={"strength": 0.0}) if isinstance(sky, Daylight) and is_night(sun) else sky,
                lights=_lights(entry.lights, rng_of),
                ground=self._ground(drawn(entry.ground, rng_of, ("ground",)), rng_of),
                finish=self._finish(names_of_finish, ()) if names_of_finish else _plain_finish(),
            )
            outdoors = weathered(drawn_scene, entry, rng_of, partial(self._weather_seed, names))
            return through_windows(drawn_scene, outdoors) if self._is_indoors else outdoors

        return scene

    def _weather_seed(self, names: Names, use: str) -> int:
        """The seed of drops, flakes or puddles: separate for a variation with its own weather."""
        of = self._alone(names) if self.drawn_alone & WEATHER else names
        return int(share(self.recipe.seed, "weather", use, *of) * 2**32)

    def _sky(self, entry: Any, names: Names) -> AnySky:
        if isinstance(entry, HdriSky):
            return concrete(entry, file=self._file("hdri", entry.hdri, ("sky", "hdri"), names))
        if isinstance(entry, NightSky):
            return _night(entry.night)
        return concrete(entry.daylight if isinstance(entry, DaylightSky) else entry)

    def _ground(self, entry: Any, rng_of: RngOf) -> Ground | None:
        if entry == "auto":
            entry = self.recipe.scene.automatic_ground
        if not isinstance(entry, GroundEntry):
            return None if entry == "off" else Ground(catcher=entry == "catcher")
        files = {name: self.pictures["image", path][0] for name in pictures_of(Ground) if (path := getattr(entry, name))}
        if entry.material is not None:
            substance = _substance(entry.material, 1024, rng_of, ("ground",))
            tile = materials.metres(substance.name, substance.seed)
            return concrete(entry, material=substance, tile=tile, color=entry.color or WHITE)
        ground: Ground = concrete(entry, **files)
        return ground if entry.color or not entry.image else ground.model_copy(update={"color": WHITE})

    def _file(self, kind: Kind, path: str, field: tuple[str, ...], names: Names) -> str:
        """The file for a path of the recipe; from a folder, one is drawn."""
        files = self.pictures[kind, path]
        if len(files) == 1:
            return files[0]
        return files[int(self._rng_of(names)((*field, "file")).integers(len(files)))]

    def _finish(self, names: tuple[Names, ...], frame: Names) -> Finish:
        parts = {name: self._part(name, drawn_for) for name, drawn_for in zip(PARTS, names, strict=True)}
        if self._is_noisy:
            of = (*frame, self.variation) if self.variation else frame
            seed = int(share(self.recipe.seed, "noise", *of) * 2**32)
            parts["effects"] = parts["effects"].model_copy(update={SEED: seed})
        return Finish(**parts)

    @cached_property
    def _part(self) -> Callable[[str, Names], Any]:
        """One part of a finish, for the names of its draws; the last results are cached."""

        @lru_cache(maxsize=256)
        def part(field: str, names: Names) -> Frozen:
            entry = drawn(getattr(self.recipe.scene, field), self._rng_of(names), (seed_name(field),))
            if isinstance(entry, BackgroundEntry):
                return self._background(entry, names)
            if isinstance(entry, EffectsEntry):
                return entry.effects
            if isinstance(entry, ViewEntry) and entry.exposure == "auto":
                return concrete(entry, exposure=INDOOR_STOPS if self._is_indoors else 0.0)
            return concrete(entry)

        return part

    def _background(self, entry: BackgroundEntry, names: Names) -> Background:
        image = None
        if entry.images is not None:
            image = self._file("images", entry.images, ("background", "images"), names)
        elif entry.image is not None:
            image = self.pictures["image", entry.image][0]
        return concrete(entry, image=image)


def _plain_finish() -> Finish:
    """The finish of a shot whose frames all have their own."""
    return Finish(effects=EffectsEntry.of_defaults().effects)


def _substance(name: Any, size: int, rng_of: RngOf, field: tuple[str, ...]) -> ProceduralMaterial:
    """A piece of a material; its other random values follow from the seed."""
    return ProceduralMaterial(name=name, seed=int(rng_of((*field, "seed")).integers(2**32)), size=size)


def _sun(entry: Any, sky: AnySky) -> Sun | None:
    if not isinstance(entry, SunEntry):
        return None if entry == "off" or (entry == "auto" and isinstance(sky, Environment)) else Sun()
    angles = _angles(entry)
    if angles is None:
        return concrete(entry)
    return concrete(entry, azimuth=angles[0], elevation=angles[1]) if angles[1] > 0 else None


def _night(entry: NightEntry) -> Sky:
    """A sky lit by the moon and the lights of towns."""
    dark, glow = 0.05 + 0.5 * entry.moon, entry.glow
    return Sky(
        zenith=(0.1 * dark + 0.1 * glow, 0.13 * dark + 0.1 * glow, 0.24 * dark + 0.1 * glow),
        horizon=(0.15 * dark + glow, 0.18 * dark + 0.8 * glow, 0.28 * dark + 0.65 * glow),
    )


def _moon(entry: NightEntry, sun: object) -> Sun | None:
    if sun == "off" or not entry.moon:
        return None
    place = {"azimuth": entry.azimuth, "elevation": entry.elevation}
    return Sun(strength=entry.moon, color=(0.75, 0.87, 1.0), **place)


def check_night(recipe: Recipe) -> None:
    """Raise RecipeError for a night sky with the sun above the horizon."""
    scene = recipe.scene
    if any(isinstance(sky, NightSky) for sky in alternatives(scene.sky)):
        for sun in alternatives(scene.sun):
            if isinstance(sun, SunEntry) and not is_night(sun):
                raise RecipeError(
                    "scene.sun: expected auto, off, or a date and time of the night beside sky: night; found one above the "
                    "horizon: leave it out, or take another sky"
                )


def _angles(entry: SunEntry) -> tuple[float, float] | None:
    """Azimuth, as for cameras, and elevation of a sun given by date, time and place. North is +Y."""
    if entry.date is None or entry.time is None or entry.latitude is None or entry.longitude is None:
        return None
    compass, elevation = sun_position(entry.date, entry.time, entry.latitude, entry.longitude)
    return (180 - compass) % 360, elevation


def is_night(entry: object) -> bool:
    """Return whether a sun given by a fixed date, time and place is below the horizon."""
    if not isinstance(entry, SunEntry) or is_random((entry.date, entry.time, entry.latitude, entry.longitude)):
        return False
    angles = _angles(entry)
    return angles is not None and angles[1] <= 0


def _lights(entries: tuple[Lamp, ...], rng_of: RngOf) -> tuple[AnyLight, ...]:
    lights: list[AnyLight] = []
    for i, entry in enumerate(entries):
        for j in range(drawn(entry.count, rng_of, ("lights", str(i), "count"))):
            lights += spec_of(entry).emitters(drawn(entry, rng_of, ("lights", str(i), str(j))))
    return tuple(lights)


def sun_position(day: str, hours: float, latitude: float, longitude: float) -> tuple[float, float]:
    """Compass azimuth (clockwise from north) and elevation of the sun, degrees, as seen through the air.

    `day`: its date; `hours`: UTC hours of that day, below 0 or above 24 for another day; degrees north and east. Accurate to
    about 0.02 degrees from 1800 to 2100. Source: NOAA's solar calculator (https://gml.noaa.gov/grad/solcalc/calcdetails.html),
    after Meeus, *Astronomical Algorithms* (2nd ed., chapters 25 and 28).
    """
    century = (date.fromisoformat(day).toordinal() + _DAY_0 + hours / 24 - 2451545) / 36525
    declination, equation = _apparent_sun(century)
    angle = math.radians((hours * 60 + equation + 4 * longitude) / 4 - 180)
    north = math.radians(latitude)
    height = math.sin(north) * math.sin(declination) + math.cos(north) * math.cos(declination) * math.cos(angle)
    elevation = math.degrees(math.asin(min(max(height, -1.0), 1.0)))
    west = math.atan2(
        math.sin(angle) * math.cos(declination),
        math.cos(angle) * math.sin(north) * math.cos(declination) - math.sin(declination) * math.cos(north),
    )
    return (math.degrees(west) + 180) % 360, elevation + _refraction(elevation)


def _apparent_sun(t: float) -> tuple[float, float]:
    """Declination, radians, and the equation of time, minutes, at `t` Julian centuries after 2000."""
    longitude = math.radians((280.46646 + t * (36000.76983 + 0.0003032 * t)) % 360)
    anomaly = math.radians(357.52911 + t * (35999.05029 - 0.0001537 * t))
    eccentricity = 0.016708634 - t * (0.000042037 + 0.0000001267 * t)
    center = (
        math.sin(anomaly) * (1.914602 - t * (0.004817 + 0.000014 * t))
        + math.sin(2 * anomaly) * (0.019993 - 0.000101 * t)
        + math.sin(3 * anomaly) * 0.000289
    )
    node = math.radians(125.04 - 1934.136 * t)
    apparent = longitude + math.radians(center - 0.00569 - 0.00478 * math.sin(node))
    seconds = 21.448 - t * (46.815 + t * (0.00059 - 0.001813 * t))
    tilt = math.radians(23 + (26 + seconds / 60) / 60 + 0.00256 * math.cos(node))
    y = math.tan(tilt / 2) ** 2
    equation = (
        y * math.sin(2 * longitude)
        - 2 * eccentricity * math.sin(anomaly)
        + 4 * eccentricity * y * math.sin(anomaly) * math.cos(2 * longitude)
        - y * y * math.sin(4 * longitude) / 2
        - 1.25 * eccentricity**2 * math.sin(2 * anomaly)
    )
    return math.asin(math.sin(tilt) * math.sin(apparent)), 4 * math.degrees(equation)


def _refraction(elevation: float) -> float:
    """Return the angle by which the air raises the apparent sun, degrees."""
    if elevation > 85:
        return 0.0
    tangent = math.tan(math.radians(elevation))
    if elevation > 5:
        return (58.1 / tangent - 0.07 / tangent**3 + 0.000086 / tangent**5) / 3600
    if elevation > -0.575:
        return (1735 + elevation * (-518.2 + elevation * (103.4 + elevation * (-12.79 + elevation * 0.711)))) / 3600
    return -20.774 / tangent / 3600
