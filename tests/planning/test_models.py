"""Model entries: files found, keys, seeds of the zoo, tables of sizes."""

import pytest

from viewsphere.errors import RecipeError
from viewsphere.model.model_spec import ScaledTo
from viewsphere.planning import models
from viewsphere.planning.models import Listing, categories, count_models, left_out, model_specs
from viewsphere.recipe.recipe import Recipe
from viewsphere_zoo import things


@pytest.fixture
def build(tmp_path):
    """A recipe whose folder holds these files, from its model entries."""

    def build(models, files=(), seed=0):
        for name in files:
            path = tmp_path / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text("x")
        data = {"models": models, "viewpoints": {"distance": 5}, "seed": seed}
        return Recipe.model_validate(data, context={"folder": tmp_path})

    return build


def keys(recipe):
    assert count_models(Listing(recipe)) == len(model_specs(recipe))
    return [spec.key for spec in model_specs(recipe)]


def error(recipe) -> str:
    with pytest.raises(RecipeError) as caught:
        model_specs(recipe)
    return str(caught.value)


def entry(source, **fields):
    return {"source": source, "category": "car", **fields}


def test_models_without_end_are_refused(build, monkeypatch):
    monkeypatch.setenv("VIEWSPHERE_MAX_MODELS", "3")
    assert len(keys(build([entry("zoo:car", count=3)]))) == 3
    assert "models[0].count: expected at most 3 (limit MAX_MODELS); found 4" in error(build([entry("zoo:car", count=4)]))


def test_patterns_and_folders_are_sorted_and_hold_models_only(build, tmp_path):
    files = ["m/b.obj", "m/a.GLB", "m/b.mtl", "m/tex.png", "m/sub/c.stl", "m/.hidden/d.obj", "m/__MACOSX/e.obj"]
    assert keys(build([entry("m/*")], files)) == ["a", "b"]
    assert keys(build([entry("m")])) == ["a", "b", "c"]
    assert keys(build([entry("m/**/*.stl")])) == ["c"]
    assert keys(build([entry(["m/b.obj", "m/*.obj", "m/a.GLB"])])) == ["a", "b"]
    spec = model_specs(build([entry("m/b.obj")]))[0]
    assert spec.source == str(tmp_path / "m" / "b.obj")
    assert spec.seed is None


def test_absolute_and_parent_paths(build, tmp_path):
    recipe = build([entry(str(tmp_path / "m" / ".." / "a.obj"))], ["a.obj", "m/x.obj"])
    assert model_specs(recipe)[0].source == str(tmp_path / "a.obj")


def test_a_name_with_brackets_is_a_file_before_it_is_a_pattern(build):
    assert keys(build([entry("a[1].obj")], ["a[1].obj"])) == ["a_1_"]


def test_keys_are_fit_for_folders(build):
    files = ["my car (old).obj", "Käfer.v2.obj", "..obj"]
    assert keys(build([entry(["my car (old).obj", "Käfer.v2.obj"])], files)) == ["Käfer.v2", "my_car__old_"]
    assert keys(build([entry("my car (old).obj", name="fleet")])) == ["fleet_my_car__old_"]


def test_files_of_one_name_get_their_ending_or_folder(build):
    assert keys(build([entry("a/*")], ["a/car.obj", "a/car.glb", "a/van.obj"])) == ["car-glb", "car-obj", "van"]
    assert keys(build([entry("n/*/model.obj")], ["n/x/model.obj", "n/y/model.obj"])) == ["model-x", "model-y"]
    files = ["p/x/v1/model.obj", "p/y/v1/model.obj"]
    assert keys(build([entry("p/*/v1/model.obj")], files)) == ["model-x-v1", "model-y-v1"]
    assert keys(build([entry("q/Car.obj"), entry("r/car.obj")], ["q/Car.obj", "r/car.obj"])) == ["Car-q", "car-r"]


def test_keys_of_many_files_of_one_name_are_made_once_each(build, monkeypatch):
    made = []
    variant = models._variant
    monkeypatch.setattr(models, "_variant", lambda *args, **options: made.append(args) or variant(*args, **options))
    files = [f"m/{name:03d}/model.obj" for name in range(100)]
    assert keys(build([entry("m/*/model.obj")], files))[::99] == ["model-000", "model-099"]
    assert len(made) == 2 * 3 * 100  # for two plans: without a folder, with its ending, with a folder


def test_keys_differ_by_the_nearest_folder_that_helps(build):
    files = ["one.obj", "m/one.obj", "m/n/one.obj", "k/n/one.obj"]
    assert keys(build([entry(["*.obj", "*/*.obj", "*/*/*.obj"])], files))[:2] == ["one-k-n", "one-m-n"]


