"""Time steps in plans, without reading a file."""

from __future__ import annotations

import numpy as np
import pytest

from viewsphere.assets.animation.timeline import Blenders, Timeline
from viewsphere.errors import RecipeError
from viewsphere.geometry.box3d import Box3d
from viewsphere.model.scene import Floor
from viewsphere.planning.distances import Distances
from viewsphere.planning.extension import extend, whole
from viewsphere.planning.plan import plan
from viewsphere.recipe.recipe import Recipe

LAST = {"walk.fbx": 48, "run.fbx": 24, "still.fbx": 1}


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """Files of which Blender would say these lengths."""
    for name in LAST:
        (tmp_path / name).write_bytes(b"x")

    def timeline(_, path, confined, clip=None, fps=None):
        return Timeline(1, LAST[path.name], 24.0, LAST[path.name] > 1)

    monkeypatch.setattr(Blenders, "timeline", timeline)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def walker(**fields):
    return {"source": "walk.fbx", "category": "person", "frames": {"step": 12}, **fields}


def recipe(*models, **fields):
    viewpoints = {"azimuth": [0, 90, 180], "distance": 5}
    return Recipe(models=models or [walker()], **{"viewpoints": viewpoints, "formats": [], **fields})


def frame_of(spec, step):
    return step.frame if step else spec.rest or 1


def box_of(spec, step=None):
    """A box that is as high as the frame says."""
    return Box3d.between((-0.5, -0.5, 0.0), (0.5, 0.5, 1.0 + frame_of(spec, step) / 100)).corners


def error(*models, **fields):
    with pytest.raises(RecipeError) as caught:
        plan(recipe(*models, **fields))
    return str(caught.value)


def test_every_pose_at_every_time_step():
    planned = plan(recipe())
    assert (planned.models, planned.time_steps, planned.frames) == (1, 4, 12)
    shots = list(planned.shots(box_of))
    assert [f.index for s in shots for f in s.instants] == list(range(12))
    assert {s.things[0].model for s in shots} == {planned.model_specs[0]}
    assert [(s.things[0].step.frame, s.things[0].step.seconds, s.things[0].key) for s in shots] == [
        (frame, (frame - 1) / 24, f"walk-f{frame:04d}") for frame in (1, 13, 25, 37)
    ]
    assert len({s.stage_key for s in shots}) == 1
    assert [[f.viewpoint.azimuth_deg for f in s.instants] for s in shots] == [[0, 90, 180]] * 4
    assert [s.instants[0].viewpoint.time.seconds for s in shots] == [0, 0.5, 1, 1.5]
    assert len({f.viewpoint.index for s in shots for f in s.instants}) == 12
    # The cameras look where the model's centre is at the first frame.
    middle = tuple(box_of(planned.model_specs[0]).mean(axis=0).tolist())
    assert {f.viewpoint.target for s in shots for f in s.instants} == {middle}
    assert [row.key for row in planned.rows] == [s.key for s in shots]
    assert [spec.key for spec in planned.kept_specs] == ["walk"]
    assert [step.frame for step in planned.steps_of(planned.kept_specs[0])] == [1, 13, 25, 37]


def test_a_camera_that_moves_takes_a_pose_a_time_step():
    planned = plan(recipe(walker(frames=[1, 2, 48], poses="moving")))
    frames = [f for s in planned.shots(box_of) for f in s.instants]
    assert [(f.viewpoint.time.frame, f.viewpoint.azimuth_deg) for f in frames] == [(1, 0), (2, 90), (48, 180)]
    assert [f.index for f in frames] == [0, 1, 2]
    assert "expected as many poses as time steps, for moving; found 3 poses and 4" in error(walker(poses="moving"))


def test_models_of_other_time_steps_and_none_stand_side_by_side():
    models = walker(), {"source": "run.fbx", "category": "person", "frames": [1, 24]}, {"source": "zoo:car"}
    planned = plan(recipe(*models))
    assert (planned.frames, planned.time_steps) == (12 + 6 + 3, None)
    alone = plan(recipe({"source": "zoo:car"}))
    car, same = planned.shot(planned.shot_count - 1, box_of), alone.shot(0, box_of)
    assert (car.key, car.scene, car.things[0].model.seed) == (same.key, same.scene, same.things[0].model.seed)
    assert [f.viewpoint.model_copy(update={"index": 0}) for f in car.instants] == [
        f.viewpoint.model_copy(update={"index": 0}) for f in same.instants
    ]
    assert [f.index for s in planned.shots(box_of) for f in s.instants] == list(range(21))
    # Frame 1 of both files is the same moment: the poses are shared.
    assert len({f.viewpoint.index for s in planned.shots(box_of) for f in s.instants}) == 3 * (4 + 1 + 1)


