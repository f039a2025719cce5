"""Runs that are hit by a fault at some moment, and what there is afterwards: shared by the tests and by scripts/faults.

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
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

from deadline import DEADLINE, until
from small import small_recipe, tree_hash
from viewsphere.errors import StoreError
from viewsphere.store.checksums import damaged_files
from viewsphere.store.manifest import MANIFEST, Manifest

CHANNELS = ["rgb", "depth", "instances"]
SPAWNED = "spawn_main"
"""Stands in the command line of each worker."""


def recipe(**changes):
    """Ten shots of two frames."""
    views = {"azimuth": {"start": 0, "stop": 324, "step": 36}, "elevation": [15], "distance": 1.0}
    return small_recipe(**{"viewpoints": views, "channels": CHANNELS, "formats": ["coco", "native"], **changes})


BIGGER = {"models": [{"source": "zoo:post_box", "category": "post box", "count": 3, "scale": {"length": 0.18}}]}


@dataclass(frozen=True)
class Work:
    """A command, without `python -m viewsphere`, that writes into `out`, where `base` lies, if any."""

    words: Callable[[Path, Path], list[str]]
    base: str = ""

    def start(self, stock: Path, out: Path, *before: str) -> subprocess.Popen[str]:
        """Start it in a process group of its own, behind other words."""
        command = [*before, sys.executable, "-m", "viewsphere", *self.words(stock, out)]
        return subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, start_new_session=True, cwd=stock
        )

    def finish(self, stock: Path, out: Path) -> None:
        """Run it to its end, which is good."""
        process = self.start(stock, out)
        said = process.communicate(timeout=DEADLINE)[1]
        assert process.returncode == 0, said


def _rendered(file: str, *more: str) -> Callable[[Path, Path], list[str]]:
    return lambda stock, out: ["render", str(stock / file), "-o", str(out), "--workers", "2", *more]


WORKS = {
    "render": Work(_rendered("recipe.yaml")),
    "append": Work(_rendered("bigger.yaml", "--append"), "small"),
    "merge": Work(lambda stock, out: ["merge", str(stock / "small"), str(stock / "other"), "-o", str(out), "--format", "coco"]),
    "import": Work(lambda stock, out: ["import", "native", str(stock / "small" / "native"), "-o", str(out)]),
    "export": Work(lambda stock, out: ["export", str(out), "--format", "coco,native,csv"], "small"),
}


def make_stock(stock: Path) -> Path:
    """Recipes and data sets that works start from."""
    from viewsphere.run.generate import generate

    (stock / "recipe.yaml").write_text(recipe().to_yaml())
    (stock / "bigger.yaml").write_text(recipe(**BIGGER).to_yaml())
    generate(recipe(), stock / "small")
    generate(recipe(models=[{"source": "zoo:chair", "category": "chair"}], name="other"), stock / "other", formats=[])
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

    def add(self, process: subprocess.Popen[str]) -> None:
        """Count a run that has ended, and what it said at last: a line, or it is untidy."""
        lines = [
            line for line in process.communicate(timeout=DEADLINE)[1].splitlines() if not line.startswith(("note:", "warning:"))
        ]
        self.times += 1
        if "Traceback" in "".join(lines) or len(lines) > 1:
            self.untidy.append("\n".join(lines))
        if lines:
            self.said[lines[-1]] = self.said.get(lines[-1], 0) + 1

    @property
    def is_good(self) -> bool:
        """Whether nothing was lost, and all was as it should be."""
        return not (self.lost or self.torn or self.unequal or self.untidy)


@dataclass
class Course:
    """A work in a folder, which faults hit again and again until it is done; then it begins anew."""

    work: Work
    stock: Path
    place: Path
    rng: random.Random
    tally: Tally = field(default_factory=Tally)

    def __post_init__(self) -> None:
        self.place.mkdir(parents=True, exist_ok=True)
        self._begin()
        begun = time.monotonic()
        process = self.work.start(self.stock, self.out)
        self._await(process)
        self._lead = time.monotonic() - begun
        said = process.communicate(timeout=DEADLINE)[1]
        assert process.returncode == 0, said
        self._span = time.monotonic() - begun - self._lead
        self.model = Path(shutil.copytree(self.out, self.place / "model"))
        self.whole = tree_hash(self.model)
        self._begin()

    @property
    def out(self) -> Path:
        """Where the work writes."""
        return self.place / "out"

    def _begin(self) -> None:
        shutil.rmtree(self.out, ignore_errors=True)
        if self.work.base:
            shutil.copytree(self.stock / self.work.base, self.out)

    def _await(self, process: subprocess.Popen[str]) -> None:
        """Wait until the work writes something."""
        writing = self.out / "store" / "writing"
        until(lambda: process.poll() is not None or (writing.is_dir() and any(writing.iterdir())))

    def moment(self, process: subprocess.Popen[str]) -> None:
        """Wait until some moment of the work, often while it writes."""
        if self.rng.random() < 0.2:
            time.sleep(self.rng.uniform(0, self._lead))
            return
        self._await(process)
        time.sleep(self.rng.uniform(0, self._span))

    def hit(self, fault: Callable[[subprocess.Popen[str]], None]) -> None:
        """Start the work, let a fault hit it, and look at what there is."""
        process = self.work.start(self.stock, self.out)
        self.moment(process)
        there = finished(self.out)
        fault(process)
        self.tally.add(process)
        self.look(there)
        if process.returncode == 0:
            self.renew()

    def look(self, there: set[str]) -> None:
        """Count what was lost of the shots that were there, and what is torn now."""
        self.tally.lost += len(there - finished(self.out))
        base = [self.stock / self.work.base] if self.work.base else []
        self.tally.torn += len(torn(self.out, self.model, *base))

    def renew(self) -> None:
        """Finish the work, compare with the model, and begin anew."""
        self.work.finish(self.stock, self.out)
        self.tally.unequal += tree_hash(self.out) != self.whole
        self._begin()


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


def workers_of(process: subprocess.Popen[str]) -> list[int]:
    """The numbers of a run's workers."""
    found = []
    with suppress(OSError):
        for pid in Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split():
            with suppress(OSError):
                if SPAWNED in Path(f"/proc/{pid}/cmdline").read_text():
                    found.append(int(pid))
    return found


