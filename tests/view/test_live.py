"""What is known of a data set while it is made, mended and added to."""

import os
import shutil
from contextlib import contextmanager

import numpy as np
import pytest

from deadline import until
from small import small_recipe
from viewsphere import Dataset
from viewsphere.errors import StoreError, UserError
from viewsphere.store import Watch, located
from viewsphere.view import Live
from viewsphere.view.live import MANY


@contextmanager
def looking(root):
    live = Live(root)
    live.start()
    try:
        yield live
    finally:
        live.stop()


def read(live, frames):
    """Return whether so many frames come to have columns, and no more."""
    return until(lambda: live.state()["read"] >= frames) and live.state()["read"] == frames


@pytest.mark.slow
def test_frames_are_known_as_they_are_finished(tmp_path):
    from viewsphere import generate

    seen = []
    with looking_later(tmp_path / "out") as begin:

        def listen(progress):
            if progress.phase == "frames":
                live = begin()
                assert until(lambda: live.state()["read"] == progress.done)
                seen.append(live.state())

        generate(small_recipe(formats=[]), tmp_path / "out", listener=listen)
    assert {state["finished"] for state in seen} == {0, 2, 4, 6, 8, 10, 12}
    assert {state["planned"] for state in seen} == {12}
    assert seen[-1]["rate"] > 0
    assert seen[0]["rate"] == 0
    assert seen[0]["age"] is None


def test_what_is_left_out_is_told_while_others_are_made(tmp_path):
    from viewsphere import generate

    (tmp_path / "bad.obj").write_text("v 0 0 0\n")
    good = {"source": "zoo:post_box", "category": "post box", "scale": {"length": 0.18}}
    bad = {"source": str(tmp_path / "bad.obj"), "category": "bad"}
    seen = []
    with looking_later(tmp_path / "out") as begin:

        def listen(progress):
            if progress.phase == "frames":
                seen.append(begin().state())

        recipe = small_recipe(models=[good, bad], channels=["rgb"], formats=[])
        generate(recipe, tmp_path / "out", keep_going=True, listener=listen)
    assert {(state["planned"], state["leftOut"], state["failed"]) for state in seen} == {(6, 6, 1)}
    assert [name for name, _ in seen[0]["failures"]] == ["bad"]


@contextmanager
def looking_later(root):
    """A function that gives what is known of a folder which is no data set yet."""
    found = []

    def begin():
        if not found:
            found.append(Live(root))
            found[0].start()
        return found[0]

    try:
        yield begin
    finally:
        for live in found:
            live.stop()


def test_columns_and_list_go_together(small_run):
    samples = list(Dataset(small_run))
    with looking(small_run) as live:
        assert read(live, len(samples))
        known = live.snapshot
        assert sorted(known.frames["number"].tolist()) == [s.index for s in samples]
        for row, number in enumerate(known.frames["number"].tolist()):
            sample = samples[number]
            assert known.table.splits[known.table.frames["split"][row]] == sample.split
            own = known.table.objects[known.table.objects["frame"] == row]
            assert [known.table.models[i] for i in own["model"]] == [o.key for o in sample.objects]
            assert live.sample(number).index == number


def test_damage_is_told_and_the_rest_goes_on(small_dataset):
    store = small_dataset.store
    key = next(iter(sorted(store.finished())))
    file = store.shot_folder(key) / "frames.json"
    whole = file.read_bytes()
    file.write_bytes(whole[:40])
    (store.folder / "skipped.json").write_text('{"left": "it has no triangles: /home/somebody/left.obj"}')
    with looking(small_dataset.root) as live:
        assert read(live, 12)
        failures = live.state()["failures"]
        assert [name for name, _ in failures] == [key, "left"]
        assert "frames.json" in failures[0][1]
        assert str(small_dataset.root) not in failures[0][1]
        assert failures[1][1] == "it has no triangles: left.obj"
        known = live.snapshot
        assert known.damaged.sum() == 2
        assert len(known.sound.frames) == 10
        with pytest.raises(StoreError):
            live.sample(int(known.frames["number"][known.damaged][0]))


