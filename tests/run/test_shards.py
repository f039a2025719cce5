"""Shards of a job array, in any order, several at once, killed and run again, make what one run makes."""

import errno
import random
import shutil
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import islice

import pytest
from filelock import FileLock
from hypothesis import given
from hypothesis import strategies as st

from command_line import viewsphere
from counting import counted
from deadline import DEADLINE, until
from small import small_recipe, tree_hash
from viewsphere.check import check
from viewsphere.errors import ModelError, StoreError, UserError
from viewsphere.model.shard import Shard
from viewsphere.planning.extension import whole
from viewsphere.run.generate import generate
from viewsphere.run.missing import Missing
from viewsphere.run.opening import prepare, to_render
from viewsphere.run.shards import shard_named
from viewsphere.run.status import status
from viewsphere.store import Dataset, Store
from viewsphere.store.index import Block, Index
from viewsphere.store.places import local

OWN = {"start_new_session": True, "stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}


def command(recipe, out, shard, workers=1):
    words = ["render", recipe, "-o", out, "--shard", shard, "--workers", workers]
    return [sys.executable, "-m", "viewsphere", *map(str, words)]


@pytest.fixture
def recipe_file(tmp_path):
    file = tmp_path / "recipe.yaml"
    file.write_text(small_recipe().to_yaml())
    return file


@pytest.mark.slow
def test_shards_in_any_order_make_what_one_run_makes(small_run, tmp_path):
    out = tmp_path / "out"
    left = [generate(small_recipe(), out, shard=(k, 3)) for k in (2, 0, 1)]
    assert [s.rendered for s in left] == [4, 4, 4]
    assert [s.missing for s in left] == [8, 4, 0]
    assert [s.formats for s in left] == [(), (), ("native", "coco")]
    assert "shard 2/3 is done, 8 of 12 frames are left to other shards" in left[0].notes[-1]
    assert tree_hash(out) == tree_hash(small_run)


def test_no_format_is_written_before_all_is_there(tmp_path):
    generate(small_recipe(), tmp_path / "out", shard=(0, 2))
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"store", "CREDITS.md"}


@pytest.mark.slow
def test_there_may_be_more_shards_than_shots(small_run, tmp_path):
    order = list(range(9))
    random.Random(3).shuffle(order)
    left = [generate(small_recipe(), tmp_path / "out", shard=(k, 9)) for k in order]
    assert sorted(s.rendered for s in left) == [0, 0, 0, 2, 2, 2, 2, 2, 2]
    assert tree_hash(tmp_path / "out") == tree_hash(small_run)


@pytest.mark.slow
def test_what_a_shard_has_does_not_depend_on_what_is_there(tmp_path):
    def shots(out):
        return set(Store(out).finished())

    generate(small_recipe(), tmp_path / "alone", shard=(1, 4))
    generate(small_recipe(), tmp_path / "out", shard=(0, 4))
    before = shots(tmp_path / "out")
    generate(small_recipe(), tmp_path / "out", shard=(1, 4))
    assert shots(tmp_path / "out") - before == shots(tmp_path / "alone")
    assert generate(small_recipe(), tmp_path / "out", shard=(1, 4)).rendered == 0


def test_a_shard_makes_the_models_of_its_shots_alone(tmp_path):
    recipe = small_recipe(shot_frames=6, formats=[])  # a shot a model
    generate(recipe, tmp_path / "out", shard=(1, 2))
    assert [path.name for path in (tmp_path / "out" / "store" / "models").iterdir()] == [prepare(recipe).subjects[1]]


@pytest.mark.slow
def test_a_shard_that_finds_all_finished_writes_only_exports_that_lack_something(tmp_path):
    out = tmp_path / "out"
    recipe = small_recipe(formats=["csv", "coco"])
    for k in range(2):
        generate(recipe, out, shard=(k, 2))
    whole, lists = tree_hash(out), {name: out / name / "checksums.xxh128" for name in ("csv", "coco")}
    assert generate(recipe, out, shard=(0, 2)).formats == ()
    lists["csv"].write_text(lists["csv"].read_text().replace("# frames 12", "# frames 6"))  # of a half-finished data set
    assert generate(recipe, out, shard=(0, 2)).formats == ("csv",)
    assert tree_hash(out) == whole


