"""Formats are given options by recipes, calls and the command line; a data set keeps those of its exports."""

import json

import pytest

from command_line import viewsphere
from installed import installed
from small import small_recipe, tree_hash
from viewsphere import Dataset, Recipe, generate, plugins
from viewsphere.check import check
from viewsphere.check.repair import repair
from viewsphere.cli.arguments import asked_formats
from viewsphere.errors import RecipeError, UserError
from viewsphere.planning.plan import plan
from viewsphere.plugins.format import FormatSpec
from viewsphere.run.exports.exporting import export

COCOS_OWN = {"coco": {"category_ids": "coco"}}
POST_BOX = {"contiguous": 1, "coco": 91}
"""Ids of the small data set's category, which is none of COCO's."""

PLUGIN = """
from contextlib import contextmanager
from viewsphere.model.fields.frozen import Frozen
from viewsphere.plugins.format import FormatSpec

class Options(Frozen):
    greeting: str = "hello"
    times: int = 1

@contextmanager
def writer(dataset, folder, note, options):
    yield lambda sample: None
    (folder / "greeting.txt").write_text(options.greeting * options.times)

def verify(dataset, folder, sampled, options):
    if (folder / "greeting.txt").read_text() != options.greeting * options.times:
        yield None, "another greeting"

FORMAT = FormatSpec(about="A greeting.", options=Options, writer=writer, verify=verify)
"""


@pytest.fixture
def plugin(tmp_path):
    with installed(tmp_path / "site", "formats", "hello", PLUGIN):
        yield


def category_id(folder):
    value = json.loads((folder / "coco" / "annotations" / "instances_train.json").read_text())
    (category,) = value["categories"]
    assert {a["category_id"] for a in value["annotations"]} == {category["id"]}
    return category["id"]


def is_proved(folder):
    return check(Dataset(folder), rays=False, sample=0).ok


@pytest.mark.slow
def test_a_recipe_gives_options_and_is_read_back_from_its_text(tmp_path):
    recipe = small_recipe(formats=["native", COCOS_OWN], channels=["rgb"])
    generate(recipe, tmp_path / "out")
    assert category_id(tmp_path / "out") == POST_BOX["coco"]
    assert is_proved(tmp_path / "out")
    (tmp_path / "again.yaml").write_text(recipe.to_yaml())
    assert Recipe.load(tmp_path / "again.yaml").formats == recipe.formats
    assert recipe.digest == small_recipe(channels=["rgb"]).digest
    generate(recipe, tmp_path / "out", formats=["coco"])  # a name alone: the recipe says the rest
    assert category_id(tmp_path / "out") == POST_BOX["coco"]
    generate(small_recipe(channels=["rgb"]), tmp_path / "out")  # as that recipe says
    assert category_id(tmp_path / "out") == POST_BOX["contiguous"]


@pytest.mark.slow
def test_an_export_that_is_written_again_keeps_its_options(small_dataset):
    root = small_dataset.root
    assert category_id(root) == POST_BOX["contiguous"]
    export(root, [COCOS_OWN])
    assert category_id(root) == POST_BOX["coco"] and is_proved(root)
    before = tree_hash(root / "coco")
    export(root, ["coco"])
    assert tree_hash(root / "coco") == before
    picture = next((root / "coco" / "images" / "train").glob("*.png"))
    picture.unlink()
    assert repair(root, sample=0).report.ok
    assert tree_hash(root / "coco") == before
    export(root, [{"coco": {"category_ids": "contiguous"}}])
    assert category_id(root) == POST_BOX["contiguous"] and is_proved(root)


@pytest.mark.slow
def test_appending_keeps_the_options_of_the_exports_that_are_there(tmp_path):
    small = {"channels": ["rgb"], "formats": []}
    generate(small_recipe(**small), tmp_path / "out", formats=[COCOS_OWN])
    more = {"azimuth": [0, 120, 240, 300], "elevation": [15, 50], "distance": 1.0}
    generate(small_recipe(**small, viewpoints=more), tmp_path / "out", append=True)
    assert category_id(tmp_path / "out") == POST_BOX["coco"]
    assert is_proved(tmp_path / "out")


@pytest.mark.slow
def test_changed_options_are_damage(small_dataset):
    file = small_dataset.root / "coco" / "checksums.xxh128"
    text = file.read_text()
    assert text.startswith('# options {"category_ids":"contiguous","pictures":"images","segmentation":"polygons"}\n')
    file.write_text(text.replace("contiguous", "coco"))
    assert not is_proved(small_dataset.root)
    found = {finding.message for finding in check(small_dataset, rays=False, sample=0).findings}
    assert any("a list that was changed" in message for message in found)
    assert any("expected 91, found 1" in message for message in found)


