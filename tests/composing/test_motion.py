"""Motions of things: closed forms of every kind, composition, entering and leaving, mistakes, a motion of somebody else."""

import re
import sys
from functools import partial
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from installed import installed
from small import ROOT
from viewsphere import plugins
from viewsphere.assets.animation.timeline import Timeline
from viewsphere.composing import motion
from viewsphere.composing.motion import Lane, Start, check_motion, check_motions, mover
from viewsphere.composing.placing import standing
from viewsphere.composing.seeds import generator
from viewsphere.errors import RecipeError
from viewsphere.geometry.box3d import Box3d
from viewsphere.model.model_spec import ModelSpec
from viewsphere.recipe.reading.file import read
from viewsphere.recipe.recipe import Recipe
from viewsphere.recipe.world.motion import MotionEntry
from viewsphere_zoo.places.neighbourhood import neighbourhood

BOX = Box3d.between((-1.0, -2.0, -0.5), (1.0, 2.0, 0.5)).corners
PLACED = standing(BOX, 3.0, 4.0, 30.0)
KINDS = plugins.names("motions")
TIMES = np.arange(51) / 25
LANES = (Lane("there", ((0, -10, 0), (0, 10, 0)), 3), Lane("back", ((-3, 10, 0), (-3, -10, 0)), 3))


def entries(*options):
    return tuple(MotionEntry(**one) for one in options) if len(options) > 1 else MotionEntry(**options[0])


def start(key="car_000", seed=0, **fields):
    spec = ModelSpec(key=key, source="walk.fbx", category="thing", category_id=1)
    rng = partial(generator, seed, "motion", key)
    return Start(placed=PLACED, spec=spec, seconds=2.0, rng=rng, **{"field": "models[2].motion", **fields})


def moved(*options, times=TIMES, **fields):
    return mover(entries(*options), start(**fields)).motion_at(times)


def poses(*options, times=TIMES, **fields):
    """The poses at these times, (T, 4, 4), of a thing that is there all the time."""
    made = moved(*options, times=times, **fields)
    found = np.array([made.pose_at(i) for i in range(len(times))])
    for pose in found:
        np.testing.assert_allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-9)
        assert np.linalg.det(pose[:3, :3]) > 0
    return found


def mistake(*options, **fields):
    with pytest.raises(RecipeError) as caught:
        moved(*options, **fields)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def angles(rotations):
    """Degrees between each rotation and the next."""
    return [np.degrees(np.arccos(np.clip((np.trace(a.T @ b) - 1) / 2, -1, 1))) for a, b in pairwise(rotations)]


def test_without_motions_things_stand_still():
    assert mover(None, start()).motion_at(TIMES).poses == (PLACED,)


def test_constant_is_a_line_and_a_turn_about_one_axis():
    found = poses({"kind": "constant", "velocity": [1, -2, 0.5], "spin_deg": [0, 0, 40]})
    np.testing.assert_allclose(found[:, :3, 3], np.array(PLACED)[:3, 3] + np.outer(TIMES, [1, -2, 0.5]), atol=1e-10)
    for time, pose in zip(TIMES, found, strict=True):
        np.testing.assert_allclose(pose[:3, :3], np.array(standing(BOX, azimuth_deg=30 + 40 * time))[:3, :3], atol=1e-10)


def test_spin_is_about_the_things_own_axes():
    axis = np.array([2, -1, 3]) / np.sqrt(14)
    found = poses({"kind": "constant", "spin_deg": [20, -10, 30]})
    np.testing.assert_allclose(angles(found[:, :3, :3]), np.sqrt(1400) / 25, rtol=1e-6)
    own = np.array(PLACED)[:3, :3] @ axis
    np.testing.assert_allclose(found[:, :3, :3] @ axis, np.tile(own, (len(TIMES), 1)), atol=1e-9)
    assert np.ptp(found[:, :3, 3], axis=0).max() == 0


KEYS = [
    {"time": 0.5, "position": [0, 0, 0], "rotation_deg": [0, 0, 0]},
    {"time": 1.0, "position": [2, 0, 1], "rotation_deg": [0, 0, 120]},
    {"time": 1.5, "position": [2, 4, 0]},
]


