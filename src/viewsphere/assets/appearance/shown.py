"""The texels of a picture that triangles show."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import Texture


def shown_texels(texture: Texture, uv: NDArray[np.float64], shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Texels (H, W) of a picture of this shape that triangles with corners `uv` (T, 3, 2) show: those whose
    centre lies in a triangle, and each triangle's own centre.

    For a triangle wider than the picture, or beyond the edge of a clamped picture, the whole bounding box counts. The texture's
    offset and scale apply; the texture must not be rotated or mirrored.
    """
    from viewsphere.assets.appearance.kernels_coverage import add_triangles

    uv = uv * texture.scale + texture.offset
    uv = uv[np.isfinite(uv).all(axis=(1, 2))]
    clamped = np.array([texture.wrap_s == "clamp", texture.wrap_t == "clamp"])
    low, high = uv.min(axis=1), uv.max(axis=1)
    outside = np.where(clamped, (low < 0) | (high > 1), high - low > 1).any(axis=1)
    period = np.where(clamped, 0.0, np.floor(low))
    last = np.nextafter(1.0, 0.0)
    uv, low, high = (
        np.where(clamped, np.clip(corner - start, 0.0, last), corner - start)
        for corner, start in ((uv, period[:, None]), (low, period), (high, period))
    )
    high = np.minimum(high, low + 1.0)
    box = np.stack([low, np.column_stack([high[:, 0], low[:, 1]]), high, np.column_stack([low[:, 0], high[:, 1]])], axis=1)
    box = box[outside]
    steps = np.zeros((shape[0], shape[1] + 1), np.int32)
    size = np.array([shape[1], shape[0]], np.float64)
    add_triangles(steps, np.concatenate([uv[~outside], box[:, [0, 1, 2]], box[:, [0, 2, 3]]]) * size)
    return np.cumsum(steps, axis=1, out=steps)[:, :-1] > 0
