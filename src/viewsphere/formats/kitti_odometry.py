"""KITTI's odometry benchmark: sequences of one camera or a rectified pair, their poses and a LiDAR's points.

    sequences/<NN>/image_2/<frame>.png     pictures of the left or only camera; image_3: of the right camera
    sequences/<NN>/velodyne/<frame>.bin    with a LiDAR: its points, float32 x (ahead) y (left) z (up) intensity
    sequences/<NN>/calib.txt               P0: to P3: (pixels), Tr: from the LiDAR's axes to the left camera's
    sequences/<NN>/times.txt               seconds from the sequence's first instant, a line for each frame
    poses/<NN>.txt                         a line for each frame, 3 x 4 row by row: left camera's axes to its first ones
    ImageSets/<split>.txt                  the frames of each split, as <NN>/<frame>

pykitti and code for odometry and SLAM read it. Sequences count from 00 in the data set's order; frames are the instants, six
digits. Lengths are metres, camera axes x right, y down, z ahead. Pixel (0, 0) is the centre of the first pixel, so K's
principal point is half a pixel less than the data set's. The first pose of a whole sequence is the identity. The first pose of
a part is relative to the sequence's first camera.

Not stored: the first camera's position in the world, and all objects. The grey cameras, 0 and 1, have no pictures; their
calibrations copy the colour cameras. Without a right camera or a LiDAR, the left camera takes its place. Code that reads
image_0 needs a link.

Not verified with KITTI's own files: the pixel number as its centre. Source: A. Geiger, P. Lenz, R. Urtasun, Are we ready for
autonomous driving? The KITTI vision benchmark suite, CVPR 2012; https://www.cvlibs.net/datasets/kitti/eval_odometry.php.
"""

from __future__ import annotations

from collections.abc import Iterator

from viewsphere.errors import UserError
from viewsphere.formats import Scope
from viewsphere.formats.shared.kitti import (
    Car,
    calibration,
    calibration_text,
    car_in,
    other_cars,
    printed,
    velodyne,
)
from viewsphere.formats.shared.mounting import Float, mounted, unmoved
from viewsphere.formats.shared.writing.pictures import picture
from viewsphere.formats.shared.writing.refusals import pinhole, sequences
from viewsphere.formats.shared.writing.timeline import Timeline, unknown_shots
from viewsphere.formats.shared.writing.tree import File, Piece, Tree, functions, line
from viewsphere.geometry.rotation import compose
from viewsphere.model.sample import Sample
from viewsphere.model.shot import Shot
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset


def _refuses(scope: Scope) -> Iterator[str]:
    """Reasons to refuse: still pictures, distorted lenses, and rigs unlike KITTI's car."""
    yield from sequences(scope)
    yield from unknown_shots(scope)
    yield from pinhole(scope)
    yield from other_cars(scope)


class _KittiOdometry(Tree):
    """The tree of the benchmark."""

    def __init__(self, dataset: Dataset) -> None:
        super().__init__(dataset)
        self._timeline = Timeline(dataset)

    def sample_files(self, sample: Sample) -> Iterator[File | Piece]:
        """Yield the files of a sensor's sample: its picture or points, and, with the left camera, the pose."""
        course, (shot, instant, place) = self._timeline.course(sample), self._timeline.position(sample)
        car = car_in(shot, "kitti_odometry")
        number, frame = f"{course.number:02d}", f"{sample.instant:06d}"
        if place == car.lidar:
            yield File(f"sequences/{number}/velodyne/{frame}.bin", velodyne(sample))
        else:
            yield File(f"sequences/{number}/image_{2 if place == car.left else 3}/{frame}.png", picture(sample, ".png"))
        if place == car.left:
            start = next(self._timeline.shots(course))
            first = next(start.samples)[1]
            lens = start.camera(first, car.left).intrinsics
            if lens != sample.camera.intrinsics:
                raise UserError(
                    f"kitti_odometry: expected one lens all through a sequence; found another in frame {sample.index}"
                )
            if self._timeline.is_first(sample):
                calibrated = calibration(shot.rig, car, lens)
                yield File(f"sequences/{number}/calib.txt", calibration_text(calibrated, ("Tr:", calibrated["velo"])))
            moved = compose(unmoved(_pose(start, first, car)), _pose(shot, instant, car))
            yield line(f"sequences/{number}/times.txt", f"{sample.time:.6e}")
            yield line(f"poses/{number}.txt", printed(moved[:3]))
            yield line(f"ImageSets/{sample.split or 'all'}.txt", f"{number}/{frame}")


def _pose(shot: Shot, instant: int, car: Car) -> Float:
    """The rigid matrix (4, 4) from the left camera's axes to the world's."""
    return compose(shot.instants[instant].world_from_rig, mounted(shot.rig, car.left))


preparer, writer, verify = functions(_KittiOdometry)


FORMAT = FormatSpec(
    about=__doc__,
    holds=("camera poses", "calibrations", "stereo", "LiDAR points"),
    read_by=("pykitti",),
    channels=("rgb",),
    lidar=True,
    names_credits=False,
    refuses=_refuses,
    writer=writer,
    preparer=preparer,
    verify=verify,
)
