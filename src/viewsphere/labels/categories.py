"""categories: the category of the seen object."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from viewsphere.labels.shared.drawing.colors import by_number
from viewsphere.labels.shared.ids import by_table
from viewsphere.labels.shared.spec import ChannelLabel, Drawing, Models, channel_of
from viewsphere.model.sample import Sample


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """The map contains the categories of the objects in the instance map."""
    instances, categories = channel_of(sample, "instances"), channel_of(sample, "categories")
    if instances is None or categories is None:
        return
    by_id = np.zeros(max([0, *(o.id for o in sample.objects), int(instances.max(initial=0))]) + 1, np.int64)
    for o in sample.objects:
        by_id[o.id] = o.category_id
    wrong = categories != by_id[instances]
    if wrong.any():
        yield f"expected those of the objects seen, found others at {wrong.sum()} pixels"


LABEL = ChannelLabel(
    name="categories",
    meaning="category of the object seen; 0 is background",
    dtype=np.int32,
    unit="category id",
    encoding="png16",
    compute=lambda context: context.per_triangle(context.geometry.triangle_category, 0),
    prove=_prove,
    ids={"category": by_table},
    drawing=Drawing("categories", pixels=lambda picture, sample: by_number(picture, sample.channels["categories"])),
)
