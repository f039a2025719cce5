"""Motions of the rig against closed forms, and their mistakes."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewsphere.composing.trajectories import World, instant, is_still, shaken, standing, trajectory
from viewsphere.composing.trajectories.file import FileTrajectory
from viewsphere.composing.viewpoints.camera import looking
from viewsphere.composing.viewpoints.pose_files import PoseFile
from viewsphere.composing.viewpoints.pose_files.motions import motion
from viewsphere.errors import RecipeError
from viewsphere.geometry.camera import orbit_center, orbit_rotation
from viewsphere.geometry.rotation import matrix_from_quaternion
from viewsphere.model.instant import Viewpoint, viewpoint_of
from viewsphere.model.place import Lane
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.sensors.rig import Rig, Sensor
from viewsphere.model.shot import Shot
from viewsphere.planning.plan import plan
from viewsphere.recipe.recipe import Recipe

FPS = 25.0
TIMES = np.arange(50) / FPS
TARGET = (0.2, -0.3, 0.5)
RING = tuple((round(10 * math.cos(k * math.pi / 8), 9), round(10 * math.sin(k * math.pi / 8), 9), 0.0) for k in range(16))
LANES = Lane("out", ((0.0, 0.0, 0.0), (50.0, 0.0, 0.0)), 3.0), Lane("ring", RING, 3.0, closed=True)


def passing(thing, instant):
    """A thing that goes along +X by a metre a second; there are two, and the second is called car."""
    if thing not in (1, 2, "car"):
        raise RecipeError(f"viewpoints.look: expected 1 or 2; found {thing}")
    return np.array([TIMES[instant], 0.0 if thing == 1 else 5.0, 0.5])


def world(seed=3, **more) -> World:
    known = {"center": passing, "lanes": LANES, **more}
    return World(FPS, TARGET, rng=lambda name: np.random.default_rng([seed, len(name)]), **known)


def made(**viewpoints):
    return Recipe(models=[{"source": "zoo:car"}], viewpoints=viewpoints).viewpoints


def poses(at=TIMES, around=None, folder=Path(), **viewpoints):
    return trajectory(made(**viewpoints), folder).poses(at, around or world())


def centers(found):
    return np.array([pose.world_from_rig[:3, 3] for pose in found])


def axes(found):
    """Rows: the camera's axes in the world, (T, 3, 3)."""
    return np.array([pose.world_from_rig[:3, :3].T for pose in found])


KINDS = {
    "orbit": {"kind": "orbit", "distance": [4, 6], "elevation": [10, 80], "look": 1},
    "spline": {"kind": "spline", "points": [[0, -5, 1], [4, -3, 2], [6, 2, 1.5], [2, 6, 1]]},
    "ring": {"kind": "spline", "points": [[0, -5, 1], [4, -3, 2], [6, 2, 1.5]], "closed": True, "speed": 9.0, "look": "car"},
    "drive": {"kind": "drive", "lane": "ring", "speed": 20.0, "side": 1.5},
    "walk": {"kind": "walk", "start": [0, -6], "turns": [{"at": 0.4, "degrees": 40}, {"at": 1.6, "degrees": -15}]},
    "way": {"kind": "walk", "points": [[0, -6], [1, -3], [4, -1]], "look": [0, 0, 1]},
    "mast": {"kind": "mast", "position": [3, -4, 5], "look": 2, "shake": {"degrees": 0.2, "mm": 5}},
    "overhead": {"kind": "mast", "overhead": 12, "look": 1, "heading": 30},
}


@pytest.mark.parametrize("name", KINDS)
def test_poses_are_rigid_and_the_focus_is_ahead(name):
    found = poses(**KINDS[name])
    assert len(found) == len(TIMES)
    turned = axes(found)
    np.testing.assert_allclose(turned @ turned.transpose(0, 2, 1), np.broadcast_to(np.eye(3), turned.shape), atol=5e-12)
    assert (np.linalg.det(turned) > 0).all()
    toward = np.array([pose.focus for pose in found]) - centers(found)
    ahead = np.einsum("ti,ti->t", toward, turned[:, 2]) / np.linalg.norm(toward, axis=1)
    assert ahead.min() > math.cos(math.radians(0.4))  # the shaken one too


