import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from truth_scenes import EVERY, LENSES, cast, cube, lens, mesh_of, orbit_camera, placed, random_soup, silhouette, sphere
from viewsphere.geometry.camera import pixel_rays
from viewsphere.model.sensors.camera import Camera
from viewsphere.truth.raster.visibility import rasterize

EXACT = settings(max_examples=12, derandomize=True, deadline=None, database=None)


def depth_of(visibility):
    with np.errstate(divide="ignore"):
        return 1.0 / visibility.inverse_depth.astype(np.float64)


@pytest.mark.parametrize("name", EVERY)
@EXACT
@given(seed=st.integers(0, 10**6))
def test_equals_brute_force_on_soups(name, seed):
    rng = np.random.default_rng(seed)
    geometry = placed(random_soup(rng, 40), random_soup(rng, 40), ground=bool(rng.integers(2)))
    fov = math.radians(rng.uniform(20, 100) if name != "fisheye" else rng.uniform(100, 250))
    intrinsics = lens(40, 32, fov, EVERY[name], cx=rng.uniform(10, 30), cy=rng.uniform(10, 24), skew=rng.uniform(-2, 2))
    distance = 10 ** rng.uniform(-1, 1)  # often inside the soup
    camera = orbit_camera(intrinsics, *rng.uniform(-3, 3, 2), distance, tilt=rng.uniform(-1, 1))
    triangle, s, margin, gap = cast(geometry, camera)
    seen = rasterize(geometry, camera)
    sure = (margin > 1e-9) & (gap > 1e-9)
    assert sure.mean() > 0.99
    assert np.array_equal(seen.triangle[sure], triangle[sure])
    hit = sure & (triangle >= 0)
    np.testing.assert_allclose(depth_of(seen)[hit], s[hit], rtol=1e-6)
    assert (seen.inverse_depth[seen.triangle < 0] == 0).all()


def test_pinhole_and_ray_table_agree():
    """The same view drawn by the projection and by the ray table: a lens whose coefficients are all zero."""
    geometry = placed(random_soup(np.random.default_rng(5), 400), ground=True)
    straight = lens(160, 120, 1.2, skew=3.0)
    zero = straight.model_copy(update={"distortion": LENSES["barrel"].model_copy(update={"coefficients": (0.0,) * 4})})
    for elevation in (-0.4, 0.3, math.pi / 2):
        a = rasterize(geometry, orbit_camera(straight, 0.3, elevation, 3.0))
        b = rasterize(geometry, orbit_camera(zero, 0.3, elevation, 3.0))
        assert np.mean(a.triangle != b.triangle) < 2e-4
        same = a.triangle == b.triangle
        np.testing.assert_allclose(a.inverse_depth[same], b.inverse_depth[same], rtol=3e-7)


@pytest.mark.parametrize("name", LENSES)
def test_tilted_plane_depth_is_exact(name):
    quad = mesh_of([[-50, 3, -50], [50, 9, -50], [50, 9, 50], [-50, 3, 50]], [[0, 1, 2], [0, 2, 3]])
    geometry = placed(quad)
    camera = Camera(lens(64, 48, 0.9, EVERY[name]), orbit_camera(lens(), 0, 0).R, np.zeros(3))
    seen = rasterize(geometry, camera)
    rays = pixel_rays(camera.intrinsics)
    normal = np.array([-0.06, 0.0, 1.0])  # y = 6 + .06 x in the world is z = 6 + .06 x in the camera
    np.testing.assert_allclose(depth_of(seen), 6.0 / (rays @ normal), rtol=2e-7)


def test_cube_faces_and_corner_depths():
    geometry = placed(cube(0.5))
    front = rasterize(geometry, orbit_camera(lens(101, 101, 0.4), distance=4.0))
    hit = front.triangle >= 0
    np.testing.assert_allclose(depth_of(front)[hit], 3.5, rtol=1e-7)
    side = 101 / math.tan(0.2) / 2 / 3.5  # pixels of the face's edge
    assert hit.sum() == round(side) ** 2
    diagonal = math.asin(1 / math.sqrt(3))
    corner = rasterize(geometry, orbit_camera(lens(101, 101, 0.4), math.pi / 4, diagonal, 4.0))
    assert 4 - math.sqrt(3) / 2 <= depth_of(corner).min() < 4 - math.sqrt(3) / 2 + 0.02
    assert depth_of(corner)[50, 50] == pytest.approx(4 - math.sqrt(3) / 2, rel=1e-6)


