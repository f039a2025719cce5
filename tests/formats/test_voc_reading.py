"""PASCAL VOC data sets made elsewhere: what is read goes out equal as VOC and as COCO; mistakes are told in a line each."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image
from pycocotools.coco import COCO

from proven import close, equal
from small import tree_hash
from viewsphere import Dataset
from viewsphere.check import check
from viewsphere.errors import StoreError
from viewsphere.run.datasets.importing import import_dataset
from viewsphere.run.exports.exporting import export

OBJECTS = {
    "2007_01": [
        ("cat", (3, 4, 20, 15), {"pose": "Left", "truncated": 1, "occluded": 0, "difficult": 1}),
        ("d'été <à>", (18, 10, 40, 30), {}),
    ],
    "2007_02": [],
    "2007_03": [("日本", (1, 1, 40, 30), {"pose": "Unspecified", "difficult": 0})],
}


def xml_of(name, objects, size=(40, 30)):
    root = ElementTree.Element("annotation")
    ElementTree.SubElement(root, "filename").text = f"{name}.jpg"
    shape = ElementTree.SubElement(root, "size")
    for key, value in zip(("width", "height", "depth"), (*size, 3), strict=True):
        ElementTree.SubElement(shape, key).text = str(value)
    for category, box, flags in objects:
        o = ElementTree.SubElement(root, "object")
        ElementTree.SubElement(o, "name").text = category
        for key, value in flags.items():
            ElementTree.SubElement(o, key).text = str(value)
        bounds = ElementTree.SubElement(o, "bndbox")
        for key, value in zip(("xmax", "xmin", "ymax", "ymin"), (box[2], box[0], box[3], box[1]), strict=True):
            ElementTree.SubElement(bounds, key).text = str(value)
        part = ElementTree.SubElement(o, "part")
        ElementTree.SubElement(part, "name").text = "head"
    return ElementTree.tostring(root)


def data_set(folder, masks=True):
    rng, kit = np.random.default_rng(4), folder / "VOCdevkit/VOC2007"
    for name in ("JPEGImages", "Annotations", "ImageSets/Main", "SegmentationObject"):
        (kit / name).mkdir(parents=True)
    for name, objects in OBJECTS.items():
        Image.fromarray(rng.integers(0, 255, (30, 40, 3), np.uint8)).save(kit / f"JPEGImages/{name}.jpg")
        (kit / f"Annotations/{name}.xml").write_bytes(xml_of(name, objects))
        ids = np.zeros((30, 40), np.uint8)
        for number, (_, (x0, y0, x1, y1), _) in enumerate(objects, 1):
            ids[y0 - 1 : y1, x0 - 1 : x1] = number
            ids[y0 - 1, x0 - 1 : x1] = 255
        if masks and objects:
            picture = Image.fromarray(ids, "L").convert("P")
            picture.putdata(ids.ravel().tolist())
            picture.save(kit / f"SegmentationObject/{name}.png")
    (kit / "ImageSets/Main/train.txt").write_text("2007_01\n2007_02\n")
    (kit / "ImageSets/Main/val.txt").write_text("2007_03\n")
    (kit / "ImageSets/Main/trainval.txt").write_text("2007_01\n2007_02\n2007_03\n")
    (kit / "ImageSets/Main/cat_train.txt").write_text("2007_01  1\n2007_02 -1\n")
    return folder, kit


def told(xml):
    return [
        {key: o.findtext(key) for key in ("name", "pose", "truncated", "occluded", "difficult")}
        | {key: o.findtext(f"bndbox/{key}") for key in ("xmin", "ymin", "xmax", "ymax")}
        for o in ElementTree.parse(xml).findall("object")
    ]


def test_what_is_read_goes_out_equal(tmp_path):
    source, kit = data_set(tmp_path / "mine")
    before = tree_hash(source)
    foreign = import_dataset("voc", source, tmp_path / "out")
    assert (foreign.name, foreign.count, foreign.splits, foreign.left_out) == ("mine", 3, ("train", "val"), ())
    assert [category.name for category in foreign.categories] == sorted({"cat", "d'été <à>", "日本"})
    export(tmp_path / "out", "voc")
    mine = tmp_path / "out/voc/VOCdevkit/VOC2012"
    for index, name in enumerate(OBJECTS):
        for found, expected in zip(
            told(mine / f"Annotations/{index:08d}.xml"), told(kit / f"Annotations/{name}.xml"), strict=True
        ):
            assert {key: value for key, value in found.items() if expected[key] is not None} == {
                key: value for key, value in expected.items() if value is not None
            }
        assert (mine / f"JPEGImages/{index:08d}.jpg").read_bytes() == (kit / f"JPEGImages/{name}.jpg").read_bytes()
        if OBJECTS[name]:
            found, was = (
                np.array(Image.open(file))
                for file in (mine / f"SegmentationObject/{index:08d}.png", kit / f"SegmentationObject/{name}.png")
            )
            equal("voc", "import: object maps", found, np.where(was == 255, 0, was))
    assert tree_hash(source) == before
    report = check(Dataset(tmp_path / "out"))
    assert report.ok, report.findings


def test_an_export_comes_back(stills, tmp_path):
    export(stills.root, "voc", output=tmp_path / "one")
    import_dataset("voc", tmp_path / "one/voc", tmp_path / "in")
    read = Dataset(tmp_path / "in")
    assert [category.name for category in read.categories] == [category.name for category in stills.categories]
    export(tmp_path / "in", "voc", output=tmp_path / "two")
    first, second = (tmp_path / end / "voc/VOCdevkit/VOC2012" for end in ("one", "two"))
    for sample in read:
        name, was = f"{sample.index:08d}", sample.source["file_name"][:8]
        assert told(second / f"Annotations/{name}.xml") == told(first / f"Annotations/{was}.xml")
        for kind in ("SegmentationObject", "SegmentationClass"):
            pixels = [np.array(Image.open(folder / kind / f"{n}.png")) for folder, n in ((first, was), (second, name))]
            equal("voc", "export, import, export: maps", *pixels)
    assert (first / "labelmap.txt").read_bytes() == (second / "labelmap.txt").read_bytes()


@pytest.mark.parametrize("masks", [True, False])
def test_coco_has_the_same_pixels(masks, tmp_path):
    import_dataset("voc", data_set(tmp_path / "mine", masks)[0], tmp_path / "out")
    export(tmp_path / "out", "coco")
    for split in ("train", "val"):
        coco = COCO(tmp_path / f"out/coco/annotations/instances_{split}.json")
        for image in coco.imgs.values():
            objects = OBJECTS[image["imported_file_name"].removesuffix(".jpg")]
            for a, (name, (x0, y0, x1, y1), flags) in zip(coco.imgToAnns[image["id"]], objects, strict=True):
                assert coco.cats[a["category_id"]]["name"] == name and flags.items() <= a.items()
                close("voc", "import, pycocotools: boxes", a["bbox"], [x0 - 1, y0 - 1, x1 - x0 + 1, y1 - y0 + 1], "px")
                if masks:
                    assert coco.annToMask(a).sum() == a["area"] > 0
                else:
                    assert "segmentation" not in a


def test_without_lists_all_annotations_are_one_split(tmp_path):
    source, kit = data_set(tmp_path / "mine")
    for file in (kit / "ImageSets/Main").iterdir():
        file.unlink()
    assert import_dataset("voc", kit, tmp_path / "out").splits == ("train",)
    assert len(Dataset(tmp_path / "out")) == 3 and source


BROKEN = [
    (("", (1, 1, 2, 2), {}), "expected a name; found ''"),
    (("a", (5, 1, 2, 2), {}), "expected bndbox with xmin <= xmax, ymin <= ymax; found ['5', '1', '2', '2']"),
    (("a", ("x", 1, 2, 2), {}), "expected numbers as bndbox; found ['x', '1', '2', '2']"),
    (("a", ("nan", 1, 2, 2), {}), "expected bndbox with xmin <= xmax, ymin <= ymax; found ['nan', '1', '2', '2']"),
    (("a", (1, 1, 2, 2), {"difficult": 2}), "expected difficult 0 or 1; found '2'"),
]


def test_broken_objects_are_told_or_left_out(tmp_path):
    source, kit = data_set(tmp_path / "mine", masks=False)
    file = kit / "Annotations/2007_01.xml"
    file.write_bytes(xml_of("2007_01", [*(broken for broken, _ in BROKEN), *OBJECTS["2007_01"]]))
    with pytest.raises(StoreError) as error:
        import_dataset("voc", source, tmp_path / "out")
    lines = [f"{file}: object {number}: {message}" for number, (_, message) in enumerate(BROKEN, 1)]
    assert str(error.value).splitlines() == [*lines, "mend them, or leave them out with --keep-going"]
    assert import_dataset("voc", source, tmp_path / "out", keep_going=True).left_out == tuple(lines)
    assert len(next(iter(Dataset(tmp_path / "out"))).objects) == 2


def test_pictures_and_annotations_that_cannot_be_used(tmp_path):
    source, kit = data_set(tmp_path / "mine", masks=False)
    Image.new("RGB", (8, 8)).save(tmp_path / "secret.jpg")
    (kit / "JPEGImages/link.jpg").symlink_to(tmp_path / "secret.jpg")
    for name in ("link", "alone", "bomb", "cut", "small"):
        (kit / f"Annotations/{name}.xml").write_bytes(xml_of(name, []))
    for name in ("bomb", "cut", "small"):
        Image.new("RGB", (8, 8)).save(kit / f"JPEGImages/{name}.jpg")
    (kit / "Annotations/bomb.xml").write_bytes(b"<!DOCTYPE a [<!ENTITY b 'c'>]><annotation>&b;</annotation>")
    (kit / "Annotations/cut.xml").write_bytes(b"<annotation>")
    names = ["../../../secret", "/etc/hostname", "link", "nowhere", "alone", "bomb", "cut", "small", "2007_01"]
    (kit / "ImageSets/Main/train.txt").write_text("\n".join(names))
    with pytest.raises(StoreError) as error:
        import_dataset("voc", source, tmp_path / "out")
    lines = str(error.value).splitlines()
    for name, line, message in zip(names[:-1], lines, [
        "found a path that leads outside", "found a path that leads outside", "found a link that leads out of it",
        "nowhere.xml; found no such file", "expected a picture JPEGImages/alone.jpg; found no such file",
        "found one with entities", "no element found", "expected 40 x 30 pixels, as small.xml says; found 8 x 8",
    ], strict=False):  # fmt: skip
        assert line.startswith(f"{kit}/ImageSets/Main/train.txt: {name}: ") and message in line, line
    assert len(lines) == len(names)
    assert import_dataset("voc", source, tmp_path / "out", keep_going=True).count == 2


def test_what_is_no_data_set_says_so(tmp_path):
    with pytest.raises(StoreError, match=r"expected a PASCAL VOC data set \(Annotations, JPEGImages, ImageSets\); found no"):
        import_dataset("voc", tmp_path, tmp_path / "out")
    (tmp_path / "Annotations").mkdir(), (tmp_path / "JPEGImages").mkdir()
    with pytest.raises(StoreError, match="expected pictures and objects that can be used; found none"):
        import_dataset("voc", tmp_path, tmp_path / "out")


def test_a_category_that_the_label_map_lacks(tmp_path):
    source, kit = data_set(tmp_path / "mine", masks=False)
    (kit / "labelmap.txt").write_text("# label:color_rgb:parts:actions\nbackground:0,0,0::\n日本:1,2,3::\ncat:4,5,6::\n")
    foreign = import_dataset("voc", source, tmp_path / "out", keep_going=True)
    assert [category.name for category in foreign.categories] == ["日本", "cat"]
    (line,) = foreign.left_out
    assert line.endswith('2007_01.xml: object 2: expected a name of labelmap.txt; found "d\'été <à>"')