@pytest.mark.slow
def test_what_shards_left_out_is_what_one_run_leaves_out(tmp_path):
    (tmp_path / "models").mkdir()
    good = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    for name, text in {"a": "no model\n", "b": good, "c": "none either\n", "d": good}.items():
        (tmp_path / "models" / f"{name}.obj").write_text(text)
    recipe = small_recipe(
        models=[{"source": str(tmp_path / "models"), "category": "thing"}],
        viewpoints={"azimuth": [0, 90], "elevation": [15], "distance": 4.0},
        shot_frames=1,
    )
    generate(recipe, tmp_path / "one", keep_going=True)
    for k in (1, 2, 0):
        generate(recipe, tmp_path / "out", keep_going=True, shard=(k, 3))
    assert set(Store(tmp_path / "out").skipped()) == {"a", "c"}
    assert tree_hash(tmp_path / "out") == tree_hash(tmp_path / "one")


@pytest.mark.slow
def test_shards_add_to_a_data_set_as_one_run_does(small_dataset, tmp_path):
    more = small_recipe(models=[{**small_recipe().model_dump()["models"][0], "count": 3}])
    shutil.copytree(small_dataset.root, tmp_path / "one")
    generate(more, tmp_path / "one", append=True)
    for k in (1, 0):
        generate(more, small_dataset.root, append=True, shard=(k, 2))
    assert tree_hash(small_dataset.root) == tree_hash(tmp_path / "one")


@pytest.mark.parametrize("shard", [(2, 2), (-1, 2), (0, 0), "0/2"])
def test_what_is_no_shard_is_refused(shard, tmp_path):
    with pytest.raises(UserError, match="shard: expected"):
        generate(small_recipe(), tmp_path / "out", shard=shard)
    assert not (tmp_path / "out").exists()


def test_shards_on_the_command_line():
    assert shard_named("3/16") == (3, 16)
    for text in ("16/16", "3", "3/", "-1/4", "a/b", "0/0", "", "1/2/3", "1" * 5000 + "/2", "\u0663/16"):
        with pytest.raises(UserError, match="--shard: expected k/n"):
            shard_named(text)


def test_a_bad_shard_is_refused_in_one_line_before_anything_is_made(recipe_file, tmp_path):
    answer = viewsphere("render", recipe_file, "-o", tmp_path / "out", "--shard", "7/7")
    assert (answer.returncode, answer.stderr.count("\n")) == (2, 1)
    assert "--shard: expected k/n, the k-th of n shards counted from 0, such as 0/16; found '7/7'" in answer.stderr
    assert not (tmp_path / "out").exists()


def test_each_shot_is_in_one_shard(tmp_path):
    portion = to_render(prepare(small_recipe(shot_frames=1)), Store(tmp_path / "out"))
    shards = [[row.key for row in replace(portion, shard=Shard(k, 5)).rows] for k in range(5)]
    assert sorted(key for keys in shards for key in keys) == sorted(row.key for row in portion.rows)
    assert {len(keys) for keys in shards} == {2, 3}


@pytest.mark.slow
@given(st.data())
def test_a_share_of_an_index_is_counted_as_its_rows_are(data):
    number = st.integers(1, 12)
    blocks: list[Block] = []
    for first in range(0, 100 * data.draw(st.integers(1, 3)), 100):
        subjects = data.draw(st.lists(st.sampled_from("abc"), min_size=1, unique=True))
        blocks.append(Block(tuple(subjects), ((first, first + data.draw(number)),), data.draw(st.integers(1, 3))))
    index = Index(tuple(blocks), first=data.draw(number), most=data.draw(number), part=0)
    rows, of = list(index), data.draw(number)
    k = data.draw(st.integers(0, of - 1))
    own = replace(index, shard=Shard(k, of))
    assert list(own) == [own[i] for i in range(len(own))] == rows[k::of]
    assert own.samples == sum(row.count for row in own)
    assert [own.find(row.key) == row for row in rows] == [row in rows[k::of] for row in rows]
    for subject in "abc":
        shots = [row for row in rows[k::of] if row.subject == subject]
        assert list(own.rows_of(subject)) == shots and own.counts[subject] == own.count_of(subject) == len(shots)
        assert own.samples_of(subject) == sum(row.count for row in shots)


def test_a_shard_of_a_hundred_million_frames_counts_out_no_row_that_it_does_not_render(tmp_path, monkeypatch):
    views = {"kind": "sphere", "count": 50_000_000, "distance": 3}
    planned = prepare(small_recipe(viewpoints=views, max_frames=10**9, shot_frames=16))
    made = counted(monkeypatch, Index, "_row")
    shards = [replace(whole(planned), shard=Shard(k, 7)) for k in range(7)]
    works = [Missing(portion, Store(tmp_path)) for portion in shards]
    assert sum(work.total for work in works) == planned.frames == 10**8
    assert sum(count for work in works for _, count in work.lines()) == 10**8 // 16
    assert all(len(portion.models) == len(portion.subjects) == 2 for portion in shards)
    assert len(list(islice(works[3].rows(), 5))) == 5 and works[3].resumed == 0
    assert len(made) <= 7 * 2 + 6


