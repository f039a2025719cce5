"""transforms.json, read as the documented parsers read it: world points come to the pixels that they have in the data set."""

from __future__ import annotations

import json
import math
from pathlib import Path

import cv2
import numpy as np
import pytest
import trimesh
from PIL import Image

from cube_dataset import FEW, LENS, make
from proven import close, equal
from small import small_recipe
from truth_scenes import LENSES
from viewsphere import Dataset, generate
from viewsphere.check import check
from viewsphere.composing.viewpoints.pose_files.nerfstudio import read_nerfstudio
from viewsphere.errors import StoreError, UserError
from viewsphere.geometry.camera import project
from viewsphere.geometry.lenses import lens_parameters
from viewsphere.run.datasets.importing import import_dataset
from viewsphere.run.exports.exporting import export


def written(dataset, place, **options):
    export(dataset.root, [{"nerfstudio": options}], output=place)
    return place / "nerfstudio"


def cameras(file, kind):
    """What a parser makes of a file: by the picture's name, K with the corner's origin, coefficients in OpenCV's order, whether
    the lens is a fisheye, world_from_camera of OpenGL's axes, and the frame's own entry.
    """
    meta = json.loads(file.read_text())
    found = {}
    for frame in meta["frames"]:
        if kind == "nerf-synthetic":
            name = f"{frame['file_path'].removeprefix('./')}.png"
            width, height = Image.open(file.parent / name).size
            focal = 0.5 * width / math.tan(0.5 * meta["camera_angle_x"])
            K, lens = np.array([[focal, 0, width / 2], [0, focal, height / 2], [0, 0, 1]]), {}
        else:
            name = frame["file_path"]
            assert not {"fl_x", "k1", "w"} & set(meta) or kind == "instant-ngp"
            lens, K = frame, np.array([[frame["fl_x"], 0, frame["cx"]], [0, frame["fl_y"], frame["cy"]], [0, 0, 1]])
            assert Image.open(file.parent / name).size == (frame["w"], frame["h"])
        fisheye = meta.get("camera_model") == "OPENCV_FISHEYE" or lens.get("is_fisheye", False)
        names = ("k1", "k2", "k3", "k4") if fisheye else ("k1", "k2", "p1", "p2", "k3")
        found[name] = K, np.array([lens.get(k, 0.0) for k in names]), fisheye, np.array(frame["transform_matrix"]), frame
    return meta, found


def pixels(camera, points):
    """Where OpenCV, whose pixels have their origins in their middles, sees world points."""
    K, lens, fisheye, pose, _ = camera
    inside = (np.linalg.inv(pose) @ np.column_stack((points, np.ones(len(points)))).T)[:3].T * (1, -1, -1)
    centred = K - np.array([[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])
    see = cv2.fisheye.projectPoints if fisheye else cv2.projectPoints
    return see(inside[:, None], np.zeros(3), np.zeros(3), centred, lens)[0][:, 0] + 0.5


def stem(dataset, sample):
    several = len({one.sensor for one in dataset}) > 1
    return f"{sample.sensor}/{sample.index:08d}" if several else f"{sample.index:08d}"


def everything(folder, kind):
    found = {}
    for file in sorted(folder.rglob("transforms*.json")):
        for name, camera in cameras(file, kind)[1].items():
            found[Path(name).relative_to(Path(name).parts[0]).with_suffix("").as_posix()] = file.parent, camera
    return found


@pytest.mark.parametrize("kind", ["nerfstudio", "instant-ngp", "nerf-synthetic"])
@pytest.mark.parametrize("world", ["stills", "poses", pytest.param("videos", marks=pytest.mark.slow)])
def test_world_points_come_to_their_pixels(world, kind, request, tmp_path):
    dataset = request.getfixturevalue(world)
    found = everything(written(dataset, tmp_path, kind=kind), kind)
    assert len(found) == len(dataset)
    for sample in dataset:
        points = sample.point_cloud("world").points[::97]
        expected = project(sample.camera.intrinsics, points @ sample.camera.R.T + sample.camera.t)[0]
        folder, camera = found[stem(dataset, sample)]
        close("nerfstudio", f"{kind}, own reader: pixels", pixels(camera, points), expected, "px", atol=1e-9)
        (picture,) = (
            folder.glob(f"[it][mre]*/{stem(dataset, sample)}.png")
            if kind != "nerf-synthetic"
            else (folder / sample.split / f"{stem(dataset, sample)}.png",)
        )
        assert picture.samefile(dataset.path(sample.files["rgb"]))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["nerfstudio", "instant-ngp"])
