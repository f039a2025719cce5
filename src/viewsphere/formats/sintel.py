"""MPI Sintel's tree, with its archives of depth, segmentation and stereo, for torchvision and ptlflow.

    training/clean/<sequence>/frame_0001.png       the pictures
    training/albedo/<sequence>/frame_0001.png      if the data set keeps the channel: sRGB, as the pictures
    training/flow/<sequence>/frame_0001.flo        flow to the next picture; none for the last, as for the next two
    training/occlusions/<sequence>/frame_0001.png  255 where the next picture does not show the point
    training/invalid/<sequence>/frame_0001.png     255 where there is no flow
    training/depth/<sequence>/frame_0001.dpt
    training/camdata_left/<sequence>/frame_0001.cam
    training/segmentation/<sequence>/frame_0001.png
    stereo/training/{clean_left,clean_right,disparities,occlusions,outofframe}/<sequence>/frame_0001.png   with `stereo`

The split `test` goes to the folder `test`, other splits to `training`; all have labels. torchvision requires the name Sintel
for the folder above `training`, so link it there; ptlflow accepts any name. Stereo has its own folder because its `occlusions`,
for the other eye and for every picture, have the same path as those of flow. The one pass, `clean`, holds everything that the
recipe paints, also motion blur; there is no `final`.

Flow: pixels, right and down, float32. Unknown flow is 1e10: flat backgrounds, and points behind the next camera. Points that
leave the picture have flow and count as occluded. Depth: metres along z, float32, inf for the background. Cameras: the 3 x 3
matrix M, the pixel (0, 0) a centre, and the 3 x 4 motion N from the world to the camera (x right, y down, z ahead), float64: x
= M N X. Segmentation: object ids, constant over the sequence, 0 for none, R 65536 + G 256 + B. Disparity: pixels, positive, 4 R
+ G / 64 + B / 16384, below 1024. `outofframe` marks points outside the right picture, `occlusions` hidden or unknown points.
Frames count from 1.

Not stored: sensors other than the left one (except stereo pictures), boxes and poses of objects, categories, names of splits.
Not verified with the originals: depth as z in metres, pixels as centres, occlusion masks that include points outside the
picture, the folder names camdata_left and segmentation. Source: Butler et al. 2012, "A Naturalistic Open Source Movie for
Optical Flow Evaluation", http://sintel.is.tue.mpg.de.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.codecs.png_tiff import encode_png
from viewsphere.codecs.srgb import encoded
from viewsphere.errors import UserError
from viewsphere.formats import Scope
from viewsphere.formats.shared.writing import refusals
from viewsphere.formats.shared.writing.export_files import Coded
from viewsphere.formats.shared.writing.flow_files import FLO_TAG, UNKNOWN, states_png
from viewsphere.formats.shared.writing.pictures import picture
from viewsphere.formats.shared.writing.sequences import Eyes, check_whole, instants, number, scene, two_eyes
from viewsphere.formats.shared.writing.tree import File, Tree, functions
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.sample import Sample
from viewsphere.model.sensors.camera import Camera
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset

MOST = 1024
"""Disparities, in pixels, that Sintel's encoding holds: 4 pixels a step of red, and fractions in green and blue."""


class _Options(Frozen):
    """The choice of Sintel's archives."""

    stereo: bool = Field(default=False, description="the archive of stereo pairs, too; of a rig of two rectified cameras")


def _needs(options: _Options) -> tuple[str, ...]:
    """Labels of pairs."""
    return ("disparity", "disparity_state") if options.stereo else ()


def _refuses(scope: Scope, options: _Options) -> Iterator[str]:
    """Yield the refused samples: still pictures, rigs that are no pair, and distorted lenses."""
    yield from refusals.sequences(scope)
    yield from refusals.stereo(scope) if options.stereo else two_eyes(scope)
    yield from refusals.pinhole(scope)


