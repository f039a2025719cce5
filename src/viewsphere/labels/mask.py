"""mask: the visible pixels of an object."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from viewsphere.geometry.mask import mask_polygons, rle_area, rle_of_part, rle_runs
from viewsphere.labels.shared.drawing.colors import color_of
from viewsphere.labels.shared.placement import Placement
from viewsphere.labels.shared.spec import Drawing, Field, Models, ObjectLabel, Picture, channel_of
from viewsphere.model.sample import ObjectAnnotation, Rle, Sample

if TYPE_CHECKING:
    from viewsphere.labels.shared.context import LabelContext


def _compute(context: LabelContext, i: int) -> Mapping[str, Any]:
    """Run lengths and area of the pixels that show the object."""
    seen, camera = context.instances, context.camera
    area = int(seen.area[i + 1])
    if not area:
        return {"rle": _nothing(camera.height, camera.width), "area": 0}
    x0, y0, x1, y1 = seen.box[i + 1].tolist()
    counts = rle_of_part(camera.height, camera.width, seen.ids[y0:y1, x0:x1] == i + 1, x0, y0)
    return {"rle": Rle(camera.height, camera.width, counts), "area": area}


@lru_cache(maxsize=16)
def _nothing(height: int, width: int) -> Rle:
    """The mask of an invisible object, cached because most things in a street are invisible."""
    return Rle(height, width, rle_of_part(height, width, np.zeros((0, 0), np.bool_), 0, 0))


def _restore(counts: str, placement: Placement, o: ObjectAnnotation) -> Mapping[str, Any]:
    """The fields, from the stored run-length code."""
    height, width = placement.camera.height, placement.camera.width
    return {"rle": Rle(height, width, counts), "area": rle_area(height, width, counts)}


def prove(sample: Sample, models: Models) -> Iterator[str]:
    """Run lengths and polygons match the instance map's pixels, and the number of these pixels is the area."""
    from pycocotools import mask as coco

    instances = channel_of(sample, "instances")
    for o in sample.objects:
        if o.source is not None and instances is None:
            yield from _foreign(o, (sample.height, sample.width))
            continue
        mask = o.mask
        if mask.shape != (sample.height, sample.width):
            yield f"object {o.id}: expected a mask of the image's size, found {mask.shape}"
            continue
        if instances is not None and not np.array_equal(mask, instances == o.id):
            yield f"object {o.id}: run lengths differ from the instance map at {(mask != (instances == o.id)).sum()} pixels"
        if o.source is not None and not mask.any():
            continue  # an imported object may have only a box
        if o.area != mask.sum():
            yield f"object {o.id}: expected area {mask.sum()}, found {o.area}"
        polygons: Any = mask_polygons(mask)
        if polygons:
            code: Any = coco.merge(coco.frPyObjects(polygons, *mask.shape))
            if not np.array_equal(coco.decode(code), mask):
                yield f"object {o.id}: polygons differ from the mask"


def _foreign(o: ObjectAnnotation, size: tuple[int, int]) -> Iterator[str]:
    """The run lengths of an imported object's mask fill the picture and sum to its area; an object may have only a box.

    No pixel is drawn, because a few characters can encode the largest picture.
    """
    if (o.rle.height, o.rle.width) != size:
        yield f"object {o.id}: expected a mask of the image's size, found {(o.rle.height, o.rle.width)}"
        return
    area = int(rle_runs(*size, o.rle.counts)[1::2].sum())
    if area and o.area != area:
        yield f"object {o.id}: expected area {area}, found {o.area}"


def _tinted(picture: Picture, sample: Sample) -> Picture:
    """The picture with every object in its colour."""
    out = picture.astype(np.float64)
    for o in sample.objects:
        mask = o.mask
        out[mask] = 0.5 * out[mask] + 0.5 * np.array(color_of(o.id))
    return out.round().astype(np.uint8)


LABEL = ObjectLabel(
    name="mask",
    meaning="its visible pixels; polygons are made of them",
    fields=(
        Field("rle", "COCO's compressed run-length code", Rle, ids={}),
        Field("area", "number of visible pixels", int, unit="px", ids={}),
    ),
    compute=_compute,
    keep=lambda o: o.rle.counts,
    restore=_restore,
    prove=prove,
    drawing=Drawing("masks", pixels=_tinted),
)
