"""YOLO data sets that no data.yaml describes, or only half: Darknet's, and those that supervision writes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from viewsphere.errors import StoreError
from viewsphere.formats.shared.image_lists import MISTAKES, SPLITS, TRAIN, one_line, text_of

NAMES = "obj.names"
"""Darknet's file of classes, a line each (https://github.com/AlexeyAB/darknet#how-to-train-to-detect-your-custom-objects)."""

DARKNET = "data/"
"""The beginning of paths in Darknet's lists. They are relative to the program's folder, and this is the data set's folder
there.
"""

IMAGES = "images"


def darknet(file: Path) -> dict[str, Any]:
    """Return a data.yaml for a folder with `obj.names` and lists of pictures: `<split>.txt`, or `images.txt`, which FiftyOne
    writes. Raises StoreError where the names cannot be read.
    """
    try:
        names = [line.strip() for line in text_of(file) if line.strip()]
    except MISTAKES as error:
        raise StoreError(f"{file}: expected a line for each class; found: {one_line(error)}") from None
    lists = {path.stem: path.name for path in sorted(file.parent.glob("*.txt"))}
    if IMAGES in lists:
        lists.setdefault(TRAIN, lists.pop(IMAGES))
    return {"names": names, **lists}


def unsaid(root: Path) -> dict[str, Any]:
    """The splits of a folder whose data.yaml names none: folders in `images`, or that itself."""
    splits = {split: f"{IMAGES}/{split}" for split in SPLITS if (root / IMAGES / split).is_dir()}
    return splits or {TRAIN: IMAGES}
