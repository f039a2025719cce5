"""The recipe in Python: what it accepts, what it refuses and in which words."""

import math
import pickle
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from viewsphere.errors import RecipeError
from viewsphere.recipe.recipe import Recipe

MODELS = [{"source": "zoo:car", "count": 3}]
VIEWS = {"distance": 5}


def recipe(**fields):
    return Recipe(**{"models": MODELS, "viewpoints": VIEWS, **fields})


def mistake(**fields) -> str:
    with pytest.raises(RecipeError) as caught:
        recipe(**fields)
    return str(caught.value)


def test_the_least_recipe_has_the_documented_defaults():
    r = recipe()
    assert (r.name, r.seed, r.max_frames, r.shot_frames, r.label_alpha) == ("dataset", 0, 1_000_000, None, 0.01)
    assert r.channels == ("rgb", "depth", "instances", "normals")
    assert [(entry.name, entry.options) for entry in r.formats] == [("native", {}), ("coco", {})]
    assert r.splits.shares == {"train": 0.7, "val": 0.3}
    assert r.splits.by == "model"
    assert r.camera.size == (640, 480)
    assert r.engine.name == "raster"
    assert r.scene.background.is_sky
    assert (r.scene.automatic_ground, r.scene.sun, r.scene.draw) == ("on", "auto", "per_model")


def test_a_recipe_is_frozen_and_pickles():
    r = recipe()
    with pytest.raises(ValidationError):
        r.seed = 3
    assert pickle.loads(pickle.dumps(r)) == r
    assert pickle.loads(pickle.dumps(r)).folder == Path.cwd()


def test_numpy_values_and_paths_are_plain_data():
    r = recipe(
        seed=np.int64(4),
        models=[{"source": Path("cars") / "a.obj", "category": "car"}],
        viewpoints={"azimuth": np.arange(0, 360, 90), "distance": np.float32(2.5), "elevation": (0, np.float64(10))},
    )
    assert r.seed == 4
    assert r.models[0].source == (str(Path("cars/a.obj")),)
    assert r.viewpoints.azimuth == (0, 90, 180, 270)
    assert r.viewpoints.distance == 2.5


LENSES = [
    ({"fov_deg": 90}, 320, 320),
    ({"fov_deg": 90, "distortion": {"model": "fisheye", "coefficients": [0, 0, 0, 0]}}, 1280 / math.pi, 1280 / math.pi),
    ({"fov_deg": 90, "fov_axis": "vertical"}, 240, 240),
    ({"focal_px": 500}, 500, 500),
    ({"focal_px": [500, 510]}, 500, 510),
    ({"focal_mm": 35, "sensor_mm": 32}, 35 / 32 * 640, 35 / 32 * 640),
    ({"focal_mm": 35, "sensor_mm": [32, 18]}, 35 / 32 * 640, 35 / 18 * 480),
]


@pytest.mark.parametrize(("lens", "fx", "fy"), LENSES)
def test_each_kind_of_lens_gives_its_focal_length(lens, fx, fy):
    k = recipe(camera={"size": [640, 480], **lens}).camera.intrinsics
    assert math.isclose(k.fx, fx, rel_tol=1e-14)
    assert math.isclose(k.fy, fy, rel_tol=1e-14)
    assert (k.cx, k.cy, k.skew) == (320, 240, 0)


def test_a_full_camera_matrix_and_distortion_are_kept():
    matrix = [[500.0, 0.5, 300.0], [0.0, 510.0, 250.0], [0.0, 0.0, 1.0]]
    distortion = {"model": "brown_conrady", "coefficients": [0.1, 0, 0, 0]}
    k = recipe(camera={"size": [640, 480], "K": matrix, "distortion": distortion}).camera.intrinsics
    assert k.K.tolist() == matrix
    assert k.distortion is not None
    assert k.distortion.coefficients == (0.1, 0, 0, 0)


def test_colours_have_names_codes_and_numbers():
    for white in ("white", "#fff", "#FFFFFF", [1, 1, 1]):
        assert recipe(scene={"background": white}).scene.background.color == (1, 1, 1)
    assert recipe(scene={"background": "#336699"}).scene.background.color == (0.2, 0.4, 0.6)


