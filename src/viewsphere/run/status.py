"""How far a data set is: what its index asks for, what is there, and what the runs at work tell of themselves."""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from itertools import chain
from pathlib import Path
from typing import Any

from viewsphere.store import Store
from viewsphere.store.folder import is_alive
from viewsphere.store.heartbeat import SILENT_S, Heartbeat
from viewsphere.store.index import Index, Row
from viewsphere.store.records import PlanRecord


@dataclass(frozen=True)
class Run:
    """A run at work: what it told last, and how many seconds ago. Its `state` is running, or dead (its process is no more), or
    silent (of another machine, and nothing was heard of it for SILENT_S seconds: dead, most likely).
    """

    told: Heartbeat
    seconds_ago: float
    state: str


@dataclass(frozen=True)
class Status:
    """How far a data set is.

    Frames are counted shot by shot: those that are `finished`, `under_way` (made by a run, in shots that are not whole: lost if
    it dies), `left_out` at the user's wish, and `missing`: all others, those under way included. Frames that get a channel
    later count once more. `models` are keys of models that are still to be made, `failed` what runs told last that ended with
    an error, until they are run again. `rate` is that of all runs together, frames a second; `seconds_left` what is missing at
    this rate, None where no run makes frames.
    """

    root: Path
    frames: int
    finished: int
    under_way: int
    left_out: int
    models: tuple[str, ...]
    runs: tuple[Run, ...]
    failed: tuple[Heartbeat, ...]

    @property
    def missing(self) -> int:
        """Frames that are still to be finished."""
        return self.frames - self.finished - self.left_out

    @property
    def complete(self) -> bool:
        """Whether nothing is left to be made, but exports."""
        return not self.missing and not self.models

    @property
    def rate(self) -> float:
        """Frames a second of all runs."""
        return sum(run.told.rate for run in self.runs if run.state == "running")

    @property
    def seconds_left(self) -> float | None:
        """Seconds until nothing is missing, at this rate."""
        return (self.missing - self.under_way) / self.rate if self.rate else None

    def to_json(self) -> dict[str, Any]:
        """All of it as plain data, for scripts."""
        told = {**asdict(self), "root": str(self.root), "models": list(self.models)}
        asked = ("missing", "complete", "rate", "seconds_left")
        return told | {name: getattr(self, name) for name in asked}


def status(out: Path | str | os.PathLike[str]) -> Status:
    """How far the data set in a folder is; raises StoreError if there is none.

    Nothing is written, and no shot is opened: it takes as long as listing the shots' folders.
    """
    store = Store(Path(out))
    plan = store.plan()
    done, skipped = set(store.finished()), store.skipped()
    runs = tuple(map(_run, store.heartbeats()))
    models = tuple(k for k in plan.models if k not in skipped and not (store.model_folder(k) / "model.json").is_file())
    return Status(
        store.root,
        frames=sum(index.samples for index in _indices(plan)),
        finished=sum(row.count for row in map(plan.find, done) if row is not None),
        under_way=sum(run.told.under_way for run in runs if run.state == "running"),
        left_out=sum(row.count for row in _rows(plan, skipped) if row.key not in done),
        models=models,
        runs=runs,
        failed=store.failures(),
    )


def _indices(plan: PlanRecord) -> Iterator[Index]:
    return chain(plan.indices, (index for index, _ in plan.supplements))


def _rows(plan: PlanRecord, skipped: dict[str, str]) -> Iterator[Row]:
    """The shots that were left out, by their own keys or by those of what they show, each once."""
    for key in skipped:
        yield from chain.from_iterable(index.of(key) for index in _indices(plan))
        row = plan.find(key)
        if row is not None and row.subject not in skipped:
            yield row


def _run(told: Heartbeat) -> Run:
    ago = max(time.time() - told.beat, 0.0)
    if told.host == socket.gethostname():
        return Run(told, ago, "running" if is_alive(told.pid) else "dead")
    return Run(told, ago, "running" if ago < SILENT_S else "silent")
