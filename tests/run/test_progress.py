"""A run says how far it is frame by frame, and counts none twice."""

import os
import signal
from itertools import pairwise
from multiprocessing import active_children

import pytest

from small import small_recipe, tree_hash
from viewsphere import generate
from viewsphere.cli.terminal import ProgressBar, _rate
from viewsphere.run.progress import Progress

WHOLE = {"shot_frames": 6, "channels": ["rgb", "instances"], "formats": []}
"""Two shots of six frames."""


def frames_told(seen):
    return [(p.done, p.under_way) for p in seen if p.phase == "frames"]


@pytest.mark.parametrize("workers", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_every_frame_is_told_before_its_shot_is_finished(tmp_path, workers):
    seen: list[Progress] = []
    generate(small_recipe(**WHOLE), tmp_path / "out", workers=workers, listener=seen.append)
    expected = [(0, k) for k in range(7)] + [(6, k) for k in range(7)] + [(12, 0)]
    assert frames_told(seen) == expected


@pytest.mark.slow
def test_frames_of_several_workers_add_up(tmp_path):
    seen: list[Progress] = []
    generate(small_recipe(**WHOLE), tmp_path / "out", workers=2, listener=seen.append)
    told = [done + under_way for done, under_way in frames_told(seen)]
    assert (told[0], told[-1]) == (0, 12)
    assert all(after - before in (0, 1) for before, after in pairwise(told))


@pytest.mark.slow
def test_frames_of_a_worker_that_dies_are_not_counted_twice(tmp_path):
    large = {**WHOLE, "camera": {"size": [800, 600], "fov_deg": 35}}  # which leaves time to kill it within its shot
    others, seen = set(active_children()), list[Progress]()

    def listen(progress):
        if progress.under_way == 2 and not any(p.under_way == 2 for p in seen):
            (worker,) = set(active_children()) - others
            os.kill(worker.pid, signal.SIGKILL)
            worker.join()
        seen.append(progress)

    summary = generate(small_recipe(**large), tmp_path / "killed", workers=1, listener=listen)
    told = [done + under_way for done, under_way in frames_told(seen)]
    assert told.count(1) == told.count(2) == 2  # they were made twice
    assert max(told) == told[-1] == summary.rendered == summary.frames == 12
    generate(small_recipe(**large), tmp_path / "whole")
    assert tree_hash(tmp_path / "killed") == tree_hash(tmp_path / "whole")  # nothing that it began is left


def test_the_bar_moves_within_a_shot():
    with ProgressBar(quiet=False) as bar:
        bar.show(Progress("frames", 100, 400, 40))
        bar.show(Progress("frames", 100, 400, 40, 30))
        (task,) = bar._rich.tasks
        assert (task.completed, task.total) == (130, 400)


def test_the_bar_tells_the_machines_of_a_cluster():
    with ProgressBar(quiet=False) as bar:
        bar.show(Progress("frames", 0, 400, nodes=1))
        assert bar._rich.tasks[0].fields["rate"] == "1 node"
        bar.show(Progress("frames", 100, 400, nodes=2))
        assert bar._rich.tasks[0].fields["rate"].endswith(" frames/s, 2 nodes")


def test_slow_frames_are_not_told_as_none():
    assert (_rate(30, 10), _rate(2, 90)) == ("3.0 frames/s", "0.022 frames/s")
