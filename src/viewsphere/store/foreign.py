"""Data sets from other tools, during their import into a store."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from viewsphere.errors import StoreError
from viewsphere.geometry.mask import rle_area, rle_box, rle_of_runs
from viewsphere.model.sample import Box, ObjectAnnotation, ObjectView, Rle, Sample
from viewsphere.store.shots.records import Category, ModelInfo

MOST_SHOWN = 10
"""Number of problems that an error names."""


@dataclass(frozen=True)
class Loaded:
    """The bytes of a file, and the ending of its name, with its dot."""

    suffix: str
    data: bytes


@dataclass(frozen=True)
class ForeignFrame:
    """A frame whose channels are files of another data set, or the bytes of such files."""

    sample: Sample
    files: Mapping[str, Path | Loaded]


@dataclass(frozen=True)
class ForeignModel:
    """A model whose OBJ and GLB have the names in `info`. Its files come from another data set, or `write` puts them into a
    folder.
    """

    info: ModelInfo
    files: Sequence[Path]
    write: Callable[[Path], None] | None = None


@dataclass(frozen=True)
class ForeignDataset:
    """The result of a format's `read`: facts about the whole data set, and its frames one by one, in order.

    Frames are numbered from 0, and `frames` can be called again. `left_out` names the broken entries that were left out.
    `said`: the data set's own metadata, as in COCO: `info` of each split, `licenses`, and the other keys of categories, such as
    `keypoints`, by the categories' names. It is JSON that the plan stores.
    """

    name: str
    digest: str  # SHA-256 of the annotations
    categories: tuple[Category, ...]
    splits: tuple[str, ...]
    channels: tuple[str, ...]
    count: int
    poses: int  # indices of poses are below this number
    max_objects: int
    frames: Callable[[], Iterator[ForeignFrame]]
    models: tuple[ForeignModel, ...] = ()
    left_out: tuple[str, ...] = ()
    said: Mapping[str, Any] = field(default_factory=dict[str, Any])


def refuse_broken(problems: Sequence[str]) -> None:
    """Raise StoreError with the first of the problems, if there are any."""
    if problems:
        more = [f"and {len(problems) - MOST_SHOWN} more"] if len(problems) > MOST_SHOWN else []
        raise StoreError("\n".join([*problems[:MOST_SHOWN], *more, "mend them, or leave them out with --keep-going"]))


def foreign_object(
    number: int,
    category: Category,
    size: tuple[int, int],
    source: Mapping[str, Any],
    counts: str | None,
    box: Box | None,
    /,
    **known: Any,
) -> ObjectAnnotation:
    """An object with only a mask (the run-length code `counts`) or only a `box`, and the fields in `known`; all other fields
    are NaN.

    `size` is the image's (width, height), `source` the annotation in the other data set.
    """
    width, height = size
    tight = counts and rle_box(height, width, counts)
    area = rle_area(height, width, counts) if counts else round(float(source.get("area") or 0))
    values: dict[str, Any] = {
        "key": "",
        "model": "",
        "box2d": tuple(map(float, tight)) if tight else box,
        "box2d_projected": None,
        "box2d_unclipped": None,
        "box3d_object": np.full((8, 3), np.nan),
        "box3d": np.full((8, 3), np.nan),
        "box3d_camera": np.full((8, 3), np.nan),
        "box3d_pixels": np.full((8, 2), np.nan),
        "box3d_in_front": np.zeros(8, np.bool_),
        "world_from_object": np.full((4, 4), np.nan),
        "camera_from_object": np.full((4, 4), np.nan),
        "quaternion": (math.nan,) * 4,
        "view": ObjectView(math.nan, math.nan, math.nan, math.nan),
        "pose_category": "",
        "size": (math.nan,) * 3,
        "real_size": None,
        "visibility": math.nan,
        "truncation": math.nan,
    }
    return ObjectAnnotation(
        id=number,
        category=category.name,
        supercategory=category.supercategory,
        category_id=category.id,
        rle=Rle(height, width, counts or _nothing(height, width)),
        area=area,
        source=dict(source),
        **{**values, **known},
    )


@cache
def _nothing(height: int, width: int) -> str:
    """The run-length code of a mask without pixels."""
    return rle_of_runs(height, width, np.array([height * width]))
