"""The sun's light as it arrives at the scene."""

from __future__ import annotations

import math
from dataclasses import dataclass

from viewsphere.geometry.camera import orbit_center
from viewsphere.model.scene import AnySky, Daylight, Sun
from viewsphere.rendering.sky.daylight import air, opening


@dataclass(frozen=True)
class Distant:
    """A light so far away that its rays are parallel: unit direction to it, irradiance facing it, angular diameter."""

    direction: tuple[float, float, float]
    irradiance: tuple[float, float, float]
    angle_deg: float


def distant_sun(sun: Sun) -> Distant:
    """A recipe's sun as a distant light."""
    x, y, z = orbit_center(math.radians(sun.azimuth), math.radians(sun.elevation), 1.0).tolist()
    r, g, b = (sun.strength * c for c in sun.color)
    return Distant((x, y, z), (r, g, b), sun.angle_deg)


def sun_light(sky: AnySky, sun: Sun | None) -> Distant | None:
    """The sun's light as it arrives, dimmed and reddened by daylight's air; None if the sun does not shine."""
    if sun is None or sun.strength <= 0:
        return None
    light = distant_sun(sun)
    if isinstance(sky, Daylight):
        left = opening(sun.elevation, sky) * air(sun.elevation, sky) * light.irradiance
        light = Distant(light.direction, (float(left[0]), float(left[1]), float(left[2])), light.angle_deg)
    return light if max(light.irradiance) > 1e-6 else None
