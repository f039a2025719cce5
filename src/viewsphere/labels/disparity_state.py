"""disparity_state: whether the seen point is seen by the sensor that is rectified with the picture's own."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from viewsphere.labels.shared import states as _state
from viewsphere.labels.shared.spec import ChannelLabel, Needs

if TYPE_CHECKING:
    from viewsphere.labels.shared.context import Sight


def compute(sight: Sight) -> NDArray[np.uint8]:
    """The state of the seen point in the other sensor's picture of the same instant, (H, W)."""
    return _state.state(sight, sight.partner_match())


LABEL = ChannelLabel(
    name="disparity_state",
    meaning=f"the seen point in the rectified sensor's picture: {_state.MEANING}",
    needs=Needs(rectified=True),
    dtype=np.uint8,
    ids={},
    empty=4,
    encoding="png",
    compute=compute,
    prove=_state.state_proof("disparity_state"),
    drawing=_state.drawing("disparity_state"),
)
