"""Paths to a part of a .blend file, as Blender writes them: `street.blend/Collection/Cars`."""

from __future__ import annotations

from pathlib import Path

from viewsphere.errors import ModelError

BLEND = ".blend"
KINDS = ("Object", "Collection")


def split_source(path: Path) -> tuple[Path, tuple[str, ...]]:
    """The file, and the part of it that the path names: () for the whole file, else `("Object", name)` or `("Collection",
    name)`.

    Raises ModelError for a path into a .blend file that names neither an object nor a collection.
    """
    if BLEND not in str(path).lower():  # true for almost all paths, and walking their parents would dominate the cost of a plan
        return path, ()
    for file in path.parents:
        if file.suffix.lower() == BLEND and not file.is_dir():
            kind, *name = path.relative_to(file).parts
            if kind not in KINDS or not name:
                wanted = " or ".join(f"{file.name}/{kind}/NAME" for kind in KINDS)
                raise ModelError(f"{path}: expected {wanted}, found {file.name}/{'/'.join((kind, *name))}")
            return file, (kind, "/".join(name))
    return path, ()
