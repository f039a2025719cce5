"""Going on with a data set of many shots: each is looked at once before the first new frame."""

import os
from itertools import islice
from pathlib import Path

import viewsphere as vs
from counting import counted
from small import small_recipe
from viewsphere.planning.extension import whole
from viewsphere.run.missing import Missing
from viewsphere.store import Store
from viewsphere.store.index import Index
from viewsphere.store.shots.manifest import MANIFEST

ALL = {"azimuth": {"start": 0, "stop": 359, "step": 1}, "elevation": [15], "distance": 1.0}


def nearly_finished(recipe, root, missing):
    """A data set whose shots are there, as far as resuming looks at them, all but the last ones; its portion."""
    portion, store = whole(vs.plan(recipe)), Store(root)
    store.open_for(portion.record)
    for row in list(portion.rows)[:-missing]:
        store.shot_folder(row.key).mkdir(parents=True)
        (store.shot_folder(row.key) / MANIFEST).touch()
    return portion


def test_each_finished_shot_is_looked_at_once(tmp_path, monkeypatch):
    portion = nearly_finished(small_recipe(viewpoints=ALL, shot_frames=1), tmp_path, missing=3)
    rows = list(portion.rows)
    scanned, asked = counted(monkeypatch, os, "scandir"), counted(monkeypatch, Store, "has_shot")
    made = counted(monkeypatch, Index, "_row")
    work = Missing(portion, Store(tmp_path))
    assert (work.total, work.resumed) == (720, 717)
    assert list(work.lines()) == [(rows[-1].subject, 3)]
    assert not made
    assert [row.key for row in work.rows()] == [row.key for row in rows[-3:]]
    assert len(list(work.jobs(rows[-1].subject))) == 3
    assert len(scanned) <= 257
    assert len(asked) == 6
    assert len(made) <= 2 * 360
    assert not list(work.jobs(rows[0].subject))


def test_a_run_that_goes_on_looks_at_each_finished_shot_before_the_work_and_after(tmp_path, monkeypatch):
    recipe = small_recipe(viewpoints=ALL, shot_frames=1, channels=["depth"], formats=[])
    nearly_finished(recipe, tmp_path, missing=1)
    looked, opened = counted(monkeypatch, os.path, "exists"), counted(monkeypatch, Path, "open")
    summary = vs.generate(recipe, tmp_path)
    assert (summary.frames, summary.rendered) == (720, 1)
    assert sum(str(path).endswith(MANIFEST) for (path,) in looked) <= 2 * 720 + 2
    assert sum("shots" in path.parts for path, *_ in opened) < 10


def test_a_hundred_million_frames_are_neither_listed_nor_counted_out(tmp_path, monkeypatch):
    views = {"kind": "sphere", "count": 50_000_000, "distance": 3}
    planned = vs.plan(small_recipe(viewpoints=views, max_frames=10**9, shot_frames=16))
    made = counted(monkeypatch, type(planned.rows), "_row")
    portion, store = whole(planned), Store(tmp_path)
    store.open_for(portion.record)
    work = Missing(portion, store)
    assert (planned.frames, work.total, work.resumed) == (10**8, 10**8, 0)
    assert sum(count for _, count in work.lines()) == planned.shot_count == 10**8 // 16
    assert len(list(islice(work.rows(), 5))) == 5
    assert store.plan_file.stat().st_size < 10_000
    assert len(made) <= 6