def test_a_format_that_is_only_read_cannot_be_asked_for(plugin, monkeypatch, small_run):
    assert asked_formats("hello, coco") == ("hello", "coco")
    monkeypatch.setitem(vars(plugins.load(FormatSpec, "hello")), "writer", None)
    others = [name for name in plugins.names("formats") if name != "hello"]
    known = f"'hello' is unknown. Valid: {', '.join(others)}"
    with pytest.raises(UserError, match=f"^--format: {known}"):
        asked_formats("coco,hello")
    with pytest.raises(UserError, match=f"^format: {known}"):
        export(small_run, "hello")
    with pytest.raises(UserError, match=r"^--format: 'coc' is unknown; did you mean 'coco'\? Valid: .*"):
        asked_formats("coc")


def test_a_format_that_does_not_work_here_is_told_before_any_work(plugin, monkeypatch):
    def check():
        raise UserError("hello: expected somebody, found none")

    monkeypatch.setitem(vars(plugins.load(FormatSpec, "hello")), "check", check)
    with pytest.raises(UserError, match="expected somebody"):
        asked_formats("hello")


def test_the_command_line_sets_options(small_dataset):
    done = viewsphere("export", small_dataset.root, "-f", "coco", "--format-option", "coco.category_ids=coco")
    assert done.returncode == 0, done.stderr
    assert category_id(small_dataset.root) == POST_BOX["coco"]


def test_render_takes_them_too(tmp_path):
    (tmp_path / "recipe.yaml").write_text(small_recipe(channels=["rgb"], formats=["coco"]).to_yaml())
    words = ("--workers", 0, "--format-option", "coco.category_ids=coco", "--format-option", "coco.pictures=splits")
    done = viewsphere("render", tmp_path / "recipe.yaml", "-o", tmp_path / "out", *words)
    assert done.returncode == 0, done.stderr
    assert category_id(tmp_path / "out") == POST_BOX["coco"]
    assert list((tmp_path / "out" / "coco" / "train").glob("*.png"))


WRONG = {
    "coco.category_ids=oco": "coco.category_ids: 'oco' is unknown; did you mean 'coco'? Valid: contiguous, coco",
    "coco.ids=coco": "coco.ids: 'ids' is unknown; did you mean 'category_ids'? Valid: category_ids, pictures, segmentation",
    "coco=coco": "coco=coco: expected format.option=value; found no option",
    "coco.category_ids": "coco.category_ids: expected field=value, such as coco.category_ids=coco; found no '='",
    "csv.a=1": "csv.a: 'csv' is unknown. Valid: coco, or add it to the formats",
}


@pytest.mark.parametrize("option", WRONG)
def test_a_wrong_option_on_the_command_line_is_one_line(small_run, option):
    told = viewsphere("export", small_run, "-f", "coco", "--format-option", option)
    assert (told.returncode, told.stderr) == (2, f"viewsphere: --format-option {WRONG[option]}\n")


def test_a_wrong_option_in_a_recipe_is_one_line_with_its_place(tmp_path):
    text = small_recipe(formats=[]).to_yaml()
    file = tmp_path / "recipe.yaml"
    lines = len(text.replace("formats: []\n", "").splitlines())
    for entry, field, told in (
        (
            "coco: {category_ids: oco}",
            "[0].coco.category_ids",
            "'oco' is unknown; did you mean 'coco'? Valid: contiguous, coco",
        ),
        ("opencv: {category_ids: coco}", "[0].opencv", "expected no options, opencv has none; found category_ids"),
        ("coco: 5", "[0]", r"expected a format's name, or {name: {option: value}}; found a mapping"),
    ):
        file.write_text(text.replace("formats: []\n", "") + f"formats: [{{{entry}}}]\n")
        with pytest.raises(RecipeError) as caught:
            recipe = Recipe.load(file)
            with recipe.located():
                plan(recipe)
        assert str(caught.value).startswith(f"{file}:{lines + 1}: formats{field}: {told}")
        assert "\n" not in str(caught.value)


@pytest.mark.usefixtures("plugin")
def test_a_format_of_ones_own_has_options(small_dataset):
    export(small_dataset.root, [{"hello": {"times": 3}}])
    assert (small_dataset.root / "hello" / "greeting.txt").read_text() == "hellohellohello"
    assert is_proved(small_dataset.root)
    with pytest.raises(UserError, match=r"hello\.tmes: 'tmes' is unknown; did you mean 'times'"):
        export(small_dataset.root, [{"hello": {"tmes": 2}}])
