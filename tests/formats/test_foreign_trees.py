"""Trees that datumaro, supervision and FiftyOne write, where they are installed: each comes in, and what the library reads of
what goes out in the same format is what it read before.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from proven import close, equal
from viewsphere import Dataset
from viewsphere.check import check
from viewsphere.run.datasets.converting import convert
from viewsphere.run.datasets.importing import import_dataset

SIZE = WIDTH, HEIGHT = 80, 60
CLASSES = ["traffic light", "car"]
SPLITS = {"a": "train", "b 2": "train", "c.v1": "val", "d": "val"}
"""Of the pictures, by their names."""

BOXES: Mapping[str, list[tuple[str, tuple[float, float, float, float]]]] = {
    "a": [("car", (2.5, 3, 12.5, 15.25)), ("traffic light", (30, 20, 50, 40))],
    "b 2": [("car", (5, 5, 25, 30))],
    "c.v1": [],
    "d": [("traffic light", (0, 0, 80, 60))],
}

Read = Mapping[str, list[tuple[str, Any, Any]]]
"""What a library reads: by the digest of a picture's file, the class, box and mask (or outline) of each object."""


def pictures(folder: Path) -> dict[str, Path]:
    """Four JPEGs, by their names."""
    folder.mkdir(parents=True)
    rng = np.random.default_rng(3)
    found = {name: folder / f"{name}.jpg" for name in BOXES}
    for file in found.values():
        Image.fromarray(rng.integers(0, 255, (HEIGHT, WIDTH, 3), np.uint8)).save(file)
    return found


def digest(file: Path | str) -> str:
    return hashlib.sha256(Path(file).read_bytes()).hexdigest()


def comes_in_and_goes_out(
    kind: str, tree: Path, tmp_path: Path, read: Callable[[Path], Read], place: str = "", **options
) -> Read:
    """What a library reads of a tree, which is what it reads of what becomes of it here; `place`: where in the export."""
    import_dataset(kind, tree, tmp_path / "in")
    report = check(Dataset(tmp_path / "in"))
    assert report.ok, report.findings
    convert(kind, tree, [{kind: options}] if options else kind, tmp_path / "out")
    was, now = read(tree), read(tmp_path / "out" / kind / place)
    assert was.keys() == now.keys()
    for key, objects in was.items():
        equal(kind, "classes", [name for name, *_ in now[key]], [name for name, *_ in objects])
        close(kind, "boxes", [box for _, box, _ in now[key]], [box for _, box, _ in objects], "px", atol=2e-4)
        for (*_, mask), (*_, before) in zip(now[key], objects, strict=True):
            equal(kind, "masks", mask, before)
    return was


def counted(read: Read, files: Mapping[str, Path]) -> dict[str, int]:
    return {name: len(read[digest(file)]) for name, file in files.items() if digest(file) in read}


# supervision


def supervised(files: Mapping[str, Path], masks: bool) -> Any:
    sv = pytest.importorskip("supervision")
    found: dict[str, Any] = {}
    for name, file in files.items():
        boxes = [(CLASSES.index(label), box) for label, box in BOXES[name]]
        drawn = np.zeros((len(boxes), HEIGHT, WIDTH), bool)
        for mask, (_, (x0, y0, x1, y1)) in zip(drawn, boxes, strict=True):
            mask[int(y0) : int(y1), int(x0) : int(x1)] = True
        found[str(file)] = (
            sv.Detections(
                np.array([box for _, box in boxes], float),
                mask=drawn if masks else None,
                class_id=np.array([number for number, _ in boxes]),
            )
            if boxes
            else sv.Detections.empty()
        )
    return sv.DetectionDataset(classes=CLASSES, images=list(found), annotations=found)


def supervision_reads(dataset: Any) -> Read:
    found: dict[str, list[tuple[str, Any, Any]]] = {}
    for path, _, seen in dataset:
        masks = [None] * len(seen) if seen.mask is None else seen.mask
        rows = zip(seen.class_id if len(seen) else (), seen.xyxy, masks, strict=True)
        found[digest(path)] = [(dataset.classes[number], box.tolist(), mask) for number, box, mask in rows]
    return found


