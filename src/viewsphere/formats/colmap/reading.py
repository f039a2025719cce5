"""Reads COLMAP's sparse models, text and binary: lenses, poses and pictures."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import StoreError
from viewsphere.files import read_bytes, read_text
from viewsphere.formats.shared.reading.as_recipe import cameras_again, pose_of
from viewsphere.formats.shared.reading.image_lists import MISTAKES, one_line
from viewsphere.formats.shared.reading.posed_pictures import (
    MOST,
    Posed,
    camera_of,
    check_picture,
    picture_inside,
    posed_dataset,
    without_world,
)
from viewsphere.geometry.lenses import LensParameters, opencv_parameters
from viewsphere.geometry.lenses.shared.programs.colmap import NAMES, PARAMETERS, own_lens
from viewsphere.geometry.rotation import matrix_from_quaternion, transform
from viewsphere.model.listed import ListedShot
from viewsphere.model.model_spec import Axis
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.store.foreign import ForeignDataset
from viewsphere.store.paths import is_name
from viewsphere.store.source_cameras import SourceCameras, refuse_any

_FOLDERS = ("", "sparse/0", "sparse", "dense/0", "dense")
"""The folders in which COLMAP's programs put meshes, relative to the folder of the data set."""

OWN = {"cameras", "images", "points3D", "rigs", "frames"}


@dataclass(frozen=True)
class _Image:
    """An image's pose, cam_from_world, as quaternion w, x, y, z and translation; its camera's number and its file."""

    pose: tuple[float, ...]
    camera: int
    name: str


def read(path: Path, *, keep_going: bool = False) -> ForeignDataset:
    """Return every image of a folder with `sparse/0` and `images`, or of such a `sparse/0`, in the order of their names, with
    cameras. There are no objects and no points.

    Splits are the lists in `<split>.txt` beside the model; without lists, all images are `train`. The world's axes are
    COLMAP's. Raises StoreError with every image that lacks its picture or its camera; with `keep_going` these are left out and
    reported.
    """
    model = read_model(path)
    folder = model.cameras.parent
    root = next((one for one in (path, folder.parent, folder.parent.parent) if (one / "images").is_dir()), path)
    problems: list[str] = []
    found: list[Posed] = []
    for image in model.images:
        try:
            lens, pose, split = model.view(image)
            file, size = picture_inside(root / "images", image.name)
            check_picture(size, lens)
            found.append(Posed(file, camera_of(lens, pose), split))
        except MISTAKES as error:
            problems.append(f"{model.file}: image {image.name!r:.80}: {one_line(error)}")
    texts = [model.cameras, model.file, *(file for file in sorted(folder.glob("*.txt")) if file.stem not in OWN)]
    return posed_dataset(path, found, texts, problems, keep_going)


@dataclass(frozen=True)
class _Model:
    """A sparse model: its files of cameras and images, lenses by number, images by name, and the splits of listed images."""

    cameras: Path
    file: Path
    lenses: dict[int, Intrinsics]
    images: tuple[_Image, ...]
    splits: dict[str, str]

    def view(self, image: _Image) -> tuple[Intrinsics, NDArray[np.float64], str]:
        """An image's lens, its pose, world_from_camera (3, 4), and its split; raises ValueError if either is missing."""
        split = self.splits.get(image.name, "train")
        if image.camera not in self.lenses:
            raise ValueError(f"found no camera {image.camera}")
        if not is_name(split):
            raise ValueError(f"expected a split's name; found {split!r:.60}")
        if not (np.abs(image.pose) < MOST).all() or max(map(abs, image.pose[:4])) < 1 / MOST:
            raise ValueError(f"expected a rotation, and a place within {MOST:g}; found {' '.join(map(str, image.pose)):.60}")
        rotation, t = matrix_from_quaternion(image.pose[:4]), np.array(image.pose[4:])
        return self.lenses[image.camera], np.column_stack((rotation.T, -transform(rotation.T, t))), split


def read_model(path: Path) -> _Model:
    """The sparse model in a folder, its images in the order of their names. Raises StoreError if there is no model."""
    files = next(filter(None, map(_files, (path / "sparse" / "0", path / "sparse", path))), None)
    if files is None:
        raise without_world(path, "sparse/0 with cameras and images as .txt or .bin", "sparse/0/cameras.*", "cameras.*")
    cameras_file, images_file = files
    folder = cameras_file.parent
    splits = {name: file.stem for file in sorted(folder.glob("*.txt")) if file.stem not in OWN for name in _lines(file)}
    try:
        binary = cameras_file.suffix == ".bin"
        read_cameras, read_images = (_binary_cameras, _binary_images) if binary else (_text_cameras, _text_images)
        lenses = {number: _lens(name, size, values) for number, name, size, values in read_cameras(cameras_file)}
        images = sorted(read_images(images_file), key=lambda image: image.name)
    except struct.error:
        raise StoreError(f"{folder}: expected a model of COLMAP's; found a file that is cut off") from None
    except MISTAKES as error:
        raise StoreError(f"{folder}: expected a model of COLMAP's; found: {one_line(error)}") from None
    return _Model(cameras_file, images_file, lenses, tuple(images), splits)


def _files(folder: Path) -> tuple[Path, Path] | None:
    """A model's files of cameras and images, preferably binary; None if there are none."""
    for ending in (".bin", ".txt"):
        cameras, images = folder / f"cameras{ending}", folder / f"images{ending}"
        if cameras.is_file() and images.is_file():
            return cameras, images
    return None


