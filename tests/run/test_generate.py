"""A run can be stopped anywhere, spread over any number of workers, and gives the same bytes."""

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from contextlib import suppress

import numpy as np
import pytest

import viewsphere as vs
from deadline import DEADLINE, until
from small import small_recipe, tree_hash
from viewsphere.errors import ModelError, RecipeError, StoreError, UserError, WorkerDied
from viewsphere.run.executors import Listed, Outcome
from viewsphere.run.executors.local import LocalPool
from viewsphere.run.exports.exporting import export
from viewsphere.run.generate import generate
from viewsphere.run.progress import Progress
from viewsphere.store import Store


def command(recipe_file, out, workers):
    return [
        sys.executable,
        "-m",
        "viewsphere",
        "render",
        str(recipe_file),
        "-o",
        str(out),
        "--workers",
        str(workers),
    ]


@pytest.fixture
def recipe_file(tmp_path):
    file = tmp_path / "recipe.yaml"
    file.write_text(small_recipe().to_yaml())
    return file


@pytest.mark.slow
def test_any_number_of_workers_gives_the_same_bytes(recipe_file, small_run, tmp_path):
    """Of none, which made `small_run`, and of two."""
    subprocess.run(command(recipe_file, tmp_path / "out", 2), check=True, timeout=DEADLINE, capture_output=True)
    assert tree_hash(tmp_path / "out") == tree_hash(small_run)


def kill_on_its_way(command, out, wait):
    """Start a run and kill it some seconds after it has finished one more shot, or all."""
    store = out / "store"
    before = len(list(store.glob("shots/*/*")))
    run = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
    assert until(lambda: run.poll() is not None or len(list(store.glob("shots/*/*"))) > before)
    time.sleep(wait)
    with suppress(ProcessLookupError):
        os.killpg(run.pid, signal.SIGKILL)
    run.wait(timeout=DEADLINE)


@pytest.mark.slow
def test_a_killed_run_goes_on_to_the_same_bytes(recipe_file, small_run, tmp_path):
    out, rng = tmp_path / "out", random.Random(4)
    kill_on_its_way(command(recipe_file, out, 2), out, rng.uniform(0, 0.5))
    generate(vs.Recipe.load(recipe_file), out)
    assert tree_hash(out) == tree_hash(small_run)


def test_finished_shots_are_never_rendered_again(tmp_path):
    seen: list[Progress] = []
    first = generate(small_recipe(), tmp_path / "out", formats=[])
    again = generate(small_recipe(), tmp_path / "out", formats=[], listener=seen.append)
    assert (first.rendered, first.frames) == (12, 12)
    assert (again.rendered, again.frames) == (0, 12)
    assert [p for p in seen if p.phase == "frames"] == [Progress("frames", 12, 12, 12)]


def test_what_is_missing_is_rendered(small_dataset, small_run):
    victim = next((small_dataset.root / "store" / "shots").glob("*/*"))
    for file in sorted(victim.rglob("*"), reverse=True):
        file.rmdir() if file.is_dir() else file.unlink()
    victim.rmdir()
    summary = generate(small_recipe(), small_dataset.root)
    assert summary.rendered == 2
    assert tree_hash(small_dataset.root) == tree_hash(small_run)


def test_memory_and_disk_hold_the_same_samples(small_run):
    dataset = vs.open(small_run)
    memory = list(vs.render(small_recipe()))
    assert len(dataset) == len(memory) == vs.plan(small_recipe()).frames == 12
    for a, b in zip(memory, dataset, strict=True):
        assert (a.index, a.split, a.pose) == (b.index, b.split, b.pose)
        assert set(a.channels) == set(b.channels)
        for name in a.channels:
            assert a.channels[name].dtype == b.channels[name].dtype
            assert np.array_equal(a.channels[name], b.channels[name], equal_nan=a.channels[name].dtype.kind == "f"), name
        for name in ("K", "R", "t", "P"):
            assert np.array_equal(getattr(a.camera, name), getattr(b.camera, name))
        for o, p in zip(a.objects, b.objects, strict=True):
            assert (o.id, o.category, o.model, o.box2d, o.area, o.visibility, o.truncation, o.size, o.real_size) == (
                p.id, p.category, p.model, p.box2d, p.area, p.visibility, p.truncation, p.size, p.real_size
            )  # fmt: skip
            assert np.array_equal(o.mask, p.mask)
            assert np.array_equal(o.box3d_pixels, p.box3d_pixels, equal_nan=True)
            assert np.array_equal(o.camera_from_object, p.camera_from_object)
            assert np.array_equal(o.mask, a.instances == o.id)
            assert (small_run / o.model).is_file()


