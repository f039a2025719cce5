"""Records of COLMAP's text and binary files. Lists end with their line in text files; binary files store their lengths."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import UserError
from viewsphere.geometry.lenses.shared.programs.colmap import PARAMETERS
from viewsphere.geometry.rotation import quaternion_from_matrix
from viewsphere.model.sensors.camera import Intrinsics

Float = NDArray[np.float64]
Pose = tuple[float, ...]
"""A rotation as quaternion w, x, y, z, then the translation, metres."""

CAMERA = 0
"""The number of the sensor type camera."""


def pose_of(R: Float, t: Float) -> Pose:
    """A motion x' = R x + t."""
    return (*quaternion_from_matrix(R), *t.tolist())


def _lens_of(lens: Intrinsics) -> tuple[str, list[float]]:
    """The name of a lens' model, and its parameters. Raises UserError for a lens without a model."""
    own = lens.lens.colmap
    if lens.skew or own is None:
        found = f"{lens.skew:g}" if lens.skew else lens.lens.name
        raise UserError(f"colmap: expected cameras without skew and with a lens of COLMAP's, found {found}")
    matrix = (lens.fx, lens.fy, lens.cx, lens.cy) if own.has_matrix else ()
    return own.model, [*matrix, *own.parameters]


@dataclass(frozen=True, eq=False)
class Camera:
    """A lens, by its number."""

    COLUMNS: ClassVar[str] = "CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]"
    number: int
    lens: Intrinsics

    def text(self) -> str:
        """The record's line or lines in a text file."""
        model, values = _lens_of(self.lens)
        return _line(self.number, model, self.lens.width, self.lens.height, *values)

    def binary(self) -> bytes:
        """The record's bytes in a binary file."""
        model, values = _lens_of(self.lens)
        head = struct.pack("<IiQQ", self.number, PARAMETERS[model][0], self.lens.width, self.lens.height)
        return head + struct.pack(f"<{len(values)}d", *values)


@dataclass(frozen=True)
class Rig:
    """Cameras by their numbers; all but the first have a pose, sensor_from_rig."""

    COLUMNS: ClassVar[str] = "RIG_ID, NUM_SENSORS, TYPE, ID of the first, then TYPE, ID, HAS_POSE, QW, QX, QY, QZ, TX, TY, TZ"
    number: int
    cameras: Sequence[int]
    poses: Sequence[Pose]

    def text(self) -> str:
        """The record's line or lines in a text file."""
        others = [value for camera, pose in self._others() for value in ("CAMERA", camera, 1, *pose)]
        return _line(self.number, len(self.cameras), "CAMERA", self.cameras[0], *others)

    def binary(self) -> bytes:
        """The record's bytes in a binary file."""
        head = struct.pack("<IIiI", self.number, len(self.cameras), CAMERA, self.cameras[0])
        return head + b"".join(struct.pack("<iIB7d", CAMERA, camera, 1, *pose) for camera, pose in self._others())

    def _others(self) -> Iterable[tuple[int, Pose]]:
        return zip(self.cameras[1:], self.poses[1:], strict=True)


@dataclass(frozen=True)
class Frame:
    """A rig's pose, rig_from_world, and its images at that instant, as (camera, image)."""

    COLUMNS: ClassVar[str] = "FRAME_ID, RIG_ID, QW, QX, QY, QZ, TX, TY, TZ, NUM_DATA, then TYPE, SENSOR_ID, DATA_ID"
    number: int
    rig: int
    pose: Pose
    images: Sequence[tuple[int, int]]

    def text(self) -> str:
        """The record's line or lines in a text file."""
        data = [value for camera, image in self.images for value in ("CAMERA", camera, image)]
        return _line(self.number, self.rig, *self.pose, len(self.images), *data)

    def binary(self) -> bytes:
        """The record's bytes in a binary file."""
        head = struct.pack("<II7dI", self.number, self.rig, *self.pose, len(self.images))
        return head + b"".join(struct.pack("<iIQ", CAMERA, camera, image) for camera, image in self.images)


SEEN = np.dtype([("x", "<f8"), ("y", "<f8"), ("point", "<u8")])
"""A point in an image, pixels, and its number."""


@dataclass(frozen=True, eq=False)
class Image:
    """A picture's file, pose (cam_from_world), camera, and visible points, (N,) of `SEEN`."""

    COLUMNS: ClassVar[str] = "IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME; a line of X, Y, POINT3D_ID"
    number: int
    pose: Pose
    camera: int
    name: str
    seen: NDArray[np.void]

    def text(self) -> str:
        """The record's line or lines in a text file."""
        head = _line(self.number, *self.pose, self.camera, self.name)
        return head + _line(*(value for row in self.seen.tolist() for value in row))

    def binary(self) -> bytes:
        """The record's bytes in a binary file."""
        head = struct.pack("<I7dI", self.number, *self.pose, self.camera)
        return head + self.name.encode() + b"\0" + struct.pack("<Q", len(self.seen)) + self.seen.tobytes()


@dataclass(frozen=True)
class Point:
    """A point in the world, metres, its colour, and the images that show it, as (image, place among its points)."""

    COLUMNS: ClassVar[str] = "POINT3D_ID, X, Y, Z, R, G, B, ERROR, then IMAGE_ID, POINT2D_IDX"
    number: int
    place: Sequence[float]
    color: Sequence[int]
    seen: Sequence[tuple[int, int]]

    def text(self) -> str:
        """The record's line or lines in a text file."""
        return _line(self.number, *self.place, *self.color, 0.0, *(value for pair in self.seen for value in pair))

    def binary(self) -> bytes:
        """The record's bytes in a binary file."""
        track = b"".join(struct.pack("<II", *pair) for pair in self.seen)
        return struct.pack("<Q3d3BdQ", self.number, *self.place, *self.color, 0.0, len(self.seen)) + track


Record = Camera | Rig | Frame | Image | Point
KINDS: dict[str, type[Record]] = {"cameras": Camera, "rigs": Rig, "frames": Frame, "images": Image, "points3D": Point}


def _line(*values: object) -> str:
    return " ".join(map(str, values)) + "\n"
