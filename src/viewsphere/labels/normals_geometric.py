"""normals_geometric: which way the seen triangle faces."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from viewsphere.labels.shared.directions import drawing, unit_proof
from viewsphere.labels.shared.spec import ChannelLabel

if TYPE_CHECKING:
    from viewsphere.labels.shared.context import Sight


def compute(sight: Sight) -> NDArray[np.float32]:
    """The triangle's normal (H, W, 3) in camera axes, towards the camera; 0 where nothing is seen."""
    from viewsphere.truth.raster import kernels_channels as kernels

    out, seen = sight.empty(np.float32, 3), sight.visibility.triangle
    kernels.normals_geometric(seen, sight.geometry.triangle_normals, sight.rays, sight.camera_from_ray, sight.camera.R, out)
    return out


LABEL = ChannelLabel(
    name="normals_geometric",
    meaning="triangle's normal, camera axes, towards the camera",
    axes="camera",
    dtype=np.float32,
    components=3,
    compute=compute,
    prove=unit_proof("normals_geometric"),
    drawing=drawing("normals_geometric"),
)
