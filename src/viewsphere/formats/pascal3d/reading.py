"""A PASCAL3D+ data set from another source: pictures by category, a record for each, masks, lists and CAD models."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import StoreError
from viewsphere.files import read_text
from viewsphere.formats.pascal3d.cads import read_cads
from viewsphere.formats.pascal3d.pictures import FILES_KEPT, Of, Told, objects_of, picture_of, told_pictures
from viewsphere.formats.pascal3d.posed import pinhole
from viewsphere.formats.pascal3d.records import Record, Seen, read_record
from viewsphere.formats.shared.reading.image_lists import MISTAKES, Listed, listed_dataset, one_line, unposed
from viewsphere.formats.shared.reading.placed_objects import placed
from viewsphere.formats.shared.reading.voc_maps import ALIKE, boxes_of, check_map, numbered, numbers_of, overlap
from viewsphere.formats.shared.viewpoint_mat import KIT
from viewsphere.geometry.camera import orbit_rotation
from viewsphere.geometry.mask import encode_rle
from viewsphere.geometry.pose_category import pose_category
from viewsphere.geometry.rotation import product, rigid
from viewsphere.model.sample import Box, ObjectAnnotation, ObjectView, Sample
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.store import Category
from viewsphere.store.foreign import ForeignDataset, ForeignModel, foreign_object
from viewsphere.store.paths import file_inside, is_name

Float = NDArray[np.float64]

PASCAL = "pascal"
"""The source of pictures with masks; other pictures have the source imagenet."""

STATES = {1: 0, 2: 1, 3: 1, 4: 2}
"""States of keypoints by the status of anchors: visible, occluded, outside; any other status is unknown (3)."""

NEAR = 3.0
"""Distance by which a mask with too little overlap may extend beyond its object's box, pixels."""

SAME = 1e-9
"""Share by which the focal lengths of one lens may differ: they are products of two 64-bit numbers."""


@dataclass(frozen=True)
class _Shown(Listed):
    """A picture, its records, and its map of objects (None without a map)."""

    told: Told
    masks: Path | None


def read(path: Path, *, keep_going: bool = False) -> ForeignDataset:
    """Return every picture of a folder with `Annotations` and `Images`, as viewsphere.formats.pascal3d describes.

    Raises StoreError with every mistake: records, pictures and CAD models that are missing, broken or outside, and broken
    objects. With `keep_going` these are left out and reported.
    """
    if not (path / "Annotations").is_dir() or not (path / "Images").is_dir():
        raise StoreError(f"{path}: expected a PASCAL3D+ data set (Annotations, Images, CAD); found no such folders")
    problems, record_of = list[str](), lru_cache(FILES_KEPT)(read_record)
    pictures = tuple(_pictures(path, record_of, problems))
    kinds, shown, most = dict.fromkeys(_named(path)), set[str](), 1
    for picture in pictures:
        found = objects_of(picture.told, record_of)
        shown |= {o.kind for o in found}
        most = max([most, len(found), *(o.id or 0 for o in found)])
    names = (*kinds, *sorted(shown - kinds.keys()))
    categories = {name: Category(number, name, "") for number, name in enumerate(names, 1)}
    cads = read_cads(path, {name: one for name, one in categories.items() if is_name(name)}, problems)
    problems += (
        f"{o.file}: object {o.place}: expected cad_index 1 to {len(cads[o.kind])}; found {o.cad}: its model is left out"
        for picture in pictures
        for o in objects_of(picture.told, record_of)
        if o.kind in cads and o.cad > len(cads[o.kind])
    )
    models = [model for found in cads.values() for model in found]
    sample_of = partial(_sample, categories, cads, record_of)
    also = "\n".join(model.info.digest for model in models)
    return listed_dataset(path, pictures, categories.values(), most, sample_of, problems, keep_going, models, also)


def _named(root: Path) -> Iterator[str]:
    """The categories of a classes.txt, in the order of their numbers; none without one."""
    file = root / KIT / "classes.txt"
    if file.is_file():
        try:
            rows = [
                row.split() for row in read_text(file_inside(root, f"{KIT}/classes.txt"), "MAX_ANNOTATION_BYTES").splitlines()
            ]
            yield from (name for _, name in sorted((int(number), name) for number, name in rows))
        except MISTAKES as error:
            raise StoreError(f"{file}: expected a number and a name a line; found: {one_line(error)}") from None


def _pictures(root: Path, record_of: Of, problems: list[str]) -> Iterator[_Shown]:
    for told in told_pictures(root, record_of, problems):
        try:
            yield _picture(root, told, record_of(told.files[0]))
        except MISTAKES as error:
            problems.append(f"{told.files[0]}: {one_line(error)}")


def _picture(root: Path, told: Told, record: Record) -> _Shown:
    """A picture with readable records."""
    there = picture_of(root, told, record)
    if there is None:
        raise ValueError(f"expected a picture; found no Images/{told.kinds[0]}_{told.source}/{told.name}")
    file, size = there
    masks = file_inside(root, f"{KIT}/SegmentationObject/{told.name}.png")
    own = masks if told.source == PASCAL and masks.is_file() else None
    if own:
        check_map(own, size)
    return _Shown(told.split, file.relative_to(root / "Images").as_posix(), file, size, (*told.files, own), told, own)


