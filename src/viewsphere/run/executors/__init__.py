"""The executors of a run: processes of this machine (`local`), or the machines of a Ray cluster (`ray`).

An executor is a file with a `WorkerPool`; the common code is in `_jobs`. No other module depends on the choice of executor.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, Self

from viewsphere.run.executors._jobs import LIVES, Job, Listed, Outcome, Queue, Work, ignored

if TYPE_CHECKING:
    from viewsphere.planning.extension import DatasetPart

__all__ = ["LIVES", "Job", "Listed", "Outcome", "Queue", "Work", "WorkerPool", "worker_pool"]


class WorkerPool(Protocol):
    """Workers for a part of a data set, which stay warm until the context ends."""

    def __enter__(self) -> Self: ...

    def __exit__(self, *_: object) -> None: ...

    @property
    def under_way(self) -> int:
        """Number of finished frames in jobs without an outcome; the frames of a worker that dies no longer count."""
        ...

    @property
    def nodes(self) -> int | None:
        """The number of machines at work; None for an executor that only uses this machine."""
        ...

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes about the workers for the user, one line each."""
        ...

    def run(self, work: Work, report: Callable[[], None] = ignored) -> Iterator[Outcome]:
        """Do all jobs and yield their outcomes as they are ready. `report` is called on progress, such as another finished
        frame.

        A UserError is an outcome, and so is WorkerDied for a job that was lost with its worker LIVES times. WorkerDied is
        raised if MOST_DEATHS workers die one after another without finishing a job. Any other exception in a worker ends the
        run with its traceback.
        """
        ...


def worker_pool(root: Path, portion: DatasetPart, workers: int, ray: str | None = None) -> WorkerPool:
    """A worker pool for a part of the data set at `root`. It has `workers` processes of this machine, or is this process
    itself if 0. With the address of a Ray cluster it has at most `workers` of the cluster's CPUs, or all if 0.

    Raises UserError for an invalid address, MissingExtraError if Ray is not installed.
    """
    if ray is None:
        from viewsphere.run.executors.local import LocalPool

        return LocalPool(root, portion, workers)
    from viewsphere.run.executors.ray import RayPool

    return RayPool(root, portion, workers, ray)