def test_patterns_of_one_ending_leave_nothing_to_blender(build):
    recipe = build([entry("m/*.obj"), entry("n/*")], ["m/a.obj", "m/b.fbx", "n/c.obj", "n/d.FBX"])
    assert [*left_out(recipe)] == ["models[1].source: 1 file that Blender reads left out: name it, e.g. n/*.FBX"]


def test_the_same_model_twice_needs_names(build):
    message = error(build([entry("a.obj"), entry("a.obj", scale={"length": 1})], ["a.obj"]))
    assert message.startswith("models[1]: expected every model once; found key 'a' again")
    assert "give one of the entries another name" in message
    assert keys(build([entry("a.obj"), entry("a.obj", name="small")])) == ["a", "small_a"]
    assert error(build([{"source": "zoo:car"}, {"source": "zoo:car"}])).startswith("models[1]: expected every model once")


def test_sources_that_give_nothing_are_named(build, tmp_path):
    assert error(build([entry("x.obj")])) == (
        "models[0].source: expected a file, folder, pattern or a source's model, such as zoo:car; "
        f"found no 'x.obj' in {tmp_path}"
    )
    assert error(build([entry("bicycle")])).endswith(f"found no 'bicycle' in {tmp_path}; did you mean 'zoo:bicycle'?")
    assert error(build([{"source": "zoo:car"}, entry("x/*.obj")])).startswith("models[1].source: expected model files (.3mf")
    (tmp_path / "empty").mkdir()
    assert "'empty' gives none in" in error(build([entry("empty")]))
    assert error(build([entry("*.obj", count=3)], ["a.obj"])) == "models[0].count: expected 3 model files; found 1"


def test_the_zoo_is_drawn_by_key(build):
    few, many = (model_specs(build([{"source": "zoo:car", "count": n}])) for n in (100, 101))
    assert few == many[:100]
    assert [s.key for s in many[99:]] == ["car_099", "car_100"]
    assert len({s.seed for s in many}) == 101
    assert all(s.source == "zoo:car" and s.category == "car" for s in many)
    other = model_specs(build([{"source": "zoo:boat"}, {"source": "zoo:car", "count": 2}]))
    assert [s.seed for s in other[1:]] == [s.seed for s in few[:2]]
    assert model_specs(build([{"source": "zoo:car"}], seed=1))[0].seed != few[0].seed
    assert keys(build([{"source": ["zoo:car", "zoo:hair_drier"], "count": 2}])) == [
        "car_000",
        "car_001",
        "hair_drier_000",
        "hair_drier_001",
    ]


def test_any_means_every_family_whose_members_are_things(build):
    known = things()
    assert {"car", "chair"} < {*known} and not {"house", "street", "landscape", "interior"} & {*known}
    few, many = (model_specs(build([{"source": "zoo:any", "count": n}])) for n in (5, 3 * len(known) + 2))
    assert many[:5] == few and [s.key for s in few] == [f"any_{i:03d}" for i in range(5)]
    for turn in range(3):
        each = many[turn * len(known) : (turn + 1) * len(known)]
        assert sorted(s.source for s in each) == [f"zoo:{name}" for name in known]
    assert [s.source for s in many[: len(known)]] != [s.source for s in many[len(known) : 2 * len(known)]]
    assert all(s.category == s.source.removeprefix("zoo:").replace("_", " ") for s in many)
    assert [c.name for c in categories(build([{"source": "zoo:any"}]))] == [name.replace("_", " ") for name in known]
    named = build([{"source": "zoo:any", "count": 4, "category": "thing", "name": "clutter"}])
    assert [c.name for c in categories(named)] == ["thing"] and keys(named)[0] == "clutter_000"
    assert count_models(Listing(build([{"source": ["zoo:any", "zoo:car"], "count": 4}]))) == 8


def test_categories_count_from_one_in_order_of_appearance(build):
    models = [
        {"source": "zoo:hair_drier"},
        {"source": "zoo:car", "supercategory": "vehicle"},
        entry("a.obj", supercategory="vehicle"),
    ]
    recipe = build(models, ["a.obj"])
    assert [(c.id, c.name, c.supercategory) for c in categories(recipe)] == [(1, "hair drier", ""), (2, "car", "vehicle")]
    assert [s.category_id for s in model_specs(recipe)] == [1, 2, 2]
    assert error(build([{"source": "zoo:car"}, entry("a.obj", supercategory="vehicle")])) == (
        "models[1].supercategory: expected '', as category 'car' has before; found 'vehicle'"
    )


