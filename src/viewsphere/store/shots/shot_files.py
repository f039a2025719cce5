"""The writing of a shot's channel files into its folder: each by itself, or all in one tar."""

from __future__ import annotations

import os
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Self

import xxhash

from viewsphere.codecs import tar
from viewsphere.files import read_bytes
from viewsphere.model.fields.files import Files
from viewsphere.store.shots.manifest import SHARD, Manifest, Seal, Span, digest, seal_of
from viewsphere.urls import link_file


class ShotFiles:
    """The folder of an unfinished shot, which receives its channels and other files during the block. If the block succeeds, it
    gets its manifest, which names the `painter`.
    """

    def __init__(self, folder: Path, kinds: Files, painter: str = "") -> None:
        self._folder, self._painter = folder, painter
        self._shard = _Shard(folder / SHARD) if kinds.shots == "tar" else None
        self._seals: dict[str, Seal] = {}
        self._folders = set[Path]()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if self._shard:
            self._shard.close()
        if kind is None:
            self._manifest().write(self._folder)

    def add(self, inside: str, data: bytes) -> None:
        """Write a channel's file with these bytes to its path in the folder; raises ValueError if the path is taken."""
        if self._shard:
            self._shard.add(inside, data)
        else:
            _write(self._place(inside), data)
            self._seals[inside] = len(data), digest(data)

    def link(self, inside: str, file: Path) -> None:
        """Add a channel's file that exists on a disk or at a URL; by a hard link where possible. Errors as for `add`."""
        if self._shard:
            self._shard.add(inside, read_bytes(file, "MAX_PICTURE_BYTES"))
        else:
            place = self._place(inside)
            link_file(file.resolve(), place)
            self._seals[inside] = seal_of(place)

    def _place(self, inside: str) -> Path:
        if inside in self._seals:
            raise _second(inside)
        place = self._folder / inside
        if place.parent not in self._folders:
            place.parent.mkdir(exist_ok=True)
            self._folders.add(place.parent)
        return place

    def _manifest(self) -> Manifest:
        texts = {path.name: seal_of(path) for path in sorted(self._folder.glob("*.json"))}
        if self._shard:
            return Manifest({**texts, SHARD: self._shard.seal}, self._shard.spans, self._painter)
        return Manifest(texts | self._seals, painter=self._painter)


class _Shard:
    """A tar that is being written."""

    def __init__(self, file: Path) -> None:
        self.spans: dict[str, Span] = {}
        self._stream: BinaryIO = file.open("wb")
        self._digest, self._size = xxhash.xxh3_128(), 0

    @property
    def seal(self) -> Seal:
        return self._size, self._digest.hexdigest()

    def add(self, inside: str, data: bytes) -> None:
        if inside in self.spans:
            raise _second(inside)
        self._write(tar.head(inside, len(data)))
        self.spans[inside] = self._size, len(data), digest(data)
        self._write(data)
        self._write(tar.filling(len(data)))

    def close(self) -> None:
        with self._stream:
            self._write(tar.ending(self._size))

    def _write(self, data: bytes) -> None:
        self._stream.write(data)
        self._digest.update(data)
        self._size += len(data)


def _second(inside: str) -> ValueError:
    return ValueError(f"expected samples of different numbers, found {inside} twice")


def _write(file: Path, data: bytes) -> None:
    """Write a new file; for small files, Python's file objects would double the time."""
    descriptor = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | getattr(os, "O_BINARY", 0), 0o666)
    try:
        left = memoryview(data)
        while left:
            left = left[os.write(descriptor, left) :]
    finally:
        os.close(descriptor)
