"""Reads transforms.json of nerfstudio and instant-ngp, and NeRF's synthetic scenes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path, PurePosixPath
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import StoreError
from viewsphere.files import read_bytes
from viewsphere.formats.nerfstudio.synthetic import SPLITS
from viewsphere.formats.shared.reading.image_lists import MISTAKES, one_line
from viewsphere.formats.shared.reading.posed_pictures import (
    Posed,
    camera_of,
    check_picture,
    picture_inside,
    posed_dataset,
    without_world,
)
from viewsphere.geometry.lenses import LensParameters, opencv_parameters
from viewsphere.geometry.lenses.shared.programs.nerfstudio import OWN, own_lens
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.store.foreign import ForeignDataset
from viewsphere.store.paths import file_inside, is_name
from viewsphere.store.texts import parsed

MODELS = ("OPENCV", "OPENCV_FISHEYE", "PINHOLE", "SIMPLE_PINHOLE", *OWN)


def read(path: Path, *, keep_going: bool = False) -> ForeignDataset:
    """Return every picture of a world's folder, or of one of its files, with cameras and depth; no objects.

    Splits are the file's lists, or come from transforms_<split>.json; otherwise all pictures are `train`. Values beside the
    frames in the file are defaults for its frames. Raises StoreError with every frame that lacks its picture, its lens or its
    pose; with `keep_going` these are left out and reported.
    """
    files = transforms_files(path)
    problems: list[str] = []
    found: dict[Path, Posed] = {}
    for file in files:
        for one in _pictures(file, problems):
            found.setdefault(one.file, one)
    return posed_dataset(path, list(found.values()), files, problems, keep_going)


def transforms_files(folder: Path) -> list[Path]:
    """The transforms.json of a folder, or else its files by split, train first. A file stands for itself. Raises StoreError if
    there are none.
    """
    if folder.is_file():
        return [folder]
    whole = folder / "transforms.json"
    found = [whole] if whole.is_file() else sorted(folder.glob("transforms_*.json"), key=lambda file: _rank(_split(file)))
    if not found:
        raise without_world(folder, "transforms.json, or transforms_train.json", "transforms*.json")
    return found


def _split(file: Path) -> str:
    return file.stem.removeprefix("transforms").removeprefix("_") or SPLITS[0]


def _rank(split: str) -> tuple[int, str]:
    return (SPLITS.index(split) if split in SPLITS else len(SPLITS), split)


def _pictures(file: Path, problems: list[str]) -> Iterator[Posed]:
    for number, said, lists in said_frames(file):
        try:
            yield _picture(file, said, lists)
        except MISTAKES as error:
            problems.append(f"{file}: frame number {number}: {one_line(error)}")


def said_frames(file: Path) -> Iterator[tuple[int, Mapping[str, Any], Mapping[str, set[str]]]]:
    """The number of each frame, its values including the file's defaults, and the files listed for each split. Raises
    StoreError for a file of another structure.
    """
    try:
        data = parsed(read_bytes(file, "MAX_RECORD_BYTES"))
    except (OSError, ValueError) as error:
        raise StoreError(f"{file}: expected JSON; found: {error}") from None
    if not isinstance(data, dict) or not isinstance(cast(dict[str, Any], data).get("frames"), list):
        raise StoreError(f"{file}: expected a mapping with a list of frames; found another")
    whole = cast(dict[str, Any], data)
    lists = {split: _names(file, whole, f"{split}_filenames") for split in reversed(SPLITS)}
    for number, frame in enumerate(cast(list[Any], whole["frames"])):
        yield number, {**whole, **frame} if isinstance(frame, dict) else {}, lists


def _names(file: Path, whole: Mapping[str, Any], field: str) -> set[str]:
    listed = whole.get(field) or []
    if not isinstance(listed, list):
        raise StoreError(f"{file}: expected {field}, a list of names; found {listed!r:.60}")
    return set(map(str, cast(list[Any], listed)))


def _picture(file: Path, said: Mapping[str, Any], lists: Mapping[str, set[str]]) -> Posed:
    name = name_of(said)
    place, size = picture_inside(file.parent, name.removeprefix("./"), ".png", ".jpg")
    lens = lens_of(said, size)
    check_picture(size, lens)
    split, pose = split_of(file, name, lists), pose_said(said)
    mapped, step = said.get("depth_file_path"), 0.001
    if mapped is None and "integer_depth_scale" in said:
        mapped, step = said.get("depth_path"), _number(said, "integer_depth_scale", step)
    depth = None if mapped is None else file_inside(file.parent, str(mapped))
    if depth is not None and not (depth.is_file() and step > 0):
        raise ValueError(f"expected depth in steps of more than 0 metres; found {mapped}, {step:g}")
    return Posed(place, camera_of(lens, pose), split, depth=depth, step=step)


def name_of(said: Mapping[str, Any]) -> str:
    """The path of a frame's picture. Raises ValueError if it has none."""
    name = said["file_path"]
    if not isinstance(name, str) or not PurePosixPath(name).parts:
        raise ValueError(f"expected a file_path; found {name!r:.60}")
    return name


