"""The tree of Driving in the Matrix: PASCAL VOC's annotations, with PNG pictures in the folder JPEGImages.

    VOC2012/JPEGImages/00000000.png         the pictures
    VOC2012/Annotations/00000000.xml        size; for each object name, pose, truncated, difficult, bndbox
    VOC2012/ImageSets/Main/<split>.txt      names of the pictures; trainval.txt joins train and val

supervision and the data set's own training code read it; torchvision reads no PNG there.

Boxes enclose the visible pixels, counted from 1: xmin = floor(x) + 1, xmax = ceil(x + width). The data set's code subtracts 1
from all four numbers and skips objects whose `difficult` is not 0; the option `smallest` marks objects with fewer visible
pixels. Category names are in lower case, like its `car`. pose is Unspecified; truncated is 1 if more than 15 % of the object is
outside the picture. Invisible objects are left out. Pictures of sequences and of all sensors are ordinary pictures here.

Not stored: distances, masks, 3D boxes and cameras. The original has them in its database, but not in the published files. The
original's lists are trainval10k, trainval50k and trainval200k: give its code the name of your list. Not verified: XML fields
beyond PASCAL VOC's. Source: Johnson-Roberson et al. 2017, "Driving in the Matrix",
https://github.com/umautobots/driving-in-the-matrix.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree

from pydantic import Field

from viewsphere.formats import Scope
from viewsphere.formats.shared.writing.pictures import picture
from viewsphere.formats.shared.writing.refusals import plain_names
from viewsphere.formats.shared.writing.tree import File, Piece, Tree, functions, line
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset

ROOT = "VOC2012"
TRUNCATED = 0.15
"""Share outside the image above which an object counts as truncated."""
NAMES = r"[^\x00-\x1f]+"


class _Options(Frozen):
    """The size below which objects are too small."""

    smallest: int = Field(default=0, ge=0, le=10**9, description="objects that show fewer pixels are `difficult`, and not read")


def _refuses(scope: Scope, options: _Options) -> Iterator[str]:
    """Reasons to refuse: names that XML cannot hold."""
    yield from plain_names(scope, NAMES, "of one line, that XML can hold")


class Matrix(Tree):
    """The tree of a data set."""

    def __init__(self, dataset: Dataset, options: _Options) -> None:
        super().__init__(dataset)
        self._smallest = options.smallest

    def sample_files(self, sample: Sample) -> Iterator[File | Piece]:
        """A picture and its objects."""
        split, _, name = self.stem(sample).partition("/")
        yield File(f"{ROOT}/JPEGImages/{name}.png", picture(sample, ".png"))
        yield File(f"{ROOT}/Annotations/{name}.xml", self._xml(sample, f"{name}.png"))
        yield line(f"{ROOT}/ImageSets/Main/{split}.txt", name)
        if split in ("train", "val"):
            yield line(f"{ROOT}/ImageSets/Main/trainval.txt", name)

    def _xml(self, sample: Sample, file: str) -> bytes:
        root = ElementTree.Element("annotation")
        size = {"width": sample.width, "height": sample.height, "depth": 3}
        _fill(root, {"folder": ROOT, "filename": file, "size": size, "segmented": 0})
        for o in sample.objects:
            if o.box2d is not None:
                _fill(ElementTree.SubElement(root, "object"), _object(o, o.area < self._smallest))
        ElementTree.indent(root, "\t")
        return (ElementTree.tostring(root, "unicode") + "\n").encode()


def _object(o: ObjectAnnotation, difficult: bool) -> dict[str, Any]:
    """Return the record of a visible object."""
    assert o.box2d is not None
    x0, y0, x1, y1 = o.box2d
    return {
        "name": o.category.lower(),
        "pose": "Unspecified",
        "truncated": int(o.truncation > TRUNCATED),
        "difficult": int(difficult),
        "bndbox": {
            "xmin": math.floor(x0) + 1,
            "ymin": math.floor(y0) + 1,
            "xmax": math.ceil(x1),
            "ymax": math.ceil(y1),
        },
    }


def _fill(parent: ElementTree.Element, fields: dict[str, Any]) -> None:
    for tag, value in fields.items():
        child = ElementTree.SubElement(parent, tag)
        if isinstance(value, dict):
            _fill(child, value)  # pyright: ignore[reportUnknownArgumentType]
        else:
            child.text = str(value)


preparer, writer, verify = functions(Matrix)


FORMAT = FormatSpec(
    parallel_rays=True,
    rolling=True,
    about=__doc__,
    holds=("boxes", "truncation"),
    read_by=("supervision", "its own training code"),
    options=_Options,
    channels=("rgb",),
    names_credits=False,
    refuses=_refuses,
    writer=writer,
    preparer=preparer,
    verify=verify,
)
