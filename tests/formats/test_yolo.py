"""YOLO, read by supervision and, where it is installed, by Ultralytics: the same boxes, masks, points and corners."""

from __future__ import annotations

import numpy as np
import pytest
import supervision
import yaml

from proven import close, equal
from viewsphere.run.exports.exporting import export


@pytest.fixture(scope="module")
def written(stills, tmp_path_factory):
    def get(task):
        place = tmp_path_factory.mktemp(task)
        export(stills.root, [{"yolo": {"task": task}}], output=place)
        return place / "yolo"

    return get


def loaded(folder, split, **more):
    found = supervision.DetectionDataset.from_yolo(
        str(folder / "images" / split), str(folder / "labels" / split), str(folder / "data.yaml"), **more
    )
    return {path.rpartition("/")[2]: annotations for path, _, annotations in found}, found.classes


def of_split(dataset, split):
    return {f"{sample.index:08d}.png": sample for sample in dataset if sample.split == split}


def test_boxes_and_classes(stills, written):
    folder = written("detect")
    for split in stills.splits:
        read, classes = loaded(folder, split)
        assert classes == [category.name for category in stills.categories]
        assert read.keys() == of_split(stills, split).keys()
        for name, sample in of_split(stills, split).items():
            seen = [o for o in sample.objects if o.box2d]
            close("yolo", "supervision: boxes", read[name].xyxy, [o.box2d for o in seen], "px", atol=1e-4)
            equal("yolo", "supervision: classes", [classes[i] for i in read[name].class_id], [o.category for o in seen])


def test_masks(stills, written):
    folder = written("segment")
    for split in stills.splits:
        read, _ = loaded(folder, split, force_masks=True)
        for name, sample in of_split(stills, split).items():
            for mask, o in zip(read[name].mask, [o for o in sample.objects if o.area], strict=True):
                inner = o.mask & mask
                assert inner.sum() == o.area  # OpenCV fills a polygon's outline, too
                assert (mask & ~o.mask).sum() <= 2 * sum(len(polygon) for polygon in o.polygons) + np.ptp(
                    np.nonzero(o.mask)[0]
                ) * 3


def numbers(folder, sample):
    text = (folder / "labels" / sample.split / f"{sample.index:08d}.txt").read_text()
    return [list(map(float, line.split())) for line in text.splitlines()]


def test_points(stills, written):
    folder = written("pose")
    told = yaml.safe_load((folder / "data.yaml").read_text())
    names = told["kpt_names"][0]
    count, size = len(names), np.array([160, 120])
    assert told["kpt_shape"] == [count, 3] and sorted(told["flip_idx"]) == list(range(count))
    assert [told["flip_idx"][i] for i in told["flip_idx"]] == list(range(count))  # mirrored twice they are themselves again
    seen = 0
    for sample in stills:
        rows = numbers(folder, sample)
        for row, o in zip(rows, [o for o in sample.objects if o.box2d], strict=True):
            points = np.reshape(row[5:], (count, 3))
            for name, place, state in zip(o.keypoint_names, o.keypoints, o.keypoint_states, strict=True):
                x, y, v = points[names.index(name)]
                assert v == {0: 2, 1: 1}.get(int(state), 0)
                if v:
                    close("yolo", "keypoints", (x, y) * size, place, "px", atol=2e-5)
                seen += v > 0
            assert not points[[i for i, name in enumerate(names) if name not in o.keypoint_names]].any()
    assert seen > 50


def test_corners(stills, written):
    folder = written("obb")
    for sample in stills:
        for row, o in zip(numbers(folder, sample), [o for o in sample.objects if o.obb is not None], strict=True):
            inside = np.clip(o.obb, 0, [160, 120])
            close("yolo", "oriented boxes", np.reshape(row[1:], (4, 2)) * [160, 120], inside, "px", atol=2e-5)


@pytest.mark.slow
@pytest.mark.parametrize("task", ["detect", "segment", "pose", "obb"])
def test_ultralytics_loads_it(stills, written, task):
    pytest.importorskip("ultralytics")
    from ultralytics.data.dataset import YOLODataset
    from ultralytics.data.utils import check_det_dataset

    folder = written(task)
    data = check_det_dataset(str(folder / "data.yaml"))
    data["path"] = folder
    read = YOLODataset(img_path=str(folder / "images" / "train"), data=data, task={"detect": "detect"}.get(task, task))
    boxes = {label["im_file"].rpartition("/")[2]: label for label in read.labels}
    for name, sample in of_split(stills, "train").items():
        seen = [o for o in sample.objects if o.box2d]
        assert len(boxes[name]["cls"]) == len(seen)