@pytest.mark.slow
def test_a_shot_that_is_made_again_is_read_anew(small_dataset):
    store = small_dataset.store
    key = next(iter(sorted(store.finished())))
    folder = store.shot_folder(key)
    whole = folder.with_name("whole")
    shutil.copytree(folder, whole)
    (folder / "frames.json").write_bytes(b"[")
    with looking(small_dataset.root) as live:
        assert read(live, 12)
        assert live.state()["failed"] == 1
        first = live.dataset.plan.find(key).first
        shutil.rmtree(folder)
        later = (whole / "manifest.json").stat().st_mtime + 5
        os.utime(whole / "manifest.json", (later, later))
        whole.rename(folder)
        assert until(lambda: live.state()["failed"] == 0)
        assert live.sample(first).index == first
        assert live.state()["finished"] == 12


@pytest.mark.slow
def test_what_is_appended_is_known(tmp_path):
    from viewsphere import generate

    recipe = small_recipe(formats=[], channels=["rgb"])
    generate(recipe, tmp_path / "out")
    longer = small_recipe(formats=[], channels=["rgb"], viewpoints={"azimuth": [60], "elevation": [15], "distance": 1.0})
    with looking(tmp_path / "out") as live:
        assert read(live, 12)
        generate(longer, tmp_path / "out", append=True)
        assert until(lambda: live.state()["read"] == 14)
        assert live.state()["planned"] == 14
        assert live.sample(13).index == 13


def test_records_beyond_the_data_set_are_not_read(small_dataset, tmp_path):
    """A link in a stranger's data set leads nowhere."""
    store = small_dataset.store
    key = next(iter(sorted(store.finished())))
    file = store.shot_folder(key) / "frames.json"
    shutil.move(file, tmp_path / "outside.json")
    file.symlink_to(tmp_path / "outside.json")
    with looking(small_dataset.root) as live:
        assert read(live, 12)
        assert "link" in live.failures()[key]
        with pytest.raises(StoreError, match="link"):
            live.sample(live.dataset.plan.find(key).first)


def test_frames_that_are_not_there(small_run):
    live = Live(small_run)
    for number in (-1, 12, 10**30):
        with pytest.raises(StoreError, match="expected one of 12 frames"):
            live.sample(number)


def test_no_data_set(tmp_path):
    with pytest.raises(StoreError, match="found no such folder"):
        Live(tmp_path / "nothing")


def test_nothing_is_watched_at_a_url():
    with pytest.raises(UserError, match="memory://data: expected a folder on this machine, found a URL: viewsphere report"):
        Live(located("memory://data"))


def test_a_watch_tells_of_each_shot_once(small_dataset):
    store = small_dataset.store
    watch = Watch(store)
    assert {found.key for found in watch.news()} == set(store.finished())
    assert list(watch.news()) == []
    key = next(iter(sorted(store.finished())))
    file = store.shot_folder(key) / "manifest.json"
    os.utime(file, (1, 1))
    os.utime(file.parent.parent, (2, 2))
    assert [(found.key, found.made, found.again) for found in watch.news()] == [(key, 1.0, True)]


@pytest.mark.slow
def test_other_processes_read_many(small_run, tmp_path):
    from large import large_dataset

    frames = MANY + 100
    with looking(large_dataset(small_run, tmp_path / "large", frames)) as live:
        assert read(live, frames)
        known = live.snapshot
        assert not known.damaged.any()
        assert known.frames["number"].tolist() == list(range(frames))
        assert len(known.table.objects) == frames


def test_the_rate_stays_sensible_when_the_clock_is_set():
    from viewsphere.view.live import _rate

    made = np.array([1000.0, 1002.0, 1004.0])
    assert _rate(made, 1004.0) == 0.5
    assert _rate(made, 1004.0 - 3600) == 0  # an hour back: all times are still to come
    assert _rate(np.append(made, [1004.0 - 3600, 1008.0 - 3600]), 1008.0 - 3600) == 0.25
    assert _rate(made, 1004.0 + 86_400) == 0
