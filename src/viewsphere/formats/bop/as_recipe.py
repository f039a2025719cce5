"""BOP's scenes with the models that they show, for rendering them again."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.cache import load_normalised
from viewsphere.codecs.size import opened
from viewsphere.errors import StoreError
from viewsphere.formats.bop.entries import MM
from viewsphere.formats.bop.reading import Frame, categories, object_pose, scene_frames
from viewsphere.formats.bop.source_models import model_files, model_folder, model_spec, symmetries_of
from viewsphere.formats.shared.reading.as_recipe import pose_of
from viewsphere.formats.shared.reading.image_lists import MISTAKES, one_line
from viewsphere.geometry.rotation import compose, rigid
from viewsphere.model.listed import ListedObject, ListedShot
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.model.thing import Motion, Thing
from viewsphere.store.paths import file_inside
from viewsphere.store.source_cameras import SourceCameras, SourceModel, refuse_any
from viewsphere.truth.raster.geometry import build_geometry
from viewsphere.truth.raster.visibility import rasterize

MOST = 12
"""Number of masks to compare, spread evenly over all masks."""

CLEARLY = 0.5
"""A shift is accepted if it leaves less than this share of the differing pixels."""

LEAST = 100
"""Least number of pixels in a mask to compare."""

STARTS = ((0.0, 0.0), (-0.5, -0.5))
STEP = 0.125
MOST_STEPS = 8
"""Limits of the search from the better start: its step, pixels, and its greatest number of steps to the best-fitting
neighbour.
"""

Shift = tuple[float, float]


SHIFTED = (
    "{differs:.2%} of the pixels of this data set's masks differ from its models' with cx {x:+g} and cy {y:+g}, as lenses here "
    "have it, {differed:.2%} without: renderers that make masks count pixels from elsewhere than pictures and depth, which the "
    "lens without this fits"
)


def source_cameras(path: Path) -> SourceCameras:
    """Return every picture of a data set of scenes, or of one of its splits, and every model with its symmetries.

    Pixels count from the first one's centre, as in BOP, unless masks fit the models clearly better from elsewhere. The world is
    the world of cam_R_w2c. Without cam_R_w2c it is the world of each camera, where up is up in the picture. Raises StoreError
    for pictures that lack their file, their lens or the pose of an object, and for objects without a model.
    """
    root, files = path, sorted(path.glob("*/*/scene_camera.json"))
    if not files:
        root, files = path.absolute().parent, sorted(path.glob("*/scene_camera.json"))
    if not files:
        raise StoreError(f"{path}: expected a BOP data set (<split>/<scene>/scene_camera.json); found no such file")
    problems: list[str] = []
    frames = tuple(frame for file in files for frame in scene_frames(root, file.parent, problems))
    shots: list[ListedShot] = []
    for frame in frames:
        try:
            shots.append(_shot(root, frame))
        except MISTAKES as error:
            problems.append(f"{frame.scene}: image {frame.image}: {one_line(error)}")
    refuse_any(problems)
    if not frames:
        raise StoreError(f"{path}: expected images; found none")
    models, notes = _models(root, frames)
    try:
        masks = _fit(frames, models)
    except MISTAKES as error:
        raise StoreError(f"{path}: expected masks, and models that can be read; found: {one_line(error)}") from None
    x, y = masks.shift
    if x or y:
        notes.append(SHIFTED.format(differs=masks.differs, differed=masks.differed, x=x, y=y))
    has_world = any(not np.array_equal(rigid(one.camera.R, one.camera.t), np.eye(4)) for one in frames)
    return SourceCameras(
        name=root.resolve().name,
        shots=tuple(_shifted(shot, masks.shift) for shot in shots),
        models=models,
        formats=("bop",),
        annotations=("amodal",),
        up="+z" if has_world else "-y",
        notes=tuple(notes),
    )


def _shot(root: Path, frame: Frame) -> ListedShot:
    world_from_camera = rigid(frame.camera.R.T, frame.camera.center)
    poses = ((str(one["obj_id"]), compose(world_from_camera, object_pose(one))) for one in frame.gt)
    return ListedShot(
        name=re.sub(r"[^A-Za-z0-9_]", "_", f"{frame.split}_{frame.scene.name}_{frame.image:06d}")[-100:],
        split=frame.split,
        image=frame.rgb.relative_to(root).as_posix(),
        world_from_camera=pose_of(world_from_camera),
        camera=frame.camera.intrinsics,
        objects=tuple(ListedObject(model=number, world_from_object=pose_of(pose)) for number, pose in poses),
    )


def _shifted(shot: ListedShot, shift: Shift) -> ListedShot:
    return shot.model_copy(update={"camera": shot.camera and shifted(shot.camera, shift)})


def _models(root: Path, frames: tuple[Frame, ...]) -> tuple[dict[str, SourceModel], list[str]]:
    """The models by their numbers, and notes on omissions."""
    files = model_files(root)
    for frame in frames:
        for one in frame.gt:
            if one["obj_id"] not in files:
                name = f"{model_folder(root)}/obj_{one['obj_id']:06d}.ply"
                raise StoreError(
                    f"{root}: expected {name}, a model of image {frame.image} of {frame.scene}; found no such file"
                )
    known, found, notes, said = categories(root, list(files)), dict[str, SourceModel](), list[str](), symmetries_of(root)
    for number, file in files.items():
        symmetries = said.get(number)
        if symmetries is not None and symmetries.unlisted():
            notes.append(f"symmetries of object {number} are left out: some follow from others that are not listed")
            symmetries = None
        category, _ = known[number]
        found[str(number)] = SourceModel(
            file, category.name, supercategory=category.supercategory, unit=1 / MM, symmetries=symmetries
        )
    return found, notes


@dataclass(frozen=True)
class _Fit:
    """The shift in pixels to add to cx and cy so that masks fit. `differed` and `differs` are the shares of their pixels that
    differ from the models' pixels, without this shift and with it.
    """

    shift: Shift = (0.0, 0.0)
    differed: float = 0.0
    differs: float = 0.0


def _fit(frames: Sequence[Frame], models: Mapping[str, SourceModel]) -> _Fit:
    """The shift of whole masks against the models in their poses; zero if it is unclear or if there are no masks. Raises
    ModelError for unreadable models, StoreError for invalid masks.
    """
    masks = [(frame, n, mask) for frame, n in _chosen(frames) if np.count_nonzero(mask := _mask(frame, n)) >= LEAST]
    if not masks:
        return _Fit()

    @cache
    def differ(shift: Shift) -> int:
        return sum(int(np.count_nonzero(mask ^ _silhouette(frame, n, models, shift))) for frame, n, mask in masks)

    best = min(STARTS, key=differ)
    for _ in range(MOST_STEPS):
        x, y = best
        around = product((x - STEP, x, x + STEP), (y - STEP, y, y + STEP))
        best, before = min((best, *around), key=differ), best
        if best == before:
            break
    pixels = sum(int(np.count_nonzero(mask)) for _, _, mask in masks)
    found = best if differ(best) < CLEARLY * differ(STARTS[0]) else STARTS[0]
    return _Fit(found, differ(STARTS[0]) / pixels, differ(found) / pixels)


def shifted(lens: Intrinsics, shift: Shift) -> Intrinsics:
    """The lens with its principal point moved."""
    return lens.model_copy(update={"cx": lens.cx + shift[0], "cy": lens.cy + shift[1]})


def _chosen(frames: Sequence[Frame]) -> Iterator[tuple[Frame, int]]:
    """A selection of objects with masks, and the pictures that show them."""
    every = max(1, len(frames) // MOST)
    chosen = [(frame, n) for frame in frames[::every] for n in range(len(frame.gt)) if _file(frame, n).is_file()]
    yield from chosen[:: max(1, len(chosen) // MOST)][:MOST]


def _file(frame: Frame, n: int) -> Path:
    return file_inside(frame.scene, f"mask/{frame.image:06d}_{n:06d}.png")


def _mask(frame: Frame, n: int) -> NDArray[np.bool_]:
    with opened(_file(frame, n)) as image:
        mask = np.asarray(image.convert("L")) > 127
    frame.check(_file(frame, n), mask)
    return mask


def _silhouette(frame: Frame, n: int, models: Mapping[str, SourceModel], shift: Shift) -> NDArray[np.bool_]:
    file = models[str(frame.gt[n]["obj_id"])].source
    assert isinstance(file, Path)
    spec = model_spec(file)
    thing = Thing(id=1, model=spec, motion=Motion.still(pose_of(object_pose(frame.gt[n]))))
    geometry = build_geometry((thing,), (load_normalised(spec),), False, 0.01)
    return rasterize(geometry, Camera(shifted(frame.camera.intrinsics, shift), np.eye(3), np.zeros(3))).triangle >= 0
