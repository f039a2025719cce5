"""amodal: all pixels of an object inside the image, including those that other objects hide."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from viewsphere.geometry.mask import decode_rle, rle_of_part
from viewsphere.geometry.seam import mask_bounds, rle_bounds, turns
from viewsphere.labels.shared.drawing.colors import color_of
from viewsphere.labels.shared.field import Field
from viewsphere.labels.shared.placement import Placement
from viewsphere.labels.shared.spec import Drawing, Models, ObjectLabel, period_of, rendered
from viewsphere.model.sample import ObjectAnnotation, Rle, Sample
from viewsphere.model.sensors.camera import Camera

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

    from viewsphere.labels.shared.context import LabelContext


def _compute(context: LabelContext, i: int) -> Mapping[str, Any]:
    """The pixels that would show the object if it were alone, and their tight box.

    Y. Zhu et al., Semantic Amodal Segmentation (https://arxiv.org/abs/1509.01329), cut off at the image's border, as in COCOA
    and KINS.
    """
    width, height = context.camera.width, context.camera.height
    if context.is_unobstructed(i):
        x0, y0, x1, y1 = context.instances.box[i + 1].tolist() if context.instances.area[i + 1] else (0, 0, 0, 0)
        part = context.instances.ids[y0:y1, x0:x1] == i + 1
    else:
        alone = context.isolated(i).in_image(width, height)
        x0, y0, part = alone.left, alone.top, alone.inverse_depth > 0
    return _fields(context.camera, rle_of_part(height, width, part, x0, y0))


def _restore(counts: str, placement: Placement, o: ObjectAnnotation) -> Mapping[str, Any]:
    """Both fields, from the stored run-length code."""
    return _fields(placement.camera, counts)


def _fields(camera: Camera, counts: str) -> Mapping[str, Any]:
    code = Rle(camera.height, camera.width, counts)
    return {"amodal": code, "box2d_amodal": rle_bounds(camera.height, camera.width, counts, camera.lens.period)}


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """The mask contains the visible mask, in the proportion given by visibility and truncation; the box is tight."""
    for o in rendered(sample):
        amodal = decode_rle(o.amodal.height, o.amodal.width, o.amodal.counts)
        if amodal.shape != (sample.height, sample.width):
            yield f"object {o.id}: expected an amodal mask of the image's size, found {amodal.shape}"
            continue
        seen, inside = o.mask, int(amodal.sum())
        if (seen & ~amodal).any():
            yield f"object {o.id}: expected the visible pixels among the amodal ones, found {(seen & ~amodal).sum()} others"
        tight = mask_bounds(amodal, period_of(sample))
        if o.box2d_amodal != tight:
            yield f"object {o.id}: expected box2d_amodal {tight}, found {o.box2d_amodal}"
        shown = int(seen.sum())
        if shown and abs(o.visibility * inside - shown * (1 - o.truncation)) > 1e-6 * inside:
            yield (
                f"object {o.id}: expected {shown * (1 - o.truncation) / o.visibility:.1f} amodal pixels, as visibility and "
                f"truncation say; found {inside}"
            )


def _draw(pen: ImageDraw, sample: Sample, scale: float) -> None:
    """The hidden pixels of each object hatched in its colour, and the box of all its pixels."""
    for o in sample.objects:
        if o.box2d_amodal is None:
            continue
        color = color_of(o.id)
        hidden = decode_rle(o.amodal.height, o.amodal.width, o.amodal.counts) & ~o.mask
        y, x = np.nonzero(hidden)
        for px, py in zip(x.tolist(), y.tolist(), strict=True):
            if (px + py) % 4 < 2:
                pen.rectangle((px * scale, py * scale, (px + 1) * scale - 1, (py + 1) * scale - 1), fill=(*color, 150))
        x0, y0, x1, y1 = (v * scale for v in o.box2d_amodal)
        for turn in (scale * n for n in turns(period_of(sample))):
            pen.rectangle((x0 - turn, y0, x1 - 1 - turn, y1 - 1), outline=color, width=1)


LABEL = ObjectLabel(
    name="amodal",
    meaning="all its pixels in the image, hidden ones too",
    axes="image",
    on_request=True,
    fields=(
        Field("amodal", "COCO's compressed run-length code of the pixels that it alone would cover", Rle, ids={}),
        Field("box2d_amodal", "their half-open corners (x0, y0, x1, y1), None without any", float, (4,), "px", optional=True),
    ),
    compute=_compute,
    keep=lambda o: o.amodal.counts,
    restore=_restore,
    prove=_prove,
    drawing=Drawing("amodal", lines=_draw, key=(("amodal: hidden parts are hatched", None),)),
)
