"""Points that stick to things, over instants at which these move, deform, go and come back."""

import dataclasses

import numpy as np
import pytest
from two_views import centers, matched, pose, view

from proven import close
from truth_scenes import LENSES, cube, lens, mesh_of, orbit_camera, sphere
from viewsphere.geometry.rotation import matrix_from_quaternion
from viewsphere.truth.surface_points.draws import points_on
from viewsphere.truth.surface_points.points import FREE, GROUND, NOWHERE, SKY, SurfacePoints, points_in_world, points_seen
from viewsphere.truth.surface_points.raster import BEHIND, INVALID, OUTSIDE, VISIBLE

STILL = pose(0, 0, 0)


def turned(rng):
    q = rng.normal(size=4)
    return matrix_from_quaternion(q / np.linalg.norm(q))


def camera(name="pinhole", azimuth=0.3, width=80):
    return orbit_camera(lens(width, 60, 2.6 if name == "fisheye" else 1.0, LENSES[name]), azimuth, 0.2, 4.0)


def test_points_move_rigidly_with_their_thing():
    rng = np.random.default_rng(0)
    first, second = pose(1, 2, 3, turn=turned(rng)), pose(-1, 0.5, 0, turn=turned(rng))
    here, there = (view([sphere(2, 0.7), cube(0.3)], [p, STILL], camera()) for p in (first, second))
    points = points_on(here, 500, rng, things=[0])
    assert (points.thing == 0).all()
    own = np.column_stack((points.in_view(here).world, np.ones(500))) @ np.linalg.inv(np.array(first)).T
    close("tracks", "closed form", points.in_view(there).world, (own @ np.array(second).T)[:, :3], "m", atol=1e-12)


@pytest.mark.parametrize("name", LENSES)
def test_points_at_pixels_go_where_the_pixels_go(name):
    """Tracks and flow are one function: things that turn, a bar that bends, the ground, the sky."""
    rng = np.random.default_rng(1)
    flat = mesh_of([[-1, 0, 0], [1, 0, 0], [1, 0, 1], [-1, 0, 1]], [[0, 1, 2], [0, 2, 3]])
    bent = dataclasses.replace(flat, vertices=flat.vertices + np.float32([[0, 0, 0], [0.2, 0, 0], [0, 0.4, 0], [0, 0, 0.1]]))
    places = [pose(-1, 0.5, 0, turn=turned(rng)), pose(1, 0, 0)], [pose(-0.9, 0.3, 0.1, turn=turned(rng)), pose(1, 0.1, 0)]
    here = view([cube(0.5), flat], places[0], camera(name), ground=True, steps=[None, 1], floor=-2.0)
    there = view([cube(0.5), bent], places[1], camera(name, 0.4), ground=True, steps=[None, 2], floor=-2.0)
    match = matched(here, there)
    points = points_seen(here, centers(here.camera).reshape(-1, 2))
    assert {0, 1, GROUND, SKY} <= set(points.thing.tolist())
    tracked = points.in_view(there)
    near = np.isfinite(tracked.xyz).all(axis=1) & (np.abs(tracked.xyz).max(axis=1) < 100)
    assert np.array_equal(np.isnan(tracked.xy), np.isnan(match.xy.reshape(-1, 2)))
    has_pixel = ~np.isnan(tracked.xy[:, 0]) & (near | (points.thing == SKY))
    np.testing.assert_allclose(tracked.xy[has_pixel], match.xy.reshape(-1, 2)[has_pixel], atol=1e-8)
    np.testing.assert_allclose(tracked.xyz[near], match.xyz.reshape(-1, 3)[near], atol=1e-8)
    assert (tracked.state == match.state.reshape(-1)).mean() > 0.999
    assert np.isinf(tracked.xyz[(points.thing == SKY) & ~np.isnan(tracked.xy[:, 0]), 2]).all()
    assert np.isnan(tracked.world[points.thing == SKY]).all()


def test_points_of_what_is_gone_are_nowhere_and_come_back():
    here = view([sphere(2, 0.7), cube(0.3)], [STILL, pose(2, 0, 0)], camera(), ground=True)
    away = view([sphere(2, 0.7), cube(0.3)], [None, pose(2, 0, 0)], camera(), ground=True)
    points = points_on(here, 300, np.random.default_rng(0))
    seen = points.in_view(away)
    assert ((seen.state == INVALID) == (points.thing == 0)).all() and {0, 1} == set(points.thing.tolist())
    assert (np.isnan(seen.world).all(axis=1) == (points.thing == 0)).all()
    assert np.isnan(seen.xyz[points.thing == 0]).all() and np.isnan(seen.xy[points.thing == 0]).all()
    np.testing.assert_array_equal(seen.world[points.thing == 1], points.in_view(here).world[points.thing == 1])
    back = view([sphere(2, 0.7), cube(0.3)], [STILL, pose(2, 0, 0)], camera(), ground=True)
    assert np.array_equal(points.in_view(back).state, points.in_view(here).state)


def test_points_of_other_triangles_are_nowhere():
    here = view([sphere(2, 0.7)], [STILL], camera(), steps=[1])
    there = view([sphere(3, 0.7)], [STILL], camera(), steps=[2])
    assert (points_on(here, 50, np.random.default_rng(0)).in_view(there).state == INVALID).all()


