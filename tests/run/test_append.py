"""Appending adds to a data set what it lacks, as if all had been rendered at once, and touches nothing that is there."""

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import viewsphere as vs
from animated import let_walk
from command_line import viewsphere
from deadline import DEADLINE, until
from shots import unit_box
from small import small_recipe, tree_hash
from viewsphere import Dataset, generate
from viewsphere.check import check
from viewsphere.composing.viewpoints.pose_numbers import joined_digests, names_of
from viewsphere.errors import ModelError, RecipeError, StoreError, UserError
from viewsphere.model.sample import ObjectAnnotation
from viewsphere.planning import fitting
from viewsphere.planning.extension import extend, whole
from viewsphere.planning.fitting import settings
from viewsphere.planning.plan import plan
from viewsphere.store import PlanRecord, Store
from viewsphere.store.shots.manifest import sealed, unsealed

BOX = {"source": "zoo:post_box", "category": "post box", "scale": {"length": 0.18}}
POSES = {"azimuth": [0, 120, 240], "elevation": [15, 50], "distance": 1.0}
DENSER = {"azimuth": [0, 60, 120, 240], "elevation": [15, 50], "distance": 1.0}
CHANNELS = ["rgb", "depth", "instances", "categories"]


def recipe(**changes):
    """Two models from six sides; `models`, `viewpoints` and `channels` are what appending may change."""
    return small_recipe(**{"channels": CHANNELS, "scene": {"ground": True}, **changes})


def models(count, first=None):
    return [*([first] if first else []), {**BOX, "count": count}]


NEW_FIRST = {**BOX, "category": "letter box", "name": "a"}
BIGGER = {"models": models(3, NEW_FIRST), "viewpoints": DENSER}


@pytest.fixture(scope="module")
def base(tmp_path_factory):
    out = tmp_path_factory.mktemp("append") / "out"
    generate(recipe(), out)
    return out


@pytest.fixture(scope="module")
def bigger(base, tmp_path_factory):
    """The data set with more models and poses appended; do not change it."""
    out = shutil.copytree(base, tmp_path_factory.mktemp("bigger") / "out")
    generate(recipe(**BIGGER), out, append=True)
    return out


@pytest.fixture
def out(base, tmp_path):
    return shutil.copytree(base, tmp_path / "out")


def state(folder: Path, *parts: str):
    """Bytes, times and places on disk of all files below some parts of a folder."""
    files = [f for part in parts or (".",) for f in (folder / part).rglob("*") if f.is_file()]
    return {f: (f.read_bytes(), f.stat().st_mtime_ns, f.stat().st_ino) for f in files}


def images(folder: Path):
    """COCO's images and annotations by id, with their split."""
    found = {}
    for file in (folder / "coco" / "annotations").glob("*.json"):
        value = json.loads(file.read_text())
        for kind in ("images", "annotations", "categories"):
            for entry in value[kind]:
                found[kind, "" if kind == "categories" else file.stem, entry["id"]] = entry
    return found


def known_by(sample):
    p = sample.pose
    return sample.objects[0].key, p.azimuth_deg, p.elevation_deg, p.distance, p.tilt_deg


def splits_of_models(record):
    return {key: split for part in record.parts for key, split in part.dealt_splits.items()}


def assert_same_frame(a, b):
    """Everything but numbers is equal."""
    assert (a.split, a.pose.category, len(a.objects)) == (b.split, b.pose.category, len(b.objects))
    assert set(a.files or a.channels) == set(b.files or b.channels)
    for name in a.channels:
        x, y = a.channels[name], b.channels[name]
        if name == "categories":
            x, y = x > 0, y > 0
        assert np.array_equal(x, y, equal_nan=x.dtype.kind == "f"), name
    for name in ("K", "R", "t"):
        assert np.array_equal(getattr(a.camera, name), getattr(b.camera, name))
    for o, p in zip(a.objects, b.objects, strict=True):
        for name in (field.name for field in fields(ObjectAnnotation) if field.name != "category_id"):
            np.testing.assert_equal(getattr(p, name), getattr(o, name), err_msg=name)


