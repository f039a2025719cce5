"""The exact rasteriser under a rolling shutter: its rows are those of pictures in which all rows have one row's poses."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from rolling_scenes import at, at_row, rolling_camera, shown_rows
from truth_scenes import cube, lens, orbit_camera, placed, random_soup, sphere
from viewsphere.geometry.rotation import rotation_about
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.sensors.rolling import Rolling, RowPoses
from viewsphere.truth.raster.rolling import pixels_in_rows
from viewsphere.truth.raster.visibility import rasterize


@pytest.mark.parametrize("seed", range(8))
def test_each_row_is_that_of_a_still_picture_at_its_time(seed):
    rng = np.random.default_rng(seed)
    geometry = placed(
        random_soup(rng, 60),
        cube(0.4),
        sphere(2, 0.5),
        moves=[at(0, 0, 0), at(1, 0, 0.3), at(-0.5, 0.5, 0.2)],
        ground=seed % 2 == 0,
    )
    geometry = replace(geometry, single_sided=np.arange(0, len(geometry.triangles) - 4, 3, dtype=np.int32))
    camera = orbit_camera(lens(64, 48), rng.uniform(0, 6), rng.uniform(0.05, 1.2), rng.uniform(0.2, 4), tilt=rng.uniform(-1, 1))
    camera = rolling_camera(camera, geometry, rng, turn=rng.uniform(0.1, 2), shift=rng.uniform(0, 1), moving=(1, 2))
    rolled = rasterize(geometry, camera)
    different = 0
    for row in range(camera.height):
        still = rasterize(*at_row(geometry, camera, row), keeps_exact=True)
        np.testing.assert_array_equal(rolled.triangle[row], still.triangle[row])
        np.testing.assert_array_equal(rolled.exact[row], still.exact[row])
        different += int((still.triangle != rolled.triangle).sum())
    assert different  # the rows' worlds differ


def test_rows_outside_the_picture_have_the_poses_of_its_ends():
    rng = np.random.default_rng(3)
    geometry = placed(cube(0.4), sphere(2, 0.5), moves=[at(0.4, 0, 0.3), at(-0.5, 0.5, 0.2)])
    camera = rolling_camera(orbit_camera(lens(40, 30), 0.3, 0.3, 1.5), geometry, rng, moving=(0,))
    window = (-40, -30, 80, 60)
    rolled = rasterize(geometry, camera, object_id=1, window=window)
    for row in (-30, -5, 0, 14, 29, 30, 59):
        still, there = at_row(geometry, camera, min(max(row, 0), 29))
        own = rasterize(still, there, object_id=1, window=window)
        np.testing.assert_array_equal(rolled.triangle[row + 30], own.triangle[row + 30])
    assert (rolled.triangle[:30] >= 0).any() and (rolled.triangle[60:] >= 0).any()


def test_the_middle_of_the_picture_is_the_instant():
    moments = Rolling(readout=0.03).moments(4, 0.06)
    np.testing.assert_allclose(moments, [-0.1875, -0.0625, 0.0625, 0.1875])
    np.testing.assert_array_equal(Rolling(readout=0.03, direction="up").moments(4, 0.06), -moments)


def test_a_spinning_camera_slants_a_vertical_pole():
    """A pole on the horizon in azimuth a is at column cx + f tan(a - w t), at the row's time t = (v + 1/2 - H/2) r / H."""
    height, focal, speed, readout = 120, 100.0, 0.8, 0.1
    camera = Camera(lens(160, height, fov=2 * math.atan(80 / focal)), np.eye(3), np.zeros(3))
    times = ((np.arange(height) + 0.5) / height - 0.5) * readout
    rotation = np.stack([rotation_about([0, -speed * t, 0]) for t in times])  # x_camera, turning to the right
    camera = replace(camera, rows=RowPoses(rotation, np.zeros((height, 3)), {}))
    half, far = 0.05, 4.0
    wall = cube(1.0)
    wall = replace(wall, vertices=(wall.vertices * (half, 50.0, 1e-4) + (0, 0, far)).astype(np.float32))
    seen = rasterize(placed(wall), camera).triangle >= 0
    f = camera.K[0, 0]
    for side in (-1, 1):
        edge = 80 + f * np.tan(math.atan(side * half / (far - 1e-4)) - speed * times)
        columns = np.array([np.flatnonzero(row)[0 if side < 0 else -1] for row in seen]) + (0 if side < 0 else 1)
        assert (np.abs(columns - edge) <= 0.5 + 1e-2).all()
    assert abs(edge[0] - edge[-1]) > 7


@pytest.mark.parametrize(("turn", "shift"), [(0.02, 0.02), (0.4, 0.3), (3.0, 1.0), (9.0, 2.0)])
def test_a_point_is_where_the_row_nearest_to_the_instant_shows_it(turn, shift):
    """Slow motions show each point once; fast ones several times, or never."""
    rng = np.random.default_rng(5)
    geometry = placed(cube(0.4))
    counts = set()
    for _ in range(6):
        camera = orbit_camera(lens(64, 48), rng.uniform(0, 6), rng.uniform(0, 1), rng.uniform(0.8, 3))
        camera = rolling_camera(camera, geometry, rng, turn, shift)
        points = rng.normal(size=(60, 3)) * 0.8
        found, z = pixels_in_rows(camera, camera.rows, 0, geometry.poses[0], points)
        for own, depth, point in zip(found, z, points, strict=True):
            places = shown_rows(camera, np.tile(geometry.poses[0], (camera.height, 1, 1)), point)
            counts.add(len(places))
            assert np.isnan(own).all() == (not places) == np.isnan(depth)
            if places:
                nearest = min(abs(y - 24) for _, y in places)
                assert abs(abs(own[1] - 24) - nearest) < 1e-6
                assert min(math.dist(own, place) for place in places) < 1e-6
    assert 1 in counts and (turn < 1 or counts & {0, 2, 3})
