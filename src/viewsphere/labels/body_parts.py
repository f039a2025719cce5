"""body_parts: which part of a body is seen, by the bones of its model's skin."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from viewsphere.labels.shared.drawing.colors import by_number
from viewsphere.labels.shared.ids import by_table
from viewsphere.labels.shared.spec import ChannelLabel, Drawing, Models, channel_of, mixed, rendered
from viewsphere.model.sample import Sample


def prove(sample: Sample, models: Models) -> Iterator[str]:
    """Parts are seen on objects alone, and are those that the object's model has; a triangle has one."""
    found, instances = channel_of(sample, "body_parts"), channel_of(sample, "instances")
    if found is None or instances is None:
        return
    wrong = ((found > 0) & (instances == 0)) | (found < 0)
    if wrong.any():
        yield f"expected parts of bodies where an object is seen; found others at {wrong.sum()} pixels"
    triangles = channel_of(sample, "triangles")
    for o in rendered(sample):
        own = instances == o.id
        known = len(models[o.key].body_parts) if o.key in models else None
        strange = 0 if known is None else int((found[own] > known).sum())
        if strange:
            yield f"object {o.id}: expected the body parts 0 to {known} of model {o.key}, found others at {strange} pixels"
        if triangles is not None and own.any() and (several := mixed(triangles[own], found[own])):
            yield f"object {o.id}: expected one body part in each triangle, found several in {several}"


LABEL = ChannelLabel(
    name="body_parts",
    meaning="part of a body, from 1, as `ModelInfo.body_parts` names them: the bone whose skin weights, summed over the "
    "triangle's corners, are largest; 0 is none",
    dtype=np.int32,
    unit="part id",
    encoding="png16",
    ids={"part": by_table},
    compute=lambda sight: sight.per_triangle(sight.geometry.triangle_body_part, 0),
    prove=prove,
    drawing=Drawing("body_parts", pixels=lambda picture, sample: by_number(picture, sample.channels["body_parts"])),
)
