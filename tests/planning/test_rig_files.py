"""Calibrations in the three formats, written as their tools write them, against what they mean."""

import math
from pathlib import Path

import numpy as np
import pytest

from viewsphere.errors import RecipeError
from viewsphere.geometry.camera import project
from viewsphere.model.sensors.rig import Rig
from viewsphere.planning.rig_files import read_rig as read_rig_file
from viewsphere.planning.rigs import rig_of
from viewsphere.recipe.recipe import Recipe

K1, K2 = np.array([[420.0, 0, 315.5], [0, 425, 239.5], [0, 0, 1]]), np.array([[430.0, 0, 320.0], [0, 431, 242.0], [0, 0, 1]])
D1, D2 = (-0.28, 0.07, 0.0002, 1.8e-05, 0.01), (-0.25, 0.06, 0.0, 0.0, 0.0)
BASELINE = 0.12


def turn(angle, axis):
    """Rotation by an angle about an axis, Rodrigues' formula."""
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross


R = turn(0.05, (0.2, 1, -0.3))
T = np.array([-0.12, 0.003, -0.01])


def opencv_matrix(name, values):
    values = np.atleast_2d(values)
    data = ", ".join(f"{v:.17g}" if v != int(v) else f"{v:.0f}." for v in values.ravel())
    return f"{name}: !!opencv-matrix\n   rows: {values.shape[0]}\n   cols: {values.shape[1]}\n   dt: d\n   data: [ {data} ]\n"


def opencv(**matrices):
    size = "image_width: 640\nimage_height: 480\n"
    return "%YAML:1.0\n---\n" + size + "".join(opencv_matrix(name, value) for name, value in matrices.items())


def camera_info(name, k, d, r, p, model="plumb_bob"):
    """As camera_calibration's `ost.yaml`."""
    text = f"image_width: 640\nimage_height: 480\ncamera_name: {name}\ndistortion_model: {model}\n"
    for field, values in (
        ("camera_matrix", k), ("distortion_coefficients", [d]), ("rectification_matrix", r), ("projection_matrix", p),
    ):  # fmt: skip
        rows, columns = np.shape(values)
        text += f"{field}:\n  rows: {rows}\n  cols: {columns}\n  data: {np.ravel(values).tolist()}\n"
    return text


def kalibr(model="radtan", **more):
    step = np.eye(4)
    step[:3, :3], step[:3, 3] = R, T
    first = {"camera_model": "pinhole", "intrinsics": [420, 425, 315.5, 239.5], "distortion_model": model,
             "distortion_coeffs": list(D1[:4]), "resolution": [640, 480], "rostopic": "/cam0/image_raw"}  # fmt: skip
    second = first | {"intrinsics": [430, 431, 320, 242], "distortion_coeffs": list(D2[:4]), "T_cn_cnm1": step.tolist()} | more
    cameras = {"cam0": first, "cam1": second, "cam2": second}
    return "".join(f"{name}:\n" + "".join(f"  {k}: {v}\n" for k, v in camera.items()) for name, camera in cameras.items())


def read(folder, text, **more) -> Rig:
    texts = text if isinstance(text, dict) else {"rig.yaml": text}
    for name, one in texts.items():
        (folder / name).write_text(one)
    recipe = Recipe.model_validate(
        {
            "models": [{"source": "zoo:car"}],
            "viewpoints": {"distance": 4},
            "rig": {"kind": "file", "path": list(texts), **more},
        },
        context={"folder": folder},
    )
    return rig_of(recipe, recipe.camera.intrinsics)


def pixels_of(k, d, points):
    """OpenCV's own formula, in its pixels, which are counted from the centre of the first one."""
    x, y = points[:, 0] / points[:, 2], points[:, 1] / points[:, 2]
    k1, k2, p1, p2, k3 = (*d, 0.0)[:5]
    r2 = x * x + y * y
    radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    bent_x = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    bent_y = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    return np.stack([k[0, 0] * bent_x + k[0, 2], k[1, 1] * bent_y + k[1, 2]], axis=1)


POINTS = np.random.default_rng(5).uniform((-1, -0.8, 3), (1, 0.8, 6), (50, 3))


def shows(rig: Rig, sensor: int, points):
    """Pixels, counted from the corner, at which a sensor shows points in the first sensor's axes."""
    pose = np.array(rig.sensors[sensor].rig_from_sensor)
    return project(rig.sensors[sensor].intrinsics, (points - pose[:3, 3]) @ pose[:3, :3])[0]


