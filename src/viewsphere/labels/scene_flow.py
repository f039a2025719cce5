"""scene_flow: by how much the seen point moves to one instant later, in metres."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from viewsphere.labels.shared import flow as _flow
from viewsphere.labels.shared.drawing.flow_colors import NEAR, drawing
from viewsphere.labels.shared.spec import ChannelLabel, Needs

if TYPE_CHECKING:
    from viewsphere.labels.shared.context import Sight


def compute(sight: Sight) -> NDArray[np.float32]:
    """X an instant later less X now, (H, W, 3) metres, each in its own instant's camera axes: the camera's motion is in it.

    NaN of the sky, and of what is not there then.
    """
    return _flow.scene_flow(sight, 1)


LABEL = ChannelLabel(
    name="scene_flow",
    meaning="motion of the seen point to one instant later, each place in its own instant's camera axes",
    axes="camera",
    needs=Needs(instants=(1,)),
    dtype=np.float32,
    components=3,
    unit="m",
    empty=np.nan,
    compute=compute,
    prove=_flow.scene_flow_proof("scene_flow", "flow_state"),
    drawing=drawing("scene_flow", NEAR),
)
