"""What COCO's files say of themselves comes in and goes out: info, licences, points; and pictures with EXIF's tag."""

import json

import numpy as np
import pytest
from PIL import Image

from viewsphere import Dataset
from viewsphere.check import check
from viewsphere.errors import StoreError
from viewsphere.formats.shared.reading.exif import shown_size, upright
from viewsphere.run.datasets.importing import import_dataset
from viewsphere.run.datasets.merging import merge
from viewsphere.run.exports.exporting import export

ORIENTATION = 0x0112
PERSON = {"keypoints": ["nose", "tail", "paw"], "skeleton": [[3, 1], [1, 2]], "color": "red"}
LICENCES = [{"id": 4, "name": "CC BY", "url": "https://x"}, {"id": 9, "name": "CC0"}]


def picture(seed, size=(40, 30)):
    return Image.fromarray(np.random.default_rng(seed).integers(0, 255, (size[1], size[0], 3), np.uint8))


def split(folder, name, licences, points=PERSON, **info):
    """One split with two pictures of two licences, and a cat with three points, one hidden and one not labelled."""
    (folder / "annotations").mkdir(parents=True, exist_ok=True)
    (folder / name).mkdir()
    images = [
        {"id": i, "file_name": f"{i}.png", "width": 40, "height": 30, "license": one["id"]} for i, one in enumerate(licences, 1)
    ]
    for image in images:
        picture(image["id"]).save(folder / name / image["file_name"])
    cat = {"id": 1, "image_id": 1, "category_id": 2, "bbox": [3, 4, 5, 6], "area": 30.0, "iscrowd": 0, "num_keypoints": 2}
    data = {
        "info": {"year": 2017, "split": name, **info},
        "licenses": licences,
        "images": images,
        "annotations": [{**cat, "keypoints": [3, 4, 2, 0, 0, 0, 7.25, 9, 1]}],
        "categories": [
            {"id": 2, "name": "cat", "supercategory": "animal", **points},
            {"id": 3, "name": "hat", "supercategory": ""},
        ],
    }
    (folder / "annotations" / f"person_keypoints_{name}.json").write_text(json.dumps(data))
    return data


def exported(out, name="train"):
    export(out, [{"coco": {"category_ids": "coco"}}])
    report = check(Dataset(out))
    assert report.ok, report.findings
    return json.loads((out / "coco" / "annotations" / f"instances_{name}.json").read_text())


def test_what_files_say_of_themselves_goes_out_as_it_came(tmp_path):
    told = {name: split(tmp_path / "real", name, LICENCES) for name in ("train", "val")}
    import_dataset("coco", tmp_path / "real", tmp_path / "out")
    for name, was in told.items():
        now = (
            exported(tmp_path / "out", name)
            if name == "train"
            else json.loads((tmp_path / "out" / "coco" / "annotations" / f"instances_{name}.json").read_text())
        )
        assert (now["info"], now["licenses"]) == (was["info"], LICENCES)
        assert now["categories"] == was["categories"]
        assert [image["license"] for image in now["images"]] == [4, 9]
        assert now["annotations"][0]["keypoints"] == was["annotations"][0]["keypoints"]


def test_points_are_the_label_keypoints_half_a_pixel_on(tmp_path):
    split(tmp_path / "real", "train", LICENCES)
    import_dataset("coco", tmp_path / "real", tmp_path / "out")
    (cat,) = Dataset(tmp_path / "out")[0].objects
    assert tuple(cat.keypoint_names) == ("nose", "tail", "paw")
    np.testing.assert_array_equal(cat.keypoints, [[3.5, 4.5], [np.nan, np.nan], [7.75, 9.5]])
    np.testing.assert_array_equal(cat.keypoint_states, [0, 3, 1])


def test_licences_and_points_of_merged_data_sets_stay_their_own(tmp_path):
    other = [{"id": 4, "name": "MIT", "url": ""}, {"id": 2, "name": "CC BY", "url": "https://x"}]
    split(tmp_path / "a", "train", LICENCES, version="a")
    split(tmp_path / "b", "train", other, {"keypoints": ["tail", "nose", "ear"], "skeleton": [[1, 3]]}, version="b")
    for name in "ab":
        import_dataset("coco", tmp_path / name, tmp_path / f"{name}-ds")
    merge([tmp_path / "a-ds", tmp_path / "b-ds"], tmp_path / "out")
    now = exported(tmp_path / "out")
    assert [one["version"] for one in now["info"]["sources"]] == ["a", "b"]
    named = {one["id"]: one["name"] for one in now["licenses"]}
    assert len(named) == len(now["licenses"])
    assert [named[image["license"]] for image in now["images"]] == ["CC BY", "CC0", "MIT", "CC BY"]
    (cat,) = (one for one in now["categories"] if one["name"] == "cat")
    assert cat["keypoints"] == ["nose", "tail", "paw", "ear"]
    assert [{cat["keypoints"][i - 1] for i in line} for line in cat["skeleton"]] == [
        {"paw", "nose"},
        {"nose", "tail"},
        {"tail", "ear"},
    ]
    points = [
        dict(zip(cat["keypoints"], np.reshape(one["keypoints"], (-1, 3)).tolist(), strict=True)) for one in now["annotations"]
    ]
    assert points[0] == {"nose": [3, 4, 2], "tail": [0, 0, 0], "paw": [7.25, 9, 1], "ear": [0, 0, 0]}
    assert points[1] == {"tail": [3, 4, 2], "nose": [0, 0, 0], "ear": [7.25, 9, 1], "paw": [0, 0, 0]}
    assert [one["num_keypoints"] for one in now["annotations"]] == [2, 2]


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (
            lambda data: data["annotations"][0].update(keypoints=[1, 2, 2]),
            r"annotation 1: expected keypoints \[x, y, v, ...\] of the",
        ),
        (lambda data: data["info"].update(year=float("nan")), "expected finite numbers in info, licenses, categories"),
    ],
)
def test_points_and_heads_that_are_wrong_are_refused(tmp_path, change, told):
    data = split(tmp_path / "real", "train", LICENCES)
    change(data)
    (tmp_path / "real" / "annotations" / "person_keypoints_train.json").write_text(json.dumps(data))
    with pytest.raises(StoreError, match=told):
        import_dataset("coco", tmp_path / "real", tmp_path / "out")
    assert not (tmp_path / "out").exists()


