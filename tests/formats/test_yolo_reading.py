"""YOLO data sets that were made elsewhere: what is read goes out equal as YOLO and as COCO; every mistake is told in a line."""

from __future__ import annotations

import json
import shutil

import numpy as np
import pytest
import yaml
from PIL import Image
from pycocotools.coco import COCO

from proven import close, equal
from small import tree_hash
from viewsphere import Dataset
from viewsphere.check import check
from viewsphere.errors import StoreError
from viewsphere.run.datasets.importing import import_dataset
from viewsphere.run.exports.exporting import export

SIZES = {"train/a": (40, 30), "train/deep/b": (64, 48), "val/c d": (33, 21)}
NAMES = ["cat", 'd\'été "à"', "日本"]
LINES = {
    "detect": {"train/a": ["0 0.5 0.5 0.25 0.5", "2 0.1 0.2 0.05 0.1"], "val/c d": ["1 0.5 0.5 1 1"]},
    "segment": {
        "train/a": ["0 0.1 0.1 0.9 0.1 0.5 0.8", "2 0.2 0.2 0.6 0.25 0.65 0.6 0.4 0.7 0.2 0.6"],
        "val/c d": ["1 0.1 0.1 0.5 0.1 0.5 0.9 0.1 0.9 0.05 0.5"],
    },
    "pose": {
        "train/a": ["0 0.5 0.5 0.25 0.5 0.4 0.4 2 0.5 0.6 1 0 0 0", "2 0.1 0.2 0.05 0.1 0 0 0 0.11 0.2 2 0.12 0.22 2"],
        "val/c d": ["1 0.5 0.5 1 1 0.1 0.2 2 0.3 0.4 2 0.9 0.9 1"],
    },
    "obb": {"train/a": ["0 0.5 0.1 0.8 0.4 0.5 0.7 0.2 0.4", "2 0.1 0.1 0.2 0.1 0.2 0.2 0.1 0.2"]},
}
POINTS = {"kpt_shape": [3, 3], "flip_idx": [0, 2, 1], "kpt_names": {0: ["nose", "left ear", "right ear"]}}


def data_set(folder, task="detect", **told):
    """A data set as people have them: JPEG and PNG, folders in folders, a picture without labels, names of all sorts."""
    rng = np.random.default_rng(4)
    for name, (width, height) in SIZES.items():
        file = folder / "images" / f"{name}.{'png' if 'b' in name else 'jpg'}"
        file.parent.mkdir(parents=True, exist_ok=True)
        Image.fromarray(rng.integers(0, 255, (height, width, 3), np.uint8)).save(file)
    for name, rows in LINES[task].items():
        file = folder / "labels" / f"{name}.txt"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("".join(f"{row}\n" for row in rows))
    data = {"path": "../datasets/mine", "train": "images/train", "val": "images/val", "nc": 3, "names": NAMES}
    data |= (POINTS if task == "pose" else {}) | told
    (folder / "data.yaml").write_text(yaml.safe_dump(data, allow_unicode=True, sort_keys=False))
    return folder


def rows_of(folder):
    return [[list(map(float, row.split())) for row in file.read_text().splitlines()] for file in sorted(folder.rglob("*.txt"))]


@pytest.mark.parametrize("task", LINES)
def test_what_is_read_goes_out_equal(task, tmp_path):
    source = data_set(tmp_path / "mine", task)
    before = tree_hash(source)
    foreign = import_dataset("yolo", source, tmp_path / "out")
    assert (foreign.name, foreign.count, foreign.splits, foreign.left_out) == ("mine", 3, ("train", "val"), ())
    assert [category.name for category in Dataset(tmp_path / "out").categories] == NAMES
    export(tmp_path / "out", [{"yolo": {"task": task}}])
    told = yaml.safe_load((tmp_path / "out/yolo/data.yaml").read_text("utf-8"))
    assert list(told["names"].values()) == NAMES
    if task == "pose":
        assert told["kpt_shape"] == [3, 3] and told["flip_idx"] == [0, 2, 1]
        assert told["kpt_names"][2] == POINTS["kpt_names"][0]
    found = [rows for rows in rows_of(tmp_path / "out/yolo/labels") if rows]
    for mine, its in zip(found, rows_of(source / "labels"), strict=True):
        for row, expected in zip(mine, its, strict=True):
            close("yolo", f"import, {task}", row, expected, "share", atol=1e-8)
    assert tree_hash(source) == before
    report = check(Dataset(tmp_path / "out"))
    assert report.ok, report.findings


