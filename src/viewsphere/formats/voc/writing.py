"""Writes a data set as PASCAL VOC."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Literal, cast
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.codecs.palette import palette
from viewsphere.codecs.png_tiff import encode_png
from viewsphere.formats.shared.writing.export_files import Coded
from viewsphere.formats.shared.writing.pictures import picture
from viewsphere.formats.shared.writing.tree import File, Piece, Tree, line
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Portion
from viewsphere.model.sample import Box, ObjectAnnotation, ObjectView, Sample
from viewsphere.store import Dataset

BOX = ("xmin", "ymin", "xmax", "ymax")
ROOT = "VOCdevkit/VOC2012"
VIEWS = {0: "Frontal", 90: "Left", 180: "Rear", 270: "Right"}
"""VOC's views by the azimuth from which an object is seen."""

TURNED, TILTED = 20, 45
"""Greatest deviation in azimuth from a view, and greatest elevation and tilt, degrees."""

TRUNCATED, OCCLUDED = 0.15, 0.05
"""Shares above which an object is truncated or occluded, by the guidelines."""


class Options(Frozen):
    """The encoding of pictures, and the limit below which objects are difficult."""

    pictures: Literal["jpg", "png"] = Field(
        default="jpg",
        description="`jpg`: as VOC's own, with losses; `png`: without, but torchvision reads no PNG",
    )
    difficult_below: Portion = Field(
        default=0.1,
        description="an object is difficult, so that evaluations pass over it, where less than this share is seen",
    )


class Voc(Tree):
    """The tree of a development kit."""

    def __init__(self, dataset: Dataset, options: Options) -> None:
        super().__init__(dataset)
        self._options = options
        self._numbers = {category.id: number for number, category in enumerate(dataset.categories, 1)}

    def sample_files(self, sample: Sample) -> Iterator[File | Piece]:
        """A picture, its XML and its two maps. A picture with objects without masks, as imported ones may have, is not listed
        as segmented.
        """
        split, _, name = self.stem(sample).partition("/")
        suffix, seen = f".{self._options.pictures}", [o for o in sample.objects if o.box2d is not None]
        yield File(f"{ROOT}/JPEGImages/{name}{suffix}", picture(sample, suffix))
        masks = [o.mask for o in seen]
        has_masks = all(mask.any() for mask in masks)
        yield File(f"{ROOT}/Annotations/{name}.xml", self._xml(sample, name + suffix, seen, has_masks))
        yield line(f"{ROOT}/ImageSets/Main/{split}.txt", name)
        if has_masks or any(mask.any() for mask in masks):
            objects = np.zeros((sample.height, sample.width), np.uint8)
            for number, mask in enumerate(masks, 1):
                objects[mask] = number
            classes = np.array([0, *(self._numbers[o.category_id] for o in seen)], np.uint8)
            yield File(f"{ROOT}/SegmentationClass/{name}.png", _indexed(sample, "classes", classes[objects]))
            yield File(f"{ROOT}/SegmentationObject/{name}.png", _indexed(sample, "objects", objects))
        if has_masks:
            yield line(f"{ROOT}/ImageSets/Segmentation/{split}.txt", name)

    def rest(self) -> Iterator[File]:
        """The names of the category numbers."""
        colors = palette().tolist()
        named = ["background", *(category.name for category in self.dataset.categories)]
        rows = (f"{name}:{','.join(map(str, colors[number]))}::\n" for number, name in enumerate(named))
        yield File(f"{ROOT}/labelmap.txt", ("# label:color_rgb:parts:actions\n" + "".join(rows)).encode())

    def _xml(self, sample: Sample, file: str, seen: Sequence[ObjectAnnotation], has_masks: bool) -> bytes:
        root = ElementTree.Element("annotation")
        _add(root, {"folder": "VOC2012", "filename": file, "source": {"database": self.dataset.name}})
        _add(root, {"size": {"width": sample.width, "height": sample.height, "depth": 3}, "segmented": int(has_masks)})
        for o in seen:
            _add(root, {"object": _object(o, self._options.difficult_below)})
        ElementTree.indent(root, "\t")
        return (ElementTree.tostring(root, "unicode") + "\n").encode()


def _object(o: ObjectAnnotation, difficult_below: float) -> dict[str, Any]:
    """The fields of an object. Imported objects keep their fields; missing flags are 0."""
    assert o.box2d is not None
    inside = 1 - o.truncation
    told = {key: value for key, value in (o.source or {}).items() if key in ("pose", "truncated", "occluded", "difficult")}
    return {
        "name": o.category,
        "pose": _pose(o.view),
        "truncated": int(o.truncation > TRUNCATED),
        "occluded": int(inside > 0 and 1 - o.visibility / inside > OCCLUDED),
        "difficult": int(o.visibility < difficult_below),
        **told,
        "bndbox": dict(zip(BOX, _bounds(o.box2d, (o.source or {}).get("bndbox")), strict=True)),
        **_polygons(o),
    }


def _bounds(box: Box, said: Any) -> list[int | float]:
    """The box's first and last pixels, counted from 1; imported boxes in another convention keep their numbers."""
    x0, y0, x1, y1 = box
    if isinstance(said, list) and len(numbers := _numbers(cast(list[Any], said))) == len(BOX):
        return numbers
    return [math.floor(x0) + 1, math.floor(y0) + 1, math.ceil(x1), math.ceil(y1)]


def _polygons(o: ObjectAnnotation) -> dict[str, Any]:
    """The corners, counted from 1, of imported polygons."""
    source = o.source or {}
    rings = source.get("segmentation") if source.get("polygon") is True else None
    if not isinstance(rings, list) or len(rings := cast(list[Any], rings)) != 1 or not isinstance(rings[0], list):
        return {}
    numbers = _numbers([value + 1 for value in _numbers(cast(list[Any], rings[0]))])
    return {"polygon": {f"{'xy'[i % 2]}{i // 2 + 1}": value for i, value in enumerate(numbers)}}


def _numbers(values: list[Any]) -> list[int | float]:
    """The numbers, whole ones without a point; empty if any value is not a finite number."""
    found = [value for value in values if isinstance(value, int | float) and math.isfinite(value)]
    return [int(value) if value == int(value) else value for value in found] if len(found) == len(values) else []


def _pose(view: ObjectView) -> str:
    """VOC's name of a view; NaN is no view."""

    def off(azimuth: int) -> float:
        return abs((view.azimuth_deg - azimuth + 180) % 360 - 180)

    nearest = min(VIEWS, key=off)
    is_upright = abs(view.elevation_deg) <= TILTED and abs(view.tilt_deg) <= TILTED
    return VIEWS[nearest] if off(nearest) <= TURNED and is_upright else "Unspecified"


def _add(parent: ElementTree.Element, fields: Mapping[str, Any]) -> None:
    for tag, value in fields.items():
        child = ElementTree.SubElement(parent, tag)
        if isinstance(value, dict):
            _add(child, value)
        else:
            child.text = str(value)


def _indexed(sample: Sample, name: str, numbers: NDArray[np.uint8]) -> Coded:
    """A map (H, W) in VOC's palette."""
    return Coded(sample.index, f"voc {name}.png", lambda: encode_png(numbers, palette=palette()))
