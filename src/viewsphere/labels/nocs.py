"""nocs: the position of the seen point on its object, as a share of the object's size."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from viewsphere.labels.shared.point_checks import ROUNDING, largest, misplaced, seen_of_object
from viewsphere.labels.shared.spec import Array, ChannelLabel, Drawing, Models, Picture, channel_of, rendered
from viewsphere.model.sample import ObjectAnnotation, Sample

if TYPE_CHECKING:
    from viewsphere.labels.shared.context import LabelContext

TOLERANCE = 1e-6
"""Amount by which float32 may be outside 0 to 1."""


def _compute(context: LabelContext) -> NDArray[np.float32]:
    """Normalised object coordinates (H, W, 3), 0 to 1 in the object's axes; NaN on scenery, on ground, and where nothing is
    seen.

    Wang et al. 2019, "Normalized Object Coordinate Space for Category-Level 6D Object Pose and Size Estimation": the diagonal
    of the object's tight box has the length 1, and the box's centre is (0.5, 0.5, 0.5). The box is `box3d_object`, that of the
    model at this instant; the axes are the model's own (front -Y, up +Z). The paper's files store z as 1 - z.
    """
    from viewsphere.truth.raster import kernels_channels as kernels

    out, g = context.empty(np.float32, 3), context.geometry
    boxes = np.zeros((g.object_count + 1, 2, 3))
    kernels.own_boxes(g.coordinates, g.is_used, np.array(g.vertex_start, np.int64), context.instances.area, boxes)
    middle, (x, y, z) = (boxes[:, 0] + boxes[:, 1]) / 2, (boxes[:, 1] - boxes[:, 0]).T
    shown, diagonal = context.shown, np.sqrt(x * x + y * y + z * z)
    values = shown.of_vertices(g.coordinates)
    kernels.nocs(shown.seen, shown.triangles, shown.objects, shown.corners, context.rays, values, middle, diagonal, out)
    return out


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """The points, converted from shares to metres, equal `coordinates` and are at their pixels and depth."""
    shares, instances = channel_of(sample, "nocs"), channel_of(sample, "instances")
    if shares is None:
        return
    seen = np.isfinite(shares).all(axis=-1)
    if (seen != ~np.isnan(shares).any(axis=-1)).any() or (np.abs(shares[seen] - 0.5) > 0.5 + TOLERANCE).any():
        yield "expected shares of 0 to 1, or NaN; found others"
    if instances is None:
        return
    if (seen != (instances > 0)).any():
        yield f"expected shares where an object is seen, NaN elsewhere; found {(seen != (instances > 0)).sum()} others"
    for o in rendered(sample):
        yield from _of_object(sample, o, shares, np.logical_and(instances == o.id, seen))


def _of_object(sample: Sample, o: ObjectAnnotation, shares: Array, own: NDArray[np.bool_]) -> Iterator[str]:
    low, high = o.box3d_object.min(axis=0), o.box3d_object.max(axis=0)
    diagonal, middle = float(np.sqrt(((high - low) ** 2).sum())), (low + high) / 2
    points = middle + (shares[own].astype(np.float64) - 0.5) * diagonal
    slack = np.full(len(points), ROUNDING * (2 * diagonal + np.abs(middle).max()))
    coordinates = channel_of(sample, "coordinates")
    if coordinates is not None:
        wrong = ~(largest(points - coordinates[own]) <= slack)
        if wrong.any():
            yield f"object {o.id}: expected shares of its coordinates, found others at {wrong.sum()} pixels"
    if sample.known_camera is not None:
        placed = seen_of_object(sample, o, points, own)
        away = np.abs(o.camera_from_object[:3, 3]).max() + largest(placed)
        wrong = misplaced(sample, placed, own, slack + 2 * ROUNDING * away)
        if wrong.any():
            yield f"object {o.id}: expected what its pixels show, at their depth; found other points at {wrong.sum()} pixels"


def picture(shares: NDArray[np.float32]) -> Picture:
    """Shares as a picture (H, W, 3) uint8, as NOCS maps are shown: x is red, y green, z blue; black without a value."""
    known = np.isfinite(shares).all(axis=-1, keepdims=True)
    return (np.clip(np.where(known, shares, 0.0), 0, 1) * 255).round().astype(np.uint8)


LABEL = ChannelLabel(
    name="nocs",
    meaning="the seen point in its object's box, whose diagonal is 1 and whose centre is 0.5",
    axes="object",
    dtype=np.float32,
    components=3,
    empty=np.nan,
    compute=_compute,
    prove=_prove,
    drawing=Drawing(
        "nocs",
        beside=lambda sample: picture(sample.channels["nocs"]),
        key=(("nocs: red goes with the object's x, green with y, blue with z", None),),
    ),
)
