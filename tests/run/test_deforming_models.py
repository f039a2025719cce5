"""A model that deforms, from its recipe to its exports: one model, one folder, and any of its time steps at any instant."""

from __future__ import annotations

import json
import shutil

import numpy as np
import pytest

from animated import TORN, let_walk, walker
from sealing import seal_again
from viewsphere import Dataset, Recipe, generate, plan
from viewsphere.assets.load import load_model
from viewsphere.check import check
from viewsphere.errors import RecipeError, StoreError
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import IDENTITY
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Motion, Thing, TimeStep
from viewsphere.run.datasets.importing import import_dataset
from viewsphere.run.datasets.merging import merge
from viewsphere.run.shots.stages import Stages
from viewsphere.scratch import of_this_process
from viewsphere.store import Choice, Store

FRAMES = (1, 13, TORN)
LABELS = [
    "instances",
    "depth",
    "parts",
    "materials",
    "coordinates",
    "nocs",
    "position",
    "panoptic",
    "normals",
    "surface_samples",
]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    let_walk(monkeypatch, tmp_path)
    return tmp_path


def recipe(folder, frames=FRAMES, **fields):
    models = [
        {"source": str(folder / "walker.fbx"), "category": "person", "frames": frames, "centring": "floor"},
        {"source": "zoo:chair", "category": "chair"},
    ]
    given = {
        "models": models,
        "viewpoints": {"azimuth": [20, 140], "elevation": 20, "distance": 3},
        "camera": {"size": [72, 54], "fov_deg": 45},
        "channels": ["rgb", *LABELS],
        "engine": {"name": "raster", "ambient_occlusion": "off"},
        "formats": [],
        "splits": {"train": 1},
    }
    return Recipe(**given | fields)


def shot_of_three(folder, engine="raster", **options):
    """A walker at three time steps, the second of which it shows where the first was, and a chair; from one camera."""
    planned = plan(recipe(folder, engine={"name": engine, **options}))
    stages = Stages()
    shots = [planned.shot(i, stages.box) for i in range(3)]
    chair = Thing(id=2, model=planned.spec("chair_000"), motion=Motion.still(at(0.9, 0.4)))
    steps = tuple(shot.things[0].step for shot in shots)
    body = Thing(id=1, model=shots[0].things[0].model, motion=Motion(poses=(IDENTITY, IDENTITY, at(0.3, 0.1)), steps=steps))
    instants = tuple(shot.instants[0] for shot in shots)
    return shots[0].model_copy(update={"things": (body, chair), "instants": instants, "key": "three", "sequence": "walk"})


def at(x, y):
    return ((1.0, 0.0, 0.0, x), (0.0, 1.0, 0.0, y), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))


def one_by_one(shot):
    """The shot cut into one of each instant."""
    for i in range(len(shot.instants)):
        alone = {"things": shot.things_at(i), "instants": shot.instants[i : i + 1], "first": shot.first + i}
        yield shot.model_copy(update=alone)


def values(dataset):
    return [(s.index, o.key, o.track, o.rle, o.size, o.box3d.tobytes()) for s in dataset for o in s.objects]


# Shots.


@pytest.mark.slow
def test_one_shot_shows_several_time_steps_and_its_samples_are_those_of_shots_of_one_each(folder):
    shot = Shot.model_validate_json(shot_of_three(folder).model_dump_json())
    together, stages = list(Stages().render(shot)), Stages()
    assert [s.objects[0].key for s in together] == [f"walker-f{frame:04d}" for frame in FRAMES]
    assert {s.objects[0].track for s in together} == {"walker"}
    assert {s.objects[1].key for s in together} == {"chair_000"}
    assert len({s.instances.tobytes() for s in together}) == 3
    keys = set()
    for whole, alone in zip(together, one_by_one(shot), strict=True):
        keys.add(alone.stage_key)
        (sample,) = stages.render(alone)
        assert all(sample.channels[name].tobytes() == whole.channels[name].tobytes() for name in ("rgb", *LABELS))
        for one, other in zip(sample.objects, whole.objects, strict=True):
            assert (one.key, one.model, one.rle, one.size) == (other.key, other.model, other.rle, other.size)
            assert one.box3d_object.tobytes() == other.box3d_object.tobytes()
    assert keys == {shot.stage_key}


def test_both_engines_show_them(folder, blender):
    raster, cycles = shot_of_three(folder), shot_of_three(folder, "cycles", samples=1, denoise="off")
    for ours, theirs in zip(Stages().render(raster), Stages().render(cycles), strict=True):
        assert all(ours.channels[name].tobytes() == theirs.channels[name].tobytes() for name in LABELS)
    pictures = [s.rgb.tobytes() for s in Stages().render(cycles)]
    assert len(set(pictures)) == 3
    assert pictures == [s.rgb.tobytes() for alone in one_by_one(cycles) for s in Stages().render(alone)]


