"""The faults of a lens that follow from its axis and from bright light, applied to light of which 1 saturates the sensor."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.camera import pixel_rays
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.sensors.imager import Imager
from viewsphere.rendering.scaling import scaled
from viewsphere.rendering.spread import gaussian, spread_both_ways

Float32 = NDArray[np.float32]

GHOSTS = ((-1.0, 2 / 3), (-0.5, 1 / 3))
"""Ghosts of a flare: their scale about the principal point, and their share of the flare's light."""

SOFT = 1 / 80
"""Sigma of a ghost's blur, in widths of the picture: ghosts are out of focus."""


def through_lens(light: Float32, imager: Imager, lens: Intrinsics) -> Float32:
    """The light (H, W, 3) behind the lens: lateral chromatic aberration, vignetting, flare and bloom, in this order."""
    red, blue = imager.chromatic_aberration
    if red or blue:
        light = light.copy()
        for channel, shift in ((0, red), (2, blue)):
            light[..., channel] = scaled(light[..., channel], 1 + shift, lens)
    if imager.cos4 or imager.vignetting:
        light = light * _falloff(lens, imager.cos4, imager.vignetting)[..., None]  # pyright: ignore[reportArgumentType]: it is frozen
    if imager.flare:
        light = (light + np.float32(imager.flare) * _ghosts(light, lens)).astype(np.float32)
    if imager.bloom:
        around = spread_both_ways(light, gaussian(imager.bloom_size * light.shape[1]))
        light = (light + np.float32(imager.bloom) * (around - light)).astype(np.float32)
    return light


@lru_cache(maxsize=4)
def _falloff(lens: Intrinsics, cos4: bool, polynomial: tuple[float, ...]) -> Float32:
    """Shares of light that reach each pixel, (H, W) float32; do not write to it. 0 where a pixel has no ray ahead."""
    squared = _radius_squared(lens)
    share = np.ones_like(squared)
    for i, a in enumerate(polynomial):
        share = share + a * squared ** (i + 1)
    if cos4:
        rays = pixel_rays(lens)
        with np.errstate(invalid="ignore", divide="ignore"):
            cosine = rays[..., 2] / np.sqrt((rays * rays).sum(axis=-1))
        share = share * np.where(cosine > 0, cosine, 0.0) ** 4
    return share.astype(np.float32)


def _radius_squared(lens: Intrinsics) -> NDArray[np.float64]:
    """Squared distance of each pixel's centre from the principal point, (H, W), 1 at the farthest corner of the picture."""
    x = (np.arange(lens.width) + 0.5 - lens.cx) ** 2
    y = (np.arange(lens.height) + 0.5 - lens.cy) ** 2
    corner = max(lens.cx, lens.width - lens.cx) ** 2 + max(lens.cy, lens.height - lens.cy) ** 2
    return (y[:, None] + x) / corner


def _ghosts(light: Float32, lens: Intrinsics) -> Float32:
    """Blurred images of the light, mirrored about the principal point; nothing comes from beyond the picture."""
    border = np.pad(light, ((1, 1), (1, 1), (0, 0)))
    inside = lens.model_copy(update={"cx": lens.cx + 1, "cy": lens.cy + 1})
    out = np.zeros_like(light)
    for scale, share in GHOSTS:
        for channel in range(3):
            out[..., channel] += np.float32(share) * scaled(border[..., channel], scale, inside)[1:-1, 1:-1]
    return spread_both_ways(out, gaussian(SOFT * light.shape[1]))
