"""Rigs of recipes: where their sensors are, what lenses they have, and mistakes."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from small import small_recipe
from viewsphere import Dataset, generate
from viewsphere.check import check
from viewsphere.errors import RecipeError
from viewsphere.geometry.camera import project
from viewsphere.model.sensors.rig import Rig
from viewsphere.planning.plan import plan
from viewsphere.planning.rigs import rig_of
from viewsphere.recipe.recipe import Recipe
from viewsphere.run.reports.rig_view import rig_lines, rig_mesh, sensor_facts

BENT = {"model": "brown_conrady", "coefficients": [-0.1, 0.01, 0, 0]}


def made(rig, **more) -> Rig:
    recipe = Recipe(**{"models": [{"source": "zoo:car"}], "viewpoints": {"distance": 4}, "rig": rig, **more})
    return rig_of(recipe, recipe.camera.intrinsics)


def sensors(**entries) -> Rig:
    return made({"sensors": entries})


def pose(rig, i):
    return np.array(rig.sensors[i].rig_from_sensor)


def test_stereo_is_two_equal_cameras_side_by_side():
    rig = made({"kind": "stereo", "baseline": 0.12})
    assert [s.name for s in rig.sensors] == ["left", "right"]
    assert rig.sensors[0].intrinsics == rig.sensors[1].intrinsics
    np.testing.assert_array_equal(pose(rig, 1), [[1, 0, 0, 0.12], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    assert rig.rectified == ((0, 1, 0.12),)


@pytest.mark.parametrize("count", [2, 3, 5, 6, 8])
def test_surround_turns_to_the_right_by_equal_steps(count):
    rig = made({"kind": "surround", "count": count, "radius": 0.4})
    assert [s.name for s in rig.sensors] == [f"camera{i}" for i in range(count)]
    for i in range(count):
        yaw = 2 * math.pi * i / count
        ahead, right, down = pose(rig, i)[:3, 2], pose(rig, i)[:3, 0], pose(rig, i)[:3, 1]
        np.testing.assert_allclose(ahead, [math.sin(yaw), 0, math.cos(yaw)], atol=1e-11)
        np.testing.assert_allclose(right, [math.cos(yaw), 0, -math.sin(yaw)], atol=1e-11)
        np.testing.assert_array_equal(down, [0, 1, 0])
        np.testing.assert_allclose(pose(rig, i)[:3, 3], 0.4 * ahead - [0, 0, 0.4], atol=1e-11)


@pytest.mark.parametrize(
    ("rotation", "ahead", "right"),
    [
        ([0, 90, 0], [1, 0, 0], [0, 0, -1]),  # to the right
        ([90, 0, 0], [0, -1, 0], [1, 0, 0]),  # up
        ([0, 0, 90], [0, 0, 1], [0, 1, 0]),  # clockwise: what was right is below
        ([30, 90, 0], [math.cos(math.radians(30)), -0.5, 0], [0, 0, -1]),  # to the right, then up
    ],
)
def test_a_rotation_turns_right_then_up_then_clockwise(rotation, ahead, right):
    rig = sensors(a={}, b={"rotation": rotation})
    np.testing.assert_allclose(pose(rig, 1)[:3, 2], ahead, atol=1e-11)
    np.testing.assert_allclose(pose(rig, 1)[:3, 0], right, atol=1e-11)


@given(st.tuples(st.floats(-89, 89), st.floats(-179, 179), st.floats(-179, 179)))
def test_matrix_and_angles_say_the_same(rotation):
    by_angles = sensors(a={}, b={"rotation": rotation, "position": [1, 2, 3]})
    by_matrix = sensors(a={}, b={"rotation": pose(by_angles, 1)[:3, :3].tolist(), "position": [1, 2, 3]})
    np.testing.assert_allclose(pose(by_matrix, 1), pose(by_angles, 1), atol=1e-11)
    np.testing.assert_allclose(sensor_facts(by_angles)[1].rotation, rotation, atol=2e-6)


@given(st.tuples(*[st.floats(-3, 3)] * 3), st.tuples(st.floats(-5, 5), st.floats(-5, 5), st.floats(0.1, 9)))
def test_what_a_sensor_looks_at_is_in_its_middle(place, off):
    look = [a + b for a, b in zip(place, off, strict=True)]
    rig = sensors(a={}, b={"position": place, "look": look})
    at = (np.array(look) - pose(rig, 1)[:3, 3]) @ pose(rig, 1)[:3, :3]
    lens = rig.sensors[1].intrinsics
    np.testing.assert_allclose(project(lens, at)[0], [lens.cx, lens.cy], atol=1e-6)
    assert abs(pose(rig, 1)[1, 0]) < 1e-12 and pose(rig, 1)[1, 1] > 0  # level in the rig


def test_the_first_sensor_is_the_origin_wherever_it_is_listed():
    """In a car's axes, the same two sensors to one another."""
    of_car = sensors(
        a={"position": [1, 0.5, 2], "rotation": [10, 40, 5]}, b={"position": [1.3, 0.5, 2], "rotation": [0, 90, 0]}
    )
    car_from_b = pose(sensors(o={}, b={"position": [1.3, 0.5, 2], "rotation": [0, 90, 0]}), 1)
    car_from_a = pose(sensors(o={}, a={"position": [1, 0.5, 2], "rotation": [10, 40, 5]}), 1)
    np.testing.assert_array_equal(pose(of_car, 0), np.eye(4))
    np.testing.assert_allclose(pose(of_car, 1), np.linalg.inv(car_from_a) @ car_from_b, atol=1e-11)


