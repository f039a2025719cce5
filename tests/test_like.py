"""Each system of Table 1 has a recipe in recipes/like: rendered small, its data set passes, and docs/like.md shows it."""

import re

import pytest

from built_once import QUICK, built_once
from like_trees import READ
from quick import quick
from small import ROOT
from viewsphere import Recipe, generate, plan
from viewsphere.check import check
from viewsphere.recipe.reading.file import read
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

SMALL = {"camera.size": [96, 72], "engine": QUICK}

# A street with a car, and what is made in no time in the place of another: the same one for all. A town takes ten times as long
# to build.
STREET = {
    "seed": 2,
    "scene.place": "zoo:neighbourhood",
    "models": [
        {"source": "zoo:car", "motion": {"kind": "path", "lane": "right", "speed": 7, "offset": 105}},
        {
            "source": "zoo:box",
            "category": "car",
            "scale": {"length": 1.5},
            "motion": {"kind": "path", "lane": "left", "speed": 8, "offset": 90},
        },
    ],
    "scenes": {"count": 1, "objects": 2, "layout": [[-1.7, 0, 0], [1.7, 0, 180]]},
    "time.frames": 2,
}
DRIVE = {**STREET, "viewpoints.lane": "right", "viewpoints.offset": 92}
ROOM = {"seed": 12, "scene.place.source": "zoo:room", "scene.place.draw": "fixed"}
TWO = {"fog": {"fog": 90}, "night": {"sky": "night", "sun": "auto"}}
# What makes each recipe small beyond the size of its pictures: two or three frames, of few models.
FEW: dict[str, dict] = {
    "sintel": {
        "seed": 2,
        "time.frames": 2,
        "time.shutter": 0,
        "scenes.objects": 2,
        "scenes.layout": [[-2.4, -1, 0], [2.4, -3, 0]],
    },
    "virtual_kitti": {**DRIVE, "camera.focal_px": 60, "variations": {"clone": {}, "fog": {"fog": 90}}},
    "synthia": {**DRIVE, "camera.focal_px": 60, "variations": {"summer": {}}},
    "suncg": {**ROOM, "camera.size": [640, 480], "models[0].count": 1, "viewpoints.count": 1},
    "minos": {**ROOM, "time.frames": 2},
    "surreal": {"camera.size": [320, 240], "time.frames": 2, "scene.place": None},
    "flyingthings3d": {
        "models[0].source": ["zoo:box", "zoo:chair", "zoo:lamp", "zoo:wheelie_bin"],
        "models[0].count": 1,
        "scenes.count": 1,
        "scenes.objects": 4,
        "time.frames": 2,
        "camera.focal_px": 105,
    },
    "icl_nuim": {**ROOM, "camera.size": [640, 480], "time.frames": 2},
    "driving_in_the_matrix": {**DRIVE, "variations": TWO},
    "viper": {**DRIVE, "variations": TWO},
    "airsim": STREET,
    "carla": DRIVE,
    "render_for_cnn": {"viewpoints.count": 1},
    "nyc3dcars": {
        "seed": 2,
        "models[0].count": 2,
        "scenes": {"count": 1, "objects": 2, "layout": [[-1.7, -16, 0], [1.6, -3, 182]]},
        "viewpoints.count": 2,
        "scene.place": "zoo:neighbourhood",
    },
    "pascal3d": {"seed": 2, "scenes.count": 1, "scenes.objects": 2, "viewpoints.count": 2, "scene.place": "zoo:neighbourhood"},
    "objectnet3d": {"models[0].source": ["zoo:backpack", "zoo:can"], "models[1].source": ["zoo:laptop"], "viewpoints.count": 1},
    "liebelt": {"viewpoints.azimuth": [30, 200], "viewpoints.elevation": [20]},
    "falling_things": {**ROOM, "scenes.count": 1, "viewpoints.count": 1},
    "sun_saenko": {"models": [{"source": "zoo:mug"}, {"source": "zoo:chair"}], "viewpoints.count": 2},
}
# Where only some of a recipe's entries of models are rendered, these, and one model of each.
SOME = {
    "sintel": [0, 3],
    "surreal": [0, 2],
    "render_for_cnn": [2, 5, 6, 9],
    "pascal3d": [2, 3],
    "objectnet3d": [0, 1, 3, 9, 10],
    "liebelt": [1, 2],
}


@pytest.fixture(scope="module", autouse=True)
def _built_once():
    with built_once():
        yield


def test_the_systems_of_table_1_are_the_recipes():
    assert sorted(SYSTEMS) == sorted(file.stem for file in FOLDER.glob("*.yaml"))


def test_the_page_shows_each_recipe_in_the_table_s_order():
    assert re.findall(r"^`recipes/like/(\w+)\.yaml`", PAGE, re.MULTILINE) == SYSTEMS
    assert re.findall(r"^!\[[^\]]+\]\(images/like/(\w+)\.jpg\)", PAGE, re.MULTILINE) == SYSTEMS
    assert all((ROOT / "docs" / "images" / "like" / f"{name}.jpg").is_file() for name in SYSTEMS)


@pytest.mark.parametrize("name", quick(SYSTEMS, *(name for name in SYSTEMS if name != "suncg")))
def test_a_recipe_is_planned_as_it_is(name):
    assert plan(Recipe.load(FOLDER / f"{name}.yaml")).frames >= 18


@pytest.mark.slow
@pytest.mark.parametrize("name", SYSTEMS)
def test_a_recipe_makes_a_data_set_that_passes_in_its_formats(name, tmp_path):
    file = FOLDER / f"{name}.yaml"
    models = read(file)[0]["models"]
    some = {"models": [{**models[i], "count": 1} for i in SOME[name]]} if name in SOME else {}
    recipe = Recipe.load(file, {**SMALL, **some, **FEW[name]})
    generate(recipe, tmp_path, workers=0)
    dataset = Dataset(tmp_path)
    assert len(dataset) > 0 and sum(len(sample.objects) for sample in dataset) > 0
    report = check(dataset, sample=2)
    assert report.ok, report.findings
    if name in READ:
        READ[name](dataset)