def kill_all(process: subprocess.Popen[str]) -> None:
    """SIGKILL of the run and its workers."""
    _signal_all(process, signal.SIGKILL)


def kill_parent(process: subprocess.Popen[str]) -> None:
    """SIGKILL of the run alone."""
    process.kill()


def kill_worker(rng: random.Random) -> Callable[[subprocess.Popen[str]], None]:
    """SIGKILL of one worker, if there is one."""

    def fault(process: subprocess.Popen[str]) -> None:
        if found := workers_of(process):
            with suppress(ProcessLookupError):
                os.kill(rng.choice(found), signal.SIGKILL)

    return fault


def terminate(process: subprocess.Popen[str]) -> None:
    """SIGTERM, as clusters send it before they kill."""
    process.terminate()


def interrupt(process: subprocess.Popen[str]) -> None:
    """Ctrl-C: all processes of the terminal's foreground hear it."""
    _signal_all(process, signal.SIGINT)


def stop_and_go_on(process: subprocess.Popen[str]) -> None:
    """SIGSTOP of all, and SIGCONT a second later."""
    _signal_all(process, signal.SIGSTOP)
    time.sleep(1)
    _signal_all(process, signal.SIGCONT)


def stop_workers_and_interrupt(process: subprocess.Popen[str]) -> None:
    """SIGSTOP of the workers, which then hear nothing any more; then Ctrl-C."""
    for pid in workers_of(process):
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGSTOP)
    process.send_signal(signal.SIGINT)


def _signal_all(process: subprocess.Popen[str], what: signal.Signals) -> None:
    with suppress(ProcessLookupError):
        os.killpg(process.pid, what)


SIGNALS: dict[str, Callable[[subprocess.Popen[str]], None]] = {
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
