import json
import shutil

import numpy as np
import pytest

import viewsphere.check
from cube_dataset import LENS, make
from viewsphere.check import check
from viewsphere.check.frames import FRAME_PROOFS
from viewsphere.errors import MissingExtraError
from viewsphere.geometry.mask import encode_rle
from viewsphere.model.camera import Distortion
from viewsphere.model.channel import CHANNELS
from viewsphere.run.exporting import export
from viewsphere.store import Dataset, encode


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return make(tmp_path_factory.mktemp("check") / "out", ground=True)


@pytest.fixture
def dataset(whole, tmp_path):
    """A copy, free to be spoilt."""
    return Dataset(shutil.copytree(whole.root, tmp_path / "out"))


def failures(dataset, **options):
    report = check(Dataset(dataset.root), **options)  # afresh: an open one keeps what it has read
    assert report.ok == (not report.findings)
    return {(f.check, f.frame) for f in report.findings}


def edit_record(dataset, frame, change):
    """Change the record of a frame; all shots have four frames."""
    file = dataset.store.shot_folder(f"block-{frame // 4}-000000") / "frames.json"
    records = json.loads(file.read_text())
    change(records[frame % 4])
    file.write_text(json.dumps(records))


def edit_channel(dataset, frame, name, change):
    sample = dataset[frame]
    array = np.array(sample.channels[name])
    change(array)
    dataset.path(sample.files[name]).write_bytes(encode(CHANNELS[name], array))


def test_a_whole_data_set_passes(whole):
    report = check(whole)
    assert report.ok, report.findings
    assert report.notes == ()
    names = ["files", "ids", "masks", "boxes", "projection", "poses", "surface"]
    assert report.checked == dict.fromkeys(names, 12)
    assert json.loads(json.dumps(report.to_json()))["ok"] is True


LENSES = {
    "brown_conrady": Distortion(model="brown_conrady", coefficients=(-0.2, 0.05, 0.001, 0.0, 0.0)),
    "fisheye": Distortion(model="fisheye", coefficients=(0.02, 0.05, 0.001, 0.0)),
}


@pytest.mark.parametrize("lens", LENSES)
def test_bent_pictures_pass(tmp_path, lens):
    report = check(make(tmp_path, intrinsics=LENS.model_copy(update={"distortion": LENSES[lens]})))
    assert report.ok, report.findings


def test_several_objects_pass(tmp_path):
    report = check(make(tmp_path, several=True))
    assert report.ok, report.findings
    assert report.notes == ()


def test_every_export_that_is_there_is_proved_by_its_format(dataset):
    assert "coco" not in check(dataset, rays=False).checked
    export(dataset.root, ["coco", "native"])
    report = check(Dataset(dataset.root), rays=False)
    assert report.ok, report.findings
    assert (report.checked["coco"], report.checked["native"]) == (12, 12)
    (dataset.root / "coco" / "train" / "000000000003.png").unlink()
    (dataset.root / "native" / "more.txt").touch()
    assert failures(dataset, rays=False) == {("coco", 2), ("native", None)}
    part = check(Dataset(dataset.root), rays=False, frames=6)
    assert part.ok and "coco: not checked, that needs all frames" in part.notes


def test_a_format_without_a_proof_is_a_note(dataset):
    (dataset.root / "blend").mkdir()
    report = check(dataset, rays=False)
    assert report.ok and report.notes == ("blend: not checked, the format has no proof",)


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (IndexError("7"), "expected an export that can be checked, found IndexError: 7"),
        (RuntimeError("no luck"), "the check itself failed: RuntimeError: no luck"),
    ],
)
def test_an_export_s_proof_that_breaks_off(dataset, monkeypatch, error, message):
    def broken(*_):
        raise error

    (dataset.root / "native").mkdir()
    monkeypatch.setattr("viewsphere.formats.native.verify", broken)
    assert [(f.check, f.message) for f in check(dataset, rays=False).findings] == [("native", message)]


def test_pictures_alone_pass_with_notes(tmp_path):
    report = check(make(tmp_path, channels=("rgb",)))
    assert report.ok, report.findings
    assert any("depth and instances" in note for note in report.notes)


