"""Correspondence under a rolling shutter: closed forms, and brute force over still worlds at the time of each row."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from two_views import centers, expected_states, pose, view

from proven import close
from rolling_scenes import at_row, rolling_camera, shown_rows
from truth_scenes import cube, lens, orbit_camera, random_soup, sphere
from viewsphere.geometry.camera import pixel_rays
from viewsphere.model.sensors.rolling import RowPoses
from viewsphere.truth.correspondences.correspondence import Match
from viewsphere.truth.correspondences.rolling import match_between
from viewsphere.truth.surface_points.raster import BEHIND, INVALID, OCCLUDED, OUTSIDE, VISIBLE
from viewsphere.truth.view import View

HEIGHT = 32


def rolling_view(rng, places, turn, shift, azimuth, sky=True, elevation=0.5):
    """Two things that move while rows are exposed, and a still one, before a moving camera."""
    camera = orbit_camera(lens(40, HEIGHT), azimuth, elevation, 2.5)
    meshes = [cube(0.4), sphere(1, 0.5), random_soup(np.random.default_rng(4), 8, 0.8)]
    still = view(meshes, places, camera, True, sky, floor=-1.0)
    moving = [i for i in (0, 1) if places[i] is not None]
    return replace(still, camera=rolling_camera(camera, still.geometry, rng, turn, shift, moving))


def matched(here, there):
    return match_between(here, here.visibility, there)


def of_row(whole, row):
    geometry, camera = at_row(whole.geometry, whole.camera, row)
    return View(whole.things, geometry, camera, True)


def poses_of(whole, thing):
    """The poses (H, 4, 4) of a thing; of the ground and the sky, which stand still, the identity."""
    if thing < 0 or thing == len(whole.things):
        return np.tile(np.eye(4), (whole.camera.height, 1, 1))
    return whole.camera.rows.moving.get(thing, np.tile(whole.geometry.poses[thing], (whole.camera.height, 1, 1)))


@pytest.mark.parametrize(("turn", "shift"), [(0.05, 0.05), (0.5, 0.4)])
def test_pixels_go_where_the_row_nearest_to_the_other_instant_shows_their_points(turn, shift):
    rng = np.random.default_rng(2)
    first = [pose(0.6, 0, 0.3), pose(-0.5, 0.5, 0.2), pose(0, 0, 0)]
    second = [pose(0.5, 0.1, 0.3), pose(-0.3, 0.5, 0.1), pose(0, 0, 0)]
    here, there = rolling_view(rng, first, turn, shift, 0.2), rolling_view(rng, second, turn, shift, 0.5)
    match = matched(here, there)
    triangle, inverse = here.visibility.triangle, here.visibility.exact
    things = np.append(here.owners, -1)[triangle]
    rays, rows, checked = pixel_rays(here.camera.intrinsics), here.camera.rows, []
    for y in range(0, HEIGHT, 2):
        for x in range(0, 40, 2):
            thing = int(things[y, x])
            if thing < 0:
                continue
            world = rows.rotation[y].T @ (rays[y, x] / inverse[y, x] - rows.translation[y])
            own = np.linalg.solve(poses_of(here, thing)[y], [*world, 1.0])[:3]
            places, xy = shown_rows(there.camera, poses_of(there, thing), own), match.xy[y, x]
            if not places:
                assert np.isnan(xy).all() and match.state[y, x] == BEHIND
                continue
            assert abs(abs(xy[1] - HEIGHT / 2) - min(abs(v - HEIGHT / 2) for _, v in places)) < 1e-6
            assert min(np.hypot(*(xy - place)) for place in places) < 1e-6
            if not ((xy >= 0) & (xy < (40, HEIGHT))).all():
                assert match.state[y, x] == OUTSIDE
                continue
            still, at = of_row(there, int(xy[1])), poses_of(there, thing)[int(xy[1])]
            moved = at[:3, :3] @ own + at[:3, 3]
            close("flow", "rows", match.xyz[y, x], still.camera.R @ moved + still.camera.t, "m", atol=1e-9)
            on = np.minimum(triangle[y, x : x + 1], there.geometry.triangle_start[-1])
            state, sure = expected_states(still, moved[None], on)
            if sure[0] and state[0] <= OCCLUDED and abs(xy[1] - round(xy[1])) > 1e-6:
                assert match.state[y, x] == state[0]
                checked.append(int(state[0]))
    assert {VISIBLE, OCCLUDED} == set(checked) and len(checked) > 100


@pytest.mark.parametrize("upward", [0.0, 1.3, -2.0])
def test_a_wall_flows_in_closed_form(upward):
    """A camera moves by v right and w down a second, a wall is at depth z: a point at row y is seen at t = y r / H, and again
    at T + y' r / H. So y' - y = -f w T / z / (1 + f w r / (H z)), and x' - x = -f v (T + (y' - y) r / H) / z.
    """
    sideways, depth, interval, readout = 0.8, 3.0, 0.1, 0.06
    camera = replace(orbit_camera(lens(64, 48), 0, 0, 0), R=np.eye(3), t=np.zeros(3))
    wall = cube(1.0)
    wall = replace(wall, vertices=(wall.vertices * (60, 60, 1e-4) + (0, 0, depth)).astype(np.float32))

    def at(instant):
        times = instant + ((np.arange(48) + 0.5) / 48 - 0.5) * readout
        shift = -times[:, None] * (sideways, upward, 0.0)
        rows = RowPoses(np.tile(np.eye(3), (48, 1, 1)), shift, {})
        moved = replace(camera, t=-instant * np.array([sideways, upward, 0.0]), rows=rows)
        return view([wall], [pose(0, 0, 0)], moved)

    here = at(0.0)
    match, z = matched(here, at(interval)), 1 / here.visibility.exact
    f = camera.K[0, 0]
    down = -f * upward * interval / z / (1 + f * upward * readout / (48 * z))
    right = -f * sideways * (interval + down * readout / 48) / z
    between = ((match.xy >= 0.5) & (match.xy <= (64, 47.5))).all(axis=-1)
    assert between.mean() > 0.5
    close("flow", "closed form", match.flow[between], np.stack((right, down), axis=-1)[between], "px", atol=1e-5)
    motion = np.stack((-sideways * (interval + down * readout / 48), -upward * (interval + down * readout / 48)), axis=-1)
    middle = between & (np.abs(match.xy[..., 1] - np.floor(match.xy[..., 1]) - 0.5) < 1e-6)
    assert middle.any() == (upward == 0)
    close("scene_flow", "closed form", match.scene_flow[middle][:, :2], motion[middle], "m", atol=1e-6)


def test_a_turning_camera_moves_the_sky_in_closed_form():
    """A camera that turns by w a second about its vertical axis: of the horizon's row, as from any other, the sky goes from the
    angle a to a - w (T + (y' - y) r / H).
    """
    speed, interval, readout = 0.5, 0.1, 0.05
    camera = replace(orbit_camera(lens(64, 48), 0, 0, 0), R=np.eye(3), t=np.zeros(3))

    def turned(angle):
        c, s = np.cos(angle), np.sin(angle)
        return np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])

    def at(instant):
        rotation = np.stack([turned(speed * (instant + ((y + 0.5) / 48 - 0.5) * readout)) for y in range(48)])
        rows = RowPoses(rotation, np.zeros((48, 3)), {})
        return view([cube(0.1)], [pose(0, 0, -50)], replace(camera, R=turned(speed * instant), rows=rows))

    match, f = matched(at(0.0), at(interval)), camera.K[0, 0]
    assert (match.visibility.triangle < 0).all()
    rays, xy = pixel_rays(camera.intrinsics), match.xy
    angle = np.arctan(rays[..., 0]) - speed * (interval + (xy[..., 1] - centers(camera)[..., 1]) / 48 * readout)
    inside = (xy[..., 1] > 0.5) & (xy[..., 1] < 47.5)
    close("flow", "closed form", xy[..., 0][inside], (32 + f * np.tan(angle))[inside], "px", atol=1e-4)
    assert (match.state[inside & (xy[..., 0] >= 0) & (xy[..., 0] < 64)] == VISIBLE).all()
    assert np.isnan(match.scene_flow).all() and np.isinf(match.xyz[..., 2][inside]).all()


def test_rows_of_one_pose_are_a_global_shutter():
    rng = np.random.default_rng(3)
    first = [pose(0.6, 0, 0.3), pose(-0.5, 0.5, 0.2), pose(0, 0, 0)]
    second = [pose(0.4, 0.1, 0.3), None, pose(0, 0, 0)]
    here, there = rolling_view(rng, first, 0.0, 0.0, 0.2), rolling_view(rng, second, 0.0, 0.0, 0.3)
    one, two = (replace(whole, camera=replace(whole.camera, rows=None)) for whole in (here, there))
    rolled, still = matched(here, there), Match(one, one.visibility, two)
    near = (np.abs(still.xyz) < 100).all(axis=-1) | np.isnan(still.xyz).all(axis=-1)
    np.testing.assert_array_equal(np.isnan(rolled.flow), np.isnan(still.flow))
    np.testing.assert_allclose(rolled.flow[near], still.flow[near], atol=1e-6)
    np.testing.assert_allclose(rolled.scene_flow[near], still.scene_flow[near], atol=1e-6)
    np.testing.assert_allclose(rolled.inverse_depth, still.inverse_depth, atol=1e-9)
    assert (rolled.state == still.state).mean() > 0.998 and (rolled.state == INVALID).any()
    mixed = matched(here, two)
    np.testing.assert_allclose(mixed.flow[near], still.flow[near], atol=1e-6)


def test_what_does_not_move_has_no_flow_at_all():
    """Zeros, not roundings, before a camera at rest; and a flat background has no place."""
    rng = np.random.default_rng(3)
    first = [pose(0.6, 0, 0.3), pose(-0.5, 0.5, 0.2), pose(0, 0, 0)]
    second = [pose(0.4, 0.1, 0.3), pose(-0.5, 0.4, 0.2), pose(0, 0, 0)]
    for sky in (True, False):
        views = []
        for places in (first, second):
            whole = rolling_view(rng, places, 0.0, 0.3, 0.2, sky, 0.1)
            kept = whole.camera.rows.moving
            rest = RowPoses(np.tile(whole.camera.R, (HEIGHT, 1, 1)), np.tile(whole.camera.t, (HEIGHT, 1)), kept)
            views.append(replace(whole, camera=replace(whole.camera, rows=rest)))
        match = matched(*views)
        owners = np.append(views[0].owners, 9)[match.visibility.triangle]
        assert {0, 1, 2, 3, 9} <= set(owners.reshape(-1).tolist())
        still = (owners == 2) | (owners == 3)
        assert (match.flow[still] == 0).all() and (match.scene_flow[still] == 0).all() and (match.flow[owners <= 1] != 0).any()
        assert (match.flow[owners == 9] == 0).all() == sky and (match.state[owners == 9] == INVALID).all() != sky


def test_things_that_deform_are_an_error():
    meshes = [cube(0.4), replace(cube(0.4), vertices=cube(0.4).vertices * np.float32(1.1))]
    camera = orbit_camera(lens(40, HEIGHT), 0, 0.5, 2.5)
    here, there = (view([mesh], [pose(0, 0, 0)], camera, steps=[k]) for k, mesh in enumerate(meshes))
    rolled = replace(here, camera=rolling_camera(camera, here.geometry, np.random.default_rng(0)))
    with pytest.raises(ValueError, match="thing 0 deforms"):
        _ = matched(rolled, there).flow
