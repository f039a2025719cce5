"""What is known of a picture besides its colours."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from viewsphere.model.camera import Camera, Intrinsics


@dataclass(frozen=True, eq=False)
class Seen:
    """Truth of one frame, from pixel centres.

    inverse_depth (H, W) float32: 1 / depth in metres along the camera's axis (along the ray for a fisheye), 0 where nothing
    is; targets (H, W) bool: pixels that show an object; distance: metres to what the camera looks at.
    """

    inverse_depth: NDArray[np.float32]
    targets: NDArray[np.bool_]
    intrinsics: Intrinsics
    distance: float


def seen_by(
    camera: Camera,
    target: NDArray[np.float64],
    inverse_depth: NDArray[np.float32],
    triangle: NDArray[np.int32],
    triangle_object: NDArray[np.int32],
) -> Seen:
    """Of truth's buffers (H, W) for this camera, which looks at `target` (3,), and of each triangle's object."""
    is_target = np.append(triangle_object > 0, False)  # the last is for -1, where nothing is
    return Seen(inverse_depth, is_target[triangle], camera.intrinsics, float(camera.R[2] @ (target - camera.center)))
