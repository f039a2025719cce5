"""Poses from files: every format gives the camera that its own convention means, and says where a file is wrong."""

import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shots import camera_of
from viewsphere.composing.viewpoints.pose_files import read_poses
from viewsphere.errors import RecipeError
from viewsphere.geometry.camera import orbit_angles, orbit_center, orbit_rotation
from viewsphere.geometry.lenses import lens_parameters
from viewsphere.geometry.rotation import quaternion_from_matrix
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.planning.plan import plan
from viewsphere.recipe.recipe import Recipe

LENS = Intrinsics(width=64, height=48, fx=60, fy=60, cx=32, cy=24)
OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])


def make(path, **more):
    """The plan of a recipe with the poses of this file."""
    camera = more.pop("camera", {"fov_deg": 40})
    viewpoints = {"kind": "file", "path": str(path), **more}
    return plan(Recipe(models=[{"source": "zoo:car"}], viewpoints=viewpoints, camera=camera))


def cameras(path, **more):
    return [camera_of(LENS, pose, (0, 0, 0)) for pose in make(path, **more).pose_list]


def motions(count=7, seed=3):
    """World-from-camera matrices (4, 4) in OpenCV's axes, world Z up, some of them looking straight up or down."""
    rng = np.random.default_rng(seed)
    found = []
    for i in range(count):
        elevation = (math.pi / 2, -math.pi / 2)[i] if i < 2 else rng.uniform(-1.5, 1.5)
        matrix = np.eye(4)
        matrix[:3, :3] = orbit_rotation(rng.uniform(-4, 4), elevation, rng.uniform(-3, 3)).T
        matrix[:3, 3] = rng.uniform(-5, 5, 3)
        found.append(matrix)
    return found


def agree(found, expected, tolerance=1e-12):
    """Cameras against world-from-camera matrices."""
    assert len(found) == len(expected)
    for camera, matrix in zip(found, expected, strict=True):
        np.testing.assert_allclose(camera.R, matrix[:3, :3].T, atol=tolerance)
        np.testing.assert_allclose(camera.center, matrix[:3, 3], atol=10 * tolerance)


@given(st.floats(-10, 10), st.floats(-math.pi / 2, math.pi / 2), st.floats(-10, 10))
def test_angles_of_a_rotation_are_those_it_was_made_of(azimuth, elevation, tilt):
    rotation = orbit_rotation(azimuth, elevation, tilt)
    np.testing.assert_allclose(orbit_rotation(*orbit_angles(rotation)), rotation, atol=1e-9 if abs(elevation) > 1.57 else 1e-13)


def test_csv_takes_its_columns_in_any_order_and_leaves_others_alone(tmp_path):
    file = tmp_path / "poses.csv"
    file.write_text("name, Elevation,distance, azimuth,theta\nfirst,10,5,20,3\nsecond,-5,4.5,400,0\n")
    assert [tuple(e) for e in read_poses(file).entries] == [(20, 10, 5, 3), (400, -5, 4.5, 0)]
    file.write_text("azimuth;elevation;distance\n1;2;3\n")
    assert [tuple(e) for e in read_poses(file).entries] == [(1, 2, 3, 0)]


def test_orbits_look_at_the_target_from_where_they_say(tmp_path):
    file = tmp_path / "poses.csv"
    file.write_text("azimuth,elevation,distance,tilt\n30,20,4,10\n200,-30,2,0\n")
    for camera, (a, e, d, t) in zip(cameras(file, target=[1, 2, 3]), ((30, 20, 4, 10), (200, -30, 2, 0)), strict=True):
        np.testing.assert_allclose(
            camera.center, np.add((1, 2, 3), orbit_center(math.radians(a), math.radians(e), d)), atol=1e-12
        )
        np.testing.assert_allclose(camera.R, orbit_rotation(*np.radians([a, e, t])), atol=1e-12)


def test_a_view_file_of_render_for_cnn_has_the_tilt_before_the_distance(tmp_path):
    file = tmp_path / "view.txt"
    file.write_text("30 20 10 4\n\n# a comment\n200 -30 0 2\n")
    assert [tuple(e) for e in read_poses(file).entries] == [(30, 20, 4, 10), (200, -30, 2, 0)]


