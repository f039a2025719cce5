"""Samples, without their channels, as plain JSON and back, exactly.

A rendered sample is stored with its shot as a short record, which holds only the values of objects that do not follow from the
shot and the models. An imported sample is stored as a whole record.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, JsonValue, PositiveInt, TypeAdapter

from viewsphere.labels import (
    Makers,
    ModelFacts,
    Placement,
    finite,
    from_short_record,
    from_whole_record,
    labels_of,
    makers,
    object_labels,
    sample_labels_of,
    short_record,
    whole_record,
)
from viewsphere.model.instant import Viewpoint
from viewsphere.model.sample import ObjectAnnotation, Origin, Sample
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.model.sensors.rig import CAMERA
from viewsphere.model.shot import Shot
from viewsphere.store.shots.records import typed

Channels = Mapping[str, NDArray[Any]]
Facts = Callable[[str, int | None], ModelFacts]
"""Facts of a model, by its key and the frame of its file, None at rest."""


def short_sample(sample: Sample) -> dict[str, Any]:
    """The short record of a sample whose shot is stored, too, as `json.dumps(..., allow_nan=False)` takes it."""
    labels = labels_of(sample.requested)
    return {"index": sample.index, "objects": [short_record(o, labels) for o in sample.objects], **_plain_extra(sample)}


def _plain_extra(sample: Sample) -> dict[str, Any]:
    """The fields of the labels of whole pictures as JSON; none without any."""
    if not sample.extra:
        return {}
    fields = {field.name: field for label in sample_labels_of(sample.requested) for field in label.fields}
    return {"extra": {name: fields[name].plain(value) for name, value in sample.extra.items()}}


def _extra(requested: Sequence[str], plain: Mapping[str, Any]) -> dict[str, Any]:
    """The fields of the requested labels, from the result of `_plain_extra`."""
    fields = (field for label in sample_labels_of(requested) for field in label.fields)
    return {field.name: field.value(plain[field.name]) for field in fields}


def whole_sample(sample: Sample) -> dict[str, Any]:
    """The whole record of a sample, with everything but its channels' pixels and the poses of its rows under a rolling shutter,
    which its shot determines; NaN becomes null.
    """
    camera, pose, labels = sample.known_camera, sample.known_pose, object_labels()
    return {
        "index": sample.index,
        "split": sample.split,
        **({"sequence": sample.sequence} if sample.sequence else {}),
        **({"variation": sample.variation} if sample.variation else {}),
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
        **({"requested": list(sample.requested)} if sample.requested else {}),
        **({"options": {name: dict(of) for name, of in sample.options.items()}} if sample.options else {}),
        **_plain_extra(sample),
    }


@dataclass(frozen=True)
class _Picture:
    """The fields of a whole record about a picture, without its camera, pose and objects."""

    __pydantic_config__ = ConfigDict(allow_inf_nan=False)
    index: int
    split: str
    instant: int
    files: dict[str, str]
    objects: list[dict[str, Any]]
    sequence: str = ""
    variation: str = ""
    sensor: str = CAMERA
    time: float = 0.0
    size: tuple[PositiveInt, PositiveInt] | None = None
    source: dict[str, Any] | None = None
    requested: tuple[str, ...] = ()
    options: dict[str, dict[str, JsonValue]] = field(default_factory=dict[str, dict[str, JsonValue]])
    extra: dict[str, Any] = field(default_factory=dict[str, Any])


_PICTURE = TypeAdapter(_Picture)


def from_whole_sample(record: Mapping[str, Any], channels: Channels, files: Mapping[str, str]) -> Sample:
    """The sample of a whole record, with these channels and files; every number is equal to the last bit."""
    camera, pose, labels, picture = record["camera"], record["pose"], object_labels(), typed(_PICTURE, record)
    finite(picture.source)
    return Sample(
        index=picture.index,
        split=picture.split,
        known_camera=camera
        and Camera(
            Intrinsics.model_validate(camera["intrinsics"]),
            _array(camera["R"], (3, 3)),
            _array(camera["t"], (3,)),
        ),
        known_pose=pose and Viewpoint.model_validate(pose),
        image_size=picture.size,
        source=picture.source,
        objects=tuple(from_whole_record(o, labels) for o in picture.objects),
        channels=channels,
        files=files,
        sequence=picture.sequence,
        variation=picture.variation,
        sensor=picture.sensor,
        instant=picture.instant,
        time=picture.time,
        requested=picture.requested,
        extra=_extra(picture.requested, picture.extra),
        options=picture.options,
    )


def _array(value: Any, shape: tuple[int, ...]) -> NDArray[np.float64]:
    array = np.array(value, np.float64)
    if array.shape != shape or not np.isfinite(array).all():
        raise ValueError(f"finite numbers {shape} expected, found {array.shape}")
    return array


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
    def _makers(self) -> Makers:
        return Makers(makers(), labels_of(self.shot.annotations), self.shot.annotations, self.where)

    def kept_channels(self, place: int) -> tuple[str, ...]:
        """The shot's channels that the sample at a place, counted from 0, has."""
        return self.shot.kept_channels(self._samples[place][2])

    def keeps(self, place: int, channel: str) -> bool:
        """Return whether the sample's sensor keeps a channel, which may have been added later."""
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
            variation=self.shot.variation,
            sensor=self.shot.rig.sensors[sensor].name,
            instant=now.index,
            time=now.seconds,
            origin=Origin(instant, sensor, None, self.root, self.shot.key),
            requested=self.shot.annotations,
            extra=_extra(self.shot.annotations, record.get("extra", {})),
            options=self.shot.labels,
            finish=self.shot.finish(instant, sensor),
        )

    def with_rows(self, place: int, sample: Sample) -> Sample:
        """The sample at a place of the shot, from a whole record, with the row poses that its camera has in the shot. Raises
        ValueError for another lens than the shot's.
        """
        _, instant, sensor = self._samples[place]
        camera, own = sample.camera, self.shot.camera(instant, sensor)
        if camera.intrinsics != own.intrinsics:
            raise ValueError("another lens than the shot's")
        return replace(sample, known_camera=replace(camera, rows=own.rows))

    def _objects(self, records: list[dict[str, Any]], instant: int, camera: Camera) -> Iterator[ObjectAnnotation]:
        things = self.shot.objects
        for record in records:
            if not 0 < record["id"] <= len(things):
                raise ValueError(f"object {record['id']}: expected one of 1 to {len(things)}")
            spec, motion = things[record["id"] - 1].model, things[record["id"] - 1].motion
            pose, step = motion.pose_at(instant), motion.step_at(instant)
            if pose is None:
                raise ValueError(f"object {record['id']}: expected one that is there")
            facts = partial(self.facts, spec.key, step and step.frame)
            placement = Placement(spec, pose, camera, self.shot.category_deg, facts, step, record["id"] - 1)
            yield from_short_record(record, placement, self._makers)
