"""What would make empty pictures is said when a recipe is planned, and nothing else is."""

import math

import pytest
from PIL import Image

from viewsphere.planning.plan import plan
from viewsphere.recipe.recipe import Recipe

VIEWS = {"azimuth": [0, 90, 180, 270], "elevation": 10, "distance": 2}


def warnings(scene, views=None, **fields):
    values = {"models": [{"source": "zoo:car"}], "splits": {"by": "model", "all": 1}, "viewpoints": {**VIEWS, **(views or {})}}
    return plan(Recipe(**values, scene=scene, **fields)).warnings


DARK = [
    {"sun": "off", "sky": {"strength": 0}},
    {"sun": {"strength": 0}, "sky": {"zenith": "black", "horizon": "black"}},
    {"sun": {"color": [0, 0, 0]}, "sky": {"strength": 0}, "lights": [{"position": [0, 0, 2], "strength": 0}]},
    {"sun": "off", "sky": {"strength": 0}, "lights": [{"position": [0, 0, 2], "strength": 3, "count": 0}]},
    {"sun": "off", "sky": {"strength": 0}, "lights": [{"kind": "hemisphere", "strength": 3, "color": "black"}]},
    {"sky": "daylight", "sun": {"date": "2026-01-01", "time": "00:00Z", "latitude": 50, "longitude": 0}},
    {"sun": "off", "sky": {"strength": {"choice": [0, {"uniform": [0, 0]}]}}},
]
LIT = [
    {},
    {"sun": "off"},
    {"sky": {"strength": 0}},
    {"sun": "off", "sky": {"strength": 0}, "lights": [{"position": [0, 0, 2], "strength": {"normal": [0, 1]}}]},
    {"sun": "off", "sky": {"strength": 0}, "lights": [{"kind": "hemisphere", "strength": 1, "color": "black", "below": "red"}]},
    {"sun": "off", "sky": "daylight"},
    {"sun": {"strength": [0, 1]}, "sky": {"strength": 0}},
]


@pytest.mark.parametrize("scene", DARK)
def test_a_scene_without_light_is_said(scene):
    assert [w for w in warnings(scene) if w.startswith("scene: no light: ")]


@pytest.mark.parametrize("scene", LIT)
def test_a_scene_with_some_light_is_not(scene):
    assert warnings(scene) == ()


def test_choices_without_light_are_said():
    (said,) = warnings({"sun": "off", "sky": {"choice": ["daylight", {"strength": 0}]}})
    assert said.startswith("scene: no light in some of what may be drawn")
    assert warnings({"sun": {"choice": ["on", "off"]}}) == ()


def test_a_photographed_sky_has_its_own_sun(tmp_path):
    (tmp_path / "a.hdr").write_bytes(b"#?RADIANCE\n\n-Y 2 +X 4\n")
    hdri = str(tmp_path / "a.hdr")
    assert warnings({"sky": hdri}) == ()
    assert warnings({"sky": {"hdri": hdri, "strength": 0}})[0].startswith("scene: no light")
    assert warnings({"sky": {"hdri": hdri, "strength": 0}, "sun": "on"}) == ()


@pytest.mark.parametrize(
    ("exposure", "word"),
    [
        (-16, "white is black"),
        ([-16, 2], "white is black"),
        ({"normal": [-12, 1]}, "white is black"),
        (16, "black is white"),
        ({"choice": [0, 15]}, "black is white"),
    ],
)
def test_an_exposure_that_hides_all_is_said(exposure, word):
    (said,) = warnings({"view": {"exposure": exposure}})
    assert said.startswith("scene.view.exposure: at ") and word in said


@pytest.mark.parametrize(
    "exposure", [0, -6, 5, [-4, 4], {"normal": [0, 1]}, {"normal": {"mean": 0, "deviation": 9, "min": -3, "max": 3}}]
)
def test_a_usual_exposure_is_not(exposure):
    assert warnings({"view": {"exposure": exposure}}) == ()


def test_an_exposure_fits_the_light():
    assert warnings({"sun": {"strength": 1e6}, "sky": {"strength": 1e6}, "view": {"exposure": -16}}) == ()
    assert warnings({"sky": {"strength": 1e-4}, "sun": "off", "view": {"exposure": 12}}) == ()


AWAY = [
    {"target": [3, 0, 0]},
    {"target": {"uniform": [[-2, -2, -2], [2, 2, 2]]}},
    {"target": [0, 0, [0, 3]]},
    {"target": {"normal": [[0, 0, 0], [0, 0, 1]]}},
    {"target": [0.6, 0, 0], "distance": [-0.8, 0]},
    {"target": {"choice": [[0, 0, 0], [0, 0, 9]]}},
]


@pytest.mark.parametrize("jitter", AWAY)
def test_jitter_that_looks_away_is_said(jitter):
    (said,) = warnings({"jitter": jitter})
    assert said.startswith("scene.jitter.target: up to ") and "out of the picture" in said


