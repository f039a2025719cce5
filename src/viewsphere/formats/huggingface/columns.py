"""The columns of a data set: their types, as `datasets` spells them, and samples as rows."""

from __future__ import annotations

from pathlib import PurePosixPath
from typing import Any

from viewsphere.formats.huggingface.arrow import arrow
from viewsphere.labels import channels
from viewsphere.model.channel import PICTURES, picture_of
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.store import Dataset, encode

READABLE = (".png", ".jpg", ".webp", ".tiff")
"""Files of pictures that Pillow opens."""

Feature = dict[str, Any]
"""A type: {"_type": its class in `datasets`, ...}, or the types of a mapping's values by their keys."""

IMAGE: Feature = {"_type": "Image"}


def _value(dtype: str) -> Feature:
    """The type of a number or a text."""
    return {"dtype": dtype, "_type": "Value"}


def _several(feature: Feature, length: int = -1) -> Feature:
    """The type of a list, of any length by default."""
    return {"feature": feature, "length": length, "_type": "Sequence"}


def _array(*shape: int) -> Feature:
    """The type of an array of exact numbers."""
    inner = _value("float64")
    for size in reversed(shape):
        inner = _several(inner, size)
    return inner


class Columns:
    """The columns of a data set: their types, and a sample as a row."""

    def __init__(self, dataset: Dataset) -> None:
        kept = dataset.plan.channels
        self._dataset = dataset
        self._classes = {category.id: number for number, category in enumerate(dataset.categories)}
        self._picture = picture_of(kept)
        self._pictures = [name for name in kept if name in PICTURES or channels()[name].components == 1]
        self.left_out = [name for name in kept if name not in self._pictures]
        self.features: Feature = {
            "index": _value("int64"),
            **{self._column(name): IMAGE for name in self._pictures},
            **dict.fromkeys(("width", "height"), _value("int32")),
            **dict.fromkeys(("sequence", "sensor"), _value("string")),
            "instant": _value("int32"),
            "time": _value("float64"),
            "camera": CAMERA,
            "pose": POSE,
            "objects": {name: _several(feature) for name, feature in self._of_objects().items()},
        }

    def _column(self, channel: str) -> str:
        return "image" if channel == self._picture else channel

    def _of_objects(self) -> dict[str, Feature]:
        names: dict[str, int] = {}
        for c in self._dataset.categories:  # imported categories may share a name
            names.setdefault(c.name if c.name not in names else f"{c.name} ({c.id})", c.id)
        return {
            "id": _value("int64"),
            "category": {"names": list(names), "_type": "ClassLabel"},
            "bbox": _array(4),
            "area": _value("int64"),
            **dict.fromkeys(("visibility", "truncation"), _value("float64")),
            **dict.fromkeys(("model", "track", "pose_category"), _value("string")),
            "box3d_camera": _array(8, 3),
            "box3d_pixels": _array(8, 2),
            "camera_from_object": _array(4, 4),
            "size": _array(3),
        }

    def row(self, sample: Sample) -> tuple[dict[str, Any], int]:
        """A sample's row, and the bytes of its pictures."""
        pictures = {self._column(name): self._image(sample, name) for name in self._pictures if name in sample.files}
        objects = [self._object(o) for o in sample.objects if o.box2d is not None]
        row = {
            **pictures,
            **{name: getattr(sample, name) for name in self.features if name in OF_SAMPLE},
            "camera": _camera(sample),
            "pose": {name: getattr(sample.known_pose, name) for name in POSE} if sample.known_pose else None,
            "objects": {name: [o[name] for o in objects] for name in self.features["objects"]},
        }
        return row, sum(len(picture["bytes"]) for picture in pictures.values())

    def _image(self, sample: Sample, name: str) -> dict[str, Any]:
        """A picture's file as `datasets` embeds it: the stored file, or the default encoding if Pillow cannot read the stored
        one.
        """
        suffix = PurePosixPath(sample.files[name]).suffix
        if suffix in READABLE:
            data = self._dataset.read(sample.files[name])
        else:
            suffix, data = channels()[name].suffix, encode(channels()[name], sample.channels[name])
        return {"bytes": data, "path": f"{sample.index:08d}{suffix}"}

    def _object(self, o: ObjectAnnotation) -> dict[str, Any]:
        x0, y0, x1, y1 = o.box2d or (0, 0, 0, 0)
        arrays = {name: getattr(o, name).tolist() for name in ("box3d_camera", "box3d_pixels", "camera_from_object")}
        plain = {name: getattr(o, name) for name in ("id", "area", "visibility", "truncation", "track", "pose_category")}
        box = [x0, y0, x1 - x0, y1 - y0]
        return {**plain, **arrays, "category": self._classes[o.category_id], "bbox": box, "model": o.key, "size": list(o.size)}


OF_SAMPLE = ("index", "width", "height", "sequence", "sensor", "instant", "time")
LENS: Feature = {"model": _value("string"), "coefficients": _several(_value("float64"))}
CAMERA: Feature = {"K": _array(3, 3), "R": _array(3, 3), "t": _array(3), "distortion": LENS}
POSE: Feature = {
    **dict.fromkeys(("azimuth_deg", "elevation_deg", "distance", "tilt_deg"), _value("float64")),
    "category": _value("string"),
}


def _camera(sample: Sample) -> dict[str, Any] | None:
    camera = sample.known_camera
    if camera is None:
        return None
    return {"K": camera.K.tolist(), "R": camera.R.tolist(), "t": camera.t.tolist(), "distortion": camera.lens.flat_record}


def arrow_type(feature: Feature) -> Any:
    """The Arrow type in which `datasets` stores one of its own types."""
    pa = arrow()
    match feature.get("_type"):
        case "Image":
            return pa.struct({"bytes": pa.binary(), "path": pa.string()})
        case "ClassLabel":
            return pa.int64()
        case "Value":
            return pa.type_for_alias(feature["dtype"])
        case "Sequence":
            return pa.list_(arrow_type(feature["feature"]), feature["length"])
        case _:
            return pa.struct({name: arrow_type(inner) for name, inner in feature.items()})
