"""The conversion of a camera's pose from requests to Blender."""

from __future__ import annotations

import numpy as np
from mathutils import Matrix


def camera_matrix(rotation, center):
    """World from Blender's camera, which looks along -Z with +Y up, from rows of OpenCV axes and a position."""
    turned = np.array(rotation).T @ np.diag([1, -1, -1])
    return Matrix.Translation(center) @ Matrix(turned.tolist()).to_4x4()
