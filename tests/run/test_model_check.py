"""What `plan` finds without a mesh, what `plan --models` finds in meshes, and what `new` makes of a folder's models."""

import json

import pytest

import viewsphere as vs
from command_line import viewsphere
from small import small_recipe, tree_hash
from viewsphere.composing import layouts
from viewsphere.errors import MissingExtraError, ModelError, RecipeError, StoreError
from viewsphere.run.datasets import converting
from viewsphere.run.shots.models import check_models

HOUSE = "v 0 0 0\nv 103 0 0\nv 103 50 0\nv 0 50 60\nf 1 2 3\nf 1 3 4\nf 1 2 4\n"
RECIPE = """name: houses
models:
  - {source: "*.obj", category: house}
viewpoints: {azimuth: [0, 180], elevation: 15, distance: 600}
camera: {size: [48, 32], fov_deg: 30}
channels: [rgb, instances]
formats: []
splits: {train: 1}
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "house.obj").write_text(HOUSE)
    (tmp_path / "recipe.yaml").write_text(RECIPE)
    return tmp_path


def planned(folder, old="", new=""):
    text = RECIPE.replace(old, new) if old else RECIPE
    assert text != RECIPE or not old
    (folder / "recipe.yaml").write_text(text)
    return vs.plan(folder / "recipe.yaml")


def test_plan_reads_no_mesh_and_models_reads_all(folder):
    (folder / "empty.obj").write_text("v 0 0 0\n")
    (folder / "text.obj").write_text("hm\n")
    found = planned(folder)
    assert found.models == 3
    with pytest.raises(ModelError) as caught:
        check_models(found)
    assert [line.split(":")[0] for line in str(caught.value).splitlines()] == [
        str(folder / n) for n in ("empty.obj", "text.obj")
    ]


def test_the_command_reads_models_where_it_is_asked_to(folder):
    assert viewsphere("plan", folder / "recipe.yaml").returncode == 0
    told = viewsphere("plan", folder / "recipe.yaml", "--models", "--json")
    assert told.returncode == 0 and json.loads(told.stdout)["models"] == 1
    (folder / "house.obj").write_text("hm\n")
    assert viewsphere("plan", folder / "recipe.yaml").returncode == 0
    told = viewsphere("plan", folder / "recipe.yaml", "--models")
    assert told.returncode == 2 and "house.obj: no triangles found" in told.stderr


@pytest.mark.parametrize(
    "command", [("plan", "--models"), ("preview", "-o", "p.png"), ("render", "-o", "out", "--workers", "0")]
)
def test_a_camera_inside_of_a_large_model_asks_for_millimetres(command, folder):
    planned(folder, "distance: 600", "distance: 0.6")
    name, *words = command
    told = viewsphere(name, "recipe.yaml", *words, cwd=folder)
    assert told.returncode == 2
    assert "viewpoints.distance: `distance` 0.6 m is inside the model, which reaches 64.6 m" in told.stderr
    assert "If the model is in millimetres, set `unit: mm`" in told.stderr
    planned(folder, "distance: 600", "distance: 20")
    told = viewsphere(name, "recipe.yaml", *words, cwd=folder)
    assert told.returncode == 2 and "set `unit: mm`" in told.stderr
    planned(folder, "category: house}", "category: house, unit: mm}")
    assert viewsphere(name, "recipe.yaml", *words, cwd=folder).returncode == 0


def test_a_camera_inside_of_a_small_model_asks_for_a_distance():
    with pytest.raises(RecipeError, match=r"inside the model, which reaches .* Set a larger `distance`"):
        list(vs.render(small_recipe(viewpoints={"azimuth": 0, "elevation": 0, "distance": 0.01})))


@pytest.mark.parametrize(
    ("suffix", "more", "message"),
    [
        ("step", "", r"models\[0\]\.source: .*part\.step: STEP \(CAD\) files are not read; convert it"),
        ("txt", "", r"models\[0\]\.source: .*part\.txt: expected a model file with suffix"),
        ("obj", ", forward: +y", r"models\[0\]\.forward: \+y lies along \+y, which is up in obj files\. Set `up:`"),
        ("glb", ", forward: -y", r"models\[0\]\.forward: -y lies along \+y, which is up in glb files"),
        ("stl", ", forward: +z", r"models\[0\]\.forward: \+z lies along \+z, which is up in stl files"),
    ],
)
def test_a_file_that_cannot_be_read_as_asked_is_refused_by_its_name(suffix, more, message, folder):
    (folder / f"part.{suffix}").touch()
    with pytest.raises(RecipeError, match=message):
        planned(folder, '"*.obj", category: house', f"part.{suffix}, category: house{more}")


@pytest.mark.parametrize("more", [", up: +z, forward: +y", ", forward: -z", ", forward: +x"])
def test_a_forward_beside_the_up_axis_is_taken(more, folder):
    assert planned(folder, "category: house", f"category: house{more}").models == 1


def test_a_forward_along_the_up_axis_that_the_file_names_is_refused_when_it_is_read(tmp_path):
    from viewsphere.assets.normalise import axes
    from viewsphere.assets.primitive import FileFacts
    from viewsphere.run.reports.inspection import model_spec

    facts = FileFacts(tmp_path / "a.dae", "dae", "+z", "-y", 1.0)
    with pytest.raises(ModelError, match=r"a\.dae: `forward: \+z` lies along \+z, which is up in this file"):
        axes(model_spec("a.dae", forward="+z"), facts)
    assert axes(model_spec("a.dae", up="+y"), facts) == ("+y", "+z")


@pytest.mark.parametrize(("layout", "orientation"), [("fall", "upright"), ("stack", "upright"), ("scatter", "stable")])
def test_a_missing_extra_is_named_when_planned(layout, orientation, monkeypatch):
    found = layouts.find_spec
    monkeypatch.setattr(layouts, "find_spec", lambda name: None if name in ("mujoco", "scipy") else found(name))
    scenes = {"count": 1, "objects": 1, "layout": layout, "orientation": orientation}
    with pytest.raises(MissingExtraError, match=r"^scenes\.(layout|orientation): .* needs .*scipy.*'viewsphere\[physics\]'"):
        vs.plan(small_recipe(scenes=scenes, splits={"by": "scene", "train": 1}))


def test_listed_shots_know_no_centre_of_the_models(folder):
    """A model far from the origin, seen by a camera that looks at it: nothing to warn of."""
    pose = [[1, 0, 0, 500], [0, 0, 1, 0], [0, -1, 0, 30], [0, 0, 0, 1]]
    thing = {"model": "house", "world_from_object": [[1, 0, 0, 500], [0, 1, 0, 400], [0, 0, 1, 0], [0, 0, 0, 1]]}
    camera = {"width": 48, "height": 32, "fx": 60, "fy": 60, "cx": 24, "cy": 16}
    shot = {"name": "one", "world_from_camera": pose, "camera": camera, "objects": [thing]}
    (folder / "shots.jsonl").write_text(json.dumps(shot) + "\n")
    old = "viewpoints: {azimuth: [0, 180], elevation: 15, distance: 600}\ncamera: {size: [48, 32], fov_deg: 30}\n"
    new = "viewpoints: {kind: file, path: shots.jsonl}\nscenes: {sampler: listed}\ncamera: {of_viewpoints: true}\n"
    (folder / "recipe.yaml").write_text(RECIPE.replace(old, new).replace("{train: 1}", "{by: frame, train: 1}"))
    found = vs.plan(folder / "recipe.yaml")
    assert not [line for line in found.warnings if "centre" in line]


def test_a_deleted_model_is_named(folder):
    (folder / "shed.obj").write_text(HOUSE)
    vs.generate(folder / "recipe.yaml", folder / "out", workers=0)
    (folder / "shed.obj").unlink()
    with pytest.raises(StoreError, match=r"out: this folder was rendered with other model files: `shed` is not in the recipe"):
        vs.generate(folder / "recipe.yaml", folder / "out", workers=0)


def test_a_full_disk_is_no_fault_of_the_source(small_run, tmp_path, monkeypatch):
    def full(dataset, *others):
        raise StoreError(f"{dataset.root}/rgb/00000001.png: No space left on device")

    monkeypatch.setattr(converting, "write", full)
    with pytest.raises(StoreError) as caught:
        vs.convert("coco", small_run / "coco", ["yolo"], tmp_path / "new")
    assert str(caught.value).startswith(f"{tmp_path / 'new'}: the disk takes no more data (No space left on device)")


@pytest.mark.parametrize("kind", ["poses", "detector", "pose6d", "in-memory", "blender"])
def test_new_takes_the_models_that_lie_in_the_folder(kind, tmp_path):
    folder = tmp_path / "my things"
    for name in ("a.obj", "b.OBJ", "old chairs/c.glb", "old chairs/#1.glb", ".hidden/d.obj", "notes.txt"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(HOUSE)
    told = viewsphere("new", folder, "--kind", kind)
    assert told.returncode == 0 and "of 4 model files" in told.stdout
    recipe = vs.Recipe.load(folder / "recipe.yaml")
    assert recipe.name == "my things"
    assert {entry.category for entry in recipe.models} == {"my things", "old chairs"}
    found = vs.plan(recipe)
    assert sorted(spec.source.rsplit("/", 1)[1] for spec in found.model_specs) == ["#1.glb", "a.obj", "b.OBJ", "c.glb"]


def test_new_in_an_empty_folder_starts_from_the_zoo(tmp_path):
    (tmp_path / "empty").mkdir()
    viewsphere("new", tmp_path / "empty")
    viewsphere("new", tmp_path / "fresh")
    assert tree_hash(tmp_path / "empty") == tree_hash(tmp_path / "fresh")
    assert vs.Recipe.load(tmp_path / "empty" / "recipe.yaml").models[0].source == ("zoo:car",)


def test_usd_models_need_blender_only_without_usd_core(folder, monkeypatch):
    def none():
        raise MissingExtraError("no Blender here")

    (folder / "house.usda").write_text("#usda 1.0\n")
    monkeypatch.setattr("viewsphere.blender.interpreter.find_blender", none)
    monkeypatch.setattr("viewsphere.assets.readers.missing", lambda reader: [])
    assert planned(folder, '"*.obj"', "house.usda").frames == 2
    monkeypatch.setattr("viewsphere.assets.readers.missing", lambda reader: [*reader.packages])
    with pytest.raises(MissingExtraError, match="no Blender here"):
        planned(folder, '"*.obj"', "house.usda")
