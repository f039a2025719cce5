"""Which points are hidden: against brute force in float64, and against Embree."""

import dataclasses
import math

import numpy as np
import pytest
from two_views import brute_hidden, brute_points, centers, expected_states, matched, pose, thing, view

from truth_scenes import EVERY, LENSES, cube, lens, mesh_of, orbit_camera, random_soup, sphere
from viewsphere.assets.mesh import Material
from viewsphere.geometry.rotation import matrix_from_quaternion
from viewsphere.model.sensors.camera import Camera
from viewsphere.truth.raster.geometry import build_geometry
from viewsphere.truth.raster.visibility import rasterize
from viewsphere.truth.surface_points.draws import points_on
from viewsphere.truth.surface_points.points import points_in_world, points_seen
from viewsphere.truth.surface_points.raster import INVALID, OCCLUDED, VISIBLE, states
from viewsphere.truth.view import View


def turned(rng):
    q = rng.normal(size=4)
    return matrix_from_quaternion(q / np.linalg.norm(q))


def random_camera(rng, name, width=64, height=48):
    fov = rng.uniform(1.5, 3.4) if name == "fisheye" else rng.uniform(0.5, 1.3)
    tilt = rng.uniform(-1, 1)
    return orbit_camera(
        lens(width, height, fov, EVERY[name]), rng.uniform(0, 6), rng.uniform(-0.3, 1.2), rng.uniform(0.5, 6),
        rng.normal(size=3) * 0.3, tilt,
    )  # fmt: skip


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.slow
def test_states_of_random_points_are_those_of_brute_force(name):
    """Points on things of all sizes, some around the camera; in front, behind, beside, below the ground's horizon."""
    rng = np.random.default_rng(sum(map(ord, name)))
    found = np.zeros(5, int)
    for _ in range(12):
        meshes = [random_soup(rng, 40, 1.5, 0.5), cube(0.5), sphere(1, 0.4), random_soup(rng, 10, 0.5, 2.0)]
        there = view(
            meshes, [pose(*rng.normal(size=3), turn=turned(rng)) for _ in meshes], random_camera(rng, name),
            ground=bool(rng.uniform() < 0.7),
        )  # fmt: skip
        points = points_on(there, 600, rng)
        seen = points.in_view(there)
        own = np.array(there.geometry.triangle_start)[points.thing] + points.triangle
        state, sure = expected_states(there, seen.world, own)
        assert sure.mean() > 0.97
        assert np.array_equal(seen.state[sure], state[sure])
        found += np.bincount(seen.state, minlength=5)
    assert (found[:4] > 50).all() and found[INVALID] == 0


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.slow
def test_states_of_pixels_are_those_of_brute_force(name):
    rng = np.random.default_rng(sum(map(ord, name)) + 1)
    for _ in range(4):
        meshes = [random_soup(rng, 25, 1.0, 0.5), cube(0.5), sphere(1, 0.4)]
        first = [pose(*rng.normal(size=3), turn=turned(rng)) for _ in meshes]
        second = [pose(*(np.array(p)[:3, 3] + rng.normal(size=3) * 0.2), turn=np.array(p)[:3, :3]) for p in first]
        cameras = random_camera(rng, name, 48, 36), random_camera(rng, name, 48, 36)
        here, there = (
            view(meshes, where, camera, ground=True, floor=-50.0)
            for where, camera in zip((first, second), cameras, strict=True)
        )
        match = matched(here, there)
        triangle, world, known = brute_points(here, there)
        on = (triangle >= 0) & known
        own = np.minimum(triangle, there.geometry.triangle_start[-1])[on]
        state, sure = expected_states(there, world[on], own)
        assert sure.mean() > 0.9
        assert np.array_equal(match.state[on][sure], state[sure])


@pytest.mark.parametrize("name", LENSES)
def test_the_sky_is_hidden_by_whatever_is_in_front(name):
    """A sky's point is seen exactly where the other picture shows the sky: at pixel centres that is what it shows."""
    camera = orbit_camera(lens(64, 48, 2.6 if name == "fisheye" else 1.1, EVERY[name]), 0.3, 0.15, 4.0)
    empty, full = (
        view([], [], camera),
        view([cube(0.7), sphere(2, 0.6)], [pose(1, 0, 0), pose(-1, 0.5, 0)], camera, ground=True),
    )
    match = matched(empty, full)
    shown = rasterize(full.geometry, camera).triangle
    has_ray = ~np.isnan(match.xy[..., 0])
    assert np.array_equal((match.state == OCCLUDED)[has_ray], (shown >= 0)[has_ray])
    assert (match.state[~has_ray] == INVALID).all()
    assert {VISIBLE, OCCLUDED} <= set(match.state[has_ray].tolist())


