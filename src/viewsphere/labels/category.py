"""category: the kind of an object."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from viewsphere.labels.shared.drawing.lines import notes
from viewsphere.labels.shared.ids import by_number
from viewsphere.labels.shared.placement import Placement
from viewsphere.labels.shared.spec import Drawing, Field, Models, ObjectLabel, rendered
from viewsphere.model.sample import Sample


def _fields(placement: Placement) -> Mapping[str, Any]:
    """The category from the model's entry in the recipe."""
    spec = placement.spec
    return {"category": spec.category, "supercategory": spec.supercategory, "category_id": spec.category_id}


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """Objects have the categories of their models."""
    for o in rendered(sample):
        facts = models.get(o.key)
        if facts is not None and (facts.category, facts.category_id) != (o.category, o.category_id):
            yield (
                f"object {o.id}: expected {facts.category!r} ({facts.category_id}), as its model {o.key} is; "
                f"found {o.category!r} ({o.category_id})"
            )


LABEL = ObjectLabel.from_placement(
    _fields,
    name="category",
    meaning="what kind of thing it is",
    fields=(
        Field("category", "name of the category", str),
        Field("supercategory", "name of what the category belongs to; may be empty", str),
        Field("category_id", "number of the category, from 1", int, ids={"category": by_number}),
    ),
    prove=_prove,
    drawing=Drawing("category", lines=notes(lambda o: o.category)),
)
