"""The reference car drawn by other renderers: frames a CPU second, each beside what its frame gives.

Every rival is a script in `rivals/`, run by the Python of a virtual environment of its own, which the first run installs below
`~/.cache/viewsphere-rivals`. All draw the same car, exported as GLB and PLY, on a plane, from the same cameras, 640x480. Each
process keeps to one core and waits while another draws, so that views alternate between the rivals and a load on the machine
slows all of them. The first views are left out. A rival that cannot be installed or started is a row with the reason.
"""

from __future__ import annotations

import json
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from threading import Timer
from typing import IO, Any

import numpy as np
from rivals.scene import write_scene

SCRIPTS = Path(__file__).parent / "rivals"
WARM = 2
"""Views left out at the start: scenes are uploaded and shaders compiled in the first one, and caches fill in the second."""
LONGEST_S = 600.0
"""Wall-clock limit for one answer: Cycles takes 5 CPU seconds a frame, and starts in 10, on a machine that others may load."""


@dataclass(frozen=True)
class Rival:
    """A renderer, the packages it needs, and the packages' environment variables."""

    name: str
    packages: tuple[str, ...]
    variables: Mapping[str, str] = field(default_factory=dict)


OURS = Rival("viewsphere", ())
RIVALS = {
    rival.name: rival
    for rival in (
        OURS,
        Rival("open3d", ("open3d==0.20.0",)),
        Rival("vtk", ("vtk==9.7.2",)),
        # Mitsuba 3.9 aborts in LLVM 14 and 15, which Debian 12 has
        Rival("mitsuba", ("mitsuba==3.5.2", "numpy<2")),
        Rival("pyrender", ("pyrender==0.1.45",)),
        Rival("cycles", ("bpy==5.0.1", "numpy<2")),
    )
}


@dataclass(frozen=True)
class Row:
    """A line of the table: CPU seconds of each warm frame, or the problem that left none."""

    name: str
    library: str = ""
    gives: str = ""
    seconds: tuple[float, ...] = ()
    problem: str = ""

    @property
    def rate(self) -> float:
        """Frames a CPU second, by the median frame."""
        return 1 / float(np.median(self.seconds))


class RivalFailedError(Exception):
    """A rival that cannot be installed, started or measured, with the reason."""


class Process:
    """A rival at work: it draws one view at a time and answers in lines of JSON."""

    def __init__(self, rival: Rival, python: Path, folder: Path) -> None:
        self.log = folder / f"{rival.name}.log"
        command = [str(python), str(SCRIPTS / f"draw_{rival.name}.py"), str(folder)]
        with self.log.open("wb") as log:
            self.process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
                text=True,
                env={**os.environ, **rival.variables},
            )

    def ask(self, line: str = "") -> dict[str, Any]:
        """Send a line, if there is one, and return the next answer."""
        watch = Timer(LONGEST_S, self.process.kill)
        watch.start()
        try:
            if line:
                print(line, file=self._pipe(self.process.stdin), flush=True)
            answer = self._pipe(self.process.stdout).readline()
        except BrokenPipeError:
            answer = ""
        finally:
            watch.cancel()
        if not answer:
            self.process.wait()
            raise RivalFailedError(last_line(self.log.read_text(errors="replace")) or "it ended without a message")
        return json.loads(answer)

    def close(self) -> float:
        """End the process; the CPU seconds that it spent on all frames together after the last one."""
        rest = 0.0
        with self.process:
            self._pipe(self.process.stdin).close()
            for line in self._pipe(self.process.stdout):
                rest = json.loads(line).get("rest", 0.0)
        return rest

    def _pipe(self, pipe: IO[str] | None) -> IO[str]:
        assert pipe is not None
        return pipe


def last_line(text: str) -> str:
    """The last line with text, where Python writes an error's message."""
    return next((line.strip() for line in reversed(text.splitlines()) if line.strip()), "")


def cache_folder() -> Path:
    """The folder of the environments."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "viewsphere-rivals"


def installed(rival: Rival, cache: Path) -> Path:
    """The Python of the rival's environment, which is made where it is missing or holds other packages."""
    if not rival.packages:
        return Path(sys.executable)
    folder = cache / rival.name
    python, mark, wanted = folder / "bin" / "python", folder / "installed.txt", "\n".join(rival.packages)
    if mark.exists() and mark.read_text() == wanted:
        return python
    print(f"installing {', '.join(rival.packages)} in {folder}", file=sys.stderr, flush=True)
    base = shutil.which("python3.11") or sys.executable  # bpy 5.0 has wheels for 3.11 alone
    for command in (
        [base, "-m", "venv", "--clear", folder],
        [python, "-m", "pip", "install", "-q", "--disable-pip-version-check", *rival.packages],
    ):
        done = subprocess.run(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True, check=False)
        if done.returncode:
            raise RivalFailedError(last_line(done.stderr) or f"{command[0]} ended with {done.returncode}")
    mark.write_text(wanted)
    return python


