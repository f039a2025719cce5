"""What a new user mistypes is one line that says where, what was expected, what was found and what to do."""

import json
import re

import pytest

import viewsphere as vs
from command_line import viewsphere
from small import small_recipe
from viewsphere.errors import MOST_TOLD, RecipeError, StoreError, UserError
from viewsphere.planning.plan import plan
from viewsphere.preview.sides import facing
from viewsphere.recipe.recipe import Recipe
from viewsphere.run.generate import generate
from viewsphere.run.reports.inspection import inspect_model, model_spec


def one_line(*words):
    answer = viewsphere(*words)
    assert answer.returncode == 2
    assert answer.stderr.count("\n") == 1
    return answer.stderr


@pytest.mark.parametrize(
    ("text", "line", "sign", "column"),
    [
        ('models:\n  - source: "zoo:car\nseed: 1\n', 2, '"', 13),
        ("name: 'abc", 1, "'", 7),
        ("seed: 1\nmodels: [{source: zoo:car}\nname: x\n", 2, "[", 9),
        ("seed: 1\ncamera: {size: [64, 48], fov_deg: 40\n", 2, "{", 9),
    ],
)
def test_what_is_not_closed_is_told_where_it_begins(text, line, sign, column, tmp_path):
    file = tmp_path / "recipe.yaml"
    file.write_text(text)
    with pytest.raises(RecipeError) as caught:
        Recipe.load(file)
    assert re.match(f"{re.escape(str(file))}:{line}: expected (an|a comma or the) end of the ", str(caught.value))
    assert f"that begins with {sign} in column {column}; found" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("sign", "[{'\"")
@pytest.mark.parametrize("end", ["", "\n", " ", "\n# the end\n"])
@pytest.mark.parametrize("before", ["", "seed: 1\nname: ", "seed: 1\nscene: {sky: [a, ", "seed: 1\nscene: [{sky: "])
def test_what_is_opened_last_of_all_is_told_where_it_begins(sign, end, before, tmp_path):
    file = tmp_path / "recipe.yaml"
    file.write_text(before + sign + end)
    with pytest.raises(RecipeError) as caught:
        Recipe.load(file)
    kind = {"[": "list", "{": "mapping"}.get(sign, "quoted text")
    line, column = before.count("\n") + 1, len(before.rpartition("\n")[2]) + 1
    what = f"the {kind} that begins with {sign} in column {column}"
    assert str(caught.value) == f"{file}:{line}: expected an end of {what}; found the end of the file: close it"


@pytest.mark.parametrize(
    "text", ["name: [a", "name: [a, b", "name: {a: 1", "name: {a: 1'", "name: [a]\nscene: [{b: [c], d: 1}, {e: [", "a: [b:"]
)
@pytest.mark.parametrize("end", ["", "\n"])
def test_what_is_not_closed_before_the_end_is_one_line(text, end, tmp_path):
    file = tmp_path / "recipe.yaml"
    file.write_text(text + end)
    with pytest.raises(RecipeError) as caught:
        Recipe.load(file)
    sign = max(text.rfind("["), text.rfind("{"))
    line, column = text.count("\n", 0, sign) + 1, sign - text.rfind("\n", 0, sign)
    assert str(caught.value).startswith(f"{file}:{line}: expected an end of the ")
    assert f"that begins with {text[sign]} in column {column}; found the end of the file: close it" in str(caught.value)


def test_zoo_families_are_known_to_plans():
    with pytest.raises(RecipeError, match=r"models\[0\]\.source: zoo: 'cars' is unknown; did you mean 'car'"):
        plan(small_recipe(models=[{"source": "zoo:cars", "category": "car"}]))


BAD_MODELS = """name: x
models:
  - {source: zoo:cars, category: car}
  - {source: zoo:chair, category: chair}
  - {source: nowhere.glb, category: thing}
  - {source: empty/*.glb, category: thing}
viewpoints: {azimuth: 0, distance: 3}
camera: {size: [32, 24], fov_deg: 40}
"""


@pytest.mark.parametrize("more", ["", "scenes: {count: 2, objects: 1}\n"])
@pytest.mark.parametrize("command", ["plan", "preview"])
def test_the_mistakes_of_all_models_are_told_together(command, more, tmp_path):
    file = tmp_path / "recipe.yaml"
    file.write_text(BAD_MODELS + more)
    answer = viewsphere(command, file, *(["-o", tmp_path / "p.png"] if command == "preview" else []))
    assert answer.returncode == 2
    wanted = [(3, "models[0].source: zoo: 'cars' is unknown"), (5, "models[2].source: "), (6, "models[3].source: ")]
    lines = answer.stderr.splitlines()
    assert len(lines) == len(wanted)
    for line, (number, begun) in zip(lines, wanted, strict=True):
        assert line.startswith(f"viewsphere: {file}:{number}: {begun}")


