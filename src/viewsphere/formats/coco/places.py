"""The places of COCO's files and pictures, in COCO's own trees and in the trees that other tools write."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from viewsphere.errors import StoreError
from viewsphere.store.paths import file_inside, is_name
from viewsphere.urls.inside import is_inside

KINDS = ("instances_", "person_keypoints_")
"""The beginnings of names of annotation files, before the split; the first that a folder has counts."""

BARE = "image_info_"
"""The beginning of names of files of pictures without annotations."""

NAMELESS = ("labels", "annotations", "_annotations.coco", "coco_annotations")
"""Files of one split, whose name is its folder's: FiftyOne's, supervision's, Roboflow's and BlenderProc's."""

ONLY = "train"
"""The split of one that lies in no folder of several."""

FOLDERS = ("", "data", "images")
"""The folders of the pictures of such a file, beside it."""


def annotation_files(path: Path) -> list[tuple[str, Path]]:
    """The files of a folder, or this one file, each with its split; raises StoreError where there are none."""
    if path.is_file():
        return [(_split_of(path), path)]
    for folder in (path / "annotations", path):
        kinds = (sorted(folder.glob(f"{kind}*.json")) for kind in KINDS)
        if found := next(filter(None, kinds), None) or sorted(folder.glob("*.json")):
            told = [(_split_of(file) if len(found) == 1 else _stem(file), file) for file in found]
            return told + _bare(path, folder, [split for split, _ in told])
    parts = ((folder.name, folder / f"{name}.json") for folder in sorted(path.glob("*")) for name in NAMELESS)
    if nested := {split: file for split, file in parts if file.is_file() and is_name(split)}:
        return list(nested.items())
    raise StoreError(f"{path}: expected a COCO data set (annotations/instances_<split>.json); found no such file")


def picture_file(image: dict[str, Any], root: Path, split: str, beside: Path) -> Path | None:
    """The file of a picture: below the root, where COCO and its relatives keep it, or below the folder `beside`, where the
    annotations are; None if there is none. Raises StoreError for a path that leads outside.
    """
    name = image.get("file_name")
    if not isinstance(name, str) or not name or not is_inside(name):
        return None
    below = [(root, f"{split}/{name}"), (root, f"images/{split}/{name}"), (root, f"images/{name}"), (root, name)]
    for folder, path in (*below, *((beside, f"{inner}/{name}" if inner else name) for inner in FOLDERS)):
        with suppress(OSError):  # the name may be too long for the file system
            if (folder / path).is_file():
                return file_inside(folder, path)
    return None


def _stem(file: Path) -> str:
    return next((file.stem.removeprefix(kind) for kind in (*KINDS, BARE) if file.stem.startswith(kind)), file.stem)


def _split_of(file: Path) -> str:
    """The split of a file that is the only one of its folder."""
    return ONLY if file.stem in NAMELESS else _stem(file)


def _bare(root: Path, folder: Path, splits: Sequence[str]) -> list[tuple[str, Path]]:
    """Splits in which nothing is annotated, and of which there are pictures, as datumaro writes them."""
    found = [(_stem(file), file) for file in sorted(folder.glob(f"{BARE}*.json"))]
    return [
        (split, file)
        for split, file in found
        if split not in splits and any((root / place / split).is_dir() for place in ("images", ""))
    ]
