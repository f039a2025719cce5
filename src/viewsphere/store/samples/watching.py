"""Repeated, cheap searches for the finished shots of a store that other processes may be writing to."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass

from viewsphere.store.shots.folder import Store
from viewsphere.store.shots.manifest import MANIFEST

SETTLED = 2.0
"""Seconds after which a folder's modification time reliably shows new entries: file systems store time in coarse steps."""


@dataclass(frozen=True)
class Finished:
    """A finished shot: its key, the time of its manifest in seconds since 1970, and whether it was reported before and has been
    made again since.
    """

    key: str
    made: float
    again: bool


class Watch:
    """Reports each shot of a store once, when it is finished, and again if it is made again.

    Only folders with new entries are read.
    """

    def __init__(self, store: Store) -> None:
        self._folder = store.folder / "shots"
        self._read: dict[str, float] = {}
        self._made: dict[str, float] = {}

    def news(self) -> Iterator[Finished]:
        """The shots finished since the previous call, in no order."""
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