def test_opencv_s_stereo_calibration_shows_what_opencv_projects(tmp_path):
    rig = read(tmp_path, opencv(K1=K1, D1=D1, K2=K2, D2=D2, R=R, T=T[:, None]))
    assert [sensor.name for sensor in rig.sensors] == ["left", "right"]
    np.testing.assert_allclose(shows(rig, 0, POINTS), pixels_of(K1, D1, POINTS) + 0.5, atol=1e-9)
    np.testing.assert_allclose(shows(rig, 1, POINTS), pixels_of(K2, D2, POINTS @ R.T + T) + 0.5, atol=1e-9)
    assert (rig.sensors[0].intrinsics.width, rig.sensors[0].intrinsics.height) == (640, 480)
    two = {"intrinsics.yml": opencv(M1=K1, D1=D1, M2=K2, D2=D2), "extrinsics.yml": "%YAML:1.0\n---\n" + opencv_matrix("R", R) + opencv_matrix("T", T[:, None])}  # fmt: skip # noqa: E501
    assert read(tmp_path, two, format="opencv") == rig


def test_cv2_agrees(tmp_path):
    cv2 = pytest.importorskip("cv2")
    storage = cv2.FileStorage(str(tmp_path / "rig.yaml"), cv2.FILE_STORAGE_WRITE)
    for name, value in (("K1", K1), ("D1", np.array(D1)), ("K2", K2), ("D2", np.array(D2)), ("R", R), ("T", T)):
        storage.write(name, value)
    storage.release()
    rig = read(tmp_path, (tmp_path / "rig.yaml").read_text())
    theirs = cv2.projectPoints(POINTS, cv2.Rodrigues(R)[0], T, K2, np.array(D2))[0][:, 0]
    np.testing.assert_allclose(shows(rig, 1, POINTS), theirs + 0.5, atol=1e-9)


@pytest.mark.parametrize("sizes", ["[ 5 ]", "[ 5, 1 ]", "[ 1, 5 ]"])
def test_opencv_5_writes_vectors_in_another_way(sizes, tmp_path):
    vector = f"D1: !!opencv-nd-matrix\n   sizes: {sizes}\n   dt: d\n   data: [ {', '.join(map(repr, D1))} ]\n"
    text = opencv(K1=K1, D1=D1, K2=K2, D2=D2, R=R, T=T[:, None])
    begin, end = text.index("D1:"), text.index("K2:")
    assert read(tmp_path, text[:begin] + vector + text[end:]) == read(tmp_path, text)
    with pytest.raises(RecipeError, match=r"rig.yaml:\d+: .*sizes of a vector or a matrix were expected; found \[5, 1, 1\]"):
        read(tmp_path, text[:begin] + vector.replace(sizes, "[5, 1, 1]") + text[end:])


def test_rectified_opencv_has_a_baseline(tmp_path):
    p1 = np.array([[400.0, 0, 320, 0], [0, 400, 240, 0], [0, 0, 1, 0]])
    p2 = p1 + np.array([[0, 0, 0, -400 * BASELINE], [0] * 4, [0] * 4])
    rig = read(tmp_path, opencv(P1=p1, P2=p2, R=R, T=T[:, None], K1=K1, K2=K2), rectified=True)
    (pair,) = rig.rectified
    assert pair[:2] == (0, 1) and math.isclose(pair.baseline, BASELINE, rel_tol=1e-12)
    assert rig.sensors[1].intrinsics.cx == 320.5 and rig.sensors[1].intrinsics.distortion is None


def test_kalibr_s_chain_adds_up(tmp_path):
    rig = read(tmp_path, kalibr())
    assert [sensor.name for sensor in rig.sensors] == ["cam0", "cam1", "cam2"]
    np.testing.assert_allclose(shows(rig, 0, POINTS), pixels_of(K1, D1[:4], POINTS) + 0.5, atol=1e-9)
    second = POINTS @ R.T + T
    np.testing.assert_allclose(shows(rig, 1, POINTS), pixels_of(K2, D2[:4], second) + 0.5, atol=1e-9)
    np.testing.assert_allclose(shows(rig, 2, POINTS), pixels_of(K2, D2[:4], second @ R.T + T) + 0.5, atol=1e-9)
    assert rig.sensors[1].intrinsics.distortion.model == "brown_conrady" and not rig.rectified
    bent = read(tmp_path, kalibr("equidistant")).sensors[0].intrinsics.distortion
    assert bent.model == "fisheye" and bent.coefficients == D1[:4]


