"""pose_category: the side of an object that is seen."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from viewsphere.geometry.pose_category import pose_category
from viewsphere.labels.shared.drawing.lines import notes
from viewsphere.labels.shared.placement import Placement
from viewsphere.labels.shared.spec import Drawing, Field, Models, ObjectLabel, rendered
from viewsphere.model.sample import Sample


def _fields(placement: Placement) -> Mapping[str, Any]:
    """The named bin of the object's view."""
    view = placement.view
    return {"pose_category": pose_category(view.azimuth_deg, view.elevation_deg, placement.category_deg)}


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """The category is top or bottom from 60 degrees up or down; otherwise its above or below matches the elevation."""
    for o in rendered(sample):
        elevation, name = round(o.view.elevation_deg, 6), o.pose_category
        ends = {"top": elevation >= 60, "bottom": elevation <= -60}
        tails = {"-above": 30 <= elevation < 60, "-below": -60 < elevation < -30}
        if any((name == end) != is_so for end, is_so in ends.items()) or any(
            name.endswith(tail) != is_so for tail, is_so in tails.items()
        ):
            yield f"object {o.id}: expected a pose category for an elevation of {elevation}, found {name!r}"


LABEL = ObjectLabel.from_placement(
    _fields,
    name="pose_category",
    meaning="which side of it is seen",
    axes="object",
    fields=(Field("pose_category", "named bin: front, front-left, ..., top", str),),
    prove=_prove,
    drawing=Drawing("pose_category", lines=notes(lambda o: o.pose_category)),
)
