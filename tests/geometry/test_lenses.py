"""Every lens model: its rays and its projection are inverse to each other, for random cameras and positions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewsphere.geometry.box import projected_bounds
from viewsphere.geometry.camera import orbit_rotation
from viewsphere.geometry.lenses import LensSpec, lens_of, lens_parameters
from viewsphere.geometry.lenses.shared import outline
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.plugins import loadable

PROFILE = settings(max_examples=25, derandomize=True, deadline=None, database=None)
FEW = settings(PROFILE, max_examples=12)


def parameters(name: str, rng: np.random.Generator):
    """Random parameters of a shipped lens, none of which folds within the picture."""
    if name == "pinhole":
        return None
    if name == "orthographic":
        return lens_parameters(name)
    if name == "scan":
        rings = np.sort(rng.uniform(-80, 80, 24))[::-1]
        return lens_parameters(name, elevations_deg=rings.tolist(), turn_deg=rng.uniform(-180, 180))
    count, size = (4, 0.005) if name == "fisheye" else (int(rng.choice([4, 5, 8])), 0.02)
    return lens_parameters(name, coefficients=(size * rng.normal(size=count)).tolist())


def camera_of(name: str, rng: np.random.Generator) -> Camera:
    own = parameters(name, rng)
    size = {"width": 48, "height": 24, "fx": 48 / 6.0 if name == "scan" else 24.0, "fy": 1.0 if name == "scan" else 25.0}
    middle = {"cx": 24.0 + rng.normal(), "cy": 0.0 if name == "scan" else 12.0 + rng.normal()}
    intrinsics = Intrinsics(**size, **middle, skew=0.0 if name == "scan" else rng.normal(), distortion=own)
    return Camera(intrinsics, orbit_rotation(*rng.uniform(-1, 1, 3)), rng.normal(size=3))


MODELS = ("brown_conrady", "fisheye", "orthographic", "pinhole", "scan")


def test_every_shipped_lens_is_tried_here_or_in_a_file_of_its_own():
    files = {file.stem.removeprefix("test_") for file in (Path(__file__).parent / "lenses").glob("test_*.py")}
    assert set(loadable(LensSpec)) <= files.union(MODELS)


@pytest.mark.parametrize("name", MODELS)
@PROFILE
@given(seed=st.integers(0, 10**6))
def test_a_point_on_a_pixel_s_ray_is_seen_in_that_pixel(name, seed):
    rng = np.random.default_rng(seed)
    lens = camera_of(name, rng).lens
    xy = rng.uniform((1, 1), (47, 23), (60, 2))
    origins, directions = lens.rays(xy)
    has_ray = ~np.isnan(directions).any(axis=-1)
    assert has_ray.mean() > 0.5 and (lens.is_parallel or not origins.any())
    length = np.linalg.norm(directions[has_ray], axis=-1)
    assert np.allclose(length, 1, atol=1e-12) if lens.has_unit_rays else (directions[has_ray, 2] == 1).all()
    found, is_shown = lens.project(origins + directions * rng.uniform(0.01, 100, (60, 1)))
    assert is_shown[has_ray].all() and not is_shown[~has_ray].any()
    np.testing.assert_allclose(found[has_ray], xy[has_ray], atol=1e-9)


@pytest.mark.parametrize("name", MODELS)
def test_the_rays_of_pixels_are_those_through_their_centres(name):
    lens = camera_of(name, np.random.default_rng(1)).lens
    centres = np.stack(np.meshgrid(np.arange(48) + 0.5, np.arange(24) + 0.5), axis=-1)
    expected, found = lens.rays(centres).directions, lens.directions()
    has_ray = ~np.isnan(expected).any(axis=-1)
    np.testing.assert_array_equal(found[has_ray], expected[has_ray])
    assert np.isnan(found[~has_ray, 0]).all()
    assert np.array_equal(lens.directions(1, (3, 2, 9, 8)), found[2:8, 3:9], equal_nan=True)


@pytest.mark.parametrize("name", ["brown_conrady", "fisheye", "pinhole"])
@FEW
@given(seed=st.integers(0, 10**6))
def test_the_search_for_a_box_agrees_with_the_lens_s_own(name, seed):
    """Triangles that the lens shows wholly, and those that cross the plane behind which it shows nothing."""
    rng = np.random.default_rng(seed)
    camera = camera_of(name, rng)
    vertices = (rng.normal(size=(12, 3)) * 0.4 + (0, 0, rng.uniform(1.5, 5)) - camera.t) @ camera.R
    triangles = rng.integers(0, 12, (9, 3)).astype(np.int32)
    is_used = np.isin(np.arange(12), triangles)
    own, is_whole = projected_bounds(camera, vertices, triangles)
    found, found_whole = outline.bounds(camera.lens, camera.R, camera.t, vertices, is_used, triangles)
    assert found_whole == is_whole
    if is_whole:
        np.testing.assert_allclose(found, own, atol=1e-3)


def test_the_box_of_a_triangle_around_the_picture_holds_the_picture():
    equidistant = lens_parameters("fisheye", coefficients=[0] * 4)
    lens = lens_of(Intrinsics(width=48, height=24, fx=24, fy=25, cx=24, cy=12, distortion=equidistant))
    around = np.array([[-50.0, -50, 1], [50, -50, 1], [0, 90, 1]])
    is_used, face = np.ones(3, np.bool_), np.array([[0, 1, 2]], np.int32)
    (x0, y0, x1, y1), _ = outline.bounds(lens, np.eye(3), np.zeros(3), around, is_used, face)
    assert x0 <= 0.5 and y0 <= 0.5 and x1 >= 47.5 and y1 >= 23.5


def test_the_box_of_a_triangle_that_crosses_a_pinhole_s_plane_is_cut_at_the_picture_s_edge():
    lens = lens_of(Intrinsics(width=48, height=24, fx=24, fy=24, cx=24, cy=12))
    ground = np.array([[-90.0, 1, 9], [90, 1, 9], [0, 1, -9]])
    is_used, face = np.ones(3, np.bool_), np.array([[0, 1, 2]], np.int32)
    box, whole = outline.bounds(lens, np.eye(3), np.zeros(3), ground, is_used, face)
    assert not whole and box[1] == pytest.approx(12 + 24 / 9, abs=1e-3) and box[3] >= 23.5
    behind = outline.bounds(lens, np.eye(3), np.zeros(3), ground - (0, 0, 20), is_used, face)
    assert behind == (None, False)


@pytest.mark.parametrize("name", MODELS)
def test_plain_data_make_the_same_lens_again(name):
    one = camera_of(name, np.random.default_rng(3)).intrinsics
    again = Intrinsics.model_validate_json(one.model_dump_json())
    assert again == one and hash(again) == hash(one) and type(again.distortion) is type(one.distortion)
    assert again.lens is one.lens
