"""Which frames share a .blend file, what of a data set is chosen, and what the store keeps of a scene; no Blender is needed."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from cube_dataset import FEW, make
from quick import quick
from small import small_recipe
from viewsphere import Dataset, generate, plan, plugins
from viewsphere.assets.cache import load_normalised
from viewsphere.engines import cycles
from viewsphere.engines.shared.blender import saving
from viewsphere.engines.shared.blender.file_frame import FileFrame
from viewsphere.errors import MissingExtraError, StoreError, UserError
from viewsphere.formats import blend
from viewsphere.geometry.camera import orbit_center, orbit_rotation
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Scene
from viewsphere.run.datasets.importing import import_dataset
from viewsphere.run.exports.exporting import export
from viewsphere.run.shots.stages import Stages
from viewsphere.store import Choice, frame_ranges


@pytest.fixture
def asked(monkeypatch):
    """Blender is not there; what it would have been asked, by the name of the file."""
    files = {}

    def save(shot, samples, load, file, data):
        files[file.name] = SimpleNamespace(shot=shot, samples=samples, load=load, data=data)
        return ("lacks a thing",)

    monkeypatch.setattr(cycles, "ENGINE", cycles.ENGINE.model_copy(update={"save": save, "check": lambda options: None}))
    return files


def test_frames_of_one_scene_share_a_file(asked, small_run, tmp_path):
    dataset = Dataset(small_run)
    assert export(small_run, ["blend"], output=tmp_path) == ("format blend: lacks a thing",)
    assert sorted(asked) == sorted(f"{key}.blend" for key in dataset.plan.models)
    for name, told in asked.items():
        expected = [s.index for s in dataset if s.objects[0].key == name.removesuffix(".blend")]
        assert [s.index for s in told.samples] == [f.index for f in told.shot.instants] == expected
        assert told.data == dataset.name


@pytest.mark.slow
def test_frames_of_other_scenes_have_other_files(asked, tmp_path):
    scene = {"draw": "per_frame", "sun": {"azimuth": {"uniform": [0, 360]}}}
    generate(small_recipe(scene=scene), tmp_path / "out")
    export(tmp_path / "out", ["blend"])
    samples = list(Dataset(tmp_path / "out"))
    assert sorted(asked) == sorted(f"{s.objects[0].key}-{s.index:06d}.blend" for s in samples)
    suns = {told.shot.scene.sun for told in asked.values()}
    assert len(suns) == len(samples) == sum(len(told.samples) for told in asked.values())


@pytest.mark.slow
def test_sky_and_colours_behind_have_files_of_their_own(asked, tmp_path):
    """The shots have several frames; what is behind them is drawn for each."""
    scene = {"background": {"choice": ["sky", "#ff0000"]}}
    generate(small_recipe(scene=scene), tmp_path / "out")
    export(tmp_path / "out", ["blend"])
    samples = list(Dataset(tmp_path / "out"))
    assert sorted(s.index for told in asked.values() for s in told.samples) == [s.index for s in samples]
    assert len(asked) > len({s.objects[0].key for s in samples})
    for told in asked.values():
        finishes = [frame.finish or told.shot.scene.finish for frame in told.shot.instants]
        assert len({finish.background.color is None for finish in finishes}) == 1


def test_the_models_are_the_stores(asked, small_run, tmp_path):
    export(small_run, ["blend"], output=tmp_path)
    for told in asked.values():
        (spec,) = {p.model for p in told.shot.things}
        found, made = told.load(spec), load_normalised(spec)
        corners = [mesh.vertices[mesh.triangles] for mesh in (found, made)]
        assert np.array_equal(*corners)
        assert found.materials == made.materials


def test_a_data_set_without_scenes_is_lit_anyhow(asked, tmp_path):
    dataset = make(tmp_path / "blocks", several=True, short=False, channels=FEW)
    assert dataset.store.shot("several-000000") is None
    export(dataset.root, ["blend"])
    (told,) = asked.values()
    assert told.shot.scene.sun is not None
    assert [p.id for p in told.shot.things] == [1, 2, 3]
    for thing, o in zip(told.shot.things, told.samples[0].objects, strict=True):
        assert np.array_equal(thing.world_from_object, o.world_from_object)
        assert told.load(thing.model).triangles.shape == (12, 3)


def test_the_store_keeps_the_shots_as_they_were_rendered(small_run):
    store, planned = Dataset(small_run).store, plan(small_recipe())
    stages = Stages()
    for shot in planned.shots(stages.box):
        kept = store.shot(shot.key)
        assert kept == shot


@pytest.mark.usefixtures("asked")
def test_a_shot_that_cannot_be_read_is_one_line(small_dataset):
    key, _ = next(small_dataset.shots())
    (small_dataset.store.shot_folder(key) / "shot.json").write_text('{"key": 3}')
    with pytest.raises(StoreError, match=r"shot\.json: expected the scene of a shot"):
        export(small_dataset.root, ["blend"])


@pytest.mark.parametrize(
    ("text", "ranges"), [("7", ((7, 8),)), ("0-15,40", ((0, 16), (40, 41))), (" 3 , 5-5 ", ((3, 4), (5, 6)))]
)
def test_frames_as_people_write_them(text, ranges):
    assert frame_ranges(text) == ranges


@pytest.mark.parametrize("text", ["a", "5-3", "-4", "1-2-3", "1..4", "²", "", ","])
def test_frames_that_are_none_are_one_line(text):
    with pytest.raises(UserError, match="--frames: expected numbers and ranges, such as 0-15,40; found"):
        frame_ranges(text)


@pytest.mark.parametrize("frames", [(), ((0, 3),), ((2, 3), (5, 7)), ((90, 99),)])
@pytest.mark.parametrize("models", [(), ("nothing",), ("*",), ("FIRST",)])
def test_a_choice_is_what_it_says(small_run, models, frames):
    whole = list(Dataset(small_run))
    first = whole[0].objects[0].key
    models = tuple(m.replace("FIRST", first) for m in models)
    chosen = Dataset(small_run, Choice(models, frames))
    expected = [
        s.index
        for s in whole
        if (not models or models == ("*",) or s.objects[0].key in models)
        and (not frames or any(a <= s.index < b for a, b in frames))
    ]
    assert [s.index for s in chosen] == [chosen[i].index for i in range(len(chosen))] == expected
    assert len(chosen) == len(expected)
    assert {m.key for m in chosen.models} == {o.key for s in chosen for o in s.objects}


def test_a_choice_needs_a_folder_of_its_own(small_dataset, tmp_path):
    some = Choice(frames=((0, 2),))
    for output in (None, small_dataset.root):
        with pytest.raises(UserError, match="--output: expected another folder"):
            export(small_dataset.root, ["native"], output=output, choice=some)
    with pytest.raises(UserError, match="expected finished frames that --models and --frames fit"):
        export(small_dataset.root, ["native"], output=tmp_path / "part", choice=Choice(("nothing",)))
    export(small_dataset.root, ["native"], output=tmp_path / "part", choice=some)
    assert [p.name for p in (tmp_path / "part").iterdir()] == ["native"]
    assert len(list((tmp_path / "part" / "native").rglob("RGB/*.png"))) == 2
    with pytest.raises(StoreError, match="expected an empty or new folder"):
        export(small_dataset.root, ["native"], output=tmp_path / "part", choice=some)


@pytest.fixture(scope="module")
def foreign(small_run, tmp_path_factory):
    """A data set that came back from its native files: neither the plan nor the files say where models stand."""
    folder = tmp_path_factory.mktemp("foreign")
    export(small_run, ["native"], output=folder)
    import_dataset("native", folder / "native", folder / "in")
    return folder / "in"


def test_models_of_imported_frames_are_what_they_show(foreign):
    whole = list(Dataset(foreign))
    first = whole[0].objects[0].key
    expected = [s.index for s in whole if s.objects[0].key == first]
    assert 0 < len(expected) < len(whole)
    assert [s.index for s in Dataset(foreign, Choice((first,)))] == expected
    assert [s.index for s in Dataset(foreign, Choice((first,), ((0, expected[-1]),)))] == expected[:-1]
    assert not len(Dataset(foreign, Choice(("nothing",))))


def test_frames_that_cannot_be_staged_are_one_line(asked, foreign, tmp_path):
    with pytest.raises(UserError, match="format blend: expected frames with known cameras, models and where they stand"):
        export(foreign, ["blend"], output=tmp_path)
    assert not asked and not any(tmp_path.iterdir())


def test_frames_that_are_left_out_and_unknown_light_are_notes(asked, tmp_path):
    dataset = make(tmp_path / "blocks", several=True, short=False, channels=FEW)
    file = dataset.store.shot_folder("several-000000") / "frames.json"
    records = json.loads(file.read_text())
    for o in records[0]["objects"]:
        o["model"] = ""
    file.write_text(json.dumps(records))
    left_out, unlit, *_ = export(dataset.root, ["blend"])
    assert f"1 of {len(dataset):,} frames are left out" in left_out
    assert f"nothing is known of the light of {len(dataset) - 1:,} frames" in unlit


def test_a_format_that_cannot_be_written_stops_the_others(monkeypatch, small_run, tmp_path):
    def find_blender(_):
        raise MissingExtraError("Blender: none")

    monkeypatch.setattr("viewsphere.blender.interpreter.find_blender", find_blender)
    with pytest.raises(MissingExtraError):
        export(small_run, ["coco", "blend"], output=tmp_path / "part")
    assert not (tmp_path / "part").exists()
    with pytest.raises(UserError, match="--output: expected a folder outside of the data set's store"):
        export(small_run, ["coco"], output=small_run / "store" / "models")
    export(small_run, ["coco", "coco"], output=tmp_path / "part")
    assert [path.name for path in (tmp_path / "part").iterdir()] == ["coco"]


def test_what_a_killed_export_left_is_removed(small_run, tmp_path):
    over = subprocess.run([sys.executable, "-c", "import os; print(os.getpid())"], capture_output=True, text=True)
    left, other = (tmp_path / f"{name}~{socket.gethostname()}~{over.stdout.strip()}~x" for name in ("coco", "native"))
    foreign = tmp_path / "coco~elsewhere~1~x"
    for folder in (left, other, foreign):
        folder.mkdir()
        (folder / "half.json").touch()
    export(small_run, ["coco"], output=tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(["coco", other.name, foreign.name])


def test_a_camera_that_single_precision_moves_is_a_note(small_run):
    samples = list(Dataset(small_run))[:1]
    finishes = [Scene().finish]
    assert not list(saving._lacking(samples, finishes, 1e-6))
    (note,) = saving._lacking(samples, finishes, 2e-3)
    assert "the camera is off by up to 0.002 of its distance" in note


def test_without_blender_nothing_is_rendered(monkeypatch, tmp_path):
    def find_blender(_):
        raise MissingExtraError("Blender: none")

    monkeypatch.setattr("viewsphere.blender.interpreter.find_blender", find_blender)
    with pytest.raises(MissingExtraError):
        generate(small_recipe(formats=["blend"]), tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("tilt", [0.0, -20.0, 110.0])
@pytest.mark.parametrize("elevation", quick([-90.0, -30.0, 0.0, 75.0, 90.0], -90.0, -30.0))
def test_the_rig_stands_where_the_camera_does(elevation, tilt, tmp_path):
    """Blender's rotations, X then Z, and the camera's own about its axis, are the sample's camera."""
    dataset = make(tmp_path / "blocks", channels=FEW)
    sample = dataset[1]
    angles = np.radians([200.0, elevation, tilt])
    rotation = orbit_rotation(*angles)
    target = np.array([0.3, -2.0, 1.0])
    center = target + orbit_center(*angles[:2], sample.pose.distance)
    camera = type(sample.camera)(sample.camera.intrinsics, rotation, -rotation @ center)
    (pose,) = saving._poses_request([type(sample)(**{**vars(sample), "known_camera": camera})], FileFrame.from_blend(None))
    np.testing.assert_allclose(pose["target"], target, atol=1e-12)
    x, z, roll = np.radians([90 - pose["elevation"], pose["azimuth"], -pose["tilt"]])
    turn = _about("z", z) @ _about("x", x)
    np.testing.assert_allclose(pose["target"] + pose["distance"] * turn[:, 2], center, atol=1e-12)
    np.testing.assert_allclose(turn @ _about("z", roll), rotation.T @ np.diag([1, -1, -1]), atol=1e-12)


