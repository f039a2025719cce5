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
"""Tries of a task whose process dies; the last one runs alone, in case memory was too small."""

MOST_DEATHS = 16
"""Deaths of workers, with no job ended in between, after which a run ends: what kills these kills the next ones, too."""


class Work(Protocol):
    """The jobs of a run, in lines: jobs of one line share the warm caches of a worker. Jobs are counted out one by one."""

    def lines(self) -> Iterable[tuple[str, int]]:
        """The name of each line, and about how many jobs are in it."""
        ...

    def jobs(self, line: str) -> Iterator[Job]:
        """The jobs of a line, in order."""
        ...


@dataclass(frozen=True)
class Job:
    """Something to do: its key in the data set, its line, and what a worker is told."""

    key: str
    line: str
    task: Any


@dataclass(frozen=True)
class Listed:
    """A few jobs, all named at once."""

    all: tuple[Job, ...]

    def lines(self) -> Iterable[tuple[str, int]]:
        """Their lines in the order of their first jobs."""
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
    """Nobody wants to know of frames under way."""


class Queue:
    """Jobs in their lines: a worker is given what it has warm, then of a line that nobody has, then of the line of which most
    is left. The next job of a line is asked for when a worker is free for it.

    `warm`: lines of workers who have not asked yet.
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
        """Return whether there is surely none to be handed out."""
        return not self._left and not self._back and not self._again

    @property
    def left(self) -> int:
        """About how many jobs are to be handed out."""
        return len(self._back) + len(self._again) + sum(max(count, 1) for count in self._left.values())

    def next(self, warm: str) -> Job | None:
        """The next job for a worker that has this line warm; None if there is none."""
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
        """A job came to its end: workers can live."""
        self._deaths = 0

    def again(self, job: Job, how: str, alone: bool = True) -> Outcome | None:
        """Put back a job whose worker died, for the next one or, if it may be to blame, for when it is `alone`; gives what
        there is to say of it if it was tried often enough. Raises WorkerDied where nobody lives long enough to end a job.
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
        """A job that was put back, for when nobody is at work beside it; None if there is none."""
        return self._again.pop() if self._again else None


def answer(worker: Worker, job: Job, tell: Callable[[int], None]) -> Outcome | str:
    """Return the result of a job in a worker's own process: its outcome, or the traceback of an error that ends the run.

    Raises MemoryError where memory is refused; the process is unreliable afterwards.
    """
    try:
        return Outcome(job.key, worker.do(job.task, tell))
    except UserError as error:
        return Outcome(job.key, error=type(error)(str(error)))
    except MemoryError:
        raise
    except Exception:
        return traceback.format_exc()
