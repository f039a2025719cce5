"""The contents of an export's files, for writing and for checking them."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from viewsphere.codecs.png_tiff import decode_png, encode_png
from viewsphere.errors import UserError
from viewsphere.files import open_file, read_bytes
from viewsphere.plugins.format import Remark
from viewsphere.store.shots.checksums import CHECKSUMS

if TYPE_CHECKING:
    from viewsphere.store import Dataset


@dataclass(frozen=True)
class Coded:
    """The encoded bytes of a frame, by the encoding's name; exports in one pass that share an encoding compute them once."""

    frame: int
    name: str
    make: Callable[[], bytes]


Content = str | bytes | Coded | NDArray[np.bool_]
"""A file's content: a stored file by its path from the data set's root, bytes, encoded bytes, or a mask (H, W), which becomes
a PNG.
"""

Expected = tuple[int | None, str, Content]
"""The frame that a file belongs to (None if there is no single one), the file's path from the export's folder, and its
content.
"""

PNG = b"\x89PNG"
"""The beginning of every PNG."""

BLOCK = 1 << 20
"""Number of bytes of a file to compare at once."""


def put(dataset: Dataset, content: Content, file: Path) -> None:
    """Write a file with this content."""
    if isinstance(content, str):
        dataset.link(content, file)
        return
    if not file.parent.is_dir():
        file.parent.mkdir(parents=True, exist_ok=True)
    if isinstance(content, Coded):
        dataset.put(content.frame, content.name, content.make, file)
    else:
        file.write_bytes(content if isinstance(content, bytes) else encode_png(content))


def models(dataset: Dataset) -> Iterator[Expected]:
    """The files of the normalised models, as `Dataset.link_models` places them in MODELS."""
    return ((None, f"MODELS/{inside}", stored) for inside, stored in dataset.model_files())


def check_files(
    dataset: Dataset, folder: Path, expected: Iterable[Expected], again: Iterable[Expected], besides: Collection[str]
) -> Iterator[Remark]:
    """Check that every expected file exists with the right content, and that there are no other files except those named in
    `besides`. These are checked after all expected files.

    `again`: the expected files once more, read only if there are more files than expected, so that names need not be kept.
    """
    there = 0
    for frame, name, content in expected:
        problem = _problem(dataset, content, folder / name)
        there += (folder / name).is_file()
        if problem:
            yield frame, f"{name}: {problem}: export again"
    lacking = [name for name in besides if not (folder / name).is_file()]
    yield from ((None, f"{name}: expected a file, found none: export again") for name in lacking)
    there += len(besides) - len(lacking)
    listed = (folder / CHECKSUMS).is_file()
    if sum(len(names) for _, _, names in os.walk(folder)) > there + listed:
        known = {CHECKSUMS, *besides, *(name for _, name, _ in again)}
        found = (file.relative_to(folder).as_posix() for file in sorted(folder.rglob("*")) if not file.is_dir())
        yield from ((None, f"{name}: expected no such file, found one") for name in found if name not in known)


def _problem(dataset: Dataset, content: Content, file: Path) -> str | None:
    if not file.is_file():
        return "expected a file, found none"
    if isinstance(content, str):
        from viewsphere.store.foreign import Loaded  # only a loaded data set has them

        stored = dataset.stored(content)
        same = read_bytes(file) == stored.data if isinstance(stored, Loaded) else same_bytes(stored, file)
        return None if same else f"expected the bytes of {content}, found others"
    data = read_bytes(file)
    if isinstance(content, bytes | Coded):
        made = content if isinstance(content, bytes) else content.make()
        return None if data == made else _different(made, data)
    if data == encode_png(content):
        return None
    try:  # another version of the encoder may have written the same mask in other bytes
        return None if np.array_equal(decode_png(data), content) else "expected the mask of its object, found another"
    except UserError as error:
        return f"expected the mask of its object, found: {error}"


def _different(wanted: bytes, found: bytes) -> str | None:
    """Return the difference between two files' bytes. Pictures of equal pixels do not differ: another version of the encoder
    may have written one of them.
    """
    at = next((i for i, (a, b) in enumerate(zip(wanted, found, strict=False)) if a != b), min(len(wanted), len(found)))
    problem = f"expected {len(wanted)} bytes that are exported, found {len(found)}, others from byte {at} on"
    if not wanted.startswith(PNG):
        return problem
    try:
        return None if np.array_equal(decode_png(found), decode_png(wanted)) else problem
    except UserError as error:
        return f"expected a picture, found: {error}"


def same_bytes(one: Path, other: Path) -> bool:
    """Return whether two files hold the same bytes; hard links of one file do, and are not read."""
    if one.samefile(other):
        return True
    if one.stat().st_size != other.stat().st_size:
        return False
    with open_file(one) as a, open_file(other) as b:
        while block := a.read(BLOCK):
            if block != b.read(BLOCK):
                return False
    return True