def test_depth_lifts_to_the_points(videos, kind, tmp_path):
    found = everything(written(videos, tmp_path, kind=kind), kind)
    for sample in videos:
        folder, (K, _, _, pose, frame) = found[stem(videos, sample)]
        steps = np.array(Image.open(folder / frame["depth_path" if kind == "instant-ngp" else "depth_file_path"]))
        equal("nerfstudio", "depth: where there is none", steps == 0, sample.depth >= 65.5355)
        rows, columns = np.nonzero(steps)
        depth = steps[rows, columns] * 1e-3
        inside = np.column_stack(((columns + 0.5 - K[0, 2]) / K[0, 0], -(rows + 0.5 - K[1, 2]) / K[1, 1], -np.ones(len(rows))))
        points = (inside * depth[:, None]) @ pose[:3, :3].T + pose[:3, 3]
        expected = sample.point_cloud("world").points[steps[np.isfinite(sample.depth)] > 0]
        rounding = 0.0005 * np.linalg.norm(inside, axis=1)[:, None]
        over = np.maximum(np.abs(points - expected) - rounding, 0)
        close("nerfstudio", "depth: lifted points beyond rounding", over, 0, "m", atol=1e-6)


@pytest.mark.slow
def test_splits_points_and_masks(poses, stills, tmp_path):
    for dataset, place in ((poses, tmp_path / "poses"), (stills, tmp_path / "stills")):
        folder = written(dataset, place, masks=True)
        for file in folder.glob("*/transforms.json"):
            meta, found = cameras(file, "nerfstudio")
            listed = {split: meta[f"{split}_filenames"] for split in ("train", "val", "test")}
            assert set().union(*listed.values()) == set(found)
            for name in found:
                sample = dataset[int(Path(name).stem)]
                assert name in listed[sample.split]
                mask = np.array(Image.open(file.parent / found[name][4]["mask_path"]))
                equal("nerfstudio", "masks", mask, np.where(sample.instances > 0, 255, 0))
            cloud = trimesh.load(file.parent / meta["ply_file_path"])
            samples = [dataset[int(Path(name).stem)] for name in found]
            everywhere = np.concatenate([sample.point_cloud("world").points for sample in samples])
            nearest = np.array([np.abs(everywhere - point).max(axis=1).min() for point in cloud.vertices[::31]])
            close("nerfstudio", "trimesh: points", nearest, 0, "m", atol=1e-5)
            assert len(cloud.vertices) > 200 and cloud.colors.shape == (len(cloud.vertices), 4)


def test_all_three_splits_are_there_for_nerf(stills, poses, tmp_path):
    folder = written(stills, tmp_path / "stills", kind="nerf-synthetic")
    for world in folder.glob("*/"):
        files = {file.name: cameras(file, "nerf-synthetic")[1].keys() for file in world.glob("*.json")}
        assert sorted(files) == ["transforms_test.json", "transforms_train.json", "transforms_val.json"]
        (names,) = {tuple(names) for names in files.values()}  # a scene is of one split
        assert len(names) == 2


@pytest.mark.parametrize("kind", ["nerfstudio", "instant-ngp"])
@pytest.mark.parametrize("name", ["pinhole", "barrel", "fisheye"])
def test_lenses(name, kind, tmp_path):
    distortion = LENSES[name]
    if name == "barrel" and kind == "instant-ngp":
        distortion = distortion.model_copy(update={"coefficients": distortion.coefficients[:4]})
    dataset = make(
        tmp_path / "out", several=True, intrinsics=LENS.model_copy(update={"distortion": distortion, "cx": 47.25}), channels=FEW
    )
    found = everything(written(dataset, tmp_path / "made", kind=kind), kind)
    for sample in dataset:
        points = np.random.default_rng(sample.index).uniform(-0.5, 0.5, (200, 3))
        expected = project(sample.camera.intrinsics, points @ sample.camera.R.T + sample.camera.t)[0]
        _, camera = found[stem(dataset, sample)]
        close("nerfstudio", f"{kind}, OpenCV: {name} lens", pixels(camera, points), expected, "px", atol=1e-6)


