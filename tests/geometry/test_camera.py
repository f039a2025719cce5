import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from lens_limits import lens_limit
from viewsphere.geometry.camera import (
    focal_from_sensor,
    inverse_camera_matrix,
    orbit_center,
    orbit_rotation,
    pixel_rays,
    project,
)
from viewsphere.geometry.lenses import focal_from_fov, lens_parameters
from viewsphere.model.sensors.camera import Intrinsics

PROFILE = settings(max_examples=25, derandomize=True, deadline=None, database=None)


def intrinsics(distortion=None, width=48, height=36, **fields):
    values = {"fx": 40.0, "fy": 42.0, "cx": 23.0, "cy": 19.5, "skew": 1.5} | fields
    return Intrinsics(width=width, height=height, distortion=distortion, **values)


def brown(*k):
    return lens_parameters("brown_conrady", coefficients=k)


def fisheye(*k):
    return lens_parameters("fisheye", coefficients=k)


def opencv_brown(k, x, y):
    """The formula of OpenCV's calib3d page, written out."""
    k1, k2, p1, p2, k3, k4, k5, k6 = (*k, *[0.0] * (8 - len(k)))
    r2 = x * x + y * y
    radial = (1 + k1 * r2 + k2 * r2**2 + k3 * r2**3) / (1 + k4 * r2 + k5 * r2**2 + k6 * r2**3)
    return x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y


def test_pinhole_rays_and_projection_by_hand():
    i = intrinsics()
    rays = pixel_rays(i)
    assert rays.shape == (36, 48, 3) and rays.dtype == np.float64
    y = (10.5 - 19.5) / 42
    np.testing.assert_allclose(rays[10, 30], [(30.5 - 23 - 1.5 * y) / 40, y, 1], rtol=1e-15)
    j, k = np.mgrid[:36, :48] + 0.5
    np.testing.assert_allclose(rays, np.stack([k, j, np.ones_like(k)], -1) @ inverse_camera_matrix(i).T, atol=1e-14)
    np.testing.assert_allclose(inverse_camera_matrix(i) @ i.K, np.eye(3), atol=1e-15)
    pixels, is_shown = project(i, [[0.2, -0.1, 2.0], [0.2, -0.1, -2.0], [0.2, 0.1, 0.0]])
    np.testing.assert_allclose(pixels[0], [40 * 0.1 + 1.5 * -0.05 + 23, 42 * -0.05 + 19.5])
    assert np.isnan(pixels[1:]).all()
    assert is_shown.tolist() == [True, False, False]


@pytest.mark.parametrize("lens", [None, brown(-0.2, 0.05, 0.001, -0.002), fisheye(0.03, -0.004, 0.0, 0.0)])
def test_windows_and_subdivision_continue_the_image(lens):
    i = intrinsics(lens)
    whole = pixel_rays(i)
    np.testing.assert_array_equal(pixel_rays(i, window=(5, 7, 20, 30)), whole[7:30, 5:20])
    beyond = pixel_rays(i, window=(-3, -4, 50, 40))
    assert beyond.shape == (44, 53, 3)
    np.testing.assert_array_equal(beyond[4:40, 3:51], whole)
    np.testing.assert_allclose(pixel_rays(i, 3)[1::3, 1::3], whole, rtol=1e-12)
    points = whole * 3.7
    pixels, is_shown = project(i, points)
    j, k = np.mgrid[:36, :48] + 0.5
    np.testing.assert_allclose(pixels, np.stack([k, j], -1), atol=1e-9)
    assert is_shown.all()


@PROFILE
@given(
    k1=st.floats(-0.6, 0.6), k2=st.floats(-0.3, 0.3), k3=st.floats(-0.1, 0.1),
    k4=st.floats(-0.3, 0.6), k5=st.floats(-0.1, 0.1), k6=st.floats(-0.05, 0.05),
    p1=st.floats(-0.02, 0.02), p2=st.floats(-0.02, 0.02),
)  # fmt: skip
def test_brown_conrady_round_trip(k1, k2, k3, k4, k5, k6, p1, p2):
    lens = brown(k1, k2, p1, p2, k3, k4, k5, k6)
    i = intrinsics(lens)
    rays = pixel_rays(i, window=(-20, -20, 70, 60))
    real = np.isfinite(rays[..., 0])
    assert np.array_equal(real, np.isfinite(rays[..., 1]))
    assert real[38:40, 42:44].all()  # the axis
    x, y, z = rays[real].T
    assert (z == 1).all()
    assert np.hypot(x, y).max() < lens_limit(lens)
    u, v = opencv_brown(lens.coefficients, x, y)
    j, k = np.mgrid[-20:60, -20:70] + 0.5
    np.testing.assert_allclose(40 * u + 1.5 * v + 23, k[real], atol=1e-9)
    np.testing.assert_allclose(42 * v + 19.5, j[real], atol=1e-9)
    pixels, _ = project(i, rays * np.linspace(0.1, 9, 90)[None, :, None])
    np.testing.assert_allclose(pixels[real], np.stack([k, j], -1)[real], atol=1e-9)


