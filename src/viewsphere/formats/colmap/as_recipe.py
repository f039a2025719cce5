"""COLMAP's cameras and its mesh, if any, for rendering again."""

from __future__ import annotations

from pathlib import Path

from viewsphere.formats.colmap.reading import read_model
from viewsphere.formats.shared.reading.as_recipe import cameras_again, nearest_up, pose_of
from viewsphere.formats.shared.reading.image_lists import MISTAKES, one_line
from viewsphere.formats.shared.reading.posed_pictures import camera_of
from viewsphere.model.listed import ListedShot
from viewsphere.store.source_cameras import SourceCameras, refuse_any

FOLDERS = ("", "sparse/0", "sparse", "dense/0", "dense")
"""The folders in which COLMAP's programs put meshes, relative to the folder of the data set."""


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
    return cameras_again(path, tuple(shots), path, FOLDERS, "colmap", nearest_up(shots))
