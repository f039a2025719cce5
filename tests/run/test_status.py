"""`status` says how far a data set is, and who is at work on it."""

import json
import os
import socket
import time
from dataclasses import replace

import pytest

import viewsphere as vs
from command_line import viewsphere
from counting import counted
from deadline import until
from small import small_recipe
from viewsphere.errors import StoreError
from viewsphere.planning.extension import whole
from viewsphere.run.exports.exporting import export
from viewsphere.run.generate import generate
from viewsphere.run.status import status
from viewsphere.scratch import LOCK
from viewsphere.store import Store
from viewsphere.store.index import Index
from viewsphere.store.shots.folder import RUN
from viewsphere.store.shots.heartbeat import SILENT_S, Heartbeat, HeartbeatWriter

SPHERE = {"kind": "sphere", "count": 50_000_000, "distance": 3}


@pytest.fixture
def half(tmp_path):
    """A data set of which half is rendered."""
    generate(small_recipe(), tmp_path / "out", shard=(0, 2))
    return tmp_path / "out"


def leave(store, told):
    """What a run has left of its heartbeat, without a lock that is held."""
    file = store.folder / "writing" / f"{told.host}~{told.pid}~x" / RUN
    file.parent.mkdir()
    file.write_text(told.to_json())
    file.with_name(LOCK).touch()


@pytest.mark.parametrize("jump", [-3600, 86_400])
def test_a_clock_that_jumps_changes_no_rate(jump, monkeypatch):
    ticks, now = [0.0], [1e9]
    monkeypatch.setattr("viewsphere.store.shots.heartbeat.time.monotonic", lambda: ticks[0])
    monkeypatch.setattr("viewsphere.store.shots.heartbeat.time.time", lambda: now[0])
    pulse = HeartbeatWriter(lambda text: None)
    pulse.enters("frames")
    pulse.now = replace(pulse.now, done=40, total=100)
    ticks[0], now[0] = 20.0, 1e9 + 20 + jump
    told = json.loads(pulse.note())
    assert told["beat"] == now[0]
    assert told["beat"] - told["begun"] == 20
    assert replace(pulse.now, begun=told["begun"], beat=told["beat"]).rate == 2


def test_a_finished_data_set(small_run):
    found = vs.status(small_run)
    assert (found.frames, found.finished, found.missing, found.left_out, found.models) == (12, 12, 0, 0, ())
    assert found.complete and found.runs == () and found.failed == () and found.seconds_left is None
    answer = viewsphere("status", small_run)
    assert answer.returncode == 0
    assert "12 frames: 12 finished, 0 under way, 0 left out, 0 missing (100.0% done)" in answer.stdout


def test_a_half_finished_data_set(half):
    found = status(half)
    assert (found.frames, found.finished, found.missing, found.complete) == (12, 6, 6, False)
    answer = viewsphere("status", half, "--json")
    assert answer.returncode == 3
    told = json.loads(answer.stdout)
    assert (told["missing"], told["complete"], told["runs"]) == (6, False, [])


def test_no_data_set(tmp_path):
    with pytest.raises(StoreError, match="no such folder"):
        status(tmp_path / "none")
    assert viewsphere("status", tmp_path / "none").returncode == 2


def test_only_the_index_and_names_are_read(half):
    for file in (half / "store" / "shots").rglob("*.json"):
        file.write_text("")
    assert status(half).finished == 6


def test_a_run_is_seen_at_work(tmp_path):
    seen = []

    def look(progress):
        if progress.phase == "frames":
            time.sleep(0.01)
            seen.append(Store(tmp_path / "out").heartbeats())

    generate(small_recipe(), tmp_path / "out", shard=(1, 2), listener=look)
    (((told, is_alive),),) = {one for one in seen}
    assert is_alive and (told.host, told.pid, told.shard) == (socket.gethostname(), os.getpid(), (1, 2))
    assert status(tmp_path / "out").runs == ()


def test_the_pulse_tells_what_is_under_way():
    written = []
    with HeartbeatWriter(written.append, (1, 2)) as pulse:
        pulse.enters("frames")
        pulse.now = replace(pulse.now, done=6, total=40, resumed=4, under_way=3)
        pulse.working_on["m-000000"] = None
        told = json.loads(pulse.note())
    assert len(written) == 1  # the first at once
    assert (told["phase"], told["done"], told["under_way"], told["working_on"]) == ("frames", 6, 3, ["m-000000"])


