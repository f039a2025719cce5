"""Checks shared by labels of positions: they find points that are not at their pixels or not at their depth."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.camera import pixel_rays
from viewsphere.geometry.rotation import product, transform
from viewsphere.labels.shared.spec import Array, channel_of
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.sensors.rolling import RowPoses

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


def seen_of_object(sample: Sample, o: ObjectAnnotation, points: Float, pixels: NDArray[np.bool_]) -> Float:
    """Points (N, 3) in an object's axes that the N True pixels show, in the camera's axes: by the object's pose in the camera
    or, under a rolling shutter, by the poses of each row.
    """
    if sample.camera.rows is None:
        return transform(o.camera_from_object, points)
    return in_camera_axes(sample, in_world_axes(sample, o, points, pixels), pixels)


def largest(rows: Float) -> Float:
    """The greatest absolute value in each row of three, (N,)."""
    x, y, z = np.abs(rows).T
    return np.maximum(np.maximum(x, y), z)


def pixels_of_rows(camera: Camera, rows: RowPoses, o: ObjectAnnotation, points: Float) -> Float:
    """Pixels (N, 2) of points (N, 3) in an object's axes under a rolling shutter, written out here for proofs: of the rows that
    meet a point, the nearest to the middle; NaN where none does.
    """
    height, row = len(rows.rotation), np.arange(len(rows.rotation)) + 0.5
    poses = rows.moving.get(o.id - 1, np.tile(o.world_from_object, (height, 1, 1)))
    world = np.einsum("hij,nj->hni", poses[:, :3, :3], points) + poses[:, None, :3, 3]
    seen = np.einsum("hij,hnj->hni", rows.rotation, world) + rows.translation[:, None]
    homogeneous = np.einsum("ij,hnj->hni", camera.K, seen)
    expected = np.full((len(points), 2), np.nan)
    for k in range(len(points)):
        u, v, w = homogeneous[:, k].T
        with np.errstate(divide="ignore", invalid="ignore"):
            x, y = u / w, v / w
        off, places = y - row, list[tuple[float, float]]()
        for r in np.flatnonzero((w[:-1] > 0) & (w[1:] > 0) & (off[:-1] * off[1:] <= 0)).tolist():
            share = off[r] / (off[r] - off[r + 1])
            places.append((x[r] + share * (x[r + 1] - x[r]), row[r] + share))
        if w[0] > 0 and off[0] <= 0:
            places.append((x[0], y[0]))
        if w[-1] > 0 and off[-1] >= 0:
            places.append((x[-1], y[-1]))
        if places:
            expected[k] = min(places, key=lambda place: abs(place[1] - height / 2))
    return expected
