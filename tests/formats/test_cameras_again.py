"""Cameras of COLMAP, as pycolmap writes them, and of nerfstudio are rendered again, around a mesh where there is one."""

from __future__ import annotations

import json
import struct
import time

import numpy as np
import pycolmap
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from command_line import viewsphere
from proven import close
from viewsphere import Dataset, Recipe, generate
from viewsphere.errors import StoreError
from viewsphere.planning.plan import plan
from viewsphere.run.datasets.importing import import_dataset
from viewsphere.run.reproduce import make_again
from viewsphere.run.reproduce_recipe import _free, stand_in

SIZES = ((64, 48), (64, 48))
LENSES = (("PINHOLE", (60, 61, 30.5, 25)), ("OPENCV", (60, 61, 33, 23, 0.1, -0.02, 1e-3, 2e-3)))
UP = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])  # -y becomes +z, and -z -y


def looking(eye, at, down):
    """Rotation from the world to a camera that looks at a point, with its y axis in the plane of `down`."""
    z = (np.array(at) - eye) / np.linalg.norm(np.array(at) - eye)
    x = np.cross(down, z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z])


def cameras(at=(3.0, -1.0, 7.0), down=(0, 1, 0), count=6):
    """Poses (R, t) of cameras around a point, COLMAP's world with y down."""
    for i in range(count):
        a = 1.1 * i
        eye = np.add(at, (4 * np.sin(a), -1.5 - 0.2 * i, -4 * np.cos(a)))
        rotation = looking(eye, at, np.array(down, float))
        yield rotation, -rotation @ eye


def reconstruction(lenses=LENSES, sizes=SIZES):
    """What pycolmap makes of these cameras."""
    found = pycolmap.Reconstruction()
    for number, ((model, values), (width, height)) in enumerate(zip(lenses, sizes, strict=True), 1):
        found.add_camera_with_trivial_rig(
            pycolmap.Camera(model=model, width=width, height=height, params=values, camera_id=number)
        )
    for i, (rotation, t) in enumerate(cameras(), 1):
        image = pycolmap.Image(name=f"left/{9 - i}.jpg", camera_id=1 + i % len(lenses), image_id=i)
        found.add_image_with_trivial_frame(image, pycolmap.Rigid3d(pycolmap.Rotation3d(rotation), t))
    return found


def colmap_tree(folder, kind="binary", **more):
    (folder / "sparse/0").mkdir(parents=True)
    made = reconstruction(**more)
    (made.write_binary if kind == "binary" else made.write_text)(folder / "sparse/0")
    return made


def rendered(made, place):
    generate(str(made.recipe), place, workers=0)
    return Dataset(place)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["text", "binary"])
def test_colmaps_cameras_are_the_same_again(tmp_path, kind):
    """In the order of names; up, as most cameras have it, is -y, and the recipe's origin is what all look at."""
    theirs = colmap_tree(tmp_path / "scene", kind)
    made = make_again("colmap", tmp_path / "scene", tmp_path / "again")
    recipe = Recipe.load(made.recipe)
    assert recipe.viewpoints.up == "-y" and made.models == 0
    np.testing.assert_allclose(recipe.viewpoints.origin, (3, -1, 7), atol=1e-6)
    again = rendered(made, tmp_path / "out")
    images = sorted(theirs.images.values(), key=lambda image: image.name)
    assert len(again) == len(images)
    for sample, image in zip(again, images, strict=True):
        pose, origin = image.cam_from_world().matrix(), np.array(recipe.viewpoints.origin)
        close("colmap", "again: rotations", sample.camera.R @ UP, pose[:, :3], atol=1e-9)
        close("colmap", "again: centres", sample.camera.center, UP @ (image.projection_center() - origin), "m", atol=1e-9)
        points = origin + np.random.default_rng(1).uniform(-0.5, 0.5, (20, 3))
        camera = theirs.cameras[image.camera_id]
        expected = np.array([camera.img_from_cam(p) for p in points @ pose[:, :3].T + pose[:, 3]])
        close("colmap", "again: pixels", pixels(sample.camera, (points - origin) @ UP.T), expected, "px", atol=1e-9)
        assert sample.objects[0].key == "car_000" and sample.objects[0].area > 60


