"""COLMAP's text model: `cameras.txt` and `images.txt` of a folder (https://colmap.github.io/format.html)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from viewsphere.composing.viewpoints.pose_files.entries import Extrinsics, PoseFile
from viewsphere.composing.viewpoints.pose_files.lens import one_lens
from viewsphere.composing.viewpoints.pose_files.lines import (
    IDENTIFIER,
    counted,
    number,
    numbers,
    picture_size,
    read_lines,
    read_text,
)
from viewsphere.composing.viewpoints.pose_files.motions import from_quaternion, motion
from viewsphere.errors import RecipeError
from viewsphere.geometry.lenses import LensParameters, opencv_parameters
from viewsphere.geometry.lenses.shared.programs.colmap import PARAMETERS, own_lens
from viewsphere.geometry.rotation import transform
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.validation.errors import told_of

MOST_IN_ONE_LINE = 10
"""Words of an image's line in images.txt; the last is the name, which may have spaces."""


def read_colmap(path: Path) -> PoseFile:
    """Images in the order of their names, with the lens they share; the pixel origin is the image's corner, as here.

    `path` is the folder, or its images.txt. COLMAP's world has no defined up axis; usually y points down.
    """
    folder = path if path.is_dir() else path.parent
    cameras = colmap_cameras(_camera_lines(folder / "cameras.txt"))
    images = sorted(_images(folder / "images.txt"), key=lambda image: image[0])
    for name, camera, _ in images:
        if camera not in cameras:
            raise RecipeError(f"{folder / 'images.txt'}: image {name}: expected a camera of cameras.txt; found {camera}")
    lens = one_lens([cameras[camera] for _, camera, _ in images], str(folder))
    return PoseFile(tuple(m for _, _, m in images), up="-y", intrinsics=lens)


def _camera_lines(file: Path) -> list[tuple[list[str], str]]:
    lines = [(words, f"{file}:{line}") for line, words in read_lines(file)]
    for words, where in lines:
        if len(words) < 5 or not IDENTIFIER.fullmatch(words[0]):
            raise RecipeError(f"{where}: expected CAMERA_ID MODEL WIDTH HEIGHT PARAMS; found {len(words)} other words")
    return lines


def colmap_cameras(lines: Iterable[tuple[Sequence[str], str]]) -> dict[int, Intrinsics]:
    """The lens of each line CAMERA_ID MODEL WIDTH HEIGHT PARAMS, with the line's place for messages, by the camera's number."""
    cameras: dict[int, Intrinsics] = {}
    for words, where in lines:
        if (camera := int(words[0])) in cameras:
            raise RecipeError(f"{where}: expected every camera once; found {camera} again: give each its own number")
        cameras[camera] = _camera(words, where)
    return cameras


def _camera(words: Sequence[str], where: str) -> Intrinsics:
    """The lens of a line CAMERA_ID MODEL WIDTH HEIGHT PARAMS; raises RecipeError, beginning with `where`, for invalid ones."""
    model = words[1]
    if model not in PARAMETERS:
        raise RecipeError(f"{where}: expected one of {', '.join(PARAMETERS)}; found {model:.40}: undistort the images first")
    names = PARAMETERS[model][1].split()
    width, height = picture_size(words[2], words[3], where)
    p = dict(zip(names, counted(words[4:], len(names), where), strict=True))
    fx = p.get("fx", p.get("f", p.get("w", 0.0)))
    if fx <= 0:
        raise RecipeError(f"{where}: expected a focal length above 0; found {fx:g}")
    with told_of(where):
        if own := own_lens(model, tuple(p.values())):
            return Intrinsics(width=width, height=height, **own._asdict())
        return Intrinsics(
            width=width, height=height, fx=fx, fy=p.get("fy", fx), cx=p["cx"], cy=p["cy"], distortion=_distortion(model, p)
        )


def _distortion(model: str, p: dict[str, float]) -> LensParameters | None:
    k1, k2, k3, k4, k5, k6, p1, p2 = (p.get(n, 0.0) for n in ("k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2"))
    if model.endswith("FISHEYE"):
        return opencv_parameters((k1, k2, k3, k4), is_fisheye=True)
    if not any((k1, k2, k3, k4, k5, k6, p1, p2)):
        return None
    coefficients = (k1, k2, p1, p2, k3, k4, k5, k6) if any((k4, k5, k6)) else (k1, k2, p1, p2, k3)
    return opencv_parameters(coefficients)


def _images(file: Path) -> list[tuple[str, int, Extrinsics]]:
    """Name, camera and motion of every image. Each has two lines; the second, its points, may be empty."""
    images: list[tuple[str, int, Extrinsics]] = []
    is_points = False
    for line, text in enumerate(read_text(file).splitlines(), 1):
        if text.lstrip().startswith("#"):
            continue
        if is_points:
            is_points = False
            continue
        words = text.split(maxsplit=MOST_IN_ONE_LINE - 1)
        if not words:
            continue
        is_points = True
        images.append(_image(words, f"{file}:{line}"))
    return images


def _image(words: Sequence[str], where: str) -> tuple[str, int, Extrinsics]:
    """IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME: world to camera."""
    if len(words) < MOST_IN_ONE_LINE or not IDENTIFIER.fullmatch(words[8]):
        raise RecipeError(f"{where}: expected IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME; found {len(words)} other words")
    number(words[0], where)
    quaternion, t = numbers(words[1:5], where), np.array(numbers(words[5:8], where))
    rotation = from_quaternion(quaternion, where)
    return words[9].strip(), int(words[8]), motion(rotation.T, -transform(rotation.T, t), where)
