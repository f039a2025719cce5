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
    """A run that has not ended.

    Attributes:
        told: Its last report.
        seconds_ago: Age of the report in seconds.
        state: `running`; `dead`: its process is gone; `silent`: it is on another machine and has not reported for `SILENT_S`
            seconds, so it is most likely dead.
    """

    told: Heartbeat
    seconds_ago: float
    state: str


@dataclass(frozen=True)
class Status:
    """The progress of a data set. Frames are counted shot by shot; frames that get a channel later count once more.

    Attributes:
        root: Folder of the data set.
        frames: Number of frames in the plan.
        finished: Number of frames in finished shots.
        missing: Number of frames still to make, including those `under_way`.
        models: Keys of models that are still missing.
        runs: The runs that have not ended.
        failed: The last report of each shard that ended with an error, until it runs again.
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
        """Missing frames that runs have made, in incomplete shots; a run that dies loses them."""
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
        """Seconds until nothing is missing, at the current rate; None while no run makes frames."""
        return (self.missing - self.under_way) / self.rate if self.rate else None

    def to_json(self) -> dict[str, Any]:
        """Return the status as plain data, for scripts.

        Returns:
            All attributes by name, of types that JSON has.
        """
        told = {**asdict(self), "root": str(self.root), "models": list(self.models)}
        asked = ("left_out", "under_way", "complete", "rate", "seconds_left")
        return told | {name: getattr(self, name) for name in asked}


def status(out: Path | str | os.PathLike[str]) -> Status:
    """Return the status of a data set. It writes nothing and opens no shot.

    Its time depends on the number of finished shots, not of planned ones.

    Args:
        out: Folder or URL of the data set.

    Returns:
        The counts of frames, the missing models and the active runs.

    Raises:
        StoreError: There is no data set.
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
