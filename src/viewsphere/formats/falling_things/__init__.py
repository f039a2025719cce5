"""Falling Things (FAT), as torchvision and pose estimators such as DOPE read it; or NDDS, the program behind it.

`fat`:

    FallingThings/mixed/<split>_<k>/                  stills; sequences have <split>_<sequence>_<k>
    FallingThings/single/<model>/<split>_<k>/         pictures of one object
        _camera_settings.json, _object_settings.json
        <number>.left.jpg, .left.depth.png, .left.seg.png, .left.json          and the same with .right

`ndds`:

    <split>_<k>/_camera_settings.json, _object_settings.json
        <number>.png, .depth.mm.16.png, .cs.png, .is.png, .json                with two cameras .left.png, ..., .right.json

k counts thousands of pictures. The number has six digits: the instant in its sequence, or the still picture in the data set (a
pair uses the number of its first picture). A rig is one camera, `left`, or a rectified pair.

Lengths are centimetres. An object's axes are those of a camera that looks out of its front: x to its right, y down, z ahead.
Their origin is the centre of its box. location and quaternion_xyzw (x, y, z, w) transform them to the camera's axes (x right, y
down, z ahead). pose_transform_permuted, A, is transposed and permuted: A^T P is the pose, where P maps (x, y, z) to (z, x, -y).
NDDS calls the same matrix pose_transform. Points of bounding_box are [y, x], points of cuboids [x, y]. The box encloses the
projected model and may extend beyond the picture. Cuboids start at front top right, then front top left, front bottom left,
front bottom right, then the rear in the same order; left and right are the object's own. The pixel origin is the picture's
corner: cx is half the width. Points behind the camera project to [-1, -1]. visibility is the unhidden share of an object's
pixels in the picture. The world, in camera_data, is viewsphere's: z up, right-handed (NDDS has Unreal's).

A class is a model, named by its key in the data set; objects of one model share it. fixed_model_transform (transposed) maps a
model's points in metres, as in the store's files and other formats, to the class's axes. Depth is along z, 16 bits, in steps of
0.1 mm (`ndds`: 1 mm); 65535 is the background and larger depths. seg and cs hold the class number (in `single` 255), 0 for the
background; is holds the object id as R 65536 + G 256 + B.

torchvision assumes that all pairs are 6 cm apart, like FAT's. With another baseline, multiply its disparities by the baseline /
6 cm. Settings hold the lenses of the first shot; where lenses differ, use camera_data's intrinsics (an extra). Not stored:
categories, exact colours (`fat` has JPEG), times. Not verified: NDDS's file names for two cameras. Source: Tremblay, To and
Birchfield, Falling Things: A Synthetic Dataset for 3D Object Detection and Pose Estimation (CVPR Workshops 2018),
https://arxiv.org/abs/1804.06534, and the data set's readme; https://github.com/NVIDIA/Dataset_Synthesizer.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.errors import UserError
from viewsphere.formats import Scope
from viewsphere.formats.shared.writing.paper import json_bytes
from viewsphere.formats.shared.writing.pictures import depth_png, picture, png
from viewsphere.formats.shared.writing.refusals import known_cameras, pinhole
from viewsphere.formats.shared.writing.tree import File, Layout, Piece, Tree, functions
from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.rotation import compose, quaternion_from_matrix, rigid, transform
from viewsphere.model.channel import missing
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.model.sensors.rig import Rig
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset, ModelInfo

_CM = 100.0

_CUBOID = ((-1, -1, 1), (1, -1, 1), (1, -1, -1), (-1, -1, -1), (-1, 1, 1), (1, 1, 1), (1, 1, -1), (-1, 1, -1))
"""The sides of a box's corners in FAT's order."""

_OBJECT_FROM_FAT = np.array([[-1.0, 0, 0], [0, 0, -1], [0, -1, 0]])
"""FAT's x is the object's right, viewsphere's -x; its y is down, viewsphere's -z; its z is ahead, viewsphere's -y."""

_PERMUTED = np.array([[0.0, 0, 1, 0], [1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]])

CHANNELS = ("rgb", "depth", "instances")
FOLDER = 1000
"""Number of pictures in a folder."""

SINGLE = 255
"""The class number of all objects in pictures of a single object."""


class _Options(Frozen):
    """The choice of two namings."""

    naming: Literal["fat", "ndds"] = Field(
        default="fat", description="`fat`: that of Falling Things; `ndds`: that of NVIDIA's Dataset Synthesizer"
    )