STORED = {  # of EXIF 2.32, table 4: where the stored rows and columns are in what is shown
    1: lambda shown: shown,
    2: lambda shown: shown[:, ::-1],
    3: lambda shown: shown[::-1, ::-1],
    4: lambda shown: shown[::-1],
    5: lambda shown: shown.swapaxes(0, 1),
    6: lambda shown: shown.swapaxes(0, 1)[::-1],
    7: lambda shown: shown[::-1, ::-1].swapaxes(0, 1),
    8: lambda shown: shown.swapaxes(0, 1)[:, ::-1],
}


def tagged(file, shown, orientation):
    stored = Image.fromarray(np.ascontiguousarray(STORED[orientation](shown)))
    exif = Image.Exif()
    exif[ORIENTATION] = orientation
    stored.save(file, exif=exif)
    return np.asarray(stored)


@pytest.mark.parametrize("orientation", STORED)
def test_pictures_come_in_as_they_are_shown(tmp_path, orientation):
    data, shown = split(tmp_path / "real", "train", LICENCES), np.asarray(picture(7))
    tagged(tmp_path / "real" / "train" / "1.png", shown, orientation)
    import_dataset("coco", tmp_path / "real", tmp_path / "out")
    first = Dataset(tmp_path / "out")[0]
    np.testing.assert_array_equal(first.rgb, shown)
    now = exported(tmp_path / "out")
    with Image.open(tmp_path / "out" / "coco" / "images" / "train" / now["images"][0]["file_name"]) as file:
        assert file.getexif().get(ORIENTATION, 1) == 1
        np.testing.assert_array_equal(np.asarray(file), shown)
    assert [now["images"][0][key] for key in ("width", "height")] == [40, 30]
    assert now["annotations"][0]["bbox"] == data["annotations"][0]["bbox"]


@pytest.mark.parametrize("orientation", [5, 6, 7, 8])
def test_labels_of_the_stored_size_keep_the_stored_pixels(tmp_path, orientation):
    stored = tagged(tmp_path / "a.png", np.asarray(picture(7)), orientation)
    size = stored.shape[1::-1]
    assert shown_size(tmp_path / "a.png") == size[::-1] == (40, 30)
    assert shown_size(tmp_path / "a.png", size) == size
    (tmp_path / "b.png").write_bytes(upright(tmp_path / "a.png", size).data)
    with Image.open(tmp_path / "b.png") as found:
        assert found.getexif().get(ORIENTATION, 1) == 1
        np.testing.assert_array_equal(np.asarray(found), stored)


def test_yolo_and_voc_speak_of_what_is_shown(tmp_path):
    shown = np.asarray(picture(7))
    (tmp_path / "yolo" / "images").mkdir(parents=True)
    (tmp_path / "yolo" / "labels").mkdir()
    tagged(tmp_path / "yolo" / "images" / "a.png", shown, 6)
    (tmp_path / "yolo" / "labels" / "a.txt").write_text("0 0.5 0.5 0.5 0.2\n")
    (tmp_path / "yolo" / "data.yaml").write_text("path: .\ntrain: images\nnames: {0: cat}\n")
    for folder in ("JPEGImages", "Annotations", "ImageSets/Main"):
        (tmp_path / "voc" / folder).mkdir(parents=True)
    tagged(tmp_path / "voc" / "JPEGImages" / "a.png", shown, 8)
    (tmp_path / "voc" / "ImageSets" / "Main" / "train.txt").write_text("a\n")
    box = "<xmin>11</xmin><ymin>13</ymin><xmax>30</xmax><ymax>18</ymax>"
    size = "<size><width>40</width><height>30</height><depth>3</depth></size>"
    text = f"<annotation>{size}<object><name>cat</name><bndbox>{box}</bndbox></object></annotation>"
    (tmp_path / "voc" / "Annotations" / "a.xml").write_text(text)
    for kind in ("yolo", "voc"):
        import_dataset(kind, tmp_path / kind, tmp_path / f"{kind}-ds")
        (sample,) = Dataset(tmp_path / f"{kind}-ds")
        np.testing.assert_array_equal(sample.rgb, shown)
        assert sample.objects[0].box2d == (10, 12, 30, 18)


def test_names_of_points_that_come_twice_are_no_names(tmp_path):
    data = split(tmp_path / "real", "train", LICENCES, {"keypoints": ["nose", "nose", "paw"]})
    import_dataset("coco", tmp_path / "real", tmp_path / "out")
    now = exported(tmp_path / "out")
    assert "keypoints" not in now["categories"][0]
    assert now["annotations"][0]["keypoints"] == data["annotations"][0]["keypoints"]
