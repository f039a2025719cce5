"""Named points as COCO has them: a list of names for each category, and of each object x, y, v for every name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain
from typing import Any

from viewsphere.model.keypoints import Keypoints
from viewsphere.model.sample import ObjectAnnotation
from viewsphere.store import Dataset

KEYPOINTS = "keypoints"
"""The label whose points are exported where a data set has it."""

VISIBLE, HIDDEN = 2, 1
FLAGS = {0: VISIBLE, 1: HIDDEN}
"""COCO's v of our states; points that are outside of the picture or behind the camera are not labelled."""

Names = Mapping[int, tuple[str, ...]]
"""Names of the points of each category, by the category's own id."""


def has_label(dataset: Dataset, name: str) -> bool:
    """Whether some of a data set's pictures have a label that is given on request."""
    return any(name in part.recipe.get("annotations", ()) for part in dataset.plan.parts)


def point_names(dataset: Dataset) -> Names:
    """The points of all models of each category, each once; of no category where the label was not asked for."""
    if not has_label(dataset, KEYPOINTS):
        return {}
    return {
        category.id: tuple(dict.fromkeys(chain.from_iterable(known.points for known in _known(dataset, category.id))))
        for category in dataset.categories
    }


def category_points(dataset: Dataset, category_id: int, names: Names) -> dict[str, Any]:
    """The fields `keypoints` and `skeleton` of a category: names, and lines between them, which count from 1."""
    if category_id not in names:
        return {}
    own = {name: number for number, name in enumerate(names[category_id], 1)}
    pairs = chain.from_iterable(known.skeleton for known in _known(dataset, category_id))
    lines = dict.fromkeys(tuple(sorted((own[one], own[other]))) for one, other in pairs)
    return {"keypoints": list(own), "skeleton": [list(line) for line in lines]}


def object_points(o: ObjectAnnotation, names: Names) -> dict[str, Any]:
    """The fields `keypoints` and `num_keypoints` of an object; whole numbers are pixels' centres, as COCO's annotators gave
    them, so half a pixel less than in boxes.
    """
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
