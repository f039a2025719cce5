"""The cameras of transforms.json, and a mesh where there is one, to be rendered again."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from viewsphere.formats.nerfstudio.reading import lens_of, name_of, pose_said, said_frames, split_of, transforms_files
from viewsphere.formats.shared.again import cameras_again, pose_of
from viewsphere.formats.shared.image_lists import MISTAKES, one_line
from viewsphere.formats.shared.posed import camera_of, picture_inside
from viewsphere.model.listed import ListedShot
from viewsphere.store.again import Again, refuse_any

FOLDERS = ("", "exports/mesh", "exports/poisson", "exports/tsdf", "exports")
"""The folders in which nerfstudio's users put meshes, relative to the folder of transforms.json."""


def again(path: Path) -> Again:
    """Return every camera of a world's folder, or of one of its files. Pictures are required only where the file does not give
    w and h. Raises StoreError where there is no such file, and for a frame that lacks its lens or its pose.
    """
    problems: list[str] = []
    shots: dict[str, ListedShot] = {}
    files = transforms_files(path)
    for file in files:
        for number, said, lists in said_frames(file):
            try:
                shot = _shot(file, said, lists)
                shots.setdefault(shot.image or str(len(shots)), shot)
            except MISTAKES as error:
                problems.append(f"{file}: frame number {number}: {one_line(error)}")
    refuse_any(problems)
    return cameras_again(path, tuple(shots.values()), files[0].parent, FOLDERS, "nerfstudio", "+z")


def _shot(file: Path, said: Mapping[str, Any], lists: Mapping[str, set[str]]) -> ListedShot:
    name, size = name_of(said), (0, 0)
    if not (said.get("w") and said.get("h")):
        _, size = picture_inside(file.parent, name.removeprefix("./"), ".png", ".jpg")
    lens, pose = lens_of(said, size), pose_said(said)
    camera_of(lens, pose)
    return ListedShot(split=split_of(file, name, lists), image=name, world_from_camera=pose_of(pose), camera=lens)
