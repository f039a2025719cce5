"""box2d: the tight box around the visible pixels of an object."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from viewsphere.geometry.mask import mask_box, rle_box
from viewsphere.labels.shared.drawing.colors import color_of
from viewsphere.labels.shared.placement import Placement
from viewsphere.labels.shared.spec import Drawing, Field, Models, ObjectLabel, rendered
from viewsphere.model.sample import ObjectAnnotation, Sample

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

    from viewsphere.labels.shared.context import LabelContext


def _compute(context: LabelContext, i: int) -> Mapping[str, Any]:
    """Half-open pixel corners, None if no pixel shows the object."""
    seen = context.instances
    return {"box2d": tuple(map(float, seen.box[i + 1].tolist())) if seen.area[i + 1] else None}


def _restore(kept: None, placement: Placement, o: ObjectAnnotation) -> Mapping[str, Any]:
    """The box of the object's mask, which is stored."""
    tight = rle_box(o.rle.height, o.rle.width, o.rle.counts)
    return {"box2d": tight and tuple(map(float, tight))}


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """The box is tight around the mask."""
    for o in rendered(sample):
        tight = mask_box(o.mask)
        if o.box2d != tight:
            yield f"object {o.id}: expected box2d {tight}, found {o.box2d}"


def _draw(pen: ImageDraw, sample: Sample, scale: float) -> None:
    """Every visible object's box, in its colour."""
    for o in sample.objects:
        if o.box2d is not None:
            x0, y0, x1, y1 = (v * scale for v in o.box2d)
            pen.rectangle((x0, y0, x1 - 1, y1 - 1), outline=color_of(o.id), width=2)


LABEL = ObjectLabel(
    name="box2d",
    meaning="its visible pixels' tight box",
    axes="image",
    fields=(
        Field("box2d", "half-open corners (x0, y0, x1, y1), None where nothing is visible", float, (4,), "px", optional=True),
    ),
    compute=_compute,
    restore=_restore,
    prove=_prove,
    drawing=Drawing("boxes", lines=_draw),
)
