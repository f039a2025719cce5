"""A recipe's formats need no label that export can compute: what render writes is what export writes later."""

import pytest

import viewsphere as vs
from quick import quick
from small import ROOT, small_recipe, tree_hash
from viewsphere.errors import RecipeError
from viewsphere.run.exports.exporting import export
from viewsphere.run.opening import check_formats, prepare

FEW = ["rgb", "instances"]
RECORDED = {
    "hdf5": {"channels": ["rgb", "instances", "depth", "categories", "normals"]},
    "bop": {"channels": ["rgb", "instances", "depth"], "annotations": ["amodal"]},
    "pointcloud": {"channels": ["rgb", "instances", "depth"]},
}
"""What each format needs, recorded while rendering."""


SHIPPED = sorted(file for file in (ROOT / "recipes").rglob("*.yaml") if ".viewsphere." not in file.name)


def check(recipe):
    check_formats(prepare(recipe), recipe.formats, recipe.channels)


@pytest.mark.parametrize("name", quick(list(RECORDED), "pointcloud"))
def test_a_label_that_follows_from_the_shots_need_not_be_recorded(name, tmp_path):
    few = {"viewpoints": {"azimuth": [0], "elevation": [15, 50], "distance": 1.0}, "formats": [name]}
    vs.generate(small_recipe(channels=FEW, **few), tmp_path / "few", workers=0)
    vs.generate(small_recipe(**RECORDED[name], **few), tmp_path / "recorded", workers=0)
    export(tmp_path / "few", [name], output=tmp_path / "later")
    found = {folder: tree_hash(tmp_path / folder / name) for folder in ("few", "recorded", "later")}
    assert found["few"] == found["later"]
    if name != "hdf5":  # which keeps all channels that are recorded
        assert found["few"] == found["recorded"]


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"channels": ["depth"], "formats": ["coco"]}, "channels: expected rgb, which format coco needs; found depth: add it"),
        ({"channels": FEW, "formats": ["tapvid"]}, "formats: format tapvid: "),
        ({"channels": FEW, "formats": ["kitti_flow"]}, "formats: format kitti_flow: "),
    ],
)
def test_a_label_that_no_shot_gives_is_asked_for(fields, message):
    with pytest.raises(vs.errors.UserError) as caught:
        check(small_recipe(**fields))
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize("file", SHIPPED, ids=lambda file: file.stem)
def test_every_shipped_recipe_is_planned_as_it_is_shipped(file):
    check(vs.Recipe.load(file))


def test_formats_with_options_of_recipes_are_known():
    with pytest.raises(RecipeError, match=r"formats\[0\]\.coco\.category_ids: 'oco' is unknown"):
        check(small_recipe(formats=[{"coco": {"category_ids": "oco"}}]))
