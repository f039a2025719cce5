"""The camera of a pose, and the check for cameras inside a model."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.camera import orbit_center, orbit_rotation
from viewsphere.model.instant import Instant, Viewpoint
from viewsphere.model.scene import IDENTITY, Vector

Float = NDArray[np.float64]

LARGE = 10.0
"""Metres: a model that reaches farther and encloses its camera is more often one in millimetres than a building."""


def looking(viewpoint: Viewpoint, focus: Vector, **more: Any) -> Instant:
    """The instant with the camera at a viewpoint; it looks at `focus` unless the viewpoint has its own target."""
    azimuth, elevation, tilt = np.radians([viewpoint.azimuth_deg, viewpoint.elevation_deg, viewpoint.tilt_deg])
    at = viewpoint.target or focus
    center = np.array(at) + orbit_center(azimuth, elevation, viewpoint.distance)
    rows = np.column_stack([orbit_rotation(azimuth, elevation, tilt).T, center]).tolist()
    a, b, c = ((x, y, z, w) for x, y, z, w in rows)
    seconds = viewpoint.time.seconds if viewpoint.time else 0.0
    return Instant(world_from_rig=(a, b, c, IDENTITY[3]), focus=at, seconds=seconds, viewpoint=viewpoint, **more)


def inside_box(box: Float, points: Float) -> NDArray[np.bool_]:
    """Return a mask of the points (N, 3) inside an oriented box (8, 3) that has a volume."""
    corner = box[2]
    edges = box[[1, 3, 6]] - corner
    lengths = np.einsum("ij,ij->i", edges, edges)
    along = np.einsum("nj,ij->ni", points - corner, edges)
    return np.all((lengths > 0) & (along > 0) & (along < lengths), axis=1)


def distance_problem(pose: Viewpoint, box: Float) -> str | None:
    """Return the error message for a camera of this pose inside the model's box (8, 3), world metres; None outside it."""
    target = box.mean(axis=0) if pose.target is None else np.array(pose.target)
    azimuth, elevation = np.radians([pose.azimuth_deg, pose.elevation_deg])
    camera = target + orbit_center(azimuth, elevation, pose.distance)
    if not inside_box(box, camera[None])[0]:
        return None
    reach = float(np.linalg.norm(box - target, axis=1).max())
    millimetres = LARGE < reach < 1000 * pose.distance
    remedy = "If the model is in millimetres, set `unit: mm`" if millimetres else "Set a larger `distance`"
    return f"`distance` {pose.distance:g} m is inside the model, which reaches {reach:.3g} m (pose {pose.index}). {remedy}"
