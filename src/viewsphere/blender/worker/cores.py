"""Which cores the libraries that Blender brings along see when they are loaded.

TBB, which Blender, Cycles and the denoiser share, starts a thread for each core but one, whatever Cycles is told. Those that
find no work spin: they took up to half of the time of a render with one thread.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

TASKS = Path("/proc/self/task")


@contextmanager
def few_cores(count: int) -> Iterator[None]:
    """Let what is loaded meanwhile see this many cores, where the system can do that (Linux); 0 for all.

    Which ones depends on the number of this process: several that start at once do not wait for the same cores. Afterwards
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
        with suppress(OSError):  # where the system does not list threads, the others stay where they are
            for task in TASKS.iterdir():
                with suppress(OSError):
                    os.sched_setaffinity(int(task.name), cores)


def some_of(cores: set[int], count: int, number: int) -> set[int]:
    """As many of the cores, or all; other ones for the next number, as long as there are others."""
    line = sorted(cores)
    first = number * count % len(line)
    return set((line * 2)[first : first + min(count, len(line))])
