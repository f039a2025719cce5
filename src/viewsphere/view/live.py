"""The finished frames of a data set that may still grow, and the columns of their labels.

Frames are listed as soon as they are finished, without reading a file; their columns are read later, in the background. Both
only grow, in the same order: a row of the columns belongs to the same row of the list.
"""

from __future__ import annotations

import signal
import threading
import time
from collections import deque
from collections.abc import Collection, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from contextlib import suppress
from copy import copy
from dataclasses import dataclass, replace
from functools import lru_cache
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import StoreError, UserError, ViewsphereError
from viewsphere.model.sample import Sample
from viewsphere.report.paths import without_folders
from viewsphere.report.table import FRAME, OBJECT, Columns, FrameTable, Rows, table_of
from viewsphere.store import Dataset, Watch
from viewsphere.urls import RemotePath

LISTED = np.dtype([("number", "i8"), ("made", "f8")])
"""A finished frame: its number in the plan, and when it was finished, in seconds since 1970."""

PIECE = 2048
"""Approximate number of frames whose records are read at once."""

MANY = 2 * PIECE
"""Number of frames without columns from which other processes read them, so that this process has time for the page."""

KEPT = 512
"""Number of samples whose records are cached."""

PAUSE = 0.5
"""Seconds between two checks of the store."""

RECENT = 120.0
"""Length in seconds of the period that determines a run's speed."""

MOST_FAILURES = 200
"""Maximum number of failures that a page receives."""


@dataclass(frozen=True)
class _Shot:
    """A finished shot: its key, its first frame, its number of frames, its finish time, and whether it was remade."""

    key: str
    first: int
    count: int
    made: float
    again: bool


@dataclass(frozen=True)
class Known:
    """The state of a data set at one time: the listed frames, and the columns of the first of them.

    `frames` are rows of `LISTED`; `damaged` marks the rows of the table with records that could not be read.
    """

    frames: NDArray[Any]
    table: FrameTable
    damaged: NDArray[np.bool_]

    @property
    def read(self) -> int:
        """The number of listed frames with columns."""
        return len(self.damaged)

    def first(self, listed: int, read: int) -> Known:
        """Return the state with only the first `listed` frames of the list and the first `read` rows of columns."""
        table = self.table
        objects = table.objects[: int(np.searchsorted(table.objects["frame"], read))]
        names = (table.splits, table.subjects, table.models, table.poses)
        return Known(self.frames[:listed], FrameTable(table.frames[:read], objects, *names), self.damaged[:read])

    @property
    def sound(self) -> FrameTable:
        """The columns of the readable frames."""
        table = self.table
        return FrameTable(table.frames[~self.damaged], table.objects, table.splits, table.subjects, table.models, table.poses)