LASTING = ("orbit", "spline")
"""These last as long as the sequence."""


@pytest.mark.parametrize("name", [name for name in KINDS if name not in LASTING])
def test_every_pose_follows_from_its_time_alone(name):
    whole = poses(**KINDS[name])
    shifted = world(center=lambda thing, i: passing(thing, i + 20))
    rest = poses(TIMES[20:], shifted, **KINDS[name])
    assert all(np.array_equal(a.world_from_rig, b.world_from_rig) for a, b in zip(whole[20:], rest, strict=True))


def test_an_orbit_is_the_paper_s_circle():
    found = poses(kind="orbit", distance=4, elevation=25, azimuth=10, turns=2)
    for i, pose in enumerate(found):
        a, e = math.radians(10 + 720 * i / len(TIMES)), math.radians(25)
        np.testing.assert_allclose(pose.world_from_rig[:3, 3], np.array(TARGET) + orbit_center(a, e, 4), atol=1e-11)
        np.testing.assert_allclose(pose.world_from_rig[:3, :3].T, orbit_rotation(a, e), atol=1e-11)
        assert pose.focus == TARGET
    whole = np.linalg.norm(np.diff(np.vstack([centers(found), centers(found)[:1]]), axis=0), axis=1)
    assert np.ptp(whole) < 1e-9  # the step from the last instant to the first is a step like the others


def test_an_orbit_goes_from_and_to_exactly():
    found = poses(kind="orbit", distance=[4, 2], elevation=[0, 90], azimuth=[30, -60], tilt=[0, 5])
    for pose, (a, e, d, t) in ((found[0], (30, 0, 4, 0)), (found[-1], (-60, 90, 2, 5))):
        expected = looking(viewpoint(a, e, d, t), TARGET, index=0).world_from_rig
        np.testing.assert_allclose(pose.world_from_rig, expected, atol=1e-11)
    by_speed = poses(kind="orbit", distance=3, speed_deg=-20)
    assert math.isclose(seen(by_speed[25]).azimuth_deg, 340.0, abs_tol=1e-7)


def viewpoint(azimuth, elevation, distance, tilt):
    return Viewpoint(index=0, azimuth_deg=azimuth, elevation_deg=elevation, distance=distance, tilt_deg=tilt)


def seen(pose):
    return viewpoint_of(pose.world_from_rig, pose.focus, 0)


def test_an_orbit_follows_what_it_goes_around():
    found = poses(kind="orbit", distance=4, look=1)
    still = poses(kind="orbit", distance=4, look=1, follow=False)
    moved = centers(found) - centers(still)
    np.testing.assert_allclose(moved, np.stack([TIMES, 0 * TIMES, 0 * TIMES], axis=1), atol=1e-11)


def test_a_spline_passes_its_points_at_its_times_and_speed():
    points = np.array([[0.0, 0, 1], [3, 0, 1], [3, 4, 2], [0, 4, 2]])
    timed = poses(np.array([0.0, 0.5, 1.5, 1.6]), kind="spline", points=points, times=[0, 0.5, 1.5, 1.6])
    np.testing.assert_allclose(centers(timed), points, atol=1e-9)
    even = centers(poses(kind="spline", points=points))
    np.testing.assert_allclose(even[[0, -1]], points[[0, -1]], atol=1e-9)
    straight = poses(kind="spline", points=[[0, 0, 1], [10, 0, 1]], speed=2.0)
    np.testing.assert_allclose(centers(straight)[:, 0], 2 * TIMES, atol=1e-9)
    np.testing.assert_allclose(axes(straight)[:, 2], np.tile([1.0, 0, 0], (len(TIMES), 1)), atol=1e-11)
    np.testing.assert_allclose(axes(straight)[:, 1], np.tile([0.0, 0, -1], (len(TIMES), 1)), atol=1e-11)
    done = centers(poses(kind="spline", points=[[0, 0, 1], [1, 0, 1]], speed=2.0))
    np.testing.assert_allclose(done[13:], np.tile([1.0, 0, 1], (len(TIMES) - 13, 1)), atol=1e-12)


