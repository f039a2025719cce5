"""Runs that are hit by a fault at some moment, and what there is afterwards: shared by the tests and by benchmarks/faults.

A work is a command that writes a data set; undisturbed it gives a tree, the model. A fault hits it while it writes. Afterwards
no shot that was finished is lost, nothing that looks finished is torn, what it said is a line, and the same command makes the
model's tree.
"""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from command_line import Answer, viewsphere
from deadline import DEADLINE, until
from small import small_recipe, tree_hash
from viewsphere.errors import StoreError
from viewsphere.scratch import LOCK
from viewsphere.store.shots.checksums import damaged_files
from viewsphere.store.shots.manifest import MANIFEST, Manifest

CHANNELS = ["rgb", "depth", "instances"]
STARTING = 2.0
"""Seconds in which a work has just begun, or has not yet."""

SPAWNED = b"spawn_main"
"""Stands in the command line of each worker."""

Fault = Callable[[subprocess.Popen[str]], bool]
"""Hits a run; says whether there was something to hit."""


def recipe(**changes):
    """Ten shots of two frames."""
    views = {"azimuth": {"start": 0, "stop": 324, "step": 36}, "elevation": [15], "distance": 1.0}
    return small_recipe(**{"viewpoints": views, "channels": CHANNELS, "formats": ["coco", "native"], **changes})


BIGGER = {"models": [{"source": "zoo:post_box", "category": "post box", "count": 3, "scale": {"length": 0.18}}]}


@dataclass(frozen=True)
class Work:
    """A command, without `python -m viewsphere`, that writes into `out`, where `base` lies, if any; some have workers.

    `is_resumed`: a second run keeps the results of a killed one, so several kills may precede the last run.
    """

    words: Callable[[Path, Path], list[str]]
    base: str = ""
    has_workers: bool = False
    is_resumed: bool = True

    def start(self, stock: Path, out: Path, *before: str, workers: int = 2) -> subprocess.Popen[str]:
        """Start it in a process group of its own, behind other words."""
        command = [*before, sys.executable, "-m", "viewsphere", *self._words(stock, out, workers)]
        return subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, start_new_session=True, cwd=stock
        )

    def here(self, stock: Path, out: Path) -> Answer:
        """Run it in this process, which takes a tenth of the time."""
        return viewsphere(*self._words(stock, out, 0), cwd=stock)

    def finish(self, stock: Path, out: Path) -> None:
        """Run it to its end, which is good."""
        answer = self.here(stock, out)
        assert answer.returncode == 0, answer.stderr

    def _words(self, stock: Path, out: Path, workers: int) -> list[str]:
        return [*self.words(stock, out), *(["--workers", str(workers)] if self.has_workers else [])]


def _rendered(file: str, *more: str) -> Callable[[Path, Path], list[str]]:
    return lambda stock, out: ["render", str(stock / file), "-o", str(out), *more]


WORKS = {
    "render": Work(_rendered("recipe.yaml"), has_workers=True),
    "append": Work(_rendered("bigger.yaml", "--append"), "small", has_workers=True),
    "merge": Work(lambda stock, out: ["merge", str(stock / "small"), str(stock / "other"), "-o", str(out), "--format", "coco"]),
    "import": Work(lambda stock, out: ["import", "native", str(stock / "small" / "native"), "-o", str(out)]),
    "export": Work(lambda stock, out: ["export", str(out), "--format", "coco,native,csv"], "small"),
    "convert": Work(
        lambda stock, out: [
            "convert",
            str(stock / "small" / "native"),
            "--from",
            "native",
            "--to",
            "coco,csv,yolo",
            "-o",
            str(out),
        ],
        has_workers=True,
        is_resumed=False,
    ),
}


def make_stock(stock: Path) -> Path:
    """Recipes and data sets that works start from."""
    from viewsphere.run.generate import generate

    (stock / "recipe.yaml").write_text(recipe().to_yaml())
    (stock / "bigger.yaml").write_text(recipe(**BIGGER).to_yaml())
    generate(recipe(), stock / "small", workers=0)
    generate(
        recipe(models=[{"source": "zoo:chair", "category": "chair"}], name="other"), stock / "other", formats=[], workers=0
    )
    return stock


