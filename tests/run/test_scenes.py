"""Whole runs with a place, company and planes: rendered, checked, resumed, refused."""

import shutil

import numpy as np
import pytest

import viewsphere
from built_once import built_once
from place_files import HOUSE, blocks, write_picture, write_place
from sealing import seal_again
from small import small_recipe, tree_hash
from viewsphere.assets.exporting.glb import glb_bytes
from viewsphere.check import check
from viewsphere.errors import ModelError, UserError
from viewsphere.preview import preview_samples
from viewsphere.recipe.recipe import Recipe
from viewsphere.run.generate import generate
from viewsphere.run.memory import render
from viewsphere.store import Dataset

COMPANY = {"count": 1, "gap": 0.05}


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("files")
    write_place(folder / "yard.glb")
    write_picture(folder / "pictures" / "a.png")
    write_picture(folder / "pictures" / "b.png", (40, 160, 60), (30, 30))
    return folder


def scene(files, labels="background", draw="fixed"):
    own = {"category": "yard"} if labels == "own" else {}
    poster = {"category": "poster"} if labels == "own" else {}
    return {
        "place": {"source": str(files / "yard.glb"), "labels": labels, **own},
        "company": {**COMPANY, "draw": "per_frame" if draw == "per_frame" else "per_model"},
        "planes": [
            {
                "images": str(files / "pictures"), "height": 0.5, "around": {"distance": [0.5, 0.9], "azimuth": [120, 240]},
                "labels": labels, "draw": draw, "share": 0.7, "count": 2, **poster,
            }
        ],
    }  # fmt: skip


def made(files, out, labels="background", draw="fixed", workers=0, **changes):
    recipe = small_recipe(
        scene=scene(files, labels, draw),
        splits={"by": "frame"},
        viewpoints={"azimuth": [20, 200], "elevation": 25, "distance": 1.4},
        **changes,
    )
    return recipe, generate(recipe, out, workers=workers)


@pytest.fixture(scope="module")
def whole(files, tmp_path_factory):
    out = tmp_path_factory.mktemp("whole") / "ds"
    recipe, _ = made(files, out)
    return recipe, Dataset(out)


@pytest.mark.slow
def test_a_scene_is_rendered_checked_and_resumed(files, whole):
    recipe, dataset = whole
    report = check(dataset)
    assert report.ok, [str(f) for f in report.findings]
    assert report.checked["surface"] == len(dataset) == 4 and report.checked["coco"] == 4
    assert "surface" not in report.not_run
    before = tree_hash(dataset.root)
    assert generate(recipe, dataset.root).rendered == 0
    assert tree_hash(dataset.root) == before
    lost = next((dataset.root / "store" / "shots").glob("*/*"))
    shutil.rmtree(lost)
    assert generate(recipe, dataset.root).rendered == 2
    assert tree_hash(dataset.root) == before
    assert len(dataset.models) == 2 and dataset.max_objects == 2


def test_memory_and_store_hold_the_same(whole):
    recipe, dataset = whole
    for stored, sample in zip(dataset, render(recipe), strict=True):
        for name in sample.channels:
            np.testing.assert_array_equal(stored.channels[name], sample.channels[name])
        assert [o.visibility for o in stored.objects] == [o.visibility for o in sample.objects]
        assert stored.pose == sample.pose


@pytest.mark.slow
def test_labelled_scenery_becomes_objects_with_models(files, tmp_path):
    _, summary = made(files, tmp_path / "ds", labels="own", draw="per_frame")
    dataset = Dataset(tmp_path / "ds")
    assert summary.frames == 4
    report = check(dataset)
    assert report.ok, [str(f) for f in report.findings]
    assert [c.name for c in dataset.categories] == ["post box", "yard", "poster"]
    names = {o.category for s in dataset for o in s.objects}
    assert names == {"post box", "yard", "poster"}
    assert len(dataset.models) == 5  # two boxes, the yard, two pictures
    assert dataset.max_objects == 2 + 1 + 2
    sample = dataset[0]
    assert set(np.unique(sample.categories)) - {0} == {o.category_id for o in sample.objects if o.area}
    yard = sample.objects[2]
    assert yard.category == "yard" and 0 < yard.visibility < 1 and yard.box3d_object[4, 2] == pytest.approx(HOUSE[1][2])


@pytest.mark.slow
def test_any_number_of_workers_makes_the_same(files, whole, tmp_path):
    made(files, tmp_path / "ds", workers=2)
    assert tree_hash(tmp_path / "ds") == tree_hash(whole[1].root)


@pytest.mark.slow
def test_the_proof_covers_the_scenery(whole, tmp_path):
    """A post that the store knows nothing of is found by its pixels; scenery that has changed is named."""
    _, dataset = whole
    copied = tmp_path / "copy"
    shutil.copytree(dataset.root, copied)
    record = next((copied / "store" / "shots").glob("*/*/scenery.json"))
    record.unlink()
    assert any(f.check == "digests" for f in check(Dataset(copied)).findings)
    seal_again(copied)
    found = {f.check for f in check(Dataset(copied)).findings}
    assert {"surface", "depth"} <= found
    shutil.rmtree(copied)
    shutil.copytree(dataset.root, copied)
    for record in (copied / "store" / "shots").glob("*/*/scenery.json"):
        text = record.read_text()
        record.write_text(text.replace("yard.glb", "gone.glb"))
    seal_again(copied)
    report = check(Dataset(copied))
    assert {f.check for f in report.findings} == {"recipe"}
    assert report.not_run["background"].startswith("background not checked where scenery-yard")


