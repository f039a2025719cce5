"""A Gaussian blur, uniform across the picture."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Portion
from viewsphere.plugins.effect import EffectSpec
from viewsphere.rendering.effects import EffectContext
from viewsphere.rendering.spread import gaussian, spread_both_ways

SIGMA = 1 / 50
"""Sigma of the Gaussian at strength 1, in widths of the picture."""


class _Blur(Frozen):
    """The strength."""

    blur: Portion = Field(default=0.0, description="defocus, as a Gaussian")


def _apply(picture: NDArray[np.float32], options: _Blur, context: EffectContext) -> NDArray[np.float32]:
    """The picture blurred by a Gaussian, in linear light, across the seam of a full turn; the sum of the light is kept."""
    return spread_both_ways(picture, gaussian(options.blur * SIGMA * picture.shape[1]), context.shows_full_turn)


EFFECT = EffectSpec(
    name="blur",
    options=_Blur,
    strongest="a Gaussian of sigma W / 50",
    stage="lens",
    order=30,
    apply=_apply,
    record=1,
)
