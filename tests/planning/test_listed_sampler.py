"""Listed shots: exactly the cameras, lenses and poses of a file; its mistakes are told with file and line, before anything."""

import json
import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from small import ROOT
from viewsphere import Dataset, Recipe, generate
from viewsphere.check import check
from viewsphere.composing.viewpoints.poses import poses
from viewsphere.errors import RecipeError
from viewsphere.limits import limits
from viewsphere.model.listed import ListedObject, ListedShot
from viewsphere.planning.plan import plan


def motion(rng, near=(0, 0, 0), spread=0.2):
    pose = np.eye(4)
    pose[:3, :3] = Rotation.random(random_state=int(rng.integers(2**31))).as_matrix()
    pose[:3, 3] = np.array(near) + rng.uniform(-spread, spread, 3)
    return pose


def shot(number, size=(64, 48), objects=2, **more):
    """A shot of objects some 2 m ahead of a camera anywhere."""
    rng = np.random.default_rng(number)
    camera = motion(rng, spread=5)
    there = [camera @ motion(rng, (0.4 * i - 0.2, 0, 2)) for i in range(objects)]
    lens = {"width": size[0], "height": size[1], "fx": 60 + number, "fy": 61.5, "cx": size[0] / 2 - 1, "cy": 20.25}
    named = zip(("post_box_000", "chair_000", "post_box_000"), there, strict=False)
    listed = [{"model": model, "world_from_object": pose.tolist()} for model, pose in named]
    return {"world_from_camera": camera.tolist(), "camera": lens, "objects": listed, **more}


LINES = [
    shot(0, name="first", split="test"),
    shot(1, (80, 40), split="train", objects=3),
    shot(2, objects=0, split="train"),
    shot(3, split="train", objects=1),
]


def recipe(folder, lines=LINES, **changes):
    text = lines if isinstance(lines, str) else "".join(json.dumps(line) + "\n" for line in lines)
    (folder / "shots.jsonl").write_text(text, "utf-8")
    values = {
        "models": [{"source": "zoo:post_box", "scale": {"length": 0.3}}, {"source": "zoo:chair", "scale": {"length": 0.4}}],
        "viewpoints": {"kind": "file", "path": str(folder / "shots.jsonl")},
        "scenes": {"sampler": "listed"},
        "camera": {"of_viewpoints": True},
        "scene": {"ground": "off", "background": "#777777"},
        "splits": {"by": "frame", "train": 0.5, "test": 0.5},
        "channels": ["rgb", "depth", "instances"],
        "formats": [],
    }
    return Recipe.model_validate({**values, **changes})


@pytest.fixture(scope="module")
def rendered(tmp_path_factory):
    place = tmp_path_factory.mktemp("listed")
    generate(recipe(place), place / "out", workers=0)
    return Dataset(place / "out")


def test_cameras_lenses_and_poses_are_the_files(rendered):
    assert [sample.split for sample in rendered] == ["test", "train", "train", "train"]
    for sample, line in zip(rendered, LINES, strict=True):
        expected = np.linalg.inv(np.array(line["world_from_camera"]))
        np.testing.assert_allclose(np.column_stack([sample.camera.R, sample.camera.t]), expected[:3], atol=1e-12)
        lens = {name: getattr(sample.camera.intrinsics, name) for name in line["camera"]}
        assert lens == line["camera"] and sample.rgb.shape == (lens["height"], lens["width"], 3)
        assert [o.key for o in sample.objects] == [one["model"] for one in line["objects"]]
        for o, one in zip(sample.objects, line["objects"], strict=True):
            np.testing.assert_allclose(o.world_from_object, one["world_from_object"], atol=1e-12)
            assert o.area > 20


def test_all_proofs_hold(rendered):
    assert not check(rendered).findings


