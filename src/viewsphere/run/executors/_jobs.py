"""The jobs of a run, their distribution to workers, and their outcomes; the same for all executors."""

from __future__ import annotations

import traceback
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from viewsphere.errors import UserError, ViewsphereError, WorkerDied

if TYPE_CHECKING:
    from viewsphere.run.shots.tasks import Worker

LIVES = 2
"""Attempts at a task whose process dies; the last attempt runs alone, in case memory was too small."""

MOST_DEATHS = 16
"""Number of workers that may die without a finished job in between; then the run ends, because later ones would die as well."""


class Work(Protocol):
    """The jobs of a run, grouped in lines: jobs of one line share the warm caches of a worker. Jobs are
    generated one by one.
    """

    def lines(self) -> Iterable[tuple[str, int]]:
        """The name of each line, and the approximate number of its jobs."""
        ...

    def jobs(self, line: str) -> Iterator[Job]:
        """The jobs of a line, in order."""
        ...


@dataclass(frozen=True)
class Job:
    """A unit of work: its key in the data set, its line, and the task for a worker."""

    key: str
    line: str
    task: Any


@dataclass(frozen=True)
class Listed:
    """Work from a list of a few jobs."""

    all: tuple[Job, ...]

    def lines(self) -> Iterable[tuple[str, int]]:
        """The lines in the order of their first jobs."""
        return Counter(job.line for job in self.all).items()

    def jobs(self, line: str) -> Iterator[Job]:
        """Yield the jobs of a line."""
        return (job for job in self.all if job.line == line)


@dataclass(frozen=True)
class Outcome:
    """The outcome of a job: the frames it made, or the error that stopped it."""

    key: str
    frames: int = 0
    error: ViewsphereError | None = None


def ignored() -> None:
    """The `report` that does nothing."""


class Queue:
    """The queue of jobs in lines. A worker gets a job of its warm line first, then of a line without a worker, then of the line
    with the most jobs left. The next job of a line is generated when a worker is free for it.

    `warm`: lines of workers that have not requested a job yet.
    """

    def __init__(self, work: Work, warm: Iterable[str] = ()) -> None:
        self._work = work
        self._left = dict(work.lines())
        self._untaken = deque(self._left)
        self._open: dict[str, Iterator[Job]] = {}
        self._takers = Counter(warm)
        self._back: list[Job] = []
        self._again: list[Job] = []
        self._tried: set[str] = set()
        self._deaths = 0

    def __contains__(self, line: str) -> bool:
        return line in self._left

    @property
    def is_done(self) -> bool:
        """Return whether certainly no job is left."""
        return not self._left and not self._back and not self._again

    @property
    def left(self) -> int:
        """The approximate number of jobs left."""
        return len(self._back) + len(self._again) + sum(max(count, 1) for count in self._left.values())

    def next(self, warm: str) -> Job | None:
        """The next job for a worker whose warm line is this one; None if no job is left."""
        if self._back:
            return self._back.pop()
        while self._left:
            line = warm if warm in self._left else self._coldest()
            job = next(self._open.setdefault(line, self._work.jobs(line)), None)
            if job is None:
                del self._left[line], self._open[line]
                continue
            self._left[line] -= 1
            if line != warm:
                self._takers[line] += 1
            return job
        return None

    def _coldest(self) -> str:
        while self._untaken:
            line = self._untaken[0]
            if line in self._left and not self._takers[line]:
                return line
            self._untaken.popleft()
        return max(self._left, key=lambda line: self._left[line] / self._takers[line])

    def ended(self) -> None:
        """Note that a job ended, which resets the count of deaths."""
        self._deaths = 0

    def again(self, job: Job, how: str, alone: bool = True) -> Outcome | None:
        """Put back a job whose worker died. The next worker gets it; if the job may be the cause, it waits to run `alone`.
        Returns the outcome of a job that has used up its attempts. Raises WorkerDied if workers keep dying before they end any
        job.
        """
        self._deaths += 1
        if self._deaths == MOST_DEATHS:
            before = f"and so did {MOST_DEATHS - 1} before it, without a shot in between"
            raise WorkerDied(f"{job.key}: its worker died ({how}), {before}")
        if job.key in self._tried:
            return Outcome(job.key, error=WorkerDied(f"{job.key}: its worker died {LIVES} times ({how})"))
        self._tried.add(job.key)
        (self._again if alone else self._back).append(job)
        return None

    def last(self) -> Job | None:
        """A job that was put back to run alone, without other workers at work; None if there is none."""
        return self._again.pop() if self._again else None


def answer(worker: Worker, job: Job, tell: Callable[[int], None]) -> Outcome | str:
    """Return the result of a job in a worker's own process: its outcome, or the traceback of an error that ends the run.

    Raises MemoryError if memory runs out; the process is unreliable afterwards.
    """
    try:
        return Outcome(job.key, worker.do(job.task, tell))
    except UserError as error:
        return Outcome(job.key, error=type(error)(str(error)))
    except MemoryError:
        raise
    except Exception:
        return traceback.format_exc()
