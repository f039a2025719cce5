"""KITTI's benchmarks of stereo, optical flow and scene flow, for torchvision, ptlflow and many trainers.

`set: scene_flow_2015`, a number for each pair of successive instants:

    training/{image_2,image_3}/000000_{10,11}.png     left and right, first and second picture
    training/{flow_occ,flow_noc}/000000_10.png        flow to the second picture
    training/{disp_occ_0,disp_noc_0}/000000_10.png    disparity of the first pictures
    training/{disp_occ_1,disp_noc_1}/000000_10.png    disparity at the second instant, for the points of the first picture
    training/obj_map/000000_10.png                    ids of objects, 0 for none, 8 bits
    training/calib_cam_to_cam/000000.txt              S_rect_02, P_rect_02, S_rect_03, P_rect_03

`set: stereo_flow_2012`: `colored_0`, `colored_1`, `flow_occ`, `flow_noc`, `disp_occ`, `disp_noc`, and `calib/000000.txt` with
P0 to P3.

A sequence of n instants has n - 1 pairs. A pair has the number of its first picture in the data set, so there are gaps. The
split `test` goes to `testing`, with all labels; other splits go to `training`. torchvision expects the export's folder as
KittiFlow, Kitti2015 or Kitti2012: link it there. Its Kitti2015Stereo expects disparity for all pictures of image_2 and image_3:
link folders with only the pictures that end with _10.

Flow is 16-bit RGB: 32768 + 64 times the pixels right and down, and 1 if valid, else 0, 0, 0. Flow beyond 512 pixels is invalid.
Disparity has 16 bits: 256 times the pixels; 0 for the background, the sky and beyond 256 pixels. Rounding causes errors of at
most half a step. `noc` holds the points whose match is inside the other picture, hidden there or not; `occ` adds the points
whose match is outside. Projections use the left camera's axes (x right, y down, z ahead) in metres; the pixel (0, 0) is a
centre.

Not stored: poses, categories, flow of the right picture, occlusion, the sequence of a pair. Not verified with the originals:
further lines of their calib_cam_to_cam. Source: Menze and Geiger 2015, "Object Scene Flow for Autonomous Vehicles", Geiger et
al. 2012, "Are we ready for Autonomous Driving?", and the development kits' readme files,
https://www.cvlibs.net/datasets/kitti/.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.codecs.png_tiff import encode_png
from viewsphere.formats import Scope
from viewsphere.formats.shared.kitti import printed, projection, rectified
from viewsphere.formats.shared.writing import refusals
from viewsphere.formats.shared.writing.export_files import Coded
from viewsphere.formats.shared.writing.flow_files import STEPS, ZERO, steps_png
from viewsphere.formats.shared.writing.pictures import picture
from viewsphere.formats.shared.writing.sequences import Eyes, check_whole, instants, number, two_eyes
from viewsphere.formats.shared.writing.tree import File, Tree, functions
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.sample import Sample
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset

MATCHED = {"noc": (0, 1), "occ": (0, 1, 2)}  # states of points: with a match inside the other picture, or anywhere


class _Options(Frozen):
    """The benchmark."""

    set: Literal["scene_flow_2015", "stereo_flow_2012"] = Field(
        default="scene_flow_2015", description="`scene_flow_2015`: two disparities and objects; `stereo_flow_2012`: without"
    )


def _needs(options: _Options) -> tuple[str, ...]:
    """Labels of scene flow."""
    return ("disparity_change", "instances") if options.set == "scene_flow_2015" else ()


def _refuses(scope: Scope, options: _Options) -> Iterator[str]:
    """Reasons to refuse: still pictures, rigs other than a stereo pair, and more objects than 8 bits can number."""
    yield from refusals.sequences(scope)
    yield from refusals.stereo(scope)
    yield from two_eyes(scope)
    if options.set == "scene_flow_2015":
        yield from refusals.most_objects(scope, 255)


class KittiFlow(Tree):
    """The tree of a benchmark."""

    def __init__(self, dataset: Dataset, options: _Options) -> None:
        super().__init__(dataset)
        check_whole(dataset, "kitti_flow")
        self._eyes, self._has_motion = Eyes(dataset), options.set == "scene_flow_2015"
        left, right = ("image_2", "image_3") if self._has_motion else ("colored_0", "colored_1")
        self._pictures: dict[str, str] = {"left": left, "right": right}

    def sample_files(self, sample: Sample) -> Iterator[File]:
        """A picture as the second and as the first of a pair, and the labels of a left one as the first."""
        side = self._eyes.side(sample)
        root = "testing" if sample.split == "test" else "training"
        now, before = (number(n, self.dataset.plan.frames, 6) for n in self._eyes.numbers(sample))
        if sample.instant:
            yield File(f"{root}/{self._pictures[side]}/{before}_11.png", picture(sample, ".png"))
        if sample.instant < instants(self.dataset, sample) - 1:
            yield File(f"{root}/{self._pictures[side]}/{now}_10.png", picture(sample, ".png"))
            if side == "left":
                yield self._calibration(sample, root, now)
                for kind, content in self._maps(sample):
                    yield File(f"{root}/{kind}/{now}_10.png", content)

    def _maps(self, sample: Sample) -> Iterator[tuple[str, Coded]]:
        """The folders of a left picture's labels."""
        for kind, states in MATCHED.items():
            yield f"flow_{kind}", _made(sample, f"flow {kind}", partial(_flow, sample, states))
            disparity = _made(sample, f"disparity {kind}", partial(_disparity, sample, states))
            yield f"disp_{kind}_0" if self._has_motion else f"disp_{kind}", disparity
            if self._has_motion:
                yield f"disp_{kind}_1", _made(sample, f"disparity then {kind}", partial(_later, sample, kind == "noc"))
        if self._has_motion:
            yield "obj_map", _ids_png(sample)

    def _calibration(self, sample: Sample, root: str, name: str) -> File:
        baseline = self._eyes.pair(sample).baseline
        if self._has_motion:
            return File(f"{root}/calib_cam_to_cam/{name}.txt", rectified(sample, baseline))
        lens = sample.camera.intrinsics  # grey and coloured, left and right
        lines = (f"P{i}: {printed(projection(lens, baseline * (i % 2)))}\n" for i in range(4))
        return File(f"{root}/calib/{name}.txt", "".join(lines).encode())


