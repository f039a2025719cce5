"""The files and folders below a folder or pattern of a recipe's `source`, up to a limit."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import suppress
from glob import glob, has_magic
from pathlib import Path, PurePath

from viewsphere.errors import RecipeError
from viewsphere.limits import limits
from viewsphere.printable import is_utf8, printable


def below(folder: Path, where: str) -> list[Path]:
    """Everything in a folder and below; raises RecipeError beyond the limit of entries."""
    _check(folder, None, where)
    return [*folder.rglob("*")]


def matching(folder: Path, pattern: str, where: str) -> list[Path]:
    """Everything that a pattern matches, starting from a folder; raises RecipeError beyond the limit of entries."""
    parts = PurePath(pattern).parts
    first = next(i for i, part in enumerate(parts) if has_magic(part))
    _check(folder.joinpath(*parts[:first]), None if "**" in parts else len(parts) - first, where)
    return [folder / path for path in glob(pattern, root_dir=folder, recursive=True)]  # noqa: PTH207 (Path.glob takes no absolute pattern)


def _check(folder: Path, depth: int | None, where: str) -> None:
    most = limits.MAX_ENTRIES
    for count, _ in enumerate(_entries(folder, depth), 1):
        if count > most:
            raise RecipeError(
                f"{where}.source: {folder} and the folders below hold more than {most:,} entries (limit MAX_ENTRIES). Name a "
                "folder nearer to the models, or set VIEWSPHERE_MAX_ENTRIES higher"
            )


def _entries(folder: Path, depth: int | None) -> Iterator[str]:
    """The names in a folder and below, `depth` levels of them; links are followed as patterns follow them."""
    waiting = [(os.fspath(folder), depth)]
    while waiting:
        place, left = waiting.pop()
        with suppress(OSError), os.scandir(place) as entries:
            for entry in entries:
                yield entry.name
                if (left is None or left > 1) and entry.is_dir():
                    waiting.append((entry.path, None if left is None else left - 1))


def named(path: Path, field: str) -> Path:
    """The path; raises RecipeError, beginning with the recipe's field, if records cannot hold the path as text."""
    if is_utf8(str(path)):
        return path
    raise RecipeError(f"{field}: the name {printable(str(path))} is not UTF-8. Rename the file or folder")
