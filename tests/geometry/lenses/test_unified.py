"""The unified model against its formula in 40 digits, and against OpenCV's omnidir where the installed OpenCV has it."""

import numpy as np
import pytest

from formula_math import sqrt
from lens_proofs import LensProofs, assert_formula, directions_of, intrinsics
from published import Published
from viewsphere.geometry.lenses import lens_parameters


def formula(xi, k1, k2, p1, p2):
    def position(x, y, z):
        below = z + xi * sqrt(x * x + y * y + z * z)
        x, y = x / below, y / below
        s = x * x + y * y
        radial = 1 + k1 * s + k2 * s * s
        return x * radial + 2 * p1 * x * y + p2 * (s + 2 * x * x), y * radial + 2 * p2 * x * y + p1 * (s + 2 * y * y)

    return position


OMNIDIR = {"model": "unified", "xi": 1.2, "coefficients": (-0.2, 0.1, 0.001, -0.002)}
PUBLISHED = Published(
    cameras={"unified (omnidir)": {"focal_px": 90, "distortion": OMNIDIR}},
    project=lambda own: formula(own.xi, *own.coefficients),
)


class TestUnified(LensProofs):
    focal = 500.0

    @staticmethod
    def parameters(rng):
        coefficients = rng.normal(size=4) * (0.1, 0.03, 0.005, 0.005)
        return lens_parameters("unified", xi=rng.uniform(0.6, 1.6), coefficients=coefficients.tolist())

    @pytest.mark.parametrize(
        "xi, k",
        [(1.2, (-0.2, 0.1, 0.001, -0.002)), (0.8, (0.0, 0.0, 0.0, 0.0)), (2.0, (0.3, 0.1, 0.02, 0.01)), (0.0, (-0.1,) * 4)],
    )
    def test_the_published_formula(self, xi, k):
        assert_formula(lens_parameters("unified", xi=xi, coefficients=k), 500, formula(xi, *k), np.random.default_rng(3))


def test_opencv_s_omnidir_agrees():
    omnidir = getattr(pytest.importorskip("cv2"), "omnidir", None)
    if omnidir is None:
        pytest.skip("this OpenCV lacks omnidir")
    xi, k = 1.3, (-0.2, 0.1, 0.001, -0.002)
    lens = intrinsics(lens_parameters("unified", xi=xi, coefficients=k), 500)
    points = directions_of(np.random.default_rng(2), 500)
    own, is_shown = lens.lens.project(points)
    theirs, _ = omnidir.projectPoints(points[:, None], np.zeros(3), np.zeros(3), lens.K, xi, np.array(k))
    assert is_shown.sum() > 200
    np.testing.assert_allclose(own[is_shown], theirs[:, 0][is_shown], rtol=0, atol=1e-9)


def test_it_is_eucm_without_distortion():
    """xi = alpha / (1 - alpha), with focal lengths times 1 + xi."""
    points = directions_of(np.random.default_rng(5), 400)
    mine, is_shown = intrinsics(lens_parameters("unified", xi=1.5), 500).lens.project(points)
    own = intrinsics(lens_parameters("eucm", alpha=0.6), 200, skew=0.2, cx=321.25, cy=237.5).lens
    theirs, also = own.project(points)
    near = is_shown & also
    assert near.sum() > 200 and (is_shown != also).sum() == 0
    np.testing.assert_allclose(mine[near], theirs[near], rtol=1e-11, atol=1e-9)