@pytest.mark.parametrize("name", LENSES)
def test_ball(name):
    radius, distance = 1.0, 4.0
    ball = sphere(5, radius)
    camera = orbit_camera(lens(160, 120, 0.8, EVERY[name]), 0.4, 0.7, distance, tilt=0.3)
    seen = rasterize(placed(ball), camera)
    d = pixel_rays(camera.intrinsics)
    d = d / np.linalg.norm(d, axis=-1, keepdims=True)
    along = distance * d[..., 2]
    root = along**2 - (distance**2 - radius**2)
    edges = ball.vertices[ball.triangles]
    longest = np.linalg.norm(edges - np.roll(edges, 1, axis=1), axis=-1).max()
    sagitta = longest**2 / (6 * radius)
    hit = seen.triangle >= 0
    inner = root > 8 * radius * sagitta
    assert hit[inner].all()
    assert not hit[root < 0].any()
    t = depth_of(seen) * np.linalg.norm(pixel_rays(camera.intrinsics), axis=-1)
    expected = along - np.sqrt(np.maximum(root, 0))
    slack = t[inner] - expected[inner]  # the mesh lies inside the ball: never nearer, and later by the sagitta over the cosine
    assert slack.min() > -1e-6
    assert (slack * np.sqrt(root[inner]) / radius).max() < 1.5 * sagitta


@pytest.mark.parametrize("name", LENSES)
@pytest.mark.parametrize("elevation", [0.0, math.pi / 2, -math.pi / 2])
def test_from_inside_a_ball_every_pixel_is_surface(name, elevation):
    fov = 2.0 if name == "pinhole" else 1.3 if name != "fisheye" else 4.4
    camera = orbit_camera(lens(96, 96, fov, EVERY[name]), 0.3, elevation, 0.7)
    seen = rasterize(placed(sphere(3)), camera)
    rays = pixel_rays(camera.intrinsics)
    real = np.isfinite(rays[..., 0])
    assert real.mean() > 0.9
    assert np.array_equal(seen.triangle >= 0, real)
    points = camera.center + (rays * depth_of(seen)[..., None])[real] @ camera.R
    radius = np.linalg.norm(points, axis=-1)
    assert radius.max() <= 1 + 1e-6
    assert radius.min() > 0.98


def test_ground_reaches_the_horizon_across_the_camera_plane():
    geometry = placed(cube(0.5), ground=True)
    height = 1.5
    camera = orbit_camera(lens(640, 480, 1.0), target=(0, 0, height - 0.5), distance=3.0)
    seen = rasterize(geometry, camera)
    ground = geometry.triangle_object[seen.triangle] == 0
    rows = np.arange(480) + 0.5 - 240
    below = seen.triangle[:, 5] >= 0
    assert np.array_equal(below, rows > 0)
    expected = height * camera.intrinsics.fy / rows[below]
    np.testing.assert_allclose(depth_of(seen)[below, 5], expected, rtol=1e-6)
    assert ground[below, 5].all()


def test_nothing_is_too_near():
    """A triangle a nanometre in front of the camera fills the picture; one behind does not."""
    tiny = mesh_of(np.array([[-4, 1, -4], [4, 1, -4], [0, 1, 6]]) * 1e-9, [[0, 1, 2]])
    at_origin = Camera(lens(32, 32, 1.0), orbit_camera(lens()).R, np.zeros(3))
    seen = rasterize(placed(tiny), at_origin)
    assert (seen.triangle == 0).all()
    np.testing.assert_allclose(depth_of(seen), 1e-9, rtol=1e-6)
    behind = placed(tiny, moves=[np.diag([1.0, -1, 1, 1]) @ np.diag([-1.0, 1, 1, 1])])
    assert (rasterize(behind, at_origin).triangle == -1).all()


@pytest.mark.parametrize("name", EVERY)
def test_first_of_equal_surfaces_wins(name):
    quad = mesh_of([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], [[0, 1, 2], [0, 2, 3]])
    geometry = placed(quad, quad, quad)
    seen = rasterize(geometry, orbit_camera(lens(distortion=EVERY[name]), distance=2.0))
    assert set(np.unique(seen.triangle)) <= {-1, 0, 1}


@pytest.mark.parametrize("name", LENSES)
@EXACT
@given(seed=st.integers(0, 10**6))
def test_watertight(name, seed):
    """From inside a closed crumpled mesh, however triangulated, no ray escapes."""
    rng = np.random.default_rng(seed)
    ball = sphere(int(rng.integers(1, 6)))
    scale = 1 + 0.3 * rng.random((len(ball.vertices), 1))
    squash = 10 ** rng.uniform(-3, 0, 3)
    move = np.eye(4)
    move[:3, 3] = rng.normal(size=3) * 10 ** rng.uniform(-2, 4)
    closed = mesh_of(ball.vertices * scale * squash, ball.triangles)
    fov = 1.5 if name != "fisheye" else 5.0
    intrinsics = lens(96, 64, fov, EVERY[name])
    camera = orbit_camera(intrinsics, *rng.uniform(-3, 3, 2), 0.2 * squash.min(), move[:3, 3], rng.uniform(-3, 3))
    real = np.isfinite(pixel_rays(intrinsics)[..., 0])
    assert np.array_equal(rasterize(placed(closed, moves=[move]), camera).triangle >= 0, real)


