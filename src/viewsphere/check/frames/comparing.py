"""Proofs of a frame's facts other than labels: its files, its objects' ids, and its camera."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import PurePosixPath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.check.frames.pictures import pictures
from viewsphere.errors import ViewsphereError
from viewsphere.geometry.camera import orbit_center, orbit_rotation
from viewsphere.labels import channels
from viewsphere.model.channel import PASSES, PICTURES
from viewsphere.model.sample import Sample

METRE_TOLERANCE = 1e-9
"""Tolerance of a rotation's entries: rounding errors of products in float64 are a million times smaller."""
ANGLE_TOLERANCE = 1e-6
"""Tolerance of a pose computed from angles: radians, and a share of the distance."""
SHARE_TOLERANCE = 1e-4
"""Excess over 1 that a share in float32 may have, such as an albedo that an engine filters."""


def files(sample: Sample) -> Iterator[str]:
    """Every channel's file belongs to the frame, exists, and contains an array of the image's size; passes have
    valid values, and pictures of different depths agree.
    """
    is_whole, height, width = True, sample.height, sample.width
    for name, file in sample.files.items():
        if file.split("/")[-2:] != [name, f"{sample.index:08d}{PurePosixPath(file).suffix}"]:
            yield f"{name}: expected the file of frame {sample.index}, found {file}"
        try:
            array = sample.channels[name]
        except ViewsphereError as error:
            is_whole = False
            yield str(error)
            continue
        channel = channels()[name]
        if not channel.fits(array, height, width):
            is_whole = False
            yield f"{file}: expected {channel.expected(height, width)}, found {array.shape} {array.dtype}"
        elif name in PASSES and name not in PICTURES:
            wrong = list(_passes(sample, name, array))
            is_whole = is_whole and not wrong
            yield from wrong
    if is_whole:
        yield from pictures(sample)


def _passes(sample: Sample, name: str, array: NDArray[Any]) -> Iterator[str]:
    """Light is a number and not negative; shares are at most 1, except for colours in a user's own .blend scene."""
    is_own = sample.origin is not None and sample.origin.shot is not None and sample.origin.shot.scene.blend is not None
    most = np.inf if PASSES[name].unit != "1" or is_own else 1 + SHARE_TOLERANCE
    wrong = ~(np.isfinite(array) & (array >= 0) & (array <= most))
    if wrong.any():
        expected = "light, 0 or more" if PASSES[name].unit != "1" else "shares of 0 to 1"
        yield f"{name}: expected {expected}; found {array[wrong].flat[0]:g} among {wrong.sum()} other numbers"


def _ids(sample: Sample) -> Iterator[str]:
    """Objects are numbered from 1, each once, in order."""
    ids = [o.id for o in sample.objects]
    if any(number < 1 for number in ids) or ids != sorted(set(ids)):
        yield f"expected objects 1, 2, ... in order, found {ids}"


def _camera(sample: Sample) -> Iterator[str]:
    """The camera's pose matches its azimuth, elevation, distance and tilt."""
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


FRAME_PROOFS: dict[str, Callable[[Sample], Iterator[str]]] = {"files": files, "ids": _ids, "camera": _camera}
"""Checks of every frame by name; the proofs of labels are in the labels' files."""
