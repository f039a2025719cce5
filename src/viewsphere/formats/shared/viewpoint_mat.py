"""MATLAB files of PASCAL3D+ and ObjectNet3D: a picture's objects and viewpoints, and the CAD models that it shows.

Pixels are MATLAB's: the centre of the first pixel is (1, 1), so half a pixel is added to viewsphere's pixels. A model's origin
is the centre of its box.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.errors import MissingExtraError, UserError
from viewsphere.formats import Scope
from viewsphere.formats.shared.writing.refusals import lenses, pinhole, plain_names
from viewsphere.geometry.rotation import transform
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.store import Dataset, ModelInfo

NAMES = r"[A-Za-z][A-Za-z0-9_]{0,62}"
"""Allowed names of variables and fields in MATLAB."""

KIT = "PASCAL/VOCdevkit/VOC2012"
"""The folder in which PASCAL3D+ keeps its files from PASCAL VOC."""

OWN = ("vertices", "faces", "pnames")
"""Fields of a CAD model other than points."""

HEAD = b"MATLAB 5.0 MAT-file Platform: posix, Created by: viewsphere"
HEAD_BYTES = 116

STATUS = {0: 1, 1: 2, 2: 4, 3: 4}
"""Statuses of anchors by the states of keypoints: visible, occluded, outside, behind."""

TRUNCATED, OCCLUDED = 0.15, 0.05
"""Shares above which an object is truncated or occluded, by PASCAL VOC's annotation guidelines."""

