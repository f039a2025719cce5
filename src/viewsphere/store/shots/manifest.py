"""The contents of a finished folder: each file's size and digest, in a self-checking file that is written last.

    {"files": {"depth/00000012.tiff": [34180, "6f0c..."], ...}, "digest": "91d2..."}

Where a shot's channels are in one tar file, it lists the start of each, so that a reader can skip the others:

    {"files": {"channels.tar": [...], ...}, "spans": {"depth/00000012.tiff": [512, 34180, "6f0c..."], ...}, "digest": "91d2..."}

Digests are XXH3 of 128 bits (https://github.com/Cyan4973/xxHash): they find damage at the speed of memory. They are no
protection against deliberate deception.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import xxhash

from viewsphere.errors import StoreError
from viewsphere.files import open_file, read_bytes, read_text
from viewsphere.store.paths import file_inside
from viewsphere.store.texts import parsed
from viewsphere.urls import byte_range
from viewsphere.urls.inside import is_inside

MANIFEST = "manifest.json"
"""Name of the file in a finished folder."""

SHARD = "channels.tar"
"""Name of the file that holds all channels of a shot."""

BLOCK = 1 << 20
"""Number of bytes that are read at a time."""

Seal = tuple[int, str]
"""A file's size in bytes and its digest."""

Span = tuple[int, int, str]
"""A file's offset in a shard, its size in bytes and its digest."""


def digest(data: bytes | memoryview) -> str:
    """The digest of some bytes, 32 hexadecimal digits."""
    return xxhash.xxh3_128_hexdigest(data)


def sealed(value: Mapping[str, Any]) -> str:
    """The text of a JSON object that carries its own digest."""
    text = json.dumps(value, separators=(",", ":"), allow_nan=False)
    return f'{text[:-1]}{"," if value else ""}"digest":"{digest(text.encode())}"}}'


def unsealed(text: str) -> dict[str, Any]:
    """Return the original argument of `sealed`; raises ValueError if the text was changed."""
    start, comma, _ = text.rpartition(',"digest":"')
    if not comma or f'{start},"digest":"{digest((start + "}").encode())}"}}' != text:
        raise ValueError("a text that was changed since it was written: its digest is another")
    return parsed(start + "}")


def seal_of(file: Path) -> Seal:
    """A file's size and digest, read block by block."""
    hasher, size = xxhash.xxh3_128(), 0
    with open_file(file) as stream:  # blocks are large, and most files smaller
        while block := stream.read(BLOCK):
            hasher.update(block)
            size += len(block)
    return size, hasher.hexdigest()


