"""The status of a data set: the frames in its index, the finished ones, and the reports of the active runs."""

from __future__ import annotations

import os
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from viewsphere.store import Store, located
from viewsphere.store.shots.heartbeat import SILENT_S, Heartbeat


@dataclass(frozen=True)
class Run:
    """A run at work: its last report, and the report's age in seconds. Its `state` is running, dead (its process is gone), or
    silent (on another machine, without a report for SILENT_S seconds, so most likely dead).
    """

    told: Heartbeat
    seconds_ago: float
    state: str


@dataclass(frozen=True)
class Status:
    """The progress of a data set.

    Frames are counted shot by shot: those that are `finished`, `left_out` at the user's request, and `missing`.
    The missing include those `under_way` (made by a run, in incomplete shots: lost if the run dies).
    Frames that get a channel later count once more.
    `models` are keys of models that are still missing. `failed` are the last reports of shards that ended with an error,
    until they run again.
    `rate` is the rate of all runs together, frames a second; `seconds_left` is the time for the missing frames at this rate,
    None while no run makes frames.
    """

    root: Path
    frames: int
    finished: int
    missing: int
    models: tuple[str, ...]
    runs: tuple[Run, ...]
    failed: tuple[Heartbeat, ...]

    @property
    def left_out(self) -> int:
        """Frames that the plan contains but no run will make."""
        return self.frames - self.finished - self.missing

    @property
    def under_way(self) -> int:
        """Missing frames that runs have made, in incomplete shots."""
        return sum(run.told.under_way for run in self.runs if run.state == "running")

    @property
    def complete(self) -> bool:
        """Return whether nothing except exports is left to make."""
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
        """Return the status as plain data, for scripts."""
        told = {**asdict(self), "root": str(self.root), "models": list(self.models)}
        asked = ("left_out", "under_way", "complete", "rate", "seconds_left")
        return told | {name: getattr(self, name) for name in asked}


def status(out: Path | str | os.PathLike[str]) -> Status:
    """Return the status of the data set in a folder; raises StoreError if there is none.

    It writes nothing and opens no shot. Its time depends on the number of finished shots, not of planned ones.
    """
    store = Store(located(out))
    plan = store.plan()
    done, skipped = tuple(store.finished()), store.skipped()
    return Status(
        store.root,
        frames=sum(index.samples for index in plan.all_indices),
        finished=sum(count for index in plan.all_indices for _, _, count in index.held(done)),
        missing=sum(gap.frames for gap in store.gaps(plan, done)),
        models=tuple(k for k in plan.models if k not in skipped and not (store.model_folder(k) / "model.json").is_file()),
        runs=tuple(_run(told, is_alive) for told, is_alive in store.heartbeats()),
        failed=store.failures(),
    )


def _run(told: Heartbeat, is_alive: bool | None) -> Run:
    ago = max(time.time() - told.beat, 0.0)
    if is_alive is False:
        return Run(told, ago, "dead")
    return Run(told, ago, "running" if is_alive or ago < SILENT_S else "silent")
