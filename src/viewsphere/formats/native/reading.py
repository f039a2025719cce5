"""Reads data sets in the layout of Ruiz et al. 2019, made by their tool or by viewsphere."""

from __future__ import annotations

import hashlib
import math
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path, PurePosixPath
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from viewsphere.codecs.size import opened
from viewsphere.errors import StoreError, UserError
from viewsphere.files import read_bytes
from viewsphere.formats.shared.reading.image_lists import MISTAKES, one_line
from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.lenses import read_parameters
from viewsphere.geometry.mask import encode_rle, mask_box, mask_polygons
from viewsphere.labels import channels
from viewsphere.model.credit import Credit
from viewsphere.model.instant import Viewpoint
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.model.sensors.rolling import Rolling
from viewsphere.model.thing import TimeStep
from viewsphere.store import Category, ModelInfo, decode
from viewsphere.store.foreign import ForeignDataset, ForeignFrame, ForeignModel, foreign_object, refuse_broken
from viewsphere.store.paths import file_inside, files_inside, is_name
from viewsphere.store.texts import parsed

RIGHT_ANGLES = 1e-3
"""Largest deviation from orthogonality of an imported rotation, whose digits may be few."""
LONGEST_NAME = 150
"""Longest name of a split or model, in bytes: file names have at most 255, and the export adds to them."""
LARGEST_POSE = 10_000_000
"""Limit of a pose's number in an imported file; larger ones are mistakes."""


def read(path: Path, *, keep_going: bool = False) -> ForeignDataset:
    """Return every frame of a folder with `dataset1.json`, with cameras and poses. Objects have their data from the JSON, their
    masks and their 3D boxes in pixels.

    A frame without a split is in `train`, and an object's category is its vehicle's. Raises StoreError with every entry that
    lacks a vehicle, a picture or a mask, or has no camera. With `keep_going` these entries are left out and reported.
    """
    file = path / "dataset1.json" if path.is_dir() else path
    vehicles, poses, digest = _load(file)
    categories = _categories(vehicles)
    problems: list[str] = []
    frames = tuple(_frames(file.parent, vehicles, poses, problems))
    models = tuple(_models(file.parent, vehicles, categories, problems))
    if not keep_going:
        refuse_broken(problems)
    if not frames:
        raise StoreError(f"{file}: expected frames that can be used; found none")
    return ForeignDataset(
        name=file.parent.resolve().name,
        digest=hashlib.sha256("\n".join([digest, *problems]).encode()).hexdigest() if problems else digest,
        categories=tuple(categories.values()),
        splits=tuple(dict.fromkeys(frame.split for frame in frames)),
        channels=("rgb", "depth") if all(frame.depth for frame in frames) else ("rgb",),
        count=len(frames),
        poses=1 + max(frame.pose.index for frame in frames),
        max_objects=max(len(frame.objects) for frame in frames),
        frames=partial(_samples, frames, categories),
        models=models,
        left_out=tuple(problems),
    )


@dataclass(frozen=True)
class _Frame:
    """One picture of the data set and its objects; every object is (model key, category, mask file, entry)."""

    split: str
    pose: Viewpoint
    camera: Camera
    rgb: Path
    depth: Path | None
    objects: tuple[tuple[str, str, Path, dict[str, Any]], ...]


def _load(file: Path) -> tuple[dict[str, Any], dict[str, Any], str]:
    try:
        text = read_bytes(file, "MAX_RECORD_BYTES")
        data = parsed(text, lambda _: None)  # NaN stands for unknown values
    except (OSError, ValueError) as error:
        raise StoreError(f"{file}: expected the native format's JSON; found: {error}") from None
    if not isinstance(data, dict) or not all(isinstance(data.get(k), dict) for k in ("vehicles", "poses")):
        raise StoreError(f"{file}: expected mappings of vehicles and poses; found something else")
    lists = cast(dict[str, dict[str, Any]], data)
    for key, vehicle in lists["vehicles"].items():
        if not isinstance(vehicle, dict) or not _is_name(key):
            raise StoreError(f"{file}: expected vehicles by names that a folder can have; found {key!r:.60}")
    return lists["vehicles"], lists["poses"], hashlib.sha256(text).hexdigest()