@pytest.mark.slow
def test_an_export_comes_back_byte_for_byte(stills, tmp_path):
    for task in LINES:
        export(stills.root, [{"yolo": {"task": task}}], output=tmp_path / task)
        import_dataset("yolo", tmp_path / task / "yolo", tmp_path / f"{task}-in")
        export(tmp_path / f"{task}-in", [{"yolo": {"task": task}}], output=tmp_path / f"{task}-again")
        index = {}
        for sample in Dataset(tmp_path / f"{task}-in"):
            index[f"{sample.index:08d}"] = sample.source["file_name"].rpartition("/")[2][:8]
        for file in (tmp_path / f"{task}-again/yolo/labels").rglob("*.txt"):
            was = tmp_path / task / "yolo/labels" / file.parent.name / f"{index[file.stem]}.txt"
            mine, its = rows_of_file(file), rows_of_file(was)
            assert len(mine) == len(its)
            for row, expected in zip(mine, its, strict=True):
                close("yolo", "export, import, export", row, expected, "share", atol=2e-8)
        told, again = (yaml.safe_load((tmp_path / f"{task}{end}/yolo/data.yaml").read_text()) for end in ("", "-again"))
        assert told == again


def rows_of_file(file):
    return [list(map(float, row.split())) for row in file.read_text().splitlines()]


@pytest.mark.parametrize("task", LINES)
def test_coco_has_the_same_pixels(task, tmp_path):
    import_dataset("yolo", data_set(tmp_path / "mine", task), tmp_path / "out")
    export(tmp_path / "out", "coco")
    found = 0
    for split in ("train", "val"):
        coco = COCO(tmp_path / f"out/coco/annotations/instances_{split}.json")
        for image in coco.imgs.values():
            name = image["imported_file_name"].removeprefix("images/").rpartition(".")[0]
            rows, size = LINES[task].get(name, []), np.array(SIZES[name])
            assert (image["width"], image["height"]) == SIZES[name]
            for a, row in zip(coco.imgToAnns[image["id"]], rows, strict=True):
                number, *values = map(float, row.split())
                equal("yolo", "import, pycocotools: classes", coco.cats[a["category_id"]]["name"], NAMES[int(number)])
                found += 1
                if task in ("detect", "pose"):
                    x, y, w, h = np.array(values[:4]) * np.tile(size, 2)
                    close("yolo", "import, pycocotools: boxes", a["bbox"], [x - w / 2, y - h / 2, w, h], "px", atol=1e-9)
                else:
                    corners = np.reshape(values, (-1, 2)) * size
                    close("yolo", "import, pycocotools: polygons", a["segmentation"][0], corners.ravel(), "px", atol=1e-9)
                    assert abs(coco.annToMask(a).sum() - a["area"]) < 0.2 * a["area"] + 6
                if task == "pose":
                    points = np.reshape(values[4:], (3, 3)) * [*size, 1]
                    points[points[:, 2] > 0, :2] -= 0.5  # COCO's whole numbers are the centres of pixels
                    close("yolo", "import, pycocotools: points", np.reshape(a["keypoints"], (3, 3)), points, "px", atol=1e-9)
                    assert a["num_keypoints"] == (points[:, 2] > 0).sum()
                    assert tuple(coco.cats[a["category_id"]]["keypoints"]) == tuple(POINTS["kpt_names"][0])
    assert found == sum(map(len, LINES[task].values()))


def test_points_without_a_third_number(tmp_path):
    source = data_set(tmp_path / "mine", kpt_shape=[2, 2])
    (source / "labels/train/a.txt").write_text("0 0.5 0.5 0.2 0.2 0.4 0.5 0 0\n1 0.5 0.5 0.2 0.2\n")
    import_dataset("yolo", source / "data.yaml", tmp_path / "out")
    one, other = next(iter(Dataset(tmp_path / "out"))).objects
    assert one.keypoint_names == ("0", "1") and one.keypoint_states.tolist() == [0, 3]
    close("yolo", "import: points", one.keypoints[0], [16, 15], "px", atol=1e-12)
    assert np.isnan(one.keypoints[1]).all() and "keypoints" not in other.extra


