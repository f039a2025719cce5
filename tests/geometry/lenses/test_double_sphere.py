"""The double sphere model against its formula in 40 digits (Usenko et al. 2018, equations 40 to 45)."""

import numpy as np
import pytest

from formula_math import sqrt
from lens_proofs import LensProofs, assert_formula
from published import Published
from small import small_recipe
from viewsphere import plan
from viewsphere.errors import RecipeError
from viewsphere.geometry.lenses import focal_from_fov, lens_parameters
from viewsphere.model.sensors.camera import Intrinsics


def formula(xi, alpha):
    def position(x, y, z):
        first = sqrt(x * x + y * y + z * z)
        second = sqrt(x * x + y * y + (xi * first + z) ** 2)
        below = alpha * second + (1 - alpha) * (xi * first + z)
        return x / below, y / below

    return position


PUBLISHED = Published(
    cameras={"double sphere": {"focal_px": 40, "distortion": {"model": "double_sphere", "xi": -0.2, "alpha": 0.6}}},
    project=lambda own: formula(own.xi, own.alpha),
)


class TestDoubleSphere(LensProofs):
    @staticmethod
    def parameters(rng):
        return lens_parameters("double_sphere", xi=rng.uniform(-0.4, 0.8), alpha=rng.uniform(0.3, 0.8))

    @pytest.mark.parametrize(
        "xi, alpha", [(-0.2, 0.6), (0.7, 0.9), (-0.3, 0.4), (0.0, 0.0), (0.9, 0.5), (-0.9, 0.1), (0.1, 1.0)]
    )
    def test_the_published_formula(self, xi, alpha):
        own = lens_parameters("double_sphere", xi=xi, alpha=alpha)
        assert_formula(own, 300, formula(xi, alpha), np.random.default_rng(3))


def test_it_shows_all_that_the_paper_does_up_to_the_picture_s_circle():
    """Equations 43 to 45 give a sufficient bound, z > -w2 d1; equation 51's circle, radius 1 / sqrt(2 alpha - 1), is exact."""
    xi, alpha = -0.2, 0.6
    w1 = (1 - alpha) / alpha
    w2 = (w1 + xi) / np.sqrt(2 * w1 * xi + xi * xi + 1)
    own = lens_parameters("double_sphere", xi=xi, alpha=alpha)
    lens = Intrinsics(width=640, height=480, fx=1, fy=1, cx=0, cy=0, distortion=own).lens
    cosines = np.linspace(1, -1, 20001)
    xy, is_shown = lens.project(np.stack([np.sqrt(1 - cosines**2), 0 * cosines, cosines], axis=1))
    assert is_shown[cosines > -w2].all() and not is_shown[-1]
    radii = xy[is_shown, 0]
    assert (np.diff(radii) > 0).all() and radii[-1] == pytest.approx(1 / np.sqrt(2 * alpha - 1), rel=1e-7)
    assert is_shown.sum() == np.argmin(is_shown)


def test_its_focal_length_spans_the_angle():
    own = lens_parameters("double_sphere", xi=-0.2, alpha=0.6)
    focal = focal_from_fov(np.radians(150), 640, own)
    lens = Intrinsics(width=640, height=480, fx=focal, fy=focal, cx=320, cy=240, distortion=own).lens
    assert lens.field_of_view()[0] == pytest.approx(150, abs=0.5)
    edge = lens.rays([[640.0, 240.0]]).directions[0]
    assert np.degrees(np.arctan2(edge[0], edge[2])) == pytest.approx(75, abs=1e-9)


@pytest.mark.parametrize(
    "given, told",
    [
        ({"xi": 1.0, "alpha": 0.5}, "camera.distortion.xi: .*less than 1"),
        ({"xi": float("nan"), "alpha": 0.5}, "camera.distortion.xi: expected a finite number; found nan"),
        ({"xi": 0.1, "alpha": 1.5}, "camera.distortion.alpha: .*less than or equal to 1"),
        ({"xi": 0.1}, "camera.distortion.alpha: expected a value"),
        ({"xi": -0.9, "alpha": 0.9}, "camera.fov_deg: expected an angle of view that the lens double_sphere shows; found 170"),
    ],
)
def test_mistakes_are_told_in_one_line(given, told):
    with pytest.raises(RecipeError, match=told) as error:
        plan(small_recipe(camera={"fov_deg": 170, "distortion": {"model": "double_sphere"} | given}))
    assert "\n" not in str(error.value)
