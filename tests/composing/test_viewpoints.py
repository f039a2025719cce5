"""Poses: the paper's grid, random kinds, cameras."""

import math
import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shots import camera_of
from viewsphere.composing.viewpoints.camera import distance_problem
from viewsphere.composing.viewpoints.pose_numbers import pose_names
from viewsphere.composing.viewpoints.poses import poses
from viewsphere.geometry.box3d import Box3d
from viewsphere.model.instant import Viewpoint
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.planning.plan import plan
from viewsphere.recipe.cameras.viewpoints import Range, axis_count, axis_value
from viewsphere.recipe.recipe import Recipe


def make(seed=0, **viewpoints):
    recipe = Recipe(models=[{"source": "zoo:car"}], viewpoints={"distance": 5, **viewpoints})
    return poses(recipe.viewpoints, seed)


def azimuths(**span):
    return [p.azimuth_deg for p in make(azimuth=span, elevation=0)]


def kolmogorov(values, cdf) -> float:
    """The Kolmogorov-Smirnov statistic, times the root of the number of values; above 1.63 at the 1 % level."""
    x = np.sort(values)
    expected, n = cdf(x), len(x)
    above = np.arange(1, n + 1) / n - expected
    below = expected - np.arange(n) / n
    return float(max(above.max(), below.max()) * math.sqrt(n))


def test_a_range_includes_its_stop():
    assert azimuths(start=0, stop=340, step=20) == list(range(0, 341, 20))
    assert azimuths(start=-30, stop=30, step=30) == [-30, 0, 30]
    assert azimuths(start=10, stop=10, step=5) == [10]


def test_a_step_that_does_not_meet_the_stop_ends_before_it():
    assert azimuths(start=0, stop=100, step=30) == [0, 30, 60, 90]


def test_a_full_turn_drops_the_repeated_360():
    assert azimuths(start=0, stop=360, step=90) == [0, 90, 180, 270]
    assert azimuths(start=-180, stop=180, step=90) == [-180, -90, 0, 90]
    assert azimuths(start=0, stop=360, step=7) == list(range(0, 358, 7))
    assert azimuths(start=0, stop=360, step=360) == [0]
    assert len(azimuths(start=0, stop=360, step=0.1)) == 3600
    assert [p.tilt_deg for p in make(tilt={"start": 0, "stop": 360, "step": 180}, azimuth=0)] == [0, 180]


def test_distances_and_elevations_never_lose_their_stop():
    assert [p.distance for p in make(azimuth=0, distance={"start": 10, "stop": 370, "step": 360})] == [10, 370]


def test_steps_do_not_drift():
    values = azimuths(start=0, stop=300, step=0.1)
    assert len(values) == 3001
    assert values[3] == 0.3
    assert values == [i / 10 for i in range(3001)]
    assert azimuths(start=0.1, stop=0.7, step=0.2) == [0.1, 0.3, 0.5, 0.7]


@given(st.integers(-2000, 2000), st.integers(1, 700), st.integers(0, 400), st.integers(0, 6), st.floats(0, 0.99))
def test_any_decimal_range_has_exactly_its_values(start, step, steps, digits, beyond):
    unit = 10**digits
    span = Range(start=start / unit, stop=(start + (steps + beyond) * step) / unit, step=step / unit)
    assert axis_count(span) == steps + 1
    assert [axis_value(span, i) for i in range(steps + 1)] == [(start + i * step) / unit for i in range(steps + 1)]


def test_azimuth_runs_fastest_then_elevation_distance_tilt():
    grid = make(azimuth=[0, 90], elevation=[0, 10, 20], distance=[4, 5], tilt=[0, 7])
    found = [(p.index, p.tilt_deg, p.distance, p.elevation_deg, p.azimuth_deg) for p in grid]
    expected = [(t, d, e, a) for t in (0, 7) for d in (4, 5) for e in (0, 10, 20) for a in (0, 90)]
    assert found == [(i, *values) for i, values in enumerate(expected)]
    assert len(grid) == 24


