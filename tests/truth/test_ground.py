"""The endless ground, against the closed form: a ray meets the plane z = h where center + s ray has that height."""

import math

import numpy as np
import pytest

from quick import quick
from truth_scenes import LENSES, cube, lens, mesh_of, orbit_camera, placed
from viewsphere.geometry.camera import pixel_rays
from viewsphere.labels import observe
from viewsphere.truth.raster.geometry import without_ground
from viewsphere.truth.raster.visibility import rasterize, with_ground

UP_TO = 1e-9
"""Sine of the angle to the horizon up to which rounding may decide."""

LOW = placed(mesh_of([[0, 0, 0], [1e-3, 0, 0], [0, 1e-3, 0]], [[0, 1, 2]]), ground=True)
"""A ground that used to end a metre away, around next to nothing."""


def closed_form(geometry, camera):
    """s (H, W) at which rays meet the ground, infinite where they do not, and world z of unit rays, NaN where there is none."""
    rays = pixel_rays(camera.intrinsics)
    z = (rays @ camera.R)[..., 2]
    s = (geometry.ground_z - camera.center[2]) / np.where(z == 0, np.nan, z)
    return np.where(s > 0, s, np.inf), z / np.linalg.norm(rays, axis=2)


@pytest.mark.parametrize("name", LENSES)
@pytest.mark.parametrize("elevation", [-0.6, -0.01, 0.004, 0.1, 0.8, math.pi / 2])
@pytest.mark.parametrize("tilt", quick([0.0, 1.1], 1.1))
@pytest.mark.parametrize("distance", [0.3, 500.0])
def test_depth_is_that_of_a_plane_up_to_the_horizon(name, elevation, tilt, distance):
    camera = orbit_camera(lens(97, 73, 1.3, LENSES[name]), 0.4, elevation, distance, tilt=tilt)
    visibility = rasterize(LOW, camera)
    expected, z = closed_form(LOW, camera)
    is_ground = visibility.triangle >= LOW.triangle_start[-1]
    assert np.array_equal(is_ground | (visibility.triangle == 0), visibility.triangle >= 0)
    known = (np.abs(z) > UP_TO) & (visibility.triangle != 0)  # False without a ray
    assert np.array_equal(is_ground[known], np.isfinite(expected[known]))
    on = known & is_ground
    assert on.any()
    observed = observe(LOW, camera, visibility, ["depth", "normals", "normals_geometric"])
    np.testing.assert_allclose(observed["depth"][on], (expected * pixel_rays(camera.intrinsics)[..., 2])[on], rtol=1e-6)
    up = camera.R[:, 2] * np.sign(camera.center[2])
    np.testing.assert_allclose(observed["normals"][on], np.broadcast_to(up, (on.sum(), 3)), atol=1e-6)
    np.testing.assert_allclose(observed["normals_geometric"][on], np.broadcast_to(up, (on.sum(), 3)), atol=1e-6)


@pytest.mark.parametrize(("below", "is_seen"), [(1e-6, True), (0.0, False), (-1e-6, False)])
def test_a_millionth_of_a_pixel_below_the_horizon_there_is_ground(below, is_seen):
    """Pixels `below` the horizon of a level camera 1.7 m up; on it there is sky, whatever rounding says."""
    camera = orbit_camera(lens(97, 73, 1.0, cy=36.5 - below), 0.3, 0.0, 3.0, (0, 0, 1.7))
    visibility = rasterize(LOW, camera)
    assert (visibility.triangle[:36] < 0).all()
    assert (visibility.triangle[37:] >= 0).all()
    assert ((visibility.triangle[36] >= 0) == is_seen).all()
    depth = observe(LOW, camera, visibility, ["depth"])["depth"][36]
    np.testing.assert_allclose(depth, 1.7 * camera.intrinsics.fy / below if is_seen else np.inf, rtol=1e-6)


@pytest.mark.parametrize("name", LENSES)
def test_samples_see_what_a_finer_camera_sees(name):
    camera = orbit_camera(lens(40, 30, 1.2, LENSES[name]), 0.4, 0.05, 3.0, tilt=0.3)
    fine = lens(80, 60, 1.2, LENSES[name])
    expected = rasterize(LOW, orbit_camera(fine, 0.4, 0.05, 3.0, tilt=0.3))
    assert np.array_equal(rasterize(LOW, camera, subdivision=2).triangle, expected.triangle)


@pytest.mark.parametrize("name", LENSES)
@pytest.mark.parametrize("elevation", [-0.4, 0.02, 0.7])
def test_ground_laid_afterwards_is_that_of_all_at_once(name, elevation):
    geometry = placed(cube(0.7), ground=True)
    camera = orbit_camera(lens(96, 72, 1.1, LENSES[name]), 0.4, elevation, 3.0, tilt=0.2)
    bare = without_ground(geometry)
    assert bare.ground_z is None
    assert len(bare.triangles) == len(bare.triangle_cutout) == geometry.triangle_start[-1]
    assert len(bare.vertices) == len(bare.normals) == geometry.vertex_start[-1]
    assert without_ground(bare) is bare
    # Which way all faces is held once for both, and was asked for without the ground first.
    assert len(bare.triangle_normals) == len(bare.triangle_side) == geometry.triangle_start[-1]
    np.testing.assert_array_equal(geometry.triangle_normals[geometry.triangle_start[-1] :], [(0, 0, 1)] * 2)
    np.testing.assert_array_equal(geometry.normals[geometry.vertex_start[-1] :], [(0, 0, 1)] * 4)
    assert len(geometry.triangle_side) == len(geometry.triangles)
    alone = rasterize(bare, camera)
    assert alone.triangle.max() < geometry.triangle_start[-1]
    before = alone.triangle.copy()
    laid, expected = with_ground(geometry, camera, alone), rasterize(geometry, camera)
    assert np.array_equal(alone.triangle, before)
    assert np.array_equal(laid.triangle, expected.triangle)
    assert np.array_equal(laid.inverse_depth, expected.inverse_depth)
    assert (laid.triangle >= geometry.triangle_start[-1]).any()
