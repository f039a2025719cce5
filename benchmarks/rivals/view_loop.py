"""The loop that each rival's script runs: a view's number comes in, its CPU seconds go out.

Only the standard library, since each script runs in an environment of its own.
"""

import json
import os
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any


def cpu_seconds() -> float:
    """CPU seconds of this process, all threads."""
    return time.process_time()


@dataclass
class Scene:
    """The exported car and its cameras, in glTF's axes (Y up, metres); cameras look along -Z, as OpenGL's do."""

    folder: Path
    name: str
    told: dict[str, Any]
    answers: Any = field(repr=False)
    ended: float = 0.0
    """CPU seconds when the last view was finished."""

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of a picture."""
        return self.told["width"], self.told["height"]

    def path(self, name: str) -> str:
        """Path of one of the scene's files."""
        return str(self.folder / name)

    def ready(self, library: str, gives: str) -> None:
        """Report the library with its version, and what a frame of it gives."""
        self.answer({"library": library, "gives": gives})

    def answer(self, message: dict[str, Any]) -> None:
        """Send one line to the benchmark."""
        self.answers.write(json.dumps(message) + "\n")
        self.answers.flush()

    def views(self) -> Iterator[int]:
        """The numbers of the views to draw; the work between two of them is what is measured."""
        for line in sys.stdin:
            begun = cpu_seconds()
            yield int(line)
            self.ended = cpu_seconds()
            self.answer({"seconds": self.ended - begun})

    def finish(self) -> None:
        """Report the work since the last view, which all views share."""
        self.answer({"rest": cpu_seconds() - self.ended})

    def keep(self, view: int, pixels: Any) -> None:
        """Write the first view's picture, (H, W) or (H, W, 3) uint8, for the benchmark to look at; others are dropped."""
        path = self.folder / f"{self.name}.pnm"
        if view or path.exists():
            return
        kind = b"P6" if pixels.ndim == 3 else b"P5"
        path.write_bytes(kind + b"\n%d %d\n255\n" % self.size + pixels.tobytes())


def opened(on_one_core: bool = True) -> Scene:
    """The scene of the folder that the command line names. This process keeps to one core unless its library cannot, and
    libraries' own messages go to standard error.
    """
    if on_one_core and hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    folder = Path(sys.argv[1])
    return Scene(folder, Path(sys.argv[0]).stem, json.loads((folder / "scene.json").read_text()), answers)