def test_rays_are_cast_on_the_frames_asked_for(whole, monkeypatch):
    assert check(whole, sample=3).checked["surface"] == 3
    assert "surface" not in check(whole, rays=False).checked
    monkeypatch.setattr("viewsphere.check.rays.find_spec", lambda name: None)
    assert any(note.startswith("surface: not checked") for note in check(whole).notes)
    with pytest.raises(MissingExtraError, match=r"viewsphere\[check\]"):
        check(whole, rays=True)


@pytest.mark.parametrize("spoil", [lambda f: f.unlink(), lambda f: f.write_bytes(f.read_bytes()[:-20])])
def test_a_missing_or_broken_file(dataset, spoil):
    spoil(dataset.path(dataset[5].files["normals"]))
    assert failures(dataset) == {("files", 5)}


def test_a_file_of_another_size(dataset):
    file = dataset.path(dataset[5].files["depth"])
    file.write_bytes(encode(CHANNELS["depth"], np.ones((9, 9), np.float32)))
    assert ("files", 5) in failures(dataset, rays=False)


def test_a_broken_record(dataset):
    (dataset.store.shot_folder("block-1-000000") / "frames.json").write_text("[{}")
    assert {("files", i) for i in range(4, 8)} <= failures(dataset)


def test_a_missing_shot_and_model(dataset):
    shutil.rmtree(dataset.store.shot_folder("block-2-000000"))
    dataset.path("store/models/block-1/block-1.glb").unlink()
    report = check(Dataset(dataset.root), rays=False)
    messages = [f.message for f in report.findings if f.check == "counts"]
    assert "expected 12 frames (3 models x 4 poses), found 8" in messages[0]
    assert "block-1.glb" in messages[1]


def test_what_was_left_out_on_purpose_is_a_note(tmp_path):
    dataset = make(tmp_path, leave_out=(2,))
    assert failures(dataset) == {("counts", None)}
    (dataset.store.folder / "skipped.json").write_text(json.dumps({"block-2-000000": "no triangles"}))
    report = check(Dataset(dataset.root))
    assert report.ok
    assert "block-2-000000 was left out: no triangles" in report.notes


def test_a_record_of_another_frame(dataset):
    edit_record(dataset, 6, lambda r: r.update(index=3))
    assert ("ids", 6) in failures(dataset)


def test_an_unknown_id_in_the_map(dataset):
    edit_channel(dataset, 2, "instances", lambda a: a.__setitem__((0, 0), 9))
    assert ("ids", 2) in failures(dataset)


def test_a_wrong_category(dataset):
    edit_channel(dataset, 2, "categories", lambda a: a.__setitem__(dataset[2].instances > 0, 3))
    assert failures(dataset) == {("ids", 2)}


def test_a_pixel_more_in_the_map(dataset):
    edit_channel(dataset, 9, "instances", lambda a: a.__setitem__((0, 0), 1))
    edit_channel(dataset, 9, "categories", lambda a: a.__setitem__((0, 0), 3))
    assert ("masks", 9) in failures(dataset)


def test_wrong_run_lengths(dataset):
    def change(record):
        mask = dataset[1].objects[0].mask.copy()
        mask[mask.any(axis=1).argmax()] = False
        record["objects"][0]["rle"]["counts"] = encode_rle(mask)

    edit_record(dataset, 1, change)
    assert {("masks", 1), ("boxes", 1)} <= failures(dataset)


def test_run_lengths_that_are_none(dataset):
    edit_record(dataset, 1, lambda r: r["objects"][0]["rle"].update(counts="?!"))
    assert ("masks", 1) in failures(dataset)


def test_run_lengths_that_are_none_where_there_is_no_map(tmp_path):
    dataset = make(tmp_path, channels=("rgb",))
    edit_record(dataset, 1, lambda r: r["objects"][0]["rle"].update(counts="?!"))
    assert {("masks", 1), ("boxes", 1)} <= failures(dataset)


