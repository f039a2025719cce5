"""flow and flow_backward: optical flow, the motion of the seen point to the next or previous instant."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from viewsphere.labels.shared.drawing.flow_colors import drawing
from viewsphere.labels.shared.needs import Next, Previous
from viewsphere.labels.shared.spec import Array, ChannelLabel, Models, channel_of, period_of
from viewsphere.model.sample import Sample
from viewsphere.truth.correspondences.correspondence import pixel_centers
from viewsphere.truth.surface_points.raster import BEHIND, OUTSIDE

if TYPE_CHECKING:
    from viewsphere.labels.shared.context import LabelContext

EDGE = 1e-3
"""Pixels from the picture's border within which rounding of stored flow decides whether the flow leads outside."""


def _flow(context: LabelContext, to: Next | Previous) -> NDArray[np.float32]:
    """Return the motion of each seen point to another instant, (H, W, 2) pixels, right and down.

    NaN where the point has no pixel at that instant: behind the camera, on an absent thing, on a flat picture. The motion takes
    the shorter way around a picture of a full turn.
    """
    match = context.match(to)
    return np.full((*context.visibility.triangle.shape, 2), np.nan, np.float32) if match is None else match.flow


def _prove(sample: Sample, name: str) -> Iterator[str]:
    """Flow exists wherever its point has a pixel, and leads outside where the state is outside."""
    state = f"{name}_state"
    vectors, states = channel_of(sample, name), channel_of(sample, state)
    if vectors is None:
        return
    if (np.isnan(vectors[..., 0]) != np.isnan(vectors[..., 1])).any():
        yield "expected both components or none; found one of them"
    elif states is not None:
        yield from _against(vectors, states, state, period_of(sample))


def _against(vectors: Array, states: Array, state: str, period: int | None) -> Iterator[str]:
    has_pixel = np.isfinite(vectors[..., 0])
    wrong = has_pixel != (states < BEHIND)
    if wrong.any():
        yield f"expected vectors where {state} is 0, 1 or 2, NaN elsewhere; found others at {wrong.sum()} pixels"
    height, width = states.shape
    there = pixel_centers(states.shape) + vectors
    border = np.minimum(there, (width, height) - there)  # distance from the picture's border
    inside = border.min(axis=-1) if period is None else border[..., 1]
    wrong = has_pixel & (np.abs(inside) > EDGE) & ((inside < 0) != (states == OUTSIDE))
    if wrong.any():
        yield f"expected {state} 2 where the vectors lead outside; found others at {wrong.sum()} pixels"


def _label(name: str, to: Next | Previous, when: str) -> ChannelLabel:
    """One direction of flow."""

    def prove(sample: Sample, models: Models) -> Iterator[str]:
        return _prove(sample, name)

    return ChannelLabel(
        name=name,
        meaning=f"where the seen point is one instant {when}, right and down of where it is",
        axes="image",
        needs=(to,),
        dtype=np.float32,
        components=2,
        unit="px",
        empty=np.nan,
        compute=lambda context: _flow(context, to),
        prove=prove,
        drawing=drawing(name),
    )


LABELS = (_label("flow", Next(), "later"), _label("flow_backward", Previous(), "earlier"))
