"""A sample as plain JSON and back, exactly: what the store keeps of a frame besides its channels."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.model.camera import Camera, Intrinsics
from viewsphere.model.instant import Viewpoint
from viewsphere.model.rig import CAMERA
from viewsphere.model.sample import ObjectAnnotation, Rle, Sample, View

_ARRAYS = (
    "box3d_object",
    "box3d",
    "box3d_camera",
    "box3d_pixels",
    "box3d_in_front",
    "world_from_object",
    "camera_from_object",
)
_TUPLES = ("box2d", "box2d_projected", "box2d_unclipped", "quaternion", "size", "real_size")
_SHARES = ("visibility", "truncation")


def sample_to_record(sample: Sample) -> dict[str, Any]:
    """The sample without its arrays of pixels, as `json.dumps(..., allow_nan=False)` takes it; NaN becomes
    null.
    """
    camera, pose = sample.known_camera, sample.known_pose
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
        "objects": [_object_to_record(o) for o in sample.objects],
        "files": dict(sample.files),
    }


def sample_from_record(record: Mapping[str, Any], channels: Mapping[str, NDArray[Any]], files: Mapping[str, str]) -> Sample:
    """The sample a record was made of, with these channels and files; every number is equal to the last bit."""
    camera, pose, size = record["camera"], record["pose"], record.get("size")
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
        objects=tuple(_object_from_record(o) for o in record["objects"]),
        channels=channels,
        files=files,
        sequence=record.get("sequence", ""),
        sensor=record.get("sensor", CAMERA),
        instant=record["instant"],
        time=record.get("time", 0.0),
    )


def _object_to_record(annotation: ObjectAnnotation) -> dict[str, Any]:
    record = dict(annotation.__dict__)
    record["rle"] = dict(annotation.rle.__dict__)
    record["view"] = {name: _without_nan(value) for name, value in annotation.view.__dict__.items()}
    for name in _ARRAYS:
        record[name] = _without_nan(record[name].tolist())
    for name in _TUPLES:
        record[name] = None if record[name] is None else _without_nan(list(record[name]))
    for name in _SHARES:
        record[name] = _without_nan(record[name])
    if annotation.source is None:
        del record["source"]
    if not annotation.track:
        del record["track"]
    return record


def _object_from_record(record: Mapping[str, Any]) -> ObjectAnnotation:
    values = dict(record)
    values["rle"] = Rle(**record["rle"])
    values["view"] = View(**{name: _number(value) for name, value in record["view"].items()})
    for name in _ARRAYS:
        values[name] = np.array(record[name], np.bool_ if name == "box3d_in_front" else np.float64)
    for name in _TUPLES:
        values[name] = None if record[name] is None else tuple(map(_number, record[name]))
    for name in _SHARES:
        values[name] = _number(record[name])
    return ObjectAnnotation(**values)


def _number(value: float | None) -> float:
    return math.nan if value is None else value


def _without_nan(value: Any) -> Any:
    if isinstance(value, list):
        return [_without_nan(v) for v in value]
    return None if isinstance(value, float) and math.isnan(value) else value
