"""Going on with a data set of many shots: each is looked at once before the first new frame."""

import os
from itertools import islice

import viewsphere as vs
from counting import counted
from small import small_recipe
from viewsphere.run.generate import Missing
from viewsphere.sampling.extension import whole
from viewsphere.store import Store
from viewsphere.store.manifest import MANIFEST


def test_each_finished_shot_is_looked_at_once(tmp_path, monkeypatch):
    views = {"azimuth": {"start": 0, "stop": 359, "step": 1}, "elevation": [15], "distance": 1.0}
    portion = whole(vs.plan(small_recipe(viewpoints=views, shot_frames=1)))
    store = Store(tmp_path)
    store.open_for(portion.record)
    rows = list(portion.rows)
    for row in rows[:-3]:
        store.shot_folder(row.key).mkdir(parents=True)
        (store.shot_folder(row.key) / MANIFEST).touch()
    scanned, asked = counted(monkeypatch, os, "scandir"), counted(monkeypatch, Store, "has_shot")
    work = Missing(portion, Store(tmp_path))
    assert (work.total, work.resumed) == (720, 717)
    assert [row.key for row in work.rows()] == [row.key for row in rows[-3:]]
    assert len(list(work.jobs(rows[-1].subject))) == 3
    assert len(scanned) <= 257
    assert len(asked) == 6
    assert not list(work.jobs(rows[0].subject))


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
