"""Runs damaged inputs through a target, and tells every one that ends otherwise than a stranger's file may.

    python campaign.py TARGET FIRST STOP

An input is known by its target and its seed: the same again makes the same files and the same finding.
"""

from __future__ import annotations

import errno
import json
import os
import resource
import shutil
import signal
import sys
import tempfile
import traceback
import warnings
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from random import Random
from types import FrameType, TracebackType

SECONDS = 20
"""Of the processor for one input, after which it is a finding."""

GROWTH = 1 << 30
"""Bytes of memory that one input may need."""

SPACE = 8 << 30
"""Bytes of address space of a process that runs inputs."""


@dataclass(frozen=True)
class Finding:
    """An input that crashed, hung, took too much memory or raised a foreign error; `where` groups findings of one cause."""

    target: str
    seed: int
    what: str
    where: str = ""


SETTINGS = {"READ_HERE": "1", "MAX_PICTURE_PIXELS": "20000000", "MAX_STORED_PIXELS": "20000000"}
SETTINGS = {f"VIEWSPHERE_{name}": value for name, value in SETTINGS.items()}
"""Models are read in the same process, and pictures are smaller than by default: those of 100 megapixels take 1.6 GB."""

CLEAR_REFS = Path("/proc/self/clear_refs")
"""What Linux is told to forget the most memory that a process has held."""


class _TooSlow(BaseException):
    """Raised in what takes longer than it may; no ordinary handler catches it."""


def run(target: str, seed: int) -> Finding | None:
    """What is wrong with how a target takes an input, None where it returns or refuses."""
    from targets import TARGETS

    from viewsphere.errors import ViewsphereError

    with tempfile.TemporaryDirectory(prefix=f"fuzz-{target}-{seed}-") as name:
        opened = make(target, seed, Path(name))
        before = _held_at_most(forget=True)
        signal.signal(signal.SIGPROF, _alarm)
        signal.setitimer(signal.ITIMER_PROF, SECONDS)
        try:
            TARGETS[target].run(Path(name), opened)
        except OSError as error:
            if error.errno not in {errno.ENAMETOOLONG, errno.ELOOP}:  # these the command line tells in one line
                return Finding(target, seed, f"{type(error).__name__}: {error}"[:200], _where(error.__traceback__))
        except ViewsphereError as error:
            if not str(error).strip():
                return Finding(target, seed, f"{type(error).__name__} without words", _where(error.__traceback__))
        except BaseException as error:
            if isinstance(error, KeyboardInterrupt):
                raise
            return Finding(target, seed, f"{type(error).__name__}: {error}"[:200], _where(error.__traceback__))
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)
        grown = _held_at_most() - before
        return Finding(target, seed, f"{grown / 1e9:.1f} GB of memory", "memory") if grown > GROWTH else None


def make(target: str, seed: int, folder: Path) -> str:
    """Write the files of an input into an empty folder; returns the name of the one to open."""
    from targets import TARGETS

    return TARGETS[target].damage(folder, Random(f"{target}:{seed}"))


def _held_at_most(forget: bool = False) -> int:
    """The most bytes of memory that this process has held; `forget`: since now, so that one input hides nothing of the next."""
    if forget and CLEAR_REFS.exists():
        CLEAR_REFS.write_text("5")
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def _alarm(number: int, frame: FrameType | None) -> None:
    raise _TooSlow(f"more than {SECONDS} seconds")


def _where(trace: TracebackType | None) -> str:
    """The last of viewsphere's lines in a traceback."""
    own = [
        f"{Path(f.filename).parts[-2]}/{Path(f.filename).name}:{f.lineno}"
        for f in traceback.extract_tb(trace)
        if "/viewsphere/" in f.filename
    ]
    return own[-1] if own else "elsewhere"


class _InTurn:
    """Stands for a pool of threads: does one thing after another, in the thread that asks."""

    def __init__(self, workers: int) -> None: ...

    def __enter__(self) -> _InTurn:
        return self

    def __exit__(self, *_: object) -> None: ...

    map = staticmethod(map)


def findings(target: str, seeds: range) -> Iterator[Finding | int]:
    """Findings among these inputs, and each input's seed before it runs."""
    from viewsphere.check import digests
    from viewsphere.plugins import registry
    from viewsphere.store.shots import checksums

    warnings.simplefilter("ignore")
    os.environ |= SETTINGS
    # Nobody installs plug-ins meanwhile, and looking for them takes long; so do threads of a processor that others keep busy.
    registry.entry_points = cache(registry.entry_points)
    checksums.ThreadPoolExecutor = digests.ThreadPoolExecutor = _InTurn
    for seed in seeds:
        yield seed
        found = run(target, seed)
        if found:
            yield found


def main() -> None:
    """Print a line of JSON for each input begun, and for each finding."""
    sys.path.insert(0, str(Path(__file__).parents[1]))
    resource.setrlimit(resource.RLIMIT_AS, (SPACE, SPACE))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    folder = tempfile.mkdtemp(prefix="fuzz-all-", dir="/dev/shm" if Path("/dev/shm").is_dir() else None)
    tempfile.tempdir = folder
    told = os.fdopen(os.dup(1), "w", buffering=1)
    with Path(os.devnull).open("w") as nowhere:  # what libraries print is nobody's business
        os.dup2(nowhere.fileno(), 1)
    try:
        for one in findings(sys.argv[1], range(int(sys.argv[2]), int(sys.argv[3]))):
            print(json.dumps(asdict(one) if isinstance(one, Finding) else one), file=told)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
