"""Ground truth of a picture for effects and the smoother: depth and targets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from viewsphere.model.sensors.camera import Camera, Intrinsics


@dataclass(frozen=True, eq=False)
class Seen:
    """Ground truth of one frame, sampled at pixel centres.

    inverse_depth (H, W) float32: 1 / depth in metres along the camera's axis (along the ray for a fisheye), 0 where nothing
    is hit; targets (H, W) bool: pixels that show an object; distance: metres from the camera to its target.
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
    """The depth and targets of one frame, from truth's buffers (H, W) for this camera, which looks at `target` (3,), and each
    triangle's object id.
    """
    is_target = np.append(triangle_object > 0, False)  # the last entry is for triangle -1, where nothing is hit
    return Seen(inverse_depth, is_target[triangle], camera.intrinsics, float(camera.R[2] @ (target - camera.center)))
