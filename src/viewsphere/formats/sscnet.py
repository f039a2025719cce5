"""SSCNet's data, for semantic scene completion from one depth picture: depth, and the class of each cell before the camera.

    depthbin/<split>/00000000_<scene>_fl000_rm0000_0000.png     depth, 16 bits
    depthbin/<split>/00000000_<scene>_fl000_rm0000_0000.bin     positions of the grid and the camera, and each cell's class

The number is the picture's in the data set, the scene its sequence, or `still`. SUNCG's numbers of floor and room are 0.

Depth is millimetres along z, rotated left by three bits, (d << 3) | (d >> 13); 0 for the background, and 65535 before the
rotation from 65.535 m on. A .bin is little-endian. It has three float32, the corner of the grid in the world, metres; sixteen
float32, the motion (4, 4) from the camera (x right, y down, z ahead) to the world, row by row; then pairs of uint32, a class
and its number of successive cells. The grid has 240 x 144 x 240 cells of 2 cm along the world's y, z and x; y changes fastest.

The world has z up. It is the data set's world if the recipe has `labels: {voxels: {axes: world}}`. Otherwise each picture has a
world of its own in which the camera looks along y: y is ahead, x to the right.

Classes are SUNCG's 36 root classes, as far as SSCNet separates them: ceiling 1, floor 2, wall 3, window 4, chair 6, bed 7, sofa
8, table 9, desk 10, cabinet (bookcase, dresser, ...) 11, television 16, and 36 for all other objects. The ground, roads,
pavement and grass are floor; buildings, scenery and fences are wall; furniture is 11; other background classes are 36. 0 is
empty, or outside the picture. In a room (scenery above, and scenery or ground below), empty cells outside the room are 255.

SSCNet's own code expects pictures of 640 x 480 pixels from a camera with f = 518.8579 and its axis through the centre of pixel
(320, 240): `camera: {K: [[518.8579, 0, 320.5], [0, 518.8579, 240.5], [0, 0, 1]], size: [640, 480]}`. Its writer omits one cell
of a volume of one class; this export writes all. Not stored: colours, objects, surfaces. Not verified: the meaning of the root
classes, except for SSCNet's mapping to 11 classes, which the list above follows. Source: Song et al. 2017, "Semantic Scene
Completion from a Single Depth Image", https://github.com/shurans/sscnet.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np
from numpy.typing import NDArray

from viewsphere.codecs.png_tiff import encode_png
from viewsphere.errors import UserError
from viewsphere.formats import Scope
from viewsphere.formats.shared.reading.class_table import Numbered
from viewsphere.formats.shared.writing import refusals
from viewsphere.formats.shared.writing.export_files import Coded
from viewsphere.formats.shared.writing.pictures import depth_steps
from viewsphere.formats.shared.writing.sequences import scene
from viewsphere.formats.shared.writing.tree import File, Tree, functions
from viewsphere.geometry.rotation import product, transform
from viewsphere.model.annotations.voxels import EMPTY, OUTSIDE, Grid, Voxels
from viewsphere.model.sample import Sample
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset

SIZE, CELL = (240, 144, 240), 0.02
EXPECTED = Intrinsics(width=640, height=480, fx=518.8579, fy=518.8579, cx=320.5, cy=240.5)
OTHER, NO_ROOM = 36, 255
FURNITURE = dict.fromkeys(("cabinet", "bookcase", "bookshelf", "shelf", "dresser", "wardrobe", "cupboard"), 11)
THINGS = FURNITURE | {
    "ceiling": 1,
    "floor": 2,
    "wall": 3,
    "interior": 3,  # for the zoo's rooms, whose walls, floor and ceiling are one object
    "window": 4,
    "chair": 6,
    "bed": 7,
    "sofa": 8,
    "couch": 8,
    "table": 9,
    "desk": 10,
    "tv": 16,
    "television": 16,
}
STUFF = {
    "ground": 2,
    "road": 2,
    "road marking": 2,
    "pavement": 2,
    "grass": 2,
    "scenery": 3,
    "building": 3,
    "fence": 3,
    "wall": 3,
    "floor": 2,
    "ceiling": 1,
    "window": 4,
    "furniture": 11,
    **dict.fromkeys(
        ("vegetation", "pole", "traffic sign", "street furniture", "vehicle", "person", "door", "household item"), OTHER
    ),
}


def _refuses(scope: Scope) -> Iterator[str]:
    """Reasons to refuse: distorted lenses, and LiDARs, which have no picture."""
    yield from refusals.known_cameras(scope)
    yield from refusals.pinhole(scope)
    yield from refusals.no_skew(scope)
    for sensor in scope.rig.sensors if scope.rig else ():
        if sensor.lidar is not None:
            yield f"expected cameras; found the LiDAR {sensor.name}"


class Sscnet(Tree):
    """The tree of a data set."""

    def __init__(self, dataset: Dataset) -> None:
        super().__init__(dataset)
        self._classes = Numbered.from_classes(dataset.classes, STUFF, THINGS, OTHER, counted=False).table

    def sample_files(self, sample: Sample) -> Iterator[File]:
        """The depth and the cells of a picture."""
        options = Voxels.model_validate(sample.options.get("voxels", {}))
        if (options.size, options.cell) != (SIZE, CELL):
            found = f"{' x '.join(map(str, options.size))} of {options.cell:g} m"
            raise UserError(f"sscnet: expected voxels of {' x '.join(map(str, SIZE))} cells of {CELL} m; found {found}")
        where = scene(sample) if sample.sequence else "still"
        name = f"depthbin/{sample.split or 'all'}/{sample.index:08d}_{where}_fl000_rm0000_0000"
        yield File(f"{name}.png", Coded(sample.index, "sscnet.png", partial(_depth, sample)))
        cells = partial(_cells, sample, Grid.for_camera(options, sample.camera), self._classes)
        yield File(f"{name}.bin", Coded(sample.index, "sscnet.bin", cells))

    def notes(self) -> Iterator[str]:
        """A note that SSCNet's own code expects another camera."""
        shot = next(iter(self.dataset.shots_of_parts), None)
        lens = shot and shot.rig.sensors[0].intrinsics
        if lens and lens != EXPECTED:
            found = f"{lens.width} x {lens.height} and {lens.fx:.6g}"
            yield f"sscnet: its own code takes 640 x 480 pixels of a focal length of 518.8579; these have {found}"