def test_what_looks_at_a_thing_has_it_in_the_middle_of_its_level_picture():
    for pose, seconds in zip(poses(kind="mast", position=[3, -4, 5], look="car"), TIMES, strict=True):
        in_camera = pose.world_from_rig[:3, :3].T @ (np.array([seconds, 5.0, 0.5]) - pose.world_from_rig[:3, 3])
        assert np.abs(in_camera[:2]).max() < 1e-10 and in_camera[2] > 0
        assert abs(pose.world_from_rig[2, 0]) < 1e-12 and pose.world_from_rig[2, 1] < 0  # level, and not upside down
    held = poses(kind="mast", position=[3, -4, 5], look=1, follow=False)
    assert all(np.array_equal(pose.world_from_rig, held[0].world_from_rig) for pose in held)


def test_a_camera_overhead_looks_straight_down():
    for pose, seconds in zip(poses(kind="mast", overhead=12, look=1, heading=90), TIMES, strict=True):
        np.testing.assert_array_equal(pose.world_from_rig[:3, 3], np.round([seconds, 0.0, 12.5], 12))
        np.testing.assert_array_equal(pose.world_from_rig[:3, :3].T, [[0, 1, 0], [1, 0, 0], [0, 0, -1]])


def test_a_drive_is_on_its_lane():
    straight = centers(poses(kind="drive", speed=10, height=1.2, offset=3, side=2))
    np.testing.assert_allclose(straight, np.stack([3 + 10 * TIMES, -2 + 0 * TIMES, 1.2 + 0 * TIMES], axis=1), atol=1e-9)
    ring = poses(np.arange(400) / FPS, kind="drive", lane="ring", speed=10)
    radius = np.hypot(*centers(ring)[:, :2].T)
    assert radius.min() > 9 and radius.max() < 10.01 and np.ptp(centers(ring)[:, 0]) > 19.5  # around, and around again
    steps = np.diff(centers(ring), axis=0)
    heading = np.einsum("ti,ti->t", steps / np.linalg.norm(steps, axis=1)[:, None], axes(ring)[:-1, 2])
    assert heading.min() > 0.999


def test_a_walk_is_made_of_lines_and_arcs():
    found = poses(np.linspace(0, 6, 601), kind="walk", start=[1, -6], heading=90, speed=1.5, bob=0.0,
                  turns=[{"at": 2, "degrees": 90}])  # fmt: skip
    steps = np.linalg.norm(np.diff(centers(found), axis=0), axis=1)
    np.testing.assert_allclose(steps, 0.015, atol=2e-6)
    np.testing.assert_allclose(centers(found)[200], [-2, -6, 1.6], atol=1e-10)  # 3 m along -X
    radius = 1.5 / math.radians(45)
    np.testing.assert_allclose(centers(found)[400], [-2 - radius, -6 - radius, 1.6], atol=1e-10)  # left of -X is -Y
    np.testing.assert_allclose(centers(found)[600], [-2 - radius, -9 - radius, 1.6], atol=1e-10)
    np.testing.assert_allclose(axes(found)[600, 2], [0, -1, 0], atol=1e-11)


def test_eyes_bob_twice_a_stride():
    found = centers(poses(np.arange(1000) / 1000, kind="walk", start=[0, 0], speed=1.5, stride=1.5, bob=0.03))
    expected = 1.6 + 0.03 * np.sin(4 * np.pi * np.arange(1000) / 1000)
    np.testing.assert_allclose(found[:, 2], expected, atol=1e-11)
    assert abs(np.ptp(found[:, 0]) - 0.03) < 1e-4


