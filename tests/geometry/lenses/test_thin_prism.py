"""OpenCV's whole model against cv2 itself, and against its formula in 40 digits."""

import numpy as np
import pytest

from formula_math import cos, sin
from lens_proofs import LensProofs, assert_formula, directions_of, intrinsics
from published import Published
from small import small_recipe
from viewsphere import plan
from viewsphere.errors import RecipeError
from viewsphere.geometry.lenses import lens_parameters

K = (0.4, 0.05, -0.001, 0.0007, 0.01, 0.6, 0.12, 0.02, 0.003, -0.001, -0.002, 0.0005)


def formula(k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4, tx=0, ty=0):
    def position(x, y, z):
        x, y = x / z, y / z
        s = x * x + y * y
        radial = (1 + k1 * s + k2 * s**2 + k3 * s**3) / (1 + k4 * s + k5 * s**2 + k6 * s**3)
        u = x * radial + 2 * p1 * x * y + p2 * (s + 2 * x * x) + s1 * s + s2 * s**2
        v = y * radial + 2 * p2 * x * y + p1 * (s + 2 * y * y) + s3 * s + s4 * s**2
        (cx, sx), (cy, sy) = ((cos(tilt + 0 * s), sin(tilt + 0 * s)) for tilt in (tx, ty))
        about_x, about_y = ((1, 0, 0), (0, cx, sx), (0, -sx, cx)), ((cy, 0, -sy), (0, 1, 0), (sy, 0, cy))
        turned = [[sum(about_y[i][k] * about_x[k][j] for k in range(3)) for j in range(3)] for i in range(3)]
        a, b, w = (row[0] * u + row[1] * v + row[2] for row in turned)
        (_, _, x2), (_, _, y2), (_, _, z2) = turned
        return (z2 * a - x2 * w) / w, (z2 * b - y2 * w) / w

    return position


TILTED = {"model": "thin_prism", "coefficients": (*K, 0.08, -0.15)}
PUBLISHED = Published(
    cameras={"OpenCV tilted thin prism": {"focal_px": 110, "distortion": TILTED}},
    project=lambda own: formula(*own.coefficients),
)


class TestThinPrism(LensProofs):
    focal = 400.0
    sees_behind = False

    @staticmethod
    def parameters(rng):
        sizes = (0.1, 0.03, 0.005, 0.005, 0.003, 0.1, 0.03, 0.003, 0.01, 0.003, 0.01, 0.003, 0.1, 0.1)
        return lens_parameters("thin_prism", coefficients=(rng.normal(size=14) * sizes)[: rng.choice([12, 14])].tolist())

    @pytest.mark.parametrize("k", [K, (*K, 0.08, -0.15), (*[0.0] * 12, 0.3, 0.2)])
    def test_the_published_formula(self, k):
        own = lens_parameters("thin_prism", coefficients=k)
        assert_formula(own, 400, formula(*k), np.random.default_rng(3), count=40)


@pytest.mark.parametrize("k", [K, (*K, 0.08, -0.15)])
def test_cv2_agrees(k):
    cv2 = pytest.importorskip("cv2")
    lens = intrinsics(lens_parameters("thin_prism", coefficients=k), 400, skew=0.0)
    points = directions_of(np.random.default_rng(2), 800)
    points = points[points[:, 2] > 0.5 * np.linalg.norm(points, axis=1)]
    own, is_shown = lens.lens.project(points)
    theirs = cv2.projectPoints(points[:, None], np.zeros(3), np.zeros(3), lens.K, np.array(k))[0][:, 0]
    assert is_shown.all()
    np.testing.assert_allclose(own, theirs, rtol=0, atol=1e-9)
    assert lens.lens.opencv.coefficients == k


@pytest.mark.parametrize(
    "coefficients, told",
    [
        ([0] * 13, "camera.distortion: thin_prism: expected 12 or 14 coefficients, got 13"),
        ([0] * 12 + [1.5, 0], "camera.distortion: thin_prism: expected tilts within 1.2 radians"),
        ([-1e4] + [0] * 11, "camera.distortion: expected coefficients that show 1.1 degrees"),
    ],
)
def test_mistakes_are_told_in_one_line(coefficients, told):
    with pytest.raises(RecipeError, match=told) as error:
        plan(small_recipe(camera={"fov_deg": 50, "distortion": {"model": "thin_prism", "coefficients": coefficients}}))
    assert "\n" not in str(error.value)
