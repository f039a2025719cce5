"""The cost of 1, 10 and 100 million images, and their time on 10 to 10,000 nodes.

    benchmarks/simulate                    the tables of docs/scale.md, from what was measured last
    benchmarks/simulate --measure          measure again: shots of the reference scene, and how fast Ray hands out work
    benchmarks/simulate --compare 2        a real run on so many Ray nodes of one CPU, beside what is predicted for it

Measured are seconds of each shot, its files and their bytes; a simulated run draws from these seconds. Failures, slow nodes and
the limits of an object store are assumptions, named in ASSUMED.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import sys
import tempfile
import time
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from multiprocessing import get_context
from pathlib import Path

from bench_scene import reference_recipe, write_reference
from cluster import Cluster, Load, Outcome, simulate

from viewsphere import Recipe, generate
from viewsphere.run.progress import Progress
from viewsphere.store import Dataset

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "tests"))
from ray_nodes import SMALL, ray_cluster  # noqa: E402, which is found now

MEASURED, PAGE = ROOT / "benchmarks" / "measured.json", ROOT / "docs" / "scale.md"
BEGIN, END = "<!-- benchmarks/simulate -->\n", "<!-- end -->\n"

IMAGES = (10**6, 10**7, 10**8)
SIMULATED = 10**7
NODES = (10, 100, 1000, 10_000)
FRAMES = 240

ASSUMED = {
    "cores": 16,
    "mtbf_h": 1000.0,
    "repair_s": 300.0,
    "slow": 0.02,
    "slow_factor": 2.0,
    "requests_per_s": 3500.0,
    "bytes_per_s": 10e9,
}
"""Nodes of 16 cores that fail every 1,000 hours (a spot machine more often) and are back after 5 minutes; 2 % of them half as
fast; one prefix of an object store, and 10 GB/s to it. S3 takes 3,500 PUT requests a second of each prefix:
https://docs.aws.amazon.com/AmazonS3/latest/userguide/optimizing-performance.html
"""

PACKED = 4
"""Files of a shot whose channels lie in one."""


@dataclass(frozen=True)
class Measured:
    """Of the reference scene on one machine: seconds of each shot on one core of several at work; what is stored of a shot;
    seconds until a worker is ready; seconds in which Ray hands out one shot.
    """

    machine: str
    frames: float
    seconds: tuple[float, ...]
    objects: float
    bytes: float
    start_s: float
    handout_s: float

    def load(self, images: int) -> Load:
        """So many images of this kind."""
        return Load(round(images / self.frames), self.frames, self.seconds, self.objects, self.bytes)


class Stopwatch:
    """Listens to a run, and notes when another shot was finished."""

    def __init__(self) -> None:
        self.begun, self.done, self.moments = time.perf_counter(), -1, list[float]()

    def __call__(self, told: Progress) -> None:
        if told.phase == "frames" and told.done > self.done:
            self.done = told.done
            self.moments.append(time.perf_counter() - self.begun)


def scene(frames: int, folder: Path) -> Recipe:
    """The benchmark's reference scene, in shots of eight frames."""
    return reference_recipe(frames, 4, folder).model_copy(update={"shot_frames": 8})


def timed(frames: int, folder: Path, number: int) -> list[float]:
    """Render alone in this process; gives when it was ready to render, and when each shot was finished."""
    watch = Stopwatch()
    generate(scene(frames, folder), folder / f"out{number}", workers=0, listener=watch)
    return watch.moments


def measure(processes: int, frames: int, folder: Path) -> Measured:
    """Render in so many processes at once, as the cores of a node do."""
    write_reference(folder)
    with get_context("spawn").Pool(processes) as pool:
        runs = pool.starmap(timed, [(frames, folder, number) for number in range(processes)])
    seconds = [[b - a for a, b in pairwise(moments)] for moments in runs]
    later = [taken for run in seconds for taken in run[1:]]
    first = statistics.mean(moments[0] + run[0] for moments, run in zip(runs, seconds, strict=True))
    dataset = Dataset(folder / "out0")
    shots = [dataset.store.shot_folder(row.key) for row in dataset.plan.rows]
    files = [file for shot in shots for file in shot.rglob("*") if file.is_file()]
    return Measured(
        machine=machine(),
        frames=frames / len(shots),
        seconds=tuple(round(taken, 4) for taken in later),
        objects=len(files) / len(shots),
        bytes=sum(file.stat().st_size for file in files) / len(shots),
        start_s=round(first - statistics.mean(later), 3),
        handout_s=0.0,
    )


def machine() -> str:
    """The processor's name."""
    lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines() if Path("/proc/cpuinfo").is_file() else []
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "an unknown processor")


def handout(calls: int = 500) -> float:
    """Seconds of a call of a Ray actor that does nothing, one after another, on a cluster of this machine."""
    import ray

    with nodes(1) as address:
        ray.init(address, log_to_driver=False)
        try:
            actor = ray.remote(Idle).remote()
            ray.get(actor.do.remote())
            begun = time.perf_counter()
            for _ in range(calls):
                ray.get(actor.do.remote())
            return (time.perf_counter() - begun) / calls
        finally:
            ray.shutdown()