@pytest.mark.slow
def test_two_that_finish_at_once_leave_what_one_leaves(recipe_file, small_run, tmp_path):
    out = tmp_path / "out"
    generate(small_recipe(), out, shard=(0, 3))
    generate(small_recipe(), out, shard=(1, 3))
    runs = [subprocess.Popen(command(recipe_file, out, "2/3", 0), **OWN) for _ in range(2)]
    for run in runs:
        _, problem = run.communicate(timeout=DEADLINE)
        assert run.returncode == 0, problem
    assert tree_hash(out) == tree_hash(small_run)


@pytest.mark.slow
def test_many_put_one_export_in_place_and_none_is_refused(small_dataset):
    code = (
        "import sys; from pathlib import Path; from viewsphere.store import Store\n"
        "store = Store(Path(sys.argv[1]))\n"
        "for _ in range(60):\n"
        "    with store.replacing(store.root / 'coco') as folder:\n"
        "        (folder / 'a').write_text('whole')\n"
    )
    runs = [subprocess.Popen([sys.executable, "-c", code, small_dataset.root], stderr=subprocess.PIPE) for _ in range(3)]
    for run in runs:
        _, problem = run.communicate(timeout=DEADLINE)
        assert run.returncode == 0, problem
    assert [path.name for path in (small_dataset.root / "coco").iterdir()] == ["a"]
    assert not any((small_dataset.root / "store" / "writing").iterdir())


@pytest.mark.slow
def test_a_run_that_is_told_to_end_leaves_nothing_unfinished(recipe_file, tmp_path):
    out = tmp_path / "out"
    run = subprocess.Popen(command(recipe_file, out, "0/1", 1), **OWN)
    assert until(lambda: Store(out).heartbeats() or run.poll() is not None)
    run.send_signal(signal.SIGTERM)
    _, said = run.communicate(timeout=DEADLINE)
    assert (run.returncode, b"stopped;" in said) == (130, True), said
    assert not any((out / "store" / "writing").iterdir())


def test_who_hangs_where_all_take_turns_is_told_of_in_one_line(tmp_path, monkeypatch):
    monkeypatch.setattr(local, "LOCK_S", 0.1)
    store = Store(tmp_path)
    store.make_ready()
    with FileLock(store.folder / "lock"), pytest.raises(StoreError, match=r"lock: expected other runs to be done .* end it"):
        Store(tmp_path / "store" / "..").open_for(to_render(prepare(small_recipe()), store).record)
    assert not store.plan_file.exists()


def test_where_a_file_system_has_no_locks_a_run_takes_no_turns(small_run, tmp_path, monkeypatch):
    def refuse(*_, **__):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(FileLock, "acquire", refuse)
    generate(small_recipe(), tmp_path / "out", shard=(0, 1))
    assert not (tmp_path / "out" / "store" / "lock").exists()
    (tmp_path / "out" / "store" / "lock").touch()
    assert tree_hash(tmp_path / "out") == tree_hash(small_run)


DYING = """
import os, signal, sys
from viewsphere.cli import main
from viewsphere.store.places.local import Local
own, lives = Local.put, int(sys.argv.pop(1))
def put(place, made, target):
    global lives
    lives -= made.is_dir()
    if lives < 0:
        os.kill(os.getpid(), signal.SIGKILL)
    own(place, made, target)
Local.put = put
main()
"""
"""The command line, killed when it is about to put in place what it makes after so many models and shots."""


def killed_at(lives, words):
    """A run that is killed after so many models and shots; when it is dead."""
    run = subprocess.Popen([sys.executable, "-c", DYING, f"{lives}", *words[3:]], **OWN)
    _, said = run.communicate(timeout=DEADLINE)
    assert run.returncode == -signal.SIGKILL, said


def killed_at_start(out, shard, words):
    """A run that is killed, without its workers, when it has told of itself; when it is dead."""
    run = subprocess.Popen(words, **OWN)
    assert until(lambda: shard in [told.shard for told, _ in Store(out).heartbeats()] or run.poll() is not None)
    run.kill()
    _, said = run.communicate(timeout=DEADLINE)
    assert run.returncode == -signal.SIGKILL, said