ARIA = (0.03, -0.004, 0.001, -0.0005, 0.0002, 0.0001, 0.001, -0.002, 0.0005, 0.0003, -0.0004, 0.0002)
OWN = {
    "EQUIRECTANGULAR": LENS.model_copy(
        update={"fx": 96 / math.tau, "fy": 72 / math.pi, "distortion": lens_parameters("equirectangular")}
    ),
    "EQUIRECTANGULAR, in part": LENS.model_copy(
        update={"fx": 40, "fy": 41, "cx": 47.25, "distortion": lens_parameters("equirectangular")}
    ),
    "ORTHOPHOTO": LENS.model_copy(update={"fx": 40, "fy": 41, "cx": 47.25, "distortion": lens_parameters("orthographic")}),
    "FISHEYE624": LENS.model_copy(update={"cx": 47.25, "distortion": lens_parameters("fisheye624", coefficients=ARIA)}),
}


def their_rays(model, frame, xy):
    """Origins and directions (N, 3) in the world, as nerfstudio's `Cameras._generate_rays_from_coords` computes them."""
    x, y = ((xy - (frame["cx"], frame["cy"])) / (frame["fl_x"], frame["fl_y"])).T
    zeros = np.zeros(len(xy))
    origins, rotation, center = np.zeros((len(xy), 3)), *np.split(np.array(frame["transform_matrix"])[:3], [3], axis=1)
    if model == "ORTHOPHOTO":
        origins, inside = np.column_stack((x, -y, zeros)), np.column_stack((zeros, zeros, zeros - 1))
    else:
        theta, phi = -np.pi * x, np.pi * (0.5 + y)
        inside = np.column_stack((-np.sin(theta) * np.sin(phi), np.cos(phi), -np.cos(theta) * np.sin(phi)))
    return origins @ rotation.T + center.T, inside @ rotation.T


def pixels_of_624(frame, inside):
    """`fisheye624_project` of nerfstudio, of points in OpenCV's axes."""
    k0, k1, k2, k3, k4, k5, p0, p1, s0, s1, s2, s3 = frame["distortion_params"]
    a, b = (inside[:, :2] / inside[:, 2:]).T
    r = np.hypot(a, b)
    th = np.arctan(r)
    bent = th + sum(k * th ** (3 + 2 * i) for i, k in enumerate((k0, k1, k2, k3, k4, k5)))
    x, y = bent * a / r, bent * b / r
    q = x * x + y * y
    u = x + (2 * x * x + q) * p0 + 2 * x * y * p1 + s0 * q + s1 * q * q
    v = y + (2 * y * y + q) * p1 + 2 * x * y * p0 + s2 * q + s3 * q * q
    return np.column_stack((u * frame["fl_x"] + frame["cx"], v * frame["fl_y"] + frame["cy"]))


@pytest.mark.parametrize("name", OWN)
def test_nerfstudio_s_own_models(name, tmp_path):
    """Its rays and pixels are those of the data set, which comes in again with its distances."""
    lens, model = OWN[name], name.partition(",")[0]
    distance = "depth" if lens.lens.has_depth else "depth_ray"
    dataset = make(tmp_path / "out", several=True, intrinsics=lens, channels=("rgb", distance, "instances"))
    folder = written(dataset, tmp_path / "made") / "several"
    meta = json.loads((folder / "transforms.json").read_text())
    assert meta["camera_model"] == model
    xy = np.random.default_rng(1).uniform((0, 0), (96, 72), (300, 2))
    for sample, frame in zip(dataset, meta["frames"], strict=True):
        own = lens.lens.rays(xy)
        if model == "FISHEYE624":
            close("nerfstudio", "FISHEYE624: pixels", pixels_of_624(frame, own.directions), xy, "px", atol=1e-9)
        else:
            origins, directions = their_rays(model, frame, xy)
            where = own.origins @ sample.camera.R + sample.camera.center
            close("nerfstudio", f"{model}: origins of rays", origins, where, "m", atol=1e-12)
            close("nerfstudio", f"{model}: rays", directions, own.directions @ sample.camera.R, atol=1e-12)
    import_dataset("nerfstudio", folder, tmp_path / "in")
    imported = Dataset(tmp_path / "in")
    for sample, was in zip(imported, dataset, strict=True):
        assert sample.camera.distortion == lens.distortion
        close("nerfstudio", f"{model}: import", sample.camera.K, was.camera.K, "px", atol=1e-12)
        found, expected = sample.channels[distance], was.channels[distance]
        assert np.array_equal(np.isfinite(found), np.isfinite(expected))
        seen = np.isfinite(expected)
        close("nerfstudio", f"{model}: {distance}", found[seen], expected[seen], "m", atol=0.000501)
    assert check(imported, rays=False).ok
    pose = read_nerfstudio(folder / "transforms.json").intrinsics
    close("nerfstudio", f"{model}: recipes", pose.K, lens.K, "px", atol=1e-12)
    assert pose.distortion == lens.distortion
    cloud = trimesh.load(folder / "points.ply")
    surface = np.concatenate([sample.point_cloud("world").points for sample in dataset])
    assert max(np.abs(surface - point).max(axis=1).min() for point in cloud.vertices[::17]) < 1e-5
    for kind in ("instant-ngp", "nerf-synthetic"):
        with pytest.raises(UserError, match="expected lenses of OpenCV's models; found"):
            written(dataset, tmp_path / kind, kind=kind)


