"""The blur of a camera that moves during the exposure, uniform across the picture."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Number, Portion
from viewsphere.plugins.effect import EffectSpec
from viewsphere.rendering.effects import EffectContext
from viewsphere.rendering.spread import spread

Float32 = NDArray[np.float32]

STREAK = 1 / 12
"""Length of the streak at strength 1, in widths of the picture."""


class _MotionBlur(Frozen):
    """The strength, and the direction."""

    motion_blur: Portion = Field(default=0.0, description="blur from camera motion")
    motion_angle_deg: Number = Field(default=0.0, description="direction of the motion blur: counter-clockwise from the right")


def _apply(picture: Float32, options: _MotionBlur, context: EffectContext) -> Float32:
    """The mean of the picture along a straight streak, across the seam of a full turn."""
    kernel = streak(options.motion_blur * STREAK * picture.shape[1], options.motion_angle_deg)
    return spread(picture, kernel, context.shows_full_turn)


def streak(length: float, angle_deg: float) -> Float32:
    """Weights of a centred segment of this length in pixels: each is the share of the segment in a bilinear pixel."""
    steps = max(1, math.ceil(8 * length))
    along = ((np.arange(steps) + 0.5) / steps - 0.5) * length
    x, y = along * math.cos(math.radians(angle_deg)), -along * math.sin(math.radians(angle_deg))
    across, down = math.ceil(abs(x).max()), math.ceil(abs(y).max())
    kernel = np.zeros((2 * down + 3, 2 * across + 3))
    left, top = np.floor(x), np.floor(y)
    for right_side in (0, 1):
        for bottom in (0, 1):
            weight = np.abs(1 - right_side - (x - left)) * np.abs(1 - bottom - (y - top))
            row, column = (top + bottom).astype(int) + down + 1, (left + right_side).astype(int) + across + 1
            np.add.at(kernel, (row, column), weight)
    return (kernel / steps).astype(np.float32)


EFFECT = EffectSpec(
    name="motion_blur",
    options=_MotionBlur,
    strongest="a straight streak of length W / 12",
    stage="lens",
    order=20,
    apply=_apply,
    shows_motion=True,
    record=2,
)
