"""Data sets of other tools in other formats, with nothing else left behind."""

import json
import re
import shutil

import numpy as np
import pytest
from test_import import coco, damage

import viewsphere as vs
from command_line import viewsphere
from quick import quick
from small import tree_hash
from viewsphere import Dataset
from viewsphere.check import check
from viewsphere.errors import StoreError, UserError
from viewsphere.run.datasets import converting
from viewsphere.run.datasets.importing import import_dataset
from viewsphere.run.exports.exporting import export, writable
from viewsphere.run.exports.writable import writable_formats

TAKEN = {"coco", "csv", "driving_in_the_matrix", "fiftyone", "hdf5", "huggingface", "imagefolder", "kitti", "voc", "webdataset"}
"""The formats, with YOLO's, that hold pictures of which nobody knows the camera."""


@pytest.fixture(scope="module")
def photos(tmp_path_factory):
    return coco(tmp_path_factory.mktemp("photos") / "real")


def names_in(folder):
    return sorted(path.name for path in folder.iterdir())


def test_what_is_converted_is_what_would_be_imported_and_exported(photos, tmp_path):
    made = vs.convert("coco", photos, "yolo,voc", tmp_path / "out")
    assert (made.frames, made.left_out, made.notes) == (3, (), ())
    import_dataset("coco", photos, tmp_path / "store")
    export(tmp_path / "store", "yolo,voc", output=tmp_path / "long")
    assert tree_hash(tmp_path / "out") == tree_hash(tmp_path / "long")
    assert names_in(tmp_path) == ["long", "out", "store"] and names_in(tmp_path / "out") == ["voc", "yolo"]


@pytest.mark.parametrize("kind", ["yolo", "voc"])
def test_what_was_converted_can_be_converted_back_without_its_source(kind, photos, tmp_path):
    source = shutil.copytree(photos, tmp_path / "real")
    vs.convert("coco", source, kind, tmp_path / "there")
    shutil.rmtree(source)
    vs.convert(kind, tmp_path / "there" / kind, ["coco"], tmp_path / "back")
    shutil.rmtree(tmp_path / "there")
    assert not any(path.is_symlink() for path in (tmp_path / "back").rglob("*"))
    back = json.loads((tmp_path / "back" / "coco" / "annotations" / "instances_train.json").read_text())
    was = json.loads((photos / "annotations" / "instances_train.json").read_text())
    named, before = ({c["id"]: c["name"] for c in data["categories"]} for data in (back, was))
    boxes = sorted((named[a["category_id"]], a["bbox"]) for a in back["annotations"])
    assert [name for name, _ in boxes] == sorted(before[a["category_id"]] for a in was["annotations"])
    for image, old in zip(back["images"], was["images"], strict=True):
        copy = tmp_path / "back" / "coco" / "images" / "train" / image["file_name"]
        assert copy.read_bytes() == (photos / "train" / old["file_name"]).read_bytes()


def test_depth_and_poses_of_bop_become_those_of_others(small_run, tmp_path):
    export(small_run, "bop", output=tmp_path / "made")
    vs.convert("bop", tmp_path / "made" / "bop", "tum,bop", tmp_path / "out")
    import_dataset("bop", tmp_path / "made" / "bop", tmp_path / "once")
    import_dataset("bop", tmp_path / "out" / "bop", tmp_path / "again")
    for sample, was in zip(Dataset(tmp_path / "again"), Dataset(tmp_path / "once"), strict=True):
        assert np.abs(sample.depth - was.depth).max() <= 0.5e-3
        assert sample.objects[0].rle == was.objects[0].rle and sample.split == was.split
        assert np.abs(sample.objects[0].camera_from_object - was.objects[0].camera_from_object).max() < 1e-12
    assert len(list((tmp_path / "out" / "tum").rglob("groundtruth.txt"))) == 1


def test_all_that_formats_cannot_hold_is_told_at_once_and_nothing_is_written(photos, tmp_path):
    answer = viewsphere("convert", photos, "--from", "coco", "--to", "tum,yolo,flyingthings", "-o", tmp_path / "out")
    tum, flying = answer.stderr.splitlines()
    assert answer.returncode == 2
    assert tum == (
        f"viewsphere: {photos}: format tum: expected pictures of known cameras; found imported ones, and expected depth of all "
        "pictures; found rgb of imported ones"
    )
    assert flying.startswith(f"viewsphere: {photos}: format flyingthings: expected sequences (a recipe's time); found imported")
    assert names_in(tmp_path) == []