def test_the_pulse_goes_on_by_itself(tmp_path, monkeypatch):
    monkeypatch.setattr("viewsphere.store.shots.heartbeat.BEAT_S", 0.02)
    written = []
    with HeartbeatWriter(written.append):
        assert until(lambda: len(written) > 3)
    beats = [json.loads(text)["beat"] for text in written]
    assert beats == sorted(beats) and beats[0] < beats[-1]
    ended = len(written)
    time.sleep(0.1)
    assert len(written) == ended


def test_runs_that_work_died_or_fell_silent(half):
    now, store = time.time(), Store(half)
    here = Heartbeat(socket.gethostname(), 7, (0, 3), "frames", 2, 4, 0, 1, now - 30, now, ("box-000000",))
    leave(store, here)
    leave(store, replace(here, host="far"))
    leave(store, replace(here, host="far", pid=8, beat=now - SILENT_S - 1))
    with store.occupied() as own:
        long_ago = replace(here, pid=9, begun=now - SILENT_S - 31, beat=now - SILENT_S - 1)
        (own / RUN).write_text(long_ago.to_json())
        found, said = status(half), viewsphere("status", half).stdout
    assert {(r.told.host, r.told.pid): r.state for r in found.runs} == {
        (here.host, 7): "dead",
        (here.host, 9): "running",  # it holds its lock
        ("far", 7): "running",
        ("far", 8): "silent",
    }
    assert found.under_way == 2 and found.rate == pytest.approx(2 * 3 / 30)
    assert found.seconds_left == pytest.approx((6 - 2) / found.rate)
    assert "silent: far (pid 8), shard 0/3: frames 3 of 4" in said and "box-000000" in said and "about 20 s left" in said


def test_what_failed_is_told(half):
    store = Store(half)
    with pytest.raises(ZeroDivisionError), store.occupied() as own, store.telling(own, (1, 2)):
        raise ZeroDivisionError("models/a.obj: expected faces, found none")
    (told,) = status(half).failed
    assert (told.pid, told.shard, told.error) == (os.getpid(), (1, 2), "models/a.obj: expected faces, found none")
    assert f"failed: {socket.gethostname()} (pid {os.getpid()}), shard 1/2: {told.error}" in viewsphere("status", half).stdout
    assert not any((store.folder / "writing").iterdir())
    assert generate(small_recipe(), half, shard=(1, 2)).missing == 0
    assert status(half).failed == () and not (store.folder / "failed").exists()


def test_what_cannot_be_read_is_left_out(half):
    writing = half / "store" / "writing"
    for i, text in enumerate(("", "null", "{", '{"shard": 3}')):
        (writing / f"far~{i}~x").mkdir()
        (writing / f"far~{i}~x" / RUN).write_text(text)
    assert status(half).runs == ()


def test_an_endless_plan_takes_no_time(tmp_path, monkeypatch):
    portion = whole(vs.plan(small_recipe(viewpoints=SPHERE, max_frames=10**9, shot_frames=16)))
    store = Store(tmp_path)
    store.open_for(portion.record)
    made = counted(monkeypatch, Index, "_row")
    found = status(tmp_path)
    assert (found.frames, found.finished, found.missing, found.left_out) == (10**8, 0, 10**8, 0)
    assert len(made) <= 3


def test_what_was_left_out_is_not_missing(tmp_path):
    (tmp_path / "models").mkdir()
    good = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    for name, text in {"a": "no model\n", "b": good}.items():
        (tmp_path / "models" / f"{name}.obj").write_text(text)
    recipe = small_recipe(
        models=[{"source": str(tmp_path / "models"), "category": "thing"}],
        viewpoints={"azimuth": [0, 90], "elevation": [15], "distance": 4.0},
    )
    generate(recipe, tmp_path / "out", keep_going=True)
    found = status(tmp_path / "out")
    assert (found.frames, found.finished, found.left_out, found.complete) == (4, 2, 2, True)


def test_an_export_of_what_is_there_says_how_much_it_is(half):
    (note,) = export(half, ["coco"])
    assert "6 of 12 frames are there to export" in note
    answer = viewsphere("export", half, "-f", "csv")
    assert "6 of 12 frames are there to export" in answer.stdout
    told = json.loads(viewsphere("export", half, "-f", "csv", "--json").stdout)
    assert (told["frames"], told["of"]) == (6, 12)
    generate(small_recipe(), half, shard=(1, 2))
    assert "# frames 12" in (half / "csv" / "checksums.xxh128").read_text()
