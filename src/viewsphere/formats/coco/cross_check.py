"""The comparison of an exported file with pycocotools, which is independent of this package."""

from __future__ import annotations

import contextlib
import io
import json
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import ViewsphereError
from viewsphere.formats.coco.categories import Names, Options, category_ids, object_points, point_names
from viewsphere.formats.coco.writing import (
    Entries,
    Entry,
    annotation_id,
    file_name,
    file_names,
    files,
    instances,
    seen,
)
from viewsphere.formats.shared.json_proof import check_json
from viewsphere.formats.shared.json_rows import Where, rows
from viewsphere.formats.shared.writing.export_files import Expected, check_files, models
from viewsphere.geometry.mask import encode_rle, mask_box
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.plugins.format import Remark
from viewsphere.scratch import temporary
from viewsphere.store.samples.seam_pieces import PIECE

if TYPE_CHECKING:
    from viewsphere.store import Dataset

OPENED: tuple[Where, ...] = ((), ("categories",), ("models",), ("images",), ("annotations",))
"""The parts of an instances file that the proof reads and compares item by item."""


MOST_FRAMES = 2000
"""Number of frames of a split to check, spread evenly: COCOeval keeps all of them in memory."""

SIGMA = 0.05
"""Sigma of all points in COCOeval's keypoint similarity; at exact positions the similarity is 1 for any value."""

MISTAKES = (LookupError, TypeError, ValueError, AttributeError, AssertionError, OSError)
"""The exceptions that pycocotools raises for invalid files."""


@dataclass(frozen=True)
class _Truth:
    """A visible object, from the stored instance map."""

    frame: int
    category: int
    mask: NDArray[np.bool_]
    box: list[int]  # x, y, width, height
    points: list[float]  # x, y, v of each of its category's points


