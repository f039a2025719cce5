"""The places of data sets: a disk, or a URL. Reading is the same for both (`viewsphere.urls`).

Writing uses a place: a folder is made in a scratch folder of this machine, and moved to its place when it is complete.
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


class _Place(Protocol):
    """Writes a data set below its root."""

    def make(self) -> None:
        """Check that the root can be written, and remove the remains of dead runs; raises StoreError if it cannot."""
        ...

    def is_foreign(self) -> bool:
        """Return whether the root has files but no sign of a store."""
        ...

    def is_begun(self) -> bool:
        """Return whether any shot exists, or another run is active."""
        ...

    def is_shared(self) -> bool:
        """Return whether other processes can read the results of this one."""
        ...

    def others_at_work(self) -> bool:
        """Return whether another run is active; False if other runs cannot be detected."""
        ...

    def occupied(self) -> AbstractContextManager[Path]:
        """Show other runs that this one is active, by a scratch folder of this machine during the block. Its end also removes
        the remains of dead workers.
        """
        ...

    def locked(self) -> AbstractContextManager[None]:
        """Keep other runs from changing shared files during the block, where the place supports that. Blocks may be nested."""
        ...

    def scratch_folder(self) -> AbstractContextManager[Path]:
        """A folder of this machine for incomplete results during the block; errors of the disk become StoreError."""
        ...

    def put(self, made: Path, target: Path) -> None:
        """Move a file or folder from a scratch folder to its place. A file replaces another; if another writer finished the
        same folder first, that folder stays.
        """
        ...

    def replace(self, made: Path, target: Path) -> None:
        """Replace a folder by one from a scratch folder."""
        ...

    def remove(self, folder: Path) -> None:
        """Remove a folder of the data set with its content, as far as possible."""
        ...

    def finished(self) -> Iterator[str]:
        """Keys of all shots with a manifest, in no order."""
        ...

    def new(self) -> AbstractContextManager[Path]:
        """A folder to write into that becomes the root itself if the block succeeds; StoreError if the root has files."""
        ...


def place_of(root: Path) -> _Place:
    """Return the writer for this root."""
    if isinstance(root, RemotePath):
        from viewsphere.store.places.remote import Remote

        return Remote(root)
    from viewsphere.store.places.local import Local

    return Local(root)
