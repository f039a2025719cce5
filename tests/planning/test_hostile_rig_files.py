"""Calibrations that a stranger, or a mistake, wrote: one line with the file, the problem and a fix, at once."""

import json
import struct
from itertools import pairwise

import pytest

from command_line import viewsphere
from viewsphere import Recipe
from viewsphere.errors import RecipeError
from viewsphere.planning.rig_files import read_rig
from viewsphere.planning.rigs import rig_of

LEVELS = "abcdefghi"
BOMB = "a: &a [1,1,1,1,1,1,1,1,1,1]\n" + "".join(
    f"{name}: &{name} [{','.join([f'*{before}'] * 10)}]\n" for before, name in pairwise(LEVELS)
)
LONG_TEXT = f"s: &s {'x' * 100_000}\nl: &l [{','.join(['*s'] * 50_000)}]\n"
MERGES = "a: &a {k: 1}\n" + "".join(
    f"{name}: &{name} {{<<: [{','.join([f'*{before}'] * 10)}]}}\n" for before, name in pairwise(LEVELS)
)
HUGE = "0x" + "f" * 5000
AFFINE, POLYNOMIAL = "1 0 0", "5 -150 0 1e-3 0 0"
TURN = [1.0, [0.0, 0.0, 0.0]]


def ocam(polynomial=POLYNOMIAL, affine=AFFINE, extent="480 640"):
    return f"{polynomial}\n3 1 1 1\n240 320\n{affine}\n{extent}\n"


def kalibr(**more):
    camera = {"intrinsics": [420, 425, 315.5, 239.5], "resolution": [640, 480]} | more
    return json.dumps({"cam0": camera})


def basalt(count=1, **more):
    lens = {"camera_type": "pinhole", "intrinsics": {"fx": 300, "fy": 300, "cx": 320, "cy": 240}}
    pose = dict(zip(("px", "py", "pz", "qx", "qy", "qz", "qw"), (0, 0, 0, 0, 0, 0, 1), strict=True))
    value = {"intrinsics": [lens | more] * count, "T_imu_cam": [pose] * count, "resolution": [[640, 480]] * count}
    return json.dumps({"value0": value})


def aria(label="left", name="KannalaBrandtK3", width=640, place=(0, 0, 0)):
    projection = {"Name": name, "Params": [300, 300, 320, 240, 0, 0, 0, 0]}
    pose = {"Translation": list(place), "UnitQuaternion": TURN}
    camera = {"Label": label, "Projection": projection, "T_Device_Camera": pose}
    return json.dumps({"CameraCalibrations": [camera | {"ConfigData": {"ImageWidth": width, "ImageHeight": 480}}]})


def opencv(rows="3", focal="300", camera="camera_matrix"):
    data = f"{{rows: {rows}, cols: 3, data: [{focal}, 0, 320, 0, {focal}, 240, 0, 0, 1]}}"
    return f"image_width: 640\nimage_height: 480\n{camera}: {data}\n"


def camera_info(name="left", focal="300", shift="0", model="plumb_bob"):
    projection = f"{{rows: 3, cols: 4, data: [{focal}, 0, 320, {shift}, 0, 300, 240, 0, 0, 0, 1, 0]}}"
    return opencv() + f"camera_name: {name}\ndistortion_model: {model}\nprojection_matrix: {projection}\n"


def colmap(*numbers, width="640"):
    return "".join(f"{number} PINHOLE {width} 480 300 300 320 240\n" for number in numbers)


def binary(width):
    return struct.pack("<QIiQQ4d", 1, 1, 1, width, 480, 300, 300, 320, 240)


RIGS = "1 2 CAMERA 1 CAMERA {} 1 1 0 0 0 0.1 0 0\n"

NAMED = [
    ("my calib (1).txt", ocam(), "my_calib_1"),
    ("_left.yaml", opencv(), "left"),
    ("Ünal.yaml", opencv(), "Unal"),
    ("相机.yaml", opencv(), "camera"),
    (f"{'x' * 100}.yaml", opencv(), "x" * 64),
    ("..a b.yaml", camera_info(name='""'), "a_b"),
    ("rig.yaml", camera_info(name="7"), "7"),
]

