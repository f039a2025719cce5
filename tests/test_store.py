"""The store: nothing half written is ever seen, and what is broken is said."""

import errno
import json
import os
import pickle
import re
import stat
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from viewsphere.errors import StoreError
from viewsphere.labels import channels
from viewsphere.model.annotations.tracks import TRACK
from viewsphere.run.exports.exporting import export
from viewsphere.scratch import of_this_process, scratch_folder
from viewsphere.store import Block, Category, Dataset, Part, PlanRecord, Store, decode, encode, new_folder
from viewsphere.store.places import local
from viewsphere.store.shots.moving import DURABILITIES, DURABILITY, move, write_through

PART = Part(
    digest="d", version="1", name="n", recipe={"a": 1.5}, channels=("rgb",), first=0, frames=1, max_objects=1,
    blocks=(Block(("m",), ((0, 1),)),), new_poses=1, dealt_splits={"m": "train"},
)  # fmt: skip


def plan_record(**changes):
    record = PlanRecord(
        version="1", digest="d", name="n", recipe={"a": 1.5}, categories=(Category(1, "car", "vehicle"),), splits=("train",),
        channels=("rgb",), models=("m",), poses=1, frames=1, max_objects=1, parts=(PART,),
    )  # fmt: skip
    return replace(record, **changes)


def test_plan_record_round_trip():
    assert PlanRecord.from_json(plan_record().to_json()) == plan_record()


def test_a_store_of_the_old_layout_is_one_line(tmp_path):
    store = Store(tmp_path / "out")
    store.open_for(plan_record())
    value = json.loads(store.plan_file.read_text())
    store.plan_file.write_text(json.dumps(value | {"store": 1}))
    with pytest.raises(
        StoreError, match=r"out: another viewsphere made this data set \(store version 1; this one reads 3\)\. Render its"
    ) as caught:
        store.plan()
    assert "\n" not in str(caught.value)
    store.plan_file.write_text(plan_record().to_json().replace('"frames":1', '"frames":2', 1))
    with pytest.raises(StoreError, match="changed since it was written"):
        store.plan()
    store.plan_file.write_text(json.dumps(value | {"store": 1}))
    with pytest.raises(StoreError, match="version 1"):
        Dataset(tmp_path / "out")


@pytest.mark.parametrize("name", [n for n in channels() if channels()[n].components])
def test_channel_files_round_trip(name, tmp_path):
    channel, rng = channels()[name], np.random.default_rng(1)
    array = rng.integers(0, 200, channel.shape(7, 11)).astype(channel.dtype)
    if channel.encoding == "tiff" and np.issubdtype(channel.dtype, np.floating):
        array = (array / 7).astype(channel.dtype)
        array.flat[::3] = channel.empty
    (tmp_path / "x").write_bytes(encode(channel, array))
    back = decode(channel, tmp_path / "x")
    assert back.dtype == array.dtype
    assert np.array_equal(back, array, equal_nan=channel.dtype is np.float32)


def test_files_of_rows_round_trip(tmp_path):
    rng = np.random.default_rng(1)
    for count in (0, 1, 500):
        rows = np.frombuffer(rng.bytes(count * TRACK.itemsize), TRACK)
        (tmp_path / "x").write_bytes(encode(channels()["tracks"], rows))
        assert decode(channels()["tracks"], tmp_path / "x").tobytes() == rows.tobytes()


def test_wrong_arrays_are_refused():
    with pytest.raises(ValueError, match="depth"):
        encode(channels()["depth"], np.zeros((2, 2), np.float64))
    with pytest.raises(StoreError, match="65535"):
        encode(channels()["instances"], np.full((2, 2), 70_000, np.int32))


def test_an_interrupted_write_leaves_nothing(tmp_path):
    store = Store(tmp_path / "out")
    store.open_for(plan_record())
    with pytest.raises(RuntimeError), store.scratch_folder(store.shot_folder("m-000000")) as folder:
        (folder / "half").write_text("x")
        raise RuntimeError
    assert not store.has_shot("m-000000")
    assert list((store.folder / "writing").iterdir()) == []


def test_two_writers_of_one_shot(tmp_path):
    store = Store(tmp_path / "out")
    store.open_for(plan_record())
    for _ in range(2):
        with store.scratch_folder(store.shot_folder("m-000000")) as folder:
            (folder / "frames.json").write_text("[]")
    assert store.has_shot("m-000000")
    assert list((store.folder / "writing").iterdir()) == []


