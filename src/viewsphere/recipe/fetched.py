"""Recipes at URLs, which are copied to this machine with all that lies beside them.

A copy lies in the user's cache, in a folder whose name follows from what is in it: data sets say where their models came from,
and so the same recipe makes the same bytes, whichever process fetched it.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from viewsphere.aside import aside, sweep
from viewsphere.caches import cache_of
from viewsphere.errors import RecipeError
from viewsphere.limits import limits
from viewsphere.urls import RemotePath, download, located

PREFIX = "fetching-"


def fetched(path: str | os.PathLike[str]) -> Path:
    """A recipe's file on this machine: itself, or a copy of one at a URL, beside copies of all files in its folder and below.

    Raises RecipeError where there is no such file, where MAX_FETCHED_BYTES are not enough, or where the cache cannot be
    written; RemoteError where the URL does not answer, or refuses.
    """
    file = located(path)
    if not isinstance(file, RemotePath):
        return file
    if not file.is_file():
        raise RecipeError(f"{file}: expected a readable recipe file, found none: correct the URL")
    sizes, most = file.parent.sizes_below(), limits.MAX_FETCHED_BYTES
    if sum(sizes.values()) > most:
        raise RecipeError(
            f"{file.parent}: expected at most {most:,} bytes in a recipe's folder (limit MAX_FETCHED_BYTES), found "
            f"{sum(sizes.values()):,}: put the recipe and its models into a folder of their own, or set "
            "VIEWSPHERE_MAX_FETCHED_BYTES higher"
        )
    try:
        return _copied(file.parent, sizes) / file.name
    except OSError as error:
        raise RecipeError(f"{cache_of('recipes')}: expected to keep {file.parent} there, found {error.strerror}") from None


def _copied(folder: RemotePath, sizes: Mapping[str, int]) -> Path:
    """A copy of these files of a folder."""
    place = cache_of("recipes")
    place.mkdir(parents=True, exist_ok=True)
    sweep(place, PREFIX)
    with aside(place, PREFIX) as own:
        made, digest = own / "new", hashlib.sha256()
        for inside in sizes:
            download(folder / inside, made / inside)
            with (made / inside).open("rb") as stream:
                digest.update(f"{inside}\0{hashlib.file_digest(stream, 'sha256').hexdigest()}\n".encode())
        target = place / digest.hexdigest()[:32]
        with suppress(OSError):  # another process was faster, or an earlier one
            made.rename(target)
        return target
