"""CPU milliseconds and kilobytes of every way to write a channel, on a rendered frame: the table of docs/performance.md.

    .venv/bin/python benchmarks/bench_files.py

The second column of pictures is of the frames with added noise (standard deviation 6 of 255). Best of twenty, three views, 640
x 480.
"""

from __future__ import annotations

import io
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from PIL import Image

from viewsphere import plan
from viewsphere.errors import MissingExtraError
from viewsphere.labels import channels
from viewsphere.model.fields.files import Files
from viewsphere.recipe.recipe import Recipe
from viewsphere.run.shots.stages import Stages
from viewsphere.run.workers.allocator import keep_freed_memory
from viewsphere.store import encode

ROUNDS = 20
NOISE = 6
PICTURES = (
    ("PNG (ours, default)", Files()),
    ("JPEG, quality 95 (Pillow)", Files(rgb="jpeg")),
    ("JPEG, quality 85 (Pillow)", Files(rgb="jpeg", quality=85)),
    ("QOI (imagecodecs)", Files(rgb="qoi")),
    ("JPEG XL, lossless (imagecodecs)", Files(rgb="jxl")),
    ("JPEG XL, quality 90 (imagecodecs)", Files(rgb="jxl", quality=90)),
    ("WebP, lossless (Pillow)", Files(rgb="webp")),
    ("WebP, quality 90 (Pillow)", Files(rgb="webp", quality=90)),
)
NUMBERS = (("tiff", "TIFF (ours, default)"), ("npz", "NPZ (ours)"), ("exr", "EXR (ours)"))


def frames() -> list[dict[str, Any]]:
    """Channels of a car on the ground, from three sides."""
    recipe = Recipe(
        models=[{"source": "zoo:car", "count": 1}],
        viewpoints={"azimuth": 30, "elevation": [5, 25, 50], "distance": 5.5},
        channels=["rgb", "depth", "instances", "normals"],
    )
    stages = Stages()
    return [dict(s.channels) for shot in plan(recipe).shots(stages.box) for s in stages.render(shot)]


def cost(work: Callable[[Any], bytes], arrays: Sequence[Any]) -> str:
    """Mean milliseconds and kilobytes as cells of a table."""
    seconds = size = 0.0
    for array in arrays:
        work(array)
        times = []
        for _ in range(ROUNDS):
            begun = time.process_time()
            data = work(array)
            times.append(time.process_time() - begun)
        seconds, size = seconds + min(times), size + len(data)
    return f" {1e3 * seconds / len(arrays):.2f} ms, {size / len(arrays) / 1e3:.0f} kB |"


def by_pillow(array: Any, **options: Any) -> bytes:
    file = io.BytesIO()
    Image.fromarray(array).save(file, "PNG", **options)
    return file.getvalue()


def by_numpy(array: Any) -> bytes:
    file = io.BytesIO()
    np.savez_compressed(file, array=array)
    return file.getvalue()


def main() -> None:
    keep_freed_memory()  # workers set the same
    made, rng = frames(), np.random.default_rng(0)
    plain = [frame["rgb"] for frame in made]
    noisy = [np.clip(a + rng.normal(0, NOISE, a.shape), 0, 255).astype(np.uint8) for a in plain]

    def row(name: str, channel: str, files: Files, *arrays: Sequence[Any]) -> None:
        try:
            print(f"| {name} |", *(cost(lambda a: encode(channels()[channel], a, files), each) for each in arrays), sep="")
        except MissingExtraError as error:
            print(f"| {name} | {error}")

    print("| picture | rendered | with noise |\n|---|---|---|")
    for name, files in PICTURES:
        row(name, "rgb", files, plain, noisy)
    for level in (1, 6):
        cells = (cost(lambda a: by_pillow(a, compress_level=level), each) for each in (plain, noisy))  # noqa: B023, used at once
        print(f"| PNG, level {level} (Pillow) |", *cells, sep="")
    print("\n| numbers | depth | normals |\n|---|---|---|")
    depth, normals, ids = ([frame[name] for frame in made] for name in ("depth", "normals", "instances"))
    for kind, name in NUMBERS:
        cells = (("depth", Files(depth=kind), depth), ("normals", Files(geometry=kind), normals))
        print(f"| {name} |", *(cost(lambda a: encode(channels()[c], a, f), each) for c, f, each in cells), sep="")  # noqa: B023
    print("| NPZ (`np.savez_compressed`) |", cost(by_numpy, depth), cost(by_numpy, normals), sep="")
    row("16-bit PNG, 1 mm (ours)", "depth", Files(depth="png16"), depth)
    print("\n| masks | instances |\n|---|---|")
    row("16-bit PNG (ours, default)", "instances", Files(), ids)
    row("indexed PNG (ours)", "instances", Files(masks="png8"), ids)


if __name__ == "__main__":
    main()
