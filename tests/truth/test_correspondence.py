"""Where the points of one picture are in another: against closed forms, and against brute force for any lens and motion."""

import gc
import math
import weakref

import numpy as np
import pytest
from two_views import brute_points, brute_xy, centers, matched, pose, view

from truth_scenes import EVERY, LENSES, cube, lens, mesh_of, orbit_camera, random_soup, sphere
from viewsphere.geometry.camera import pixel_rays, project
from viewsphere.geometry.rotation import matrix_from_quaternion
from viewsphere.model.sensors.camera import Camera
from viewsphere.truth.surface_points.draws import points_on

AHEAD = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # looks along +Y, Z up
STILL = pose(0, 0, 0)
ROUNDED = 2.0**-24  # of a float32 that is the nearest one


def wall(distance=4.0, size=64.0):
    corners = [[-size, distance, -size], [size, distance, -size], [size, distance, size], [-size, distance, size]]
    return mesh_of(corners, [[0, 1, 2], [0, 2, 3]])


def at(intrinsics, center=(0.0, 0.0, 0.0), rotation=AHEAD):
    return Camera(intrinsics, rotation, -rotation @ np.asarray(center))


def turned(rng, angle=None):
    q = rng.normal(size=4)
    q /= np.linalg.norm(q)
    return matrix_from_quaternion(q if angle is None else [1, *(angle * q[:3])])


@pytest.mark.parametrize("far", [0.0, 1e4])
@pytest.mark.parametrize("step", [(0.3, 0.0, 0.1), (0.0, -0.7, 0.0), (0.2, -0.5, -0.1)])
def test_a_plane_that_moves_and_comes_near(step, far):
    origin = np.array([far, -far, 0.0])
    camera = at(lens(160, 120, 1.0), origin)
    match = matched(view([wall()], [pose(*origin)], camera), view([wall()], [pose(*(origin + step))], camera))
    f, half = camera.intrinsics.fx, np.array([80.0, 60.0])
    z = 4.0 + step[1]
    there = ((centers(camera) - half) * 4.0 / f + (step[0], -step[2])) * f / z + half
    np.testing.assert_allclose(match.xy, there, atol=1e-10 if not far else 1e-8)
    np.testing.assert_allclose(match.inverse_depth, 1 / z, rtol=1e-9)
    moved = np.broadcast_to((step[0], -step[2], step[1]), (120, 160, 3))
    np.testing.assert_allclose(match.scene_flow, moved, rtol=ROUNDED, atol=1e-8)
    np.testing.assert_allclose(match.xyz[..., :2], (there - half) / f * z, atol=1e-8)


@pytest.mark.slow
def test_a_ball_that_turns_moves_with_its_facets():
    rng = np.random.default_rng(1)
    camera = orbit_camera(lens(120, 90, 0.8), 0.3, 0.4, 3.0)
    ball = sphere(3, 1.0)
    here, there = (view([ball], [pose(0, 0, 0, turn=t)], camera) for t in (np.eye(3), turned(rng, 0.15)))
    match = matched(here, there)
    triangle, world, sure = brute_points(here, there)
    on = (triangle >= 0) & sure
    assert on.sum() > 2000
    np.testing.assert_allclose(match.xy[on], brute_xy(there, world)[on], atol=1e-9)


def test_a_camera_that_orbits_and_zooms():
    first, second = lens(160, 120, 0.9), lens(160, 120, 0.6)
    cameras = [orbit_camera(first, 0.2, 0.3, 6.0, tilt=0.1), orbit_camera(second, 0.5, 0.2, 5.0, tilt=-0.1)]
    here, there = (view([wall(2.0), cube(1.0)], [STILL, STILL], camera) for camera in cameras)
    triangle, world, sure = brute_points(here, there)
    on = (triangle >= 0) & sure
    xy = brute_xy(there, world)
    np.testing.assert_allclose(matched(here, there).xy[on], xy[on], atol=1e-9)
    assert np.abs(xy - centers(cameras[0]))[on].max() > 20


@pytest.mark.parametrize("name", LENSES)
def test_the_sky_turns_and_does_not_move(name):
    fov = 3.0 if name == "fisheye" else 1.2
    first, second = lens(96, 72, fov, EVERY[name]), lens(96, 72, 0.9 * fov, EVERY[name])
    turn = turned(np.random.default_rng(3), 0.1)
    here = view([], [], at(first))
    there = view([], [], at(second, (100.0, -30.0, 2.0), turn @ AHEAD))
    match = matched(here, there)
    directions = pixel_rays(first) @ turn.T
    expected, _ = project(second, directions)
    seen = ~np.isnan(expected[..., 0])
    assert np.array_equal(~np.isnan(match.xy[..., 0]), seen)
    np.testing.assert_allclose(match.xy[seen], expected[seen], atol=1e-9)
    assert np.isnan(match.scene_flow).all() and np.isinf(match.xyz[seen][:, 2]).all()
    assert (match.inverse_depth[seen] == 0).all()
    assert (match.state[seen] != 4).all() and (match.state[~np.isnan(pixel_rays(first)[..., 0]) & ~seen] == 3).all()