class Idle:
    """An actor that does nothing."""

    def do(self) -> None:
        """Nothing."""


def compare(count: int, frames: int, folder: Path) -> None:
    """Render on so many Ray nodes of one CPU each, and print how long that took beside what is predicted."""
    measured = measure(count, frames, folder)
    watch = Stopwatch()
    with nodes(count) as address:
        generate(scene(count * frames, folder), folder / "ray", workers=0, ray=address, listener=watch)
    found = watch.moments[-1] - watch.moments[0]
    known = Load(len(watch.moments) - 1, measured.frames, measured.seconds, measured.objects, measured.bytes)
    whole = Cluster(count, cores=1, start_s=max(0.0, measured.start_s - watch.moments[0]), handout_s=stored().handout_s)
    predicted = [simulate(known, whole, seed).makespan for seed in range(20)]
    mean, between = statistics.mean(predicted), f"{min(predicted):.1f} to {max(predicted):.1f}"
    print(f"{known.shots} shots of {measured.frames:.0f} frames on {count} Ray nodes of one CPU:")
    print(f"predicted {mean:.1f} s ({between}), found {found:.1f} s ({found / mean - 1:+.1%})")


@contextmanager
def nodes(count: int) -> Generator[str]:
    """The address of a cluster of so many Ray nodes of one CPU each on this machine."""
    with ray_cluster() as cluster:
        for _ in range(count - 1):
            cluster.add_node(**SMALL)
        yield cluster.address


def stored() -> Measured:
    """The last measurements."""
    return Measured(**json.loads(MEASURED.read_text("utf-8")))


def rows(table: Sequence[Sequence[str]]) -> str:
    """A table of Markdown; its first row is the head."""
    head, *body = ("| " + " | ".join(row) + " |\n" for row in table)
    return head + "|" + "---|" * len(table[0]) + "\n" + "".join(body)


def costs(measured: Measured) -> str:
    """The cost of images, whatever makes them."""
    table = [["Images", "Core hours", "Stored", "Files (requests)", "with `shots: tar`", "Shots"]]
    for images in IMAGES:
        load = measured.load(images)
        size, files, packed = load.shots * load.bytes / 1e12, load.shots * load.objects, load.shots * PACKED
        numbers = (f"{files:,.0f}", f"{packed:,.0f}", f"{load.shots:,}")
        table.append([f"{images:,}", f"{load.core_hours:,.0f}", f"{size:,.2f} TB", *numbers])
    return rows(table)


def duration(seconds: float) -> str:
    """In minutes, hours or days."""
    minutes = seconds / 60
    return f"{minutes:.0f} min" if minutes < 90 else f"{minutes / 60:.1f} h" if minutes < 2880 else f"{minutes / 1440:.1f} days"


def courses(measured: Measured) -> str:
    """The time of SIMULATED images and the use of nodes, for each way to store shots."""
    load = measured.load(SIMULATED)
    table = [["Nodes", "A file a channel and frame", "`shots: tar`", "A store without limits", "Shots made twice"]]
    for count in NODES:
        cluster = Cluster(count, start_s=measured.start_s, handout_s=measured.handout_s, **ASSUMED)
        free = replace(cluster, requests_per_s=math.inf, bytes_per_s=math.inf)
        found = [simulate(load, cluster), simulate(replace(load, objects=PACKED), cluster), simulate(load, free)]
        table.append([f"{count:,}", *map(told, found), f"{found[-1].lost:,}"])
    return f"\n{SIMULATED:,} images, makespan and efficiency:\n\n{rows(table)}"


def told(outcome: Outcome) -> str:
    """Makespan and efficiency."""
    return f"{duration(outcome.makespan)}, {outcome.efficiency:.0%}"


def page(measured: Measured) -> str:
    """The cost of images, for the generated part of docs/scale.md."""
    seconds, size = statistics.mean(measured.seconds) / measured.frames, measured.bytes / measured.frames / 1e6
    intro = (
        f"Measured on one core of a {measured.machine}, with another core at work: {seconds:.3f} s and {size:.2f} MB a frame, "
        f"{measured.objects:.0f} files a shot of {measured.frames:.0f} frames.\n\n"
    )
    return intro + costs(measured)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--measure", action="store_true")
    options.add_argument("--compare", type=int, metavar="NODES")
    options.add_argument("--frames", type=int, default=FRAMES, help="of the measured run, each node's")
    asked = options.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        if asked.measure:
            found = replace(measure(2, asked.frames, Path(folder)), handout_s=round(handout(), 6))
            MEASURED.write_text(json.dumps(asdict(found)) + "\n", "utf-8")
        if asked.compare:
            compare(asked.compare, asked.frames, Path(folder))
            return
    told = page(stored()) + courses(stored())
    before, _, rest = PAGE.read_text("utf-8").partition(BEGIN)
    PAGE.write_text(before + BEGIN + told + END + rest.partition(END)[2], "utf-8")
    print(told)


if __name__ == "__main__":
    main()
