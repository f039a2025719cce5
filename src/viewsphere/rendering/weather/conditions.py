"""The effect of weather on the light of sun and sky: clouds cover them, fog spreads the remaining light.

A layer of optical depth t lets exp(-t / sine of the sun's elevation) of the sun pass as a beam, and of all light 1 / (1 + 3/4
(1 - g) t), with asymmetry g, according to the two-stream approximation (Meador and Weaver 1980).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from viewsphere.model.scene import AnySky, Color, Daylight, Environment, HemisphereLight, Sky, Sun
from viewsphere.model.weather import Fog
from viewsphere.rendering.sky.sky import received, sky_pictures
from viewsphere.rendering.sky.sun import sun_light

Float = NDArray[np.float64]

ASYMMETRY = 0.85
"""Scattering asymmetry of droplets in cloud and fog."""

LAYER = 60.0
"""Default thickness of the fog layer overhead, in metres."""

DARK = 0.3
"""Brightness of rain and snow clouds relative to others, at a photographer's exposure."""

METERED = 0.85
"""Radiance of thick fog as a photographer exposes it: a light grey."""

CLOUD = 0.4
"""Share of a clear sky's light, sun included, that passes through clouds, after a photographer's partial compensation."""


def floor_light(sun: Sun | None, sky: AnySky) -> Float:
    """Radiance (3,) of a white level floor under sun and sky."""
    return received(sky_pictures(sky, sun, (), True).lighting, sun_light(sky, sun))


def clouded(sun: Sun | None, sky: AnySky, clouds: float) -> tuple[Sun | None, AnySky]:
    """Sun and sky with this share of the sky covered by clouds. A photographed sky shows its own clouds, and dims with its
    sun.
    """
    if not clouds:
        return sun, sky
    if isinstance(sky, Daylight):
        return sun, sky.model_copy(update={"clouds": max(sky.clouds, clouds), "strength": sky.strength * (1 - DARK * clouds)})
    left = None if sun is None or clouds == 1 else sun.model_copy(update={"strength": sun.strength * (1 - clouds)})
    if isinstance(sky, Environment):
        return left, sky.model_copy(update={"strength": sky.strength * (1 - clouds * (1 - CLOUD))})
    level = clouds * CLOUD * float(floor_light(sun, sky).mean())
    # CIE's overcast sky is three times as bright overhead as at the horizon; in a gradient's
    # proportions a white floor under it has a radiance of 14/15 of the zenith's.
    return left, Sky(
        zenith=_mixed(sky, sky.zenith, clouds, level * 15 / 14), horizon=_mixed(sky, sky.horizon, clouds, level * 5 / 14)
    )


def _mixed(sky: Sky, color: Color, clouds: float, level: float) -> Color:
    """A sky colour with this share covered by clouds of this radiance."""
    r, g, b = ((1 - clouds) * sky.strength * c + level for c in color)
    return r, g, b


def in_fog(sun: Sun | None, sky: AnySky, fog: Fog) -> tuple[Sun | None, AnySky, HemisphereLight | None, Float]:
    """Sun and sky as seen through fog, the additional light that ground fog scatters, and the radiance (3,) of the fog."""
    depth = fog.extinction * (fog.height or LAYER)
    total, beam = floor_light(sun, sky), sun_light(sky, sun)
    light = total / (1 + 0.75 * (1 - ASYMMETRY) * depth)
    thick = 1 - math.exp(-fog.extinction * LAYER)
    closed = min(METERED / max(float(light.mean()), 1e-9), 1.0) ** thick
    light *= closed
    left, direct = None, np.zeros(3)
    if sun is not None and beam is not None:
        sine = beam.direction[2]
        passed = closed * np.array(beam.irradiance) * math.exp(-depth / max(sine, 0.05))
        strength = float(passed.max())
        if strength > 1e-4:
            r, g, b = (passed / strength).tolist()
            left = sun.model_copy(update={"strength": strength, "color": (r, g, b)})
            direct = passed * sine / math.pi
    if fog.height is None:
        r, g, b = np.maximum(light - direct, 0).tolist()
        return left, Sky(zenith=(r, g, b), horizon=(r, g, b)), None, light
    if isinstance(sky, Daylight):
        return sun, sky, None, light  # its sun follows from the air above; ground fog is thin
    sky = sky.model_copy(update={"strength": sky.strength * closed})
    spread = np.maximum(light - direct - received(sky_pictures(sky, None, (), True).lighting, None), 0)
    r, g, b = spread.tolist()
    return left, sky, HemisphereLight(strength=1.0, color=(r, g, b)), light
