"""Points under a rolling shutter: brute force over still worlds at the time of each row."""

from __future__ import annotations

import numpy as np
import pytest
from two_views import centers, expected_states, pose, view

from rolling_scenes import at_row, rolling_camera, shown_rows
from truth_scenes import cube, lens, orbit_camera, random_soup, sphere
from viewsphere.model.sensors.rolling import RowPoses
from viewsphere.truth.raster.rolling import pixels_in_rows
from viewsphere.truth.surface_points.draws import points_on
from viewsphere.truth.surface_points.points import FREE, GROUND, SKY, points_in_world, points_seen
from viewsphere.truth.surface_points.raster import BEHIND, OCCLUDED, OUTSIDE, VISIBLE
from viewsphere.truth.surface_points.rolling import when_shown
from viewsphere.truth.view import View


def rolling_view(rng, turn, shift, ground=True, width=64):
    """Two moving things and a still one before a moving camera."""
    camera = orbit_camera(lens(width, 48), rng.uniform(0, 6), rng.uniform(0.1, 1.2), rng.uniform(1.5, 4))
    meshes, places = (
        [cube(0.4), sphere(2, 0.5), random_soup(rng, 12, 1.0)],
        [pose(0.6, 0, 0.3), pose(-0.5, 0.5, 0.2), pose(0, 0, 0)],
    )
    still = view(meshes, places, camera, ground=ground, floor=-1.0)
    return View(still.things, still.geometry, rolling_camera(camera, still.geometry, rng, turn, shift, (0, 1)), True)


def of_row(whole, row):
    """The still world of a row, made by the tests alone."""
    geometry, camera = at_row(whole.geometry, whole.camera, row)
    return View(whole.things, geometry, camera, True)


def poses_of(whole, thing):
    return whole.camera.rows.moving.get(thing, np.tile(whole.geometry.poses[thing], (whole.camera.height, 1, 1)))


@pytest.mark.parametrize(("turn", "shift"), [(0.05, 0.05), (0.4, 0.3), (3.0, 1.0)])
def test_points_on_things_are_where_and_as_the_row_nearest_to_the_instant_shows_them(turn, shift):
    rng, found = np.random.default_rng(7), []
    for _ in range(3):
        whole = rolling_view(rng, turn, shift)
        points = points_on(whole, 150, rng, things=[0, 1, 2])
        tracked = points.in_view(whole)
        own = tracked._own
        in_thing = np.einsum("nk,nkd->nd", points.weights, whole.geometry.coordinates[whole.geometry.triangles[own]])
        for k, thing in enumerate(points.thing.tolist()):
            places = shown_rows(whole.camera, poses_of(whole, thing), in_thing[k].astype(np.float64))
            if not places:
                assert tracked.state[k] == BEHIND and np.isnan(tracked.xy[k]).all()
                continue
            x, y = tracked.xy[k]
            assert abs(abs(y - 24) - min(abs(place[1] - 24) for place in places)) < 1e-6
            assert min(np.hypot(x - u, y - v) for u, v in places) < 1e-6
            if not (0 <= x < whole.camera.width and 0 <= y < 48):
                assert tracked.state[k] == OUTSIDE
                continue
            still = of_row(whole, int(y))
            at = poses_of(whole, thing)[int(y)]
            world = at[:3, :3] @ in_thing[k] + at[:3, 3]
            state, sure = expected_states(still, world[None], own[k : k + 1])
            if sure[0] and state[0] in (VISIBLE, OCCLUDED) and abs(y - round(y)) > 1e-6:
                assert tracked.state[k] == state[0]
                found.append(tracked.state[k])
    assert {VISIBLE, OCCLUDED} == set(found) and len(found) > 60


def test_points_at_pixels_are_those_that_the_picture_shows_and_stay_there():
    rng = np.random.default_rng(2)
    whole = rolling_view(rng, 0.1, 0.1)
    xy = centers(whole.camera).reshape(-1, 2)
    points = points_seen(whole, xy)
    triangle = whole.visibility.triangle.reshape(-1)
    things = np.append(whole.owners, SKY)[triangle]
    np.testing.assert_array_equal(points.thing, np.where(things == 3, GROUND, things))
    on = points.thing >= 0
    first = np.array(whole.geometry.triangle_start)
    np.testing.assert_array_equal(points.triangle[on] + first[points.thing[on]], triangle[on])
    tracked = points.in_view(whole)
    np.testing.assert_allclose(tracked.xy, xy, atol=1e-7)
    assert (tracked.state == VISIBLE).mean() > 0.998
    assert {0, 1, 2, GROUND, SKY} <= set(points.thing.tolist())


def test_a_point_moves_through_the_picture_in_closed_form():
    """A point at depth z that moves by v t to the right and w t down is at row y with y = cy + f (Y + w t) / z, and t follows
    from the row: t = (y - H/2) r / H. So y = (cy + f Y / z - H k / 2) / (1 - k) with k = f w r / (H z).
    """
    height, (v, w), z = 48, (1.7, 0.9), 3.0
    camera = orbit_camera(lens(64, height), 0, 0, 0)
    times = (np.arange(height) + 0.5) / height - 0.5
    still = view([cube(0.1)], [pose(0, 0, 0)], camera)
    rng = np.random.default_rng(0)
    in_camera = np.column_stack((rng.uniform(-0.6, 0.6, 40), rng.uniform(-0.4, 0.4, 40), np.full(40, z)))
    world = (in_camera - camera.t) @ camera.R
    shift = camera.t + times[:, None] * (v, w, 0.0)
    rows = RowPoses(np.tile(camera.R, (height, 1, 1)), shift, {})
    whole = View(still.things, still.geometry, type(camera)(camera.intrinsics, camera.R, camera.t, rows), True)
    f, k = camera.K[1, 1], camera.K[1, 1] * w / (height * z)
    y = (height / 2 + f * in_camera[:, 1] / z - height * k / 2) / (1 - k)
    x = 32 + f * (in_camera[:, 0] + v * (y - height / 2) / height) / z
    found = points_in_world(world).in_view(whole)
    assert (found.points.body == FREE).all() and ((y > 0.5) & (y < height - 0.5)).all()
    np.testing.assert_allclose(found.xy, np.column_stack((x, y)), atol=1e-9)


def test_a_place_at_the_time_of_its_row_is_shown_by_that_row_as_if_it_stood_still():
    """So tracks on moving scenery, whose motion no sample holds, have positions in the picture."""
    rng = np.random.default_rng(4)
    whole = rolling_view(rng, 0.1, 0.4)
    tracked = points_on(whole, 200, rng, things=[0, 1, 2]).in_view(whole)
    places = when_shown(whole, tracked.world, tracked.moving, tracked.xy[:, 1])
    found, _ = pixels_in_rows(whole.camera, whole.camera.rows, -1, np.eye(4), places)
    inside = (tracked.xy[:, 1] > 0.5) & (tracked.xy[:, 1] < 47.5)
    still = tracked.points.thing == 2
    np.testing.assert_array_equal(places[still], tracked.world[still])
    np.testing.assert_allclose(found[inside], tracked.xy[inside], atol=2e-3)
    at_once, _ = pixels_in_rows(whole.camera, whole.camera.rows, -1, np.eye(4), tracked.world)
    assert np.abs(at_once - tracked.xy)[inside & ~still].max() > 1 and inside.sum() > 50