@pytest.mark.parametrize("masks", [False, True], ids=["boxes", "masks"])
def test_supervision_coco(masks, tmp_path):
    files, tree = pictures(tmp_path / "src"), tmp_path / "tree"
    supervised(files, masks).as_coco(str(tree / "images"), str(tree / "annotations.json"))
    import supervision as sv

    def read(folder):
        file = next(iter(folder.rglob("*.json")))
        images = folder / "images" if file.parent == folder else folder / "images" / "train"
        return supervision_reads(sv.DetectionDataset.from_coco(str(images), str(file), force_masks=masks))

    was = comes_in_and_goes_out("coco", tree, tmp_path, read)
    assert counted(was, files) == {name: len(boxes) for name, boxes in BOXES.items()}


@pytest.mark.parametrize("masks", [False, True], ids=["boxes", "masks"])
def test_supervision_yolo(masks, tmp_path):
    files, tree = pictures(tmp_path / "src"), tmp_path / "tree"
    supervised(files, masks).as_yolo(str(tree / "images"), str(tree / "labels"), str(tree / "data.yaml"))
    import supervision as sv

    def read(folder):
        ends = [folder / end if folder == tree else folder / end / "train" for end in ("images", "labels")]
        return supervision_reads(sv.DetectionDataset.from_yolo(*map(str, ends), str(folder / "data.yaml"), force_masks=masks))

    task = {"task": "segment"} if masks else {}
    was = comes_in_and_goes_out("yolo", tree, tmp_path, read, **task)
    assert counted(was, files) == {name: len(boxes) for name, boxes in BOXES.items()}


@pytest.mark.parametrize("masks", [False, True], ids=["boxes", "masks"])
def test_supervision_voc(masks, tmp_path):
    files, tree = pictures(tmp_path / "src"), tmp_path / "tree"
    supervised(files, masks).as_pascal_voc(str(tree / "images"), str(tree / "annotations"))
    import supervision as sv

    def read(folder):
        ends = ("images", "annotations") if folder == tree else ("JPEGImages", "Annotations")
        return supervision_reads(sv.DetectionDataset.from_pascal_voc(*(str(folder / end) for end in ends), force_masks=masks))

    was = comes_in_and_goes_out("voc", tree, tmp_path, read, "VOCdevkit/VOC2012")
    assert counted(was, files) == {name: len(boxes) for name, boxes in BOXES.items()}


# datumaro


def datumaro_tree(kind: str, tmp_path: Path, also: Callable[[Any, str], list[Any]] = lambda dm, name: []) -> tuple[Any, Path]:
    """A tree of the library's name for a format, without pictures of the same content."""
    dm = pytest.importorskip("datumaro")
    from datumaro.components.media import Image as Picture

    files, numbers = pictures(tmp_path / "src"), count(1)
    items = []
    for name, file in files.items():
        boxes = [
            dm.Bbox(x0, y0, x1 - x0, y1 - y0, label=CLASSES.index(label), id=next(numbers), group=number)
            for number, (label, (x0, y0, x1, y1)) in enumerate(BOXES[name], 1)
        ]
        picture = Picture.from_file(path=str(file))
        items.append(dm.DatasetItem(name, subset=SPLITS[name], media=picture, annotations=boxes + also(dm, name)))
    dm.Dataset.from_iterable(items, categories=CLASSES).export(str(tmp_path / "tree"), kind, save_media=True)
    return dm, tmp_path / "tree"


def datumaro_reads(dm: Any, kind: str, masks: bool = True) -> Callable[[Path], Read]:
    def read(folder: Path) -> Read:
        dataset = dm.Dataset.import_from(str(folder), kind)
        labels, found = dataset.categories()[dm.AnnotationType.label], {}
        for item in dataset:
            objects = []
            for one in item.annotations:
                if one.type == dm.AnnotationType.bbox:
                    objects.append((labels[one.label].name, list(one.points), None))
                elif one.type == dm.AnnotationType.polygon:
                    objects.append((labels[one.label].name, list(one.get_bbox()), list(one.points)))
                elif one.type == dm.AnnotationType.mask and masks:
                    objects.append((labels[one.label].name, list(one.get_bbox()), np.asarray(one.image)))
            found[digest(item.media.path)] = objects
        return found

    return read


