"""Surfaces in one place: which is seen, whatever rounding says."""

import math

import numpy as np
import pytest

from truth_scenes import EVERY, cube, lens, mesh_of, orbit_camera, placed, silhouette
from viewsphere.geometry.camera import orbit_rotation
from viewsphere.geometry.rotation import compose, rigid
from viewsphere.truth.raster.visibility import rasterize
from viewsphere_zoo.families.fence import LENGTH, Fence, fence

IMAGE = (0, 0, 160, 120)


def grid(low, high, columns, rows, flipped=False):
    """Corners in the plane z = 0, and triangles, of a rectangle cut into columns x rows."""
    x, y = np.meshgrid(np.linspace(low[0], high[0], columns + 1), np.linspace(low[1], high[1], rows + 1), indexing="ij")
    i = np.arange(columns * rows)
    a = i // rows * (rows + 1) + i % rows
    b, c, d = a + 1, a + rows + 2, a + rows + 1
    triangles = [[a, d, c], [a, c, b]] if flipped else [[a, d, b], [d, c, b]]
    return np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3), np.concatenate([np.stack(t, axis=1) for t in triangles])


def turned(angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def seen_object(geometry, camera):
    seen = rasterize(geometry, camera)
    return np.where(seen.triangle >= 0, geometry.triangle_object[seen.triangle], 0)


def camera_before(rng, name, normal, middle):
    """A random camera a few metres away that sees a plane of this normal from 75 degrees off it or less."""
    fisheye = name == "fisheye"
    intrinsics = lens(160, 120, math.radians(120 if fisheye else 40), EVERY[name], skew=rng.uniform(-1, 1))
    while True:
        camera = orbit_camera(intrinsics, *rng.uniform(-3, 3, 2), 10 ** rng.uniform(0.3, 1), middle, rng.uniform(-3, 3))
        view = middle - camera.center
        if abs(normal @ view) > math.cos(math.radians(75)) * np.linalg.norm(view):
            return camera


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.slow
def test_of_two_surfaces_in_one_plane_the_first_is_seen_all_over(name, swapped):
    """Tilted, cut into different triangles, their corners rounded to float32: no camera sees a mixture."""
    rng, overlap = np.random.default_rng(4), 0
    for _ in range(12):
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        middle = rng.normal(size=3) * 0.5
        sheets = [grid((-1, -0.8), (0.7, 0.9), 7, 5), grid((-0.6, -1), (1, 0.7), 3, 8, flipped=True)]
        meshes = [mesh_of(corners @ turn.T + middle, triangles) for corners, triangles in sheets]
        geometry = placed(*meshes[:: -1 if swapped else 1])
        for _ in range(4):
            camera = camera_before(rng, name, turn[:, 2], middle)
            both = silhouette(geometry, camera, 1, IMAGE) & silhouette(geometry, camera, 2, IMAGE)
            assert (seen_object(geometry, camera)[both] == 1).all()
            overlap += both.sum()
    assert overlap > 20_000


def test_a_camera_that_moves_does_not_flip_them():
    patch = mesh_of(*grid((-0.4, -0.4), (0.4, 0.4), 9, 4))
    tilted = rigid(orbit_rotation(0.7, 0.2, 0.1), (0.0, 0.0, 0.0))
    geometry = placed(cube(0.5), patch, moves=[tilted, compose(tilted, rigid(np.eye(3), (0.0, 0.0, 0.5)))])
    for shift in np.linspace(0, 1, 40):
        camera = orbit_camera(lens(160, 120, 0.5), 0.3 + 0.01 * shift, 0.8, 3.0 + 1e-3 * shift, (shift / 7, 0.0, 0.4))
        on_cube = seen_object(geometry, camera)
        assert (on_cube != 2).all()
        assert (on_cube == 1).sum() > 1000


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize(("gap", "winner"), [(1e-6, 2), (1e-8, 1)])
def test_what_is_nearer_by_a_millionth_is_seen(name, gap, winner):
    """A sheet in front of another, later in order, and small and large triangles of it."""
    sheet = mesh_of(*grid((-1, -1), (1, 1), 1, 1))
    fine = mesh_of(*grid((-1, -1), (1, 1), 20, 20))
    fisheye = name == "fisheye"
    camera = orbit_camera(lens(160, 120, 2.0 if fisheye else 0.8, EVERY[name]), elevation=math.pi / 2, distance=2.0)
    for front in (sheet, fine):
        move = np.eye(4)
        move[2, 3] = 2.0 * gap
        geometry = placed(sheet, front, moves=[np.eye(4), move])
        seen = seen_object(geometry, camera)
        both = silhouette(geometry, camera, 1, IMAGE) & silhouette(geometry, camera, 2, IMAGE)
        assert both.sum() > 1000
        assert (seen[both] == winner).all()


@pytest.mark.parametrize("name", EVERY)
def test_what_lies_in_the_ground_is_seen_before_it(name):
    """From any height above the ground, however low."""
    sheet = mesh_of(*grid((-1, -1), (1, 1), 3, 5))
    for i, height in enumerate((1e-3, 1e-2, 0.3, 2.0)):
        flat = rigid(turned(0.4 + i), (0.37, -0.21, 0.77))
        geometry = placed(sheet, cube(0.25), moves=[flat, rigid(turned(i), (0.9, 0.8, 1.02))], ground=True)
        fov = 2.0 if name == "fisheye" else 1.0
        camera = orbit_camera(lens(160, 120, fov, EVERY[name]), i, math.asin(height / 4), 4.0, (0.3, 0.0, geometry.ground_z))
        assert camera.center[2] > geometry.ground_z
        alone = silhouette(geometry, camera, 1, IMAGE) | silhouette(geometry, camera, 2, IMAGE)
        assert np.array_equal(seen_object(geometry, camera) > 0, alone)


@pytest.mark.parametrize("style", ["pickets", "boards", "railing"])
def test_of_neighbouring_fences_the_first_has_the_post_they_share(style):
    panel = fence(Fence(style=style))
    turn = turned(0.37)
    beside = turn[:, 0] * LENGTH
    geometry = placed(panel, panel, moves=[rigid(turn, (0.0, 0.0, 0.0)), rigid(turn, beside)])
    shared = 0
    for azimuth in np.linspace(0, 6, 9):
        camera = orbit_camera(lens(160, 120, 0.3), azimuth, 0.2, 4.0, beside / 2 + (0.0, 0.0, 0.6))
        depths = [rasterize(geometry, camera, object_id=i).inverse_depth for i in (1, 2)]
        tied = (depths[0] == depths[1]) & (depths[0] > 0)
        assert (seen_object(geometry, camera)[tied] == 1).all()
        shared += tied.sum()
    assert shared > 1000