def _sample(
    categories: Mapping[str, Category], cads: Mapping[str, Sequence[ForeignModel]], record_of: Of, picture: _Shown, index: int
) -> Sample:
    seen = objects_of(picture.told, record_of)
    masks = _masks(picture.masks, seen) if picture.masks else [None] * len(seen)
    lens = _lens(record_of(picture.told.files[0]).lens, seen, picture.size)
    objects = [
        _annotation(o, categories[o.kind], cads.get(o.kind, ()), picture, lens, mask)
        for o, mask in zip(seen, masks, strict=True)
    ]
    sample = replace(unposed(picture, index, objects, {"file_name": picture.name}), requested=("keypoints",), instant=index)
    camera = lens and Camera(lens, np.eye(3), np.zeros(3))
    return sample if camera is None else replace(sample, known_camera=camera, image_size=None)


def _lens(known: Float | None, seen: Sequence[Seen], size: tuple[int, int]) -> Intrinsics | None:
    """The lens of a picture: its own, or else a lens with its viewpoints' focal length. Its axis meets the origin of a single
    object, or the middle of the picture with several objects. None without viewpoints, or if focal lengths differ.
    """
    width, height = size
    if known is not None:
        return pinhole(known, size)
    fine = [o.view for o in seen if o.is_fine]
    lengths = [view["focal"] * view["viewport"] for view in fine]
    if not fine or max(lengths) - min(lengths) > SAME * max(lengths):
        return None
    x, y = (fine[0]["px"] - 0.5, fine[0]["py"] - 0.5) if len(fine) == 1 else (width / 2, height / 2)
    return Intrinsics(width=width, height=height, fx=lengths[0], fy=lengths[0], cx=x, cy=y)


def _annotation(
    o: Seen,
    category: Category,
    cads: Sequence[ForeignModel],
    picture: Listed,
    lens: Intrinsics | None,
    mask: str | None,
) -> ObjectAnnotation:
    """An object with its mask, model and pose; its `source` holds its COCO annotation."""
    x0, y0, x1, y1 = o.box
    source: dict[str, Any] = {"bbox": [x0, y0, x1 - x0, y1 - y0], "area": (x1 - x0) * (y1 - y0), **o.flags}
    source |= {"cad_index": o.cad, "viewpoint": dict(o.view)} if o.cad or o.view else {}
    source |= {"anchors": {name: status for name, (_, status) in o.anchors.items()}} if o.anchors else {}
    info = cads[o.cad - 1].info if 0 < o.cad <= len(cads) else None
    known: dict[str, Any] = {"key": info.key if info else "", **_standing(o, info and info.box3d_object, lens)}
    assert o.id is not None
    return foreign_object(o.id, category, picture.size, source, mask, o.box, box2d=o.box, extra=_keypoints(o), **known)


def _masks(file: Path, seen: Sequence[Seen]) -> Iterator[str | None]:
    """The run-length code of each object's mask; None for an empty mask, or one that belongs to another object by its box."""
    numbers = numbers_of(file)
    found = boxes_of(numbers)
    for o, number in zip(seen, numbered([(o.place, o.box) for o in seen], found), strict=True):
        is_own = number > 0 and (overlap(o.box, found[number]) >= ALIKE or _is_inside(found[number], o.box))
        yield encode_rle(numbers == number) if is_own else None


def _is_inside(one: Box, other: Box) -> bool:
    return all(one[i] >= other[i] - NEAR and one[i + 2] <= other[i + 2] + NEAR for i in (0, 1))


def _keypoints(o: Seen) -> dict[str, Any]:
    places = [(math.nan, math.nan) if place is None else (place[0] - 0.5, place[1] - 0.5) for place, _ in o.anchors.values()]
    return {
        "keypoint_names": tuple(o.anchors),
        "keypoints": np.array(places, np.float64).reshape(-1, 2),
        "keypoint_states": np.array([STATES.get(status, 3) for _, status in o.anchors.values()], np.int64),
    }


def _standing(o: Seen, box: Float | None, lens: Intrinsics | None) -> dict[str, Any]:
    """Return the known fields of an object's position: its pose, only a coarse view, or nothing."""
    motion = o.motion if o.motion is not None else _turned(o.view, lens) if o.is_fine and lens is not None else None
    if motion is not None:
        pose = rigid(motion[:, :3], motion[:, 3])
        return placed(np.full((8, 3), np.nan) if box is None else box, pose, np.eye(4), lens)
    names = ("azimuth", "elevation") if o.is_fine else ("azimuth_coarse", "elevation_coarse")
    azimuth, elevation = (o.view.get(name, math.nan) for name in names)
    if math.isnan(azimuth + elevation):
        return {}
    distance, tilt = (o.view["distance"], o.view["theta"]) if o.is_fine else (math.nan, math.nan)
    view = ObjectView(azimuth % 360, elevation, distance, tilt)
    return {"view": view, "pose_category": pose_category(view.azimuth_deg, elevation)}


def _turned(view: Mapping[str, float], lens: Intrinsics) -> Float:
    """RT (3, 4) of a viewpoint: the camera looks at the model from there, and is turned the shortest way that puts the model's
    origin at px, py.
    """
    angles = (math.radians(view[name]) for name in ("azimuth", "elevation", "theta"))
    y = (view["py"] - 0.5 - lens.cy) / lens.fy
    ray = np.array([(view["px"] - 0.5 - lens.cx - lens.skew * y) / lens.fx, y, 1.0])
    ray /= math.sqrt(float((ray * ray).sum()))
    return np.column_stack([product(_shortest(ray), orbit_rotation(*angles)), ray * view["distance"]])


def _shortest(ray: Float) -> Float:
    """The rotation (3, 3) that takes +z to a unit vector ahead by the shortest way."""
    x, y, z = ray.tolist()
    k = 1 / (1 + z)
    return np.array([[1 - k * x * x, -k * x * y, x], [-k * x * y, 1 - k * y * y, y], [-x, -y, z]])
