"""Recipe files: the line of every mistake, YAML's own mistakes, the schema, the documentation."""

import json
import re
from functools import cache
from pathlib import Path
from unittest.mock import patch

import jsonschema
import pytest
import yaml

from viewsphere.errors import RecipeError, UserError
from viewsphere.recipe.reading.file import _Loader, parse, read
from viewsphere.recipe.recipe import Recipe, schema

ROOT = Path(__file__).parents[2]
GOOD = """\
name: cars
models:
  - source: zoo:car
    count: 2
    category: car
viewpoints:
  azimuth: {start: 0, stop: 360, step: 90}
  elevation:
    - 0
    - 30
  distance: 5
camera:
  size: [64, 48]
  fov_deg: 40
"""


@pytest.fixture
def write(tmp_path):
    def write(text: str | bytes) -> Path:
        path = tmp_path / "recipe.yaml"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return write


def load_error(path: Path) -> str:
    with pytest.raises(RecipeError) as caught:
        Recipe.load(path)
    return str(caught.value).replace(str(path), "recipe.yaml")


POSITIONS = [
    (
        ("category:", "categry:"),
        "recipe.yaml:5: models[0].categry: 'categry' is unknown; did you mean 'category'? Valid: source, category, "
        "supercategory, count, name, "
        "frames, clip, fps, poses, motion, up, forward, unit, centring, real_size, scale, sidecar, symmetries, "
        "keypoints, faces, color, material, labels, confined, licence, attribution, source_url",
    ),
    (("count: 2", "count: two"), "recipe.yaml:4: models[0].count: expected a whole number; found 'two'"),
    (("    - 30", "    - 99"), "recipe.yaml:8: viewpoints.elevation: expected elevations of -90 to 90 degrees; found 99"),
    (("    - 30", "    - x"), "recipe.yaml:10: viewpoints.elevation[1]: expected a number; found 'x'"),
    (("step: 90", "step: 0"), "recipe.yaml:7: viewpoints.azimuth.step: expected a number greater than 0; found 0"),
    (
        ("step: 90", "setp: 90"),
        "recipe.yaml:7: viewpoints.azimuth.setp: 'setp' is unknown; did you mean 'step'? Valid: start, stop, step",
    ),
    (("  distance: 5\n", ""), "recipe.yaml:6: viewpoints.distance: expected a value; found nothing"),
    (("[64, 48]", "[64, 0]"), "recipe.yaml:13: camera.size[1]: expected a number greater than or equal to 1; found 0"),
    (("  fov_deg: 40\n", "  K: null\n"), "recipe.yaml:12: camera: expected one of fov_deg, focal_px, focal_mm"),
    (
        ("viewpoints:", "viewpoints:\n  kind: sphree"),
        "recipe.yaml:7: viewpoints.kind: 'sphree' is unknown; did you mean 'sphere'?",
    ),
    (("name: cars", "nmae: cars"), "recipe.yaml:1: nmae: 'nmae' is unknown; did you mean 'name'? Valid: name, seed"),
    (
        ("category:", r'"a\n\e[31m":'),
        r"recipe.yaml:5: models[0].'a\n\x1b[31m': 'a\n\x1b[31m' is unknown. Valid: source, category",
    ),
]


@pytest.mark.parametrize(("change", "message"), POSITIONS)
def test_a_mistake_is_reported_at_its_line(write, change, message):
    assert change[0] in GOOD
    assert load_error(write(GOOD.replace(*change))).splitlines()[0].startswith(message)


def test_several_mistakes_come_in_the_order_of_the_file(write):
    text = GOOD.replace("count: 2", "count: 0").replace("distance: 5", "distance: -1").replace("fov_deg", "fov")
    lines = load_error(write(text)).splitlines()
    assert [line.split(":")[1] for line in lines] == ["4", "11", "14"]


SYNTAX = [
    ("name: [1, 2\nmodels: x\n", "recipe.yaml:1: expected a comma or the end of the list that begins with [ in column 7"),
    ("name: a\nmodels:\n\t- source: x\n", "recipe.yaml:3: expected spaces; found a tab"),
    ("name: a\n name: b\n", "recipe.yaml:2: a colon does not fit here: "),
    ("name: a\nseed: 1\nname: b\n", "recipe.yaml:3: name: expected every field once; found 'name' again, after line 1"),
    ("models:\n - {count: 1, count: 2}\n", "recipe.yaml:2: models[0].count: expected every field once"),
    ("- a\n- b\n", "recipe.yaml:1: expected a mapping of name, models, viewpoints, ...; found a list"),
    ("", "recipe.yaml:1: expected a mapping of name, models, viewpoints, ...; found an empty file"),
    ("# nothing\n", "recipe.yaml:1: expected a mapping of name, models, viewpoints, ...; found an empty file"),
    ("name: a\n---\nname: b\n", "recipe.yaml:2: a second document begins with ---"),
    ("name: !!python/object:os.system x\n", "recipe.yaml:1: name: expected plain YAML; found 'x' with the tag"),
    ("name: a\n? [1, 2]\n: b\n", "recipe.yaml:2: recipe: expected a name before the colon; found a list or mapping"),
    ("name: *other\n", 'recipe.yaml:1: `*other` needs quotes: "*other"'),
    ("name: a\nmodels: &m\n  - *m\n", "recipe.yaml:2: models[0]: expected a value; found an alias for the value it"),
    ("name: a\nseed: 1\nscene: \x07\n", "recipe.yaml:3: expected text; found the control character '\\x07'"),
    (b"name: a\nseed: 1 # \xff\n", "recipe.yaml:2: expected text in UTF-8; found byte 0xff: save it as UTF-8"),
    ("name: a\n".encode("utf-16"), "recipe.yaml:1: expected text in UTF-8"),
    ("name: " + "[" * 5000, "recipe.yaml: expected a recipe, found lists or mappings nested too deeply"),
]


