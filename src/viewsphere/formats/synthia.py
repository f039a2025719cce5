"""SYNTHIA's trees: `seqs` of its video sequences, with depth, classes, objects and cameras, or `rand` of its random pictures,
with classes.

    SYNTHIA-SEQS-<sequence>/RGB/Stereo_Left/Omni_F/000000.png           layout `seqs`: pictures; Stereo_Right is the right one
    SYNTHIA-SEQS-<sequence>/Depth/Stereo_Left/Omni_F/000000.png         cm along z, 16 bits, the same in three channels
    SYNTHIA-SEQS-<sequence>/GT/LABELS/Stereo_Left/Omni_F/000000.png     16 bits: red class, green object, blue 0
    SYNTHIA-SEQS-<sequence>/GT/COLOR/Stereo_Left/Omni_F/000000.png      colours of classes
    SYNTHIA-SEQS-<sequence>/CameraParams/Stereo_Left/Omni_F/000000.txt  16 numbers
    SYNTHIA-SEQS-<sequence>/CameraParams/intrinsics.txt                 focal length, ppx, ppy, baseline on lines 1, 3, 5, 7

    RGB/0000000.png                                                     layout `rand`: pictures
    GT/0000000.png, GTTXT/0000000.txt                                   colours of classes, and their numbers
    ALL.txt                                                             the names of all pictures, one a line
    label_colors.txt                                                    red, green, blue and name of every class, by its number

datumaro reads `rand`. If all sensors of a rig are called left or right and one of f, b, l, r (left_f, right_b, ...), they have
the folders Omni_F, Omni_B, Omni_L and Omni_R. Of other rigs, the export writes a camera or a rectified pair to Omni_F.

Classes are SYNTHIA's: Sky, Building, Road, Sidewalk, Fence, Vegetation (also grass), Pole, Sign, Lanemarking, and the
categories Car, Pedestrian (also person), Bicycle (Cyclist in `rand`) and TrafficLight. Ground, scenery and street furniture are
Void, 0. Other categories count from 16 (from 14 in `rand`) and have colours of their own. Objects have their ids, constant over
a sequence; 0 is none. Depth is 65535 for the background and beyond 655.34 m.

The 16 numbers transform the camera to the world, column by column, so the last four are its position. Both are left-handed: x
right, y up, z ahead of the camera; the world swaps viewsphere's y and z. Lengths are metres. The origin of the principal point
is the picture's corner. One focal length holds for x and y and for a whole sequence.

Not stored: boxes, poses of objects, names of splits, flow (SYNTHIA has none), and, in `rand`, everything but classes. Not
verified with the original files: the order, direction and axes of the 16 numbers (public readers disagree; most read them so),
the depth of the background, and the origin of pixels. Source: Ros et al. 2016, "The SYNTHIA Dataset",
http://synthia-dataset.net.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.codecs.png_tiff import encode_png
from viewsphere.errors import UserError
from viewsphere.formats import Scope
from viewsphere.formats.shared.reading.class_table import Numbered
from viewsphere.formats.shared.writing import refusals
from viewsphere.formats.shared.writing.export_files import Coded
from viewsphere.formats.shared.writing.pictures import depth_steps, picture
from viewsphere.formats.shared.writing.sequences import Eyes, scene, two_eyes
from viewsphere.formats.shared.writing.tree import LINES, File, Layout, Piece, Tree, functions
from viewsphere.geometry.rotation import transform
from viewsphere.model.annotations.classes import Color, SemanticClass
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.sample import Sample
from viewsphere.model.sensors.camera import Camera
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset

FAR = 65535
MOST = 200

COLORS: dict[str, Color] = {
    "Void": (0, 0, 0),
    "Sky": (128, 128, 128),
    "Building": (128, 0, 0),
    "Road": (128, 64, 128),
    "Sidewalk": (0, 0, 192),
    "Fence": (64, 64, 128),
    "Vegetation": (128, 128, 0),
    "Pole": (192, 192, 128),
    "Car": (64, 0, 128),
    "Sign": (192, 128, 128),
    "Pedestrian": (64, 64, 0),
    "Bicycle": (0, 128, 192),
    "Lanemarking": (0, 175, 0),
}
"""Classes 0 to 12."""

LIGHT: Color = (0, 128, 128)
LIGHTS = {"seqs": 15, "rand": 13}
STUFF = {
    "sky": 1,
    "building": 2,
    "road": 3,
    "pavement": 4,
    "fence": 5,
    "vegetation": 6,
    "grass": 6,
    "pole": 7,
    "traffic sign": 9,
    "road marking": 12,
    "vehicle": 8,
    "person": 10,
    **dict.fromkeys(("wall", "door", "window"), 2),
}
THINGS = {
    "building": 2,
    "fence": 5,
    "tree": 6,
    "pole": 7,
    "car": 8,
    "sign": 9,
    "trafficsign": 9,
    "roadsign": 9,
    "pedestrian": 10,
    "person": 10,
    "bicycle": 11,
    "cyclist": 11,
}
NAMED = re.compile(r"(left|right)[_.-]?([fblr])", re.IGNORECASE)
SWAPPED = np.array([[1.0, 0, 0], [0, 0, 1], [0, 1, 0]])
UPWARD = np.diag([1.0, -1, 1])


class _Options(Frozen):
    """The choice of SYNTHIA's trees."""

    layout: Literal["seqs", "rand"] = Field(
        default="rand", description="`seqs`: sequences, with depth, objects and cameras; `rand`: pictures, with classes"
    )


