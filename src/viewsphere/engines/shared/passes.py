"""The split of a picture's light into passes, so that albedo x shading + residual is the whole light."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]


def shading_of(albedo: Float32, diffuse: Float32) -> Float32:
    """Diffuse light (H, W, 3) over albedo: the same light from a white surface.

    If a channel of the albedo is 0, the shading's channel is the mean of the others; if all are 0, the shading is 0.
    """
    has = albedo > 0
    shading = np.divide(diffuse, albedo, out=np.zeros(albedo.shape, np.float32), where=has)
    some = ~has.all(axis=-1)
    known = has[some]
    mean = shading[some].sum(axis=-1, keepdims=True) / np.maximum(known.sum(axis=-1, keepdims=True), 1).astype(np.float32)
    shading[some] = np.where(known, shading[some], mean)
    return shading
