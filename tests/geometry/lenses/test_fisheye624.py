"""Project Aria's FISHEYE624 against its formula in 40 digits, pycolmap, and Project Aria's own tools where installed."""

import numpy as np
import pytest

from formula_math import atan2, sqrt
from lens_proofs import SIZE, LensProofs, assert_formula, directions_of, intrinsics
from published import Published
from viewsphere.geometry.lenses import lens_parameters

SLAM = (-0.0271, 0.0951, -0.0707, 0.0167, 0.0014, -0.0006, 0.00045, -0.00091, -0.0004, -0.0001, 0.0012, -0.0002)
"""About the size of those of Aria's cameras."""


def formula(k0, k1, k2, k3, k4, k5, p0, p1, s0, s1, s2, s3):
    def position(x, y, z):
        r = sqrt(x * x + y * y)
        theta = atan2(r, z)
        q = theta * theta
        bent = theta * (1 + k0 * q + k1 * q**2 + k2 * q**3 + k3 * q**4 + k4 * q**5 + k5 * q**6)
        x, y, s = bent * x / r, bent * y / r, bent * bent
        u = x + (2 * x * x + s) * p0 + 2 * x * y * p1 + s0 * s + s1 * s**2
        return u, y + (2 * y * y + s) * p1 + 2 * x * y * p0 + s2 * s + s3 * s**2

    return position


PUBLISHED = Published(
    cameras={"FISHEYE624": {"focal_px": 48, "distortion": {"model": "fisheye624", "coefficients": SLAM}}},
    project=lambda own: formula(*own.coefficients),
)


class TestFisheye624(LensProofs):
    @staticmethod
    def parameters(rng):
        sizes = (0.03, 0.01, 0.003, 0.001, 0.0003, 0.0001, 0.01, 0.01, 0.01, 0.003, 0.01, 0.003)
        return lens_parameters("fisheye624", coefficients=(rng.normal(size=12) * sizes).tolist())

    @pytest.mark.parametrize("k", [SLAM, (0.0,) * 12, (0.1, 0.02, 0.0, 0.0, 0.0, 0.0, 0.02, -0.03, 0.02, 0.01, -0.02, 0.01)])
    def test_the_published_formula(self, k):
        assert_formula(lens_parameters("fisheye624", coefficients=k), 240, formula(*k), np.random.default_rng(3))


def ahead(least):
    points = directions_of(np.random.default_rng(2), 500)
    return points[points[:, 2] > least * np.linalg.norm(points, axis=1)]


def test_colmap_s_model_agrees():
    pycolmap = pytest.importorskip("pycolmap")
    lens = intrinsics(lens_parameters("fisheye624", coefficients=SLAM), 240, skew=0.0)
    params = [lens.fx, lens.fy, lens.cx, lens.cy, *SLAM]
    theirs = pycolmap.Camera(model="RAD_TAN_THIN_PRISM_FISHEYE", width=SIZE[0], height=SIZE[1], params=params)
    own, is_shown = lens.lens.project(ahead(0.05))
    assert is_shown.all()
    np.testing.assert_allclose(own, theirs.img_from_cam(ahead(0.05)), rtol=0, atol=1e-9)


def test_project_aria_s_tools_agree():
    calibration = pytest.importorskip("projectaria_tools.core.calibration")
    lens = intrinsics(lens_parameters("fisheye624", coefficients=SLAM), 240, fy=240.0, skew=0.0)
    params = np.array([lens.fx, lens.cx - 0.5, lens.cy - 0.5, *SLAM])  # counted from the centre of the first pixel
    theirs = calibration.CameraProjection(calibration.CameraModelType.FISHEYE624, params)
    own, is_shown = lens.lens.project(ahead(0.05))
    assert is_shown.all()
    np.testing.assert_allclose(own, [theirs.project(point) + 0.5 for point in ahead(0.05)], rtol=0, atol=1e-9)