def test_a_lens_that_a_sensor_does_not_state_is_the_camera_s():
    camera = {"size": [320, 240], "fov_deg": 60, "distortion": BENT}
    rig = made(
        {"sensors": {"a": {}, "b": {"size": [160, 120]}, "c": {"fov_deg": 90}, "d": {"fov_deg": 90, "distortion": BENT}}},
        camera=camera,
    )
    a, b, c, d = (s.intrinsics for s in rig.sensors)
    assert (a.width, a.distortion.coefficients) == (320, tuple(BENT["coefficients"]))
    assert (b.width, b.distortion) == (160, a.distortion) and math.isclose(b.fx, a.fx / 2)
    assert c.distortion is None and math.isclose(c.fx, 160) and (c.width, c.height) == (320, 240)
    assert d.distortion == a.distortion and d.fx == c.fx
    assert [s.channels for s in rig.sensors] == [None] * 4


def test_channels_are_in_the_recipe_s_order_and_follow_a_clear_background():
    more = {"channels": ["rgb", "depth", "instances"], "scene": {"background": "transparent"}}
    rig = made({"sensors": {"a": {}, "b": {"channels": ["depth", "rgb"]}}}, **more)
    assert rig.sensors[1].channels == ("rgba", "depth")


@pytest.mark.parametrize(
    "second",
    [
        {"position": [0.1, 0.01, 0]}, {"position": [0.1, 0, 0.001]}, {"position": [0.1, 0, 0], "fov_deg": 41},
        {"position": [0.1, 0, 0], "rotation": [0, 1e-4, 0]}, {"position": [0.1, 0, 0], "distortion": BENT}, {},
    ],
)  # fmt: skip
def test_other_pairs_are_not_rectified(second):
    assert sensors(a={}, b=second).rectified == ()


def test_pairs_are_found_in_either_order():
    assert sensors(a={}, b={"position": [-0.2, 0, 0]}).rectified == ((1, 0, 0.2),)
    aside = sensors(
        a={}, b={"position": [0, 0, 1], "rotation": [0, 90, 0]}, c={"position": [0, 0, 0.5], "rotation": [0, 90, 0]}
    )
    assert [(left, right) for left, right, _ in aside.rectified] == [(1, 2)]


