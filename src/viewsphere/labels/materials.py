"""materials: which material of its model is seen."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from viewsphere.labels.shared.drawing.colors import by_number
from viewsphere.labels.shared.ids import by_table
from viewsphere.labels.shared.spec import ChannelLabel, Drawing, Models, channel_of, mixed, rendered
from viewsphere.model.sample import Sample


def prove(sample: Sample, models: Models) -> Iterator[str]:
    """Objects have materials, which their models have, the background has none, and a triangle has one."""
    materials, instances = channel_of(sample, "materials"), channel_of(sample, "instances")
    if materials is None or instances is None:
        return
    wrong = (materials > 0) != (instances > 0)
    if wrong.any():
        yield f"expected a material where an object is seen, none elsewhere; found {wrong.sum()} others"
    triangles = channel_of(sample, "triangles")
    for o in rendered(sample):
        own, known = instances == o.id, models[o.key].materials if o.key in models else ()
        strange = (materials[own] > len(known)).sum() if known else 0
        if strange:
            yield f"object {o.id}: expected the materials 1 to {len(known)} of model {o.key}, found others at {strange} pixels"
        if triangles is not None and own.any() and (several := mixed(triangles[own], materials[own])):
            yield f"object {o.id}: expected one material in each triangle, found several in {several}"


LABEL = ChannelLabel(
    name="materials",
    meaning="material of the object's model, from 1, in the order of its file and of `ModelInfo.materials`; 0 is none",
    dtype=np.int32,
    unit="material id",
    encoding="png16",
    ids={"part": by_table},
    compute=lambda sight: sight.per_triangle(sight.geometry.triangle_material, 0),
    prove=prove,
    drawing=Drawing("materials", pixels=lambda picture, sample: by_number(picture, sample.channels["materials"])),
)
