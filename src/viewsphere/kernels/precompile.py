"""Kernel compilation on all cores, in several processes, since numba compiles one kernel at a time in each."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import suppress
from dataclasses import asdict
from functools import partial
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import IO

from viewsphere.kernels.overloads import Overload

MOST_PROCESSES = 16
"""Limit of processes: each takes a second and 250 MB to start, and there are about 40 kernels to compile."""

TOLD_S = 0.5
"""Seconds between reports, so that a progress bar keeps moving during a slow kernel."""

COMPILED = "compiled"
_PROGRAM = "from viewsphere.kernels.precompile import serve; serve()"
_SOURCES = Path(__file__).parents[2]

Told = Callable[[int, int], None]
"""A callback that receives the numbers of compiled kernels and of all kernels, every half second."""


def compile_all(overloads: Sequence[Overload], tell: Told, processes: int | None = None) -> tuple[Overload, ...]:
    """Compile overloads that no cache has, and return those compiled now. The others are compiled when they are called."""
    waiting = SimpleQueue[Overload]()
    for each in overloads:
        waiting.put(each)
    answers = list[tuple[Overload, bool]]()

    def answered(overload: Overload, is_compiled: bool) -> None:
        answers.append((overload, is_compiled))

    tell(0, len(overloads))
    count = min(processes or _cores(), MOST_PROCESSES, len(overloads))
    with ThreadPoolExecutor(max(count, 1)) as threads:
        left = {threads.submit(_drive, waiting, answered) for _ in range(count)}
        while left:
            left = wait(left, TOLD_S).not_done
            tell(len(answers), len(overloads))
    return tuple(overload for overload, is_compiled in answers if is_compiled)


def _drive(waiting: SimpleQueue[Overload], answered: Callable[[Overload, bool], None]) -> None:
    """Let a process compile the waiting overloads one after another, until none waits or the process dies."""
    path = os.pathsep.join(filter(None, (str(_SOURCES), os.environ.get("PYTHONPATH"))))
    program = partial(subprocess.Popen, [sys.executable, "-c", _PROGRAM], env={**os.environ, "PYTHONPATH": path}, text=True)
    pipe = subprocess.PIPE
    with suppress(OSError), program(stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL) as process:
        assert process.stdin is not None and process.stdout is not None
        for overload in _taken(waiting):
            process.stdin.write(json.dumps(asdict(overload)) + "\n")
            process.stdin.flush()
            answer = process.stdout.readline()
            if not answer:  # it died
                return
            answered(overload, answer.strip() == COMPILED)


def _taken(waiting: SimpleQueue[Overload]) -> Iterable[Overload]:
    while True:
        try:
            yield waiting.get_nowait()
        except Empty:
            return


def serve(tasks: IO[str] = sys.stdin, answers: IO[str] = sys.stdout) -> None:
    """Compile the overloads that arrive as lines, and answer each. An overload that fails to compile is left to its callers."""
    for line in tasks:
        try:
            Overload(**json.loads(line)).compile()
        except Exception as error:  # as numba has many
            answers.write(f"{type(error).__name__}\n")
        else:
            answers.write(f"{COMPILED}\n")
        answers.flush()


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
