"""The conversion of data sets from other tools to other formats, without leaving a viewsphere data set behind."""

from __future__ import annotations

import errno
import os
import re
from collections.abc import Generator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from viewsphere.errors import StoreError, UserError
from viewsphere.files import read_bytes
from viewsphere.recipe.formats import Formats, read_formats
from viewsphere.run.datasets.importing import put_in_store, read_dataset
from viewsphere.run.exports.exporting import linked, write
from viewsphere.run.exports.scope import refuse, scope_of_foreign
from viewsphere.run.exports.writable import writable
from viewsphere.run.progress import Listener, null_listener
from viewsphere.scratch import scratch_folder
from viewsphere.store import Dataset, located, new_folder
from viewsphere.store.foreign import ForeignDataset
from viewsphere.store.places.local import TAKEN
from viewsphere.store.shots.checksums import CHECKSUMS, damaged_files


@dataclass(frozen=True)
class Converted:
    """The result of `viewsphere.convert`.

    Attributes:
        frames: Number of written frames.
        left_out: The parts that `keep_going` left out, with reasons.
        notes: Notes of the formats for the user.
    """

    frames: int
    left_out: tuple[str, ...]
    notes: tuple[str, ...]


def convert(
    kind: str,
    source: Path | str,
    formats: Formats,
    out: Path | str,
    *,
    keep_going: bool = False,
    workers: int = 0,
    listener: Listener | None = None,
) -> Converted:
    """Write another tool's data set in these formats, each to OUT/<format>, as `export` does.

    The files are hard links to the source's files or copies of them, so you can delete the source afterwards. Either all
    folders are written or none. A folder from an earlier run with the same files stays, so you can repeat a run that was
    killed between two folders.

    Args:
        kind: Format of the source, such as `coco`.
        source: Folder or file of the source.
        formats: Formats to write, as for `export`.
        out: Folder for the exports.
        keep_going: Leaves out broken parts of the source, and reports them.
        workers: Number of processes, as for `export`.
        listener: A function that receives a `Progress` whenever the work has advanced.

    Returns:
        The number of frames, what was left out, and notes.

    Raises:
        UserError: A format is unknown or cannot hold the data set.
        StoreError: The source is broken, or a folder contains other files.
    """
    entries = read_formats(formats)
    for entry in entries:
        writable(entry.name, "--to")
        _check_outside(source, located(out) / entry.name)
        entry.arguments()
    if not entries:
        raise UserError("--to: expected a format; found none")
    foreign = read_dataset(kind, source, keep_going=keep_going, field="--from")
    refuse(entries, scope_of_foreign(foreign), source)
    with ExitStack() as whole:
        # In order of names: of two simultaneous runs, the first to put one folder in place puts all shared folders in place.
        ordered = sorted(entries, key=lambda entry: entry.name)
        folders = [(entry, whole.enter_context(_folder(located(out) / entry.name))) for entry in ordered]
        store = whole.enter_context(scratch_folder(folders[0][1].parent)) / "store"  # on the same disk, for links
        with _told_of(store, foreign, source, located(out)):
            put_in_store(foreign, store, listener)
            dataset = Dataset(store)
            notes = write(dataset, folders, listener or null_listener, workers)
        return Converted(len(dataset), foreign.left_out, tuple(dict.fromkeys(notes)) + tuple(linked(dataset, out)))


@contextmanager
def _folder(target: Path) -> Generator[Path]:
    """A folder to write into that becomes `target`. It is deleted if `target` already has the same files, also if another run
    has put them there meanwhile.

    Raises StoreError if `target` contains other files.
    """
    made = b""
    if (target / CHECKSUMS).is_file():
        with scratch_folder(target.parent) as own:
            folder = own / target.name
            folder.mkdir()
            yield folder
            _check_same(read_bytes(folder / CHECKSUMS, "MAX_STREAMED_BYTES"), target)
        return
    try:
        with new_folder(target) as folder:
            yield folder
            made = read_bytes(folder / CHECKSUMS, "MAX_STREAMED_BYTES")
    except StoreError as error:
        if not made or getattr(error.__cause__, "errno", None) not in TAKEN:
            raise
        _check_same(made, target)


def _check_same(made: bytes, target: Path) -> None:
    """Raise StoreError unless the files of a folder match this list of digests."""
    listed = target / CHECKSUMS
    is_same = listed.is_file() and read_bytes(listed, "MAX_STREAMED_BYTES") == made
    if not is_same or any(damaged_files(target)):
        raise StoreError(f"{target}: this folder holds another data set. Choose another folder, or delete it")


FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""Error codes of a full disk."""


@contextmanager
def _told_of(store: Path, foreign: ForeignDataset, source: Path | str, out: Path) -> Generator[None]:
    """Report errors as errors of the source, or of the output if its disk is full, but not of the temporary store."""
    try:
        yield
    except UserError as error:
        full = next((reason for reason in map(os.strerror, FULL) if reason in str(error)), None)
        if full is not None:
            raise StoreError(f"{out}: the disk takes no more data ({full}). Free some room, or choose another folder") from None
        found = re.search(rf"{re.escape(str(store))}\S*/(\w+)/(\d{{8}})\.\w+: ", str(error))
        if found is None:
            raise type(error)(str(error).replace(str(store), str(source))) from None
        frame = next(islice(foreign.frames(), int(found[2]), None))
        file = frame.files[found[1]]
        name = file if isinstance(file, Path) else f"{source}, picture {found[2]}"
        raise type(error)(f"{name}: expected a whole picture; found a damaged one: mend it, or take it out") from None


def _check_outside(source: Path | str, folder: Path) -> None:
    """Raise UserError for a folder inside the source data set."""
    if folder.resolve().is_relative_to(Path(source).resolve()):
        raise UserError(f"-o: expected a folder outside of the data set that is read; found {folder}")