@pytest.mark.parametrize(("text", "message"), SYNTAX)
def test_what_is_no_yaml_is_reported_at_its_line(write, text, message):
    found = load_error(write(text))
    assert found.startswith(message)
    assert "\n" not in found


@pytest.mark.slow
def test_aliases_cannot_explode(write):
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 10)]
    assert "expected at most 200,000 values (limit MAX_RECIPE_VALUES); found more: write fewer aliases" in load_error(
        write("\n".join(lines))
    )


def test_aliases_mean_what_they_stand_for(write):
    text = GOOD.replace("[64, 48]", "&size [64, 48]").replace("    - 30", "    - 30\n  tilt: &t [1, 2]\n  target: center")
    assert Recipe.load(write(text)).camera.size == (64, 48)
    doubled = GOOD + "scene:\n  sky: {zenith: &c [1, 0, 0], horizon: *c}\n"
    assert Recipe.load(write(doubled)).scene.sky.horizon == (1, 0, 0)


def test_missing_files_and_folders(tmp_path):
    assert load_error(tmp_path / "none.yaml").endswith("expected a readable recipe file, found: No such file or directory")
    assert load_error(tmp_path).endswith("expected a recipe file, found a folder: name the .yaml file in it")


def test_values_follow_yaml_1_2(write):
    path = write("a: no\nb: 12:30\nc: 1e3\nd: 010\ne: 2020-01-01\nf: true\ng: ~\nh: -.5\ni: off\nj: '7'\nk: .inf\nl: 0x10\n")
    assert read(path)[0] == {
        "a": "no",
        "b": "12:30",
        "c": 1000.0,
        "d": 10,
        "e": "2020-01-01",
        "f": True,
        "g": None,
        "h": -0.5,
        "i": "off",
        "j": "7",
        "k": float("inf"),
        "l": "0x10",
    }


def test_byte_order_mark_and_crlf_are_harmless(write):
    path = write(b"\xef\xbb\xbf" + GOOD.replace("\n", "\r\n").encode())
    assert Recipe.load(path).name == "cars"


ROUND_TRIPS = [
    {},
    {"name": "1e3", "seed": 5, "formats": []},
    {"name": "no: #'x' ü"},
    {"scene": {"background": "white", "ground": "off", "sun": "off"}},
    {"scene": {"background": {"images": "a", "draw": "fixed"}, "ground": [0.1, 0.2, 1 / 3]}},
    {"viewpoints": {"kind": "sphere", "count": 3, "distance": [1, 2], "elevation": 3}},
    {"viewpoints": {"kind": "normal", "count": 3, "distance": 1e-5, "sd": {"tilt": 1}}},
    {"viewpoints": {"kind": "jitter", "distance": 3, "plus_minus": {"azimuth": 1}, "target": [0, 0, 1]}},
    {"camera": {"size": [10, 20], "K": [[1, 0, 5], [0, 1, 5], [0, 0, 1]]}},
    {"camera": {"focal_mm": 35, "sensor_mm": [36, 24], "distortion": {"model": "fisheye", "coefficients": [0] * 4}}},
    {"models": [{"source": ["a", "b.obj"], "category": "off", "unit": 0.5, "real_size": {"csv": "s.csv", "unit": "mm"}}]},
    {"models": [{"source": "a", "category": "1", "real_size": {"width": 1, "height": 2, "length": 3}, "scale": "real_size"}]},
    {"splits": {"by": "frame", "test": 0.25, "train": 0.75}, "engine": {"name": "raster", "samples": 2}},
    {"splits": {"train": 1, "val": ["car_000"]}},
]


@pytest.mark.parametrize("fields", ROUND_TRIPS)
def test_to_yaml_reads_back_as_the_same_recipe(write, fields):
    recipe = Recipe(**{"models": [{"source": "zoo:car"}], "viewpoints": {"distance": 5}, **fields})
    path = write(recipe.to_yaml())
    again = Recipe.load(path)
    assert again.model_dump() == recipe.model_dump()
    assert again.digest == recipe.digest
    assert Recipe.model_validate(recipe.model_dump(mode="json")).digest == recipe.digest
    validator().validate(read(path)[0])


