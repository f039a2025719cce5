"""JPEG compression, as in a camera or on the web."""

from __future__ import annotations

import io

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Portion
from viewsphere.plugins.effect import EffectSpec
from viewsphere.rendering.effects import EffectContext

BEST, WORST = 95, 5
"""JPEG's qualities just above strength 0, and at strength 1."""


class _Jpeg(Frozen):
    """The strength."""

    jpeg: Portion = Field(default=0.0, description="traces of compression")


def _apply(pixels: NDArray[np.uint8], options: _Jpeg, _context: EffectContext) -> NDArray[np.uint8]:
    """Bytes (H, W, 3) or (H, W, 4) encoded and decoded again, with colours at half the resolution; alpha is unchanged."""
    from PIL import Image

    buffer = io.BytesIO()
    quality = round(BEST + (WORST - BEST) * options.jpeg)
    Image.fromarray(np.ascontiguousarray(pixels[..., :3])).save(buffer, "JPEG", quality=quality, subsampling="4:2:0")
    out = pixels.copy()
    with Image.open(buffer) as image:
        out[..., :3] = np.asarray(image)
    return out


EFFECT = EffectSpec(
    name="jpeg",
    options=_Jpeg,
    strongest="quality 5 (95 just above strength 0), colours at half the resolution",
    stage="file",
    order=10,
    apply=_apply,
    record=13,
)
