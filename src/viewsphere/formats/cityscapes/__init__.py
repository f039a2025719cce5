"""Cityscapes, for torchvision, cityscapesScripts and many trainers of semantic segmentation of streets.

    leftImg8bit/<split>/<city>/<city>_<sequence>_<frame>_leftImg8bit.png
    rightImg8bit/<split>/<city>/<city>_<sequence>_<frame>_rightImg8bit.png   the right picture of a rectified pair
    gtFine/<split>/<city>/<city>_<sequence>_<frame>_gtFine_labelIds.png      8 bits: the label's id
    ..._gtFine_instanceIds.png                                               16 bits: 1000 id + n, or the id
    ..._gtFine_color.png, ..._gtFine_polygons.json                           RGBA; labels and polygons
    camera/<split>/<city>/<city>_<sequence>_<frame>_camera.json              intrinsic and extrinsic
    disparity/<split>/<city>/<city>_<sequence>_<frame>_disparity.png         with `stereo`: 16 bits

Each sequence is a city. `-` replaces `_` in its name, because `_` separates the parts of a file name. The sequence number is
its number in the plan, and frames are instants. Still pictures belong to the city `stills`, one sequence each; large data sets
have `stills0000`, `stills0001`, ... Only left pictures, or those of the only camera, have labels, as in the original.
torchvision reads splits named train, val and test.

Labels follow the names of classes and categories. Cityscapes' own names match in any spelling. Other names map as follows: road
marking is road, pavement sidewalk, grass terrain; tree, hedge and shrub vegetation; house building; lamp post pole; road sign
traffic sign; pedestrian person; cyclist rider; van and taxi car; lorry truck; tram train; motorbike motorcycle; bike bicycle.
Ground without a road is `ground`; scenery, street furniture, benches, post boxes and bins are `static`; other things are
`dynamic`. Evaluations ignore these three. No pixel is `unlabeled`. For the labels person to bicycle, n counts the instances of
a label in the picture from 0; other pixels have the id alone.

polygons.json: cityscapesScripts draws the polygons in order and obtains labelIds.png. Vertices are pixel columns and rows, and
outlines belong to the polygon. An instance is one polygon; lines that later polygons cover join its pieces. If such a line
crosses another instance in several pieces, redrawn maps have wrong pixels there. Other labels have one polygon for each piece.

disparity: pixels = (p - 1) / 256; 0 means unknown, or 256 and more. It is dense, also at points hidden from the right camera;
the sky has 0 pixels. camera.json: u0 and v0 count from the centre of the first pixel. viewsphere has no vehicle, so the export
puts one on world z = 0 below each camera, heading where the camera looks: x, y and yaw are 0, z is the height (metres). Pitch
and roll (radians) rotate the camera's axes (x ahead, y left, z up) into the vehicle's as Ry(pitch) Rx(roll). A single camera
has `baseline` 0.

Not stored: poses in the world, 3D boxes, times, labels of right pictures. Not verified with the originals: the nesting of
camera.json, and how their tools handle other cities. Source: M. Cordts et al., The Cityscapes Dataset, CVPR 2016;
https://github.com/mcordts/cityscapesScripts, docs/csCalibration.pdf there.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.codecs.png_tiff import encode_png
from viewsphere.formats import Scope
from viewsphere.formats.cityscapes.classes import COLORS, LABELS, label_of
from viewsphere.formats.cityscapes.instances import EACH, Region, regions
from viewsphere.formats.shared.writing import refusals
from viewsphere.formats.shared.writing.export_files import Coded
from viewsphere.formats.shared.writing.paper import json_bytes
from viewsphere.formats.shared.writing.pictures import picture, png
from viewsphere.formats.shared.writing.sequences import Eyes, two_eyes
from viewsphere.formats.shared.writing.timeline import Timeline
from viewsphere.formats.shared.writing.tree import FOLDER_SIZE, File, Tree, functions
from viewsphere.model.annotations.classes import SemanticClass
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.sample import Sample
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset

TYPES = 4
"""Largest number of files of a frame in one folder."""


class _Options(Frozen):
    """The option of disparity."""

    stereo: bool = Field(default=False, description="disparity of the left pictures, too; of a rig of two rectified cameras")


def _needs(options: _Options) -> tuple[str, ...]:
    """Disparity on request."""
    return ("disparity",) if options.stereo else ()


def _refuses(scope: Scope, options: _Options) -> Iterator[str]:
    """Reasons to refuse: rigs of several cameras other than a pair, lenses that camera.json cannot express, and more instances
    than ids.
    """
    yield from two_eyes(scope)
    yield from refusals.stereo(scope) if options.stereo else ()
    yield from refusals.known_cameras(scope)
    yield from refusals.pinhole(scope)
    yield from refusals.no_skew(scope)
    yield from refusals.most_objects(scope, EACH)


class _Cityscapes(Tree):
    """The tree of cities."""

    def __init__(self, dataset: Dataset, options: _Options) -> None:
        super().__init__(dataset)
        self._options, self._eyes, self._timeline = options, Eyes(dataset), Timeline(dataset)
        self._labels = _labels_of(dataset.classes)

    def sample_files(self, sample: Sample) -> Iterator[File]:
        """A picture and, for a left one, its camera and labels."""
        side, name = self._eyes.side(sample), self._name(sample)
        yield File(f"{side}Img8bit/{name}_{side}Img8bit.png", picture(sample, ".png"))
        if side == "right":
            return
        camera = _camera(sample, self._eyes.pair(sample).baseline)
        yield File(f"camera/{name}_camera.json", json_bytes(camera))
        if self._options.stereo:
            made = Coded(sample.index, "cityscapes disparity.png", lambda: _disparity(sample))
            yield File(f"disparity/{name}_disparity.png", made)
        labels = self._labels[sample.channels["semantic"]]
        drawn = regions(labels, sample.channels["instances"])
        numbers = labels.astype(np.uint16)
        for region in drawn:
            numbers[region.mask] = region.number
        colors = np.array([(*color, 255) for color in COLORS.values()], np.uint8)
        yield File(f"gtFine/{name}_gtFine_labelIds.png", png(sample, "cityscapes labels", labels))
        yield File(f"gtFine/{name}_gtFine_instanceIds.png", png(sample, "cityscapes instances", numbers))
        yield File(f"gtFine/{name}_gtFine_color.png", png(sample, "cityscapes colors", colors[labels]))
        yield File(f"gtFine/{name}_gtFine_polygons.json", json_bytes(_polygons(sample, drawn)))

    def _name(self, sample: Sample) -> str:
        """Split, city, and the common start of the names of a frame's files."""
        if sample.sequence:
            city = sample.sequence.replace("_", "-")
            number, frame = self._timeline.course(sample).number, sample.instant
        else:
            folder = self.dataset.plan.folder_of(sample.index, FOLDER_SIZE // TYPES)
            city, number, frame = f"stills{'' if folder is None else f'{folder:04d}'}", sample.index, 0
        return f"{sample.split or 'all'}/{city}/{city}_{number:06d}_{frame:06d}"


def _polygons(sample: Sample, drawn: list[Region]) -> dict[str, Any]:
    objects = [{"label": LABELS[one.label], "polygon": ring.tolist()} for one in drawn for ring in one.rings]
    return {"imgHeight": sample.height, "imgWidth": sample.width, "objects": objects}


def _disparity(sample: Sample) -> bytes:
    """Disparity (pixels) in 16 bits: 256 times the pixels, plus 1."""
    pixels = sample.channels["disparity"].astype(np.float64)
    steps = np.rint(np.where(np.isfinite(pixels), pixels, -1) * 256) + 1
    return encode_png(np.where((steps >= 1) & (steps <= 65535), steps, 0).astype(np.uint16))


def _camera(sample: Sample, baseline: float) -> dict[str, dict[str, float]]:
    lens, (right, down, ahead) = sample.camera.intrinsics, sample.camera.R.tolist()
    pitch = math.atan2(-ahead[2], math.hypot(ahead[0], ahead[1]))
    roll = math.atan2(-right[2], -down[2])
    extrinsic = {"baseline": baseline, "pitch": pitch, "roll": roll, "x": 0.0, "y": 0.0, "yaw": 0.0}
    return {
        "extrinsic": {**extrinsic, "z": float(sample.camera.center[2])},
        "intrinsic": {"fx": lens.fx, "fy": lens.fy, "u0": lens.cx - 0.5, "v0": lens.cy - 0.5},
    }


preparer, writer, verify = functions(_Cityscapes)


def _labels_of(classes: Sequence[SemanticClass]) -> NDArray[np.uint8]:
    """Labels (N,) by the classes' ids; 0 (unlabeled) for numbers without a class."""
    table = np.zeros(1 + max(one.id for one in classes), np.uint8)
    for one in classes:
        table[one.id] = label_of(one)
    return table


FORMAT = FormatSpec(
    about=__doc__,
    holds=("semantic masks", "instance masks", "polygons", "stereo pairs", "disparity", "calibration"),
    read_by=("torchvision", "cityscapesScripts"),
    options=_Options,
    channels=("rgb", "instances", "semantic"),
    names_credits=False,
    needs=_needs,
    refuses=_refuses,
    writer=writer,
    preparer=preparer,
    verify=verify,
)
