"""Twins of a camera: further lenses at the same place, rendered instead of resampled."""

from __future__ import annotations

import numpy as np
import pytest

from small import small_recipe
from viewsphere import Dataset, Recipe, generate, plan
from viewsphere.check import check
from viewsphere.errors import RecipeError

BENT = {"model": "brown_conrady", "coefficients": [-0.3, 0.08, 0.001, -0.002]}
CAMERA = {"size": [96, 72], "focal_px": 80, "distortion": BENT}
PINHOLE = {"fov_deg": 50, "size": [64, 48]}


def with_also(also, **changes):
    return small_recipe(**{"camera": {**CAMERA, "also": also}, "formats": [], **changes})


def test_a_twin_is_a_sensor_at_the_camera_s_place():
    recipe = with_also({"pinhole": PINHOLE, "around": {"projection": "equirectangular", "size": [64, 32]}}, channels=["rgb"])
    rig = plan(recipe).rig
    assert [sensor.name for sensor in rig.sensors] == ["camera", "pinhole", "around"]
    assert all(np.array_equal(sensor.rig_from_sensor, np.eye(4)) for sensor in rig.sensors)
    bent, straight, around = (sensor.intrinsics for sensor in rig.sensors)
    assert bent == small_recipe(camera=CAMERA).camera.intrinsics
    assert straight.lens.is_linear and (straight.width, straight.height) == (64, 48)
    assert straight.lens.field_of_view()[0] == pytest.approx(50)
    assert around.lens.name == "equirectangular"


def test_a_recipe_with_twins_is_one_with_a_rig():
    recipe = with_also({"pinhole": PINHOLE}, channels=["rgb"])
    rig = {"sensors": {"camera": {}, "pinhole": PINHOLE}}
    same = small_recipe(camera=CAMERA, rig=rig, formats=[], channels=["rgb"])
    assert recipe == same and recipe.digest == same.digest
    assert type(recipe).model_validate(recipe.model_dump(mode="json")).digest == recipe.digest


@pytest.mark.slow
def test_labels_of_a_twin_are_those_of_its_own_lens_at_the_same_points(tmp_path):
    """Both pictures are proved, and a pixel's surface is where the other lens shows it."""
    generate(with_also({"pinhole": PINHOLE}, channels=["rgb", "depth", "position", "instances"]), tmp_path / "out", workers=0)
    dataset = Dataset(tmp_path / "out")
    report = check(dataset)
    assert not report.findings, report.findings
    bent, straight = dataset[0], dataset[1]
    assert np.array_equal(bent.camera.center, straight.camera.center) and np.array_equal(bent.camera.R, straight.camera.R)
    seen = straight.instances > 0
    points = straight.position[seen].astype(np.float64) @ bent.camera.R.T + bent.camera.t
    xy, is_shown = bent.camera.lens.project(points)
    column, row = np.floor(xy[is_shown]).astype(int).T
    inside = (column >= 0) & (column < 96) & (row >= 0) & (row < 72)
    same = bent.instances[row[inside], column[inside]] == straight.instances[seen][is_shown][inside]
    assert inside.sum() > 100 and same.mean() > 0.9  # but for edges


K = [[81, 0.5, 47], [0, 79, 35], [0, 0, 1]]
LENSES = {
    "focal": (CAMERA, [[80, 0, 48], [0, 80, 36], [0, 0, 1]]),
    "matrix": ({"size": [96, 72], "K": K, "distortion": BENT}, K),
    "centre": ({**CAMERA, "principal_point": [40, 30]}, [[80, 0, 40], [0, 80, 30], [0, 0, 1]]),
    "angle": ({"size": [96, 72], "fov_deg": 60, "distortion": BENT}, None),
}


