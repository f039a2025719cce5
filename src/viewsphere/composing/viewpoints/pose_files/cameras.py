"""Cameras of 3D files (.blend, FBX, glTF, USD), at frames of their animation, as Blender evaluates them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from viewsphere.composing.viewpoints.pose_files.entries import Extrinsics, PoseFile
from viewsphere.composing.viewpoints.pose_files.lens import one_lens
from viewsphere.composing.viewpoints.pose_files.motions import motion
from viewsphere.errors import ModelError, RecipeError
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.recipe.cameras.time import chosen_frames
from viewsphere.recipe.cameras.viewpoints import PoseList

if TYPE_CHECKING:
    from viewsphere.assets.animation.timeline import Blenders

SUFFIXES = (".abc", ".blend", ".fbx", ".glb", ".gltf", ".usd", ".usda", ".usdc", ".usdz")


def read_cameras(path: Path, entry: PoseList, zooms: bool = False) -> PoseFile:
    """The poses of the entry's camera at its frames, in metres, +z up, and its lens; with `zooms`, a lens for each pose if they
    differ.

    Raises RecipeError for a missing camera or missing frames and, without `zooms`, for a lens that changes.
    """
    from viewsphere.assets.animation.timeline import Blenders  # which loads readers of models

    with Blenders.none_yet() as blenders:
        try:
            frames = _frames(path, entry, blenders)
            about = {"camera": entry.camera, "frames": frames, "at": entry.at, "size": entry.size}
            about |= {"clip": entry.clip, "fps": entry.fps}
            cameras = blenders.answer(path, entry.confined, "cameras", about)["cameras"]
        except ModelError as error:
            raise RecipeError(f"viewpoints: {error}") from None
    lenses = tuple(_lens(one["lens"]) for one in cameras)
    entries = tuple(_motion(one, str(path)) for one in cameras)
    if zooms and len(set(lenses)) > 1:
        return PoseFile(entries, up="+z", lenses=lenses)
    return PoseFile(entries, up="+z", intrinsics=one_lens(lenses, str(path)))


def _frames(path: Path, entry: PoseList, blenders: Blenders) -> tuple[int, ...] | None:
    if entry.frames is None:
        return None
    line = blenders.timeline(path, entry.confined, entry.clip, entry.fps)
    chosen = chosen_frames(entry.frames, line.first, line.last)
    beyond = [frame for frame in chosen if not line.first <= frame <= line.last]
    if beyond or not chosen:
        found = beyond[0] if beyond else "none of them"
        raise RecipeError(f"viewpoints.frames: expected frames of {line.first} to {line.last}, as {path} has; found {found}")
    return chosen


def _lens(told: dict[str, Any]) -> Intrinsics:
    """The lens of a camera, rounded to seven digits, because Blender computes in single precision."""
    fx, fy, cx, cy = (float(f"{told[name]:.7g}") for name in ("fx", "fy", "cx", "cy"))
    return Intrinsics(width=told["width"], height=told["height"], fx=fx, fy=fy, cx=cx, cy=cy)


def _motion(told: dict[str, Any], where: str) -> Extrinsics:
    return motion(np.array(told["rotation"], np.float64), np.array(told["center"], np.float64), where)
