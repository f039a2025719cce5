"""Scaramuzza's omnidirectional model: the forward polynomial in 40 digits is the truth."""

import mpmath
import numpy as np
import pytest

from formula_math import sqrt
from lens_proofs import SIZE, LensProofs, directions_of, intrinsics
from published import Published
from small import small_recipe
from viewsphere import plan
from viewsphere.errors import RecipeError
from viewsphere.geometry.lenses import lens_parameters, scaramuzza

OCAM = (-0.42, 0.05, -0.11)
"""About the size of a fisheye of 190 degrees."""


def ray(c, shear, x, y):
    """The ray of a position."""
    y = y - shear * x
    rho = sqrt(x * x + y * y)
    z = 1 + sum(term * rho ** (n + 2) for n, term in enumerate(c))
    return x, y, z


PUBLISHED = Published(
    cameras={"Scaramuzza": {"focal_px": 45, "distortion": {"model": "scaramuzza", "coefficients": OCAM, "shear": 0.01}}},
    ray=lambda own: lambda x, y: ray(own.coefficients, own.shear, x, y),
)


class TestScaramuzza(LensProofs):
    @staticmethod
    def parameters(rng):
        c = (rng.uniform(-0.6, -0.1), rng.normal() * 0.05, rng.uniform(-0.2, 0.0), rng.normal() * 0.01)
        return lens_parameters("scaramuzza", coefficients=c, shear=rng.normal() * 0.01)

    @pytest.mark.parametrize("c, shear", [(OCAM, 0.0), (OCAM, 0.02), ((-0.3,), -0.01), ((0.2, -0.3, 0.1, -0.2), 0.0)])
    def test_rays_are_those_of_the_polynomial(self, c, shear):
        lens = intrinsics(lens_parameters("scaramuzza", coefficients=c, shear=shear), 240)
        xy = np.random.default_rng(3).uniform((0, 0), SIZE, (80, 2))
        directions = lens.lens.rays(xy).directions
        has_ray = ~np.isnan(directions[:, 0])
        assert has_ray.sum() > 40
        with mpmath.workdps(40):
            for (u, v), direction in zip(xy[has_ray].tolist(), directions[has_ray], strict=True):
                y = (mpmath.mpf(v) - lens.cy) / lens.fy
                expected = ray(c, shear, (mpmath.mpf(u) - lens.cx - lens.skew * y) / lens.fx, y)
                length = mpmath.sqrt(sum(e * e for e in expected))
                expected = tuple(e / length for e in expected)
                assert max(abs(float(e - d)) for e, d in zip(expected, direction.tolist(), strict=True)) < 5e-16 * 2

    def test_projection_inverts_the_polynomial(self):
        """In 40 digits, the ray at the position of a point passes within 1e-9 pixels of it."""
        c, shear = OCAM, 0.02
        lens = intrinsics(lens_parameters("scaramuzza", coefficients=c, shear=shear), 240)
        points = directions_of(np.random.default_rng(5), 300)
        xy, is_shown = lens.lens.project(points)
        assert is_shown.sum() > 100 and (points[is_shown, 2] < 0).any()
        with mpmath.workdps(40):
            for (u, v), point in zip(xy[is_shown].tolist(), points[is_shown].tolist(), strict=True):
                y = (mpmath.mpf(v) - lens.cy) / lens.fy
                x = (mpmath.mpf(u) - lens.cx - lens.skew * y) / lens.fx
                straight = y - shear * x
                rho = mpmath.sqrt(x * x + straight * straight)
                r = mpmath.sqrt(point[0] ** 2 + mpmath.mpf(point[1]) ** 2)

                def error(rho, r=r, z=point[2]):
                    return rho * z - r * (1 + sum(term * rho ** (n + 2) for n, term in enumerate(c)))

                exact = mpmath.findroot(error, rho)
                assert abs(float(exact - rho)) * lens.fx < 1e-9


@pytest.mark.parametrize("c", [OCAM, (-0.3,), (0.2, -0.3, 0.1, -0.2), (0.5,)])
def test_the_inverse_ends_after_a_few_steps(c, monkeypatch):
    """Also for points beyond the limit, on the axis and without a direction: they take no step at all."""
    sizes, height = [], scaramuzza._height
    own = lens_parameters("scaramuzza", coefficients=c)
    points = np.concatenate([np.random.default_rng(7).normal(size=(5000, 3)), np.eye(3)[2:], -np.eye(3)[2:], np.zeros((1, 3))])
    scaramuzza._table(own.coefficients)
    monkeypatch.setattr(scaramuzza, "_height", lambda c, rho: sizes.append(len(rho)) or height(c, rho))
    is_shown = ~np.isnan(scaramuzza._to_plane(own, points)[:, 0])
    assert len(sizes) < scaramuzza.STEPS / 4 and sizes[0] == is_shown.sum()
    assert sum(sizes) < 6 * is_shown.sum()


@pytest.mark.parametrize(
    "given, told",
    [
        ({"coefficients": []}, "camera.distortion.coefficients"),
        ({"coefficients": [5000]}, "camera.distortion: expected coefficients that show 1.1 degrees"),
        ({"coefficients": [-0.3], "shear": 2}, "camera.distortion.shear: .*less than or equal to 0.5"),
    ],
)
def test_mistakes_are_told_in_one_line(given, told):
    with pytest.raises(RecipeError, match=told) as error:
        plan(small_recipe(camera={"focal_px": 40, "distortion": {"model": "scaramuzza", **given}}))
    assert "\n" not in str(error.value)