def test_ros_camera_info_has_its_baseline_in_p(tmp_path):
    """The right camera sees a rectified point X at K2 R2^T (X - b), distorted, as R and the fourth column of P say."""
    r1, r2 = turn(0.02, (1, 0.3, 0)), turn(-0.03, (0.1, 1, 0.2))
    p1 = np.array([[400.0, 0, 320, 0], [0, 400, 240, 0], [0, 0, 1, 0]])
    p2 = p1.copy()
    p2[0, 3] = -400 * BASELINE
    texts = {"left.yaml": camera_info("left", K1, D1, r1, p1), "right.yaml": camera_info("right", K2, D2, r2, p2)}
    rig = read(tmp_path, texts)
    raw_left = POINTS @ r1  # rows: R1^T times the rectified point
    raw_right = (POINTS - [BASELINE, 0, 0]) @ r2
    np.testing.assert_allclose(shows(rig, 0, raw_left), pixels_of(K1, D1, raw_left) + 0.5, atol=1e-9)
    np.testing.assert_allclose(shows(rig, 1, raw_left), pixels_of(K2, D2, raw_right) + 0.5, atol=1e-8)
    ideal = read(tmp_path, texts, rectified=True)
    assert math.isclose(ideal.rectified[0].baseline, BASELINE, rel_tol=1e-12)
    in_right = np.column_stack([POINTS, np.ones(len(POINTS))]) @ p2.T
    np.testing.assert_allclose(shows(ideal, 1, POINTS), in_right[:, :2] / in_right[:, 2:] + 0.5, atol=1e-9)
    with pytest.raises(RecipeError, match="different names; found left, left"):
        read(tmp_path, {"left.yaml": texts["left.yaml"], "right.yaml": texts["left.yaml"]})


def test_all_formats_say_the_same_of_one_rig(tmp_path):
    """The same two pinholes in the three formats give equal sensors."""
    shift = [-BASELINE, 0, 0]
    plain = np.eye(4)
    plain[:3, 3] = shift
    no_bend = {"distortion_model": "none", "T_cn_cnm1": plain.tolist(), "intrinsics": [420, 425, 315.5, 239.5]}
    chain = kalibr("none", **no_bend).partition("cam2:")[0]
    p1 = np.column_stack([K1, [0, 0, 0]])
    p2 = np.column_stack([K1, [-420 * BASELINE, 0, 0]])
    texts = {f"{n}.yaml": camera_info(n, K1, [0.0] * 5, np.eye(3), p) for n, p in (("left", p1), ("right", p2))}
    stereo = opencv(K1=K1, D1=[0.0] * 5, K2=K1, D2=[0.0] * 5, R=np.eye(3), T=np.array(shift)[:, None])
    rigs = [read(tmp_path, chain), read(tmp_path, texts), read(tmp_path, stereo)]
    for rig in rigs:
        assert rig.sensors[0].intrinsics == rigs[0].sensors[0].intrinsics == rig.sensors[1].intrinsics
        assert math.isclose(rig.rectified[0].baseline, BASELINE, rel_tol=1e-12)


