"""Calibrations of lenses that bend more: as their tools write them, against what the tools or the formulas project."""

import json

import numpy as np
import pytest

from lens_proofs import directions_of
from small import small_recipe
from viewsphere import Dataset, Recipe, generate
from viewsphere.check import check
from viewsphere.errors import RecipeError
from viewsphere.geometry.camera import project
from viewsphere.planning.rigs import rig_of

POINTS = directions_of(np.random.default_rng(5), 4000)
AHEAD = POINTS[POINTS[:, 2] > 0.6 * np.linalg.norm(POINTS, axis=1)][:200]
K = (301.5, 303.25, 320.75, 238.5)
TURN, SHIFT = (0.9, 0.1, -0.3, 0.3), (0.11, -0.02, 0.03)


def read(folder, texts, **more):
    for name, text in texts.items():
        (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    rig = {"kind": "file", "path": list(texts), **more}
    recipe = Recipe.model_validate(
        {"models": [{"source": "zoo:car"}], "viewpoints": {"distance": 4}, "rig": rig}, context={"folder": folder}
    )
    return rig_of(recipe, recipe.camera.intrinsics)


def shows(rig, points, sensor=0):
    pose = np.array(rig.sensors[sensor].rig_from_sensor)
    return project(rig.sensors[sensor].intrinsics, (points - pose[:3, 3]) @ pose[:3, :3])[0]


def pixels(x, y, offset=0.5):
    return np.stack([K[0] * x + K[2] + offset, K[1] * y + K[3] + offset], axis=1)


def turned(quaternion):
    """The rotation of w, x, y, z, by its formula."""
    w, x, y, z = np.array(quaternion) / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def double_sphere(points, xi, alpha):
    x, y, z = points.T
    first = np.sqrt(x * x + y * y + z * z)
    below = alpha * np.sqrt(x * x + y * y + (xi * first + z) ** 2) + (1 - alpha) * (xi * first + z)
    return x / below, y / below


def eucm(points, alpha, beta=1.0):
    x, y, z = points.T
    below = alpha * np.sqrt(beta * (x * x + y * y) + z * z) + (1 - alpha) * z
    return x / below, y / below


def omni(points, xi, k1, k2, p1, p2):
    x, y, z = points.T
    below = z + xi * np.sqrt(x * x + y * y + z * z)
    x, y = x / below, y / below
    s = x * x + y * y
    radial = 1 + k1 * s + k2 * s * s
    return x * radial + 2 * p1 * x * y + p2 * (s + 2 * x * x), y * radial + 2 * p2 * x * y + p1 * (s + 2 * y * y)


def atan(points, omega):
    x, y = points[:, 0] / points[:, 2], points[:, 1] / points[:, 2]
    r = np.hypot(x, y)
    scale = np.arctan(2 * r * np.tan(omega / 2)) / (omega * r)
    return x * scale, y * scale


BENT = (-0.1, 0.05, 0.001, -0.002)
KALIBR = {
    "ds": ([-0.2, 0.6], "none", [], lambda points: double_sphere(points, -0.2, 0.6)),
    "eucm": ([0.6, 1.1], "none", [], lambda points: eucm(points, 0.6, 1.1)),
    "omni": ([1.2], "radtan", BENT, lambda points: omni(points, 1.2, *BENT)),
    "pinhole": ([], "fov", [0.9], lambda points: atan(points, 0.9)),
}


@pytest.mark.parametrize("model", KALIBR)
def test_kalibr(model, tmp_path):
    own, bent, numbers, formula = KALIBR[model]
    entry = f"camera_model: {model}, intrinsics: {[*own, *K]}, distortion_model: {bent}, distortion_coeffs: {list(numbers)}"
    rig = read(tmp_path, {"camchain.yaml": f"cam0: {{{entry}, resolution: [640, 480]}}"})
    np.testing.assert_allclose(shows(rig, AHEAD), pixels(*formula(AHEAD)), rtol=0, atol=1e-9)
    assert (rig.sensors[0].intrinsics.width, rig.sensors[0].name) == (640, "cam0")


BASALT = {
    "ds": ({"xi": -0.2, "alpha": 0.6}, lambda points: double_sphere(points, -0.2, 0.6)),
    "eucm": ({"alpha": 0.6, "beta": 1.1}, lambda points: eucm(points, 0.6, 1.1)),
    "ucm": ({"alpha": 0.6}, lambda points: eucm(points, 0.6)),
    "pinhole": ({}, lambda points: (points[:, 0] / points[:, 2], points[:, 1] / points[:, 2])),
}


@pytest.mark.parametrize("kind", BASALT)
def test_basalt(kind, tmp_path):
    own, formula = BASALT[kind]
    lens = {"camera_type": kind, "intrinsics": dict(zip(("fx", "fy", "cx", "cy"), K, strict=True)) | own}
    poses = [
        dict(zip(("qw", "qx", "qy", "qz", "px", "py", "pz"), (*turn, *shift), strict=True))
        for turn, shift in (((1, 0.2, 0, 0), (0.3, 0, 0)), (TURN, SHIFT))
    ]
    value = {"intrinsics": [lens, lens], "T_imu_cam": poses, "resolution": [[640, 480], [640, 480]]}
    rig = read(tmp_path, {"calibration.json": json.dumps({"value0": value})})
    assert [sensor.name for sensor in rig.sensors] == ["cam0", "cam1"]
    np.testing.assert_allclose(shows(rig, AHEAD), pixels(*formula(AHEAD)), rtol=0, atol=1e-9)
    imu_from_first, imu_from_second = turned((1, 0.2, 0, 0)), turned(TURN)
    in_first = ((AHEAD @ imu_from_second.T + SHIFT) - (0.3, 0, 0)) @ imu_from_first
    np.testing.assert_allclose(shows(rig, in_first, 1), pixels(*formula(AHEAD)), rtol=0, atol=1e-8)


def test_basalt_s_other_lenses(tmp_path):
    numbers = {"kb4": [0.01, -0.002, 0.001, 0.0], "pinhole-radtan8": [0.1, 0.02, 0.001, 0.002, 0.01, 0.1, 0.0, 0.0]}
    for kind, values in numbers.items():
        names = ("k1", "k2", "k3", "k4") if kind == "kb4" else ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
        own = dict(zip(("fx", "fy", "cx", "cy", *names), (*K, *values), strict=True))
        pose = dict.fromkeys(("qx", "qy", "qz", "px", "py", "pz"), 0) | {"qw": 1}
        value = {"intrinsics": [{"camera_type": kind, "intrinsics": own}], "T_imu_cam": [pose], "resolution": [[640, 480]]}
        lens = read(tmp_path, {"calibration.json": json.dumps({"value0": value})}).sensors[0].intrinsics.distortion
        assert lens.coefficients == tuple(values)


ARIA = (
    240.9,
    319.5,
    239.1,
    -0.0271,
    0.0951,
    -0.0707,
    0.0167,
    0.0014,
    -0.0006,
    0.00045,
    -0.00091,
    -0.0004,
    -0.0001,
    0.0012,
    0.0,
)


def aria(label, turn, shift, config):
    projection = {"Description": "see FisheyeRadTanThinPrism.h", "Name": "FisheyeRadTanThinPrism", "Params": list(ARIA)}
    turn = (np.array(turn) / np.linalg.norm(turn)).tolist()
    pose = {"Translation": list(shift), "UnitQuaternion": [turn[0], turn[1:]]}
    return {"Calibrated": True, "Label": label, "Projection": projection, "SerialNumber": "", "T_Device_Camera": pose} | config


def test_project_aria(tmp_path):
    """The pixels of projectaria-tools are compared in the lens's own test; here the order of the numbers and the poses."""
    config = {"ConfigData": {"ImageWidth": 640, "ImageHeight": 480, "MaxSolidAngle": 1.4}}
    cameras = [aria("camera-slam-left", (1, 0, 0, 0), (0, 0, 0), config), aria("camera-rgb", TURN, SHIFT, {})]
    rig = read(tmp_path, {"calibration.json": json.dumps({"CameraCalibrations": cameras, "ImuCalibrations": []})})
    assert [sensor.name for sensor in rig.sensors] == ["camera-slam-left", "camera-rgb"]
    own = rig.sensors[0].intrinsics
    assert (own.width, own.height, own.fx, own.fy, own.cx, own.cy) == (640, 480, 240.9, 240.9, 320, 239.6)
    assert own.distortion.model == "fisheye624" and own.distortion.coefficients == ARIA[3:]
    np.testing.assert_allclose(shows(rig, AHEAD @ turned(TURN).T + SHIFT, 1), shows(rig, AHEAD), rtol=0, atol=1e-8)
    kannala = cameras[0] | {"Projection": {"Name": "KannalaBrandtK3", "Params": [*K, 0.01, 0.0, 0.0, 0.0]}}
    lens = read(tmp_path, {"calibration.json": json.dumps({"CameraCalibrations": [kannala]})}).sensors[0].intrinsics
    assert lens.distortion.coefficients == (0.01, 0.0, 0.0, 0.0) and lens.fy == K[1]


def test_project_aria_s_tools_agree(tmp_path):
    calibration = pytest.importorskip("projectaria_tools.core.calibration")
    rig = read(tmp_path, {"c.json": json.dumps({"CameraCalibrations": [aria("camera-rgb", (1, 0, 0, 0), (0, 0, 0), {})]})})
    theirs = calibration.CameraProjection(calibration.CameraModelType.FISHEYE624, np.array(ARIA))
    np.testing.assert_allclose(shows(rig, AHEAD), [theirs.project(point) + 0.5 for point in AHEAD], rtol=0, atol=1e-9)


COLMAP = {
    "SIMPLE_RADIAL": (300, 320, 240, -0.1),
    "RADIAL": (300, 320, 240, -0.1, 0.02),
    "OPENCV": (*K, *BENT),
    "FULL_OPENCV": (*K, *BENT, 0.01, 0.1, 0.02, 0.0),
    "SIMPLE_RADIAL_FISHEYE": (300, 320, 240, 0.02),
    "RADIAL_FISHEYE": (300, 320, 240, 0.02, -0.01),
    "OPENCV_FISHEYE": (*K, 0.02, -0.01, 0.001, 0.0),
    "FOV": (*K, 0.9),
    "THIN_PRISM_FISHEYE": (*K, 0.03, -0.005, 0.002, -0.001, 0.001, -0.0002, 0.003, -0.002),
    "RAD_TAN_THIN_PRISM_FISHEYE": (*K, *ARIA[3:]),
    "SIMPLE_DIVISION": (300, 320, 240, -0.2),
    "DIVISION": (*K, -0.2),
    "SIMPLE_FISHEYE": (300, 320, 240),
    "FISHEYE": K,
    "EUCM": (*K, 0.6, 1.1),
    "SIMPLE_PINHOLE": (300, 320, 240),
    "PINHOLE": K,
    "EQUIRECTANGULAR": (640, 480),
}


@pytest.mark.parametrize("model", COLMAP)
def test_colmap_s_cameras(model, tmp_path):
    """pycolmap writes both files, and projects the same."""
    pycolmap = pytest.importorskip("pycolmap")
    theirs = pycolmap.Camera(model=model, width=640, height=480, params=COLMAP[model], camera_id=7)
    whole = pycolmap.Reconstruction()
    whole.add_camera_with_trivial_rig(theirs)
    whole.write_text(tmp_path)
    whole.write_binary(tmp_path)
    points = AHEAD[np.hypot(*AHEAD[:, :2].T) > 0.011 * AHEAD[:, 2]]  # COLMAP has a series for FOV near the axis
    for name in ("cameras.txt", "cameras.bin"):
        rig = read(tmp_path, {name: (tmp_path / name).read_bytes()})
        assert rig.sensors[0].name == "camera7" and rig.sensors[0].intrinsics.width == 640
        np.testing.assert_allclose(shows(rig, points), theirs.img_from_cam(points), rtol=0, atol=1e-9)


def test_all_of_colmap_s_models_are_tried_here():
    pycolmap = pytest.importorskip("pycolmap")
    assert set(pycolmap.CameraModelId.__members__) - {"INVALID"} == set(COLMAP)


def test_colmap_s_rigs(tmp_path):
    cameras = "".join(f"{i} EUCM 640 480 {' '.join(map(str, COLMAP['EUCM']))}\n" for i in (3, 5))
    rigs = f"# RIG_ID ...\n1 2 CAMERA 3 CAMERA 5 1 {' '.join(map(str, (*TURN, *SHIFT)))}\n"
    rig = read(tmp_path, {"cameras.txt": cameras, "rigs.txt": rigs})
    assert [sensor.name for sensor in rig.sensors] == ["camera3", "camera5"]
    in_rig = (AHEAD - SHIFT) @ turned(TURN)  # a point is R X + t in the sensor's axes
    np.testing.assert_allclose(shows(rig, in_rig, 1), pixels(*eucm(AHEAD, 0.6, 1.1), 0), rtol=0, atol=1e-8)
    for texts, told in (
        ({"cameras.txt": cameras}, "cameras.txt: expected one camera, or a rigs.txt beside it in `path`; found 2 cameras"),
        ({"cameras.txt": cameras, "rigs.txt": "1 2 CAMERA 3 CAMERA 5 0\n"}, "expected a rig whose sensors all have poses"),
        ({"cameras.txt": cameras, "rigs.txt": rigs.replace("CAMERA 5", "CAMERA 6")}, "expected camera 6, which the rig has"),
        ({"cameras.txt": cameras, "rigs.txt": rigs.replace("CAMERA 5", "IMU 5")}, "expected cameras as sensors; found 'IMU 5'"),
        ({"cameras.bin": b"\1\0\0\0\0\0\0\0\1"}, "expected COLMAP's cameras.bin; found a file that is cut off"),
        (
            {"cameras.txt": "1 FOV 640 480 300 300 320 240 9\n"},
            "camera 1: expected a number less than or equal to 3.1",
        ),
    ):
        with pytest.raises(RecipeError, match=told) as error:
            read(tmp_path, texts)
        assert "\n" not in str(error.value)


OCAM = """#polynomial coefficients for the DIRECT mapping function (ocam_model.ss in MATLAB). These are used by cam2world

5 -1.500000e+02 0.000000e+00 2.000000e-03 -1.500000e-06 1.200000e-08

#polynomial coefficients for the inverse mapping function

3 200.0 100.0 1.0

#center: "row" and "column", starting from 0 (C convention)

238.5 321.25

#affine parameters "c", "d", "e"

0.999 0.0002 -0.0003

#image size: "height" and "width"

480 640
"""


def test_ocamcalib(tmp_path):
    """A pixel's ray is cam2world's of OCamCalib: m = A^-1 (pixel - centre), then (m, polynomial), in its axes."""
    rig = read(tmp_path, {"calib_results.txt": OCAM})
    own = rig.sensors[0].intrinsics
    assert (own.width, own.height, rig.sensors[0].name) == (640, 480, "calib_results")
    xy = np.random.default_rng(1).uniform((0, 0), (640, 480), (300, 2))
    row, column = xy[:, 1] - 0.5 - 238.5, xy[:, 0] - 0.5 - 321.25
    x, y = np.linalg.solve([[0.999, 0.0002], [-0.0003, 1.0]], np.stack([row, column]))
    rho = np.hypot(x, y)
    z = -150 + 2e-3 * rho**2 - 1.5e-6 * rho**3 + 1.2e-8 * rho**4
    expected = np.stack([y, x, -z], axis=1)
    expected /= np.linalg.norm(expected, axis=1)[:, None]
    directions = own.lens.rays(xy).directions
    np.testing.assert_allclose(directions, expected, rtol=0, atol=1e-12)
    np.testing.assert_allclose(own.lens.project(expected)[0], xy, rtol=0, atol=1e-9)
    for old, new, told in (
        ("5 -1.5", "5 1.5", "expected a polynomial of a0 below 0"),
        ("5 -1.5", "6 -1.5", "expected a polynomial of a0 below 0"),
        ("0.999 ", "-1.0 ", "expected an affine matrix near"),
        ("-1.500000e+02", "nan", "expected a finite number; found 'nan'"),
    ):
        with pytest.raises(RecipeError, match=told):
            read(tmp_path, {"calib_results.txt": OCAM.replace(old, new, 1)})


@pytest.mark.parametrize("ending", ["yaml", "xml"])
@pytest.mark.parametrize("count", [5, 8, 12, 14])
def test_opencv_s_files_of_one_camera(ending, count, tmp_path):
    cv2 = pytest.importorskip("cv2")
    bent = np.array((0.1, 0.02, 0.001, -0.002, 0.01, 0.1, 0.03, 0.0, 0.002, 0.001, -0.003, 0.001, 0.02, -0.03)[:count])
    matrix = np.array([[K[0], 0, K[2]], [0, K[1], K[3]], [0, 0, 1]])
    storage = cv2.FileStorage(str(tmp_path / f"camera.{ending}"), cv2.FILE_STORAGE_WRITE)
    for name, value in (("image_width", 640), ("image_height", 480), ("camera_matrix", matrix)):
        storage.write(name, value)
    storage.write("distortion_coefficients", bent[None])
    storage.release()
    rig = read(tmp_path, {f"camera.{ending}": (tmp_path / f"camera.{ending}").read_text()})
    theirs = cv2.projectPoints(AHEAD[:, None], np.zeros(3), np.zeros(3), matrix, bent)[0][:, 0] + 0.5
    np.testing.assert_allclose(shows(rig, AHEAD), theirs, rtol=0, atol=1e-9)
    assert (rig.sensors[0].name, rig.sensors[0].intrinsics.height) == ("camera", 480)


def test_broken_xml_is_one_line(tmp_path):
    for text, told in (
        ("<opencv_storage><K1>", "not well-formed"),
        ("<other/>", "expected OpenCV's opencv_storage; found 'other'"),
        ('<!DOCTYPE a [<!ENTITY b "c">]><opencv_storage>&b;</opencv_storage>', "entities"),
    ):
        with pytest.raises(RecipeError, match=told) as error:
            read(tmp_path, {"camera.xml": text})
        assert "\n" not in str(error.value)


@pytest.mark.slow
def test_a_data_set_of_such_a_rig_passes_check(tmp_path):
    (tmp_path / "cameras.txt").write_text("1 FOV 64 48 30 30 32 24 0.8\n")
    recipe = small_recipe(rig={"file": str(tmp_path / "cameras.txt")}, channels=["rgb", "depth", "instances"], formats=[])
    generate(recipe, tmp_path / "out", workers=0)
    dataset = Dataset(tmp_path / "out")
    assert dataset[0].camera.lens.name == "fov" and not check(dataset).findings
