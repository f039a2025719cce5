"""KITTI's benchmarks of objects and of tracking: a line of text an object, with its 3D box in the left camera's axes; datumaro,
torchvision and most code for 3D detection read it.

    training/image_2/<frame>.png     task `object`: the pictures of the left or only camera; image_3: those of the right one
    training/label_2/<frame>.txt     type truncated occluded alpha left top right bottom height width length x y z rotation_y
    training/calib/<frame>.txt       P0 to P3, R0_rect, Tr_velo_to_cam, Tr_imu_to_velo
    training/velodyne/<frame>.bin    where there is a LiDAR: its points, float32 x y z intensity, its x ahead, y left, z up
    ImageSets/<split>.txt            the frames of each split; all have labels, so all lie in training

    training/image_02/<sequence>/<frame>.png     task `tracking`: the same by sequence, image_03 and velodyne likewise
    training/label_02/<sequence>.txt             a line an object and frame: frame, track id, then as above
    training/calib/<sequence>.txt                P0: to P3:, R_rect, Tr_velo_cam, Tr_imu_velo
    evaluate_tracking.seqmap.training            the sequences and how many frames they have

Frames have six digits, sequences four. A frame's number is that of the first of its rig's samples in the data set, and for
`tracking` its instant. Types are the data set's categories; those that KITTI has, too, are written as there (car: Car, person:
Pedestrian). Objects of which nothing is seen have no line; track ids are the data set's ids of objects.

2D boxes are of the visible pixels: numbers of the first and of the last column and row, from 0, so an object of one pixel
has a box without width. Projections have their origin at the first pixel's centre, too. `truncated` is the share outside of
the picture, for `tracking` 0, 1 or 2 (above 15 %, above 50 %); `occluded` is 0 to 3 (above 5 %, above 50 %; nothing of it is in
the picture). Metres and radians, axes x right, y down, z ahead; x y z is the middle of the box's bottom.

What is lost: boxes turn about the camera's y axis alone, so they are exact only for a camera that looks level at what stands
upright; of others the middle and the size are exact, the heading is projected along y, and the tilt is lost. The camera's pose
is not kept (kitti_odometry does), and there are no oxts, no DontCare regions and no masks. The grey cameras are those in
colour, the right one the left one where there is none, and the IMU is the LiDAR; without a LiDAR it stands where the camera
does. Values of imported objects that nobody knows are KITTI's: -1, -10 and -1000.

Not checked against KITTI's own files: that a pixel's number is its centre, the tracking benchmark's names in calibrations, and
the sequence map. Source: A. Geiger, P. Lenz, R. Urtasun, Are we ready for autonomous driving? The KITTI vision benchmark suite,
CVPR 2012; the development kit's readme, https://github.com/bostondiditeam/kitti/blob/master/resources/devkit_object/readme.txt.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Literal

import numpy as np
from pydantic import Field

from viewsphere.errors import UserError
from viewsphere.formats import Scope
from viewsphere.formats._kitti import (
    Car,
    calibration,
    calibration_text,
    car_in,
    other_cars,
    row,
    velodyne,
)
from viewsphere.formats._mounting import Float
from viewsphere.formats._pictures import picture
from viewsphere.formats._refusals import pinhole, plain_names, sequences
from viewsphere.formats._timeline import Timeline, unknown_shots
from viewsphere.formats._tree import File, Piece, Tree, functions, line
from viewsphere.model.frozen import Frozen
from viewsphere.model.rig import CAMERA, Rig
from viewsphere.model.sample import Sample
from viewsphere.store import Dataset

CHANNELS = ("rgb",)
CREDITS = False
LIDAR = True
HOLDS = ("boxes", "3D boxes", "tracks", "calibrations", "stereo", "LiDAR points")
READ_BY = ("datumaro", "torchvision")

NAMES = ("Car", "Van", "Truck", "Pedestrian", "Person_sitting", "Cyclist", "Tram", "Misc")
TYPES = {"person": "Pedestrian"} | {name.casefold(): name for name in NAMES}

CALIBRATED = {
    "object": ("R0_rect:", "Tr_velo_to_cam:", "Tr_imu_to_velo:"),
    "tracking": ("R_rect", "Tr_velo_cam", "Tr_imu_velo"),
}
"""How the tasks begin the lines behind the projections: only one has colons."""


class Options(Frozen):
    """Which benchmark."""

    task: Literal["object", "tracking"] = Field(
        default="object", description="`object`: a file of labels for each picture; `tracking`: one for each sequence"
    )


def type_of(category: str) -> str:
    """KITTI's name of a category, or its own."""
    return TYPES.get(category.casefold(), category)


