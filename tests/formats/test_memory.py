"""Writing and proving a data set takes as much memory for many frames as for few."""

from __future__ import annotations

import tracemalloc

import pytest

from small import small_recipe
from viewsphere import Dataset, generate, plugins
from viewsphere.run.exporting import write

FORMATS = ("coco", "native")
MOST_GROWTH = 400
"""Bytes a frame; its record alone has several thousand."""


def peak(work) -> int:
    """Most bytes that Python and numpy hold at once."""
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.fixture(scope="module")
def datasets(tmp_path_factory):
    """Some frames, and five times as many, in shots of one size."""
    found = []
    for count in (60, 300):
        out = tmp_path_factory.mktemp("memory") / "out"
        views = {"azimuth": [i * 360 / count for i in range(count)], "elevation": 20, "distance": 1.0}
        generate(small_recipe(viewpoints=views, formats=[], camera={"size": [32, 24]}, shot_frames=20), out)
        found.append(Dataset(out))
    return found


@pytest.mark.slow
def test_memory_does_not_grow_with_the_frames(datasets):
    written, proved = [], []
    for dataset in datasets:
        folders = {name: dataset.root / name for name in FORMATS}
        for folder in folders.values():
            folder.mkdir()
        written.append(peak(lambda dataset=dataset, folders=folders: write(dataset, folders)))
        proved.append(peak(lambda dataset=dataset: [verified(dataset, name) for name in FORMATS]))
    frames = len(datasets[1]) - len(datasets[0])
    assert frames >= 400
    for few, many in (written, proved):
        print(few, many, (many - few) / frames)
        assert many - few < MOST_GROWTH * frames


def verified(dataset, name):
    assert list(plugins.load("formats", name).verify(dataset, dataset.root / name, range(10))) == []
