"""The FOV model against its formula in 40 digits, and against COLMAP's FOV."""

import numpy as np
import pytest

from formula_math import atan, sqrt, tan
from lens_proofs import SIZE, LensProofs, assert_formula, directions_of, intrinsics
from published import Published
from viewsphere.geometry.lenses import lens_parameters


def formula(omega):
    def position(x, y, z):
        x, y = x / z, y / z
        r = sqrt(x * x + y * y)
        bent = atan(2 * r * tan(omega / 2 + 0 * r)) / omega
        return x * bent / r, y * bent / r

    return position


PUBLISHED = Published(
    cameras={"FOV": {"focal_px": 70, "distortion": {"model": "fov", "omega": 0.9}}},
    project=lambda own: formula(own.omega),
)


class TestFov(LensProofs):
    focal = 300.0
    sees_behind = False

    @staticmethod
    def parameters(rng):
        return lens_parameters("fov", omega=rng.uniform(0.05, 1.6))

    @pytest.mark.parametrize("omega", [0.9, 0.01, 2.5])
    def test_the_published_formula(self, omega):
        assert_formula(lens_parameters("fov", omega=omega), 300, formula(omega), np.random.default_rng(3))


def test_colmap_s_model_agrees():
    """COLMAP has a series instead of the formula within r = 0.01 of the axis."""
    pycolmap = pytest.importorskip("pycolmap")
    lens = intrinsics(lens_parameters("fov", omega=0.9), 300, skew=0.0)
    params = [lens.fx, lens.fy, lens.cx, lens.cy, 0.9]
    theirs = pycolmap.Camera(model="FOV", width=SIZE[0], height=SIZE[1], params=params)
    points = directions_of(np.random.default_rng(2), 800)
    points = points[(points[:, 2] > 0.2 * np.linalg.norm(points, axis=1))]
    points = points[np.hypot(points[:, 0], points[:, 1]) > 0.011 * points[:, 2]]
    own, is_shown = lens.lens.project(points)
    assert is_shown.all() and len(points) > 100
    np.testing.assert_allclose(own, theirs.img_from_cam(points), rtol=0, atol=1e-9)


def test_the_middle_of_the_picture_has_the_axis_for_its_ray():
    lens = intrinsics(lens_parameters("fov", omega=0.9), 300).lens
    middle = np.array([[lens.intrinsics.cx, lens.intrinsics.cy]])
    np.testing.assert_array_equal(lens.rays(middle).directions, [[0, 0, 1]])
    np.testing.assert_array_equal(lens.project([[0.0, 0.0, 3.0]])[0], middle)