@pytest.mark.parametrize("name", quick(writable_formats(), *sorted(TAKEN), *writable_formats()[::3]))
def test_every_format_holds_imported_pictures_or_says_why_not(name, photos, tmp_path):
    try:
        writable(name)
    except UserError as lacking:
        pytest.skip(str(lacking))
    import_dataset("coco", photos, tmp_path / "out")
    before = tree_hash(tmp_path / "out")
    if name in {*TAKEN, "yolo"}:
        export(tmp_path / "out", name)
        report = check(Dataset(tmp_path / "out"))
        assert report.ok, report.findings
        assert vs.convert("coco", photos, name, tmp_path / "converted").frames == 3
        return
    with pytest.raises(UserError) as refused:
        export(tmp_path / "out", name)
    (line,) = str(refused.value).splitlines()
    assert line.startswith(f"{tmp_path / 'out'}: format {name}: expected ") and "; found " in line
    assert tree_hash(tmp_path / "out") == before
    with pytest.raises(UserError) as refused:
        vs.convert("coco", photos, name, tmp_path / "converted")
    assert str(refused.value) == line.replace(str(tmp_path / "out"), str(photos), 1)
    assert not (tmp_path / "converted").exists()


def test_what_is_broken_is_refused_or_left_out(tmp_path):
    source = coco(tmp_path / "real", damage(("annotations", 1, "category_id"), 4))
    words = ("convert", source, "--from", "coco", "--to", "yolo", "-o", tmp_path / "out")
    answer = viewsphere(*words)
    assert (answer.returncode, names_in(tmp_path)) == (2, ["real"])
    assert "annotation 51: expected the id of a category; found 4" in answer.stderr
    answer = viewsphere(*words, "--keep-going", "--workers", "0")
    assert answer.returncode == 0 and answer.stdout.splitlines()[-1] == f"wrote {tmp_path / 'out' / 'yolo'}"
    assert "left out " in answer.stderr
    answer = viewsphere(*words[:-1], tmp_path / "other", "--keep-going", "--json", "--workers", "0")
    told = json.loads(answer.stdout)
    assert (told["formats"], told["frames"], len(told["left_out"])) == (["yolo"], 3, 1)


def test_options_of_formats_are_asked_for_as_elsewhere(photos, tmp_path):
    words = ("convert", photos, "--from", "coco", "--to", "coco", "-o", tmp_path / "out")
    answer = viewsphere(*words, "--format-option", "coco.category_ids=coco", "--workers", "0")
    assert answer.returncode == 0
    written = json.loads((tmp_path / "out" / "coco" / "annotations" / "instances_train.json").read_text())
    assert {c["id"] for c in written["categories"]} == {17, 3}
    answer = viewsphere(*words[:-1], tmp_path / "no", "--format-option", "yolo.task=pose")
    assert answer.returncode == 2 and "--format-option yolo" in answer.stderr


@pytest.mark.parametrize("error", [KeyboardInterrupt, StoreError])
def test_what_stops_half_way_leaves_nothing(error, photos, tmp_path, monkeypatch):
    whole = converting.write

    def stopped(dataset, formats, *others):
        whole(dataset, formats, *others)
        raise error(f"{dataset.root}: full")

    monkeypatch.setattr(converting, "write", stopped)
    answer = viewsphere(
        "convert", photos, "--from", "coco", "--to", "yolo,voc", "-o", tmp_path / "new" / "out", "--workers", "0"
    )
    told = {KeyboardInterrupt: (130, "stopped; nothing was written"), StoreError: (2, f"viewsphere: {photos}: full")}
    assert (answer.returncode, answer.stderr.splitlines()[-1]) == told[error]
    assert names_in(tmp_path) == []


