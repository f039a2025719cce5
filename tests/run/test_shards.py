"""Shards of a job array, in any order, several at once, killed and run again, make what one run makes."""

import os
import random
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from deadline import DEADLINE
from small import small_recipe, tree_hash
from viewsphere.errors import ModelError, UserError
from viewsphere.run.generate import generate
from viewsphere.run.opening import prepare, to_render
from viewsphere.run.share import shard_named
from viewsphere.store import Store

OWN = {"start_new_session": True, "stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}


def command(recipe, out, shard, workers=1):
    words = ["render", recipe, "-o", out, "--shard", shard, "--workers", workers]
    return [sys.executable, "-m", "viewsphere", *map(str, words)]


@pytest.fixture
def recipe_file(tmp_path):
    file = tmp_path / "recipe.yaml"
    file.write_text(small_recipe().to_yaml())
    return file


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


def test_there_may_be_more_shards_than_shots(small_run, tmp_path):
    order = list(range(9))
    random.Random(3).shuffle(order)
    left = [generate(small_recipe(), tmp_path / "out", shard=(k, 9)) for k in order]
    assert sorted(s.rendered for s in left) == [0, 0, 0, 2, 2, 2, 2, 2, 2]
    assert tree_hash(tmp_path / "out") == tree_hash(small_run)


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


def test_shards_add_to_a_data_set_as_one_run_does(small_dataset, tmp_path):
    import shutil

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
    for text in ("16/16", "3", "3/", "-1/4", "a/b"):
        with pytest.raises(UserError, match="--shard: expected k/n"):
            shard_named(text)


def test_each_shot_is_in_one_shard(tmp_path):
    from dataclasses import replace

    from viewsphere.sampling.share import Share

    portion = to_render(prepare(small_recipe(shot_frames=1)), Store(tmp_path / "out"))
    shares = [[row.key for row in replace(portion, share=Share(k, 5)).rows] for k in range(5)]
    assert sorted(key for keys in shares for key in keys) == sorted(row.key for row in portion.rows)
    assert {len(keys) for keys in shares} == {2, 3}


def test_two_that_finish_at_once_leave_what_one_leaves(recipe_file, small_run, tmp_path):
    out = tmp_path / "out"
    generate(small_recipe(), out, shard=(0, 3))
    generate(small_recipe(), out, shard=(1, 3))
    runs = [subprocess.Popen(command(recipe_file, out, "2/3", 0), **OWN) for _ in range(3)]
    for run in runs:
        _, problem = run.communicate(timeout=DEADLINE)
        assert run.returncode == 0, problem
    assert tree_hash(out) == tree_hash(small_run)


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


def test_a_run_that_is_told_to_end_leaves_nothing_unfinished(recipe_file, tmp_path):
    out = tmp_path / "out"
    run = subprocess.Popen(command(recipe_file, out, "0/1", 1), **OWN)
    deadline = time.monotonic() + DEADLINE
    while not any((out / "store" / "writing").glob("*~run")) and time.monotonic() < deadline:
        time.sleep(0.02)
    run.send_signal(signal.SIGTERM)
    _, said = run.communicate(timeout=DEADLINE)
    assert (run.returncode, b"stopped;" in said) == (130, True), said
    assert not any((out / "store" / "writing").iterdir())


def killed(words, seconds):
    """A run of which all processes are killed after so many seconds, unless it was done before; whether it was killed."""
    run = subprocess.Popen(words, **OWN)
    try:
        run.wait(timeout=seconds)
        return False
    except subprocess.TimeoutExpired:
        os.killpg(run.pid, signal.SIGKILL)
        return True
    finally:
        run.communicate(timeout=DEADLINE)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
def test_seven_shards_three_at_a_time_two_of_them_killed(seed, recipe_file, small_run, tmp_path):
    out, rng = tmp_path / "out", random.Random(seed)
    order = rng.sample(range(7), 7)
    victims = {order[0]: rng.uniform(1.5, 4.0), order[rng.randrange(1, 7)]: rng.uniform(1.5, 4.0)}

    def made(k):
        again = k in victims and killed(command(recipe_file, out, f"{k}/7"), victims[k])
        done = subprocess.run(command(recipe_file, out, f"{k}/7"), capture_output=True, timeout=DEADLINE)
        assert done.returncode == 0, done.stderr
        return again

    with ThreadPoolExecutor(3) as three:
        assert any(list(three.map(made, order)))
    assert tree_hash(out) == tree_hash(small_run)


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
