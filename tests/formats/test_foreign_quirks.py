"""Trees as datumaro, supervision, FiftyOne and BlenderProc write them, made by hand: what is unlike the formats' own."""

from __future__ import annotations

import json

import numpy as np
import pytest
from PIL import Image

from proven import close, equal
from viewsphere import Dataset
from viewsphere.check import check
from viewsphere.errors import StoreError
from viewsphere.geometry.mask import encode_rle, rle_runs
from viewsphere.run.datasets.converting import convert
from viewsphere.run.datasets.importing import import_dataset

NAMES = ["traffic light", "car"]


def picture(file, size=(40, 30)):
    """A picture unlike all others, as its file is named."""
    file.parent.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(list(str(file.name).encode()))
    Image.fromarray(rng.integers(0, 255, (*size[::-1], 3), np.uint8)).save(file)


def text(file, *lines):
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")


def come_in(kind, tree, tmp_path):
    """What comes in, by the picture's split and name: which is what comes in again of what goes out."""
    import_dataset(kind, tree, tmp_path / "in")
    report = check(Dataset(tmp_path / "in"))
    assert report.ok, report.findings
    convert(kind, tree, kind, tmp_path / "out")
    import_dataset(kind, tmp_path / "out" / kind, tmp_path / "again")
    one, other = ({s.rgb.tobytes(): s for s in Dataset(tmp_path / name)} for name in ("in", "again"))
    assert one.keys() == other.keys() and len(one) == len(Dataset(tmp_path / "in"))
    for key, sample in one.items():
        assert other[key].split == sample.split
        for o, again in zip(sample.objects, other[key].objects, strict=True):
            assert o.category == again.category
            close(kind, "boxes", again.box2d, o.box2d, "px", atol=1e-5)
            equal(kind, "masks", again.mask, o.mask)
    return {(s.split, s.source["file_name"]): s.objects for s in Dataset(tmp_path / "in")}


def told(objects):
    return [(o.category, *np.round(o.box2d, 6)) for o in objects]


def coco(*names, annotations=(), **more):
    images = [{"id": i, "file_name": name, "width": 40, "height": 30, **more} for i, name in enumerate(names, 1)]
    categories = [{"id": i, "name": name, "supercategory": None} for i, name in enumerate(NAMES, 1)]
    return json.dumps({"images": images, "categories": categories, "annotations": list(annotations)})


BOX = {"id": 1, "image_id": 1, "category_id": 2, "bbox": [2.5, 3.0, 10.0, 12.25], "area": 122.5, "iscrowd": 0}


def test_datumaro_coco_of_a_split_without_objects(tmp_path):
    tree = tmp_path / "tree"
    picture(tree / "images/train/sub/a 1.jpg"), picture(tree / "images/val/b.v1.jpg")
    text(tree / "annotations/instances_train.json", coco("sub/a 1.jpg", annotations=[{**BOX, "segmentation": []}], license=0))
    text(tree / "annotations/image_info_train.json", coco("sub/a 1.jpg"))
    text(tree / "annotations/image_info_val.json", coco("b.v1.jpg"))
    text(tree / "annotations/image_info_test2017.json", coco("000000000001.jpg"))  # COCO's own, without its pictures
    found = come_in("coco", tree, tmp_path)
    assert {key: told(objects) for key, objects in found.items()} == {
        ("train", "sub/a 1.jpg"): [("car", 2.5, 3, 12.5, 15.25)],
        ("val", "b.v1.jpg"): [],
    }


def test_person_keypoints_are_annotations_of_their_split(tmp_path):
    tree = tmp_path / "tree"
    picture(tree / "images/train/a.jpg")
    pointed = {**BOX, "keypoints": [3, 4, 2, 0, 0, 0], "num_keypoints": 1}
    text(tree / "annotations/person_keypoints_train.json", coco("a.jpg", annotations=[pointed]))
    assert list(come_in("coco", tree, tmp_path)) == [("train", "a.jpg")]
    out = json.loads((tmp_path / "out/coco/annotations/instances_train.json").read_text())
    assert {key: out["annotations"][0][key] for key in pointed} == pointed