@dataclass
class Tally:
    """What came of a fault."""

    times: int = 0
    lost: int = 0
    torn: int = 0
    unequal: int = 0
    said: dict[str, int] = field(default_factory=dict)
    untidy: list[str] = field(default_factory=list)

    def add(self, process: subprocess.Popen[str], is_hit: bool) -> None:
        """Count a run that has ended, if it was hit, and what it said at last: a line, or it is untidy."""
        lines = [
            line for line in process.communicate(timeout=DEADLINE)[1].splitlines() if not line.startswith(("note:", "warning:"))
        ]
        self.times += is_hit
        if "Traceback" in "".join(lines) or len(lines) > 1:
            self.untidy.append("\n".join(lines))
        if lines:
            self.said[lines[-1]] = self.said.get(lines[-1], 0) + 1

    @property
    def is_good(self) -> bool:
        """Return whether nothing was lost, and all was as it should be."""
        return not (self.lost or self.torn or self.unequal or self.untidy)


@dataclass(frozen=True)
class Undisturbed:
    """The tree that a work makes, its digest, and how many files it has."""

    model: Path
    whole: str
    files: int


@cache
def undisturbed(work: Work, stock: Path) -> Undisturbed:
    """What comes of a work that nothing hits; found once."""
    out = Path(tempfile.mkdtemp(dir=stock)) / "model"
    _begin(work, stock, out)
    work.finish(stock, out)
    return Undisturbed(out, tree_hash(out), _files(out))


def _begin(work: Work, stock: Path, out: Path) -> None:
    shutil.rmtree(out, ignore_errors=True)
    if work.base:
        shutil.copytree(stock / work.base, out)


def _files(out: Path) -> int:
    return sum(len(files) for _, _, files in os.walk(out))


@dataclass
class Course:
    """A work in a folder, which faults hit again and again until it is done; then it begins anew."""

    work: Work
    stock: Path
    place: Path
    rng: random.Random
    workers: int = 2
    tally: Tally = field(default_factory=Tally)
    is_begun: bool = False

    def __post_init__(self) -> None:
        self.place.mkdir(parents=True, exist_ok=True)
        self.undisturbed = undisturbed(self.work, self.stock)
        _begin(self.work, self.stock, self.out)

    @property
    def out(self) -> Path:
        """Where the work writes."""
        return self.place / "out"

    def moment(self, process: subprocess.Popen[str]) -> None:
        """Wait until some moment of the work, often while it writes: until so many files are there, and a little more."""
        if self.rng.random() < 0.2:
            time.sleep(self.rng.uniform(0, STARTING))
            return
        there = _files(self.out)
        awaited = there + self.rng.random() * (self.undisturbed.files - there)
        until(lambda: process.poll() is not None or _files(self.out) > awaited)
        time.sleep(self.rng.uniform(0, 0.1))

    def suffer(self, fault: Fault, times: int) -> None:
        """Let a fault hit the work so many times; a run that had ended before does not count."""
        end = time.monotonic() + times * DEADLINE
        while self.tally.times < times:
            assert time.monotonic() < end, f"hit {self.tally.times} of {times} times"
            self.hit(fault)

    def hit(self, fault: Fault) -> None:
        """Start the work, let a fault hit it, and look at what there is."""
        process, self.is_begun = self.work.start(self.stock, self.out, workers=self.workers), True
        self.moment(process)
        there = finished(self.out)
        self.tally.add(process, fault(process))
        self.look(there)
        if process.returncode == 0 or not self.work.is_resumed:
            self.renew()

    def look(self, there: set[str]) -> None:
        """Count what was lost of the shots that were there, and what is torn now."""
        self.tally.lost += len(there - finished(self.out))
        base = [self.stock / self.work.base] if self.work.base else []
        self.tally.torn += len(torn(self.out, self.undisturbed.model, *base))

    def renew(self) -> None:
        """Finish the work, if it has begun, compare with the model, and begin anew."""
        if self.is_begun:
            self.work.finish(self.stock, self.out)
            self.tally.unequal += tree_hash(self.out) != self.undisturbed.whole
            _begin(self.work, self.stock, self.out)
        self.is_begun = False


def finished(out: Path) -> set[str]:
    """The shots that are there."""
    return {path.parent.name for path in out.glob(f"store/shots/*/*/{MANIFEST}")}


def torn(out: Path, *wholes: Path) -> list[str]:
    """Shots, models and exports that look finished, and are not; files at the root that are not those of whole trees."""
    found = []
    for path in (*out.glob("store/shots/*/*"), *out.glob("store/models/*")):
        try:
            damage = list(Manifest.read(path).damage(path))
        except StoreError as error:
            damage = [str(error)]
        found += damage[:1]
    for path in out.glob("*"):
        if (path / LOCK).is_file():  # made aside by a process, and removed by the next run
            continue
        same = [whole / path.name for whole in wholes if (whole / path.name).exists()]
        if not same:
            found.append(f"{path}: expected no such file")
        elif path.is_file() and path.read_bytes() not in [file.read_bytes() for file in same]:
            found.append(f"{path}: differs")
        elif path.is_dir() and path.name != "store":
            found += [f"{path}: {problem}" for problem in damaged_files(path)][:1]
    for path in out.glob("store/*.json"):
        with suppress(ValueError):
            json.loads(path.read_text("utf-8"))
            continue
        found.append(f"{path}: no JSON")
    return found