def test_lists_of_pictures_and_paths_as_others_write_them(tmp_path):
    source = data_set(tmp_path / "mine", train="list.txt", val=["../images/val"], test=None, extra="images/train/deep")
    (source / "list.txt").write_text("./images/train/a.jpg\n\nimages/train/deep/b.png\n")
    foreign = import_dataset("yolo", source, tmp_path / "out")
    assert [sample.split for sample in Dataset(tmp_path / "out")] == ["train", "train", "val"]
    assert foreign.splits == ("train", "val")
    shutil.copytree(source / "images", tmp_path / "other/sub/images")
    (tmp_path / "other/mine.yaml").write_text("path: sub\ntrain: images/train\nval: images/val\nnames: {0: a}\n")
    assert import_dataset("yolo", tmp_path / "other", tmp_path / "out2").count == 3


BROKEN = {
    "0 0.5 0.5 0.2": "expected a class and 4 numbers, or x and y of three corners or more; found 3 numbers",
    "0 0.1 0.1 0.2 0.2 0.3": "expected a class and 4 numbers, or x and y of three corners or more; found 5 numbers",
    "0 0.5 x 0.2 0.2": "expected numbers; found '0 0.5 x 0.2 0.2'",
    "3 0.5 0.5 0.2 0.2": "expected a class from 0 to 2; found '3'",
    "-1 0.5 0.5 0.2 0.2": "expected a class from 0 to 2; found '-1'",
    "0.5 0.5 0.5 0.2 0.2": "expected a class from 0 to 2; found '0.5'",
    "nan 0.5 0.5 0.2 0.2": "expected a class from 0 to 2; found 'nan'",
    "0 nan 0.5 0.2 0.2": "expected finite numbers; found '0 nan 0.5 0.2 0.2'",
    "0 20 15 10 10": "expected shares of the picture, 0 to 1; found '0 20 15 10 10'",
    "0 0.5 0.5 -0.005 0.2": "expected a width and a height from 0 on; found -0.005, 0.2",
    "0": "expected a class and 4 numbers, or x and y of three corners or more; found 0 numbers",
}


def test_broken_lines_are_told_or_left_out(tmp_path):
    source = data_set(tmp_path / "mine")
    file = source / "labels/train/a.txt"
    file.write_text("\n".join(["0 0.5 0.5 0.25 0.5", *BROKEN, "1 0.2 0.2 0.1 0.1"]))
    with pytest.raises(StoreError) as error:
        import_dataset("yolo", source, tmp_path / "out")
    told = str(error.value).splitlines()
    assert len(told) == 12 and told[10] == "and 1 more"
    for number, (line, message) in enumerate(zip(told[:10], BROKEN.values(), strict=False), 2):
        assert line == f"{file}: line {number}: {message}"
    assert told[-1] == "mend them, or leave them out with --keep-going" and not (tmp_path / "out").exists()
    foreign = import_dataset("yolo", source, tmp_path / "out", keep_going=True)
    assert len(foreign.left_out) == len(BROKEN)
    assert [o.category for o in next(iter(Dataset(tmp_path / "out"))).objects] == ["cat", NAMES[1]]


def test_points_that_are_none(tmp_path):
    source = data_set(tmp_path / "mine", "pose")
    file = source / "labels/train/a.txt"
    file.write_text("0 0.5 0.5 0.2 0.2 0.1 0.1 2\n0 0.5 0.5 0.2 0.2 0.1 0.1 3 0 0 0 0 0 0\n")
    foreign = import_dataset("yolo", source, tmp_path / "out", keep_going=True)
    assert foreign.left_out == (
        f"{file}: line 1: expected a class and 4 or 13 numbers; found 7",
        f"{file}: line 2: expected points that are 0, 1 or 2; found [3.0, 0.0, 0.0]",
    )


def test_pictures_that_are_missing_or_no_pictures(tmp_path):
    source = data_set(tmp_path / "mine")
    (source / "images/val/c d.jpg").unlink()
    (source / "images/train/deep/b.png").write_bytes(b"no picture")
    with pytest.raises(StoreError) as error:
        import_dataset("yolo", source, tmp_path / "out")
    first, second, _ = str(error.value).splitlines()
    assert first.startswith(f"{source}/data.yaml: train: expected a picture that can be read; found images/train/deep/b.png: ")
    where = source / "images/val"
    assert second == f"{source}/labels/val/c d.txt: expected a picture of these labels; found none in {where}"
    assert import_dataset("yolo", source, tmp_path / "out", keep_going=True).count == 1


