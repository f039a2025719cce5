"""Warnings for recipes with empty pictures: no light, an exposure that hides everything, a camera that looks away.

The checks read the recipe alone, so lamps and photographed skies have a wide margin.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product
from statistics import fmean
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.composing.scene.draws import is_night
from viewsphere.composing.viewpoints.poses import Poses
from viewsphere.geometry.camera import orbit_center
from viewsphere.model.scene import Sun
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.sensors.rig import Rig, Sensor
from viewsphere.recipe.draws import alternatives, component, span
from viewsphere.recipe.models import Dimensions, ModelEntry, ScaleEntry
from viewsphere.recipe.recipe import Recipe
from viewsphere.recipe.world.light import DaylightSky, HdriSky, NightSky, SunEntry
from viewsphere.recipe.world.scene import SceneEntry

Float = NDArray[np.float64]

MOST_POSES = 1000
"""Number of checked poses, evenly spaced over all."""

UNKNOWN = 30.0
"""Uncertainty of a light's brightness, as a factor of its strength: a lamp may be near, and a photograph varies."""

DARK, BRIGHT = 2.0**-10, 16.0
"""Radiances that every view transform shows as black and as white."""

DRAWS = 20
"""Number of random poses that are drawn for a mean."""

GRID = 32
"""Columns and rows of the pixels whose rays are tried."""

BLACK = 0.5
"""Share of the picture without rays that triggers a warning: the circle of a round fisheye leaves 0.21 of a square."""

MOSTLY = 2 / 3
"""Share of the picture covered by ground that triggers a warning; a level camera has half of the picture below the horizon."""

BLACKEST = 0.02
"""Reflectance of the darkest paint."""

SMALLEST = 12
"""Pixels, of the longer side of its box, below which an object is too small for most detectors."""

TOO_SMALL = f"which for most detectors is too small (under {SMALLEST})"


def unlit(scene: SceneEntry) -> Iterator[str]:
    """Yield warnings about settings that make a scene's pictures black, or white."""
    dark = not all(isinstance(sky, NightSky) for sky in alternatives(scene.sky))
    if dark and any(is_night(sun) for sun in alternatives(scene.sun)):
        yield "scene.sun: at this date, time and place the sun is below the horizon: there is none, and no daylight"
    yield from _no_light(scene)
    yield from _hidden_by_exposure(scene)


def doubtful_views(recipe: Recipe, views: Poses, rig: Rig) -> Iterator[str]:
    """Yield warnings about lenses that show little, and about viewpoints of the first sensor from which models are out of view
    or too small, or the background is hidden.
    """
    lens = rig.sensors[0].intrinsics
    for sensor in rig.sensors:
        yield from _mostly_black(sensor, "camera" if len(rig.sensors) == 1 else f"rig: sensor {sensor.name}")
    yield from _out_of_view(recipe, views, lens)
    yield from _hidden_background(recipe.scene, views, lens)
    yield from _too_small(recipe, views, lens)


def _mostly_black(sensor: Sensor, where: str) -> Iterator[str]:
    """A warning if most of the picture is outside of what the lens shows, by rays of a grid of pixels."""
    lens = sensor.intrinsics
    if lens.lens.is_straight or lens.lens.is_scan:
        return
    across, down = (np.linspace(0, size, GRID + 1)[:-1] + size / (2 * GRID) for size in (lens.width, lens.height))
    rays = lens.lens.rays(np.stack(np.meshgrid(across, down), axis=-1)).directions
    black = float(np.isnan(rays).any(axis=-1).mean())
    if black > BLACK:
        yield (
            f"{where}: the lens shows nothing in {100 * black:.0f} % of the picture, which is black there: set a larger focal "
            "length or a smaller size, or see whether the coefficients are those of this size"
        )


def _no_light(scene: SceneEntry) -> Iterator[str]:
    """A warning if there is no light at all, or none in some of the scenes that may be drawn."""
    dark = [] if scene.blend is not None else [high == 0 for _, high in _lights(scene)]
    if any(dark):
        some = "" if all(dark) else " in some of what may be drawn"
        yield (
            f"scene: no light{some}: sun, sky and lights are off or of strength 0: models are black, unless they shine by "
            "themselves; set scene.sun: on, or a strength"
        )


