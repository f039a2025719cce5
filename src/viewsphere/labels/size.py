"""size: the extents of an object's box, and its true size."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from viewsphere.geometry.box3d import Box3d
from viewsphere.labels.shared.drawing.lines import notes
from viewsphere.labels.shared.placement import Placement
from viewsphere.labels.shared.spec import Drawing, Field, Models, ObjectLabel, rendered
from viewsphere.model.sample import Sample

TOLERANCE = 1e-9
"""Tolerance of the proof as a share of the size."""


def _fields(placement: Placement) -> Mapping[str, Any]:
    """The 3D box's extents, and the model's true size."""
    return {"size": Box3d(placement.box).size, "real_size": placement.facts.real_size}


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """Sizes match the box and the model."""
    for o in rendered(sample):
        low, high = o.box3d_object.min(axis=0), o.box3d_object.max(axis=0)
        x, y, z = (high - low).tolist()
        if max(abs(a - b) for a, b in zip((x, z, y), o.size, strict=True)) > TOLERANCE * max(x, y, z):
            yield f"object {o.id}: expected size {(x, z, y)}, found {o.size}"
        if o.key in models and models[o.key].real_size != o.real_size:
            yield f"object {o.id}: expected real_size {models[o.key].real_size} of model {o.key}, found {o.real_size}"


LABEL = ObjectLabel.from_placement(
    _fields,
    name="size",
    meaning="how large it is: width along X, height along Z, length along Y of its own axes",
    axes="object",
    fields=(
        Field("size", "width, height and length of its 3D box", float, (3,), "m"),
        Field("real_size", "the true ones, None where nobody said", float, (3,), "m", optional=True),
    ),
    prove=_prove,
    drawing=Drawing(
        "size",
        lines=notes(lambda o: " x ".join(f"{side:.2f}" for side in o.size)),
        key=(("size: width x height x length in metres", None),),
    ),
)