class Live:
    """Watches a data set in a separate thread, between `start` and `stop`.

    Raises StoreError if there is no data set, UserError for a URL, whose files it would have to request repeatedly.
    """

    def __init__(self, root: Path, workers: int = 1) -> None:
        if isinstance(root, RemotePath):
            raise UserError(f"{root}: expected a folder on this machine, found a URL: viewsphere report writes a page of it")
        self.dataset = Dataset(root)
        self._workers = max(1, workers)
        self._plan_seen = self._plan_time()
        self._watch = Watch(self.dataset.store)
        self._shots: list[_Shot] = []
        self._shots_read = 0
        self._frames, self._damaged = Rows(LISTED), Rows(np.dtype(np.bool_))
        self._columns = Columns()
        self._unreadable: dict[str, str] = {}
        self._sample = lru_cache(maxsize=KEPT)(self._read_sample)
        self._lock = threading.Lock()
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._look, name="viewsphere view", daemon=True)

    def start(self) -> None:
        """Start to watch."""
        self._thread.start()

    def stop(self) -> None:
        """Stop watching."""
        self._end.set()
        self._thread.join()

    @property
    def snapshot(self) -> Known:
        """The current state; it does not change when more frames arrive."""
        with self._lock:
            return Known(self._frames.array, self._columns.table, self._damaged.array)

    def sample(self, number: int) -> Sample:
        """The sample of a frame's number; raises StoreError for a missing or unreadable one.

        Recent records are cached for requests of their pictures; arrays are not.
        """
        sample = self._sample(self.dataset, number)
        return replace(sample, channels=copy(sample.channels))

    def _read_sample(self, dataset: Dataset, number: int) -> Sample:
        try:
            row = dataset.plan.row_at(number)
        except IndexError:
            raise StoreError(f"frame {number}: expected one of {dataset.plan.frames:,} frames") from None
        if not dataset.store.has_shot(row.key):
            raise StoreError(f"frame {number}: expected a finished frame, found none so far")
        return dataset.sample_at(row.key, number - row.first)

    def times(self) -> list[tuple[float, int]]:
        """Return the time at which each listed shot was finished, in seconds since 1970, and its number of frames."""
        return [(shot.made, shot.count) for shot in list(self._shots)]

    def failures(self) -> dict[str, str]:
        """Return the reasons, by model or shot, for parts left out of the run and for shots that cannot be read."""
        found = dict(self._unreadable)
        try:
            found |= self.dataset.store.skipped()
        except StoreError as error:
            found["skipped.json"] = str(error)
        return {key: without_folders(why) for key, why in found.items()}

    def state(self) -> dict[str, Any]:
        """Return the progress of the data set as plain data.

        It has the frames planned (without frames left out), left out, finished and with columns. It also has frames a second,
        seconds left, failures, and the age of the newest frame.
        """
        known, failures, now = self.snapshot, self.failures(), time.time()
        left_out = self._left_out(failures)
        finished, planned = len(known.frames), self.dataset.plan.frames - left_out
        made = known.frames["made"]
        rate = _rate(made, now)
        return {
            "planned": planned,
            "leftOut": left_out,
            "finished": finished,
            "read": known.read,
            "rate": round(rate, 3),
            "left": round((planned - finished) / rate, 1) if rate else None,
            "age": round(max(0.0, now - float(made.max())), 1) if finished else None,
            "failed": len(failures),
            "failures": list(failures.items())[:MOST_FAILURES],
        }

    def _left_out(self, failures: Collection[str]) -> int:
        """Return the number of the plan's frames that will never be rendered."""
        plan = self.dataset.plan
        shots = (row for row in map(plan.find, failures) if row is not None and row.subject not in failures)
        subjects = sum(index.samples_of(name) for index in plan.indices for name in failures)
        return subjects + sum(row.count for row in shots if not self.dataset.store.has_shot(row.key))

    def _look(self) -> None:
        # Ctrl-C is for the main thread; the readers that this thread starts inherit the blocked signal.
        if hasattr(signal, "pthread_sigmask"):
            signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        while not self._end.is_set():
            # If the store is moved or unreadable for a while, the page shows its last state.
            with suppress(OSError, ViewsphereError):
                self._list_news()
            self._read_columns()
            self._end.wait(PAUSE)

    def _plan_time(self) -> tuple[int, int]:
        found = self.dataset.store.plan_file.stat()
        return found.st_mtime_ns, found.st_size

    def _list_news(self) -> None:
        """Add the newly finished frames; an extended plan and remade shots are read again."""
        news = sorted(self._news(), key=lambda shot: shot.first)
        if (seen := self._plan_time()) != self._plan_seen or any(shot.again for shot in news):
            self.dataset, self._plan_seen = Dataset(self.dataset.root), seen
        for shot in news:
            if shot.again:
                self._unreadable.pop(shot.key, None)
                continue
            rows = np.zeros(shot.count, LISTED)
            rows["number"], rows["made"] = np.arange(shot.first, shot.first + shot.count), shot.made
            with self._lock:
                self._frames.extend(rows)
                self._shots.append(shot)

    def _news(self) -> Iterator[_Shot]:
        """The new shots of the plan's own frames, without shots that add channels to older frames."""
        plan = self.dataset.plan
        for found in self._watch.news():
            row = plan.find(found.key)
            if row is None and self._plan_time() != self._plan_seen:
                plan = self.dataset.store.plan()
                row = plan.find(found.key)
            if row is not None and row.part == plan.part_of(row.first):
                yield _Shot(found.key, row.first, row.count, found.made, found.again)

    def _read_columns(self) -> None:
        """Read the columns of all frames that have none, in the order of the list."""
        if sum(shot.count for shot in self._shots[self._shots_read :]) >= MANY:
            with suppress(BrokenExecutor):  # then this process reads the rest, and reports the shot at fault
                self._read_elsewhere()
        for piece in _pieces(self._shots[self._shots_read :]):
            if self._end.is_set():
                return
            self._take(piece, _tables(self.dataset, piece))

    def _read_elsewhere(self) -> None:
        """Read the columns in other processes, and check for new frames meanwhile."""
        ahead: deque[tuple[Sequence[_Shot], Future[list[FrameTable | str]]]] = deque()
        with ProcessPoolExecutor(self._workers, get_context("spawn"), _step_back) as pool:
            for piece in _pieces(self._shots[self._shots_read :]):
                ahead.append((piece, pool.submit(_read, self.dataset.root, piece)))
                if len(ahead) > 2 * self._workers:
                    self._take_first(ahead)
                if self._end.is_set():
                    pool.shutdown(wait=False, cancel_futures=True)
                    return
            while ahead:
                self._take_first(ahead)

    def _take_first(self, ahead: deque[tuple[Sequence[_Shot], Future[list[FrameTable | str]]]]) -> None:
        piece, future = ahead.popleft()
        self._take(piece, future.result())
        with suppress(OSError, ViewsphereError):
            self._list_news()

    def _take(self, shots: Sequence[_Shot], tables: Sequence[FrameTable | str]) -> None:
        with self._lock:
            for shot, table in zip(shots, tables, strict=True):
                if isinstance(table, str):
                    self._unreadable[shot.key] = table
                self._columns.extend(_unknown(shot.count, self.dataset.splits[0]) if isinstance(table, str) else table)
                self._damaged.extend(np.full(shot.count, isinstance(table, str)))
            self._shots_read += len(shots)


