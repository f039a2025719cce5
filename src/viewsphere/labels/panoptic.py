"""panoptic: class and object id in one number, for things and stuff."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import StoreError
from viewsphere.labels.shared.class_maps import KEY, colored, with_classes, wrong_classes
from viewsphere.labels.shared.drawing.colors import color_of
from viewsphere.labels.shared.ids import by_table
from viewsphere.labels.shared.spec import Array, ChannelLabel, Drawing, Models, Picture, channel_of
from viewsphere.model.annotations.classes import SKY
from viewsphere.model.sample import Sample

if TYPE_CHECKING:
    from viewsphere.labels.shared.context import LabelContext

BITS = 16
"""Number of bits for an object's id; the class is in the bits above them."""

MOST = (1 << BITS) - 1, (1 << (31 - BITS)) - 1
"""The greatest id of an object, and of a class."""


def compute(context: LabelContext) -> NDArray[np.int32]:
    """class * 65536 + object id, (H, W): the class is from `semantic`, the id from `instances` (0 for stuff).

    So it has the segments of Kirillov et al. 2019, "Panoptic Segmentation". Raises StoreError for more than 65535 objects or
    classes above 32767, which do not fit into the number.
    """
    classes = context.geometry.triangle_class
    found = context.geometry.object_count, int(classes.max(initial=0))
    if found[0] > MOST[0] or found[1] > MOST[1]:
        raise StoreError(f"channel panoptic: expected objects of 0..{MOST[0]}, classes of 0..{MOST[1]}; found {found}")
    out = context.per_triangle(classes, SKY)
    out <<= BITS
    out |= context.instances.ids
    return out


def class_of(codes: Array) -> Array:
    """The classes in a map."""
    return codes >> BITS


def object_of(codes: Array) -> Array:
    """The objects' ids in a map, 0 for stuff."""
    return codes & MOST[0]


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """Objects match `instances`, and classes match the objects' categories."""
    codes, instances = channel_of(sample, "panoptic"), channel_of(sample, "instances")
    if codes is None or instances is None:
        return
    wrong = object_of(codes) != instances
    if wrong.any():
        yield f"expected the objects seen; found others at {wrong.sum()} pixels"
    yield from wrong_classes(sample, class_of(codes), instances)


def renumbered(codes: Array, ids: Mapping[int, int]) -> Array:
    """The map with new ids for categories."""
    return with_classes(class_of(codes), ids) << BITS | object_of(codes)


def _with_objects(codes: Array, ids: Mapping[int, int]) -> Array:
    """The map with new ids for objects."""
    return class_of(codes) << BITS | by_table(object_of(codes), ids)


def picture(codes: NDArray[np.int32]) -> Picture:
    """A map as a picture (H, W, 3) uint8: stuff in the colour of its class, each thing in its own."""
    colors, objects = colored(class_of(codes)), object_of(codes)
    for i in np.unique(objects[objects > 0]).tolist():
        colors[objects == i] = color_of(i)
    return colors


LABEL = ChannelLabel(
    name="panoptic",
    meaning="class * 65536 + object id: the class as in `semantic`, the id 0 of stuff",
    dtype=np.int32,
    holds_classes=True,
    unit="class and object id",
    empty=SKY << BITS,
    compute=compute,
    prove=_prove,
    ids={"category": renumbered, "object": _with_objects},
    drawing=Drawing("panoptic", beside=lambda sample: picture(sample.channels["panoptic"]), key=KEY),
)
