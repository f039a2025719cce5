"""Long runs of small frames, measured while they go on (Linux): memory, open files, what lies aside, and frames a second.

    benchmarks/soak [--frames 20000] [--workers 1] [--kinds stills,sequences,memory] [--out build/soak]

Random scenes of more models than stay warm: still pictures and sequences of a stereo pair, each rendered by a run (of
--workers 0 in its own process); and still pictures in memory. Ends with status 1 where, after a warm-up of a fifth of the
frames, anything but the speed, which other work on the machine changes, grows by more than 5 %.
"""

from __future__ import annotations

import argparse
import ctypes
import gc
import json
import math
import os
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from itertools import pairwise
from multiprocessing import active_children, get_context
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

import viewsphere as vs
from viewsphere.kernels.entries import kernel_folder
from viewsphere.run.progress import Progress

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "scripts"))
from figures import BLUE, GREEN, INK, PALE, RED, line, polygon, svg, words

KINDS = ("stills", "sequences", "memory")
MOMENTS, LEAST_APART, WARM_UP, MOST_GROWTH = 200, 20, 0.2, 0.05
SPANS = 16
TEXELS, MODELS = 2048, 32
"""Side of a model's texture, and how many models have one: 16 MB each, a third more than is kept warm."""

VIEWS, INSTANTS = 24, 24
"""Frames of a scene, and instants of a sequence."""

CURVES = {
    "parent": ("MB of the run's process", BLUE),
    "heap": ("MB in use in it", BLUE),
    "blocks": ("thousand blocks of Python objects in it", BLUE),
    "workers": ("MB of its workers", GREEN),
    "files": ("open files of all", RED),
    "aside": ("files and folders aside", INK),
}
WIDTH, HEIGHT, LEFT, TOP, GAP = 240, 56, 60, 60, 34


@dataclass(frozen=True)
class Moment:
    """After so many frames: seconds since the beginning, MB in memory of the run's own process and of all its workers, how many
    files they have open, and how many files and folders aside: in the output, among temporary files, in shared memory.

    Memory that was freed may stay with a process, so that a small leak hides in it: of the run's own process `heap` is what is
    in use of C's heap (MB), and `blocks` how many thousand blocks Python's own allocator has given out.
    """

    frames: int
    seconds: float
    parent: float
    heap: float
    blocks: float
    workers: float
    files: int
    aside: int


