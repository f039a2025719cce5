"""Workbench's studio light, which can imitate only the sun and two hemispheres: the sky and the light from below."""

from __future__ import annotations

import math

import bpy
import numpy as np

DARKEST = 0.6
"""Largest share of the light that shadows remove: Workbench darkens faces turned away from the sun as much, though the sun
gives them nothing.
"""

TURNED = 0.05
"""Cosine of the angle between the sun and a surface's normal below which Workbench treats the surface as shadowed."""


def light(display, lights, hemispheres):
    """Light the display's studio by the sun among the `lights`, and by `hemispheres` (2, 3), the radiance of a white matt
    surface that faces up, and of one that faces down; None leaves Blender's own studio as it is.
    """
    if hemispheres is None:
        return
    system, shading = bpy.context.preferences.system, display.shading
    above, below = np.array(hemispheres)
    sun = next((one for one in lights if one["kind"] == "sun"), None)
    direct = np.zeros(3) if sun is None else np.array(sun["irradiance"]) / math.pi
    toward = (0.0, 0.0, 1.0) if sun is None else sun["direction"]
    system.use_studio_light_edit = True
    least = np.minimum(above, below)
    system.light_ambient = least.tolist()
    for lamp in system.solid_lights:
        lamp.use, lamp.specular_color = False, (0, 0, 0)
    # A studio lamp of smoothness 1 gives (1 + cosine) / 4 of its colour.
    for lamp, way, more in zip(system.solid_lights, (1.0, -1.0), (above - least, below - least), strict=False):
        _shine(lamp, (0.0, 0.0, way), 2 * more, 1.0)
    _shine(system.solid_lights[2], toward, direct, 0.0)
    shading.use_world_space_lighting = True
    shading.show_shadows = sun is not None
    if sun is not None:
        lit = direct.mean() * max(toward[2], 0.05)
        shading.shadow_intensity = min(float(lit / (lit + above.mean())), DARKEST)
        display.shadow_shift, display.shadow_focus = TURNED, 1 - TURNED
        display.light_direction = _turned(toward)


def _shine(lamp, toward, color, smooth):
    lamp.use, lamp.smooth = True, smooth
    lamp.direction, lamp.diffuse_color = _turned(toward), color.tolist()


def _turned(direction):
    """A direction of the world in a studio's axes."""
    x, y, z = direction
    return x, z, -y
