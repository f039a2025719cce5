"""surface_samples: points on every object's surface, with their normals, and whether they are seen."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.camera import project
from viewsphere.geometry.rotation import transform
from viewsphere.labels.shared.drawing.colors import color_of
from viewsphere.labels.shared.ids import in_column
from viewsphere.labels.shared.needs import ObjectPoints
from viewsphere.labels.shared.spec import Array, ChannelLabel, Drawing, Models, channel_of, rendered
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Count
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.truth.surface_points.raster import BEHIND, OUTSIDE, VISIBLE

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

    from viewsphere.labels.shared.context import LabelContext

MOST = 100_000
"""Points on one object."""

SURFACE_SAMPLE = np.dtype(
    [
        ("object", "<i4"),
        ("triangle", "<i4"),
        ("point_object", "<f8", (3,)),
        ("normal_object", "<f4", (3,)),
        ("point", "<f8", (3,)),
        ("normal", "<f4", (3,)),
        ("pixel", "<f8", (2,)),
        ("state", "u1"),
    ]
)
"""One point in one sample: the id of the object that it lies on, and the triangle of its model; the point, metres, and the
triangle's normal, outwards by its winding, in the object's axes and in the world's; where the point is in the picture, pixels,
NaN behind the camera; and its state there: 0 visible, 1 occluded, 2 outside, 3 behind.
"""


class _SurfaceSamples(Frozen):
    """Options of the label surface_samples."""

    count: Annotated[Count, Field(le=MOST)] = Field(default=1024, description="points on each object")


Float = NDArray[np.float64]

TOLERANCE = 1e-9
"""Share of the numbers that a point was computed from by which it may differ."""

EDGE = 1e-6
"""Pixels from the picture's border within which rounding decides whether a point is inside."""

UNIT = 1e-5
"""By how much the components of float32 normals may differ."""


def _compute(context: LabelContext) -> NDArray[np.void]:
    """Rows of samples, `count` (an option) for each object, in the order of the ids, (N,) of `SURFACE_SAMPLE`; none of an
    object that is not there, or has no surface.

    The points are drawn evenly by area on the model at that instant. All instances have the same points, wherever they are.
    Visibility is that of `tracks`: the segment from the camera's centre to the point meets no other surface.
    """
    own, draw = context.own_view, context.get(ObjectPoints())
    if own is None or draw is None:
        raise ValueError("surface_samples: expected a sample of a shot, found none")
    points = draw(context.options_of("surface_samples", _SurfaceSamples).count)
    now, g = points.in_view(own), own.geometry
    out = np.zeros(len(points), SURFACE_SAMPLE)
    start, ids = np.array(g.triangle_start), np.array([thing.id for thing in own.things], np.int32)
    corners = g.coordinates[g.triangles[start[points.thing] + points.triangle]].astype(np.float64)
    out["object"], out["triangle"], out["state"], out["pixel"] = ids[points.thing], points.triangle, now.state, now.xy
    weights = points.weights[..., None]
    out["point_object"] = weights[:, 0] * corners[:, 0] + weights[:, 1] * corners[:, 1] + weights[:, 2] * corners[:, 2]
    out["point"] = now.world
    normals = _unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    out["normal_object"] = normals
    for i in np.unique(points.thing).tolist():
        on = points.thing == i
        out["normal"][on] = transform(np.array(own.things[i].world_from_object)[:3, :3], normals[on])
    return out


def _unit(vectors: Float) -> Float:
    x, y, z = vectors.T
    return vectors / np.sqrt(x * x + y * y + z * z)[:, None]


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """Points lie in their objects' boxes, are elsewhere by the pose alone, and in the picture where the camera shows them."""
    rows = channel_of(sample, "surface_samples")
    if rows is None:
        return
    if (rows["state"] > BEHIND).any():
        yield f"expected states of 0 to {BEHIND}; found others of {(rows['state'] > BEHIND).sum()} points"
    strange = ~np.isin(rows["object"], [o.id for o in sample.objects])
    if strange.any():
        yield f"expected points on objects of the sample; found {strange.sum()} on others"
    for o in rendered(sample):
        yield from _of_object(o, rows[rows["object"] == o.id])
    if sample.known_camera is not None:
        yield from _in_picture(sample, rows)


