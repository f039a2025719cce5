"""Exports that several processes share are what one makes, and leave nothing behind where something fails."""

import errno
import math
import os
import pickle
import re
import shutil
import signal
import time
from multiprocessing import active_children
from pathlib import Path

import pytest

from small import small_recipe, tree_hash
from viewsphere import generate
from viewsphere.errors import StoreError, UserError, ViewsphereError, WorkerDied
from viewsphere.run.exports import preparing
from viewsphere.run.exports.exporting import export
from viewsphere.run.workers.in_order import AHEAD, _answer, in_order
from viewsphere.store import Choice

FORMATS = ["coco", "native", "csv", "webdataset"]
"""The last one prepares nothing."""

VIEWS = {"azimuth": {"start": 0, "stop": 348, "step": 12}, "elevation": 20, "distance": 1.0}


@pytest.fixture(scope="module")
def rendered(tmp_path_factory):
    """Sixty frames of two models in twenty shots."""
    out = tmp_path_factory.mktemp("exports") / "out"
    channels = ["rgb", "depth", "instances"]
    recipe = small_recipe(
        viewpoints=VIEWS, camera={"size": [24, 18], "fov_deg": 35}, channels=channels, shot_frames=3, formats=[]
    )
    generate(recipe.model_copy(update={"keep_annotations_above": 0.97}), out)
    return out


@pytest.fixture
def shared(monkeypatch):
    """Small lots, shared as soon as there is somebody to share them with; gives the lots that workers were handed."""
    seen = []

    def noted(workers, make, tasks):
        assert workers > 1 or next(tasks, None) is None
        return in_order(workers, make, (seen.append(task) or task for task in tasks))

    monkeypatch.setattr(preparing, "in_order", noted)
    monkeypatch.setattr(preparing, "LOT", 4)
    monkeypatch.setattr(preparing, "PATIENCE_S", 0.0)
    monkeypatch.setattr(preparing, "WORTH_S", 0.0)
    return seen


def frames_of(lots):
    return sum(len(places) for lot in lots for _, places in lot)


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2])
def test_the_same_bytes_whoever_made_them(workers, rendered, shared, tmp_path):
    told = {}
    for count in (0, workers):
        heard = told[count] = []
        notes = export(rendered, FORMATS, output=tmp_path / str(count), workers=count, listener=heard.append)
        assert notes == ()
    assert tree_hash(tmp_path / "0") == tree_hash(tmp_path / str(workers))
    assert told[0] == told[workers]
    assert [progress.done for progress in told[0]] == list(range(61))
    assert frames_of(shared) == (0 if workers == 1 else 54)  # of sixty, but for the first lot


@pytest.mark.slow
@pytest.mark.parametrize(
    ("choice", "frames"), [(Choice(models=("post_box_001",)), 30), (Choice(frames=((1, 2), (7, 29), (40, 44))), 27)]
)
def test_a_choice_is_shared_too(choice, frames, rendered, shared, tmp_path):
    for count in (0, 2):
        export(rendered, ["coco", "native"], output=tmp_path / str(count), choice=choice, workers=count)
    assert tree_hash(tmp_path / "0") == tree_hash(tmp_path / "2")
    assert len(list((tmp_path / "2" / "coco" / "images").glob("*/*.png"))) == frames
    assert frames - 8 < frames_of(shared) < frames


@pytest.mark.slow
def test_what_a_worker_cannot_read_is_told_in_a_line_and_nothing_is_put_in_place(rendered, shared, tmp_path):
    out = shutil.copytree(rendered, tmp_path / "out")
    (records,) = (out / "store" / "shots").glob("*/post_box_001-000015/frames.json")
    records.write_text("[]")
    before = set(active_children())
    with pytest.raises(StoreError, match=r"^\S*frames.json: expected the frames of a finished shot, found .* again$"):
        export(out, ["coco", "native"], workers=2)
    assert frames_of(shared) > 0
    assert {path.name for path in out.iterdir()} == {"CREDITS.md", "store"}
    assert not list((out / "store" / "writing").iterdir())
    assert set(active_children()) == before


@pytest.mark.slow
def test_ctrl_c_leaves_no_worker_and_nothing_in_place(rendered, shared, tmp_path):
    before, seen = set(active_children()), []

    def interrupt(progress):
        if progress.done == 20:
            seen.append(len(set(active_children()) - before))
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        export(rendered, ["coco"], output=tmp_path / "exports", workers=2, listener=interrupt)
    assert seen == [2]
    assert set(active_children()) == before
    assert not list(tmp_path.iterdir())


