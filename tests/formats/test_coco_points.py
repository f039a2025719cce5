"""COCO's keypoints and run lengths, read by pycocotools, supervision and, where installed, torchvision and datumaro."""

from __future__ import annotations

import contextlib
import io
import json
import shutil
import warnings

import numpy as np
import pytest
import supervision
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval
from torchvision_readers import torchvision_datasets

from proven import close, equal
from viewsphere.formats.coco import FORMAT, Options
from viewsphere.run.exports.exporting import export


@pytest.fixture(scope="module")
def written(stills, tmp_path_factory):
    def get(segmentation):
        place = tmp_path_factory.mktemp(segmentation)
        export(stills.root, [{"coco": {"segmentation": segmentation}}], output=place)
        return place / "coco"

    return get


@pytest.fixture(scope="module")
def rle(written):
    return written("rle")


def load(folder, split):
    with contextlib.redirect_stdout(io.StringIO()):
        return COCO(folder / "annotations" / f"instances_{split}.json")


def pairs(dataset, folder):
    """pycocotools' file, its annotation, and our sample and object, of all that is seen."""
    for split in dataset.splits:
        read = load(folder, split)
        for sample in (sample for sample in dataset if sample.split == split):
            own = [o for o in sample.objects if o.area]
            for annotation, o in zip(read.imgToAnns[sample.index + 1], own, strict=True):
                yield read, annotation, sample, o


def test_points_are_those_of_the_objects(stills, rle):
    seen = 0
    for read, annotation, _, o in pairs(stills, rle):
        names = read.cats[annotation["category_id"]]["keypoints"]
        points = np.reshape(annotation["keypoints"], (-1, 3))
        assert names == list(o.keypoint_names) and len(points) == len(names)
        flags = np.array([{0: 2, 1: 1}.get(int(state), 0) for state in o.keypoint_states])
        equal("coco", "pycocotools: flags of keypoints", points[:, 2], flags)
        assert annotation["num_keypoints"] == np.count_nonzero(flags)
        close("coco", "pycocotools: keypoints", points[flags > 0, :2] + 0.5, o.keypoints[flags > 0], "px", atol=1e-9)
        assert not points[flags == 0].any()
        seen += np.count_nonzero(flags)
    assert seen > 100


def test_a_visible_point_lies_on_a_pixel_of_its_number(stills, rle):
    """The nearest whole pixel to x, y is the one that the point is seen in, as of COCO's annotators."""
    for _, annotation, sample, o in pairs(stills, rle):
        for (x, y, flag), place in zip(np.reshape(annotation["keypoints"], (-1, 3)), o.keypoints, strict=True):
            if flag and not np.isclose(place % 1, 0, atol=1e-6).any():
                assert (round(x), round(y)) == tuple(np.floor(place).astype(int))
                assert 0 <= round(x) < sample.width and 0 <= round(y) < sample.height


def test_skeletons_count_from_one(stills, rle):
    models = {model.category: model.keypoints for model in stills.models}
    for category in load(rle, "train").dataset["categories"]:
        known, names = models[category["name"]], category["keypoints"]
        lines = {frozenset(names[i - 1] for i in line) for line in category["skeleton"]}
        assert names == list(known.points) and lines == {frozenset(line) for line in known.skeleton}
        assert len(lines) == len(category["skeleton"])


def test_detections_of_the_points_score_one(stills, rle):
    for split in stills.splits:
        read = load(rle, split)
        for category, told in read.cats.items():
            found = [
                {**{key: a[key] for key in ("image_id", "category_id", "keypoints")}, "score": 0.9}
                for a in read.anns.values()
                if a["category_id"] == category and a["num_keypoints"]
            ]
            if found:
                with contextlib.redirect_stdout(io.StringIO()):
                    evaluation = COCOeval(read, read.loadRes(found), "keypoints")
                    evaluation.params.catIds = [category]
                    evaluation.params.kpt_oks_sigmas = np.full(len(told["keypoints"]), 0.05)
                    evaluation.evaluate()
                    evaluation.accumulate()
                    evaluation.summarize()
                close("coco", "pycocotools: AP of keypoints", evaluation.stats[0], 1, atol=1e-12)


