"""BOP's scenes with the models that they are of, to be rendered again."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from viewsphere.errors import StoreError
from viewsphere.formats.bop.cads import model_files, model_folder, symmetries_of
from viewsphere.formats.bop.entries import MM
from viewsphere.formats.bop.pixels import Shift, fit, shifted
from viewsphere.formats.bop.reading import Frame, categories, object_pose, scene_frames
from viewsphere.formats.shared.again import pose_of
from viewsphere.formats.shared.image_lists import MISTAKES, one_line
from viewsphere.geometry.rotation import compose, rigid
from viewsphere.model.listed import ListedObject, ListedShot
from viewsphere.store.again import Again, AgainModel, refuse_any

SHIFTED = (
    "{differs:.2%} of the pixels of this data set's masks differ from its models' with cx {x:+g} and cy {y:+g}, as lenses here "
    "have it, {differed:.2%} without: renderers that make masks count pixels from elsewhere than pictures and depth, which the "
    "lens without this fits"
)


def again(path: Path) -> Again:
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
        masks = fit(frames, models)
    except MISTAKES as error:
        raise StoreError(f"{path}: expected masks, and models that can be read; found: {one_line(error)}") from None
    x, y = masks.shift
    if x or y:
        notes.append(SHIFTED.format(differs=masks.differs, differed=masks.differed, x=x, y=y))
    has_world = any(not np.array_equal(rigid(one.camera.R, one.camera.t), np.eye(4)) for one in frames)
    return Again(
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


def _models(root: Path, frames: tuple[Frame, ...]) -> tuple[dict[str, AgainModel], list[str]]:
    """The models by their numbers, and notes on what is left out."""
    files = model_files(root)
    for frame in frames:
        for one in frame.gt:
            if one["obj_id"] not in files:
                name = f"{model_folder(root)}/obj_{one['obj_id']:06d}.ply"
                raise StoreError(
                    f"{root}: expected {name}, a model of image {frame.image} of {frame.scene}; found no such file"
                )
    known, found, notes, said = categories(root, list(files)), dict[str, AgainModel](), list[str](), symmetries_of(root)
    for number, file in files.items():
        symmetries = said.get(number)
        if symmetries is not None and symmetries.unlisted():
            notes.append(f"symmetries of object {number} are left out: some follow from others that are not listed")
            symmetries = None
        category, _ = known[number]
        found[str(number)] = AgainModel(
            file, category.name, supercategory=category.supercategory, unit=1 / MM, symmetries=symmetries
        )
    return found, notes