@pytest.mark.slow
def test_what_is_seen_is_the_mesh_of_the_time_step(folder):
    """Coordinates of pixels lie in the box of the model at the time step, which reaches as far as its file says."""
    for sample, frame in zip(Stages().render(shot_of_three(folder)), FRAMES, strict=True):
        body, raw = sample.objects[0], walker(frame).bounds
        box = body.box3d_object
        np.testing.assert_allclose(np.ptp(box, axis=0), raw[1] - raw[0], atol=1e-6)
        np.testing.assert_allclose(box.min(axis=0), raw[0] - [0, 0, walker(1).bounds[0, 2]], atol=1e-6)
        seen = sample.coordinates[body.mask]
        assert (seen >= box.min(axis=0) - 1e-5).all()
        assert (seen <= box.max(axis=0) + 1e-5).all()


def test_time_steps_are_one_or_one_an_instant(folder):
    shot = shot_of_three(folder).model_dump()
    shot["things"][0]["motion"]["steps"] = shot["things"][0]["motion"]["steps"][:2]
    with pytest.raises(ValueError, match=r"one an instant \(3\); found 3 and 2"):
        Shot.model_validate(shot)


def test_motions_say_what_stays():
    step = TimeStep(frame=3)
    assert Motion().is_still
    assert not Motion(steps=(step,)).is_still
    assert Motion(steps=(step, None)).held(1) == Motion()
    assert Motion(poses=(IDENTITY, None), steps=(step,)).held(1) == Motion(poses=(None,), steps=(step,))
    body = Thing(id=1, model=ModelSpec(key="a", source="a.fbx", category="x", category_id=1), motion=Motion(steps=(None, step)))
    assert (body.key, body.still_at(1).key) == ("a", "a-f0003")


# Data sets.


@pytest.mark.slow
def test_a_data_set_keeps_one_model_of_all_time_steps(folder):
    generate(recipe(folder, formats=["coco", "native"]), folder / "out")
    dataset = Dataset(folder / "out")
    assert dataset.plan.models == ("walker", "chair_000")
    stored = folder / "out" / "store" / "models"
    assert sorted(p.name for p in stored.iterdir()) == ["chair_000", "walker"]
    files = {p.name for p in (stored / "walker").iterdir()}
    assert {"walker.glb", "walker.mtl", *(f"walker-f{f:04d}.obj" for f in FRAMES)} <= files
    assert not any(name.endswith(".glb") for name in files - {"walker.glb"})
    infos = {info.key: info for info in dataset.models}
    assert [*infos] == ["walker", *(f"walker-f{f:04d}" for f in FRAMES), "chair_000"]
    assert infos["walker"].box3d_object.tobytes() == infos["walker-f0001"].box3d_object.tobytes()
    assert infos["walker-f0013"].size != infos["walker"].size
    for s in dataset[:6]:
        o, info = s.objects[0], infos[s.objects[0].key]
        assert (o.track, o.model, o.size) == ("walker", f"store/models/walker/{o.key}.obj", info.size)
        assert o.key == f"walker-f{s.pose.time.frame:04d}"
        assert (folder / "out" / o.model).is_file()
    report = check(dataset, rays=True)
    assert report.ok, report


@pytest.mark.slow
def test_exports_name_the_files_and_come_back(folder):
    generate(recipe(folder, formats=["coco", "native"]), folder / "out")
    (instances,) = (folder / "out" / "coco" / "annotations").glob("instances_*.json")
    for models, root in (
        (json.loads(instances.read_text())["models"], folder / "out" / "coco"),
        (json.loads((folder / "out" / "native" / "dataset1.json").read_text())["vehicles"], folder / "out" / "native"),
    ):
        assert models["walker-f0013"]["model_file"] == "./MODELS/walker/walker-f0013.obj"
        assert (models["walker-f0013"]["animation"], models["walker-f0013"]["frame"]) == ("walker.glb", 13)
        assert all((root / model["model_file"]).is_file() for model in models.values())
        assert (root / "MODELS" / "walker" / "walker.glb").is_file()
    import_dataset("native", folder / "out" / "native", folder / "in")
    back = Dataset(folder / "in")
    assert [m.key for m in back.models] == [m.key for m in Dataset(folder / "out").models]
    assert back.plan.models == ("walker", "chair_000")
    for model in back.models:
        mesh, _ = load_model(folder / "in" / model.glb, node=model.node)
        assert np.allclose(np.ptp(mesh.bounds, axis=0)[[0, 2, 1]], np.ptp(model.box3d_object, axis=0), atol=1e-5)
    assert sorted(s.objects[0].track for s in back) == [""] * 2 + ["walker"] * 6


@pytest.mark.slow
def test_time_steps_are_chosen_by_their_keys(folder):
    generate(recipe(folder), folder / "out")

    def found(*models):
        return [s.index for s in Dataset(folder / "out", Choice(models))]

    assert found("walker") == [0, 1, 2, 3, 4, 5]
    assert found("walker-f0013") == [2, 3]
    assert found("*-f00*") == [0, 1, 2, 3, 4, 5]
    assert found("walker-f0002") == found("walk") == []
    assert [m.key for m in Dataset(folder / "out", Choice(("walker-f0013",))).models] == ["walker-f0013"]


