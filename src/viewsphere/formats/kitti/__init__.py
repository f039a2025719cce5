"""KITTI's benchmarks of objects and of tracking: a line of text for each object, with its 3D box in the left camera's axes.

    training/image_2/<frame>.png     task `object`: pictures of the left or only camera; image_3: of the right camera
    training/label_2/<frame>.txt     type truncated occluded alpha left top right bottom height width length x y z rotation_y
    training/calib/<frame>.txt       P0 to P3, R0_rect, Tr_velo_to_cam, Tr_imu_to_velo
    training/velodyne/<frame>.bin    with a LiDAR: its points, float32 x y z intensity, its x ahead, y left, z up
    ImageSets/<split>.txt            the frames of each split; all have labels, so all lie in training

    training/image_02/<sequence>/<frame>.png     task `tracking`: the same by sequence, image_03 and velodyne likewise
    training/label_02/<sequence>.txt             a line for each object and frame: frame, track id, then as above
    training/calib/<sequence>.txt                P0: to P3:, R_rect, Tr_velo_cam, Tr_imu_velo
    evaluate_tracking.seqmap.training            the sequences and their numbers of frames

datumaro, torchvision and most code for 3D detection read it. Frames have six digits, sequences four. A frame has the number of
the first sample of its rig in the data set; for `tracking`, its instant. Types are the data set's categories; those that KITTI
also has use its spelling (car: Car, person: Pedestrian). Invisible objects have no line. Track ids are the data set's object
ids.

2D boxes enclose the visible pixels: the numbers of the first and last column and row, from 0. An object of one pixel therefore
has a box of width 0. The origin of projections is also the centre of the first pixel. `truncated` is the share outside the
picture; for `tracking`, 0, 1 or 2 (above 15 %, above 50 %). `occluded` is 0 to 3 (above 5 %, above 50 %; entirely outside the
picture). Lengths are metres, angles radians, axes x right, y down, z ahead; x y z is the centre of the box's bottom.

Not stored: pitch and roll, the camera's pose (kitti_odometry stores it), oxts, DontCare regions and masks. Boxes rotate around
the camera's y axis alone. They are exact for a level camera and upright objects; otherwise centre and size are exact, the
heading is projected along y, and the tilt is lost. The grey cameras copy the colour cameras. Without a right camera, the left
one takes its place. The IMU is at the LiDAR; without a LiDAR, both are at the camera. Unknown values of imported objects are
KITTI's: -1, -10 and -1000.

`viewsphere import kitti` imports a folder of another origin. The folder has `training`, or other folders, with image_2 and
label_2 (a picture each) or image_02 and label_02 (sequences). Splits are the lists in ImageSets; without lists, `train` holds
all of `training`. The import skips `testing`, which has no labels, and a list `test` of its pictures. It reads the left colour
camera, whose picture the label boxes refer to. It ignores the right camera, the grey cameras, points and oxts.

A picture's world has z up and its origin in the reference camera, which looks along y; labels keep their values there. P2 gives
the lens and the position of the left camera (6 cm off in KITTI's own files). Without a calibration both are unknown. Exports
have labels in the left camera's own axes, and P2 without its fourth column. An object's `source` holds `alpha`, a score and the
track id. Ids are those of the tracks, plus one if tracks count from 0. `truncated` of tracking, and `occluded`, are the labels
truncation_level and occlusion_level. DontCare regions are not objects: they are `dont_care` in the picture's `source`,
half-open corners, and exports write them unchanged, with the track -1. Sequences keep KITTI's numbers; the time of a picture is
unknown.

Not verified with KITTI's own files: the pixel number as its centre, the tracking benchmark's names in calibrations, and the
sequence map. Source: A. Geiger, P. Lenz, R. Urtasun, Are we ready for autonomous driving? The KITTI vision benchmark suite,
CVPR 2012; the development kit's readme, https://github.com/bostondiditeam/kitti/blob/master/resources/devkit_object/readme.txt.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from viewsphere.formats import Scope
from viewsphere.formats.kitti.reading import read
from viewsphere.formats.kitti.writing import Kitti, Options, type_of
from viewsphere.formats.shared.kitti import other_cars
from viewsphere.formats.shared.writing.refusals import pinhole, plain_names, sequences
from viewsphere.formats.shared.writing.tree import functions
from viewsphere.plugins.format import FormatSpec


def _refuses(scope: Scope, options: Options) -> Iterator[str]:
    """Reasons to refuse: unsupported lenses and names, rigs unlike KITTI's car and, for tracking, pictures outside
    sequences.
    """
    yield from pinhole(scope)
    yield from other_cars(scope)
    yield from plain_names(scope)
    counts = Counter(type_of(category.name) for category in scope.categories)
    for name in (name for name, count in counts.items() if count > 1):
        alike = ", ".join(category.name for category in scope.categories if type_of(category.name) == name)
        yield f"expected categories of different types; found {alike}, all of type {name}"
    if options.task == "tracking" and scope.rig is not None:  # imported pictures each record whether they belong to a sequence
        yield from sequences(scope)


preparer, writer, verify = functions(Kitti)


FORMAT = FormatSpec(
    about=__doc__,
    holds=("boxes", "3D boxes", "tracks", "calibrations", "stereo", "LiDAR points"),
    read_by=("datumaro", "torchvision"),
    options=Options,
    channels=("rgb",),
    lidar=True,
    names_credits=False,
    refuses=_refuses,
    writer=writer,
    preparer=preparer,
    verify=verify,
    read=read,
)
