"""position: the position of the seen point in the world."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.rotation import inverse, product, transform
from viewsphere.labels.shared.point_checks import (
    ROUNDING,
    Float,
    exact_depth,
    in_camera_axes,
    in_world_axes,
    largest,
    misplaced,
)
from viewsphere.labels.shared.spec import Array, ChannelLabel, Drawing, Models, Picture, channel_of, rendered
from viewsphere.model.sample import Sample
from viewsphere.model.sensors.rolling import RowPoses

if TYPE_CHECKING:
    from viewsphere.labels.shared.context import LabelContext

STRIPES = 2
"""Colours of a picture begin anew so often in a metre, divided by two."""


def _compute(context: LabelContext) -> NDArray[np.float32]:
    """The seen point in the world's axes, (H, W, 3) metres, on objects, scenery and ground; NaN where nothing is seen.

    It is the pixel's ray from the camera's centre, times 1/s of `truth.raster.visibility`, so it is on that ray and at `depth`.
    """
    from viewsphere.truth.raster import kernels_channels as kernels

    if context.camera.rows is not None:
        return _in_rows(context, context.camera.rows)
    out, world_from_camera = context.empty(np.float32, 3), inverse(context.camera.R)
    center = -transform(world_from_camera, context.camera.t)
    world_from_ray = product(world_from_camera, context.camera_from_ray_to)
    kernels.positions(context.visibility.inverse_depth, context.rays_to, world_from_ray, center, out)
    return out


def _in_rows(context: LabelContext, rows: RowPoses) -> NDArray[np.float32]:
    """The points of a rolling shutter: each is at its place at the moment of its row."""
    from viewsphere.truth.raster import kernels_channels as kernels

    out, inverse_depth, down = context.empty(np.float32, 3), context.visibility.inverse_depth, np.eye(3)
    for row, (rotation, translation) in enumerate(zip(rows.rotation, rows.translation, strict=True)):
        down[1, 2] = row  # the row's rays are those of a picture of one row
        world_from_camera = inverse(rotation)
        world_from_ray = product(product(world_from_camera, context.camera_from_ray), down)
        own, center = slice(row, row + 1), -transform(world_from_camera, translation)
        kernels.positions(inverse_depth[own], context.rays, world_from_ray, center, out[own])
    return out


def _prove(sample: Sample, models: Models) -> Iterator[str]:
    """Points are at their pixels and depth, and equal the object's coordinates, moved by its pose."""
    points = channel_of(sample, "position")
    if points is None:
        return
    seen: NDArray[np.bool_] = np.logical_and.reduce(np.isfinite(points), axis=-1)
    if (seen != np.isfinite(points).any(axis=-1)).any():
        yield "expected all three numbers or none; found some of them"
    depth, instances = exact_depth(sample), channel_of(sample, "instances")
    if depth is not None and (seen != np.isfinite(depth)).any():
        yield f"expected points where depth is finite, NaN elsewhere; found {(seen != np.isfinite(depth)).sum()} others"
    if instances is not None and (~seen & (instances > 0)).any():
        yield f"expected points where an object is seen; found NaN at {(~seen & (instances > 0)).sum()} pixels"
    if sample.known_camera is None:
        return
    world = points[seen].astype(np.float64)
    off = misplaced(sample, in_camera_axes(sample, world, seen), seen, _slack(sample, world))
    if off.any():
        yield f"expected points that are seen in their pixels, and at their depth; found {off.sum()} others"
    yield from _against_coordinates(sample, points, seen)


def _against_coordinates(sample: Sample, points: Array, seen: NDArray[np.bool_]) -> Iterator[str]:
    coordinates, instances = channel_of(sample, "coordinates"), channel_of(sample, "instances")
    if coordinates is None or instances is None:
        return
    for o in rendered(sample):
        own = np.logical_and(instances == o.id, seen)
        world = points[own].astype(np.float64)
        moved = in_world_axes(sample, o, coordinates[own].astype(np.float64), own)
        wrong = ~(largest(moved - world) <= _slack(sample, world) + ROUNDING * largest(moved))
        if wrong.any():
            yield f"object {o.id}: expected its coordinates, moved by its pose; found other points at {wrong.sum()} pixels"


def _slack(sample: Sample, world: Float) -> Float:
    """Metres by which rounding may move points (N, 3): a share of their distances from the camera and from the origin."""
    return ROUNDING * (2 * largest(world - sample.camera.center) + largest(world))


def striped(points: NDArray[np.float32]) -> Picture:
    """Points as a picture (H, W, 3) uint8: red follows x, green y, blue z, rising and falling within each metre."""
    seen = np.isfinite(points).all(axis=-1, keepdims=True)
    share = np.abs((np.where(seen, points, 0.0) * STRIPES / 2) % 1 * 2 - 1)
    return np.where(seen, 60 + 195 * (1 - share), 0).round().astype(np.uint8)


LABEL = ChannelLabel(
    name="position",
    meaning="the seen point in the world, of scenery and ground, too",
    axes="world",
    dtype=np.float32,
    components=3,
    unit="m",
    empty=np.nan,
    compute=_compute,
    prove=_prove,
    drawing=Drawing(
        "position",
        beside=lambda sample: striped(sample.channels["position"]),
        key=(("position: red goes with x, green with y, blue with z, up and down again in each metre", None),),
    ),
)