def test_poses_are_a_sequence():
    grid = make(azimuth=[0, 90, 180], elevation=0)
    assert [p.index for p in grid[1:]] == [1, 2]
    assert grid[-1] == grid[2]
    with pytest.raises(IndexError):
        grid[3]


def test_a_pose_carries_its_target_and_category():
    pose = make(azimuth=90, elevation=0, target=[0, 0, 1])[0]
    assert pose.target == (0, 0, 1)
    assert pose.category == "left"
    assert make(azimuth=30, elevation=0, bins=30)[0].category == "az030"
    assert make(azimuth=30, elevation=75)[0].category == "top"
    assert make(azimuth=30)[0].target is None


def test_a_million_poses_cost_nothing_until_asked_for():
    tracemalloc.start()
    grid = make(azimuth={"start": 0, "stop": 360, "step": 0.36}, elevation={"start": 0, "stop": 90, "step": 0.09})
    assert len(grid) == 1000 * 1001
    assert grid[len(grid) - 1].elevation_deg == 90
    assert len(make(kind="sphere", count=10**12)) == 10**12
    assert tracemalloc.get_traced_memory()[1] < 5_000_000
    tracemalloc.stop()


@pytest.mark.slow
def test_the_sphere_is_uniform_by_area():
    views = [make(kind="sphere", count=4000).view(i) for i in range(4000)]
    sines = np.sin(np.radians([v.elevation for v in views]))
    turns = np.array([v.azimuth for v in views]) / 360
    assert kolmogorov(sines, lambda x: (x + 1) / 2) < 1.63
    assert kolmogorov(turns, lambda x: x) < 1.63
    angles = 2 * np.pi * turns
    points = np.column_stack([np.sqrt(1 - sines**2) * np.cos(angles), np.sqrt(1 - sines**2) * np.sin(angles), sines])
    assert np.abs(points.mean(axis=0)).max() < 4 / math.sqrt(3 * 4000)
    assert np.abs(points.T @ points / 4000 - np.eye(3) / 3).max() < 0.025


@pytest.mark.slow
def test_a_band_of_the_sphere_keeps_to_its_limits():
    fields = {"count": 2000, "elevation": [20, 60], "azimuth": [-30, 30], "distance": [4, 6], "tilt": [-5, 5]}
    views = np.array([make(kind="sphere", **fields).view(i) for i in range(2000)])
    low, high = math.sin(math.radians(20)), math.sin(math.radians(60))
    assert kolmogorov(np.sin(np.radians(views[:, 1])), lambda x: (x - low) / (high - low)) < 1.63
    for column, (lo, hi) in ((0, (-30, 30)), (2, (4, 6)), (3, (-5, 5))):
        assert lo <= views[:, column].min() < views[:, column].max() <= hi
        assert kolmogorov(views[:, column], lambda x, lo=lo, hi=hi: (x - lo) / (hi - lo)) < 1.63
    assert 20 <= views[:, 1].min() < views[:, 1].max() <= 60


@pytest.mark.slow
def test_normal_draws_have_their_mean_and_spread():
    fields = {"azimuth": 30, "elevation": 15, "distance": 5, "tilt": 1, "sd": {"azimuth": 20, "elevation": 5, "distance": 0.3}}
    views = np.array([make(kind="normal", count=3000, **fields).view(i) for i in range(3000)])
    assert np.allclose(views.mean(axis=0), [30, 15, 5, 1], atol=4 * np.array([20, 5, 0.3, 0]) / math.sqrt(3000))
    assert np.allclose(views[:, :3].std(axis=0), [20, 5, 0.3], rtol=0.06)
    assert np.all(views[:, 3] == 1)
    assert np.abs(np.corrcoef(views[:, :3].T) - np.eye(3)).max() < 0.08