def pixels(camera, points):
    """Where a camera shows points of the world, its distortion as OpenCV's documentation has it."""
    inside = points @ camera.R.T + camera.t
    x, y = inside[:, 0] / inside[:, 2], inside[:, 1] / inside[:, 2]
    bent = camera.intrinsics.distortion
    k1, k2, p1, p2 = bent.coefficients[:4] if bent else (0, 0, 0, 0)
    r2 = x * x + y * y
    radial = 1 + k1 * r2 + k2 * r2 * r2
    xd = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    yd = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    k = camera.K
    return np.stack([k[0, 0] * xd + k[0, 2], k[1, 1] * yd + k[1, 2]], 1)


@pytest.mark.slow
def test_a_stand_in_is_where_all_look_and_cameras_are_outside(tmp_path):
    colmap_tree(tmp_path / "scene")
    made = make_again("colmap", tmp_path / "scene" / "sparse" / "0", tmp_path / "again")
    text = made.recipe.read_text()
    assert "the data set has no mesh" in text and "zoo:car" in text
    again = rendered(made, tmp_path / "out")
    assert all(0.05 < o.area / (64 * 48) < 0.6 for sample in again for o in sample.objects)


@pytest.mark.slow
def test_lenses_of_several_sizes_are_listed_shots(tmp_path):
    theirs = colmap_tree(tmp_path / "scene", sizes=((64, 48), (40, 60)))
    made = make_again("colmap", tmp_path / "scene", tmp_path / "again")
    assert Recipe.load(made.recipe).sampler == "listed"
    again = rendered(made, tmp_path / "out")
    images = sorted(theirs.images.values(), key=lambda image: image.name)
    for sample, image in zip(again, images, strict=True):
        camera = theirs.cameras[image.camera_id]
        assert sample.rgb.shape == (camera.height, camera.width, 3)
        world = sample.objects[0].world_from_object
        np.testing.assert_allclose(world, np.eye(4), atol=1e-9)  # upright, facing -Y, at the origin


def mesh_of(folder, name):
    """A box of COLMAP's world around what the cameras look at, lying along its z."""
    box = trimesh.creation.box((0.5, 1.0, 2.0))
    box.apply_translation((3, -1, 7))
    (folder / name).parent.mkdir(parents=True, exist_ok=True)
    box.export(folder / name)
    return box


@pytest.mark.slow
@pytest.mark.parametrize("name", ["dense/meshed-poisson.ply", "mesh.obj"])
def test_the_data_sets_own_mesh_is_where_it_was(tmp_path, name):
    """Its pixels are those that trimesh's rays meet, through COLMAP's own cameras; a cloud of points beside it is none."""
    theirs = colmap_tree(tmp_path / "scene", lenses=LENSES[:1], sizes=SIZES[:1])
    box = mesh_of(tmp_path / "scene", name)
    trimesh.PointCloud(np.zeros((3, 3))).export(tmp_path / "scene/fused.ply")
    made = make_again("colmap", tmp_path / "scene", tmp_path / "again")
    assert made.models == 1
    again = rendered(made, tmp_path / "out")
    v, u = np.mgrid[:48, :64] + 0.5
    for sample, image in zip(again, sorted(theirs.images.values(), key=lambda image: image.name), strict=True):
        pose = image.cam_from_world().matrix()
        inverse = np.linalg.inv(theirs.cameras[image.camera_id].calibration_matrix())
        rays = np.stack([u.ravel(), v.ravel(), np.ones(u.size)], 1) @ inverse.T @ pose[:, :3]
        hit = box.ray.intersects_any(np.tile(image.projection_center(), (len(rays), 1)), rays).reshape(48, 64)
        close("colmap", "again: cameras around a mesh", sample.camera.center, UP @ image.projection_center(), "m", atol=1e-9)
        assert np.count_nonzero(sample.objects[0].mask ^ hit) <= 2 < np.count_nonzero(hit)


