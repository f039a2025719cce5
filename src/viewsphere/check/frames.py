"""Proofs of what is said of a frame beside its labels: its files, its objects' numbers, and its camera."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import PurePosixPath

import numpy as np

from viewsphere.errors import ViewsphereError
from viewsphere.geometry.camera import orbit_center, orbit_rotation
from viewsphere.labels import channels
from viewsphere.model.sample import Sample

METRE_TOLERANCE = 1e-9
ANGLE_TOLERANCE = 1e-6


def files(sample: Sample) -> Iterator[str]:
    """Every channel's file is that of the frame, is there and holds an array of the image's size."""
    height, width = sample.height, sample.width
    for name, file in sample.files.items():
        if file.split("/")[-2:] != [name, f"{sample.index:08d}{PurePosixPath(file).suffix}"]:
            yield f"{name}: expected the file of frame {sample.index}, found {file}"
        try:
            array = sample.channels[name]
        except ViewsphereError as error:
            yield str(error)
            continue
        channel = channels()[name]
        if not channel.fits(array, height, width):
            yield f"{file}: expected {channel.expected(height, width)}, found {array.shape} {array.dtype}"


def ids(sample: Sample) -> Iterator[str]:
    """Objects are numbered from 1, each once, in order."""
    found = [o.id for o in sample.objects]
    if any(number < 1 for number in found) or found != sorted(set(found)):
        yield f"expected objects 1, 2, ... in order, found {found}"


def camera(sample: Sample) -> Iterator[str]:
    """The camera stands and looks as its azimuth, elevation, distance and tilt say."""
    if sample.known_camera is None:
        return
    known = sample.camera
    if not np.allclose(known.R @ known.R.T, np.eye(3), atol=METRE_TOLERANCE) or np.linalg.det(known.R) < 0:
        yield "expected a rotation R, found something else"
    pose = sample.known_pose
    if pose is None or not all(o.is_placed for o in sample.objects) or not (pose.target or sample.objects):
        return
    azimuth, elevation, tilt = (math.radians(a) for a in (pose.azimuth_deg, pose.elevation_deg, pose.tilt_deg))
    if not np.allclose(known.R, orbit_rotation(azimuth, elevation, tilt), rtol=0, atol=ANGLE_TOLERANCE):
        yield f"R is not that of azimuth {pose.azimuth_deg}, elevation {pose.elevation_deg}, tilt {pose.tilt_deg}"
    target = np.array(pose.target) if pose.target else sample.objects[0].box3d.mean(axis=0)
    stands = target + orbit_center(azimuth, elevation, pose.distance)
    if not np.allclose(known.center, stands, rtol=0, atol=ANGLE_TOLERANCE * (1 + pose.distance)):
        yield f"expected the camera at {stands.tolist()}, found it at {known.center.tolist()}"


FRAME_PROOFS: dict[str, Callable[[Sample], Iterator[str]]] = {"files": files, "ids": ids, "camera": camera}
"""Checks of every frame by name; those of labels stand in their files."""