def test_keyframes_go_straight_and_turn_evenly():
    found = poses({"kind": "keyframes", "keys": KEYS})
    way = found[:, :3, 3] - np.array(PLACED)[:3, 3]
    for i, name in enumerate("xyz"):
        expected = np.interp(TIMES, [0.5, 1, 1.5], [key["position"][i] for key in KEYS])
        np.testing.assert_allclose(way[:, i], expected, atol=1e-10, err_msg=name)
    turns = np.interp(TIMES, [0.5, 1], [0, 120])
    for turn, pose in zip(turns, found, strict=True):
        np.testing.assert_allclose(pose[:3, :3], np.array(standing(BOX, azimuth_deg=30 + turn))[:3, :3], atol=1e-9)


def test_keyframes_of_the_world():
    at = [{"time": 0, "position": [-1, 2, 3], "rotation_deg": [0, 0, 90]}]
    (pose,) = moved({"kind": "keyframes", "origin": "world", "keys": at}).poses
    np.testing.assert_allclose(np.array(pose), (*standing(BOX, -1, 2, 90)[:2], (0, 0, 1, 3.5), (0, 0, 0, 1)), atol=1e-9)


def test_rotations_of_keys_are_about_x_then_y_then_z_or_quaternions():
    def rotation(**key):
        keys = [{"time": 0, **key}]
        return poses({"kind": "keyframes", "origin": "world", "keys": keys}, times=[0.0])[0][:3, :3]

    x, y, z = (rotation(rotation_deg=angles) for angles in ([20, 0, 0], [0, -50, 0], [0, 0, 70]))
    np.testing.assert_allclose(rotation(rotation_deg=[20, -50, 70]), z @ y @ x, atol=1e-9)
    half = np.radians(35)
    np.testing.assert_allclose(rotation(quaternion=[2 * np.cos(half), 0, 0, 2 * np.sin(half)]), z, atol=1e-9)


def test_slerp_between_keys_has_a_constant_angular_speed_the_shorter_way_around():
    keys = [{"time": 0, "rotation_deg": [10, 20, -100]}, {"time": 2, "rotation_deg": [50, -70, 140]}]
    found = angles(poses({"kind": "keyframes", "keys": keys})[:, :3, :3])
    assert np.ptp(found) < 1e-5 and sum(found) < 180


def test_smooth_keyframes_begin_and_end_slowly():
    keys = [{"time": 0, "position": [0, 0, 0]}, {"time": 2, "position": [8, 0, 0]}]
    x = poses({"kind": "keyframes", "keys": keys, "ease": "smooth"})[:, 0, 3] - 3
    np.testing.assert_allclose(x, 8 * (3 * (TIMES / 2) ** 2 - 2 * (TIMES / 2) ** 3), atol=1e-9)


@pytest.mark.slow
@given(st.integers(0, 2**32 - 1), st.booleans())
@settings(max_examples=10, deadline=None)
def test_a_spline_passes_its_points_at_a_constant_speed(seed, closed):
    points = np.random.default_rng(seed).normal(size=(5, 3)) * 4
    one = {"kind": "spline", "points": points.tolist(), "speed": 5.0, "closed": closed}
    curve = motion.curve_through(points, closed, "points")

    def way(times):
        return poses(one, times=times)[:, :3, 3] - np.array(PLACED)[:3, 3]

    np.testing.assert_allclose(way(curve.knots / 5), [*points, points[0]] if closed else points, atol=1e-9)
    u = np.linspace(0, 1, 50_001)[:-1, None]
    dense = np.concatenate([c[0] + u * (c[1] + u * (c[2] + u * c[3])) for c in curve.cubics])
    gone = np.append(0, np.cumsum(np.linalg.norm(np.diff(dense, axis=0), axis=1)))  # along short chords, by brute force
    times = np.linspace(0, gone[-1] / 5, 100)
    there = np.stack([np.interp(5 * times, gone, dense[:, i]) for i in range(3)], axis=1)
    np.testing.assert_allclose(way(times), there, atol=1e-6)


def test_a_spline_of_the_world_and_its_heading():
    one = {"kind": "spline", "points": [[0, 0, 0], [8, 0, 6]], "speed": 5, "origin": "world"}
    for heading, front in (("level", [1, 0, 0]), ("along", [0.8, 0, 0.6])):
        found = poses({**one, "heading": heading})
        np.testing.assert_allclose(-found[:, :3, 1], np.tile(front, (len(TIMES), 1)), atol=1e-9)
        assert (found[:, 2, 2] > 0.7).all() and (np.abs(found[:, 2, 0]) < 1e-9).all()
    kept = poses(one)
    np.testing.assert_allclose(kept[:, :3, 3] - [0, 0, 0.5], np.outer(5 * TIMES, [0.8, 0, 0.6]), atol=1e-9)
    np.testing.assert_allclose(kept[:, :3, :3], np.tile(np.array(PLACED)[:3, :3], (len(TIMES), 1, 1)), atol=1e-10)