def _step_back() -> None:
    """Lower this process's priority in favour of rendering and the page."""
    import os

    if hasattr(os, "nice"):
        os.nice(10)


def _pieces(shots: Sequence[_Shot]) -> Iterator[Sequence[_Shot]]:
    """The shots in pieces of about `PIECE` frames."""
    piece: list[_Shot] = []
    for shot in shots:
        piece.append(shot)
        if sum(s.count for s in piece) >= PIECE:
            yield piece
            piece = []
    if piece:
        yield piece


def _read(root: Path, shots: Sequence[_Shot]) -> list[FrameTable | str]:
    return _tables(Dataset(root), shots)


def _tables(dataset: Dataset, shots: Sequence[_Shot]) -> list[FrameTable | str]:
    """The columns of each shot, or the reason why it cannot be read."""
    found: list[FrameTable | str] = []
    for shot in shots:
        try:
            found.append(table_of(dataset.samples_of(shot.key, range(shot.count))))
        except (ViewsphereError, ArithmeticError, TypeError, ValueError) as error:  # also numbers that do not fit a column
            found.append(str(error))
    return found


def _unknown(count: int, split: str) -> FrameTable:
    """Columns of frames about which only the split is known."""
    frames = np.zeros(count, FRAME)
    for name in ("azimuth", "elevation", "distance"):
        frames[name] = np.nan
    return FrameTable(frames, np.zeros(0, OBJECT), (split,), ("",), (), ())


def _rate(made: NDArray[np.float64], now: float) -> float:
    """Recent frames a second, from the times at which they were finished; 0 if there are no recent frames or the rate is
    unknown.

    Future times are from before the clock was set back, and do not count.
    """
    recent = np.sort(made[(made >= now - RECENT) & (made <= now)])
    if not len(recent) or recent[0] == recent[-1]:
        return 0.0
    return float(np.count_nonzero(recent > recent[0]) / (now - recent[0]))