def test_sizes_and_categories_of_all_models_are_told_together(tmp_path):
    (tmp_path / "sizes.csv").write_text("name,width,height,length\nc,1,1,1\n")
    entries = [{"source": f"{name}.obj", "category": "thing", "real_size": "sizes.csv"} for name in "abcd"]
    for name in "abcd":
        (tmp_path / f"{name}.obj").touch()
    values = small_recipe().model_dump(mode="json") | {"models": entries, "splits": {"train": 1}}
    with pytest.raises(RecipeError) as caught:
        plan(Recipe.model_validate(values, context={"folder": tmp_path}))
    assert [line.partition(":")[0] for line in str(caught.value).splitlines()] == [f"models[{i}].real_size" for i in (0, 1, 3)]
    for i in (1, 3):
        entries[i]["supercategory"] = "other"
    with pytest.raises(RecipeError) as caught:
        plan(Recipe.model_validate(values, context={"folder": tmp_path}))
    assert [line.partition(":")[0] for line in str(caught.value).splitlines()] == [f"models[{i}].supercategory" for i in (1, 3)]


def test_of_very_many_mistakes_the_last_are_counted():
    models = [{"source": f"zoo:car{i}", "category": "car"} for i in range(MOST_TOLD + 5)]
    with pytest.raises(RecipeError) as caught:
        plan(small_recipe(models=models))
    lines = str(caught.value).splitlines()
    assert len(lines) == MOST_TOLD + 1
    assert lines[-1] == "and 5 more mistakes"


def test_a_preview_tells_all_models_that_cannot_be_used(tmp_path):
    (tmp_path / "a.obj").write_text("v 0 0 0\n")
    (tmp_path / "b.glb").write_text("no model")
    file = tmp_path / "recipe.yaml"
    models = "models: [{source: zoo:chair, category: chair}, {source: [a.obj, b.glb], category: thing}]"
    file.write_text(f"name: x\n{models}\nviewpoints: {{azimuth: 0, distance: 3}}\ncamera: {{size: [32, 24], fov_deg: 40}}\n")
    answer = viewsphere("preview", file, "-o", tmp_path / "p.png")
    assert answer.returncode == 2
    told = [line for line in answer.stderr.splitlines() if not line.startswith("compiling")]
    assert [line.split(":")[1].strip() for line in told] == [str(tmp_path / name) for name in ("a.obj", "b.glb")]
    near = file.read_text().replace("distance: 3", "distance: 0.01").replace("{source: [a.obj, b.glb]", "{source: zoo:car")
    file.write_text(near)
    answer = viewsphere("preview", file, "-o", tmp_path / "p.png")
    assert answer.returncode == 2
    assert len(re.findall(r"is inside the model, which reaches .* \(model (?:chair|car)_000\)", answer.stderr)) == 2


def test_categories_that_coco_does_not_have_are_told(tmp_path):
    models = [{"source": "zoo:post_box", "category": name, "name": name} for name in ("bicycle", "post_box", "bike")]
    coco = [{"coco": {"category_ids": "coco"}}]
    recipe = small_recipe(models=models, formats=coco, splits={"train": 1}, viewpoints={"azimuth": 0, "distance": 3})
    notes = (
        "coco.category_ids: 'post_box', which COCO does not have, gets id 92",
        "coco.category_ids: 'bike', which COCO has once, for another category here, gets id 93",
    )
    assert tuple(note for note in plan(recipe).notes if "coco" in note) == notes
    assert not [note for note in plan(small_recipe(models=models, splits={"train": 1})).notes if "coco" in note]
    told = [note for note in generate(recipe, tmp_path / "out").notes if "coco.category_ids" in note]
    assert told == [f"note: {note}" for note in notes]
    written = json.loads((tmp_path / "out/coco/annotations/instances_train.json").read_text())
    assert {c["name"]: c["id"] for c in written["categories"]} == {"bicycle": 2, "post_box": 92, "bike": 93}


def test_missing_folders_of_photographs_do_not_exist():
    with pytest.raises(RecipeError, match="nowhere, which does not exist"):
        plan(small_recipe(scene={"background": {"images": "nowhere"}}))