def test_origin_scale_and_up_move_cameras_and_objects_alike(tmp_path):
    """What a camera sees of an object does not depend on the world's axes; lengths are scaled."""
    views = {"kind": "file", "path": str(tmp_path / "shots.jsonl"), "up": "-y", "origin": [1, 2, 3], "scale": 2.0}
    planned = plan(recipe(tmp_path, viewpoints=views))
    for made, line in zip(planned.shots(lambda *_: np.zeros((8, 3))), LINES, strict=True):
        camera = np.array(line["world_from_camera"])
        own = made.camera(0)
        np.testing.assert_allclose(own.center, 2 * np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]) @ (camera[:3, 3] - [1, 2, 3]))
        for thing, one in zip(made.things, line["objects"], strict=True):
            seen = np.linalg.inv(camera) @ np.array(one["world_from_object"])
            world = np.array(thing.world_from_object)
            np.testing.assert_allclose(own.R @ world[:3, :3], seen[:3, :3], atol=1e-12)
            np.testing.assert_allclose(own.R @ world[:3, 3] + own.t, 2 * seen[:3, 3], atol=1e-12)


@pytest.mark.slow
def test_shots_are_added_to_a_data_set_that_has_others(rendered, tmp_path):
    generate(recipe(tmp_path, LINES[:2]), tmp_path / "out", workers=0)
    with pytest.raises(Exception, match="append"):
        generate(recipe(tmp_path), tmp_path / "out", workers=0)
    generate(recipe(tmp_path), tmp_path / "out", workers=0, append=True)
    again = Dataset(tmp_path / "out")
    assert len(again) == 4
    for one, other in zip(again, rendered, strict=True):
        np.testing.assert_array_equal(one.instances, other.instances)


@pytest.mark.slow
def test_a_camera_may_be_inside_of_scenery(tmp_path):
    line = shot(0, objects=1, split="train")
    line["objects"][0]["world_from_object"] = line["world_from_camera"]
    with pytest.raises(RecipeError, match="outside of all that is placed"):
        generate(recipe(tmp_path, [line]), tmp_path / "refused", workers=0)
    line["objects"][0]["scenery"] = True
    generate(recipe(tmp_path, [line]), tmp_path / "out", workers=0)
    assert Dataset(tmp_path / "out")[0].objects[0].key == "post_box_000"


def test_lenses_of_their_own_without_objects(tmp_path):
    """The models of a recipe seen by the file's cameras, each with its lens, where these are of one size."""
    lines = [{name: line[name] for name in ("world_from_camera", "camera")} for line in (LINES[0], LINES[3])]
    for line in lines:
        line["world_from_camera"] = np.diag([1.0, -1.0, -1.0, 1.0]).tolist()
        line["world_from_camera"][2][3] = 2.0
    generate(recipe(tmp_path, lines, scenes=None, splits={"by": "model", "train": 1}), tmp_path / "out", workers=0)
    assert sorted(sample.camera.intrinsics.fx for sample in Dataset(tmp_path / "out")) == [60, 60, 63, 63]
    with pytest.raises(RecipeError, match=r"camera.of_viewpoints: expected lenses of one size; found 64 x 48, 80 x 40"):
        plan(recipe(tmp_path, LINES, scenes=None, splits={}))


def changed(**changes):
    return json.dumps({**shot(7, split="train"), **changes})


POSE = shot(7)["world_from_camera"]
BROKEN = {
    "no JSON": ('{"name": ', r"shots.jsonl:2: expected a shot as JSON"),
    "no shot": ("[1]", r"shots.jsonl:2: recipe: expected a mapping"),
    "no camera": (changed(camera=None), r"shots.jsonl:2: camera: expected one in every line"),
    "a field": (changed(object=[]), r"shots.jsonl:2: object: 'object' is unknown; did you mean 'objects'"),
    "a name": (changed(name="../up"), r"shots.jsonl:2: name: expected text that should match"),
    "a device": (changed(name="con.1"), r"shots.jsonl:2: name: expected a name for a folder on any system"),
    "the first's name": (changed(name="FIRST"), r"shots.jsonl:2: name: expected one that no other .* found 'FIRST', as in 1"),
    "no number": (changed(world_from_camera=[[0, 0, 0, "x"], *POSE[1:]]), r"world_from_camera\[0\]\[3\]: expected"),
    "NaN": (changed(world_from_camera=[[0, 0, 0, float("nan")], *POSE[1:]]), r"shots.jsonl:2: .*expected a"),
    "no last row": (changed(world_from_camera=[*POSE[:3], [0, 0, 1, 1]]), r"world_from_camera: expected \[0, 0, 0, 1\]"),
    "no rotation": (changed(world_from_camera=np.diag([1, 2, 1, 1.0]).tolist()), r"world_from_camera: expected a rotation"),
    "a mirror": (changed(world_from_camera=np.diag([1, -1, 1, 1.0]).tolist()), r"world_from_camera: expected a rotation"),
    "a large picture": (
        changed(camera={"width": 10**9, "height": 1, "fx": 1, "fy": 1, "cx": 0, "cy": 0}),
        r"shots.jsonl:2: camera: expected at most 16384 pixels a side; found 1000000000 x 1",
    ),
    "a model": (
        changed(objects=[{"model": "chair_00", "world_from_object": POSE}]),
        r"shots.jsonl:2: objects\[0\].model: expected the key .* found 'chair_00'; did you mean 'chair_000'",
    ),
    "a split": (changed(split="tain"), r"shots.jsonl:2: split: 'tain' is unknown; did you mean 'train'. Valid: train, test"),
}


