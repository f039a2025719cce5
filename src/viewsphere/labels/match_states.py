"""flow_state, flow_backward_state and disparity_state: whether another picture also shows the seen point."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from viewsphere.labels.shared.needs import Next, Partner, Previous, no_disparity
from viewsphere.labels.shared.spec import ChannelLabel, Drawing, Models, Picture, channel_of
from viewsphere.model.sample import Sample
from viewsphere.truth.surface_points.raster import INVALID

if TYPE_CHECKING:
    from viewsphere.labels.shared.context import LabelContext

MEANING = "0 visible, 1 occluded, 2 outside the picture, 3 behind the camera, 4 invalid"
COLORS = np.array([(235, 235, 235), (200, 60, 50), (60, 110, 200), (120, 70, 160), (0, 0, 0)], np.uint8)


def _states(context: LabelContext, other: Next | Previous | Partner) -> NDArray[np.uint8]:
    """The states of the seen points in another view, (H, W); all invalid without one."""
    match = context.match(other)
    return np.full(context.visibility.triangle.shape, INVALID, np.uint8) if match is None else match.state


def _drawing(channel: str) -> Drawing:
    """Return the drawing of a channel of states beside a picture."""
    colors: list[list[int]] = COLORS.tolist()
    names = (f"{channel}: visible", "occluded", "outside", "behind", "invalid")
    return Drawing(
        channel,
        beside=lambda sample: picture(sample.channels[channel]),
        key=tuple((name, (r, g, b)) for name, (r, g, b) in zip(names, colors, strict=True)),
    )


def picture(states: NDArray[np.uint8]) -> Picture:
    """States as a picture (H, W, 3): visible is light, occluded red, outside blue, behind violet, invalid black."""
    return COLORS[np.minimum(states, INVALID)]


def _label(name: str, where: str, other: Next | Previous | Partner) -> ChannelLabel:
    """The states in one other picture."""

    def prove(sample: Sample, models: Models) -> Iterator[str]:
        known = channel_of(sample, name)
        if known is not None and (known > INVALID).any():
            yield f"expected 0 to 4; found others at {(known > INVALID).sum()} pixels"

    return ChannelLabel(
        name=name,
        meaning=f"the seen point {where}: {MEANING}",
        needs=(other,),
        refuses=no_disparity if isinstance(other, Partner) else None,
        dtype=np.uint8,
        ids={},
        empty=4,
        encoding="png",
        compute=lambda context: _states(context, other),
        prove=prove,
        drawing=_drawing(name),
    )


LABELS = (
    _label("flow_state", "one instant later", Next()),
    _label("flow_backward_state", "one instant earlier", Previous()),
    _label("disparity_state", "in the rectified sensor's picture", Partner()),
)
