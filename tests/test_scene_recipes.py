"""The recipes of scenes worth learning from make data sets that pass, small ones of each."""

import pytest

from built_once import QUICK, built_once
from small import ROOT
from viewsphere import Recipe, generate, plan
from viewsphere.check import check
from viewsphere.run.shots.stages import Stages
from viewsphere.store import Dataset

SMALL = {"camera.size": [96, 72], "formats": [], "engine": QUICK}

SCENES = ("tabletop_fall", "bin_picking", "flying_things")


@pytest.fixture(scope="module", autouse=True)
def _built_once():
    with built_once():
        yield


def changed(name, **more):
    return Recipe.load(ROOT / "recipes" / f"{name}.yaml", {**SMALL, **more})


@pytest.mark.slow
def test_the_recipe_of_occluders_makes_a_data_set_that_passes(tmp_path):
    few = {
        "models": [{"source": "zoo:wheelie_bin", "count": 4, "category": "bin"}],
        "viewpoints.count": 2,
        "splits": {"by": "frame"},
    }
    generate(changed("occluded", **few), tmp_path)
    dataset = Dataset(tmp_path)
    seen = [sample.objects[0].visibility for sample in dataset]
    assert len(seen) == 8 and sum(0.3 <= share <= 0.7 for share in seen) >= 6
    assert check(dataset, sample=2).ok


@pytest.mark.slow
def test_the_recipe_of_rooms_makes_a_data_set_that_passes(tmp_path):
    few = {"models[0].count": 1, "models[1].count": 1, "scenes.count": 1, "viewpoints.count": 2, "splits": {"by": "frame"}}
    generate(changed("rooms", **few), tmp_path)
    dataset = Dataset(tmp_path)
    assert len(dataset) == 2 and all(3 <= len(sample.objects) <= 8 for sample in dataset)
    assert check(dataset, sample=2).ok


@pytest.mark.slow
def test_the_recipe_of_a_town_makes_a_data_set_that_passes(tmp_path):
    few = {"models[0].count": 1, "scenes.objects": 3, "scenes.layout": [[-1.7, -16.5, 0], [-1.7, 5.5, 0], [1.7, -5.5, 180]]}
    generate(changed("town", **few, **{"time.frames": 2}), tmp_path)
    dataset = Dataset(tmp_path)
    assert len(dataset) == 2
    assert check(dataset, sample=1).ok


@pytest.mark.slow
@pytest.mark.parametrize(("name", "apart"), [*((name, 1) for name in SCENES), ("rooms", 56)])
def test_what_a_recipe_draws_has_room_and_comes_to_rest(name, apart):
    """One scene that does not would end a whole run. The first ones are rendered above."""
    planned, stages = plan(changed(name)), Stages()
    for number in range(apart, planned.shot_count, apart):
        assert planned.shot(number, stages.box).things


@pytest.mark.parametrize("name", [*SCENES, "occluded", "rooms", "town"])
def test_a_recipe_is_planned(name):
    assert changed(name).models
