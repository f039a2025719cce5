"""box2d_projected: the box of an object's projected model, whether it is visible or not."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from viewsphere.geometry.box import Bounds, clip_to_picture
from viewsphere.geometry.mask import mask_box
from viewsphere.geometry.seam import tight_box, turns, united
from viewsphere.labels.shared.drawing.colors import color_of
from viewsphere.labels.shared.placement import Placement
from viewsphere.labels.shared.spec import Drawing, Field, Models, ObjectLabel, period_of, rendered
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.model.sensors.camera import Camera

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

    from viewsphere.labels.shared.context import LabelContext


def _compute(context: LabelContext, i: int) -> Mapping[str, Any]:
    """Both boxes, clipped and unclipped. If the lens shows only a part of the model, the box includes the centres of its
    visible pixels. Otherwise surface nearer than the near limit of projected boxes would be in no box.
    """
    bounds, whole = context.projected[i]
    rolls, seen = context.camera.rows is not None, None
    if (rolls or not whole) and context.instances.area[i + 1]:
        x0, y0, x1, y1 = _seen(context, i)
        seen = x0 + 0.5, y0 + 0.5, x1 - 0.5, y1 - 0.5
    if rolls and bounds and seen:  # a rolling shutter may show a part twice
        bounds = united(bounds, seen, None)
    projected = _clipped(bounds, context.camera)
    if not whole and seen:
        projected = united(projected or seen, seen, context.camera.lens.period)
    return {"box2d_projected": projected, "box2d_unclipped": bounds if whole else None}


def _seen(context: LabelContext, i: int) -> tuple[int, int, int, int]:
    x0, y0, x1, y1 = context.instances.box[i + 1].tolist()
    return tight_box((x0, y0, x1, y1), context.camera.lens.period, lambda: context.instances.ids == i + 1)


def _clipped(bounds: Bounds | None, camera: Camera) -> Bounds | None:
    return bounds and clip_to_picture(bounds, camera)


def _keep(o: ObjectAnnotation) -> Any:
    """The unclipped box, from which the clipped box follows; without an unclipped box, {"cut": the clipped box}."""
    if o.box2d_unclipped is not None:
        return list(o.box2d_unclipped)
    return None if o.box2d_projected is None else {"cut": list(o.box2d_projected)}


def _restore(kept: Any, placement: Placement, o: ObjectAnnotation) -> Mapping[str, Any]:
    """Both boxes, from the stored one."""
    if isinstance(kept, dict):
        return {"box2d_projected": tuple(kept["cut"]), "box2d_unclipped": None}
    bounds = None if kept is None else (kept[0], kept[1], kept[2], kept[3])
    return {"box2d_projected": _clipped(bounds, placement.camera), "box2d_unclipped": bounds}


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """The projected box contains the visible pixels and is the clipped form of the unclipped box, which is inside the projected
    3D box.
    """
    for o in rendered(sample):
        tight, around, unclipped = mask_box(o.mask), o.box2d_projected, o.box2d_unclipped
        if tight and (around is None or not _holds(around, tight, sample, o)):
            yield f"object {o.id}: expected the visible box in the projected one, found {tight} and {around}"
        if unclipped and around != _clipped(unclipped, sample.camera):
            yield f"object {o.id}: expected box2d_projected to be the clipped {unclipped}, found {around}"
        if unclipped and sample.camera.rows is None and sample.camera.lens.is_straight and o.box3d_in_front.all():
            x, y = o.box3d_pixels.T
            if not _within(unclipped, (x.min(), y.min(), x.max(), y.max()), 1e-3):
                yield f"object {o.id}: expected box2d_unclipped within the projected 3D box, found {unclipped}"


def _holds(around: Bounds, tight: tuple[int, int, int, int], sample: Sample, o: ObjectAnnotation) -> bool:
    """Return whether a box holds the visible pixels, to a pixel, in one of the turns of a picture of a full turn."""
    period = period_of(sample)
    x0, y0, x1, y1 = tight_box(tight, period, lambda: o.mask)
    wide = 0 if period is None or around[2] - around[0] < period - 2 else period  # a box all around holds every column
    return any(_within((x0 + turn, y0, x1 + turn, y1), around, 1.0 + wide) for turn in turns(period))


def _within(inner: tuple[float, ...], outer: tuple[float, ...], slack: float) -> bool:
    return (
        inner[0] >= outer[0] - slack
        and inner[1] >= outer[1] - slack
        and inner[2] <= outer[2] + slack
        and inner[3] <= outer[3] + slack
    )


def _draw(pen: ImageDraw, sample: Sample, scale: float) -> None:
    """Every object's box, seen or hidden, in its colour."""
    for o in sample.objects:
        if o.box2d_projected is not None:
            x0, y0, x1, y1 = (v * scale for v in o.box2d_projected)
            for turn in (scale * n for n in turns(period_of(sample))):
                pen.rectangle((x0 - turn, y0, x1 - turn, y1), outline=color_of(o.id), width=1)


_CORNERS = "corners (x0, y0, x1, y1) of the projected model"

LABEL = ObjectLabel(
    name="box2d_projected",
    meaning="the box of its projected model, seen or hidden",
    axes="image",
    fields=(
        Field("box2d_projected", f"{_CORNERS}, clipped to the image; None outside of it", float, (4,), "px", optional=True),
        Field("box2d_unclipped", f"{_CORNERS}; None where it reaches behind the camera", float, (4,), "px", optional=True),
    ),
    compute=_compute,
    keep=_keep,
    restore=_restore,
    prove=_prove,
    drawing=Drawing("box2d_projected", lines=_draw),
)