def test_pictures_have_alpha_for_nerf(tmp_path):
    dataset = make(tmp_path / "out", several=True, channels=("rgb", "rgba", "depth", "instances"))
    folder = written(dataset, tmp_path / "made", kind="nerf-synthetic")
    for sample in dataset:
        (file,) = folder.glob(f"*/*/{sample.index:08d}.png")
        equal("nerfstudio", "alpha", np.array(Image.open(file)), sample.rgba)


def test_drawn_lenses(tmp_path):
    camera = {"size": [96, 72], "fov_deg": {"uniform": [30, 50]}}
    generate(small_recipe(camera=camera, channels=["rgb", "depth"], formats=[]), tmp_path / "out", workers=0)
    dataset = Dataset(tmp_path / "out")
    found = everything(written(dataset, tmp_path / "made"), "nerfstudio")
    for sample in dataset:
        close("nerfstudio", "drawn lenses", found[stem(dataset, sample)][1][0], sample.camera.K, "px")
    with pytest.raises(UserError, match="expected one lens for all pictures of a world; found several"):
        written(dataset, tmp_path / "nerf", kind="nerf-synthetic")
    assert not (tmp_path / "nerf" / "nerfstudio").exists()


@pytest.mark.parametrize(
    ("lens", "options", "message"),
    [
        ({"skew": 2.5}, {}, "expected cameras without skew; found 2.5 of camera"),
        ({"distortion": LENSES["rational"]}, {}, "expected lenses of at most 5 coefficients; found 8 of camera"),
        ({"distortion": LENSES["barrel"]}, {"kind": "instant-ngp"}, "at most 4 coefficients; found 5 of camera"),
        ({"distortion": LENSES["fisheye"]}, {"kind": "nerf-synthetic"}, "expected pinhole cameras; found 4 coefficients of"),
        (
            {"cx": 47.5},
            {"kind": "nerf-synthetic"},
            "expected square pixels and a centred principal point; found fx 80",
        ),
        ({}, {"kind": "instant-ngp", "masks": True}, "expected masks with kind nerfstudio; found instant-ngp"),
    ],
)
def test_what_it_refuses(lens, options, message, tmp_path):
    dataset = make(tmp_path / "out", intrinsics=LENS.model_copy(update=lens), channels=FEW)
    with pytest.raises(UserError, match=f"format nerfstudio: .*{message}"):
        written(dataset, tmp_path / "made", **options)
    assert not (tmp_path / "made").exists()


