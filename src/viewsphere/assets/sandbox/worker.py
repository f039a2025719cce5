"""The program that reads model files, so that a crash costs a message: `python -m viewsphere.assets.sandbox.worker`.

A line of standard input is a job: the model's specification, the folder for the result, and the limits. The folder receives
`mesh.arrays` and `outcome.json`: the files that the model named, or the error. On Linux a process is forked for each job, and a
line of standard output is its exit code. The program itself opens no model, so that one file cannot affect the next. Other
systems do not fork safely, so there the program ends after its first job. End of file on standard input means that the
requesting process is gone.
"""

from __future__ import annotations

import gc
import json
import os
import select
import signal
import sys
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from importlib import import_module
from itertools import chain
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Any, Self

from viewsphere.errors import ModelError

if TYPE_CHECKING:
    from viewsphere.model.model_spec import ModelSpec

MESH, OUTCOME, LOG = "mesh.arrays", "outcome.json", "log.txt"

FORKS = sys.platform == "linux"
"""True if the program reads many files, each in a process forked from it."""

IDLE_SECONDS = 30.0
"""Seconds without a job after which the program ends: it holds 50 MB, and restarts in 0.3 s of processor time."""

IMPORTED = (
    "ctypes",
    "resource",
    "numpy.ma",
    "viewsphere.model.model_spec",
    "viewsphere.assets.load",
    "viewsphere.assets.mesh_file",
    "viewsphere.assets.normalise",
)
"""Modules imported before the first fork, together with the readers' modules. They are always the same, so that memory limits
leave equal room for each file.
"""


@dataclass(frozen=True)
class Job:
    """A model to read (a ModelSpec's fields), the folder for the result, limits of seconds and bytes, and whether its reader
    reserves more memory than it writes to. The ascending `frames` of its animation are read; without any, the file is read
    without animation. With `is_timeline`, only the timeline of the file is read.
    """

    spec: dict[str, Any]
    folder: str
    seconds: float
    memory: int
    reserves_memory: bool = False
    frames: tuple[int, ...] = ()
    is_timeline: bool = False

    def to_json(self) -> str:
        """The job as one line of JSON."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, line: bytes) -> Self:
        """The job that `to_json` wrote."""
        fields = json.loads(line)
        return cls(**fields | {"frames": tuple(fields["frames"])})


def _main() -> None:
    """Do the jobs of standard input."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the requesting process decides
    if FORKS:
        _serve()
    else:
        line = next(_lines(0), b"")
        os.dup2(2, 1)
        Thread(target=_watch, daemon=True).start()
        _do(Job.from_json(line))


def _serve() -> None:
    """Fork a process for each job, until no job comes."""
    answers = os.dup(1)
    os.dup2(2, 1)  # output of modules must not be mistaken for an answer
    for name in IMPORTED:
        import_module(name)
    _import_readers()
    gc.collect()
    gc.freeze()  # forked processes need not copy pages that the collector would write to
    ended, wake = os.pipe()
    os.set_blocking(wake, False)
    signal.signal(signal.SIGCHLD, _noted)
    signal.set_wakeup_fd(wake, warn_on_full_buffer=False)
    parent = os.getpid()
    for line in _lines(0):
        child = os.fork()
        if not child:
            signal.set_wakeup_fd(-1)
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            _end_with(parent)
            job = Job.from_json(line)
            _redirect(Path(job.folder) / LOG, close=(answers, ended, wake))
            _do(job)
        os.write(answers, f"{_exit_code(child, ended)}\n".encode())
    os._exit(0)


def _import_readers() -> None:
    """Import the modules of all readers; a failed import becomes an error of the files that need the module."""
    from viewsphere.assets.readers import readers

    for name in chain.from_iterable(reader.modules for reader in readers().values()):
        with suppress(Exception):
            import_module(name)


def _noted(number: int, frame: object) -> None:
    """A signal handler that does nothing: the wakeup pipe only receives signals that have a handler."""


def _lines(file: int) -> Iterator[bytes]:
    """The lines of a pipe, until its end or until none comes for `IDLE_SECONDS`."""
    held = b""
    while (not FORKS or _is_ready(file)) and (data := os.read(file, 1 << 16)):
        *lines, held = (held + data).split(b"\n")
        yield from lines


def _is_ready(*files: int) -> list[int]:
    return select.select(files, (), (), IDLE_SECONDS)[0]


def _exit_code(child: int, ended: int) -> int:
    """The exit code of a forked process, or minus the signal if it was killed. Both processes end if the requesting process
    ends.

    `ended`: a pipe that receives a byte when a process has ended.
    """
    while True:
        if 0 in _is_ready(0, ended):  # no further job arrives before the answer, so this is the end of the file
            os.kill(child, signal.SIGKILL)
            os._exit(1)
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status)
        with suppress(BlockingIOError):
            os.read(ended, 64)


