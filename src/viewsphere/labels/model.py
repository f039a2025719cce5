"""model: the model of an object."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from viewsphere.labels.shared.drawing.lines import notes
from viewsphere.labels.shared.placement import Placement
from viewsphere.labels.shared.spec import Drawing, Field, Models, ObjectLabel, rendered
from viewsphere.model.sample import Sample


def _fields(placement: Placement) -> Mapping[str, Any]:
    """The model's names."""
    spec, step = placement.spec, placement.step
    if step is None:
        return {"key": spec.key, "model": placement.facts.obj, "track": ""}
    return {"key": spec.key_at(step.frame), "model": placement.facts.obj, "track": spec.key}


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """The object's model is in the data set."""
    for o in rendered(sample):
        facts = models.get(o.key)
        if facts is None:
            yield f"object {o.id}: expected a model of the data set, found {o.key!r}"
        elif facts.obj != o.model:
            yield f"object {o.id}: expected the file {facts.obj} of model {o.key}, found {o.model}"
        elif facts.track != o.track:
            yield f"object {o.id}: expected track {facts.track!r} of model {o.key}, found {o.track!r}"


LABEL = ObjectLabel.from_placement(
    _fields,
    name="model",
    meaning="which model it is",
    fields=(
        Field("key", "the model's key in the data set", str),
        Field("model", "path of the normalised model, relative to the data set's root", str),
        Field("track", "key of the animated model that stays itself over time, else empty", str),
    ),
    prove=_prove,
    drawing=Drawing("model", lines=notes(lambda o: o.key)),
)
