"""The contents of a finished folder: each file's size and digest, in a file that is written last and proves itself.

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
"""Bytes of a file that are read at once."""

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
    """Return the original argument of `sealed`; raises ValueError for a text that was changed since."""
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
    """The files of a folder by their paths in it, and those that lie in its shard, as if they lay in the folder.

    `painter` is the processor type and the kernel build that painted the pictures, empty where no engine did.
    """

    files: Mapping[str, Seal]
    spans: Mapping[str, Span] = field(default_factory=dict[str, Span])
    painter: str = ""

    @staticmethod
    def of(folder: Path) -> Manifest:
        """Return the manifest of a folder and the folders below, without the manifest itself."""
        paths = sorted(path for path in folder.rglob("*") if path.is_file() and path != folder / MANIFEST)
        return Manifest({path.relative_to(folder).as_posix(): seal_of(path) for path in paths})

    @staticmethod
    def read(folder: Path) -> Manifest:
        """The manifest of a finished folder; raises StoreError where there is none, or it was damaged."""
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
        """Write it into its folder, whose other files are whole."""
        value: dict[str, Any] = {"files": self.files, **({"spans": self.spans} if self.spans else {})}
        value |= {"painter": self.painter} if self.painter else {}
        (folder / MANIFEST).write_text(sealed(value), "utf-8", newline="\n")

    @property
    def seals(self) -> Mapping[str, Seal]:
        """The seals of all files, with the files inside the shard instead of the shard itself."""
        seals_of_files = {path: seal for path, seal in self.files.items() if path != SHARD}
        return seals_of_files | {path: (size, found) for path, (_, size, found) in self.spans.items()}

    def holder(self, path: str) -> str:
        """The file that holds another, both by their paths in the folder: the shard, or the file itself."""
        return SHARD if path in self.spans else path

    def content(self, path: str, holder: Path) -> bytes:
        """The bytes of a file, by its path in the folder, and where its holder lies. Raises StoreError where they are not those
        that were written, OSError where they cannot be read.
        """
        if path not in self.spans:
            data = read_bytes(holder, "MAX_PICTURE_BYTES")
            self.check(path, data, holder)
            return data
        at, size, told = self.spans[path]
        data = byte_range(holder, at, size)
        if digest(data) != told:
            found = said((len(data), digest(data)))
            raise StoreError(f"{holder}: {path}: expected {said((size, told))}, found {found}: {REPAIR}")
        return data

    def check(self, path: str, data: bytes, file: Path) -> None:
        """Raises StoreError where the bytes of a file, by its path in the folder, are not those that were written."""
        seal = self.files.get(path)
        if seal != (len(data), digest(data)):
            raise StoreError(f"{file}: expected {said(seal)}, found {said((len(data), digest(data)))}: {REPAIR}")

    def damage(self, folder: Path) -> Iterator[str]:
        """Yield the differences from the written state: files that are missing, changed, or additional."""
        for path, told in self.files.items():
            try:
                seal = seal_of(file_inside(folder, path))
            except StoreError as error:
                yield str(error)
                continue
            except OSError as error:
                yield f"{folder / path}: expected {said(told)}, found {error.strerror or error}"
                continue
            if seal != told:
                yield f"{folder / path}: expected {said(told)}, found {said(seal)}"
        yield from (f"{path}: expected no such file" for path in self._strangers(folder))

    def _strangers(self, folder: Path) -> Iterable[Path]:
        known = {folder / path for path in (*self.files, MANIFEST)}
        return (path for path in sorted(folder.rglob("*")) if path.is_file() and path not in known)


KNOWN = ("model.json", "shot.json", "scenery.json")
"""Files that say what a folder's others are made of."""


def refuse_another(damaged: Path, again: Path) -> None:
    """Raise StoreError where a folder that was made again is not equal to what the damaged one is known to have been.

    That is what its manifest says, or where that was damaged, too, what its files say that can be read. Where all files fit
    the manifest, and are wrong all the same, nothing is known.
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


def said(told: Seal | None) -> str:
    """A file's size and the beginning of its digest, in words."""
    return "no such file" if told is None else f"{told[0]:,} bytes with digest {told[1][:12]}"
