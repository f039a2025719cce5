"""Skies as pictures of the whole sphere: the light on the scene, and the sky visible behind it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from viewsphere.model.scene import AnyLight, AnySky, Daylight, Environment, HemisphereLight, Sky, Sun
from viewsphere.rendering.sky.daylight import daylight_picture, opening
from viewsphere.rendering.sky.sun import Distant, sun_light

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]

SURROUNDINGS = 0.3
"""Reflectance of the assumed ground below a synthetic sky's horizon if the scene has no ground."""

HALO = 0.32
"""Radiance of the glow around the sun in a gradient, as a share of the sun's irradiance."""

HEIGHT = 256
"""Rows of the picture made from a gradient or daylight."""


class SkyPictures(NamedTuple):
    """Equirectangular radiance (H, W, 3) float32: rows from the zenith down, the middle towards +X, the left quarter towards
    +Y; both are rotated by turn_deg about z, counter-clockwise from above. `seen` is the object `lighting` if both are equal.
    """

    lighting: Float32
    seen: Float32
    turn_deg: float


def sky_pictures(sky: AnySky, sun: Sun | None, lights: Sequence[AnyLight], has_ground: bool) -> SkyPictures:
    """The sky with the light of all hemisphere lights, without the sun except in photographs that show it.

    Without a ground, the area below a synthetic sky is grey and reflects the light that it receives. Raises RecipeError when a
    picture cannot be read.
    """
    from viewsphere.rendering.sky.environment_file import read_environment  # imports llvmlite, which planning does not need

    even = even_light(lights)
    if isinstance(sky, Environment):
        seen = read_environment(Path(sky.file)).pixels * np.float32(sky.strength)
        return SkyPictures(_with_even(seen, even), seen, sky.rotation_deg)
    sine = np.sin((0.5 - (np.arange(HEIGHT) + 0.5) / HEIGHT) * np.pi)
    if isinstance(sky, Daylight):
        sun = sun or Sun()
        factor = sky.strength * opening(sun.elevation, sky)
        picture = daylight_picture(sun.elevation, sky, HEIGHT) * np.float32(factor)
        turn_deg, seen = sun.azimuth - 90, picture
    else:
        picture = _gradient(sky, sine)
        turn_deg, seen = 0.0, picture + _halo(sun_light(sky, sun), sine)
    lighting = _with_even(picture, even)
    if not has_ground:
        below = even[1] + SURROUNDINGS * received(lighting, sun_light(sky, sun))
        lighting = np.where((sine > 0)[:, None, None], lighting, below).astype(np.float32)
    return SkyPictures(lighting, seen, turn_deg)


def even_light(lights: Sequence[AnyLight]) -> Float:
    """Radiance from above and from below that all hemisphere lights add to the ambient light, (2, 3).

    For a surface normal with this z: irradiance / pi = above * (1 + z) / 2 + below * (1 - z) / 2.
    """
    even = [light for light in lights if isinstance(light, HemisphereLight)]
    return sum((light.strength * np.array([light.color, light.below]) for light in even), np.zeros((2, 3)))


def gradient_share(sine: Float) -> Float:
    """Place of a gradient's colour between the horizon's (0) and the zenith's (1), by the sine of the elevation."""
    return 1 - (1 - np.maximum(sine, 0)) ** 3


def _gradient(sky: Sky, sine: Float) -> Float32:
    zenith, horizon = (sky.strength * np.array(c) for c in (sky.zenith, sky.horizon))
    colors = horizon + gradient_share(sine)[:, None] * (zenith - horizon)
    return np.repeat(colors[:, None].astype(np.float32), 2 * HEIGHT, axis=1)


def _halo(sun: Distant | None, sine: Float) -> Float32:
    """Glow around the sun, (H, W, 3)."""
    if sun is None:
        return np.zeros((1, 1, 3), np.float32)
    azimuth = math.pi - (np.arange(2 * HEIGHT) + 0.5) / HEIGHT * math.pi
    x, y, z = sun.direction
    level = x * np.cos(azimuth) + y * np.sin(azimuth)
    toward = np.maximum(np.sqrt(1 - sine**2)[:, None] * level + z * sine[:, None], 0)
    share = 0.12 * toward**4 + 0.25 * toward**24
    return (share[..., None] * HALO * np.array(sun.irradiance)).astype(np.float32)


def _with_even(picture: Float32, even: Float) -> Float32:
    """The picture with more light from above and from below; the same array if there is no such light."""
    if not even.any():
        return picture
    half = len(picture) // 2
    lighting = picture.copy()
    lighting[:half] += even[0].astype(np.float32)
    lighting[half:] += even[1].astype(np.float32)
    return lighting


def received(lighting: Float32, sun: Distant | None) -> Float:
    """Radiance (3,) of a white level floor lit by the upper half of a picture (H, W, 3) and by the sun."""
    height = len(lighting)
    sine = np.sin((0.5 - (np.arange(height) + 0.5) / height) * np.pi)
    weight = np.maximum(sine, 0) * np.sqrt(1 - sine**2) * (2 * math.pi / height)
    up = weight @ lighting.mean(axis=1, dtype=np.float64)
    return up if sun is None else up + np.array(sun.irradiance) * sun.direction[2] / math.pi
