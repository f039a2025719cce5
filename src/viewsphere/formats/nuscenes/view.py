"""One sample with its sequence, and the records that it adds to nuScenes' tables."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from viewsphere.formats.nuscenes.names import LOG, category_of, modalities, token
from viewsphere.formats.nuscenes.story import Story, neighbours
from viewsphere.formats.shared.mounting import CAMERA_FROM_LIDAR, Float, centred, measured, mounted, unmoved
from viewsphere.formats.shared.writing.pictures import suffix_of
from viewsphere.formats.shared.writing.timeline import Course
from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.rotation import compose, product, quaternion_from_matrix
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.sensors.lidar import LIDAR
from viewsphere.model.sensors.rig import Rig
from viewsphere.model.shot import Shot
from viewsphere.store import Category

Record = dict[str, Any]

_LEVELS = ("v0-40", "v40-60", "v60-80", "v80-100")

_BOUNDS = (0.4, 0.6, 0.8)
"""Visible shares of an object at which the next level of visibility begins."""

_OBJECT_FROM_BOX = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
"""The rotation from a box's axes (x ahead, y left, z up) to viewsphere's object axes, with the front at -y."""

APART_S = 3600
"""Seconds between the starts of successive scenes: the development kit sorts scenes by time."""

KINDS = (".png", ".jpg")

Rows = Iterator[tuple[str, Record]]
"""Names of tables, each with one of its records."""


@dataclass(frozen=True, eq=False)
class View:
    """A sample, its shot, its instant and its sensor in the shot, and its sequence."""

    sample: Sample
    shot: Shot
    instant: int
    place: int
    course: Course
    story: Story

    @property
    def scene(self) -> str:
        """The name of the sample's scene."""
        return f"scene-{self.course.number + 1:04d}"

    @property
    def modality(self) -> str:
        """`camera` or `lidar`."""
        return modalities(self.shot.rig)[self.place]

    @property
    def timestamp(self) -> int:
        """The sample's time, microseconds."""
        return round((APART_S * self.course.number + self.sample.time) * 1e6)

    def token(self, table: str, *names: object) -> str:
        """The token of a record of the sample's sequence."""
        return token(table, self.sample.sequence, *names)

    def file(self, channel: str) -> str:
        """The path of the sample's picture or points."""
        suffix = ".pcd.bin" if self.modality == "lidar" else suffix_of(self.sample, *KINDS)
        return f"samples/{channel}/{self.scene}__{channel}__{self.sample.instant:06d}{suffix}"

    def of_sensor(self, channel: str) -> Rows:
        """The record of the sample's file and, for the first sample or a zooming camera, of the sensor's calibration."""
        instant, lens, own = self.sample.instant, self.sample.camera.intrinsics, self.story.sensors[self.place]
        zooms, is_camera = lens != self.story.lenses[self.place], self.modality == "camera"
        calibrated = self.token("calibrated_sensor", channel, *([instant] if zooms else []))
        if zooms or instant == own[0]:
            mounting = _ego_from_sensor(self.shot.rig, self.place)
            yield (
                "calibrated_sensor",
                {
                    "token": calibrated,
                    "sensor_token": token("sensor", channel),
                    **mounting,
                    "camera_intrinsic": _matrix_of(lens) if is_camera else [],
                },
            )
        yield (
            "sample_data",
            {
                "token": self.token("sample_data", channel, instant),
                "sample_token": self.token("sample", instant),
                "ego_pose_token": self.token("ego_pose", instant),
                "calibrated_sensor_token": calibrated,
                "timestamp": self.timestamp,
                "fileformat": self.file(channel).rpartition(".")[2] if is_camera else "pcd",
                "is_key_frame": True,
                "height": self.sample.height if is_camera else 0,
                "width": self.sample.width if is_camera else 0,
                "filename": self.file(channel),
                **_chain(own, instant, lambda other: self.token("sample_data", channel, other)),
            },
        )

    def of_instant(self) -> Rows:
        """The records of the sample's instant and, at the first instant, of the scene."""
        instant, instants = self.sample.instant, self.story.instants
        ego = _world_from_ego(np.array(self.shot.instants[self.instant].world_from_rig))
        yield "ego_pose", {"token": self.token("ego_pose", instant), "timestamp": self.timestamp, **ego}
        own, scene = self.token("sample", instant), self.token("scene")
        beside = _chain(instants, instant, lambda other: self.token("sample", other))
        yield "sample", {"token": own, "timestamp": self.timestamp, "scene_token": scene, **beside}
        if instant == instants[0]:
            ends = zip(("first_sample_token", "last_sample_token"), (instants[0], instants[-1]), strict=True)
            samples = {name: self.token("sample", end) for name, end in ends}
            named = {"name": self.scene, "description": self.sample.sequence}
            yield "scene", {"token": scene, "log_token": LOG, "nbr_samples": len(instants), **samples, **named}

    def of_objects(self, seen: Sequence[Sample]) -> Rows:
        """The records of the instant's objects, as shown by these samples."""
        points, shares, instant = _hits(seen), _shares(seen), self.sample.instant
        for o in self.sample.objects:
            own, instance = self.story.objects[o.id], self.token("instance", o.id)
            named = partial(self.token, "sample_annotation", o.id)
            if instant == own[0]:
                ends = {"first_annotation_token": named(own[0]), "last_annotation_token": named(own[-1])}
                kind = token("category", o.category_id)
                yield "instance", {"token": instance, "category_token": kind, "nbr_annotations": len(own), **ends}
            yield (
                "sample_annotation",
                {
                    "token": named(instant),
                    "sample_token": self.token("sample", instant),
                    "instance_token": instance,
                    "visibility_token": _grade(shares[o.id]),
                    "attribute_tokens": [],
                    **_box(o),
                    **_chain(own, instant, named),
                    "num_lidar_pts": points[o.id],
                    "num_radar_pts": 0,
                },
            )


