"""Cameras, rigs and some points of the worlds that they see, for formats that store little else."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from viewsphere.codecs.png_tiff import encode_png
from viewsphere.formats.shared.writing.export_files import Coded
from viewsphere.geometry.camera import pixel_rays
from viewsphere.geometry.rotation import transform
from viewsphere.labels.shared.drawing.passes import shown_picture
from viewsphere.model.sample import Sample
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.model.sensors.rig import CAMERA, Rig
from viewsphere.store import Dataset

Float = NDArray[np.float64]
MOST = 65535
"""Number of depth steps in 16 bits."""

POINTS = 500
"""Approximate number of points taken from a picture."""


def world_of(dataset: Dataset, sample: Sample) -> str:
    """The name of the static world that several cameras show: a sequence, a scene or a model."""
    if sample.sequence:
        return sample.sequence
    row = dataset.plan.row_at(sample.index)
    return f"{row.subject}-{row.part}" if row.part else row.subject


def world_from_camera(camera: Camera) -> Float:
    """The camera's pose, (4, 4), with OpenCV's axes."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = camera.R.T, camera.center
    return pose


def opengl_pose(camera: Camera) -> Float:
    """The camera's pose, (4, 4), with OpenGL's axes: x right, y up, z back."""
    return world_from_camera(camera) * (1.0, -1.0, -1.0, 1.0)


@dataclass(frozen=True, eq=False)
class Moment:
    """A rig at the instant of a sample: names, lenses and `rig_from_sensor`, (4, 4), of its sensors; the sample's sensor; the
    sensors with samples; the number of the first sample; and the rig's pose, as a camera pose. `folder` separates the files of
    several sensors and is empty for a single one.
    """

    names: tuple[str, ...]
    lenses: tuple[Intrinsics, ...]
    mounts: tuple[Float, ...]
    sensor: int
    there: tuple[int, ...]
    first: int
    pose: Camera
    folder: str

    @property
    def is_first(self) -> bool:
        """Return whether the sample is the first one of its moment."""
        return self.sensor == self.there[0]


class Rigs:
    """The rigs of a data set's samples."""

    def __init__(self, dataset: Dataset) -> None:
        self._dataset = dataset
        self._shot = lru_cache(maxsize=8)(dataset.labelled)

    def usual(self, part: int) -> Rig | None:
        """The rig of the first shot of a part of the data set."""
        return self._usual.get(part)

    @property
    def _usual(self) -> dict[int, Rig]:
        if not hasattr(self, "_found"):
            firsts = {row.part: row.key for row in reversed(self._dataset.rows)}
            shots = {part: self._shot(key) for part, key in firsts.items()}
            self._found = {part: shot.rig for part, shot in shots.items() if shot is not None}
        return self._found

    def moment(self, sample: Sample) -> Moment:
        """The rig at the instant of a sample; only the sample's camera if its shot is unknown."""
        taken = sample.origin
        shot = taken.shot or self._shot(taken.key) if taken else None
        if taken is None or shot is None:
            camera = sample.camera
            folder = "" if sample.sensor == CAMERA else sample.sensor
            return Moment((sample.sensor,), (camera.intrinsics,), (np.eye(4),), 0, (0,), sample.index, camera, folder)
        sensors, first = shot.rig.sensors, sample.index - taken.sensor
        return Moment(
            tuple(sensor.name for sensor in sensors),
            tuple(shot.camera(taken.instant, number).intrinsics for number in range(len(sensors))),
            tuple(np.array(sensor.rig_from_sensor) for sensor in sensors),
            taken.sensor,
            tuple(self._dataset.choice.places(first, len(sensors))),
            first,
            shot.camera(taken.instant),
            sensors[taken.sensor].name if len(sensors) > 1 else "",
        )


def measured_png(sample: Sample, metres: float) -> Coded:
    """Depth along z, of panoramas along the ray, in steps of this many metres, 16 bits, as in RGB-D cameras: 0 for no surface
    or a depth beyond the range.
    """

    def make() -> bytes:
        (name,) = sample.camera.lens.channels(("depth",))
        depth = sample.channels[name].astype(np.float64)
        with np.errstate(invalid="ignore"):
            steps = np.rint(depth / metres)
        held = (depth > 0) & (steps <= MOST)
        return encode_png(np.where(held, np.maximum(steps, 1), 0).astype(np.uint16))

    return Coded(sample.index, f"measured {metres!r}.png", make)


@dataclass(frozen=True, eq=False)
class _Points:
    """Points of a picture: their pixels (N, 2), their positions in the world (N, 3), metres, and their colours (N, 3) uint8."""

    pixels: Float
    world: Float
    colors: NDArray[np.uint8]


def points_of(sample: Sample) -> _Points:
    """The points that pixels of a coarse grid show, by the channel `depth`, or `depth_ray` of panoramas."""
    camera = sample.camera
    (name,) = camera.lens.channels(("depth",))
    step = max(1, math.ceil(math.sqrt(camera.width * camera.height / POINTS)))
    rows, columns = np.mgrid[step // 2 : camera.height : step, step // 2 : camera.width : step]
    rays, begin = pixel_rays(camera.intrinsics)[rows, columns], camera.lens.origins()[rows, columns]
    along = rays[..., 2] if camera.lens.has_depth else np.ones(rays.shape[:-1])
    depth = sample.channels[name][rows, columns].astype(np.float64)
    seen = np.isfinite(depth) & np.isfinite(rays).all(axis=-1) & (along * depth > 0)
    rows, columns, rays, depth, along = rows[seen], columns[seen], rays[seen], depth[seen], along[seen]
    places = begin[seen] + rays * (depth / along)[:, None]
    pixels = np.column_stack((columns, rows)) + 0.5
    return _Points(pixels, transform(camera.R.T, places - camera.t), shown_picture(sample)[rows, columns, :3])