def test_settings_reach_the_specification(build):
    fields = {"up": "+y", "forward": "+z", "unit": "in", "centring": "floor", "confined": False, "scale": {"length": 1.8}}
    spec = model_specs(build([entry("a.obj", **fields)], ["a.obj"]))[0]
    assert (spec.up, spec.forward, spec.unit, spec.centring, spec.confined) == ("+y", "+z", 0.0254, "floor", False)
    assert spec.scale == 1.8
    assert spec.real_size is None


def test_real_sizes_are_given_looked_up_or_the_file_s(build, tmp_path):
    (tmp_path / "sizes.csv").write_text("name, length,Width,height\na,4,1.7,1.5\nb,3885,1695,1510\n")
    files = ["a.obj", "b.obj", "c.obj"]

    def size(source, real_size):
        return model_specs(build([entry(source, real_size=real_size)], files))[0].real_size

    assert size("a.obj", "sizes.csv") == (1.7, 1.5, 4)
    assert size("b.obj", {"csv": "sizes.csv", "unit": "mm"}) == pytest.approx((1.695, 1.51, 3.885), rel=1e-15)
    assert size("c.obj", {"width": 1, "height": 2, "length": 3}) == (1, 2, 3)
    assert size("c.obj", "file") == "file"
    assert model_specs(build([{"source": "zoo:car"}]))[0].real_size == "file"
    message = error(build([entry("c.obj", real_size="sizes.csv")]))
    assert message == f"models[0].real_size: expected a row for 'c' in {tmp_path / 'sizes.csv'}; found none"


TABLES = [
    ("", ":1: expected columns name, width, height, length; found nothing"),
    ("name,width,height\n", ":1: expected columns name, width, height, length; found name, width, height"),
    ("name,width,height,length\na,1,2,x\n", ":2: length: expected a number above 0; found 'x'"),
    ("name,width,height,length\na,1,2\n", ":2: length: expected a number above 0; found None"),
    ("name,width,height,length\na,1,-2,3\n", ":2: height: expected a number above 0; found '-2'"),
    ("name,width,height,length\na,1,inf,3\n", ":2: height: expected a number above 0; found 'inf'"),
    ("name,width,height,length\na,1,2,3\na,1,2,3\n", ":3: expected every name once; found 'a'"),
]


@pytest.mark.parametrize(("text", "message"), TABLES)
def test_a_faulty_table_is_reported_at_its_line(build, tmp_path, text, message):
    (tmp_path / "sizes.csv").write_text(text)
    assert error(build([entry("a.obj", real_size="sizes.csv")], ["a.obj"])) == f"{tmp_path / 'sizes.csv'}{message}"


def test_a_missing_table_is_reported(build):
    message = error(build([entry("a.obj", real_size="none.csv")], ["a.obj"]))
    assert message.endswith("expected a readable CSV file of name, width, height, length; found: No such file or directory")


def test_keys_of_very_long_names_are_shortened_and_stay_distinct(build):
    files = [f"{'n' * 200}{i}.obj" for i in range(2)] + ["日本" * 40 + ".obj"]
    found = keys(build([entry("*.obj")], files))
    assert len(set(found)) == 3
    assert all(len(key.encode()) <= 150 for key in found)


@pytest.mark.parametrize("is_installed", [True, False])
def test_folders_and_patterns_mean_usd_files_where_they_are_read_without_blender(tmp_path, monkeypatch, is_installed):
    for name in ("a.obj", "b.usda", "c.USDZ", "d.fbx"):
        (tmp_path / name).touch()
    monkeypatch.setattr("viewsphere.assets.readers.missing", lambda reader: [] if is_installed else [*reader.packages])
    expected = ["a.obj", "b.usda", "c.USDZ"] if is_installed else ["a.obj"]
    for source in (".", "*"):
        assert sorted(file.name for file in models._matching(tmp_path, source, "models[0]")) == expected


def test_a_scale_names_one_measure(tmp_path):
    (tmp_path / "a.obj").touch()

    def scale(value):
        entry = {"source": "a.obj", "category": "a", "scale": value}
        recipe = Recipe.model_validate({"models": [entry], "viewpoints": {"distance": 3}}, context={"folder": tmp_path})
        return model_specs(recipe)[0].scale, recipe.model_dump(mode="json")["models"][0]["scale"]

    assert scale({"length": 2}) == (2.0, {"length": 2.0})
    assert scale({"height": 2}) == (ScaledTo(measure="height", metres=2), {"height": 2.0})
    with pytest.raises(RecipeError, match=r"models\[0\].scale: expected one of length, .*; found length and height"):
        scale({"length": 1, "height": 2})
    with pytest.raises(RecipeError, match=r"models\[0\].scale: expected one of length, .*; found none"):
        scale({})
