"""COLMAP's THIN_PRISM_FISHEYE against its formula in 40 digits, and against pycolmap."""

import numpy as np
import pytest

from formula_math import atan2, sqrt
from lens_proofs import SIZE, LensProofs, assert_formula, directions_of, intrinsics
from published import Published
from small import small_recipe
from viewsphere import plan
from viewsphere.errors import RecipeError
from viewsphere.geometry.lenses import lens_parameters

K = (0.03, -0.005, 0.002, -0.001, 0.001, -0.0002, 0.003, -0.002)


def formula(k1, k2, p1, p2, k3, k4, sx, sy):
    def position(x, y, z):
        r = sqrt(x * x + y * y)
        theta = atan2(r, z)
        x, y, s = theta * x / r, theta * y / r, theta * theta
        radial = 1 + k1 * s + k2 * s**2 + k3 * s**3 + k4 * s**4
        u = x * radial + 2 * p1 * x * y + p2 * (s + 2 * x * x) + sx * s
        return u, y * radial + 2 * p2 * x * y + p1 * (s + 2 * y * y) + sy * s

    return position


PUBLISHED = Published(
    cameras={"thin prism fisheye": {"focal_px": 45, "distortion": {"model": "thin_prism_fisheye", "coefficients": K}}},
    project=lambda own: formula(*own.coefficients),
)


class TestThinPrismFisheye(LensProofs):
    @staticmethod
    def parameters(rng):
        sizes = (0.03, 0.01, 0.01, 0.01, 0.003, 0.001, 0.01, 0.01)
        return lens_parameters("thin_prism_fisheye", coefficients=(rng.normal(size=8) * sizes).tolist())

    @pytest.mark.parametrize("k", [K, (0.0,) * 8, (0.1, 0.05, 0.02, 0.01, 0.0, 0.0, -0.02, 0.03)])
    def test_the_published_formula(self, k):
        own = lens_parameters("thin_prism_fisheye", coefficients=k)
        assert_formula(own, 240, formula(*k), np.random.default_rng(3))


def test_colmap_s_model_agrees():
    pycolmap = pytest.importorskip("pycolmap")
    lens = intrinsics(lens_parameters("thin_prism_fisheye", coefficients=K), 300, skew=0.0)
    model = "THIN_PRISM_FISHEYE"
    theirs = pycolmap.Camera(model=model, width=SIZE[0], height=SIZE[1], params=[lens.fx, lens.fy, lens.cx, lens.cy, *K])
    points = directions_of(np.random.default_rng(2), 500)
    points = points[points[:, 2] > 0.05 * np.linalg.norm(points, axis=1)]
    own, is_shown = lens.lens.project(points)
    assert is_shown.all()
    np.testing.assert_allclose(own, theirs.img_from_cam(points), rtol=0, atol=1e-9)


def test_without_tangential_and_prism_terms_it_is_opencv_s_fisheye():
    k1, k2, k3, k4 = 0.03, -0.005, 0.001, -0.0002
    thin = intrinsics(lens_parameters("thin_prism_fisheye", coefficients=(k1, k2, 0, 0, k3, k4, 0, 0)), 240)
    plain = intrinsics(lens_parameters("fisheye", coefficients=(k1, k2, k3, k4)), 240)
    points = directions_of(np.random.default_rng(6), 3000)
    (one, is_shown), (other, also) = (lens.lens.project(points) for lens in (thin, plain))
    np.testing.assert_array_equal(is_shown, also)
    np.testing.assert_allclose(one[is_shown], other[is_shown], rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    "coefficients, told",
    [
        ([0] * 7, "camera.distortion.coefficients"),
        ([float("nan")] + [0] * 7, "camera.distortion.coefficients.*expected a finite number; found nan"),
        (
            [-1000] + [0] * 7,
            "camera.distortion: expected coefficients that show 1.1 degrees .*; these fold .* at 1 degrees",
        ),
        ([0, 0, 30, 0, 0, 0, 0, 0], "camera.distortion: expected coefficients that show 1.1 degrees"),
    ],
)
def test_mistakes_are_told_in_one_line(coefficients, told):
    lens = {"model": "thin_prism_fisheye", "coefficients": coefficients}
    with pytest.raises(RecipeError, match=told) as error:
        plan(small_recipe(camera={"focal_px": 40, "distortion": lens}))
    assert "\n" not in str(error.value)
