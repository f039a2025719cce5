"""Things that move through sequences: what a shot asks for is what the whole sequence has, and no more is computed."""

import pytest
from test_motion import LANES, WALK, entries, start

from viewsphere.composing.motion import Mover, mover
from viewsphere.model.thing import Motion
from viewsphere.planning.samplers.shared.moving import Moving
from viewsphere.recipe.cameras.sequence import TimeEntry

TIME = TimeEntry(frames=60, fps=25)
PATH = {"kind": "path", "points": [[0, 0, 0], [0, 4, 0], [2, 6, 1]], "speed": 4}
SEVERAL = {
    "path": [PATH],
    "waits": [{**PATH, "offset": -6}],
    "leaves": [{**PATH, "end": "leave"}],
    "lane": [{"kind": "path", "lane": "any", "speed": 4}],
    "spline": [{"kind": "spline", "points": [[0, 0, 0], [1, 2, 0], [4, 4, 1]], "speed": 2, "heading": "along"}],
    "late": [{"kind": "constant", "velocity": [1, 0, 0], "enter": 2.3}],
    "never": [{"kind": "constant", "enter": 9}],
    "still": [{"kind": "oscillate"}],
    "clip": [{"kind": "clip"}],
    "one frame": [{"kind": "clip", "speed": 0}],
    "walks, comes and goes": [{**PATH, "enter": 0.5}, {"kind": "clip", "leave": 1.5}],
    "is not there yet": [{"kind": "constant", "enter": 9}, {"kind": "clip"}],
    "random": [{"kind": "random", "position": [1, 1, 1], "rotation_deg": [9, 9, 9]}],
}


def made(options, time=TIME):
    plays = {"timeline": WALK} if any(one["kind"] == "clip" for one in options) else {}
    return Moving(mover(entries(*options), start(lanes=LANES, **plays)), time)


def part(motion, instants):
    """Some instants of the motion of a whole sequence."""
    if motion.is_still:
        return motion
    poses, steps = ([part[0 if len(part) == 1 else i] for i in instants] for part in (motion.poses, motion.steps))
    poses, steps = poses if len(motion.poses) > 1 else poses[:1], steps if len(motion.steps) > 1 else steps[:1]
    return Motion(poses=tuple(poses), steps=tuple(steps), moves=True)


@pytest.mark.parametrize("options", SEVERAL.values(), ids=SEVERAL)
def test_instants_are_those_of_the_whole_sequence(options):
    moving = made(options)
    whole = moving.mover.motion_at([TIME.seconds_at(i) for i in range(TIME.count)])
    assert moving.is_still == whole.is_still
    for instants in ([0], [59], [12, 13, 14], [0, 30, 59], list(range(60))):
        assert moving.during(instants) == part(whole, instants)
        assert moving.motion_at(instants[0]) == whole.held(instants[0])


@pytest.mark.parametrize("name", ["path", "waits", "leaves", "lane", "spline", "random", "walks, comes and goes"])
def test_a_shot_of_a_vast_sequence_asks_for_its_own_instants(name, monkeypatch):
    asked = []
    state = Mover.state
    monkeypatch.setattr(Mover, "state", lambda self, time: asked.append(time) or state(self, time))
    moving = made(SEVERAL[name], TimeEntry(frames=1_000_000, fps=25))
    moving.during([40, 41, 42])
    assert len(asked) < 100
