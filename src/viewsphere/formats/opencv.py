"""Calibrations in OpenCV's YAML, for `cv2.FileStorage`: of every camera, every pair of cameras, and every picture.

    cameras/<sensor>.yaml            image_width, image_height, camera_matrix, distortion_coefficients, fisheye_model
    stereo/<left>/<right>.yaml       image_width, image_height, M1, D1, M2, D2, R, T; R1, R2, P1, P2, Q of rectified pairs;
                                     of two fisheyes model: fisheye
    pictures/<split>/<index>.yaml    a camera's keys, and its pose: R, tvec, rvec
    parts/<number>/                  cameras and stereo of data sets that were merged into the first

The numbers suit OpenCV's functions. `camera_matrix` counts pixels from the centre of the first pixel: a centred camera has cx =
(width - 1) / 2. `distortion_coefficients` are k1 k2 p1 p2 [k3 [k4 k5 k6]] for `cv2.projectPoints`, zeros for a pinhole. If
`fisheye_model` is 1, they are k1 k2 k3 k4 for `cv2.fisheye`. R and tvec transform points of the world (metres, z up) to the
camera's axes, x right, y down, z ahead. R and T of a pair transform the first camera's axes to the second's; Q transforms (x,
y, disparity, 1) to points of the left camera.

Pairs are all rectified pairs, and the first camera with each other camera. A camera's file describes its first picture; for
random or zooming lenses, use the pictures' files. Not stored: skew, which OpenCV's projection ignores; LiDARs; the pictures
themselves. Sources: https://docs.opencv.org/4.x/d9/d0c/group__calib3d.html;
https://docs.opencv.org/4.x/da/d56/classcv_1_1FileStorage.html. Not verified: fisheye_model as the customary name.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import UserError
from viewsphere.formats import Scope
from viewsphere.formats.shared.cameras import Rigs
from viewsphere.formats.shared.writing.refusals import known_cameras, no_skew, opencv_lenses
from viewsphere.formats.shared.writing.tree import File, Tree, functions
from viewsphere.geometry.rotation import product, rotation_vector, transform
from viewsphere.model.sample import Sample
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.sensors.rig import Rig, Sensor
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset

Value = int | str | NDArray[np.float64]


def _refuses(scope: Scope) -> Iterator[str]:
    """Reasons to refuse: unknown cameras, skew, and lenses that OpenCV lacks."""
    yield from known_cameras(scope)
    yield from no_skew(scope)
    yield from opencv_lenses(scope)


class _Opencv(Tree):
    """Files of cameras, pairs and pictures."""

    def __init__(self, dataset: Dataset) -> None:
        super().__init__(dataset)
        self._rigs = Rigs(dataset)

    def sample_files(self, sample: Sample) -> Iterator[File]:
        """A picture's camera, with its pose."""
        camera = sample.camera
        if not camera.lens.is_scan:
            if camera.intrinsics.skew or camera.lens.opencv is None:
                raise UserError(f"opencv: frame {sample.index}: expected a camera of OpenCV's without skew; found another")
            pose = {"R": camera.R, "tvec": camera.t[:, None], "rvec": rotation_vector(camera.R)[:, None]}
            yield File(f"pictures/{self.stem(sample)}.yaml", _yaml({**_lens(camera.intrinsics), **pose}))

    def rest(self) -> Iterator[File]:
        """Cameras and pairs of each part of the data set."""
        for part in range(len(self.dataset.plan.parts)):
            rig, folder = self._rigs.usual(part), f"parts/{part}/" if part else ""
            sensors = [sensor for sensor in rig.sensors if sensor.lidar is None] if rig else []
            for sensor in sensors:
                yield File(f"{folder}cameras/{sensor.name}.yaml", _yaml(_lens(sensor.intrinsics)))
            for left, right, baseline in _pairs(rig, sensors) if rig else ():
                yield File(f"{folder}stereo/{left.name}/{right.name}.yaml", _yaml(_stereo(left, right, baseline)))