def _is_name(text: str) -> bool:
    """Return whether a text can name one folder, with room for the longer name that the folder has while it is written."""
    return is_name(text) and len(text.encode()) <= LONGEST_NAME


def _categories(vehicles: Mapping[str, Any]) -> dict[str, Category]:
    categories: dict[str, Category] = {}
    for vehicle in vehicles.values():
        name = str(vehicle.get("category") or "object")
        categories.setdefault(name, Category(len(categories) + 1, name, str(vehicle.get("supercategory") or "")))
    return categories


def _models(
    root: Path, vehicles: dict[str, Any], categories: Mapping[str, Category], problems: list[str]
) -> Iterator[ForeignModel]:
    """The models with existing files, each with its time steps if it deforms."""
    found = list(_vehicles(root, vehicles, categories, problems))
    steps: defaultdict[str, list[ModelInfo]] = defaultdict(list)
    for model in found:
        steps[model.info.track].append(model.info)
    known = {model.info.key for model in found if not model.info.track}
    for model in found:
        info = model.info
        if not info.track:
            yield replace(model, info=replace(info, steps=tuple(steps[info.key])))
        elif info.track not in known:  # a selection from a data set may lack the model itself
            known.add(info.track)
            yield replace(model, info=replace(info, key=info.track, track="", steps=tuple(steps[info.track])))


def _vehicles(
    root: Path, vehicles: dict[str, Any], categories: Mapping[str, Category], problems: list[str]
) -> Iterator[ForeignModel]:
    """The models with existing files, and the time steps of deforming ones."""
    for key, vehicle in vehicles.items():
        try:
            file = file_inside(root, str(vehicle.get("model_file")))
            if file.is_file():
                files = files_inside(root, file.parent)
                yield ForeignModel(_model(key, file, vehicle, categories[str(vehicle.get("category") or "object")]), files)
        except StoreError as error:
            problems.append(f"{root}: vehicle {key}: {error}")
        except MISTAKES as error:
            problems.append(f"{root}: vehicle {key}: expected its bbox3D_model, real_size and credit; {one_line(error)}")


def _model(key: str, file: Path, vehicle: dict[str, Any], category: Category) -> ModelInfo:
    box = _vertices(vehicle["bbox3D_model"], 3)
    if np.isnan(box).any():
        raise ValueError("found a box that lacks vertices")
    animation = str(vehicle.get("animation", ""))
    glb = file.with_name(animation) if _is_name(animation) else file.with_suffix(".glb")
    real = vehicle.get("real_size") or {}
    width, height, length = (real.get(side) for side in ("width", "height", "length"))
    return ModelInfo(
        key=key,
        category=category.name,
        supercategory=category.supercategory,
        category_id=category.id,
        obj=file.name,
        glb=glb.name if glb.is_file() else file.name,
        box3d_object=box,
        size=Box3d(box).size,
        real_size=(_number(width), _number(height), _number(length)) if width and height and length else None,
        parts=(),
        triangles=0,
        digest=hashlib.sha256(read_bytes(file, "MAX_RECORD_BYTES")).hexdigest(),
        step=TimeStep(frame=int(vehicle["frame"]), seconds=_number(vehicle.get("seconds", 0))) if animation else None,
        track=str(vehicle.get("id_track", "")) if animation else "",
        credit=Credit.model_validate(vehicle["credit"]) if "credit" in vehicle else None,
    )