def transforms(folder, **more):
    """What ns-process-data writes of a video: one lens beside the frames, poses of OpenGL's axes, a sparse cloud."""
    frames = []
    for i, (rotation, t) in enumerate(cameras(at=(0.2, 0.4, 0.3), down=(0, 0, -1)), 1):
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = rotation.T * [1, -1, -1], -rotation.T @ t
        frames.append({"file_path": f"images/frame_{i:05d}.png", "transform_matrix": pose.tolist(), "colmap_im_id": i})
    lens = {
        "w": 64,
        "h": 48,
        "fl_x": 60.5,
        "fl_y": 60.25,
        "cx": 32.5,
        "cy": 23.5,
        "k1": 0.05,
        "k2": -0.01,
        "p1": 1e-3,
        "p2": 0.0,
    }
    said = {**lens, "camera_model": "OPENCV", "frames": frames, "ply_file_path": "sparse_pc.ply", **more}
    said["applied_transform"] = [[1.0, 0, 0, 0], [0, 0, 1.0, 0], [0, -1.0, 0, 0]]
    folder.mkdir()
    (folder / "transforms.json").write_text(json.dumps(said, indent=4))
    trimesh.PointCloud(np.zeros((3, 3))).export(folder / "sparse_pc.ply")
    return frames


@pytest.mark.slow
def test_nerfstudios_cameras_are_the_same_again(tmp_path):
    frames = transforms(tmp_path / "scene", test_filenames=["images/frame_00002.png"], train_filenames=[])
    made = make_again("nerfstudio", tmp_path / "scene", tmp_path / "again")
    origin = np.array(Recipe.load(made.recipe).viewpoints.origin)
    again = rendered(made, tmp_path / "out")
    assert [sample.split for sample in again] == ["train", "test", *["train"] * 4]
    for sample, frame in zip(again, frames, strict=True):
        pose = np.array(frame["transform_matrix"])
        close("nerfstudio", "again: rotations", sample.camera.R.T * [1, -1, -1], pose[:3, :3], atol=1e-9)
        close("nerfstudio", "again: centres", sample.camera.center, pose[:3, 3] - origin, "m", atol=1e-9)
        lens = sample.camera.intrinsics
        assert (lens.fx, lens.fy, lens.cx, lens.cy) == (60.5, 60.25, 32.5, 23.5)
        assert lens.distortion.coefficients[:4] == (0.05, -0.01, 1e-3, 0.0)


@pytest.mark.slow
def test_lenses_of_each_frame_and_a_mesh_with_cameras_inside(tmp_path):
    """As of phones: a lens in every frame; the mesh is the room in which the cameras are."""
    frames = transforms(tmp_path / "scene")
    file = tmp_path / "scene/transforms.json"
    said = json.loads(file.read_text())
    for i, frame in enumerate(said["frames"]):
        frame |= {"fl_x": 60.0 + i, "fl_y": 61.0 + i}
    file.write_text(json.dumps(said))
    trimesh.creation.box((20, 20, 20)).export(tmp_path / "scene/room.glb")
    again = rendered(make_again("nerfstudio", file, tmp_path / "again"), tmp_path / "out")
    for i, (sample, frame) in enumerate(zip(again, frames, strict=True)):
        assert sample.camera.intrinsics.fx == 60.0 + i
        close("nerfstudio", "again: centres", sample.camera.center, np.array(frame["transform_matrix"])[:3, 3], "m", atol=1e-9)
        assert sample.objects[0].area == 64 * 48


