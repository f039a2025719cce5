"""barycentrics: the position of the seen point in its triangle."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from viewsphere.labels.shared.spec import ChannelLabel, Drawing, Models, Picture, channel_of
from viewsphere.model.sample import Sample

if TYPE_CHECKING:
    from viewsphere.labels.shared.context import LabelContext

TOLERANCE = 1e-5
"""The largest deviation of the sum of weights from 1, as a share of the largest weight. On a ground that reaches the horizon,
the float32 weights are large.
"""


def _compute(context: LabelContext) -> NDArray[np.float32]:
    """Weights (H, W, 3) of the seen triangle's corners; 0 where nothing is seen."""
    from viewsphere.truth.raster import kernels_channels as kernels

    out, shown = context.empty(np.float32, 3), context.shown
    kernels.barycentrics(shown.seen, shown.triangles, shown.corners, context.rays, out)
    return out


def prove(sample: Sample, models: Models) -> Iterator[str]:
    """Weights add up to 1, or are 0 where nothing is seen."""
    weights = channel_of(sample, "barycentrics")
    if weights is None:
        return
    total = weights.astype(np.float64).sum(axis=-1)
    most = np.maximum(np.abs(weights).max(axis=-1), 1)
    wrong = ~((np.abs(total - 1) < TOLERANCE * most) | (weights == 0).all(axis=-1))
    if wrong.any():
        yield f"expected weights that add up to 1, found others at {wrong.sum()} pixels"


def _picture(weights: NDArray[np.float32]) -> Picture:
    """Weights as a picture (H, W, 3) uint8: red at each triangle's first corner, green at the second, blue at the third."""
    return (np.clip(weights, 0, 1) * 255).round().astype(np.uint8)


LABEL = ChannelLabel(
    name="barycentrics",
    meaning="weights of the triangle's corners at the seen point",
    dtype=np.float32,
    components=3,
    compute=_compute,
    prove=prove,
    drawing=Drawing(
        "barycentrics",
        beside=lambda sample: _picture(sample.channels["barycentrics"]),
        key=(("barycentrics: red, green and blue are the triangle's first, second and third corner", None),),
    ),
)
