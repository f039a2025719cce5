"""Writes PASCAL3D+'s tree."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from viewsphere.codecs.palette import palette
from viewsphere.codecs.png_tiff import encode_png
from viewsphere.errors import UserError
from viewsphere.formats.shared.viewpoint_mat import KIT, Cads, Options
from viewsphere.formats.shared.writing.export_files import Coded
from viewsphere.formats.shared.writing.pictures import picture
from viewsphere.formats.shared.writing.tree import File, Piece, Tree, line
from viewsphere.model.sample import Sample
from viewsphere.store import Dataset

MOST = 254  # 255 is void
CLASSES = (
    "aeroplane", "bicycle", "bird", "boat", "bottle", "bus", "car", "cat", "chair", "cow", "diningtable", "dog", "horse",
    "motorbike", "person", "pottedplant", "sheep", "sofa", "train", "tvmonitor",
)  # fmt: skip
"""PASCAL VOC's categories, numbered from 1."""


class Pascal3d(Tree):
    """The tree of a release."""

    def __init__(self, dataset: Dataset, options: Options) -> None:
        super().__init__(dataset)
        self._cads = Cads(dataset, options, "pascal3d")
        names = [category.name for category in dataset.categories]
        others = iter(range(len(CLASSES) + 1, MOST + 1))
        self._numbers = {name: CLASSES.index(name) + 1 if name in CLASSES else next(others) for name in names}
        lists = [f"{name}_{split}" for name in names for split in dataset.splits]
        if twice := next((name for name in lists if lists.count(name) > 1), None):
            raise UserError(f"pascal3d: expected categories and splits that make different names; found {twice} twice")

    def sample_files(self, sample: Sample) -> Iterator[File | Piece]:
        """A picture and its record for each category that it shows, and its maps."""
        split, _, stem = self.stem(sample).partition("/")
        name, seen = stem.rpartition("/")[2], [o for o in sample.objects if o.box2d is not None]
        shown = {o.category for o in seen}
        for category in self._numbers if shown else ():
            yield line(f"{KIT}/ImageSets/Main/{category}_{split}.txt", name, f"{1 if category in shown else -1:2}")
        if not shown:
            return
        record = self._cads.record(sample, seen, f"{name}.jpg", masks=True)
        for category in sorted(shown):
            yield File(f"Images/{category}_pascal/{name}.jpg", picture(sample, ".jpg"))
            yield File(f"Annotations/{category}_pascal/{name}.mat", record)
        objects = np.zeros((sample.height, sample.width), np.uint8)
        for number, o in enumerate(seen, 1):
            objects[o.mask] = number
        classes = np.array([0, *(self._numbers[o.category] for o in seen)], np.uint8)[objects]
        yield File(f"{KIT}/SegmentationClass/{name}.png", _indexed(sample, "classes", classes))
        yield File(f"{KIT}/SegmentationObject/{name}.png", _indexed(sample, "objects", objects))

    def rest(self) -> Iterator[File]:
        """The models, and the names of the category numbers."""
        for category, infos in self._cads.by_category.items():
            if infos:
                yield File(f"CAD/{category}.mat", self._cads.file(category))
            for number, info in enumerate(infos, 1):
                yield File(f"CAD/{category}/{number:02}.off", self._cads.off(info))
        rows = "".join(f"{number} {name}\n" for name, number in sorted(self._numbers.items(), key=lambda one: one[1]))
        yield File(f"{KIT}/classes.txt", rows.encode())


def _indexed(sample: Sample, name: str, numbers: NDArray[np.uint8]) -> Coded:
    """A map (H, W) in VOC's palette."""
    return Coded(sample.index, f"pascal3d {name}.png", lambda: encode_png(numbers, palette=palette()))
