"""Channels that fill the disk for nobody are named, with what they take."""

import json
from collections import Counter

import pytest

from command_line import viewsphere
from small import ROOT, small_recipe
from viewsphere import Dataset, Recipe, generate
from viewsphere.formats import blend
from viewsphere.recipe.formats import read_formats
from viewsphere.run.exports.unused import among

CHANNELS = ["rgb", "depth", "instances", "normals"]


def notes_of(out, formats):
    recipe = small_recipe(channels=CHANNELS)
    return [note for note in generate(recipe, out, formats=formats).notes if "no format uses" in note]


def test_a_run_tells_what_the_unused_channels_take_on_disk(tmp_path):
    (note,) = notes_of(tmp_path / "ds", ["coco"])
    sizes = Counter()
    for sample in Dataset(tmp_path / "ds"):
        for name, file in sample.files.items():
            sizes[name] += (tmp_path / "ds" / file).stat().st_size
    share = (sizes["depth"] + sizes["normals"]) / sizes.total()
    order = "normals and depth" if sizes["normals"] > sizes["depth"] else "depth and normals"
    assert note.startswith(f"note: {order} are {share:.0%} of the frames' bytes and no format uses them (coco): leave them out")


@pytest.mark.slow
def test_nothing_is_said_where_a_format_takes_all_or_there_is_none(tmp_path):
    assert notes_of(tmp_path / "ds", []) == []
    assert len(notes_of(tmp_path / "ds", ["csv"])) == 1  # which takes pictures, and needs no channel
    assert notes_of(tmp_path / "ds", ["native", "coco"]) == []
    assert notes_of(tmp_path / "ds", ["coco"]) == []  # native lies beside it


@pytest.mark.slow
def test_a_format_that_cannot_be_written_here_is_no_error(tmp_path, monkeypatch):
    def refuse():
        raise AssertionError

    monkeypatch.setattr(blend, "FORMAT", blend.FORMAT.model_copy(update={"check": refuse}))
    (tmp_path / "ds" / "blend").mkdir(parents=True)
    (tmp_path / "ds" / "store" / "writing").mkdir(parents=True)
    (note,) = notes_of(tmp_path / "ds", ["coco"])
    assert "(coco, blend)" in note


@pytest.mark.parametrize(
    ("sizes", "formats", "said"),
    [
        ({"rgb": 50, "depth": 50}, ["coco"], ("depth", 0.5)),
        ({"rgb": 51, "depth": 49}, ["coco"], None),
        ({"rgb": 90, "rgba": 10}, ["csv"], None),
        ({"depth": 60, "rgb": 37, "instances": 3}, ["coco"], ("depth", 0.6)),  # so small a one is not worth its name
        ({"normals": 40, "rgb": 10, "depth": 50}, ["coco", "csv"], ("depth, normals", 0.9)),
        ({"normals": 40, "rgb": 10, "depth": 50}, ["coco", "native"], None),
        ({"rgb": 10, "depth": 90}, ["nerfstudio"], None),  # which reads depth, as it is asked for
        ({"rgb": 10, "depth": 90}, [{"nerfstudio": {"kind": "nerf-synthetic"}}], ("depth", 0.9)),
        ({}, ["coco"], None),
    ],
)
def test_large_shares_are_told(sizes, formats, said):
    found = among(Counter(sizes), read_formats(formats))
    assert (found and (", ".join(found.channels), found.share)) == said


def test_one_channel_and_three_are_told_in_words():
    coco = read_formats("coco")
    assert str(among(Counter(depth=6, rgb=4), coco)).startswith("depth is 60% of the frames' bytes and no format uses it ")
    three = Counter(depth=3, normals=2, parts=2, rgb=1)
    assert str(among(three, coco)).startswith("depth, normals and parts are 88% of ")


@pytest.mark.slow
def test_the_estimate_of_a_plan_tells_them(tmp_path):
    file = tmp_path / "r.yaml"
    file.write_text(small_recipe(channels=CHANNELS, formats=["coco"]).to_yaml())
    lines = viewsphere("plan", file, "--estimate", "--workers", "0").stdout.splitlines()
    assert any(line.startswith("note: ") and "no format uses them (coco)" in line for line in lines)
    told = json.loads(viewsphere("plan", file, "--estimate", "--workers", "0", "--json").stdout)["estimate"]["unused"]
    assert sorted(told["channels"]) == ["depth", "normals"] and 0.5 <= told["share"] < 1
    other = viewsphere("plan", file, "--estimate", "--workers", "0", "--set", "formats=[coco,native]").stdout
    assert "no format uses" not in other


STARTS = ROOT / "src" / "viewsphere" / "recipe" / "starts"
SHIPPED = sorted([*(ROOT / "recipes").glob("*.yaml"), *STARTS.glob("*/recipe.yaml")])


@pytest.mark.parametrize("file", SHIPPED, ids=lambda file: f"{file.parent.name}-{file.stem}")
def test_recipes_to_start_from_keep_nothing_large_for_nobody(file):
    recipe = Recipe.load(file)
    large = Counter(name for name in recipe.channels if name != "instances")
    assert among(large, recipe.formats) is None or not recipe.formats