@pytest.mark.parametrize("name", LENSES)
def test_an_empty_twin_of_a_bent_lens_is_the_pinhole_with_its_matrix(name):
    camera, matrix = LENSES[name]
    recipe = small_recipe(camera={**camera, "also": {"pinhole": {}, "masks": {"channels": ["instances"]}}}, formats=[])
    bent, straight, masks = plan(recipe).rig.sensors
    assert straight.intrinsics == bent.intrinsics.model_copy(update={"distortion": None}) == masks.intrinsics
    assert masks.channels == ("instances",) and bent.intrinsics.distortion is not None
    np.testing.assert_array_equal(straight.intrinsics.K, bent.intrinsics.K if matrix is None else matrix)
    assert type(recipe).model_validate(recipe.model_dump(mode="json")).digest == recipe.digest


@pytest.mark.parametrize(
    "camera",
    [
        {"size": [96, 72], "focal_px": 80},
        {**CAMERA, "focal_px": {"uniform": [70, 80]}},
        {"projection": "cylindrical", "size": [96, 40], "span": {"horizontal": 120}},
        {"fov_deg": 40, "size": [96, 72]},
    ],
)
def test_an_empty_twin_of_another_lens_is_an_error(camera):
    with pytest.raises(
        RecipeError, match=r"camera\.also\.pinhole: expected a lens of its own: one of fov_deg, .*, or \{\} beside a bent"
    ) as error:
        small_recipe(camera={**camera, "also": {"pinhole": {}}}, formats=[])
    assert "\n" not in str(error.value)


def test_a_wrong_lens_beside_an_empty_twin_is_named():
    with pytest.raises(RecipeError, match=r"camera\.focal_px"):
        small_recipe(camera={**CAMERA, "focal_px": -1, "also": {"pinhole": {}}}, formats=[])


@pytest.mark.parametrize(
    ("also", "told"),
    [
        (
            {"pinhole": {"size": [8, 8]}},
            "camera.also.pinhole: expected a lens of its own: one of fov_deg, .*; found 'size'",
        ),
        ({"pinhole": True}, "camera.also.pinhole: expected a mapping with one of fov_deg"),
        ({"camera": PINHOLE}, "camera.also.camera: expected another name; found camera"),
        ({"pinhole": {"fov_deg": 200}}, "camera.also.pinhole.fov_deg: expected a number less than 180; found 200"),
        ({"pinhole": {"fov_deg": 50, "fov": 2}}, "camera.also.pinhole.fov: .*unknown"),
        (
            {"pinhole": {"fov_deg": 50, "position": [1, 0, 0]}},
            "camera.also.pinhole: expected none of position, .*; found position",
        ),
        ({"pin hole": PINHOLE}, "camera.also.pin hole: expected a name of letters"),
    ],
)
def test_a_wrong_twin_is_one_line(also, told):
    with pytest.raises(RecipeError, match=told) as error:
        with_also(also)
    assert "\n" not in str(error.value)


def test_errors_of_planning_name_the_field_of_the_twin(tmp_path):
    file = tmp_path / "r.yaml"
    file.write_text(
        "models: [{source: zoo:car}]\nviewpoints: {distance: 9}\n"
        "camera:\n  fov_deg: 50\n  also:\n    ortho: {projection: orthographic}\n"
    )
    with pytest.raises(RecipeError, match=r"r\.yaml:6: camera\.also\.ortho: expected width_m beside projection: orthographic"):
        plan(Recipe.load(file))


@pytest.mark.parametrize("width", [True, "0.3"])
def test_a_width_that_is_no_number_is_refused(width):
    with pytest.raises(RecipeError, match=r"camera\.width_m: expected a number"):
        Recipe.model_validate(
            {
                "models": [{"source": "zoo:car"}],
                "viewpoints": {"distance": 9},
                "camera": {"projection": "orthographic", "width_m": width},
            }
        )


def test_twins_beside_a_rig_are_refused():
    with pytest.raises(RecipeError, match=r"camera\.also: expected none beside rig"):
        with_also({"pinhole": PINHOLE}, rig={"kind": "stereo", "baseline": 0.1})
