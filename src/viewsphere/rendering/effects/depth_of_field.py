"""Depth of field from exact depth."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Length, Portion
from viewsphere.plugins.effect import EffectSpec
from viewsphere.rendering.effects import EffectContext
from viewsphere.rendering.spread import box, spread_both_ways

Float32 = NDArray[np.float32]
Mask = NDArray[np.bool_]

FAR = 1 / 40
"""Radius, in widths, of the disc that a point at infinity becomes at strength 1."""

NEAREST = 2.0
"""Largest disc, as a multiple of `FAR`: discs stop growing nearer than a third of the focus distance."""

TAPS = 24
"""Largest radius, in pixels, of a disc whose pixels are all visited. In larger discs, every second (third, ...) pixel
represents its neighbours.
"""

STEP = 1.0
"""Largest difference, in pixels, between the disc radii of neighbouring pixels of one surface."""


class _DepthOfField(Frozen):
    """The strength, and the distance of the sharp plane."""

    depth_of_field: Portion = Field(default=0.0, description="blur of surfaces nearer or farther than focus")
    focus: Length | None = Field(default=None, description="metres; default: the distance of the camera's target")


def _apply(picture: Float32, options: _DepthOfField, context: EffectContext) -> Float32:
    """The picture through a thin lens whose sharp plane is `focus` metres away.

    Every pixel is spread over its disc. A pixel behind a sharp or less blurred pixel does not spread over that pixel. A pixel
    in front of the focus spreads over everything, and the background behind its soft border is filled in from the
    neighbourhood. Pixels at a depth step show both sides: before the spreading, they get the colour of their own side;
    afterwards, they are softened over three pixels.
    """
    largest = options.depth_of_field * FAR * picture.shape[1]
    if largest < 1e-3:
        return picture
    from viewsphere.rendering.effects.shared import kernels_focus as kernels

    signed = circle_radius(context.seen.inverse_depth, options.focus or context.seen.distance, largest)
    step = _steps(signed)
    picture = _one_sided(picture, signed, step)
    stride = max(1, math.ceil(float(np.abs(signed).max()) / TAPS))
    if stride > 1:
        picture = _thinned(picture, np.abs(signed), stride)
    margin = math.ceil(float(np.abs(signed).max())) + stride
    around = ((margin, margin), (margin, margin + kernels.LINE))
    signed = np.pad(signed, around, mode="edge")
    radius = np.abs(signed)
    known = [signed, radius, np.clip(signed - np.float32(0.5), 0, 1), 1 / disc_area(radius, stride)]
    colors = np.pad(np.moveaxis(picture, 2, 0), ((0, 0), *around), mode="edge")
    out = np.empty_like(picture)
    kernels.spread_discs(np.stack([*known, *colors, np.ones_like(signed)]), margin, stride, out)
    soft = spread_both_ways(out, np.array([0.25, 0.5, 0.25], np.float32))
    return np.where(step[..., None], soft, out)


def circle_radius(inverse_depth: Float32, focus: float, largest: float) -> Float32:
    """Radius in pixels of the circle of confusion, above 0 in front of the focus, below 0 behind it; float32. Inverse depth is
    (H, W), 0 infinitely far.

    A thin lens of aperture A, its sensor v pixels behind it, shows a point at z as a disc of diameter A v |1/z - 1/focus|,
    which is proportional to |focus / z - 1|: `largest` is the radius at infinity.
    """
    relative = inverse_depth * np.float32(focus) - np.float32(1)
    return np.minimum(relative, np.float32(NEAREST)) * np.float32(largest)


def disc_area(radius: Float32, stride: int = 1) -> Float32:
    """Sum of the weights clip(radius + 1/2 - distance, 0, 1) over a disc's pixels, in units of the stride."""
    reach = math.ceil(float(radius.max()) / stride + 0.5)
    steps = np.arange(0, 16 * reach + 2) / 16
    y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    distance, count = np.unique(np.hypot(y, x), return_counts=True)
    areas = np.clip(steps[:, None] + 0.5 - distance, 0, 1) @ count
    return np.interp(radius / stride, steps, areas).astype(np.float32)


def _thinned(picture: Float32, radius: Float32, stride: int) -> Float32:
    """The picture with each visited pixel replaced by the mean of the pixels it represents, wherever discs are larger than the
    stride.
    """
    share = np.clip(radius * np.float32(1 / stride) - np.float32(0.5), 0, 1)[..., None]
    means = spread_both_ways(picture, box((stride - 1) / 2))
    return (picture + (means - picture) * share).astype(np.float32)


def _steps(signed: Float32) -> Mask:
    """Pixels beside a pixel of another surface."""
    out = np.zeros(signed.shape, np.bool_)
    across, down = np.abs(np.diff(signed, axis=1)) > STEP, np.abs(np.diff(signed, axis=0)) > STEP
    out[:, 1:] |= across
    out[:, :-1] |= across
    out[1:] |= down
    out[:-1] |= down
    return out


def _one_sided(picture: Float32, signed: Float32, step: Mask) -> Float32:
    """The picture with each pixel at a step replaced by the mean of pixels within two that are alike and not at a step."""
    y, x = np.nonzero(step)
    total, colors = np.zeros(len(y), np.float32), np.zeros((len(y), picture.shape[2]), np.float32)
    for down, across in np.ndindex(5, 5):
        v = np.clip(y + down - 2, 0, step.shape[0] - 1)
        u = np.clip(x + across - 2, 0, step.shape[1] - 1)
        like = ~step[v, u] & (np.abs(signed[v, u] - signed[y, x]) <= STEP)
        weight = np.where(like, np.float32(1 / ((down - 2) ** 2 + (across - 2) ** 2 + 1)), np.float32(0))
        total += weight
        colors += weight[:, None] * picture[v, u]
    is_covered = total > 0
    out = picture.copy()
    out[y[is_covered], x[is_covered]] = colors[is_covered] / total[is_covered, None]
    return out


EFFECT = EffectSpec(
    name="depth_of_field",
    options=_DepthOfField,
    strongest="points infinitely far away blur to discs of diameter W / 20, near ones at most to twice that",
    stage="lens",
    order=10,
    apply=_apply,
    shows_seam=True,
    needs_pinhole=True,
    record=3,
)