def _hidden_by_exposure(scene: SceneEntry) -> Iterator[str]:
    """A warning for an exposure that turns white into black, or black into white."""
    lit = [light for light in _lights(scene) if light[1] > 0]
    if not lit or scene.blend is not None or scene.view.exposure == "auto":
        return
    low, high = span(scene.view.exposure)
    if max(light[1] for light in lit) * 2**low < DARK:
        yield f"scene.view.exposure: at {low:g} stops white is black, and so is the picture; raise it, or the lights' strength"
    if BLACKEST * min(light[0] for light in lit) * 2**high > BRIGHT:
        yield f"scene.view.exposure: at {high:g} stops black is white, and so is the picture; lower it, or the lights' strength"


def _out_of_view(recipe: Recipe, views: Poses, lens: Intrinsics) -> Iterator[str]:
    """A warning if the models' centre is in no picture, or if jitter moves it out of some; random scenes are not checked.

    The models' sizes are not known yet: near ones may still be visible.
    """
    scene = recipe.scene
    if not lens.lens.is_linear or not views.are_known:
        return
    widest = math.hypot(max(lens.cx, lens.width - lens.cx) / lens.fx, max(lens.cy, lens.height - lens.cy) / lens.fy)
    chosen = _some(views)
    centres = [views.target(i) for i in chosen]
    away = [_offset(views, i) for i in chosen]
    if (
        recipe.scenes is None
        and not scene.is_composed
        and all(c is not None and _misses(np.array([c]), d, widest) for c, d in zip(centres, away, strict=True))
    ):
        yield (
            "viewpoints: the models' centre, which stands at the origin, is in no picture: pictures may be empty; "
            "look at it with target: center, or from farther away"
        )
        return
    ends = [span(component(scene.jitter.target, axis)) for axis in range(3)]
    corners = np.array(list(product(*ends)))
    if not corners.any():
        return
    least = 1 + span(scene.jitter.distance)[0]
    if any(_misses(corners, d * least, widest) for c, d in zip(centres, away, strict=True) if c is None):
        farthest = float(np.linalg.norm(corners, axis=1).max())
        yield (
            f"scene.jitter.target: up to {farthest:.3g} m move the models' centre out of the picture: pictures may be empty; "
            "ask for less, for a larger viewpoints.distance or for a larger camera.fov_deg"
        )