def test_normal_draws_stay_below_the_pole_and_away_from_the_target():
    fields = {"elevation": 85, "distance": 0.5, "sd": {"elevation": 20, "distance": 1}}
    views = [make(kind="normal", count=500, **fields).view(i) for i in range(500)]
    assert all(abs(v.elevation) <= 90 and v.distance > 0 for v in views)


def test_jitter_moves_each_viewpoint_of_the_grid_uniformly():
    by = {"azimuth": 10, "elevation": 5, "distance": 0.5, "tilt": 2}
    grid = make(kind="jitter", azimuth=[0, 90], elevation=[10, 89], distance=[3, 4], plus_minus=by, count=400)
    assert len(grid) == 8 * 400
    views = np.array([grid.view(i) for i in range(len(grid))]).reshape(2, 2, 2, 400, 4)  # distance, elevation, azimuth
    for d, distance in enumerate((3, 4)):
        for a, azimuth in enumerate((0, 90)):
            assert kolmogorov(views[d, 0, a, :, 0], lambda x, m=azimuth: (x - m + 10) / 20) < 1.9
            assert kolmogorov(views[d, 0, a, :, 2], lambda x, m=distance: x - m + 0.5) < 1.9
    assert kolmogorov(views[:, 0, :, :, 1].ravel(), lambda x: (x - 5) / 10) < 1.63
    assert kolmogorov(views[:, 1, :, :, 1].ravel(), lambda x: (x - 84) / 6) < 1.63  # 84 to the pole
    assert kolmogorov(views[..., 3].ravel(), lambda x: (x + 2) / 4) < 1.63


def test_draws_do_not_depend_on_what_else_there_is():
    few, many = make(kind="sphere", count=10), make(kind="sphere", count=1000)
    assert [few.view(i) for i in range(10)] == [many.view(i) for i in range(10)]
    by = {"azimuth": 10}
    one = make(kind="jitter", azimuth=[90], elevation=[20], plus_minus=by)
    more = make(kind="jitter", azimuth=[0, 90], elevation=[10, 20], plus_minus=by)
    assert one.view(0) == more.view(3)
    assert make(1, kind="sphere", count=1).view(0) != make(2, kind="sphere", count=1).view(0)


def test_pose_names_are_values_on_a_grid_and_distinct():
    one, more = make(azimuth=[90], elevation=[20]), make(azimuth=[0, 90], elevation=[10, 20])
    assert one.name(0) == more.name(3)
    for kind in (more, make(kind="sphere", count=9), make(kind="jitter", azimuth=[0, 1], plus_minus={}, count=2)):
        assert len({kind.name(i) for i in range(len(kind))}) == len(kind)
    assert make(azimuth=[0.0], elevation=-0.0).name(0) == make(azimuth=[0], elevation=0).name(0)


LENS = Intrinsics(width=64, height=48, fx=50, fy=50, cx=32, cy=24)


def test_the_camera_stands_where_the_pose_says_and_looks_at_the_target():
    pose = Viewpoint(index=0, azimuth_deg=90, elevation_deg=0, distance=5)
    camera = camera_of(LENS, pose, (1, 2, 3))
    assert np.allclose(camera.center, [6, 2, 3], atol=1e-14)
    assert np.allclose(camera.R @ [1, 2, 3] + camera.t, [0, 0, 5], atol=1e-14)
    above = camera_of(LENS, Viewpoint(index=0, azimuth_deg=0, elevation_deg=90, distance=2), (0, 0, 0))
    assert np.allclose(above.R, [[1, 0, 0], [0, -1, 0], [0, 0, -1]], atol=1e-15)


def test_a_pose_s_own_target_wins():
    pose = Viewpoint(index=0, azimuth_deg=0, elevation_deg=0, distance=5, target=(1, 1, 1))
    assert np.allclose(camera_of(LENS, pose, (0, 0, 0)).center, [1, -4, 1])


