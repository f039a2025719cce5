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

    Afterwards all threads may run on any core again.
    """
    if not count or not hasattr(os, "sched_setaffinity"):
        yield
        return
    cores = os.sched_getaffinity(0)
    with suppress(OSError):
        os.sched_setaffinity(0, sorted(cores)[:count])
    try:
        yield
    finally:
        for task in TASKS.iterdir():
            with suppress(OSError):
                os.sched_setaffinity(int(task.name), cores)