@pytest.mark.parametrize("name", ["labels", "_annotations.coco"])
def test_coco_folders_of_splits(name, tmp_path):
    """FiftyOne's, with `data`, and Roboflow's, with pictures beside the file; both as a whole and one split alone."""
    tree, inner = tmp_path / "tree", "data/" if name == "labels" else ""
    for split, file in (("train", "a.jpg"), ("valid", "b 2.jpg")):
        picture(tree / split / f"{inner}{file}")
        text(tree / split / f"{name}.json", coco(file, annotations=[BOX], license=None, coco_url=None))
    found = come_in("coco", tree, tmp_path)
    assert {key: told(objects) for key, objects in found.items()} == {
        ("train", "a.jpg"): [("car", 2.5, 3, 12.5, 15.25)],
        ("valid", "b 2.jpg"): [("car", 2.5, 3, 12.5, 15.25)],
    }
    assert import_dataset("coco", tree / "valid", tmp_path / "one").splits == ("train",)


def test_blenderproc_coco(tmp_path):
    """One file beside `images`, which its names begin with; run lengths as numbers; whole boxes."""
    tree, mask = tmp_path / "coco_data", np.zeros((30, 40), np.bool_)
    mask[5:20, 10:30], mask[8:10, 12:15] = True, False
    runs = rle_runs(30, 40, encode_rle(mask)).tolist()
    annotation = {**BOX, "segmentation": {"counts": runs, "size": [30, 40]}, "area": int(mask.sum()), "bbox": [10, 5, 20, 15]}
    for number in (0, 1):
        picture(tree / f"images/{number:06d}.jpg")
    more = {"width": 40, "height": 30}  # which it says of objects, too
    text(
        tree / "coco_annotations.json",
        coco("images/000000.jpg", "images/000001.jpg", annotations=[annotation | more], license=1, date_captured="x"),
    )
    found = come_in("coco", tree, tmp_path)
    (o,) = found["train", "images/000000.jpg"]
    assert (o.category, o.box2d, o.area) == ("car", (10, 5, 30, 20), mask.sum()) and (o.mask == mask).all()
    assert found["train", "images/000001.jpg"] == ()


LINES = ["1 0.187500 0.304167 0.250000 0.408333"]
SEEN = [("car", 2.5, 3.0, 12.5, 15.25)]


def near(objects):
    """What lines of six digits say."""
    return [(o.category, *np.round(np.array(o.box2d) * 4) / 4) for o in objects]


@pytest.mark.parametrize("described", [True, False], ids=["datumaro", "fiftyone"])
def test_darknets_lists(described, tmp_path):
    """With obj.data and paths from the program's folder; without, and with one list of all."""
    tree = tmp_path / "tree"
    text(tree / "obj.names", *NAMES)
    if described:
        text(tree / "obj.data", "classes = 2", "train = data/train.txt", "valid = data/valid.txt", "names = data/obj.names")
        places = {"train": "obj_train_data/sub/a 1", "valid": "obj_valid_data/b.v1"}
    else:
        places = {"images": "data/a 1"}
    for split, place in places.items():
        text(tree / f"{split}.txt", f"data/{place}.jpg" if described else f"{place}.jpg")
        picture(tree / f"{place}.jpg")
        (tree / f"{place}.txt").write_text(LINES[0] if split != "valid" else "")  # without an end of line
    found = come_in("yolo", tree, tmp_path)
    expected = {("train", f"{place}.jpg"): SEEN for split, place in places.items() if split != "valid"}
    expected |= {("valid", "obj_valid_data/b.v1.jpg"): []} if described else {}
    assert {key: near(objects) for key, objects in found.items()} == expected


def test_darknets_list_leads_nowhere_else(tmp_path):
    tree = tmp_path / "tree"
    text(tree / "obj.names", *NAMES)
    picture(tmp_path / "secret.jpg"), picture(tree / "a.jpg")
    text(tree / "train.txt", "a.jpg", "data/../../secret.jpg", "/etc/hostname", "data/lost.jpg")
    with pytest.raises(StoreError) as error:
        import_dataset("yolo", tree, tmp_path / "out")
    *lines, _ = str(error.value).splitlines()
    assert len(lines) == 3 and all("expected a picture below the folder; found no" in line for line in lines)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("folder", ["images", "images/val"])
