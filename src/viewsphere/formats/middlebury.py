"""Middlebury's stereo scenes of 2014, or ETH3D's two-view scenes, for torchvision and most stereo matchers.

`set: middlebury`:

    <split>/<scene>-perfect/im0.png, im1.png              left and right
    <split>/<scene>-perfect/disp0.pfm, disp1.pfm          their disparities
    <split>/<scene>-perfect/mask0nocc.png                 255 if the right picture also shows the left one's point, else 0
    <split>/<scene>-perfect/calib.txt                     cam0, cam1, doffs, baseline, width, height, ndisp, ...

`set: eth3d`:

    two_view_training/<scene>/im0.png, im1.png, calib.txt, cameras.txt, images.txt
    two_view_training_gt/<scene>/disp0GT.pfm, mask0nocc.png

A scene is a pair: `<sequence>_<instant>`, or the frame number of a still picture. ETH3D's split `test` goes to two_view_test,
other splits to two_view_training. torchvision expects the export's folder as Middlebury2014 or ETH3D: link it there. For
Middlebury it reads the splits train, test and additional. It also requires a folder with one of the original's names, such as
an empty `Adirondack`.

Disparity: pixels, positive in both pictures, float32 (PFM: little-endian, the lowest row first); inf is unknown, as for flat
backgrounds; 0 is infinitely far. calib.txt: pixels, (0, 0) a centre, and the baseline in mm, so depth is baseline f / (d +
doffs). doffs is 0; ndisp, vmin and vmax bound disp0's finite disparities. cameras.txt and images.txt follow COLMAP: the pixel
(0, 0) is a corner, motions go from the world to the camera (x right, y down, z ahead), in metres.

Not stored: objects, other exposures and lights (im1E, im1L), disp1 of ETH3D. Not verified with the originals: pixel centres in
calib.txt, and inf as unknown. Sources: Scharstein et al. 2014, "High-Resolution Stereo Datasets with Subpixel-Accurate Ground
Truth", https://vision.middlebury.edu/stereo/data/scenes2014/; Schoeps et al. 2017, "A Multi-View Stereo Benchmark with
High-Resolution Images and Multi-Camera Videos", https://www.eth3d.net.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from typing import Literal

import numpy as np
from pydantic import Field

from viewsphere.formats import Scope
from viewsphere.formats.shared.writing import refusals
from viewsphere.formats.shared.writing.export_files import Coded
from viewsphere.formats.shared.writing.flow_files import map_pfm, states_png
from viewsphere.formats.shared.writing.pictures import picture
from viewsphere.formats.shared.writing.sequences import Eyes, instants, number, scene, two_eyes
from viewsphere.formats.shared.writing.tree import File, Tree, functions
from viewsphere.geometry.rotation import quaternion_from_matrix
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.sample import Sample
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset


class _Options(Frozen):
    """The benchmark whose folders the export writes."""

    set: Literal["middlebury", "eth3d"] = Field(
        default="middlebury", description="`middlebury`: both disparities; `eth3d`: that of the left picture"
    )


def _refuses(scope: Scope, options: _Options) -> Iterator[str]:
    """Yield the reasons why a data set has no stereo pairs."""
    yield from refusals.stereo(scope)
    yield from two_eyes(scope)


class Middlebury(Tree):
    """The tree of scenes."""

    def __init__(self, dataset: Dataset, options: _Options) -> None:
        super().__init__(dataset)
        self._eyes, self._is_eth3d = Eyes(dataset), options.set == "eth3d"

    def sample_files(self, sample: Sample) -> Iterator[File]:
        """An eye's picture and disparity; the left eye also gives the files of the pair."""
        eye, pictures, truth = ("left", "right").index(self._eyes.side(sample)), *self._folders(sample)
        yield File(f"{pictures}/im{eye}.png", picture(sample, ".png"))
        if not eye or not self._is_eth3d:
            name = "disp0GT.pfm" if self._is_eth3d else f"disp{eye}.pfm"
            yield File(f"{truth}/{name}", map_pfm(sample, "disparity", math.inf))
        if not eye:
            baseline = self._eyes.pair(sample).baseline
            yield File(f"{truth}/mask0nocc.png", states_png(sample, "disparity_state", 0))
            yield File(f"{pictures}/calib.txt", Coded(sample.index, "calib.txt", partial(_calibration, sample, baseline)))
            if self._is_eth3d:
                yield from _colmap(sample, baseline, pictures)

    def _folders(self, sample: Sample) -> tuple[str, str]:
        """Return the folder of the pictures, and the folder of their disparity."""
        name = f"{self._eyes.numbers(sample)[0]:08d}"
        if sample.sequence:
            name = f"{scene(sample)}_{number(sample.instant, instants(self.dataset, sample))}"
        if not self._is_eth3d:
            folder = f"{sample.split or 'all'}/{name}-perfect"
            return folder, folder
        root = "two_view_test" if sample.split == "test" else "two_view_training"
        return f"{root}/{name}", f"{root}_gt/{name}"


def _calibration(sample: Sample, baseline: float) -> bytes:
    """The lines of calib.txt."""
    lens, disparity = sample.camera.intrinsics, sample.channels["disparity"]
    known = disparity[np.isfinite(disparity)]
    least, most = (math.floor(known.min()), math.ceil(known.max())) if known.size else (0, 0)
    matrix = f"[{lens.fx!r} 0 {lens.cx - 0.5!r}; 0 {lens.fy!r} {lens.cy - 0.5!r}; 0 0 1]"
    told = {"cam0": matrix, "cam1": matrix, "doffs": 0, "baseline": repr(1000 * baseline)}
    told |= {"width": lens.width, "height": lens.height, "ndisp": most + 1, "isint": 0, "vmin": least, "vmax": most}
    return "".join(f"{name}={value}\n" for name, value in {**told, "dyavg": 0, "dymax": 0}.items()).encode()


def _colmap(sample: Sample, baseline: float, folder: str) -> Iterator[File]:
    """Both eyes in COLMAP's text format."""
    camera, lens = sample.camera, sample.camera.intrinsics
    size = f"{lens.width} {lens.height}"
    lines = (f"{i} PINHOLE {size} {lens.fx!r} {lens.fy!r} {lens.cx!r} {lens.cy!r}\n" for i in (0, 1))
    yield File(f"{folder}/cameras.txt", "".join(lines).encode())
    turn = " ".join(map(repr, quaternion_from_matrix(camera.R)))
    places = ((camera.t - (x, 0, 0)).tolist() for x in (0.0, baseline))
    poses = (f"{i} {turn} {' '.join(map(repr, place))} {i} im{i}.png\n\n" for i, place in enumerate(places))
    yield File(f"{folder}/images.txt", "".join(poses).encode())


preparer, writer, verify = functions(Middlebury)


FORMAT = FormatSpec(
    about=__doc__,
    holds=("disparity", "occlusions", "calibration"),
    read_by=("torchvision",),
    options=_Options,
    channels=("rgb", "disparity", "disparity_state"),
    names_credits=False,
    refuses=_refuses,
    writer=writer,
    preparer=preparer,
    verify=verify,
)
