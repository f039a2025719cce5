"""The rate at which frames reach a training loop, beside their least cost: PyTorch loaders with two workers.

Reading: pictures, depth and boxes of the reference scene by `vs.open(...).select`, in order and shuffled, beside two processes
that only decode the same files, and a loader that does nothing else: it copies batches into memory that processes share, which
is PyTorch's own cost. Rendering: the same pictures by `vs.render`, beside two processes that only render. What three further
epochs take is counted, the least of several turns; turns of what is compared alternate, so that a load that slows the machine
slows both. Shares are of CPU time.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable
from functools import partial
from importlib.util import find_spec
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from bench_scene import reference_recipe

import viewsphere as vs
from viewsphere.labels import channels
from viewsphere.model.sample import Sample
from viewsphere.run.workers.allocator import keep_freed_memory
from viewsphere.store import decode

PICTURES = ("rgb", "depth")
FRAMES = {"reading": 256, "rendering": 32}
WORKERS, BATCH, TURNS, MORE = 2, 16, 3, 3


def in_two(work: Callable[..., None], *given: Any) -> None:
    """Let two processes do a share of some work each."""
    processes = [get_context("spawn").Process(target=work, args=(k, *given)) for k in range(WORKERS)]
    for process in processes:
        process.start()
    for process in processes:
        process.join()
        if process.exitcode:
            raise SystemExit(f"bench: a process ended with {process.exitcode}")


def decoded(k: int, out: Path, epochs: int) -> None:
    keep_freed_memory()
    files = [[(channels()[name], out / sample.files[name]) for name in PICTURES] for sample in vs.open(out)]
    for _ in range(epochs):
        for frame in files[k::WORKERS]:
            for channel, file in frame:
                decode(channel, file)


class Decoded:
    """A data set that does nothing but decode."""

    def __init__(self, out: Path) -> None:
        self.files = [[(name, out / sample.files[name]) for name in PICTURES] for sample in vs.open(out)]

    def __len__(self) -> int:
        return len(self.files)

    def __getitem__(self, i: int) -> dict[str, Any]:
        return {name: decode(channels()[name], file) for name, file in self.files[i]}


def rendered(k: int, recipe: vs.Recipe, epochs: int) -> None:
    keep_freed_memory()
    for sample in vs.render(recipe, shard=(k, WORKERS), epochs=epochs):
        batch([sample])


def batch(samples: Iterable[Sample]) -> list[Any]:
    import torch

    return [torch.from_numpy(np.stack([sample.channels[name] for sample in samples])) for name in PICTURES]


def loaded(frames: Any, epochs: int, **settings: Any) -> None:
    from torch.utils.data import DataLoader

    loader = DataLoader(frames, BATCH, num_workers=WORKERS, persistent_workers=True, **settings)
    for _ in range(epochs):
        for _ in loader:
            pass


def cost(run: Callable[[int], None], epochs: int) -> tuple[float, float]:
    """Seconds on the wall, and CPU seconds of all processes."""
    begun, before = time.monotonic(), sum(os.times()[:4])
    run(epochs)
    return time.monotonic() - begun, sum(os.times()[:4]) - before


def compare(frames: int, runs: dict[str, Callable[[int], None]]) -> None:
    """Print frames a second and CPU milliseconds a frame of each, and what of those of the first two it delivers."""
    least: dict[tuple[str, int], tuple[float, float]] = {}
    for _ in range(TURNS):
        for epochs in (1, 1 + MORE):
            for name, run in runs.items():
                found, known = cost(run, epochs), least.get((name, epochs))
                least[name, epochs] = (min(found[0], known[0]), min(found[1], known[1])) if known else found
    first, second = list(runs)[:2]
    print(f"\n| {WORKERS} workers | frames/s | CPU ms a frame | {first}, of it | {second}, of it |\n|---|---:|---:|---:|---:|")
    costs = {name: [more - once for once, more in zip(least[name, 1], least[name, 1 + MORE], strict=True)] for name in runs}
    for name, (wall, cpu) in costs.items():
        shares = " | ".join(f"{costs[base][1] / cpu:.2f}" for base in (first, second))
        print(f"| {name} | {MORE * frames / wall:.0f} | {1e3 * cpu / (MORE * frames):.2f} | {shares} |")


def training(folder: Path) -> None:
    """Measure reading and rendering for a training loop."""
    if find_spec("torch") is None:
        raise SystemExit("bench: --training: expected PyTorch, found none: pip install torch")
    recipe, out = reference_recipe(FRAMES["reading"], 4, folder), folder / "out"
    vs.generate(recipe, out)
    frames = vs.open(out).select(*PICTURES, "objects.box2d")
    compare(
        len(frames),
        {
            "decoding alone": partial(in_two, decoded, out),
            "decoding in a loader": partial(loaded, Decoded(out)),
            "`vs.open`, in order": partial(loaded, frames),
            "`vs.open`, shuffled": partial(loaded, frames, shuffle=True),
        },
    )
    small = reference_recipe(FRAMES["rendering"], 4, folder).model_copy(update={"channels": PICTURES})
    compare(
        FRAMES["rendering"],
        {
            "rendering alone": partial(in_two, rendered, small),
            "`vs.render` in a loader": lambda epochs: loaded(vs.render(small), epochs, collate_fn=batch),
        },
    )
