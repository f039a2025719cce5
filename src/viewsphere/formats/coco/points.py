"""Named points as COCO has them: a list of names for each category, and of each object x, y, v for every name.

Whole numbers are pixels' centres, as COCO's annotators gave them, so half a pixel less than in boxes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import chain
from typing import TYPE_CHECKING, Any

import numpy as np

from viewsphere.formats.coco.said import imported_categories
from viewsphere.model.keypoints import Keypoints
from viewsphere.model.sample import ObjectAnnotation

if TYPE_CHECKING:
    from viewsphere.store import Category, Dataset

KEYPOINTS = "keypoints"
"""The label whose points are exported where a data set has it."""

VISIBLE, HIDDEN = 2, 1
FLAGS = {0: VISIBLE, 1: HIDDEN}
"""COCO's v of our states; points that are outside of the picture or behind the camera are not labelled."""

STATES = {flag: state for state, flag in FLAGS.items()}
NOT_LABELLED = 3

Names = Mapping[int, tuple[str, ...]]
"""Names of the points of each category, by the category's own id."""


def has_label(dataset: Dataset, name: str) -> bool:
    """Return whether some of a data set's pictures have a label that is given on request."""
    return any(name in part.recipe.get("annotations", ()) for part in dataset.plan.parts)


def point_names(dataset: Dataset) -> Names:
    """The points of each category, each once: those that it was imported with, then those of its models; of no category
    that was imported without where the label was not asked for.
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
    """A category's fields `keypoints` and `skeleton`, names, and lines between them, which count from 1; and all others that it
    was `imported` with.
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
    """Our label of an annotation's `keypoints`, of these names."""
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