@pytest.mark.slow
@settings(PROFILE, max_examples=2 * settings.default.max_examples // 5)
@given(seed=st.integers(0, 10**6))
def test_brown_conrady_loses_no_ray(seed):
    """Any point that projects comes back as the ray of its pixel: Newton finds the one unfolded solution."""
    rng = np.random.default_rng(seed)
    lens = brown(*(rng.normal(size=8) * [0.3, 0.1, 0.005, 0.005, 0.03, 0.2, 0.05, 0.01]))
    limit = min(lens_limit(lens), 3.0)
    radius, angle = limit * np.sqrt(rng.random(200)) * 0.97, rng.uniform(0, 2 * np.pi, 200)
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.ones(200)], axis=-1)
    pixels, _ = project(intrinsics(lens, fx=1.0, fy=1.0, cx=0.0, cy=0.0, skew=0.0), points)
    for point, (u, v) in zip(points, pixels, strict=True):
        if np.isfinite(u):
            centred = intrinsics(lens, 1, 1, fx=1.0, fy=1.0, cx=0.5 - u, cy=0.5 - v, skew=0.0)
            np.testing.assert_allclose(pixel_rays(centred)[0, 0], point, rtol=1e-7, atol=1e-7)


def test_folded_rays_are_refused():
    """r (1 - r^2 / 3) rises up to r = 1, where it is 2/3: no ray beyond, and what lies further out is not seen."""
    lens = brown(-1 / 3, 0.0, 0.0, 0.0)
    assert lens_limit(lens) == pytest.approx(1.0, rel=1e-12)
    i = intrinsics(lens, 400, 1, fx=200.0, fy=200.0, cx=200.0, cy=0.5, skew=0.0)
    real = np.isfinite(pixel_rays(i)[0, :, 0])
    assert np.array_equal(real, np.abs(np.arange(400) + 0.5 - 200) / 200 < 2 / 3)
    pixels, is_shown = project(i, [[0.99, 0, 1], [1.01, 0, 1], [-5.0, 0, 1]])
    assert np.isfinite(pixels[0]).all()
    assert np.isnan(pixels[1:]).all()
    assert is_shown.tolist() == [True, False, False]
    assert lens_limit(brown(0.1, 0.02, 0.0, 0.0)) == math.inf


@pytest.mark.parametrize("lens", [brown, fisheye])
def test_a_lens_that_folds_next_to_the_axis_is_an_error(lens):
    """With k1 alone, the limit is sqrt(-1 / (3 k1)): 0.0204 for k1 = -800, 0.0196 for k1 = -870."""
    assert lens_limit(lens(-800.0, 0.0, 0.0, 0.0)) == pytest.approx(math.sqrt(1 / 2400))
    for k1, angle in ((-870.0, "1.1"), (-1e5, "0.1")):
        told = f"expected coefficients that show 1.1 degrees around the axis; these fold the picture back at {angle} degrees"
        with pytest.raises(ValidationError, match=told):
            lens(k1, 0.0, 0.0, 0.0)


def test_tangential_terms_that_fold_next_to_the_axis_are_an_error():
    with pytest.raises(ValidationError, match="these fold the picture back at"):
        brown(0.0, 0.0, 100.0, 0.0)


