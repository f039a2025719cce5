"""Writing a data set takes as much memory for many frames as for few."""

from __future__ import annotations

import gc
import pathlib
import tracemalloc
from pathlib import Path

import pytest

from small import small_recipe
from viewsphere import Dataset, generate
from viewsphere.recipe.formats import FormatEntry
from viewsphere.run.exports.exporting import write

CHANNELS = ["rgb", "depth", "instances", "normals", "parts", "semantic", "panoptic", "nocs"]
MOST_GROWTH = 400
"""Bytes a frame; its record alone has several thousand."""


@pytest.fixture(scope="module")
def datasets(tmp_path_factory):
    """Some frames, and four times as many, in shots of one size; the few have more shots than a data set keeps manifests of."""
    found = []
    for count in (30, 120):
        out = tmp_path_factory.mktemp("memory") / "out"
        views = {"azimuth": [i * 360 / count for i in range(count)], "elevation": 20, "distance": 1.0}
        generate(small_recipe(viewpoints=views, channels=CHANNELS, formats=[], camera={"size": [32, 24]}, shot_frames=5), out)
        found.append(out)
    return found


def held(root: Path, folder: Path) -> int:
    """Bytes that Python and numpy hold when all frames but the last are written; the table of interned strings, which pathlib
    fills, does not count.
    """
    dataset = Dataset(root)
    found = []

    def tell(progress):
        if progress.done == len(dataset) - 1:
            gc.collect()
            kept = tracemalloc.take_snapshot().filter_traces([tracemalloc.Filter(False, pathlib.__file__)])
            found.append(sum(trace.size for trace in kept.traces))

    formats = [(FormatEntry(name=name), folder / name) for name in ("coco", "native")]
    for _, target in formats:
        target.mkdir(parents=True)
    tracemalloc.start()
    try:
        write(dataset, formats, tell)
    finally:
        tracemalloc.stop()
    return found[0]


@pytest.mark.slow
def test_memory_does_not_grow_with_the_frames(datasets, tmp_path):
    few, many = datasets
    held(few, tmp_path / "first")  # what is imported then stays
    assert held(many, tmp_path / "many") - held(few, tmp_path / "few") < MOST_GROWTH * 180