def bar(bend):
    """A bar along x of 24 rings, skinned to two bones: the second is turned at the bar's middle."""
    x = np.linspace(-1, 1, 24)
    ring = np.array([[0, -0.2, -0.2], [0, 0.2, -0.2], [0, 0.2, 0.2], [0, -0.2, 0.2]])
    rest = (ring[None] + x[:, None, None] * [1, 0, 0]).reshape(-1, 3)
    share = np.clip(rest[:, :1] / 0.6 + 0.5, 0, 1)
    c, s = math.cos(bend), math.sin(bend)
    posed = (1 - share) * rest + share * (rest @ np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]).T)
    i = np.arange(23)[:, None] * 4 + np.arange(4)
    j = np.arange(23)[:, None] * 4 + (np.arange(4) + 1) % 4
    quads = np.stack([i, j, j + 4, i + 4], axis=-1).reshape(-1, 4)
    return mesh_of(posed, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]))


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize("moves", [False, True])
@pytest.mark.slow
def test_a_skinned_bar_moves_with_its_triangles(name, moves):
    rng = np.random.default_rng(5)
    camera = orbit_camera(lens(96, 72, 2.0 if name == "fisheye" else 0.8, EVERY[name]), 0.2, 0.3, 3.0)
    after = pose(0.1, -0.2, 0.3, turn=turned(rng, 0.1)) if moves else STILL
    here = view([bar(0.0)], [STILL], camera, steps=[1])
    there = view([bar(0.5)], [after], camera, steps=[2])
    match = matched(here, there)
    triangle, world, sure = brute_points(here, there)
    on = (triangle >= 0) & sure
    assert on.sum() > 200
    np.testing.assert_allclose(match.xy[on], brute_xy(there, world)[on], atol=1e-9)
    np.testing.assert_allclose(match.xyz[on], (world @ camera.R.T + camera.t)[on], atol=1e-11)
    still = on & (here.geometry.vertices[here.geometry.triangles[triangle]] == there.geometry.vertices[
        there.geometry.triangles[triangle]]).all(axis=(-1, -2))  # fmt: skip
    assert still.any() != moves
    assert (match.xy == centers(camera))[still].all()


def divided(mesh):
    """The same triangles, none of which share a vertex."""
    return mesh_of(mesh.vertices[mesh.triangles].reshape(-1, 3), np.arange(3 * len(mesh.triangles)))


def test_vertices_may_be_divided_where_triangles_fold():
    """Files of faceted models have one vertex where two triangles are level, and two where they fold."""
    camera = orbit_camera(lens(96, 72, 0.8), 0.2, 0.3, 3.0)
    straight, bent = bar(0.0), bar(0.5)
    here, there = (view([mesh], [STILL], camera, steps=[k]) for k, mesh in ((1, straight), (2, bent)))
    expected = matched(here, there)
    points = points_on(here, 200, np.random.default_rng(0))
    for first, second in ((straight, divided(bent)), (divided(straight), bent), (divided(straight), divided(bent))):
        one, other = (view([mesh], [STILL], camera, steps=[k]) for k, mesh in ((1, first), (2, second)))
        np.testing.assert_array_equal(matched(one, other).xy, expected.xy)
        np.testing.assert_array_equal(matched(one, other).state, expected.state)
        np.testing.assert_array_equal(points.in_view(other).xy, points.in_view(there).xy)


def test_as_many_other_triangles_are_others():
    """The quads of a bar cut along their other diagonals, and a bar in another order, whether vertices are shared or not."""
    camera = orbit_camera(lens(96, 72, 0.8), 0.2, 0.3, 3.0)
    straight, bent = bar(0.0), bar(0.5)
    quads = len(bent.triangles) // 2
    a, b, c, d = *bent.triangles[:quads].T, bent.triangles[quads:, 2]
    others = mesh_of(bent.vertices, np.concatenate([np.stack([a, b, d], 1), np.stack([b, c, d], 1)]))
    backwards = mesh_of(bent.vertices, bent.triangles[::-1])
    here = view([straight], [STILL], camera, steps=[1])
    seen = matched(here, here).visibility.triangle >= 0
    for mesh in (others, backwards, divided(others)):
        match = matched(here, view([mesh], [STILL], camera, steps=[2]))
        assert (match.state[seen] == 4).all() and np.isnan(match.xy[seen]).all()


