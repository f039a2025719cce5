"""The rays of a LiDAR's scan: to pixels and back, and the box of a projected model."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quick import quick
from viewsphere.geometry.box import projected_bounds
from viewsphere.geometry.camera import orbit_rotation, pixel_rays, project
from viewsphere.geometry.lenses.scan import Scan
from viewsphere.model.sensors.camera import Camera
from viewsphere.recipe.cameras.lidar import LidarEntry


def scan(**said):
    return LidarEntry.model_validate({"rings": 8, "elevation": [-25, 3], "azimuth_step": 5} | said).intrinsics


SCANS = {
    "turn": scan(),
    "sector": scan(azimuth=[-30, 50], azimuth_step=2),
    "behind": scan(azimuth=[90, 270]),
    "uneven": scan(rings=None, elevation=None, elevations=[10, 4, 2, 1, 0, -3, -20]),
    "lone": scan(rings=None, elevation=None, elevations=[-2]),
    "both poles": scan(elevation=[-90, 90], rings=7),
}


@pytest.mark.parametrize("name", SCANS)
def test_rays_come_back_to_their_pixels(name):
    """Those beyond the first and last ring, and beside a sector, too."""
    own = SCANS[name]
    window = (-own.width, -own.height, 2 * own.width, 2 * own.height)
    rays = pixel_rays(own, 1, window)
    there = np.isfinite(rays[..., 0])
    np.testing.assert_allclose(np.linalg.norm(rays[there], axis=-1), 1, rtol=1e-14)
    y, x = np.mgrid[window[1] : window[3], window[0] : window[2]] + 0.5
    level = there & (np.hypot(rays[..., 0], rays[..., 2]) > 1e-9)
    pixels, _ = project(own, 3.0 * rays[level])
    np.testing.assert_allclose(pixels, np.stack([x, y], axis=-1)[level], atol=1e-9)
    inside = there[own.height : 2 * own.height, own.width : 2 * own.width]
    assert inside.all()


def test_rings_and_columns_have_the_angles_that_were_asked_for():
    """Columns go clockwise seen from above, from the left; azimuths are counted to the left of ahead."""
    own = SCANS["sector"]
    rays = pixel_rays(own)
    azimuth, elevation = np.degrees(np.arctan2(-rays[..., 0], rays[..., 2])), np.degrees(np.arcsin(-rays[..., 1]))
    np.testing.assert_allclose(azimuth, np.broadcast_to(50 - 2 * (np.arange(40) + 0.5), (8, 40)), atol=1e-12)
    np.testing.assert_allclose(elevation, np.broadcast_to(np.linspace(3, -25, 8)[:, None], (8, 40)), atol=1e-12)


def test_a_whole_turn_has_each_direction_once():
    own = SCANS["turn"]
    around = pixel_rays(own, 1, (-own.width, 0, 2 * own.width, own.height))
    assert np.isnan(around[:, : own.width]).all()
    assert np.isnan(around[:, 2 * own.width :]).all()
    directions = np.random.default_rng(1).normal(size=(500, 3))
    pixels, _ = project(own, directions)
    assert ((pixels[:, 0] >= 0) & (pixels[:, 0] < own.width)).all()


def test_straight_up_has_no_pixel():
    pixels, _ = project(SCANS["turn"], [[0, -2, 0], [0, 2, 0], [0, 0, 0]])
    assert np.isnan(pixels).all()


@pytest.mark.parametrize("name", quick(SCANS, "behind", "uneven", "both poles"))
@given(seed=st.integers(0, 10**6))
def test_the_box_of_triangles_is_that_of_their_points(name, seed):
    """It holds all of them, and is no larger, but for triangles that lie all around or behind the scan's middle."""
    rng = np.random.default_rng(seed)
    own = SCANS[name]
    corners = rng.normal(size=(3, 3)) + rng.normal(size=3) * rng.choice([0.3, 2.0])
    camera = Camera(own, orbit_rotation(*rng.uniform(-1, 1, 3)), rng.normal(size=3) * 0.2)
    bounds, whole = projected_bounds(camera, corners, np.array([[0, 1, 2]], np.int32))
    share = np.linspace(0, 1, 401)[:, None, None]
    edges = (1 - share) * corners + share * np.roll(corners, 1, axis=0)
    inner = rng.dirichlet([1, 1, 1], 2000) @ corners
    points = np.concatenate([edges.reshape(-1, 3), inner]) @ camera.R.T + camera.t
    pixels, _ = project(own, points)
    assert whole
    assert (pixels >= np.array(bounds[:2]) - 1e-9).all()
    assert (pixels <= np.array(bounds[2:]) + 1e-9).all()
    turn = 2 * math.pi * own.K[0, 0]
    if bounds[2] - bounds[0] < turn * 0.99:
        np.testing.assert_allclose(pixels[:, 0].min(), bounds[0], atol=1e-9)
        np.testing.assert_allclose(pixels[:, 0].max(), bounds[2], atol=1e-9)
        degree = np.abs(np.diff(project(own, edges @ camera.R.T + camera.t)[0][..., 1], axis=0)).max()
        assert pixels[:, 1].min() - bounds[1] <= degree + 1e-9
        assert bounds[3] - pixels[:, 1].max() <= degree + 1e-9


def test_a_triangle_overhead_lies_all_around():
    camera = Camera(SCANS["turn"], np.eye(3), np.zeros(3))
    overhead = np.array([[-1.0, -1, -1], [1, -1, -1], [0, -1, 2]])
    (x0, y0, x1, y1), _ = projected_bounds(camera, overhead, np.array([[0, 1, 2]], np.int32))
    up = (3 - 90) / 4 + 0.5  # rows are four degrees apart
    np.testing.assert_allclose((x0, x1, y0), (0, SCANS["turn"].width, up), atol=1e-9)
    assert y1 < 0


def test_rings_fall():
    with pytest.raises(ValueError, match="expected elevations that fall from ring to ring; found 1, then 2"):
        Scan(elevations_deg=(1.0, 2.0))
