"""Vignetting: a lens passes less light away from the axis."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Portion
from viewsphere.plugins.effect import EffectSpec
from viewsphere.rendering.effects import EffectContext

DARKEST = 0.1
"""Share of its light that the farthest corner keeps at strength 1."""


class _Vignetting(Frozen):
    """The strength."""

    vignetting: Portion = Field(default=0.0, description="darker corners")


def _apply(picture: NDArray[np.float32], options: _Vignetting, context: EffectContext) -> NDArray[np.float32]:
    """The picture with a falloff of cos^4 of the angle to the axis, scaled to the farthest corner's share; alpha is
    unchanged.
    """
    lens = context.seen.intrinsics
    height, width = picture.shape[:2]
    x = (np.arange(width, dtype=np.float32) + np.float32(0.5 - lens.cx)) ** 2
    y = (np.arange(height, dtype=np.float32) + np.float32(0.5 - lens.cy)) ** 2
    corner = max(lens.cx, width - lens.cx) ** 2 + max(lens.cy, height - lens.cy) ** 2
    tangent = (1 - (1 - DARKEST) * options.vignetting) ** -0.5 - 1  # squared, at the corner: cos^4 is (1 + tan^2)^-2
    share = 1 / np.square(1 + (y[:, None] + x) * np.float32(tangent / corner))
    out = picture.copy()
    out[..., :3] *= share[..., None]
    return out


EFFECT = EffectSpec(
    name="vignetting",
    options=_Vignetting,
    strongest="the farthest corner has a tenth of its light: cos^4 of an angle whose tangent grows with the radius",
    stage="lens",
    order=50,
    apply=_apply,
    shows_seam=True,
    in_imager=True,
    record=4,
)
