"""The text of an OBJ file and of its material libraries, decoded with one common encoding."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from viewsphere.assets.paths.folder import ModelFolder, UnreadableError
from viewsphere.assets.readers.shared.text import decode, likely, own_encoding, uncommented

LIBRARY = re.compile(rb"(?m)^[ \t]*mtllib[ \t]+(.*?)[ \t\r]*$")
USED = re.compile(rb"(?m)^[ \t]*usemtl[ \t]")
MAP = re.compile(rb"(?mi)^[ \t]*(?:map_\w+|bump|norm|disp|decal|refl)[ \t]+(.*?)[ \t\r]*$")


@dataclass(frozen=True)
class Library:
    """The text of a material library, and its folder, to which the names of its pictures are relative."""

    text: str
    folder: Path


@dataclass(frozen=True)
class _File:
    path: Path
    data: bytes


def read_texts(folder: ModelFolder) -> tuple[str, list[Library]]:
    """The model's text and its libraries; a library that cannot be read is a warning.

    If faces use materials and no library is named or readable, the library is `<name>.mtl` beside the model.
    """
    model = _File(folder.model, folder.read_model())
    text = decode(model.data) if (own_encoding(model.data) or "").startswith("utf-16") else None
    plain = model.data if text is None else text.encode()
    files = _libraries(folder, plain)
    encoding = _encoding(folder, [_File(model.path, plain), *files])
    return text or decode(model.data, encoding), [Library(decode(f.data, encoding), f.path.parent) for f in files]


def _libraries(folder: ModelFolder, data: bytes) -> list[_File]:
    """The libraries that the model names, else the library beside it."""
    lines = list(dict.fromkeys(LIBRARY.findall(data)))
    problems: list[str] = []
    files = [file for line in lines for file in _named(folder, line, problems)]
    if not files and USED.search(data):
        files = _beside(folder, problems)
    for problem in problems:
        folder.warn(f"{problem}; its materials are plain white")
    return files


def _named(folder: ModelFolder, line: bytes, problems: list[str]) -> list[_File]:
    """The libraries of an mtllib line: one file whose name may contain blanks, or several whose names do not."""
    names = [name for name in _spellings(folder, line) if folder.finder.holds(name)]
    whole = names[0] if names else decode(line)
    several = [whole] if names else uncommented(whole).split()
    files: list[_File] = []
    for name in several:
        try:
            data = folder.read(name, "material library")
            files.append(_File(folder.path_of(name, "material library"), data))
        except UnreadableError as error:
            problems.append(str(error))
    return files


def _spellings(folder: ModelFolder, line: bytes) -> Iterator[str]:
    """The name with and without an apparent comment, in each possible encoding."""
    for encoding in (own_encoding(line),) if own_encoding(line) else likely([line]):
        name = decode(line, encoding)
        yield from dict.fromkeys((name, uncommented(name)))


def _beside(folder: ModelFolder, problems: list[str]) -> list[_File]:
    """The library with the model's name, with a warning that gives the reason for reading it."""
    for name in (f"{folder.model.stem}.mtl", f"{folder.model.name}.mtl"):
        if folder.finder.holds(name):
            reason = problems[0] if problems else "no mtllib line names a material library"
            problems.clear()
            folder.warn(f"{reason}; {name!r} was read instead")
            return [_File(folder.path_of(name), folder.read(name, "material library"))]
    if not problems:
        folder.warn(f"no mtllib line names a material library, and there is no {folder.model.stem}.mtl; all is plain white")
    return []


def _encoding(folder: ModelFolder, files: Sequence[_File]) -> str | None:
    """The encoding of the files without a visible one: the likely encoding that yields the most names of existing files, the
    first one if several do.
    """
    foreign = [file for file in files if own_encoding(file.data) is None]
    if not foreign:
        return None
    named = [(file.path.parent, line) for file in foreign for line in MAP.findall(file.data) if not line.isascii()]

    def spelled(encoding: str) -> int:
        names = ((base, uncommented(decode(line, encoding)).split(" ")) for base, line in named)
        return sum(any(folder.finder.holds(" ".join(words[i:]), base) for i in range(len(words))) for base, words in names)

    return max(likely([file.data for file in foreign]), key=spelled)