def test_what_does_not_move_has_no_flow_at_all():
    """Zeros, not roundings: of things, ground and sky before a camera at rest, of whatever stands still while others move."""
    for name, distortion in LENSES.items():
        camera = orbit_camera(lens(64, 48, 2.6 if name == "fisheye" else 1.1, distortion), 1.0, 0.1, 4.0, tilt=0.2)
        meshes, rng = [cube(0.6), sphere(2, 0.5)], np.random.default_rng(0)
        where = pose(1.3, 0.4, 0.1, turn=turned(rng))
        here = view(meshes, [where, STILL], camera, ground=True)
        there = view(meshes, [where, pose(0, 0, 2)], camera, ground=True, floor=here.geometry.ground_z)
        match = matched(here, there)
        owners = np.append(here.owners, 9)[match.visibility.triangle]
        assert {0, 1, 2, 9} <= set(np.unique(owners))
        assert (match.xy == centers(camera))[owners != 1].all() and (match.xy != centers(camera))[owners == 1].any()
        assert (match.scene_flow[(owners == 0) | (owners == 2)] == 0).all()


def test_nothing_moves_before_parallel_rays_at_rest_and_their_sky_has_no_place():
    """All pixels show one direction of the sky, so none of them is its place in the other picture."""
    camera = orbit_camera(lens(64, 48, 1.1, EVERY["orthographic"]), 1.0, -0.1, 4.0, tilt=0.2)
    where = pose(1.3, 0.4, 0.1, turn=turned(np.random.default_rng(0)))
    here, there = (view([cube(0.6), sphere(2, 0.5)], [where, at], camera) for at in (STILL, pose(0, 0, 2)))
    match = matched(here, there)
    owners = np.append(here.owners, 9)[match.visibility.triangle]
    assert set(np.unique(owners)) == {0, 1, 9}
    assert (match.flow[owners == 0] == 0).all() and (match.scene_flow[owners == 0] == 0).all()
    assert np.isnan(match.flow[owners == 9]).all() and (match.state[owners == 9] == 4).all()
    assert (match.flow[owners == 1] != 0).any()


def test_only_what_moves_differs_where_the_camera_only_moves():
    """Disparity's picture rows are exactly one's own."""
    first = at(lens(64, 48, 1.0))
    second = at(first.intrinsics, (0.1, 0, 0))
    here, there = (view([wall(), cube(0.5)], [STILL, pose(0, 2, 0)], camera) for camera in (first, second))
    assert (matched(here, there).xy[..., 1] == centers(first)[..., 1]).all()


def random_scene(rng, count=3):
    meshes = [random_soup(rng, 12, 0.6, 0.4), cube(0.5), sphere(1, 0.4)][:count]
    first = [pose(*rng.normal(size=3), turn=turned(rng)) for _ in meshes]
    second = [pose(*(np.array(p)[:3, 3] + rng.normal(size=3) * 0.1), turn=turned(rng)) for p in first]
    return meshes, first, second


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize("other", EVERY)
def test_any_motion_between_any_lenses_is_that_of_brute_force(name, other):
    """Things and cameras move at random; the ground stays, and meets nobody's triangles."""
    rng = np.random.default_rng(sum(map(ord, name + other)))
    for _ in range(3):
        meshes, first, second = random_scene(rng)
        cameras = [
            orbit_camera(
                lens(56, 42, rng.uniform(1.5, 3.2) if which == "fisheye" else rng.uniform(0.5, 1.2), EVERY[which]),
                rng.uniform(0, 6), rng.uniform(-0.3, 1), rng.uniform(2, 6), rng.normal(size=3) * 0.3, rng.uniform(-1, 1),
            )
            for which in (name, other)
        ]  # fmt: skip
        here = view(meshes, first, cameras[0], ground=True, floor=-9.0)
        there = view(meshes, second, cameras[1], ground=True, floor=-9.0)
        match = matched(here, there)
        triangle, world, sure = brute_points(here, there)
        on = (triangle >= 0) & sure
        far = np.linalg.norm(world - cameras[1].center, axis=-1) > 1e3
        expected = brute_xy(there, world)
        same = np.isnan(match.xy[..., 0]) == np.isnan(expected[..., 0])
        assert same[on].all()
        with_pixel = on & ~np.isnan(expected[..., 0]) & ~far
        near_picture = with_pixel & (np.abs(expected) < 1e4).all(axis=-1)
        np.testing.assert_allclose(match.xy[near_picture], expected[near_picture], atol=1e-6)
        close = on & ~far
        axes = world @ cameras[1].R.T + cameras[1].t
        np.testing.assert_allclose(match.xyz[close], axes[close], rtol=1e-9, atol=1e-7)
        _, place, _ = brute_points(here, here)
        flow = axes - (place @ cameras[0].R.T + cameras[0].t)
        np.testing.assert_allclose(match.scene_flow[close], flow[close], rtol=ROUNDED, atol=1e-7)


