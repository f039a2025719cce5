"""COCO panoptic segmentation: every pixel belongs to one segment, a thing or stuff. panopticapi, datumaro and trainers read it.

    annotations/panoptic_<split>.json            images, annotations with `segments_info`, categories
    annotations/panoptic_<split>/<image id>.png  segment ids as colours: id = R + 256 G + 65536 B
    images/<split>/<image id>.png                the pictures, or .jpg

The segments come from the channel panoptic. A thing's segment id is its object id, which is stable over a sequence. A stuff
segment's id is 65536 times its class. 0 has no class and no segment. As in COCO, ids are unique only within a picture.
Categories list things first, numbered 1, 2, ... in the data set's order, as in the format coco by default, then stuff.
`isthing` separates the two, and `color` is the colour of semantic maps. All stuff classes are listed, visible or not. `bbox` is
x, y, width and height in pixels from the corner of the first pixel, tight around the segment; `area` counts pixels; `iscrowd`
is 0. Image ids count from 1 and follow the plan, as in the format coco. Large data sets have numbered sub-folders.

Objects without annotations still have segments. Not stored: sequences, sensors, cameras and poses; the format coco has them.
Source: A. Kirillov et al., Panoptic Segmentation, CVPR 2019; https://cocodataset.org/#format-data and
https://github.com/cocodataset/panopticapi.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.formats.shared.writing.paper import json_bytes
from viewsphere.formats.shared.writing.pictures import picture, png, suffix_of
from viewsphere.formats.shared.writing.tree import File, Layout, Piece, Tree, functions, item
from viewsphere.geometry.mask import mask_box
from viewsphere.labels.panoptic import class_of, object_of
from viewsphere.model.annotations.classes import SemanticClass, thing_class
from viewsphere.model.sample import Sample
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset

KINDS = (".png", ".jpg")


class _CocoPanoptic(Tree):
    """The tree of COCO's panoptic task."""

    def __init__(self, dataset: Dataset) -> None:
        super().__init__(dataset)
        ordered = sorted(dataset.classes, key=lambda one: not one.is_thing)
        self._classes = {one.id: (number, one) for number, one in enumerate(ordered, 1)}

    def sample_files(self, sample: Sample) -> Iterator[File | Piece]:
        """A picture, its segments' map, and its entries of the split's JSON."""
        split, _, name = self.stem(sample).partition("/")
        name = f"{name.rpartition('/')[0]}/{sample.index + 1:012d}".lstrip("/")
        ids = _segment_ids(sample.channels["panoptic"])
        image, file, suffix = sample.index + 1, f"annotations/panoptic_{split}", suffix_of(sample, *KINDS)
        yield File(f"images/{split}/{name}{suffix}", picture(sample, *KINDS))
        yield File(f"{file}/{name}.png", png(sample, "coco panoptic", _colors(ids)))
        size = {"width": sample.width, "height": sample.height}
        yield item(f"{file}.json", {"id": image, "file_name": name + suffix, **size}, "images")
        segments = list(self._segments(sample, ids))
        told = {"image_id": image, "file_name": f"{name}.png", "segments_info": segments}
        yield item(f"{file}.json", told, "annotations")

    def layout(self, path: str, counts: Mapping[str, int]) -> Layout:
        """Categories, followed by the entries of samples."""
        supers = {thing_class(category.id): category.supercategory for category in self.dataset.categories}
        head = {
            "info": {"description": self.dataset.name, "version": "1.0"},
            "licenses": [],
            "categories": [_category(number, one, supers) for number, one in self._classes.values()],
        }
        return (json_bytes(head)[:-1] + b',"images":[\n', "images", b'\n],"annotations":[\n', "annotations", b"\n]}\n")

    def _segments(self, sample: Sample, ids: NDArray[np.int64]) -> Iterator[dict[str, Any]]:
        """Yield COCO's record of each segment of a picture, in the order of ids."""
        classes = class_of(sample.channels["panoptic"])
        for number in np.unique(ids[ids > 0]).tolist():
            mask = ids == number
            box = mask_box(mask)
            assert box is not None
            x0, y0, x1, y1 = box
            yield {
                "id": number,
                "category_id": self._classes[int(classes[mask][0])][0],
                "area": int(np.count_nonzero(mask)),
                "bbox": [x0, y0, x1 - x0, y1 - y0],
                "iscrowd": 0,
            }


def _segment_ids(codes: NDArray[np.int32]) -> NDArray[np.int64]:
    """Segment ids (H, W): object ids, and for stuff its class above them."""
    objects = object_of(codes).astype(np.int64)
    return np.where(objects > 0, objects, codes)


def _colors(ids: NDArray[np.int64]) -> NDArray[np.uint8]:
    """Ids as COCO's colours (H, W, 3)."""
    return np.stack([ids >> shift & 255 for shift in (0, 8, 16)], axis=2).astype(np.uint8)


def _category(number: int, one: SemanticClass, supers: Mapping[int, str]) -> dict[str, Any]:
    own = supers.get(one.id, "stuff")
    return {"id": number, "name": one.name, "supercategory": own, "isthing": int(one.is_thing), "color": list(one.color)}


preparer, writer, verify = functions(_CocoPanoptic)


FORMAT = FormatSpec(
    parallel_rays=True,
    rolling=True,
    about=__doc__,
    holds=("panoptic masks", "boxes"),
    read_by=("panopticapi", "datumaro"),
    channels=("rgb", "panoptic"),
    names_credits=False,
    panoramas=True,
    writer=writer,
    preparer=preparer,
    verify=verify,
)