def _needs(options: _Options) -> tuple[str, ...]:
    """Return the additional channels of sequences."""
    return ("depth", "instances") if options.layout == "seqs" else ()


def _refuses(scope: Scope, options: _Options) -> Iterator[str]:
    """Reasons to refuse: for sequences, still pictures and unsupported rigs and lenses; always, names with spaces and more
    categories than numbers.
    """
    yield from refusals.most_categories(scope, MOST)
    yield from refusals.plain_names(scope)
    if options.layout == "seqs":
        yield from refusals.sequences(scope)
        sensors = scope.rig.sensors if scope.rig else ()
        if not all(NAMED.fullmatch(sensor.name) for sensor in sensors):
            yield from two_eyes(scope)
        yield from refusals.pinhole(scope)
        yield from refusals.no_skew(scope)
        yield from refusals.most_objects(scope, FAR)
        lenses = {sensor.intrinsics: sensor.name for sensor in sensors if sensor.lidar is None}
        if len(lenses) > 1 or any(lens.fx != lens.fy for lens in lenses):
            yield f"expected cameras of one lens and one focal length; found {', '.join(lenses.values())}"


class Synthia(Tree):
    """The tree of a layout."""

    def __init__(self, dataset: Dataset, options: _Options) -> None:
        super().__init__(dataset)
        self._rand = options.layout == "rand"
        light = LIGHTS[options.layout]
        things = {**THINGS, "trafficlight": light}
        self._numbered = Numbered.from_classes(dataset.classes, STUFF, things, light + 1)
        self._names, self._colors = _named(self._numbered, dataset.classes, light)
        self._eyes = None if self._rand else Eyes(dataset)

    def sample_files(self, sample: Sample) -> Iterator[File | Piece]:
        """A picture, and its labels."""
        classes = self._numbered.table
        color = Coded(sample.index, f"synthia {self._rand}.png", lambda: encode_png(self._colors[_ids(sample, classes)]))
        if self._rand:
            name = f"{sample.index:07d}"
            yield File(f"RGB/{name}.png", picture(sample, ".png"))
            yield File(f"GT/{name}.png", color)
            yield File(f"GTTXT/{name}.txt", Coded(sample.index, "synthia.txt", partial(_table, sample, classes)))
            yield Piece("ALL.txt", f"{name}.png\n".encode())
            return
        assert self._eyes is not None
        root, camera = f"SYNTHIA-SEQS-{scene(sample)}", self._camera(sample)
        for kind, content in (
            ("RGB", picture(sample, ".png")),
            ("Depth", Coded(sample.index, "synthia depth.png", partial(_depth, sample))),
            ("GT/LABELS", Coded(sample.index, "synthia labels.png", partial(_labels, sample, classes))),
            ("GT/COLOR", color),
        ):
            yield File(f"{root}/{kind}/{camera}/{sample.instant:06d}.png", content)
        yield File(f"{root}/CameraParams/{camera}/{sample.instant:06d}.txt", _extrinsics(sample.camera))
        lens = sample.camera.intrinsics
        told = "\n\n".join(f"{value!r}" for value in (lens.fx, lens.cx, lens.cy, self._eyes.pair(sample).baseline))
        yield Piece(f"{root}/CameraParams/intrinsics.txt", b"", f"{told}\n")

    def layout(self, path: str, counts: Mapping[str, int]) -> Layout:
        """The lens of a sequence, which is the name of a section; otherwise lines."""
        if not path.endswith("intrinsics.txt"):
            return LINES
        if len(counts) > 1:
            raise UserError(f"synthia: expected one lens in each sequence; found {len(counts)} in {path.partition('/')[0]}")
        return (next(iter(counts)).encode(),)

    def rest(self) -> Iterator[File]:
        """The classes."""
        if self._rand:
            rows = (f"{r} {g} {b} {name}\n" for name, (r, g, b) in zip(self._names, self._colors.tolist(), strict=True))
            yield File("label_colors.txt", "".join(rows).encode())

    def _camera(self, sample: Sample) -> str:
        named = NAMED.fullmatch(sample.sensor)
        if named:
            return f"Stereo_{named[1].capitalize()}/Omni_{named[2].upper()}"
        assert self._eyes is not None
        return f"Stereo_{self._eyes.side(sample).capitalize()}/Omni_F"


