"""flow: optical flow, where the seen point is one instant later."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from viewsphere.labels.shared import flow as _flow
from viewsphere.labels.shared.drawing.flow_colors import drawing
from viewsphere.labels.shared.spec import ChannelLabel, Needs

if TYPE_CHECKING:
    from viewsphere.labels.shared.context import Sight


def compute(sight: Sight) -> NDArray[np.float32]:
    """Return the motion of each seen point to the next instant, (H, W, 2) pixels, right and down.

    NaN where the point has no pixel then: behind the camera, on a thing that is absent then, on a flat picture.
    """
    return _flow.flow(sight, 1)


LABEL = ChannelLabel(
    name="flow",
    meaning="where the seen point is one instant later, right and down of where it is",
    axes="image",
    needs=Needs(instants=(1,)),
    dtype=np.float32,
    components=2,
    unit="px",
    empty=np.nan,
    compute=compute,
    prove=_flow.flow_proof("flow", "flow_state"),
    drawing=drawing("flow"),
)
