"""OpenCV's fisheye (Kannala and Brandt) against its formula in 40 digits, and against cv2."""

import numpy as np
import pytest

from formula_math import atan2, sqrt
from lens_proofs import assert_formula, directions_of, intrinsics
from published import Published
from viewsphere.geometry.lenses import lens_parameters

TUM_VI = (0.0034823, 0.00071503, -0.0020532, 0.00020293)


def formula(k1, k2, k3, k4):
    def position(x, y, z):
        r = sqrt(x * x + y * y)
        theta = atan2(r, z)
        s = theta * theta
        bent = theta * (1 + k1 * s + k2 * s**2 + k3 * s**3 + k4 * s**4)
        return bent * x / r, bent * y / r

    return position


PUBLISHED = Published(
    cameras={"fisheye (Kannala and Brandt)": {"focal_px": 45, "distortion": {"model": "fisheye", "coefficients": TUM_VI}}},
    project=lambda own: formula(*own.coefficients),
)


@pytest.mark.parametrize("k", [TUM_VI, (0.0,) * 4, (0.03, -0.004, 0.0007, -0.0001)])
def test_the_published_formula(k):
    assert_formula(lens_parameters("fisheye", coefficients=k), 240, formula(*k), np.random.default_rng(3))


def test_cv2_agrees():
    cv2 = pytest.importorskip("cv2")
    lens = intrinsics(lens_parameters("fisheye", coefficients=TUM_VI), 240, skew=0.0)
    points = directions_of(np.random.default_rng(2), 500)
    points = points[points[:, 2] > 0.05 * np.linalg.norm(points, axis=1)]
    own, is_shown = lens.lens.project(points)
    theirs = cv2.fisheye.projectPoints(points[:, None], np.zeros(3), np.zeros(3), lens.K, np.array(TUM_VI))[0][:, 0]
    assert is_shown.all() and len(points) > 50
    np.testing.assert_allclose(own, theirs, rtol=0, atol=1e-9)