@pytest.mark.slow
@pytest.mark.parametrize(
    "changes",
    [
        pytest.param({"models": models(3)}, marks=pytest.mark.slow),
        {"models": models(1, NEW_FIRST)},
        pytest.param({"viewpoints": DENSER}, marks=pytest.mark.slow),
        {"viewpoints": {"azimuth": 30, "elevation": 15, "distance": 1.0}},
        {"channels": [*CHANNELS, "normals"]},
        pytest.param(BIGGER, marks=pytest.mark.slow),
        {**BIGGER, "channels": ["rgb", "parts", "normals"]},
        {"name": "other", "formats": ["coco"], "shot_frames": 5, "models": models(3), "max_frames": 100},
    ],
    ids=["models", "a new category first", "poses", "only new poses", "channels", "models and poses", "all", "the rest"],
)
def test_nothing_is_touched_and_all_is_as_if_rendered_at_once(changes, out):
    before, coco = state(out, "store/shots", "store/models"), images(out)
    old = {known_by(s): s for s in Dataset(out)}
    summary = generate(recipe(**changes), out, append=True)
    after = state(out, "store/shots", "store/models")
    assert {file: after[file] for file in before} == before
    dataset = Dataset(out)
    assert [s.index for s in dataset] == list(range(len(dataset)))
    assert [known_by(s) for s in dataset[: len(old)]] == list(old)
    found = images(out)
    assert {key: found[key] for key in coco} == coco
    for (kind, file, _), entry in found.items():
        assert kind != "images" or (out / "coco" / "images" / file.removeprefix("instances_") / entry["file_name"]).is_file()
    channels = [*CHANNELS, *(c for c in changes.get("channels", []) if c not in CHANNELS)]
    fresh = {known_by(s): s for s in vs.render(recipe(**{**changes, "channels": channels}))}
    there = {known_by(s): s for s in dataset}
    assert there.keys() == fresh.keys() | old.keys()
    assert len(there) == len(dataset) == summary.frames
    for key, sample in fresh.items():  # quotas are of a part, so splits of models depend on what was there
        assert_same_frame(replace(sample, split=there[key].split), there[key])
    assert {key: there[key].split for key in old} == {key: sample.split for key, sample in old.items()}
    assert {s.objects[0].key: s.split for s in dataset}.items() <= splits_of_models(dataset.plan).items()
    for number, part in enumerate(dataset.plan.parts):
        wanted = set(dataset.plan.channels_of(number))
        assert all(s.files.keys() == wanted for s in dataset[part.first : part.first + part.frames])
    poses = {known_by(s)[1:]: s.pose.index for s in dataset}
    assert sorted(poses.values()) == list(range(dataset.plan.poses))
    assert {s.pose.index for s in dataset} == set(poses.values())
    report = check(dataset)
    assert report.ok, report.findings


def test_categories_are_numbered_on(bigger):
    dataset = Dataset(bigger)
    assert [(c.id, c.name) for c in dataset.categories] == [(1, "post box"), (2, "letter box")]
    for sample in dataset:
        o = sample.objects[0]
        assert o.category_id == {"post box": 1, "letter box": 2}[o.category]
        assert set(np.unique(sample.channels["categories"])) == {0, o.category_id}


@pytest.mark.slow
def test_several_appends_follow_one_another(out):
    steps = [
        {"models": models(3)},
        {"models": models(3), "channels": [*CHANNELS, "normals"]},
        {"models": models(1, NEW_FIRST), "viewpoints": DENSER},
        {"models": models(3, NEW_FIRST), "viewpoints": DENSER, "channels": [*CHANNELS, "normals", "parts"]},
    ]
    before = state(out, "store/shots", "store/models")
    for step in steps:
        generate(recipe(**step), out, append=True)
        after = state(out, "store/shots", "store/models")
        assert {file: after[file] for file in before} == before
        before = after
        report = check(Dataset(out), rays=False, fast=step is not steps[-1])
        assert report.ok, report.findings
    dataset = Dataset(out)
    fresh = {known_by(s): s for s in vs.render(recipe(**steps[-1]))}
    assert fresh.keys() == {known_by(s) for s in dataset}
    for sample in dataset:
        assert_same_frame(replace(fresh[known_by(sample)], split=sample.split), sample)  # quotas are those of each part
    assert [(p.first, p.frames) for p in dataset.plan.parts] == [(0, 12), (12, 6), (18, 0), (18, 10), (28, 4)]
    assert PlanRecord.from_json(dataset.plan.to_json()) == dataset.plan
    unchanged = tree_hash(out)
    for step in [{}, *steps]:
        summary = generate(recipe(**step), out, append=True)
        assert (summary.rendered, summary.frames) == (0, 32)
        assert "nothing to add" in summary.notes[-1]
    assert tree_hash(out) == unchanged


def test_a_model_that_is_something_else_is_refused_though_nothing_is_new(out):
    before = tree_hash(out)
    with pytest.raises(StoreError, match=r"expected category 'post box' of model 'post_box_000'.* found 'letter box'"):
        generate(recipe(models=[{**BOX, "category": "letter box"}]), out, append=True)
    assert tree_hash(out) == before


