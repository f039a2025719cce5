"""Samples, without their channels, as plain JSON and back, exactly.

A rendered sample is kept beside its shot by a short record, which holds only those values of the objects that do not follow
from the shot and the models. An imported sample is kept by a whole record.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.labels import (
    ModelFacts,
    Placement,
    from_short_record,
    from_whole_record,
    object_labels,
    short_record,
    whole_record,
)
from viewsphere.model.camera import Camera, Intrinsics
from viewsphere.model.instant import Viewpoint
from viewsphere.model.rig import CAMERA
from viewsphere.model.sample import ObjectAnnotation, Sample, Taken
from viewsphere.model.shot import Shot

Channels = Mapping[str, NDArray[Any]]
Facts = Callable[[str, int | None], ModelFacts]
"""What is known of a model, by its key, and the frame of its file that it shows, None at rest."""


def short_sample(sample: Sample) -> dict[str, Any]:
    """The short record of a sample whose shot is stored, too, as `json.dumps(..., allow_nan=False)` takes it."""
    labels = object_labels()
    return {"index": sample.index, "objects": [short_record(o, labels) for o in sample.objects]}


def whole_sample(sample: Sample) -> dict[str, Any]:
    """The whole record of a sample, with everything but its channels' pixels; NaN becomes null."""
    camera, pose, labels = sample.known_camera, sample.known_pose, object_labels()
    return {
        "index": sample.index,
        "split": sample.split,
        **({"sequence": sample.sequence} if sample.sequence else {}),
        **({"sensor": sample.sensor} if sample.sensor != CAMERA else {}),
        "instant": sample.instant,
        **({"time": sample.time} if sample.time else {}),
        "pose": pose and pose.model_dump(mode="json"),
        "camera": camera
        and {
            "intrinsics": camera.intrinsics.model_dump(mode="json"),
            "R": camera.R.tolist(),
            "t": camera.t.tolist(),
        },
        **({"size": sample.image_size} if sample.image_size else {}),
        **({"source": dict(sample.source)} if sample.source is not None else {}),
        "objects": [whole_record(o, labels) for o in sample.objects],
        "files": dict(sample.files),
    }


def from_whole_sample(record: Mapping[str, Any], channels: Channels, files: Mapping[str, str]) -> Sample:
    """The sample a whole record was made of, with these channels and files; every number is equal to the last bit."""
    camera, pose, size, labels = record["camera"], record["pose"], record.get("size"), object_labels()
    return Sample(
        index=record["index"],
        split=record["split"],
        known_camera=camera
        and Camera(
            Intrinsics.model_validate(camera["intrinsics"]),
            np.array(camera["R"], np.float64),
            np.array(camera["t"], np.float64),
        ),
        known_pose=pose and Viewpoint.model_validate(pose),
        image_size=size and (int(size[0]), int(size[1])),
        source=record.get("source"),
        objects=tuple(from_whole_record(o, labels) for o in record["objects"]),
        channels=channels,
        files=files,
        sequence=record.get("sequence", ""),
        sensor=record.get("sensor", CAMERA),
        instant=record["instant"],
        time=record.get("time", 0.0),
    )


@dataclass(frozen=True, eq=False)
class ShotRecords:
    """Restores a shot's samples from short records; `facts` describes its models, `where` names the file in messages, `root` is
    the data set's folder.
    """

    shot: Shot
    facts: Facts
    where: str
    root: str

    @cached_property
    def _samples(self) -> tuple[tuple[int, int, int], ...]:
        return tuple(self.shot.samples)

    @cached_property
    def _makers(self) -> dict[str, Any]:
        return {field.name: label for label in object_labels() for field in label.fields}

    def kept(self, place: int) -> tuple[str, ...]:
        """The channels of the shot's that the sample at a place has, counted from 0."""
        return self.shot.kept(self._samples[place][2])

    def keeps(self, place: int, channel: str) -> bool:
        """Whether a channel, that may have been added later, is one of the sample's sensor."""
        own = self.shot.rig.sensors[self._samples[place][2]].channels
        return own is None or channel in own

    def sample(self, place: int, record: Mapping[str, Any], channels: Channels, files: Mapping[str, str]) -> Sample:
        """The sample at a place of the shot, counted from 0, with these channels and files."""
        _, instant, sensor = self._samples[place]
        now, camera = self.shot.instants[instant], self.shot.camera(instant, sensor)
        return Sample(
            index=record["index"],
            split=now.split,
            known_camera=camera,
            known_pose=self.shot.viewpoint(instant, sensor),
            objects=tuple(self._objects(record["objects"], instant, camera)),
            channels=channels,
            files=files,
            sequence=self.shot.sequence,
            sensor=self.shot.rig.sensors[sensor].name,
            instant=now.index,
            time=now.seconds,
            taken=Taken(instant, sensor, None, self.root, self.shot.key),
        )

    def _objects(self, records: list[dict[str, Any]], instant: int, camera: Camera) -> Iterator[ObjectAnnotation]:
        things = self.shot.objects
        for record in records:
            spec, motion = things[record["id"] - 1].model, things[record["id"] - 1].motion
            pose, step = motion.at(instant), motion.step_at(instant)
            if pose is None:
                raise ValueError(f"object {record['id']}: expected one that is there")
            facts = partial(self.facts, spec.key, step and step.frame)
            placement = Placement(spec, pose, camera, self.shot.category_deg, facts, step)
            yield from_short_record(record, placement, self._makers, self.where)
