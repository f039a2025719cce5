"""One Blender process: starting it, sending it requests, ending it.

The Blender process runs `worker/` in the interpreter that has bpy, with factory settings, and with nothing of this process's
Python or of the user's Blender: neither add-ons nor scripts. Requests and answers are JSON, a line each, over the process's
standard input and output; arrays are in files of a shared folder. Blender's other output goes to a log. When
this process ends, in whatever way, Blender's standard input closes; Blender then removes the folder and ends as well.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import weakref
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from threading import Timer
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import BlenderDied, BlenderError
from viewsphere.files import open_file
from viewsphere.scratch import ScratchDir, sweep

START = """\
import sys, runpy
sys.path.append({package!r})
runpy.run_module("worker", run_name="__main__", alter_sys=True)
"""

ANSWER_S = 120.0
GRACE_S = 3.0
"""Seconds for Blender to end by itself once its input is closed; an idle Blender takes a few milliseconds."""

MEMORY = Path("/dev/shm")
LEAST_MEMORY = 2 << 30
"""Bytes that must be free in `MEMORY` to be used: containers often have 64 MB."""

PREFIX = "viewsphere-blender-"
TAIL_BYTES, TAIL_LINES = 4096, 6
"""The end of Blender's log that an error message has."""

SHELLS_SIGNALS = 128
"""The number that a shell adds to a signal's number to make an exit status (POSIX, "Exit Status for Commands")."""


class BlenderProcess:
    """A Blender process, started at once and owned by this object; only one thread at a time may use it.

    `python` is an interpreter that has bpy (`find_blender`). Blender's output is appended to the file `log`, by default
    one that is deleted with the process. Arrays and other files for Blender are in `folder`, which is also deleted with it.
    With `readable`, Blender reads only these folders, if the system can enforce this (Linux 5.13 and later), and ends with the
    thread that starts it; its `folder` is then among this process's temporary files. `threads` is Blender's number of threads,
    0 for one per core.
    """

    def __init__(self, python: Path, log: Path | None = None, readable: Sequence[Path] | None = None, threads: int = 0) -> None:
        scratch_folder = _aside(Path(tempfile.gettempdir()) if readable is not None else _memory())
        self.folder = scratch_folder.folder
        self.log = log or self.folder / "blender.log"
        self._put: list[Path] = []
        told = [json.dumps(None if readable is None else [str(place) for place in readable]), json.dumps(threads)]
        try:
            with self.log.open("ab") as noise:
                self._log_start = noise.tell()
                self._process = subprocess.Popen(
                    [python, "-P", "-c", START.format(package=str(Path(__file__).parent)), self.folder, *told],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=noise,
                    env=_environment(python, self.folder),
                    process_group=0 if os.name == "posix" else None,
                    creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
                )
        except OSError as error:
            scratch_folder.remove()
            raise BlenderDied(f"{python}: Blender cannot be started: {error.strerror or error}") from None
        self._end: weakref.finalize[Any, Any] = weakref.finalize(self, _end, self._process, scratch_folder, os.getpid())

    def __enter__(self) -> BlenderProcess:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def pid(self) -> int:
        """The process id of Blender."""
        return self._process.pid

    def close(self) -> None:
        """End Blender and remove its folder, which garbage collection of this object and the end of this process do as well."""
        self._end()

    def put(self, array: NDArray[Any]) -> str:
        """Write an array to a file that the next request can name, and return its path; that request's answer deletes it."""
        file = self.folder / f"{len(self._put)}.npy"
        np.save(file, array, allow_pickle=False)
        self._put.append(file)
        return str(file)

    def ask(self, do: str, timeout_s: float = ANSWER_S, **told: Any) -> Any:
        """Blender's answer to a request, as plain JSON data.

        Raises BlenderError when the answer is an error (a note has the worker's trace), BlenderDied when Blender has ended, or
        does not answer in time: Blender is killed then.
        """
        request = json.dumps({"do": do, **told}).encode() + b"\n"
        begun = time.monotonic()
        timer = Timer(timeout_s, _kill, [self._process])  # breaks both pipes, whichever this thread waits for
        timer.daemon = True
        timer.start()
        try:
            answer = self._exchange(request)
        except BaseException:
            _kill(self._process)  # a late answer would be read as the next request's answer
            raise
        finally:
            timer.cancel()
            self._forget()
        if answer is None:
            raise self._died(do, time.monotonic() - begun, timeout_s)
        if "error" in answer:
            error = BlenderError(answer["error"])
            error.add_note(answer["trace"])
            raise error
        return answer["ok"]

    def _exchange(self, request: bytes) -> dict[str, Any] | None:
        """The answer to a request; None when Blender has ended without one."""
        requests, answers = self._process.stdin, self._process.stdout
        assert requests is not None and answers is not None
        try:
            requests.write(request)
            requests.flush()
            while line := answers.readline():
                if line.startswith((b'{"ok"', b'{"error"')) and line.endswith(b"\n"):
                    return json.loads(line)
        except (OSError, ValueError):  # Blender has ended, or was closed
            return None
        return None

    def _forget(self) -> None:
        """Remove the files of `put`: the request that named them has been answered."""
        for file in self._put:
            file.unlink(missing_ok=True)
        self._put.clear()

    def _died(self, do: str, seconds: float, timeout_s: float) -> BlenderDied:
        """The error that describes, in one line, how Blender ended."""
        try:
            status = self._process.wait(GRACE_S)
        except subprocess.TimeoutExpired:
            _kill(self._process)
            status = self._process.wait()
        if not self._end.alive:
            return BlenderDied(f"Blender was ended before `{do}` was asked")
        said = " | ".join(self._last_lines()) or "nothing"
        if seconds >= timeout_s:
            return BlenderDied(f"Blender hung (no answer in {timeout_s:g} s) of `{do}`", log=said, is_late=True)
        by = _signal(status)
        how = f"exit status {status}" if by is None else f"signal {by}"
        return BlenderDied(f"Blender died ({how}) after {seconds:.1f} s of `{do}`", by, log=said)

    def _last_lines(self) -> list[str]:
        """The last lines that this Blender wrote to its log."""
        with suppress(OSError), open_file(self.log) as file:
            size = file.seek(0, os.SEEK_END)
            file.seek(max(self._log_start, size - TAIL_BYTES))
            lines = file.read().decode("utf-8", "replace").splitlines()
            return [line.strip() for line in lines if line.strip()][-TAIL_LINES:]
        return []


