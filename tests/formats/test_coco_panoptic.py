"""COCO panoptic, read as panopticapi does it, which is on no index, and by datumaro where it is installed."""

from __future__ import annotations

import json

import numpy as np
import pytest
from PIL import Image

import cube_dataset
from proven import close, equal
from viewsphere.model.annotations.classes import FIRST_THING
from viewsphere.recipe.formats import FormatEntry
from viewsphere.run.exports.exporting import export, write
from viewsphere.store import Category


@pytest.fixture(scope="module")
def written(stills, tmp_path_factory):
    place = tmp_path_factory.mktemp("panoptic")
    export(stills.root, ["coco_panoptic"], output=place)
    return place / "coco_panoptic"


def read(folder, split):
    """Categories, images, and (ids (H, W), segments by id) of each image, by its id."""
    value = json.loads((folder / "annotations" / f"panoptic_{split}.json").read_text(encoding="utf-8"))
    maps = {}
    for annotation in value["annotations"]:
        colors = np.array(Image.open(folder / "annotations" / f"panoptic_{split}" / annotation["file_name"]), np.uint32)
        ids = colors[..., 0] + 256 * colors[..., 1] + 65536 * colors[..., 2]
        maps[annotation["image_id"]] = ids, {one["id"]: one for one in annotation["segments_info"]}
    return {c["id"]: c for c in value["categories"]}, {i["id"]: i for i in value["images"]}, maps


def quality(truth, found):
    """Panoptic quality of each category (Kirillov et al. 2019, eq. 1) over pairs of maps and segments; no void, no crowds."""
    sums = {}
    for (ids, segments), (other, guessed) in zip(truth, found, strict=True):
        matched = [set(), set()]
        for one, info in segments.items():
            for two, guess in guessed.items():
                both = np.count_nonzero((ids == one) & (other == two))
                iou = both / (np.count_nonzero(ids == one) + np.count_nonzero(other == two) - both)
                if iou > 0.5 and info["category_id"] == guess["category_id"]:
                    sums.setdefault(info["category_id"], []).append((iou, 1))
                    matched[0].add(one), matched[1].add(two)
        for known, done in ((segments, matched[0]), (guessed, matched[1])):
            for number in known.keys() - done:
                sums.setdefault(known[number]["category_id"], []).append((0, 0.5))
    return {category: sum(iou for iou, _ in rows) / sum(weight for _, weight in rows) for category, rows in sums.items()}


def expected_segments(sample):
    """Mask, category's name, and object's id (0 of stuff) of each segment of a picture, from other labels than panoptic."""
    yield from ((sample.instances == o.id, o.category, o.id) for o in sample.objects if o.area)
    stuff = np.where(sample.instances == 0, sample.semantic, 0)
    yield from ((stuff == number, number, 0) for number in np.unique(stuff[stuff > 0]))


def test_segments_are_things_and_stuff(stills, written):
    names = {one.id: one.name for one in stills.classes}
    for split in stills.splits:
        categories, images, maps = read(written, split)
        samples = {sample.index + 1: sample for sample in stills if sample.split == split}
        assert images.keys() == maps.keys() == samples.keys()
        for number, sample in samples.items():
            ids, segments = maps[number]
            rebuilt = np.zeros(ids.shape, np.uint32)
            assert ids.all() and set(np.unique(ids)) == segments.keys()
            for mask, name, object_id in expected_segments(sample):
                [found] = np.unique(ids[mask])
                told, category = segments[found], categories[segments[found]["category_id"]]
                equal("coco_panoptic", "own reader: masks", ids == found, mask)
                assert category["name"] == (name if object_id else names[name])
                assert (category["isthing"], told["iscrowd"]) == (int(object_id > 0), 0)
                assert not object_id or found == object_id
                rows, columns = np.nonzero(mask)
                box = [columns.min(), rows.min(), np.ptp(columns) + 1, np.ptp(rows) + 1]
                equal("coco_panoptic", "own reader: boxes and areas", [*told["bbox"], told["area"]], [*box, mask.sum()])
                rebuilt[mask] = found
            equal("coco_panoptic", "own reader: all pixels", rebuilt, ids)


