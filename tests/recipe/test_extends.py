"""Recipes that extend others, and fields set from outside."""

import json

import pytest

from viewsphere.errors import RecipeError
from viewsphere.recipe.reading import extends
from viewsphere.recipe.reading.extends import assemble, parse_change
from viewsphere.recipe.reading.file import read
from viewsphere.recipe.recipe import Recipe

BASE = """\
name: base
models:
  - source: zoo:car
    count: 4
  - source: zoo:hair_drier
viewpoints:
  azimuth: [0, 90]
  elevation: [10, 20]
  distance: 5
camera: {size: [64, 48], fov_deg: 40}
scene:
  background: sky
  sun: {azimuth: 10}
"""


@pytest.fixture
def write(tmp_path):
    """Writes files by name, and gives the path of the last."""

    def write(**texts):
        for name, text in texts.items():
            file = tmp_path / f"{name.replace('__', '/')}.yaml"
            file.parent.mkdir(exist_ok=True)
            file.write_text(text)
        return file

    return write


def test_what_a_recipe_says_holds_and_the_rest_is_the_others(write):
    recipe = Recipe.load(write(base=BASE, own="extends: base.yaml\nname: own\nviewpoints: {elevation: 30}\n"))
    whole = Recipe.load(write(whole=BASE.replace("name: base", "name: own").replace("[10, 20]", "30")))
    assert recipe == whole
    assert recipe.digest == whole.digest


def test_lists_are_replaced_and_null_takes_a_field_away(write):
    recipe = Recipe.load(
        write(base=BASE, own="extends: base.yaml\nmodels: [{source: zoo:car}]\ncamera: {fov_deg: null, focal_px: 70}")
    )
    assert [(m.source, m.count) for m in recipe.models] == [(("zoo:car",), None)]
    assert recipe.camera.focal_px == (70, 70)
    assert recipe.camera.size == (64, 48)


def test_viewpoints_of_another_kind_keep_nothing_of_the_grid(write):
    own = "extends: base.yaml\nviewpoints: {kind: sphere, count: 7, distance: [3, 4]}\n"
    assert Recipe.load(write(base=BASE, own=own)).viewpoints.model_dump()["azimuth"] == (0.0, 360.0)


def test_later_recipes_hold_over_earlier_and_chains_are_followed(write):
    file = write(
        base=BASE, middle="extends: base.yaml\nseed: 3\nname: middle\n", night="scene: {sun: off}\nseed: 4\n",
        own="extends: [middle.yaml, night.yaml]\n",
    )  # fmt: skip
    recipe = Recipe.load(file)
    assert (recipe.name, recipe.seed, recipe.scene.sun) == ("middle", 4, "off")


def test_paths_start_from_the_file_they_are_written_in(write, tmp_path):
    base = """\
models:
  - {source: [a/*.obj, b.obj], category: x, real_size: sizes.csv}
  - {source: /abs/b.obj, category: x, real_size: file}
  - source: zoo:car
viewpoints: {kind: file, path: poses.csv}
scene: {background: {images: photos}}
"""
    recipe = Recipe.load(write(lib__base=base, own="extends: lib/base.yaml\n"))
    assert recipe.models[0].source == ("lib/a/*.obj", "lib/b.obj")
    assert recipe.models[0].real_size == "lib/sizes.csv"
    assert recipe.models[2].source == ("zoo:car",)
    assert (recipe.models[1].source, recipe.models[1].real_size) == (("/abs/b.obj",), "file")
    assert (recipe.viewpoints.path, recipe.scene.background.images) == ("lib/poses.csv", "lib/photos")
    below = Recipe.load(write(**{"base": base, "sub__own": "extends: ../base.yaml\n"}))
    assert below.viewpoints.path == "../poses.csv"
    assert (below.folder / below.viewpoints.path).resolve() == (tmp_path / "poses.csv").resolve()


def test_changes_set_fields_deep_in_the_recipe(write):
    changes = dict(map(parse_change, ["models[0].count=2", "viewpoints.elevation=[1, 2, 3]", "scene.sun=off", "shot_frames=9"]))
    recipe = Recipe.load(write(base=BASE), changes)
    assert recipe.models[0].count == 2
    assert recipe.viewpoints.elevation == (1, 2, 3)
    assert (recipe.scene.sun, recipe.shot_frames) == ("off", 9)
    assert Recipe.load(write(base=BASE), {"models": [{"source": "zoo:car"}], "scene.sun": None}).scene.sun == "auto"


def test_a_change_follows_yamls_rules():
    assert parse_change("a.b=[10,20]") == ("a.b", [10, 20])
    assert parse_change("a= 1e3 ") == ("a", 1000.0)
    assert parse_change("a=x=y") == ("a", "x=y")
    assert parse_change("a=") == ("a", None)


