"""A sensor's noise: shot noise of photo-electrons and read noise of the electronics."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]

ELECTRONS = 50.0
"""Photo-electrons that make white at strength 1."""

READ = 0.03
"""Sigma of the read noise at strength 1, white being 1."""


def noise(picture: Float32, shot: float, read: float, seed: int) -> Float32:
    """The picture with shot and read noise, independent for each channel of each pixel, clipped to [0, 1].

    Light v becomes Poisson(v n) / n with n = ELECTRONS / shot^2, then a Gaussian is added. Premultiplied colours get the noise
    of the unpremultiplied colour times alpha; alpha is unchanged. The same seed gives the same noise.
    """
    if shot == 0 and read == 0:
        return picture
    rng = np.random.default_rng(seed)
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
