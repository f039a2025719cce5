"""Ids of categories: from 1 without gaps, or COCO's own for its 80 names."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache
from itertools import chain
from typing import TYPE_CHECKING

from viewsphere.formats.coco.options import Options

if TYPE_CHECKING:
    from viewsphere.store import Category, Dataset

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
    """The exported id of each category of the data set, by its own."""
    if options.category_ids == "contiguous":
        return {category.id: number for number, category in enumerate(dataset.categories, 1)}
    if keeps_ids(dataset):
        return {category.id: category.id for category in dataset.categories}
    return official_ids(dataset.categories)


def keeps_ids(dataset: Dataset) -> bool:
    """Return whether any of it was imported, so that categories keep their ids."""
    return any(part.frames and not part.settings for part in dataset.plan.parts)


def official_ids(categories: tuple[Category, ...]) -> dict[int, int]:
    """COCO's id of each category, or a free one.

    Of two categories with one name of COCO's, the first has it. Free ids follow the recipe's order.
    """
    ids: dict[int, int] = {}
    for category in categories:
        own = _known().get(_plain(category.name))
        ids[category.id] = own if own and own not in ids.values() else _FIRST_FREE_ID - 1 + category.id
    return ids


def notes(categories: Sequence[Category], options: Options) -> Iterator[str]:
    """Yield notes on unexpected ids: categories that COCO does not have, or has once."""
    if options.category_ids == "contiguous":
        return
    for category, number in zip(categories, official_ids(tuple(categories)).values(), strict=True):
        if number >= _FIRST_FREE_ID:
            why = "COCO does not have" if _plain(category.name) not in _known() else "COCO has once, for another category here"
            yield f"coco.category_ids: {category.name!r}, which {why}, gets id {number}"


def _plain(name: str) -> str:
    return "".join(c for c in name.lower() if c.isalnum())


@cache
def _known() -> dict[str, int]:
    """COCO's id of each spelling, plain."""
    ids = {_plain(name): number for name, number in CATEGORY_IDS.items()}
    return ids | {other: CATEGORY_IDS[name] for other, name in _OTHER_SPELLINGS.items()}