def _of_object(o: ObjectAnnotation, rows: Array) -> Iterator[str]:
    local, low, high = rows["point_object"], o.box3d_object.min(axis=0), o.box3d_object.max(axis=0)
    slack = TOLERANCE * (1 + float(np.abs([low, high]).max()))
    outside = ((local < low - slack) | (local > high + slack) | np.isnan(local)).any(axis=1).sum()
    if outside:
        yield f"object {o.id}: expected points in its box, found {outside} outside"
    off = np.abs(rows["point"] - transform(o.world_from_object, local)).max(axis=1, initial=0.0)
    if not (off <= slack + TOLERANCE * np.abs(o.world_from_object).max()).all():
        yield f"object {o.id}: expected points that its pose moves to where they are in the world, found others"
    normals, turned = rows["normal_object"], transform(o.world_from_object[:3, :3], rows["normal_object"])
    is_unit = np.abs(np.sqrt((normals.astype(np.float64) ** 2).sum(axis=1)) - 1) < UNIT
    if not is_unit.all() or not (np.abs(turned - rows["normal"]) < UNIT).all():
        yield f"object {o.id}: expected normals of length 1 that its pose turns into those in the world, found others"


def _in_picture(sample: Sample, rows: Array) -> Iterator[str]:
    camera = sample.camera
    pixels, _ = project(camera.intrinsics, transform(camera.R, rows["point"]) + camera.t)
    found, has_pixel = rows["pixel"], ~np.isnan(rows["pixel"]).any(axis=1)
    same = np.isnan(pixels) == np.isnan(found)
    same &= ~(np.abs(pixels - found) > EDGE * (1 + np.abs(np.nan_to_num(pixels)) / 1e3))
    if not same.all():
        yield f"expected pixels at which the camera shows the points; found others of {(~same.all(axis=1)).sum()}"
    inside = np.minimum(found, (camera.width, camera.height) - found).min(axis=1, initial=np.inf)
    wrong = has_pixel != (rows["state"] < BEHIND)
    wrong |= has_pixel & (np.abs(inside) > EDGE) & ((inside < 0) != (rows["state"] == OUTSIDE))
    if wrong.any():
        yield f"expected state {OUTSIDE} outside of the picture, {BEHIND} without a pixel; found others of {wrong.sum()} points"


def _draw(pen: ImageDraw, sample: Sample, scale: float) -> None:
    """Every point that is seen, in its object's colour, with a short line along its normal."""
    rows, camera = sample.channels["surface_samples"], sample.camera
    size = {o.id: float(np.sqrt((Box3d(o.box3d_object).diagonal ** 2).sum())) for o in sample.objects}
    length = np.array([0.04 * size.get(i, 0.0) for i in rows["object"].tolist()])
    ends, _ = project(camera.intrinsics, transform(camera.R, rows["point"] + length[:, None] * rows["normal"]) + camera.t)
    radius = max(1.0, scale * camera.width / 400)
    for i in np.flatnonzero(rows["state"] == VISIBLE):
        (x, y), end, color = rows["pixel"][i] * scale, ends[i] * scale, color_of(int(rows["object"][i]))
        if np.isfinite(end).all():
            pen.line((x, y, *end.tolist()), fill=(*color, 160))
        pen.ellipse((x - radius, y - radius, x + radius, y + radius), fill=color)


LABEL = ChannelLabel(
    name="surface_samples",
    meaning="points on each object's surface, a row each, with normals, in the object, in the world and in the picture, and "
    "whether it is seen",
    axes="object, world, image",
    needs=(ObjectPoints(),),
    one_pose=True,
    options=_SurfaceSamples,
    dtype=SURFACE_SAMPLE,
    components=0,
    unit="m, px",
    empty=np.nan,
    encoding="npz",
    ids={"object": in_column("object"), "part": in_column("triangle")},
    compute=_compute,
    prove=_prove,
    drawing=Drawing("surface_samples", lines=_draw),
)