def test_appending_nothing_new_says_so(out):
    before = tree_hash(out)
    part = recipe(models=models(1), viewpoints={"azimuth": [120], "elevation": [50], "distance": 1.0})
    summary = generate(part, out, append=True)
    assert (summary.rendered, summary.frames) == (0, 12)
    assert "nothing to add" in summary.notes[-1]
    assert tree_hash(out) == before
    assert len(Dataset(out).plan.parts) == 1


@pytest.mark.slow
def test_random_viewpoints_go_on(tmp_path):
    sphere = {"kind": "sphere", "count": 3, "distance": 1.0}
    generate(recipe(viewpoints=sphere), tmp_path / "out", formats=[])
    summary = generate(recipe(viewpoints={**sphere, "count": 5}), tmp_path / "out", append=True, formats=[])
    assert (summary.rendered, summary.frames) == (4, 10)
    summary = generate(recipe(viewpoints={**sphere, "distance": 2.0}), tmp_path / "out", append=True, formats=[])
    assert summary.rendered == 6  # of the same names, but elsewhere


@pytest.mark.slow
def test_backgrounds_and_splits_by_frame_do_not_change(tmp_path):
    from PIL import Image

    pictures = tmp_path / "pictures"
    pictures.mkdir()
    for i in range(5):
        Image.new("RGB", (8, 6), (50 * i, 0, 0)).save(pictures / f"{i}.png")
    fixed = {"scene": {"background": {"images": str(pictures)}}, "splits": {"by": "frame", "train": 0.5, "val": 0.5}}
    generate(recipe(**fixed), tmp_path / "out", formats=[])
    grown = recipe(**fixed, **BIGGER)
    generate(grown, tmp_path / "out", append=True, formats=[])
    there = {known_by(s): s for s in Dataset(tmp_path / "out")}
    for sample in vs.render(grown):
        assert_same_frame(sample, there[known_by(sample)])
    Image.new("RGB", (8, 6)).save(pictures / "6.png")
    with pytest.raises(RecipeError, match="scene's images: expected what the data set has"):
        generate(recipe(**fixed, models=models(4)), tmp_path / "out", append=True)


@pytest.mark.slow
def test_company_stands_in_appended_frames(tmp_path):
    scene = {"scene": {"ground": True, "company": {"count": 1, "layout": [[1.0, 0, 30]]}}, "splits": {"by": "frame"}}
    far = {"azimuth": [0, 120], "elevation": [30], "distance": 3.0}
    generate(recipe(**scene, viewpoints=far), tmp_path / "out", formats=[])
    before = state(tmp_path / "out", "store/shots")
    grown = recipe(**scene, viewpoints={**far, "azimuth": [0, 60, 120]}, models=models(2, NEW_FIRST))
    generate(grown, tmp_path / "out", append=True, formats=["coco"])
    assert state(tmp_path / "out", "store/shots").items() >= before.items()
    dataset = Dataset(tmp_path / "out")
    fresh = {known_by(s): s for s in vs.render(grown)}
    assert len(dataset) == len(fresh) == 9
    for sample in dataset[4:]:
        assert_same_frame(fresh[known_by(sample)], sample)
    report = check(dataset)
    assert report.ok, report.findings
    with pytest.raises(RecipeError, match=r"channels: .* found company drawn from other models"):
        generate(
            recipe(**scene, viewpoints=far, channels=[*CHANNELS, "normals"], models=models(3)), tmp_path / "out", append=True
        )


def command(file, out, *options):
    return [sys.executable, "-m", "viewsphere", "render", str(file), "-o", str(out), *options]


@pytest.fixture
def bigger_file(tmp_path):
    file = tmp_path / "bigger.yaml"
    file.write_text(recipe(**BIGGER).to_yaml())
    return file


@pytest.mark.slow
@pytest.mark.parametrize("workers", [0, 2])
def test_any_number_of_workers_gives_the_same_bytes(workers, bigger_file, bigger, out):
    if workers:
        run = command(bigger_file, out, "--append", "--workers", str(workers))
        said = subprocess.run(run, check=True, timeout=DEADLINE, capture_output=True, text=True).stdout
    else:
        said = viewsphere("render", bigger_file, "-o", out, "--append", "--workers", 0).stdout
    assert "adds 20 frames (4 models x 8 poses less 12 that are there)" in said
    assert tree_hash(out) == tree_hash(bigger)


