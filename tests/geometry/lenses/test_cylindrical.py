"""Cylindrical panoramas by closed forms; `test_equirectangular` tests all that panoramas share."""

import math

import numpy as np
import pytest

from formula_math import atan2, cos, sin, sqrt
from published import Published
from viewsphere.geometry.camera import pixel_rays
from viewsphere.recipe.world.scene import CameraEntry

PUBLISHED = Published(
    cameras={"cylindrical": {"projection": "cylindrical", "size": [200, 96]}},
    project=lambda own: lambda x, y, z: (atan2(x, z), y / sqrt(x * x + z * z)),
    ray=lambda own: lambda x, y: (sin(x), y, cos(x)),
    highest=math.tan(math.radians(89.9)),
)


def test_a_cylindrical_picture_has_equal_steps_of_azimuth_and_height():
    span = {"horizontal": 90, "vertical": 2 * math.degrees(math.atan(math.pi / 4 * 40 / 36))}
    own = CameraEntry.model_validate({"projection": "cylindrical", "size": [36, 40], "span": span}).intrinsics
    rays = pixel_rays(own)
    height = rays[..., 1] / np.hypot(rays[..., 0], rays[..., 2])
    np.testing.assert_allclose(np.diff(height, axis=0), math.pi / 2 / 36, rtol=1e-12)
    np.testing.assert_allclose(np.diff(np.arctan2(rays[..., 0], rays[..., 2]), axis=1), math.pi / 2 / 36, rtol=1e-11)
    assert own.lens.field_of_view() == pytest.approx((90, 2 * math.degrees(math.atan(height.max() + math.pi / 4 / 36))))
