"""Lines along the targets' borders and creases, drawn over the picture as in early computer graphics."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Portion
from viewsphere.plugins.effect import EffectSpec
from viewsphere.rendering.effects import EffectContext
from viewsphere.rendering.seen import Seen
from viewsphere.rendering.spread import gaussian, spread_both_ways

Float32 = NDArray[np.float32]

CREASE = (0.25, 0.75)
"""Change of slope between neighbouring pixels at which a line starts to appear, and at which it is fully visible."""

WIDTH = 1 / 300
"""Width of the lines, in widths of the picture."""


class _EdgeHighlight(Frozen):
    """The strength."""

    edge_highlight: Portion = Field(default=0.0, description="brighter edges")


def _apply(picture: Float32, options: _EdgeHighlight, context: EffectContext) -> Float32:
    """The picture with lines that are blended towards white; alpha is unchanged."""
    share = _lines(context.seen)[..., None] * np.float32(options.edge_highlight)
    white = picture[..., 3:] if picture.shape[2] == 4 else np.float32(1)
    out = picture.copy()
    out[..., :3] += (white - picture[..., :3]) * share
    return out


def _lines(seen: Seen) -> Float32:
    """Return the coverage by lines of each pixel, (H, W) float32 in [0, 1].

    The inverse depth of a plane is linear in the picture, so its second difference is not 0 only at creases and steps.
    """
    bent = _crease(seen.inverse_depth, seen.intrinsics.fx)
    low, high = CREASE
    edge = np.where(seen.targets, np.clip((bent - low) / (high - low), 0, 1), np.float32(0))
    edge[seen.targets & _beside(~seen.targets)] = 1
    sigma = max(WIDTH * edge.shape[1] / 4, 0.4)
    soft = spread_both_ways(edge[..., None].astype(np.float32), gaussian(sigma))[..., 0]
    return np.minimum(soft * np.float32(sigma * 2.5 + 0.6), 1)


def _crease(inverse_depth: Float32, focal: float) -> Float32:
    """Change of the surface's slope from one pixel to the next, approximately the tangent of the angle; (H, W), 0 where
    empty.
    """
    q = np.pad(inverse_depth, 1, mode="edge")
    middle = q[1:-1, 1:-1]
    across = np.abs(q[1:-1, :-2] - 2 * middle + q[1:-1, 2:])
    down = np.abs(q[:-2, 1:-1] - 2 * middle + q[2:, 1:-1])
    slope = np.maximum(across, down) * np.float32(focal) / np.maximum(middle, np.float32(1e-12))
    return np.where(middle > 0, slope, np.float32(0))


def _beside(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Pixels that have a pixel of the mask to their left, right, top or bottom."""
    out = np.zeros_like(mask)
    out[1:] |= mask[:-1]
    out[:-1] |= mask[1:]
    out[:, 1:] |= mask[:, :-1]
    out[:, :-1] |= mask[:, 1:]
    return out


EFFECT = EffectSpec(
    name="edge_highlight",
    options=_EdgeHighlight,
    strongest="white lines, W / 300 wide, along the targets' borders and creases",
    stage="objects",
    order=10,
    apply=_apply,
    shows_seam=True,
    needs_pinhole=True,
    record=10,
)
