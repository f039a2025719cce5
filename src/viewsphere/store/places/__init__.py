"""The places of data sets: a disk, or a URL. Reading is the same for both (`viewsphere.urls`).

Writing uses a `Place`: a folder is made in a scratch folder of this machine, and moved to its place when it is complete.
A disk does that by a rename. A URL has no rename: files are uploaded, and the file that marks the folder as complete comes
last. A folder without this file counts as absent, and is made again over its remains. No run detects others at a URL: runs
that make the same shot write the same bytes. Files of the store are never changed, so reading needs no locks.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Protocol

from viewsphere.urls import RemotePath


class Place(Protocol):
    """Writes a data set below its root."""

    def make(self) -> None:
        """See that it can be written, and clear what dead runs left; raises StoreError if it cannot."""
        ...

    def is_foreign(self) -> bool:
        """Return whether there are files which no store has, though nothing tells of a store."""
        ...

    def is_begun(self) -> bool:
        """Return whether any shot is there, or another run is at work."""
        ...

    def is_shared(self) -> bool:
        """Return whether other processes find there what this one writes."""
        ...

    def others_at_work(self) -> bool:
        """Return whether another run is at work; False where nothing is known of others."""
        ...

    def occupied(self) -> AbstractContextManager[Path]:
        """Show other runs that this one is at work, by a folder of this machine that is aside as long as the block lasts; then
        what workers left that died goes, too.
        """
        ...

    def locked(self) -> AbstractContextManager[None]:
        """Nobody else changes what runs have in common as long as the block lasts, where that can be known. Blocks may be
        nested.
        """
        ...

    def scratch_folder(self) -> AbstractContextManager[Path]:
        """A folder of this machine for what is not whole yet, as long as the block lasts; StoreError for what the disk refuses
        meanwhile.
        """
        ...

    def put(self, made: Path, target: Path) -> None:
        """Put a file or folder that lies aside in its place. A file takes the place of another; where another writer finished
        the same folder first, that one stays.
        """
        ...

    def replace(self, made: Path, target: Path) -> None:
        """Put a folder that lies aside in the place of another one."""
        ...

    def remove(self, folder: Path) -> None:
        """Remove a folder of the data set with all that is in it, as far as that is possible."""
        ...

    def finished(self) -> Iterator[str]:
        """Keys of all shots whose manifest is there, in no order."""
        ...

    def new(self) -> AbstractContextManager[Path]:
        """A folder to write into that becomes the root itself when the block ends well; raises StoreError where files lie
        there.
        """
        ...


def place_of(root: Path) -> Place:
    """Return the writer for this root."""
    if isinstance(root, RemotePath):
        from viewsphere.store.places.remote import Remote

        return Remote(root)
    from viewsphere.store.places.local import Local

    return Local(root)
