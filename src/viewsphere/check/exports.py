"""Proofs of the exports: COCO against the stored instance maps, native JSON against the paper's keys."""

from __future__ import annotations

import contextlib
import io
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from viewsphere.check.failure import failure
from viewsphere.errors import ViewsphereError
from viewsphere.formats import coco, native
from viewsphere.geometry.mask import encode_rle, mask_box
from viewsphere.model.sample import Sample
from viewsphere.store import Dataset

EVALUATED_IMAGES = 2000
"""Images a split is evaluated on at most, spread evenly: COCOeval keeps all of them in memory."""

RENEWED = {"id", "image_id", "category_id", "path_mask"}
"""What an imported annotation does not keep."""

Remark = tuple[int | None, str]


@dataclass(frozen=True)
class FrameTruth:
    """What the stored instance map says of one object: run lengths and tight box, None where it is not seen."""

    frame: int
    split: str
    pose: int | None
    object_id: int
    key: str
    category_id: int
    size: tuple[int, int]
    counts: str
    box: tuple[int, int, int, int] | None
    source: Mapping[str, Any] | None = None

    @property
    def is_expected(self) -> bool:
        """Whether COCO has an annotation for it: it is seen, or was imported with one."""
        return self.box is not None or self.source is not None


def frame_truth(sample: Sample) -> Iterator[FrameTruth]:
    """All objects of a frame, from its instance map; from the annotations where there is none to read. Of a frame without
    objects one that is not seen, number 0.
    """
    pose = sample.known_pose and sample.known_pose.index
    if not sample.objects:
        yield FrameTruth(sample.index, sample.split, pose, 0, "", 0, (sample.height, sample.width), "", None)
    try:
        instances = sample.channels["instances"]
    except (KeyError, ViewsphereError):
        instances = None
    for o in sample.objects:
        try:
            mask = o.mask if instances is None else instances == o.id
        except ValueError:
            continue  # the frame's own proofs say so
        yield FrameTruth(
            sample.index,
            sample.split,
            pose,
            o.id,
            o.key,
            o.category_id,
            mask.shape,
            encode_rle(mask),
            mask_box(mask),
            o.source if o.box2d else None,
        )


def check_coco(dataset: Dataset, truths: Sequence[FrameTruth], notes: list[str]) -> Iterator[Remark]:
    """Annotations are the stored maps' objects, pixel for pixel, and detections made from these score AP 1."""
    exported = dataset.root / "coco"
    with TemporaryDirectory() as aside:
        complete = (exported / "annotations").is_dir()
        folder = exported if complete else Path(aside)
        if not complete:
            notes.append("coco: not exported; its annotations were made for this check")
            try:
                coco.write_annotations(dataset, folder)
            except Exception as error:
                yield None, failure("annotations that can be written", error)
                return
        seen = set[int]()
        for split in dataset.splits:
            file = folder / "annotations" / f"instances_{split}.json"
            own = [t for t in truths if t.split == split]
            try:
                with contextlib.redirect_stdout(io.StringIO()):
                    truth = _load(file)
                yield from _coco_split(dataset, truth, own, seen)
                if complete:
                    yield from _coco_files(truth, folder / split)
                yield from _precision(dataset, truth, own)
            except Exception as error:
                yield None, f"{file}: {failure('COCO instances', error)}"


def _load(file: Path) -> Any:
    from pycocotools.coco import COCO

    return COCO(file)


def _annotation_id(dataset: Dataset, truth: FrameTruth) -> int:
    return dataset.plan.annotation_id(truth.frame, truth.object_id)