@pytest.mark.parametrize("name", LENSES)
def test_points_seen_at_pixel_centers_are_the_visibility_buffers(name):
    rng = np.random.default_rng(4)
    meshes = [random_soup(rng, 60, 1.0, 0.6), sphere(2, 0.7)]
    there = view(meshes, [pose(0, 0, 0), pose(1, 0, 0)], random_camera(rng, name), ground=True)
    shown = rasterize(there.geometry, there.camera).triangle
    points = points_seen(there, centers(there.camera).reshape(-1, 2))
    start = np.array(there.geometry.triangle_start)
    triangle = np.where(points.thing >= 0, start[np.maximum(points.thing, 0)] + points.triangle, points.thing)
    expected = np.where(shown >= start[-1], -1, np.where(shown >= 0, shown, -2)).reshape(-1)
    has_ray = points.thing != -4
    assert np.array_equal(triangle[has_ray], expected[has_ray]) and has_ray.mean() > 0.7
    seen = points.in_view(there)
    assert (seen.state[has_ray] == VISIBLE).all() and (seen.state[~has_ray] == INVALID).all()
    np.testing.assert_allclose(seen.xy[has_ray], centers(there.camera).reshape(-1, 2)[has_ray], atol=1e-6)


def holed():
    """A card of two triangles whose left half is clear."""
    material = Material("net", (1.0, 1.0, 1.0, 1.0), alpha_mode="MASK", alpha_cutoff=0.5)
    corners = [[-1, 0, -1], [0, 0, -1], [1, 0, -1], [-1, 0, 1], [0, 0, 1], [1, 0, 1]]
    triangles = [[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]]
    colors = np.ones((6, 4), np.float32)
    colors[[0, 3], 3] = 0.0
    return mesh_of(corners, triangles, materials=(material,), colors=colors)


@pytest.mark.parametrize("name", LENSES)
def test_cut_outs_hide_where_they_are_surface(name):
    """Alpha rises from 0 at the left to 1 in the middle, so surface begins at x = -0.5."""
    camera = orbit_camera(lens(64, 48, 2.0 if name == "fisheye" else 0.9, EVERY[name]), 0.0, 0.0, 4.0)
    there = view([holed()], [pose(0, 0, 0)], camera)
    assert (there.geometry.triangle_cutout >= 0).any()
    rng = np.random.default_rng(0)
    points = rng.uniform((-0.9, 1, -0.9), (0.9, 3, 0.9), (4000, 3))
    state = points_in_world(points).in_view(there).state
    at_card = points[:, 0] * 4 / (4 + points[:, 1])
    sure = np.abs(at_card + 0.5) > 1e-6
    assert np.array_equal((state == OCCLUDED)[sure], (at_card > -0.5)[sure])
    on = points_on(there, 2000, rng)
    assert (on.in_view(there).world[:, 0] >= -0.5 - 1e-9).all()


def test_slivers_hide_as_they_are_drawn():
    """Triangles so thin that the sign of their area is rounding: what a pixel shows is what its sky's point meets."""
    rng = np.random.default_rng(7)
    for _ in range(20):
        a = rng.normal(size=(30, 1, 3))
        along = rng.normal(size=(30, 1, 3))
        thin = a + along * rng.uniform(0, 1, (30, 3, 1)) + rng.normal(size=(30, 3, 3)) * 10 ** rng.uniform(-9, -3, (30, 1, 1))
        camera = random_camera(rng, "pinhole")
        there = view([mesh_of(thin.reshape(-1, 3), np.arange(90))], [pose(0, 0, 0)], camera)
        match = matched(view([], [], camera), there)
        assert np.array_equal(match.state == OCCLUDED, rasterize(there.geometry, camera).triangle >= 0)


def test_a_triangle_through_the_cameras_plane_hides():
    """A long triangle from behind the camera to far ahead, beside its axis."""
    strip = mesh_of([[0.3, -9, -1], [0.3, 50, -1], [0.3, 50, 3]], [[0, 1, 2]])
    camera = Camera(lens(64, 48, 1.2), np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]), np.zeros(3))
    there = view([strip], [pose(0, 0, 0)], camera)
    rng = np.random.default_rng(0)
    points = points_in_world(rng.uniform((-3, 0.5, -2), (6, 40, 3), (5000, 3)))
    seen = points.in_view(there)
    state, sure = expected_states(there, seen.world, np.full(5000, -1))
    assert np.array_equal(seen.state[sure], state[sure]) and (state == OCCLUDED).sum() > 200