def test_tilt_is_pascal3ds_theta(tmp_path):
    """PASCAL3D+'s own projection (`project_3d.m`): rotate about the principal point by theta, then flip y."""
    azimuth, elevation, theta, distance = np.radians(33.0), np.radians(12.0), np.radians(25.0), 3.0
    center = np.array([np.cos(elevation) * np.sin(azimuth), -np.cos(elevation) * np.cos(azimuth), np.sin(elevation)]) * distance
    a, e = -azimuth, -(np.pi / 2 - elevation)
    rz = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    rx = np.array([[1, 0, 0], [0, np.cos(e), -np.sin(e)], [0, np.sin(e), np.cos(e)]])
    points = np.array([[0.3, 0.1, 0.2], [-0.4, 0.2, -0.1], [0, 0, 0.5]])
    x, y, z = rx @ rz @ (points - center).T
    flat = np.stack([LENS.fx * x / -z, LENS.fx * y / -z])
    turned = np.array([[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]]) @ flat
    expected = np.stack([turned[0] + LENS.cx, -turned[1] + LENS.cy], axis=-1)
    file = tmp_path / "poses.csv"
    file.write_text("azimuth,elevation,distance,theta\n33,12,3,25\n")
    (camera,) = cameras(file)
    homogeneous = np.column_stack([points, np.ones(3)]) @ camera.P.T
    np.testing.assert_allclose(homogeneous[:, :2] / homogeneous[:, 2:], expected, atol=1e-9)


def test_tum_is_camera_to_world_with_the_quaternions_scalar_last(tmp_path):
    file = tmp_path / "groundtruth.txt"
    lines = ["# timestamp tx ty tz qx qy qz qw"]
    for i, m in enumerate(motions()):
        w, x, y, z = quaternion_from_matrix(m[:3, :3])
        lines.append(" ".join(map(repr, [i * 0.1, *m[:3, 3].tolist(), float(x), float(y), float(z), float(w)])))
    file.write_text("\n".join(lines) + "\n")
    agree(cameras(file), motions())


def test_kitti_has_y_down(tmp_path):
    """KITTI's world is x right, y down, z ahead; ours x right, y ahead, z up."""
    ours_from_kitti = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
    file = tmp_path / "00.txt"
    np.savetxt(file, [(np.linalg.inv(ours_from_kitti) @ m)[:3].ravel() for m in motions()], fmt="%.17g")
    agree(cameras(file), motions())
    np.savetxt(file, [np.eye(4)[:3].ravel()], fmt="%.17g")
    (first,) = cameras(file)
    np.testing.assert_allclose(first.R[2], (0, 1, 0), atol=1e-15)  # the first camera looks ahead, at a model's front


def test_nerfstudio_is_opengl_camera_to_world_and_brings_its_lens(tmp_path):
    file = tmp_path / "transforms.json"
    lens = {
        "w": 640,
        "h": 480,
        "fl_x": 500.0,
        "fl_y": 510.0,
        "cx": 321.0,
        "cy": 239.0,
        "camera_model": "OPENCV",
        "k1": 0.1,
        "p2": 0.01,
    }
    frames = [{"file_path": f"{i}.png", "transform_matrix": (m @ OPENGL).tolist()} for i, m in enumerate(motions())]
    file.write_text(json.dumps({**lens, "frames": frames}))
    agree(cameras(file), motions())
    bent = lens_parameters("brown_conrady", coefficients=(0.1, 0, 0, 0.01, 0))
    expected = Intrinsics(width=640, height=480, fx=500, fy=510, cx=321, cy=239, distortion=bent)
    planned = make(file, camera={"of_viewpoints": True})
    assert planned.intrinsics == expected
    file.write_text(json.dumps({"camera_angle_x": 0.8, "w": 800, "h": 800, "frames": frames}))
    assert make(file, camera={"of_viewpoints": True}).intrinsics.fx == pytest.approx(400 / math.tan(0.4))
    file.write_text(json.dumps({"w": 640, "h": 480, "fl_x": 500, "k1": 0.1, "k4": 0.2, "is_fisheye": True, "frames": frames}))
    fisheye = make(file, camera={"of_viewpoints": True}).intrinsics.distortion
    assert fisheye == lens_parameters("fisheye", coefficients=(0.1, 0, 0, 0.2))
    file.write_text(json.dumps({"w": 640, "h": 480, "fl_x": 500, "k4": 0.2, "frames": frames}))
    with pytest.raises(RecipeError, match=r"frames\[0\]: k4: expected 0, .*; found 0.2"):
        make(file)


def colmap(folder, matrices, camera="1 OPENCV 640 480 500 510 321 239 0.1 0.02 0.003 0.004"):
    """A COLMAP model; its images stand in the file in reverse, as COLMAP may write them in any order."""
    folder.mkdir(exist_ok=True)
    (folder / "cameras.txt").write_text(f"# Camera list\n{camera}\n")
    lines = ["# Image list with two lines of data per image:"]
    for i, m in reversed(list(enumerate(matrices))):
        inverse = np.linalg.inv(m)
        numbers = [*(float(q) for q in quaternion_from_matrix(inverse[:3, :3])), *inverse[:3, 3].tolist()]
        lines += [" ".join([str(i + 1), *map(repr, numbers), "1", f"image {i:03d}.png"]), "1.0 2.0 -1" if i % 2 else ""]
    (folder / "images.txt").write_text("\n".join(lines) + "\n")
    return folder