def test_a_data_yaml_without_splits(folder, tmp_path):
    """As supervision writes it; in `images`, or its folders."""
    tree = tmp_path / "tree"
    text(tree / "data.yaml", "nc: 2", "names: [traffic light, car]")
    picture(tree / folder / "a 1.jpg")
    text(tree / folder.replace("images", "labels") / "a 1.txt", *LINES)
    found = come_in("yolo", tree, tmp_path)
    split = "val" if folder.endswith("val") else "train"
    assert {key: near(objects) for key, objects in found.items()} == {(split, f"{folder}/a 1.jpg"): SEEN}


def test_a_data_yaml_of_an_absolute_path(tmp_path):
    """As FiftyOne writes it: where the tree was, which may be elsewhere now, and `./` before its folders."""
    tree = tmp_path / "tree"
    places = ("train: ./images/train/", "val: ./images/val/")
    text(tree / "dataset.yaml", "names:", "  0: traffic light", "  1: car", "path: /elsewhere/yolo", *places)
    for split, name in (("train", "a.jpg"), ("val", "b.jpg")):
        picture(tree / "images" / split / name)
        text(tree / "labels" / split / f"{name[0]}.txt", *(LINES if split == "train" else ()))
    found = come_in("yolo", tree, tmp_path)
    assert {key: near(objects) for key, objects in found.items()} == {
        ("train", "images/train/a.jpg"): SEEN,
        ("val", "images/val/b.jpg"): [],
    }


def xml(name, *objects):
    """An annotation; each object a name, a box, and anything behind it."""
    rows = (
        f"<object><name>{label}</name><bndbox>"
        + "".join(f"<{key}>{value}</{key}>" for key, value in zip(("xmin", "ymin", "xmax", "ymax"), box, strict=True))
        + f"</bndbox>{more}</object>"
        for label, box, more in objects
    )
    size = "<size><width>40</width><height>30</height><depth>3</depth></size>"
    return f"<annotation><filename>{name}.jpg</filename>{size}<segmented></segmented>{''.join(rows)}</annotation>"


@pytest.mark.parametrize(("annotations", "images"), [("annotations", "images"), ("labels", "data")])
def test_voc_in_other_folders(annotations, images, tmp_path):
    """supervision's, which count from 1, and FiftyOne's."""
    tree = tmp_path / "tree"
    for name in ("a 1", "b.v1"):
        picture(tree / images / f"{name}.jpg")
    text(tree / annotations / "a 1.xml", xml("a 1", ("car", (4, 4, 12, 15), "")))
    text(tree / annotations / "b.v1.xml", xml("b.v1"))
    found = come_in("voc", tree, tmp_path)
    assert {key: told(objects) for key, objects in found.items()} == {
        ("train", "a 1.jpg"): [("car", 3, 3, 12, 15)],
        ("train", "b.v1.jpg"): [],
    }


def test_supervisions_polygons(tmp_path):
    """One an object, its corners the middles of pixels, counted from 1."""
    tree, corners = tmp_path / "tree", (11, 6, 11, 20, 30, 20, 30, 6)
    polygon = "".join(f"<{'xy'[i % 2]}{i // 2 + 1}>{value}</{'xy'[i % 2]}{i // 2 + 1}>" for i, value in enumerate(corners))
    picture(tree / "images/a.jpg")
    text(tree / "annotations/a.xml", xml("a", ("car", (11, 6, 30, 20), f"<polygon>{polygon}</polygon>")))
    ((o,),) = come_in("voc", tree, tmp_path).values()
    assert o.source["segmentation"] == [[value - 1 for value in corners]] and o.mask[5:19, 10:29].all() and o.area == 14 * 19
    (file,) = (tmp_path / "out").rglob("*.xml")
    assert "".join(file.read_text().split()).count(f"<polygon>{polygon}</polygon>") == 1


