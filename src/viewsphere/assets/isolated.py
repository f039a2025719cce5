"""Reading a model file in a process of its own: a crash, an endless loop or a flood of memory costs one message."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from threading import Event, Timer
from typing import Any

from viewsphere.assets import endings
from viewsphere.assets.load import BLENDER_SUFFIXES, check_source
from viewsphere.assets.reader import OUTCOME, Job, mesh_name, read
from viewsphere.errors import ModelError
from viewsphere.files import open_file, read_text
from viewsphere.limits import limits
from viewsphere.model.model_spec import ModelSpec

LOG = "log.txt"
READ_HERE = "VIEWSPHERE_READ_HERE"
"""Set to 1, this variable lets models be read in the calling process, unprotected."""

SINGLE_THREADED = {
    name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "PXR_WORK_THREAD_LIMIT")
}
"""Threads reserve address space, which is limited, and readers have no use for them."""


def read_apart(spec: ModelSpec, frames: Sequence[int], folder: Path) -> tuple[list[Path], list[Path]]:
    """Read and normalise a model file in a short-lived process that writes only below `folder`: as it is at frames of its
    animation, which ascend, or for no frames as it stands.

    Gives the files that `mesh_file.read_mesh` reads, one a frame, and the files that the model named. Raises ModelError in one
    line: what the reader says of the file, or how its process came to its end (killed for time or memory, crashed).
    """
    memory = limits.MAX_READ_BYTES
    seconds = limits.MAX_READ_SECONDS * (1 + len(frames))
    by_blender = bool(frames) or check_source(Path(spec.source)) in BLENDER_SUFFIXES
    job = Job(spec.model_dump(mode="json"), str(folder), seconds, memory, os.getpid(), by_blender, tuple(frames))
    outcome = read(job) if os.environ.get(READ_HERE) == "1" else _run(job)
    if "error" in outcome:
        raise ModelError(outcome["error"])
    return [folder / mesh_name(i) for i in range(max(len(frames), 1))], [Path(file) for file in outcome["files"]]


def _run(job: Job) -> dict[str, Any]:
    """The outcome of a child process."""
    folder = Path(job.folder)
    late = Event()
    process, lifeline = _started(job)
    timer = Timer(job.seconds, lambda: (late.set(), process.kill()))
    timer.daemon = True
    timer.start()
    try:
        code = process.wait()
    finally:
        timer.cancel()
        process.kill()
        process.wait()
        os.close(lifeline)
    try:
        return json.loads(read_text(folder / OUTCOME))
    except (OSError, ValueError):
        raise ModelError(f"{job.spec['source']}: {_end(job, code, late=late.is_set())}") from None


def _started(job: Job) -> tuple[subprocess.Popen[bytes], int]:
    """The child, and our end of the pipe that is its standard input."""
    environment = os.environ | SINGLE_THREADED | dict.fromkeys(("TMPDIR", "TEMP", "TMP"), job.folder)  # gone with it
    environment["PYTHONPATH"] = os.pathsep.join(entry or str(Path.cwd()) for entry in sys.path)
    command = [sys.executable, "-P", "-m", "viewsphere.assets.reader", job.to_json()]
    theirs, ours = os.pipe()
    try:
        with (Path(job.folder) / LOG).open("wb") as log:
            return subprocess.Popen(command, stdin=theirs, stdout=log, stderr=log, env=environment), ours
    except (OSError, ValueError) as error:
        os.close(ours)
        raise ModelError(
            f"{job.spec['source']}: expected to read it in a process of its own, but none can be started ({error}); "
            f"set {READ_HERE}=1 to read models without that protection"
        ) from None
    finally:
        os.close(theirs)


def _end(job: Job, code: int, *, late: bool) -> str:
    """Why a child ended without an outcome."""
    if late or (code < 0 and -code == getattr(signal, "SIGXCPU", None)):
        return endings.too_slow(job.seconds)
    if code == 1 and (reason := _last_line(Path(job.folder) / LOG)):
        return f"the process that reads it failed ({reason})"
    how = f"exit code {code}"
    if code < 0:
        how = signal.Signals(-code).name if -code in set(signal.Signals) else f"signal {-code}"
    return endings.ended("the process that reads it", how, job.memory)


def _last_line(log: Path) -> str:
    try:
        with open_file(log) as file:
            file.seek(max(log.stat().st_size - 4096, 0))
            lines = file.read().decode(errors="replace").split("\n")
    except OSError:
        return ""
    return next((line.strip()[:200] for line in reversed(lines) if line.strip()), "")
