"""coordinates: the position of the seen point on its object."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from viewsphere.labels.shared.spec import ChannelLabel, Drawing, Models, Picture, channel_of, rendered
from viewsphere.model.sample import Sample

if TYPE_CHECKING:
    from viewsphere.labels.shared.context import LabelContext

TOLERANCE = 1e-5
"""Share of an object's size by which float32 coordinates may be outside its box."""


def _compute(context: LabelContext) -> NDArray[np.float32]:
    """The seen point in its object's axes, (H, W, 3) metres; NaN on scenery, on ground, and where nothing is seen."""
    from viewsphere.truth.raster import kernels_channels as kernels

    out, shown = context.empty(np.float32, 3), context.shown
    values = shown.of_vertices(context.geometry.coordinates)
    kernels.coordinates(shown.seen, shown.triangles, shown.objects, shown.corners, context.rays, values, out)
    return out


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """Points lie in their objects' boxes; the background has no coordinates."""
    points, instances = channel_of(sample, "coordinates"), channel_of(sample, "instances")
    if points is None or instances is None:
        return
    if (np.isfinite(points).all(axis=-1) != (instances > 0)).any():
        yield "expected points where an object is seen, NaN elsewhere; found others"
    for o in rendered(sample):
        own = points[instances == o.id].astype(np.float64)
        low, high = o.box3d_object.min(axis=0), o.box3d_object.max(axis=0)
        slack = TOLERANCE * float((high - low).max())
        outside = ((own < low - slack) | (own > high + slack)).any(axis=-1).sum()
        if outside:
            yield f"object {o.id}: expected points in its box, found {outside} outside"


def _picture(sample: Sample) -> Picture:
    """The points as a picture (H, W, 3) uint8. From one side of their object's box to the other, red grows with x, green with y
    and blue with z. Pixels without a point are black.
    """
    points = sample.channels["coordinates"]
    out = np.zeros(points.shape, np.uint8)
    for o in rendered(sample):
        own = sample.channels["instances"] == o.id
        low, high = o.box3d_object.min(axis=0), o.box3d_object.max(axis=0)
        out[own] = (255 * np.clip((points[own] - low) / np.maximum(high - low, 1e-9), 0, 1)).round()
    return out


LABEL = ChannelLabel(
    name="coordinates",
    meaning="the seen point in its object's own axes",
    axes="object",
    dtype=np.float32,
    components=3,
    unit="m",
    empty=np.nan,
    compute=_compute,
    prove=_prove,
    drawing=Drawing(
        "coordinates",
        beside=_picture,
        key=(("coordinates: across its box red goes with the object's x, green with y, blue with z", None),),
    ),
)