def _frames(root: Path, vehicles: dict[str, Any], poses: dict[str, Any], problems: list[str]) -> Iterator[_Frame]:
    """The frames: objects that share a picture. A frame with any broken entry is left out."""
    for number, pose in poses.items():
        pictures: dict[str, list[tuple[str, dict[str, Any]]]] = {}
        try:
            for name, entry in pose.get("vehicles_rendered", {}).items():
                pictures.setdefault(str(entry.get("path_rgb")), []).append((name, entry))
        except AttributeError:
            problems.append(f"{root}: pose {number}: expected mappings of what was rendered; found something else")
            continue
        for entries in pictures.values():
            try:
                yield _frame(root, number, pose, entries, vehicles)
            except UserError as error:
                problems.append(f"{root}: pose {number}, {entries[0][0]}: {error}")
            except MISTAKES as error:
                problems.append(f"{root}: pose {number}, {entries[0][0]}: expected a frame that can be read; {one_line(error)}")


def _frame(
    root: Path, number: str, pose: dict[str, Any], entries: list[tuple[str, dict[str, Any]]], vehicles: dict[str, Any]
) -> _Frame:
    first = entries[0][1]
    folder = PurePosixPath(pose.get("folder", f"Pose-{number}"))
    matrix = first.get("transformation_matrix") or pose["transformation_matrix"]
    camera = _camera(matrix, first["render_resolution"], first.get("distortion"), first.get("rolling_shutter"))
    view: Mapping[str, Any] = first.get("viewpoint") or pose  # the paper's own files have one for each pose
    split = str(first.get("split") or "train")
    if not _is_name(split) or not 0 <= int(number) < LARGEST_POSE:
        raise ValueError(f"found pose {number} of split {split!r}")
    objects: list[tuple[str, str, Path, dict[str, Any]]] = []
    for name, entry in entries:
        key = str(entry.get("id_model", name))
        category = str(vehicles[key].get("category") or "object")
        objects.append((key, category, _picture(root, folder / "MASK" / entry["path_mask"], camera), entry))
        _known(entry)
    depth = file_inside(root, str(folder / "DEPTH" / str(first.get("path_depth"))))
    return _Frame(
        split=split,
        pose=Viewpoint(
            index=int(number),
            azimuth_deg=view["azimuth"],
            elevation_deg=view["elevation"],
            distance=abs(view["distance"]),
            tilt_deg=view.get("tilt", 0.0),
            category=view.get("pose_category", ""),
        ),
        camera=camera,
        rgb=_picture(root, folder / "RGB" / first["path_rgb"], camera),
        depth=depth if _is_depth(depth, camera) else None,
        objects=tuple(objects),
    )


def _picture(root: Path, relative: PurePosixPath, camera: Camera) -> Path:
    """The file of this path below `root`, if it is an image of the camera's size."""
    file = file_inside(root, str(relative))
    if not file.is_file():
        raise FileNotFoundError(f"found no {file}")
    with opened(file) as image:
        if image.size != (camera.width, camera.height):
            raise ValueError(f"found {file} of {image.size[0]} x {image.size[1]} pixels, not {camera.width} x {camera.height}")
    return file


def _is_depth(file: Path, camera: Camera) -> bool:
    """Return whether a file holds depth as viewsphere keeps it: metres along z, in any of its encodings."""
    try:
        array = decode(channels()["depth"], file)
    except UserError:
        return False
    return array.shape == (camera.height, camera.width)


def _camera(
    matrix: Mapping[str, Any],
    resolution: list[int],
    distortion: dict[str, Any] | None,
    shutter: dict[str, Any] | None,
) -> Camera:
    k, motion = np.array(matrix["K"], np.float64), np.array(matrix["RT"], np.float64)
    if k.shape != (3, 3) or motion.shape != (3, 4) or not (np.isfinite(k).all() and np.isfinite(motion).all()):
        raise ValueError("found no K (3, 3) and RT (3, 4) of numbers")
    rotation = motion[:, :3]
    if np.abs(rotation @ rotation.T - np.eye(3)).max() > RIGHT_ANGLES or np.linalg.det(rotation) < 0:
        raise ValueError("found an RT without a rotation")
    width, height = resolution
    size, bent = {"width": width, "height": height}, read_parameters(distortion or None)
    rolling = None if shutter is None else Rolling.model_validate(shutter)
    lens = Intrinsics(**size, fx=k[0, 0], fy=k[1, 1], cx=k[0, 2], cy=k[1, 2], skew=k[0, 1], distortion=bent, rolling=rolling)
    return Camera(lens, rotation, motion[:, 3])