def test_the_ground_is_there_under_the_sky_unless_said_otherwise():
    assert recipe(scene={"background": "white"}).scene.automatic_ground == "off"
    assert recipe(scene={"background": "environment"}).scene.automatic_ground == "catcher"
    assert not recipe(scene={"background": "white"}).scene.has_ground
    assert recipe(scene={"background": "white", "ground": True}).scene.has_ground
    assert not recipe(scene={"ground": "off"}).scene.has_ground
    assert recipe(scene={"ground": "#336699"}).scene.ground.color == (0.2, 0.4, 0.6)
    assert recipe(scene={"sun": False}).scene.sun == "off"
    assert recipe(scene={"sun": "on"}).scene.sun == "on"


NOON = {"date": "2026-06-21", "time": "12:30Z", "latitude": 41, "longitude": -8}
LAMP = {"position": [0, 0, 3], "strength": 1}

MISTAKES = [
    ({"nam": "x"}, "nam: 'nam' is unknown; did you mean 'name'? Valid: name, seed, ", ""),
    ({"seed": -1}, "seed: expected a number greater than or equal to 0; found -1", ""),
    ({"seed": 1.5}, "seed: expected a whole number; found 1.5", ""),
    ({"name": "a\nb"}, "name: expected one line of printable text; found 'a\\nb'", ""),
    ({"models": []}, "models: expected at least 1 of them; found 0", ""),
    ({"models": [{"source": "a.obj"}]}, "models[0]: expected a category", ""),
    ({"models": [{"source": "car"}]}, "models[0]: expected a category, such as car; found none", "; did you mean 'zoo:car'?"),
    (
        {"models": [{"source": ["zoo:car", "a.obj"], "category": "car"}]},
        "models[0]: expected either files or models",
        "",
    ),
    ({"models": [{"source": "zo:car"}]}, "models[0]: expected a category", "; there is no source 'zo'; did you mean 'zoo'?"),
    ({"models": [{"source": "zoo:"}]}, "models[0]: expected the name of a model after 'zoo:'", ""),
    ({"models": [{**MODELS[0], "unit": "mmm"}]}, "models[0].unit: 'mmm' is unknown; did you mean 'mm'? Valid: m, cm", ""),
    ({"models": [{**MODELS[0], "unit": 0}]}, "models[0].unit: 0 is unknown. Valid: m, cm", ""),
    ({"models": [{**MODELS[0], "up": "z"}]}, "models[0].up: 'z' is unknown; did you mean '+z'? Valid: +x, -x", ""),
    ({"models": [{**MODELS[0], "up": "+z", "forward": "-z"}]}, "models[0]: expected up and forward along diff", ""),
    ({"models": [{**MODELS[0], "centring": "bx"}]}, "models[0].centring: 'bx' is unknown; did you mean 'box'? Valid: box", ""),
    ({"models": [{**MODELS[0], "scale": {"length": 0}}]}, "models[0].scale.length: expected a number greater", ""),
    ({"models": [{**MODELS[0], "scale": 2}]}, "models[0].scale: expected as_is, real_size or a mapping", "; found 2"),
    ({"models": [{"source": "a.obj", "category": "a", "scale": "real_size"}]}, "models[0]: expected real_size", ""),
    ({"models": [{**MODELS[0], "count": 0}]}, "models[0].count: expected a number greater than or equal to 1", ""),
    ({"models": [{**MODELS[0], "real_size": {"width": 1, "height": 1}}]}, "models[0].real_size.length: expected a", ""),
    ({"viewpoints": {}}, "viewpoints.distance: expected a value; found nothing", ""),
    ({"viewpoints": {"kind": "gird"}}, "viewpoints.kind: 'gird' is unknown; did you mean 'grid'? Valid: grid, ", ""),
    ({"viewpoints": {"distance": 0}}, "viewpoints.distance: expected distances above 0 m; found 0", ""),
    ({"viewpoints": {"distance": [1, -2]}}, "viewpoints.distance: expected distances above 0 m; found -2", ""),
    ({"viewpoints": {"distance": True}}, "viewpoints.distance: expected a number; found true", ""),
    ({"viewpoints": {"distance": "5"}}, "viewpoints.distance: expected a number, a list of", "; found '5'"),
    ({"viewpoints": {"distance": []}}, "viewpoints.distance: expected at least 1", ""),
    ({"viewpoints": {"distance": math.nan}}, "viewpoints.distance: expected a finite number; found nan", ""),
    ({"viewpoints": {**VIEWS, "elevation": 91}}, "viewpoints.elevation: expected elevations of -90", "; found 91"),
    ({"viewpoints": {**VIEWS, "azimuth": [0, 90, 0]}}, "viewpoints.azimuth: expected distinct values; found 0 twi", ""),
    ({"viewpoints": {**VIEWS, "bins": 50}}, "viewpoints.bins: expected a number of degrees that divides 360", ""),
    ({"viewpoints": {**VIEWS, "target": "centre"}}, "viewpoints.target: expected center, follow or [x, y, z]", ""),
    ({"viewpoints": {"kind": "sphere", "count": 5, "distance": [5, 4]}}, "viewpoints.distance: expected [low, h", ""),
    ({"viewpoints": {"kind": "jitter", "distance": 1, "plus_minus": {"distance": 1}}}, "viewpoints: expected dist", ""),
    ({"camera": {"size": [0, 480]}}, "camera.size[0]: expected a number greater than or equal to 1; found 0", ""),
    ({"camera": {"size": [640, 10**9]}}, "camera.size[1]: expected a number less than or equal to 16384", ""),
    ({"camera": {"size": [640]}}, "camera.size[1]: expected a value; found nothing", ""),
    ({"camera": {"fov_deg": 40, "focal_px": 3}}, "camera: expected one of fov_deg,", "; found fov_deg and focal_px"),
    ({"camera": {"distortion": {"model": "fisheye", "coefficients": [1]}}}, "camera.distortion: fisheye: expected 4 coeff", ""),
    (
        {"camera": {"distortion": {"model": "brown_conrady", "coefficients": [-1e5, 0, 0, 0]}}},
        "camera.distortion: expected coefficients that show 1.1 degrees around the axis",
        "",
    ),
    ({"camera": {"focal_mm": 35}}, "camera: expected focal_mm and sensor_mm together", ""),
    ({"camera": {"focal_mm": 35, "sensor_mm": -1}}, "camera.sensor_mm: expected millimetres above 0", ""),
    ({"camera": {"fov_deg": 180}}, "camera.fov_deg: expected a number less than 180", ""),
    ({"camera": {"K": [[1, 0, 0], [0, 1, 0], [0, 0, 2]]}}, "camera.K: expected [[fx, skew, cx]", ""),
    ({"scene": {"background": "no"}}, "scene.background: expected sky, environment, tr", "'no'; did you mean 'transparent'?"),
    ({"scene": {"fog": "no"}}, "scene.fog: expected off, a number (visibility), or a mapping; found 'no'; did you mean 'o", ""),
    ({"scene": {"fog": "yes"}}, "scene.fog: expected off, a number (visibility), or a mapping", "; found 'yes'"),
    ({"scene": {"wet": "yes"}}, "scene.wet: expected auto, off, a number (amount), or a mapping", "did you mean 'auto'?"),
    ({"scene": {"sun": "yes"}}, "scene.sun: 'yes' is unknown; did you mean 'on'? Valid: auto, on, off", ""),
    ({"rig": "yes"}, "rig: expected a mapping; found 'yes'", ""),
    ({"rig": 5}, "rig: expected a mapping; found 5", ""),
    ({"rig": False}, "rig: expected a mapping; found false: leave the field out for none", ""),
    ({"splits": "off"}, "splits: expected a mapping; found 'off': leave the field out for none", ""),
    ({"scene": {"background": "whit"}}, "scene.background: expected sky, environment, tr", "; did you mean 'white'?"),
    ({"scene": {"background": None}}, "scene.background: expected sky", "; put a '#' colour in quotes"),
    ({"scene": {"background": [255, 255, 255]}}, "scene.background: expected sky", "; found [255, 255, 255]"),
    ({"scene": {"background": {"image": "a.png", "images": "b"}}}, "scene.background: expected one of color, ", ""),
    ({"scene": {"background": {"image": "a.png", "draw": "fixed"}}}, "scene.background: expected images beside", ""),
    ({"scene": {"background": "skyy"}}, "scene.background: expected sky, environment", "; found 'skyy'; did you mean 'sky'?"),
    ({"scene": {"sky": {"hdir": "a.exr"}}}, "scene.sky.hdir: 'hdir' is unknown; did you mean 'hdri'? Valid: zenith", ""),
    (
        {"scene": {"sky": {"choise": ["daylight"]}}},
        "scene.sky.choise: 'choise' is unknown; did you mean 'choice'? Valid: ",
        "",
    ),
    (
        {"scene": {"sky": ["a.exr"]}},
        "scene.sky: expected daylight, night, the path of an EXR or HDR file, or a mapping",
        "['a.exr']",
    ),
    (
        {"scene": {"lights": [{"kind": "spot", "position": [0, 0, 0], "strength": 1}]}},
        "scene.lights[0].position: the lamp is at the point it is aimed at, ",
        "[0.0, 0.0, 0.0]: change this place or toward",
    ),
    (
        {
            "scene": {
                "lights": [{"kind": "area", "position": {"choice": [[1, 1, 1], [2, 2, 2]]}, "toward": [2, 2, 2], "strength": 1}]
            }
        },
        "scene.lights[0].position: the lamp is at the point it is aimed at",
        "[2.0, 2.0, 2.0]: change this place or toward",
    ),
    (
        {"scene": {"lights": [{"kind": "area", "at": {"elevation": 90, "distance": 3}, "toward": [0, 0, 3], "strength": 1}]}},
        "scene.lights[0].at: the lamp is at the point it is aimed at",
        "[0.0, 0.0, 3.0]: change this place or toward",
    ),
    (
        {"scene": {"lights": [{"kind": "area", "position": [0, 0, 1], "size": [1, 0], "strength": 1}]}},
        "scene.lights[0].size[1]: expected a number greater than 0",
        "found 0",
    ),
    (
        {"scene": {"lights": [{"position": [0, 0, 1e20], "strength": 1}]}},
        "scene.lights[0].position[2]: expected a number less than or equal to 100000",
        "found 1e+20",
    ),
    ({"scene": {"sun": {"strength": -1}}}, "scene.sun.strength: expected a number greater than or equal to 0", "found -1"),
    ({"scene": {"sun": {"strength": 1e38}}}, "scene.sun.strength: expected a number less than or equal to 1000000000", "1e+38"),
    (
        {"scene": {"sun": {"color": [1e38, 1, 1]}}},
        "scene.sun.color[0]: expected a number less than or equal to 1000000",
        "1e+38",
    ),
    ({"scene": {"view": {"temperature_k": 100}}}, "scene.view.temperature_k: expected a number greater", "1500; found 100"),
    (
        {"scene": {"background": "transparent", "smoother": {"kind": {"choice": ["none", "poisson"]}}}},
        "scene.smoother.kind: expected none, box or gaussian beside background: transparent; found poisson, which takes",
        "choose another, or give a background",
    ),
    ({"scene": {"planes": [{"image": "a", "height": 1e30, "at": [0, 1, 0]}]}}, "scene.planes[0].height: expected", "1e+30"),
    ({"viewpoints": {"distance": [1, 2e6]}}, "viewpoints.distance: expected distances of at most 1,000,000 m", "found 2e+06"),
    (
        {"viewpoints": {"distance": [1, 1e30]}},
        "viewpoints.distance[1]: expected a number less than or equal to 1000000000",
        "1e+30",
    ),
    ({"viewpoints": {"distance": 9, "target": [0, -1e30, 0]}}, "viewpoints.target[1]: expected a number greater", "-1e+30"),
    ({"camera": {"size": [9, 9], "focal_px": 1e30}}, "camera.focal_px: expected a number less", "1e+30"),
    (
        {"scene": {"ground": "of"}},
        "scene.ground: expected on, off, auto, catcher, a mapping, a colour name",
        "; found 'of'; did you mean 'off'?",
    ),
    (
        {"scene": {"sun": {"elevaton": 3}}},
        "scene.sun.elevaton: 'elevaton' is unknown; did you mean 'elevation'? Valid: azimuth",
        "",
    ),
    ({"scene": {"sun": 3}}, "scene.sun: expected auto, on, off or a mapping; found 3", ""),
    ({"scene": {"sun": {"date": "2026-06-21"}}}, "scene.sun: expected date, time, latitude, longitude together", "found date"),
    ({"scene": {"sun": {**NOON, "time": "12:30"}}}, "scene.sun.time: expected a time and its distance from UTC", "'12:30'"),
    ({"scene": {"sun": {**NOON, "date": "21.6.2026"}}}, "scene.sun.date: expected a date such as '2026-06-21'", ""),
    ({"scene": {"sun": {**NOON, "elevation": 4}}}, "scene.sun: expected angles or date, time and place, not both", ""),
    (
        {"scene": {"sky": {"hdri": "a.exr", "zenith": [1, 1, 1]}}},
        "scene.sky.zenith: 'zenith' is unknown. Valid: hdri, stre",
        "",
    ),
    ({"scene": {"sky": {"daylight": {"clouds": 2}}}}, "scene.sky.daylight.clouds: expected a number less than", "found 2"),
    ({"scene": {"lights": {"strength": 1}}}, "scene.lights: expected one of position, at; found none", ""),
    ({"scene": {"lights": [{**LAMP, "at": {"distance": 2}}]}}, "scene.lights[0]: expected one of position, at; found both", ""),
    (
        {"scene": {"lights": [{**LAMP, "kind": "sopt"}]}},
        "scene.lights[0].kind: 'sopt' is unknown; did you mean 'spot'? Valid: area, hemisphere, point, spot",
        "",
    ),
    (
        {"scene": {"lights": [{**LAMP, "blend": 1}]}},
        "scene.lights[0].blend: 'blend' is unknown. Valid: count, strength, color",
        "",
    ),
    ({"scene": {"lights": [{"position": [0, 0, 3]}]}}, "scene.lights[0].strength: expected a value; found nothing", ""),
    (
        {"scene": {"ground": {"roughnes": 1}}},
        "scene.ground.roughnes: 'roughnes' is unknown; did you mean 'roughness'? Valid: color, material, pattern",
        "",
    ),
    ({"scene": {"materials": [{"models": "car_*"}]}}, "scene.materials[0]: expected tint, metallic, roughness, image", ""),
    ({"scene": {"background": {"blur": 0.1}}}, "scene.background: expected image or images beside blur", ""),
    ({"scene": {"background": {"image": "a", "zoom": 2}}}, "scene.background: expected fit: crop beside zoom and pl", ""),
    ({"scene": {"background": {"color": "red", "transparent": True}}}, "scene.background: expected one of color, ", ""),
    ({"scene": {"background": {"choice": ["sky", "transparent"]}}}, "scene: expected a transparent background in all", ""),
    ({"scene": {"background": {"choice": ["sky", {"images": "a", "draw": "fixed"}]}}}, "scene: expected no draw inside", ""),
    ({"scene": {"smoother": "gausian"}}, "scene.smoother: 'gausian' is unknown; did you mean 'gaussian'? Valid: none, box", ""),
    (
        {"scene": {"view": {"transform": "filmc"}}},
        "scene.view.transform: 'filmc' is unknown; did you mean 'filmic'? Valid: standard",
        "",
    ),
    (
        {"scene": {"effects": {"noise": 1}}},
        "scene.effects.noise: 'noise' is unknown; did you mean 'shot_noise'? Valid: draw, blur",
        "",
    ),
    ({"scene": {"jitter": {"distance": [-1, 0]}}}, "scene.jitter.distance[0]: expected a number greater than or", "-1"),
    (
        {"scene": {"draw": "per_shot"}},
        "scene.draw: 'per_shot' is unknown. Valid: fixed, per_model, per_sequence, per_frame",
        "",
    ),
    ({"engine": 3}, "engine: expected a mapping; found 3", ""),
    ({"channels": ["rgb", "rgb"]}, "channels: expected distinct names; found 'rgb' twice", ""),
    ({"channels": "rgb"}, "channels: expected a list; found 'rgb'", ""),
    (
        {"splits": {"by": "mdel"}},
        "splits.by: 'mdel' is unknown; did you mean 'model'? Valid: model, scene, sequence, pose, frame",
        "",
    ),
    ({"splits": {"train": 0.7, "val": 0.2}}, "splits: expected shares that add up to 1; found train 0.7", "0.9"),
    ({"splits": {"train": "most"}}, "splits.train: expected a share of 0 to 1, a list", ""),
    ({"splits": {"by": "pose", "train": 1, "val": ["a"]}}, "splits: expected by: model", ""),
    ({"splits": {"a/b": 1}}, "splits: expected names of letters", ""),
    ({"label_alpha": 0}, "label_alpha: expected a number greater than 0", ""),
    ({"max_frames": 0}, "max_frames: expected a number greater than or equal to 1", ""),
]