HOSTILE = {
    "a path as a name": (camera_info(name="../x"), r"begins with a letter or digit; found '\.\./x': rename"),
    "a list as a name": (camera_info(name="[a]"), r"found \"?.\['a'\]"),
    "a space in a label": (aria(label="a b"), "found 'a b': rename"),
    "a long label": (aria(label="a" * 100_000), "found 'aaa.*\\.\\.\\.: rename"),
    **{
        f"{field} of a bomb": (BOMB + field, r"at most 200,000 values \(limit MAX_RECIPE_VALUES\).*write fewer aliases")
        for field in ("cam0: *i", "CameraCalibrations: [*i]", "cam0: {intrinsics: *i}", "value0: {intrinsics: *i}", "K1: *i")
    },
    "merges": (MERGES, "MAX_RECIPE_VALUES"),
    "a value within itself": ("cam0: &a [*a]", "MAX_RECIPE_VALUES"),
    "aliases of a long text": (LONG_TEXT + "cam0: *l", r"cam0: expected a mapping; found \['xxx"),
    "long text as a name": (LONG_TEXT + camera_info(name="*l"), r"found .*\['xxx"),
    "thousands of digits": (opencv(rows=HUGE), "rows x cols numbers; found a whole number of 20000 bits x 3"),
    "a number of thousands of digits": (kalibr(intrinsics=0).replace(": 0", f": [{HUGE}]"), "found a whole number"),
    "a type's text": ("cam0: !!int ''", "expected YAML"),
    "a type's word": ("cam0: !!bool x", "expected YAML"),
    "a type's time": ("cam0: !!timestamp x", "expected YAML"),
    "sexagesimals": (f"cam0: {'1:' * 300}1.5", "expected YAML|expected a mapping"),
    "a control character": ("cam0: '\x01'", "expected YAML"),
    "lines of numbers": ("lines: [1, 2, 3, 4, 5]", "expected a calibration"),
    "a list as a model": (kalibr(camera_model=["pinhole"]), r"camera_model: expected one of .*; found \['pinhole'\]"),
    "a list as a distortion": (kalibr(distortion_model=[1], distortion_coeffs=[]), r"distortion_model: .*; found \[1\]"),
    "a list as a model of ROS": (camera_info(model="[a]"), r"distortion_model: expected one of .*; found \['a'\]"),
    "a mapping as a type": (basalt(camera_type={}), "camera_type: expected one of .*; found a mapping"),
    "a list as a projection": (aria(name=["a"]), r"Projection\.Name: expected one of .*; found \['a'\]"),
    "a bool as rows": (opencv(rows="true"), "found true x 3"),
    "Aria's width": (aria(width=1e15), "pixels from 1 to 16384; found 1000000000000000.0 and 480"),
    "Kalibr's width": (kalibr(resolution=[320.5, 240]), "whole numbers of pixels from 1 to 16384; found 320.5 and 240"),
    "a far focal length": (opencv(focal="1e300"), r"expected pixels up to 1e\+09; found fx 1e\+300"),
    "a far place": (aria().replace("CameraCalibrations\": [", "CameraCalibrations\": [" + json.dumps(
        json.loads(aria(label="first", place=(1e308, 0, 0)))["CameraCalibrations"][0]) + ","), "left: expected a place within"),
    "100 cameras": (basalt(100), "expected 1 to 64 sensors; found 100"),
}  # fmt: skip

TEXTS = {
    "a0 beyond": (ocam("5 -1e200 0 1e-3 0 0"), "a0 below 0, down to -1e\\+09.*found 5 numbers from -1e\\+200"),
    "a fraction of terms": (ocam("5.5 -150 0 1e-3 0 0"), "expected a polynomial"),
    "many terms": (ocam("60 -1e9 0" + " 1e300" * 58), "1 to 11 terms more; found 60 numbers"),
    "endless terms": (ocam("5 -1e9 0 1e300 1e300 1e300"), "expected a finite number; found -inf"),
    "affine": (ocam(affine="1e-300 0 1e300"), "expected an affine matrix near .*; found c 1e-300, d 0, e 1e\\+300"),
    "shear": (ocam(affine="1 0 1e9"), "expected an affine matrix"),
    "OCamCalib's size": (ocam(extent="480 1e12"), "pixels from 1 to 16384"),
    "a short size": (ocam(extent="480"), "expected a calibration"),
    "superscripts": (colmap("²"), "expected a calibration"),
    "thousands of digits": (colmap("1" * 5000), "expected a calibration"),
    "a wide picture": (colmap(1, width="99999999999"), "pixels from 1 to 16384; found '99999999999' and '480'"),
    "half a pixel": (colmap(1, width="320.5"), "whole numbers of pixels from 1 to 16384; found '320.5'"),
    "a camera again": (colmap(1, 1), "camera 1: expected every camera once; found 1 again: give each its own number"),
}