def _refuses(scope: Scope, options: _Options) -> Iterator[str]:
    """Reasons to refuse: unknown cameras, lenses other than pinholes, and rigs other than a camera or a pair."""
    yield from known_cameras(scope)
    yield from pinhole(scope)
    if scope.rig is not None and _sides(scope.rig) is None:
        yield f"expected one camera or a rectified pair; found {', '.join(sensor.name for sensor in scope.rig.sensors)}"


def _sides(rig: Rig) -> dict[str, str] | None:
    """Return the left and the right sensor by name; None for a rig of other sensors."""
    names = [sensor.name for sensor in rig.sensors]
    if len(names) == 1:
        return {names[0]: "left"}
    pair = next(iter(rig.rectified), None)
    return None if pair is None or len(names) > 2 else {names[pair.left]: "left", names[pair.right]: "right"}


class FallingThings(Tree):
    """The tree of a naming."""

    def __init__(self, dataset: Dataset, options: _Options) -> None:
        super().__init__(dataset)
        self._is_fat = options.naming == "fat"
        self._classes = {key: number for number, key in enumerate(dataset.plan.models, 1)}
        if len(self._classes) >= SINGLE:
            raise UserError(f"falling_things: expected fewer than {SINGLE} models; found {len(self._classes):,}")
        shot = next(iter(dataset.shots_of_parts), None)
        self._sides = (shot and _sides(shot.rig)) or {}
        lenses = {} if shot is None else {sensor.name: sensor.intrinsics for sensor in shot.rig.sensors}
        self._lenses = [(side, lenses[name]) for name, side in self._sides.items()]

    def sample_files(self, sample: Sample) -> Iterator[File | Piece]:
        """A camera's picture, depth, classes and objects; raises UserError if an imported picture lacks a channel."""
        for name in missing(CHANNELS, sample.channels):
            raise UserError(f"frame {sample.index}: expected channel {name}; found none")
        number = sample.instant if sample.sequence else sample.index - (sample.origin.sensor if sample.origin else 0)
        folder = self._folder(sample, number)
        side = self._sides.get(sample.sensor, "left")
        yield from (Piece(f"{folder}/_{name}_settings.json", b"") for name in ("camera", "object"))
        stem = f"{folder}/{number:06d}" + (f".{side}" if self._is_fat or len(self._sides) > 1 else "")
        classes = png(sample, f"model classes {self._is_single(sample)}", self._class_map(sample))
        if self._is_fat:
            yield File(f"{stem}.jpg", picture(sample, ".jpg"))
            yield File(f"{stem}.depth.png", depth_png(sample, 1e-4, nothing=65535))
            yield File(f"{stem}.seg.png", classes)
        else:
            yield File(f"{stem}.png", picture(sample, ".png"))
            yield File(f"{stem}.depth.mm.16.png", depth_png(sample, 1e-3, nothing=65535))
            yield File(f"{stem}.cs.png", classes)
            ids = sample.channels["instances"]
            yield File(f"{stem}.is.png", png(sample, "ids 24", np.stack([ids >> 16, ids >> 8, ids], -1).astype(np.uint8)))
        yield File(f"{stem}.json", json_bytes(self._frame(sample)))

    def _is_single(self, sample: Sample) -> bool:
        return self._is_fat and self.dataset.plan.most_objects(sample.index) == 1

    def _folder(self, sample: Sample, number: int) -> str:
        parts = (sample.split or "all", *([sample.sequence] if sample.sequence else []), str(number // FOLDER))
        own = "_".join(parts)
        if not self._is_fat:
            return own
        if not self._is_single(sample):
            return f"FallingThings/mixed/{own}"
        return f"FallingThings/single/{_class_of(sample.objects[0]) if sample.objects else 'none'}/{own}"

    def _class_map(self, sample: Sample) -> NDArray[np.uint8]:
        """The number of the class that each pixel shows, (H, W)."""
        table = np.zeros(max((o.id for o in sample.objects), default=0) + 1, np.uint8)
        for o in sample.objects:
            table[o.id] = SINGLE if self._is_single(sample) else self._classes[_class_of(o)]
        ids = sample.channels["instances"]
        return np.where(ids < len(table), table[np.minimum(ids, len(table) - 1)], 0).astype(np.uint8)

    def _frame(self, sample: Sample) -> dict[str, Any]:
        matrix = "pose_transform_permuted" if self._is_fat else "pose_transform"
        boxed = (o for o in sample.objects if o.is_placed and _box_of(o) is not None)
        return {
            "camera_data": _camera_data(sample.camera),
            "objects": [_annotation(o, sample.camera.K, matrix) for o in boxed],
        }

    def layout(self, path: str, counts: Mapping[str, int]) -> Layout:
        """A folder's settings."""
        if path.endswith("_camera_settings.json"):
            return (json_bytes({"camera_settings": [_lens_settings(side, lens) for side, lens in self._lenses]}),)
        only = path.split("/")[2] if path.startswith("FallingThings/single/") else None
        shown = {info.track or info.key: info for info in reversed(self.dataset.models)}
        shown = {name: shown[name] for name in self._classes if name in shown and only in (None, name)}
        objects = [_model_settings(info, name, SINGLE if only else self._classes[name]) for name, info in shown.items()]
        return (json_bytes({"exported_object_classes": list(shown), "exported_objects": objects}),)


preparer, writer, verify = functions(FallingThings)


def _camera_data(camera: Camera) -> dict[str, Any]:
    """Return the pose of the camera in the world, and its lens."""
    k = camera.intrinsics
    return {
        "location_worldframe": (camera.center * _CM).tolist(),
        "quaternion_xyzw_worldframe": _xyzw(camera.R.T),
        "intrinsics": {"fx": k.fx, "fy": k.fy, "cx": k.cx, "cy": k.cy},
    }


def _class_of(o: ObjectAnnotation) -> str:
    """The name of an object's class: its model's key."""
    return o.track or o.key


def _xyzw(rotation: NDArray[np.float64]) -> list[float]:
    w, x, y, z = quaternion_from_matrix(rotation)
    return [x, y, z, w]


def _box_of(o: ObjectAnnotation) -> tuple[float, float, float, float] | None:
    """The box of the projected model, which may extend beyond the picture; None if no part of it is projected."""
    return o.box2d_unclipped or o.box2d_projected


def _annotation(o: ObjectAnnotation, k: NDArray[np.float64], matrix: str) -> dict[str, Any]:
    """The record of an object with a box. `k` is (3, 3); `matrix` is the permuted pose's key."""
    center = o.box3d_object.mean(axis=0)
    pose = compose(o.camera_from_object, rigid(_OBJECT_FROM_FAT, center))
    pose[:3, 3] *= _CM
    middle, corners, box = pose[:3, 3], Box3d(o.box3d_camera).corners_at(_CUBOID) * _CM, _box_of(o)
    assert box is not None
    inside = 1 - o.truncation
    return {
        "class": _class_of(o),
        "instance_id": o.id,
        "visibility": min(o.visibility / inside, 1.0) if inside > 0 else 0.0,
        "location": middle.tolist(),
        "quaternion_xyzw": _xyzw(pose[:3, :3]),
        matrix: compose(pose, _PERMUTED.T).T.tolist(),
        "cuboid_centroid": middle.tolist(),
        "projected_cuboid_centroid": _projected(k, middle[None])[0],
        "bounding_box": {"top_left": [box[1], box[0]], "bottom_right": [box[3], box[2]]},
        "cuboid": corners.tolist(),
        "projected_cuboid": _projected(k, corners),
    }


def _projected(k: NDArray[np.float64], points: NDArray[np.float64]) -> list[list[float]]:
    """Pixels of points (N, 3) in camera axes."""
    return [[x / z, y / z] if z > 0 else [-1.0, -1.0] for x, y, z in transform(k, points).tolist()]


def _lens_settings(name: str, lens: Intrinsics) -> dict[str, Any]:
    """A camera of _camera_settings.json."""
    return {
        "name": name,
        "horizontal_fov": math.degrees(2 * math.atan(lens.width / (2 * lens.fx))),
        "intrinsic_settings": {
            "resX": lens.width, "resY": lens.height, "fx": lens.fx, "fy": lens.fy, "cx": lens.cx, "cy": lens.cy, "s": lens.skew,
        },
        "captured_image_size": {"width": lens.width, "height": lens.height},
    }  # fmt: skip


def _model_settings(info: ModelInfo, name: str, number: int) -> dict[str, Any]:
    """A class of _object_settings.json, and its number."""
    width, height, length = Box3d(info.box3d_object).size
    turn = _OBJECT_FROM_FAT.T * _CM
    fixed = rigid(turn, -transform(turn, info.box3d_object.mean(axis=0)))
    return {
        "class": name,
        "segmentation_class_id": number,
        "fixed_model_transform": fixed.T.tolist(),
        "cuboid_dimensions": [width * _CM, height * _CM, length * _CM],
    }


FORMAT = FormatSpec(
    about=__doc__,
    holds=("object poses", "3D boxes", "boxes", "depth", "class masks", "camera poses"),
    read_by=("torchvision", "DOPE"),
    options=_Options,
    channels=CHANNELS,
    names_credits=False,
    refuses=_refuses,
    writer=writer,
    preparer=preparer,
    verify=verify,
)
