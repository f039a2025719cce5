"""The finished shots of a store that others may be writing to, found again and again for little."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass

from viewsphere.store.shots.folder import Store
from viewsphere.store.shots.manifest import MANIFEST

SETTLED = 2.0
"""Seconds after which a folder's time tells whether anything came into it since: file systems count time in steps."""


@dataclass(frozen=True)
class Finished:
    """A shot that is there: its key, when it was finished, in seconds since 1970 by its manifest's time, and whether it was
    told of before, and was made again since.
    """

    key: str
    made: float
    again: bool


class Watch:
    """Tells of each shot of a store once, when it is finished, and again when it was made again.

    Only those folders are read into which something came since.
    """

    def __init__(self, store: Store) -> None:
        self._folder = store.folder / "shots"
        self._read: dict[str, float] = {}
        self._made: dict[str, float] = {}

    def news(self) -> Iterator[Finished]:
        """The shots that were finished since it was asked before, in no order."""
        with suppress(FileNotFoundError), os.scandir(self._folder) as groups:
            for group in groups:
                with suppress(FileNotFoundError, NotADirectoryError):
                    yield from self._news_of(group)

    def _news_of(self, group: os.DirEntry[str]) -> Iterator[Finished]:
        changed = group.stat().st_mtime
        if self._read.get(group.name) == changed:
            return
        is_settled = time.time() - changed > SETTLED
        with os.scandir(group.path) as shots:
            for shot in shots:
                with suppress(FileNotFoundError, NotADirectoryError):
                    modified = os.stat(f"{shot.path}/{MANIFEST}").st_mtime  # noqa: PTH116, Path takes as long again
                    if (before := self._made.get(shot.name)) != modified:
                        self._made[shot.name] = modified
                        yield Finished(shot.name, modified, before is not None)
        if is_settled:
            self._read[group.name] = changed
