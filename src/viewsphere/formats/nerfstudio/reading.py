"""Reads transforms.json of nerfstudio and instant-ngp, and NeRF's synthetic scenes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path, PurePosixPath
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import StoreError
from viewsphere.formats._listed import MISTAKES, one_line
from viewsphere.formats._posed import Posed, camera_of, check_picture, picture_inside, posed_dataset
from viewsphere.formats.nerfstudio.synthetic import SPLITS
from viewsphere.model.camera import Distortion, Intrinsics
from viewsphere.store.foreign import ForeignDataset
from viewsphere.store.paths import file_inside, is_name
from viewsphere.store.texts import parsed

MODELS = ("OPENCV", "OPENCV_FISHEYE", "PINHOLE", "SIMPLE_PINHOLE")


def read(path: Path, *, keep_going: bool = False) -> ForeignDataset:
    """All pictures of a world's folder, or of one of its files, with cameras and depth; no objects.

    Splits are those of the file's lists, or of transforms_<split>.json; without these all is `train`. What the file says beside
    the frames counts where a frame does not say it. Raises StoreError with every frame that lacks its picture, its lens or its
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
    """transforms.json of a folder, else a file a split, train first; a file itself. Raises StoreError where there is none."""
    if folder.is_file():
        return [folder]
    whole = folder / "transforms.json"
    found = [whole] if whole.is_file() else sorted(folder.glob("transforms_*.json"), key=lambda file: _rank(_split(file)))
    if not found:
        raise StoreError(f"{folder}: expected transforms.json, or transforms_train.json; found neither")
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
    """The number of each frame, what is said of it or beside the frames, and the files that are listed of each split. Raises
    StoreError for a file of another structure.
    """
    try:
        data = parsed(file.read_bytes())
    except (OSError, ValueError) as error:
        raise StoreError(f"{file}: expected JSON; found: {error}") from None
    if not isinstance(data, dict) or not isinstance(cast(dict[str, Any], data).get("frames"), list):
        raise StoreError(f"{file}: expected a mapping with a list of frames; found another")
    whole = cast(dict[str, Any], data)
    lists = {split: set(map(str, whole.get(f"{split}_filenames") or ())) for split in reversed(SPLITS)}
    for number, frame in enumerate(cast(list[Any], whole["frames"])):
        yield number, {**whole, **frame} if isinstance(frame, dict) else {}, lists


def _picture(file: Path, said: Mapping[str, Any], lists: Mapping[str, set[str]]) -> Posed:
    name = str(said["file_path"])
    place, size = picture_inside(file.parent, name.removeprefix("./"), ".png", ".jpg")
    lens = lens_of(said, size)
    check_picture(size, lens)
    split, pose = split_of(file, name, lists), pose_said(said)
    mapped, step = said.get("depth_file_path"), 0.001
    if mapped is None and "integer_depth_scale" in said:
        mapped, step = said.get("depth_path"), float(said["integer_depth_scale"])
    depth = None if mapped is None else file_inside(file.parent, str(mapped))
    if depth is not None and not (depth.is_file() and step > 0):
        raise ValueError(f"expected depth in steps of more than 0 metres; found {mapped}, {step:g}")
    return Posed(place, camera_of(lens, pose), split, depth=depth, step=step)


def split_of(file: Path, name: str, lists: Mapping[str, set[str]]) -> str:
    """The split of the picture of a name; raises ValueError for one that is no name."""
    folder = PurePosixPath(name).parts[0]
    split = next((split for split in SPLITS if name in lists.get(split, ())), folder if folder in SPLITS else _split(file))
    if not is_name(split):
        raise ValueError(f"expected a split's name; found {split!r:.60}")
    return split


def pose_said(said: Mapping[str, Any]) -> NDArray[np.float64]:
    """The pose of a frame, world_from_camera (3, 4), OpenCV's axes; raises ValueError for another matrix."""
    pose = np.array(said["transform_matrix"], np.float64)
    if pose.shape not in ((3, 4), (4, 4)):
        raise ValueError(f"expected a transform_matrix of 4 x 4; found {pose.shape}")
    return pose[:3] * (1.0, -1.0, -1.0, 1.0)


def lens_of(said: Mapping[str, Any], size: tuple[int, int]) -> Intrinsics:
    """The lens of a frame, whose picture has a size; raises ValueError for one that viewsphere does not have."""
    width, height = int(said.get("w", size[0])), int(said.get("h", size[1]))
    fx = said.get("fl_x") or width / 2 / math.tan(float(said["camera_angle_x"]) / 2)
    cx, cy = said.get("cx", width / 2), said.get("cy", height / 2)
    model = "OPENCV_FISHEYE" if said.get("is_fisheye") else said.get("camera_model", "OPENCV")
    if model not in MODELS:
        raise ValueError(f"expected a camera_model of {', '.join(MODELS)}; found {model!r:.60}")
    k1, k2, k3, k4, p1, p2 = (float(said.get(name, 0.0)) for name in ("k1", "k2", "k3", "k4", "p1", "p2"))
    bent: Distortion | None = None
    if model == "OPENCV_FISHEYE":
        bent = Distortion(model="fisheye", coefficients=(k1, k2, k3, k4))
    elif k4:
        raise ValueError(f"expected lenses without k4; found {k4:g}: undistort the pictures first")
    elif any((k1, k2, k3, p1, p2)):
        bent = Distortion(model="brown_conrady", coefficients=(k1, k2, p1, p2, k3) if k3 else (k1, k2, p1, p2))
    size_of = {"width": width, "height": height}
    return Intrinsics(**size_of, fx=fx, fy=said.get("fl_y") or fx, cx=cx, cy=cy, distortion=bent)
