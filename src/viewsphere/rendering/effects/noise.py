"""A sensor's noise: shot noise of photo-electrons and read noise of the electronics."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Portion
from viewsphere.plugins.effect import EffectSpec
from viewsphere.rendering.effects import EffectContext

Float32 = NDArray[np.float32]

ELECTRONS = 50.0
"""Photo-electrons that make white at strength 1."""

READ = 0.03
"""Sigma of the read noise at strength 1, white being 1."""


class _Noise(Frozen):
    """The strengths: the read noise is added to the light as the sensor counts it."""

    shot_noise: Portion = Field(default=0.0, description="shot noise, stronger in bright parts")
    read_noise: Portion = Field(default=0.0, description="sensor noise, equal everywhere")


def _apply(picture: Float32, options: _Noise, context: EffectContext) -> Float32:
    """The picture with shot and read noise, independent for each channel of each pixel, clipped to [0, 1].

    Light v becomes Poisson(v n) / n with n = ELECTRONS / shot_noise^2, so that its noise is proportional to the strength; then
    a Gaussian is added. Premultiplied colours get the noise of the unpremultiplied colour times alpha; alpha is unchanged. The
    same seed gives the same noise.
    """
    shot, read = options.shot_noise, options.read_noise
    rng = np.random.default_rng(context.seed)
    alpha = picture[..., 3:] if picture.shape[2] == 4 else np.ones((1, 1, 1), np.float32)
    light = picture[..., :3] / np.maximum(alpha, np.float32(1e-6))
    if shot > 0:
        electrons = ELECTRONS / shot**2
        light = (rng.poisson(light * electrons) / electrons).astype(np.float32)
    if read > 0:
        light = light + rng.standard_normal(light.shape, np.float32) * np.float32(READ * read)
    out = picture.copy()
    out[..., :3] = np.clip(light, 0, 1) * alpha
    return out


EFFECTS = (
    EffectSpec(
        name="shot_noise",
        options=_Noise,
        strongest="white is 50 photo-electrons: Poisson noise of 14 % of white, elsewhere in proportion to the square root",
        stage="sensor",
        order=10,
        apply=_apply,
        is_noisy=True,
        in_imager=True,
        record=11,
    ),
    EffectSpec(
        name="read_noise",
        options=_Noise,
        strongest="Gaussian noise of 3 % of white everywhere",
        stage="sensor",
        order=20,
        apply=_apply,
        is_noisy=True,
        in_imager=True,
        record=12,
    ),
)