def outlined(dm: Any, name: str) -> list[Any]:
    if name != "b 2":
        return []
    mask = np.zeros((HEIGHT, WIDTH), bool)
    mask[40:50, 30:50] = True
    mask[43:46, 35:40] = False
    return [dm.Polygon([5, 5, 25, 6.5, 20, 30], label=0, id=8, group=8), dm.Mask(mask, label=1, id=9, group=9)]


@pytest.mark.parametrize("kind", ["coco", "coco_instances"])
def test_datumaro_coco(kind, tmp_path):
    dm, tree = datumaro_tree(kind, tmp_path, outlined)
    was = comes_in_and_goes_out("coco", tree, tmp_path, datumaro_reads(dm, "coco_instances"))
    assert Dataset(tmp_path / "in").splits == ("train", "val")
    assert sorted(map(len, was.values())) == [0, 1, 2, 5]  # it makes boxes of outlines, too


@pytest.mark.parametrize("kind", ["yolo", "yolo_ultralytics"])
def test_datumaro_yolo(kind, tmp_path):
    dm, tree = datumaro_tree(kind, tmp_path)
    was = comes_in_and_goes_out("yolo", tree, tmp_path, datumaro_reads(dm, "yolo"))
    assert sorted(map(len, was.values())) == [0, 1, 1, 2]


@pytest.mark.parametrize("kind", ["voc_detection", "voc"])
def test_datumaro_voc(kind, tmp_path):
    dm, tree = datumaro_tree(kind, tmp_path)
    was = comes_in_and_goes_out("voc", tree, tmp_path, datumaro_reads(dm, "voc", masks=False), "VOCdevkit/VOC2012")
    assert sorted(map(len, was.values())) == [0, 1, 1, 2]


def test_datumaro_voc_masks(tmp_path):
    """Masks without boxes, in pictures without XML."""

    def drawn(dm, name):
        mask = np.zeros((HEIGHT, WIDTH), bool)
        mask[40:50, 30:50] = True
        return [dm.Mask(mask, label=1, id=9, group=9)] if name == "c.v1" else []

    dm, tree = datumaro_tree("voc_instance_segmentation", tmp_path, drawn)
    assert not (tree / "Annotations" / "c.v1.xml").exists()
    import_dataset("voc", tree, tmp_path / "in")
    (sample,) = (s for s in Dataset(tmp_path / "in") if s.source["file_name"] == "c.v1.jpg")
    (o,) = sample.objects
    assert (o.category, o.box2d, o.area, int(o.mask[40:50, 30:50].sum())) == ("car", (30, 40, 50, 50), 200, 200)
    convert("voc", tree, "voc", tmp_path / "out")
    found = datumaro_reads(dm, "voc_segmentation")(tmp_path / "out/voc/VOCdevkit/VOC2012")
    (mask,) = (mask for objects in found.values() for _, _, mask in objects)
    assert (mask == o.mask).all()


# FiftyOne