@pytest.mark.parametrize("kind", ["nerfstudio", "instant-ngp", "nerf-synthetic"])
def test_a_world_comes_in_as_it_went_out(stills, poses, kind, tmp_path):
    for dataset, world in ((stills, "scene-000001"), (poses, "car_000")):
        folder = written(dataset, tmp_path / world, kind=kind) / world
        found = import_dataset("nerfstudio", folder, tmp_path / f"{world}-in")
        imported = Dataset(tmp_path / f"{world}-in")
        own = [sample for sample in dataset if dataset.plan.row_at(sample.index).subject == world]
        assert len(imported) == len(own) > 1 and found.left_out == ()
        for sample, was in zip(imported, own, strict=True):
            close("nerfstudio", "import: poses", sample.camera.R, was.camera.R, atol=1e-12)
            close("nerfstudio", "import: positions", sample.camera.center, was.camera.center, "m", atol=1e-12)
            close("nerfstudio", "import: lenses", sample.camera.K, was.camera.K, "px", atol=1e-9)
            equal("nerfstudio", "import: pictures", sample.rgb, was.rgb)
            assert sample.split == (was.split if kind == "nerf-synthetic" else "train")  # a world of one split has it thrice
            if kind != "nerf-synthetic":
                near = was.depth < 65.5
                close("nerfstudio", "import: depth", sample.depth[near], was.depth[near], "m", atol=0.000501)
                assert np.isinf(sample.depth[~near]).all()
    assert check(imported, rays=False).ok
    again = written(imported, tmp_path / "again", kind=kind)
    first = [json.loads(min(place.rglob("transforms*.json")).read_text())["frames"] for place in (folder, again)]
    before, after = ([frame["transform_matrix"] for frame in frames] for frames in first)
    close("nerfstudio", "import: out again", after, before, atol=1e-12)


@pytest.mark.parametrize("name", ["barrel", "fisheye"])
@pytest.mark.parametrize("kind", ["nerfstudio", "instant-ngp"])
def test_lenses_come_in(name, kind, tmp_path):
    bent = LENSES[name]
    if name == "barrel" and kind == "instant-ngp":
        bent = bent.model_copy(update={"coefficients": bent.coefficients[:4]})
    dataset = make(tmp_path / "out", several=True, intrinsics=LENS.model_copy(update={"distortion": bent}), channels=FEW)
    import_dataset("nerfstudio", written(dataset, tmp_path / "made", kind=kind) / "several", tmp_path / "in")
    for sample in Dataset(tmp_path / "in"):
        assert sample.camera.distortion == bent


def test_what_is_broken_is_told(poses, tmp_path):
    folder = written(poses, tmp_path / "made") / "car_000"
    file = folder / "transforms.json"
    whole = json.loads(file.read_text())

    def told(change):
        data = json.loads(json.dumps(whole))
        change(data)
        file.unlink()
        file.write_text(json.dumps(data))
        with pytest.raises(StoreError) as caught:
            import_dataset("nerfstudio", folder, tmp_path / "in")
        assert not (tmp_path / "in").exists()
        return str(caught.value)

    def of_frame(**fields):
        return told(lambda data: data["frames"][1].update(fields))

    assert "frame number 1: expected a picture; found no images/none.png" in of_frame(file_path="images/none.png")
    assert "frame number 1: " in of_frame(file_path="../../../etc/passwd")
    assert "expected a picture of 161 x 120 pixels; found 160 x 120" in of_frame(w=161)
    assert "expected a rigid pose; found another" in of_frame(transform_matrix=np.diag([2.0, 1, 1, 1]).tolist())
    assert "expected a transform_matrix of 4 x 4 numbers; found [[1, 0], [0, 1]]" in of_frame(transform_matrix=[[1, 0], [0, 1]])
    assert "frame number 1: found no 'file_path'" in told(lambda data: data["frames"][1].pop("file_path"))
    assert "expected lenses without k4; found 0.5" in of_frame(k4=0.5)
    assert "expected a camera_model of OPENCV, " in told(lambda data: data.update(camera_model="VR180_L"))
    assert "expected a mapping with a list of frames" in told(lambda data: data.pop("frames"))
    file.write_text(json.dumps({**whole, "frames": [7, *whole["frames"]]}))
    found = import_dataset("nerfstudio", file, tmp_path / "in", keep_going=True)
    assert found.count == 3 and len(found.left_out) == 1
    with pytest.raises(StoreError, match=r"expected transforms\.json, or transforms_train\.json; found none"):
        import_dataset("nerfstudio", tmp_path, tmp_path / "none")


def test_recipes_take_the_poses(videos, tmp_path):
    folder = written(videos, tmp_path)
    for world in videos.sequences:
        read = read_nerfstudio(folder / world / "transforms.json")
        own = [sample for sample in videos if sample.sequence == world]
        assert read.intrinsics == own[0].camera.intrinsics
        for entry, sample in zip(read.entries, own, strict=True):
            close("nerfstudio", "recipes: poses", entry.R, sample.camera.R, atol=1e-12)
            close("nerfstudio", "recipes: positions", entry.center, sample.camera.center, "m", atol=1e-12)
