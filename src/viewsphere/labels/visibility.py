"""visibility: how much of an object is seen, and how much lies outside of the image."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.box import Bounds, overlap
from viewsphere.labels._label import Field, Models, ObjectLabel, rendered
from viewsphere.labels._sight import Sight
from viewsphere.model.sample import Sample
from viewsphere.truth.visibility import silhouette

EVERYWHERE = (-math.inf, -math.inf, math.inf, math.inf)


def compute(sight: Sight, i: int) -> Mapping[str, Any]:
    """Both shares of one object.

    Visibility is the object's visible pixels over all pixels that it would cover alone, on a canvas of three times the image's
    width and height (BOP's visib_fract, https://github.com/thodan/bop_toolkit/blob/master/docs/bop_datasets_format.md);
    truncation is the share of the latter outside the image. An object that covers no pixel has visibility 0.
    """
    visible, truncated = _shares(sight, i, int(sight.instances.area[i + 1]))
    return {"visibility": visible, "truncation": truncated}


def _shares(sight: Sight, i: int, area: int) -> tuple[float, float]:
    own, whole = sight.projected[i]
    if own is None:
        if not area:
            return 0.0, 1.0
        own = EVERYWHERE  # the object is visible, but all nearer than the distance at which projected boxes begin
    width, height = sight.camera.width, sight.camera.height
    image = (0.0, 0.0, float(width), float(height))
    if whole and not overlap(own, image):
        return 0.0, 1.0
    inside = whole and own[0] >= 0 and own[1] >= 0 and own[2] <= width and own[3] <= height
    if inside and not area:
        return 0.0, 0.0
    if inside and _is_unobstructed(sight, i):
        return 1.0, 0.0
    total, kept = _pixels_alone(sight, i, own if whole else EVERYWHERE)
    if total == 0:
        return 0.0, 0.0 if overlap(own, image) else 1.0
    return area / total, (total - kept) / total


def _is_unobstructed(sight: Sight, i: int) -> bool:
    """Whether nothing can hide any part of the object: its 2D box meets no other object's box, there is no scenery, and the
    ground cannot lie before it.
    """
    geometry = sight.geometry
    if geometry.has_scenery:
        return False  # a street's box meets all others: to look at scenery's boxes would cost more than it saves
    own = sight.projected[i][0]
    for j, (other, whole) in enumerate(sight.projected):
        if j != i and own and other and (not whole or overlap(own, other)):
            return False
    return geometry.ground_z is None or float(sight.camera.center[2]) > geometry.ground_z


def _pixels_alone(sight: Sight, i: int, own: Bounds) -> tuple[int, int]:
    """Number of pixels that the object alone would cover on the large canvas, and how many of these lie in the image."""
    width, height = sight.camera.width, sight.camera.height
    x0, y0, x1, y1 = own
    left, top = math.floor(max(x0, -width)), math.floor(max(y0, -height))
    right, bottom = math.ceil(min(x1, 2 * width)), math.ceil(min(y1, 2 * height))
    if right <= left or bottom <= top:
        return 0, 0
    alone: NDArray[np.bool_] = silhouette(sight.geometry, sight.camera, i + 1, (left, top, right, bottom))
    in_image = alone[max(-top, 0) : max(height - top, 0), max(-left, 0) : max(width - left, 0)]
    return int(np.count_nonzero(alone)), int(np.count_nonzero(in_image))


def prove(sample: Sample, models: Models) -> Iterator[str]:
    """Both shares lie in [0, 1], and visibility is above 0 exactly for objects with visible pixels."""
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
    compute=compute,
    keep=lambda o: [o.visibility, o.truncation],
    restore=lambda kept, placement, o: {"visibility": kept[0], "truncation": kept[1]},
    prove=prove,
)
