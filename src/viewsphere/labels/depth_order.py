"""depth_order: which of two overlapping objects in the picture is in front of the other."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from viewsphere.geometry.mask import decode_rle
from viewsphere.labels.shared.drawing.colors import color_of
from viewsphere.labels.shared.drawing.lines import arrow, middle
from viewsphere.labels.shared.field import Field
from viewsphere.labels.shared.ids import in_attributes
from viewsphere.labels.shared.placement import Placement
from viewsphere.labels.shared.spec import Drawing, Models, ObjectLabel, rendered
from viewsphere.model.sample import ObjectAnnotation, Sample

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

    from viewsphere.labels.shared.context import IsolatedMask, LabelContext


@dataclass(frozen=True)
class Overlap:
    """Another object that shares pixels with the object, hidden pixels included. The fields are its id, the number of shared
    pixels in the image, and the share of them at which the object itself is nearer.
    """

    id: int
    pixels: int
    nearer: float


def _compute(context: LabelContext, i: int) -> Mapping[str, Any]:
    """The objects that overlap with the one of id i + 1, in the order of their ids.

    The pairwise orders of amodal data sets: Y. Zhu et al., https://arxiv.org/abs/1509.01329; H. Lee and J. Park, InstaOrder,
    https://arxiv.org/abs/2111.14562, which also has pairs where each object is nearer somewhere.
    """
    others = [j for j, place in enumerate(context.placements) if place and j != i]
    if not others or context.is_unobstructed(i):
        return {"overlaps": ()}
    found = (_overlap(_inside(context, i), _inside(context, j), j + 1) for j in others)
    return {"overlaps": tuple(one for one in found if one)}


def _inside(context: LabelContext, i: int) -> IsolatedMask:
    return context.isolated(i).in_image(context.camera.width, context.camera.height)


def _overlap(own: IsolatedMask, other: IsolatedMask, id: int) -> Overlap | None:
    a, b = own.box, other.box
    x0, y0, x1, y1 = max(a[0], b[0]), max(a[1], b[1]), min(a[2], b[2]), min(a[3], b[3])
    if x0 >= x1 or y0 >= y1:
        return None
    mine = own.inverse_depth[y0 - a[1] : y1 - a[1], x0 - a[0] : x1 - a[0]]
    others = other.inverse_depth[y0 - b[1] : y1 - b[1], x0 - b[0] : x1 - b[0]]
    both = (mine > 0) & (others > 0)
    pixels = int(np.count_nonzero(both))
    return Overlap(id, pixels, int(np.count_nonzero((mine > others) & both)) / pixels) if pixels else None


def _restore(kept: Any, placement: Placement, o: ObjectAnnotation) -> Mapping[str, Any]:
    """The field, from lists of its numbers."""
    return {"overlaps": tuple(Overlap(id, pixels, nearer) for id, pixels, nearer in kept or ())}


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """Overlaps are mutual and match the amodal masks where these are stored; the two shares add up to at most 1."""
    by_id = {o.id: o for o in rendered(sample)}
    for o in by_id.values():
        for one in o.overlaps:
            other = by_id.get(one.id)
            mutual = next((back for back in other.overlaps if back.id == o.id), None) if other else None
            if one.id == o.id or mutual is None or mutual.pixels != one.pixels:
                yield f"object {o.id}: expected the overlap of {one.pixels} pixels that object {one.id} has with it, found none"
            elif not 0 <= one.nearer <= 1 or one.nearer + mutual.nearer > 1 + 1e-12:
                yield f"objects {o.id}, {one.id}: expected shares of together at most 1, found {one.nearer}, {mutual.nearer}"
        if "amodal" in sample.requested:
            yield from _by_masks(o, by_id)


def _by_masks(o: ObjectAnnotation, by_id: Mapping[int, ObjectAnnotation]) -> Iterator[str]:
    own, told = _mask(o), {one.id: one.pixels for one in o.overlaps}
    for other in by_id.values():
        both = int((own & _mask(other)).sum()) if other.id != o.id else 0
        if both != told.get(other.id, 0):
            yield f"objects {o.id}, {other.id}: expected an overlap of {both} amodal pixels, found {told.get(other.id, 0)}"


def _mask(o: ObjectAnnotation) -> Any:
    return decode_rle(o.amodal.height, o.amodal.width, o.amodal.counts)


def _draw(pen: ImageDraw, sample: Sample, scale: float) -> None:
    """An arrow from each object to the overlapping objects that are mostly behind it."""
    by_id = {o.id: o for o in sample.objects}
    for o in sample.objects:
        for one in o.overlaps:
            start, end = middle(o), middle(by_id[one.id]) if one.id in by_id else None
            if start and end and one.nearer > MOSTLY:
                arrow(pen, (start[0] * scale, start[1] * scale), (end[0] * scale, end[1] * scale), color_of(o.id))


MOSTLY = 0.5
"""Minimum share of the common pixels for an object to be drawn as the nearer one."""


LABEL = ObjectLabel(
    name="depth_order",
    meaning="which objects overlap with it, and which of the two is nearer",
    on_request=True,
    fields=(
        Field(
            "overlaps",
            "id, number of common pixels in the image (hidden ones count), and the share of them at which it is nearer",
            Overlap,
            many=True,
            ids={"object": in_attributes("id")},
        ),
    ),
    compute=_compute,
    keep=lambda o: [[one.id, one.pixels, one.nearer] for one in o.overlaps] or None,
    restore=_restore,
    prove=_prove,
    drawing=Drawing("depth_order", lines=_draw, key=(("depth_order: arrows lead from the nearer object", None),)),
)
