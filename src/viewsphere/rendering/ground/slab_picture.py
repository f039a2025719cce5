"""The floor of slabs as a picture, for renderers that do not know its formula (`kernels_slabs`)."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from viewsphere.assets.mesh import Image, Material, Texture
from viewsphere.assets.srgb import encoded
from viewsphere.rendering.ground.kernels_slabs import shades
from viewsphere.rendering.ground.material import PERIOD, SLABS

TEXELS = 1024
"""Side of the slabs' picture; it shows `PERIOD` slabs a side."""

_BRIGHTEST = 1.44
"""No shade of the slabs is greater."""


def laid_with_slabs(material: Material) -> tuple[Material, tuple[Image, ...]]:
    """The ground's material with a picture of its slabs."""
    r, g, b, a = material.base_color
    picture = _slab_picture()
    used = replace(
        material,
        base_color=(r * _BRIGHTEST, g * _BRIGHTEST, b * _BRIGHTEST, a),
        base_color_texture=Texture(0, scale=(SLABS / PERIOD, SLABS / PERIOD)),
    )
    return used, (picture,)


@lru_cache(maxsize=1)
def _slab_picture() -> Image:
    """One period of the slabs, as a share of `_BRIGHTEST`."""
    at = ((np.arange(TEXELS) + 0.5) * (PERIOD / TEXELS)).astype(np.float32)
    x, y = (np.ascontiguousarray(v).reshape(-1) for v in np.broadcast_arrays(at, at[:, None]))
    tone = np.empty(TEXELS * TEXELS, np.float32)
    shades(x, y, np.float32(PERIOD / TEXELS), tone)
    pixels = np.full((TEXELS, TEXELS, 4), 255, np.uint8)
    grey = np.rint(encoded(tone.reshape(TEXELS, TEXELS) / _BRIGHTEST) * 255).astype(np.uint8)
    pixels[..., :3] = grey[..., None]
    return Image("slabs", pixels)