def refuses(scope: Scope, options: Options) -> Iterator[str]:
    """Lenses, names, other cars than KITTI's, and what is no sequence."""
    yield from pinhole(scope)
    yield from other_cars(scope)
    yield from plain_names(scope)
    counts = Counter(type_of(category.name) for category in scope.categories)
    for name in (name for name, count in counts.items() if count > 1):
        alike = ", ".join(category.name for category in scope.categories if type_of(category.name) == name)
        yield f"expected categories of different types; found {alike}, all of type {name}"
    if options.task == "tracking":
        yield from sequences(scope)
        yield from unknown_shots(scope)


class Kitti(Tree):
    """The tree of a task."""

    def __init__(self, dataset: Dataset, options: Options) -> None:
        super().__init__(dataset)
        self._task = options.task
        self._timeline = Timeline(dataset)

    def of(self, sample: Sample) -> Iterator[File | Piece]:
        """What a sensor adds: its picture or points, and, of the left camera, all that is of the frame as a whole."""
        rig, car, place = self._sensor(sample)
        name, image = f"{sample.index - place:06d}", "image_"
        if self._task == "tracking":
            name, image = f"{self._timeline.course(sample).number:04d}/{sample.instant:06d}", "image_0"
        if place == car.lidar:
            yield File(f"training/velodyne/{name}.bin", velodyne(sample))
        else:
            yield File(f"training/{image}{2 if place == car.left else 3}/{name}.png", picture(sample, ".png"))
        if place == car.left:
            yield line(f"ImageSets/{sample.split or 'all'}.txt", name)
            yield from self._labels(sample, rig, car, name)

    def _sensor(self, sample: Sample) -> tuple[Rig | None, Car, int]:
        """The rig, what it is to KITTI, and the sample's sensor by its place in it; of one camera, as imported and merged data
        sets may have it, where the shot is not known. Raises UserError for another sensor there.
        """
        if sample.taken is not None or sample.sensor != CAMERA or self._task == "tracking":
            shot, _, place = self._timeline.taken(sample)
            return shot.rig, car_in(shot, "kitti"), place
        return None if sample.known_camera is None else Rig.of(sample.known_camera.intrinsics), Car(0), 0

    def _labels(self, sample: Sample, rig: Rig | None, car: Car, name: str) -> Iterator[File | Piece]:
        """The lines of a frame's objects, and how its cameras are calibrated, where that is known."""
        rows = [row(o, type_of(o.category), self._task == "tracking") for o in sample.objects if o.box2d is not None]
        calibrated = None if rig is None else _text(calibration(rig, car, sample.camera.intrinsics), self._task)
        if self._task == "object":
            yield File(f"training/label_2/{name}.txt", "".join(f"{row}\n" for row in rows).encode())
            if calibrated:
                yield File(f"training/calib/{name}.txt", calibrated)
            return
        course = self._timeline.course(sample)
        number, start = f"{course.number:04d}", next(self._timeline.shots(course))
        if start.camera(next(start.samples)[1], car.left).intrinsics != sample.camera.intrinsics:
            raise UserError(f"kitti: expected one lens all through a sequence; found another in frame {sample.index}")
        ids = (o.id for o in sample.objects if o.box2d is not None)
        lines = "".join(f"{sample.instant} {own} {row}\n" for own, row in zip(ids, rows, strict=True))
        yield Piece(f"training/label_02/{number}.txt", lines.encode())
        if calibrated and self._timeline.is_first(sample):
            yield File(f"training/calib/{number}.txt", calibrated)
            yield line("evaluate_tracking.seqmap.training", number, "empty", "000000", f"{course.instants:06d}")


def _text(calibrated: Mapping[str, Float], task: str) -> bytes:
    """The text of a calibration, in a task's words."""
    others = (np.eye(3), calibrated["velo"], np.eye(3, 4))
    return calibration_text(calibrated, *zip(CALIBRATED[task], others, strict=True))


preparer, writer, verify = functions(Kitti)
