"""A rolling shutter of a recipe: its errors, a data set that is checked, and every format's answer."""

from __future__ import annotations

import json
import shutil

import numpy as np
import pytest

from rolling_scenes import READOUT, sliding
from sealing import seal_again
from viewsphere import Dataset, Recipe, generate, plan, plugins
from viewsphere.check import check
from viewsphere.errors import RecipeError, UserError
from viewsphere.labels import channels, labels
from viewsphere.plugins.format import FormatSpec
from viewsphere.recipe.formats import FormatEntry
from viewsphere.run.exports.exporting import export
from viewsphere.run.opening import check_formats
from viewsphere.store import encode

CHANNELS = [
    *("rgb", "depth", "depth_ray", "instances", "normals", "normals_geometric", "nocs", "coordinates", "position"),
    *("barycentrics", "triangles"),
]


def rolling_recipe(**changes) -> Recipe:
    """A box that slides past another one, seen by a camera that goes around both."""
    asked = {"channels": CHANNELS, "annotations": ["amodal", "contour", "occluders"]}
    return Recipe.model_validate(sliding("zoo:post_box", 1.1, 3) | asked | changes)


@pytest.mark.parametrize(
    ("rolling", "told"),
    [
        ({"readout": 0}, "camera.rolling.readout: expected a number greater than 0; found 0"),
        ({"readout": -0.03}, "camera.rolling.readout: expected a number greater than 0; found -0.03"),
        ({"readout": float("nan")}, "camera.rolling.readout: expected a finite number; found nan"),
        ({"readout": float("inf")}, "camera.rolling.readout: expected a finite number; found inf"),
        ({}, "camera.rolling.readout: "),
        ({"readout": 0.03, "direction": "left"}, "camera.rolling.direction: "),
        ({"readout": 0.03, "rows": 3}, "'rows' is unknown"),
    ],
)
def test_a_wrong_readout_is_one_line(rolling, told):
    with pytest.raises(RecipeError) as error:
        rolling_recipe(camera={"size": [96, 72], "fov_deg": 45, "rolling": rolling})
    assert told in str(error.value) and "\n" not in str(error.value)


FISHEYE = {"model": "fisheye", "coefficients": [0, 0, 0, 0]}


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"time": None}, "camera.rolling: expected time beside it"),
        ({"time": {"frames": 3, "fps": 13}}, "camera.rolling.readout: expected at most 0.0769231 s"),
        ({"time": {"frames": 3, "fps": 10, "shutter": 0.2}}, "time.shutter: expected 0 beside camera.rolling; found 0.2"),
        ({"channels": ["rgb", "depth_sensor"]}, "channels: depth_sensor: expected no camera.rolling beside it"),
        ({"channels": ["rgb", "voxels"]}, "channels: voxels: expected no camera.rolling beside it"),
        ({"engine": "cycles"}, "engine: expected one that paints rolling shutters"),
        ({"scene": {"ground": True, "rain": 5}}, "scene.rain: expected off beside camera.rolling"),
        ({"camera": {"size": [96, 72], "fov_deg": 45, "rolling": {"readout": 0.05}, "distortion": FISHEYE}}, "a pinhole"),
    ],
)
def test_what_it_rules_out_is_one_line_before_rendering(changes, told):
    if changes.get("time", 1) is None:
        changes = changes | {"viewpoints": {"azimuth": 0, "elevation": 20, "distance": 1.1}, "splits": {"by": "model"}}
        changes["models"] = [{"source": "zoo:post_box", "category": "post box"}]
    with pytest.raises(RecipeError) as error:
        plan(rolling_recipe(**changes))
    assert told in str(error.value) and "\n" not in str(error.value)


def test_labels_of_whole_objects_require_one_pose():
    """A label that reads points of whole objects cannot be computed for rows with poses."""
    compared = {"ObjectPoints"}
    for name, label in labels().items():
        if compared & {type(need).__name__ for need in label.needs}:
            assert label.one_pose, name


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    out = tmp_path_factory.mktemp("rolling") / "out"
    generate(rolling_recipe(), out, workers=0)
    return out


