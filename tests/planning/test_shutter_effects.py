"""An open shutter and an effect that blurs as motion does exclude each other."""

import pytest

from small import small_recipe
from viewsphere import plan
from viewsphere.errors import RecipeError

BLURS = ({"motion_blur": 0.2}, {"motion_blur": [0, 0.2]}, {"motion_blur": {"choice": [0, 0.1]}})


def blurred(effects, shutter):
    return small_recipe(scene={"effects": effects}, time={"frames": 2, "fps": 5, "shutter": shutter}, formats=[])


@pytest.mark.parametrize("effects", BLURS)
def test_an_open_shutter_refuses_an_effect_that_blurs_too(effects):
    message = r"time\.shutter: expected 0 beside scene\.effects\.motion_blur, which blurs pictures, too; found 0\.5"
    with pytest.raises(RecipeError, match=message):
        plan(blurred(effects, 0.5))
    assert plan(blurred(effects, 0)).frames


def test_variations_are_refused_too():
    recipe = small_recipe(
        variations={"day": {}, "fast": {"effects": {"motion_blur": 0.2}}},
        time={"frames": 2, "fps": 5, "shutter": 0.5},
        formats=[],
    )
    with pytest.raises(RecipeError, match=r"time\.shutter: expected 0 beside scene\.effects\.motion_blur"):
        plan(recipe)


@pytest.mark.parametrize("effects", [{"motion_blur": 0}, {"blur": 0.2, "motion_angle_deg": 30}])
def test_an_open_shutter_takes_other_effects(effects):
    assert plan(blurred(effects, 0.5)).frames
