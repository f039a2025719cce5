"""Fog and night do not reach a photograph that is the background, so they are refused beside one."""

import numpy as np
import pytest
from PIL import Image

from viewsphere.errors import RecipeError
from viewsphere.planning.plan import plan
from viewsphere.recipe.recipe import Recipe


def planned(folder, **scene):
    Image.fromarray(np.full((8, 8, 3), 200, np.uint8)).save(folder / "photo.png")
    photo = {"image": str(folder / "photo.png")}
    camera, views = {"size": [32, 32], "fov_deg": 40}, {"azimuth": 0, "elevation": 5, "distance": 1}
    around = {"background": photo, "ground": "off", **scene}
    return plan(Recipe(name="sign", models=[{"source": "zoo:mug"}], viewpoints=views, camera=camera, scene=around))


@pytest.mark.parametrize("weather", [{"fog": 8}, {"sky": "night"}, {"fog": {"visibility": 30, "height": 2}}])
def test_fog_and_night_are_refused_beside_a_photograph(tmp_path, weather):
    with pytest.raises(RecipeError, match="does not reach the photographs"):
        planned(tmp_path, **weather)


def test_rain_and_snow_fall_before_it(tmp_path):
    assert planned(tmp_path, rain=40).frames == planned(tmp_path, snow=10).frames == 1