@PROFILE
@given(k1=st.floats(-0.1, 0.1), k2=st.floats(-0.02, 0.02), k3=st.floats(-0.005, 0.005), k4=st.floats(-0.001, 0.001))
def test_fisheye_round_trip(k1, k2, k3, k4):
    lens = fisheye(k1, k2, k3, k4)
    i = intrinsics(lens, fx=9.0, fy=9.5)  # about 300 degrees across
    rays = pixel_rays(i)
    real = np.isfinite(rays).all(axis=-1)
    np.testing.assert_allclose(np.linalg.norm(rays[real], axis=-1), 1, atol=1e-12)
    theta = np.arctan2(np.hypot(rays[..., 0], rays[..., 1]), rays[..., 2])[real]
    assert theta.max() <= lens_limit(lens) + 1e-12
    if lens_limit(lens) > 2:
        assert theta.max() > math.pi / 2
    pixels, is_shown = project(i, rays * 5)
    j, k = np.mgrid[:36, :48] + 0.5
    inner = real.copy()
    inner[real] = theta < lens_limit(lens) - 1e-6
    np.testing.assert_allclose(pixels[inner], np.stack([k, j], -1)[inner], atol=1e-9)
    assert is_shown[inner].all() and not is_shown[~real].any()


def test_fisheye_round_trip_where_newton_s_method_alone_jumps_for_ever():
    lens = fisheye(0.0, 0.02, 0.0025, -0.001)
    i = intrinsics(lens, 4, 4, fx=1.0, fy=1.0, cx=0.0, cy=0.0, skew=0.0)
    theta = np.linspace(0.01, lens_limit(lens) - 1e-6, 20_001)
    radius = theta * (1 + 0.02 * theta**4 + 0.0025 * theta**6 - 0.001 * theta**8)
    rays = i.lens.rays(np.stack([radius, np.zeros_like(radius)], axis=-1)).directions
    np.testing.assert_allclose(np.arctan2(rays[:, 0], rays[:, 2]), theta, atol=1e-7)


def test_equidistant_fisheye_in_closed_form():
    i = intrinsics(fisheye(0.0, 0.0, 0.0, 0.0), 401, 1, fx=100.0, fy=100.0, cx=200.5, cy=0.5, skew=0.0)
    angle = (np.arange(401) - 200) / 100
    expected = np.stack([np.sin(angle), np.zeros(401), np.cos(angle)], axis=-1)
    np.testing.assert_allclose(pixel_rays(i)[0], expected, atol=1e-14)
    pixels, is_shown = project(i, [[0, 0, 2], [1, 0, 0], [0, 0, -1], [0, 0, 0], [1, 0, -1]])
    np.testing.assert_allclose(pixels[:2], [[200.5, 0.5], [200.5 + 50 * math.pi, 0.5]])
    assert np.isnan(pixels[2:4]).all()
    np.testing.assert_allclose(pixels[4], [200.5 + 75 * math.pi, 0.5])
    assert is_shown.tolist() == [True, True, False, False, True]


@pytest.mark.parametrize("model, count", [("brown_conrady", 3), ("brown_conrady", 6), ("fisheye", 3), ("fisheye", 5)])
def test_number_of_coefficients(model, count):
    with pytest.raises(ValueError, match=f"expected .* coefficients, got {count}"):
        lens_parameters(model, coefficients=(0.0,) * count)


def test_focal_lengths():
    assert focal_from_fov(math.pi / 2, 640) == pytest.approx(320)
    assert focal_from_fov(math.pi, 640, fisheye(0, 0, 0, 0)) == pytest.approx(640 / math.pi)
    assert focal_from_sensor(50.0, 36.0, 720) == pytest.approx(1000)


@PROFILE
@given(a=st.floats(0, 6.2), e=st.floats(-1.5, 1.5), d=st.floats(0.1, 100), tilt=st.floats(-3, 3))
def test_orbit(a, e, d, tilt):
    rotation, center = orbit_rotation(a, e, tilt), orbit_center(a, e, d)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(rotation) == pytest.approx(1)
    np.testing.assert_allclose(rotation @ -center, [0, 0, d], atol=1e-12 * d)  # the target lies ahead
    up = orbit_rotation(a, e, 0.0) @ [0, 0, 1]
    assert abs(up[0]) < 1e-15 and up[1] <= 0  # no roll
    rolled = rotation @ [0, 0, 1]
    if math.cos(e) > 1e-3:
        # a camera that rolls clockwise sees the world turn counter-clockwise: what was up moves to the left
        assert math.atan2(-rolled[0], -rolled[1]) == pytest.approx(tilt, abs=1e-9)


def test_orbit_above():
    np.testing.assert_allclose(orbit_rotation(0.0, math.pi / 2), [[1, 0, 0], [0, -1, 0], [0, 0, -1]], atol=1e-15)
    np.testing.assert_allclose(orbit_center(math.pi / 2, 0, 2.0), [2, 0, 0], atol=1e-15)  # azimuth 90: on +X