@pytest.mark.parametrize(("fields", "start", "end"), MISTAKES)
def test_a_mistake_is_one_line_that_says_where_and_what(fields, start, end):
    message = mistake(**fields)
    assert message.startswith(start)
    assert message.endswith(end)
    assert "\n" not in message


def test_a_misspelt_field_that_is_needed_is_one_mistake():
    with pytest.raises(RecipeError) as caught:
        Recipe(models=MODELS, viewpoint=VIEWS)
    assert str(caught.value).startswith("viewpoint: 'viewpoint' is unknown; did you mean 'viewpoints'? Valid: name, ")
    assert "\n" not in str(caught.value)
    with pytest.raises(RecipeError) as caught:
        Recipe(models=MODELS, shots=VIEWS, camara={})
    assert [line.split(":")[0] for line in str(caught.value).splitlines()] == ["viewpoints", "shots", "camara"]


def test_every_mistake_is_told_on_a_line_of_its_own():
    lines = mistake(seed=-1, channels=["rgb", "rgb"], camera={"size": [640, 480], "fov": 3}).splitlines()
    assert {line.split(":")[0] for line in lines} == {"seed", "channels", "camera.fov"}


RANGE_MISTAKES = [
    ({"start": 0, "stop": 10, "step": 0}, "viewpoints.azimuth.step: expected a number greater than 0; found 0"),
    ({"start": 0, "stop": 10, "step": -5}, "viewpoints.azimuth.step: expected a number greater than 0; found -5"),
    ({"start": 30, "stop": 10, "step": 5}, "viewpoints.azimuth: expected stop at or above start; found start 30 and"),
    ({"start": 0, "stop": 400, "step": 5}, "viewpoints.azimuth: expected at most a full turn; found 0 to 400"),
    ({"start": 0, "stop": 360, "step": 1e-200}, "viewpoints.azimuth: expected a step that gives at most 10^12"),
    ({"start": 0, "stop": 10}, "viewpoints.azimuth.step: expected a value; found nothing"),
]