@dataclass(frozen=True)
class Manifest:
    """The files of a folder by their paths, including the files inside its shard as if they were in the folder.

    `painter` is the processor type and the kernel build that rendered the pictures, empty without an engine.
    """

    files: Mapping[str, Seal]
    spans: Mapping[str, Span] = field(default_factory=dict[str, Span])
    painter: str = ""

    @staticmethod
    def from_folder(folder: Path) -> Manifest:
        """Return the manifest of a folder and the folders below, without the manifest itself."""
        paths = sorted(path for path in folder.rglob("*") if path.is_file() and path != folder / MANIFEST)
        return Manifest({path.relative_to(folder).as_posix(): seal_of(path) for path in paths})

    @staticmethod
    def read(folder: Path) -> Manifest:
        """The manifest of a finished folder; raises StoreError if it is missing or damaged."""
        file = folder / MANIFEST
        try:
            value = unsealed(read_text(file, "MAX_RECORD_BYTES"))
            files = {str(path): (int(size), str(found)) for path, (size, found) in value["files"].items()}
            spans = {str(path): (int(at), int(size), str(found)) for path, (at, size, found) in value.get("spans", {}).items()}
            outside = next((path for path in (*files, *spans) if not is_inside(path)), None)
            if outside is not None:
                raise ValueError(f"a path that leads out of it, {outside!r:.200}")
            if any(at < 0 or size < 0 or at + size > files[SHARD][0] for at, size, _ in spans.values()):
                raise ValueError(f"files beyond the end of {SHARD}")
            return Manifest(files, spans, str(value.get("painter", "")))
        except (OSError, LookupError, TypeError, ValueError, ArithmeticError, AttributeError) as error:
            problem = (error.strerror if isinstance(error, OSError) else None) or error
            raise StoreError(f"{file}: expected the manifest of a finished folder, found {problem}: {REPAIR}") from None

    def write(self, folder: Path) -> None:
        """Write the manifest into its folder, whose other files are complete."""
        value: dict[str, Any] = {"files": self.files, **({"spans": self.spans} if self.spans else {})}
        value |= {"painter": self.painter} if self.painter else {}
        (folder / MANIFEST).write_text(sealed(value), "utf-8", newline="\n")

    @property
    def seals(self) -> Mapping[str, Seal]:
        """The seals of all files, with the files inside the shard instead of the shard itself."""
        seals_of_files = {path: seal for path, seal in self.files.items() if path != SHARD}
        return seals_of_files | {path: (size, found) for path, (_, size, found) in self.spans.items()}

    def holder(self, path: str) -> str:
        """The file that contains another one: the shard, or the file itself; both as paths in the folder."""
        return SHARD if path in self.spans else path

    def content(self, path: str, holder: Path) -> bytes:
        """The bytes of the file at `path` in the folder; `holder` is the path of its holder. Raises StoreError if they changed
        since they were written, OSError if they cannot be read.
        """
        if path not in self.spans:
            data = read_bytes(holder, "MAX_PICTURE_BYTES")
            self.check(path, data, holder)
            return data
        at, size, told = self.spans[path]
        data = byte_range(holder, at, size)
        if digest(data) != told:
            found = _in_words((len(data), digest(data)))
            raise StoreError(f"{holder}: {path}: expected {_in_words((size, told))}, found {found}: {REPAIR}")
        return data

    def check(self, path: str, data: bytes, file: Path) -> None:
        """Raise StoreError if the bytes of the file at `path` in the folder changed since they were written."""
        seal = self.files.get(path)
        if seal != (len(data), digest(data)):
            raise StoreError(f"{file}: expected {_in_words(seal)}, found {_in_words((len(data), digest(data)))}: {REPAIR}")

    def damage(self, folder: Path) -> Iterator[str]:
        """Yield the differences from the written state: files that are missing, changed, or additional."""
        for path, told in self.files.items():
            try:
                seal = seal_of(file_inside(folder, path))
            except StoreError as error:
                yield str(error)
                continue
            except OSError as error:
                yield f"{folder / path}: expected {_in_words(told)}, found {error.strerror or error}"
                continue
            if seal != told:
                yield f"{folder / path}: expected {_in_words(told)}, found {_in_words(seal)}"
        yield from (f"{path}: expected no such file" for path in self._strangers(folder))

    def _strangers(self, folder: Path) -> Iterable[Path]:
        known = {folder / path for path in (*self.files, MANIFEST)}
        return (path for path in sorted(folder.rglob("*")) if path.is_file() and path not in known)


KNOWN = ("model.json", "shot.json", "scenery.json")
"""Files that describe the content of a folder's other files."""


def refuse_another(damaged: Path, again: Path) -> None:
    """Raise StoreError if a folder that was made again differs from the known original content of the damaged one.

    The original content is known from its manifest or, if that is damaged too, from its readable files. It is unknown if all
    files match the manifest but are wrong nevertheless.
    """
    try:
        manifest = Manifest.read(damaged)
        known = manifest.files if any(manifest.damage(damaged)) else {}
    except StoreError:
        known = {name: seal_of(damaged / name) for name in KNOWN if _is_json(damaged / name)}
    files = Manifest.read(again).files
    other = [path for path, seal in known.items() if files.get(path) != seal]
    if other:
        raise StoreError(
            f"{damaged}: expected what was made before, found another {other[0]}: the models or what is around them changed "
            "since: put the old ones back, or delete the folder and render again"
        )


def _is_json(file: Path) -> bool:
    try:
        parsed(read_bytes(file, "MAX_RECORD_BYTES"))
    except (OSError, ValueError):
        return False
    return True


REPAIR = "mend it with viewsphere check --repair"
"""The fix for damaged files, for messages."""


def _in_words(told: Seal | None) -> str:
    """A file's size and the beginning of its digest, in words."""
    return "no such file" if told is None else f"{told[0]:,} bytes with digest {told[1][:12]}"