def _redirect(log: Path, close: Sequence[int]) -> None:
    """Replace a forked process's files: empty standard input, a log for all output, and none of the program's other files."""
    out, nothing = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), os.open(os.devnull, os.O_RDONLY)
    for new, old in ((nothing, 0), (out, 1), (out, 2)):
        os.dup2(new, old)
    for file in (out, nothing, *close):
        os.close(file)
    os.environ.update(dict.fromkeys(("TMPDIR", "TEMP", "TMP"), str(log.parent)))  # removed with the job's folder


def _do(job: Job) -> None:
    """Do a job, and end this process."""
    _limit(job)
    outcome = read(job)
    (Path(job.folder) / OUTCOME).write_text(json.dumps(outcome), "utf-8", newline="\n")
    sys.stderr.flush()
    os._exit(0)  # at once: a library's cleanup at exit may crash, too


def read(job: Job) -> dict[str, Any]:
    """Read and normalise the model into the job's folder; returns the files that the model named, or the error, for
    `outcome.json`. Any exception in a reader becomes one line that names the model.
    """
    from viewsphere.model.model_spec import ModelSpec

    spec = ModelSpec.model_validate(job.spec)
    try:
        if job.is_timeline:
            return _read_timeline(spec)
        files = _read_model(spec, job)
    except ModelError as error:
        return {"error": str(error)}
    except MemoryError:
        problem = f"reading it takes more than {job.memory:,} bytes of memory (limit MAX_READ_BYTES)"
        return {"error": f"{spec.source}: {problem}; simplify the model, or set VIEWSPHERE_MAX_READ_BYTES higher"}
    except RecursionError:
        depth = sys.getrecursionlimit()
        return {"error": f"{spec.source}: expected at most {depth:,} things within one another (recursion), found more"}
    except Exception as error:
        said = " ".join(str(error).split())[:200]
        problem = f"its reader failed ({type(error).__name__}: {said})"
        return {"error": f"{spec.source}: {problem}; export the model again, or report the file as a bug"}
    return {"files": [str(file) for file in files]}


def _read_model(spec: ModelSpec, job: Job) -> Sequence[Path]:
    """Write the mesh, or one for each frame; returns the files that the model named."""
    from viewsphere.assets.load import load_frames, load_model
    from viewsphere.assets.mesh_file import write_mesh
    from viewsphere.assets.normalise import normalise, placed

    folder, source = Path(job.folder), Path(spec.source)
    if not job.frames:
        raw, facts = load_model(source, confined=spec.confined, shown=spec.shown)
        write_mesh(folder / MESH, normalise(raw, facts, spec), placed(raw, facts, spec))
        return facts.files
    found = load_frames(source, job.frames, confined=spec.confined, shown=spec.shown, clip=spec.clip, fps=spec.fps)
    first = next(found)
    files = dict.fromkeys(first[1].files)
    for number, (raw, facts) in enumerate(found):
        write_mesh(folder / mesh_name(number), normalise(raw, facts, spec, first), placed(raw, facts, spec, first))
        files |= dict.fromkeys(facts.files)
    return tuple(files)


def _read_timeline(spec: ModelSpec) -> dict[str, Any]:
    """The timeline of a file and the files that it names."""
    from viewsphere.assets.load import suffix_of
    from viewsphere.assets.paths.folder import ModelFolder
    from viewsphere.assets.readers import reader_of

    folder = ModelFolder(Path(spec.source), spec.confined, clip=spec.clip, fps=spec.fps)
    reader = reader_of(suffix_of(folder.model))
    assert reader is not None and reader.timeline is not None
    return {"timeline": reader.timeline(folder), "files": [str(file) for file in folder.files]}


def mesh_name(number: int) -> str:
    """File name for the mesh of a job's frame, by the frame's position in the job."""
    return MESH if number == 0 else f"mesh{number}.arrays"


def _end_with(parent: int) -> None:
    """End this process when its parent ends."""
    import ctypes

    set_death_signal = 1  # PR_SET_PDEATHSIG, prctl(2)
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(set_death_signal, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != parent:
        os._exit(1)


def _watch() -> None:
    while os.read(0, 64):
        pass
    os._exit(1)


def _limit(job: Job) -> None:
    """Limit memory and the size of files, and processor time in case no other process is left to stop this one."""
    if sys.platform == "win32":
        return
    import resource

    # Blender reserves much more memory than it writes to, and works on all cores.
    memory = "RLIMIT_DATA" if job.reserves_memory else "RLIMIT_AS"
    cores = (os.cpu_count() or 1) if job.reserves_memory else 1
    seconds = int(2 * job.seconds * cores) + 1
    wanted = {memory: job.memory, "RLIMIT_FSIZE": job.memory, "RLIMIT_CPU": seconds, "RLIMIT_CORE": 0}
    for name, most in wanted.items():
        with suppress(ValueError, OSError, AttributeError):  # a limit that the platform lacks or has set lower
            kind = getattr(resource, name)
            hard = resource.getrlimit(kind)[1]
            resource.setrlimit(kind, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))


if __name__ == "__main__":
    _main()
