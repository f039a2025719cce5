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
    """Workers for a part of a data set, who stay warm until the context ends."""

    def __enter__(self) -> Self: ...

    def __exit__(self, *_: object) -> None: ...

    @property
    def under_way(self) -> int:
        """Frames that were made of jobs without an outcome so far; those of a worker that dies no longer count."""
        ...

    @property
    def nodes(self) -> int | None:
        """The number of machines at work; None for an executor that only uses this machine."""
        ...

    @property
    def notes(self) -> tuple[str, ...]:
        """The notes about the workers for the user, a line each."""
        ...

    def run(self, work: Work, report: Callable[[], None] = ignored) -> Iterator[Outcome]:
        """Do all jobs; outcomes come as they are ready. `report` is called when there is news, such as another frame under way.

        A UserError is an outcome, and so is WorkerDied, of a job that was lost with its worker LIVES times; this one is raised
        where MOST_DEATHS workers die one after another and nothing is done in between, and anything else
        that a worker raises ends the run with its traceback.
        """
        ...


def worker_pool(root: Path, portion: DatasetPart, workers: int, ray: str | None = None) -> WorkerPool:
    """A worker pool for a part of the data set at `root`: so many workers of this machine, this process itself if none; or,
    with the address of a Ray cluster, at most so many of its CPUs, all if none.

    Raises UserError for an address that cannot be one, MissingExtraError where Ray is not installed.
    """
    if ray is None:
        from viewsphere.run.executors.local import LocalPool

        return LocalPool(root, portion, workers)
    from viewsphere.run.executors.ray import RayPool

    return RayPool(root, portion, workers, ray)