def _about(axis, angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]] if axis == "x" else [[c, -s, 0], [s, c, 0], [0, 0, 1]])


def test_blend_is_a_format_that_cannot_be_imported():
    assert "blend" in plugins.names("formats")
    assert not hasattr(blend, "read")
    assert blend._spec("a", "a.glb").centring == "as_is" and isinstance(blend._spec("a", "a.glb"), ModelSpec)


@pytest.mark.parametrize("world", quick(["videos", "drives"], "videos"))
@pytest.mark.slow
def test_each_sensor_of_a_rig_has_files_of_its_own(asked, world, request, tmp_path):
    dataset = request.getfixturevalue(world)
    export(dataset.root, ["blend"], output=tmp_path)
    cameras = {sample.index: sample.camera for sample in dataset if sample.sensor != "top"}
    written = [sample.index for told in asked.values() for sample in told.samples]
    assert sorted(written) == sorted(cameras)
    for told in asked.values():
        assert len({sample.sensor for sample in told.samples}) == 1
        for number, sample in enumerate(told.samples):
            camera = told.shot.camera(number)
            np.testing.assert_allclose(camera.R, cameras[sample.index].R, atol=1e-12)
            np.testing.assert_allclose(camera.t, cameras[sample.index].t, atol=1e-12)
            assert camera.intrinsics == cameras[sample.index].intrinsics
            for thing in told.shot.objects:
                there = {o.id: o.world_from_object for o in sample.objects}
                np.testing.assert_array_equal(thing.motion.pose_at(0), there[thing.id])