def test_a_run_that_was_killed_between_two_folders_can_be_repeated(photos, tmp_path):
    vs.convert("coco", photos, ["voc", "yolo"], tmp_path / "whole")
    vs.convert("coco", photos, ["voc"], tmp_path / "out")  # as far as the killed run came
    before = tree_hash(tmp_path / "out" / "voc")
    vs.convert("coco", photos, ["voc", "yolo"], tmp_path / "out")
    assert tree_hash(tmp_path / "out") == tree_hash(tmp_path / "whole") and names_in(tmp_path / "out") == ["voc", "yolo"]
    label = next((tmp_path / "out" / "voc").rglob("*.xml"))
    label.write_bytes(label.read_bytes().replace(b"<", b" <", 1))
    with pytest.raises(StoreError, match="voc: this folder holds another data set"):
        vs.convert("coco", photos, ["voc"], tmp_path / "out")
    assert tree_hash(tmp_path / "out" / "voc") != before and names_in(tmp_path / "out") == ["voc", "yolo"]


def meanwhile(run):
    """A listener that does something once, while a run is at work."""
    runs = [run]
    return lambda progress: runs.pop()() if runs else None


@pytest.mark.parametrize("formats", [["voc", "yolo"], ["yolo", "voc"]])
def test_two_runs_at_the_same_time_both_end_with_the_same_folders(formats, photos, tmp_path):
    out = tmp_path / "out"
    other = meanwhile(lambda: vs.convert("coco", photos, formats, out))
    vs.convert("coco", photos, ["voc", "yolo"], out, listener=other)
    vs.convert("coco", photos, ["voc", "yolo"], tmp_path / "whole")
    assert tree_hash(out) == tree_hash(tmp_path / "whole") and names_in(out) == ["voc", "yolo"]


def test_of_two_runs_with_other_pictures_the_later_one_is_refused(photos, tmp_path):
    out, fewer = tmp_path / "out", tmp_path / "fewer"
    shutil.copytree(photos, fewer)
    listed = next(fewer.rglob("*.json"))
    value = json.loads(listed.read_text())
    value["annotations"] = []
    listed.write_text(json.dumps(value))
    other = meanwhile(lambda: vs.convert("coco", fewer, ["voc", "csv"], out))
    with pytest.raises(StoreError, match="this folder holds another data set"):
        vs.convert("coco", photos, ["csv", "voc"], out, listener=other)
    vs.convert("coco", fewer, ["csv", "voc"], tmp_path / "whole")
    assert tree_hash(out) == tree_hash(tmp_path / "whole") and names_in(out) == ["csv", "voc"]


def test_other_files_stay_and_are_named(photos, tmp_path):
    (tmp_path / "out" / "yolo").mkdir(parents=True)
    (tmp_path / "out" / "yolo" / "mine.txt").write_text("mine")
    with pytest.raises(StoreError, match=r"yolo: expected an empty or new folder, found other files"):
        vs.convert("coco", photos, ["voc", "yolo"], tmp_path / "out")
    assert names_in(tmp_path / "out") == ["yolo"] and names_in(tmp_path / "out" / "yolo") == ["mine.txt"]
    vs.convert("coco", photos, ["voc"], tmp_path / "out")
    assert names_in(tmp_path / "out") == ["voc", "yolo"]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--to", "yolo", "-o", "out"), r"--from: expected one of bop, coco, .*; found none"),
        (("--from", "coco", "-o", "out"), r"--to: expected one or more of airsim, .*; found none"),
        (("--from", "coco", "--to", "yolo"), r"-o: expected a folder for the formats' folders; found none"),
        (("--from", "imagefolder", "--to", "yolo", "-o", "out"), r"--from: 'imagefolder' is unknown\. Valid: bop, coco, .*"),
        (("--from", "coco", "--to", "yol", "-o", "out"), r"--to: 'yol' is unknown; did you mean 'yolo'"),
        (("--from", "yolo", "--to", "voc", "-o", "out"), r"real: expected a YOLO data set \(data.yaml\); found no such file"),
    ],
)
def test_mistakes_are_told_in_one_line(words, told, photos, tmp_path):
    answer = viewsphere("convert", photos, *words, cwd=tmp_path)
    (line,) = answer.stderr.splitlines()
    assert answer.returncode == 2 and re.search(told, line)
    assert names_in(tmp_path) == []