def shifts(steady, moved):
    """Metres, and degrees, from one pose to the other, in the first one's axes."""
    by = [np.linalg.inv(a.world_from_rig) @ b.world_from_rig for a, b in zip(steady, moved, strict=True)]
    turned = [math.degrees(math.acos(min((np.trace(m[:3, :3]) - 1) / 2, 1.0))) for m in by]
    return np.array([m[:3, 3] for m in by]), np.array(turned)


@pytest.mark.slow
def test_shake_is_bounded_smooth_and_seeded():
    times = np.arange(2000) / 200
    entry = {"kind": "mast", "position": [3, -4, 5]}
    steady, moved = poses(times, **entry), poses(times, **entry, shake={"degrees": 0.2, "mm": 5, "hertz": 3})
    metres, degrees = shifts(steady, moved)
    assert 0.001 < np.abs(metres).max() <= 0.005 + 1e-9
    assert 0.05 < degrees.max() <= 0.2 * math.sqrt(3) + 1e-6
    power = np.abs(np.fft.rfft(metres[:, 0] * np.hanning(len(times)))) ** 2
    assert power[np.fft.rfftfreq(len(times), 1 / 200) > 3.4].sum() < 1e-4 * power.sum()
    again = poses(times, **entry, shake={"degrees": 0.2, "mm": 5, "hertz": 3})
    other = poses(times, world(seed=4), **entry, shake={"degrees": 0.2, "mm": 5, "hertz": 3})
    assert all(np.array_equal(a.world_from_rig, b.world_from_rig) for a, b in zip(moved, again, strict=True))
    assert not np.array_equal(moved[7].world_from_rig, other[7].world_from_rig)


def test_what_stands_still_can_be_shaken():
    entry = made(distance=4, shake={"mm": 5})
    assert is_still(entry) and not is_still(made(kind="orbit", distance=4))
    pose = standing(viewpoint(30, 20, 4, 0), TARGET)
    np.testing.assert_array_equal(pose.world_from_rig, looking(viewpoint(30, 20, 4, 0), TARGET, index=0).world_from_rig)
    found = shaken([pose] * len(TIMES), entry.shake, TIMES, world())
    assert 0 < max(np.abs(centers(found) - pose.world_from_rig[:3, 3]).max(axis=1)) < 0.01
    with pytest.raises(ValueError, match="expected viewpoints that move, got grid"):
        trajectory(entry, Path())


def tum(folder, stamps, places, quaternions):
    lines = (" ".join(map(repr, map(float, (t, *p, *q)))) for t, p, q in zip(stamps, places, quaternions, strict=True))
    (folder / "path.tum").write_text("# time x y z qx qy qz qw\n" + "\n".join(lines) + "\n")


def test_a_file_is_passed_at_its_stamps(tmp_path):
    """Between two stamps of a quarter turn lies an eighth of a turn, and the middle of the way."""
    half = math.sqrt(0.5)
    tum(
        tmp_path,
        [100.0, 101.0, 103.0],
        [(0, -5, 1), (1, -5, 1), (1, -9, 2)],
        [(0, 0, 0, 1), (half, 0, 0, half), (half, 0, 0, half)],
    )
    found = poses(np.array([0.0, 0.5, 1.0, 1.5, 3.0]), folder=tmp_path, kind="file", path="path.tum")
    np.testing.assert_allclose(centers(found), [(0, -5, 1), (0.5, -5, 1), (1, -5, 1), (1, -6, 1.25), (1, -9, 2)], atol=1e-11)
    eighth = matrix_from_quaternion((math.cos(math.pi / 8), math.sin(math.pi / 8), 0, 0))
    np.testing.assert_allclose(found[1].world_from_rig[:3, :3], eighth, atol=1e-11)
    for stamps, expected in (
        ([0, 1, 1], "times that ascend; found 1"),
        ([0, 2, 1], "found 1.0"),
        ([0, 0.5, 0.9], "poses for 3 s"),
    ):
        tum(tmp_path, stamps, [(0, -5, 1)] * 3, [(0, 0, 0, 1)] * 3)
        with pytest.raises(RecipeError, match=expected):
            poses(np.array([0.0, 3.0]), folder=tmp_path, kind="file", path="path.tum")


