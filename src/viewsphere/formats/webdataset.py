"""Tar shards to read as a stream (https://github.com/webdataset/webdataset), and an index of them.

    <split>-000000.tar, <split>-000001.tar, ...
    <split>.json                                 the shards and their numbers of samples, as `wids` reads it; the categories

A sample is a run of files of one key, `<index>`: its pictures as the store keeps them (`.rgb.png`), its other channels, also
pictures of more than eight bits, as arrays (`.depth.npy`), and all other data (`.json`). Equal samples make equal bytes: files
have no date and no owner.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Collection, Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.codecs import tar
from viewsphere.files import open_file
from viewsphere.formats.shared.writing.export_files import check_files
from viewsphere.formats.shared.writing.paper import json_bytes
from viewsphere.model.channel import ALL_PICTURES, PICTURES
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.sample import Sample
from viewsphere.plugins.format import FormatSpec, Remark
from viewsphere.store import Dataset
from viewsphere.store.shots.sample_records import whole_sample


class _Options(Frozen):
    """The size of shards, and the encoding of numbers."""

    samples_per_shard: int = Field(default=1000, ge=1, description="most samples of a shard")
    bytes_per_shard: int | None = Field(
        default=None, ge=1, description="a shard ends before the sample that would make its samples take more bytes than this"
    )
    arrays: Literal["npy", "files"] = Field(
        default="npy",
        description="channels that are no pictures: `npy`, arrays, which webdataset decodes; `files`, the store's own, which "
        "are smaller, but webdataset's decoders would make 8-bit colours of them",
    )


@dataclass(frozen=True)
class _Piece:
    """The next bytes of a file of the export, and their offset; `frame`: the frame that they belong to; `what`: their
    description.
    """

    file: str
    begin: int
    data: bytes
    what: str
    frame: int | None = None


@contextmanager
def _writer(
    dataset: Dataset, folder: Path, note: Callable[[str], None], options: _Options
) -> Generator[Callable[[Sample], None]]:
    """Write the shards and their indices; no more than a sample is held in memory."""
    shards = _Shards(dataset, options)

    def put(pieces: Iterator[_Piece]) -> None:
        for piece in pieces:
            with (folder / piece.file).open("ab") as file:
                file.write(piece.data)

    yield lambda sample: put(shards.add(sample))
    put(shards.end())


def _verify(dataset: Dataset, folder: Path, sampled: Collection[int], options: _Options) -> Iterator[Remark]:
    """Yield every difference from the current export in bytes, by the files inside the shards."""
    shards, sizes = _Shards(dataset, options), dict[str, int]()
    for piece in shards.all():
        sizes[piece.file] = piece.begin + len(piece.data)
        if (folder / piece.file).is_file() and _found(folder / piece.file, piece) != piece.data:
            yield piece.frame, f"{piece.file}: {piece.what}: expected the bytes that are exported, found others: export again"
    for name, size in sizes.items():
        if (folder / name).is_file() and (folder / name).stat().st_size > size:
            yield None, f"{name}: expected {size} bytes, found {(folder / name).stat().st_size}: export again"
    yield from check_files(dataset, folder, (), (), sizes)


def _found(file: Path, piece: _Piece) -> bytes:
    with open_file(file) as shard:
        shard.seek(piece.begin)
        return shard.read(len(piece.data))


@dataclass
class _Split:
    """The shards of a split: samples and bytes of the complete shards, and of the current one."""

    name: str
    whole: list[tuple[int, int]] = field(default_factory=list[tuple[int, int]])
    samples: int = 0
    size: int = 0

    def file(self, number: int) -> str:
        return f"{self.name}-{number:06d}.tar"

    def add(self, data: bytes, what: str, frame: int | None = None) -> _Piece:
        self.size += len(data)
        return _Piece(self.file(len(self.whole)), self.size - len(data), data, what, frame)

    def end(self) -> Iterator[_Piece]:
        """The end of the current shard, if there is one."""
        if self.samples:
            yield self.add(tar.ending(self.size), "its end")
            self.whole.append((self.samples, self.size))
            self.samples = self.size = 0

    def index(self, categories: list[dict[str, Any]]) -> _Piece:
        shards = [
            {"url": self.file(number), "nsamples": samples, "filesize": size}
            for number, (samples, size) in enumerate(self.whole)
        ]
        head = {"__kind__": "wids-shard-index-v1", "wids_version": 1, "name": self.name}
        data = json_bytes({**head, "categories": categories, "shardlist": shards}) + b"\n"
        return _Piece(f"{self.name}.json", 0, data, "its shards and categories")


class _Shards:
    """The conversion of samples into the bytes of the export's files."""

    def __init__(self, dataset: Dataset, options: _Options) -> None:
        self._dataset, self._options = dataset, options
        self._splits: dict[str, _Split] = {}

    def all(self) -> Iterator[_Piece]:
        """The bytes of all files."""
        for sample in self._dataset:
            yield from self.add(sample)
        yield from self.end()

    def add(self, sample: Sample) -> Iterator[_Piece]:
        """The bytes of a sample, preceded by the end of the previous shard if the sample starts a new one."""
        split = self._splits.setdefault(sample.split, _Split(sample.split))
        files = [(name, tar.member(name, data)) for name, data in self._files(sample)]
        size, most = sum(len(data) for _, data in files), self._options.bytes_per_shard
        if split.samples == self._options.samples_per_shard or (most and split.size + size > most):
            yield from split.end()
        split.samples += 1
        yield from (split.add(data, name, sample.index) for name, data in files)

    def end(self) -> Iterator[_Piece]:
        """Yield the ends of the last shards, and the indices."""
        categories = [dict(c.__dict__) for c in self._dataset.categories]
        for split in self._splits.values():
            yield from split.end()
            yield split.index(categories)

    def _files(self, sample: Sample) -> Iterator[tuple[str, bytes]]:
        key = f"{sample.index:08d}"
        for channel, stored in sorted(sample.files.items()):
            if channel in PICTURES or self._options.arrays == "files":
                yield f"{key}.{channel}{PurePosixPath(stored).suffix}", self._dataset.read(stored)
            else:
                yield f"{key}.{channel}.npy", _npy(sample.channels[channel])
        yield f"{key}.json", json_bytes(_record(sample))


def _record(sample: Sample) -> dict[str, Any]:
    """Return a sample's record without its pixels, and without the paths of a store, which the shards do not contain."""
    record = whole_sample(sample)
    objects = [{name: value for name, value in o.items() if name != "model"} for o in record["objects"]]
    return {**{name: value for name, value in record.items() if name != "files"}, "objects": objects}


def _npy(array: NDArray[Any]) -> bytes:
    data = io.BytesIO()
    np.lib.format.write_array(data, np.ascontiguousarray(array), (1, 0), allow_pickle=False)
    return data.getvalue()


FORMAT = FormatSpec(
    parallel_rays=True,
    rolling=True,
    about=__doc__,
    holds=("everything",),
    read_by=("webdataset", "wids"),
    pictures=ALL_PICTURES,
    options=_Options,
    names_credits=False,
    panoramas=True,
    writer=_writer,
    verify=_verify,
)
