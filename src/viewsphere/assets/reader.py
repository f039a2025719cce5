"""The program that reads one model file, so that a crash costs a message: `python -m viewsphere.assets.reader JOB`.

JOB is JSON: the model's specification, the folder for the result, the limits and the process that asked. The folder
receives `mesh.npz` and `outcome.json`: the files that the model named, or the error. Standard input is a pipe that
nobody writes to; its end of file means that the process that asked is gone.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Any

from viewsphere.errors import ModelError

if TYPE_CHECKING:
    from viewsphere.model.model_spec import ModelSpec

MESH, OUTCOME = "mesh.npz", "outcome.json"


@dataclass(frozen=True)
class Job:
    """What to read (a ModelSpec's fields), where the result goes, seconds, bytes, the asking process's id, and whether Blender
    is what reads it. `frames` of its animation, which ascend, are read; none: the file as it stands.
    """

    spec: dict[str, Any]
    folder: str
    seconds: float
    memory: int
    parent: int
    by_blender: bool = False
    frames: tuple[int, ...] = ()

    def to_json(self) -> str:
        """The job as one line of JSON."""
        return json.dumps(asdict(self))


def main() -> None:
    """Do the job of the first argument, and end this process."""
    told = json.loads(sys.argv[1])
    job = Job(**told | {"frames": tuple(told["frames"])})
    _end_with(job.parent)
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


def mesh_name(number: int) -> str:
    """File name for the mesh of a job's frame, by the frame's position in the job."""
    return MESH if number == 0 else f"mesh{number}.npz"


def _end_with(parent: int) -> None:
    """End this process when the process that asked ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the process that asked decides
    if sys.platform == "linux":
        import ctypes

        set_death_signal = 1  # PR_SET_PDEATHSIG, prctl(2)
        with suppress(OSError, AttributeError):
            ctypes.CDLL(None).prctl(set_death_signal, signal.SIGKILL, 0, 0, 0)
        if os.getppid() != parent:
            os._exit(1)
    Thread(target=_watch, daemon=True).start()


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
    memory = "RLIMIT_DATA" if job.by_blender else "RLIMIT_AS"
    cores = (os.cpu_count() or 1) if job.by_blender else 1
    seconds = int(2 * job.seconds * cores) + 1
    wanted = {memory: job.memory, "RLIMIT_FSIZE": job.memory, "RLIMIT_CPU": seconds, "RLIMIT_CORE": 0}
    for name, most in wanted.items():
        with suppress(ValueError, OSError, AttributeError):  # a limit that the platform lacks, or has set lower
            kind = getattr(resource, name)
            hard = resource.getrlimit(kind)[1]
            resource.setrlimit(kind, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))


if __name__ == "__main__":
    main()
