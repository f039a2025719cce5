"""The shared parts of KITTI's benchmarks: the sensors of a car, their calibration, lines of labels, and files of points."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from viewsphere.errors import UserError
from viewsphere.formats import Scope
from viewsphere.formats.shared.mounting import CAMERA_FROM_LIDAR, Float, centred, measured, mounted, pointless, unmoved
from viewsphere.geometry.rotation import compose, product, transform
from viewsphere.model.sample import Sample
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.sensors.rig import Rig
from viewsphere.model.shot import Shot


class Car(NamedTuple):
    """The sensors of a rig by their places in it: the reference camera, its partner to the right, and the LiDAR."""

    left: int
    right: int | None = None
    lidar: int | None = None


def _car_of(rig: Rig) -> Car | None:
    """The rig as KITTI's car; None for a rig with sensors other than a camera or a rectified pair, and at most one LiDAR."""
    cameras = [i for i, sensor in enumerate(rig.sensors) if sensor.lidar is None]
    lidars = [i for i, sensor in enumerate(rig.sensors) if sensor.lidar is not None]
    pairs = [pair for pair in rig.rectified if {pair.left, pair.right} <= set(cameras)]
    if len(lidars) > 1 or not 1 <= len(cameras) <= 2 or (len(cameras) == 2 and not pairs):
        return None
    left, right = (pairs[0].left, pairs[0].right) if len(cameras) == 2 else (cameras[0], None)
    return Car(left, right, lidars[0] if lidars else None)


def other_cars(scope: Scope) -> Iterator[str]:
    """Yield the reasons why a data set's rig differs from KITTI's car, or lacks its points."""
    yield from pointless(scope)
    if scope.rig is not None and _car_of(scope.rig) is None:
        found = ", ".join(sensor.name for sensor in scope.rig.sensors)
        yield f"expected a camera or a rectified pair, and one LiDAR at most; found {found}"


def car_in(shot: Shot, name: str) -> Car:
    """The rig of a shot as KITTI's car. Raises UserError, with the format's name, for any other rig."""
    car = _car_of(shot.rig)
    if car is None:
        raise UserError(
            f"{name}: shot {shot.key}: expected a camera or a rectified pair, and at most one LiDAR. Choose another format"
        )
    return car


def calibration(rig: Rig, car: Car, intrinsics: Intrinsics) -> Mapping[str, Float]:
    """The four projections (3, 4), with the centre of the first pixel at (0, 0), and `velo` (3, 4), from the LiDAR's axes to
    the left camera's. The grey cameras 0 and 1 are at the colour cameras 2 and 3; a missing right camera is at the left one.
    `intrinsics`: the left camera's lens at that instant.
    """
    left, right = mounted(rig, car.left), mounted(rig, car.left if car.right is None else car.right)
    velo = CAMERA_FROM_LIDAR
    if car.lidar is not None:
        velo = compose(compose(unmoved(left), mounted(rig, car.lidar)), CAMERA_FROM_LIDAR)
    two, three = (projection(intrinsics, along) for along in (0.0, _along(left, right)))
    return {"P0": two, "P1": three, "P2": two, "P3": three, "velo": velo[:3]}


def projection(lens: Intrinsics, along: float = 0.0) -> Float:
    """The matrix (3, 4) from a camera's axes to the pixels (with (0, 0) a centre) of a camera with this lens, shifted along
    its x axis.
    """
    return product(centred(lens.K), [[1, 0, 0, -along], [0, 1, 0, 0], [0, 0, 1, 0]])


def _along(left: Float, right: Float) -> float:
    """Return the position of the right camera along the left one's x axis."""
    return float(transform(left[:3, :3].T, right[:3, 3] - left[:3, 3])[0])


def printed(values: Float) -> str:
    """Numbers in the style of KITTI's calibrations, row by row, with enough digits to be read back almost equal."""
    return " ".join(f"{value:.12e}" for value in (np.asarray(values) + 0.0).ravel())


def calibration_text(calibrated: Mapping[str, Float], *others: tuple[str, Float]) -> bytes:
    """Lines of the four projections and of other matrices, each starting with its key."""
    projections = ((f"{name}:", calibrated[name]) for name in ("P0", "P1", "P2", "P3"))
    return "".join(f"{name} {printed(matrix)}\n" for name, matrix in (*projections, *others)).encode()


def rectified(sample: Sample, baseline: float) -> bytes:
    """The lines of calib_cam_to_cam.txt for the colour cameras, 02 and, if the baseline is not 0, 03. The sample is the left
    camera's.
    """
    eyes = {"02": 0.0, "03": baseline} if baseline else {"02": 0.0}
    size = f"{sample.width} {sample.height}"
    lines = (f"S_rect_{i}: {size}\nP_rect_{i}: {printed(projection(sample.camera.intrinsics, x))}\n" for i, x in eyes.items())
    return "".join(lines).encode()


def velodyne(sample: Sample) -> bytes:
    """The points of a LiDAR, four float32 each: x ahead, y left, z up (metres), and intensity."""
    points = measured(sample)
    return np.column_stack([points["xyz"], points["intensity"]]).astype("<f4").tobytes()


NO_BOX = (-1.0, -1.0, -1.0, -1000.0, -1000.0, -1000.0, -10.0)
NO_ANGLE, NO_SHARE = -10.0, -1
"""The placeholders for unknown values of imported objects."""

DONT_CARE = "dont_care"
"""The key in an imported picture's `source` for the boxes (half-open corners) of regions that evaluations leave out."""
