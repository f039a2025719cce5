"""The local pool: processes that each do one job at a time, are handed what they have warm, and may die.

`ProcessPoolExecutor` can hang when a worker dies or is replaced (CPython issue 115634) and knows nothing of what a worker has
warm, hence our own: one pipe a worker, spawn rather than fork.
"""

from __future__ import annotations

import signal
import sys
import traceback
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import get_context, resource_tracker
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, cast

from viewsphere.errors import UserError, ViewsphereError

if TYPE_CHECKING:
    from viewsphere.run.tasks import Worker
    from viewsphere.sampling.extension import Portion

LIVES = 2
"""How often a task is tried when its process dies."""


class Work(Protocol):
    """What there is to do, in lines: jobs of one line share what a worker has warm. Jobs are counted out one by one."""

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
        """Those of a line."""
        return (job for job in self.all if job.line == line)


@dataclass(frozen=True)
class Outcome:
    """What became of a job: the frames it made, or why it could not be done."""

    key: str
    frames: int = 0
    error: ViewsphereError | None = None


def ignored() -> None:
    """Nobody wants to know of frames under way."""


class Crew:
    """So many workers for a part of a data set, this process itself if none; workers that were started stay until the context
    ends.

    A worker is started when there is a job for it, and takes a second.
    """

    def __init__(self, root: Path, workers: int, portion: Portion) -> None:
        self._root = root
        self._workers = workers
        self._portion = portion
        self._hands: list[_Hand] = []
        self._here: Worker | None = None
        self._begun: dict[str, int] = {}

    def __enter__(self) -> Crew:
        return self

    def __exit__(self, *_: object) -> None:
        for hand in self._hands:
            hand.stop()
        self._hands.clear()
        self._here = None

    @property
    def under_way(self) -> int:
        """Frames that were made of jobs without an outcome so far; those of a worker that dies no longer count."""
        return sum(self._begun.values())

    def run(self, work: Work, heard: Callable[[], None] = ignored) -> Iterator[Outcome]:
        """Do all jobs; outcomes come as they are ready. `heard` is called when another frame is under way.

        A UserError is an outcome; anything else a worker raises ends the run with its traceback.
        """
        queue = Queue(work, [hand.line for hand in self._hands])
        if self._workers == 0:
            yield from self._run_here(queue, heard)
            return
        busy: dict[Connection, _Hand] = {}
        for hand in self._hands:
            if hand.line in queue:
                self._give(hand, queue, busy)
        for hand in self._hands:
            if hand.pipe not in busy:
                self._give(hand, queue, busy)
        while len(self._hands) < self._workers and self._give(None, queue, busy):
            pass
        while busy:
            for pipe in wait(list(busy)):
                yield from self._hear(busy, cast(Connection, pipe), queue, heard)  # Windows has another class

    def _note(self, job: Job, frames: int, heard: Callable[[], None]) -> None:
        """Remember how many frames of a job are made."""
        self._begun[job.key] = frames
        heard()

    def _run_here(self, queue: Queue, heard: Callable[[], None]) -> Iterator[Outcome]:
        from viewsphere.run.tasks import Worker

        self._here = self._here or Worker(self._root, self._portion)
        line = ""
        while (job := queue.next(line)) is not None:
            line = job.line
            try:
                outcome = Outcome(job.key, self._here.do(job.task, lambda frames, job=job: self._note(job, frames, heard)))
            except UserError as error:
                outcome = Outcome(job.key, error=error)
            self._begun.pop(job.key, None)
            yield outcome

    def _give(self, hand: _Hand | None, queue: Queue, busy: dict[Connection, _Hand]) -> bool:
        """Hand out the next job, to a new worker if none is given; False if there is none."""
        job = queue.next(hand.line if hand else "")
        if job is None:
            return False
        if hand is None:
            hand = _Hand(self._root, self._portion)
            self._hands.append(hand)
        busy[hand.pipe] = hand
        hand.give(job)
        return True

    def _hear(
        self, busy: dict[Connection, _Hand], pipe: Connection, queue: Queue, heard: Callable[[], None]
    ) -> Iterator[Outcome]:
        """Take the news of a frame; or one answer, or the news of a death, and hand out the next job."""
        hand = busy[pipe]
        job = hand.job
        assert job is not None
        try:
            answer: Outcome | str | int = pipe.recv()
        except (EOFError, ConnectionResetError):
            self._end(job, busy, pipe)
            self._hands.remove(hand)
            code = hand.stop()
            if not queue.again(job):
                yield Outcome(job.key, error=ViewsphereError(f"{job.key}: its worker died {LIVES} times (exit code {code})"))
            self._give(None, queue, busy)
            return
        if isinstance(answer, int):
            self._note(job, answer, heard)
            return
        self._end(job, busy, pipe)
        if isinstance(answer, str):
            raise ViewsphereError(f"{job.key}: a worker failed\n{answer}")
        self._give(hand, queue, busy)
        yield answer

    def _end(self, job: Job, busy: dict[Connection, _Hand], pipe: Connection) -> None:
        """Its worker no longer does a job; the frames of one that died are made again, those of an outcome are in it."""
        self._begun.pop(job.key, None)
        del busy[pipe]


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
        self._tries: Counter[str] = Counter()
        self._again: list[Job] = []

    def __contains__(self, line: str) -> bool:
        return line in self._left

    def next(self, warm: str) -> Job | None:
        """The next job for a worker that has this line warm; None if there is none."""
        if self._again:
            job = self._again.pop()
            self._tries[job.key] += 1
            return job
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

    def again(self, job: Job) -> bool:
        """Put back a job whose worker died; False if it was tried often enough."""
        if self._tries[job.key] >= LIVES - 1:
            return False
        self._again.append(job)
        return True


class _Hand:
    """One worker process, seen from here."""

    def __init__(self, root: Path, portion: Portion) -> None:
        context = get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(theirs, root, portion), daemon=True)
        with _deaf():
            self.process.start()
        theirs.close()
        self.line = ""
        self.job: Job | None = None

    def give(self, job: Job) -> None:
        self.job, self.line = job, job.line
        with suppress(OSError):  # a dead worker is noticed when its answer is awaited
            self.pipe.send(job)

    def stop(self) -> int | None:
        """End the process; what it had not finished is lost, what it had is not."""
        self.process.terminate()
        self.process.join()
        self.pipe.close()
        return self.process.exitcode


@contextmanager
def _deaf() -> Generator[None]:
    """A process started meanwhile does not hear Ctrl-C, not even before `_serve` begins; this one hears it afterwards."""
    if sys.platform == "win32":  # has no masks to inherit
        yield
        return
    resource_tracker.ensure_running()  # the start of the tracker would unblock the signal again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _serve(pipe: Connection, root: Path, portion: Portion) -> None:
    """A worker's life: take a job, tell of each of its frames by their number so far, answer, until the other side is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to handle
    from viewsphere.run.allocator import keep_freed_memory
    from viewsphere.run.tasks import Worker

    keep_freed_memory()
    worker = Worker(root, portion)
    with suppress(EOFError, ConnectionError):  # the parent is gone, with or without unread answers
        while True:
            job: Job = pipe.recv()
            try:
                pipe.send(Outcome(job.key, worker.do(job.task, pipe.send)))
            except UserError as error:
                pipe.send(Outcome(job.key, error=type(error)(str(error))))
            except Exception:
                pipe.send(traceback.format_exc())