def spoil(scene, what):
    images, said = scene / "sparse/0/images.bin", scene / "transforms.json"
    match what:
        case "half":
            images.write_bytes(images.read_bytes()[:300])
        case "camera":
            data = bytearray((scene / "sparse/0/cameras.bin").read_bytes())
            data[8:12] = struct.pack("<I", 77)
            (scene / "sparse/0/cameras.bin").write_bytes(data)
        case "model":
            data = bytearray((scene / "sparse/0/cameras.bin").read_bytes())
            data[12:16] = struct.pack("<i", 999)
            (scene / "sparse/0/cameras.bin").write_bytes(data)
        case "pose":
            said.write_text(json.dumps({"w": 4, "h": 4, "fl_x": 4, "frames": [{"file_path": "a.png"}]}))
        case "mirror":
            pose = np.diag([1.0, 1, -1, 1]).tolist()
            said.write_text(
                json.dumps({"w": 4, "h": 4, "fl_x": 4, "frames": [{"file_path": "a.png", "transform_matrix": pose}]})
            )
        case "outside":
            frame = {"file_path": "../../a.png", "transform_matrix": np.eye(4).tolist()}
            said.write_text(json.dumps({"camera_angle_x": 1.0, "frames": [frame]}))
        case "none":
            said.write_text('{"frames": []}')
        case "text":
            said.write_text('{"frames": [')
        case "lists":
            said.write_text(json.dumps({"frames": [{"file_path": "a.png"}], "train_filenames": 5}))
        case "nan":
            (scene / "sparse/0/cameras.txt").write_text("1 PINHOLE 64 48 nan 60 32 24\n2 PINHOLE 64 48 60 60 32 24\n")
            (scene / "sparse/0/images.txt").write_text("1 1 0 0 0 0 0 0 1 a.jpg\n\n")
            images.unlink()
        case "mesh":
            (scene.parent / "mesh.obj").write_text("v 0 0 0")
            (scene / "mesh.obj").symlink_to(scene.parent / "mesh.obj")


BROKEN = {
    "colmap": {"half": "expected a model of COLMAP's", "camera": r"found no camera 1 \(2 more like it\)",
               "model": "expected one of SIMPLE_PINHOLE", "mesh": "a link that leads out of it",
               "nan": r"expected a model of COLMAP's; found: fx: expected a .*number.*; found nan$"},
    "nerfstudio": {"lists": r"transforms.json: expected train_filenames, a list of names; found 5",
                   "pose": "frame number 0: found no 'transform_matrix'", "mirror": "expected a rigid pose",
                   "outside": r"expected relative paths without '\.\.'", "none": "expected pictures with cameras; found none",
                   "text": "expected JSON"},
}  # fmt: skip


@pytest.mark.parametrize(("kind", "what"), [(kind, what) for kind in BROKEN for what in BROKEN[kind]])
def test_broken_data_sets_are_told_in_a_line_and_leave_nothing(tmp_path, kind, what):
    scene = tmp_path / "scene"
    colmap_tree(scene) if kind == "colmap" else scene.mkdir()
    spoil(scene, what)
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(StoreError, match=BROKEN[kind][what]) as error:
        make_again(kind, scene, tmp_path / "again")
    assert "\n" not in str(error.value) and sorted(tmp_path.rglob("*")) == before


CAMERA, IMAGE = "1 PINHOLE 64 48 60 60 32 24", "1 1 0 0 0 0 0 0 1 a.jpg"