def test_there_is_no_match_of_what_is_gone_or_other():
    camera = orbit_camera(lens(64, 48, 1.0), 0.0, 0.3, 5.0)
    meshes = [cube(0.5), cube(0.5), sphere(1, 0.5)]
    places = [pose(-1.5, 0, 0), STILL, pose(1.5, 0, 0)]
    here = view(meshes, places, camera, steps=[None, None, 3])
    owners = np.append(here.owners, 9)[matched(here, here).visibility.triangle]
    gone = matched(here, view(meshes, [None, *places[1:]], camera, steps=[None, None, 3]))
    other = matched(here, view([*meshes[:2], sphere(2, 0.5)], places, camera, steps=[None, None, 4]))
    for match, which in ((gone, 0), (other, 2)):
        assert (np.isnan(match.xy).all(axis=-1) == (owners == which)).all()
        assert (np.isnan(match.xyz[..., 0]) == ((owners == which) | (owners == 9))).all()
        assert ((match.state == 4) == (owners == which)).all()
        assert (match.state == 0)[owners != which].mean() > 0.98  # the other ball hides a little more of the sky
        assert np.isnan(match.scene_flow[owners == which]).all() and np.isnan(match.inverse_depth[owners == which]).all()


def test_a_flat_picture_is_nowhere_and_a_ground_of_another_height_is_another():
    camera = orbit_camera(lens(64, 48, 1.0), 0.0, 0.2, 5.0)
    here = view([cube(0.5)], [STILL], camera, ground=True, sky=False)
    seen = matched(here, here).visibility.triangle
    there = view([cube(0.5)], [STILL], camera, ground=True, sky=False, floor=-3.0)
    match = matched(here, there)
    ground = seen >= here.geometry.triangle_start[-1]
    assert ground.any() and (seen < 0).any()
    assert ((match.state == 4) == (ground | (seen < 0))).all()
    assert (np.isnan(match.xy[..., 0]) == (match.state == 4)).all()


@pytest.mark.parametrize("name", EVERY)
def test_forward_and_backward_agree(name):
    """|f(p) + b(p + f(p))| where the point is seen in both pictures; b is evaluated from geometry, at any position."""
    from viewsphere.truth.surface_points.points import points_seen

    rng = np.random.default_rng(8)
    meshes, first, second = random_scene(rng)
    intrinsics = lens(80, 60, 2.8 if name == "fisheye" else 0.9, EVERY[name])
    cameras = orbit_camera(intrinsics, 0.3, 0.4, 4.0), orbit_camera(intrinsics, 0.4, 0.35, 4.1)
    here, there = (view(meshes, poses, c, ground=True, floor=-3.0) for poses, c in zip((first, second), cameras, strict=True))
    match = matched(here, there)
    visible = match.state == 0
    back = points_seen(there, match.xy[visible]).in_view(here)
    off = np.abs(back.xy - centers(cameras[0])[visible]).max(axis=1)
    assert visible.sum() > 800
    assert (off <= 0.01).mean() > 0.9995  # on an edge a ray may meet the neighbour, which lies elsewhere
    assert np.median(off) < 1e-9


@pytest.mark.parametrize("name", EVERY)
def test_flow_is_the_way_from_the_pixels_centers(name):
    rng = np.random.default_rng(5)
    here, there = (
        view(
            [cube(0.4), sphere(2, 0.5)],
            [pose(-0.6, 4, 0, turn=turned(rng)), pose(0.5, 3, 0.1)],
            at(lens(96, 72, 1.0, EVERY[name]), (x, 0, 0)),
        )
        for x in (0.0, 0.2)
    )
    match = matched(here, there)
    way = (match.xy - centers(here.camera)).astype(np.float32)
    assert np.nanmax(np.abs(way)) > 1
    assert match.flow.tobytes() == way.tobytes()


def test_a_match_is_gone_with_its_last_user():
    """Its arrays are as large as several pictures: they are not to wait for a collection of garbage."""
    here, there = (view([cube(0.5)], [STILL], orbit_camera(lens(64, 48, 1.0), a, 0.2, 5.0), ground=True) for a in (0.0, 0.1))
    gc.disable()
    try:
        match = matched(here, there)
        assert match.state.shape == match.flow.shape[:2] == match.scene_flow.shape[:2]
        known = weakref.ref(match)
        del match
        assert known() is None
    finally:
        gc.enable()
