"""KITTI's benchmark of depth prediction and completion, with pictures, in the folders of KITTI's drives.

    {train,val,test}/<sequence>/image_0{2,3}/data/0000000000.png
    {train,val,test}/<sequence>/proj_depth/groundtruth/image_0{2,3}/0000000000.png
    {train,val,test}/<sequence>/calib_cam_to_cam.txt     S_rect_02, P_rect_02, and 03 of a pair; of its first pictures

02 is the left or only camera, 03 the right camera of a rectified pair. Splits other than `val` and `test` go to `train`. Frames
count from 0.

Depth has 16 bits: 256 times the metres along z, 0 for the background and beyond 256 metres. Rounding causes errors of at most 2
mm. The depth is dense, unlike the original. Projections use the left camera's axes (x right, y down, z ahead) in metres; the
pixel (0, 0) is a centre. Not stored: poses, object labels, a zooming lens. Not verified with the originals: further lines of
their calib_cam_to_cam.txt. Source: Uhrig et al. 2017, "Sparsity Invariant CNNs", and the development kit's readme,
https://www.cvlibs.net/datasets/kitti/eval_depth.php?benchmark=depth_prediction.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from viewsphere.formats import Scope
from viewsphere.formats.shared.kitti import rectified
from viewsphere.formats.shared.writing import refusals
from viewsphere.formats.shared.writing.export_files import Coded
from viewsphere.formats.shared.writing.flow_files import steps_png
from viewsphere.formats.shared.writing.pictures import picture
from viewsphere.formats.shared.writing.sequences import Eyes, check_whole, instants, number, scene, two_eyes
from viewsphere.formats.shared.writing.tree import File, Tree, functions
from viewsphere.model.sample import Sample
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset

CAMERAS = {"left": "image_02", "right": "image_03"}


def _refuses(scope: Scope) -> Iterator[str]:
    """Reasons to refuse: still pictures, rigs of several cameras other than a pair, and distorted lenses."""
    yield from refusals.sequences(scope)
    yield from two_eyes(scope)
    yield from refusals.pinhole(scope)


class KittiDepth(Tree):
    """The tree of drives."""

    def __init__(self, dataset: Dataset) -> None:
        super().__init__(dataset)
        check_whole(dataset, "kitti_depth")
        self._eyes = Eyes(dataset)

    def sample_files(self, sample: Sample) -> Iterator[File]:
        """A picture, its depth and, with a sequence's first picture, the lenses."""
        root, side = sample.split if sample.split in ("val", "test") else "train", self._eyes.side(sample)
        folder, camera = f"{root}/{scene(sample)}", CAMERAS[side]
        name = number(sample.instant, instants(self.dataset, sample), 10)
        yield File(f"{folder}/{camera}/data/{name}.png", picture(sample, ".png"))
        depth = Coded(sample.index, "kitti depth.png", partial(_metres, sample))
        yield File(f"{folder}/proj_depth/groundtruth/{camera}/{name}.png", depth)
        if side == "left" and not sample.instant:
            yield File(f"{folder}/calib_cam_to_cam.txt", rectified(sample, self._eyes.pair(sample).baseline))


def _metres(sample: Sample) -> bytes:
    depth = sample.channels["depth"]
    return steps_png(depth, np.isfinite(depth) & (depth > 0))


preparer, writer, verify = functions(KittiDepth)


FORMAT = FormatSpec(
    about=__doc__,
    holds=("depth", "calibration"),
    read_by=("OpenCV", "Pillow"),
    channels=("rgb", "depth"),
    names_credits=False,
    refuses=_refuses,
    writer=writer,
    preparer=preparer,
    verify=verify,
)
