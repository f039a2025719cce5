"""Limits the cores that the libraries within bpy see when they are loaded.

TBB, which Blender, Cycles and the denoiser share, starts a thread for each core but one, however many threads Cycles is to
use. Threads without work spin: they took up to half of the time of a render with one thread.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

TASKS = Path("/proc/self/task")


@contextmanager
def few_cores(count: int) -> Iterator[None]:
    """While the context lasts, let libraries that are loaded see this many cores, where the system can do that (Linux); 0: all.

    The cores are chosen by this process's id, so that processes that start at once use different ones. Afterwards
    all threads may run on any core again.
    """
    if not count or not hasattr(os, "sched_setaffinity"):
        yield
        return
    cores = os.sched_getaffinity(0)
    with suppress(OSError):
        os.sched_setaffinity(0, some_of(cores, count, os.getpid()))
    try:
        yield
    finally:
        with suppress(OSError):
            os.sched_setaffinity(0, cores)
        with suppress(OSError):  # where the system lists no threads, other threads keep the few
            for task in TASKS.iterdir():
                with suppress(OSError):
                    os.sched_setaffinity(int(task.name), cores)


def some_of(cores: set[int], count: int, number: int) -> set[int]:
    """`count` of the cores, or all if there are fewer; consecutive numbers get different cores as far as there are enough."""
    line = sorted(cores)
    first = number * count % len(line)
    return set((line * 2)[first : first + min(count, len(line))])
