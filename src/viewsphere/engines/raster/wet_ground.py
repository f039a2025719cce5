"""What wet ground mirrors: in puddles sharply, in the film on rough ground drawn out along the picture's columns.

The film's own mirror image of the sky is part of its material; here is what things in front of that sky change.
"""

from __future__ import annotations

import numpy as np

from viewsphere.assets.wetting import FILM
from viewsphere.engines.raster.mirroring import blurred, looked_at, lying, mirrored
from viewsphere.engines.raster.painting import Baked
from viewsphere.engines.raster.records import Float32
from viewsphere.model.camera import Camera
from viewsphere.model.classes import STUFF_IDS
from viewsphere.model.weather import Wet
from viewsphere.surroundings.puddles import puddles
from viewsphere.truth.visibility import Visibility

LOW = 0.3
"""Metres above the ground up to which a surface mirrors, and is not mirrored: kerbs and pavements lie in between."""

LEVEL = 0.97
"""z of a normal from which on a surface mirrors."""

WATER = 0.02
"""Reflectance of water at normal incidence."""

PAVED = [STUFF_IDS[name] for name in ("ground", "scenery", "road", "road marking", "pavement")]
"""Classes that mirror."""

DRAWN_OUT = 30, 150
"""The picture's height over the reach of a film's blur, down and across."""

UNDER_WATER = 0.35
"""Share of a puddle's ground that is not seen for what swims in it."""


def mirror_in_water(baked: Baked, camera: Camera, visibility: Visibility, wet: Wet, radiance: Float32) -> None:
    """Add to `radiance` (H * W, 4) of a picture, in place, what its wet ground mirrors."""
    geometry, shown = baked.geometry, visibility.triangle.reshape(-1)
    plane = 0.0 if geometry.has_scenery or geometry.ground_z is None else geometry.ground_z  # in a place things stand on 0
    if camera.center[2] <= plane + LOW:
        return
    low = lying(geometry, plane + LOW)
    is_mirror = low & (baked.surfaces.normals[:, 2] > LEVEL) & np.isin(geometry.triangle_class, PAVED)
    at = np.flatnonzero((shown >= 0) & is_mirror[shown])
    if not len(at):
        return
    cosine, place = looked_at(camera, visibility, at)
    water = WATER + (1 - WATER) * (1 - cosine) ** 5
    deep = puddles(wet, place[:, 0], place[:, 1])
    radiance[at, :3] *= 1 - (UNDER_WATER * deep)[:, None]
    seen = mirrored(baked, camera, plane, low, at)
    image = (water[:, None] * (seen.things - seen.hidden * seen.sky)).astype(np.float32)
    reach = max(1, camera.height // DRAWN_OUT[0]), max(1, camera.height // DRAWN_OUT[1])
    film = wet.amount * FILM * (1 - deep)[:, None] * blurred(image, at, camera, reach)
    pool = deep[:, None] * (image + (1 - wet.amount * FILM) * water[:, None] * seen.sky)
    radiance[at, :3] = np.maximum(radiance[at, :3] + film + pool, 0)