@pytest.mark.parametrize(("azimuth", "start"), RANGE_MISTAKES)
def test_a_range_that_leads_nowhere_is_a_mistake(azimuth, start):
    assert mistake(viewpoints={"azimuth": azimuth, "distance": 1}).startswith(start)


def test_the_digest_counts_what_changes_pictures_and_labels_only():
    same = recipe()
    for fields in ({"name": "b"}, {"formats": ["kitti"]}, {"max_frames": 5}, {"shot_frames": 3}):
        assert recipe(**fields).digest == same.digest
    for fields in (
        {"seed": 1},
        {"models": [{"source": "zoo:car", "count": 4}]},
        {"viewpoints": {"distance": 6}},
        {"camera": {"size": [640, 480], "fov_deg": 41}},
        {"scene": {"sun": "off"}},
        {"engine": {"name": "raster", "samples": 2}},
        {"channels": ["rgb"]},
        {"splits": {"by": "pose"}},
        {"label_alpha": 0.5},
    ):
        assert recipe(**fields).digest != same.digest
    assert recipe(camera={"size": [640, 480], "fov_deg": 40.0}).digest == same.digest


def test_engine_options_stand_beside_its_name():
    engine = recipe(engine={"name": "raster", "samples": 4}).engine
    assert (engine.name, engine.options) == ("raster", {"samples": 4})
    assert recipe(engine="blender").engine.name == "blender"