@pytest.mark.parametrize("polygon", ["<x1>1</x1><y1>2</y1>", "<x1>a</x1>" * 6, "<x1>1e9</x1>" * 6, "<x1>nan</x1>" * 6])
def test_polygons_that_are_none(polygon, tmp_path):
    tree = tmp_path / "tree"
    picture(tree / "images/a.jpg")
    text(tree / "annotations/a.xml", xml("a", ("car", (11, 6, 30, 20), f"<polygon>{polygon}</polygon>")))
    with pytest.raises(StoreError, match=r"a.xml: object 1: expected (numbers as polygon|a polygon of three corners or more)"):
        import_dataset("voc", tree, tmp_path / "out")


LABELS = ("# label:color_rgb:parts:actions", "background:::", "traffic light:::", "car:::")
PALETTE = {0: (0, 0, 0), 1: (128, 0, 0), 2: (0, 128, 0)}


def colored(file, numbers):
    file.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(np.array([PALETTE[i] for i in range(3)], np.uint8)[numbers]).save(file)


def datumaro_voc(tree):
    """Boxes from 0, with fractions; no XML where there are none; maps in colours, counted by what has pixels."""
    for name in ("a", "b", "sub/c 2"):
        picture(tree / f"JPEGImages/{name}.jpg")
    text(tree / "labelmap.txt", *LABELS)
    boxes = [("car", (0.0, 0.0, 40.0, 30.0), ""), ("traffic light", (2.5, 3.0, 12.5, 15.25), "")]
    text(tree / "Annotations/a.xml", xml("a", *boxes))
    text(tree / "ImageSets/Main/train.txt", "a", "sub/c 2"), text(tree / "ImageSets/Main/val.txt", "b")
    ids, masked = np.zeros((30, 40), np.uint8), np.zeros((30, 40), np.uint8)
    ids[3:15, 3:12], masked[5:20, 10:30] = 1, 1
    colored(tree / "SegmentationObject/a.png", ids), colored(tree / "SegmentationClass/a.png", ids)
    colored(tree / "SegmentationObject/sub/c 2.png", masked), colored(tree / "SegmentationClass/sub/c 2.png", masked * 2)
    return ids == 1, masked == 1


def test_datumaro_voc(tmp_path):
    ids, masked = datumaro_voc(tmp_path / "tree")
    found = come_in("voc", tmp_path / "tree", tmp_path)
    assert {key: told(objects) for key, objects in found.items()} == {
        ("train", "a.jpg"): [("car", 0, 0, 40, 30), ("traffic light", 2.5, 3, 12.5, 15.25)],
        ("train", "sub/c 2.jpg"): [("car", 10, 5, 30, 20)],
        ("val", "b.jpg"): [],
    }
    car, light = found["train", "a.jpg"]
    assert not car.mask.any() and (light.mask == ids).all()  # the map's first object is the second one of the XML
    assert (found["train", "sub/c 2.jpg"][0].mask == masked).all()
    file = next(file for file in (tmp_path / "out").rglob("*.xml") if "traffic light" in file.read_text())
    written = file.read_text()
    assert all(
        f"<{key}>{value}</{key}>" in written for key, value in (("xmin", 2.5), ("ymax", 15.25), ("xmax", 40), ("ymin", 0))
    )


def test_voc_lists_of_segmentation_alone(tmp_path):
    _, masked = datumaro_voc(tmp_path / "tree")
    (tmp_path / "tree/Annotations/a.xml").unlink(), (tmp_path / "tree/Annotations").rmdir()
    (tmp_path / "tree/ImageSets/Main").rename(tmp_path / "tree/ImageSets/Segmentation")
    found = come_in("voc", tmp_path / "tree", tmp_path)
    assert told(found["train", "sub/c 2.jpg"]) == [("car", 10, 5, 30, 20)] and masked.any()
    assert told(found["train", "a.jpg"]) == [("traffic light", 3, 3, 12, 15)]


def test_without_a_labelmap_a_lost_annotation_is_told(tmp_path):
    datumaro_voc(tmp_path / "tree")
    (tmp_path / "tree/labelmap.txt").unlink()
    with pytest.raises(StoreError, match=r"val.txt: b: expected .*b.xml; found no such file"):
        import_dataset("voc", tmp_path / "tree", tmp_path / "out")
