"""obb: the smallest oriented rectangles around the visible pixels of an object, and around its projected model."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from viewsphere.geometry.camera import project
from viewsphere.geometry.hull import convex_hull, mask_outline, smallest_rectangle
from viewsphere.geometry.rotation import rigid, transform
from viewsphere.geometry.seam import part_in, tight_box
from viewsphere.labels.shared.drawing.colors import color_of
from viewsphere.labels.shared.field import Field
from viewsphere.labels.shared.placement import Placement
from viewsphere.labels.shared.spec import Drawing, Models, ObjectLabel, rendered
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.truth.raster.rolling import pixels_in_rows

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

    from viewsphere.labels.shared.context import LabelContext

TOLERANCE = 1e-6
"""Pixels by which rounding may move a corner."""


def _compute(context: LabelContext, i: int) -> Mapping[str, Any]:
    """Both rectangles; the model's only if the lens shows all of its vertices."""
    seen = context.instances
    x0, y0, x1, y1 = seen.box[i + 1].tolist() if seen.area[i + 1] else (0, 0, 0, 0)
    box = tight_box((x0, y0, x1, y1), context.camera.lens.period, lambda: seen.ids == i + 1)
    return {"obb": _around(part_in(box, seen.ids) == i + 1, *box[:2]), "obb_projected": _projected(context, i)}


def _projected(context: LabelContext, i: int) -> Any:
    g, camera = context.geometry, context.camera
    own = slice(g.vertex_start[i], g.vertex_start[i + 1])
    if camera.rows is not None:
        points = g.coordinates[own][g.is_used[own]].astype(np.float64)
        pixels, z = pixels_in_rows(camera, camera.rows, i, g.poses[i], points)
        return smallest_rectangle(convex_hull(pixels)) if len(pixels) and (z > 0).all() else None
    vertices = g.places(i)[g.is_used[own]]
    in_camera = transform(rigid(camera.R, camera.t), vertices)
    pixels, _ = project(camera.intrinsics, in_camera)
    if not len(pixels) or not (in_camera[:, 2] > 0).all() or not np.isfinite(pixels).all():
        return None
    return smallest_rectangle(convex_hull(pixels))


def _around(part: Any, x0: int, y0: int) -> Any:
    return smallest_rectangle(convex_hull(mask_outline(part, x0, y0))) if part.any() else None


def _restore(kept: Any, placement: Placement, o: ObjectAnnotation) -> Mapping[str, Any]:
    """The rectangle of the mask, and the stored rectangle of the model."""
    if o.box2d is None:
        return {"obb": None, "obb_projected": None if kept is None else np.array(kept, np.float64)}
    x0, y0, x1, y1 = map(int, o.box2d)
    around = _around(part_in((x0, y0, x1, y1), o.mask), x0, y0)
    return {"obb": around, "obb_projected": None if kept is None else np.array(kept, np.float64)}


def _keep(o: ObjectAnnotation) -> Any:
    """The model's rectangle; the mask is stored already."""
    return None if o.obb_projected is None else o.obb_projected.tolist()


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """Rectangles have right angles, hold the visible pixels, touch them on each side, and are no larger than upright boxes."""
    for o in rendered(sample):
        if (o.obb is None) != (o.box2d is None):
            yield f"object {o.id}: expected an oriented box where something is visible, found {o.obb}"
        for name, box in (("obb", o.box2d), ("obb_projected", o.box2d_unclipped)):
            corners = getattr(o, name)
            if corners is not None:
                yield from (f"object {o.id}: {name}: {problem}" for problem in _rectangle(corners, box))
        if o.obb is not None and o.box2d is not None:
            x0, y0, x1, y1 = map(int, o.box2d)
            outline = mask_outline(part_in((x0, y0, x1, y1), o.mask), x0, y0)
            yield from (f"object {o.id}: obb: {problem}" for problem in _tight(o.obb, outline, TOLERANCE))


def _rectangle(corners: Any, upright: Any) -> Iterator[str]:
    """Yield the errors in a rectangle, given its upright box."""
    sides = np.roll(corners, -1, axis=0) - corners
    reach = 1 + float(np.abs(corners).max())
    if np.abs(sides[0] + sides[2]).max() > TOLERANCE * reach or abs(float(sides[0] @ sides[1])) > TOLERANCE * reach**2:
        yield f"expected a rectangle, found {corners.tolist()}"
    if upright is not None:
        area, limit = abs(float(np.linalg.det(sides[:2]))), (upright[2] - upright[0]) * (upright[3] - upright[1])
        if area > limit + TOLERANCE * reach**2:
            yield f"expected an area of at most {limit:.6g}, that of the upright box, found {area:.6g}"


def _tight(corners: Any, points: Any, slack: float) -> Iterator[str]:
    """Yield the errors in a rectangle around points."""
    for k in range(2):
        side = corners[k + 1] - corners[k]
        length = float(np.hypot(*side))
        if length == 0:
            continue
        along = (points - corners[k]) @ side / length
        if abs(along.min()) > slack * 1e3 or abs(along.max() - length) > slack * 1e3:
            yield f"expected sides at the visible pixels, found them {along.min():.4g} and {along.max() - length:.4g} off"


def _draw(pen: ImageDraw, sample: Sample, scale: float) -> None:
    """The rectangle of each object's visible pixels, in its colour, and its model's rectangle as a thinner line."""
    for o in sample.objects:
        for corners, width in ((o.obb, 2), (o.obb_projected, 1)):
            if corners is not None:
                points = [tuple(p) for p in (corners * scale).tolist()]
                pen.line((*points, points[0]), fill=color_of(o.id), width=width)


_CORNERS = "corners, clockwise as seen from the highest one on"

LABEL = ObjectLabel(
    name="obb",
    meaning="its smallest oriented rectangles",
    axes="image",
    on_request=True,
    fields=(
        Field("obb", f"{_CORNERS}: around its visible pixels; None without any", float, (4, 2), "px", "", True, True),
        Field(
            "obb_projected",
            f"{_CORNERS}: around its projected model; None where the lens does not show all of it in front",
            *(float, (4, 2), "px", "", True, True),
        ),
    ),
    compute=_compute,
    keep=_keep,
    restore=_restore,
    prove=_prove,
    drawing=Drawing("obb", lines=_draw),
)
