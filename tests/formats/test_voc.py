"""PASCAL VOC, read by supervision, Pillow and, where they are installed, torchvision and datumaro."""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
import supervision
from PIL import Image
from torchvision_readers import torchvision_datasets

import cube_dataset
from proven import close, equal
from viewsphere import plugins
from viewsphere.errors import UserError
from viewsphere.plugins.format import FormatSpec
from viewsphere.recipe.formats import FormatEntry
from viewsphere.run.exports.exporting import export, write
from viewsphere.run.exports.scope import refusals, scope_of
from viewsphere.store import Category

SIDES = {"Frontal": 0, "Left": 90, "Rear": 180, "Right": 270}


@pytest.fixture(scope="module")
def written(stills, tmp_path_factory):
    place = tmp_path_factory.mktemp("voc")
    export(stills.root, [{"voc": {"pictures": "png"}}], output=place)
    return place / "voc"


def seen(sample):
    return [o for o in sample.objects if o.box2d]


def by_name(dataset, split=None):
    return {f"{sample.index:08d}": sample for sample in dataset if split in (None, sample.split)}


def inside(folder):
    return folder / "VOCdevkit" / "VOC2012"


def palette_picture(folder, kind, name):
    picture = Image.open(inside(folder) / kind / f"{name}.png")
    assert picture.mode == "P"
    colors = np.array(picture.getpalette(), np.uint8).reshape(-1, 3)
    assert colors[:4].tolist() == [[0, 0, 0], [128, 0, 0], [0, 128, 0], [128, 128, 0]] and colors[255].tolist() == [
        224,
        224,
        192,
    ]
    return np.array(picture)


def test_supervision_gives_boxes_and_classes(stills, written):
    read = supervision.DetectionDataset.from_pascal_voc(
        str(inside(written) / "JPEGImages"), str(inside(written) / "Annotations")
    )
    samples = by_name(stills)
    assert len(read) == len(samples)
    for path, picture, found in read:
        sample = samples[path.rpartition("/")[2].removesuffix(".png")]
        equal("voc", "supervision: pictures", picture[..., ::-1], sample.rgb)
        close("voc", "supervision: boxes", found.xyxy, [o.box2d for o in seen(sample)], "px")
        equal("voc", "supervision: classes", [read.classes[i] for i in found.class_id], [o.category for o in seen(sample)])


def test_palette_pictures_are_classes_and_objects(stills, written):
    numbers = {category.name: i for i, category in enumerate(stills.categories, 1)}
    for name, sample in by_name(stills).items():
        objects = palette_picture(written, "SegmentationObject", name)
        classes = palette_picture(written, "SegmentationClass", name)
        assert objects.max() == len(seen(sample))
        for place, o in enumerate(seen(sample), 1):
            equal("voc", "Pillow: instance masks", objects == place, sample.instances == o.id)
            equal("voc", "Pillow: class masks", classes[objects == place], np.full(o.area, numbers[o.category], np.uint8))
        assert not classes[objects == 0].any()


def test_splits_are_listed_once(stills, written):
    for kind in ("Main", "Segmentation"):
        files = {file.stem: file.read_text().split() for file in (inside(written) / "ImageSets" / kind).iterdir()}
        assert files == {split: list(by_name(stills, split)) for split in stills.splits}


def test_fields_of_objects(stills, written):
    poses = set()
    for name, sample in by_name(stills).items():
        root = ElementTree.parse(inside(written) / "Annotations" / f"{name}.xml").getroot()
        assert [root.findtext(f"size/{tag}") for tag in ("width", "height", "depth")] == ["160", "120", "3"]
        assert root.findtext("segmented") == "1" and root.findtext("source/database") == "stills"
        for entry, o in zip(root.findall("object"), seen(sample), strict=True):
            assert int(entry.findtext("truncated")) == min(o.truncation_level, 1)
            assert int(entry.findtext("occluded")) == min(o.occlusion_level, 1)
            assert int(entry.findtext("difficult")) == (o.visibility < 0.1)
            pose = entry.findtext("pose")
            poses.add(pose)
            if pose != "Unspecified":
                assert abs((o.view.azimuth_deg - SIDES[pose] + 180) % 360 - 180) <= 20
    assert len(poses) > 2


def test_left_faces_the_pictures_left(poses, tmp_path):
    """Where an object that is seen from its left or right has its front, box face 1562, against its back."""
    export(poses.root, ["voc"], output=tmp_path)
    known = 0
    for name, sample in by_name(poses).items():
        root = ElementTree.parse(inside(tmp_path / "voc") / "Annotations" / f"{name}.xml").getroot()
        for entry, o in zip(root.findall("object"), seen(sample), strict=True):
            ahead, pose = o.box3d_camera[[1, 5, 6, 2]].mean(0) - o.box3d_camera[[0, 4, 7, 3]].mean(0), entry.findtext("pose")
            sides = {"Left": -ahead[0], "Right": ahead[0], "Frontal": -ahead[2], "Rear": ahead[2]}
            assert pose == "Unspecified" or max(sides, key=sides.get) == pose
            known += pose in ("Left", "Right")
    assert known


