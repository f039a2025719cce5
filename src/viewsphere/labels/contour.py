"""contour: the outlines of an object's visible pixels, and their convex hull."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.hull import convex_hull, mask_outline
from viewsphere.geometry.seam import mask_bounds, part_in
from viewsphere.labels.shared.drawing.colors import color_of
from viewsphere.labels.shared.field import Field
from viewsphere.labels.shared.placement import Placement
from viewsphere.labels.shared.spec import Drawing, Models, ObjectLabel, rendered
from viewsphere.model.sample import ObjectAnnotation, Sample

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw


def _restore(kept: None, placement: Placement, o: ObjectAnnotation) -> Mapping[str, Any]:
    """Outlines and hull, from the corners of the mask's pixels."""
    mask = o.mask
    hull = convex_hull(_corners(mask, placement.camera.lens.period)) if mask.any() else np.empty((0, 2))
    return {"contour": tuple(np.array(ring).reshape(-1, 2) for ring in o.polygons), "hull": hull}


def _corners(mask: NDArray[np.bool_], period: int | None) -> NDArray[np.float64]:
    """The corners of a mask's pixels; across the seam of a full turn, those beyond it have x above the width."""
    box = mask_bounds(mask, period)
    if period is None or box is None or box[2] <= period:
        return mask_outline(mask)
    return mask_outline(part_in(box, mask), *box[:2])


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """Outlines enclose the area of the mask; the hull is convex, encloses no less, and reaches the box's sides."""
    for o in rendered(sample):
        enclosed = sum(_area(ring) for ring in o.contour)
        if abs(enclosed - o.area) > 1e-6:
            yield f"object {o.id}: expected outlines around {o.area} pixels, found {enclosed:.6g}"
        if not len(o.hull):
            if o.area:
                yield f"object {o.id}: expected the hull of {o.area} pixels, found none"
            continue
        before, after = o.hull - np.roll(o.hull, 1, axis=0), np.roll(o.hull, -1, axis=0) - o.hull
        if (before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0] <= 0).any() or _area(o.hull) < o.area - 1e-6:
            yield f"object {o.id}: expected a convex hull around {o.area} pixels, found {o.hull.tolist()!r:.80}"
        if o.box2d != (*o.hull.min(axis=0).tolist(), *o.hull.max(axis=0).tolist()):
            yield f"object {o.id}: expected a hull that reaches to {o.box2d}, found another"


def _area(ring: Any) -> float:
    x, y = ring.T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


def _draw(pen: ImageDraw, sample: Sample, scale: float) -> None:
    """Outlines and hulls in the colours of their objects."""
    for o in sample.objects:
        for ring in (*o.contour, o.hull):
            points = [tuple(p) for p in (ring * scale).tolist()]
            if points:
                pen.line((*points, points[0]), fill=color_of(o.id), width=1)


LABEL = ObjectLabel(
    name="contour",
    meaning="the outlines of its visible pixels, and their convex hull",
    axes="image",
    on_request=True,
    fields=(
        Field(
            "contour",
            "closed outlines along pixel corners, clockwise as seen, one for each part connected in the picture, holes joined",
            *(float, (-1, 2), "px"),
            is_array=True,
            many=True,
        ),
        Field("hull", "corners of the convex hull, clockwise as seen", float, (-1, 2), "px", is_array=True),
    ),
    restore=_restore,
    prove=_prove,
    drawing=Drawing("contour", lines=_draw),
)
