"""The code that maps of classes share: colours, renumbering and proofs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from viewsphere.labels.shared.ids import by_table
from viewsphere.labels.shared.point_checks import exact_depth
from viewsphere.labels.shared.spec import Array, Picture
from viewsphere.model.annotations.classes import FIRST_THING, SKY, STUFF, class_colors, thing_class
from viewsphere.model.sample import Sample

KEY = tuple(STUFF.items())
"""The meaning of each colour of stuff."""


def with_classes(classes: Array, ids: Mapping[int, int]) -> Array:
    """Classes with new ids for categories."""
    return by_table(classes, {thing_class(old): thing_class(new) for old, new in ids.items()})


def wrong_classes(sample: Sample, classes: Array, instances: Array) -> Iterator[str]:
    """Yield the errors in a sample's map of classes, given the map of instances that places its visible objects."""
    by_id = np.zeros(max([0, *(o.id for o in sample.objects), int(instances.max(initial=0))]) + 1, np.int64)
    for o in sample.objects:
        by_id[o.id] = thing_class(o.category_id)
    things = instances > 0
    wrong = things & (classes != by_id[instances])
    if wrong.any():
        yield f"expected the classes of the objects seen; found others at {wrong.sum()} pixels"
    wrong = ~things & ((classes < 1) | (classes > len(STUFF)) | (classes >= FIRST_THING))
    if wrong.any():
        yield f"expected stuff where no object is seen; found other classes at {wrong.sum()} pixels"
    depth = exact_depth(sample)
    if depth is not None:
        wrong = np.isinf(depth) != (classes == SKY)
        if wrong.any():
            yield f"expected sky where depth is infinite, and nowhere else; found otherwise at {wrong.sum()} pixels"


def colored(classes: Array) -> Picture:
    """A map of classes as a picture (H, W, 3) uint8."""
    return class_colors(int(classes.max(initial=0)) + 1)[classes]
