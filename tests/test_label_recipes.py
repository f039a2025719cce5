"""Every recipe in recipes/labels is rendered, and its data set proved."""

import pytest

from small import ROOT
from viewsphere import Recipe, generate
from viewsphere.check import check
from viewsphere.labels import channels, on_request
from viewsphere.store import Dataset

RECIPES = sorted((ROOT / "recipes" / "labels").glob("*.yaml"))


def cost(file):
    """A whole street takes a while to build."""
    return [pytest.mark.slow] if "place:" in file.read_text("utf-8") else []


@pytest.mark.parametrize("file", [pytest.param(file, id=file.stem, marks=cost(file)) for file in RECIPES])
def test_a_label_s_recipe_makes_a_data_set_that_passes(file, tmp_path):
    recipe = Recipe.load(file)
    generate(recipe, tmp_path, workers=0)
    report, frames = check(Dataset(tmp_path), sample=None), len(Dataset(tmp_path))
    assert report.ok, report.findings
    asked = {*recipe.annotations, *({file.stem} & channels().keys())}
    assert asked, "a recipe shows a channel of its name, or annotations"
    assert {report.checked[name] for name in (*asked, "surface")} == {frames}


def test_every_label_on_request_has_a_recipe():
    assert on_request().keys() <= {name for file in RECIPES for name in Recipe.load(file).annotations}
