"""Recipes at URLs, which are copied to this machine with all files beside them.

A copy is in the user's cache, in a folder named after the URL. Data sets record the paths of their models, so that the same
recipe makes the same bytes in any process. Data sets below the recipe's folder are not copied.
"""

from __future__ import annotations

import hashlib
import os
from contextlib import suppress
from pathlib import Path

from viewsphere.caches import cache_of
from viewsphere.errors import RecipeError
from viewsphere.files import open_file
from viewsphere.limits import limits
from viewsphere.scratch import scratch_folder, sweep
from viewsphere.urls import RemotePath, download, files_below, located

PREFIX = "fetching-"
PLAN = "store/plan.json"
"""A file that every data set has."""


def fetched(path: str | os.PathLike[str]) -> Path:
    """A recipe's file on this machine: itself, or a copy of one at a URL, beside copies of all files in its folder and below.

    Raises RecipeError if the file is missing, if MAX_FETCHED_BYTES are exceeded, or if the cache cannot be written; RemoteError
    if the URL does not answer, or refuses.
    """
    file = located(path)
    if not isinstance(file, RemotePath):
        return file
    if not file.is_file():
        raise RecipeError(f"{file}: expected a readable recipe file, found none: correct the URL")
    place = cache_of("recipes")
    try:
        place.mkdir(parents=True, exist_ok=True)
        sweep(place, PREFIX)
        with scratch_folder(place, PREFIX) as scratch:
            _download(file.parent, scratch / "new")
            target = place / hashlib.sha256(str(file.parent).encode()).hexdigest()[:32]
            _replace(target, scratch)
    except FileNotFoundError as error:
        raise RecipeError(f"{file.parent}: a file disappeared while it was copied ({error}): run the command again") from None
    except OSError as error:
        raise RecipeError(f"{place}: expected to keep {file.parent} there, found {error.strerror or error}") from None
    return target / file.name


def _download(folder: RemotePath, copy: Path) -> None:
    """Copy all files in a folder and below, except data sets. Copies nothing if the total size is known to exceed the limit,
    and stops at the limit otherwise: not all file systems report sizes.
    """
    files = folder.sizes_below()
    suffixes = tuple(file.removesuffix(PLAN) or "store/" for file in files if f"/{file}".endswith(f"/{PLAN}"))
    wanted = {file: size for file, size in files.items() if not file.startswith(suffixes)}
    most = limits.MAX_FETCHED_BYTES
    fits, left = sum(wanted.values()) <= most, most
    for file in wanted if fits else ():
        fits = download(folder / file, copy / file, left)
        if not fits:
            break
        left -= (copy / file).stat().st_size
    if not fits:
        raise RecipeError(
            f"{folder}: expected at most {most:,} bytes in a recipe's folder (limit MAX_FETCHED_BYTES), found more: put "
            "the recipe and its models into a folder of their own, or set VIEWSPHERE_MAX_FETCHED_BYTES higher"
        )


def _replace(target: Path, own: Path) -> None:
    """Move the copy into place, unless an equal copy is there, which another process may be reading."""
    if target.is_dir() and _digests(target) == _digests(own / "new"):
        return
    with suppress(FileNotFoundError):
        target.rename(own / "old")
    with suppress(OSError):  # another process was faster
        (own / "new").rename(target)


def _digests(folder: Path) -> dict[str, str]:
    digests: dict[str, str] = {}
    for inside in files_below(folder):
        with open_file(folder / inside) as stream:
            digests[inside] = hashlib.file_digest(stream, "sha256").hexdigest()
    return digests
