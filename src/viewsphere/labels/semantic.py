"""semantic: the class at each pixel, for things and stuff."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from viewsphere.labels.shared.class_maps import KEY, colored, with_classes, wrong_classes
from viewsphere.labels.shared.spec import ChannelLabel, Drawing, Models, channel_of
from viewsphere.model.annotations.classes import SKY, STUFF_IDS, class_colors
from viewsphere.model.sample import Sample


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """Objects have their categories' classes, everything else is stuff, and empty pixels are sky."""
    classes, instances = channel_of(sample, "semantic"), channel_of(sample, "instances")
    if classes is not None and instances is not None:
        yield from wrong_classes(sample, classes, instances)


def _class_names() -> str:
    """The names of stuff with their ids, in words."""
    return ", ".join(f"{i} {name}" for name, i in STUFF_IDS.items())


LABEL = ChannelLabel(
    name="semantic",
    meaning=f"class of what is seen: stuff below 32 ({_class_names()}), things 31 + their category's id",
    dtype=np.int32,
    holds_classes=True,
    unit="class id",
    empty=SKY,
    encoding="png16",
    colors=tuple(map(tuple, class_colors().tolist())),
    compute=lambda context: context.per_triangle(context.geometry.triangle_class, SKY),
    prove=_prove,
    ids={"category": with_classes},
    drawing=Drawing("semantic", beside=lambda sample: colored(sample.channels["semantic"]), key=KEY),
)