@pytest.mark.parametrize(
    "jitter", [{"target": {"normal": [[0, 0, 0], 0.05]}}, {"target": [0.6, 0, 0]}, {"distance": [-0.5, 9]}]
)
def test_jitter_that_keeps_the_model_in_is_not(jitter):
    assert warnings({"jitter": jitter}) == ()


def test_only_what_lies_beside_the_line_of_sight_counts():
    assert warnings({"jitter": {"target": [0, 1.9, 0]}}, {"azimuth": 180, "elevation": 0}) == ()
    assert warnings({"jitter": {"target": [0, -1.9, 0]}}, {"azimuth": 0, "elevation": 0}) == ()
    assert warnings({"jitter": {"target": [1.9, 0, 0]}}, {"azimuth": 180, "elevation": 0}) != ()


@pytest.fixture
def photos(tmp_path):
    Image.new("RGB", (40, 30)).save(tmp_path / "a.png")
    return {"images": str(tmp_path)}


HIDING = ["on", "gray", {"color": {"choice": ["gray", "red"]}}, {"choice": ["on", "gray"]}]


@pytest.mark.parametrize("ground", HIDING)
def test_photographs_behind_the_ground_are_said(ground, photos):
    (said,) = warnings({"background": photos, "ground": ground}, {"elevation": [30, 60]})
    assert said.startswith("scene.background: the endless ground hides about 100 % of its pictures; set scene.ground: catcher")


@pytest.mark.parametrize("ground", ["auto", "off", "catcher", {"catcher": True}, {"choice": ["on", "off"]}])
def test_photographs_that_are_seen_are_not(ground, photos):
    assert warnings({"background": photos, "ground": ground}, {"elevation": [30, 60]}) == ()


def test_the_horizon_says_how_much_of_photographs_is_hidden(photos):
    scene = {"background": photos, "ground": "on"}
    lens = {"size": [400, 400], "fov_deg": 90}  # half the height is the tangent of 45 degrees
    assert warnings(scene, {"elevation": 15}, camera=lens) == ()
    (said,) = warnings(scene, {"elevation": math.degrees(math.atan(0.5))}, camera=lens)
    assert "about 75 %" in said
    assert warnings({"background": "sky", "ground": "on"}, {"elevation": 60}) == ()


@pytest.mark.parametrize(("elevation", "is_said"), [([0, 12], False), ([0, 60], True)])
def test_few_random_poses_stand_for_all_that_scenes_draw(elevation, is_said, photos):
    views = {"kind": "sphere", "count": 1, "elevation": elevation, "distance": {"fill": 0.5}, "azimuth": [-180, 180]}
    for seed in range(5):
        said = warnings({"background": photos, "ground": "on"}, views, seed=seed, camera={"size": [400, 400], "fov_deg": 90})
        assert bool(said) is is_said


def test_a_target_that_is_not_the_model_is_said():
    (said,) = warnings({}, {"target": [0, 0, 7]})
    assert said.startswith("viewpoints: the models' centre")
    assert warnings({}, {"target": [0, 0, 0.3]}) == ()
    assert warnings({"place": "zoo:neighbourhood"}, {"target": [0, 0, 7]}) == ()


def test_a_wide_lens_sees_more():
    assert warnings({"jitter": {"target": [0, 0, 3]}}, camera={"size": [640, 480], "fov_deg": 160}) == ()


def test_jitter_below_the_ground_is_said():
    (said,) = warnings({"jitter": {"elevation": [-30, 30]}})
    assert said.startswith("elevations go down to -20")
    assert warnings({"jitter": {"elevation": [-30, 30]}, "ground": "off"}) == ()


def test_warnings_name_the_line(tmp_path):
    file = tmp_path / "r.yaml"
    file.write_text(
        "models: [{source: zoo:car}]\nsplits: {all: 1}\nviewpoints: {distance: 5}\nscene:\n  view:\n    exposure: -16\n"
    )
    (said,) = plan(Recipe.load(file)).warnings
    assert said.startswith(f"{file}:6: scene.view.exposure: ")


@pytest.mark.parametrize(("focal", "is_told"), [(20, True), (60, False)])
def test_a_lens_that_shows_little_of_its_picture_is_said(focal, is_told):
    """This fisheye shows angles up to 90 degrees: a circle of 20 x pi / 2 pixels is 0.2 of the picture."""
    lens = {"model": "fisheye", "coefficients": [-4 / (3 * math.pi**2), 0, 0, 0]}  # its radius is greatest at 90 degrees
    found = warnings({}, camera={"size": [120, 120], "focal_px": focal, "distortion": lens})
    told = [text for text in found if "shows nothing in" in text]
    assert bool(told) == is_told
    rig = {"sensors": {"a": {}, "b": {"focal_px": focal, "distortion": lens, "size": [120, 120]}}}
    told = [text for text in warnings({}, rig=rig) if text.startswith("rig: sensor b: the lens shows nothing in")]
    assert bool(told) == is_told
