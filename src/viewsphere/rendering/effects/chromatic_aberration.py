"""Chromatic aberration: a lens enlarges each colour differently."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Portion
from viewsphere.plugins.effect import EffectSpec
from viewsphere.rendering.effects import EffectContext
from viewsphere.rendering.scaling import scaled

Float32 = NDArray[np.float32]

SPLIT = 0.01
"""Enlargement of red at strength 1, and reduction of blue."""


class _ChromaticAberration(Frozen):
    """The strength."""

    chromatic_aberration: Portion = Field(default=0.0, description="coloured edges towards the corners")


def _apply(picture: Float32, options: _ChromaticAberration, context: EffectContext) -> Float32:
    """The picture with red and blue scaled about the principal point in opposite directions; alpha covers all three
    channels.
    """
    intrinsics = context.seen.intrinsics
    out = picture.copy()
    for channel, sign in ((0, 1), (2, -1)):
        scale = 1 + sign * SPLIT * options.chromatic_aberration
        out[..., channel] = scaled(picture[..., channel], scale, intrinsics)
        if picture.shape[2] == 4:
            np.maximum(out[..., 3], scaled(picture[..., 3], scale, intrinsics), out=out[..., 3])
    return out


EFFECT = EffectSpec(
    name="chromatic_aberration",
    options=_ChromaticAberration,
    strongest="red 1 % larger and blue 1 % smaller than green, about the principal point",
    stage="lens",
    order=40,
    apply=_apply,
    shows_seam=True,
    in_imager=True,
    record=5,
)