def test_straight_up_things_keep_their_azimuth():
    up = {"kind": "spline", "points": [[0, 0, 0], [0, 0, 3]], "speed": 1, "heading": "along"}
    np.testing.assert_allclose(poses(up)[:, :3, :3], np.tile(np.array(PLACED)[:3, :3], (len(TIMES), 1, 1)), atol=1e-10)


@pytest.mark.slow
def test_random_keeps_within_its_band_and_its_amplitudes():
    times = np.arange(5000) / 25
    one = {"kind": "random", "position": [2, 0.5, 0], "rotation_deg": [0, 0, 30], "highest_hz": 1.5}
    found = poses(one, times=times)
    way = found[:, :3, 3] - np.array(PLACED)[:3, 3]
    turn = np.degrees(np.arctan2(found[:, 1, 0], found[:, 0, 0])) - 30
    assert np.abs(way[:, 2]).max() == 0
    for values, amplitude in ((way[:, 0], 2), (way[:, 1], 0.5), (turn, 30)):
        assert 0.5 * amplitude < np.abs(values).max() <= amplitude
        power = np.abs(np.fft.rfft(values * np.hanning(len(values)))) ** 2
        frequencies = np.fft.rfftfreq(len(values), 1 / 25)
        assert power[frequencies > 1.52].sum() < 1e-6 * power.sum()
        assert power[(frequencies > 1.2) & (frequencies < 1.52)].sum() > 0.05 * power.sum()
    assert np.abs(np.corrcoef(np.stack([way[:, 0], way[:, 1], turn])) - np.eye(3)).max() < 0.25


def test_random_is_equal_for_equal_names_and_differs_for_others():
    one = {"kind": "random", "position": [1, 1, 1]}
    first = poses(one)
    assert (first == poses(one)).all()
    assert (first == poses({"kind": "constant"}, one)).all()
    for other in (poses(one, key="car_001"), poses(one, seed=1)):
        assert (other[:, :3, 3] != first[:, :3, 3]).all()
    twice = poses(one, one)[:, :3, 3] - np.array(PLACED)[:3, 3]
    assert np.abs(twice - 2 * (first[:, :3, 3] - np.array(PLACED)[:3, 3])).max() > 0.1


def test_oscillate_is_a_sine():
    one = {"kind": "oscillate", "position": [0, 2, 0], "rotation_deg": [0, 0, 20], "period": 0.8, "phase_deg": 90}
    found, share = poses(one), np.cos(2 * np.pi * TIMES / 0.8)
    np.testing.assert_allclose(found[:, :3, 3] - np.array(PLACED)[:3, 3], np.outer(share, [0, 2, 0]), atol=1e-9)
    turn = np.degrees(np.arctan2(found[:, 1, 0], found[:, 0, 0]))
    np.testing.assert_allclose(turn, 30 + 20 * share, atol=1e-7)


def test_a_path_of_points_of_the_world_with_heading_side_and_offset():
    one = {"kind": "path", "points": [[0, 0, 0], [0, 30, 0]], "speed": 6, "offset": 2, "side": 1.5}
    found = poses(one)
    y = 2 + 6 * TIMES
    np.testing.assert_allclose(found[:, :3, 3], np.stack([0 * y + 1.5, y, 0 * y + 0.5], axis=1), atol=1e-9)
    np.testing.assert_allclose(-found[:, :3, 1], np.tile([0, 1, 0], (len(TIMES), 1)), atol=1e-9)


def test_a_closed_path_comes_around_its_front_ahead():
    points = [[5, 0, 0], [0, 5, 0], [-5, 0, 0], [0, -5, 0]]
    length = motion.curve_through(points, True, "").length
    times = np.linspace(0, 2, 1001)
    found = poses({"kind": "path", "points": points, "speed": length, "closed": True}, times=times)
    np.testing.assert_allclose(found[:501], found[500:], atol=1e-6)
    step = np.diff(found[:501, :3, 3], axis=0)
    front = -(found[:500, :3, 1] + found[1:501, :3, 1]) / 2
    cosine = (step * front).sum(axis=1) / np.linalg.norm(step, axis=1) / np.linalg.norm(front, axis=1)
    assert cosine.min() > 0.9999


