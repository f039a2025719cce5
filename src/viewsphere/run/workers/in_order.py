"""Parallel work in processes of this machine, with results in order."""

from __future__ import annotations

import os
import pickle
import traceback
from collections.abc import Callable, Generator, Iterable
from contextlib import suppress
from functools import cache
from multiprocessing.connection import Connection, wait
from typing import Any, TypeVar, cast

from viewsphere.errors import UserError, ViewsphereError, WorkerDied
from viewsphere.run.workers.process import OUT_OF_MEMORY, WorkerProcess, belong_to_parent, end_reason, interrupts_deferred

Task = TypeVar("Task")
Made = TypeVar("Made")

AHEAD = 4
"""Maximum number of results per worker that wait for an earlier result, so that memory does not grow if one task is slow."""

ADVICE = ": give it more memory, or ask for fewer workers"


def in_order(workers: int, make: Callable[[], Callable[[Task], Made]], tasks: Iterable[Task]) -> Generator[tuple[Task, Made]]:
    """Each task with its result, in the order of the tasks, which are requested when a worker is free.

    `make()`, called in each worker process, returns the function that does a task; everything is sent by pickle.
    Raises the first UserError or OSError that a task raises, ViewsphereError with the traceback of any other exception, and
    WorkerDied if a worker dies, because no task is done twice. Workers end with the iterator.
    """
    left, started, free = iter(tasks), list[WorkerProcess](), list[WorkerProcess]()
    busy, made = dict[Connection, tuple[int, Task, WorkerProcess]](), dict[int, tuple[Task, Made]]()
    given = taken = 0
    try:
        while True:
            while len(busy) < workers and given < taken + AHEAD * workers and (task := next(left, None)) is not None:
                worker = free.pop() if free else _start(make, started)
                worker.send(task)
                busy[worker.pipe] = given, task, worker
                given += 1
            if not busy and not made:
                return
            while taken in made:
                yield made.pop(taken)
                taken += 1
            for pipe in wait(list(busy)) if busy else ():
                number, task, worker = busy.pop(cast(Connection, pipe))  # another class on Windows
                made[number] = task, _answered(worker)
                free.append(worker)
    finally:
        for worker in started:
            worker.stop()


def _start(make: Callable[[], Any], started: list[WorkerProcess]) -> WorkerProcess:
    with interrupts_deferred():  # until it is registered here, so that it is ended with the others
        started.append(WorkerProcess(_serve, make))
    return started[-1]


def _answered(worker: WorkerProcess) -> Any:
    try:
        made, error = worker.pipe.recv()
    except (EOFError, OSError):  # it may die while sending an answer
        raise WorkerDied(f"expected a worker's answer, found that it died: {end_reason(worker.end(), ADVICE)}") from None
    if error is not None:
        raise error
    return made


def _serve(pipe: Connection, make: Callable[[], Callable[[Any], Any]]) -> None:
    """The loop of a worker: receive a task, send the answer; ends when the parent is gone."""
    belong_to_parent()
    from viewsphere.run.workers.allocator import keep_freed_memory

    keep_freed_memory()
    made = cache(make)
    with suppress(EOFError, ConnectionError):  # the parent is gone, with or without unread answers
        while True:
            task = pipe.recv()
            pipe.send_bytes(_answer(lambda task=task: made()(task)))


def _answer(do: Callable[[], Any]) -> bytes:
    """Return the result of a task, or its exception, in the form that `_answered` reads."""
    try:
        return pickle.dumps((do(), None))
    except UserError as error:
        return pickle.dumps((None, type(error)(str(error))))
    except OSError as error:
        return pickle.dumps((None, OSError(error.errno, error.strerror or str(error))))
    except MemoryError:
        os._exit(OUT_OF_MEMORY)
    except Exception:
        return pickle.dumps((None, ViewsphereError(f"a worker failed\n{traceback.format_exc()}")))