def _depth(sample: Sample) -> bytes:
    steps = depth_steps(sample, 0.001)
    return encode_png((steps << np.uint16(3)) | (steps >> np.uint16(13)))


def _cells(sample: Sample, grid: Grid, classes: NDArray[np.uint8]) -> bytes:
    """A .bin: the corner, the camera, and runs of classes."""
    runs = sample.channels["voxels"]
    labels = np.where((runs["filled"] == EMPTY) | (runs["state"] == OUTSIDE), 0, classes[runs["class"]])
    if runs["indoors"].any():
        labels[(labels == 0) & (runs["indoors"] == 0)] = NO_ROOM
    ordered = np.repeat(labels.astype(np.uint8), runs["length"]).reshape(grid.size).ravel(order="F")
    first = np.concatenate(([0], np.flatnonzero(np.diff(ordered)) + 1))
    pairs = np.column_stack((ordered[first], np.diff(first, append=len(ordered))))
    corner, pose = _places(grid, sample.camera)
    return corner.astype("<f4").tobytes() + pose.astype("<f4").tobytes() + pairs.astype("<u4").tobytes()


def _places(grid: Grid, camera: Camera) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The grid's corner (3,), and the motion (4, 4) from the camera, in the world whose y is the grid's first axis."""
    ahead, up, right, corner = grid.world_from_grid[:3].T
    turn, pose = np.stack((right, ahead, up)), np.eye(4)
    pose[:3, :3], pose[:3, 3] = product(turn, np.ascontiguousarray(camera.R.T)), transform(turn, camera.center)
    return transform(turn, corner), pose


preparer, writer, verify = functions(Sscnet)


FORMAT = FormatSpec(
    about=__doc__,
    holds=("depth", "voxels", "cameras"),
    read_by=("code for SSCNet's data",),
    channels=("depth", "voxels"),
    names_credits=False,
    refuses=_refuses,
    writer=writer,
    preparer=preparer,
    verify=verify,
)