def test_few_frames_are_made_by_this_process(rendered, monkeypatch, tmp_path):
    def nobody(workers, make, tasks):
        assert next(tasks, None) is None
        yield from ()

    monkeypatch.setattr(preparing, "PATIENCE_S", math.inf)
    monkeypatch.setattr(preparing, "in_order", nobody)
    export(rendered, ["coco"], output=tmp_path, workers=2)


def test_how_workers_link_files_is_told(rendered, monkeypatch, tmp_path):
    def copied(workers, make, tasks):
        work = make()
        for task in tasks:
            parts, kinds = work(task)
            assert "hard link" in kinds
            yield task, (parts, {"copy"})

    monkeypatch.setattr(preparing, "in_order", copied)
    monkeypatch.setattr(preparing, "PATIENCE_S", 0.0)
    monkeypatch.setattr(preparing, "WORTH_S", 0.0)
    monkeypatch.setattr(preparing, "LOT", 4)
    notes = export(rendered, ["coco"], output=tmp_path / "exports", workers=2)
    assert notes == (f"{rendered}: files of the exports are made as a copy, hard links do not work here",)


def test_long_shots_are_cut_and_short_ones_go_together(monkeypatch):
    monkeypatch.setattr(preparing, "LOT", 4)
    monkeypatch.setattr(preparing, "LONGEST", 4)
    shots = [("a", range(9)), ("b", [1]), ("c", [0, 2]), ("d", range(3)), ("e", range(1))]
    assert list(preparing._lots(iter(shots))) == [
        (("a", range(4)),),
        (("a", range(4, 8)),),
        (("a", range(8, 9)), ("b", [1]), ("c", [0, 2])),
        (("d", range(3)), ("e", range(1))),
    ]


def _make():
    return _do


def _do(task):
    """Odd numbers wait for a file; texts say how it goes wrong."""
    match task:
        case (str(file), int(number)):
            while number % 2 and not Path(file).exists():
                time.sleep(0.01)
            return number
        case "refused":
            raise UserError("it is refused")
        case "no disk":
            raise OSError(errno.ENOSPC, "No space left on device")
        case "fails":
            return 1 / 0
        case "no pickle":
            return lambda: None
        case "dies":
            os.kill(os.getpid(), signal.SIGKILL)
        case "no memory":
            raise MemoryError


@pytest.mark.slow
def test_results_come_in_order_and_a_slow_worker_holds_up_the_others(tmp_path):
    """Of two workers one waits for a file, which is made when the other is as far ahead of it as it may be."""
    asked, file = [], tmp_path / "go"

    def tasks():
        yield str(file), 1
        for number in range(2, 42, 2):
            asked.append(number)
            if len(asked) == 2 * AHEAD - 1:
                file.touch()
            yield str(file), number

    results = in_order(2, _make, tasks())
    assert next(results) == ((str(file), 1), 1)
    assert len(asked) == 2 * AHEAD - 1
    assert [made for _, made in results] == list(range(2, 42, 2))


@pytest.mark.parametrize(
    ("task", "kind", "said"),
    [
        ("refused", UserError, r"it is refused"),
        ("no disk", OSError, r".*No space left on device"),
        ("fails", ViewsphereError, r"a worker failed\nTraceback(.|\n)*ZeroDivisionError.*\n"),
        ("no pickle", ViewsphereError, r"a worker failed\nTraceback(.|\n)*pickle(.|\n)*"),
    ],
)
def test_what_goes_wrong_travels(task, kind, said):
    made, error = pickle.loads(_answer(lambda: _do(task)))
    assert made is None
    assert type(error) is kind
    assert re.fullmatch(said, str(error))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("task", "kind", "said"),
    [
        ("refused", UserError, "^it is refused$"),
        (
            "no memory",
            WorkerDied,
            "found that it died: it was refused memory: give it more memory, or ask for fewer workers$",
        ),
        pytest.param(
            "dies",
            WorkerDied,
            "found that it died: it was killed, as systems do when memory runs out: give",
            marks=pytest.mark.skipif(os.name == "nt", reason="signals"),
        ),
    ],
)
def test_what_goes_wrong_in_a_worker_is_told(task, kind, said):
    before = set(active_children())
    with pytest.raises(kind, match=said):
        list(in_order(1, _make, [task]))
    assert set(active_children()) == before


def test_nobody_is_hired_for_nothing():
    before = set(active_children())
    assert list(in_order(2, _make, [])) == []
    assert set(active_children()) == before