def test_all_time_steps_of_a_model_share_a_split_a_scene_and_a_camera():
    scene = {"sun": {"azimuth": {"uniform": [0, 360]}}, "jitter": {"azimuth": {"uniform": [-5, 5]}}}
    for by in ("model", "pose"):
        splits = {"train": 0.5, "val": 0.5, "by": by}
        planned = plan(recipe(walker(), {"source": "run.fbx", "category": "x", "frames": "all"}, scene=scene, splits=splits))
        frames = [(s.things[0].model.key, f) for s in planned.shots(box_of) for f in s.instants]
        groups = {}
        for number, (track, frame) in enumerate(frames):
            groups.setdefault((track, number % 3), set()).add((frame.split, frame.viewpoint.azimuth_deg))
        assert all(len(found) == 1 for found in groups.values())
        assert sum(planned.split_counts.values()) == planned.frames == 3 * (4 + 24)
    suns = {(s.things[0].model.key, s.scene.sun.azimuth) for s in planned.shots(box_of)}
    assert len(suns) == 2


def test_company_is_at_its_own_time_step_of_the_same_number():
    models = walker(), {"source": "run.fbx", "category": "person", "frames": [1, 24]}
    planned = plan(recipe(*models, scene={"company": {"count": 1}}, splits={"train": 1}))
    pairs = [tuple(p.key for p in s.things) for s in planned.shots(box_of)]
    assert pairs[:4] == [
        ("walk-f0001", "run-f0001"),
        ("walk-f0013", "run-f0024"),
        ("walk-f0025", "run-f0024"),
        ("walk-f0037", "run-f0024"),
    ]
    assert pairs[4:] == [("run-f0001", "walk-f0001"), ("run-f0024", "walk-f0013")]


def test_the_ground_is_where_the_lowest_moment_touches_it():
    def sinking(spec, step=None):
        return box_of(spec, step) - [0, 0, frame_of(spec, step) / 50]

    assert {s.scene.floor for s in plan(recipe()).shots(sinking)} == {Floor(height=-37 / 50)}
    assert {s.scene.floor for s in plan(recipe(scene={"ground": "off"})).shots(sinking)} == {None}
    assert plan(recipe({"source": "zoo:car"})).shot(0, box_of).scene.floor is None


def test_shots_never_span_time_steps_and_records_say_the_same():
    planned = plan(recipe(shot_frames=2))
    portion = whole(planned)
    assert list(portion.record.rows) == list(planned.rows)
    for row in portion.record.rows:
        shot = portion.shot(row, box_of)
        assert len({f.viewpoint.time for f in shot.instants}) == 1
        assert [f.index for f in shot.instants] == list(range(row.first, row.first + row.count))
    assert portion.record.models == tuple(spec.key for spec in planned.kept_specs)


def test_time_steps_are_added_to_those_there_are():
    first = whole(plan(recipe(walker(frames=[1, 25])))).record
    again = extend(plan(recipe(walker(frames=[1, 25]))), first)
    assert again.adds_nothing
    more = extend(plan(recipe(walker(frames=[1, 13, 25]))), first)
    assert more.part.frames == 3
    shown = [portion_shot for row in more.record.rows_of(1) for portion_shot in more.shot(row, box_of).instants]
    assert [(f.index, f.viewpoint.index, f.viewpoint.time.frame) for f in shown] == [(6, 6, 13), (7, 7, 13), (8, 8, 13)]


def test_a_camera_inside_at_any_time_step_is_found():
    def growing(spec, step=None):
        return Box3d.between((-0.5, -0.5, 0.0), (0.5, 0.5 if frame_of(spec, step) < 30 else 9.0, 1.0)).corners

    planned = plan(recipe(viewpoints={"azimuth": [0, 180], "distance": 5, "elevation": 0}))
    problem = Distances(planned, growing).problem(planned.subjects[0])
    assert problem is not None
    assert "walk-f0037" in str(problem)
    assert Distances(planned, box_of).problem(planned.subjects[0]) is None
    assert np.isfinite(Distances(planned, box_of).cameras(planned.shot(0, box_of).things, range(planned.poses))).all()


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"frames": [2, 1]}, "expected frames that ascend; found 2 before 1"),
        ({"frames": [1, 1]}, "expected frames that ascend; found 1 before 1"),
        ({"frames": []}, "frames"),
        ({"frames": {"first": 9, "last": 3}}, "expected first up to last; found 9 and 3"),
        ({"frames": "some"}, "frames"),
        ({"frames": [1, 49]}, "expected frames of 1 to 48, as "),
        ({"frames": {"first": 50}}, "found none of them"),
        ({"source": "still.fbx"}, "something moves; found no animation in "),
        ({"source": "zoo:car"}, "models[0].frames: expected a file, or a model that moves; found zoo:car"),
        ({"frames": None, "poses": "moving"}, "expected frames, for poses: moving; found none"),
        (
            {"frames": None, "clip": "a"},
            "expected frames, or a motion of kind clip of the model or of",
        ),
        ({"frames": {"first": 1, "last": 48, "step": 0}}, "frames"),
    ],
)
def test_mistakes_cost_one_line(fields, said):
    with pytest.raises(RecipeError) as caught:
        plan(recipe(walker(**fields)))
    assert said in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


def test_a_time_step_s_key_is_no_other_model_s(folder):
    (folder / "walk-f0013.fbx").write_bytes(b"x")
    assert "expected every key once; found 'walk-f0013' twice" in error(
        walker(), {"source": "walk-f0013.fbx", "category": "person"}
    )
    assert "set max_frames: 144 in the recipe" in error(walker(frames="all"), max_frames=100)