def split_of(file: Path, name: str, lists: Mapping[str, set[str]]) -> str:
    """The split of a picture, from the lists, its folder or the file's name. Raises ValueError for an invalid name."""
    folder = PurePosixPath(name).parts[0]
    split = next((split for split in SPLITS if name in lists.get(split, ())), folder if folder in SPLITS else _split(file))
    if not is_name(split):
        raise ValueError(f"expected a split's name; found {split!r:.60}")
    return split


def pose_said(said: Mapping[str, Any]) -> NDArray[np.float64]:
    """The pose of a frame, world_from_camera (3, 4), OpenCV's axes; raises ValueError for any other matrix."""
    try:
        pose = np.array(said["transform_matrix"], np.float64)
    except (TypeError, ValueError):
        pose = np.zeros(0)
    if pose.shape not in ((3, 4), (4, 4)):
        raise ValueError(f"expected a transform_matrix of 4 x 4 numbers; found {said['transform_matrix']!r:.60}")
    return pose[:3] * (1.0, -1.0, -1.0, 1.0)


def _number(said: Mapping[str, Any], name: str, other: float) -> float:
    """Return the value of this name as a number, by default the other one; raises ValueError for a value that is not a
    number.
    """
    value = other if said.get(name) is None else said[name]
    if not isinstance(value, (int, float)) or not abs(value) < math.inf:
        raise ValueError(f"expected {name}, a number; found {value!r:.60}")
    return float(value)


def lens_of(said: Mapping[str, Any], size: tuple[int, int]) -> Intrinsics:
    """The lens of a frame whose picture has this size. Raises ValueError for a lens that viewsphere does not support."""
    width, height = (int(_number(said, name, own)) for name, own in zip("wh", size, strict=True))
    fx, angle = _number(said, "fl_x", 0.0), _number(said, "camera_angle_x", 0.0)
    if not (fx or angle):
        raise ValueError("expected fl_x, or camera_angle_x; found neither")
    fx = fx or width / 2 / math.tan(angle / 2)
    cx, cy = _number(said, "cx", width / 2), _number(said, "cy", height / 2)
    model = "OPENCV_FISHEYE" if said.get("is_fisheye") else said.get("camera_model", "OPENCV")
    if model not in MODELS:
        raise ValueError(f"expected a camera_model of {', '.join(MODELS)}; found {model!r:.60}")
    size_of = {"width": width, "height": height}
    fy = _number(said, "fl_y", 0.0) or fx
    if model in OWN:
        return Intrinsics(**size_of, **own_lens(model, (fx, fy, cx, cy), said.get("distortion_params") or ())._asdict())
    k1, k2, k3, k4, p1, p2 = (_number(said, name, 0.0) for name in ("k1", "k2", "k3", "k4", "p1", "p2"))
    bent: LensParameters | None = None
    if model == "OPENCV_FISHEYE":
        bent = opencv_parameters((k1, k2, k3, k4), is_fisheye=True)
    elif k4:
        raise ValueError(f"expected lenses without k4; found {k4:g}: undistort the pictures first")
    elif any((k1, k2, k3, p1, p2)):
        bent = opencv_parameters((k1, k2, p1, p2, k3) if k3 else (k1, k2, p1, p2))
    return Intrinsics(**size_of, fx=fx, fy=fy, cx=cx, cy=cy, distortion=bent, rolling=None)
