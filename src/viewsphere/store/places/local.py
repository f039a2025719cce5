"""A data set on a disk: folders are made in a scratch folder, and renamed when they are complete."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Generator, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import chain, count
from pathlib import Path

from viewsphere.errors import StoreError
from viewsphere.scratch import ScratchDir, left_by_dead, of_this_process, scratch_folder, sweep
from viewsphere.store.shots.manifest import MANIFEST
from viewsphere.store.shots.moving import move, write_through

NEW, OLD = "new", "old"
"""Scratch folders: NEW for results in progress; OLD, by paths in the data set, for the folders that they replace."""

LOCK_S = 600
"""Seconds that a run waits while others change shared files, which takes them moments."""

NO_LOCKS = {errno.ENOLCK, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP}
"""Errors of file systems without locks."""

TAKEN = {errno.ENOTEMPTY, errno.EEXIST}
"""Errors of POSIX systems if another run was faster; Windows has no error of its own for this."""


@dataclass(frozen=True)
class Local:
    """Writes a data set below a folder."""

    root: Path

    @property
    def _store(self) -> Path:
        return self.root / "store"

    @property
    def _writing(self) -> Path:
        return self._store / "writing"

    def make(self) -> None:
        """See `Place`."""
        try:
            self._writing.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise StoreError(f"{self.root}: expected a writable output folder, found {error.strerror or error}") from None
        if not os.access(self._writing, os.W_OK):
            raise StoreError(f"{self.root}: expected a writable output folder, found one that cannot be written")
        with disk_errors(self.root):
            self._sweep()

    def is_foreign(self) -> bool:
        """See `Place`."""
        return self.root.is_dir() and any(self.root.iterdir()) and not self._writing.is_dir()

    def is_begun(self) -> bool:
        """See `Place`."""
        return any(self._writing.iterdir()) or any((self._store / "shots").glob("*/*"))

    def is_shared(self) -> bool:
        """See `Place`."""
        return True

    def others_at_work(self) -> bool:
        """See `Place`."""
        this_process = of_this_process()
        return any(not path.name.startswith(this_process) for path in self._writing.iterdir())

    @contextmanager
    def occupied(self) -> Generator[Path]:
        """See `Place`."""
        with disk_errors(self.root):
            scratch = ScratchDir.make(self._writing)
        try:
            yield scratch.folder
        finally:
            scratch.remove()
            with suppress(OSError):
                self._sweep()

    @contextmanager
    def locked(self) -> Generator[None]:
        """See `Place`."""
        from filelock import FileLock, Timeout

        lock = FileLock(self._store.absolute() / "lock", timeout=LOCK_S, is_singleton=True)
        with disk_errors(self.root):
            try:
                lock.acquire()
            except Timeout:
                raise StoreError(
                    f"{lock.lock_file}: expected other runs to be done with it within {LOCK_S} s, found one that is not: "
                    "end it if it hangs, or try again"
                ) from None
            except OSError as error:
                if error.errno not in NO_LOCKS:
                    raise
        try:
            yield
        finally:
            lock.release()

    @contextmanager
    def scratch_folder(self) -> Generator[Path]:
        """See `Place`."""
        with disk_errors(self.root):
            self._writing.mkdir(parents=True, exist_ok=True)
            scratch = ScratchDir.make(self._writing)
            try:
                yield scratch.folder
            except BaseException:
                self._give_up(scratch)
                raise
            scratch.remove()

    def put(self, made: Path, target: Path) -> None:
        """See `Place`."""
        target.parent.mkdir(parents=True, exist_ok=True)
        if made.is_file():
            move(made, target)
            return
        try:
            if target.is_dir() and not (target / MANIFEST).is_file():
                shutil.rmtree(target)
            move(made, target)
        except OSError:
            if not target.is_dir():
                raise

    def replace(self, made: Path, target: Path) -> None:
        """See `Place`. The old folder moves to the scratch folder and is removed with it, as is a folder that another run puts
        there at this moment. The old folder is never lost: if this fails between the two moves, `scratch_folder` puts it back;
        if the process dies, the next run does.
        """
        target.parent.mkdir(parents=True, exist_ok=True)
        old = made.parent / OLD / target.relative_to(self.root)
        old.parent.mkdir(parents=True)
        write_through(made)  # the slowest step, which fails on a full disk, precedes the removal of the old folder
        for another in count():
            with suppress(FileNotFoundError):  # there is none, or another run has moved it
                move(target, made.parent / f"{another}" if old.exists() else old)
            try:
                move(made, target)
                return
            except OSError as error:
                if not made.exists() or (error.errno not in TAKEN and not target.exists()):
                    raise

    def remove(self, folder: Path) -> None:
        """See `Place`."""
        shutil.rmtree(folder, ignore_errors=True)

    def finished(self) -> Iterator[str]:
        """See `Place`."""
        with suppress(FileNotFoundError):
            for group in os.scandir(self._store / "shots"):
                shots = os.scandir(group.path)
                yield from (shot.name for shot in shots if os.path.exists(f"{shot.path}/{MANIFEST}"))  # noqa: PTH110

    def _sweep(self) -> None:
        """Remove the unfinished results of dead writers, and put back the folders that they were about to replace."""
        for left in left_by_dead(self._writing):
            self._put_back(left)

    def _give_up(self, own: ScratchDir) -> None:
        """Remove an unfinished result, and put back the folder that it was about to replace; if that fails now, the next sweep
        does it.
        """
        is_back = False
        try:
            with suppress(OSError):
                self._put_back(own.folder)
                is_back = True
        finally:
            if is_back:
                own.remove()
            else:
                own.leave()

    def _put_back(self, left: Path) -> None:
        """Put back the folders that were about to be replaced, if no others have taken their places."""
        for old in _replaced(left / OLD):
            target = self.root / old.relative_to(left / OLD)
            if not target.exists():
                target.parent.mkdir(parents=True, exist_ok=True)
                try:
                    move(old, target)
                except OSError:
                    if not target.exists():  # else another run was faster
                        raise

    @contextmanager
    def new(self) -> Generator[Path]:
        """See `Place`."""
        target = self.root
        place, prefix = target.parent, f"{target.name}~"
        missing = [parent for parent in target.parents if not parent.exists()]
        try:
            with disk_errors(target):
                if target.exists() and (not target.is_dir() or any(target.iterdir())):
                    raise StoreError(
                        f"{target}: expected an empty or new folder, found other files: choose another, or delete it"
                    )
                place.mkdir(parents=True, exist_ok=True)
                sweep(place, prefix)
                with scratch_folder(place, prefix) as scratch:
                    folder = scratch / NEW
                    folder.mkdir()
                    yield folder
                    if target.exists():
                        target.rmdir()
                    move(folder, target)
        finally:
            for parent in missing:
                with suppress(OSError):  # something is in it
                    parent.rmdir()


def _replaced(old: Path) -> Iterator[Path]:
    """The models, shots and exports stored here under their paths in a data set, without links to other places."""
    exports = (path for path in old.glob("*") if path.name != "store")
    for path in chain(old.glob("store/models/*"), old.glob("store/shots/*/*"), exports):
        if path.resolve() == old.resolve() / path.relative_to(old):
            yield path


@contextmanager
def disk_errors(root: Path) -> Generator[None]:
    """Turn disk errors into one-line StoreErrors; finished results stay."""
    try:
        yield
    except OSError as error:
        raise StoreError(f"{root}: expected to write, found: {error.strerror or error}; what is finished is kept") from error
