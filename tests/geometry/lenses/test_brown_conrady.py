"""OpenCV's standard model against its formula in 40 digits, and against cv2."""

import numpy as np
import pytest

from lens_proofs import assert_formula, directions_of, intrinsics
from published import Published
from viewsphere.geometry.lenses import lens_parameters

BARREL = (-0.21, 0.06, 0.001, -0.002, -0.004)
RATIONAL = (0.4, 0.05, -0.001, 0.0007, 0.01, 0.6, 0.12, 0.02)


def formula(k1, k2, p1, p2, k3=0, k4=0, k5=0, k6=0):
    def position(x, y, z):
        x, y = x / z, y / z
        s = x * x + y * y
        radial = (1 + k1 * s + k2 * s**2 + k3 * s**3) / (1 + k4 * s + k5 * s**2 + k6 * s**3)
        return x * radial + 2 * p1 * x * y + p2 * (s + 2 * x * x), y * radial + 2 * p2 * x * y + p1 * (s + 2 * y * y)

    return position


PUBLISHED = Published(
    cameras={
        "Brown and Conrady": {"focal_px": 130, "distortion": {"model": "brown_conrady", "coefficients": BARREL}},
        "OpenCV rational": {"focal_px": 110, "distortion": {"model": "brown_conrady", "coefficients": RATIONAL}},
    },
    project=lambda own: formula(*own.coefficients),
)


@pytest.mark.parametrize("k", [BARREL[:4], BARREL, RATIONAL], ids=len)
def test_the_published_formula(k):
    own = lens_parameters("brown_conrady", coefficients=k)
    assert_formula(own, 400, formula(*k), np.random.default_rng(3), count=40)


@pytest.mark.parametrize("k", [BARREL, RATIONAL], ids=len)
def test_cv2_agrees(k):
    cv2 = pytest.importorskip("cv2")
    lens = intrinsics(lens_parameters("brown_conrady", coefficients=k), 400, skew=0.0)
    points = directions_of(np.random.default_rng(2), 800)
    points = points[points[:, 2] > 0.75 * np.linalg.norm(points, axis=1)]
    own, is_shown = lens.lens.project(points)
    theirs = cv2.projectPoints(points[:, None], np.zeros(3), np.zeros(3), lens.K, np.array(k))[0][:, 0]
    assert is_shown.all() and len(points) > 50
    np.testing.assert_allclose(own, theirs, rtol=0, atol=1e-9)
