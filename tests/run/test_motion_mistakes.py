"""Recipes of motion that cannot be: the command says in one line where and what, before a picture is rendered."""

import pytest
import yaml

from command_line import viewsphere

BASE = {
    "models": [{"source": "zoo:post_box"}],
    "viewpoints": {"distance": 4, "azimuth": 30, "elevation": 15},
    "time": {"frames": 5, "fps": 5},
    "camera": {"size": [64, 48], "fov_deg": 40},
    "channels": ["depth"],
    "splits": {"by": "sequence", "train": 1.0},
    "formats": ["native"],
}
STILL = {"time": None, "splits": {"by": "model", "train": 1.0}}


def moving(**motion):
    return {"models": [{"source": "zoo:post_box", "motion": motion}]}


def keys(*times):
    return moving(kind="keyframes", keys=[{"time": t, "position": [t, 0, 0]} for t in times])


WAY = [[0, 0, 0], [1, 0, 0]]
AROUND = {"kind": "orbit", "distance": 4}
MISTAKES = {
    "a path of one point": (moving(kind="path", points=WAY[:1], speed=1), "models[0].motion.points: expected at least 2"),
    "a spline of one point": (moving(kind="spline", points=WAY[:1], speed=1), "models[0].motion.points: expected at least 2"),
    "a rig's path of one point": ({"viewpoints": {"kind": "spline", "points": [[0, -4, 1]]}}, "viewpoints.points: expected"),
    "a time again": (keys(0, 1, 1), "models[0].motion.keys[2].time: expected"),
    "a time that goes back": (keys(0, 2, 1), "models[0].motion.keys[2].time: expected"),
    "a rig's times again": (
        {"viewpoints": {"kind": "spline", "points": [[0, -4, 1], [1, -4, 1]], "times": [1, 1]}},
        "viewpoints: expected times that ascend",
    ),
    "no speed": (moving(kind="path", points=WAY, speed=0), "models[0].motion.speed: expected a number greater than 0"),
    "a rig's speed": (
        {"viewpoints": {"kind": "spline", "points": [[0, -4, 1], [1, -4, 1]], "speed": 0}},
        "viewpoints.speed: expected a number greater than 0",
    ),
    "no baseline": ({"rig": {"kind": "stereo", "baseline": 0}}, "rig.baseline: expected a number greater than 0"),
    "a rig in a thing": (
        {"rig": {"sensors": {"a": {}, "b": {"position": [0, 0, 4]}}}},
        "rig: expected all sensors outside of the models; found b",
    ),
    "a way into a thing": (
        {"viewpoints": {"kind": "spline", "points": [[0, -4, 0.5], [0, 0, 0.5], [0, 4, 0.5]], "look": [9, 0, 0.5]}},
        "viewpoints: expected the camera outside",
    ),
    "its own place": (
        {"viewpoints": {"kind": "mast", "position": [0, -4, 1], "look": [0, -4, 1]}},
        "viewpoints: expected look away from position",
    ),
    "its own place on its way": (
        {"viewpoints": {"kind": "spline", "points": [[0, -4, 1], [4, -4, 1]], "look": [0, -4, 1]}},
        "viewpoints.look: expected another place than the camera's own",
    ),
    "no frames a second": ({"time": {"frames": 5, "fps": 0}}, "time.fps: expected a number greater than 0"),
    "points drawn": (
        {"tracks": {"count": 10**8}},
        "tracks: expected at most 2,000,000 points in a sequence; found 100,000,000",
    ),
    "points at each instant": (
        {"tracks": {"count": 10**7, "at": "each"}},
        "tracks: expected at most 2,000,000 points in a sequence; found 50,000,000",
    ),
    "points at an instant that is not there": ({"tracks": {"grid": 8, "at": [5]}}, "tracks.at: expected instants of 0 to 4"),
    "points outside": ({"tracks": {"points": "outside.csv"}}, "tracks.points: expected positions inside the picture of camera"),
    "points too late": ({"tracks": {"points": "late.csv"}}, "tracks.points: expected instants of 0 to 4"),
    "points without time": (STILL | {"tracks": {"grid": 8}}, "tracks: expected time beside tracks"),
    "flow of still pictures": (STILL | {"channels": ["flow"]}, "channels[0]: expected time beside flow"),
    "its states, too": (STILL | {"channels": ["depth", "flow_state"]}, "channels[1]: expected time beside flow_state"),
    "disparity of one camera": ({"channels": ["disparity"]}, "channels[0]: expected rig beside disparity"),
    "disparity of sensors that are not rectified": (
        {"channels": ["disparity"], "rig": {"sensors": {"a": {}, "b": {"position": [0.1, 0, 0], "rotation": [0, 3, 0]}}}},
        "channels: expected a rig with two rectified sensors",
    ),
    "a trajectory beyond its end": (
        {"viewpoints": {"kind": "file", "path": "short.tum"}, "time": {"seconds": 3, "fps": 5}},
        "viewpoints.path: expected poses for 2.8 s; found",
    ),
    "motion of a still picture": (STILL | moving(kind="constant"), "models[0].motion: expected time beside motions"),
    "a rig's motion in a still picture": (STILL | {"viewpoints": AROUND}, "viewpoints.kind: expected grid"),
}


@pytest.fixture
def files(tmp_path):
    (tmp_path / "outside.csv").write_text("instant,x,y\n0,10,10\n1,64,3\n")
    (tmp_path / "late.csv").write_text("0,10,10\n5,4,3\n")
    (tmp_path / "short.tum").write_text("".join(f"{t} {t} -4 1 -0.7071 0 0 0.7071\n" for t in range(2)))
    return tmp_path


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_is_one_line(name, files):
    changes, expected = MISTAKES[name]
    (files / "recipe.yaml").write_text(yaml.safe_dump(BASE | changes))
    answer = viewsphere("render", "recipe.yaml", "-o", "out", "--workers", "0", cwd=files)
    lines = [line for line in answer.stderr.splitlines() if line.strip()]
    assert answer.returncode == 2 and len(lines) == 1, answer.stderr
    assert expected in lines[0] and "found" in lines[0]
    assert not list(files.glob("out/store/shots/*/*"))


def test_two_sensors_of_one_name_are_one_line(files):
    text = yaml.safe_dump(BASE) + "rig:\n  sensors:\n    left: {}\n    left: {position: [0.1, 0, 0]}\n"
    (files / "recipe.yaml").write_text(text)
    answer = viewsphere("render", "recipe.yaml", "-o", "out", "--workers", "0", cwd=files)
    lines = [line for line in answer.stderr.splitlines() if line.strip()]
    assert answer.returncode == 2 and len(lines) == 1 and "left" in lines[0], answer.stderr