@pytest.fixture(scope="module")
def many(tmp_path_factory):
    """A recipe of 24 shots, and the tree that one run makes of it."""
    views = {"azimuth": {"start": 0, "stop": 330, "step": 30}, "elevation": [15], "distance": 1.0}
    recipe = small_recipe(viewpoints=views, shot_frames=1, channels=["rgb", "depth", "instances"])
    out = tmp_path_factory.mktemp("many") / "out"
    generate(recipe, out)
    return recipe, tree_hash(out)


@pytest.mark.slow
def test_five_shards_three_at_a_time_two_of_them_killed(many, tmp_path):
    recipe, whole_tree = many
    file, out, rng = tmp_path / "recipe.yaml", tmp_path / "out", random.Random(1)
    file.write_text(recipe.to_yaml())
    order = rng.sample(range(5), 5)
    at_start, at_work = rng.sample(order, 2)

    def make(k):
        words = command(file, out, f"{k}/5", workers=0)
        if k == at_start:
            killed_at_start(out, (k, 5), command(file, out, f"{k}/5"))
        elif k == at_work:
            killed_at(rng.randrange(3), words)
        done = subprocess.run(words, capture_output=True, timeout=DEADLINE)
        assert done.returncode == 0, done.stderr

    with ThreadPoolExecutor(3) as three:
        list(three.map(make, order))
    assert tree_hash(out) == whole_tree
    found = status(out)
    assert found.complete and not found.runs and not found.failed


@pytest.mark.slow
def test_what_a_killed_shard_left_is_told_exported_and_proved(many, tmp_path):
    recipe, whole_tree = many
    file, out = tmp_path / "recipe.yaml", tmp_path / "out"
    file.write_text(recipe.to_yaml())
    generate(recipe, out, shard=(0, 2))
    killed_at(5, command(file, out, "1/2", workers=0))
    found = status(out)
    assert (found.frames, found.finished, found.missing) == (24, 17, 7)
    assert [(run.state, run.told.shard) for run in found.runs] == [("dead", (1, 2))]
    said = viewsphere("status", out)
    assert said.returncode == 3 and "shard 1/2" in said.stdout and "run it again" in said.stdout
    assert viewsphere("export", out, "-f", "coco,csv").returncode == 0
    report = check(Dataset(out))
    assert {finding.check for finding in report.findings} == {"counts"}
    assert len(Dataset(out)) == 17
    generate(recipe, out, shard=(1, 2))
    assert viewsphere("check", out).returncode == 0
    shutil.rmtree(out / "csv")
    assert tree_hash(out) == whole_tree


@pytest.mark.slow
def test_shards_that_add_at_once_add_what_one_run_adds(small_dataset, tmp_path):
    box = small_recipe().model_dump()["models"][0]
    more = small_recipe(models=[{**box, "count": 3}])
    (tmp_path / "more.yaml").write_text(more.to_yaml())
    shutil.copytree(small_dataset.root, tmp_path / "one")
    generate(more, tmp_path / "one", append=True)
    words = [[*command(tmp_path / "more.yaml", small_dataset.root, f"{k}/2", 0), "--append"] for k in range(2)]
    runs = [subprocess.Popen(one, **OWN) for one in words]
    for run in runs:
        _, problem = run.communicate(timeout=DEADLINE)
        assert run.returncode == 0, problem
    assert tree_hash(small_dataset.root) == tree_hash(tmp_path / "one")


def test_a_bad_model_fails_its_shard_and_not_the_others(tmp_path):
    (tmp_path / "models").mkdir()
    good = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    for name, text in {"a": "no model\n", "b": good}.items():
        (tmp_path / "models" / f"{name}.obj").write_text(text)
    recipe = small_recipe(
        models=[{"source": str(tmp_path / "models"), "category": "thing"}],
        viewpoints={"azimuth": [0, 90], "elevation": [15], "distance": 4.0},
        formats=[],
    )
    with pytest.raises(ModelError, match=r"a\.obj"):
        generate(recipe, tmp_path / "out", shard=(0, 2))
    assert generate(recipe, tmp_path / "out", shard=(1, 2)).rendered == 2
    (failed,) = Store(tmp_path / "out").failures()
    assert failed.shard == (0, 2) and "a.obj" in failed.error
    (tmp_path / "models" / "a.obj").write_text(good)
    assert generate(recipe, tmp_path / "out", shard=(0, 2)).missing == 0
    assert Store(tmp_path / "out").failures() == ()
