"""Every recipe in recipes/labels is rendered, and its data set proved."""

import pytest

from built_once import QUICK, built_once
from small import ROOT
from viewsphere import Recipe, generate
from viewsphere.check import check
from viewsphere.labels import channels, drawable, labels, on_request
from viewsphere.model.channel import DEFAULT_CHANNELS, FINISHED
from viewsphere.preview.frame import draw_sample
from viewsphere.store import Dataset

RECIPES = sorted((ROOT / "recipes" / "labels").glob("*.yaml"))


# What makes a recipe small: fewer scenes, and models, all of which are kept.
FEW: dict[str, dict] = {
    "captions": {"models[0].count": 1, "models[1].count": 2, "scenes": {"count": 1, "objects": 4, "layout": "scatter"}},
    "clouds": {"scenes.count": 1},
    "hidden": {"models[0].count": 2, "models[1].count": 1, "scenes": {"count": 1, "objects": 3, "layout": "scatter"}},
    "keypoints": {"scenes.count": 1},
    "lidar": {"models[0].count": 1, "models[1].count": 1, "scenes": {"count": 1, "objects": 2, "layout": "scatter"}},
    "outlines": {"models[0].count": 2, "models[1].count": 1, "scenes": {"count": 1, "objects": 3, "layout": "scatter"}},
    "passes": {"camera.size": [96, 72]},
    "voxels": {"scenes.count": 1},
}


@pytest.fixture(scope="module", autouse=True)
def _built_once():
    with built_once():
        yield


def cost(file):
    """A whole street takes a while to build."""
    return [pytest.mark.slow] if "place:" in file.read_text("utf-8") else []


@pytest.mark.slow
@pytest.mark.parametrize("file", [pytest.param(file, id=file.stem, marks=cost(file)) for file in RECIPES])
def test_a_label_s_recipe_makes_a_data_set_that_passes(file, tmp_path):
    recipe = Recipe.load(file, FEW.get(file.stem, {}) | ({} if file.stem == "passes" else {"engine": QUICK}))
    generate(recipe, tmp_path, workers=0)
    dataset = Dataset(tmp_path)
    report, seen = check(dataset, sample=None), {len(dataset), sum("rgb" in sample.files for sample in dataset)}
    assert report.ok, report.findings
    shown = {*recipe.annotations, *recipe.channels} - {*DEFAULT_CHANNELS}
    assert shown
    assert {report.checked[name] for name in (*(shown & labels().keys()), "surface")} <= seen
    pictures = [sample for sample in dataset if "rgb" in sample.files]
    for source in shown & drawable().keys() - {"lidar"}:
        assert any(changes_the_picture(sample, source) for sample in pictures), source


def changes_the_picture(sample, source):
    """Return whether a label's drawing shows anything, over the picture or beside it."""
    plain, drawn = draw_sample(sample), draw_sample(sample, [drawable()[source].name])
    return plain.shape != drawn.shape or (plain != drawn).any()


def test_every_label_that_can_be_asked_for_has_a_recipe_and_every_label_a_drawing():
    shown = [Recipe.load(file) for file in RECIPES]
    assert on_request().keys() <= {name for recipe in shown for name in recipe.annotations}
    followed = {"tracks"} if any(recipe.tracks for recipe in shown) else set()
    assert channels().keys() - {*FINISHED} <= {name for recipe in shown for name in recipe.channels} | followed
    assert labels().keys() <= drawable().keys()