def workers_of(pid: int, processes: Path = Path("/proc")) -> list[int]:
    """The numbers of a run's workers; those that end meanwhile are left out."""
    found = []
    for process in processes.glob("[0-9]*"):
        with suppress(OSError):
            parent = (process / "stat").read_text().rpartition(")")[2].split()[1]
            if int(parent) == pid and SPAWNED in (process / "cmdline").read_bytes():
                found.append(int(process.name))
    return found


def kill_all(process: subprocess.Popen[str]) -> bool:
    """SIGKILL of the run and its workers."""
    return _signal_all(process, signal.SIGKILL)


def kill_parent(process: subprocess.Popen[str]) -> bool:
    """SIGKILL of the run alone."""
    return _signal(process, signal.SIGKILL)


def kill_worker(rng: random.Random) -> Fault:
    """SIGKILL of one worker, once there is one."""

    def fault(process: subprocess.Popen[str]) -> bool:
        return any(_sent(pid, signal.SIGKILL) for pid in sorted(_workers(process), key=lambda _: rng.random())[:1])

    return fault


def terminate(process: subprocess.Popen[str]) -> bool:
    """SIGTERM, as clusters send it before they kill."""
    return _signal(process, signal.SIGTERM)


def interrupt(process: subprocess.Popen[str]) -> bool:
    """Ctrl-C: all processes of the terminal's foreground hear it."""
    return _signal_all(process, signal.SIGINT)


def stop_and_go_on(process: subprocess.Popen[str]) -> bool:
    """SIGSTOP of all, and SIGCONT a second later."""
    is_hit = _signal_all(process, signal.SIGSTOP)
    time.sleep(1)
    _signal_all(process, signal.SIGCONT)
    return is_hit


def stop_workers_and_interrupt(process: subprocess.Popen[str]) -> bool:
    """SIGSTOP of the workers, once there are some, which then hear nothing any more; then Ctrl-C."""
    stopped = [_sent(pid, signal.SIGSTOP) for pid in _workers(process)]
    return _signal(process, signal.SIGINT) and any(stopped)


def _workers(process: subprocess.Popen[str]) -> list[int]:
    """The workers that a run has, once it has some; none where it ends before."""
    found: list[int] = []

    def seen() -> bool:
        found[:] = workers_of(process.pid)
        return bool(found) or process.poll() is not None

    assert until(seen)
    return found


def _signal(process: subprocess.Popen[str], what: signal.Signals) -> bool:
    is_at_work = process.poll() is None
    process.send_signal(what)
    return is_at_work


def _signal_all(process: subprocess.Popen[str], what: signal.Signals) -> bool:
    is_at_work = process.poll() is None
    with suppress(ProcessLookupError):
        os.killpg(process.pid, what)
    return is_at_work


def _sent(pid: int, what: signal.Signals) -> bool:
    with suppress(ProcessLookupError):
        os.kill(pid, what)
        return True
    return False


SIGNALS: dict[str, Fault] = {
    "SIGKILL of everything": kill_all,
    "SIGKILL of the parent": kill_parent,
    "SIGKILL of a worker": kill_worker(random.Random(1)),
    "SIGTERM": terminate,
    "Ctrl-C": interrupt,
    "SIGSTOP, SIGCONT": stop_and_go_on,
    "workers SIGSTOPped, Ctrl-C": stop_workers_and_interrupt,
}


@contextmanager
def small_disk(place: Path, **options: str) -> Iterator[Callable[..., None]]:
    """A file system in memory of its own, whose options, such as its size, can be changed; needs root."""
    place.mkdir(parents=True, exist_ok=True)

    def told(**options: str) -> str:
        return ",".join(f"{name}={value}" if value else name for name, value in options.items())

    def remount(**options: str) -> None:
        subprocess.run(["mount", "-o", f"remount,{told(**options)}", str(place)], check=True, capture_output=True)

    subprocess.run(["mount", "-t", "tmpfs", "-o", told(**options), "tmpfs", str(place)], check=True, capture_output=True)
    try:
        yield remount
    finally:
        subprocess.run(["umount", "-l", str(place)], check=True, capture_output=True)
