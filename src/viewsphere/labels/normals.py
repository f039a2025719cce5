"""normals: which way the seen surface faces, smoothed as it is shaded."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from viewsphere.labels.shared.directions import drawing, unit_proof
from viewsphere.labels.shared.spec import ChannelLabel

if TYPE_CHECKING:
    from viewsphere.labels.shared.context import Sight


def compute(sight: Sight) -> NDArray[np.float32]:
    """Interpolated vertex normals (H, W, 3) on the visible side of their triangle, bent to at most perpendicular to the ray
    where interpolation turns them away.
    """
    from viewsphere.truth.raster import kernels_channels as kernels

    out, g = sight.empty(np.float32, 3), sight.geometry
    kernels.normals_shading(
        sight.visibility.triangle, g.triangles, sight.corners, sight.rays, g.normals, g.triangle_side, g.triangle_normals,
        sight.camera_from_ray, sight.camera.R, out,
    )  # fmt: skip
    return out


LABEL = ChannelLabel(
    name="normals",
    meaning="shading normal, camera axes, towards the camera",
    axes="camera",
    dtype=np.float32,
    components=3,
    compute=compute,
    prove=unit_proof("normals"),
    drawing=drawing("normals"),
)