BROKEN = [
    ("a: 1", "found none of them"),
    ("- 1", "expected a mapping; found list"),
    ("cam0: [", "expected YAML"),
    ("cam0: {intrinsics: [1, 2, 3]}", "expected fx, fy, cx, cy; found 3"),
    ("cam0: {intrinsics: [0, 2, 3, 4]}", "focal lengths above 0"),
    (kalibr("fov"), "distortion_coeffs: expected one number; found 4"),
    (kalibr("equi"), "expected radtan, equidistant, fov or none; found 'equi'"),
    (kalibr(camera_model="mono"), "camera_model: expected one of pinhole, omni, ds, eucm; found 'mono'"),
    (kalibr(camera_model="ds", intrinsics=[1, 2, 3]), "expected xi, alpha, fx, fy, cx, cy; found 3 numbers"),
    (kalibr(camera_model="ds", intrinsics=[0, 0.5, 2, 3, 4, 5]), "distortion_model: expected none beside ds; found 'radtan'"),
    (kalibr(camera_model="eucm", intrinsics=[9, 1, 2, 3, 4, 5], distortion_model="none"), "intrinsics: expected a number less"),
    ("value0: {intrinsics: []}", "T_imu_cam: expected a list of cameras; found nothing"),
    ("value0: {intrinsics: [], T_imu_cam: [], resolution: []}", "expected 1 to 64 sensors; found 0"),
    ("CameraCalibrations: []", "expected 1 to 64 sensors; found 0"),
    ("value0: {intrinsics: [1], T_imu_cam: [], resolution: []}", "expected equally many intrinsics"),
    ("value0: {intrinsics: [{camera_type: x}], T_imu_cam: [1], resolution: [1]}", "expected a mapping; found nothing"),
    ("CameraCalibrations: 3", "expected a list of cameras; found 3"),
    ("CameraCalibrations: [{Label: a, Projection: {Name: Spherical, Params: []}}]", "Projection.Name: expected one of Fisheye"),
    ("camera_matrix: 3", "camera_matrix: expected a matrix; found 3"),
    (kalibr(T_cn_cnm1=[[1, 0], [0, 1]]), "expected 4 x 4 numbers; found 2 x 2"),
    (kalibr(T_cn_cnm1=np.diag([1, 1, -1, 1]).tolist()), "expected a rotation"),
    (kalibr(intrinsics=["x", 1, 2, 3]), "expected a finite number; found 'x'"),
    (opencv(K1=K1, D1=[0.1, 0.2], K2=K2, R=R, T=T[:, None]), "expected 4, 5, 8, 12 or 14 numbers; found 2"),
    (opencv(K1=K1, K2=K2, R=R, T=np.zeros((3, 1))), "expected 3 numbers, not all 0"),
    (opencv(K1=K1, K2=K2, R=R), "T: expected a matrix; found nothing"),
    (opencv(K1=K1, D1=[0.0] * 12 + [1.5, 0], K2=K2, R=R, T=T[:, None]), "D1: thin_prism: expected tilts within 1.2 radians"),
    (camera_info("a", K1, D1, np.eye(3), np.zeros((3, 4))), "projection_matrix: expected focal lengths above 0"),
    (camera_info("a", K1, D1, np.eye(3), np.eye(4)[:3], model="omni"), "distortion_model: expected one of plumb_bob"),
    ("%YAML:1.0\n---\nR: !!opencv-matrix\n   rows: 2\n   cols: 3\n   data: [1]\nK1: 1\n", "rows x cols numbers"),
    ("a: !!python/object/apply:os.system ['true']", "expected YAML"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "expected"), BROKEN)
def test_what_cannot_be_read_is_one_line_with_the_file(tmp_path, text, expected):
    with pytest.raises(RecipeError, match=expected) as caught:
        read(tmp_path, text)
    assert str(caught.value).startswith(str(tmp_path)) and "\n" not in str(caught.value)


def test_projections_without_a_focal_length_are_refused(tmp_path):
    flat = np.hstack([K1, np.zeros((3, 1))])
    text = opencv(K1=K1, K2=K2, R=R, T=T[:, None], P1=flat, P2=flat * [[0, 1, 1, 1], [1, 1, 1, 1], [1, 1, 1, 1]])
    (tmp_path / "rig.yaml").write_text(text)
    with pytest.raises(RecipeError, match="expected focal lengths above 0"):
        read_rig_file([tmp_path / "rig.yaml"], rectified=True)


def test_a_file_that_is_not_there(tmp_path: Path):
    recipe = Recipe.model_validate(
        {"models": [{"source": "zoo:car"}], "viewpoints": {"distance": 4}, "rig": {"file": "gone.yaml"}},
        context={"folder": tmp_path},
    )
    with pytest.raises(RecipeError, match=r"gone\.yaml: expected a readable file of a calibration"):
        rig_of(recipe, recipe.camera.intrinsics)


def test_a_large_calibration_and_deep_brackets_are_one_line(tmp_path, monkeypatch):
    with pytest.raises(RecipeError, match="nested too deeply"):
        read(tmp_path, "K1: " + "[" * 100_000)
    with pytest.raises(RecipeError, match="D1: expected a number"):
        read(tmp_path, opencv(K1=K1, D1=[1e308, 0, 0, 0], K2=K2, R=R, T=T[:, None]))
    monkeypatch.setenv("VIEWSPHERE_MAX_RIG_BYTES", "9")
    with pytest.raises(RecipeError, match="limit MAX_RIG_BYTES"):
        read(tmp_path, "camera_matrix: 1\n")
