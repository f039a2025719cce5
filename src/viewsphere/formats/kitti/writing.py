"""Writes KITTI's trees of objects and of tracks."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np
from pydantic import Field

from viewsphere.errors import UserError
from viewsphere.formats.shared.kitti import (
    DONT_CARE,
    NO_ANGLE,
    NO_BOX,
    NO_SHARE,
    Car,
    calibration,
    calibration_text,
    car_in,
    velodyne,
)
from viewsphere.formats.shared.mounting import Float
from viewsphere.formats.shared.writing.pictures import picture
from viewsphere.formats.shared.writing.timeline import Timeline
from viewsphere.formats.shared.writing.tree import File, Piece, Tree, line
from viewsphere.labels.kitti_levels import LARGELY_HIDDEN, LARGELY_OUTSIDE, PARTLY, TRUNCATED, UNKNOWN
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.sample import Box, ObjectAnnotation, Sample
from viewsphere.model.sensors.rig import CAMERA, Rig
from viewsphere.store import Dataset

NAMES = ("Car", "Van", "Truck", "Pedestrian", "Person_sitting", "Cyclist", "Tram", "Misc")
TYPES = {"person": "Pedestrian"} | {name.casefold(): name for name in NAMES}

CALIBRATED = {
    "object": ("R0_rect:", "Tr_velo_to_cam:", "Tr_imu_to_velo:"),
    "tracking": ("R_rect", "Tr_velo_cam", "Tr_imu_velo"),
}
"""The first words of the calibration lines after the projections, by task; only `object` has colons."""


class Options(Frozen):
    """The benchmark."""

    task: Literal["object", "tracking"] = Field(
        default="object", description="`object`: a file of labels for each picture; `tracking`: one for each sequence"
    )


def type_of(category: str) -> str:
    """KITTI's name of a category, or the category's own name."""
    return TYPES.get(category.casefold(), category)


class _Course(NamedTuple):
    """A sequence: its number, its number of instants, and, if imported, its first sample's number."""

    number: int
    instants: int
    first: int | None


class Kitti(Tree):
    """The tree of a task."""

    def __init__(self, dataset: Dataset, options: Options) -> None:
        super().__init__(dataset)
        self._task = options.task
        self._timeline = Timeline(dataset)
        self._unplanned = lru_cache(maxsize=4)(self._found)

    def sample_files(self, sample: Sample) -> Iterator[File | Piece]:
        """Yield the files of a sensor's sample: its picture or points, and, with the left camera, the files of the frame as a
        whole.
        """
        rig, car, place = self._sensor(sample)
        name, image = f"{sample.index - place:06d}", "image_"
        if self._task == "tracking":
            name, image = f"{self._course(sample).number:04d}/{sample.instant:06d}", "image_0"
        if place == car.lidar:
            yield File(f"training/velodyne/{name}.bin", velodyne(sample))
        else:
            yield File(f"training/{image}{2 if place == car.left else 3}/{name}.png", picture(sample, ".png"))
        if place == car.left:
            yield line(f"ImageSets/{sample.split or 'all'}.txt", name)
            yield from self._labels(sample, rig, car, name)

    def _sensor(self, sample: Sample) -> tuple[Rig | None, Car, int]:
        """The rig, its role as KITTI's car, and the place of the sample's sensor in the rig. If the shot is unknown, as in
        imported and merged data sets, the rig is a single camera. Raises UserError for any other sensor then.
        """
        if sample.origin is not None or sample.sensor != CAMERA:
            shot, _, place = self._timeline.position(sample)
            return shot.rig, car_in(shot, "kitti"), place
        return None if sample.known_camera is None else Rig.single(sample.known_camera.intrinsics), Car(0), 0

    def _course(self, sample: Sample) -> _Course:
        """The sequence of a sample. Raises UserError for a still picture."""
        if sample.origin is None and sample.sequence:
            return self._unplanned(sample.sequence)
        course = self._timeline.course(sample)
        return _Course(course.number, course.instants, None)

    def _found(self, name: str) -> _Course:
        """An imported sequence, with its length from its last picture's number; KITTI's own sequences keep their numbers."""
        samples, known = self.dataset.sequence(name), self.dataset.sequences
        are_numbers = all(re.fullmatch("[0-9]{4}", one) for one in known)
        return _Course(int(name) if are_numbers else known.index(name), samples[-1].instant + 1, samples[0].index)

    def _labels(self, sample: Sample, rig: Rig | None, car: Car, name: str) -> Iterator[File | Piece]:
        """The lines of a frame's objects and, if known, the calibration of its cameras."""
        seen = [o for o in sample.objects if o.box2d is not None]
        rows = [_row(o, type_of(o.category), self._task == "tracking") for o in seen]
        regions = [_nobody_cares(box) for box in (sample.source or {}).get(DONT_CARE, ())]
        calibrated = None if rig is None else _text(calibration(rig, car, sample.camera.intrinsics), self._task)
        if self._task == "object":
            yield File(f"training/label_2/{name}.txt", "".join(f"{row}\n" for row in (*rows, *regions)).encode())
            if calibrated:
                yield File(f"training/calib/{name}.txt", calibrated)
            return
        course = self._course(sample)
        number = f"{course.number:04d}"
        if course.first is None:
            self._check_lens(sample, car)
        ids = (*(o.id for o in seen), *(-1 for _ in regions))
        lines = "".join(f"{sample.instant} {own} {row}\n" for own, row in zip(ids, (*rows, *regions), strict=True))
        yield Piece(f"training/label_02/{number}.txt", lines.encode())
        if self._timeline.is_first(sample) if course.first is None else course.first == sample.index:
            if calibrated:
                yield File(f"training/calib/{number}.txt", calibrated)
            yield line("evaluate_tracking.seqmap.training", number, "empty", "000000", f"{course.instants:06d}")

    def _check_lens(self, sample: Sample, car: Car) -> None:
        """Raise UserError if a sequence zooms, because it has only one calibration."""
        start = next(self._timeline.shots(self._timeline.course(sample)))
        if start.camera(next(start.samples)[1], car.left).intrinsics != sample.camera.intrinsics:
            raise UserError(f"kitti: expected one lens all through a sequence; found another in frame {sample.index}")


