"""occluders: the things that hide an object, and the share of it that each hides."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from viewsphere.labels.shared.drawing.colors import color_of
from viewsphere.labels.shared.drawing.lines import arrow, middle, note
from viewsphere.labels.shared.field import Field
from viewsphere.labels.shared.ids import in_attributes
from viewsphere.labels.shared.placement import Placement
from viewsphere.labels.shared.spec import Drawing, Models, ObjectLabel, rendered
from viewsphere.model.sample import ObjectAnnotation, Sample

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

    from viewsphere.labels.shared.context import LabelContext


@dataclass(frozen=True)
class Occluder:
    """A thing that hides an object: `id` of another object, or 0 for scenery and ground. `share` is the share of the object's
    pixels in the image that it hides.
    """

    id: int
    share: float


def _compute(context: LabelContext, i: int) -> Mapping[str, Any]:
    """Return the things that are seen at the object's hidden pixels; of several things in front of it, the nearest counts."""
    if context.is_unobstructed(i):
        return {"occluders": ()}
    alone = context.isolated(i).in_image(context.camera.width, context.camera.height)
    x0, y0, x1, y1 = alone.box
    own = alone.inverse_depth > 0
    shown = np.bincount(context.instances.ids[y0:y1, x0:x1][own], minlength=i + 2).tolist()
    total = sum(shown)
    found = [Occluder(id, pixels / total) for id, pixels in enumerate(shown) if pixels and id != i + 1]
    return {"occluders": tuple(sorted(found, key=lambda one: (-one.share, one.id)))}


def _restore(kept: Any, placement: Placement, o: ObjectAnnotation) -> Mapping[str, Any]:
    """The field, from pairs of id and share."""
    return {"occluders": tuple(Occluder(id, share) for id, share in kept or ())}


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """Shares and the visible share add up to the pixels in the image; each id is of another object, and occurs once."""
    known = {0, *(o.id for o in sample.objects)}
    for o in rendered(sample):
        ids = [one.id for one in o.occluders]
        if len(set(ids)) < len(ids) or o.id in ids or not known.issuperset(ids):
            yield f"object {o.id}: expected different occluders of {sorted(known - {o.id})}, found {ids}"
        shares = [one.share for one in o.occluders]
        if not all(0 < share <= 1 for share in shares) or shares != sorted(shares, reverse=True):
            yield f"object {o.id}: expected shares above 0 in falling order, found {shares}"
        hidden = 1 - o.visibility / (1 - o.truncation) if o.truncation < 1 else math.fsum(shares)
        if (o.visibility or shares) and abs(math.fsum(shares) - hidden) > 1e-9:
            yield f"object {o.id}: expected occluders of {hidden:.6f} of it, found {math.fsum(shares):.6f}"


def _draw(pen: ImageDraw, sample: Sample, scale: float) -> None:
    """An arrow from each object to each of its occluders, with the share as text."""
    by_id = {o.id: o for o in sample.objects}
    for o in sample.objects:
        for one in o.occluders:
            start, end = middle(o), middle(by_id[one.id]) if one.id in by_id else None
            if start and end:
                arrow(pen, (start[0] * scale, start[1] * scale), (end[0] * scale, end[1] * scale), color_of(o.id))
        if o.occluders:
            note(pen, o, scale, f"{sum(one.share for one in o.occluders):.0%}", color_of(o.id))


LABEL = ObjectLabel(
    name="occluders",
    meaning="what hides it",
    on_request=True,
    fields=(
        Field(
            "occluders",
            "id (0: scenery or ground) and share of its pixels in the image, largest first",
            Occluder,
            many=True,
            ids={"object": in_attributes("id")},
        ),
    ),
    compute=_compute,
    keep=lambda o: [[one.id, one.share] for one in o.occluders] or None,
    restore=_restore,
    prove=_prove,
    drawing=Drawing("occluders", lines=_draw, key=(("occluders: arrows lead to what hides an object", None),)),
)