def test_leftovers_of_the_dead_are_swept_and_those_of_the_living_stay(tmp_path):
    store = Store(tmp_path / "out")
    store.open_for(plan_record())
    writing = store.folder / "writing"
    (writing / f"{of_this_process()}of a killed process of this number").mkdir()
    (writing / "otherhost~1~x").mkdir()
    with scratch_folder(writing) as alive:
        with store.occupied():
            (writing / f"{of_this_process()}of a worker that was killed meanwhile").mkdir()
        assert {p.name for p in writing.iterdir()} == {alive.name, "otherhost~1~x"}


@pytest.mark.slow
def test_runs_that_replace_one_folder_at_once_do_not_hinder_one_another(tmp_path):
    store = Store(tmp_path / "out")
    store.open_for(plan_record())

    def replace_it(number):
        for _ in range(100):
            with store.replacing(store.root / "coco") as folder:
                (folder / "made by").write_text(f"{number}")

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(replace_it, range(4)))
    assert (store.root / "coco" / "made by").read_text() in "0123"
    assert not list((store.folder / "writing").iterdir())


def test_what_was_being_replaced_comes_back(tmp_path):
    """A run that died between putting the old folder aside and the new one in its place."""
    store = Store(tmp_path / "out")
    store.open_for(plan_record())
    (store.root / "elsewhere" / "a").mkdir(parents=True)
    left = store.folder / "writing" / f"{of_this_process()}x"
    for old in ("coco", "store/models/m", "store/shots/ab/m-000000", "native"):
        (left / "old" / old).mkdir(parents=True)
        (left / "old" / old / "file").write_text("old")
    (left / "old" / "csv").symlink_to(store.root / "elsewhere")
    (store.root / "native").mkdir()
    store.make_ready()
    for back in ("coco", "store/models/m", "store/shots/ab/m-000000"):
        assert (store.root / back / "file").read_text() == "old"
    assert not any((store.root / "native").iterdir())
    assert not (store.root / "csv").exists()
    assert (store.root / "elsewhere" / "a").is_dir()
    assert not left.exists()


class Failing:
    """`move` that fails at some of its calls: before it moves, or after."""

    def __init__(self, errors, is_late=False):
        self.errors, self.is_late, self.calls = errors, is_late, 0

    def __call__(self, source, target):
        self.calls += 1
        error = self.errors.get(self.calls)
        if error is None or self.is_late:
            move(source, target)
        if error is not None:
            raise error


def replace_again(store):
    with store.replacing(store.root / "coco") as folder:
        (folder / "file").write_text("new")


@pytest.fixture(params=DURABILITIES)
def exported(tmp_path, request, monkeypatch):
    """A store with an export, whose run is asked for this durability."""
    monkeypatch.setenv(DURABILITY, request.param)
    store = Store(tmp_path / "out")
    store.open_for(plan_record())
    (store.root / "coco").mkdir()
    (store.root / "coco" / "file").write_text("old")
    return store


@pytest.mark.parametrize("error", [KeyboardInterrupt(), OSError(errno.EIO, "I/O error")], ids=["Ctrl-C", "EIO"])
@pytest.mark.parametrize(
    ("call", "is_late", "left"), [(1, False, "old"), (1, True, "old"), (2, False, "old"), (2, True, "new")]
)
def test_what_fails_while_it_replaces_loses_nothing(call, is_late, left, error, exported, monkeypatch):
    monkeypatch.setattr(local, "move", Failing({call: error}, is_late))
    with pytest.raises((KeyboardInterrupt, StoreError)):
        replace_again(exported)
    assert (exported.root / "coco" / "file").read_text() == left
    assert not list((exported.folder / "writing").iterdir())


@pytest.mark.parametrize("second", [KeyboardInterrupt(), OSError(errno.EIO, "I/O error")], ids=["Ctrl-C", "EIO"])
def test_what_cannot_be_put_back_at_once_is_put_back_by_the_next_run(second, exported, monkeypatch):
    with monkeypatch.context() as patched, pytest.raises(KeyboardInterrupt):
        patched.setattr(local, "move", Failing({2: KeyboardInterrupt(), 3: second}))
        replace_again(exported)
    assert not (exported.root / "coco").exists()
    exported.make_ready()
    assert (exported.root / "coco" / "file").read_text() == "old"
    assert not list((exported.folder / "writing").iterdir())