def _hidden_background(scene: SceneEntry, views: Poses, lens: Intrinsics) -> Iterator[str]:
    """A warning if an endless ground hides most of the background photographs, on average over the poses."""
    pictures = [entry for entry in scene.backgrounds if entry.image is not None or entry.images is not None]
    if not pictures or not scene.always_has_ground or lens.lens.is_parallel:
        return
    draws = [views.drawn_for(str(n)) for n in range(DRAWS)]  # scenes draw their own poses, few each
    hidden = fmean(_below_horizon(there.view(i).elevation, lens) for there in draws for i in _some(there, MOST_POSES // DRAWS))
    if hidden > MOSTLY:
        yield (
            f"scene.background: the endless ground hides about {100 * hidden:.0f} % of its pictures; set scene.ground: "
            "catcher, which shows shadows alone, or off"
        )


def _too_small(recipe: Recipe, views: Poses, lens: Intrinsics) -> Iterator[str]:
    """A warning for each entry whose models are smaller than `SMALLEST` pixels at the farthest viewpoint, if the recipe gives
    their length or the share of the picture that they fill.
    """
    chosen = _some(views)
    fills = [fill for i in chosen if (fill := views.fill(i)) is not None]
    pixels = min(fills, default=math.inf) * max(lens.width, lens.height)
    if pixels < SMALLEST:
        yield f"viewpoints.distance: a share of {min(fills):g} is {pixels:.2g} pixels, {TOO_SMALL}: ask for more"
    if fills or not views.are_known:
        return
    farthest = max(views.view(i).distance for i in chosen) * (1 + span(recipe.scene.jitter.distance)[1])
    scale = max(lens.fx, lens.fy) / (1.0 if lens.lens.is_parallel else farthest)
    for i, entry in enumerate(recipe.models):
        length = _length(entry)
        pixels = math.inf if length is None else length * scale
        if pixels < SMALLEST:
            yield (
                f"models[{i}]: {length:g} m seen from {farthest:g} m are about {pixels:.2g} pixels, {TOO_SMALL}: come "
                "nearer, or ask for larger pictures, a longer lens or distance: {fill: ...}"
            )


def _some(views: Poses, most: int = MOST_POSES) -> list[int]:
    """Numbers of at most `most` poses, evenly spaced over all."""
    # Not np.unique: it imports numpy.ma, 8 ms.
    return sorted(set(np.linspace(0, len(views) - 1, min(len(views), most)).round().astype(int).tolist()))


def _below_horizon(elevation_deg: float, lens: Intrinsics) -> float:
    """The share of a picture's height below the horizon, for a camera without tilt and distortion."""
    horizon = lens.cy - lens.fy * math.tan(math.radians(min(max(elevation_deg, -89), 89)))
    return min(max(1 - horizon / lens.height, 0.0), 1.0)


def _length(entry: ModelEntry) -> float | None:
    """The longest side, metres, of an entry's models, from their dimensions or from the measure to which they are scaled."""
    if isinstance(entry.scale, ScaleEntry):
        return span(entry.scale.goal[1])[0]
    size = entry.real_size if entry.scale == "real_size" else None
    return max(size.width, size.height, size.length) if isinstance(size, Dimensions) else None


def _offset(views: Poses, index: int) -> Float:
    """The offset (3,) from a camera's target to the camera."""
    view = views.view(index)
    return orbit_center(math.radians(view.azimuth), math.radians(view.elevation), view.distance)


def _misses(targets: Float, offset: Float, widest: float) -> bool:
    """Return whether the origin is outside the picture of a camera that looks at one of the targets (N, 3) from this offset
    (3,).
    """
    distance = float(np.linalg.norm(offset))
    along = targets @ (offset / distance)
    beside = np.linalg.norm(targets - along[:, None] * (offset / distance), axis=1)
    depth = distance + along
    return bool(((depth <= 0) | (beside > widest * np.maximum(depth, 0))).any())


def _lights(scene: SceneEntry) -> Iterator[tuple[float, float]]:
    """The approximate least and greatest radiance of white, for every possible pair of sky and sun."""
    lamps = 0.0
    for lamp in scene.lights:
        color = max(span(lamp.color)[1], span(getattr(lamp, "below", 0.0))[1])
        lamps += UNKNOWN * span(lamp.count)[1] * span(lamp.strength)[1] * color
    for sky, sun in product(alternatives(scene.sky), alternatives(scene.sun)):
        above, shining = _sky(sky, is_night(sun)), _sun(sun, isinstance(sky, HdriSky))
        yield above[0] + shining[0], above[1] + shining[1] + lamps


def _sky(sky: Any, night: bool) -> tuple[float, float]:
    if isinstance(sky, HdriSky):
        return span(sky.strength)[0] / UNKNOWN, span(sky.strength)[1] * UNKNOWN
    if isinstance(sky, NightSky):
        low, high = span(sky.night.glow)
        return low / 2, high + span(sky.night.moon)[1]
    if isinstance(sky, DaylightSky):
        low, high = span(sky.daylight.strength)
        return (0.0, 0.0) if night else (low / UNKNOWN, high * UNKNOWN)
    low, high = span(sky.strength)
    colors = [span(sky.zenith), span(sky.horizon)]
    return low * min(c[0] for c in colors), high * max(c[1] for c in colors)


def _sun(sun: Any, photographed: bool) -> tuple[float, float]:
    if sun == "off" or is_night(sun) or (sun == "auto" and photographed):
        return 0.0, 0.0
    entry = sun if isinstance(sun, SunEntry) else Sun()
    strength, color = span(entry.strength), span(entry.color)
    return 0.0, strength[1] * color[1] / math.pi
