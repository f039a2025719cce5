"""The file search of all readers, for textures, buffers and material libraries that a model names."""

from __future__ import annotations

import difflib
import os
import re
import unicodedata
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from itertools import islice
from pathlib import Path, PurePosixPath
from urllib.parse import unquote

LAYOUTS = ("materials/textures", "materials", "images", "texture", "textures")
"""Folders beside the model's own in which public data sets keep pictures: Google Scanned Objects and Gazebo models
(`meshes/`), ShapeNetCore v2 (`models/`), PartNet-Mobility (`textured_objs/`), and exporters of COLLADA.
"""

BELOW = ("textures", "texture", "images", "maps", "tex", "materials/textures")
"""Folders below the model's own that are searched for a file whose given path does not exist."""

PICTURES = {".bmp", ".dds", ".gif", ".jpeg", ".jpg", ".png", ".ppm", ".tga", ".tif", ".tiff", ".webp"}

NEAREST_AMONG = 2_000
"""Greatest number of files compared with the name of a missing one: enough for any asset, and fast in a folder of a million."""

URL = re.compile(r"(?i)([a-z][a-z0-9+.-]+)://")
DRIVE = re.compile(r"/?[A-Za-z][:|](?=/|$)")


class NotFoundError(Exception):
    """Raised if there is no file for a reference; the message gives the reason and the most similar existing file."""


@dataclass(frozen=True)
class _Found:
    """A file, and whether it differs from the reference's own path."""

    path: Path
    elsewhere: bool = False


