"""FiftyOne's own data sets on disk, for its app: boxes, masks, keypoints, 3D boxes and maps in one view.

    metadata.json, samples.json                                    the content, and an entry for each picture
    data/<split>/<index>.png                                       the pictures
    fields/ground_truth.detections/<split>/<index>_<object>.png    an object's mask within its box, black and white
    fields/segmentation/<split>/<index>.png                        class numbers, if the data set keeps `semantic`
    fields/depth/<split>/<index>.png                               millimetres to 65535, 0 for none, if it keeps `depth`

    fiftyone.Dataset.from_dir(dataset_dir="...", dataset_type=fiftyone.types.FiftyOneDataset)

A picture has its split as a tag, and `sequence`, `sensor`, `instant` and `time`. If its camera is known, it has `K` (pixels
from the picture's corner), `world_from_camera` (x right, y down, z ahead; metres), and for lenses other than pinholes
`distortion` (the model and its parameters). `ground_truth` lists the visible objects:
label, bounding_box (x, y, width and height of the visible pixels, as shares of the picture), mask, index (the object id,
constant over a sequence), supercategory, model, visibility and truncation. `location`, `dimensions` and `rotation` are the 3D
box in the world (z up): its centre, its size along the object's x, y and z (front -y) in metres, and its angles around x, y and
z in radians, R = Rx Ry Rz. `keypoints` are the objects' named points, if the data set keeps them. Their list joins the names of
all models; a point that an object lacks, or that is outside the picture, is NaN. `occluded` marks hidden points. The data set's
mask_targets and skeleton hold the names of classes and points.

The files use the format's first version, which has no list of fields; today's importer accepts it and derives the fields from
the entries. Not stored: passes and other channels. Not verified: how the app rotates 3D boxes. Source: FiftyOne's
documentation, https://docs.voxel51.com/user_guide/import_datasets.html, and version 1.22.1 of the package.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.formats.shared.writing.paper import json_bytes
from viewsphere.formats.shared.writing.pictures import depth_png, picture, png, suffix_of
from viewsphere.formats.shared.writing.tree import File, Layout, Piece, Tree, functions
from viewsphere.geometry.rotation import transform
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset

KINDS = (".png", ".jpg", ".webp")
MILLIMETRE = 0.001
NAN = {"$numberDouble": "NaN"}
"""The placeholder of a NaN until `_json` has written it; no JSON text looks like this."""

STATES = (0, 1)
"""States of points in the picture: visible, occluded."""


class _FiftyOne(Tree):
    """The tree of a data set."""

    def __init__(self, dataset: Dataset) -> None:
        super().__init__(dataset)
        known = [model.keypoints for model in dataset.models if model.keypoints]
        self._points = list(dict.fromkeys(name for points in known for name in points.points))
        self._lines = list(dict.fromkeys(pair for points in known for pair in points.skeleton))
        self._bits = np.uint8 if all(one.id < 256 for one in dataset.classes) else np.uint16

    def sample_files(self, sample: Sample) -> Iterator[File | Piece]:
        """A picture, its maps, its objects' masks and its entry."""
        stem = self.stem(sample)
        file, seen = f"data/{stem}{suffix_of(sample, *KINDS)}", [o for o in sample.objects if o.box2d is not None]
        entry: dict[str, Any] = {"filepath": file, "tags": [sample.split], **_taken(sample)}
        yield File(file, picture(sample, *KINDS))
        if "semantic" in sample.channels:
            path = f"fields/segmentation/{stem}.png"
            classes = sample.channels["semantic"].astype(self._bits)
            yield File(path, png(sample, f"classes {np.dtype(self._bits)}", classes))
            entry["segmentation"] = {"_cls": "Segmentation", "mask_path": path}
        if "depth" in sample.channels:
            path = f"fields/depth/{stem}.png"
            yield File(path, depth_png(sample, MILLIMETRE))
            entry["depth"] = {"_cls": "Heatmap", "map_path": path, "range": [0, 65535]}
        detections: list[dict[str, Any]] = []
        for o in seen:
            detections.append(_detection(sample, o))
            mask = _within(o)
            if mask is not None:
                path = f"fields/ground_truth.detections/{stem}_{o.id:03d}.png"
                yield File(path, mask)
                detections[-1]["mask_path"] = path
        marked = [self._marked(sample, o) for o in seen if o.extra.get("keypoint_names")] if self._points else []
        entry["ground_truth"] = {"_cls": "Detections", "detections": detections}
        if marked:
            entry["keypoints"] = {"_cls": "Keypoints", "keypoints": marked}
        yield Piece("samples.json", _json(entry), between=b",\n")

    def layout(self, path: str, counts: Mapping[str, int]) -> Layout:
        """The list of samples."""
        return (b'{"samples":[\n', "", b"\n]}\n")

    def rest(self) -> Iterator[File]:
        """Names of classes and of points."""
        info: dict[str, Any] = {"default_classes": [category.name for category in self.dataset.categories]}
        info["mask_targets"] = {"segmentation": {str(one.id): one.name for one in self.dataset.classes}}
        if self._points:
            edges = [[self._points.index(one), self._points.index(other)] for one, other in self._lines]
            info["default_skeleton"] = {"labels": self._points, "edges": edges}
        yield File("metadata.json", json_bytes({"name": self.dataset.name, "media_type": "image", "info": info}))

    def _marked(self, sample: Sample, o: ObjectAnnotation) -> dict[str, Any]:
        """An object's points, in the order of all names."""
        points, occluded = [[NAN, NAN] for _ in self._points], [False for _ in self._points]
        for name, place, state in zip(o.keypoint_names, o.keypoints, o.keypoint_states, strict=True):
            if int(state) in STATES and name in self._points:
                at = self._points.index(name)
                points[at] = (place / [sample.width, sample.height]).tolist()
                occluded[at] = bool(state)
        return {"_cls": "Keypoint", "label": o.category, "index": o.id, "points": points, "occluded": occluded}