def test_watertight_on_pixel_centres():
    """Edges and corners that run exactly through pixel centres, in a fan and in a grid, lose none."""
    n = 17
    x, z = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    vertices = np.stack([x.ravel() - 8.0, np.full(n * n, 32.0), z.ravel() - 8.0], axis=1)
    cell = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    triangles = np.concatenate([[[c, c + n, c + n + 1], [c, c + n + 1, c + 1]] for c in cell])
    geometry = placed(mesh_of(vertices, triangles))
    for step in (1, 2, 4):  # pixels a grid cell: every centre on the grid, every other one, ...
        focal = 32.0 * step
        intrinsics = lens(16 * step, 16 * step, fx=focal, fy=focal, cx=8 * step + 0.5, cy=8 * step - 0.5)
        camera = Camera(intrinsics, orbit_camera(lens()).R, np.zeros(3))
        seen = rasterize(geometry, camera)
        assert (seen.triangle >= 0).all()
        np.testing.assert_allclose(depth_of(seen), 32.0, rtol=1e-7)
        alone = silhouette(geometry, camera, 1, (-4, -4, 16 * step + 4, 16 * step + 4))
        assert alone.sum() == (16 * step + 1) ** 2  # one more: the far border's centres lie on the grid's own border


@pytest.mark.parametrize("width, height", [(16, 16), pytest.param(4096, 4096, marks=pytest.mark.slow)])
def test_image_sizes(width, height):
    geometry = placed(sphere(3), ground=True)
    seen = rasterize(geometry, orbit_camera(lens(width, height, 0.8), elevation=math.pi / 2))
    assert seen.triangle.shape == (height, width)
    assert (seen.triangle >= 0).all()
    ball = geometry.triangle_object[seen.triangle] == 1
    x, y, _ = np.moveaxis(pixel_rays(lens(width, height, 0.8)), -1, 0)
    assert np.mean(ball != (np.hypot(x, y) < math.tan(math.asin(1 / 5)))) < 0.01


def test_subdivision_samples_the_quarters_of_pixels():
    geometry = placed(random_soup(np.random.default_rng(1), 300), ground=True)
    half = lens(40, 30, 1.0)
    full = lens(80, 60, 1.0)
    a = rasterize(geometry, orbit_camera(half, 0.2, 0.3, 4), subdivision=2)
    b = rasterize(geometry, orbit_camera(full, 0.2, 0.3, 4))
    assert np.mean(a.triangle != b.triangle) < 1e-3
    odd = rasterize(geometry, orbit_camera(half, 0.2, 0.3, 4), subdivision=3)
    assert np.array_equal(odd.triangle[1::3, 1::3], rasterize(geometry, orbit_camera(half, 0.2, 0.3, 4)).triangle)


@pytest.mark.parametrize("name", EVERY)
def test_silhouette_agrees_with_the_picture_and_goes_beyond_it(name):
    ball = sphere(3)
    move = np.eye(4)
    move[:3, 3] = 0.6, 0.2, 0.5
    geometry = placed(ball, cube(0.4), moves=[np.eye(4), move], ground=True)
    camera = orbit_camera(lens(80, 60, 0.5, EVERY[name]), 0.3, 0.2, 4.0)
    seen = rasterize(geometry, camera)
    objects = np.where(seen.triangle >= 0, geometry.triangle_object[seen.triangle], 0)
    wide = (-80, -60, 160, 120)
    for object_id in (1, 2):
        inside = silhouette(geometry, camera, object_id, (0, 0, 80, 60))
        assert (inside >= (objects == object_id)).all()
        beyond = silhouette(geometry, camera, object_id, wide)
        assert np.array_equal(beyond[60:120, 80:160], inside)
        assert inside.sum() <= beyond.sum()
        alone = rasterize(geometry, camera, object_id=object_id)
        assert np.array_equal(alone.triangle >= 0, inside)
    assert silhouette(geometry, camera, 1, wide).sum() > silhouette(geometry, camera, 1, (0, 0, 80, 60)).sum()
    with pytest.raises(ValueError, match=r"object_id: expected 1\.\.2, got 3"):
        silhouette(geometry, camera, 3, wide)


@pytest.mark.parametrize("elevation", [0.3, 1.2])
def test_instances_are_the_objects_seen_counted_once(elevation):
    geometry = placed(random_soup(np.random.default_rng(3), 60), cube(), ground=True)
    seen = rasterize(geometry, orbit_camera(lens(301, 200, 1.2), 0.3, elevation, 4.0))
    ids = np.where(seen.triangle >= 0, geometry.triangle_object[seen.triangle], 0)
    found = seen.instances(geometry)
    assert seen.instances(geometry) is found
    assert np.array_equal(found.ids, ids)
    assert set(np.unique(ids)) == {0, 1, 2}
    for i in (1, 2):
        rows, columns = np.nonzero(ids == i)
        assert found.area[i] == len(rows)
        assert found.box[i].tolist() == [columns.min(), rows.min(), columns.max() + 1, rows.max() + 1]