def test_colmap_is_world_to_camera_and_brings_its_lens(tmp_path):
    folder = colmap(tmp_path / "sparse", motions())
    agree(cameras(folder, up="+z"), motions(), 1e-11)
    agree(cameras(folder / "images.txt", up="+z"), motions(), 1e-11)
    bent = lens_parameters("brown_conrady", coefficients=(0.1, 0.02, 0.003, 0.004, 0))
    expected = Intrinsics(width=640, height=480, fx=500, fy=510, cx=321, cy=239, distortion=bent)
    assert make(folder, camera={"of_viewpoints": True}).intrinsics == expected


@pytest.mark.parametrize(
    ("line", "fx", "lens"),
    [
        ("1 SIMPLE_PINHOLE 640 480 500 320 240", 500, None),
        ("1 PINHOLE 640 480 500 510 320 240", 500, None),
        ("1 SIMPLE_RADIAL 640 480 500 320 240 0.1", 500, ("brown_conrady", (0.1, 0, 0, 0, 0))),
        ("1 RADIAL 640 480 500 320 240 0.1 0.2", 500, ("brown_conrady", (0.1, 0.2, 0, 0, 0))),
        ("1 FULL_OPENCV 640 480 500 510 320 240 1 2 3 4 5 6 7 8", 500, ("brown_conrady", (1, 2, 3, 4, 5, 6, 7, 8))),
        ("1 OPENCV_FISHEYE 640 480 500 510 320 240 1 2 3 4", 500, ("fisheye", (1, 2, 3, 4))),
    ],
)
def test_colmaps_camera_models(tmp_path, line, fx, lens):
    found = make(colmap(tmp_path / "m", motions(1), line), camera={"of_viewpoints": True}).intrinsics
    assert (found.width, found.height, found.fx, found.cx, found.cy) == (640, 480, fx, 320, 240)
    assert (found.distortion and (found.distortion.model, found.distortion.coefficients)) == lens


def test_scale_origin_and_axes_move_the_models_into_the_files_world(tmp_path):
    file = tmp_path / "poses.txt"
    np.savetxt(file, [m[:3].ravel() for m in motions()], fmt="%.17g")
    expected = []
    for m in motions():
        n = m.copy()
        n[:3, 3] = 0.5 * (m[:3, 3] - [1, 2, 3])
        expected.append(n)
    agree(cameras(file, format="kitti", up="+z", scale=0.5, origin=[1, 2, 3]), expected)


def test_every_takes_every_nth(tmp_path):
    file = tmp_path / "poses.csv"
    file.write_text("azimuth,elevation,distance\n" + "".join(f"{i},0,5\n" for i in range(10)))
    assert [p.azimuth_deg for p in make(file, every=4).pose_list] == [0, 4, 8]


def test_a_camera_that_rests_has_poses_of_different_names(tmp_path):
    file = tmp_path / "poses.csv"
    file.write_text("azimuth,elevation,distance\n1,0,5\n1,0,5\n2,0,5\n")
    poses = make(file).pose_list
    assert len({poses.name(i) for i in range(3)}) == 3


def test_the_digest_follows_from_the_poses_not_from_where_they_lie(tmp_path):
    (tmp_path / "a").mkdir()
    file, other = tmp_path / "poses.csv", tmp_path / "a" / "poses.csv"
    file.write_text("azimuth,elevation,distance\n1,0,5\n")
    other.write_text("azimuth,elevation,distance\n1.0,0,5,\n")
    assert make(file).pose_list.digest == make(other).pose_list.digest
    other.write_text("azimuth,elevation,distance\n1,0,6\n")
    assert make(file).pose_list.digest != make(other).pose_list.digest