HALF_PIXEL = np.array([[0.0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])

SQUARE = 1e-9
"""Share by which the sides of pixels may differ."""


class Options(Frozen):
    """The optional data of objects."""

    anchors: bool = Field(default=True, description="the models' named points (the label `keypoints`) as anchors")


def no_viewpoints(scope: Scope) -> Iterator[str]:
    """Reasons to refuse: unknown viewpoints, except in imported trees of this kind, which may have only some; cameras other
    than pinholes with square pixels; and names that MATLAB does not allow.
    """
    shown = [sample.known_camera is not None and o.is_placed for sample in scope.pictures for o in sample.objects]
    if shown and not any(shown) and "keypoints" not in scope.annotations:
        yield "expected pictures of known cameras and viewpoints; found imported ones"
    yield from pinhole(scope)
    for name, lens in lenses(scope):
        if found := _oblong(lens):
            yield f"expected square pixels; found {found} of {name}"
    yield from plain_names(scope, NAMES, "of letters a to z, digits and _, a letter first")


def _oblong(lens: Intrinsics) -> str:
    """Return the numbers of a lens without square pixels, as text; empty for a lens with square pixels."""
    is_square = not lens.skew and math.isclose(lens.fx, lens.fy, rel_tol=SQUARE)
    return "" if is_square else f"fx {lens.fx:g}, fy {lens.fy:g}, skew {lens.skew:g}"


def scipy_io(name: str) -> Any:
    """Return the module that writes .mat files. Raises MissingExtraError, with the format's name, if it is not installed."""
    try:
        from scipy import io
    except ImportError:
        raise MissingExtraError(f"format {name}: expected scipy, found none: pip install 'viewsphere[mat]'") from None
    return io


def mat(**variables: Any) -> bytes:
    """A MATLAB 5 file of these variables, always with the same bytes."""
    file = BytesIO()
    scipy_io("mat").savemat(file, variables, long_field_names=True, oned_as="row")
    data = file.getvalue()
    return HEAD.ljust(HEAD_BYTES) + data[HEAD_BYTES:]


def structs(rows: Sequence[Mapping[str, Any]]) -> NDArray[Any]:
    """A struct array (1, N) of rows with the same fields."""
    fields = list(rows[0]) if rows else ["class"]
    found = np.empty((1, len(rows)), [(name, object) for name in fields])
    for i, row in enumerate(rows):
        for name in fields:
            found[name][0, i] = row[name]
    return found


def _nothing() -> NDArray[np.float64]:
    """MATLAB's []."""
    return np.zeros((0, 0))


def _box(o: ObjectAnnotation) -> NDArray[np.float64]:
    """A box's first and last pixels, counted from 1: x1, y1, x2, y2."""
    assert o.box2d is not None
    x0, y0, x1, y1 = o.box2d
    return np.array([[math.floor(x0) + 1, math.floor(y0) + 1, math.ceil(x1), math.ceil(y1)]], np.float64)


class Cads:
    """The models of a data set by their categories, and their points' names in MATLAB's form."""

    def __init__(self, dataset: Dataset, options: Options, name: str) -> None:
        self._dataset = dataset
        self._has_anchors = options.anchors
        self.by_category: dict[str, list[ModelInfo]] = {category.name: [] for category in dataset.categories}
        self._places = dict[str, int]()
        for info in dataset.models:
            self.by_category[info.category].append(info)
            self._places[info.key] = len(self.by_category[info.category])
        self._fields = {
            category: _fields(infos, f"{name}: category {category}") for category, infos in self.by_category.items()
        }

    def record(self, sample: Sample, objects: Iterable[ObjectAnnotation], filename: str, *, masks: bool) -> bytes:
        """The file of a picture. Raises UserError for a lens other than a pinhole with square pixels, as merged data sets may
        have.
        """
        lens = sample.known_camera and sample.known_camera.intrinsics
        if lens and (not lens.lens.is_linear or _oblong(lens)):
            found = _oblong(lens) or "a lens that distorts"
            raise UserError(f"frame {sample.index}: expected a pinhole with square pixels; found {found}")
        return mat(
            record={
                "filename": filename,
                "imgsize": np.array([[sample.width, sample.height, 3]], np.float64),
                "segmented": float(masks),
                "objects": structs([self._object(o, sample) for o in objects]),
                **({"K": lens.K + HALF_PIXEL} if lens else {}),
            }
        )

    def _object(self, o: ObjectAnnotation, sample: Sample) -> dict[str, Any]:
        anchors, inside = self._anchors(o), 1 - o.truncation
        seen = sum(anchor["status"] == 1 for anchor in anchors.values())
        said = dict(o.source or {})
        motion = None if sample.known_camera is None or not o.is_placed else _camera_from_cad(o)
        number = self._places.get(o.key) or said.get("cad_index")
        return {
            "class": o.category,
            "bbox": _box(o),
            "truncated": float(said.get("truncated", o.truncation > TRUNCATED)),
            "occluded": float(said.get("occluded", inside > 0 and 1 - o.visibility / inside > OCCLUDED)),
            "difficult": float(said.get("difficult", 0)),
            "cad_index": np.int32(number) if number else _nothing(),
            "anchors": anchors or _nothing(),
            "viewpoint": _said(said, seen) if motion is None else _viewpoint(o, sample, motion[:, 3], seen),
            "id": float(o.id),
            "RT": _nothing() if motion is None else motion,
        }

    def _anchors(self, o: ObjectAnnotation) -> dict[str, dict[str, Any]]:
        """Anchors by their names; invisible ones have no position, unless they are imported."""
        fields, said = self._fields[o.category], o.source
        if not self._has_anchors or (not fields if said is None else "keypoint_names" not in o.extra):
            return {}
        known = (said or {}).get("anchors", {})
        names: Sequence[str] = o.keypoint_names
        return {
            fields.get(name, name): {
                "location": place[None] + 0.5 if state == 0 or (said and np.isfinite(place).all()) else _nothing(),
                "status": float(known.get(name, STATUS[int(state)])),
            }
            for name, place, state in zip(names, o.keypoints, o.keypoint_states, strict=True)
        }

    def file(self, category: str) -> bytes:
        """The file of a category's models: a struct array of its name."""
        return mat(**{category: self.structs(category)})

    def structs(self, category: str, *, has_points: bool = True) -> NDArray[Any]:
        """The models of a category as a MATLAB struct array."""
        fields = self._fields[category] if has_points else {}
        rows: list[dict[str, Any]] = []
        for info in self.by_category[category]:
            vertices, triangles = self.shape(info)
            row: dict[str, Any] = {"vertices": vertices, "faces": triangles + np.int32(1)}
            if has_points:
                points, center = info.keypoints.points if info.keypoints else {}, info.box3d_object.mean(axis=0)
                row["pnames"] = np.array([list(fields.values())], object) if fields else _nothing()
                row |= {
                    its: np.array([points[name]]) - center if name in points else _nothing() for name, its in fields.items()
                }
            rows.append(row)
        return structs(rows)

    def cells(self, categories: Sequence[str]) -> bytes:
        """A file of all models: the categories' names, and a cell with the shapes of each."""
        cells, names = np.empty((1, len(categories)), object), np.empty((1, len(categories)), object)
        for i, category in enumerate(categories):
            names[0, i], cells[0, i] = category, self.structs(category, has_points=False)
        return mat(cads=cells, class_names=names)

    def points(self, info: ModelInfo) -> Iterator[tuple[str, bytes]]:
        """Each named point of a model: its name in MATLAB's form, and its OFF text."""
        for name, place in info.keypoints.points.items() if info.keypoints else ():
            x, y, z = (np.array(place) - info.box3d_object.mean(axis=0)).tolist()
            yield self._fields[info.category][name], f"OFF\n1 0 0\n{x!r} {y!r} {z!r}\n".encode()

    def shape(self, info: ModelInfo) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
        """A model's vertices (V, 3), metres from the centre of its box, and triangles (T, 3)."""
        mesh = self._dataset.mesh(info.key)
        return mesh.vertices.astype(np.float64) - info.box3d_object.mean(axis=0), mesh.triangles

    def off(self, info: ModelInfo) -> bytes:
        """A model as OFF text."""
        return off_bytes(*self.shape(info))


def off_bytes(vertices: NDArray[np.float64], triangles: NDArray[np.int32]) -> bytes:
    """A shape as OFF text."""
    rows = [f"OFF\n{len(vertices)} {len(triangles)} 0"]
    rows += [f"{x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
    rows += [f"3 {a} {b} {c}" for a, b, c in triangles.tolist()]
    return ("\n".join(rows) + "\n").encode()


def _camera_from_cad(o: ObjectAnnotation) -> NDArray[np.float64]:
    """The motion (3, 4) from the axes of an object's CAD model to the camera's; an unknown model has its own origin."""
    motion = o.camera_from_object[:3].copy()
    motion[:, 3] = transform(motion, np.nan_to_num(o.box3d_object.mean(axis=0)))
    return motion


def _said(source: Mapping[str, Any], anchors: int) -> Any:
    """The unchanged viewpoint of an imported object with an unknown position; [] without a viewpoint."""
    known = source.get("viewpoint")
    return {**known, "num_anchor": float(anchors)} if known else _nothing()


def _viewpoint(o: ObjectAnnotation, sample: Sample, place: NDArray[np.float64], anchors: int) -> dict[str, float]:
    """Return the view of a model's origin, which is at `place` in the camera's axes. The distance of an origin behind the
    camera is 0, like an unmeasured one.
    """
    ahead = bool(place[2] > 0)
    x, y, z = transform(sample.camera.K, place).tolist()
    azimuth, elevation = o.view.azimuth_deg % 360, o.view.elevation_deg
    return {
        "azimuth_coarse": azimuth,
        "elevation_coarse": elevation,
        "azimuth": azimuth,
        "elevation": elevation,
        "distance": o.view.distance if ahead else 0.0,
        "focal": 1.0,
        "px": x / z + 0.5 if ahead else 0.0,
        "py": y / z + 0.5 if ahead else 0.0,
        "theta": o.view.tilt_deg,
        "viewport": sample.camera.intrinsics.fx,
        "num_anchor": float(anchors),
    }


def _fields(infos: Iterable[ModelInfo], where: str) -> dict[str, str]:
    """Fields of MATLAB by the names of points; raises UserError if two names share a field."""
    names = dict.fromkeys(name for info in infos if info.keypoints for name in info.keypoints.points)
    found = dict[str, str]()
    for name in names:
        field = re.sub(r"[^A-Za-z0-9_]", "_", name)
        field = (field if field[0].isalpha() else f"p_{field}")[:63]
        other = next((one for one, its in found.items() if its == field), field if field in OWN else None)
        if other is not None:
            raise UserError(f"{where}: expected names of points that differ in letters and digits; found {other!r}, {name!r}")
        found[name] = field
    return found
