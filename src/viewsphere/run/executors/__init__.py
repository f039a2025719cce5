"""The executors of a run: processes of this machine (`local`), or the machines of a Ray cluster (`ray`).

An executor is a file with a `Crew`; the common code is in `_jobs`. No other module depends on the choice of executor.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, Self

from viewsphere.run.executors._jobs import LIVES, Job, Listed, Outcome, Queue, Work, ignored

if TYPE_CHECKING:
    from viewsphere.planning.extension import Portion

__all__ = ["LIVES", "Crew", "Job", "Listed", "Outcome", "Queue", "Work", "hired"]


class Crew(Protocol):
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

    def run(self, work: Work, heard: Callable[[], None] = ignored) -> Iterator[Outcome]:
        """Do all jobs; outcomes come as they are ready. `heard` is called when there is news, such as another frame under way.

        A UserError is an outcome, and so is WorkerDied, of a job that was lost with its worker LIVES times; this one is raised
        where MOST_DEATHS workers die one after another and nothing is done in between, and anything else
        that a worker raises ends the run with its traceback.
        """
        ...


def hired(root: Path, portion: Portion, workers: int, ray: str | None = None) -> Crew:
    """A crew for a part of the data set at `root`: so many workers of this machine, this process itself if none; or, with the
    address of a Ray cluster, at most so many of its CPUs, all if none.

    Raises UserError for an address that cannot be one, MissingExtraError where Ray is not installed.
    """
    if ray is None:
        from viewsphere.run.executors.local import LocalCrew

        return LocalCrew(root, portion, workers)
    from viewsphere.run.executors.ray import RayCrew

    return RayCrew(root, portion, workers, ray)
