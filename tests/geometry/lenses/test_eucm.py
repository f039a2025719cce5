"""The enhanced unified model against its formula in 40 digits, and against COLMAP's EUCM."""

import numpy as np
import pytest

from formula_math import sqrt
from lens_proofs import SIZE, LensProofs, assert_formula, directions_of, intrinsics
from published import Published
from viewsphere.geometry.lenses import lens_parameters


def formula(alpha, beta):
    def position(x, y, z):
        below = alpha * sqrt(beta * (x * x + y * y) + z * z) + (1 - alpha) * z
        return x / below, y / below

    return position


PUBLISHED = Published(
    cameras={"EUCM": {"focal_px": 45, "distortion": {"model": "eucm", "alpha": 0.62, "beta": 1.15}}},
    project=lambda own: formula(own.alpha, own.beta),
)


class TestEucm(LensProofs):
    @staticmethod
    def parameters(rng):
        return lens_parameters("eucm", alpha=rng.uniform(0.3, 0.8), beta=np.exp(rng.uniform(-0.7, 0.7)))

    @pytest.mark.parametrize("alpha, beta", [(0.6, 1.1), (0.9, 0.5), (0.4, 2.0), (0.0, 1.0), (0.5, 1.0), (1.0, 1.2)])
    def test_the_published_formula(self, alpha, beta):
        own = lens_parameters("eucm", alpha=alpha, beta=beta)
        assert_formula(own, 300, formula(alpha, beta), np.random.default_rng(3))


def test_colmap_s_model_agrees():
    pycolmap = pytest.importorskip("pycolmap")
    lens = intrinsics(lens_parameters("eucm", alpha=0.62, beta=1.15), 300, skew=0.0)
    theirs = pycolmap.Camera(
        model="EUCM", width=SIZE[0], height=SIZE[1], params=[lens.fx, lens.fy, lens.cx, lens.cy, 0.62, 1.15]
    )
    points = directions_of(np.random.default_rng(2), 500)
    points = points[points[:, 2] > 0.1 * np.linalg.norm(points, axis=1)]
    own, is_shown = lens.lens.project(points)
    assert is_shown.all()
    np.testing.assert_allclose(own, theirs.img_from_cam(points), rtol=0, atol=1e-9)
