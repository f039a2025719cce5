r"""Pictures in a folder of their class, for torchvision's `ImageFolder` and Hugging Face's `imagefolder`.

    README.md                          for `datasets`: the folder of each split
    <split>/<class>/<index>.png        the pictures
    <split>/metadata.jsonl             for `datasets`: a line for each picture: file_name, label, and more of the object

The class is the category, or the pose category (the visible side), of the object with the most visible pixels; the lowest id
wins a tie. Pictures without an object are left out. `metadata.jsonl` describes this object: `label` (the class), `category`,
`pose_category`, `model`; `azimuth`, `elevation`, `tilt` (degrees) and `distance` (metres) of the camera relative to it;
`visibility` (0 to 1) and `box` (visible pixels, half-open corners x0, y0, x1, y1). `index` and `objects`, the number of visible
objects, describe the picture. Unknown values are null.

A folder has the name of its class. Readers would miss some names, so `%` and a code, as in URLs, replace each of
`<>:"/\|?*[]%`, control characters, and a dot, space or underscore at either end. torchvision numbers the sorted folders of one
split from 0: a split that lacks a class has other numbers. `datasets` returns the columns of `metadata.jsonl`, with the
unchanged names. Large data sets have numbered folders inside the class folders. Sources: torchvision's documentation of
`ImageFolder`; https://huggingface.co/docs/datasets/image_dataset.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from typing import Any, Literal

import yaml
from pydantic import Field

from viewsphere.errors import UserError
from viewsphere.formats import Scope
from viewsphere.formats.shared.writing.paper import json_bytes
from viewsphere.formats.shared.writing.pictures import picture, suffix_of
from viewsphere.formats.shared.writing.tree import LINES, File, Layout, Piece, Tree, functions
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset

KINDS = (".png", ".jpg", ".webp")
CARD = "README.md"
UNFIT = re.compile(r'[<>:"/\\|?*\[\]%\x00-\x1f\x7f]|^[. _]|[. _]$')
LONGEST = 255
"""Largest number of bytes in a folder's name."""


class _Options(Frozen):
    """The meaning of a class."""

    by: Literal["category", "pose_category"] = Field(
        default="category", description="`category`: what the object is; `pose_category`: which side of it is seen"
    )


def _refuses(scope: Scope, options: _Options) -> Iterator[str]:
    """Reasons to refuse: categories whose folders would coincide, and splits that `datasets` cannot distinguish."""
    names = [_folder(category.name) for category in scope.categories] if options.by == "category" else []
    for name in names:
        if not name or len(name.encode()) > LONGEST:
            yield f"expected names of categories that fit a folder's, 1 to {LONGEST} bytes; found {name!r}"
    for kind, found in (("categories", names), ("splits", [_split(name) for name in scope.splits])):
        if len({name.casefold() for name in found}) < len(found):
            yield f"expected names of {kind} that differ in more than case and signs; found {', '.join(found)}"


class ImageFolder(Tree):
    """The tree of these classes."""

    def __init__(self, dataset: Dataset, options: _Options) -> None:
        super().__init__(dataset)
        self._by = options.by

    def sample_files(self, sample: Sample) -> Iterator[File | Piece]:
        """A picture and its line; nothing for a picture without objects."""
        seen = [o for o in sample.objects if o.area]
        if not seen:
            return
        o = max(seen, key=lambda one: (one.area, -one.id))
        label = str(getattr(o, self._by))
        if not label:
            raise UserError(f"imagefolder: expected the {self._by} of object {o.id}; found none (frame {sample.index})")
        split, _, place = self.stem(sample).partition("/")
        inside = f"{_folder(label)}/{place}{suffix_of(sample, *KINDS)}"
        yield File(f"{split}/{inside}", picture(sample, *KINDS))
        told = {"file_name": inside, "label": label, "index": sample.index, "objects": len(seen), **_told(o)}
        yield Piece(f"{split}/metadata.jsonl", json_bytes(told) + b"\n")
        yield Piece(CARD, b"", split)

    def layout(self, path: str, counts: Mapping[str, int]) -> Layout:
        """The card names the splits that have pictures, in the data set's order."""
        if path != CARD:
            return LINES
        order = {name: number for number, name in enumerate(self.dataset.splits)}
        splits = sorted(counts, key=lambda name: order.get(name, len(order)))
        files = [{"split": _split(name), "path": f"{name}/**"} for name in splits]
        head = yaml.safe_dump({"configs": [{"config_name": "default", "data_files": files}]}, sort_keys=False)
        return (f"---\n{head}---\n".encode(),)


def _folder(name: str) -> str:
    """The name of a class's folder, different for each class."""
    return UNFIT.sub(lambda match: f"%{ord(match[0]):02X}", name)


def _split(name: str) -> str:
    """A split's name as `datasets` allows it: letters, digits and underscores."""
    return re.sub(r"\W", "_", name)


def _told(o: ObjectAnnotation) -> dict[str, Any]:
    view = {
        "azimuth": o.view.azimuth_deg,
        "elevation": o.view.elevation_deg,
        "tilt": o.view.tilt_deg,
        "distance": o.view.distance,
        "visibility": o.visibility,
    }
    names = {"category": o.category, "pose_category": o.pose_category or None, "model": o.key or None}
    return names | {key: None if math.isnan(value) else value for key, value in view.items()} | {"box": o.box2d}


preparer, writer, verify = functions(ImageFolder)


FORMAT = FormatSpec(
    parallel_rays=True,
    rolling=True,
    about=__doc__,
    holds=("the class of a picture", "viewpoints"),
    read_by=("torchvision", "datasets"),
    options=_Options,
    channels=("rgb",),
    names_credits=False,
    refuses=_refuses,
    panoramas=True,
    writer=writer,
    preparer=preparer,
    verify=verify,
)