@pytest.fixture(scope="module")
def fiftyone_trees(tmp_path_factory):
    """A folder for each format, in it one for each split where the library has one split in a tree."""
    fo = pytest.importorskip("fiftyone")
    root = tmp_path_factory.mktemp("fiftyone")
    dataset = fo.Dataset()
    for name, file in pictures(root / "src").items():
        sample = fo.Sample(filepath=str(file), tags=[SPLITS[name]])
        sample["truth"] = fo.Detections(
            detections=[
                fo.Detection(
                    label=label,
                    bounding_box=[x0 / WIDTH, y0 / HEIGHT, (x1 - x0) / WIDTH, (y1 - y0) / HEIGHT],
                    **({"mask": np.eye(20, dtype=bool) | (np.arange(20) > 9)} if (x0, y0) == (30, 20) else {}),
                )
                for label, (x0, y0, x1, y1) in BOXES[name]
            ]
        )
        dataset.add_sample(sample)
    dataset.compute_metadata()
    for split in ("train", "val"):
        view = dataset.match_tags(split)
        for kind, name, more in [
            (fo.types.YOLOv5Dataset, "yolo", {"split": split, "classes": CLASSES}),
            (fo.types.YOLOv4Dataset, f"yolo4/{split}", {"classes": CLASSES}),
            (fo.types.COCODetectionDataset, f"coco/{split}", {"classes": CLASSES}),
            (fo.types.VOCDetectionDataset, f"voc/{split}", {}),
        ]:
            view.export(export_dir=str(root / name), dataset_type=kind, label_field="truth", **more)
    yield root
    dataset.delete()


def fiftyone_reads(kind: str, **more: Any) -> Read:
    import fiftyone as fo

    dataset = fo.Dataset.from_dir(dataset_type=getattr(fo.types, kind), label_field="truth", **more)
    scale = np.array(SIZE * 2)
    found = {}
    for sample in dataset:
        truth = sample["truth"] if sample.has_field("truth") else None
        objects = [] if truth is None else truth.detections
        found[digest(sample.filepath)] = [(o.label, (np.array(o.bounding_box) * scale).tolist(), o.mask) for o in objects]
    dataset.delete()
    return found


@pytest.mark.parametrize("kind", ["detections", "segmentations"])
def test_fiftyone_coco(kind, fiftyone_trees, tmp_path):
    tree, splits = fiftyone_trees / "coco", ("train", "val")

    def read(folder):
        found = {}
        for split in splits:
            own = [tree / split / "data", tree / split / "labels.json"]
            places = own if folder == tree else [folder / "images" / split, folder / f"annotations/instances_{split}.json"]
            data, labels = map(str, places)
            found |= fiftyone_reads("COCODetectionDataset", data_path=data, labels_path=labels, label_types=kind)
        return found

    was = comes_in_and_goes_out("coco", tree, tmp_path, read)
    assert Dataset(tmp_path / "in").splits == splits
    assert sorted(map(len, was.values())) == ([0, 1, 1, 2] if kind == "detections" else [0, 0, 0, 1])


def test_fiftyone_yolo(fiftyone_trees, tmp_path):
    def read(folder):
        file = next(folder.glob("*.yaml"))
        reads = [fiftyone_reads("YOLOv5Dataset", yaml_path=str(file), split=split) for split in ("train", "val")]
        return {k: v for one in reads for k, v in one.items()}

    was = comes_in_and_goes_out("yolo", fiftyone_trees / "yolo", tmp_path, read)
    assert sorted(map(len, was.values())) == [0, 1, 1, 2]


def test_fiftyone_darknet(fiftyone_trees, tmp_path):
    tree = fiftyone_trees / "yolo4/train"

    def read(folder):
        if folder == tree:
            return fiftyone_reads("YOLOv4Dataset", dataset_dir=str(folder))
        return fiftyone_reads("YOLOv5Dataset", yaml_path=str(folder / "data.yaml"), split="train")

    was = comes_in_and_goes_out("yolo", tree, tmp_path, read)
    assert sorted(map(len, was.values())) == [1, 2]


@pytest.mark.parametrize("split", ["train", "val"])
def test_fiftyone_voc(split, fiftyone_trees, tmp_path):
    tree = fiftyone_trees / "voc" / split

    def read(folder):
        ends = ("data", "labels") if folder == tree else ("JPEGImages", "Annotations")
        return fiftyone_reads("VOCDetectionDataset", data_path=str(folder / ends[0]), labels_path=str(folder / ends[1]))

    was = comes_in_and_goes_out("voc", tree, tmp_path, read, "VOCdevkit/VOC2012")
    assert sorted(map(len, was.values())) == {"train": [1, 2], "val": [0, 1]}[split]