def test_a_path_waits_or_is_left_at_its_ends():
    one = {"kind": "path", "points": [[0, 0, 0], [0, 4, 0]], "speed": 4, "offset": -2}
    y = poses(one)[:, 1, 3]
    np.testing.assert_allclose(y, np.clip(4 * TIMES - 2, 0, 4), atol=1e-9)
    gone = moved({**one, "end": "leave"})
    assert [i for i in range(len(TIMES)) if gone.pose_at(i) is None] == [i for i, t in enumerate(TIMES) if not 0.5 <= t <= 1.5]


def test_lanes_are_followed_in_their_direction():
    for name, sign in (("there", 1), ("back", -1)):
        found = poses({"kind": "path", "lane": name, "speed": 4}, lanes=LANES)
        np.testing.assert_allclose(np.diff(found[:, 1, 3]), sign * 4 / 25, atol=1e-9)
        np.testing.assert_allclose(-found[:, 1, 1], sign, atol=1e-9)
    drawn = [poses({"kind": "path", "lane": "any", "speed": 4}, lanes=LANES, seed=i)[0, 0, 3] for i in range(12)]
    assert {0.0, -3.0} == set(drawn)


def test_the_lanes_of_the_neighbourhood_lie_on_its_road():
    place = neighbourhood()
    low_x, low_y, high_x, high_y = place.free
    assert [lane.name for lane in place.lanes] == ["right", "left"]
    for lane in place.lanes:
        for x, y, z in lane.points:
            assert low_x <= x - lane.width / 2 and x + lane.width / 2 <= high_x and low_y <= y <= high_y and z == 0


WALK = Timeline(1, 25, 24.0, True)


def frames(options, times, timeline=WALK):
    made = moved({"kind": "clip", **options}, times=times, timeline=timeline)
    steps = [made.step_at(i) for i in range(len(times))]
    assert made.poses == (PLACED,)
    assert all(step.seconds == timeline.seconds(step.frame) for step in steps)
    return [step.frame for step in steps]


def test_a_clips_frames_are_those_of_its_file():
    times = np.arange(5) / 24
    assert frames({}, times) == [1, 2, 3, 4, 5]
    assert frames({"speed": 2}, times) == [1, 3, 5, 7, 9]
    assert frames({"offset": 0.5}, times) == [13, 14, 15, 16, 17]
    assert frames({"speed": -1, "offset": 0.5}, times) == [13, 12, 11, 10, 9]
    assert frames({}, [0, 0.02, 0.0208, 0.0209, 0.04]) == [1, 1, 1, 2, 2]


def test_what_comes_after_a_clips_end():
    times = np.arange(0, 80) / 24
    up = list(range(1, 26))
    assert frames({"loop": "once"}, times) == up + [25] * 55
    assert frames({"loop": "loop"}, times) == (up[:-1] * 4)[:80]
    assert frames({"loop": "back_and_forth"}, times) == (up + up[-2:0:-1] + up + up[-2:0:-1])[:80]
    assert frames({"loop": "once", "speed": -1, "offset": 1}, times) == up[::-1] + [1] * 55
    assert frames({}, times, Timeline(7, 7, 24.0, True)) == [7] * 80


def test_a_path_and_a_clip():
    path = {"kind": "path", "points": [[0, 0, 0], [0, 30, 0]], "speed": 6}
    made = moved(path, {"kind": "clip", "loop": "once"}, timeline=WALK)
    assert made.poses == moved(path).poses
    assert [made.step_at(i).frame for i in (0, 25, 50)] == [1, 25, 25]


def test_a_list_moves_what_the_motions_before_moved():
    turn, drive = {"kind": "constant", "spin_deg": [0, 0, 90]}, {"kind": "constant", "velocity": [1, 0, 0]}
    roll = {"kind": "oscillate", "rotation_deg": [25, 0, 0]}
    both = poses(turn, drive, roll)
    np.testing.assert_allclose(both[:, :3, 3], poses(drive)[:, :3, 3], atol=1e-9)
    first, own = poses(turn)[:, :3, :3], np.array(PLACED)[:3, :3].T @ poses(roll)[:, :3, :3]
    np.testing.assert_allclose(both[:, :3, :3], first @ own, atol=1e-9)


