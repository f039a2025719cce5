"""flow_backward_state: whether the seen point is seen one instant earlier."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from viewsphere.labels.shared import states as _state
from viewsphere.labels.shared.spec import ChannelLabel, Needs

if TYPE_CHECKING:
    from viewsphere.labels.shared.context import Sight


def compute(sight: Sight) -> NDArray[np.uint8]:
    """The state of the seen point in the same sensor's picture an instant earlier, (H, W); 4 at the first instant."""
    return _state.state(sight, sight.match(-1))


LABEL = ChannelLabel(
    name="flow_backward_state",
    meaning=f"the seen point one instant earlier: {_state.MEANING}",
    needs=Needs(instants=(-1,)),
    dtype=np.uint8,
    ids={},
    empty=4,
    encoding="png",
    compute=compute,
    prove=_state.state_proof("flow_backward_state"),
    drawing=_state.drawing("flow_backward_state"),
)
