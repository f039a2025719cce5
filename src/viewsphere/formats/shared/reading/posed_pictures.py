"""The import of pictures with known cameras from data sets of other tools into a store."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from viewsphere.codecs.png_tiff import decode_png, encode_png, encode_tiff
from viewsphere.codecs.size import opened
from viewsphere.errors import StoreError, UserError
from viewsphere.files import read_bytes
from viewsphere.formats.shared.cameras import world_from_camera
from viewsphere.geometry.rotation import transform
from viewsphere.model.instant import viewpoint_of
from viewsphere.model.sample import Sample
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.model.sensors.rig import CAMERA
from viewsphere.store.foreign import ForeignDataset, ForeignFrame, Loaded, refuse_broken
from viewsphere.store.paths import file_inside, is_name

RIGHT_ANGLES = 1e-3
MOST = 1e9
"""Upper limit of every number of a pose."""


@dataclass(frozen=True)
class Posed:
    """A picture's file, its camera, and its place in the data set; and its depth: a 16-bit file along z, of panoramas along the
    ray, in steps of this many metres, 0 if unknown.
    """

    file: Path
    camera: Camera
    split: str = "train"
    sequence: str = ""
    sensor: str = CAMERA
    instant: int = 0
    time: float = 0.0
    depth: Path | None = None
    step: float = 0.001

    @property
    def distance(self) -> str:
        """The channel of its depth."""
        (name,) = self.camera.lens.channels(("depth",))
        return name


def without_world(path: Path, expected: str, *patterns: str) -> StoreError:
    """Return the error for a folder that lacks the expected files; it names the worlds in the folder, by their files'
    patterns.
    """
    found = sorted({file.relative_to(path).parts[0] for pattern in patterns for file in path.glob(f"*/{pattern}")})
    names = ", ".join(name for name in found if is_name(name))
    worlds = f"worlds in {names:.200}: give one of these" if names else "none"
    return StoreError(f"{path}: expected {expected}; found {worlds}")


def camera_of(lens: Intrinsics, pose: NDArray[np.float64]) -> Camera:
    """The camera of a pose, world_from_camera (3 or 4, 4), OpenCV's axes; raises ValueError for a pose that is not rigid."""
    turn, center = np.array(pose[:3, :3], np.float64), np.array(pose[:3, 3], np.float64)
    if not (np.abs(pose) < MOST).all() or np.abs(turn @ turn.T - np.eye(3)).max() > RIGHT_ANGLES or np.linalg.det(turn) < 0:
        raise ValueError("expected a rigid pose; found another")
    rotation = np.ascontiguousarray(turn.T)
    return Camera(lens, rotation, -transform(rotation, center))


def picture_inside(root: Path, relative: str, *endings: str) -> tuple[Path, tuple[int, int]]:
    """A picture below a folder, by its path with or without one of the endings, and its width and height."""
    names = [relative, *(relative + ending for ending in endings)]
    file = next((file for file in (file_inside(root, name) for name in names) if file.is_file()), None)
    if file is None:
        raise ValueError(f"expected a picture; found no {relative}")
    with opened(file) as image:
        return file, image.size


def check_picture(size: tuple[int, int], lens: Intrinsics) -> None:
    """Raise ValueError for a picture whose size differs from its camera's."""
    if size != (lens.width, lens.height):
        raise ValueError(f"expected a picture of {lens.width} x {lens.height} pixels; found {size[0]} x {size[1]}")


def posed_dataset(
    path: Path, found: Sequence[Posed], texts: Sequence[Path], problems: Sequence[str], keep_going: bool
) -> ForeignDataset:
    """A data set of these pictures, without objects. `texts`: the files that describe them. Raises StoreError for the
    problems, unless it is to keep going, and if no picture is left.
    """
    if not keep_going:
        refuse_broken(problems)
    if not found:
        raise StoreError(f"{path}: expected pictures that can be used; found none")
    digest = hashlib.sha256()
    for file in texts:
        digest.update(f"{file.name}\0{hashlib.sha256(read_bytes(file, 'MAX_RECORD_BYTES')).hexdigest()}".encode())
    for problem in problems:
        digest.update(problem.encode(errors="backslashreplace"))
    return ForeignDataset(
        name=path.resolve().stem,
        digest=digest.hexdigest(),
        categories=(),
        splits=tuple(dict.fromkeys(one.split for one in found)),
        channels=("rgb", *dict.fromkeys(one.distance for one in found)) if all(one.depth for one in found) else ("rgb",),
        count=len(found),
        poses=len(found),
        max_objects=1,
        frames=partial(_frames, found),
        left_out=tuple(problems),
    )


def _frames(found: Sequence[Posed]) -> Iterator[ForeignFrame]:
    has_depth = all(one.depth for one in found)
    for index, one in enumerate(found):
        pose = viewpoint_of(world_from_camera(one.camera), (0.0, 0.0, 0.0), index)
        sample = Sample(index, one.split, one.camera, pose, (), {}, {})
        sample = replace(sample, sequence=one.sequence, sensor=one.sensor, instant=one.instant, time=one.time)
        depth = {one.distance: _depth(one.depth, one)} if has_depth and one.depth else {}
        yield ForeignFrame(sample, {"rgb": one.file, **depth})


def _depth(file: Path, one: Posed) -> Loaded:
    """A depth map like stored ones: z-depth with its step, distances along rays in metres."""
    try:
        steps = decode_png(read_bytes(file, "MAX_PICTURE_BYTES"))
    except (OSError, UserError) as error:
        raise StoreError(f"{file}: expected depth as PNG of 16 bits; found: {error}") from None
    size = (one.camera.height, one.camera.width)
    if steps.shape != size or steps.dtype != np.uint16:
        raise StoreError(f"{file}: expected depth of 16 bits, {size[1]} x {size[0]}; found {steps.dtype} {steps.shape}")
    if one.camera.lens.has_depth:
        return Loaded(".png", encode_png(steps, unit=one.step))
    return Loaded(".tiff", encode_tiff(np.where(steps > 0, steps * one.step, np.inf).astype(np.float32)))