def test_quality_is_one_on_itself_and_less_on_less(stills, written):
    _, _, maps = read(written, "train")
    for value in quality(maps.values(), maps.values()).values():
        close("coco_panoptic", "PQ on itself", value, 1, atol=1e-12)
    moved = [(np.roll(ids, 25, axis=1), segments) for ids, segments in maps.values()]
    worse = quality(maps.values(), moved)
    assert 0 < min(worse.values()) < 0.9 or 0 in worse.values()


def test_categories_are_numbered_as_the_format_coco_does(stills, written, tmp_path):
    export(stills.root, ["coco"], output=tmp_path)
    categories, images, _ = read(written, "val")
    told = json.loads((tmp_path / "coco" / "annotations" / "instances_val.json").read_text())
    things = {number: one for number, one in categories.items() if one["isthing"]}
    assert {n: (c["name"], c["supercategory"]) for n, c in things.items()} == {
        c["id"]: (c["name"], c["supercategory"]) for c in told["categories"]
    }
    assert [(i["id"], i["file_name"]) for i in told["images"]] == [(n, i["file_name"]) for n, i in images.items()]
    assert list(categories) == list(range(1, len(stills.classes) + 1))
    colors = {one.name: list(one.color) for one in stills.classes}
    assert all(one["color"] == colors[one["name"]] for one in categories.values())
    assert sum(not one["isthing"] for one in categories.values()) == sum(c.id < FIRST_THING for c in stills.classes)


def test_pictures_are_the_stored_ones(stills, written):
    for sample in stills:
        file = written / "images" / sample.split / f"{sample.index + 1:012d}.png"
        assert file.samefile(stills.path(sample.files["rgb"]))


def test_a_tracked_object_keeps_its_id(videos, tmp_path):
    export(videos.root, ["coco_panoptic"], output=tmp_path)
    for split in videos.splits:
        _, _, maps = read(tmp_path / "coco_panoptic", split)
        for sample in (sample for sample in videos if sample.split == split):
            ids, _ = maps[sample.index + 1]
            for o in sample.objects:
                equal("coco_panoptic", "own reader: tracks", ids == o.id, sample.instances == o.id)


def test_hostile_names_and_empty_pictures(tmp_path, monkeypatch):
    hostile = ('hair "drier" & co', "Große Schüssel 漢字", "a/b: #c")
    monkeypatch.setattr(cube_dataset, "CATEGORIES", tuple(Category(i, name, "") for i, name in enumerate(hostile, 1)))
    placed = cube_dataset.placed
    monkeypatch.setattr(cube_dataset, "placed", lambda offsets: placed({m: (0, 0, 500) for m in offsets}))
    dataset = cube_dataset.make(tmp_path / "out")
    (tmp_path / "tree").mkdir()
    write(dataset, [(FormatEntry(name="coco_panoptic"), tmp_path / "tree")])
    categories, _, maps = read(tmp_path / "tree", "train")
    assert [categories[i]["name"] for i in (1, 2, 3)] == list(hostile)
    for ids, segments in maps.values():
        [sky] = segments.values()
        assert categories[sky["category_id"]]["name"] == "sky" and sky["area"] == ids.size and (ids == sky["id"]).all()


def test_datumaro_reads_it(stills, written):
    datumaro = pytest.importorskip("datumaro")
    found = datumaro.Dataset.import_from(str(written), "coco_panoptic")
    names = [label.name for label in found.categories()[datumaro.AnnotationType.label]]
    samples = {f"{sample.index + 1:012d}": sample for sample in stills}
    assert {item.id: item.subset for item in found} == {name: sample.split for name, sample in samples.items()}
    for item in found:
        own = {a.id: a for a in item.annotations}
        for mask, name, object_id in expected_segments(samples[item.id]):
            told = own.pop(object_id or 65536 * int(name))
            equal("coco_panoptic", "datumaro: masks", told.image, mask)
            assert not object_id or names[told.label] == name
        assert not own
