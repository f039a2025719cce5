"""A long run of tiny frames in one process: its memory, its open files and its speed, measured while it goes on (Linux).

After a warm-up of a fifth of the frames, growth is what the last fifth needs more than the second one, in the median.
Ends with status 1 where memory or open files grow by more than 5 %.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from figures import BLUE, GREEN, INK, RED, line, svg, words

from viewsphere import Recipe, generate
from viewsphere.run.progress import Progress

MODELS, SAMPLES, MOST_GROWTH = 4, 200, 0.05
WIDTH, HEIGHT, LEFT, TOP = 760, 110, 60, 40


@dataclass(frozen=True)
class Moment:
    """After so many frames: seconds since the first, MB in memory, open files."""

    frames: int
    seconds: float
    memory: float
    files: int


class Watch:
    """Takes a moment every so many frames."""

    def __init__(self, every: int) -> None:
        self.every, self.moments, self._begun = every, list[Moment](), time.monotonic()

    def __call__(self, told: Progress) -> None:
        if told.phase != "frames" or (self.moments and told.done < self.moments[-1].frames + self.every):
            return
        status = Path("/proc/self/status").read_text("ascii")
        memory = next(int(text.split()[1]) for text in status.splitlines() if text.startswith("VmRSS"))
        files = sum(1 for _ in Path("/proc/self/fd").iterdir())
        self.moments.append(Moment(told.done, time.monotonic() - self._begun, memory / 1024, files))


def recipe(frames: int) -> Recipe:
    """So many frames of 32 x 24 pixels, of four post boxes."""
    value: dict[str, Any] = {
        "name": "soak",
        "models": [{"source": "zoo:post_box", "category": "post box", "count": MODELS, "scale": {"length": 0.18}}],
        "viewpoints": {"kind": "sphere", "count": frames // MODELS, "distance": 1.0},
        "camera": {"size": [32, 24], "fov_deg": 35},
        "scene": {"ground": True},
        "channels": ["rgb", "depth", "instances"],
        "max_frames": frames,
        "formats": [],
    }
    return Recipe.model_validate(value)


def rates(moments: Sequence[Moment]) -> list[float]:
    """Frames a second between each moment and the next."""
    return [(b.frames - a.frames) / (b.seconds - a.seconds) for a, b in pairwise(moments)]


def growth(values: Sequence[float]) -> float:
    """Of the median of the last fifth over that of the second, less 1."""
    fifth = len(values) // 5
    return statistics.median(values[-fifth:]) / statistics.median(values[fifth : 2 * fifth]) - 1


def chart(curves: dict[str, Sequence[float]], frames: int) -> str:
    """One curve above another, each from 0."""
    parts: list[str] = []
    for row, ((name, values), color) in enumerate(zip(curves.items(), (BLUE, GREEN, RED), strict=True)):
        low, most = TOP + (row + 1) * HEIGHT + row * TOP, max(values)
        step = (WIDTH - 2 * LEFT) / max(1, len(values) - 1)
        points = [(LEFT + i * step, low - HEIGHT * value / most) for i, value in enumerate(values)]
        parts += [line((LEFT, low), (WIDTH - LEFT, low), INK, 1), words((LEFT, low - HEIGHT - 8), name, color, "start")]
        parts += [words((LEFT - 6, low - HEIGHT + 5), f"{most:,.0f}", INK, "end"), words((LEFT - 6, low), "0", INK, "end")]
        parts += [line(a, b, color) for a, b in pairwise(points)]
    bottom = TOP + 3 * (HEIGHT + TOP) - 10
    return svg(WIDTH, bottom + 20, [*parts, words((WIDTH - LEFT, bottom), f"{frames:,} frames", INK, "end")])


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--frames", type=int, default=20_000)
    options.add_argument("--out", type=Path, default=Path("build/soak"), help="folder for moments.json and chart.svg")
    asked = options.parse_args()
    watch = Watch(max(1, asked.frames // SAMPLES))
    with tempfile.TemporaryDirectory() as folder:
        generate(recipe(asked.frames), Path(folder) / "out", listener=watch)
    moments = watch.moments
    curves: dict[str, Sequence[float]] = {"MB in memory": [m.memory for m in moments], "open files": [m.files for m in moments]}
    curves["frames a second"] = rates(moments)
    asked.out.mkdir(parents=True, exist_ok=True)
    (asked.out / "chart.svg").write_text(chart(curves, asked.frames), "utf-8")
    (asked.out / "moments.json").write_text(json.dumps([asdict(m) for m in moments], indent=1), "utf-8")
    grown = {name: growth(values) for name, values in curves.items()}
    for name, values in curves.items():
        warm = values[len(values) // 5]
        print(f"{name}: {warm:,.1f} after the warm-up, {values[-1]:,.1f} at the end, growth {grown[name]:+.1%}")
    if max(grown["MB in memory"], grown["open files"]) > MOST_GROWTH:
        sys.exit(f"expected growth of at most {MOST_GROWTH:.0%}")


if __name__ == "__main__":
    main()