def test_the_ground_stays_where_it_is():
    """Its triangles move along with the objects; its points do not."""
    here = view([cube(0.3)], [STILL], camera(), ground=True, floor=-1.0)
    there = view([cube(0.3)], [pose(30, 0, 4)], camera(), ground=True, floor=-1.0)
    points = points_seen(here, [[5.5, 50.25], [70.125, 58.0]])
    assert points.thing.tolist() == [GROUND, GROUND]
    assert not np.array_equal(here.geometry.vertices[-4:], there.geometry.vertices[-4:])
    np.testing.assert_allclose(points.in_view(there).xy, [[5.5, 50.25], [70.125, 58.0]], atol=1e-10)
    assert (points.in_view(there).world[:, 2] == -1.0).all() and (points.in_view(there).state == VISIBLE).all()
    assert (points.in_view(view([cube(0.3)], [STILL], camera(), ground=True, floor=-2.0)).state == INVALID).all()
    assert (points.in_view(view([cube(0.3)], [STILL], camera())).state == INVALID).all()


def test_a_query_at_any_position_is_found_there_again():
    here = view([sphere(3, 0.7), cube(0.5)], [STILL, pose(1.2, 0, 0)], camera(), ground=True)
    xy = np.random.default_rng(0).uniform((0, 0), (80, 60), (3000, 2))
    points = points_seen(here, xy)
    found = points.in_view(here)
    np.testing.assert_allclose(found.xy, xy, atol=1e-9)
    assert (found.state == VISIBLE).all() and {0, 1, GROUND, SKY} == set(points.thing.tolist())
    np.testing.assert_allclose(points.weights[points.thing >= 0].sum(axis=1), 1, atol=1e-12)


def test_queries_outside_of_the_picture_and_on_a_flat_picture_are_nowhere():
    here = view([cube(0.3)], [STILL], camera(), sky=False)
    points = points_seen(here, [[-0.1, 30], [80.0, 30], [40, 60.0], [1, 1], [40, 30]])
    assert points.thing.tolist() == [NOWHERE] * 4 + [0]
    assert points.in_view(here).state.tolist() == [INVALID] * 4 + [VISIBLE]


def test_points_of_the_world_stay_and_have_every_state():
    here = view([cube(0.5)], [STILL], camera(azimuth=0.0))
    points = points_in_world([[0, -2.0, 0], [0, 3.0, -0.3], [90, 3.0, 0], [0, -50.0, 0]])
    assert (points.thing == FREE).all()
    seen = points.in_view(here)
    assert seen.state.tolist() == [VISIBLE, 1, OUTSIDE, BEHIND]
    assert np.array_equal(seen.world, points.place)
    assert np.isnan(seen.xy[3]).all() and seen.xyz[3, 2] < 0 and np.isfinite(seen.xy[:3]).all()


def test_joined_points_are_all_of_them_and_chosen_ones_are_some():
    rng = np.random.default_rng(0)
    here = view([sphere(2, 0.7), cube(0.3)], [STILL, pose(1.5, 0, 0)], camera(), ground=True)
    parts = [
        points_on(here, 40, rng),
        points_in_world(rng.normal(size=(10, 3))),
        points_seen(here, rng.uniform(0, 60, (30, 2))),
    ]
    joined = SurfacePoints.joined(parts)
    assert len(joined) == 80
    xy = np.concatenate([part.in_view(here).xy for part in parts])
    np.testing.assert_array_equal(joined.in_view(here).xy, xy)
    index = np.array([70, 3, 41])
    np.testing.assert_array_equal(joined.chosen(index).in_view(here).xy, xy[index])
    np.testing.assert_array_equal(joined.chosen(index).in_view(here).state, joined.in_view(here).state[index])


def test_points_picked_at_several_instants_are_on_the_triangles_of_theirs():
    """A ball has other triangles from the second instant on, and is gone at the third: points of each instant, joined."""
    balls = [sphere(2, 0.7), sphere(3, 0.7), None, sphere(3, 0.8), sphere(2, 0.8)]
    views = [
        view([ball or sphere(2, 0.7), cube(0.3)], [STILL if ball else None, pose(1.5, 0, 0)], camera(), steps=[i + 1, None])
        for i, ball in enumerate(balls)
    ]
    rng = np.random.default_rng(0)
    parts = [points_on(one, 50, rng) for one in views]
    joined = SurfacePoints.joined(parts)
    assert [body.position for body in joined.bodies] == [0, 1, 0]  # two kinds of ball, and one cube
    assert np.array_equal(joined.thing, np.concatenate([part.thing for part in parts]))
    for one in views:
        alone, seen = [part.in_view(one) for part in parts], joined.in_view(one)
        np.testing.assert_array_equal(seen.state, np.concatenate([part.state for part in alone]))
        np.testing.assert_array_equal(seen.world, np.concatenate([part.world for part in alone]))
    later = joined.in_view(views[3]).state[50:100]
    assert (later != INVALID).all() and (joined.in_view(views[3]).state[:50] == INVALID).any()


def test_draws_are_even_by_area_and_need_a_surface():
    """Of a card twice as wide as another, twice as many; and as many on either side of its middle."""
    wide = mesh_of([[-2, 0, -1], [2, 0, -1], [2, 0, 1], [-2, 0, 1]], [[0, 1, 2], [0, 2, 3]])
    tall = mesh_of([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], [[0, 1, 2], [0, 2, 3]])
    here = view([wide, tall, mesh_of(np.zeros((0, 3)), [])], [STILL, pose(0, 1, 0), STILL], camera())
    points = points_on(here, 30_000, np.random.default_rng(0))
    world = points.in_view(here).world
    assert abs((points.thing == 0).mean() - 2 / 3) < 0.01
    assert abs((world[points.thing == 0, 0] < 0).mean() - 0.5) < 0.01 and abs((world[:, 2] < 0.5).mean() - 0.75) < 0.01
    again = points_on(here, 30_000, np.random.default_rng(0))
    assert np.array_equal(again.weights, points.weights) and np.array_equal(again.triangle, points.triangle)
    with pytest.raises(ValueError, match="have a surface, found none"):
        points_on(here, 10, np.random.default_rng(0), things=[2])