BAD = [
    ("p.csv", "azimuth,elevation\n1,2\n", r"p.csv:1: expected columns azimuth, elevation, distance; found azimuth, elevation"),
    ("p.csv", "azimuth,elevation,distance\n1,2,3\n1,nan,3\n", r"p.csv:3: elevation: expected a finite number; found 'nan'"),
    ("p.csv", "azimuth,elevation,distance\n1,2\n", r"p.csv:2: distance: expected a finite number; found nothing"),
    ("p.csv", "azimuth,elevation,distance\n1,95,3\n", r"p.csv:2: elevation: expected -90 to 90 degrees; found 95"),
    ("p.csv", "azimuth,elevation,distance\n1,5,0\n", r"p.csv:2: distance: expected metres above 0; found 0"),
    ("p.csv", "azimuth,elevation,distance\n", r"p.csv: expected at least one pose; found none"),
    ("p.csv", "", r"p.csv:1: expected columns .*; found nothing"),
    ("p.txt", "1 2 3\n", r"p.txt:1: expected 4 numbers in a line .*; found 3"),
    ("p.txt", "0 1 2 3 0 0 0 0\n", r"p.txt:1: expected a quaternion; found one of length 0"),
    ("p.txt", "0 1 2 3 0 0 0 1\n0 1 2\n", r"p.txt:2: expected 8 numbers; found 3"),
    ("p.txt", "1 0 0 0 0 1 0 0 0 0 -1 0\n", r"p.txt:1: expected a rotation; found a matrix that is none"),
    ("p.txt", "2 0 0 0 0 1 0 0 0 0 1 0\n", r"p.txt:1: expected a rotation"),
    ("p.json", "{", r"p.json: expected JSON; found"),
    ("p.json", "[]", r"p.json: expected a mapping with a list of frames"),
    (
        "p.json",
        '{"frames": [{"transform_matrix": [[1, 2], 3]}]}',
        r"p.json: frames\[0\].transform_matrix: expected a 4x4 matrix",
    ),
    ("p.json", '{"frames": [3]}', r"p.json: frames\[0\]: expected a mapping; found 3"),
    ("images.txt", "1 1 0 0 0 0 0\n", r"cameras.txt: expected a readable file of poses; found: No such file"),
]


@pytest.mark.parametrize(("name", "text", "message"), BAD)
def test_a_file_that_is_wrong_is_named_with_its_line(tmp_path, name, text, message):
    (tmp_path / name).write_text(text)
    with pytest.raises(RecipeError, match=message):
        make(tmp_path / name)


def test_what_colmap_may_have_wrong(tmp_path):
    folder = colmap(tmp_path / "a", motions(2), "1 PERSPECTIVE 640 480 640 480")
    with pytest.raises(RecipeError, match=r"cameras.txt:2: expected one of SIMPLE_PINHOLE, .*; found PERSPECTIVE"):
        make(folder)
    colmap(folder, motions(2), "7 PINHOLE 640 480 1 2 3 4")
    with pytest.raises(RecipeError, match=r"image image 000.png: expected a camera of cameras.txt; found 1"):
        make(folder)
    colmap(folder, motions(2), "1 PINHOLE 640 480 1 2 3")
    with pytest.raises(RecipeError, match=r"cameras.txt:2: expected 4 numbers; found 3"):
        make(folder)


def test_two_lenses_in_one_file_are_refused(tmp_path):
    file = tmp_path / "transforms.json"
    frames = [{"transform_matrix": np.eye(4).tolist(), "w": 64, "h": 48, "fl_x": f} for f in (50, 60)]
    file.write_text(json.dumps({"frames": frames}))
    with pytest.raises(RecipeError, match=r"expected one camera for all frames, .*; found 2"):
        make(file)


def test_a_lens_of_the_viewpoints_has_to_be_there(tmp_path):
    file = tmp_path / "poses.csv"
    file.write_text("azimuth,elevation,distance\n1,0,5\n")
    with pytest.raises(RecipeError, match=r"camera.of_viewpoints: expected a file of poses that names a lens"):
        make(file, camera={"of_viewpoints": True})
    with pytest.raises(RecipeError, match="expected no size and no distortion beside of_viewpoints"):
        make(file, camera={"of_viewpoints": True, "size": [3, 4]})


def test_a_lens_out_of_bounds_and_a_large_file_are_one_line(tmp_path, monkeypatch):
    (tmp_path / "images.txt").write_text("1 1 0 0 0 0 0 3 1 a.png\n\n")
    for camera in ("1 PINHOLE 640 0.5 420 425 315 239", "1 OPENCV 640 480 420 425 315 239 1e308 0 0 0"):
        (tmp_path / "cameras.txt").write_text(camera + "\n")
        with pytest.raises(RecipeError, match=r"cameras\.txt:1: expected (a number|whole numbers)"):
            read_poses(tmp_path)
    monkeypatch.setenv("VIEWSPHERE_MAX_POSES_BYTES", "9")
    with pytest.raises(RecipeError, match=r"found: 45 bytes long, and at most 9 bytes are allowed \(limit MAX_POSES_BYTES\)"):
        read_poses(tmp_path)


PRIVATE = "root:$6$s3cr3t:19000\nmachine example.org password s3cr3t\n"


@pytest.mark.parametrize("name", ["p.csv", "p.txt", "p.json", "images.txt", "cameras.txt"])
def test_a_file_that_lists_no_poses_is_not_quoted(tmp_path, name):
    (tmp_path / "cameras.txt").write_text("1 PINHOLE 640 480 420 425 315 239\n")
    (tmp_path / "images.txt").write_text("1 1 0 0 0 0 0 3 1 a.png\n\n")
    (tmp_path / name).write_text(PRIVATE)
    with pytest.raises(RecipeError) as caught:
        make(tmp_path / (name if name.startswith("p.") else "images.txt"))
    assert "s3cr3t" not in str(caught.value)
