"""The progress of runs: each run rewrites a small file in the store every few seconds.
Any machine that sees the store can read these files.
"""

from __future__ import annotations

import json
import os
import signal
import socket
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from threading import Event, Thread
from typing import Any

from viewsphere.errors import StoreError
from viewsphere.files import read_bytes
from viewsphere.store.texts import parsed

BEAT_S = 5.0
"""Seconds from one heartbeat to the next."""

SILENT_S = 120.0
"""Seconds without a heartbeat after which a run of unknown state is reported as silent: clocks differ, and network file systems
show changes late.
"""

MOST = 2.0**53
"""Largest number of frames or seconds in a valid report."""


@dataclass(frozen=True)
class Heartbeat:
    """The report of a run about its own progress.

    `shard` (k, n): it renders the k-th of n shares. `done` of `total` count frames in the phase "frames", else the units of
    that phase. `resumed` of them existed before the run. `under_way` counts those in unfinished shots, whose keys are
    `working_on`. `begun` and `beat` are the times of the phase's start and of this report, in seconds since 1970. `error`: the
    reason for the run's end.
    """

    host: str
    pid: int
    shard: tuple[int, int] = (0, 1)
    phase: str = "start"
    done: int = 0
    total: int = 0
    resumed: int = 0
    under_way: int = 0
    begun: float = 0.0
    beat: float = 0.0
    working_on: tuple[str, ...] = ()
    error: str = ""

    @property
    def rate(self) -> float:
        """Current frames per second; 0 if the run makes none, or if it is too early to measure."""
        made, seconds = self.done + self.under_way - self.resumed, self.beat - self.begun
        return made / seconds if self.phase == "frames" and made > 0 and seconds > 0 else 0.0

    def to_json(self) -> str:
        """The text of its file."""
        return json.dumps(asdict(self), separators=(",", ":"))

    @staticmethod
    def read(file: Path) -> Heartbeat | None:
        """The heartbeat in a file; None if the file is missing or unreadable, for example because it has just been removed."""
        try:
            value: dict[str, Any] = parsed(read_bytes(file, "MAX_RECORD_BYTES"))
            number, of = value["shard"]
            shown = tuple(map(str, value["working_on"]))
            begun, beat = float(value["begun"]), float(value["beat"])
            counts = {name: int(value[name]) for name in ("done", "total", "resumed", "under_way")}
            heartbeat = Heartbeat(str(value["host"]), int(value["pid"]), (int(number), int(of)), begun=begun, beat=beat)
            if not all(abs(number) < MOST for number in (begun, beat, *counts.values())):
                return None
            return replace(heartbeat, **counts, phase=str(value["phase"]), working_on=shown, error=str(value["error"]))
        except (OSError, LookupError, TypeError, ValueError, OverflowError):
            return None


class HeartbeatWriter:
    """Writes a run's report every few seconds, in its own thread, so that slow frames do not delay it. `now` is the next
    report; `working_on` changes when a shot is handed out or finished.

    A monotonic clock measures the time since a phase began, so that rates stay right when the system's time is set.
    """

    def __init__(self, write: Callable[[str], None], shard: tuple[int, int] = (0, 1)) -> None:
        self.now = Heartbeat(socket.gethostname(), os.getpid(), shard)
        self._phase_begun = time.monotonic()
        self.working_on: dict[str, None] = {}
        self._write = write
        self._ended = Event()
        self._thread = Thread(target=self._beats, name="heartbeat", daemon=True)

    def __enter__(self) -> HeartbeatWriter:
        self._write(self.note())
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()

    def enters(self, phase: str) -> None:
        """Begin a phase, unless it is already the current one."""
        if phase != self.now.phase:
            self.now, self._phase_begun = replace(self.now, phase=phase), time.monotonic()

    def note(self, error: str = "") -> str:
        """Return the current report: the run's progress, or the reason for its end."""
        beat = time.time()
        begun = beat - (time.monotonic() - self._phase_begun)
        return replace(self.now, begun=begun, beat=beat, working_on=tuple(self.working_on.copy()), error=error).to_json()

    def _beats(self) -> None:
        if hasattr(signal, "pthread_sigmask"):
            signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})  # are the main thread's
        while not self._ended.wait(BEAT_S):
            with suppress(OSError, StoreError):  # a full disk ends the run elsewhere, if it has to
                self._write(self.note())
