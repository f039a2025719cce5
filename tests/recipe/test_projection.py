"""A recipe names a lens by `projection`, and gives the lens's own options beside it: here a third party's."""

from __future__ import annotations

import math

import numpy as np
import pytest

from installed import example, installed
from small import small_recipe
from viewsphere import Dataset, Recipe, generate, plan
from viewsphere.check import check
from viewsphere.errors import RecipeError
from viewsphere.recipe.cameras.rig import SensorEntry
from viewsphere.recipe.world.scene import CameraEntry

SMALLEST = """    if size[0] < 8:
        raise ValueError(f"expected a width of 8 pixels or more; found {size[0]}")
    focal ="""
CODE = example("division").replace('model: Literal["division"] = "division"', "").split("LENS = ")[0] + example(
    "barrel"
).replace("from my_package.division", "#").replace("    focal =", SMALLEST)
CAMERA = {"size": [64, 48], "projection": "barrel", "half": 0.5, "k": -0.4}


@pytest.fixture
def barrel(tmp_path):
    with installed(tmp_path / "site", "lenses", "barrel", CODE):
        yield


@pytest.mark.usefixtures("barrel")
def test_its_options_give_the_matrix_and_the_parameters_and_are_written_as_they_were_given():
    recipe = Recipe.model_validate(small_recipe(camera=CAMERA))
    lens = recipe.camera.intrinsics
    assert (lens.fx, lens.fy, lens.cx, lens.cy) == (64, 64, 32, 24)
    assert lens.distortion is not None and lens.lens.name == "barrel" and lens.lens.record == {"model": "barrel", "k": -0.4}
    written = recipe.camera.model_dump(mode="json", exclude_defaults=True)
    assert written == CAMERA
    assert Recipe.model_validate(small_recipe(camera=written)).digest == recipe.digest
    xy = np.array([[0.5, 40.0]])
    assert np.allclose(lens.lens.project(lens.lens.rays(xy).directions)[0], xy, rtol=0, atol=1e-9)


@pytest.mark.usefixtures("barrel")
def test_a_camera_without_it_is_written_as_before():
    assert "projection" not in CameraEntry.model_validate({"fov_deg": 40}).model_dump()
    assert "projection" not in SensorEntry.model_validate({}).model_dump()


@pytest.mark.usefixtures("barrel")
@pytest.mark.parametrize(
    "given, told",
    [
        ({"projection": "barel"}, r"camera.projection: 'barel' is unknown; did you mean 'barrel'\? Valid: .*barrel"),
        ({"projection": 3}, r"camera.projection: 3 is unknown. Valid: "),
        ({"projection": "brown_conrady"}, "camera.projection: 'brown_conrady' is unknown. Valid: "),
        ({"k": None}, "camera.k: expected .*number; found null"),
        ({"half": 0}, "camera.half: expected a number greater than 0; found 0"),
        ({"half": math.nan}, "camera.half: expected a finite number; found nan"),
        ({"hlaf": 1}, r"camera.hlaf: 'hlaf' is unknown; did you mean 'half'\? Valid: projection, half, k, size"),
        ({"fov_deg": 40}, "camera.fov_deg: expected none beside projection: barrel, whose own options describe the lens"),
        ({"focal_px": 40}, "camera.focal_px: expected none beside projection: barrel"),
        ({"sensor_mm": 36}, "camera.sensor_mm: expected none beside projection: barrel"),
        ({"distortion": {"model": "fisheye", "coefficients": [0, 0, 0, 0]}}, "camera.distortion: expected none beside proj"),
        ({"size": [4, 4]}, "camera: expected a width of 8 pixels or more; found 4"),
    ],
)
def test_mistakes_are_told_in_one_line(given, told):
    with pytest.raises(RecipeError, match=told) as error:
        plan(small_recipe(camera=CAMERA | given))
    assert "\n" not in str(error.value)


@pytest.mark.usefixtures("barrel")
def test_a_sensor_has_it_too_and_shares_a_cameras():
    camera, straight = CameraEntry.model_validate(CAMERA), CameraEntry.model_validate({"fov_deg": 50, "size": [64, 48]})
    assert SensorEntry.model_validate({"size": [32, 24]}).lens(camera).intrinsics.fx == 32
    assert SensorEntry.model_validate({"fov_deg": 90}).lens(camera).intrinsics.distortion is None
    own = SensorEntry.model_validate({"projection": "barrel", "k": -0.1, "position": [0, 1, 0]})
    assert own.model_dump(exclude_defaults=True) == {"projection": "barrel", "k": -0.1, "position": (0, 1, 0)}
    assert own.lens(straight).intrinsics.fx == 32
    with pytest.raises(ValueError, match="expected none beside projection: barrel"):
        SensorEntry.model_validate({"projection": "barrel", "k": -0.1, "fov_deg": 40})


@pytest.mark.usefixtures("barrel")
@pytest.mark.slow
def test_a_data_set_made_with_it_passes_check(tmp_path):
    generate(small_recipe(camera=CAMERA, formats=[]), tmp_path / "out", workers=0)
    assert not check(Dataset(tmp_path / "out")).findings