def _lens(model: str, size: tuple[int, int], values: Sequence[float]) -> Intrinsics:
    names = PARAMETERS[model][1].split() if model in PARAMETERS else ()
    if not names or len(values) != len(names):
        raise ValueError(f"expected one of {', '.join(PARAMETERS)} with its parameters; found {model} with {len(values)}")
    p = dict(zip(names, values, strict=True))
    k1, k2, k3, k4, k5, k6, p1, p2 = (p.get(name, 0.0) for name in ("k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2"))
    bent: LensParameters | None = None
    if own := own_lens(model, values):
        return Intrinsics(width=size[0], height=size[1], **own._asdict())
    if model.endswith("FISHEYE"):
        bent = opencv_parameters((k1, k2, k3, k4), is_fisheye=True)
    elif any((k1, k2, k3, k4, k5, k6, p1, p2)):
        count = 8 if any((k4, k5, k6)) else 5 if k3 else 4
        bent = opencv_parameters((k1, k2, p1, p2, k3, k4, k5, k6)[:count])
    fx = p.get("fx", p.get("f", 0.0))
    return Intrinsics(width=size[0], height=size[1], fx=fx, fy=p.get("fy", fx), cx=p["cx"], cy=p["cy"], distortion=bent)


def _lines(file: Path) -> list[str]:
    """Lines other than comments."""
    try:
        text = read_text(file, "MAX_RECORD_BYTES")
    except (OSError, ValueError) as error:
        raise StoreError(f"{file}: expected text; found: {error}") from None
    return [line.strip() for line in text.splitlines() if not line.lstrip().startswith("#")]


def _text_cameras(file: Path) -> Iterator[tuple[int, str, tuple[int, int], list[float]]]:
    for line in filter(None, _lines(file)):
        words = line.split()
        try:
            number, width, height, *values = int(words[0]), int(words[2]), int(words[3]), *map(float, words[4:])
        except (IndexError, ValueError):
            raise ValueError(f"expected CAMERA_ID MODEL WIDTH HEIGHT and numbers; found {line!r:.60}") from None
        yield number, words[1], (width, height), values


def _text_images(file: Path) -> Iterator[_Image]:
    """The images of a text file. Each has two lines; the second one, its points, may be empty."""
    lines = iter(_lines(file))
    for line in filter(None, lines):
        words = line.split(maxsplit=9)
        try:
            image = _Image(tuple(map(float, words[1:8])), int(words[8]), words[9])
        except (IndexError, ValueError):
            raise ValueError(f"expected IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME; found {line!r:.60}") from None
        yield image
        next(lines, None)


def _binary_cameras(file: Path) -> Iterator[tuple[int, str, tuple[int, int], list[float]]]:
    data, at = read_bytes(file, "MAX_RECORD_BYTES"), 8
    for _ in range(struct.unpack_from("<Q", data)[0]):
        number, model, width, height = struct.unpack_from("<IiQQ", data, at)
        name = NAMES.get(model, str(model))
        count = len(PARAMETERS[name][1].split()) if name in PARAMETERS else 0
        yield number, name, (width, height), list(struct.unpack_from(f"<{count}d", data, at + 24))
        at += 24 + 8 * count


def _binary_images(file: Path) -> Iterator[_Image]:
    data, at = read_bytes(file, "MAX_RECORD_BYTES"), 8
    for _ in range(struct.unpack_from("<Q", data)[0]):
        _, *pose, camera = struct.unpack_from("<I7dI", data, at)
        end = data.find(b"\0", at + 64)
        if end < 0:
            raise ValueError("a name that is cut off")
        yield _Image(tuple(pose), camera, data[at + 64 : end].decode())
        at = end + 9 + 24 * struct.unpack_from("<Q", data, end + 1)[0]


def source_cameras(path: Path) -> SourceCameras:
    """Return every camera of a folder with `sparse/0`, or of such a `sparse/0`, text or binary, in the order of their images'
    names.

    Pictures are not required. Up is the axis of the world that is nearest to the cameras' mean up. Raises StoreError if there
    is no model, for an image without its camera, and for a lens that viewsphere does not support.
    """
    model = read_model(path)
    problems: list[str] = []
    shots: list[ListedShot] = []
    for image in model.images:
        try:
            lens, pose, split = model.view(image)
            camera_of(lens, pose)
            shots.append(ListedShot(split=split, image=image.name, world_from_camera=pose_of(pose), camera=lens))
        except MISTAKES as error:
            problems.append(f"{model.file}: image {image.name!r:.80}: {one_line(error)}")
    refuse_any(problems)
    return cameras_again(path, tuple(shots), path, _FOLDERS, "colmap", _nearest_up(shots))


def _nearest_up(shots: Sequence[ListedShot]) -> Axis:
    """The axis of the world that is nearest to the cameras' mean up direction."""
    up = -np.array([np.array(shot.world_from_camera)[:3, 1] for shot in shots]).reshape(-1, 3).sum(axis=0)
    axes: tuple[tuple[Axis, Axis], ...] = (("+x", "-x"), ("+y", "-y"), ("+z", "-z"))
    largest = int(np.abs(up).argmax())
    return axes[largest][int(up[largest] < 0)]
