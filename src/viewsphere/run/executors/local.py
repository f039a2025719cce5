"""A pool of processes of this machine. Each does one job at a time, preferably of its warm line, and may die.

`ProcessPoolExecutor` can hang when a worker dies or is replaced (CPython issue 115634) and ignores the warm caches of workers,
so viewsphere has its own worker processes (`workers/process.py`).
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import TYPE_CHECKING, cast

from viewsphere.errors import UserError, ViewsphereError
from viewsphere.kernels.garbage import importing, spare_imports
from viewsphere.run.executors._jobs import Job, Outcome, Queue, Work, answer, ignored
from viewsphere.run.workers.process import OUT_OF_MEMORY, WorkerProcess, belong_to_parent, end_reason, interrupts_deferred

if TYPE_CHECKING:
    from viewsphere.planning.extension import DatasetPart
    from viewsphere.run.shots.tasks import Worker

ADVICE = ", the last time while it was alone: give it more memory, or ask for smaller pictures or models"

LEAVING_S = 5.0
"""Seconds for workers to end after the last job."""


class LocalPool:
    """Worker processes for a part of a data set; with 0 workers, this process itself.

    A worker starts with its first job, which takes a second, and stays until the context ends.
    """

    nodes: int | None = None
    notes: tuple[str, ...] = ()

    def __init__(self, root: Path, portion: DatasetPart, workers: int) -> None:
        self._root = root
        self._workers = workers
        self._portion = portion
        self._pool: list[_Worker] = []
        self._here: Worker | None = None
        self._begun: dict[str, int] = {}

    def __enter__(self) -> LocalPool:
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        if kind is None:
            self._let_go()
        self._dismiss()
        self._here = None

    def _let_go(self) -> None:
        """Give all workers time to end by themselves and to remove their temporary files."""
        until = time.monotonic() + LEAVING_S
        for worker in self._pool:
            worker.pipe.close()
        for worker in self._pool:
            worker.process.join(max(0.0, until - time.monotonic()))

    def _dismiss(self) -> None:
        """End all workers, and free the memory of their warm caches."""
        for worker in self._pool:
            worker.stop()
        self._pool.clear()

    @property
    def under_way(self) -> int:
        """Number of finished frames in jobs without an outcome; the frames of a worker that dies no longer count."""
        return sum(self._begun.values())

    def run(self, work: Work, report: Callable[[], None] = ignored) -> Iterator[Outcome]:
        """Like `WorkerPool.run`; `report` is called after every finished frame."""
        queue = Queue(work, [worker.line for worker in self._pool])
        if self._workers == 0:
            yield from self._run_here(queue, report)
            return
        busy: dict[Connection, _Worker] = {}
        for worker in self._pool:
            if worker.line in queue:
                self._give(worker, queue, busy)
        for worker in self._pool:
            if worker.pipe not in busy:
                self._give(worker, queue, busy)
        while len(self._pool) < self._workers and self._give(None, queue, busy):
            pass
        while busy:
            for pipe in wait(list(busy)):
                yield from self._receive(busy, cast(Connection, pipe), queue, report)  # another class on Windows
            if not busy and (job := queue.last()):
                self._dismiss()
                self._give_to(None, job, busy)

    def _note(self, job: Job, frames: int, report: Callable[[], None]) -> None:
        """Store the number of a job's finished frames."""
        self._begun[job.key] = frames
        report()

    def _run_here(self, queue: Queue, report: Callable[[], None]) -> Iterator[Outcome]:
        with importing():
            from viewsphere.run.shots.tasks import Worker

        self._here = self._here or Worker(self._root, self._portion)
        line = ""
        while (job := queue.next(line)) is not None:
            line = job.line
            try:
                outcome = Outcome(job.key, self._here.do(job.task, lambda frames, job=job: self._note(job, frames, report)))
            except UserError as error:
                outcome = Outcome(job.key, error=error)
            self._begun.pop(job.key, None)
            yield outcome

    def _give(self, worker: _Worker | None, queue: Queue, busy: dict[Connection, _Worker]) -> bool:
        """Hand out the next job, to a new worker if none is given; False if there is none."""
        job = queue.next(worker.line if worker else "")
        if job is not None:
            self._give_to(worker, job, busy)
        return job is not None

    def _give_to(self, worker: _Worker | None, job: Job, busy: dict[Connection, _Worker]) -> None:
        if worker is None:
            with interrupts_deferred():  # until it is registered here, so that it is ended with the others
                worker = _Worker(self._root, self._portion)
                self._pool.append(worker)
        busy[worker.pipe] = worker
        worker.give(job)

    def _receive(
        self, busy: dict[Connection, _Worker], pipe: Connection, queue: Queue, report: Callable[[], None]
    ) -> Iterator[Outcome]:
        """Receive one message. After an answer or a worker's death, hand out the next job."""
        worker = busy[pipe]
        job = worker.job
        assert job is not None
        try:
            news: Outcome | str | int = pipe.recv()
        except (EOFError, OSError):  # it may die while sending an answer
            self._end(job, busy, pipe)
            self._pool.remove(worker)
            if failed := queue.again(job, end_reason(worker.end(), ADVICE)):
                yield failed
            self._give(None, queue, busy)
            return
        if isinstance(news, int):
            self._note(job, news, report)
            return
        self._end(job, busy, pipe)
        if isinstance(news, str):
            raise ViewsphereError(f"{job.key}: a worker failed\n{news}")
        queue.ended()
        self._give(worker, queue, busy)
        yield news

    def _end(self, job: Job, busy: dict[Connection, _Worker], pipe: Connection) -> None:
        """Note that a worker no longer does its job, and stop counting the job's frames as under way."""
        self._begun.pop(job.key, None)
        del busy[pipe]


class _Worker(WorkerProcess):
    """One worker process, and its warm line."""

    def __init__(self, root: Path, portion: DatasetPart) -> None:
        super().__init__(_serve, root, portion)
        self.line = ""
        self.job: Job | None = None

    def give(self, job: Job) -> None:
        self.job, self.line = job, job.line
        self.send(job)


def _serve(pipe: Connection, root: Path, portion: DatasetPart) -> None:
    """The loop of a worker: receive a job, report the number of finished frames, send the answer; ends when the parent is
    gone.
    """
    belong_to_parent()
    spare_imports()
    with importing():
        from viewsphere.run.shots.tasks import Worker
        from viewsphere.run.workers.allocator import keep_freed_memory

    keep_freed_memory()
    worker = Worker(root, portion)
    with suppress(EOFError, ConnectionError):  # the parent is gone, with or without unread answers
        while True:
            job: Job = pipe.recv()
            try:
                pipe.send(answer(worker, job, pipe.send))
            except MemoryError:
                os._exit(OUT_OF_MEMORY)
