"""Ids of categories: from 1 without gaps, or COCO's own for its 80 names."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from itertools import chain
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from pydantic import Field

from viewsphere.formats.coco.source_metadata import imported_categories
from viewsphere.model.annotations.keypoints import Keypoints
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.sample import ObjectAnnotation

if TYPE_CHECKING:
    from viewsphere.store import Category, Dataset

CHANNELS = ("rgb",)
"""The channels that the format requires."""

KEYPOINTS = "keypoints"
"""The label whose points are exported if a data set has it."""

VISIBLE, HIDDEN = 2, 1
FLAGS = {0: VISIBLE, 1: HIDDEN}
"""COCO's v for viewsphere's states; points outside the picture or behind the camera are not labelled."""

STATES = {flag: state for state, flag in FLAGS.items()}
NOT_LABELLED = 3
Names = Mapping[int, tuple[str, ...]]
"""Names of the points of each category, by the category's id."""


_NAMES = {
    1: "person bicycle car motorcycle airplane bus train truck boat",
    10: "traffic_light fire_hydrant",
    13: "stop_sign parking_meter bench bird cat dog horse sheep cow elephant bear zebra giraffe",
    27: "backpack umbrella",
    31: "handbag tie suitcase frisbee skis snowboard sports_ball kite baseball_bat baseball_glove skateboard surfboard "
    "tennis_racket bottle",
    46: "wine_glass cup fork knife spoon bowl banana apple sandwich orange broccoli carrot hot_dog pizza donut cake chair "
    "couch potted_plant bed",
    67: "dining_table",
    70: "toilet",
    72: "tv laptop mouse remote keyboard cell_phone microwave oven toaster sink refrigerator",
    84: "book clock vase scissors teddy_bear hair_drier toothbrush",
}
CATEGORY_IDS: dict[str, int] = dict(
    chain.from_iterable(
        ((name.replace("_", " "), first + i) for i, name in enumerate(names.split())) for first, names in _NAMES.items()
    )
)
"""COCO's 80 categories and their ids, which have gaps (https://github.com/cocodataset/cocoapi)."""

_OTHER_SPELLINGS = {
    **{"hairdryer": "hair drier", "bike": "bicycle", "motorbike": "motorcycle", "aeroplane": "airplane"},
    **{"sofa": "couch", "tvmonitor": "tv", "television": "tv", "monitor": "tv"},
    **{"mug": "cup", "plant": "potted plant", "table": "dining table"},
}
_FIRST_FREE_ID = 91


def category_ids(dataset: Dataset, options: Options) -> dict[int, int]:
    """The exported id of each category, by its id in the data set."""
    if options.category_ids == "contiguous":
        return {category.id: number for number, category in enumerate(dataset.categories, 1)}
    if keeps_ids(dataset):
        return {category.id: category.id for category in dataset.categories}
    return _official_ids(dataset.categories)


def keeps_ids(dataset: Dataset) -> bool:
    """Return whether any part of the data set was imported, so that categories keep their ids."""
    return any(part.frames and not part.settings for part in dataset.plan.parts)


def _official_ids(categories: tuple[Category, ...]) -> dict[int, int]:
    """COCO's id of each category, or a free one.

    If two categories have the same COCO name, the first gets COCO's id. Free ids follow the recipe's order.
    """
    ids: dict[int, int] = {}
    for category in categories:
        own = _official().get(_plain(category.name))
        ids[category.id] = own if own and own not in ids.values() else _FIRST_FREE_ID - 1 + category.id
    return ids


def notes(categories: Sequence[Category], options: Options) -> Iterator[str]:
    """Yield notes on unexpected ids: categories that COCO lacks, or that share a single COCO category."""
    if options.category_ids == "contiguous":
        return
    for category, number in zip(categories, _official_ids(tuple(categories)).values(), strict=True):
        if number >= _FIRST_FREE_ID:
            why = (
                "COCO does not have" if _plain(category.name) not in _official() else "COCO has once, for another category here"
            )
            yield f"coco.category_ids: {category.name!r}, which {why}, gets id {number}"


def _plain(name: str) -> str:
    return "".join(c for c in name.lower() if c.isalnum())


