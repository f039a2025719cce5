"""Worlds under a rolling shutter, and the still worlds of their rows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from viewsphere.geometry.rotation import rotation_about
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.sensors.rolling import RowPoses
from viewsphere.truth.raster.geometry import Geometry

READOUT = 0.0771


def sliding(source: str, distance: float, frames: int) -> dict:
    """A recipe's fields: two things of a family, one of which slides past the other, seen by a camera that goes around both; a
    tenth of a second a picture.
    """
    motion = {"kind": "constant", "velocity": [0.9, 0, 0]}
    return {
        "name": "rolling",
        "models": [{"source": source, "category": "thing", "count": 2, "scale": {"length": 0.18}, "motion": motion}],
        "viewpoints": {"kind": "orbit", "azimuth": [0, 60], "elevation": 20, "distance": distance},
        "time": {"frames": frames, "fps": 10},
        "camera": {"size": [96, 72], "fov_deg": 45, "rolling": {"readout": READOUT}},
        "scene": {"ground": True},
        "splits": {"by": "sequence"},
        "formats": [],
    }


def at(x: float, y: float, z: float) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    return pose


def swung(start: np.ndarray, height: int, rng: np.random.Generator, turn: float, shift: float) -> np.ndarray:
    """Poses (H, 4, 4) around a pose: a turn and a shift, both even in time."""
    axis, way, out = rng.normal(size=3), rng.normal(size=3) * shift, np.tile(np.eye(4), (height, 1, 1))
    for i, share in enumerate(np.linspace(-0.5, 0.5, height)):
        out[i, :3, :3] = rotation_about(axis / np.linalg.norm(axis) * turn * share) @ start[:3, :3]
        out[i, :3, 3] = start[:3, 3] + way * share
    return out


def rolling_camera(camera: Camera, geometry: Geometry, rng, turn=0.3, shift=0.3, moving=()) -> Camera:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = camera.R.T, camera.center
    placed = swung(pose, camera.height, rng, turn, shift)
    rotation = np.ascontiguousarray(placed[:, :3, :3].swapaxes(1, 2))
    shifts = -np.einsum("hij,hj->hi", rotation, placed[:, :3, 3])
    things = {i: swung(geometry.poses[i], camera.height, rng, turn, shift) for i in moving}
    return replace(camera, rows=RowPoses(rotation, shifts, things))


def at_row(geometry: Geometry, camera: Camera, row: int) -> tuple[Geometry, Camera]:
    """The still world and camera of a row."""
    assert camera.rows is not None
    poses = geometry.poses.copy()
    for i, own in camera.rows.moving.items():
        poses[i] = own[row]
    bounds = np.tile([[-1e3], [1e3]], (len(poses), 1, 3))  # nothing is left out
    still = replace(geometry, poses=poses, bounds=bounds)
    return still, Camera(camera.intrinsics, camera.rows.rotation[row], camera.rows.translation[row])


def shown_rows(camera: Camera, poses: np.ndarray, point: np.ndarray) -> list[tuple[float, float]]:
    """All places at which rows show a point of a thing at these poses (H, 4, 4), between rows and beyond the ends."""
    rows = camera.rows
    world = poses[:, :3, :3] @ point + poses[:, :3, 3]
    seen = (np.einsum("hij,hj->hi", rows.rotation, world) + rows.translation) @ camera.K.T
    with np.errstate(divide="ignore", invalid="ignore"):
        x, y, w = seen[:, 0] / seen[:, 2], seen[:, 1] / seen[:, 2], seen[:, 2]
    off, found = y - (np.arange(len(y)) + 0.5), []
    for r in range(len(y) - 1):
        if w[r] > 0 and w[r + 1] > 0 and off[r] * off[r + 1] <= 0:
            share = off[r] / (off[r] - off[r + 1])
            found.append((x[r] + share * (x[r + 1] - x[r]), r + 0.5 + share))
    found += [(x[0], y[0])] if w[0] > 0 and off[0] <= 0 else []
    return found + ([(x[-1], y[-1])] if w[-1] > 0 and off[-1] >= 0 else [])
