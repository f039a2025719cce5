"""VIPER, the data set of Playing for Benchmarks: videos with classes, objects, flow and cameras; ptlflow reads its flow.

    classes.csv                               id, classname, red, green, blue, class_eval, trainid, instance_eval
    <split>/img/001/001_00001.png             the pictures, by the sequence's number and the frame's, both from 1
    <split>/cls/001/001_00001.png             8 bits, grey: the class
    <split>/inst/001/001_00001.png            red is the class, 256 G + B the object's id
    <split>/flow/001/001_00001.npz            u and v, 16-bit floats, to the next frame; none for the last frame
    <split>/camera/001.csv                    frame, projection (16 numbers), view (16 numbers), row by row

Splits are train, val and test. The second sensor of a rig has a sequence 001-1, and so on. Classes are VIPER's 32. Ground and
grass are terrain, road markings road, pavement sidewalk, poles and street furniture infrastructure, vehicles cars; walls, doors
and windows are buildings; scenery and other indoor surfaces are unlabeled (0). Categories with a class name have that class;
others count from 32 and are listed in classes.csv. Objects keep their ids over a sequence; 0 is none.

Flow is pixels, right and down, NaN if unknown; ptlflow ignores flow beyond 512. Its 16 bits are exact to one part in 2048. The
view matrix transforms the camera's axes in the first frame of its sequence to its present axes: x right, y up, z back, metres.
The projection is OpenGL's, with the near plane at 0.1 m and the far plane at 1000 m.

Not stored: depth, which the original has not published; names of conditions (day, rain, ...); and boxes. VIPER has a list of
boxes for each frame, but no source documents the order of the 3D numbers, and its readme and a public reader disagree on the
class column. Not verified with the original files: camera lists without a header, the planes of the projection, frames counted
from 1. Source: Richter, Hayder, Koltun 2017, "Playing for Benchmarks", https://github.com/srrichter/viper.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from functools import partial

import numpy as np
from numpy.typing import NDArray

from viewsphere.codecs.png_tiff import encode_png
from viewsphere.errors import StoreError
from viewsphere.formats import Scope
from viewsphere.formats.shared.reading.class_table import Numbered
from viewsphere.formats.shared.writing import refusals
from viewsphere.formats.shared.writing.export_files import Coded
from viewsphere.formats.shared.writing.pictures import picture
from viewsphere.formats.shared.writing.sequences import check_whole, instants
from viewsphere.formats.shared.writing.timeline import Timeline
from viewsphere.formats.shared.writing.tree import File, Piece, Tree, functions
from viewsphere.geometry.rotation import product, transform
from viewsphere.model.sample import Sample
from viewsphere.model.sensors.camera import Camera
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset

MOST, MOST_OBJECTS = 200, 65535
NEAR, FAR = 0.1, 1000.0

CLASSES = """\
0,unlabeled,0,0,0,0,255,0
1,ambiguous,111,74,0,0,255,0
2,sky,70,130,180,1,0,0
3,road,128,64,128,1,1,0
4,sidewalk,244,35,232,1,2,0
5,railtrack,230,150,140,0,255,0
6,terrain,152,251,152,1,3,0
7,tree,87,182,35,1,4,0
8,vegetation,35,142,35,1,5,0
9,building,70,70,70,1,6,0
10,infrastructure,153,153,153,1,7,0
11,fence,190,153,153,1,8,0
12,billboard,150,20,20,1,9,0
13,trafficlight,250,170,30,1,10,1
14,trafficsign,220,220,0,1,11,0
15,mobilebarrier,180,180,100,1,12,0
16,firehydrant,173,153,153,1,13,1
17,chair,168,153,153,1,14,1
18,trash,81,0,21,1,15,0
19,trashcan,81,0,81,1,16,1
20,person,220,20,60,1,17,1
21,animal,255,0,0,0,255,0
22,bicycle,119,11,32,0,255,0
23,motorcycle,0,0,230,1,18,1
24,car,0,0,142,1,19,1
25,van,0,80,100,1,20,1
26,bus,0,60,100,1,21,1
27,truck,0,0,70,1,22,1
28,trailer,0,0,90,0,255,0
29,train,0,80,100,0,255,0
30,plane,0,100,100,0,255,0
31,boat,50,0,90,0,255,0
"""
HEAD = "id,classname,red,green,blue,class_eval,trainid,instance_eval\n"
THINGS = {line.split(",")[1]: number for number, line in enumerate(CLASSES.splitlines()) if number > 1}
STUFF = {
    "sky": 2,
    "ground": 6,
    "road": 3,
    "road marking": 3,
    "pavement": 4,
    "grass": 6,
    "vegetation": 8,
    "building": 9,
    "fence": 11,
    "pole": 10,
    "traffic sign": 14,
    "street furniture": 10,
    "vehicle": 24,
    "person": 20,
    **dict.fromkeys(("wall", "door", "window"), 9),
}
UPWARD = np.diag([1.0, -1, -1])


def _refuses(scope: Scope) -> Iterator[str]:
    """Reasons to refuse: still pictures, lenses that need more than an angle of view, and more objects or categories than
    numbers.
    """
    yield from refusals.sequences(scope)
    yield from refusals.pinhole(scope)
    yield from refusals.centred(scope)
    yield from refusals.most_objects(scope, MOST_OBJECTS)
    yield from refusals.most_categories(scope, MOST)


class Viper(Tree):
    """The tree of a data set."""

    def __init__(self, dataset: Dataset) -> None:
        super().__init__(dataset)
        check_whole(dataset, "viper")
        self._classes = Numbered.from_classes(dataset.classes, STUFF, THINGS, len(CLASSES.splitlines()))
        self._timeline = Timeline(dataset)

    def sample_files(self, sample: Sample) -> Iterator[File | Piece]:
        """A picture, its maps, its flow, and a line for its camera."""
        course, sensor = self._timeline.course(sample), sample.origin.sensor if sample.origin else 0
        sequence = f"{course.number + 1:03d}{f'-{sensor}' if sensor else ''}"
        root, frame = sample.split or "train", sample.instant + 1
        name = f"{sequence}/{sequence}_{frame:05d}"
        yield File(f"{root}/img/{name}.png", picture(sample, ".png"))
        for kind, make in (("cls", _classes), ("inst", _instances)):
            coded = Coded(sample.index, f"viper {kind}.png", partial(make, sample, self._classes.table))
            yield File(f"{root}/{kind}/{name}.png", coded)
        if sample.instant < instants(self.dataset, sample) - 1:
            yield File(f"{root}/flow/{name}.npz", Coded(sample.index, "viper.npz", partial(_flow, sample)))
        first = next(self._timeline.shots(course), None)
        if first is None:
            raise StoreError(f"frame {sample.index}: expected the first shot of {sample.sequence}, found none")
        values = (*_projection(sample.camera).ravel(), *_view(first.camera(0, sensor), sample.camera).ravel())
        row = ",".join(str(value + 0.0) for value in map(float, values))
        yield Piece(f"{root}/camera/{sequence}.csv", f"{frame},{row}\n".encode())

    def rest(self) -> Iterator[File]:
        """VIPER's classes, and the data set's further classes."""
        text, colors = io.StringIO(newline=""), {one.name: one.color for one in self.dataset.classes if one.is_thing}
        rows = csv.writer(text, lineterminator="\n")
        for number, name in self._classes.own.items():
            rows.writerow([number, name, *colors[name], 0, 255, 0])
        yield File("classes.csv", (HEAD + CLASSES + text.getvalue()).encode())


def _classes(sample: Sample, table: NDArray[np.uint8]) -> bytes:
    return encode_png(table[sample.channels["semantic"]])


def _instances(sample: Sample, table: NDArray[np.uint8]) -> bytes:
    ids = sample.channels["instances"]
    return encode_png(np.dstack((table[sample.channels["semantic"]], ids >> 8, ids & 255)).astype(np.uint8))


def _flow(sample: Sample) -> bytes:
    """An archive of u and v, (H, W) float16."""
    flow = np.clip(sample.channels["flow"], -65504, 65504).astype(np.float16)
    file = io.BytesIO()
    np.savez(file, u=flow[..., 0], v=flow[..., 1])
    return file.getvalue()


def _projection(camera: Camera) -> NDArray[np.float64]:
    """OpenGL's projection (4, 4)."""
    k, depth = camera.intrinsics, FAR - NEAR
    scale = (2 * k.fx / k.width, 2 * k.fy / k.height)
    rows = [[scale[0], 0, 0, 0], [0, scale[1], 0, 0], [0, 0, -(FAR + NEAR) / depth, -2 * FAR * NEAR / depth], [0, 0, -1, 0]]
    return np.array(rows, np.float64)


def _view(first: Camera, now: Camera) -> NDArray[np.float64]:
    """The motion (4, 4) from one camera's axes to another's, y up, z back."""
    turned = product(now.R, np.ascontiguousarray(first.R.T))
    moved, matrix = now.t - transform(turned, first.t), np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = product(product(UPWARD, turned), UPWARD), transform(UPWARD, moved)
    return matrix


preparer, writer, verify = functions(Viper)


FORMAT = FormatSpec(
    about=__doc__,
    holds=("segmentation", "instances", "flow", "cameras"),
    read_by=("ptlflow",),
    channels=("rgb", "semantic", "instances", "flow"),
    names_credits=False,
    refuses=_refuses,
    writer=writer,
    preparer=preparer,
    verify=verify,
)