class Watch:
    """Takes a moment every so many frames."""

    def __init__(self, frames: int, out: Path) -> None:
        self.every, self.moments = max(LEAST_APART, frames // MOMENTS), list[Moment]()
        self._out, self._begun = out, time.monotonic()

    def __call__(self, told: Progress) -> None:
        """Hear how far a run is."""
        if told.phase == "frames":
            self.at(told.done + told.under_way)

    def at(self, frames: int) -> None:
        """So many frames are made."""
        if not frames or (self.moments and frames < self.moments[-1].frames + self.every):
            return
        gc.collect()  # what waits for it is no leak
        own, others = os.getpid(), [child.pid for child in active_children() if child.pid]
        found = Moment(
            frames=frames,
            seconds=time.monotonic() - self._begun,
            parent=memory(own),
            heap=heap(),
            blocks=sys.getallocatedblocks() / 1e3,
            workers=sum(map(memory, others)),
            files=sum(map(open_files, (own, *others))),
            aside=self._aside((own, *others)),
        )
        self.moments.append(found)

    def _aside(self, processes: Sequence[int]) -> int:
        names = [path.name for place in ("/dev/shm", tempfile.gettempdir()) for path in Path(place).iterdir()]
        own = [name for name in names if any(f"~{process}~" in name for process in processes)]
        return len(own) + sum(1 for _ in self._out.glob("store/writing/*"))


class Mallinfo2(ctypes.Structure):
    """The state of glibc's heap: mallinfo2(3)."""

    _fields_ = [(name, ctypes.c_size_t) for name in ("arena", "ordblks", "smblks", "hblks", "hblkhd", "usmblks", "fsmblks")]
    _fields_ += [(name, ctypes.c_size_t) for name in ("uordblks", "fordblks", "keepcost")]


def heap() -> float:
    """MB in use of this process's heap; 0 if the C library does not report it."""
    ask = getattr(ctypes.CDLL(None), "mallinfo2", None)
    if ask is None:
        return 0.0
    ask.restype = Mallinfo2
    told = ask()
    return (told.uordblks + told.hblkhd) / 1e6


def memory(process: int) -> float:
    """MB of a process that are in memory; 0 where it has ended."""
    try:
        pages = Path(f"/proc/{process}/statm").read_text("ascii").split()[1]
    except (OSError, IndexError):
        return 0.0
    return int(pages) * os.sysconf("SC_PAGE_SIZE") / 1e6


def open_files(process: int) -> int:
    """Return the number of files, pipes and the like that a process has open; 0 where it has ended."""
    try:
        return len(os.listdir(f"/proc/{process}/fd"))  # noqa: PTH208, which is quicker
    except OSError:
        return 0


def growth(values: Sequence[float]) -> float:
    """Return the growth from the first to the last of some values, as a share of the first: what is never given back.

    Scenes differ, and what they need comes and goes, but a leak lifts the floor: of 16 spans, each with its least value, the
    more of what the medians of the first and the last quarter say, and the median slope between any two (Theil and Sen).
    """
    y = np.array([min(span) for span in np.array_split(np.asarray(values, float), min(SPANS, len(values)))])
    quarter = max(1, len(y) // 4)
    first, last = np.median(y[:quarter]), np.median(y[-quarter:])
    a, b = np.triu_indices(len(y), 1)
    grown = max(last - first, np.median((y[b] - y[a]) / (b - a)) * (len(y) - 1)) if len(a) else 0.0
    return float(grown / first) if first else math.inf if grown > 0 else 0.0


def after_warm_up(moments: Sequence[Moment], name: str) -> list[float]:
    """One of the curves from where it has to stay as it is."""
    return [float(getattr(moment, name)) for moment in moments if moment.frames > WARM_UP * moments[-1].frames]


def problems(kind: str, moments: Sequence[Moment], most: float = MOST_GROWTH) -> Iterator[str]:
    """Yield a message for each value that grows by more than this in a run."""
    for name, (what, _) in CURVES.items():
        values = after_warm_up(moments, name)
        if (found := growth(values)) > most:
            span = f"{values[0]:,.0f} to {values[-1]:,.0f} {what}"
            yield f"{kind}: expected growth of at most {most:.0%} after the warm-up; found {found:+.1%}: {span}"


def blocks(folder: Path, count: int, texels: int) -> None:
    """So many OBJ files of a textured block, each with a picture of its own."""
    folder.mkdir()
    corners = [(x, y, z) for z in (0, 1) for y in (-0.5, 0.5) for x in (-0.5, 0.5)]
    faces = ((1, 2, 6, 5), (2, 4, 8, 6), (4, 3, 7, 8), (3, 1, 5, 7), (5, 6, 8, 7), (3, 4, 2, 1))
    lines = [f"v {x} {y} {z}" for x, y, z in corners] + ["vt 0 0", "vt 1 0", "vt 1 1", "vt 0 1", "usemtl side"]
    lines += ["f " + " ".join(f"{corner}/{i}" for i, corner in enumerate(face, 1)) for face in faces]
    ramp = np.linspace(0, 255, texels).astype(np.uint8)
    for number in range(count):
        pixels = np.empty((texels, texels, 3), np.uint8)
        pixels[..., 0], pixels[..., 1], pixels[..., 2] = ramp, ramp[:, None], number * 255 // count
        Image.fromarray(pixels).save(folder / f"block{number}.png", compress_level=1)
        (folder / f"block{number}.mtl").write_text(f"newmtl side\nKd 1 1 1\nmap_Kd block{number}.png\n", "ascii")
        text = "\n".join((f"mtllib block{number}.mtl", *lines))
        (folder / f"block{number}.obj").write_text(f"{text}\n", "ascii")


def recipe(kind: str, frames: int, folder: Path) -> vs.Recipe:
    """About so many frames of 64 x 48 pixels, of three models of a folder and of the zoo at a time."""
    turning = [{"kind": "random", "position": [0.3, 0.3, 0], "rotation_deg": [0, 0, 40], "highest_hz": 2}]
    moves = {"motion": turning} if kind == "sequences" else {}
    value: dict[str, Any] = {
        "name": f"soak-{kind}",
        "models": [
            {"source": str(folder / "*.obj"), "category": "block", "up": "+z", "scale": {"length": [0.3, 0.8]}, **moves},
            {"source": "zoo:post_box", "category": "post box", "count": 4, "scale": {"length": 0.4}, **moves},
            {"source": "zoo:chair", "category": "chair", "count": 4, **moves},
        ],
        "scenes": {"count": max(1, frames // VIEWS), "objects": 3},
        "viewpoints": {"kind": "sphere", "count": VIEWS, "elevation": [10, 60], "distance": [4, 6]},
        "camera": {"size": [64, 48], "fov_deg": 50},
        "scene": {
            "ground": {"uniform": ["#303030", "#c0b0a0"]},
            "sun": {"azimuth": [0, 360], "elevation": [20, 70]},
            "effects": {"blur": [0, 0.1], "jpeg": [0, 0.3]},
        },
        "channels": ["rgb", "depth", "instances", "normals"],
        "splits": {"by": "frame"},
        "formats": [],
    }
    if kind == "sequences":
        value |= {
            "scenes": {"count": max(1, frames // (2 * INSTANTS)), "objects": 3},
            "viewpoints": {"kind": "orbit", "azimuth": [0, 60], "elevation": [18, 30], "distance": [5, 4.5]},
            "rig": {"kind": "stereo", "baseline": 0.1},
            "time": {"frames": INSTANTS, "fps": 10},
            "tracks": {"count": 16, "on": "objects", "at": [0]},
            "channels": [*value["channels"], "flow", "flow_state", "disparity"],
            "shot_frames": 8,
        }
    return vs.Recipe.model_validate(value)


def course(kind: str, frames: int, workers: int, models: int = MODELS, texels: int = TEXELS) -> list[Moment]:
    """Render about so many frames, and watch it. What is written goes with the temporary folder."""
    with tempfile.TemporaryDirectory(prefix="viewsphere-soak-") as folder:
        place = Path(folder)
        blocks(place / "models", models, texels)
        wanted = recipe(kind, frames, place / "models")
        watch = Watch(frames, place / "out")
        if kind == "memory":
            for number, _ in enumerate(vs.render(wanted), 1):
                watch.at(number)
        else:
            vs.generate(wanted, place / "out", workers=workers, listener=watch)
    return watch.moments


def rates(moments: Sequence[Moment]) -> list[float]:
    """Frames a second between each moment and the next."""
    return [(b.frames - a.frames) / (b.seconds - a.seconds) for a, b in pairwise(moments)]


def told(kind: str, moments: Sequence[Moment]) -> str:
    """A run in a line."""
    parts: list[str] = []
    for name, (what, _) in CURVES.items():
        values = after_warm_up(moments, name)
        parts.append(f"{np.median(values):,.0f} {what} ({growth(values):+.1%})")
    return f"{kind}: {moments[-1].frames:,} frames, {', '.join(parts)}; {np.median(rates(moments)):,.0f} frames a second"


def chart(courses: Mapping[str, Sequence[Moment]]) -> str:
    """A column for each run, its curves one above another, each from 0; the warm-up is gray."""
    parts: list[str] = []
    rows = (*((what, color) for what, color in CURVES.values()), ("frames a second", INK))
    for column, (kind, moments) in enumerate(courses.items()):
        left = LEFT + column * (WIDTH + LEFT)
        parts.append(words((left + WIDTH / 2, 24), f"{kind}: {moments[-1].frames:,} frames", INK))
        curves = [*([float(getattr(m, name)) for m in moments] for name in CURVES), rates(moments)]
        for row, ((what, color), values) in enumerate(zip(rows, curves, strict=True)):
            low = TOP + HEIGHT + row * (HEIGHT + GAP)
            parts += curve(values, (left, low), what, color)
    return svg(LEFT + len(courses) * (WIDTH + LEFT), TOP + len(rows) * (HEIGHT + GAP), parts)


def curve(values: Sequence[float], at: tuple[float, float], name: str, color: str) -> Iterator[str]:
    """A curve whose lower left corner is there."""
    (left, low), most = at, max(values) or 1.0
    warm, step = left + WARM_UP * WIDTH, WIDTH / max(1, len(values) - 1)
    yield polygon([(left, low), (left, low - HEIGHT), (warm, low - HEIGHT), (warm, low)], PALE)
    yield line((left, low), (left + WIDTH, low), INK, 1)
    yield words((left, low - HEIGHT - 8), name, color, "start")
    yield words((left - 6, low - HEIGHT + 5), f"{max(values):,.0f}", INK, "end")
    yield words((left - 6, low), "0", INK, "end")
    points = " ".join(f"{left + i * step:.1f},{low - HEIGHT * value / most:.1f}" for i, value in enumerate(values))
    yield f'<polyline points="{points}" fill="none" stroke="{color}" stroke-width="1.5"/>'


def write(courses: Mapping[str, Sequence[Moment]], folder: Path) -> None:
    """Write what was measured, and the chart of it."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "chart.svg").write_text(chart(courses), "utf-8")
    plain = {kind: [asdict(moment) for moment in moments] for kind, moments in courses.items()}
    (folder / "moments.json").write_text(json.dumps(plain, indent=1), "utf-8")


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--frames", type=int, default=20_000, help="of each kind")
    options.add_argument("--workers", type=int, default=1)
    options.add_argument("--kinds", default=",".join(KINDS))
    options.add_argument("--out", type=Path, default=Path("build/soak"), help="folder for moments.json and chart.svg")
    asked = options.parse_args()
    courses: dict[str, list[Moment]] = {}
    with tempfile.TemporaryDirectory(prefix="viewsphere-soak-cache-") as cache:
        os.environ |= {"NUMBA_CACHE_DIR": str(kernel_folder()), "VIEWSPHERE_CACHE": cache}  # half a gigabyte of models
        with ProcessPoolExecutor(1, get_context("spawn"), max_tasks_per_child=1) as pool:  # each in a process of its own
            for kind in asked.kinds.split(","):
                courses[kind] = pool.submit(course, kind, asked.frames, asked.workers).result()
                print(told(kind, courses[kind]), flush=True)
                write(courses, asked.out)
    if found := [text for kind, moments in courses.items() for text in problems(kind, moments)]:
        sys.exit("\n".join(found))


if __name__ == "__main__":
    main()
