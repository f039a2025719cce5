"""Each system of Table 1 has a recipe in recipes/like: rendered small, its data set passes, and docs/like.md shows it."""

import re

import pytest

from like_trees import READ
from small import ROOT
from viewsphere import Recipe, generate, plan
from viewsphere.check import check
from viewsphere.store import Dataset

FOLDER = ROOT / "recipes" / "like"
PAGE = (ROOT / "docs" / "like.md").read_text("utf-8")
SYSTEMS = [
    "sintel",
    "virtual_kitti",
    "synthia",
    "suncg",
    "minos",
    "surreal",
    "flyingthings3d",
    "icl_nuim",
    "driving_in_the_matrix",
    "viper",
    "airsim",
    "carla",
    "render_for_cnn",
    "nyc3dcars",
    "pascal3d",
    "objectnet3d",
    "liebelt",
    "falling_things",
    "sun_saenko",
]

SMALL = {"camera.size": [96, 72], "engine": {"name": "raster", "bounces": "off"}}
"""Whether light bounces is no matter of a recipe's kind of content; its bake would take half of a room's time."""

# A street with two cars: it is built in a tenth of a town's time.
STREET = {
    "scene.place": "zoo:neighbourhood",
    "models": [
        {"source": "zoo:car", "motion": {"kind": "path", "lane": "right", "speed": 7, "offset": 105}},
        {"source": "zoo:car", "name": "oncoming", "motion": {"kind": "path", "lane": "left", "speed": 8, "offset": 90}},
    ],
    "scenes": {"count": 1, "objects": 2, "layout": [[-1.7, 0, 0], [1.7, 0, 180]]},
    "time.frames": 2,
}
DRIVE = {**STREET, "viewpoints.lane": "right", "viewpoints.offset": 92}
TWO = {"fog": {"fog": 90}, "night": {"sky": "night", "sun": "auto"}}
# What makes each recipe small beyond the size of its pictures: two or three frames, of few models.
FEW: dict[str, dict] = {
    "sintel": {"time.frames": 2, "time.shutter": 0},
    "virtual_kitti": {**DRIVE, "camera.focal_px": 60, "variations": {"clone": {}, "fog": {"fog": 90}}},
    "synthia": {**DRIVE, "camera.focal_px": 60, "variations": {"summer": {}}},
    "suncg": {"camera.size": [640, 480], "models[0].count": 2, "viewpoints.count": 1},
    "minos": {"time.frames": 2},
    "surreal": {"camera.size": [320, 240], "models[0].count": 1, "time.frames": 2, "scene.place": None},
    "flyingthings3d": {"scenes.count": 1, "scenes.objects": 5, "time.frames": 2, "camera.focal_px": 105},
    "icl_nuim": {"camera.size": [640, 480], "time.frames": 2},
    "driving_in_the_matrix": {**DRIVE, "variations": TWO},
    "viper": {**DRIVE, "variations": TWO},
    "airsim": STREET,
    "carla": DRIVE,
    "render_for_cnn": {"viewpoints.count": 1, **{f"models[{i}].count": 1 for i in range(10)}},
    "nyc3dcars": {"scenes.count": 1, "viewpoints.count": 2, "scene.place": "zoo:neighbourhood"},
    "pascal3d": {"scenes.count": 2, "viewpoints.count": 1},
    "objectnet3d": {"viewpoints.count": 1},
    "liebelt": {"models[0].count": 1, "models[1].count": 1, "viewpoints.azimuth": [30, 200], "viewpoints.elevation": [20]},
    "falling_things": {"scenes.count": 1, "viewpoints.count": 1},
    "sun_saenko": {"models": [{"source": "zoo:mug"}, {"source": "zoo:chair"}], "viewpoints.count": 2},
}


def test_the_systems_of_table_1_are_the_recipes():
    assert sorted(SYSTEMS) == sorted(file.stem for file in FOLDER.glob("*.yaml"))


def test_the_page_shows_each_recipe_in_the_table_s_order():
    assert re.findall(r"^`recipes/like/(\w+)\.yaml`", PAGE, re.MULTILINE) == SYSTEMS
    assert re.findall(r"^!\[[^\]]+\]\(images/like/(\w+)\.jpg\)", PAGE, re.MULTILINE) == SYSTEMS
    assert all((ROOT / "docs" / "images" / "like" / f"{name}.jpg").is_file() for name in SYSTEMS)


@pytest.mark.parametrize("name", SYSTEMS)
def test_a_recipe_is_planned_as_it_is(name):
    assert plan(Recipe.load(FOLDER / f"{name}.yaml")).frames >= 18


@pytest.mark.slow
@pytest.mark.parametrize("name", SYSTEMS)
def test_a_recipe_makes_a_data_set_that_passes_in_its_formats(name, tmp_path):
    recipe = Recipe.load(FOLDER / f"{name}.yaml", {**SMALL, **FEW[name]})
    generate(recipe, tmp_path, workers=0)
    dataset = Dataset(tmp_path)
    assert len(dataset) > 0 and sum(len(sample.objects) for sample in dataset) > 0
    report = check(dataset, sample=2)
    assert report.ok, report.findings
    if name in READ:
        READ[name](dataset)
