"""PASCAL VOC, as the VOC2012 development kit has it; read by torchvision, supervision, datumaro and most trainers of detectors.

    VOCdevkit/VOC2012/JPEGImages/<index>.jpg             the pictures; .png with `pictures: png`
    VOCdevkit/VOC2012/Annotations/<index>.xml            size; of each object name, pose, truncated, occluded, difficult, box
    VOCdevkit/VOC2012/SegmentationClass/<index>.png      palette picture: 0 background, else the category's number
    VOCdevkit/VOC2012/SegmentationObject/<index>.png     palette picture: 0 background, else the object's place in the XML
    VOCdevkit/VOC2012/ImageSets/Main/<split>.txt         names of a split's pictures; in Segmentation/, of those with masks
    VOCdevkit/VOC2012/labelmap.txt                       names and colours of the categories' numbers, for datumaro

Boxes are around the visible pixels and count pixels from 1, both ends inside: xmin = floor(x) + 1, xmax = ceil(x + w).
datumaro takes them as such with `coordinate_mode="voc-one-based"`, supervision always; torchvision gives the numbers as they
are. Categories' numbers count from 1 in the data set's order; their colours are VOC's palette. Objects of which nothing is seen
have no entry.

truncated: more than 15 % of the object lies outside of the picture. occluded: others hide more than 5 % of what lies inside.
Both numbers are those of the annotators' guidelines. pose: Frontal, Rear, Left or Right, where the camera stands within 20
degrees of that side, no more than 45 degrees above or below and tilted; else Unspecified. Left is seen of an object that shows
its own left side: it faces the picture's left. difficult: see the option.

Lost: sequences, sensors and cameras. Masks have no void line (255) around objects, as VOC's own have: all pixels are known. The
class lists of the classification task (`<category>_<split>.txt`) and `trainval.txt` are not written: they follow from the XML,
and from `train.txt` and `val.txt`. torchvision takes only splits named train, val and trainval, and pictures that are JPEG;
supervision looks at no sub-folders, which data sets of more than 10,000 pictures have; datumaro passes over splits with `_` in
their name. Not verified: what `Left` means, of which the guidelines say nothing. Source: M. Everingham et al., The PASCAL
Visual Object Classes Challenge, http://host.robots.ox.ac.uk/pascal/VOC/voc2012/, and its annotation guidelines of 2009.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Literal
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.codecs.palette import palette
from viewsphere.codecs.png_tiff import encode_png
from viewsphere.formats import Scope
from viewsphere.formats._contents import Coded
from viewsphere.formats._pictures import picture
from viewsphere.formats._refusals import most_categories, most_objects, plain_names
from viewsphere.formats._tree import File, Piece, Tree, functions, line
from viewsphere.model.frozen import Frozen
from viewsphere.model.numbers import Portion
from viewsphere.model.sample import ObjectAnnotation, ObjectView, Sample
from viewsphere.store import Dataset

CHANNELS = ("rgb",)
CREDITS = False
HOLDS = ("boxes", "class masks", "instance masks", "truncation", "occlusion", "pose categories")
READ_BY = ("torchvision", "supervision", "datumaro")

ROOT = "VOCdevkit/VOC2012"
MOST = 254  # 255 is void
NAMES = r"[^:#\x00-\x1f][^:\x00-\x1f]*"
"""Names of categories that XML and a line of labelmap.txt can hold."""

VIEWS = {0: "Frontal", 90: "Left", 180: "Rear", 270: "Right"}
"""By the azimuth from which an object is seen."""

TURNED, TILTED = 20, 45
"""Most degrees of azimuth off a view, and of elevation and tilt."""

TRUNCATED, OCCLUDED = 0.15, 0.05
"""Shares above which an object is so, by the guidelines."""


class Options(Frozen):
    """How pictures are kept, and which objects count as difficult."""

    pictures: Literal["jpg", "png"] = Field(
        default="jpg",
        description="`jpg`: as VOC's own, with losses; `png`: without, but torchvision reads no PNG",
    )
    difficult_below: Portion = Field(
        default=0.1,
        description="an object is difficult, so that evaluations pass over it, where less than this share is seen",
    )


def refuses(scope: Scope, options: Options) -> Iterator[str]:
    """Numbers of 8 bits, and names that fill a line."""
    yield from most_categories(scope, MOST)
    yield from most_objects(scope, MOST)
    yield from plain_names(scope, NAMES)


class Voc(Tree):
    """The tree of a development kit."""

    def __init__(self, dataset: Dataset, options: Options) -> None:
        super().__init__(dataset)
        self._options = options
        self._numbers = {category.id: number for number, category in enumerate(dataset.categories, 1)}

    def of(self, sample: Sample) -> Iterator[File | Piece]:
        """A picture, its XML and, if all its objects have masks, its two maps."""
        split, _, name = self.stem(sample).partition("/")
        suffix, seen = f".{self._options.pictures}", [o for o in sample.objects if o.box2d is not None]
        yield File(f"{ROOT}/JPEGImages/{name}{suffix}", picture(sample, suffix))
        masks = [o.mask for o in seen]
        has_masks = all(mask.any() for mask in masks)
        yield File(f"{ROOT}/Annotations/{name}.xml", self._xml(sample, name + suffix, seen, has_masks))
        yield line(f"{ROOT}/ImageSets/Main/{split}.txt", name)
        if has_masks:
            objects = np.zeros((sample.height, sample.width), np.uint8)
            for number, mask in enumerate(masks, 1):
                objects[mask] = number
            classes = np.array([0, *(self._numbers[o.category_id] for o in seen)], np.uint8)
            yield File(f"{ROOT}/SegmentationClass/{name}.png", _indexed(sample, "classes", classes[objects]))
            yield File(f"{ROOT}/SegmentationObject/{name}.png", _indexed(sample, "objects", objects))
            yield line(f"{ROOT}/ImageSets/Segmentation/{split}.txt", name)

    def rest(self) -> Iterator[File]:
        """The names of the numbers."""
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
    """The fields of an object; of imported ones, of which less is known, flags are 0."""
    assert o.box2d is not None
    x0, y0, x1, y1 = o.box2d
    inside = 1 - o.truncation
    return {
        "name": o.category,
        "pose": _pose(o.view),
        "truncated": int(o.truncation > TRUNCATED),
        "occluded": int(inside > 0 and 1 - o.visibility / inside > OCCLUDED),
        "difficult": int(o.visibility < difficult_below),
        "bndbox": {
            "xmin": math.floor(x0) + 1,
            "ymin": math.floor(y0) + 1,
            "xmax": math.ceil(x1),
            "ymax": math.ceil(y1),
        },
    }


def _pose(view: ObjectView) -> str:
    """VOC's name of a view; NaN is none."""

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


preparer, writer, verify = functions(Voc)