def points(sample: Sample) -> bytes:
    """The points of a LiDAR, five float32 each: x ahead, y left, z up (metres), intensity, ring."""
    found = measured(sample)
    return np.column_stack([found["xyz"], found["intensity"], found["ring"]]).astype("<f4").tobytes()


def _hits(seen: Sequence[Sample]) -> Counter[int]:
    """Return the number of points of all LiDARs on each object, by its id."""
    found = [sample.channels[LIDAR]["instance"] for sample in seen if LIDAR in sample.channels]
    return Counter(np.concatenate(found).tolist() if found else ())


def _shares(seen: Sequence[Sample]) -> dict[int, float]:
    """Return each object's largest visible share in any camera, by its id; without cameras, in any LiDAR."""
    cameras = [sample for sample in seen if LIDAR not in sample.channels] or seen
    found = dict[int, float]()
    for o in (o for sample in cameras for o in sample.objects):
        found[o.id] = max(found.get(o.id, 0.0), o.visibility)
    return found


def visibilities() -> list[Record]:
    """The levels of visibility."""
    shares = (level[1:].replace("-", " to ") for level in _LEVELS)
    told = (f"visibility of whole object is {share} %" for share in shares)
    levels = enumerate(zip(_LEVELS, told, strict=True), 1)
    return [{"token": f"{number}", "level": level, "description": words} for number, (level, words) in levels]


def category_record(one: Category) -> Record:
    """A category; its description is its name in the data set."""
    return {"token": token("category", one.id), "name": category_of(one.name), "description": one.name, "index": one.id}


def _chain(instants: Sequence[int], instant: int, name: Callable[[int], str]) -> Record:
    """Tokens of the previous and the next record, empty at the ends."""
    before, behind = neighbours(instants, instant)
    return {"prev": "" if before is None else name(before), "next": "" if behind is None else name(behind)}


def _placed(matrix: Float) -> Record:
    """A rigid matrix (4, 4) as a position and a quaternion."""
    return {"translation": matrix[:3, 3].tolist(), "rotation": list(quaternion_from_matrix(matrix[:3, :3]))}


def _ego_from_sensor(rig: Rig, sensor: int) -> Record:
    """Return the pose of a sensor, by its place in the rig, in the ego's axes; a LiDAR's pose is turned to its own axes."""
    axes = np.eye(4) if rig.sensors[sensor].lidar is None else CAMERA_FROM_LIDAR
    return _placed(compose(compose(unmoved(CAMERA_FROM_LIDAR), mounted(rig, sensor)), axes))


def _world_from_ego(world_from_rig: Float) -> Record:
    """Return the pose of the ego in the world."""
    return _placed(compose(world_from_rig, CAMERA_FROM_LIDAR))


def _matrix_of(lens: Intrinsics) -> list[list[float]]:
    """K, row by row, with the origin in the first pixel's centre."""
    return centred(lens.K).tolist()


def _box(o: ObjectAnnotation) -> Record:
    """The middle, the size and the rotation of an object's box in the world."""
    width, height, length = o.size
    turn = product(o.world_from_object[:3, :3], _OBJECT_FROM_BOX)
    middle = Box3d(o.box3d).center
    return {
        "translation": middle.tolist(),
        "size": [width, length, height],
        "rotation": list(quaternion_from_matrix(turn)),
    }


def _grade(visibility: float) -> str:
    """The token of the level of visibility."""
    return str(1 + sum(visibility >= bound for bound in _BOUNDS))