@pytest.mark.parametrize("what", BROKEN)
def test_mistakes_are_told_with_file_and_line(what, tmp_path):
    line, message = BROKEN[what]
    with pytest.raises(RecipeError, match=message) as told:
        plan(recipe(tmp_path, json.dumps(LINES[0]) + "\n" + line + "\n"))
    assert "\n" not in str(told.value) and "shots.jsonl:2: " in str(told.value)


def test_too_many_objects_are_refused(tmp_path, monkeypatch):
    monkeypatch.setenv("VIEWSPHERE_MAX_LISTED_OBJECTS", "2")
    assert limits.MAX_LISTED_OBJECTS == 2
    with pytest.raises(RecipeError, match=r"shots.jsonl:2: .*at most 2 \(limit MAX_LISTED_OBJECTS\); found 3"):
        plan(recipe(tmp_path))


UNFIT = {
    "viewpoints: expected a file of shots": {"viewpoints": {"distance": 2}, "camera": {"fov_deg": 40}},
    "time: expected none beside sampler: listed": {
        "time": {"frames": 2},
        "splits": {"by": "sequence", "train": 0.5, "test": 0.5},
    },
    "scenes: expected no options, listed has none; found count": {"scenes": {"sampler": "listed", "count": 3}},
    "splits.by: expected frame, as shots say their splits; found scene": {"splits": {"by": "scene", "train": 0.5, "test": 0.5}},
    "splits.by: expected frame, as shots say their splits; found model": {"splits": {"train": 0.5, "test": 0.5}},
    "scene.company: expected none": {"scene": {"company": 1}},
    "rig: expected shots of one lens": {"rig": {"kind": "stereo", "baseline": 0.1}},
}


@pytest.mark.parametrize("message", UNFIT)
def test_what_has_no_place_beside_listed_shots_is_refused(message, tmp_path):
    with pytest.raises(RecipeError, match=re.escape(message)):
        plan(recipe(tmp_path, LINES[:1] if "time" in UNFIT[message] else LINES, **UNFIT[message]))


def test_a_changed_object_is_another_pose_and_another_plan(tmp_path):
    first = recipe(tmp_path)
    digest, name = plan(first).digest, poses(first.viewpoints, 0).name(0)
    moved = json.loads(json.dumps(LINES))
    moved[0]["objects"][1]["world_from_object"][0][3] += 1e-3
    second = recipe(tmp_path, moved)
    assert plan(second).digest != digest and poses(second.viewpoints, 0).name(0) != name
    assert poses(second.viewpoints, 0).name(1) == poses(first.viewpoints, 0).name(1)


def test_all_fields_are_documented():
    text = (ROOT / "docs/recipe.md").read_text("utf-8")
    section = text[text.index("### Listed shots") : text.index("### Data sets rendered again")]
    for name in (*ListedShot.model_fields, *ListedObject.model_fields):
        assert f"`{name}`" in section or f"`{name}: true`" in section
    line = next(line for line in section.splitlines() if line.startswith("{"))
    ListedShot.model_validate(json.loads(line))