@cache
def validator() -> jsonschema.Draft202012Validator:
    return jsonschema.Draft202012Validator(schema())


@pytest.mark.slow
def test_the_schema_is_one_and_describes_every_field():
    whole = schema()
    jsonschema.Draft202012Validator.check_schema(whole)
    json.dumps(whole)
    for name, definition in {"recipe": whole, **whole["$defs"]}.items():
        for field, value in definition.get("properties", {}).items():
            assert value.get("description"), f"{name}.{field} has no description"


@pytest.mark.parametrize("name", sorted(p.name for p in (ROOT / "recipes").glob("*.yaml")))
def test_the_recipes_of_the_paper_are_valid(name):
    path = ROOT / "recipes" / name
    assert Recipe.load(path).name == path.stem
    validator().validate(yaml.safe_load(path.read_text("utf-8")))
    validator().validate(read(path)[0])


@pytest.mark.parametrize(
    "fields",
    [
        {"nam": "x"},
        {"models": []},
        {"models": [{"source": "zoo:car", "categry": "x"}]},
        {"viewpoints": {"distance": "far"}},
        {"viewpoints": {"kind": "gird", "distance": 1}},
        {"scene": {"ground": 3}},
        {"scene": {"effects": {"blur": "much"}}},
        {"scene": {"sun": {"strength": {"unifrom": [1, 2]}}}},
        {"scene": {"view": {"transform": "filmc"}}},
        {"scene": {"lights": [{"kind": "laser", "strength": 1, "position": [0, 0, 1]}]}},
        {"splits": {"by": "mdel"}},
        {"splits": {"train": "x"}},
    ],
)
def test_the_schema_refuses_what_the_recipe_refuses(fields):
    data = {"models": [{"source": "zoo:car"}], "viewpoints": {"distance": 5}, **fields}
    assert list(validator().iter_errors(data))
    with pytest.raises(RecipeError):
        Recipe(**data)


def test_the_schema_knows_the_channels_it_is_told():
    data = {"models": [{"source": "zoo:car"}], "viewpoints": {"distance": 5}, "channels": ["rgb", "rgbb"]}
    assert not list(validator().iter_errors(data))
    assert list(jsonschema.Draft202012Validator(schema(channels=("rgb", "depth"))).iter_errors(data))


BLOCKS = re.findall(r"```yaml\n(.*?)```", (ROOT / "docs" / "recipe.md").read_text("utf-8"), re.DOTALL)


@pytest.mark.parametrize("block", BLOCKS)
def test_every_block_of_the_documentation_is_a_recipe_or_a_part_of_one(write, block):
    part, _ = read(write(block))
    whole = {"models": [{"source": "zoo:car"}], "viewpoints": {"distance": 5}, **part}
    validator().validate(whole)
    whole.pop("extends", None)
    Recipe(**whole)


def test_the_documentation_names_every_field():
    text = (ROOT / "docs" / "recipe.md").read_text("utf-8")
    whole = schema()
    for name, definition in {"recipe": whole, **whole["$defs"]}.items():
        for field in definition.get("properties", {}):
            assert re.search(rf"\b{field}\b", text), f"docs/recipe.md does not mention {name}.{field}"


def test_values_beyond_the_limit_are_not_read(tmp_path, monkeypatch):
    monkeypatch.setenv("VIEWSPHERE_MAX_RECIPE_VALUES", "100")
    file = tmp_path / "r.yaml"
    file.write_text("name: x\nmodels:\n" + "- 1\n" * 5000)
    with patch.object(_Loader, "compose_scalar_node", autospec=True, side_effect=_Loader.compose_scalar_node) as made:
        with pytest.raises(RecipeError, match=r"r.yaml:100: expected at most 100 values \(limit MAX_RECIPE_VALUES\)"):
            read(file)
        assert made.call_count < 110
    file.write_text("name: x\nmodels:\n" + "- 1\n" * 97)
    assert len(read(file)[0]["models"]) == 97
    monkeypatch.setenv("VIEWSPHERE_MAX_RECIPE_VALUES", "many")
    with pytest.raises(UserError, match="VIEWSPHERE_MAX_RECIPE_VALUES: expected a whole number above 0, found 'many'"):
        read(file)


def test_brackets_within_one_another_cost_little_and_halves_of_characters_are_refused(tmp_path, monkeypatch):
    halves = '{"a\\ud800": 1}', 'name: "\\ud800"'
    for text, found in (("[" * 100_000, "nested too deeply"), *((half, "half of one") for half in halves)):
        with pytest.raises(RecipeError, match=found):
            parse(text, "recipe.yaml")
    (tmp_path / "a.yaml").write_text("name: long\n")
    monkeypatch.setenv("VIEWSPHERE_MAX_RECIPE_BYTES", "5")
    with pytest.raises(RecipeError, match=r"found: 11 bytes long, and at most 5 bytes are allowed \(limit MAX_RECIPE_BYTES\)"):
        read(tmp_path / "a.yaml")