def test_dataset_indexing(small_run):
    dataset = vs.open(small_run)
    assert [s.index for s in dataset] == [dataset[i].index for i in range(len(dataset))] == list(range(12))
    assert dataset[-1].index == 11
    assert [s.index for s in dataset[2:5]] == [2, 3, 4]
    with pytest.raises(IndexError):
        dataset[12]


def test_another_recipe_is_refused_and_nothing_changes(small_dataset):
    before = tree_hash(small_dataset.root)
    other = small_recipe(viewpoints={"azimuth": [0], "elevation": [15], "distance": 1.0})
    with pytest.raises(StoreError, match="another output folder"):
        generate(other, small_dataset.root)
    assert tree_hash(small_dataset.root) == before


def test_foreign_files_are_refused(tmp_path):
    (tmp_path / "thesis.tex").write_text("x")
    with pytest.raises(StoreError, match="other files"):
        generate(small_recipe(), tmp_path)


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="root may write anywhere")
def test_unwritable_folder(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(StoreError, match="writable"):
        generate(small_recipe(), tmp_path / "out")


def test_output_that_is_a_file(tmp_path):
    (tmp_path / "out").write_text("x")
    with pytest.raises(StoreError, match="writable output folder"):
        generate(small_recipe(), tmp_path / "out")


def test_unknown_format_is_refused_before_rendering(tmp_path):
    with pytest.raises(UserError, match="did you mean 'coco'"):
        generate(small_recipe(), tmp_path / "out", formats=["cocoo"])
    assert not (tmp_path / "out").exists()


def test_a_channel_that_a_format_needs_is_missed_before_rendering(tmp_path):
    with pytest.raises(RecipeError, match="channels: expected rgb, which format coco needs; found depth"):
        generate(small_recipe(channels=["depth"]), tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("how", [{"image": "{}/bad.png"}, {"images": "{}"}])
def test_a_background_that_is_no_image_is_refused_before_rendering(how, tmp_path):
    (tmp_path / "bad.png").write_text("no picture")
    background = {key: value.format(tmp_path) for key, value in how.items()}
    recipe = small_recipe(scene={"background": background})
    with pytest.raises(RecipeError, match=r"scene.background.*bad.png"):
        generate(recipe, tmp_path / "out")
    assert not (tmp_path / "out").exists()
    with pytest.raises(RecipeError, match=r"scene.background.*bad.png"):
        next(vs.render(recipe))


def test_a_recipe_can_be_mended_and_tried_again(tmp_path):
    near = small_recipe(viewpoints={"azimuth": 0, "elevation": 0, "distance": 0.05}, formats=[])
    with pytest.raises(RecipeError, match="inside the model"):
        generate(near, tmp_path / "out")
    mended = small_recipe(viewpoints={"azimuth": 0, "elevation": 0, "distance": 1}, formats=[])
    assert generate(mended, tmp_path / "out").frames == 2


def test_warnings_of_models_are_told(tmp_path):
    (tmp_path / "card.obj").write_text("mtllib none.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n")
    models = [{"source": str(tmp_path / "card.obj"), "category": "card"}]
    summary = generate(small_recipe(models=models, formats=[]), tmp_path / "out")
    assert list(summary.warnings.models) == ["card"] and summary.warnings.files == {}
    assert "none.mtl" in summary.warnings.models["card"][0]


def test_camera_inside_the_model_is_refused_in_memory():
    near = small_recipe(viewpoints={"azimuth": 0, "elevation": 0, "distance": 0.05})
    with pytest.raises(RecipeError, match="inside the model"):
        next(vs.render(near))


def test_camera_inside_the_model_is_refused(tmp_path):
    near = small_recipe(viewpoints={"azimuth": 0, "elevation": 0, "distance": 0.05})
    with pytest.raises(RecipeError, match="distance"):
        generate(near, tmp_path / "out")


@pytest.fixture
def one_bad(tmp_path):
    (tmp_path / "models").mkdir()
    (tmp_path / "models" / "bad.obj").write_text("not a model\n")
    good = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    (tmp_path / "models" / "good.obj").write_text(good)
    return small_recipe(
        models=[{"source": str(tmp_path / "models"), "category": "thing"}],
        viewpoints={"azimuth": [0, 90], "elevation": [15], "distance": 4.0},
    )


def test_one_bad_model_stops_the_run(one_bad, tmp_path):
    with pytest.raises(ModelError, match=r"bad\.obj"):
        generate(one_bad, tmp_path / "out")
    assert len(vs.open(tmp_path / "out")) == 0


def test_one_bad_model_is_left_out_if_asked(one_bad, tmp_path):
    summary = generate(one_bad, tmp_path / "out", keep_going=True)
    assert list(summary.skipped) == ["bad"]
    assert summary.frames == 2
    assert {o.key for s in vs.open(tmp_path / "out") for o in s.objects} == {"good"}


@pytest.fixture
def losing(monkeypatch):
    """The first two shots are lost with their workers, whoever makes them."""

    class Losing(LocalPool):
        def run(self, work, *heard):
            for number, outcome in enumerate(super().run(work, *heard)):
                if isinstance(work, Listed) or number > 1:
                    yield outcome
                else:
                    shutil.rmtree(Store(self._root).shot_folder(outcome.key))
                    yield Outcome(outcome.key, error=WorkerDied(f"{outcome.key}: its worker died 2 times (it was lost)"))

    monkeypatch.setattr("viewsphere.run.generate.worker_pool", lambda root, portion, *_: Losing(root, portion, 0))


@pytest.mark.slow
def test_shots_lost_with_their_workers_are_told_when_all_others_are_made(losing, monkeypatch, small_run, tmp_path):
    with pytest.raises(WorkerDied) as caught:
        generate(small_recipe(), tmp_path / "out")
    assert [line.partition(": ")[2] for line in str(caught.value).splitlines()] == ["its worker died 2 times (it was lost)"] * 2
    assert len(vs.open(tmp_path / "out")) == 12 - 2 * 2
    monkeypatch.undo()
    assert generate(small_recipe(), tmp_path / "out").rendered == 2 * 2
    assert tree_hash(tmp_path / "out") == tree_hash(small_run)


def test_shots_lost_with_their_workers_are_left_out_if_asked(losing, tmp_path):
    summary = generate(small_recipe(), tmp_path / "out", keep_going=True)
    assert (summary.frames, summary.rendered, len(summary.skipped)) == (8, 8, 2)
    assert (tmp_path / "out" / "coco").is_dir()


def test_a_changed_model_is_refused(one_bad, tmp_path):
    generate(one_bad, tmp_path / "out", keep_going=True)
    file = tmp_path / "models" / "good.obj"
    file.write_text(file.read_text().replace("v 1 0 0", "v 2 0 0"))
    with pytest.raises(StoreError, match="changed"):
        generate(one_bad, tmp_path / "out", keep_going=True)


def test_export_of_a_half_finished_store(small_dataset):
    first = next((small_dataset.root / "store" / "shots").glob("*/*"))
    first.rename(small_dataset.root / "gone")
    export(small_dataset.root, ["coco"])
    ids = [
        image["id"]
        for file in (small_dataset.root / "coco" / "annotations").glob("*.json")
        for image in json.loads(file.read_text())["images"]
    ]
    assert len(ids) == 10
    assert set(ids) == {s.index + 1 for s in vs.open(small_dataset.root)}


def test_an_unknown_engine_option_is_refused_before_anything_is_made(tmp_path):
    with pytest.raises(UserError, match="did you mean 'antialias'"):
        generate(small_recipe(engine={"name": "raster", "antialiased": 4}), tmp_path / "out")
    assert not (tmp_path / "out").exists()
