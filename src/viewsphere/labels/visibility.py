"""visibility: the visible share of an object, and its share outside the image."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from viewsphere.geometry.box import overlap
from viewsphere.labels.shared.context import EVERYWHERE
from viewsphere.labels.shared.drawing.lines import notes
from viewsphere.labels.shared.spec import Drawing, Field, Models, ObjectLabel, rendered
from viewsphere.model.sample import Sample

if TYPE_CHECKING:
    from viewsphere.labels.shared.context import LabelContext


def _compute(context: LabelContext, i: int) -> Mapping[str, Any]:
    """Both shares of one object.

    Visibility is the object's visible pixels over all pixels that it would cover if it were alone, on a canvas of three times
    the image's width and height (BOP's visib_fract,
    https://github.com/thodan/bop_toolkit/blob/master/docs/bop_datasets_format.md); truncation is the share of the latter
    outside the image. An object that covers no pixel has visibility 0.
    """
    visible, truncated = _shares(context, i, int(context.instances.area[i + 1]))
    return {"visibility": visible, "truncation": truncated}


def _shares(context: LabelContext, i: int, area: int) -> tuple[float, float]:
    own, whole = context.reached[i]
    if own is None:
        if not area:
            return 0.0, 1.0
        own = EVERYWHERE  # the object is visible, but nearer than the near limit of projected boxes
    width, height = context.camera.width, context.camera.height
    image = (0.0, 0.0, float(width), float(height))
    if whole and not overlap(own, image):
        return 0.0, 1.0
    inside = whole and own[1] >= 0 and own[3] <= height
    inside = inside and (context.camera.lens.period is not None or (own[0] >= 0 and own[2] <= width))
    if inside and not area:
        return 0.0, 0.0
    if inside and context.is_unobstructed(i):
        return 1.0, 0.0
    total, kept = _pixels_alone(context, i)
    if total == 0:
        return 0.0, 0.0 if overlap(own, image) else 1.0
    return area / total, (total - kept) / total


def _pixels_alone(context: LabelContext, i: int) -> tuple[int, int]:
    """Number of pixels that the object alone would cover on the large canvas, and the number of these inside the image."""
    alone = context.isolated(i)
    inside = alone.in_image(context.camera.width, context.camera.height)
    return int(np.count_nonzero(alone.inverse_depth)), int(np.count_nonzero(inside.inverse_depth))


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """Both shares are in [0, 1], and visibility is above 0 exactly for objects with visible pixels."""
    for o in rendered(sample):
        shares, seen = (o.visibility, o.truncation), int(o.mask.sum())
        if not all(0 <= share <= 1 for share in shares) or (o.visibility > 0) != (seen > 0):
            yield f"object {o.id}: visibility {o.visibility}, truncation {o.truncation} and {seen} visible pixels"


LABEL = ObjectLabel(
    name="visibility",
    meaning="how much of it is seen, and how much lies outside of the image",
    fields=(
        Field("visibility", "visible pixels over all that it alone would cover, those outside included", float),
        Field("truncation", "share of the latter outside of the image", float),
    ),
    compute=_compute,
    keep=lambda o: [o.visibility, o.truncation],
    restore=lambda kept, placement, o: {"visibility": kept[0], "truncation": kept[1]},
    prove=_prove,
    drawing=Drawing("visibility", lines=notes(lambda o: f"{o.visibility:.0%}"), key=(("visibility: how much is seen", None),)),
)
