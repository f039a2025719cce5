"""Checks of paths and names in a data set, which may be untrusted: they may refer only to its own files.

All conversions of stored paths to files use this module.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from stat import S_ISLNK

from viewsphere.errors import StoreError
from viewsphere.urls import RemotePath
from viewsphere.urls.inside import PLAIN, is_inside


def file_inside(root: Path, relative: str) -> Path:
    """The file of this stored path below the data set's folder `root`; it may be absent.

    Raises StoreError for a path that is absolute or holds `..`, and for one that leaves the folder by a link.
    """
    if not is_inside(relative):
        raise StoreError(
            f"{root}: expected relative paths without '..', found {relative!r:.200}: correct it, or ask its maker for a whole "
            "data set"
        )
    file = root / relative
    if isinstance(file, RemotePath) or _is_straight(root, relative):
        return file
    try:
        leads_to = file.resolve()
        is_below = leads_to.is_relative_to(root.resolve())
    except (OSError, RuntimeError, ValueError) as error:  # links in a circle, names that no file system takes
        raise StoreError(f"{file!s:.300}: expected a path that can be followed, found: {error!s:.300}") from None
    if not is_below:
        raise StoreError(
            f"{file}: expected a file inside of {root}, found a link that leads out of it, to {leads_to}: put the file in the "
            "place of the link"
        )
    return file


def _is_straight(root: Path, relative: str) -> bool:
    """Return whether no link is on the path from a folder to a file below it; False also if that cannot be determined."""
    if os.name == "nt" or not PLAIN.fullmatch(relative):
        return False
    place = str(root)
    for name in relative.split("/"):
        place = f"{place}/{name}"
        try:
            if S_ISLNK(os.lstat(place).st_mode):
                return False
        except FileNotFoundError:
            return True
        except (OSError, ValueError):
            return False
    return True


def files_inside(root: Path, folder: Path) -> Sequence[Path]:
    """The files in a folder of the data set, sorted; raises StoreError as `file_inside` does."""
    paths = (file_inside(root, (folder / path.name).relative_to(root).as_posix()) for path in sorted(folder.iterdir()))
    return tuple(file for file in paths if file.is_file())


def is_name(text: object) -> bool:
    """Return whether this is the name of one file or folder: a text without separators that is neither `.` nor `..`."""
    return isinstance(text, str) and bool(text.strip(". ")) and not set(text) & set("/\\\0")


def names(texts: Sequence[str], what: str) -> tuple[str, ...]:
    """The texts, which become parts of paths; raises ValueError for an invalid name."""
    wrong = next((text for text in texts if not is_name(text)), None)
    if wrong is not None:
        raise ValueError(f"{what} {wrong!r:.100} where a name without / is expected")
    return tuple(texts)
