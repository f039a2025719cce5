"""From a pose to its camera, and whether it can stand there."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from viewsphere.geometry.camera import orbit_center, orbit_rotation
from viewsphere.geometry.rotation import transform
from viewsphere.model.camera import Camera, Intrinsics
from viewsphere.model.shot import Pose

Float = NDArray[np.float64]


def camera_for(intrinsics: Intrinsics, pose: Pose, target: ArrayLike) -> Camera:
    """The camera of a pose; `target` (3,) world metres is looked at unless the pose has a target of its own."""
    azimuth, elevation, tilt = np.radians([pose.azimuth_deg, pose.elevation_deg, pose.tilt_deg])
    at = np.asarray(target if pose.target is None else pose.target, np.float64)
    rotation = orbit_rotation(azimuth, elevation, tilt)
    center = at + orbit_center(azimuth, elevation, pose.distance)
    return Camera(intrinsics, rotation, -transform(rotation, center))


def inside_box(box: Float, points: Float) -> NDArray[np.bool_]:
    """Which of the points (N, 3) lie inside an oriented box (8, 3) that has a volume."""
    corner = box[2]
    edges = box[[1, 3, 6]] - corner
    lengths = np.einsum("ij,ij->i", edges, edges)
    along = np.einsum("nj,ij->ni", points - corner, edges)
    return np.all((lengths > 0) & (along > 0) & (along < lengths), axis=1)


def distance_problem(pose: Pose, box: Float) -> str | None:
    """Why the camera of this pose cannot stand where it does, inside the model's box (8, 3) in world metres; or None."""
    target = box.mean(axis=0) if pose.target is None else np.array(pose.target)
    azimuth, elevation = np.radians([pose.azimuth_deg, pose.elevation_deg])
    camera = target + orbit_center(azimuth, elevation, pose.distance)
    if not inside_box(box, camera[None])[0]:
        return None
    reach = float(np.linalg.norm(box - target, axis=1).max())
    return (
        f"expected the camera outside the model; found distance {pose.distance:g} m (pose {pose.index}) inside its "
        f"box, which reaches {reach:.3g} m"
    )
