"""The reader's process, started for the first model file and reused for later ones."""

from __future__ import annotations

import atexit
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from threading import Event, Timer

from viewsphere.assets.sandbox.worker import LOG, Job

SINGLE_THREADED = {
    name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "PXR_WORK_THREAD_LIMIT")
}
"""Environment variables that turn off threads: threads reserve address space, which is limited, and readers do not need
them.
"""


@dataclass(frozen=True)
class _Ended:
    """The end of a job: the exit code of its process, or minus the signal that killed it; and whether it took too long."""

    code: int
    is_late: bool


@dataclass(frozen=True)
class Setting:
    """The settings that a reader inherits: other settings need another reader."""

    executable: str
    folder: str
    environment: dict[str, str]

    @classmethod
    def current(cls) -> Setting:
        """Return the settings of this process."""
        folder = ""
        with suppress(OSError):  # it may have been deleted
            folder = os.getcwd()  # noqa: PTH109
        path = os.pathsep.join(entry or folder for entry in sys.path)
        return cls(sys.executable, folder, {**os.environ, **SINGLE_THREADED, "PYTHONPATH": path})


@dataclass(frozen=True, eq=False)
class ReaderProcess:
    """A running reader process and the settings that it inherited."""

    process: subprocess.Popen[bytes]
    setting: Setting

    @classmethod
    def start(cls, setting: Setting, log: Path) -> ReaderProcess:
        """A new reader, which prints to a log; raises OSError or ValueError if none can be started."""
        command = [setting.executable, "-P", "-m", "viewsphere.assets.sandbox.worker"]
        pipe = subprocess.PIPE
        with log.open("wb") as file:
            return cls(
                subprocess.Popen(
                    command,
                    stdin=pipe,
                    stdout=pipe,
                    stderr=file,
                    env={**setting.environment, **dict.fromkeys(("TMPDIR", "TEMP", "TMP"), str(log.parent))},
                    start_new_session=True,  # so that it is killed together with what it forked
                ),
                setting,
            )

    def answer(self, job: Job) -> tuple[_Ended, bool]:
        """Return the end of a job, and whether the reader waits for another. If the reader itself ended, the result is its exit
        code.
        """
        assert self.process.stdin is not None and self.process.stdout is not None
        late = Event()
        timer = Timer(job.seconds, lambda: (late.set(), self.kill()))
        timer.daemon = True
        timer.start()
        try:
            with suppress(BrokenPipeError):
                self.process.stdin.write(job.to_json().encode() + b"\n")
                self.process.stdin.flush()
            line = self.process.stdout.readline()
            if line:
                return _Ended(int(line), is_late=False), True
            return _Ended(self.process.wait(), late.is_set()), False
        except BaseException:
            self.kill()
            raise
        finally:
            timer.cancel()

    def kill(self) -> None:
        """Kill the reader and all processes that it forked."""
        if self.process.poll() is None:
            with suppress(ProcessLookupError, PermissionError):  # it is just ending
                self.process.kill() if sys.platform == "win32" else os.killpg(self.process.pid, signal.SIGKILL)

    def close(self) -> None:
        """End the reader, and close its files."""
        self.kill()
        self.process.wait()
        for pipe in (self.process.stdin, self.process.stdout):
            with suppress(OSError):
                if pipe is not None:
                    pipe.close()


def do(job: Job) -> _Ended:
    """Do a job in a separate process; raises OSError or ValueError if none can be started."""
    idle, setting = _idle_readers(os.getpid()), Setting.current()
    for reader, is_new in _readers(idle, setting, Path(job.folder) / LOG):
        ended, waits = reader.answer(job)
        if waits:
            idle.append(reader)
        else:
            reader.close()
        if waits or is_new or ended.is_late:
            return ended
    raise AssertionError


def _readers(idle: list[ReaderProcess], setting: Setting, log: Path) -> Iterator[tuple[ReaderProcess, bool]]:
    """Yield idle readers with this setting, which may have ended since their last job, then a new one. Readers with other
    settings are closed.
    """
    with suppress(IndexError):
        while True:
            reader = idle.pop()
            if reader.setting == setting:
                yield reader, False
            else:
                reader.close()
    yield ReaderProcess.start(setting, log), True


@cache
def _idle_readers(process_id: int) -> list[ReaderProcess]:
    """The idle readers of this process; a process forked from it has none."""
    readers: list[ReaderProcess] = []
    atexit.register(_close_all, readers, process_id)
    return readers


def _close_all(readers: list[ReaderProcess], process_id: int) -> None:
    while readers and os.getpid() == process_id:
        readers.pop().close()
