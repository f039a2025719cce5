"""Reading of a model file in a separate process, so that a crash, an endless loop or excessive memory use costs one message."""

from __future__ import annotations

import json
import os
import signal
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from viewsphere.assets.load import suffix_of
from viewsphere.assets.paths import endings
from viewsphere.assets.readers import reader_of
from viewsphere.assets.sandbox.server import do
from viewsphere.assets.sandbox.worker import LOG, OUTCOME, Job, mesh_name, read
from viewsphere.errors import ModelError
from viewsphere.files import open_file, read_text
from viewsphere.limits import limits
from viewsphere.model.model_spec import ModelSpec
from viewsphere.scratch import temporary

READ_HERE = "VIEWSPHERE_READ_HERE"
"""If this variable is 1, models are read in the calling process, without protection."""


def read_apart(spec: ModelSpec, frames: Sequence[int], folder: Path) -> tuple[list[Path], list[Path]]:
    """Read and normalise a model file in a short-lived process that writes only below `folder`: at the ascending frames of its
    animation, or without animation if there are no frames.

    Returns the files for `mesh_file.read_mesh`, one per frame, and the files that the model named. Raises a one-line
    ModelError: the reader's message, or the way its process ended (killed for time or memory, crashed).
    """
    memory = limits.MAX_READ_BYTES
    seconds = limits.MAX_READ_SECONDS * (1 + len(frames))
    reader = reader_of(suffix_of(Path(spec.source)), moving=bool(frames))
    reserves = reader is not None and reader.reserves_memory
    job = Job(spec.model_dump(mode="json"), str(folder), seconds, memory, reserves, tuple(frames))
    outcome = read(job) if os.environ.get(READ_HERE) == "1" else _run(job)
    if "error" in outcome:
        raise ModelError(outcome["error"])
    return [folder / mesh_name(i) for i in range(max(len(frames), 1))], [Path(file) for file in outcome["files"]]


def timeline_apart(path: Path, confined: bool, clip: str | None, fps: float | None) -> tuple[dict[str, Any], list[Path]]:
    """The timeline of a file, read in a short-lived process, and the files that it names; otherwise as `read_apart`."""
    spec = ModelSpec(
        key="timeline", source=str(path), category="model", category_id=1, confined=confined, clip=clip, fps=fps
    )  # fmt: skip
    reader = reader_of(suffix_of(path))
    with temporary("reading") as folder:
        job = Job(
            spec.model_dump(mode="json"),
            str(folder),
            limits.MAX_READ_SECONDS,
            limits.MAX_READ_BYTES,
            reader is not None and reader.reserves_memory,
            is_timeline=True,
        )
        outcome = read(job) if os.environ.get(READ_HERE) == "1" else _run(job)
    if "error" in outcome:
        raise ModelError(outcome["error"])
    return outcome["timeline"], [Path(file) for file in outcome["files"]]


def _run(job: Job) -> dict[str, Any]:
    """The outcome of a job in a separate process."""
    folder = Path(job.folder)
    try:
        ended = do(job)
    except (OSError, ValueError) as error:
        raise ModelError(
            f"{job.spec['source']}: expected to read it in a process of its own, but none can be started ({error}); "
            f"set {READ_HERE}=1 to read models without that protection"
        ) from None
    try:
        return json.loads(read_text(folder / OUTCOME))
    except (OSError, ValueError):
        raise ModelError(f"{job.spec['source']}: {_end(job, ended.code, late=ended.is_late)}") from None


def _end(job: Job, code: int, *, late: bool) -> str:
    """Return the reason why a child ended without an outcome."""
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
