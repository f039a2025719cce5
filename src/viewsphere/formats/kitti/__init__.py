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

Data sets that were made elsewhere are imported by their folder: `viewsphere import kitti`. It has `training`, or other folders,
with image_2 and label_2 (a picture each) or image_02 and label_02 (sequences); splits are the lists in ImageSets, else all of
`training` is in `train`. `testing`, which has no labels, and a list `test` of its pictures, are passed over. Read is the left
colour camera alone: labels' boxes are of its picture; the right one, the grey ones, points and oxts are not. A picture's world
has its z up and its origin in the reference camera, which looks along y: labels are what they say there. The lens and where the
left camera stands (KITTI's own: 6 cm off), are P2's. Without a calibration nobody knows them. Exports have labels in the left
camera's own axes, and P2 without its fourth column. `alpha`, a score, and the track id, are in an object's `source`; ids are
the tracks', one more where tracks count from 0. `truncated` of tracking, and `occluded`, are the labels truncation_level and
occlusion_level. DontCare regions are no objects: they are `dont_care` in the picture's `source`, half-open corners, and go out
as they came, with the track -1. Sequences keep KITTI's numbers; when a picture was taken is not known.

Not checked against KITTI's own files: that a pixel's number is its centre, the tracking benchmark's names in calibrations, and
the sequence map. Source: A. Geiger, P. Lenz, R. Urtasun, Are we ready for autonomous driving? The KITTI vision benchmark suite,
CVPR 2012; the development kit's readme, https://github.com/bostondiditeam/kitti/blob/master/resources/devkit_object/readme.txt.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from viewsphere.formats import Scope
from viewsphere.formats.kitti.reading import read
from viewsphere.formats.kitti.writing import Kitti, Options, type_of
from viewsphere.formats.shared.kitti import other_cars
from viewsphere.formats.shared.refusals import pinhole, plain_names, sequences
from viewsphere.formats.shared.tree import functions
from viewsphere.plugins.format import FormatSpec


def refuses(scope: Scope, options: Options) -> Iterator[str]:
    """Lenses, names, other cars than KITTI's, and what is no sequence."""
    yield from pinhole(scope)
    yield from other_cars(scope)
    yield from plain_names(scope)
    counts = Counter(type_of(category.name) for category in scope.categories)
    for name in (name for name, count in counts.items() if count > 1):
        alike = ", ".join(category.name for category in scope.categories if type_of(category.name) == name)
        yield f"expected categories of different types; found {alike}, all of type {name}"
    if options.task == "tracking" and scope.rig is not None:  # of others each picture says whether it is of a sequence
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
    refuses=refuses,
    writer=writer,
    preparer=preparer,
    verify=verify,
    read=read,
)