@pytest.mark.slow
def test_appending_adds_time_steps_and_changes_nothing_that_was_there(folder):
    out = folder / "out"
    generate(recipe(folder, frames=[1, 25]), out)
    before, there = values(Dataset(out)), {info.key: info.digest for info in Dataset(out).models}
    objs = {p.name: p.read_bytes() for p in (out / "store/models/walker").glob("*.obj")}
    generate(recipe(folder, frames=[13, 25, TORN]), out, append=True)
    dataset = Dataset(out)
    infos = {info.key: info for info in dataset.models}
    assert [key for key in infos if key.startswith("walker-")] == [f"walker-f{f:04d}" for f in (1, 13, 25, TORN)]
    assert {key: infos[key].digest for key in there} == there
    assert {name: (out / "store/models/walker" / name).read_bytes() for name in objs} == objs
    assert values(dataset)[: len(before)] == before
    assert [s.pose.time.frame for s in dataset if s.pose.time] == [1, 1, 25, 25, 13, 13, TORN, TORN]
    assert check(dataset, rays=True).ok
    assert generate(recipe(folder, frames=[13, 25, TORN]), out, append=True).rendered == 0
    assert not [*(out / "store" / "writing").iterdir()]


@pytest.mark.slow
def test_a_model_whose_file_changed_is_not_added_to(folder, monkeypatch):
    generate(recipe(folder, frames=[1, 25]), folder / "out")
    (folder / "walker.fbx").write_bytes(b"limps")
    monkeypatch.setattr("animated.CORNERS", walker(1).vertices * 2)
    with pytest.raises(StoreError, match=r"model 'walker' .* changed since this data set was begun"):
        generate(recipe(folder, frames=[13]), folder / "out", append=True)
    assert check(Dataset(folder / "out")).ok


@pytest.mark.slow
def test_a_model_that_was_being_replaced_comes_back(folder):
    """A run that died between putting the old folder aside and the new one in its place."""
    out = folder / "out"
    generate(recipe(folder, frames=[1, 25]), out)
    store = Store(out)
    old = store.folder / "writing" / f"{of_this_process()}x" / "old" / "store" / "models"
    old.mkdir(parents=True)
    shutil.move(store.model_folder("walker"), old)
    store.make_ready()
    assert check(Dataset(out)).ok
    assert not [*(store.folder / "writing").iterdir()]


@pytest.mark.slow
def test_another_time_step_s_vertices_are_found_by_check(folder):
    """Two OBJ files, then two nodes of the GLB, change places; digests are made anew, so only labels can tell."""
    out = folder / "out"
    generate(recipe(folder), out)
    glb = out / "store/models/walker/walker.glb"
    data = glb.read_bytes()
    a, b, c = b"walker-f0001", b"walker-f0013", b"walker-f9999"
    glb.write_bytes(data.replace(a, c).replace(b, a).replace(c, b))
    seal_again(out)
    report = check(Dataset(out), rays=True)
    assert {finding.frame for finding in report.findings} >= {0, 1, 2, 3}


@pytest.mark.slow
def test_equal_models_merge_and_others_stay_apart(folder):
    for name, frames, azimuth in (("a", FRAMES, [20]), ("b", FRAMES, [80]), ("c", (1, 25), [80])):
        viewpoints = {"azimuth": azimuth, "elevation": 20, "distance": 3}
        generate(recipe(folder, frames=frames, viewpoints=viewpoints), folder / name)
    merged = merge([folder / "a", folder / "b"], folder / "ab")
    assert merged.plan.models == ("walker", "chair_000")
    other = merge([folder / "a", folder / "c"], folder / "ac")
    assert other.plan.models == ("walker", "chair_000", "walker-2")
    last = [s.objects[0] for s in other if s.objects[0].track == "walker-2"]
    assert [o.key for o in last] == ["walker-2-f0001", "walker-2-f0025"]
    assert all((folder / "ac" / o.model).is_file() for o in last)
    for dataset in (merged, other):
        report = check(dataset, rays=True)
        assert report.ok, report


@pytest.mark.slow
def test_a_time_step_has_the_key_of_no_other_model(folder):
    (folder / "walker-f0013.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 1\nf 1 2 3\n")
    still = {"source": str(folder / "walker-f0013.obj"), "category": "sheet"}
    moves = recipe(folder).models[0].model_dump(exclude_unset=True)
    with pytest.raises(RecipeError, match="found 'walker-f0013' twice"):
        plan(recipe(folder, models=[moves, still]))
    generate(recipe(folder, models=[still]), folder / "sheet")
    with pytest.raises(RecipeError, match="expected another name for 'walker'; found 'walker-f0013'"):
        generate(recipe(folder, models=[moves]), folder / "sheet", append=True)
    generate(recipe(folder, models=[moves]), folder / "out")
    with pytest.raises(StoreError, match="expected another name for 'walker-f0013'"):
        generate(recipe(folder, models=[still]), folder / "out", append=True)