@contextmanager
def ended(process: Process) -> Iterator[Process]:
    """End the process whatever happens."""
    try:
        yield process
    finally:
        process.process.kill()
        process.process.wait()


def is_empty(path: Path) -> bool:
    """True where the picture that a rival left is missing or all one value, as where nothing was drawn."""
    return not path.exists() or len(set(path.read_bytes().split(b"\n255\n", 1)[1])) < 2


def measured(rivals: Sequence[Rival], folder: Path, frames: int, cache: Path) -> list[Row]:
    """A row for each rival: in turns, each draws one view after another."""
    rows = {rival.name: Row(rival.name) for rival in rivals}
    at_work: dict[str, Process] = {}

    def guarded(name: str, line: str = "") -> dict[str, Any]:
        try:
            return at_work[name].ask(line)
        except RivalFailedError as error:
            rows[name] = replace(rows[name], problem=str(error))
            del at_work[name]
            return {}

    with ExitStack() as stack:
        for rival in rivals:
            try:
                process = Process(rival, installed(rival, cache), folder)
            except (RivalFailedError, OSError) as error:
                rows[rival.name] = replace(rows[rival.name], problem=str(error))
                continue
            at_work[rival.name] = stack.enter_context(ended(process))
            answer = guarded(rival.name)
            rows[rival.name] = replace(rows[rival.name], **answer)
        for view in range(WARM + frames):
            for name in list(at_work):
                answer = guarded(name, str(view))
                if answer and view >= WARM:
                    rows[name] = replace(rows[name], seconds=(*rows[name].seconds, answer["seconds"]))
        for name, process in at_work.items():
            rows[name] = finished(rows[name], process.close() / (WARM + frames), folder / f"draw_{name}.pnm")
    return list(rows.values())


def finished(row: Row, share: float, picture: Path) -> Row:
    """The row with each frame's share of the work done at the end, or with a problem where its picture is empty."""
    if is_empty(picture):
        return replace(row, problem="its picture is empty")
    return replace(row, seconds=tuple(each + share for each in row.seconds))


def table(rows: Sequence[Row]) -> list[str]:
    """The lines of a Markdown table, the fastest first, problems last."""
    ours = next((row.rate for row in rows if row.name == OURS.name and not row.problem), None)
    lines = ["| renderer | frames a CPU second | of viewsphere's | a frame gives |", "|---|---:|---:|---|"]
    for row in sorted((row for row in rows if not row.problem), key=lambda row: -row.rate):
        share = "" if ours is None else f"{row.rate / ours:.2g}"
        lines.append(f"| {row.library} | {row.rate:.2g} | {share} | {row.gives} |")
    cells = ((row.library or row.name, row.problem.replace("|", "/")) for row in rows if row.problem)
    return lines + [f"| {name} | | | not measured: {problem} |" for name, problem in cells]


def as_json(rows: Sequence[Row], machine: str) -> dict[str, Any]:
    """The same with each frame's CPU seconds, for programs."""
    figures = [
        {"name": row.name, "library": row.library, "gives": row.gives, "problem": row.problem, "seconds": list(row.seconds)}
        for row in rows
    ]
    return {"machine": machine, "system": platform.platform(), "date": f"{datetime.now(UTC):%Y-%m-%d}", "rows": figures}


def chosen(names: Sequence[str]) -> list[Rival]:
    """The rivals of these names, or all; viewsphere always."""
    unknown = sorted(set(names) - set(RIVALS))
    if unknown:
        raise SystemExit(f"--rivals: no rival is named {unknown[0]!r}. Choose from {', '.join(RIVALS)}.")
    return [rival for rival in RIVALS.values() if not names or rival is OURS or rival.name in names]


def rivals(names: Sequence[str], frames: int, machine: str) -> dict[str, Any]:
    """Measure the rivals, print the table and return the figures."""
    wanted = chosen(names)
    with tempfile.TemporaryDirectory() as name:
        write_scene(Path(name), WARM + frames)
        rows = measured(wanted, Path(name), frames, cache_folder())
    print("\n".join(table(rows)))
    return as_json(rows, machine)