def test_a_point_just_behind_a_surface_is_hidden_from_a_millionth_on():
    camera = Camera(lens(64, 48, 1.2), np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]), np.zeros(3))
    there = view([mesh_of([[-9, 2, -9], [9, 2, -9], [0, 2, 9]], [[0, 1, 2]])], [pose(0, 0, 0)], camera)
    for gap, state in ((0.9e-6, VISIBLE), (1.1e-6, OCCLUDED), (-1e-3, VISIBLE)):
        assert points_in_world([[0.1, 2 * (1 + gap), 0.2]]).in_view(there).state == [state]


@pytest.mark.parametrize("name", LENSES)
def test_where_no_mesh_is_the_ground_hides_what_is_below_and_nothing_what_is_not(name):
    """A small cube far from all points, which are above the ground and below it, ahead and in the sky."""
    camera = orbit_camera(lens(64, 48, 2.0 if name == "fisheye" else 1.0, EVERY[name]), 0.0, 0.3, 6.0)
    rng = np.random.default_rng(5)
    aside = pose(0, 40, 0)
    with_ground, without = (view([cube(0.1)], [aside], camera, ground=ground, floor=-1.0) for ground in (True, False))
    places = rng.uniform((-2, -2, -2.5), (2, 3, 0.5), (3000, 3))
    low = points_in_world(places)
    seen = low.in_view(with_ground).state
    inside = seen <= OCCLUDED
    assert inside.sum() > 1500
    assert np.array_equal(seen[inside] == OCCLUDED, places[inside, 2] < -1.0)
    assert (low.in_view(without).state[inside] == VISIBLE).all()
    match = matched(without, with_ground)  # the sky of a world without a ground, and the cube
    on_cube = without.visibility.triangle >= 0
    shown = with_ground.visibility.triangle >= 0
    assert np.array_equal((match.state == OCCLUDED)[~on_cube], shown[~on_cube]) and 0 < shown.mean() < 1


@pytest.mark.parametrize("name", LENSES)
def test_states_of_several_at_once_are_those_of_each(name):
    rng = np.random.default_rng(2)
    there = view([sphere(2, 0.6), cube(0.5)], [pose(0, 0, 0), pose(1, 0, 0)], random_camera(rng, name), ground=True)
    match = matched(there, there)
    tracked = points_on(there, 500, rng).in_view(there)
    free = points_in_world(rng.normal(size=(300, 3)) * 3).in_view(there)
    together = states([match.placed, tracked.placed, free.placed])
    for one, alone in zip(together, (match.state, tracked.state, free.state), strict=True):
        assert np.array_equal(one, alone)
    with pytest.raises(ValueError, match="one view"):
        states([match.placed, free.points.in_view(dataclasses.replace(there)).placed])


def embree_scene(geometry):
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    scene = EmbreeScene(robust=True)
    TriangleMesh(scene, geometry.vertices.astype(np.float32), geometry.triangles)
    return scene


def zoo_scene():
    from zoo_mesh import drawn

    meshes = [drawn("car", 1), sphere(4, 0.5), cube(0.4)]
    things = [thing(0, pose(0, 0, 0)), thing(1, pose(1.4, -0.6, 0.4)), thing(2, pose(-1.6, -1.0, 0.2))]
    return things, meshes


@pytest.mark.slow
def test_a_hundred_thousand_points_against_embree():
    """Embree's rays are float32: each difference is settled by float64 brute force, and none goes against us."""
    pytest.importorskip("embreex")
    things, meshes = zoo_scene()
    geometry = build_geometry(things, meshes, True, 0.01)
    scene, rng = embree_scene(geometry), np.random.default_rng(0)
    differences = 0
    for azimuth in (0.4, 3.0):
        camera = orbit_camera(lens(640, 480, math.radians(55)), azimuth, 0.3, 6.0)
        there = View(things, geometry, camera, True)
        points = points_on(there, 50_000, rng)
        seen = points.in_view(there)
        inside = seen.state <= OCCLUDED
        own = np.array(geometry.triangle_start)[points.thing] + points.triangle
        away = seen.world - camera.center
        origin = np.broadcast_to(camera.center.astype(np.float32), away.shape).copy()
        hit = scene.run(origin, away.astype(np.float32), output=True)
        theirs = (hit["tfar"] < 1 - 2e-5) & (hit["primID"] != own)
        differ = np.flatnonzero(inside & (theirs != (seen.state == OCCLUDED)))
        differences += len(differ)
        hidden, _ = brute_hidden(there, seen.world[differ], own[differ], chunk=16)
        assert np.array_equal(hidden, seen.state[differ] == OCCLUDED)
        assert 20_000 < (seen.state == OCCLUDED).sum() < 45_000
    assert differences < 500