@pytest.mark.parametrize("place", ["/etc", "../secret", "images/../../secret", "C:\\secret", "nowhere", 7])
def test_splits_that_lead_outside_or_nowhere(place, tmp_path):
    (tmp_path / "secret").mkdir()
    source = data_set(tmp_path / "mine", train=place)
    with pytest.raises(StoreError, match=r"data\.yaml: train: expected a folder or a list of pictures below; found "):
        import_dataset("yolo", source, tmp_path / "out")
    assert import_dataset("yolo", source, tmp_path / "out", keep_going=True).splits == ("val",)


def test_links_and_lists_that_lead_outside(tmp_path):
    Image.new("RGB", (8, 8)).save(tmp_path / "secret.png")
    source = data_set(tmp_path / "mine", train="list.txt")
    (source / "images/val/link.png").symlink_to(tmp_path / "secret.png")
    (source / "list.txt").write_text(f"images/train/a.jpg\n../secret.png\n{tmp_path}/secret.png\n")
    with pytest.raises(StoreError) as error:
        import_dataset("yolo", source, tmp_path / "out")
    told = str(error.value).splitlines()
    assert told[0] == f"{source}/list.txt: expected a picture below the folder; found no '../secret.png'"
    assert "secret.png'" in told[1] and "found a link that leads out of it" in told[2] and len(told) == 4
    assert import_dataset("yolo", source, tmp_path / "out", keep_going=True).count == 2
    secret = (tmp_path / "secret.png").stat().st_ino
    assert not [path for path in (tmp_path / "out").rglob("*") if path.stat().st_ino == secret]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("train: [", "expected YOLO's YAML; found: "),
        ("- 1", "expected names and folders of pictures; found something else"),
        ("train: images/train", "expected names, a list of different texts or a mapping from 0 on; found None"),
        ("names: [a, a]", "expected names, .*; found "),
        ("names: {1: a}", "expected names, .*; found "),
        ("names: [1, 2]", "expected names, .*; found "),
        ("names: [a]\nkpt_shape: [0, 3]", r"expected kpt_shape \[number, 2 or 3\]; found \[0, 3\]"),
        ("names: [a]\nkpt_shape: [2, 3]\nflip_idx: [0, 0]", r"expected flip_idx, every point's number once; found \[0, 0\]"),
        ("names: [a]\nkpt_shape: [2, 3]\nkpt_names: {0: [b]}", "expected kpt_names, 2 different names for each class; found "),
        ("names: [a]\ntrain: empty", "expected pictures that can be used; found none"),
    ],
)
def test_descriptions_that_are_none(text, message, tmp_path):
    (tmp_path / "mine/empty").mkdir(parents=True)
    (tmp_path / "mine/data.yaml").write_text(text)
    with pytest.raises(StoreError, match=f"data.yaml: {message}") as error:
        import_dataset("yolo", tmp_path / "mine", tmp_path / "out")
    assert "\n" not in str(error.value)
    with pytest.raises(StoreError, match=r"expected a YOLO data set \(data.yaml\); found no such file"):
        import_dataset("yolo", tmp_path / "mine/empty", tmp_path / "out")


def test_coco_and_yolo_of_one_import_agree(tmp_path):
    """Polygons of a COCO data set go out as YOLO's, and come back."""
    import_dataset("yolo", data_set(tmp_path / "mine", "segment"), tmp_path / "one")
    export(tmp_path / "one", "coco", output=tmp_path)
    import_dataset("coco", tmp_path / "coco", tmp_path / "two")
    export(tmp_path / "two", [{"yolo": {"task": "segment"}}], output=tmp_path)
    found = [rows for rows in rows_of(tmp_path / "yolo/labels") if rows]
    for mine, its in zip(found, rows_of(tmp_path / "mine/labels"), strict=True):
        for row, expected in zip(mine, its, strict=True):
            close("yolo", "import, coco, import, yolo", row, expected, "share", atol=1e-8)
    assert json.loads((tmp_path / "coco/annotations/instances_val.json").read_text())["annotations"]