@dataclass(eq=False)
class Finder:
    """The search for files that a model names.

    The asset's root is the model's folder; the `LAYOUTS` beside that folder belong to it, too. While `confined`, no file
    outside the root is returned or listed, regardless of links and `..` in a path. `looked_for` are all paths that were tried:
    the model changes if one of them appears.
    """

    model: Path
    confined: bool = True
    looked_for: dict[Path, None] = field(default_factory=dict[Path, None])
    _listings: dict[Path, dict[str, str]] = field(default_factory=dict[Path, dict[str, str]])
    _found: dict[tuple[str, Path | None], _Found | None] = field(
        default_factory=dict[tuple[str, "Path | None"], "_Found | None"]
    )
    _files: dict[tuple[Path, ...], list[Path]] = field(default_factory=dict[tuple[Path, ...], list[Path]])

    def find(self, reference: str, base: Path | None = None) -> _Found:
        """The file of a reference, which may be percent-encoded, in another case, or written with backslashes.

        Its path is resolved from the model's folder, then from `base`, the folder of the file that holds the reference. If the
        path does not exist, its last name is searched beside the model, beside `base`, then in the known folders. Raises
        NotFoundError.
        """
        names = self._names(reference)
        if (reference, base) not in self._found:
            self._found[reference, base] = self._search(names, base)
        if (found := self._found[reference, base]) is None:
            raise NotFoundError(self._why(names, self._folders(base)))
        return found

    def holds(self, reference: str, base: Path | None = None) -> bool:
        """Return whether there is a file for a reference."""
        try:
            names = self._names(reference)
        except NotFoundError:
            return False
        if (reference, base) not in self._found:
            self._found[reference, base] = self._search(names, base)
        return self._found[reference, base] is not None

    def _search(self, names: list[str], base: Path | None) -> _Found | None:
        starts = [self.model.parent] if base in (None, self.model.parent) else [self.model.parent, base]
        for name, folder in ((name, folder) for name in names for folder in starts):
            if not DRIVE.match(name) and (path := self._followed(folder, name)) is not None:
                return _Found(path)
        for last, folder in ((PurePosixPath(name).name, folder) for name in names for folder in self._folders(base)):
            if last and (path := self._followed(folder, last)) is not None:
                return _Found(path, elsewhere=PurePosixPath(last) not in map(PurePosixPath, names))
        return None

    def _folders(self, base: Path | None) -> list[Path]:
        """Folders in which a file is searched by its last name alone."""
        starts = [self.model.parent] if base in (None, self.model.parent) else [self.model.parent, base]
        below = [start / name for start in starts for name in BELOW]
        return [*starts, *below, *(self._root.parent / name for name in LAYOUTS)]

    @cached_property
    def _root(self) -> Path:
        return _real(self.model.parent)

    def _names(self, reference: str) -> list[str]:
        """The reference both unchanged and percent-decoded, with forward slashes; a file: URL becomes a path."""
        url = URL.match(reference)
        if "\0" in reference or (url and url[1].lower() != "file"):
            raise NotFoundError("is not a path below the model's folder; it is not fetched")
        name = reference.strip().strip('"').replace("\\", "/")
        name = name[len("file://") :] if url else name
        return [name for name in dict.fromkeys((name, unquote(name))) if "\0" not in name]

    def is_inside(self, path: Path) -> bool:
        """Return whether a path, after resolving links, is in the asset's root."""
        real, folder = _real(path), self._root
        if real.is_relative_to(folder):
            return True
        beside = real.relative_to(folder.parent) if real.is_relative_to(folder.parent) else Path()
        return any(PurePosixPath(*map(_key, beside.parts)).is_relative_to(layout) for layout in LAYOUTS)

    def _followed(self, folder: Path, name: str) -> Path | None:
        """The file at a relative path, ignoring the case of its names; None if it is missing or outside the root."""
        target = Path(os.path.normpath(_real(folder) / name))
        try:
            if not self._may_give(target):
                return None
            self.looked_for[target] = None
            path = target if target.is_file() else self._in_any_case(target)
            if path is None or not self._may_give(path) or not path.is_file():
                return None
        except (OSError, ValueError):
            return None
        self.looked_for[path] = None
        return path

    def _may_give(self, path: Path) -> bool:
        return not self.confined or self.is_inside(path)

    def _in_any_case(self, target: Path) -> Path | None:
        """The path with each name as its folder spells it."""
        path = Path(target.anchor)
        for name in target.parts[1:]:
            exact = path / name
            if not os.path.lexists(exact):
                spelled = self._listing(path).get(_key(name))
                if spelled is None:
                    return None
                exact = path / spelled
            path = exact
        return path

    def _listing(self, folder: Path) -> dict[str, str]:
        """A folder's names by key; for each key, the first name in order."""
        if folder not in self._listings:
            names = sorted((file.name for file in folder.iterdir()), reverse=True) if folder.is_dir() else []
            self._listings[folder] = {_key(name): name for name in names}
        return self._listings[folder]

    def _why(self, names: list[str], folders: Iterable[Path]) -> str:
        """Return the reason for a missing file: it does not exist, or the path leads outside."""
        outside = self.confined and not (DRIVE.match(names[-1]) or self.is_inside(self.model.parent / names[-1]))
        reason = "is outside the model's folder, not read; set confined: false to allow" if outside else "does not exist"
        nearest = self._nearest(PurePosixPath(names[-1]).name, folders)
        return reason if nearest is None else f"{reason} (nearest file: {nearest!r})"

    def _nearest(self, last: str, folders: Iterable[Path]) -> str | None:
        """The file below these folders with the most similar name, relative to the model's folder."""
        wanted = PurePosixPath(last.lower())
        kinds = PICTURES if wanted.suffix in PICTURES else {wanted.suffix}
        stems = {file: PurePosixPath(file.name.lower()) for file in self._files_in(tuple(folders))}
        stems = {file: name.stem for file, name in stems.items() if name.suffix in kinds}
        # difflib's default threshold, 0.6, still accepts names of one series (wood_1, wood_2) and rejects others.
        close = difflib.get_close_matches(wanted.stem, list(stems.values()), 1, 0.6)
        best = [file for file, stem in stems.items() if [stem] == close]
        return os.path.relpath(best[0], self._root).replace(os.sep, "/") if best else None

    def _files_in(self, folders: tuple[Path, ...]) -> list[Path]:
        """Files that may be returned, in these folders and their subfolders."""
        if folders not in self._files:
            self._files[folders] = list(islice(self._walked(folders), NEAREST_AMONG))
        return self._files[folders]

    def _walked(self, folders: Iterable[Path]) -> Iterator[Path]:
        seen: set[Path] = set()
        for folder in map(_real, folders):
            places = [folder, *(folder / name for name in sorted(self._names_in(folder)))]
            for place in places:
                if place in seen or not place.is_dir() or not self._may_give(place):
                    continue
                seen.add(place)
                yield from (place / name for name in sorted(self._names_in(place)) if (place / name).is_file())

    def _names_in(self, folder: Path) -> list[str]:
        try:
            return list(self._listing(folder).values()) if self._may_give(folder) else []
        except OSError:
            return []


def _key(name: str) -> str:
    """A name for comparison: archives of macOS decompose letters with accents, other systems compose them."""
    return unicodedata.normalize("NFC", name).casefold()


def _real(path: Path) -> Path:
    """The path without links; unlike `Path.resolve`, it also handles circular links."""
    return Path(os.path.realpath(path))