@cache
def _official() -> dict[str, int]:
    """COCO's id for each normalised spelling."""
    ids = {_plain(name): number for name, number in CATEGORY_IDS.items()}
    return ids | {other: CATEGORY_IDS[name] for other, name in _OTHER_SPELLINGS.items()}


class Options(Frozen):
    """The numbers of categories, the folders of pictures, and the encoding of masks."""

    category_ids: Literal["contiguous", "coco"] = Field(
        default="contiguous",
        description="`contiguous`: 1, 2, 3, ... in the data set's order of categories, as trainers expect; `coco`: COCO's own "
        "ids of its 80 names, however spelled (`hair_drier`, `hairdryer`), from 91 on for others; imported ones keep theirs",
    )
    pictures: Literal["images", "splits"] = Field(
        default="images",
        description="`images`: in `images/<split>/`, where datumaro looks; `splits`: in `<split>/`, as the paper's tool does",
    )

    segmentation: Literal["polygons", "rle"] = Field(
        default="polygons",
        description="of masks, both exact. `polygons`: rings along pixels' edges; `rle`: pycocotools' compressed run lengths",
    )

    def folder(self, split: str) -> str:
        """Return the folder of a split's pictures, relative to the export's folder."""
        return f"images/{split}" if self.pictures == "images" else split


def has_label(dataset: Dataset, name: str) -> bool:
    """Return whether some of a data set's pictures have a label that is computed on request."""
    return any(name in part.recipe.get("annotations", ()) for part in dataset.plan.parts)


def point_names(dataset: Dataset) -> Names:
    """The points of each category without duplicates: imported points first, then its models' points. A category imported
    without points has none unless the label was requested.
    """
    imported, is_asked = imported_categories(dataset), has_label(dataset, KEYPOINTS)
    names: dict[int, tuple[str, ...]] = {}
    for category in dataset.categories:
        first = imported.get(category.name.casefold(), {})
        if is_asked or KEYPOINTS in first:
            models = chain.from_iterable(known.points for known in _known(dataset, category.id)) if is_asked else ()
            names[category.id] = tuple(dict.fromkeys((*first.get(KEYPOINTS, ()), *models)))
    return names


def category_points(dataset: Dataset, category: Category, names: Names, imported: Mapping[str, Any]) -> dict[str, Any]:
    """A category's fields `keypoints` (names) and `skeleton` (lines between points, counted from 1), and all other fields from
    `imported`.
    """
    if category.id not in names:
        return dict(imported)
    own = {name: number for number, name in enumerate(names[category.id], 1)}
    lines = [list(line) for line in imported.get("skeleton", ())]
    for known in _known(dataset, category.id) if has_label(dataset, KEYPOINTS) else ():
        for line in (sorted((own[one], own[other])) for one, other in known.skeleton):
            if line not in lines and line[::-1] not in lines:
                lines.append(line)
    return {**imported, KEYPOINTS: list(own), "skeleton": lines}


def named_points(names: Sequence[str], flat: Sequence[float]) -> dict[str, Any]:
    """viewsphere's label for an annotation's `keypoints` with these names."""
    rows = np.array(flat, float).reshape(-1, 3)
    places = np.where(rows[:, 2:] > 0, rows[:, :2] + 0.5, math.nan)
    states = np.array([STATES.get(int(flag), NOT_LABELLED) for flag in rows[:, 2]], np.int64)
    return {"keypoint_names": tuple(names), "keypoints": places, "keypoint_states": states}


def object_points(o: ObjectAnnotation, names: Names) -> dict[str, Any]:
    """The fields `keypoints` and `num_keypoints` of an object."""
    if o.category_id not in names:
        return {}
    flat: list[float] = [0] * (3 * len(names[o.category_id]))
    places = {name: 3 * number for number, name in enumerate(names[o.category_id])}
    found: Sequence[str] = getattr(o, "keypoint_names", ())
    for i, name in enumerate(found):
        flag = FLAGS.get(int(o.keypoint_states[i]))
        if flag is not None:
            x, y = o.keypoints[i].tolist()
            flat[places[name] : places[name] + 3] = (x - 0.5, y - 0.5, flag)
    return {"keypoints": flat, "num_keypoints": sum(flag > 0 for flag in flat[2::3])}


def _known(dataset: Dataset, category_id: int) -> list[Keypoints]:
    return [model.keypoints for model in dataset.models if model.category_id == category_id and model.keypoints]