def test_things_enter_and_leave():
    made = moved({"kind": "constant", "velocity": [1, 0, 0], "enter": 0.5, "leave": 1.5})
    there = [made.pose_at(i) is not None for i in range(len(TIMES))]
    assert there == [0.5 <= time < 1.5 for time in TIMES]
    assert made.pose_at(25) == moved({"kind": "constant", "velocity": [1, 0, 0]}).pose_at(25)
    two = moved({"kind": "constant", "enter": 0.5}, {"kind": "clip", "leave": 1.0}, timeline=WALK)
    assert [two.pose_at(i) is not None for i in range(len(TIMES))] == [0.5 <= time < 1.0 for time in TIMES]
    assert {step.frame for step in two.steps} == set(range(13, 25)) and None not in two.steps
    assert moved({"kind": "constant", "enter": 9}).poses == (None,)


def test_when_things_enter_may_be_drawn():
    one = {"kind": "constant", "enter": [0, 2]}
    firsts = {moved(one, key=f"car_{i:03}").poses.count(None) for i in range(20)}
    assert len(firsts) > 10
    assert moved(one) == moved(one)


def test_what_does_not_move_is_still():
    for still in ({"kind": "constant"}, {"kind": "oscillate"}, {"kind": "random"}):
        assert moved(still).poses == (PLACED,)
        assert moved(still).is_still


def test_options_are_drawn_for_each_name():
    one = {"kind": "constant", "velocity": {"uniform": [[-1, 0, 0], [1, 0, 0]]}}
    speeds = {poses(one, key=f"car_{i:03}", times=[0, 1.0])[1, 0, 3] - 3 for i in range(20)}
    assert len(speeds) == 20 and all(-1 <= speed <= 1 for speed in speeds)
    assert (poses(one) == poses({"kind": "clip"}, one, timeline=WALK)).all()


@pytest.mark.parametrize(
    "one",
    [
        {"kind": "constant", "velocity": [1, 2, 3], "spin_deg": [1, 2, 3]},
        {"kind": "keyframes", "keys": KEYS},
        {"kind": "spline", "points": [[0, 0, 0], [1, 2, 0], [4, 4, 1]], "speed": 2, "heading": "along"},
        {"kind": "path", "lane": "any", "speed": 2},
        {"kind": "random", "position": [1, 1, 1], "rotation_deg": [9, 9, 9]},
        {"kind": "oscillate", "position": [1, 1, 1], "rotation_deg": [9, 9, 9]},
        {"kind": "clip"},
    ],
    ids=lambda one: one["kind"],
)
def test_poses_do_not_depend_on_which_times_are_asked_for(one):
    there = {"lanes": LANES, "timeline": WALK}
    whole, single = moved(one, **there), [moved(one, times=[time], **there) for time in TIMES]
    assert [whole.pose_at(i) for i in range(len(TIMES))] == [one.pose_at(0) for one in single]
    assert [whole.step_at(i) for i in range(len(TIMES))] == [one.step_at(0) for one in single]


WHERE = "models[2].motion"
POINTS = [[0, 0, 0], [1, 0, 0]]