@pytest.mark.parametrize("text", ["", "{}"])
def test_a_model_without_its_facts(dataset, text):
    (dataset.store.model_folder("block-1") / "model.json").write_text(text)
    assert failures(dataset) == {("counts", None)}


@pytest.mark.parametrize(("key", "value"), [("area", 7), ("visibility", 0.0), ("truncation", 1.5)])
def test_a_wrong_number_of_pixels(dataset, key, value):
    edit_record(dataset, 1, lambda r: r["objects"][0].update({key: value}))
    assert ("masks", 1) in failures(dataset)


@pytest.mark.parametrize("name", ["box2d", "box2d_projected", "box2d_unclipped"])
def test_a_wrong_2d_box(dataset, name):
    def change(record):
        box = record["objects"][0][name]
        record["objects"][0][name] = [box[0] + 2, *box[1:]]

    edit_record(dataset, 3, change)
    assert failures(dataset) == {("boxes", 3)}


@pytest.mark.parametrize("name", ["box3d_object", "box3d", "box3d_camera", "box3d_pixels", "camera_from_object"])
def test_a_wrong_3d_box_or_pose(dataset, name):
    def change(record):
        record["objects"][0][name][1][1] += 3e-6

    edit_record(dataset, 3, change)
    assert ("projection", 3) in failures(dataset)


def test_a_vertex_that_is_not_behind(dataset):
    def change(record):
        record["objects"][0]["box3d_in_front"][0] = False

    edit_record(dataset, 3, change)
    assert failures(dataset) == {("projection", 3)}


def test_a_wrong_quaternion_and_size(dataset):
    edit_record(dataset, 3, lambda r: r["objects"][0].update(quaternion=[1, 0, 0, 0]))
    edit_record(dataset, 4, lambda r: r["objects"][0].update(size=[1, 2, 3]))
    assert failures(dataset) == {("projection", 3), ("projection", 4)}


def test_a_wrong_camera(dataset):
    edit_record(dataset, 3, lambda r: r["camera"]["t"].__setitem__(2, 2.5))
    assert {("projection", 3), ("poses", 3)} <= failures(dataset)


@pytest.mark.parametrize("name", ["azimuth_deg", "elevation_deg", "tilt_deg", "distance"])
def test_a_wrong_pose(dataset, name):
    edit_record(dataset, 3, lambda r: r["pose"].update({name: r["pose"][name] + 0.01}))
    assert failures(dataset) == {("poses", 3)}


def test_a_wrong_view(dataset):
    edit_record(dataset, 3, lambda r: r["objects"][0]["view"].update(azimuth_deg=11))
    assert failures(dataset) == {("poses", 3)}


def test_depth_that_is_not_the_models(dataset):
    edit_channel(dataset, 7, "depth", lambda a: a.__imul__(np.float32(1.001)))
    assert failures(dataset) == {("surface", 7)}
    assert failures(dataset, rays=False) == set()


def test_another_model_than_was_drawn(dataset):
    shutil.copy(dataset.path("store/models/block-2/block-2.glb"), dataset.path("store/models/block-0/block-0.glb"))
    assert failures(dataset) == {("surface", i) for i in range(4)}


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (IndexError("7"), "expected data that can be checked, found IndexError: 7"),
        (RuntimeError("no luck"), "the check itself failed: RuntimeError: no luck"),
    ],
)
def test_a_proof_that_breaks_off_blames_the_data_only_for_what_data_causes(whole, monkeypatch, error, message):
    def broken(*_):
        raise error

    monkeypatch.setitem(FRAME_PROOFS, "boxes", broken)
    findings = check(whole, rays=False).findings
    assert {(f.check, f.message) for f in findings} == {("boxes", message)}
    assert len(findings) == len(whole)


def test_findings_say_where(dataset):
    edit_record(dataset, 3, lambda r: r["objects"][0].update(area=1))
    finding = next(f for f in check(dataset, rays=False).findings if f.check == "masks")
    assert str(finding).startswith("masks: frame 3: object 1: expected area")
    assert viewsphere.check.Finding("counts", None, "x").__str__() == "counts: x"