class Sintel(Tree):
    """The tree of a data set."""

    def __init__(self, dataset: Dataset, options: _Options) -> None:
        super().__init__(dataset)
        check_whole(dataset, "sintel")
        self._stereo, self._eyes = options.stereo, Eyes(dataset)

    def sample_files(self, sample: Sample) -> Iterator[File]:
        """A picture and, for the left eye, its labels."""
        count, side = instants(self.dataset, sample), self._eyes.side(sample)
        name = f"{scene(sample)}/frame_{number(sample.instant + 1, count)}"
        root = "test" if sample.split == "test" else "training"
        if self._stereo:
            yield from self._pair(sample, f"stereo/{root}", side, f"{name}.png")
        if side == "left":
            yield File(f"{root}/clean/{name}.png", picture(sample, ".png"))
            yield File(f"{root}/depth/{name}.dpt", Coded(sample.index, "depth.dpt", lambda: _tagged(sample.channels["depth"])))
            yield File(f"{root}/camdata_left/{name}.cam", _cam(sample.camera))
            yield File(f"{root}/segmentation/{name}.png", Coded(sample.index, "ids 24.png", partial(_ids, sample)))
            if "albedo" in sample.channels:
                yield File(f"{root}/albedo/{name}.png", Coded(sample.index, "albedo.png", partial(_albedo, sample)))
            if sample.instant < count - 1:
                yield File(f"{root}/flow/{name}.flo", _flo_file(sample))
                yield File(f"{root}/occlusions/{name}.png", states_png(sample, "flow_state", 1, 2, 3))
                yield File(f"{root}/invalid/{name}.png", states_png(sample, "flow_state", 3, 4))

    def _pair(self, sample: Sample, root: str, side: str, name: str) -> Iterator[File]:
        """Yield the files of a picture in the archive of stereo pairs."""
        yield File(f"{root}/clean_{side}/{name}", picture(sample, ".png"))
        if side == "left":
            yield File(f"{root}/disparities/{name}", Coded(sample.index, "sintel disparity.png", partial(_disparity, sample)))
            yield File(f"{root}/occlusions/{name}", states_png(sample, "disparity_state", 1, 4))
            yield File(f"{root}/outofframe/{name}", states_png(sample, "disparity_state", 2, 3))


def _cam(camera: Camera) -> bytes:
    """A camera as Sintel's .cam: the tag, M and N, float64."""
    lens = camera.K.copy()
    lens[:2, 2] -= 0.5
    return FLO_TAG + lens.astype("<f8").tobytes() + np.column_stack((camera.R, camera.t)).astype("<f8").tobytes()


def _disparity(sample: Sample) -> bytes:
    disparity = np.nan_to_num(sample.channels["disparity"].astype(np.float64))
    steps = np.rint(disparity * 2**14).astype(np.int64)
    if steps.max() >= MOST << 14:
        raise UserError(f"frame {sample.index}: sintel: expected disparity below {MOST} pixels; found {disparity.max():.1f}")
    return encode_png(_bytes_of(steps, 16, 8, 0))


def _ids(sample: Sample) -> bytes:
    return encode_png(_bytes_of(sample.channels["instances"].astype(np.int64), 16, 8, 0))


def _bytes_of(numbers: NDArray[np.int64], *shifts: int) -> NDArray[np.uint8]:
    """Numbers (H, W) as pixels: the bytes that start at these bits."""
    return np.stack([numbers >> shift & 255 for shift in shifts], axis=-1).astype(np.uint8)


def _albedo(sample: Sample) -> bytes:
    return encode_png(np.rint(encoded(np.clip(sample.channels["albedo"], 0, 1)) * 255).astype(np.uint8))


preparer, writer, verify = functions(Sintel)


def _tagged(array: NDArray[Any]) -> bytes:
    """Numbers (H, W) or (H, W, 2) after Middlebury's tag, width and height, as little-endian float32, row by row."""
    height, width = array.shape[:2]
    return FLO_TAG + np.array([width, height], "<i4").tobytes() + np.ascontiguousarray(array, "<f4").tobytes()


def _flo_file(sample: Sample, channel: str = "flow") -> Coded:
    """A channel of flow as .flo, with 1e10 for unknown flow."""

    def make() -> bytes:
        flow = sample.channels[channel]
        return _tagged(np.where(np.isnan(flow), UNKNOWN, flow))

    return Coded(sample.index, f"{channel}.flo", make)


FORMAT = FormatSpec(
    about=__doc__,
    holds=("flow", "occlusions", "depth", "cameras", "instances", "disparity"),
    read_by=("torchvision", "ptlflow"),
    options=_Options,
    channels=("rgb", "depth", "instances", "flow", "flow_state"),
    names_credits=False,
    needs=_needs,
    refuses=_refuses,
    writer=writer,
    preparer=preparer,
    verify=verify,
)