def _coco_split(dataset: Dataset, truth: Any, own: Sequence[FrameTruth], seen: set[int]) -> Iterator[Remark]:
    """Ids, images and annotations of one split; `seen` gathers the annotation ids of all."""
    images: list[int] = [image["id"] for image in truth.dataset["images"]]
    annotations: list[dict[str, Any]] = truth.dataset["annotations"]
    numbers: list[int] = [a["id"] for a in annotations]
    if len(set(images)) != len(images) or len(set(numbers)) != len(numbers) or seen & set(numbers):
        yield None, "expected unique ids, found some twice"
    if any(i < 1 for i in (*images, *numbers)):
        yield None, "expected ids from 1, found smaller ones"
    seen |= set(numbers)
    for frame in sorted({t.frame for t in own} ^ {i - 1 for i in images}):
        yield frame, "expected an image for each finished frame, found none, or one too many: export again"
    expected = {_annotation_id(dataset, t): t for t in own if t.is_expected}
    for number in sorted(set(expected) - set(numbers)):
        yield expected[number].frame, f"object {expected[number].object_id}: expected annotation {number}, found none"
    ids = coco.category_ids(dataset)
    for annotation in annotations:
        mine = expected.get(annotation["id"])
        if mine is None:
            yield annotation["image_id"] - 1, f"annotation {annotation['id']}: expected none, its object is not seen"
            continue
        if (annotation["image_id"], annotation["category_id"]) != (mine.frame + 1, ids[mine.category_id]):
            yield (
                mine.frame,
                f"annotation {annotation['id']}: expected image {mine.frame + 1}, category {ids[mine.category_id]}",
            )
        proof = _coco_annotation if mine.source is None else _foreign_annotation
        yield from ((mine.frame, message) for message in proof(truth, annotation, mine))


def _foreign_annotation(truth: Any, annotation: dict[str, Any], mine: FrameTruth) -> Iterator[str]:
    """An imported annotation is what it was, but for its ids."""
    changed = {k for k, v in (mine.source or {}).items() if k not in RENEWED and annotation.get(k) != v}
    if changed:
        yield f"annotation {annotation['id']}: expected the imported one's {', '.join(sorted(changed))}; found others"


def _coco_annotation(truth: Any, annotation: dict[str, Any], mine: FrameTruth) -> Iterator[str]:
    from pycocotools import mask as rle

    assert mine.box is not None
    name = f"annotation {annotation['id']}"
    code = truth.annToRLE(annotation)
    if code["counts"].decode("ascii") != mine.counts:
        stored: Any = {"size": list(mine.size), "counts": mine.counts.encode("ascii")}
        if not np.array_equal(rle.decode(code), rle.decode(stored)):
            yield f"{name}: its segmentation differs from the instance map"
    x0, y0, x1, y1 = mine.box
    if annotation["bbox"] != [x0, y0, x1 - x0, y1 - y0]:
        yield f"{name}: expected bbox {[x0, y0, x1 - x0, y1 - y0]}, found {annotation['bbox']}"
    if annotation["area"] != rle.area(code):
        yield f"{name}: expected area {rle.area(code)}, found {annotation['area']}"


def _coco_files(truth: Any, folder: Path) -> Iterator[Remark]:
    for image in truth.dataset["images"]:
        if not (folder / image["file_name"]).is_file():
            yield image["id"] - 1, f"expected {folder.name}/{image['file_name']}, found no such file"
    for annotation in truth.dataset["annotations"]:
        if "path_mask" in annotation and not (folder / annotation["path_mask"]).is_file():
            yield annotation["image_id"] - 1, f"expected {folder.name}/{annotation['path_mask']}, found no such file"


