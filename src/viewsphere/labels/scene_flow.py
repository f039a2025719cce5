"""scene_flow and scene_flow_backward: the motion of the seen point to one instant later or earlier, in metres."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from viewsphere.labels.shared.drawing.flow_colors import NEAR, drawing
from viewsphere.labels.shared.needs import Next, Previous
from viewsphere.labels.shared.spec import ChannelLabel, Models, channel_of
from viewsphere.model.sample import Sample
from viewsphere.truth.surface_points.raster import INVALID

if TYPE_CHECKING:
    from viewsphere.labels.shared.context import LabelContext


def _scene_flow(context: LabelContext, to: Next | Previous) -> NDArray[np.float32]:
    """Return X at another instant minus X now, (H, W, 3) metres, each in its own instant's camera axes, so it includes the
    camera's motion. NaN for the sky, and for things that are absent at that instant.
    """
    match = context.match(to)
    return np.full((*context.visibility.triangle.shape, 3), np.nan, np.float32) if match is None else match.scene_flow


def _prove(sample: Sample, name: str, state: str) -> Iterator[str]:
    """Exactly the seen points that do not disappear have scene flow."""
    vectors, states, depth = (channel_of(sample, n) for n in (name, state, "depth"))
    if vectors is None:
        return
    has = np.isfinite(vectors).all(axis=-1)
    if (has != np.isfinite(vectors).any(axis=-1)).any():
        yield "expected all components or none; found some of them"
    if states is not None and (has & (states == INVALID)).any():
        yield f"expected NaN where {state} is 4; found vectors at {(has & (states == INVALID)).sum()} pixels"
    if states is not None and depth is not None:
        missing = (np.isfinite(depth) & (states != INVALID)) & ~has
        if missing.any():
            yield f"expected vectors where something is seen and {state} is not 4; found NaN at {missing.sum()} pixels"


def _label(name: str, to: Next | Previous, when: str, state: str) -> ChannelLabel:
    """One direction of scene flow; `state` is the channel of the same direction's states."""

    def prove(sample: Sample, models: Models) -> Iterator[str]:
        return _prove(sample, name, state)

    return ChannelLabel(
        name=name,
        meaning=f"motion of the seen point to one instant {when}, each place in its own instant's camera axes",
        axes="camera",
        needs=(to,),
        dtype=np.float32,
        components=3,
        unit="m",
        empty=np.nan,
        compute=lambda context: _scene_flow(context, to),
        prove=prove,
        drawing=drawing(name, NEAR),
    )


LABELS = (
    _label("scene_flow", Next(), "later", "flow_state"),
    _label("scene_flow_backward", Previous(), "earlier", "flow_backward_state"),
)