WRONG = [
    ("extends: nothing.yaml\n", r"own.yaml:1: extends: expected a recipe file; found none at .*nothing.yaml"),
    ("name: x\nextends: [3]\n", r"own.yaml:2: extends: expected the path of a recipe, or a list of them; found 3"),
    ("extends: own.yaml\n", r"own.yaml:1: extends: own.yaml extends itself, directly or through others"),
    ("extends: base.yaml\nscene: {sun: {elevation: 300}}\n", r"own.yaml:2: scene.sun.elevation: expected a number"),
    ("extends: base.yaml\nviewpoints: {tilt: x}\n", r"own.yaml:2: viewpoints.tilt"),
]


@pytest.mark.parametrize(("text", "message"), WRONG)
def test_a_mistake_is_named_where_it_was_written(write, text, message):
    with pytest.raises(RecipeError, match=message):
        Recipe.load(write(base=BASE, own=text))


def test_a_mistake_of_the_other_recipe_is_named_there(write):
    file = write(base=BASE.replace("fov_deg: 40", "fov_deg: 400"), own="extends: base.yaml\nseed: 2\n")
    with pytest.raises(RecipeError, match=r"base.yaml:10: camera.fov_deg: expected a number"):
        Recipe.load(file)


def test_circles_are_refused(write):
    file = write(a="extends: b.yaml\n", b="extends: a.yaml\n")
    with pytest.raises(RecipeError, match=r"b.yaml extends itself, directly or through others"):
        Recipe.load(file)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("viewpoints.elevation", r"--set viewpoints.elevation: expected field=value"),
        ("viewpoints..elevation=3", r"--set viewpoints..elevation: expected a field"),
        ("[0]=3", r"--set \[0\]: expected a field"),
        ("models[7].count=3", r"--set models\[7\].count: expected an index below 2; found 7"),
        ("name.x=3", r"--set name.x: expected a mapping to set x in; found 'base'"),
        ("viewpoints.elevation=[1,", r"--set viewpoints.elevation:1: expected an end of the list"),
        ("viewpoints.elevation=[100]", r"--set viewpoints.elevation: expected elevations of -90 to 90"),
        ("viewpoints.elevatoin=3", r"--set viewpoints.elevatoin: .*did you mean 'elevation'"),
    ],
)
def test_a_change_that_is_wrong_says_so(write, change, message):
    with pytest.raises(RecipeError, match=message):
        Recipe.load(write(base=BASE), dict([parse_change(change)]))


def test_each_file_is_read_once(write, monkeypatch):
    files = {"r0": BASE} | {f"r{i}": f"extends: [r{i - 1}.yaml, ./r{i - 1}.yaml]\n" for i in range(1, 26)}
    found = []
    monkeypatch.setattr(extends, "read", lambda path: found.append(path.name) or read(path))
    assert extends.assemble(write(**files))[0]["name"] == "base"
    assert sorted(found) == sorted(f"{name}.yaml" for name in files)


@pytest.mark.parametrize(
    ("field", "under", "over"),
    [
        ("sky", {"daylight": {"turbidity": 3}}, {"hdri": "a.exr"}),
        ("sky", {"hdri": "a.exr", "strength": 2}, {"night": {"moon": 0.2}}),
        ("sky", {"night": {"moon": 0.2}}, {"zenith": [0.1, 0.2, 0.3]}),
        ("background", {"images": "photos", "fit": "crop"}, {"color": [1, 0, 0]}),
        ("background", {"environment": True}, {"images": "photos"}),
        ("ground", {"material": "wood"}, {"image": "a.png"}),
    ],
)
def test_kinds_replace_one_another(tmp_path, field, under, over):
    (tmp_path / "base.yaml").write_text(json.dumps({"scene": {field: under}}))
    (tmp_path / "top.yaml").write_text(json.dumps({"extends": "base.yaml", "scene": {field: over}}))
    assert assemble(tmp_path / "top.yaml")[0]["scene"][field] == over


def test_a_kind_keeps_its_fields(tmp_path):
    (tmp_path / "base.yaml").write_text(json.dumps({"scene": {"sky": {"hdri": "a.exr"}}, "rig": {"sensors": {"a": {}}}}))
    over = {"extends": "base.yaml", "scene": {"sky": {"strength": 2}}, "rig": {"kind": "stereo", "baseline": 0.1}}
    (tmp_path / "top.yaml").write_text(json.dumps(over))
    data = assemble(tmp_path / "top.yaml")[0]
    assert data["scene"]["sky"] == {"hdri": "a.exr", "strength": 2}
    assert data["rig"] == {"kind": "stereo", "baseline": 0.1}