@pytest.mark.slow
def test_check_proves_it(whole):
    report = check(Dataset(whole))
    assert not report.findings and not report.not_run
    assert report.checked["surface"] == len(Dataset(whole)) == 6
    assert all(sample.camera.rows is not None for sample in Dataset(whole))


def test_corners_of_boxes_are_those_nearest_to_the_instant(whole):
    for sample in Dataset(whole):
        for o in sample.objects:
            assert np.isfinite(o.box3d_pixels).all()
            x0, y0, x1, y1 = o.box2d_unclipped
            low, high = o.box3d_pixels.min(axis=0), o.box3d_pixels.max(axis=0)
            assert (low <= (x0 + 0.6, y0 + 0.6)).all() and (high >= (x1 - 0.6, y1 - 0.6)).all()
    moved = [np.abs(o.box3d_pixels - global_pixels(s, o)).max() for s in Dataset(whole) for o in s.objects]
    assert max(moved) > 3


def global_pixels(sample, o) -> np.ndarray:
    placed = np.column_stack([o.box3d, np.ones(8)]) @ sample.camera.P.T
    return placed[:, :2] / placed[:, 2:]


@pytest.fixture
def copied(whole, tmp_path):
    return shutil.copytree(whole, tmp_path / "out")


@pytest.mark.parametrize("name", ["depth", "instances", "normals", "position", "nocs"])
def test_a_changed_row_is_found(copied, name):
    sample = Dataset(copied)[1]
    array = np.array(sample.channels[name])
    row = int(np.argmax((sample.channels["instances"] > 0).sum(axis=1)))
    array[row] = array[row - 1]
    file = copied / sample.files[name]
    file.write_bytes(encode(channels()[name], array))
    seal_again(copied)
    assert any(sample.index == finding.frame for finding in check(Dataset(copied)).findings)


@pytest.mark.parametrize("change", ["readout", "direction", "pose"])
def test_a_changed_readout_or_motion_is_found(copied, change):
    file = next(copied.glob("**/shot.json"))
    shot = json.loads(file.read_text())
    rolling = shot["rig"]["sensors"][0]["intrinsics"]["rolling"]
    if change == "readout":
        rolling["readout"] *= 1.01
    elif change == "direction":
        rolling["direction"] = "up"
    else:
        shot["exposures"][1]["things"][0]["motion"]["poses"][1][0][3] += 1e-3
    file.write_text(json.dumps(shot))
    seal_again(copied)
    assert check(Dataset(copied)).findings


def answers(recipe: Recipe) -> dict[str, str | None]:
    planned, found = plan(recipe), {}
    for name in plugins.names("formats"):
        try:
            check_formats(planned, [FormatEntry(name=name)], CHANNELS)
            found[name] = None
        except UserError as error:
            found[name] = str(error)
    return found


def test_every_format_holds_it_or_refuses_it_in_one_line(whole, tmp_path):
    camera = {"size": [96, 72], "fov_deg": 45}
    plain, rolled = answers(rolling_recipe(camera=camera)), answers(rolling_recipe())
    assert plain.keys() == rolled.keys()
    for name in plain:
        holds = plugins.load(FormatSpec, name).rolling
        if plain[name] is None:
            assert (rolled[name] is None) == holds, name
        if rolled[name] is not None and plain[name] is None:
            assert "one pose for all rows" in rolled[name] and "\n" not in rolled[name]
    assert {"native", "coco", "yolo", "voc", "webdataset"} <= {name for name, told in rolled.items() if told is None}
    assert {"colmap", "nerfstudio", "tum", "opencv"} <= {name for name, told in rolled.items() if told is not None}


def test_a_format_with_the_camera_has_the_readout_too(whole, tmp_path):
    sample, written = Dataset(whole)[0], set()
    for name in (name for name, told in answers(rolling_recipe()).items() if told is None):
        try:
            export(whole, [name], output=tmp_path / name)
        except UserError:
            continue  # it needs a package that is not here
        data = b"".join(file.read_bytes() for file in (tmp_path / name).rglob("*") if file.is_file())
        if repr(float(sample.camera.t[2])).encode() in data:
            written.add(name)
            assert repr(READOUT).encode() in data, name
    assert {"native", "coco"} <= written