@pytest.mark.parametrize(
    ("camera", "image", "message"),
    [
        ("1 PINHOLE", IMAGE, "found: expected CAMERA_ID MODEL WIDTH HEIGHT and numbers; found '1 PINHOLE'"),
        (
            "1 PINHOLE 64 x 60 60 32 24",
            IMAGE,
            "found: expected CAMERA_ID MODEL WIDTH HEIGHT and numbers; found '1 PINHOLE 64 x",
        ),
        (CAMERA, "1 1 0", "found: expected IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME; found '1 1 0'"),
        (CAMERA, "1 1 0 0 0 x 0 0 1 a.jpg", "found: expected IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME; found '1 1 0 0 0 x"),
        (CAMERA, "1 0 0 0 0 0 0 0 1 a.jpg", "image 'a.jpg': expected a rotation, and a place within 1e+09; found 0.0 0.0 "),
        (
            CAMERA,
            "1 1e300 0 1e300 0 0 0 0 1 a.jpg",
            "image 'a.jpg': expected a rotation, and a place within 1e+09; found 1e+300 ",
        ),
        (CAMERA, "1 nan 0 0 0 0 0 0 1 a.jpg", "image 'a.jpg': expected a rotation, and a place within 1e+09; found nan "),
        (CAMERA, "1 1 0 0 0 1e308 0 0 1 a.jpg", "image 'a.jpg': expected a rotation, and a place within 1e+09; found 1.0 "),
        (CAMERA.replace("64", "20000"), IMAGE, "image 'a.jpg': camera: expected at most 16384 pixels a side; found 20000 x 48"),
    ],
)
def test_lines_of_colmap_are_told_in_words(tmp_path, camera, image, message):
    (tmp_path / "cameras.txt").write_text(f"{camera}\n")
    (tmp_path / "images.txt").write_text(f"{image}\n\n")
    with pytest.raises(StoreError) as error:
        make_again("colmap", tmp_path, tmp_path / "again")
    assert message in str(error.value) and len(str(error.value).splitlines()) == 1


@pytest.mark.parametrize(("kind", "file"), [("colmap", "sparse/0/cameras.txt"), ("nerfstudio", "transforms_train.json")])
def test_worlds_in_a_folder_are_named(tmp_path, kind, file):
    """As in what viewsphere itself exports: a folder for each world."""
    for name in ("chair_000", "bicycle_000", "else"):
        (tmp_path / name / file).parent.mkdir(parents=True)
    for name in ("chair_000", "bicycle_000"):
        (tmp_path / name / file).touch()
    with pytest.raises(StoreError, match=r"; found worlds in bicycle_000, chair_000: give one of these$"):
        make_again(kind, tmp_path, tmp_path / "again")
    with pytest.raises(StoreError, match=r"; found worlds in bicycle_000, chair_000: give one of these$"):
        import_dataset(kind, tmp_path, tmp_path / "in")
    with pytest.raises(StoreError, match=r"; found none$"):
        import_dataset(kind, tmp_path / "else", tmp_path / "in")


FRAME = {"file_path": "images/a.png", "w": 64, "h": 48, "fl_x": 60.0, "transform_matrix": np.eye(4).tolist()}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"file_path": ""}, "expected a file_path; found ''"),
        ({"file_path": None}, "expected a file_path; found None"),
        ({"fl_x": None}, "expected fl_x, or camera_angle_x; found neither"),
        ({"fl_x": None, "camera_angle_x": 0}, "expected fl_x, or camera_angle_x; found neither"),
        ({"fl_x": "wide"}, "expected fl_x, a number; found 'wide'"),
        ({"k1": [1]}, r"expected k1, a number; found \[1\]"),
        ({"w": "x"}, "expected w, a number; found 'x'"),
        ({"w": 20_000}, "camera: expected at most 16384 pixels a side; found 20000 x 48"),
        ({"transform_matrix": (np.eye(4) * 1e300).tolist()}, "expected a rigid pose; found another"),
        ({"transform_matrix": [[1], [1, 2]]}, r"expected a transform_matrix of 4 x 4 numbers; found \[\[1\], \[1, 2\]\]"),
    ],
)
def test_frames_of_other_values_are_told_in_words(tmp_path, changes, message):
    (tmp_path / "transforms.json").write_text(json.dumps({"frames": [FRAME | changes]}))
    with pytest.raises(StoreError, match=f"frame number 0: {message}$"):
        make_again("nerfstudio", tmp_path, tmp_path / "again")