def test_other_files_have_a_pose_a_frame(tmp_path):
    frames = []
    for i in range(3):
        matrix = np.eye(4)
        matrix[:3, 3] = i, -4, 1
        frames.append({"transform_matrix": matrix.tolist()})
    (tmp_path / "transforms.json").write_text(json.dumps({"frames": frames}))
    found = poses(np.array([0.0, 0.04, 0.06, 0.08]), folder=tmp_path, kind="file", path="transforms.json")
    np.testing.assert_allclose(centers(found)[:, 0], [0, 1, 1.5, 2], atol=1e-11)
    (tmp_path / "views.csv").write_text("azimuth,elevation,distance\n350,10,4\n10,20,4\n")
    orbits = poses(np.array([0.0, 0.02, 0.04]), folder=tmp_path, kind="file", path="views.csv", target="follow")
    assert [round(seen(pose).azimuth_deg, 6) % 360 for pose in orbits] == [350, 0, 10]  # the shorter way, over 0
    np.testing.assert_allclose(orbits[2].focus, passing(1, 2), atol=1e-12)


def zooming(fx):
    eye = np.eye(3)
    entries = tuple(motion(eye, np.array([0.0, 0.0, float(i)]), "here") for i in range(len(fx)))
    lenses = tuple(Intrinsics(width=64, height=48, fx=f, fy=f, cx=32, cy=24) for f in fx)
    return FileTrajectory(made(kind="file", path="x.glb"), PoseFile(entries, lenses=lenses))


def test_a_camera_that_zooms_has_a_lens_each_instant():
    found = zooming([50.0, 100.0]).poses(np.array([0.0, 0.01, 0.04]), world())
    assert [pose.intrinsics.fx for pose in found] == [50.0, 62.5, 100.0]
    lens = Intrinsics(width=64, height=48, fx=50, fy=50, cx=32, cy=24)
    other = lens.model_copy(update={"width": 32})
    rig = Rig(
        sensors=(Sensor(name="a", intrinsics=lens), Sensor(name="b", intrinsics=lens), Sensor(name="c", intrinsics=other))
    )
    instants = tuple(instant(pose, i, 0.0, 0, 45.0, split="train") for i, pose in enumerate(found))
    shot = Shot(key="zoom", things=(), rig=rig, instants=instants, scene={}, channels=("depth",))
    assert [shot.camera(1, sensor).intrinsics.fx for sensor in range(3)] == [62.5, 62.5, 50.0]
    back = Shot.model_validate_json(shot.model_dump_json())
    assert back == shot and back.camera(2).K[0, 0] == 100.0
    with pytest.raises(ValueError, match="expected pictures of 64 x 48"):
        bigger = instants[0].model_copy(update={"intrinsics": lens.model_copy(update={"height": 49})})
        Shot.model_validate(shot.model_dump() | {"instants": [bigger.model_dump()]})


@given(st.tuples(*[st.floats(-50, 50)] * 3), st.tuples(*[st.floats(-50, 50)] * 3).filter(lambda p: math.hypot(*p) > 0.01))
def test_the_viewpoint_says_where_the_camera_is(place, off):
    """`sample.pose` leads back to the camera, for any place and anything looked at."""
    pose = poses(np.array([0.0]), kind="mast", position=place, look=[a + b for a, b in zip(place, off, strict=True)])[0]
    now = instant(pose, 3, 1.5, 7, 45.0)
    assert (now.index, now.seconds, now.viewpoint.index) == (3, 1.5, 7)
    again = np.array(looking(now.viewpoint, (0, 0, 0), index=0).world_from_rig)
    assert np.abs(again - pose.world_from_rig).max() < 1e-6


