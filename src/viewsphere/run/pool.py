"""The local pool: processes that each do one task at a time, are handed what they have warm, and may die.

`ProcessPoolExecutor` can hang when a worker dies or is replaced (CPython issue 115634) and knows no affinity, hence our
own: one pipe a worker, spawn rather than fork.
"""

from __future__ import annotations

import signal
import traceback
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import TYPE_CHECKING, Any

from viewsphere.errors import UserError, ViewsphereError

if TYPE_CHECKING:
    from viewsphere.run.tasks import Worker

LIVES = 2
"""How often a task is tried when its process dies."""


@dataclass(frozen=True)
class Job:
    """Something to do, named before it is spelled out: `make` gives the task when a worker is free for it."""

    key: str
    affinity: str
    make: Callable[[], Any]


@dataclass(frozen=True)
class Outcome:
    """What became of a job: the frames it made, or why it could not be done."""

    key: str
    frames: int = 0
    error: ViewsphereError | None = None


class Crew:
    """So many workers for one data set, this process itself if none; those that have come stay until the context ends.

    A worker comes when there is a job for it, and takes a second.
    """

    def __init__(self, root: Path, workers: int) -> None:
        self._root = root
        self._workers = workers
        self._hands: list[_Hand] = []
        self._here: Worker | None = None

    def __enter__(self) -> Crew:
        return self

    def __exit__(self, *_: object) -> None:
        for hand in self._hands:
            hand.stop()
        self._hands.clear()
        self._here = None

    def run(self, jobs: Iterable[Job]) -> Iterator[Outcome]:
        """Do all jobs, one list at a time; outcomes come as they are ready.

        A UserError is an outcome; anything else a worker raises ends the run with its traceback.
        """
        if self._workers == 0:
            yield from self._run_here(jobs)
            return
        queue = Queue(jobs, [hand.affinity for hand in self._hands])
        busy: dict[Connection, _Hand] = {}
        for hand in self._come(queue):
            busy[hand.pipe] = hand
            hand.give(queue.next(hand.affinity))
        while busy:
            for pipe in wait(list(busy)):
                assert isinstance(pipe, Connection)
                yield from self._hear(busy, pipe, queue)

    def _run_here(self, jobs: Iterable[Job]) -> Iterator[Outcome]:
        from viewsphere.run.tasks import Worker

        self._here = self._here or Worker(self._root)
        for job in jobs:
            try:
                yield Outcome(job.key, self._here.do(job.make()))
            except UserError as error:
                yield Outcome(job.key, error=error)

    def _come(self, queue: Queue) -> list[_Hand]:
        """As many hands as there is work for, first those that have some of it warm."""
        number = min(self._workers, len(queue))
        while len(self._hands) < number:
            self._hands.append(_Hand(self._root))
        return sorted(self._hands, key=lambda hand: hand.affinity not in queue)[:number]

    def _hear(self, busy: dict[Connection, _Hand], pipe: Connection, queue: Queue) -> Iterator[Outcome]:
        """Take one answer, or the news of a death, and hand out the next job."""
        hand = busy.pop(pipe)
        job = hand.job
        assert job is not None
        try:
            answer: Outcome | str = pipe.recv()
        except (EOFError, ConnectionResetError):
            self._hands.remove(hand)
            code = hand.stop()
            if not queue.again(job):
                yield Outcome(job.key, error=ViewsphereError(f"{job.key}: its worker died {LIVES} times (exit code {code})"))
            if queue:
                hand = _Hand(self._root)
                self._hands.append(hand)
                busy[hand.pipe] = hand
                hand.give(queue.next(""))
            return
        if isinstance(answer, str):
            raise ViewsphereError(f"{job.key}: a worker failed\n{answer}")
        if queue:
            busy[pipe] = hand
            hand.give(queue.next(hand.affinity))
        yield answer


class Queue:
    """Jobs by affinity: a worker is given what it has warm, then what nobody has, then of what most is left.

    `warm`: what those have who have not asked yet.
    """

    def __init__(self, jobs: Iterable[Job], warm: Iterable[str] = ()) -> None:
        self._left: dict[str, deque[Job]] = {}
        self._takers = Counter(warm)
        self._tries: Counter[str] = Counter()
        for job in jobs:
            self._left.setdefault(job.affinity, deque()).append(job)
        self._count = sum(len(q) for q in self._left.values())

    def __len__(self) -> int:
        return self._count

    def __contains__(self, affinity: str) -> bool:
        return affinity in self._left

    def next(self, warm: str) -> Job:
        """The next job for a worker that has this affinity warm."""
        affinity = warm if warm in self else self._coldest()
        line = self._left[affinity]
        job = line.popleft()
        if not line:
            del self._left[affinity]
        if affinity != warm:
            self._takers[affinity] += 1
        self._count -= 1
        self._tries[job.key] += 1
        return job

    def _coldest(self) -> str:
        for affinity in self._left:
            if not self._takers[affinity]:
                return affinity
        return max(self._left, key=lambda a: len(self._left[a]) / self._takers[a])

    def again(self, job: Job) -> bool:
        """Put back a job whose worker died; False if it was tried often enough."""
        if self._tries[job.key] >= LIVES:
            return False
        self._left.setdefault(job.affinity, deque()).appendleft(job)
        self._count += 1
        return True


class _Hand:
    """One worker process, seen from here."""

    def __init__(self, root: Path) -> None:
        context = get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(theirs, root), daemon=True)
        self.process.start()
        theirs.close()
        self.affinity = ""
        self.job: Job | None = None

    def give(self, job: Job) -> None:
        self.job, self.affinity = job, job.affinity
        task = job.make()
        with suppress(OSError):  # a dead worker is noticed when its answer is awaited
            self.pipe.send(task)

    def stop(self) -> int | None:
        """End the process; what it had not finished is lost, what it had is not."""
        self.process.terminate()
        self.process.join()
        self.pipe.close()
        return self.process.exitcode


def _serve(pipe: Connection, root: Path) -> None:
    """A worker's life: take a task, answer, until the other side is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to handle
    from viewsphere.run.tasks import Worker

    worker = Worker(root)
    with suppress(EOFError, BrokenPipeError):
        while True:
            task = pipe.recv()
            try:
                pipe.send(Outcome(task.key, worker.do(task)))
            except UserError as error:
                pipe.send(Outcome(task.key, error=type(error)(str(error))))
            except Exception:
                pipe.send(traceback.format_exc())
