"""A LiDAR's sweep while things and sensor move: closed forms, and each column drawn at its own moment."""

from dataclasses import replace

import numpy as np
import pytest

from truth_scenes import cube, mesh_of, placed, sphere
from viewsphere.geometry.camera import pixel_rays
from viewsphere.geometry.rotation import rigid, rotation_about
from viewsphere.model.sensors.camera import Camera
from viewsphere.recipe.cameras.lidar import LidarEntry
from viewsphere.truth.lidar.sweeping import Turning, still_hits, swept_hits
from viewsphere.truth.raster.visibility import rasterize

RIGHT_HANDED = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # looks along the world's y, its z is up


def scan(**more):
    said = {"rings": 16, "elevation": [-20, 20], "azimuth_step": 1, "range": [0, 1000]} | more
    return LidarEntry.model_validate(said).intrinsics


def driving(own, seconds=0.1, velocity=(0.0, 0.0, 0.0), spin=(0.0, 0.0, 0.0), moved=None):
    """The columns' poses of a sensor that goes straight on and turns evenly, in world axes."""
    times = ((np.arange(own.width) + 0.5) / own.width - 0.5) * seconds
    rotation = np.stack([RIGHT_HANDED @ rotation_about(np.multiply(spin, t)).T for t in times])
    centers = np.multiply.outer(times, velocity)
    shift = -(rotation @ centers[..., None])[..., 0]
    things = {i: np.stack([rigid(np.eye(3), np.multiply(v, t)) for t in times]) for i, v in (moved or {}).items()}
    return times, Turning(rotation, shift, things)


def wall(distance):
    corners = [[-200, distance, -200], [200, distance, -200], [200, distance, 200], [-200, distance, 200]]
    return mesh_of(corners, [[0, 1, 2], [0, 2, 3]])


@pytest.mark.parametrize("is_wall_moving", [False, True])
def test_a_wall_comes_nearer_from_column_to_column(is_wall_moving):
    own, speed = scan(azimuth=[-60, 60]), 15.0
    geometry = placed(wall(20.0))
    moved = {0: (0.0, -speed, 0.0)} if is_wall_moving else None
    times, turning = driving(own, velocity=(0, 0 if is_wall_moving else speed, 0), moved=moved)
    hits = swept_hits(geometry, Camera(own, RIGHT_HANDED, np.zeros(3)), turning)
    assert len(hits.ring) == own.width * own.height
    ahead = pixel_rays(own)[hits.ring, hits.column, 2]
    np.testing.assert_allclose(hits.distance, (20 - speed * times[hits.column]) / ahead, rtol=1e-12)
    np.testing.assert_allclose(hits.cosine, ahead, rtol=1e-9)


def test_a_turning_sensor_sees_a_wall_turn():
    own, rate = scan(azimuth=[-30, 30]), 1.0
    times, turning = driving(own, spin=(0, 0, rate))
    hits = swept_hits(placed(wall(20.0)), Camera(own, RIGHT_HANDED, np.zeros(3)), turning)
    azimuth = np.radians(30 - (hits.column + 0.5)) + rate * times[hits.column]
    level = np.hypot(*np.moveaxis(pixel_rays(own)[hits.ring, hits.column][:, [0, 2]], -1, 0))
    np.testing.assert_allclose(hits.distance, 20 / (np.cos(azimuth) * level), rtol=1e-12)


def test_nothing_moves_nothing_changes():
    own = scan()
    geometry = placed(sphere(4, 1.5), cube(1.0), moves=[rigid(np.eye(3), (0, 6, 0)), rigid(np.eye(3), (5, -2, 0))], ground=True)
    camera = Camera(own, RIGHT_HANDED, np.zeros(3))
    _, turning = driving(own)
    still, swept = still_hits(geometry, camera, rasterize(geometry, camera)), swept_hits(geometry, camera, turning)
    for name in ("ring", "column", "triangle"):
        np.testing.assert_array_equal(getattr(swept, name), getattr(still, name))
    np.testing.assert_allclose(swept.distance, still.distance, rtol=1e-6)
    np.testing.assert_allclose(swept.incidence, still.incidence, atol=1e-3)  # the world's normals are float32


@pytest.mark.slow
def test_each_column_is_nearly_as_if_drawn_at_its_own_moment():
    """At a street's speeds: another triangle is met at outlines, and a neighbouring facet of a ball; all else is the same."""
    own, rng = scan(rings=32, elevation=[-15, 5]), np.random.default_rng(4)
    moves = [rigid(rotation_about(rng.normal(size=3)), (*rng.uniform(-20, 20, 2), 0)) for _ in range(12)]
    meshes = [sphere(3, 1.5) if i % 2 else cube(1.2) for i in range(12)]
    geometry = placed(*meshes, moves=moves, ground=True)
    _, turning = driving(own, velocity=(3, 14, 0), spin=(0, 0, 0.5), moved={0: (-8, 3, 0), 3: (0, -14, 0)})
    hits = swept_hits(geometry, Camera(own, RIGHT_HANDED, np.zeros(3)), turning)
    found = np.full((own.height, own.width), np.inf)
    found[hits.ring, hits.column] = hits.distance
    expected = np.full_like(found, np.inf)
    for column in range(own.width):
        camera = Camera(own, turning.rotation[column], turning.shift[column])
        there = rasterize(_at(geometry, turning, column), camera, window=(column, 0, column + 1, own.height), keeps_exact=True)
        with np.errstate(divide="ignore"):
            expected[:, column] = 1 / there.exact[:, 0]
    assert np.isfinite(expected).mean() > 0.5
    assert (_apart(found, expected) > 1e-4).mean() < 0.02
    camera = Camera(own, RIGHT_HANDED, np.zeros(3))
    still = still_hits(geometry, camera, rasterize(geometry, camera))
    all_at_once = np.full_like(found, np.inf)
    all_at_once[still.ring, still.column] = still.distance
    assert (_apart(all_at_once, expected) > 1e-4).mean() > 0.1


def _apart(one, other):
    """How far ranges are apart, infinite where one is there alone."""
    with np.errstate(invalid="ignore"):
        return np.where(np.isinf(one) & np.isinf(other), 0.0, np.abs(one - other))


def _at(geometry, turning, column):
    """All triangles at a column's moment."""
    poses = geometry.poses.copy()
    for i, motion in turning.moved.items():
        poses[i] = motion[column] @ poses[i]
    return replace(geometry, poses=poses)