@pytest.mark.slow
def test_a_killed_run_goes_on_to_the_same_bytes(bigger_file, bigger, out):
    rng, before = random.Random(3), state(out, "store/shots", "store/models")
    there = len(list(out.glob("store/shots/*/*")))
    run = subprocess.Popen(
        command(bigger_file, out, "--append", "--workers", "2"),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    assert until(lambda: run.poll() is not None or len(list(out.glob("store/shots/*/*"))) > there)
    time.sleep(rng.uniform(0, 0.3))
    os.killpg(run.pid, signal.SIGKILL)
    run.wait(timeout=DEADLINE)
    assert viewsphere("render", bigger_file, "-o", out, "--append", "--workers", 0).returncode == 0
    assert tree_hash(out) == tree_hash(bigger)
    after = state(out, "store/shots", "store/models")
    assert {file: after[file] for file in before} == before


class Stopped(Exception):
    """Ctrl-C, as far as a run can tell."""


def stop_in(phase, done):
    def listen(progress):
        if (progress.phase, progress.done) == (phase, done):
            raise Stopped

    return listen


@pytest.mark.slow
@pytest.mark.parametrize("append", [True, False])
def test_an_interrupted_append_goes_on_with_and_without_the_option(append, bigger, out):
    with pytest.raises(Stopped):
        generate(recipe(**BIGGER), out, append=True, listener=stop_in("frames", 18))
    assert 12 < len(Dataset(out)) < 32
    with pytest.raises(StoreError, match=r"expected a finished data set to append to, found \d+ frames missing"):
        generate(recipe(models=models(4)), out, append=True)
    assert generate(recipe(**BIGGER), out, append=append).rendered < 20
    assert tree_hash(out) == tree_hash(bigger)


@pytest.mark.slow
def test_an_append_that_ended_among_its_models_leaves_no_trace(bigger, out):
    with pytest.raises(Stopped):
        generate(recipe(models=models(4)), out, append=True, listener=stop_in("models", 4))
    generate(recipe(**BIGGER), out, append=True)
    assert tree_hash(out) == tree_hash(bigger)


@pytest.mark.slow
def test_missing_shots_of_any_part_are_found_and_made_again(bigger, tmp_path):
    copy = shutil.copytree(bigger, tmp_path / "out")
    generate(recipe(**BIGGER, channels=[*CHANNELS, "normals"]), copy, append=True)
    whole_set, store = tree_hash(copy), Store(copy)
    lost = ["post_box_000-000002", "post_box_002-000004", "post_box_001-000000+2"]
    for key in lost:
        shutil.rmtree(store.shot_folder(key))
    messages = [f.message for f in check(Dataset(copy), rays=False).findings if f.check == "counts"]
    assert [m.split(":")[0] for m in messages] == [
        "expected 12 frames (part 1, recipe 'small'), found 10",
        "expected 20 frames (part 2, recipe 'small'), found 18",
        "expected 32 frames (normals of older frames, part 3, recipe 'small'), found 30",
    ]
    for key, message in zip(lost, messages, strict=True):
        assert f"shot {key} is the first of 1 missing" in message
    assert generate(recipe(), copy).rendered == 2
    assert generate(recipe(**BIGGER), copy).rendered == 2
    assert generate(recipe(**BIGGER, channels=[*CHANNELS, "normals"]), copy).rendered == 2
    assert tree_hash(copy) == whole_set


REFUSED = {
    "seed": ({"seed": 1}, "seed: expected 0, as the data set has; found 1"),
    "camera": ({"camera": {"size": [96, 72], "fov_deg": 36}}, "camera: expected"),
    "scene": ({"scene": {"ground": False}}, "scene: expected"),
    "engine": ({"engine": {"name": "raster", "antialias": 4}}, "engine: expected"),
    "engine option": ({"engine": {"name": "raster", "antialiased": 4}}, "did you mean 'antialias'"),
    "label_alpha": ({"label_alpha": 0.5}, "label_alpha: expected 0.01, as the data set has; found 0.5"),
    "bins": ({"viewpoints": {**POSES, "bins": 90}}, "viewpoints.bins: expected 45.0, as the data set has; found 90.0"),
    "target": ({"viewpoints": {**POSES, "target": [0, 0, 1]}}, "viewpoints.target: expected 'center'"),
    "shares": ({"splits": {"train": 0.5, "val": 0.5}}, "splits: expected train 0.7, val 0.3 by model, as the data set has"),
    "by": ({"splits": {"by": "pose"}}, "splits: expected .* by model, .* found .* by pose"),
    "supercategory": (
        {"models": [{**NEW_FIRST, "category": "post box", "supercategory": "x"}]},
        "expected supercategory '' for category 'post box', as the data set has; found 'x'",
    ),
    "capitals": ({"models": [{**NEW_FIRST, "name": "Post_Box"}]}, "more than capitals"),
    "other size": ({"models": [{**BOX, "count": 3, "scale": {"length": 0.4}}]}, "'post_box_000'.*changed"),
    "other category": ({"models": [{**BOX, "count": 3, "category": "box"}]}, "expected category 'post box' of model"),
    "a channel for some": ({"models": models(1), "channels": ["rgb", "normals"]}, "channels: .* no model 'post_box_001'"),
    "a channel for less": (
        {"viewpoints": {**POSES, "elevation": 15}, "channels": ["rgb", "normals"]},
        "channels: .* only 3 of 6 poses",
    ),
    "empty": ({"empty": 0.5, "models": models(3)}, "empty: expected null, as the data set has; found 0.5"),
    "inside the model": (
        {"viewpoints": {"azimuth": 0, "elevation": 0, "distance": 0.05}, "models": models(3)},
        "is inside the model",
    ),
}


QUICK = {"seed", "empty", "camera", "shares", "other size", "a channel for less", "inside the model"}


@pytest.mark.parametrize("name", [n if n in QUICK else pytest.param(n, marks=pytest.mark.slow) for n in REFUSED])
def test_what_does_not_fit_is_refused_and_nothing_changes(name, out):
    changes, message = REFUSED[name]
    before = state(out)
    with pytest.raises(UserError, match=message) as caught:
        generate(recipe(**changes), out, append=True)
    assert len(set(str(caught.value).splitlines())) <= 3  # a line for each model
    assert state(out) == before
    assert sorted(p.name for p in (out / "store" / "models").iterdir()) == ["post_box_000", "post_box_001"]


def test_old_models_may_not_change_splits(tmp_path):
    lists = {"splits": {"train": ["post_box_000"], "val": ["post_box_001"]}}
    generate(recipe(**lists), tmp_path / "out", formats=[])
    moved = {"splits": {"train": ["post_box_001", "post_box_002"], "val": ["post_box_000"]}}
    with pytest.raises(RecipeError, match="splits: expected model 'post_box_000' in 'train', where the data set has it"):
        generate(recipe(**moved, models=models(3)), tmp_path / "out", append=True)
    longer = {"splits": {"train": ["post_box_000"], "val": ["post_box_001", "post_box_002"]}}
    generate(recipe(**longer, models=models(3)), tmp_path / "out", append=True, formats=[])
    splits = {s.objects[0].key: s.split for s in Dataset(tmp_path / "out")}
    assert splits == {"post_box_000": "train", "post_box_001": "val", "post_box_002": "val"}


def test_a_zoo_model_whose_code_changed_is_refused(out, monkeypatch):
    import viewsphere_zoo as zoo
    from viewsphere_zoo.families import post_box

    def random(rng):
        return post_box.post_box_random(np.random.default_rng(int(rng.integers(9))))

    monkeypatch.setattr(zoo, "_digest", lambda family: "of other sources")
    monkeypatch.setattr(post_box, "FAMILY", post_box.FAMILY.model_copy(update={"random": random}))
    before = state(out)
    with pytest.raises(StoreError, match=r"model 'post_box_000' \(zoo:post_box\) changed"):
        generate(recipe(models=models(3)), out, append=True)
    assert state(out) == before


TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


@pytest.fixture
def of_files(tmp_path):
    """A data set of a model file, and a function from file names to recipes."""
    (tmp_path / "good.obj").write_text(TETRAHEDRON)
    (tmp_path / "new.obj").write_text(TETRAHEDRON.replace("v 0 0 1", "v 0 0 2"))

    def of(*names, **changes):
        sources = [str(tmp_path / name) for name in names]
        views = {"azimuth": [0, 90], "elevation": [15], "distance": 5.0}
        return recipe(**{"models": [{"source": sources, "category": "thing"}], "viewpoints": views, **changes})

    generate(of("good.obj"), tmp_path / "out", formats=[])
    return tmp_path / "out", of


def test_a_changed_model_file_is_refused(of_files, tmp_path):
    out, of = of_files
    before = state(out)
    (tmp_path / "good.obj").write_text(TETRAHEDRON.replace("v 1 0 0", "v 2 0 0"))
    with pytest.raises(StoreError, match=r"model 'good' .* changed since this data set was begun"):
        generate(of("good.obj", "new.obj"), out, append=True)
    assert state(out) == before
    assert generate(of("new.obj"), out, append=True, formats=[]).rendered == 2  # the old one need not be there


@pytest.mark.slow
def test_a_new_model_that_cannot_be_read_is_refused_or_left_out(of_files, tmp_path):
    out, of = of_files
    (tmp_path / "bad.obj").write_text("not a model\n")
    before = state(out)
    with pytest.raises(ModelError, match=r"bad\.obj"):
        generate(of("good.obj", "new.obj", "bad.obj"), out, append=True)
    assert state(out) == before
    assert not (out / "store" / "models" / "new").exists()
    summary = generate(of("good.obj", "new.obj", "bad.obj"), out, append=True, keep_going=True, formats=[])
    assert (summary.rendered, list(summary.skipped)) == (2, ["bad"])
    more = {"name": "more", "viewpoints": {"azimuth": 45, "distance": 5}}
    summary = generate(of("good.obj", "new.obj", **more), out, append=True)
    assert summary.rendered == 2  # what was left out does not count as missing
    report = check(Dataset(out))
    assert report.ok, report.findings
    assert any(note.startswith("bad was left out") for note in report.notes)


def test_another_version_s_data_are_refused(out):
    file = out / "store" / "plan.json"
    value = unsealed(file.read_text())
    file.unlink()
    file.write_text(sealed(value | {"version": "0.0.1", "parts": [part | {"version": "0.0.1"} for part in value["parts"]]}))
    before = state(out)
    with pytest.raises(StoreError, match=r"expected data made by viewsphere .*, found 0\.0\.1"):
        generate(recipe(models=models(3)), out, append=True)
    assert state(out) == before


def test_appending_to_what_is_no_data_set(tmp_path, bigger_file):
    (tmp_path / "thesis.tex").write_text("x")
    missing = "expected a folder that render wrote; found no such folder: check the path"
    foreign = "expected a data set (store/plan.json), found none: render one first"
    for folder, problem in ((tmp_path / "new", missing), (tmp_path, foreign)):
        said = viewsphere("render", bigger_file, "-o", folder, "--append")
        assert said.returncode == 2
        assert said.stderr == f"viewsphere: {folder}: {problem}\n"
        assert not said.stdout
    assert not (tmp_path / "new").exists()


def test_without_the_option_another_recipe_is_refused_with_a_hint(out):
    before = state(out)
    with pytest.raises(StoreError, match="--append"):
        generate(recipe(**BIGGER), out)
    assert state(out) == before


@pytest.mark.slow
def test_two_appends_at_once_do_not_mix(out):
    other = recipe(models=models(4))

    def meanwhile(progress):
        if progress.phase == "models" and progress.done == progress.total == 3:
            generate(other, out, append=True, formats=[])

    with pytest.raises(StoreError, match="another run"):
        generate(recipe(models=models(3)), out, append=True, listener=meanwhile)
    assert [p.frames for p in Dataset(out).plan.parts] == [12, 12]
    assert {m.key for m in Dataset(out).models} == {f"post_box_00{i}" for i in range(4)}
    report = check(Dataset(out), rays=False)
    assert report.ok, report.findings


@pytest.mark.slow
def test_large_data_sets_are_planned_fast_and_kept_small():
    views = {"azimuth": {"start": 0, "stop": 359, "step": 1}, "elevation": list(range(0, 80, 4)), "distance": 3.0}
    large = vs.plan(recipe(models=[{"source": "zoo:car", "count": 38}], viewpoints=views, shot_frames=None))
    more = {**views, "azimuth": {"start": 0, "stop": 359.5, "step": 0.5}}
    larger = vs.plan(recipe(models=[{"source": "zoo:car", "count": 40}], viewpoints=more, shot_frames=None))
    there = PlanRecord.from_json(whole(large).record.to_json())
    portion = extend(larger, there)
    text = portion.record.to_json()
    assert (there.frames, portion.part.frames, portion.record.frames) == (273_600, 302_400, 576_000)
    assert len(text) < 2_500_000
    assert [len(block.subjects) for block in portion.part.blocks] == [38, 2]
    assert all(len(block.positions) == 1 for block in portion.part.blocks)
    last = portion.record.indices[1][-1]
    shot = portion.shot(last, unit_box)
    assert shot.instants[-1].index == 575_999
    assert [f.index for f in shot.instants] == list(range(last.first, last.first + last.count))
    assert shot.instants[-1].viewpoint.azimuth_deg % 1 == 0.5


def test_poses_that_a_merged_data_set_has_twice_are_there():
    once = whole(vs.plan(recipe())).record
    first = once.parts[0]
    block = replace(first.blocks[0], subjects=("post_box_002",), positions=((6, 12),))
    again = replace(first, first=12, frames=6, blocks=(block,), new_poses=6, pose_names=joined_digests(names_of(once)))
    twice = replace(once, poses=12, frames=18, parts=(first, again))
    assert extend(vs.plan(recipe(models=models(3))), twice).adds_nothing
    more = extend(vs.plan(recipe(models=models(4), viewpoints=DENSER)), twice)
    assert [(block.subjects, block.positions) for block in more.part.blocks] == [
        (("post_box_000", "post_box_001", "post_box_002"), ((12, 14),)),
        (("post_box_003",), ((0, 6), (12, 14))),
    ]
    supplied = extend(vs.plan(recipe(models=models(3), channels=[*CHANNELS, "normals"])), twice)
    rows = [row for index, _ in supplied.record.supplements for row in index]
    assert (
        [supplied.shot(row, unit_box).instants[0].index for row in rows] == [row.first for row in rows] == list(range(0, 18, 2))
    )
    last = supplied.shot(rows[-1], unit_box)
    assert (last.things[0].model.key, last.channels) == ("post_box_002", ("normals",))
    seen = [now.viewpoint for now in last.instants]
    assert [(v.index, v.azimuth_deg, v.elevation_deg) for v in seen] == [(10, 120, 50), (11, 240, 50)]


@pytest.mark.slow
@given(st.lists(st.tuples(st.integers(0, 40), st.integers(1, 7)), min_size=1, max_size=5), st.integers(8, 20))
def test_folders_never_overflow_and_what_is_there_stays(spans, size):
    record, firsts = whole(vs.plan(recipe())).record, [0]
    for frames, _ in spans:
        firsts.append(firsts[-1] + frames)
    parts = tuple(
        replace(record.parts[0], first=first, frames=frames, max_objects=most)
        for first, (frames, most) in zip(firsts, spans, strict=False)
    )
    grown = [replace(record, parts=parts[:n], frames=firsts[n]) for n in range(1, len(parts) + 1)]
    objects, annotations = Counter(), set()
    for frame in range(firsts[-1]):
        last = grown[-1]
        assert {r.folder_of(frame, size) for r in grown if frame < r.frames} == {last.folder_of(frame, size)}
        objects[last.folder_of(frame, size)] += last.most_objects(frame)
        numbers = {last.annotation_id(frame, i) for i in range(1, last.most_objects(frame) + 1)}
        for r in grown:
            assert frame >= r.frames or {r.annotation_id(frame, i) for i in range(1, r.most_objects(frame) + 1)} == numbers
        assert not numbers & annotations
        annotations |= numbers
    assert not annotations or (min(annotations), max(annotations)) == (1, len(annotations))
    assert max(objects.values(), default=0) <= size
    if grown[0].frames * spans[0][1] > size + spans[0][1]:
        assert None not in objects


def moving_recipe(viewpoints, **changes):
    """A post box that moves, two instants from each viewpoint; sequences have splits of their own."""
    said = {
        "models": [{**BOX, "motion": {"kind": "constant", "velocity": [0.5, 0, 0]}}],
        "time": {"frames": 2, "fps": 10},
        "viewpoints": {"distance": 1.5, **viewpoints},
        "camera": {"size": [32, 24]},
        "channels": ["rgb", "flow"],
        "splits": {"by": "sequence", "train": 0.5, "val": 0.5},
        "formats": [],
    }
    return vs.Recipe.model_validate({**said, **changes})


@pytest.mark.slow
def test_appended_sequences_have_names_of_their_own(tmp_path):
    generate(moving_recipe({"azimuth": 30}), tmp_path / "out", workers=0)
    for azimuth in ([90, 30], 60):
        generate(moving_recipe({"azimuth": azimuth}), tmp_path / "out", workers=0, append=True)
    dataset = Dataset(tmp_path / "out")
    seen = {sample.sequence: sample.pose.azimuth_deg for sample in dataset}
    assert seen == {"post_box_000": 30, "post_box_000-000001": 90, "post_box_000-000002": 60}
    assert all(len(list(dataset.sequence(name, "camera"))) == 2 for name in dataset.sequences)
    report = check(dataset, sample=None)
    assert report.ok, report.findings


@pytest.mark.slow
def test_another_motion_of_the_camera_is_another_sequence(tmp_path):
    for distance in (1.5, 2.5):
        orbit = moving_recipe({"kind": "orbit", "elevation": 20, "distance": distance})
        generate(orbit, tmp_path / "out", workers=0, append=distance > 2)
    dataset = Dataset(tmp_path / "out")
    assert dataset.sequences == ("post_box_000", "post_box_000-000001")
    assert [round(sample.pose.distance, 6) for sample in dataset] == [1.5, 1.5, 2.5, 2.5]
    generate(orbit, tmp_path / "out", workers=0, append=True)
    assert len(Dataset(tmp_path / "out")) == 4
    generate(moving_recipe({"azimuth": 30}), tmp_path / "out", workers=0, append=True)
    assert Dataset(tmp_path / "out").sequences[2:] == ("post_box_000-000002",)
    shaken = moving_recipe({"kind": "orbit", "elevation": 20, "distance": 2.5, "shake": {"degrees": 1}})
    with pytest.raises(RecipeError, match=r"viewpoints\.shake: expected null, as the data set has; found a mapping"):
        generate(shaken, tmp_path / "out", workers=0, append=True)


def test_another_motion_of_a_model_needs_another_name(tmp_path):
    def moves(speed, **entry):
        return {**BOX, **entry, "motion": {"kind": "constant", "velocity": [speed, 0, 0]}}

    generate(moving_recipe({"azimuth": 30}, models=[moves(0.5)]), tmp_path / "out", workers=0)
    for other in (moves(0.7), BOX):
        with pytest.raises(
            RecipeError, match=r"models\[0\]\.motion: expected the motion of post_box_000 that the data set has"
        ):
            generate(moving_recipe({"azimuth": 30}, models=[other]), tmp_path / "out", workers=0, append=True)
    both = moving_recipe({"azimuth": 30}, models=[moves(0.7, name="fast"), moves(0.5)])
    generate(both, tmp_path / "out", workers=0, append=True)
    generate(moving_recipe({"azimuth": [30, 90]}, models=[moves(0.5)]), tmp_path / "out", workers=0, append=True)
    dataset = Dataset(tmp_path / "out")
    gone = {name: _way(dataset.sequence(name, "camera")) for name in dataset.sequences}
    expected = {"post_box_000": 0.05, "fast_000": 0.07, "post_box_000-000001": 0.05}
    assert gone == pytest.approx(expected)
    assert check(dataset, sample=None).ok


PLAYED = {"clip": "Run", "fps": 12}


@pytest.mark.slow
@pytest.mark.parametrize("field", PLAYED)
@pytest.mark.parametrize("time", [None, {"frames": 2, "fps": 10}])
def test_what_an_animated_model_plays_is_what_it_played(field, time, tmp_path, monkeypatch):
    let_walk(monkeypatch, tmp_path)
    plays = {"frames": [1, 13]} if time is None else {"motion": {"kind": "clip"}}
    person = {"source": str(tmp_path / "walker.fbx"), "category": "person", **plays}
    views = {
        "viewpoints": {"azimuth": 30, "elevation": 10, "distance": 4},
        "time": time,
        "formats": [],
        "channels": ["instances"],
    }
    first = recipe(**views, models=[BOX, person])
    generate(first, tmp_path / "out", workers=0)
    changed = recipe(**views, models=[BOX, {**person, field: PLAYED[field]}])
    with pytest.raises(
        RecipeError, match=rf"models\[1\]\.{field}: expected the {field} of walker that the data set has; found"
    ):
        generate(changed, tmp_path / "out", workers=0, append=True)
    renamed = recipe(**views, models=[BOX, person, {**person, "name": "fast", field: PLAYED[field]}])
    added = generate(renamed, tmp_path / "out", workers=0, append=True)
    assert added.rendered == 2
    assert {o.key for s in vs.open(tmp_path / "out") for o in s.objects} >= {"post_box_000"}


def test_drawn_lenses_are_compared_as_what_may_be_drawn(tmp_path):
    def lens(*degrees):
        camera = {"size": [96, 72], "fov_deg": {"choice": degrees}}
        return recipe(models=models(1), camera=camera, formats=[], channels=["instances"])

    first, others = lens(30, 50), (lens(30, 90), lens(90, 50))
    assert any(plan(first).intrinsics == plan(other).intrinsics for other in others)  # the one that stands for all
    generate(first, tmp_path / "out", workers=0)
    for other in others:
        with pytest.raises(RecipeError, match=r"^camera: expected .*the data set has; found .*: appended frames have to fit"):
            generate(other, tmp_path / "out", workers=0, append=True)
    assert generate(first, tmp_path / "out", workers=0, append=True).rendered == 0


def test_settings_are_computed_once_a_check(out, monkeypatch):
    there, calls = Store(out).plan(), []
    monkeypatch.setattr(fitting, "settings", lambda planned: calls.append(planned) or settings(planned))
    fitting.check_fit(plan(recipe(models=models(3))), replace(there, parts=there.parts * 3))
    assert len(calls) == 1


def _way(samples):
    """Metres along x from the first instant to the second."""
    first, second = (sample.objects[0].world_from_object[0][3] for sample in samples)
    return second - first