def _made(sample: Sample, name: str, make: Callable[[], bytes]) -> Coded:
    return Coded(sample.index, f"kitti {name}.png", make)


def _flow(sample: Sample, states: tuple[int, ...]) -> bytes:
    return _flow_png(sample.channels["flow"], np.isin(sample.channels["flow_state"], states))


def _disparity(sample: Sample, states: tuple[int, ...]) -> bytes:
    disparity = sample.channels["disparity"]
    return steps_png(disparity, np.isin(sample.channels["disparity_state"], states) & (disparity > 0))


def _later(sample: Sample, inside: bool) -> bytes:
    """The disparity of the visible points one instant later; `inside`: only for points inside both pictures then."""
    later = sample.channels["disparity"] + sample.channels["disparity_change"]
    valid = np.isin(sample.channels["flow_state"], MATCHED["occ"]) & (sample.channels["disparity"] > 0) & (later > 0)
    return steps_png(later, valid & _in_both(sample, later) if inside else valid)


def _in_both(sample: Sample, later: NDArray[Any]) -> NDArray[np.bool_]:
    x = np.arange(sample.width) + 0.5 + sample.channels["flow"][..., 0] - later
    return np.isin(sample.channels["flow_state"], MATCHED["noc"]) & (x >= 0) & (x < sample.width)


preparer, writer, verify = functions(KittiFlow)


def _flow_png(flow: NDArray[np.float32], valid: NDArray[np.bool_]) -> bytes:
    """KITTI's flow (H, W, 2) as 16-bit RGB: right and down in steps of 1/64 pixel from 2^15, and 1 if valid.

    Flow beyond 512 pixels cannot be expressed and is invalid. Invalid flow is 0, 0, 0.
    """
    steps = np.rint(np.where(valid[..., None], flow.astype(np.float64), 0) * STEPS) + ZERO
    has = valid & ((steps >= 0) & (steps <= 65535)).all(axis=-1)
    return encode_png(np.where(has[..., None], np.dstack((steps, np.ones(has.shape))), 0).astype(np.uint16))


def _ids_png(sample: Sample, bits: int = 8) -> Coded:
    """The ids of objects, 0 for none, in a grey PNG of 8 or 16 bits."""
    kind = np.uint8 if bits == 8 else np.uint16
    return Coded(sample.index, f"ids {bits}.png", lambda: encode_png(sample.channels["instances"].astype(kind)))


FORMAT = FormatSpec(
    about=__doc__,
    holds=("flow", "disparity", "scene flow", "instances", "calibration"),
    read_by=("torchvision", "ptlflow"),
    options=_Options,
    channels=("rgb", "flow", "flow_state", "disparity", "disparity_state"),
    names_credits=False,
    needs=_needs,
    refuses=_refuses,
    writer=writer,
    preparer=preparer,
    verify=verify,
)