def _compare_with_pycocotools(
    dataset: Dataset, file: Path, split: str, sampled: Collection[int], options: Options
) -> Iterator[Remark]:
    """Yield masks, areas and boxes that differ from the instance maps, and any AP below 1 for detections made from the maps
    and from the stored keypoints.

    Imported frames are left out, because their true masks are unknown.
    """
    positions = sorted(sampled)
    samples = (dataset[i] for i in positions[:: max(1, -(-len(positions) // MOST_FRAMES))])
    ids, names = category_ids(dataset, options), point_names(dataset)
    truths = {
        annotation_id(dataset, sample, o): truth
        for sample in samples
        if sample.split == split and all(o.source is None for o in sample.objects)
        for o, truth in _truths(sample, ids, names)
    }
    if not truths or not file.is_file():
        return
    try:
        coco = _loaded(file, {truth.frame + 1 for truth in truths.values()})
        for number in truths.keys() & coco.anns.keys():
            yield from _differences(coco, coco.anns[number], truths[number])
        yield from _precision(coco, list(truths.values()), file)
        yield from _precision_of_points(coco, [truth for truth in truths.values() if any(truth.points)], file)
    except Exception as error:  # pycocotools raises bare ones for wrong polygons
        if type(error) is not Exception and not isinstance(error, MISTAKES):
            raise
        yield None, f"{file.name}: expected COCO instances, found {type(error).__name__}: {error}"


def _truths(sample: Sample, ids: Mapping[int, int], names: Names) -> Iterator[tuple[ObjectAnnotation, _Truth]]:
    """The visible objects, taken from the run lengths if there is no map, or if a seam cuts the object."""
    try:
        instances = sample.channels["instances"]
    except (KeyError, ViewsphereError):
        instances = None
    for o in sample.objects:
        mask = o.mask if instances is None or PIECE in o.extra else instances == o.id
        if box := mask_box(mask):
            x0, y0, x1, y1 = box
            points = object_points(o, names).get("keypoints", [])
            yield o, _Truth(sample.index, ids[o.category_id], mask, [x0, y0, x1 - x0, y1 - y0], points)


def _loaded(file: Path, images: Collection[int]) -> Any:
    """The exported file as pycocotools reads it, with only these images."""
    from pycocotools.coco import COCO

    value: dict[str, Any] = {"images": [], "annotations": []}
    for (name, *_), row in rows(file, ((), ("images",), ("annotations",))):
        if name not in {"images", "annotations"}:
            value[name] = row
        elif row["id" if name == "images" else "image_id"] in images:
            value[name].append(row)
    with temporary("coco") as scratch_folder, contextlib.redirect_stdout(io.StringIO()):
        part = scratch_folder / file.name
        part.write_text(json.dumps(value), "utf-8", newline="\n")
        return COCO(part)


def _differences(coco: Any, annotation: dict[str, Any], truth: _Truth) -> Iterator[Remark]:
    counts = coco.annToRLE(annotation)["counts"]
    if not np.array_equal(coco.annToMask(annotation), truth.mask):
        yield truth.frame, f"annotation {annotation['id']}: its segmentation differs from the instance map"
    if (counts if isinstance(counts, str) else counts.decode("ascii")) != encode_rle(truth.mask):
        yield truth.frame, f"annotation {annotation['id']}: its run lengths differ from the instance map's"
    said, area = (annotation["area"], annotation["bbox"]), int(np.count_nonzero(truth.mask))
    if said != (area, truth.box):
        yield truth.frame, f"annotation {annotation['id']}: expected area {area} and bbox {truth.box}, found {said}"


def _precision(coco: Any, truths: Collection[_Truth], file: Path) -> Iterator[Remark]:
    """Average precision of detections made from the stored maps; it must be 1."""
    from pycocotools.cocoeval import COCOeval

    for kind in ("segm", "bbox"):
        with contextlib.redirect_stdout(io.StringIO()):
            evaluation: Any = COCOeval(coco, coco.loadRes([_detection(truth) for truth in truths]), kind)
            evaluation.evaluate()
            evaluation.accumulate()
            evaluation.summarize()
        if not evaluation.stats[0] > 1 - 1e-9:
            found = f"{evaluation.stats[0]:.4f}"
            yield None, f"{file.name}: {kind}: expected AP 1.0 of detections made from the instance maps, found {found}"


def _precision_of_points(coco: Any, truths: Collection[_Truth], file: Path) -> Iterator[Remark]:
    """Average precision of keypoints by category, because each category has its own number of them."""
    from pycocotools.cocoeval import COCOeval

    for category in sorted({truth.category for truth in truths}):
        found = [{**_detection(truth), "keypoints": truth.points} for truth in truths if truth.category == category]
        with contextlib.redirect_stdout(io.StringIO()):
            evaluation: Any = COCOeval(coco, coco.loadRes(found), "keypoints")
            evaluation.params.catIds, evaluation.params.maxDets = [category], [len(found)]
            evaluation.params.kpt_oks_sigmas = np.full(len(found[0]["keypoints"]) // 3, SIGMA)
            evaluation.evaluate()
            evaluation.accumulate()
        precision = evaluation.eval["precision"][..., 0, 0]  # of all areas and detections
        if not precision.min() > 1 - 1e-9:
            told = f"expected AP 1.0 of the stored points of category {category}, found {precision.mean():.4f}"
            yield None, f"{file.name}: keypoints: {told}"


def _detection(truth: _Truth) -> dict[str, Any]:
    code = {"size": list(truth.mask.shape), "counts": encode_rle(truth.mask)}
    return {"image_id": truth.frame + 1, "category_id": truth.category, "score": 1.0, "bbox": truth.box, "segmentation": code}


def verify(dataset: Dataset, folder: Path, sampled: Collection[int], options: Options) -> Iterator[Remark]:
    """Yield every difference from the current export. For the `sampled` frames, pycocotools' masks must equal the stored
    instance maps, and detections made from these maps must score AP 1.
    """
    names = file_names(dataset)
    with temporary("coco") as scratch_folder:
        with instances(dataset, scratch_folder, options) as append:
            expected, again = _expected(dataset, append, options), _expected(dataset, _nowhere, options)
            yield from check_files(dataset, folder, expected, again, [f"annotations/{name}" for name in names])
        for name in names:
            yield from check_json(scratch_folder / name, folder / "annotations" / name, OPENED, _frame)
        for split in dataset.splits:
            yield from _compare_with_pycocotools(dataset, folder / "annotations" / file_name(split), split, sampled, options)


def _expected(dataset: Dataset, append: Callable[[Entry], None], options: Options) -> Iterator[Expected]:
    """Yield every file except the instances; for the instances, `append` receives each frame."""
    entries = Entries(dataset, options)
    for sample in dataset:
        masks = seen(sample)
        append(entries.entry(sample, masks))
        yield from files(dataset, sample, masks, options)
    yield from models(dataset)


def _nowhere(entry: Entry) -> None:
    """Ignore a frame, for callers that need only its files."""


def _frame(where: Where, value: Any) -> int | None:
    """The frame of an image id: ids are frames counted from 1."""
    key = {"images": "id", "annotations": "image_id"}.get(where[0] if where else "")
    number = value.get(key) if key and isinstance(value, dict) else None
    return number - 1 if isinstance(number, int) else None
