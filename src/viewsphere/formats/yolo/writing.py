"""Writes a data set as YOLO."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Literal

import numpy as np
import yaml
from pydantic import Field

from viewsphere.errors import UserError
from viewsphere.formats.shared.writing.pictures import picture, suffix_of
from viewsphere.formats.shared.writing.polygons import one_ring
from viewsphere.formats.shared.writing.tree import File, Piece, Tree
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.store import Dataset

KINDS = (".png", ".jpg", ".webp")
STATES = {0: 2, 1: 1}  # of viewsphere's keypoints; points outside or behind the camera are not labelled


class Options(Frozen):
    """The labels that the export writes."""

    task: Literal["detect", "segment", "pose", "obb"] = Field(
        default="detect",
        description="`detect`: boxes; `segment`: polygons; `pose`: boxes with keypoints; `obb`: oriented boxes",
    )


class Yolo(Tree):
    """The tree of a task."""

    def __init__(self, dataset: Dataset, options: Options) -> None:
        super().__init__(dataset)
        self._task = options.task
        self._classes = {category.id: number for number, category in enumerate(dataset.categories)}
        self._points = _points(dataset) if options.task == "pose" else {}
        if options.task == "pose" and not self._points:
            raise UserError("yolo: expected models with keypoints for task pose; found none: name some in the models' sidecars")

    def sample_files(self, sample: Sample) -> Iterator[File | Piece]:
        """A picture and its labels."""
        stem = self.stem(sample)
        yield File(f"images/{stem}{suffix_of(sample, *KINDS)}", picture(sample, *KINDS))
        rows = (self._row(sample, o) for o in sample.objects if o.box2d is not None)
        yield File(f"labels/{stem}.txt", "".join(f"{row}\n" for row in rows if row).encode())

    def rest(self) -> Iterator[File]:
        """The data.yaml, from which training starts."""
        splits = {name: f"images/{name}" for name in self.dataset.splits}
        data: dict[str, Any] = {**splits}  # without a path, which Ultralytics would resolve from the working folder
        data |= {name: next(iter(splits.values())) for name in ("train", "val") if name not in splits}
        if self._points:
            data["kpt_shape"] = [len(self._points), 3]
            data["flip_idx"] = _flipped(self.dataset, self._points)
            names = list(self._points)
            data["kpt_names"] = {number: names for number in self._classes.values()}
        data["names"] = {self._classes[category.id]: category.name for category in self.dataset.categories}
        yield File("data.yaml", yaml.safe_dump(data, sort_keys=False, allow_unicode=True).encode())

    def _row(self, sample: Sample, o: ObjectAnnotation) -> str:
        """A line of labels; empty for an object without data for the task."""
        assert o.box2d is not None
        size = np.array([sample.width, sample.height])
        low, high = np.array(o.box2d[:2]) / size, np.array(o.box2d[2:]) / size
        numbers = [*((low + high) / 2), *(high - low)]
        if self._task == "segment":
            rings = _rings(o)
            if not rings:
                return ""
            numbers = (one_ring(rings) / size).ravel()
        elif self._task == "obb":
            corners = o.extra.get("obb")
            if corners is None:
                return ""
            numbers = np.clip(corners / size, 0, 1).ravel()
        elif self._task == "pose":
            numbers += self._marked(o, size).ravel().tolist()
        return " ".join([str(self._classes[o.category_id]), *(f"{value:.8g}" for value in numbers)])

    def _marked(self, o: ObjectAnnotation, size: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        """Return every point, (N, 3): x, y, v; 0 0 0 for points that the object does not have, or that are outside the
        picture.
        """
        found = np.zeros((len(self._points), 3))
        if "keypoint_names" not in o.extra:  # imported, as a box alone
            return found
        for name, place, state in zip(o.keypoint_names, o.keypoints, o.keypoint_states, strict=True):
            if int(state) in STATES and name in self._points:
                found[self._points[name]] = (*(place / size), STATES[int(state)])
        return found


def _rings(o: ObjectAnnotation) -> list[list[float]]:
    """The rings of an object's mask; an imported object keeps its own rings."""
    said = (o.source or {}).get("segmentation")
    return said if said and isinstance(said, list) else o.polygons if o.area else []


def _points(dataset: Dataset) -> dict[str, int]:
    """The names of all models' points, and their numbers; for imported data sets, the points of the first object with
    points.
    """
    names = [name for model in dataset.models for name in (model.keypoints.points if model.keypoints else ())]
    if not names:
        marked = (o.extra.get("keypoint_names") for sample in dataset for o in sample.objects)
        names = next((found for found in marked if found), ())
    return {name: number for number, name in enumerate(dict.fromkeys(names))}


def _flipped(dataset: Dataset, points: Mapping[str, int]) -> list[int]:
    """The index of each point's counterpart in a mirror image."""
    told = next((sample.source["flip_idx"] for sample in dataset if sample.source and "flip_idx" in sample.source), None)
    if told is not None and len(told) == len(points):
        return list(told)
    pairs = [pair for model in dataset.models if model.keypoints for pair in model.keypoints.flips]
    swapped = {one: other for pair in pairs for one, other in (pair, pair[::-1])}
    return [points[swapped.get(name, name)] for name in points]