@pytest.mark.parametrize(
    ("one", "message"),
    [
        ({"kind": "splin"}, f"{WHERE}.kind: 'splin' is unknown; did you mean 'spline'? Valid: {', '.join(KINDS)}"),
        (
            {"kind": "constant", "speed": 3},
            f"{WHERE}.speed: 'speed' is unknown. Valid: velocity, spin_deg",
        ),
        ({"kind": "path", "points": POINTS[:1], "speed": 1}, f"{WHERE}.points: expected at least 2 of them; found 1"),
        ({"kind": "spline", "points": POINTS[:1], "speed": 1}, f"{WHERE}.points: expected at least 2 of them; found 1"),
        (
            {"kind": "spline", "points": POINTS, "speed": 1, "closed": True},
            f"{WHERE}.points: expected 3 points or more; found 2",
        ),
        (
            {"kind": "path", "points": [*POINTS, POINTS[1]], "speed": 1},
            f"{WHERE}.points: expected neighbours apart; found point 2 and the next at [1.0, 0.0, 0.0]",
        ),
        ({"kind": "path", "points": POINTS, "speed": 0}, f"{WHERE}.speed: expected a number greater than 0; found 0"),
        ({"kind": "spline", "points": POINTS, "speed": 0}, f"{WHERE}.speed: expected a number greater than 0; found 0"),
        ({"kind": "spline", "points": POINTS}, f"{WHERE}.speed: expected a value; found nothing"),
        (
            {"kind": "keyframes", "keys": [KEYS[0], {"time": 0.5, "position": [1, 0, 0]}]},
            f"{WHERE}.keys[1].time: expected a time after 0.5, the key's before; found 0.5",
        ),
        (
            {"kind": "keyframes", "keys": [*KEYS, {"time": 1.2, "position": [1, 0, 0]}]},
            f"{WHERE}.keys[3].time: expected a time after 1.5, the key's before; found 1.2",
        ),
        (
            {"kind": "keyframes", "keys": [{"time": 1}]},
            f"{WHERE}.keys[0]: expected position, and rotation_deg or quaternion, or one of them; found none",
        ),
        (
            {"kind": "keyframes", "keys": [{"time": 1, "quaternion": [0, 0, 0, 0]}]},
            f"{WHERE}.keys[0]: expected a quaternion that is not 0; found [0, 0, 0, 0]",
        ),
        ({"kind": "path", "speed": 1}, f"{WHERE}: expected one of lane, points; found none"),
        (
            {"kind": "path", "lane": "any", "speed": 1},
            f"{WHERE}.lane: expected a place with lanes, such as scene.place: zoo:neighbourhood or zoo:town; found none: "
            "set one, or list points",
        ),
        (
            {"kind": "path", "points": POINTS, "speed": 1, "offset": 2},
            f"{WHERE}.offset: expected at most 1 m, the length of the way; found 2",
        ),
        ({"kind": "clip"}, f"{WHERE}: expected a file in which something moves; found no animation in walk.fbx"),
        (
            {"kind": "random", "position": [-1, 0, 0]},
            f"{WHERE}.position[0]: expected a number greater than or equal to 0; found -1",
        ),
        ({"kind": "oscillate", "period": 0}, f"{WHERE}.period: expected a number greater than 0; found 0"),
    ],
)
def test_mistakes(one, message):
    assert mistake(one) == message
    in_list = message.replace(WHERE, f"{WHERE}[1]")
    assert mistake({"kind": "constant"}, one) == in_list


def test_mistakes_of_lanes_and_clips():
    lane = {"kind": "path", "lane": "their", "speed": 1}
    assert mistake(lane, lanes=LANES) == f"{WHERE}.lane: 'their' is unknown; did you mean 'there'? Valid: any, there, back"
    beyond = mistake({"kind": "clip", "offset": 1.5}, timeline=WALK)
    assert beyond == f"{WHERE}.offset: expected 0 to 1 s, the length of the animation in walk.fbx; found 1.5"
    assert mistake({"kind": "clip"}, timeline=Timeline(1, 1, 24.0, False)).startswith(f"{WHERE}: expected a file in which")


def test_a_plan_finds_mistakes_without_a_start():
    check_motion(entries({"kind": "path", "lane": "any", "speed": [2, 3]}, {"kind": "clip"}), "models[0].motion")
    with pytest.raises(
        RecipeError, match=r"^scene\.company\.motion\[1\]\.spedd: 'spedd' is unknown; did you mean 'speed'\? Valid: .*$"
    ):
        check_motion(entries({"kind": "clip"}, {"kind": "clip", "spedd": 3}), "scene.company.motion")


(FALL,) = (
    block
    for block in re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "extending.md").read_text("utf-8"), re.DOTALL)
    if "def moves(" in block
)


@pytest.fixture(params=["entry point", "file beside the others"])
def bounce(request, tmp_path, monkeypatch):
    """The motion in the docs, in a package of somebody's or beside ours."""
    if request.param == "entry point":
        with installed(tmp_path, "motions", "bounce", FALL):
            yield
        return
    monkeypatch.setattr(motion, "__path__", [*motion.__path__, str(tmp_path)])
    (tmp_path / "bounce.py").write_text(FALL)
    yield
    sys.modules.pop(f"{motion.__name__}.bounce", None)
    motion.__dict__.pop("bounce", None)