def test_fields_that_differ_are_named(small_run):
    views = {"azimuth": [0, 120], "elevation": [15, 50], "distance": 1.0}
    with pytest.raises(StoreError, match=r", another in viewpoints\.azimuth: choose"):
        generate(small_recipe(viewpoints=views), small_run)


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["plan", "x.yaml", "--estimat"], "plan: --estimat is no option; did you mean '--estimate'? See viewsphere plan -h"),
        (["check", "x", "--sample", "abc"], "check: --sample: expected a whole number; found 'abc': see"),
        (
            ["plan", "x.yaml", "--workers", "two"],
            "plan: --workers: expected a whole number; found 'two': see viewsphere plan -h",
        ),
        (
            ["plan", "x.yaml", "--workers", "-1"],
            "plan: --workers: expected a number greater than or equal to 0; found '-1': see",
        ),
        (["plan", "x.yaml", "-z"], "plan: -z is no option: see viewsphere plan -h"),
        (["plan", "x.yaml", "--zzz"], "plan: --zzz is no option: see viewsphere plan -h"),
        (["plam"], "no such command 'plam'; did you mean 'plan'? See viewsphere -h"),
        (["zzzzzz"], "no such command 'zzzzzz': see viewsphere -h"),
        (["plan", "a", "b"], "plan: got unexpected extra argument"),
    ],
)
def test_mistakes_in_options_are_one_line(words, expected):
    assert one_line(*words).startswith(f"viewsphere: {expected}")


def test_reports_of_recipes_say_what_they_expect(tmp_path):
    file = tmp_path / "recipe.yaml"
    file.write_text(small_recipe().to_yaml())
    assert f"{file}: expected a folder that `render` wrote; found a file" in one_line("report", file)


def test_pictures_are_called_png(small_run, tmp_path):
    assert "ends in .png; found" in one_line("preview", small_run, "-o", tmp_path / "p.xyz")
    assert not (tmp_path / "p.xyz").exists()


@pytest.mark.parametrize("up", ["+x", "-x", "+y", "-y", "+z", "-z"])
def test_up_alone_picks_a_forward(up):
    report = inspect_model(model_spec("zoo:post_box", up=up))
    assert report.up == up
    assert report.forward[1] != up[1]


def test_units_have_the_names_that_recipes_give_them():
    assert model_spec("a.glb", unit="mm").unit == 0.001
    assert model_spec("a.glb", unit="2.5").unit == 2.5
    with pytest.raises(UserError, match=r"^--unit: 'mx' is unknown.*Valid: m, cm, mm"):
        model_spec("a.glb", unit="mx")


@pytest.mark.parametrize(("up", "forward"), [("+y", "+z"), ("+z", "-y"), ("-x", "+y")])
def test_each_side_names_the_forward_that_makes_it_the_front(up, forward):
    sides = [facing(up, forward, azimuth) for azimuth in (0, 90, 180, 270)]
    assert sides[0] == forward
    assert len(set(sides)) == 4
    for azimuth, side in zip((0, 90, 180, 270), sides, strict=True):
        assert facing(up, side, -azimuth) == forward


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("models: [{source: zoo:chair count: 1}]\n", "'count: 1}]' in column 29 of line 1"),
        ("camera: {size: [64, 48]\n  fov_deg: 40}\n", "'fov_deg: 40}' in column 3 of line 2"),
        ("camera: {size: [64 {}], fov_deg: 40}\n", "'{}], fov_deg: 40}' in column 20 of line 1"),
    ],
)
def test_missing_commas_are_told_where_they_are_missing(text, found, tmp_path):
    file = tmp_path / "recipe.yaml"
    file.write_text(text)
    with pytest.raises(RecipeError) as caught:
        Recipe.load(file)
    assert str(caught.value).startswith(f"{file}:1: expected a comma or the end of the ")
    assert f"; found {found}: set a comma before it" in str(caught.value)


@pytest.fixture
def mixed(tmp_path):
    """A folder of models, two of which only Blender reads."""
    folder = tmp_path / "aw"
    folder.mkdir()
    for name in ("a.obj", "b.fbx", "c.FBX", "notes.txt"):
        (folder / name).touch()
    return tmp_path


def of_files(folder, *sources):
    file = folder / "recipe.yaml"
    file.write_text(small_recipe(models=[{"source": list(sources), "category": "x"}]).to_yaml())
    return Recipe.load(file)


