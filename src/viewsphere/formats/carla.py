"""Files of CARLA's cameras: pictures, depth in 24 bits, semantic tags, instances, cameras and boxes in CARLA's terms.

    <sequence>/<sensor>/rgb/000000.png                      pictures, by the number of the instant
    <sequence>/<sensor>/depth/000000.png                    metres along z: (R + 256 G + 65536 B) / (256^3 - 1) * 1000
    <sequence>/<sensor>/semantic_segmentation/000000.png    red is the tag, green and blue are 0
    <sequence>/<sensor>/instance_segmentation/000000.png    red is the tag, G + 256 B the object's id
    <sequence>/<sensor>/bounding_boxes/000000.json          every object: id, type, tag, transform, extent
    <sequence>/<sensor>/transforms.json                     every frame: frame, timestamp, transform, fov, image size

Still pictures are `<split>/<sensor>/rgb/00000000.png`, by number, in numbered folders for large data sets. CARLA defines no
data set format. Folders have the names of its sensor blueprints (sensor.camera.depth). The two kinds of JSON are viewsphere's
own and use the names of CARLA's Python classes.

Tags follow CARLA 0.9.14. Background classes map as follows: sky Sky, ground Ground, road Roads, road marking RoadLine, pavement
SideWalks, grass Terrain, vegetation Vegetation, building Building, fence Fence, pole Pole, traffic sign TrafficSign, street
furniture Static, vehicle Car, person Pedestrian, wall Wall; scenery and indoor surfaces Other. A category with a tag's name has
that tag (person is Pedestrian); all other categories are Dynamic. Depth is 1000 m for the background and beyond 1000 m.

The world is Unreal's, left-handed, in metres: x ahead, y right, z up, which is viewsphere's (x, -y, z). A transform is a
location and a rotation (pitch, yaw, roll in degrees), as in `carla.Transform`. Cameras and objects look along x. An object's
location is the centre of its box, and `extent` is half its length (x), width (y) and height (z). `fov` is the horizontal angle
in degrees: f = width / (2 tan(fov / 2)). The principal point is (width / 2, height / 2) from the picture's corner.

Not stored: LiDAR, the split of a sequence, and flow, whose scale and direction in CARLA are not verified. Not verified with
CARLA itself: planar depth. Source: Dosovitskiy et al. 2017, "CARLA: An Open Urban Driving Simulator",
https://carla.readthedocs.io/en/latest/ref_sensors/.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.codecs.png_tiff import encode_png
from viewsphere.formats import Scope
from viewsphere.formats.shared.reading.class_table import Numbered
from viewsphere.formats.shared.writing import refusals
from viewsphere.formats.shared.writing.export_files import Coded
from viewsphere.formats.shared.writing.paper import json_bytes
from viewsphere.formats.shared.writing.pictures import picture
from viewsphere.formats.shared.writing.sequences import scene
from viewsphere.formats.shared.writing.tree import File, Piece, Tree, functions, item
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.model.sensors.camera import Camera
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset

FAR = 1000.0
STEPS = 256**3 - 1
MOST = 65535
LEVEL = 1e-9
"""Tolerance within which an axis counts as pointing straight up or down."""

TAGS = (
    "Unlabeled", "Roads", "SideWalks", "Building", "Wall", "Fence", "Pole", "TrafficLight", "TrafficSign", "Vegetation",
    "Terrain", "Sky", "Pedestrian", "Rider", "Car", "Truck", "Bus", "Train", "Motorcycle", "Bicycle", "Static", "Dynamic",
    "Other", "Water", "RoadLine", "Ground", "Bridge", "RailTrack", "GuardRail",
)  # fmt: skip
THINGS = {name.casefold(): number for number, name in enumerate(TAGS) if number} | {"person": 12, "tree": 9, "roadsign": 8}
DYNAMIC = TAGS.index("Dynamic")
STUFF = {
    "sky": "Sky",
    "ground": "Ground",
    "scenery": "Other",
    "road": "Roads",
    "road marking": "RoadLine",
    "pavement": "SideWalks",
    "grass": "Terrain",
    "vegetation": "Vegetation",
    "building": "Building",
    "fence": "Fence",
    "pole": "Pole",
    "traffic sign": "TrafficSign",
    "street furniture": "Static",
    "vehicle": "Car",
    "person": "Pedestrian",
    "wall": "Wall",
    **dict.fromkeys(("floor", "ceiling", "door", "window", "furniture", "household item"), "Other"),
}


def _refuses(scope: Scope) -> Iterator[str]:
    """Reasons to refuse: unknown cameras, lenses that need more than an angle of view, and more objects than ids."""
    yield from refusals.known_cameras(scope)
    yield from refusals.pinhole(scope)
    yield from refusals.centred(scope)
    yield from refusals.most_objects(scope, MOST)


class Carla(Tree):
    """The tree of all sensors."""

    def __init__(self, dataset: Dataset) -> None:
        super().__init__(dataset)
        stuff = {name: TAGS.index(tag) for name, tag in STUFF.items()}
        self._tags = Numbered.from_classes(dataset.classes, stuff, THINGS, DYNAMIC, counted=False).table
        self._thing = {one.name: int(self._tags[one.id]) for one in dataset.classes if one.is_thing}

    def sample_files(self, sample: Sample) -> Iterator[File | Piece]:
        """A picture, its maps, its objects, and its camera."""
        split, _, number = self.stem(sample).partition("/")
        if sample.sequence:
            split, number = scene(sample), f"{sample.instant:06d}"
        root = f"{split}/{sample.sensor}"
        yield File(f"{root}/rgb/{number}.png", picture(sample, ".png"))
        for kind, make in (
            ("depth", partial(_depth, sample)),
            ("semantic_segmentation", partial(_tagged, sample, self._tags, ids=False)),
            ("instance_segmentation", partial(_tagged, sample, self._tags, ids=True)),
        ):
            yield File(f"{root}/{kind}/{number}.png", Coded(sample.index, f"carla {kind}.png", make))
        boxes = [self._box(o) for o in sample.objects if o.is_boxed]
        yield File(f"{root}/bounding_boxes/{number}.json", json_bytes(boxes) + b"\n")
        told = {"frame": sample.instant if sample.sequence else sample.index, "timestamp": sample.time}
        yield item(f"{root}/transforms.json", told | _camera(sample.camera))

    def _box(self, o: ObjectAnnotation) -> dict[str, Any]:
        right, ahead, up = -o.world_from_object[:3, 0], -o.world_from_object[:3, 1], o.world_from_object[:3, 2]
        width, height, length = o.size
        return {
            "id": o.id,
            "type_id": o.category,
            "semantic_tag": self._thing[o.category],
            "transform": transform(o.box3d.mean(axis=0), ahead, right, up),
            "extent": {"x": length / 2, "y": width / 2, "z": height / 2},
        }


def _camera(camera: Camera) -> dict[str, Any]:
    """Return the pose of a camera, and its image size and angle of view."""
    right, down, ahead = camera.R
    return {
        "transform": transform(camera.center, ahead, right, -down),
        "fov": math.degrees(2 * math.atan(camera.width / (2 * camera.intrinsics.fx))),
        "image_size_x": camera.width,
        "image_size_y": camera.height,
    }


Float = NDArray[np.float64]


def transform(place: Float, ahead: Float, right: Float, up: Float) -> dict[str, dict[str, float]]:
    """A position and axes of viewsphere's world as CARLA's location and rotation. Roll is 0 for axes that look straight up or
    down.
    """
    x, y, z = place.tolist()
    level = math.hypot(ahead[0], ahead[1])
    yaw, roll = math.atan2(-ahead[1], ahead[0]), math.atan2(-right[2], up[2])
    if level < LEVEL:
        yaw, roll = math.atan2(-right[0], -right[1]), 0.0
    turns = (math.atan2(ahead[2], level), yaw, roll)
    return {
        "location": {"x": x, "y": -y + 0.0, "z": z},
        "rotation": dict(zip(("pitch", "yaw", "roll"), (math.degrees(turn) + 0.0 for turn in turns), strict=True)),
    }


def _depth(sample: Sample) -> bytes:
    depth = sample.channels["depth"].astype(np.float64)
    steps = np.rint(np.minimum(depth, FAR) / FAR * STEPS).astype(np.int64)
    return encode_png(np.dstack([steps >> shift & 255 for shift in (0, 8, 16)]).astype(np.uint8))


def _tagged(sample: Sample, tags: NDArray[np.uint8], *, ids: bool) -> bytes:
    """Tags in red and, on request, object ids in green (the low byte) and blue."""
    number = sample.channels["instances"].astype(np.int64) * ids
    return encode_png(np.dstack((tags[sample.channels["semantic"]], number & 255, number >> 8)).astype(np.uint8))


preparer, writer, verify = functions(Carla)


FORMAT = FormatSpec(
    about=__doc__,
    holds=("depth", "segmentation", "instances", "cameras", "3D boxes"),
    read_by=("OpenCV", "code for CARLA's sensors"),
    channels=("rgb", "depth", "semantic", "instances"),
    names_credits=False,
    refuses=_refuses,
    writer=writer,
    preparer=preparer,
    verify=verify,
)
