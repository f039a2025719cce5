"""parts, body_parts and materials: the part, the body part and the material of the model at the seen point."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from viewsphere.labels.shared.drawing.colors import by_number
from viewsphere.labels.shared.ids import by_table
from viewsphere.labels.shared.spec import ChannelLabel, Drawing, Models, Proof, channel_of, mixed, rendered
from viewsphere.model.sample import Sample


def _prove_parts(sample: Sample, models: Models) -> Iterator[str]:
    """Objects have parts; the background has none."""
    parts, instances = channel_of(sample, "parts"), channel_of(sample, "instances")
    if parts is not None and instances is not None and ((parts > 0) != (instances > 0)).any():
        yield f"expected a part where an object is seen, none elsewhere; found {((parts > 0) != (instances > 0)).sum()} others"


def _prove_body_parts(sample: Sample, models: Models) -> Iterator[str]:
    """Only objects have parts, these exist in their models, and a triangle has one part."""
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


def _prove_materials(sample: Sample, models: Models) -> Iterator[str]:
    """Objects have materials of their models, the background has none, and a triangle has one material."""
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


def _label(name: str, meaning: str, unit: str, table: str, prove: Proof) -> ChannelLabel:
    """A channel of the triangles' numbers in a table of the geometry."""
    return ChannelLabel(
        name=name,
        meaning=meaning,
        dtype=np.int32,
        unit=unit,
        encoding="png16",
        ids={"part": by_table},
        compute=lambda context: context.per_triangle(getattr(context.geometry, table), 0),
        prove=prove,
        drawing=Drawing(name, pixels=lambda picture, sample: by_number(picture, sample.channels[name])),
    )


LABELS = (
    _label("parts", "named part of the object's model, from 1; 0 is none", "part id", "triangle_part", _prove_parts),
    _label(
        "body_parts",
        "part of a body, from 1, as `ModelInfo.body_parts` names them: the bone whose skin weights, summed over the "
        "triangle's corners, are largest; 0 is none",
        "part id",
        "triangle_body_part",
        _prove_body_parts,
    ),
    _label(
        "materials",
        "material of the object's model, from 1, in the order of its file and of `ModelInfo.materials`; 0 is none",
        "material id",
        "triangle_material",
        _prove_materials,
    ),
)