def _text(calibrated: Mapping[str, Float], task: str) -> bytes:
    """The text of a calibration, with the keys of a task."""
    others = (np.eye(3), calibrated["velo"], np.eye(3, 4))
    return calibration_text(calibrated, *zip(CALIBRATED[task], others, strict=True))


def _nobody_cares(region: Box) -> str:
    """The line of a region that evaluations leave out, without its end."""
    numbers = " ".join(f"{number + 0.0:.9g}" for number in (NO_ANGLE, *_inclusive(region), *NO_BOX))
    return f"DontCare {NO_SHARE} {NO_SHARE} {numbers}"


def _row(o: ObjectAnnotation, kind: str, in_grades: bool) -> str:
    """A line of labels, without its end, for an object of this type; its truncation is a share or a grade."""
    assert o.box2d is not None
    alpha, box = _upright(o) if o.is_boxed else (NO_ANGLE, NO_BOX)
    alpha = (o.source or {}).get("alpha", alpha)
    start = f"{kind} {_outside(o, in_grades):.6g} {_hidden(o)}"
    return " ".join([start, *(f"{number + 0.0:.9g}" for number in (alpha, *_inclusive(o.box2d), *box))])


def _outside(o: ObjectAnnotation, in_grades: bool) -> float:
    """Return the part of an object outside the picture, as a share or a grade. Imported objects may have only one of them, or
    neither.
    """
    if in_grades and "truncation_level" in o.extra:
        return int(o.extra["truncation_level"])
    if math.isnan(o.truncation):
        return NO_SHARE
    return (o.truncation > TRUNCATED) + (o.truncation > LARGELY_OUTSIDE) if in_grades else o.truncation


def _hidden(o: ObjectAnnotation) -> int:
    """KITTI's grade of occlusion, also for merged objects, for which only the shares are stored."""
    if "occlusion_level" in o.extra:
        return int(o.extra["occlusion_level"])
    if math.isnan(o.visibility) or o.truncation >= 1:
        return UNKNOWN
    hidden = 1 - o.visibility / (1 - o.truncation)
    return (hidden > PARTLY) + (hidden > LARGELY_HIDDEN)


def _inclusive(box: Box) -> Box:
    """The first and the last column and row of half-open corners (x0, y0, x1, y1)."""
    x0, y0, x1, y1 = box
    return x0, y0, x1 - 1, y1 - 1


def _upright(o: ObjectAnnotation) -> tuple[float, tuple[float, ...]]:
    """alpha; and height, width, length, x, y, z (metres, camera axes, the middle of the bottom) and rotation_y (radians) of
    the object's box, set upright in the camera's axes around the same middle.
    """
    width, height, length = o.size
    x, y, z = o.box3d_camera.mean(axis=0).tolist()
    front = -o.camera_from_object[:3, 1]
    turn = math.atan2(-front[2], front[0])
    return _wrapped(turn - math.atan2(x, z)), (height, width, length, x, y + height / 2, z, turn)


def _wrapped(angle: float) -> float:
    """The same angle in [-pi, pi]."""
    return math.remainder(angle, 2 * math.pi)