@pytest.mark.parametrize("source", ["aw", "aw/*", "**/*"])
def test_plans_warn_of_files_that_only_blender_reads(mixed, source):
    planned = plan(of_files(mixed, source))
    assert planned.models == 1
    said = [line for line in planned.warnings if "Blender" in line]
    assert said == [
        f"{mixed / 'recipe.yaml'}:3: models[0].source: 2 files that Blender reads left out: name them, e.g. aw/*.fbx"
    ]


@pytest.mark.parametrize("sources", [("aw/*.obj",), ("aw/a.obj",), ("aw", "aw/*.fbx", "aw/*.FBX")])
def test_plans_warn_of_no_file_that_is_named_or_not_meant(mixed, sources):
    assert not [line for line in plan(of_files(mixed, *sources)).warnings if "Blender" in line]


def test_folders_of_files_that_only_blender_reads_say_how_to_name_them(mixed):
    (mixed / "aw" / "a.obj").unlink()
    (mixed / "aw" / "c.FBX").unlink()
    with pytest.raises(
        RecipeError, match=r"'aw' gives none in .*; 1 file that Blender reads left out: name it, e\.g\. aw/\*\.fbx"
    ):
        plan(of_files(mixed, "aw"))


def test_options_of_formats_without_a_format_show_how_to_name_it(small_run):
    said = one_line("export", small_run, "--format", "coco", "--format-option", "category_ids=foo")
    assert "found no format: say coco.category_ids=foo" in said


def test_models_are_no_recipes(tmp_path):
    for name in ("mug.glb", "mug.FBX"):
        (tmp_path / name).write_bytes(b"glTF\xff")
        said = one_line("render", tmp_path / name, "-o", tmp_path / "out")
        assert f"found a model: look at it (viewsphere inspect {tmp_path / name})" in said
        assert "viewsphere new" in said


@pytest.mark.parametrize("command", [("check",), ("export", "--format", "coco"), ("report",)])
def test_missing_data_sets_do_not_exist(command, tmp_path):
    name, *words = command
    assert f"{tmp_path / 'nope'}: expected a folder that render wrote; found no such folder" in one_line(
        name, tmp_path / "nope", *words
    )


@pytest.mark.parametrize(
    ("field", "value", "told"),
    [
        ("viewpoints.distance", {"fill": 0.3, "min": 2}, "viewpoints.distance.fill: expected no field but fill; found 'min'"),
        ("viewpoints.distance", {"fill": 5}, "viewpoints.distance.fill: expected a share of 1e-06 to 4; found 5"),
        (
            "scene.materials",
            {"images": "photos"},
            "scene.materials: expected a list; found a mapping: .* write [{images: photos}]",
        ),
        ("camera.size", 640, "camera.size: expected [width, height] in pixels, such as [640, 480]; found 640"),
        ("models", ["source:zoo:chair"], "found 'source:zoo:chair': set a space after the colon, source: zoo:chair"),
        ("models", ["zoo:chair"], "models[0]: expected a mapping; found 'zoo:chair': write {source: zoo:chair}"),
    ],
)
def test_values_of_another_shape_show_the_right_one(field, value, told, tmp_path):
    file = tmp_path / "recipe.yaml"
    file.write_text(small_recipe().to_yaml())
    with pytest.raises(RecipeError, match=re.escape(told).replace(r"\.\*", ".*")):
        Recipe.load(file, {field: value})


def test_formats_are_known_before_anything_is_printed(tmp_path):
    file = tmp_path / "recipe.yaml"
    file.write_text(small_recipe().to_yaml())
    answer = viewsphere("render", file, "-o", tmp_path / "out", "--format", "yolov")
    assert answer.stdout == ""
    assert answer.stderr.startswith("viewsphere: --format: 'yolov' is unknown; did you mean 'yolo'? Valid: ")
    assert not (tmp_path / "out").exists()


def test_what_users_hold_shows_itself_in_a_line(small_run):
    dataset = vs.open(small_run)
    frames = vs.render(small_recipe())
    assert str(len(dataset)) in repr(dataset)
    assert str(small_run) in repr(dataset)
    assert f"{frames.plan.frames} frames" in repr(frames)
    assert f"{dataset[0].width} x {dataset[0].height} pixels, {len(dataset[0].objects)} object" in repr(dataset[0])
    assert all(len(repr(shown)) < 320 and " at 0x" not in repr(shown) for shown in (dataset, frames, dataset[0]))