def _named(numbered: Numbered, classes: tuple[SemanticClass, ...], light: int) -> tuple[list[str], NDArray[np.uint8]]:
    """Names and colours (N, 3) of all numbers; categories that SYNTHIA lacks get colours that it does not use."""
    known = {i: named for i, named in enumerate(COLORS.items())} | {light: ("TrafficLight", LIGHT)}
    own = {one.name: one.color for one in classes if one.is_thing}
    for number, name in numbered.own.items():
        r, g, b = own[name]
        known[number] = (name, (r | 1, g | 1, b | 1))
    found = [known.get(i, (f"Reserved{i}", (0, 0, 0))) for i in range(max(known) + 1)]
    return [name for name, _ in found], np.array([color for _, color in found], np.uint8)


def _extrinsics(camera: Camera) -> bytes:
    """The motion from a camera to the world, both left-handed with y up, as 16 numbers, column by column."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = SWAPPED @ camera.R.T @ UPWARD, transform(SWAPPED, camera.center)
    return (" ".join(map(repr, (matrix.T + 0.0).ravel().tolist())) + "\n").encode()


def _ids(sample: Sample, classes: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return classes[sample.channels["semantic"]]


def _labels(sample: Sample, classes: NDArray[np.uint8]) -> bytes:
    ids = sample.channels["instances"]
    return encode_png(np.dstack((_ids(sample, classes), ids, np.zeros_like(ids))).astype(np.uint16))


def _depth(sample: Sample) -> bytes:
    return encode_png(np.dstack([depth_steps(sample, 0.01, FAR, FAR)] * 3))


def _table(sample: Sample, classes: NDArray[np.uint8]) -> bytes:
    return "".join(" ".join(map(str, row)) + "\n" for row in _ids(sample, classes).tolist()).encode()


preparer, writer, verify = functions(Synthia)


FORMAT = FormatSpec(
    about=__doc__,
    holds=("segmentation", "instances", "depth", "cameras", "stereo"),
    read_by=("datumaro (rand)", "OpenCV", "numpy"),
    options=_Options,
    channels=("rgb", "semantic"),
    names_credits=False,
    needs=_needs,
    refuses=_refuses,
    writer=writer,
    preparer=preparer,
    verify=verify,
)
