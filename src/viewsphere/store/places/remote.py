"""A data set at a URL: folders are made on this machine, and uploaded file by file when they are complete."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import TypeVar, cast

from viewsphere.errors import StoreError
from viewsphere.scratch import temporary
from viewsphere.store.places.local import NEW, disk_errors
from viewsphere.store.shots.checksums import CHECKSUMS
from viewsphere.store.shots.manifest import MANIFEST
from viewsphere.urls import files_below
from viewsphere.urls.remote_path import RemotePath

AT_ONCE = 16
"""Number of parallel uploads or requests: storages answer many requests in the time of one."""

TELLING = (CHECKSUMS, MANIFEST, "model.json")
"""Files that describe a folder, in the order of their upload, after all other files. The last one that a folder has marks it as
complete.
"""

Item = TypeVar("Item")
Made = TypeVar("Made")


@dataclass(frozen=True)
class Remote:
    """Writes a data set below a URL."""

    root: RemotePath

    def make(self) -> None:
        """See `Place`; a missing permission shows only at the first upload."""

    def is_foreign(self) -> bool:
        """See `Place`."""
        return any(self.root.glob("*"))

    def is_begun(self) -> bool:
        """See `Place`; other runs cannot be detected."""
        return any(True for _ in self.finished())

    def is_shared(self) -> bool:
        """See `Place`."""
        return self.root.is_shared

    def others_at_work(self) -> bool:
        """See `Place`; other processes are not visible here."""
        return False

    def occupied(self) -> AbstractContextManager[Path]:
        """See `Place`; other runs cannot see it."""
        return temporary("run")

    def locked(self) -> AbstractContextManager[None]:
        """See `Place`; other processes are not visible here."""
        return nullcontext()

    @contextmanager
    def scratch_folder(self) -> Generator[Path]:
        """See `Place`."""
        with disk_errors(self.root), temporary("aside") as scratch:
            yield scratch

    def put(self, made: Path, target: Path) -> None:
        """See `Place`."""
        place = cast(RemotePath, target)
        if made.is_file():
            place.upload(made)
            return
        paths = list(files_below(made))
        telling = [name for name in TELLING if name in paths]
        if telling and (place / telling[-1]).is_file():
            return
        _each(lambda path: (place / path).unlink(), set(place.files_below()) - set(paths))  # of a run that was ended
        _each(lambda path: (place / path).upload(made / path), [path for path in paths if path not in telling])
        for name in telling:
            (place / name).upload(made / name)

    def replace(self, made: Path, target: Path) -> None:
        """See `Place`. The old folder is absent from the first file on, and the new one is there with the last."""
        place = cast(RemotePath, target)
        for name in reversed(TELLING):
            (place / name).unlink()
        self.put(made, place)

    def remove(self, folder: Path) -> None:
        """See `Place`."""
        place = cast(RemotePath, folder)
        for name in reversed(TELLING):
            (place / name).unlink()
        _each(lambda path: (place / path).unlink(), place.files_below())

    def finished(self) -> Iterator[str]:
        """See `Place`. Folders of shots are listed group by group, with their content: a thousand files per response."""
        groups = list((self.root / "store" / "shots").glob("*"))
        yield from chain.from_iterable(_each(_finished_of, groups))

    @contextmanager
    def new(self) -> Generator[Path]:
        """See `Place`."""
        if self.is_foreign():
            raise StoreError(f"{self.root}: expected an empty or new folder, found other files: choose another, or delete it")
        with self.scratch_folder() as scratch:
            folder = scratch / NEW
            folder.mkdir()
            yield folder
            self.put(folder, self.root)


def _finished_of(group: RemotePath) -> list[str]:
    """Keys of the shots in a group that have a manifest."""
    parted = (path.partition("/") for path in group.files_below())
    return [key for key, _, file in parted if file == MANIFEST]


def _each(work: Callable[[Item], Made], items: Iterable[Item]) -> list[Made]:
    """Return the result for each item, in order, several at once; the first error ends the work."""
    with ThreadPoolExecutor(AT_ONCE) as pool:
        futures = [pool.submit(work, item) for item in items]
        try:
            return [future.result() for future in futures]
        except BaseException:
            with suppress(Exception):
                pool.shutdown(wait=False, cancel_futures=True)
            raise
