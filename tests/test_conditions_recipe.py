"""The recipe of one street under six conditions."""

from pathlib import Path

import numpy as np
import pytest

import viewsphere as vs
from viewsphere import Recipe, plan

RECIPE = Path(__file__).parent.parent / "recipes/conditions.yaml"
NAMES = ["morning", "overcast", "fog", "rain", "snow", "night"]


def test_every_shot_is_planned_under_every_condition():
    planned = plan(RECIPE)
    assert [subject.rpartition("-")[2] for subject in planned.varied_subjects] == NAMES
    assert planned.frames == 6 and planned.factors.endswith("x 6 variations") and not planned.warnings
    scenes = {name: planned._under[name].scene(planned.subjects[0], "") for name in NAMES}
    assert 5 < scenes["morning"].sun.elevation < 25 and scenes["night"].lamps
    assert scenes["fog"].fog.visibility == 80 and scenes["rain"].wet
    assert scenes["rain"].rain.seed != scenes["snow"].snow.seed  # what a variation sets, it draws on its own
    assert scenes["overcast"].weather is False


@pytest.mark.slow
def test_conditions_look_different_and_have_the_same_labels():
    changes = {"camera.size": [96, 64], "channels": ["rgb", "depth", "instances", "semantic"], "models[0].count": 2}
    changes |= {"models[1].count": 1, "scenes.objects": 3, "scenes.layout": [[-1.9, 14, 0], [-0.1, 8.6, 12], [0.9, 2.8, 155]]}
    found = {sample.variation: sample for sample in vs.render(Recipe.load(RECIPE, changes))}
    assert list(found) == NAMES
    first = found["morning"]
    for sample in found.values():
        assert all((sample.channels[name] == first.channels[name]).all() for name in ("instances", "semantic"))
        np.testing.assert_array_equal(sample.depth, first.depth)
        assert [o.rle for o in sample.objects] == [o.rle for o in first.objects]
    level = {name: sample.rgb.mean() for name, sample in found.items()}
    spread = {name: sample.rgb[:20].std() for name, sample in found.items()}
    assert level["night"] < 0.5 * level["morning"]
    assert spread["fog"] < 0.5 * spread["overcast"]