def _precision(dataset: Dataset, truth: Any, own: Sequence[FrameTruth]) -> Iterator[Remark]:
    """Average precision of detections rebuilt from the stored maps; it must be 1."""
    from pycocotools.cocoeval import COCOeval

    ids = coco.category_ids(dataset)
    foreign = {t.frame for t in own if t.source is not None}
    frames = sorted({t.frame for t in own} - foreign)
    images = {f + 1 for f in frames[:: max(1, -(-len(frames) // EVALUATED_IMAGES))]}
    detections: list[dict[str, Any]] = []
    for t in own:
        if t.box and t.frame + 1 in images:
            x0, y0, x1, y1 = t.box
            code = {"size": list(t.size), "counts": t.counts}
            bbox = [x0, y0, x1 - x0, y1 - y0]
            found = {"image_id": t.frame + 1, "category_id": ids[t.category_id], "score": 1.0}
            detections.append({**found, "bbox": bbox, "segmentation": code})
    if not detections:
        return
    for kind in ("segm", "bbox"):
        with contextlib.redirect_stdout(io.StringIO()):
            evaluation: Any = COCOeval(truth, truth.loadRes([dict(d) for d in detections]), kind)
            evaluation.params.imgIds = sorted(images)
            evaluation.evaluate()
            evaluation.accumulate()
            evaluation.summarize()
        if not evaluation.stats[0] > 1 - 1e-9:
            yield None, f"{kind}: expected AP 1.0 of detections made from the instance maps, found {evaluation.stats[0]:.4f}"


VEHICLE_KEYS = {"supercategory", "category", "model_file", "bbox3D_model", "real_size"}
POSE_KEYS = {"distance", "elevation", "azimuth", "transformation_matrix", "vehicles_rendered"}
RENDERED_KEYS = {"path_rgb", "path_mask", "path_depth", "render_resolution", "render_scale", "bbox_3D_pxs"}
FACE_NAMES = ["ground", "top", "right", "front", "left", "back"]


def check_native(dataset: Dataset, truths: Sequence[FrameTruth]) -> Iterator[Remark]:
    """The native JSON has the paper's keys, an entry for every object of every frame with a pose, and its files."""
    truths = [truth for truth in truths if truth.pose is not None]
    folder = dataset.root / "native"
    try:
        value = json.loads((folder / "dataset1.json").read_text("utf-8"))
        yield from _native(dataset, folder, value, truths)
    except Exception as error:
        yield None, f"{folder / 'dataset1.json'}: {failure('the native format', error)}"


def _native(dataset: Dataset, folder: Path, value: dict[str, Any], truths: Sequence[FrameTruth]) -> Iterator[Remark]:
    for key in (info.key for info in dataset.models):
        vehicle = value["vehicles"].get(key, {})
        if not vehicle.keys() >= VEHICLE_KEYS or list(vehicle["bbox3D_model"]) != FACE_NAMES:
            yield None, f"vehicle {key}: expected the keys {sorted(VEHICLE_KEYS)}, found {sorted(vehicle)}"
        elif not (folder / vehicle["model_file"]).is_file():
            yield None, f"vehicle {key}: expected {vehicle['model_file']}, found no such file"
    entries = 0
    for truth in truths:
        pose = value["poses"].get(str(truth.pose), {})
        if not pose.keys() >= POSE_KEYS or not pose["distance"] > 0:
            yield truth.frame, f"pose {truth.pose}: expected the keys {sorted(POSE_KEYS)} and a positive distance"
            continue
        entry = pose["vehicles_rendered"].get(native.object_name(dataset, truth.frame, truth.object_id, truth.key))
        if entry is None or not entry.keys() >= RENDERED_KEYS or list(entry["bbox_3D_pxs"]) != FACE_NAMES:
            yield truth.frame, f"object {truth.object_id}: expected an entry with the keys {sorted(RENDERED_KEYS)}"
            continue
        entries += 1
        if (tuple(entry["bbox_2D"]) if entry["bbox_2D"] else None) != truth.box:
            yield truth.frame, f"object {truth.object_id}: expected bbox_2D {truth.box}, found {entry['bbox_2D']}"
        for kind, path in (("RGB", "path_rgb"), ("MASK", "path_mask"), ("DEPTH", "path_depth")):
            if entry[path] is not None and not (folder / pose["folder"] / kind / entry[path]).is_file():
                yield truth.frame, f"expected {pose['folder']}/{kind}/{entry[path]}, found no such file"
    found = sum(len(pose["vehicles_rendered"]) for pose in value["poses"].values())
    if found != len(truths):
        yield None, f"expected {len(truths)} rendered objects, found {found}: export again"
