"""box2d: the tight box around the visible pixels of an object."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from viewsphere.geometry.seam import mask_bounds, rle_bounds, tight_box, turns
from viewsphere.labels.shared.drawing.colors import color_of
from viewsphere.labels.shared.placement import Placement
from viewsphere.labels.shared.spec import Drawing, Field, Models, ObjectLabel, period_of, rendered
from viewsphere.model.sample import ObjectAnnotation, Sample

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

    from viewsphere.labels.shared.context import LabelContext


def _compute(context: LabelContext, i: int) -> Mapping[str, Any]:
    """Half-open pixel corners, None if no pixel shows the object."""
    seen = context.instances
    if not seen.area[i + 1]:
        return {"box2d": None}
    x0, y0, x1, y1 = seen.box[i + 1].tolist()
    box = tight_box((x0, y0, x1, y1), context.camera.lens.period, lambda: seen.ids == i + 1)
    return {"box2d": tuple(map(float, box))}


def _restore(kept: None, placement: Placement, o: ObjectAnnotation) -> Mapping[str, Any]:
    """The box of the object's mask, which is stored."""
    return {"box2d": rle_bounds(o.rle.height, o.rle.width, o.rle.counts, placement.camera.lens.period)}


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """The box is tight around the mask."""
    for o in rendered(sample):
        tight = mask_bounds(o.mask, period_of(sample))
        if o.box2d != tight:
            yield f"object {o.id}: expected box2d {tight}, found {o.box2d}"


def _draw(pen: ImageDraw, sample: Sample, scale: float) -> None:
    """Every visible object's box, in its colour."""
    for o in sample.objects:
        if o.box2d is not None:
            x0, y0, x1, y1 = (v * scale for v in o.box2d)
            for turn in (scale * n for n in turns(period_of(sample))):
                pen.rectangle((x0 - turn, y0, x1 - 1 - turn, y1 - 1), outline=color_of(o.id), width=2)


LABEL = ObjectLabel(
    name="box2d",
    meaning="its visible pixels' tight box",
    axes="image",
    fields=(
        Field(
            "box2d",
            "half-open corners (x0, y0, x1, y1), None where nothing is visible; x1 exceeds the width across a seam",
            float,
            (4,),
            "px",
            optional=True,
        ),
    ),
    compute=_compute,
    restore=_restore,
    prove=_prove,
    drawing=Drawing("boxes", lines=_draw),
)