def test_pictures_are_jpeg_unless_asked(stills, tmp_path):
    export(stills.root, ["voc"], output=tmp_path)
    for name, sample in by_name(stills).items():
        picture = Image.open(inside(tmp_path / "voc") / "JPEGImages" / f"{name}.jpg")
        assert picture.format == "JPEG" and picture.mode == "RGB"
        assert np.abs(np.array(picture, float) - sample.rgb).mean() < 4


def test_more_is_difficult_when_asked(stills, tmp_path):
    export(stills.root, [{"voc": {"difficult_below": 1.0}}], output=tmp_path)
    for name, sample in by_name(stills).items():
        root = ElementTree.parse(inside(tmp_path / "voc") / "Annotations" / f"{name}.xml").getroot()
        found = [entry.findtext("difficult") for entry in root.findall("object")]
        assert found == [str(int(o.visibility < 1)) for o in seen(sample)]


HOSTILE = ('hair "drier" & <co>', "Große Schüssel 漢字", "car's 100%")


@pytest.fixture
def hostile(tmp_path, monkeypatch):
    """A data set whose categories have names that XML has to escape, and one whose pictures are empty."""
    monkeypatch.setattr(cube_dataset, "CATEGORIES", tuple(Category(i, name, "") for i, name in enumerate(HOSTILE, 1)))
    named = cube_dataset.make(tmp_path / "named", several=True)
    placed = cube_dataset.placed
    monkeypatch.setattr(cube_dataset, "placed", lambda offsets: placed({m: (0, 0, 500) for m in offsets}))
    made = {"named": named, "empty": cube_dataset.make(tmp_path / "empty")}
    for name, dataset in made.items():
        (tmp_path / "out" / name).mkdir(parents=True)
        write(dataset, [(FormatEntry(name="voc"), tmp_path / "out" / name)])
    return tmp_path / "out", made


def test_names_and_empty_pictures(hostile):
    out, made = hostile
    for name, sample in by_name(made["named"]).items():
        root = ElementTree.parse(inside(out / "named") / "Annotations" / f"{name}.xml").getroot()
        assert [entry.findtext("name") for entry in root.findall("object")] == [o.category for o in seen(sample)]
    assert HOSTILE[1] in (inside(out / "named") / "labelmap.txt").read_text(encoding="utf-8")
    for name in by_name(made["empty"]):
        root = ElementTree.parse(inside(out / "empty") / "Annotations" / f"{name}.xml").getroot()
        assert not root.findall("object") and root.findtext("segmented") == "1"
        assert not palette_picture(out / "empty", "SegmentationObject", name).any()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"categories": tuple(Category(i, f"c{i}", "") for i in range(1, 256))}, "expected at most 254 categories; found 255"),
        ({"most_objects": 300}, "expected at most 254 objects in a picture; found 300"),
        ({"categories": (Category(1, "a:b", ""),)}, "expected names of categories of one line, without : .*; found 'a:b'"),
    ],
)
def test_refusals(stills, changes, message):
    voc = plugins.load(FormatSpec, "voc")
    with pytest.raises(UserError, match=message):
        raise UserError(*refusals(voc, FormatEntry(name="voc"), replace(scope_of(stills), **changes)))


def test_torchvision_reads_it(stills, tmp_path):
    datasets = torchvision_datasets()
    export(stills.root, ["voc"], output=tmp_path)
    for split in ("train", "val"):
        found = datasets.VOCDetection(str(tmp_path / "voc"), image_set=split)
        masks = datasets.VOCSegmentation(str(tmp_path / "voc"), image_set=split)
        assert len(found) == len(masks) == len(by_name(stills, split))
        for (picture, target), (_, mask), sample in zip(found, masks, by_name(stills, split).values(), strict=True):
            assert picture.size == (160, 120)
            boxes = [[int(o["bndbox"][k]) for k in ("xmin", "ymin", "xmax", "ymax")] for o in target["annotation"]["object"]]
            close("voc", "torchvision: boxes", np.array(boxes) - [1, 1, 0, 0], [o.box2d for o in seen(sample)], "px")
            numbers = {category.name: i for i, category in enumerate(stills.categories, 1)}
            expected = sum(numbers[o.category] * o.mask for o in seen(sample))
            equal("voc", "torchvision: class masks", np.array(mask), expected)


def test_datumaro_reads_it(stills, written):
    datumaro = pytest.importorskip("datumaro")
    found = datumaro.Dataset.import_from(str(written), "voc", coordinate_mode="voc-one-based")
    names = [label.name for label in found.categories()[datumaro.AnnotationType.label]]
    assert names == ["background", *(category.name for category in stills.categories)]
    samples = by_name(stills)
    assert {item.id: item.subset for item in found} == {name: sample.split for name, sample in samples.items()}
    for item in found:
        sample = samples[item.id]
        boxes = [a for a in item.annotations if a.type == datumaro.AnnotationType.bbox]
        close("voc", "datumaro: boxes", [b.points for b in boxes], [o.box2d for o in seen(sample)], "px")
        equal("voc", "datumaro: classes", [names[b.label] for b in boxes], [o.category for o in seen(sample)])
        masks = {a.group: a for a in item.annotations if a.type == datumaro.AnnotationType.mask and a.group}
        for place, o in enumerate(seen(sample), 1):
            equal("voc", "datumaro: masks", masks[place].image, o.mask)
            assert names[masks[place].label] == o.category