MISTAKES = [
    ({"kind": "stereo", "baseline": 0}, "rig.baseline: expected a number greater than 0"),
    ({"kind": "stereo", "baseline": -0.1}, "rig.baseline: expected a number greater than 0"),
    ({"kind": "stereo"}, "rig.baseline: expected a value"),
    ({"kind": "mono"}, "rig.kind: 'mono' is unknown. Valid: sensors, stereo, surround, file"),
    ({"sensors": {"Left": {}, "left": {}}}, "rig.sensors: sensors .Left. and .left. differ only in capitals"),
    ({"sensors": {}}, "rig.sensors: expected at least 1"),
    ({"sensors": {"a b": {}}}, "rig.sensors.a b: "),
    ({"sensors": {"a": {"rotation": [0, 0, 0], "look": [0, 0, 1]}}}, "rig.sensors.a: expected rotation or look; found both"),
    ({"sensors": {"a": {"position": [0, 0, 1], "look": [0, 0, 1]}}}, "look away from position"),
    ({"sensors": {"a": {"look": [0, -1, 0]}}}, r"not straight above or below .*rotation: \[90, 0, 0\] looks up"),
    ({"sensors": {"a": {"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}}}, "rig.sensors.a.rotation: expected a rotation"),
    ({"sensors": {"a": {"fov_deg": 50, "focal_px": 300}}}, "found fov_deg and focal_px"),
    ({"sensors": {"a": {"K": [[0, 0, 1], [0, 1, 1], [0, 0, 1]]}}}, "rig.sensors.a.K: expected .*fx and fy above 0"),
    ({"sensors": {"a": {"channels": ["depht"]}}}, "rig.sensors.a.channels.0.: .*did you mean 'depth'"),
    ({"kind": "surround", "count": 1}, "rig.count: expected a number greater than or equal to 2"),
]  # fmt: skip


@pytest.mark.parametrize(("rig", "expected"), MISTAKES)
def test_mistakes_are_one_line(rig, expected):
    with pytest.raises(RecipeError, match=expected) as caught:
        made(rig)
    assert str(caught.value).startswith("rig") and "\n" not in str(caught.value)


def test_a_size_alone_needs_a_lens_that_is_not_in_pixels():
    with pytest.raises(RecipeError, match=r"rig\.sensors\.b: expected fov_deg, focal_px or K beside size"):
        made({"sensors": {"a": {}, "b": {"size": [64, 48]}}}, camera={"focal_px": 500})


def test_disparity_needs_a_rectified_pair():
    recipe = Recipe(
        models=[{"source": "zoo:car"}], viewpoints={"distance": 4}, channels=["disparity"], rig={"sensors": {"a": {}}}
    )
    with pytest.raises(RecipeError, match=r"channels: expected a rig with two rectified sensors .* for disparity; found none"):
        rig_of(recipe, recipe.camera.intrinsics)
    stereo = Recipe(**recipe.model_dump(mode="json") | {"rig": {"kind": "stereo", "baseline": 0.1}})
    assert rig_of(stereo, stereo.camera.intrinsics).rectified


def test_plans_count_sensors_and_tell_rigs_apart():
    base = {"models": [{"source": "zoo:car", "count": 2}], "viewpoints": {"distance": 4, "azimuth": [0, 90, 180]}}
    one = plan(Recipe(**base))
    two = plan(Recipe(**base, rig={"kind": "stereo", "baseline": 0.1}))
    three = plan(Recipe(**base, rig={"kind": "stereo", "baseline": 0.2}))
    assert (one.frames, two.frames) == (6, 12) and sum(two.split_counts.values()) == 12
    assert two.factors.endswith("3 poses x 2 sensors")
    assert len({one.digest, two.digest, three.digest}) == 3
    assert [row.count for row in two.rows] == [6, 6] and two.rows.row_at(7).first == 6


def test_a_rig_in_words_and_as_a_model():
    rig = sensors(front={}, side={"position": [0.3, 0, 0], "channels": ["rgb"]})
    text = "\n".join(rig_lines(rig))
    assert "position  [0.3, 0, 0] m" in text and "channels  rgb" in text and "40 x 30.54 degrees" in text
    assert "rectified   front and side, baseline 0.3 m" in text
    mesh = rig_mesh(rig)
    assert mesh.parts == ("front", "side") and (np.linalg.norm(mesh.normals, axis=1) - 1 < 1e-5).all()
    first, second = (mesh.vertices[mesh.triangles[mesh.triangle_part == i]].reshape(-1, 3) for i in (0, 1))
    np.testing.assert_allclose(second - first, np.tile([-0.3, 0, 0], (len(first), 1)), atol=1e-6)  # its right is a model's -X
    assert first[:, 1].min() < -0.2 < 0.1 > first[:, 1].max()  # ahead is the front, -Y


def test_a_fisheye_s_frustum_and_angle():
    fisheye = {"model": "fisheye", "coefficients": [0, 0, 0, 0]}
    rig = sensors(a={"fov_deg": 170, "size": [100, 100], "distortion": fisheye})
    assert abs(sensor_facts(rig)[0].fov_deg[0] - 170) < 2
    assert np.isfinite(rig_mesh(rig).vertices).all()


MIXED = {"sensors": {"front": {}, "around": {"projection": "equirectangular", "size": [64, 32]}}}


def kept(**changes):
    planned = plan(small_recipe(**{"rig": MIXED, "formats": [], **changes}))
    return [sensor.kept_channels(planned.recipe.channels) for sensor in planned.rig.sensors]


def test_each_sensor_keeps_the_channels_that_its_lens_has():
    """Without a list of channels, a pinhole has depth and a panorama distances along its rays."""
    recipe = small_recipe(rig=MIXED, formats=[]).model_dump(mode="json", exclude={"channels"}, exclude_defaults=True)
    planned = plan(Recipe.model_validate(recipe))
    assert planned.recipe.channels == ("rgb", "depth", "depth_ray", "instances", "normals")
    front, around = (sensor.kept_channels(planned.recipe.channels) for sensor in planned.rig.sensors)
    assert front == planned.recipe.channels and around == ("rgb", "depth_ray", "instances", "normals")
    again = plan(planned.recipe)
    assert again.rig == planned.rig and again.digest == planned.digest
    assert kept(channels=["rgb", "depth"]) == [("rgb", "depth"), ("rgb",)]
    assert kept(channels=["depth", "instances"]) == [("depth", "instances"), ("instances",)]


def test_a_sensor_beside_a_stereo_pair_of_other_lenses_has_no_disparity():
    channels = ["rgb", "disparity", "instances"]
    around, right = MIXED["sensors"]["around"], {"position": [0.1, 0, 0]}
    less = ("rgb", "instances")
    assert kept(rig={"sensors": {"a": {}, "b": right, "around": around}}, channels=channels) == [tuple(channels)] * 2 + [less]
    below = {**around, "position": [0, 0.2, 0]}
    assert (
        kept(rig={"sensors": {"front": {}, "upper": around, "lower": below}}, channels=channels)
        == [less] + [tuple(channels)] * 2
    )
    pinholes = {"a": {}, "b": right, "c": {"position": [0, 0, 1]}}
    assert kept(rig={"sensors": pinholes}, channels=channels) == [tuple(channels)] * 3  # NaN, as ever
    with pytest.raises(RecipeError, match="channels: expected a rig with two rectified sensors"):
        kept(channels=channels)


def test_a_channel_that_a_sensor_lists_and_its_lens_lacks_is_an_error():
    for entry in ({"channels": ["rgb", "depth"]}, {"channels": ["depth"]}):
        rig = {"sensors": {**MIXED["sensors"], "around": {**MIXED["sensors"]["around"], **entry}}}
        with pytest.raises(RecipeError, match="channels: depth: expected a lens with z-depth; found equirectangular"):
            kept(rig=rig, channels=["rgb", "depth"])
    with pytest.raises(RecipeError, match="channels: depth: expected a lens with z-depth"):
        kept(rig={"sensors": {"around": MIXED["sensors"]["around"]}}, channels=["rgb", "depth"])


@pytest.mark.slow
def test_a_rig_of_a_pinhole_and_a_panorama_is_proved(tmp_path):
    recipe = small_recipe(rig=MIXED, formats=["native", "colmap"]).model_dump(mode="json", exclude_defaults=True)
    del recipe["channels"]
    generate(Recipe.model_validate(recipe), tmp_path / "out", workers=0)
    dataset = Dataset(tmp_path / "out")
    assert not check(dataset).findings
    assert {("depth" in sample.channels, sample.sensor) for sample in dataset} == {(True, "front"), (False, "around")}