def _samples(frames: tuple[_Frame, ...], categories: Mapping[str, Category]) -> Iterator[ForeignFrame]:
    for index, frame in enumerate(frames):
        size = frame.camera.width, frame.camera.height
        objects = tuple(
            _object(number, categories[category], key, _mask(mask, size), entry)
            for number, (key, category, mask, entry) in enumerate(frame.objects, 1)
        )
        files = {"rgb": frame.rgb, **({"depth": frame.depth} if frame.depth else {})}
        yield ForeignFrame(Sample(index, frame.split, frame.camera, frame.pose, objects, {}, {}), files)


def _object(number: int, category: Category, key: str, mask: NDArray[np.bool_], entry: dict[str, Any]) -> ObjectAnnotation:
    """An object; its `source` holds its entry in COCO's terms."""
    pixels, visibility, truncation = _known(entry)
    tight = mask_box(mask) or (0, 0, 0, 0)
    source = {
        "iscrowd": 0,
        "area": int(mask.sum()),
        "bbox": [tight[0], tight[1], tight[2] - tight[0], tight[3] - tight[1]],
        "segmentation": mask_polygons(mask),
        "bbox_3D_pxs": entry.get("bbox_3D_pxs"),
        "visibility": visibility,
        "truncation": truncation,
        "id_model": key,
    }
    return foreign_object(
        number,
        category,
        (mask.shape[1], mask.shape[0]),
        source,
        encode_rle(mask),
        None,
        key=key,
        track=str(entry.get("id_track", "")),
        box3d_pixels=pixels,
        box3d_in_front=~np.isnan(pixels[:, 0]),
        visibility=math.nan if visibility is None else visibility,
        truncation=math.nan if truncation is None else truncation,
    )


def _known(entry: dict[str, Any]) -> tuple[NDArray[np.float64], float | None, float | None]:
    """3D box in pixels (8, 2), visibility and truncation, as far as given. Raises an error for malformed values."""
    shares = entry.get("visibility"), entry.get("truncation")
    visibility, truncation = (None if share is None else _number(share) for share in shares)
    return _vertices(entry.get("bbox_3D_pxs"), 2), visibility, truncation


def _number(value: Any) -> float:
    """A finite number; raises ValueError or OverflowError for anything else, such as a text that Python reads as a number."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise ValueError(f"found {value!r:.40} where a finite number is expected")
    return float(value)


def _mask(file: Path, size: tuple[int, int]) -> NDArray[np.bool_]:
    try:
        with opened(file) as image:
            mask = np.asarray(image.convert("L")) > 127
    except (OSError, ValueError, SyntaxError, UserError) as error:
        raise StoreError(f"{file}: expected a mask; found: {error}") from None
    if mask.shape != (size[1], size[0]):
        raise StoreError(f"{file}: expected {size[0]} x {size[1]} pixels; found {mask.shape[1]} x {mask.shape[0]}")
    return mask


def _vertices(named: Mapping[str, Mapping[str, list[float] | None]] | None, size: int) -> NDArray[np.float64]:
    """A box's vertices (8, size) from {face: {vertex: [coordinates]}}, NaN where a vertex has none."""
    points = np.full((8, size), np.nan)
    for face in (named or {}).values():
        for vertex, point in face.items():
            if point is not None:
                points[int(vertex)] = point
    if np.isinf(points).any():
        raise ValueError("found an infinite vertex")
    return points