def _json(entry: dict[str, Any]) -> bytes:
    """An entry as the importer reads it, which is Python's JSON with NaN."""
    return json_bytes(entry).replace(json_bytes(NAN), b"NaN")


def _taken(sample: Sample) -> dict[str, Any]:
    """Return the time and the camera of a picture."""
    said: dict[str, Any] = {"sequence": sample.sequence, "sensor": sample.sensor}
    said |= {"instant": sample.instant, "time": float(sample.time)}
    if sample.known_camera is not None:
        camera, motion = sample.camera, np.eye(4)
        motion[:3, :3], motion[:3, 3] = camera.R.T, camera.center
        said |= {"K": camera.K.tolist(), "world_from_camera": motion.tolist()}
        if camera.lens.record is not None:
            said["distortion"] = camera.lens.record
    return said


def _detection(sample: Sample, o: ObjectAnnotation) -> dict[str, Any]:
    assert o.box2d is not None
    size = np.array([sample.width, sample.height])
    low, high = np.array(o.box2d[:2]) / size, np.array(o.box2d[2:]) / size
    told: dict[str, Any] = {
        "_cls": "Detection",
        "label": o.category,
        "bounding_box": [*low.tolist(), *(high - low).tolist()],
        "index": o.id,
        "supercategory": o.supercategory,
    }
    if not o.is_boxed:
        return told
    middle, (width, height, length) = o.box3d_object.mean(axis=0), o.size
    told |= {"model": o.key, "visibility": float(o.visibility), "truncation": float(o.truncation)}
    told |= {"location": transform(o.world_from_object, middle).tolist(), "dimensions": [width, length, height]}
    return {**told, "rotation": _angles(o.world_from_object[:3, :3])}


def _angles(turn: NDArray[np.float64]) -> list[float]:
    """The angles (radians) around x, y, z of a rotation (3, 3) = Rx Ry Rz; z is 0 if only the sum of two angles is
    determined.
    """
    (a, b, c), (_, e, f), (_, h, i) = turn.tolist()
    y = math.asin(max(-1.0, min(1.0, c)))
    if math.hypot(a, b) < 1e-9:
        return [math.atan2(h, e), y, 0.0]
    return [math.atan2(-f, i), y, math.atan2(-b, a)]


def _within(o: ObjectAnnotation) -> NDArray[np.bool_] | None:
    """The part of an object's mask in its box; None for an object without a mask."""
    assert o.box2d is not None
    (x0, y0), (x1, y1) = map(math.floor, o.box2d[:2]), map(math.ceil, o.box2d[2:])
    mask = o.mask
    return np.ascontiguousarray(mask[y0:y1, x0:x1]) if mask.any() else None


preparer, writer, verify = functions(_FiftyOne)


FORMAT = FormatSpec(
    about=__doc__,
    holds=("boxes", "masks", "keypoints", "3D boxes", "depth", "semantic maps", "cameras"),
    read_by=("FiftyOne",),
    channels=("rgb",),
    names_credits=False,
    writer=writer,
    preparer=preparer,
    verify=verify,
)