@pytest.mark.usefixtures("bounce")
def test_the_motion_in_the_docs_is_one_file():
    assert plugins.names("motions").count("bounce") == 1
    times = np.arange(0, 800) / 100
    found = poses({"kind": "bounce", "height": 2, "keeps": 0.5}, {"kind": "constant", "velocity": [1, 0, 0]}, times=times)
    np.testing.assert_allclose(found[:, 0, 3], 3 + times, atol=1e-9)
    height = found[:, 2, 3] - 0.5
    lands = np.sqrt(2 * 2 / 9.81)
    falling = times < lands
    np.testing.assert_allclose(height[falling], 2 - 9.81 / 2 * times[falling] ** 2, atol=1e-9)
    assert height[times > lands].max() == pytest.approx(0.5, abs=1e-3)  # half the speed: a quarter of the height
    assert height.min() >= -1e-9 and height[-1] == 0
    assert mistake({"kind": "bounce"}) == f"{WHERE}.height: expected a value; found nothing"
    drawn = {poses({"kind": "bounce", "height": [1, 2]}, key=f"car_{i:03}", times=[0.0])[0, 2, 3] for i in range(9)}
    assert len(drawn) == 9


def recipe(*models, **fields):
    return Recipe(models=models, viewpoints={"distance": 5}, **fields)


def test_a_motion_of_null_is_none():
    rest = {"scene": {"company": 1, "place": "zoo:neighbourhood"}, "splits": {"by": "frame"}}
    plain = recipe({"source": "zoo:car", "count": 3}, **rest)
    assert "motion" not in plain.to_yaml()
    again = {"source": "zoo:car", "count": 3, "motion": None}
    assert recipe(again, **rest).digest == plain.digest
    assert recipe({**again, "motion": {"kind": "random"}}).digest != recipe(again).digest


def test_a_recipe_says_motions():
    made = recipe(
        {
            "source": "zoo:car",
            "motion": [{"kind": "path", "lane": "any", "speed": [2, 3]}, {"kind": "random", "enter": [1, 2]}],
        },
        scene={"company": {"count": 1, "motion": {"kind": "constant", "velocity": [1, 0, 0]}}},
    )
    assert [entry.kind for entry in made.models[0].motion] == ["path", "random"]
    assert made.scene.company.motion.options == {"velocity": [1, 0, 0]}
    assert Recipe.model_validate(made.model_dump(mode="json")).digest == made.digest


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"motion": "spin"}, r"^models\[0\]\.motion: expected \{kind: \.\.\.\} or a list of these; found 'spin'$"),
        ({"motion": [{}]}, r"^models\[0\]\.motion\[0\]\.kind: expected a value; found nothing$"),
        ({"motion": {"kind": "random", "enter": 3, "leave": 2}}, r"^models\[0\]\.motion: expected leave after enter; found"),
    ],
)
def test_mistakes_of_recipes(fields, message):
    with pytest.raises(RecipeError, match=message):
        recipe({"source": "zoo:car", **fields})


@pytest.mark.parametrize("own", [True, False])
def test_the_motion_clip_takes_a_clips_name(own):
    walker = {"source": "walk.fbx", "category": "person", "clip": "Walk"}
    plays = {"motion": {"kind": "clip"}}
    made = recipe(
        {**walker, **(plays if own else {})}, time={"frames": 2}, scene={} if own else {"company": {"count": 1, **plays}}
    )
    check_motions(made)
    with pytest.raises(RecipeError, match=r"models\[0\]\.clip: expected frames, or a motion of kind clip of the model or of"):
        check_motions(recipe({**walker, "motion": {"kind": "random"}}, time={"frames": 2}))


BLOCKS = re.findall(r"```yaml\n(.*?)```", (ROOT / "docs" / "motion.md").read_text("utf-8"), re.DOTALL)


@pytest.mark.parametrize("block", BLOCKS)
def test_every_block_of_the_page_is_a_recipe_with_motions(block, tmp_path):
    (tmp_path / "recipe.yaml").write_text(block)
    fields, _ = read(tmp_path / "recipe.yaml")
    made = Recipe(**{"viewpoints": {"distance": 5}, "time": {"frames": 2}, **fields})
    check_motions(made)
    assert has_motion(made)


def has_motion(made):
    place = made.scene.place
    return any(entry.motion for entry in made.models) or bool(place and place.motion)
