"""Runs in which Blender dies again and again: nothing is lost, nothing differs."""

from __future__ import annotations

import os
import random
import signal
import threading
import time
from contextlib import suppress

import pytest
from cycles_scenes import DRAFT, HAIR_DRIER, recipe_of

from viewsphere import generate, render
from viewsphere.engines.shared.blender.staging import keeper_of

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900), pytest.mark.usefixtures("blender")]

KILLS = 5
FRAMES = 24


def endured():
    """Two models from many sides."""
    return recipe_of(
        DRAFT | {"samples": 2, "replace_after": 0},
        {"size": [64, 64]},
        models=[HAIR_DRIER | {"count": 2}],
        viewpoints={"azimuth": {"start": 0, "stop": 330, "step": 30}, "elevation": [25], "distance": 0.9},
        channels=["rgb", "instances", "depth"],
    )


class Killer(threading.Thread):
    """Kills Blender at times drawn from a seed, within `interval` seconds of a picture; after each kill it waits for a picture,
    as no frame may lose two Blenders."""

    def __init__(self, keeper, seed, interval):
        super().__init__(daemon=True)
        self.pictures = self.kills = 0
        self._keeper, self._random, self._interval = keeper, random.Random(seed), interval
        self._done = threading.Event()

    def run(self):
        seen = 0
        while self.kills < KILLS and not self._done.is_set():
            process = self._keeper.process
            if self.pictures <= seen or process is None:
                time.sleep(0.005)
                continue
            time.sleep(self._random.uniform(0, self._interval))
            with suppress(ProcessLookupError):
                os.kill(process.pid, signal.SIGKILL)
                self.kills += 1
            seen = self.pictures + 1  # one more may have been finished just now

    def count(self, samples):
        """The samples as they come, counted as pictures."""
        for sample in samples:
            self.pictures += 1
            yield sample

    def stop(self):
        self._done.set()
        self.join()
        self._keeper.drop()


def test_five_killed_blenders_cost_nothing(blender):
    start = time.perf_counter()
    expected = pictures_of(render(endured()))
    assert len(expected) == FRAMES
    killer = Killer(keeper_of(blender), seed=4, interval=(time.perf_counter() - start) / FRAMES)
    killer.start()
    while killer.kills < KILLS:
        assert pictures_of(killer.count(render(endured()))) == expected
    killer.stop()


def test_a_run_whose_blender_is_killed_gives_the_same_files(blender, tmp_path, monkeypatch):
    from viewsphere.engines.shared.blender.staging import CyclesStage

    start = time.perf_counter()
    generate(endured(), tmp_path / "calm", workers=0)
    killer = Killer(keeper_of(blender), seed=9, interval=(time.perf_counter() - start) / FRAMES)
    paint = CyclesStage.paint

    def counted(self, *given):
        pictures = paint(self, *given)
        killer.pictures += 1
        return pictures

    monkeypatch.setattr(CyclesStage, "paint", counted)
    killer.start()
    generate(endured(), tmp_path / "killed", workers=0)
    killer.stop()
    assert killer.kills >= 3
    assert len(files(tmp_path / "calm")) >= 3 * FRAMES
    assert files(tmp_path / "killed") == files(tmp_path / "calm")


def pictures_of(samples):
    """What the channels of all frames hold, as bytes."""
    return [{name: channel.tobytes() for name, channel in sample.channels.items()} for sample in samples]


def files(folder):
    """What all pictures and numbers of a data set are, by place."""
    kept = (".png", ".tiff")
    return {str(f.relative_to(folder)): f.read_bytes() for f in sorted(folder.rglob("*")) if f.suffix in kept}
