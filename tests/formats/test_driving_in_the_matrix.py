"""Driving in the Matrix, read by supervision, and by a reader after the data set's own code: the same boxes and classes."""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

import cv2
import pytest
import supervision

from proven import close, equal
from viewsphere.formats.driving_in_the_matrix import FORMAT, Matrix
from viewsphere.run.exports.exporting import export
from viewsphere.run.exports.scope import scope_of
from viewsphere.store import Category

NAME = "driving_in_the_matrix"


@pytest.fixture(scope="module")
def written(stills, tmp_path_factory):
    place = tmp_path_factory.mktemp("matrix")
    export(stills.root, [{NAME: {"smallest": 300}}], output=place)
    return place / NAME / "VOC2012"


def test_supervision_gives_boxes_and_classes(stills, written):
    read = supervision.DetectionDataset.from_pascal_voc(str(written / "JPEGImages"), str(written / "Annotations"))
    found = {path.rpartition("/")[2]: (picture, annotations) for path, picture, annotations in read}
    assert len(found) == len(stills)
    for sample in stills:
        picture, annotations = found[f"{sample.index:08d}.png"]
        seen = [o for o in sample.objects if o.box2d]
        equal(NAME, "supervision: pictures", picture[..., ::-1], sample.rgb)
        close(NAME, "supervision: boxes", annotations.xyxy, [o.box2d for o in seen], "px")  # it takes 1 from the minima
        equal(NAME, "supervision: classes", [read.classes[i] for i in annotations.class_id], [o.category for o in seen])


def test_lists_and_flags(stills, written):
    lists = {file.stem: file.read_text().split() for file in (written / "ImageSets/Main").iterdir()}
    assert lists.keys() == {"train", "val", "test", "trainval"}
    difficult = 0
    for sample in stills:
        name = f"{sample.index:08d}"
        assert [split for split in lists if name in lists[split]] == [
            split for split in lists if split == sample.split or (split == "trainval" and sample.split in ("train", "val"))
        ]
        root = ElementTree.parse(written / f"Annotations/{name}.xml").getroot()
        assert cv2.imread(str(written / "JPEGImages" / root.findtext("filename"))).shape == (120, 160, 3)
        assert [int(root.find("size").findtext(tag)) for tag in ("width", "height", "depth")] == [160, 120, 3]
        for entry, o in zip(root.iter("object"), [o for o in sample.objects if o.box2d], strict=True):
            box = [float(entry.find("bndbox").findtext(tag)) - 1 for tag in ("xmin", "ymin", "xmax", "ymax")]
            equal(NAME, "a reader after its code: boxes, ends inside", box, [*o.box2d[:2], o.box2d[2] - 1, o.box2d[3] - 1])
            assert int(entry.findtext("difficult")) == (o.area < 300)
            assert int(entry.findtext("truncated")) == (o.truncation > 0.15)
            difficult += o.area < 300
    assert difficult


def test_odd_names_and_empty_pictures(stills):
    tree = Matrix(stills, FORMAT.options())
    odd = replace(stills[0], objects=(replace(stills[0].objects[0], category="Bäume <'&\"> x"),))
    xml = next(one for one in tree.sample_files(odd) if one.path.endswith(".xml")).content
    assert ElementTree.fromstring(xml).find("object").findtext("name") == "bäume <'&\"> x"
    xml = next(one for one in tree.sample_files(replace(odd, objects=())) if one.path.endswith(".xml")).content
    assert ElementTree.fromstring(xml).find("object") is None


def test_what_it_refuses(stills):
    scope = scope_of(stills)
    assert list(FORMAT.refuses(scope, FORMAT.options())) == []
    (told,) = FORMAT.refuses(replace(scope, categories=(Category(1, "a\nb", ""),)), FORMAT.options())
    assert told.endswith("found 'a\\nb'")