def test_a_tilt_rolls_the_camera_clockwise_seen_from_behind():
    pose = Viewpoint(index=0, azimuth_deg=0, elevation_deg=0, distance=5, tilt_deg=90)
    camera = camera_of(LENS, pose, (0, 0, 0))
    assert np.allclose(camera.R @ [0, 0, 1], [-1, 0, 0], atol=1e-15)  # up in the world is left in the picture


def test_a_camera_inside_the_model_is_a_problem():
    box = Box3d.between(np.array([-1.0, -2.0, -0.5]), np.array([1.0, 2.0, 0.5])).corners

    def problem(**values):
        return distance_problem(Viewpoint(**{"index": 7, "azimuth_deg": 0, "elevation_deg": 0, "distance": 1.5, **values}), box)

    found = problem()
    assert found is not None
    assert "`distance` 1.5 m is inside the model" in found and "(pose 7)" in found
    assert problem(distance=2.01) is None
    assert problem(azimuth_deg=90) is None
    assert problem(azimuth_deg=90, distance=0.99) is not None
    assert problem(elevation_deg=90, distance=0.51) is None
    assert problem(target=(0, 3, 0), distance=1.5) is not None
    assert distance_problem(Viewpoint(index=0, azimuth_deg=0, elevation_deg=0, distance=0.1), box * [1, 1, 0]) is None


RANDOM = {
    "sphere": {"kind": "sphere", "count": 2, "elevation": [5, 40], "distance": {"fill": 0.6}},
    "normal": {"kind": "normal", "count": 2, "distance": 2, "sd": {"azimuth": 20}},
    "jitter": {"kind": "jitter", "azimuth": [0, 90], "distance": 2, "plus_minus": {"azimuth": 20}},
}


def views_of(names, viewpoints, **changes):
    """Of each model its viewpoints."""
    models = [{"source": "zoo:mug", "name": name, "category": "mug"} for name in names]
    planned = plan(Recipe(models=models, viewpoints=viewpoints, **changes))
    boxes = lambda spec, step=None: Box3d.between((-0.05, -0.05, 0), (0.05, 0.05, 0.1)).corners  # noqa: E731
    shots = {row.subject.removesuffix("_000"): planned.shot(row, boxes) for row in planned.rows}
    return {key: [now.viewpoint for now in shot.instants] for key, shot in shots.items()}


@pytest.mark.parametrize("kind", RANDOM)
@pytest.mark.slow
def test_random_viewpoints_are_drawn_for_each_model(kind):
    names = [f"mug_{i}" for i in range(20)]
    own, shared = (views_of(names, RANDOM[kind] | more) for more in ({}, {"shared": True}))
    assert len({view.azimuth_deg for views in own.values() for view in views}) == 40
    assert len({view.azimuth_deg for views in shared.values() for view in views}) == 2
    assert [view.index for view in own["mug_7"]] == [0, 1]


def test_a_model_more_and_another_order_change_no_model_s_viewpoints():
    few, more = views_of(["a", "b"], RANDOM["sphere"]), views_of(["c", "b", "a"], RANDOM["sphere"])
    assert all(more[name] == few[name] for name in few)
    other = views_of(["a", "b"], RANDOM["sphere"], seed=1)
    assert all(other[name] != few[name] for name in few)


def test_viewpoints_of_a_grid_are_those_of_all_models():
    views = views_of(["a", "b"], {"azimuth": [0, 90], "distance": 2})
    assert views["a"] == views["b"]


def test_shared_viewpoints_and_own_ones_are_different_poses_of_a_data_set():
    own, shared = (make(**RANDOM["sphere"], **more) for more in ({}, {"shared": True}))
    assert not set(pose_names(own).tolist()) & set(pose_names(shared).tolist())


def test_sequences_of_each_model_have_viewpoints_of_their_own():
    still = {**RANDOM["normal"], "count": 1}
    for more, count in (({}, 3), ({"shared": True}, 1)):
        views = views_of(["a", "b", "c"], still | more, time={"frames": 2, "fps": 10})
        assert len({view.azimuth_deg for of in views.values() for view in of}) == count