def _end(process: subprocess.Popen[bytes], scratch_folder: ScratchDir, owner: int) -> None:
    """Let Blender end by itself, else kill it, and remove its folder; a forked copy of the owning process does nothing."""
    if os.getpid() != owner:
        return
    assert process.stdin is not None and process.stdout is not None
    with suppress(OSError):
        process.stdin.close()
    try:
        process.wait(GRACE_S)
    except subprocess.TimeoutExpired:
        _kill(process)
        process.wait()
    process.stdout.close()
    scratch_folder.remove()
    sweep(scratch_folder.folder.parent, PREFIX)


def _kill(process: subprocess.Popen[bytes]) -> None:
    """Kill Blender with its whole process group: where the interpreter is a script, its children would keep the pipes open."""
    if os.name != "posix":
        process.kill()
    elif process.returncode is None:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)


def _signal(status: int) -> str | None:
    """Name of the signal that ended a process with this exit status, or that a shell script reports (128 and more)."""
    number = -status if status < 0 else status - SHELLS_SIGNALS
    with suppress(ValueError):
        return signal.Signals(number).name
    return str(number) if status < 0 else None


def _environment(python: Path, folder: Path) -> dict[str, str]:
    """This process's environment without variables that would lead Blender to the user's files or to another Python's."""
    foreign = ("BLENDER_",) if python == Path(sys.executable) else ("BLENDER_", "PYTHON", "__PYVENV_LAUNCHER__")
    kept = {name: value for name, value in os.environ.items() if not name.startswith(foreign)}
    own = {name: str(folder) for name in ("TMPDIR", "TEMP", "TMP")}
    return {**kept, **own, "BLENDER_USER_RESOURCES": str(folder / "user")}


def _memory() -> Path:
    """The folder for large arrays: `MEMORY` if enough of it is free, else the folder of temporary files."""
    with suppress(OSError):
        if os.access(MEMORY, os.W_OK) and shutil.disk_usage(MEMORY).free >= LEAST_MEMORY:
            return MEMORY
    return Path(tempfile.gettempdir())


def _aside(place: Path) -> ScratchDir:
    """Return a new scratch folder in this place, after removing those of killed processes."""
    sweep(place, PREFIX)
    return ScratchDir.make(place, PREFIX)
