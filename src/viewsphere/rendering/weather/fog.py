"""The air between objects and the camera: Koschmieder's law (1924), in scene-linear light, with range along the ray.

I = J exp(-d) + A (1 - exp(-d)): J is the light of a surface, A the light of the air. d, the optical depth of the ray, has a
closed form: extinction times range. If the air is e times thinner every `height` metres above z = 0, d is the integral.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.camera import pixel_rays
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.weather import Fog

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]

LEVEL = 1e-6
"""Rise of a ray, in units of the fog's height, below which the ray counts as level."""

OPAQUE = 80.0
"""Optical depth of rays without end."""


@dataclass(frozen=True, eq=False)
class Air:
    """The air along rays.

    eye: the height from which they begin, or the heights (N,) of parallel rays; stretch (N,): metres of range for a metre of
    their depth (see `Visibility`); rise (N,): sine of their elevation. is_outdoors: the air is beyond the windows of a room,
    and only ground and sky are visible through it.
    """

    fog: Fog
    eye: float | Float
    stretch: Float32
    rise: Float32
    is_outdoors: bool = False

    @classmethod
    def for_camera(
        cls,
        fog: Fog,
        camera: Camera,
        rays: NDArray[np.floating] | None = None,
        is_outdoors: bool = False,
        at: NDArray[np.floating] | None = None,
    ) -> Air:
        """The air in front of a camera, along rays (N, 3) in its axes through positions `at` (N, 2), by default through its
        pixel centres.
        """
        ray = np.nan_to_num(pixel_rays(camera.intrinsics).reshape(-1, 3) if rays is None else rays)
        length = np.sqrt((ray * ray).sum(axis=1))
        rise = (ray @ camera.R[:, 2]) / np.maximum(length, 1e-12)
        eye: float | Float = float(camera.center[2])
        if camera.lens.is_parallel:
            begin = camera.lens.origins().reshape(-1, 3) if at is None else camera.lens.rays(at).origins
            eye = eye + begin @ camera.R[:, 2]
        return cls(fog, eye, length.astype(np.float32), rise.astype(np.float32), is_outdoors)

    def depth(self, inverse: Float32, which: NDArray[np.integer] | slice = slice(None)) -> Float32:
        """Optical depth (n,) of the rays with these indices, from the eye to the surface with this 1/depth; 0 is the sky."""
        with np.errstate(divide="ignore", over="ignore"):
            away = self.stretch[which] / inverse
            if self.fog.height is None:
                return np.minimum(away * self.fog.extinction, OPAQUE).astype(np.float32)
            eye = self.eye[which] if isinstance(self.eye, np.ndarray) else self.eye
            begin = self.fog.extinction * np.exp(-np.clip(eye / self.fog.height, -80.0, 80.0))
            rate = (self.rise[which] / self.fog.height).astype(np.float64)
            level = np.abs(rate) < LEVEL
            climbed = np.clip(np.where(level, 0.0, rate) * np.where(np.isinf(away), 1e9, away), -60, 700)
            bent = -np.expm1(-climbed) / np.where(level, 1.0, rate)
            found: Float = np.minimum(begin * np.where(level, away, bent), OPAQUE)
            return found.astype(np.float32)

    def veil(self, radiance: Float32, depth: Float32, which: NDArray[np.integer] | slice = slice(None)) -> None:
        """Dim light (N, 4), premultiplied, by an optical depth, and add the air's own light over the covered part, in place."""
        through = np.exp(-depth)
        light = radiance[which]
        color = np.array(self.fog.color, np.float32)
        light[:, :3] = light[:, :3] * through[:, None] + (light[:, 3] * (1 - through))[:, None] * color
        radiance[which] = light

    def behind(self, sky: Float32, alpha: Float32) -> Float32:
        """The sky's light (N, 3) seen through the air, if `alpha` (N,) of it is hidden already."""
        through = np.exp(-self.depth(np.zeros(len(sky), np.float32)))
        glow = ((1 - alpha) * (1 - through))[:, None] * np.array(self.fog.color, np.float32)
        return np.add(sky * through[:, None], glow, dtype=np.float32)