MISTAKES = [
    ({"kind": "spline", "points": [[0, 0, 1]]}, "viewpoints.points: expected at least 2"),
    ({"kind": "spline", "points": [[0, 0, 1], [0, 0, 1]]}, "points that differ from the one before"),
    ({"kind": "spline", "points": [[0, 0, 1], [1, 0, 1]], "times": [1, 1]}, "times that ascend; found 1 after 1"),
    ({"kind": "spline", "points": [[0, 0, 1], [1, 0, 1]], "times": [1, 0.5]}, "times that ascend; found 0.5 after 1"),
    ({"kind": "spline", "points": [[0, 0, 1], [1, 0, 1]], "times": [0, 1, 2]}, "a time for each of 2 points; found 3"),
    ({"kind": "spline", "points": [[0, 0, 1], [1, 0, 1]], "speed": 0}, "viewpoints.speed: expected a number greater than 0"),
    ({"kind": "spline", "points": [[0, 0, 1], [1, 0, 1]], "closed": True}, "three points or more"),
    ({"kind": "drive", "speed": 0}, "viewpoints.speed: expected a number greater than 0"),
    ({"kind": "mast", "position": [1, 2, 3], "look": [1, 2, 3]}, "look away from position"),
    ({"kind": "mast", "position": [1, 2, 3], "overhead": 4}, "position or overhead; found both"),
    ({"kind": "mast", "position": [1, 2, 3], "look": "ahead"}, "found look: ahead"),
    ({"kind": "orbit", "distance": 3, "look": "ahead"}, "viewpoints.look: expected what to go around"),
    ({"kind": "orbit", "distance": [3, 0]}, "distances above 0 m; found 0"),
    ({"kind": "orbit", "distance": 3, "turns": 1, "speed_deg": 4}, "found turns and speed_deg"),
    ({"kind": "walk"}, "start or points; found neither"),
    ({"kind": "walk", "start": [0, 0], "turns": [{"at": 0, "degrees": 90}, {"at": 1, "degrees": 9}]}, "one after another"),
    ({"kind": "mast", "position": [1, 2, 3], "shake": {"degree": 1}}, "did you mean 'degrees'"),
]


@pytest.mark.parametrize(("entry", "expected"), MISTAKES)
def test_mistakes_of_entries_are_one_line(entry, expected):
    with pytest.raises(RecipeError, match=expected) as caught:
        made(**entry)
    assert str(caught.value).startswith("viewpoints") and "\n" not in str(caught.value)


LATER = [
    ({"kind": "mast", "position": list(TARGET)}, {}, "viewpoints.look: expected another place than the camera's own"),
    ({"kind": "drive"}, {"lanes": ()}, "expected a place with lanes"),
    ({"kind": "drive", "lane": "owt"}, {}, "viewpoints.lane: .*did you mean 'out'"),
    ({"kind": "drive", "offset": 60}, {}, "viewpoints.offset: expected less than 50 m"),
    ({"kind": "orbit", "distance": 3, "look": 9}, {}, "expected 1 or 2; found 9"),
]


@pytest.mark.parametrize(("entry", "there", "expected"), LATER)
def test_mistakes_that_only_the_world_shows(entry, there, expected):
    with pytest.raises(RecipeError, match=expected):
        poses(around=world(**there), **entry)


@pytest.mark.parametrize("kind", [{"kind": "orbit", "distance": 3}, {"kind": "mast", "overhead": 3}, {"kind": "drive"}])
def test_without_time_they_are_refused(kind):
    recipe = Recipe(models=[{"source": "zoo:car"}], viewpoints=kind)
    with pytest.raises(RecipeError, match=r"viewpoints\.kind: expected grid, .* which needs time"):
        plan(recipe)


def test_still_pictures_are_not_shaken():
    with pytest.raises(RecipeError, match=r"^viewpoints\.shake: expected time beside it"):
        plan(Recipe(models=[{"source": "zoo:car"}], viewpoints={"distance": 4, "shake": {"mm": 1}}))


def test_shake_counts_in_the_digest():
    old = Recipe(models=[{"source": "zoo:chair"}], viewpoints={"distance": 4})
    shaky = Recipe(models=[{"source": "zoo:chair"}], viewpoints={"distance": 4, "shake": {"mm": 1}})
    assert shaky.digest != old.digest and Recipe(**shaky.model_dump(mode="json")).digest == shaky.digest