def test_a_disk_that_fills_up_fails_before_the_old_leaves(exported, monkeypatch):
    def full(path):
        assert (exported.root / "coco" / "file").read_text() == "old"
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(local, "write_through", full)
    with pytest.raises(StoreError, match="No space left"):
        replace_again(exported)
    assert (exported.root / "coco" / "file").read_text() == "old"


@pytest.mark.skipif(os.name != "posix", reason="writes folders to the disk")
@pytest.mark.parametrize("number", [errno.EINVAL, errno.ENOTSUP, errno.EIO])
def test_folders_whose_file_system_does_not_write_them_to_the_disk_are_left_to_it(number, tmp_path, monkeypatch):
    def sync(descriptor):
        if stat.S_ISDIR(os.fstat(descriptor).st_mode):
            raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "fsync", sync)
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv(DURABILITY, "fsync")
    (tmp_path / "a").mkdir()
    with pytest.raises(OSError, match=os.strerror(number)) if number == errno.EIO else nullcontext():
        move(tmp_path / "a", tmp_path / "b")
        assert (tmp_path / "b").is_dir()


def test_where_the_disk_s_own_memory_cannot_be_emptied_the_system_s_is(tmp_path, monkeypatch):
    """On macOS, with a disk of the network."""

    def refuse(*_):
        raise OSError(errno.ENOTSUP, "refused")

    synced = []
    monkeypatch.setitem(sys.modules, "fcntl", SimpleNamespace(fcntl=refuse, F_FULLFSYNC=51))
    monkeypatch.setattr(sys, "platform", "darwin")
    monkeypatch.setattr(os, "fsync", synced.append)
    monkeypatch.setenv(DURABILITY, "fsync")
    (tmp_path / "a").write_text("a")
    write_through(tmp_path / "a")
    assert len(synced) == 1


def test_what_was_half_removed_does_not_come_back(tmp_path):
    store = Store(tmp_path / "out")
    store.open_for(plan_record())
    left = store.folder / "writing" / f"{of_this_process()}x~"
    (left / "old" / "coco").mkdir(parents=True)
    store.make_ready()
    assert not (store.root / "coco").exists()
    assert not left.exists()


def test_an_export_puts_back_and_clears_what_a_killed_one_left(small_dataset):
    root = small_dataset.root
    left = root / "store" / "writing" / f"{of_this_process()}x"
    (left / "new").mkdir(parents=True)
    (left / "old").mkdir()
    (root / "native").rename(left / "old" / "native")
    export(root, ["coco"])
    assert (root / "native").is_dir()
    assert not list((root / "store" / "writing").iterdir())


@pytest.mark.parametrize("changes", [{"digest": "other"}, {"version": "2"}])
def test_data_of_another_plan_are_refused(tmp_path, changes):
    store = Store(tmp_path / "out")
    store.open_for(plan_record())
    store.shot_folder("m-000000").mkdir(parents=True)
    with pytest.raises(StoreError, match="another output folder"):
        store.open_for(plan_record(**changes))


def test_a_plan_without_frames_gives_way_to_the_mended_one(tmp_path):
    store = Store(tmp_path / "out")
    store.open_for(plan_record())
    store.model_folder("m").mkdir(parents=True)
    store.open_for(plan_record(digest="other"))
    assert store.plan().digest == "other"
    assert not store.model_folder("m").exists()


def test_a_plan_that_a_run_works_on_stays(tmp_path):
    store = Store(tmp_path / "out")
    store.open_for(plan_record())
    with store.occupied(), pytest.raises(StoreError, match="another output folder"):
        store.open_for(plan_record(digest="other"))
    assert not any((store.folder / "writing").iterdir())


def test_a_folder_named_store_is_no_store(tmp_path):
    (tmp_path / "store").mkdir()
    (tmp_path / "native").mkdir()
    with pytest.raises(StoreError, match="other files"):
        Store(tmp_path).open_for(plan_record())


