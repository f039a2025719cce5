"""A check shared by labels of positions: it finds points that are not at their pixels or not at their depth."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.camera import pixel_rays
from viewsphere.geometry.rotation import product, transform
from viewsphere.labels.shared.spec import Array, channel_of
from viewsphere.model.sample import ObjectAnnotation, Sample

Float = NDArray[np.float64]

ROUNDING = 4e-7
"""Rounding error of float32, as a share of the numbers from which a point was computed."""


def exact_depth(sample: Sample) -> Array | None:
    """The depth of a sample; None if it is not stored, or is stored in whole steps, as only PNG files do."""
    return None if sample.files.get("depth", "").endswith(".png") else channel_of(sample, "depth")


def misplaced(sample: Sample, points: Float, pixels: NDArray[np.bool_], slack: Float) -> NDArray[np.bool_]:
    """Return a mask of the points (N, 3), metres in a camera's axes, that are off the rays of the N True pixels in `pixels`
    (H, W). If depth is exact, points off their depth count too; `slack` (N,) is the rounding error in metres.
    """
    rays = pixel_rays(sample.camera.intrinsics)
    rays = rays.reshape(-1, 3) if pixels.all() else rays[pixels]
    if sample.camera.lens.is_parallel:
        points = points - sample.camera.lens.origins()[pixels]
    x, y, z = points.T  # by columns, because numpy is slow on rows of three
    a, b, c = rays.T
    along = (x * a + y * b + z * c) / (a * a + b * b + c * c)
    x, y, off = x - along * a, y - along * b, z - along * c
    wrong = ~((along > 0) & (x * x + y * y + off * off <= slack * slack))
    depth = exact_depth(sample)
    if depth is not None:
        wrong |= ~(np.abs(z - depth[pixels]) <= slack)
    return wrong


def in_camera_axes(sample: Sample, world: Float, pixels: NDArray[np.bool_]) -> Float:
    """World points (N, 3) that the N True pixels show, in the camera's axes: under a rolling shutter, those of each row."""
    rows = sample.camera.rows
    if rows is None:
        return transform(sample.camera.R, world) + sample.camera.t
    row = np.nonzero(pixels)[0]
    return product(rows.rotation[row], world[..., None])[..., 0] + rows.translation[row]


def in_world_axes(sample: Sample, o: ObjectAnnotation, points: Float, pixels: NDArray[np.bool_]) -> Float:
    """Points (N, 3) in an object's axes that the N True pixels show, in the world at the time of each pixel."""
    rows = sample.camera.rows
    if rows is None or o.id - 1 not in rows.moving:
        return transform(o.world_from_object, points)
    poses = rows.moving[o.id - 1][np.nonzero(pixels)[0]]
    return product(poses[:, :3, :3], points[..., None])[..., 0] + poses[:, :3, 3]


def largest(rows: Float) -> Float:
    """The greatest absolute value in each row of three, (N,)."""
    x, y, z = np.abs(rows).T
    return np.maximum(np.maximum(x, y), z)