def test_cameras_that_look_away_from_one_another_have_a_stand_in_ahead_of_the_first():
    rng = np.random.default_rng(0)
    from viewsphere.model.listed import ListedShot

    def shot(rotation, center):
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = rotation, center
        return ListedShot.model_validate({"world_from_camera": pose.tolist()})

    ahead = [shot(np.eye(3), (x, 0, 0)) for x in (0.0, 1.0, 2.0)]  # parallel axes
    assert stand_in(ahead).origin[2] > 0 and stand_in(ahead).length > 0
    outward = [shot(Rotation.from_euler("y", a).as_matrix(), np.array([np.sin(a), 0, np.cos(a)])) for a in rng.uniform(0, 6, 9)]
    found, first = stand_in(outward), np.array(outward[0].world_from_camera)
    assert (np.array(found.origin) - first[:3, 3]) @ first[:3, 2] > 0
    assert all(np.linalg.norm(np.array(found.origin) - np.array(s.world_from_camera)[:3, 3]) >= found.length for s in outward)


@pytest.mark.slow
@pytest.mark.parametrize("place", [1e8, 1e-9])
def test_a_camera_at_any_distance_has_a_stand_in_that_can_be_rendered(tmp_path, place):
    """The second looks at the first's axis, so that what they look at is about as far away."""
    poses = np.stack([np.eye(4)] * 2)
    poses[:, :3, :3] *= [1, -1, -1]
    poses[1, :3, :3] = Rotation.from_euler("y", 45, degrees=True).as_matrix()
    poses[1, :3, 3] = place, 0, 0
    frames = [FRAME | {"file_path": f"{i}.png", "transform_matrix": pose.tolist()} for i, pose in enumerate(poses)]
    (tmp_path / "transforms.json").write_text(json.dumps({"frames": frames}))
    made = make_again("nerfstudio", tmp_path, tmp_path / "again")
    assert len(rendered(made, tmp_path / "out")) == 2


def test_many_shots_of_one_name_are_numbered_in_time():
    names, began = dict[str, int](), time.process_time()
    found = [_free(name, names) for name in ["shot", "SHOT", "shot-2"] + ["Shot"] * 20_000]
    assert found[:4] == ["shot", "SHOT-2", "shot-2-2", "Shot-3"] and found[-1] == "Shot-20002"
    assert len({name.casefold() for name in found}) == len(found) and time.process_time() - began < 5


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["colmap", "nerfstudio"])
def test_recipes_keep_what_their_formats_read(tmp_path, kind):
    (colmap_tree if kind == "colmap" else transforms)(tmp_path / "scene")
    made = make_again(kind, tmp_path / "scene", tmp_path / "again")
    assert Recipe.load(made.recipe).channels == ("rgb", "depth")
    assert not any("no format uses" in note for note in generate(str(made.recipe), tmp_path / "out", workers=0).notes)


@pytest.mark.slow
def test_the_command_line_makes_a_recipe_that_can_be_planned_and_shown(tmp_path):
    transforms(tmp_path / "scene")
    answer = viewsphere("new", "--from", "nerfstudio", tmp_path / "scene", cwd=tmp_path)
    assert answer.returncode == 0 and "scene-again/recipe.yaml: 6 shots, a stand-in model" in answer.stdout
    recipe = tmp_path / "scene-again/recipe.yaml"
    assert json.loads(viewsphere("plan", recipe, "--json").stdout)["frames"] == 6
    assert viewsphere("preview", recipe, "-o", tmp_path / "sheet.png").returncode == 0
    assert plan(str(recipe)).frames == 6
    for words, message in (
        (("new", tmp_path / "b", "--kind", "poses", "--from", "colmap", tmp_path), "found --kind poses and --from colmap"),
        (("new", "--from", "nerfstudio", tmp_path / "scene"), "scene-again: expected a new folder"),
        (("new", tmp_path / "b", "--from", "colmap", tmp_path / "nothing"), "expected a data set; found no"),
        (("new", tmp_path / "b", "--from", "kitti", tmp_path), "'kitti' is unknown. Valid: bop, colmap, nerfstudio, pascal3d"),
    ):  # fmt: skip
        refused = viewsphere(*words, cwd=tmp_path)
        assert refused.returncode == 2 and message in refused.stderr and len(refused.stderr.splitlines()) == 1
    assert not (tmp_path / "b").exists()