def test_run_lengths_are_the_masks(stills, rle, written):
    polygons = {(s.index, o.id): (read, a) for read, a, s, o in pairs(stills, written("polygons"))}
    for read, annotation, sample, o in pairs(stills, rle):
        assert isinstance(annotation["segmentation"]["counts"], str)
        equal("coco", "pycocotools: run lengths", read.annToMask(annotation), sample.instances == o.id)
        other, same = polygons[sample.index, o.id]
        equal("coco", "pycocotools: polygons", other.annToMask(same), sample.instances == o.id)
        assert {**annotation, "segmentation": None} == {**same, "segmentation": None}


def test_supervision_reads_run_lengths(stills, rle):
    for split in stills.splits:
        read = supervision.DetectionDataset.from_coco(
            str(rle / "images" / split), str(rle / "annotations" / f"instances_{split}.json"), force_masks=True
        )
        samples = {f"{sample.index + 1:012d}.png": sample for sample in stills if sample.split == split}
        for path, _, found in read:
            own = [o for o in samples[path.rpartition("/")[2]].objects if o.area]
            equal("coco", "supervision: masks", found.mask, [o.mask for o in own])


def test_others_read_run_lengths(stills, rle):
    datasets = torchvision_datasets()
    datumaro = pytest.importorskip("datumaro")
    for split in stills.splits:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = datasets.CocoDetection(rle / "images" / split, rle / "annotations" / f"instances_{split}.json")
        found = datasets.wrap_dataset_for_transforms_v2(found, target_keys=("boxes", "labels", "masks"))
        for (_, target), sample in zip(found, [s for s in stills if s.split == split], strict=True):
            equal("coco", "torchvision: masks", target["masks"], [o.mask for o in sample.objects if o.area])
    samples = {f"{sample.index + 1:012d}": sample for sample in stills}
    for item in datumaro.Dataset.import_from(str(rle), "coco_instances"):
        masks = {a.id: a.image for a in item.annotations if a.type == datumaro.AnnotationType.mask}
        own = [o for o in samples[item.id].objects if o.area]
        equal("coco", "datumaro: masks", [masks[i] for i in sorted(masks)], [o.mask for o in own])


def changed_points(annotation):
    annotation["keypoints"][0] += 40
    annotation["keypoints"][2] = 2


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (changed_points, "keypoints"),
        (lambda annotation: annotation.pop("num_keypoints"), "num_keypoints"),
        (lambda annotation: annotation["segmentation"].update(counts="0"), "segmentation"),
    ],
)
def test_changed_fields_are_found(stills, rle, tmp_path, change, told):
    folder = shutil.copytree(rle, tmp_path / "coco")
    options, file = Options(segmentation="rle"), folder / "annotations" / "instances_train.json"
    assert not list(FORMAT.verify(stills, folder, range(len(stills)), options))
    value = json.loads(file.read_text())
    change(next(a for a in value["annotations"] if a["num_keypoints"]))
    file.write_text(json.dumps(value))
    assert any(told in message for _, message in FORMAT.verify(stills, folder, (), options))


def test_pycocotools_finds_moved_points(stills, rle, tmp_path):
    """The proof by another reader, by itself."""
    from viewsphere.formats.coco.cross_check import _compare_with_pycocotools

    folder = shutil.copytree(rle, tmp_path / "coco")
    options, file = Options(segmentation="rle"), folder / "annotations" / "instances_train.json"
    assert not list(_compare_with_pycocotools(stills, file, "train", range(len(stills)), options))
    value = json.loads(file.read_text())
    for annotation in value["annotations"]:
        annotation["keypoints"] = [c + 50 * (i % 3 == 0) for i, c in enumerate(annotation["keypoints"])]
    file.write_text(json.dumps(value))
    remarks = _compare_with_pycocotools(stills, file, "train", range(len(stills)), options)
    assert any("keypoints: expected AP 1.0" in message for _, message in remarks)


def test_without_the_annotation_there_are_no_points(small_dataset):
    export(small_dataset.root, ["coco"])
    for file in (small_dataset.root / "coco" / "annotations").iterdir():
        assert "keypoints" not in file.read_text()