@pytest.mark.parametrize("text", ["[{}]", "[", "{}", "[1, 2]", "[]"])
def test_damaged_frames_are_named_with_a_way_out(small_dataset, text):
    file = next(small_dataset.store.folder.rglob("frames.json"))
    file.unlink()  # the files of this fixture may be hard links
    file.write_text(text)
    with pytest.raises(StoreError, match=f"{re.escape(str(file))}.*delete .* and render again"):
        list(small_dataset)


def test_a_damaged_picture_is_named_with_a_way_out(small_dataset):
    file = next(small_dataset.store.folder.rglob("instances/*.png"))
    data = file.read_bytes()
    file.unlink()
    file.write_bytes(data[:-20])
    with pytest.raises(StoreError, match=f"{re.escape(str(file))}.*mend it with viewsphere check --repair"):
        [s.instances for s in small_dataset]


def test_a_damaged_model_record_is_named_with_a_way_out(small_dataset):
    file = next(small_dataset.store.folder.rglob("model.json"))
    file.unlink()
    file.write_text("{}")
    with pytest.raises(StoreError, match=f"{re.escape(str(file))}.*delete .* and render again"):
        _ = small_dataset.models


@pytest.mark.parametrize("text", ["", "{}", "[]", '{"store": 99}', json.dumps({"store": 1})])
def test_a_broken_plan_is_said(tmp_path, text):
    (tmp_path / "store").mkdir()
    (tmp_path / "store" / "plan.json").write_text(text)
    with pytest.raises(StoreError, match="plan"):
        Dataset(tmp_path)


def test_a_full_disk_is_one_line_and_loses_nothing(tmp_path):
    store = Store(tmp_path / "out")
    store.open_for(plan_record())
    with pytest.raises(StoreError, match="No space left"), store.scratch_folder(store.shot_folder("m-000000")):
        raise OSError(28, "No space left on device")
    assert not store.has_shot("m-000000")


def test_link_is_a_hard_link_where_it_can_be(small_dataset):
    file = small_dataset[0].files["rgb"]
    small_dataset.link(file, small_dataset.root / "x" / "a.png")
    assert (small_dataset.root / "x" / "a.png").samefile(small_dataset.path(file))
    assert small_dataset.link_kinds == {"hard link"}


def test_link_models_puts_all_but_the_record_in_a_folder_a_model(small_dataset):
    small_dataset.link_models(small_dataset.root / "x")
    stored, linked = (
        {f.relative_to(folder).as_posix(): f for f in folder.rglob("*") if f.is_file()}
        for folder in (small_dataset.root / "store" / "models", small_dataset.root / "x")
    )
    assert linked.keys() == {name for name in stored if not name.endswith(("/model.json", "/manifest.json"))}
    assert all(file.samefile(stored[name]) for name, file in linked.items())
    assert {f"{i.key}/{i.key}.{s}" for i in small_dataset.models for s in ("obj", "glb")} <= linked.keys()


def test_link_copies_where_links_fail(small_dataset, monkeypatch):
    def refuse(*_: object) -> None:
        raise OSError

    monkeypatch.setattr(os, "link", refuse)
    file = small_dataset[0].files["rgb"]
    small_dataset.link(file, small_dataset.root / "x" / "a.png")
    assert (small_dataset.root / "x" / "a.png").read_bytes() == small_dataset.path(file).read_bytes()
    assert small_dataset.link_kinds <= {"reflink", "copy"}


def test_a_data_set_and_its_samples_travel_to_other_processes(small_run):
    dataset = Dataset(small_run)
    dataset[3]
    copy, sample = pickle.loads(pickle.dumps((dataset, dataset[3])))
    assert len(copy) == len(dataset)
    assert np.array_equal(copy[3].depth, sample.depth)
    assert np.array_equal(sample.depth, dataset[3].depth)
    assert sample.objects[0].box2d == dataset[3].objects[0].box2d


def test_a_new_folder_that_comes_to_nothing_leaves_nothing(tmp_path):
    def made(place, fails):
        with new_folder(place) as folder:
            (folder / "file").touch()
            if fails:
                raise ValueError

    made(tmp_path / "a" / "b", fails=False)
    for place in ("a/c", "d/e/f"):
        with pytest.raises(ValueError):
            made(tmp_path / place, fails=True)
    assert sorted(str(p.relative_to(tmp_path)) for p in tmp_path.rglob("*")) == ["a", "a/b", "a/b/file"]
