"""FlyingThings3D, Monkaa and Driving (the Scene Flow sets), for torchvision, ptlflow and stereo trainers.

    frames_cleanpass/<scene>/{left,right}/0000.png
    optical_flow/<scene>/{into_future,into_past}/{left,right}/OpticalFlowInto{Future,Past}_0000_{L,R}.pfm
    disparity/<scene>/{left,right}/0000.pfm
    object_index/<scene>/{left,right}/0000.pfm
    camera_data/<scene>/camera_data.txt, intrinsics.txt

and, if the data set keeps the channels,

    disparity_change/<scene>/into_future/{left,right}/0000.pfm             disparity_change
    material_index/<scene>/{left,right}/0000.pfm                           materials
    motion_boundaries/<scene>/into_future/{left,right}/0000.pgm            motion_boundaries: 255, else 0
    occlusions/<scene>/{into_future,into_past}/{left,right}/0000.png       flow_state, flow_backward_state: 255 where the
                                                                           other picture does not show the point

The option `set` decides the name of a scene. flyingthings3d: `TRAIN/A/<sequence>`, or `TEST/A/<sequence>` in splits `val` and
`test`. monkaa: `<sequence>`. driving: `<mm>mm_focallength/scene_forwards/<sequence>`, in millimetres of a sensor 32 mm wide.
Monkaa and Driving have no splits. Frames count from 0. For flow, torchvision expects the export's folder as FlyingThings3D; for
stereo, as SceneFlow/FlyingThings3D, SceneFlow/Monkaa or SceneFlow/Driving. Link it there.

PFM: little-endian float32, the lowest row first. Flow: pixels right, pixels down, and 0; unknown flow is 1e10. The last picture
into the future and the first into the past are unknown throughout, because readers require all files. Disparity: pixels,
positive in both pictures, 0 at infinity. Its change to the next picture is 1e10 where unknown. Index maps: ids of objects and
materials, 0 for none. The original has no folder `occlusions`; ptlflow reads it.

camera_data.txt has a block for each frame: `Frame N`, `L` and 16 numbers, `R` and 16 numbers. They are 4 x 4 matrices, row by
row, from camera to world; cameras look along -z, x right, y up; metres, world z up. intrinsics.txt is an addition, because
readers assume a lens: frame, fx, fy, cx, cy (pixels; the pixel (0, 0) is a centre), baseline (metres).

Not stored: poses, boxes and categories of objects, a final pass, backward motion other than flow. Not verified with the
originals: axes of the camera matrices, the file type of motion boundaries and of material indices. Source: Mayer et al. 2016,
"A Large Dataset to Train Convolutional Networks for Disparity, Optical Flow, and Scene Flow Estimation",
https://lmb.informatik.uni-freiburg.de/resources/datasets/SceneFlowDatasets.en.html.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Literal

import numpy as np
from pydantic import Field

from viewsphere.formats import Scope
from viewsphere.formats.shared.writing import refusals
from viewsphere.formats.shared.writing.export_files import Coded
from viewsphere.formats.shared.writing.flow_files import UNKNOWN, flow_pfm, map_pfm, states_png
from viewsphere.formats.shared.writing.pictures import picture
from viewsphere.formats.shared.writing.sequences import Eyes, check_whole, instants, number, scene, two_eyes
from viewsphere.formats.shared.writing.tree import File, Piece, Tree, functions, line
from viewsphere.geometry.rotation import rigid
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.sample import Sample
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset

HELD_OUT = ("val", "test")
SENSOR_MM = 32
WAYS = (("future", "flow"), ("past", "flow_backward"))
OPENGL = (1.0, -1.0, -1.0, 1.0)


class _Options(Frozen):
    """The choice among the three sets whose folders the export can write."""

    set: Literal["flyingthings3d", "monkaa", "driving"] = Field(
        default="flyingthings3d", description="`flyingthings3d`: TRAIN and TEST; `monkaa`, `driving`: no splits"
    )


def _refuses(scope: Scope, options: _Options) -> Iterator[str]:
    """Reasons to refuse: still pictures, and rigs other than a stereo pair."""
    yield from refusals.sequences(scope)
    yield from refusals.stereo(scope)
    yield from two_eyes(scope)


class FlyingThings(Tree):
    """The tree of a set."""

    def __init__(self, dataset: Dataset, options: _Options) -> None:
        super().__init__(dataset)
        check_whole(dataset, "flyingthings")
        self._set, self._eyes = options.set, Eyes(dataset)

    def sample_files(self, sample: Sample) -> Iterator[File | Piece]:
        """A picture, its maps, and its cameras."""
        folder, side = self._scene(sample), self._eyes.side(sample)
        name = number(sample.instant, instants(self.dataset, sample))
        yield File(f"frames_cleanpass/{folder}/{side}/{name}.png", picture(sample, ".png"))
        for way, channel in WAYS:
            into = f"{folder}/into_{way}/{side}"
            file = f"OpticalFlowInto{way.title()}_{name}_{side[0].upper()}.pfm"
            yield File(f"optical_flow/{into}/{file}", flow_pfm(sample, channel, float(UNKNOWN)))
            if f"{channel}_state" in sample.channels:
                yield File(f"occlusions/{into}/{name}.png", states_png(sample, f"{channel}_state", 1, 2, 3))
        yield File(f"disparity/{folder}/{side}/{name}.pfm", map_pfm(sample, "disparity"))
        yield File(f"object_index/{folder}/{side}/{name}.pfm", map_pfm(sample, "instances"))
        yield from self._kept(sample, folder, f"{side}/{name}")
        if side == "left":
            yield from self._cameras(sample, f"camera_data/{folder}")

    def _scene(self, sample: Sample) -> str:
        if self._set == "monkaa":
            return scene(sample)
        if self._set == "flyingthings3d":
            return f"{'TEST' if sample.split in HELD_OUT else 'TRAIN'}/A/{scene(sample)}"
        lens = self._eyes.lens(sample)
        return f"{round(lens.fx * SENSOR_MM / lens.width)}mm_focallength/scene_forwards/{scene(sample)}"

    def _kept(self, sample: Sample, folder: str, name: str) -> Iterator[File]:
        """Maps of the optional channels that the data set keeps."""
        if "disparity_change" in sample.channels:
            change = map_pfm(sample, "disparity_change", float(UNKNOWN))
            yield File(f"disparity_change/{folder}/into_future/{name}.pfm", change)
        if "materials" in sample.channels:
            yield File(f"material_index/{folder}/{name}.pfm", map_pfm(sample, "materials"))
        if "motion_boundaries" in sample.channels:
            grey = Coded(sample.index, "motion_boundaries.pgm", partial(_pgm, sample))
            yield File(f"motion_boundaries/{folder}/into_future/{name}.pgm", grey)

    def _cameras(self, sample: Sample, folder: str) -> Iterator[Piece]:
        """The frame's block with both eyes' matrices, and the frame's lens."""
        camera, baseline = sample.camera, self._eyes.pair(sample).baseline
        eyes = (rigid(camera.R.T, camera.center + camera.R[0] * x) * OPENGL for x in (0.0, baseline))
        rows = (f"{name} {' '.join(map(str, eye.ravel().tolist()))}\n" for name, eye in zip("LR", eyes, strict=True))
        yield Piece(f"{folder}/camera_data.txt", f"Frame {sample.instant}\n{''.join(rows)}\n".encode())
        lens = camera.intrinsics
        yield line(f"{folder}/intrinsics.txt", sample.instant, lens.fx, lens.fy, lens.cx - 0.5, lens.cy - 0.5, baseline)


def _pgm(sample: Sample) -> bytes:
    array = np.where(sample.channels["motion_boundaries"] > 0, 255, 0).astype(np.uint8)
    return f"P5\n{array.shape[1]} {array.shape[0]}\n255\n".encode() + array.tobytes()


preparer, writer, verify = functions(FlyingThings)


FORMAT = FormatSpec(
    about=__doc__,
    holds=("flow", "disparity", "disparity change", "instances", "motion boundaries", "occlusions", "cameras"),
    read_by=("torchvision", "ptlflow"),
    options=_Options,
    channels=("rgb", "instances", "flow", "flow_backward", "disparity"),
    names_credits=False,
    refuses=_refuses,
    writer=writer,
    preparer=preparer,
    verify=verify,
)