def _pairs(rig: Rig, cameras: list[Sensor]) -> Iterator[tuple[Sensor, Sensor, float]]:
    """Rectified pairs of cameras with their baselines, and the first camera's other pairs, with baseline 0."""
    rectified = [(rig.sensors[left], rig.sensors[right], baseline) for left, right, baseline in rig.rectified]
    rectified = [pair for pair in rectified if pair[0].lidar is None and pair[1].lidar is None]
    yield from rectified
    known = {frozenset((left.name, right.name)) for left, right, _ in rectified}
    for other in cameras[1:]:
        if frozenset((cameras[0].name, other.name)) not in known:
            yield cameras[0], other, 0.0


def _matrix(lens: Intrinsics) -> NDArray[np.float64]:
    """K (3, 3), pixels from the centre of the first pixel."""
    return np.array([[lens.fx, 0.0, lens.cx - 0.5], [0.0, lens.fy, lens.cy - 0.5], [0.0, 0.0, 1.0]])


def _bent(lens: Intrinsics) -> NDArray[np.float64]:
    """The distortion coefficients, (1, N)."""
    own = lens.lens.opencv
    return np.array([own.coefficients if own and own.coefficients else [0.0] * 5])


def _is_fisheye(lens: Intrinsics) -> bool:
    return lens.lens.opencv is not None and lens.lens.opencv.is_fisheye


def _lens(lens: Intrinsics) -> dict[str, Value]:
    size = {"image_width": lens.width, "image_height": lens.height}
    found = {"camera_matrix": _matrix(lens), "distortion_coefficients": _bent(lens)}
    return {**size, **found, "fisheye_model": int(_is_fisheye(lens))}


def _stereo(left: Sensor, right: Sensor, baseline: float) -> dict[str, Value]:
    """A pair's lenses, the mount of the second camera relative to the first, and the additional keys of rectified pairs."""
    one, other = np.array(left.rig_from_sensor), np.array(right.rig_from_sensor)
    R = product(other[:3, :3].T, one[:3, :3])
    T = transform(other[:3, :3].T, one[:3, 3] - other[:3, 3])
    K, f, second = _matrix(left.intrinsics), left.intrinsics, right.intrinsics
    said: dict[str, Value] = {"image_width": f.width, "image_height": f.height}
    said |= {"M1": K, "D1": _bent(f), "M2": _matrix(second), "D2": _bent(second), "R": R, "T": T[:, None]}
    if _is_fisheye(f) and _is_fisheye(second):
        said["model"] = "fisheye"
    if not baseline:
        return said
    square = f.fx / f.fy
    Q = [[1, 0, 0, -K[0, 2]], [0, square, 0, -K[1, 2] * square], [0, 0, 0, f.fx], [0, 0, 1 / baseline, 0]]
    P1, P2 = np.column_stack((K, np.zeros(3))), np.column_stack((K, (-f.fx * baseline, 0, 0)))
    return {**said, "R1": np.eye(3), "R2": np.eye(3), "P1": P1, "P2": P2, "Q": np.array(Q, np.float64)}


def _yaml(values: dict[str, Value]) -> bytes:
    """A file in FileStorage's YAML."""
    text = ["%YAML:1.0", "---"]
    for name, value in values.items():
        if isinstance(value, int | str):
            text.append(f"{name}: {value}")
            continue
        rows, columns = value.shape
        numbers = ", ".join(map(repr, (value + 0.0).ravel().tolist()))
        text += [f"{name}: !!opencv-matrix", f"   rows: {rows}", f"   cols: {columns}", "   dt: d", f"   data: [ {numbers} ]"]
    return ("\n".join(text) + "\n").encode()


preparer, writer, verify = functions(_Opencv)


FORMAT = FormatSpec(
    about=__doc__,
    holds=("cameras", "stereo calibration", "poses"),
    read_by=("cv2.FileStorage",),
    channels=(),
    lidar=True,
    names_credits=False,
    refuses=_refuses,
    writer=writer,
    preparer=preparer,
    verify=verify,
)