@pytest.mark.slow
def test_what_cannot_stand_there_is_refused_in_one_line(files, tmp_path):
    def problem(scene, viewpoints=None):
        recipe = small_recipe(
            scene=scene, splits={"by": "frame"}, viewpoints=viewpoints or {"azimuth": [0, 90], "elevation": 0, "distance": 2}
        )
        with pytest.raises(UserError) as caught:
            generate(recipe, tmp_path / "ds")
        assert "\n" not in str(caught.value)
        with pytest.raises(UserError) as in_memory:
            list(render(recipe))
        assert type(in_memory.value) is type(caught.value)
        shutil.rmtree(tmp_path / "ds", ignore_errors=True)
        return str(caught.value)

    # the house is 3 to 6 m along X and 2 to 5 m along Y; the model stands 1 m before its front
    place = {"source": str(files / "yard.glb")}
    inside = {**place, "origin": [4.5, 1, 0]}
    found = problem({"place": inside}, {"azimuth": 180, "elevation": 0, "distance": 2})
    assert "viewpoints: expected the camera outside of all that is placed; found it at (" in found
    assert "inside piece scenery-yard-" in found
    high = {"azimuth": 180, "elevation": 60, "distance": 5}
    list(render(small_recipe(scene={"place": inside}, viewpoints=high)))
    room = {**place, "origin": [4.5, 3.5, 0]}  # where the model stands in the house, the camera may
    list(render(small_recipe(scene={"place": room}, viewpoints={"azimuth": 0, "elevation": 0, "distance": 1})))
    assert "company.layout: expected 0.3 m between all" in problem({"company": {"layout": [[0.05, 0, 0]]}})
    picture = str(files / "pictures" / "a.png")
    assert "planes[0].at" in problem({"planes": {"image": picture, "height": 1, "at": [0, 0, 0]}})
    assert "is inside the model" in problem(
        {"company": {"layout": [[2, 0, 0]]}}, {"azimuth": 90, "elevation": 0, "distance": 1}
    )
    around = {"azimuth": {"start": 0, "stop": 360, "step": 10}, "elevation": 0, "distance": 0.2}
    company = {"count": 1, "gap": 0.05, "draw": "per_frame"}
    list(
        render(small_recipe(scene={"company": company}, viewpoints=around, splits={"train": 1}))
    )  # company is drawn until no camera is inside
    (tmp_path / "bad.glb").write_text("no model")
    with pytest.raises(ModelError, match=r"bad.glb"):
        list(render(small_recipe(scene={"place": str(tmp_path / "bad.glb")})))


@pytest.mark.slow
def test_a_model_left_out_takes_the_shots_it_would_be_in_with_it(files, tmp_path):
    (tmp_path / "bad.obj").write_text("nothing")
    (tmp_path / "good.glb").write_bytes(glb_bytes(blocks(((-0.1, -0.2, 0), (0.1, 0.2, 0.2)))))
    (tmp_path / "other.glb").write_bytes(glb_bytes(blocks(((-0.1, -0.1, 0), (0.1, 0.1, 0.3)))))
    models = [{"source": [str(tmp_path / n) for n in ("bad.obj", "good.glb", "other.glb")], "category": "block"}]
    recipe = small_recipe(models=models, scene={"company": 2}, splits={"by": "frame"})
    with pytest.raises(ModelError):
        generate(recipe, tmp_path / "ds")
    recipe = small_recipe(models=models, scene={"company": {"layout": [[1, 0, 0]]}}, splits={"by": "frame"})
    summary = generate(recipe, tmp_path / "ds2", keep_going=True)
    assert "bad" in summary.skipped
    beside = [k for k, reason in summary.skipped.items() if "in it stands bad" in reason]
    assert summary.frames == 6 * 3 - 6 - 2 * len(beside)
    report = check(Dataset(tmp_path / "ds2"))
    assert report.ok, [str(f) for f in report.findings]


def test_a_preview_draws_scenes_of_their_own_for_frames(files):
    recipe = small_recipe(scene=scene(files, draw="per_frame"), splits={"by": "frame"})
    samples = list(preview_samples(recipe, 4, 64))
    assert len(samples) == 4 and all(len(s.objects) == 2 for s in samples)


@pytest.mark.slow
def test_a_car_on_the_street_of_the_zoo(tmp_path):
    recipe = Recipe(
        models=[{"source": "zoo:car", "count": 2}],
        viewpoints={"azimuth": [20, 200], "elevation": 12, "distance": 10},
        camera={"size": [160, 120], "fov_deg": 50},
        splits={"by": "frame"},
        scene={"place": "zoo:neighbourhood", "company": 1},
        engine={"name": "raster", "bounces": "off"},
    )
    with built_once():
        generate(recipe, tmp_path / "ds")
        dataset = viewsphere.open(tmp_path / "ds")
        report = check(dataset)
    assert report.ok, [str(f) for f in report.findings]
    assert all(len(s.objects) == 2 and s.objects[0].visibility > 0.3 for s in dataset)