def shown(raised):
    message = str(raised.value)
    assert "\n" not in message and len(message) < 700
    return message


@pytest.mark.parametrize(("file", "text", "name"), NAMED)
def test_names_of_files_become_names_of_sensors(tmp_path, file, text, name):
    (tmp_path / file).write_text(text, "utf-8")
    models = {"models": [{"source": "zoo:car"}], "viewpoints": {"distance": 4}, "rig": {"file": file}}
    recipe = Recipe.model_validate(models, context={"folder": tmp_path})
    assert [sensor.name for sensor in rig_of(recipe, recipe.camera.intrinsics).sensors] == [name]


@pytest.mark.timeout(20)
@pytest.mark.parametrize("case", HOSTILE)
def test_hostile_documents_are_one_line(tmp_path, case):
    text, expected = HOSTILE[case]
    (tmp_path / "rig.yaml").write_text(text, "utf-8")
    with pytest.raises(RecipeError, match=expected) as raised:
        read_rig([tmp_path / "rig.yaml"])
    assert shown(raised).startswith(str(tmp_path / "rig.yaml"))


@pytest.mark.timeout(20)
@pytest.mark.parametrize("case", TEXTS)
def test_hostile_texts_are_one_line(tmp_path, case):
    text, expected = TEXTS[case]
    (tmp_path / "rig.txt").write_text(text, "utf-8")
    with pytest.raises(RecipeError, match=expected) as raised:
        read_rig([tmp_path / "rig.txt"])
    assert shown(raised).startswith(str(tmp_path / "rig.txt"))


def test_a_binary_width_has_the_same_limit(tmp_path):
    (tmp_path / "cameras.bin").write_bytes(binary(16384))
    assert read_rig([tmp_path / "cameras.bin"])[0].size == (16384, 480)
    (tmp_path / "cameras.bin").write_bytes(binary(2**63))
    with pytest.raises(RecipeError, match="pixels from 1 to 16384; found '9223372036854775808'"):
        read_rig([tmp_path / "cameras.bin"])


@pytest.mark.parametrize(
    ("other", "expected"), [("1", "found 1 again"), ("²", "cameras as sensors"), ("2" * 5000, "cameras as")]
)
def test_rigs_of_colmap_have_each_camera_once(tmp_path, other, expected):
    (tmp_path / "cameras.txt").write_text(colmap(1, 2))
    (tmp_path / "rigs.txt").write_text(RIGS.format(2))
    paths = [tmp_path / "cameras.txt", tmp_path / "rigs.txt"]
    assert [sensor.name for sensor in read_rig(paths)] == ["camera1", "camera2"]
    (tmp_path / "rigs.txt").write_text(RIGS.format(other), "utf-8")
    with pytest.raises(RecipeError, match=expected) as raised:
        read_rig(paths)
    assert shown(raised).startswith(str(tmp_path / "rigs.txt"))


def test_64_sensors_are_a_rig_and_a_format_without_sensors_is_none(tmp_path):
    (tmp_path / "rig.json").write_text(basalt(64))
    assert len(read_rig([tmp_path / "rig.json"])) == 64
    with pytest.raises(RecipeError, match="expected 1 to 64 sensors; found 0"):
        read_rig([tmp_path / "rig.json"], "kalibr")


def test_many_values_are_refused_before_the_rest_is_read(tmp_path, monkeypatch):
    monkeypatch.setenv("VIEWSPHERE_MAX_RECIPE_VALUES", "100")
    (tmp_path / "rig.yaml").write_text("cam0: [" + "1," * 100 + "\n}")
    with pytest.raises(RecipeError, match=r"rig\.yaml:1: .*at most 100 values"):
        read_rig([tmp_path / "rig.yaml"])


def test_plan_says_it_in_one_line(tmp_path):
    (tmp_path / "rig.yaml").write_text(camera_info(name="../x"))
    (tmp_path / "r.yaml").write_text("models: [{source: zoo:car}]\nviewpoints: {distance: 4}\nrig: {file: rig.yaml}\n")
    answer = viewsphere("plan", "r.yaml", cwd=tmp_path)
    assert answer.returncode == 2 and "rename the camera in the file" in answer.stderr
    assert len(answer.stderr.strip().splitlines()) == 1
