"""Worker processes of this machine, for the process that starts them: one pipe per worker, spawned rather than forked."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from functools import partial
from multiprocessing import get_context, parent_process, resource_tracker
from multiprocessing.connection import wait
from threading import Thread, current_thread, main_thread
from types import FrameType
from typing import Any

from viewsphere.run.workers.exit_at_once import exit_at_once

OUT_OF_MEMORY = 77
"""Exit code of a worker that ran out of memory."""

DYING_S = 10.0
"""Seconds for a worker with a closed pipe to end by itself, so that its exit code is its own."""


class WorkerProcess:
    """A worker process that runs `serve(pipe, *told)`; the process that started it has to stop it."""

    def __init__(self, serve: Callable[..., None], *told: Any) -> None:
        context = get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(target=_live, args=(serve, theirs, *told), daemon=True)
        self.process.start()
        theirs.close()

    def send(self, what: object) -> None:
        """Send an object to the worker; a dead worker is noticed when its answer is awaited."""
        with suppress(OSError):
            self.pipe.send(what)

    def stop(self) -> int | None:
        """End the process and return its exit code; only unfinished work is lost."""
        self.process.kill()  # also ends a stopped process
        self.process.join()
        self.pipe.close()
        return self.process.exitcode

    def end(self) -> int | None:
        """The exit code of a worker whose pipe is closed."""
        self.process.join(DYING_S)
        return self.stop()


def _live(serve: Callable[..., None], *told: Any) -> None:
    """The main function of a worker process, which ends at once."""
    serve(*told)
    exit_at_once(0)


def end_reason(code: int | None, advice: str) -> str:
    """Return the reason for a worker's end with this exit code; if memory may have run out, the advice follows."""
    if code == OUT_OF_MEMORY:
        return f"it was refused memory{advice}"
    if code == -getattr(signal, "SIGKILL", 0):
        return f"it was killed, as systems do when memory runs out{advice}"
    return f"exit code {code}"


@contextmanager
def interrupts_deferred() -> Generator[None]:
    """Processes started in this context ignore Ctrl-C from their start; this process receives it after the block."""
    if sys.platform == "win32":  # no masks to inherit
        yield
        return
    resource_tracker.ensure_running()  # the start of the tracker would unblock the signal again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        with _later():
            yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _later() -> Generator[None]:
    """Delay this process's reaction to Ctrl-C and SIGTERM until the block ends.
    Signal masks are no substitute: they block signals in one thread only, and other threads may receive them.
    """
    does = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    heard: list[Callable[[], Any]] = []

    def note(do: Callable[..., Any], number: int, frame: FrameType | None) -> None:
        heard.append(partial(do, number, frame))

    if current_thread() is main_thread():  # only the main thread can set handlers, and they run in it
        for number, do in does.items():
            if callable(do):
                signal.signal(number, partial(note, do))
    try:
        yield
    finally:
        if current_thread() is main_thread():
            for number, do in does.items():
                if callable(do):
                    signal.signal(number, do)
    for do in heard[:1]:
        do()


def belong_to_parent() -> None:
    """Leave Ctrl-C to the process that started this one, and end with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End this process as soon as its parent is dead, because another run may have taken over its work."""
    if parent := parent_process():
        wait([parent.sentinel])
        os._exit(1)
