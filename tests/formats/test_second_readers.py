"""Formats without a public reader that installs, read a second time, from their documentation alone (formats.md of the
project's reference), by readers that were written without a look at what writes them.
"""

from __future__ import annotations

import configparser
import json
import pickle
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from proven import close, equal
from viewsphere import Dataset, generate
from viewsphere.run.exports.exporting import export
from worlds import poses as poses_recipe
from worlds import videos as videos_recipe

CENTRE = 0.5  # from an origin at the first pixel's centre to one at the picture's corner


# ---- what the readers share ----------------------------------------------------------------------------------------------


def written(dataset, place, name, **options):
    export(dataset.root, [{name: options}], output=place)
    return place / name


def pixels(path):
    """A PNG of 8 or 16 bits, its channels red, green and blue."""
    found = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    return found if found.ndim == 2 else found[..., ::-1]


def table(path):
    """The rows of a text with a line of column names, as mappings."""
    names, *rows = (line.split() for line in Path(path).read_text().splitlines())
    assert all(len(row) == len(names) for row in rows)
    return [dict(zip(names, row, strict=True)) for row in rows]


def numbers(row, *names):
    return np.array([float(row[name]) for name in names])


def about(axis, angle):
    """The rotation about one axis, right-handed."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    found = np.eye(3)
    found[[i, i, j, j], [i, j, i, j]] = c, -s, s, c
    return found


def projected(K, points):
    """Points (N, 3) before the camera in pixels."""
    found = points @ np.asarray(K).T
    return found[:, :2] / found[:, 2:]


def known(o):
    return np.isfinite(o.box3d_pixels).all()


def near_and_far(depth, sample, unit, top):
    """Compare decoded depth: what is told is the label within half a unit, the rest is nothing, or farther than can be told."""
    told = np.isfinite(depth)
    assert not np.isfinite(sample.depth[~told & (sample.depth < top)]).any()
    assert told.any()
    return depth[told], sample.depth[told], unit / 2 + 1e-6


# ---- Virtual KITTI -------------------------------------------------------------------------------------------------------

VKITTI_WORLD = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]], float)
"""From the data set's world (z up) to Virtual KITTI's (y down): `rotation_world_space`, `world_space` and extrinsics."""


def vkitti_flow(path):
    """README: (2 / 65535 v - 1) (W - 1), likewise of the height; blue 0 is invalid."""
    found = pixels(path).astype(float)
    height, width = found.shape[:2]
    flow = (2 / 65535 * found[..., :2] - 1) * [width - 1, height - 1]
    flow[found[..., 2] == 0] = np.nan
    return flow


def vkitti_scene_flow(path):
    return (pixels(path).astype(float) * 2 / 65535 - 1) * 10


def vkitti_depth(path):
    found = pixels(path)
    assert found.dtype == np.uint16
    return np.where(found == 65535, np.inf, found / 100)


def turned(y, x, z):
    """What turns a car of Virtual KITTI (x to its right, y down, z ahead; rotation 0 looks along x)."""
    return about("y", y + np.pi / 2) @ about("x", x) @ about("z", z)


CAR = np.array([[-1, 0, 0], [0, 0, -1], [0, -1, 0]], float)
"""From the axes right, down, ahead to those of the data set's objects (x to their left, -y ahead, z up)."""


def vkitti_corners(place, size, rotation):
    """Corners in the order of the data set of a box that stands on `place`."""
    width, height, length = size
    left, ahead, up = (np.array(s, float) for s in zip(*SIGNS, strict=True))
    ahead = -ahead
    local = np.stack([-left * width / 2, -(up + 1) / 2 * height, ahead * length / 2], axis=-1)
    return local @ rotation.T + place


SIGNS = [(1, 1, -1), (1, -1, -1), (-1, -1, -1), (-1, 1, -1), (1, 1, 1), (1, -1, 1), (-1, -1, 1), (-1, 1, 1)]


def check_flows(name, sample, flow, label):
    """Flow is the label within half a step where it is told; untold is what is unknown, or leads too far."""
    height, width = flow.shape[:2]
    far = (np.abs(label) > [width - 1, height - 1]).any(axis=-1)
    assert np.array_equal(np.isnan(flow[..., 0]), np.isnan(label[..., 0]) | far)
    told = ~np.isnan(flow[..., 0])
    if told.any():
        step = max(width, height) / 65535
        close("vkitti", f"second reader: {name}", flow[told], label[told], "px", atol=step + 1e-5)
    return int((np.abs(label[told]) > 1).sum())


def check_scene_flow(found, label):
    told = np.isfinite(label).all(axis=-1) & (np.abs(label) < 10).all(axis=-1)
    close("vkitti", "second reader: scene flow", found[told], label[told], "m", atol=10 / 65535 + 1e-6)


def points_of(sample):
    """The seen points (H, W, 3) in the camera, metres, by the labels' depth."""
    rows, columns = np.indices(sample.depth.shape) + CENTRE
    rays = np.stack([columns, rows, np.ones_like(rows)], axis=-1) @ np.linalg.inv(sample.camera.K).T
    return rays * sample.depth.astype(float)[..., None]


def rigid(camera):
    return np.vstack([np.column_stack([camera.R, camera.t]), [0, 0, 0, 1]])


def motion_back(sample, before):
    """The motion of the seen points to the instant before, each in its own camera's axes, by poses of objects and cameras."""
    points = points_of(sample)
    found = np.full(points.shape, np.nan)
    earlier = {o.id: o.camera_from_object for o in before.objects}
    motions = {o.id: earlier[o.id] @ np.linalg.inv(o.camera_from_object) for o in sample.objects}
    motions[0] = rigid(before.camera) @ np.linalg.inv(rigid(sample.camera))
    for number, motion in motions.items():
        there = (sample.instances == number) & np.isfinite(sample.depth)
        found[there] = points[there] @ motion[:3, :3].T + motion[:3, 3] - points[there]
    return found


@pytest.fixture(scope="module")
def vkitti2(videos, tmp_path_factory):
    return written(videos, tmp_path_factory.mktemp("vkitti2"), "vkitti", version="2")


def scenes(dataset):
    """Samples by sequence, by the order of sensors and the instant."""
    found: dict[str, dict] = {}
    for sample in dataset:
        cameras = found.setdefault(sample.sequence, {})
        cameras[sample.instant, ("left", "right").index(sample.sensor) if sample.sensor != "camera" else 0] = sample
    return found


@pytest.mark.slow
def test_vkitti_2_pictures(videos, vkitti2):
    moved = 0
    for sequence, samples in scenes(videos).items():
        frames = vkitti2 / f"Scene{sequence}" / "clone" / "frames"
        last = max(instant for instant, _ in samples)
        colors = {tuple(map(int, numbers(row, "r", "g", "b"))): row["Category"] for row in table(frames.parent / "colors.txt")}
        for (instant, camera), sample in samples.items():

            def at(kind, name, instant=instant, camera=camera, frames=frames):
                return frames / kind / f"Camera_{camera}" / f"{name}_{instant:05d}.png"

            found, expected, atol = near_and_far(vkitti_depth(at("depth", "depth")), sample, 0.01, 655.34)
            close("vkitti", "second reader: depth", found, expected, "m", atol=atol)
            with Image.open(at("instanceSegmentation", "instancegt")) as picture:
                assert picture.mode in ("P", "L")  # a palette's numbers, or shades
                equal("vkitti", "second reader: instances", np.asarray(picture), sample.instances)  # track id + 1
            classes = pixels(at("classSegmentation", "classgt"))
            for o in sample.objects:
                names = {colors[tuple(map(int, c))] for c in np.unique(classes[o.mask], axis=0)}
                assert not o.area or names == {"Car" if o.category == "car" else o.category}
            assert at("forwardFlow", "flow").exists() == (instant < last)
            assert at("backwardFlow", "backwardFlow").exists() == (instant > 0)
            if instant < last:
                flow = vkitti_flow(at("forwardFlow", "flow"))
                moved += check_flows("flow", sample, flow, sample.flow)
                check_scene_flow(vkitti_scene_flow(at("forwardSceneFlow", "sceneFlow")), sample.scene_flow)
            if instant:
                flow = vkitti_flow(at("backwardFlow", "backwardFlow"))
                check_flows("backward flow", sample, flow, sample.flow_backward)
                label = motion_back(sample, samples[instant - 1, camera])
                check_scene_flow(vkitti_scene_flow(at("backwardSceneFlow", "backwardSceneFlow")), label)
    assert moved > 1000


def test_vkitti_2_texts(videos, vkitti2):
    for sequence, samples in scenes(videos).items():
        folder = vkitti2 / f"Scene{sequence}" / "clone"
        texts = {name: table(folder / f"{name}.txt") for name in ("intrinsic", "extrinsic", "bbox", "pose", "info")}
        of = {name: {} for name in texts}
        for name in ("intrinsic", "extrinsic", "bbox", "pose"):
            for row in texts[name]:
                key = (int(row["frame"]), int(row["cameraID"]))
                of[name].setdefault(key, {})[int(row.get("trackID", 0))] = row
        labels = {int(row["trackID"]): row["label"] for row in texts["info"]}
        assert of["intrinsic"].keys() == of["extrinsic"].keys() == samples.keys()
        for key, sample in samples.items():
            row = of["intrinsic"][key][0]
            K = np.diag([*numbers(row, "K[0,0]", "K[1,1]"), 1.0])
            K[:2, 2] = numbers(row, "K[0,2]", "K[1,2]") + CENTRE
            close("vkitti", "second reader: intrinsics", K, sample.camera.K, "px", atol=1e-9)
            line = next(x for x in (folder / "extrinsic.txt").read_text().splitlines()[1:] if x.split()[:2] == [*map(str, key)])
            motion = np.array(line.split()[2:], float).reshape(4, 4)
            seen = {o.id - 1: o for o in sample.objects if o.area}
            assert of["bbox"].get(key, {}).keys() == of["pose"].get(key, {}).keys() == seen.keys()
            for track, o in seen.items():
                assert labels[track] == ("Car" if o.category == "car" else o.category)
                check_vkitti_box(of["bbox"][key][track], o)
                check_vkitti_pose(of["pose"][key][track], o, motion, K)


def check_vkitti_box(row, o):
    left, right, top, down = numbers(row, "left", "right", "top", "bottom")
    close("vkitti", "second reader: boxes", (left, top, right + 1, down + 1), o.box2d, "px")
    assert int(row["number_pixels"]) == o.area
    close("vkitti", "second reader: truncation", float(row["truncation_ratio"]), o.truncation, atol=1e-9)
    share = o.area / ((right - left + 1) * (down - top + 1))
    close("vkitti", "second reader: occupancy", float(row["occupancy_ratio"]), share, atol=1e-9)
    assert row["isMoving"] == str(bool(np.linalg.norm(o.velocity) > 1e-6))


def check_vkitti_pose(row, o, motion, K):
    size = numbers(row, "width", "height", "length")
    x, y, z = o.box3d_object.max(axis=0) - o.box3d_object.min(axis=0)
    close("vkitti", "second reader: sizes", size, (x, z, y), "m", atol=1e-6)
    placed = {}
    for space in ("world", "camera"):
        place = numbers(row, *(f"{space}_space_{a}" for a in "XYZ"))
        rotation = turned(*numbers(row, *(f"rotation_{space}_space_{a}" for a in "yxz")))
        placed[space] = vkitti_corners(place, size, rotation)
    close("vkitti", "second reader: corners in the camera", placed["camera"], o.box3d_camera, "m", atol=1e-6)
    close("vkitti", "second reader: corners in the world", placed["world"], o.box3d @ VKITTI_WORLD.T, "m", atol=1e-6)
    moved = placed["world"] @ motion[:3, :3].T + motion[:3, 3]
    close("vkitti", "second reader: extrinsics", moved, o.box3d_camera, "m", atol=1e-6)
    if known(o):
        close("vkitti", "second reader: projected", projected(K, moved), o.box3d_pixels, "px", atol=1e-3)
    at = numbers(row, "camera_space_X", "camera_space_Z")
    alpha = float(row["rotation_camera_space_y"]) - np.arctan2(*at)
    turn = (float(row["alpha"]) - alpha + np.pi) % (2 * np.pi) - np.pi
    close("vkitti", "second reader: alpha", turn, 0, "rad", atol=1e-9)


ONE_EYE = ["occlusion_level", "truncation_level", "velocity"]


@pytest.fixture(scope="module")
def one_eye(tmp_path_factory):
    """Videos of one camera, which version 1.3.1 wants."""
    out = tmp_path_factory.mktemp("one_eye") / "data"
    channels = ["rgb", "depth", "instances", "semantic", "flow", "flow_state"]
    return Dataset(Path(generate_one(out, channels)))


def generate_one(out, channels):
    told = {"rig": None, "channels": channels, "tracks": None, "time": {"frames": 3, "fps": 10}, "annotations": ONE_EYE}
    generate(videos_recipe(**told), out, workers=0)
    return out


@pytest.mark.slow
def test_vkitti_1(one_eye, tmp_path):
    root = written(one_eye, tmp_path, "vkitti", version="1.3.1")
    for sequence, samples in scenes(one_eye).items():
        (told,) = (root / "vkitti_1.3.1_motgt").glob(f"{sequence}_*.txt")
        variation = told.stem.removeprefix(f"{sequence}_")
        rows = table(told)
        extrinsics = np.loadtxt(root / "vkitti_1.3.1_extrinsicsgt" / told.name, skiprows=1)
        assert len(rows[0]) == 25 and extrinsics.shape[1] == 17
        encoding = table(root / "vkitti_1.3.1_scenegt" / f"{told.stem}_scenegt_rgb_encoding.txt")
        last = max(instant for instant, _ in samples)
        for (instant, _), sample in samples.items():

            def at(kind, instant=instant, sequence=sequence, variation=variation):
                return root / f"vkitti_1.3.1_{kind}" / sequence / variation / f"{instant:05d}.png"

            equal("vkitti", "second reader: pictures", pixels(at("rgb")), sample.rgb)
            found, expected, atol = near_and_far(vkitti_depth(at("depthgt")), sample, 0.01, 655.34)
            close("vkitti", "second reader: depth", found, expected, "m", atol=atol)
            assert at("flowgt").exists() == (instant < last)
            if instant < last:
                check_flows("flow", sample, vkitti_flow(at("flowgt")), sample.flow)
            check_scene_colours(pixels(at("scenegt")), encoding, sample)
            motion = extrinsics[extrinsics[:, 0] == instant][0, 1:].reshape(4, 4)
            mine = [row for row in rows if int(row["frame"]) == instant]
            seen = {o.id - 1: o for o in sample.objects if o.area}
            assert {int(row["tid"]) for row in mine} == seen.keys()
            for row in mine:
                check_motgt(row, seen[int(row["tid"])], motion)


def check_scene_colours(found, encoding, sample):
    """Every object, and every class of all else, is of the colour that the text says."""
    names = list(encoding[0])
    told = {row[names[0]]: tuple(int(row[name]) for name in names[1:4]) for row in encoding}
    by = {}
    for o in sample.objects:
        if o.area:
            (colour,) = {tuple(map(int, c)) for c in found[o.mask]}
            by[o.id] = colour
            assert colour in told.values()
    assert len(set(by.values())) == len(by)
    assert not {tuple(map(int, c)) for c in np.unique(found[sample.instances == 0], axis=0)} & set(by.values())


def check_motgt(row, o, motion):
    left, top, right, down = numbers(row, *"ltrb")
    close("vkitti", "second reader: boxes", (left, top, right + 1, down + 1), o.box2d, "px")
    size = numbers(row, "w3d", "h3d", "l3d")
    corners = vkitti_corners(numbers(row, "x3d", "y3d", "z3d"), size, turned(*numbers(row, "ry", "rx", "rz")))
    close("vkitti", "second reader: corners in the camera", corners, o.box3d_camera, "m", atol=1e-6)
    world = (corners - motion[:3, 3]) @ motion[:3, :3]
    close("vkitti", "second reader: extrinsics", world, o.box3d @ VKITTI_WORLD.T, "m", atol=1e-6)
    close("vkitti", "second reader: truncation", float(row["truncr"]), o.truncation, atol=1e-9)
    box = (right - left + 1) * (down - top + 1)
    close("vkitti", "second reader: occupancy", float(row["occupr"]), o.area / box, atol=1e-9)
    assert int(row["occluded"]) == o.occlusion_level
    assert int(row["truncated"]) == (o.truncation > 0) + (o.truncation > 0.5)
    assert row["label"] == ("Car" if o.category == "car" else o.category)
    assert row["moving"] == str(int(np.linalg.norm(o.velocity) > 1e-6))


# ---- a camera that is rolled, which the shared data sets have not ---------------------------------------------------------


@pytest.fixture(scope="module")
def tilted(tmp_path_factory):
    """Pictures of a camera that rolls, looks down and up, at models one at a time, some of them cut off."""
    out = tmp_path_factory.mktemp("tilted") / "data"
    views = {"azimuth": [40, 250], "elevation": [25, -15], "tilt": [30], "distance": 2.0}
    generate(poses_recipe(viewpoints=views, scene={"ground": False}), out, workers=0)
    return Dataset(out)


@pytest.fixture(scope="module", params=["stills", pytest.param("tilted", marks=pytest.mark.slow)])
def views(request):
    return request.getfixturevalue(request.param)


# ---- CARLA ---------------------------------------------------------------------------------------------------------------

TAGS = {"sky": 11, "ground": 25, "car": 14, "chair": 21, "post_box": 21}


def carla_matrix(transform):
    """What `carla.Transform` does: from the thing's axes (ahead, right, up) to Unreal's world, left-handed."""
    turn = transform["rotation"]
    (cp, cy, cr), (sp, sy, sr) = ([f(np.radians(turn[n])) for n in ("pitch", "yaw", "roll")] for f in (np.cos, np.sin))
    found = np.eye(4)
    found[:3, :3] = [
        [cp * cy, cy * sp * sr - sy * cr, -cy * sp * cr - sy * sr],
        [cp * sy, sy * sp * sr + cy * cr, -sy * sp * cr + cy * sr],
        [sp, -cp * sr, cp * cr],
    ]
    found[:3, 3] = [transform["location"][a] for a in "xyz"]
    return found


def carla_K(row):
    width, height = row["image_size_x"], row["image_size_y"]
    focal = width / (2 * np.tan(np.radians(row["fov"]) / 2))
    return np.array([[focal, 0, width / 2], [0, focal, height / 2], [0, 0, 1]])


def test_carla(views, tmp_path):
    root = written(views, tmp_path, "carla")
    for split in views.splits:
        folder = root / split / "camera"
        frames = {row["frame"]: row for row in json.loads((folder / "transforms.json").read_text())}
        samples = {sample.index: sample for sample in views if sample.split == split}
        assert frames.keys() == samples.keys()
        for index, sample in samples.items():
            name = f"{index:08d}"
            code = pixels(folder / "depth" / f"{name}.png").astype(np.int64) @ [1, 256, 65536]
            depth = 1000 * code / (256**3 - 1)
            told = np.isfinite(sample.depth)
            close("carla", "second reader: depth", depth[told], sample.depth[told], "m", atol=3.1e-5)
            assert (depth[~told] == 1000).all()
            tags = pixels(folder / "semantic_segmentation" / f"{name}.png")
            expected = np.full(tags.shape[:2], TAGS["sky"])
            expected[sample.semantic == 2] = TAGS["ground"]
            for o in sample.objects:
                expected[sample.instances == o.id] = TAGS[o.category]
            equal("carla", "second reader: tags", tags[..., 0], expected)
            instances = pixels(folder / "instance_segmentation" / f"{name}.png").astype(int)
            equal("carla", "second reader: tags", instances[..., 0], expected)
            equal("carla", "second reader: instances", instances[..., 1:] @ [1, 256], sample.instances)
            row = frames[index]
            check_carla_boxes(json.loads((folder / "bounding_boxes" / f"{name}.json").read_text()), row, sample)


def check_carla_boxes(boxes, row, sample):
    to_camera = np.linalg.inv(carla_matrix(row["transform"]))
    close("carla", "second reader: intrinsics", carla_K(row), sample.camera.K, "px", atol=1e-9)
    assert {box["id"] for box in boxes} == {o.id for o in sample.objects}
    for box in boxes:
        (o,) = (o for o in sample.objects if o.id == box["id"])
        assert box["type_id"] == o.category and box["semantic_tag"] == TAGS[o.category]
        left, back, up = np.array(SIGNS, float).T
        local = np.stack([-back, -left, up], axis=-1) * [box["extent"][a] for a in "xyz"]
        motion = carla_matrix(box["transform"])
        world = local @ motion[:3, :3].T + motion[:3, 3]
        close("carla", "second reader: corners in the world", world * [1, -1, 1], o.box3d, "m", atol=1e-6)
        seen = world @ to_camera[:3, :3].T + to_camera[:3, 3]
        seen = np.stack([seen[:, 1], -seen[:, 2], seen[:, 0]], axis=-1)
        close("carla", "second reader: corners in the camera", seen, o.box3d_camera, "m", atol=1e-6)
        if known(o):
            found = projected(carla_K(row), seen)
            close("carla", "second reader: projected", found, o.box3d_pixels, "px", atol=1e-3)


# ---- AirSim --------------------------------------------------------------------------------------------------------------

AIRSIM = ["scene", "depth_planar", "depth_perspective", "segmentation", "infrared"]


def airsim_pfm(path):
    """Rows from the top, as AirSim writes them."""
    kind, size, scale, body = path.read_bytes().split(b"\n", 3)
    width, height = map(int, size.split())
    assert kind == b"Pf"
    return np.frombuffer(body, "<f4" if float(scale) < 0 else ">f4").reshape(height, width)


def airsim_log(folder):
    names, *rows = ((folder / "airsim_rec.txt").read_text().rstrip("\n")).split("\n")
    return [dict(zip(names.split("\t"), row.split("\t"), strict=True)) for row in rows]


def quaternion_matrix(w, x, y, z):
    """q p q*, of a unit quaternion."""
    v, I = np.array([x, y, z]), np.eye(3)  # noqa: E741
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return (w * w - v @ v) * I + 2 * np.outer(v, v) + 2 * w * cross


def check_airsim_pose(row, sample):
    turn = quaternion_matrix(*numbers(row, "Q_W", "Q_X", "Q_Y", "Q_Z"))
    place = numbers(row, "POS_X", "POS_Y", "POS_Z")
    for o in sample.objects:
        east, north, up = o.box3d.T
        body = (np.stack([north, east, -up], axis=-1) - place) @ turn
        found = np.stack([body[:, 1], body[:, 2], body[:, 0]], axis=-1)
        close("airsim", "second reader: corners in the camera", found, o.box3d_camera, "m", atol=1e-6)


def check_airsim_images(folder, row, sample, colours):
    files = {int(name.split("_")[-2]): folder / "images" / name for name in row["ImageFile"].split(";")}
    equal("airsim", "second reader: pictures", pixels(files[0]), sample.rgb)
    for kind, label in ((1, sample.depth), (2, sample.depth_ray)):
        told, found = np.isfinite(label), airsim_pfm(files[kind])
        close("airsim", "second reader: depth", found[told], label[told], "m")
        assert (found[~told] == 65504).all()
    if 4 in files:
        told, found = np.isfinite(sample.disparity), airsim_pfm(files[4]).astype(float) * sample.width
        close("airsim", "second reader: disparity", found[told], sample.disparity[told], "px", atol=1e-5)
        assert (found[~told] == 0).all()
    equal("airsim", "second reader: segmentation", pixels(files[5]), colours[sample.instances])
    shade = pixels(files[7])
    equal("airsim", "second reader: infrared", shade, np.broadcast_to(sample.instances[..., None], shade.shape))


def airsim_colours(root):
    rows = [line.split("\t") for line in (root / "seg_rgbs.txt").read_text().splitlines()]
    assert [int(number) for number, _ in rows] == list(range(len(rows)))
    return np.array([json.loads(colour) for _, colour in rows])


def test_airsim_videos(videos, tmp_path):
    root = written(videos, tmp_path, "airsim", images=[*AIRSIM, "disparity_normalized"])
    colours = airsim_colours(root)
    for sequence, samples in scenes(videos).items():
        rows = airsim_log(root / sequence)
        assert len(rows) == len(samples)
        for row in rows:
            (sample,) = (
                s for s in samples.values() if s.sensor == row["VehicleName"] and round(s.time * 1000) == int(row["TimeStamp"])
            )
            check_airsim_pose(row, sample)
            check_airsim_images(root / sequence, row, sample, colours)


def test_airsim_pictures(views, tmp_path):
    root = written(views, tmp_path, "airsim", images=AIRSIM)
    for split in views.splits:
        settings = json.loads((root / split / "settings.json").read_text())
        told = settings["Vehicles"]["camera"]["Cameras"]["0"]["CaptureSettings"][0]
        for row in airsim_log(root / split):
            (sample,) = (s for s in views if s.index == int(row["TimeStamp"]))
            assert sample.split == split
            focal = told["Width"] / 2 / np.tan(np.radians(told["FOV_Degrees"]) / 2)
            close("airsim", "second reader: angle of view", focal, sample.camera.K[0, 0], "px", atol=1e-9)
            check_airsim_pose(row, sample)
            check_airsim_images(root / split, row, sample, airsim_colours(root))


# ---- NOCS ----------------------------------------------------------------------------------------------------------------

UPRIGHT = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]], float)
"""From the axes of the data set's objects (x left, -y ahead, z up) to those of NOCS' models (x left, y up, z ahead)."""


def obj_vertices(path):
    return np.array([line.split()[1:4] for line in path.read_text().splitlines() if line.startswith("v ")], float)


@pytest.mark.slow
def test_nocs(views, tmp_path):
    root = written(views, tmp_path, "nocs")
    for sample in views:
        (colour,) = (root / "real" / sample.split).glob(f"*/{sample.index % 1000:04d}_color.png")
        beginning = str(colour).removesuffix("color.png")
        depth = cv2.imread(beginning + "depth.png", -1)
        assert depth.dtype == np.uint16 and depth.ndim == 2
        told = np.isfinite(sample.depth) & (sample.depth < 65.535)
        close("nocs", "second reader: depth", depth[told] / 1000, sample.depth[told], "m", atol=5.1e-4)
        assert (depth[~told] == np.where(np.isfinite(sample.depth[~told]), 65535, 0)).all()  # farther counts as 65.535 m
        mask = cv2.imread(beginning + "mask.png")[..., 2].astype(int)
        equal("nocs", "second reader: mask", np.where(mask == 255, 0, mask), sample.instances)
        coord = cv2.imread(beginning + "coord.png")[..., (2, 1, 0)] / 255
        coord[..., 2] = 1 - coord[..., 2]
        inside = sample.instances > 0
        expected = (sample.nocs[inside] - 0.5) @ UPRIGHT.T + 0.5
        close("nocs", "second reader: coordinates", coord[inside], expected, "", atol=0.5 / 255 + 1e-6)
        rows = [line.split() for line in Path(beginning + "meta.txt").read_text().splitlines()]
        assert [(int(a), int(b), c) for a, b, c in rows] == [(o.id, o.category_id, o.key) for o in sample.objects]
        scene = colour.parent.name
        found = pickle.loads(
            (
                root / "gts" / f"real_{sample.split}" / f"results_real_{sample.split}_{scene}_{sample.index % 1000:04d}.pkl"
            ).read_bytes()
        )
        models = {o.key: root / "obj_models" / f"real_{sample.split}" / f"{o.key}.obj" for o in sample.objects}
        check_nocs_poses(found, sample, models, coord)


def check_nocs_poses(found, sample, models, coord):
    seen = [o for o in sample.objects if o.area]
    assert list(found["gt_class_ids"]) == [o.category_id for o in seen]
    boxes = np.array(found["gt_bboxes"])[:, [1, 0, 3, 2]]
    close("nocs", "second reader: boxes", boxes, [o.box2d for o in seen], "px")
    K = found["intrinsics"] + np.array([[0, 0, CENTRE], [0, 0, CENTRE], [0, 0, 0]])
    close("nocs", "second reader: intrinsics", K, sample.camera.K, "px", atol=1e-9)
    for o, pose, scales in zip(seen, found["gt_RTs"], found["gt_scales"], strict=True):
        local = np.array(SIGNS) @ UPRIGHT.T * scales / 2
        corners = local @ pose[:3, :3].T + pose[:3, 3]
        close("nocs", "second reader: corners in the camera", corners, o.box3d_camera, "m", atol=1e-5)
        diagonal = np.cbrt(np.linalg.det(pose[:3, :3]))
        points = (coord[o.mask] - 0.5) @ pose[:3, :3].T + pose[:3, 3]
        error = 0.5 / 255 * diagonal * np.sqrt(3)
        close("nocs", "second reader: points in the camera", points, points_of(sample)[o.mask], "m", atol=error + 1e-5)
        extents = np.loadtxt(models[o.key].with_suffix(".txt"))
        close("nocs", "second reader: extents", extents, scales * diagonal, "m", atol=1e-6)
        vertices = obj_vertices(models[o.key])
        close("nocs", "second reader: mesh", np.ptp(vertices, axis=0), extents, "m", atol=1e-6)
        if o.box2d_unclipped:
            shown = projected(K, vertices / diagonal @ pose[:3, :3].T + pose[:3, 3])
            around = (*shown.min(axis=0), *shown.max(axis=0))
            close("nocs", "second reader: projected mesh", around, o.box2d_unclipped, "px", atol=1e-3)


# ---- Omni3D --------------------------------------------------------------------------------------------------------------


def test_omni3d(views, tmp_path):
    root = written(views, tmp_path, "omni3d")
    read = 0
    for split in views.splits:
        told = json.loads((root / "Omni3D" / f"viewsphere_{split}.json").read_text())
        images = {image["id"]: image for image in told["images"]}
        names = {category["id"]: category["name"] for category in told["categories"]}
        for found in told["annotations"]:
            image = images[found["image_id"]]
            (sample,) = (s for s in views if s.index == int(Path(image["file_path"]).stem))
            assert sample.split == split and (root / image["file_path"]).is_file()
            close("omni3d", "second reader: intrinsics", image["K"], sample.camera.K, "px", atol=1e-9)
            (o,) = (o for o in sample.objects if o.id == found["track_id"])
            assert names[found["category_id"]] == found["category_name"] == o.category
            check_omni3d(found, o, image)
            read += 1
    assert read == sum(len(sample.objects) for sample in views)


def check_omni3d(found, o, image):
    width, height, length = found["dimensions"]
    center, turn = np.array(found["center_cam"]), np.array(found["R_cam"])
    close("omni3d", "second reader: rotation", np.linalg.det(turn), 1, atol=1e-9)
    left, back, up = np.array(SIGNS, float).T
    local = np.stack([-back * length / 2, -up * height / 2, left * width / 2], axis=-1)
    corners = local @ turn.T + center
    close("omni3d", "second reader: corners in the camera", corners, o.box3d_camera, "m", atol=1e-6)
    ordered = np.array([(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)])
    told = np.array(found["bbox3D_cam"])  # as Cube R-CNN orders them: length along x, height along y, width along z
    close("omni3d", "second reader: bbox3D_cam", told, ordered * [length, height, width] / 2 @ turn.T + center, "m", atol=1e-6)
    if not found["behind_camera"]:
        shown = projected(image["K"], told)
        around = np.array((*shown.min(axis=0), *shown.max(axis=0)))
        close("omni3d", "second reader: bbox2D_proj", found["bbox2D_proj"], around, "px", atol=1e-6)
        cut = np.clip(around, 0, [image["width"], image["height"]] * 2)
        if (cut[2:] > cut[:2]).all():
            close("omni3d", "second reader: bbox2D_trunc", found["bbox2D_trunc"], cut, "px", atol=1e-6)
    assert found["behind_camera"] == bool((o.box3d_camera[:, 2] <= 0).any())
    close("omni3d", "second reader: bbox2D_tight", found["bbox2D_tight"], o.box2d or [-1] * 4, "px")
    close("omni3d", "second reader: visibility", found["visibility"], o.visibility, atol=1e-9)
    close("omni3d", "second reader: truncation", found["truncation"], o.truncation, atol=1e-9)
    assert found["segmentation_pts"] == o.area and found["lidar_pts"] == -1 and found["depth_error"] == -1


# ---- KITTI: depth, and tracking ------------------------------------------------------------------------------------------


def calibration(path):
    lines = (line.replace(":", " ").split() for line in path.read_text().splitlines())
    found = {name: rest for name, *rest in lines}
    return {name: np.array(rest, float) for name, rest in found.items() if all(_is_number(value) for value in rest)}


def _is_number(text):
    try:
        float(text)
    except ValueError:
        return False
    return True


def centred(P):
    """A projection whose origin is the first pixel's centre, for pixels from the picture's corner."""
    return np.array([[1, 0, CENTRE], [0, 1, CENTRE], [0, 0, 1]]) @ P.reshape(3, 4)


def test_kitti_depth(videos, tmp_path):
    root = written(videos, tmp_path, "kitti_depth")
    for sequence, samples in scenes(videos).items():
        for (instant, camera), sample in samples.items():
            folder = root / sample.split / sequence
            name = f"image_0{2 + camera}"
            equal("kitti_depth", "second reader: pictures", pixels(folder / name / "data" / f"{instant:010d}.png"), sample.rgb)
            depth = pixels(folder / "proj_depth" / "groundtruth" / name / f"{instant:010d}.png")
            assert depth.dtype == np.uint16
            told = depth > 0
            assert not np.isfinite(sample.depth[~told & (sample.depth < 255.99)]).any()
            close("kitti_depth", "second reader: depth", depth[told] / 256, sample.depth[told], "m", atol=1 / 512 + 1e-5)
            told = calibration(folder / "calib_cam_to_cam.txt")
            size = told[f"S_rect_0{2 + camera}"]
            assert list(size) == [sample.width, sample.height]
            P = centred(told[f"P_rect_0{2 + camera}"])
            left = samples[instant, 0]
            for o, other in zip(sample.objects, left.objects, strict=True):
                assert o.id == other.id
                corners = np.column_stack([other.box3d_camera, np.ones(8)])
                close("kitti_depth", "second reader: projected", projected(P, corners), o.box3d_pixels, "px", atol=1e-6)


TRACKING = ["frame", "id", "type", "truncated", "occluded", "alpha", "left", "top", "right", "bottom"]
TRACKING += ["height", "width", "length", "x", "y", "z", "rotation_y"]


@pytest.mark.slow
def test_kitti_tracking(drives, tmp_path):
    root = written(drives, tmp_path, "kitti", task="tracking")
    training = root / "training"
    names = [line.split() for line in (root / "evaluate_tracking.seqmap.training").read_text().splitlines()]
    sequences: dict[str, list] = {}
    for sample in drives:
        sequences.setdefault(sample.sequence, []).append(sample)
    assert [(int(row[0]), int(row[-1]) - int(row[-2])) for row in names] == [(0, 5), (1, 5)]
    for number, samples in enumerate(sequences.values()):
        told = calibration(training / "calib" / f"{number:04d}.txt")
        rows = [line.split(" ") for line in (training / "label_02" / f"{number:04d}.txt").read_text().splitlines()]
        rows = [dict(zip(TRACKING, row, strict=True)) for row in rows]
        for sample in samples:
            if sample.sensor == "top":
                left = next(s for s in samples if s.instant == sample.instant and s.sensor == "left")
                cloud = np.fromfile(training / "velodyne" / f"{number:04d}" / f"{sample.instant:06d}.bin", "<f4").reshape(-1, 4)
                check_velodyne(cloud, told["Tr_velo_cam"].reshape(3, 4), sample, left)
            else:
                P = centred(told["P2" if sample.sensor == "left" else "P3"])
                left = next(s for s in samples if s.instant == sample.instant and s.sensor == "left")
                for o, other in zip(sample.objects, left.objects, strict=True):
                    corners = np.column_stack([other.box3d_camera, np.ones(8)])
                    close("kitti", "second reader: projected", projected(P, corners), o.box3d_pixels, "px", atol=1e-6)
            if sample.sensor == "left":
                mine = {int(row["id"]): row for row in rows if int(row["frame"]) == sample.instant}
                seen = {o.id: o for o in sample.objects if o.area}
                assert mine.keys() == seen.keys()
                for track, row in mine.items():
                    check_kitti_row(row, seen[track])


def check_kitti_row(row, o):
    assert row["type"] == ("Car" if o.category == "car" else o.category)
    left, top, right, down = numbers(row, "left", "top", "right", "bottom")
    close("kitti", "second reader: boxes", (left, top, right + 1, down + 1), o.box2d, "px")
    assert int(row["truncated"]) == o.truncation_level and int(row["occluded"]) == o.occlusion_level
    x, y, z = np.ptp(o.box3d_object, axis=0)
    close("kitti", "second reader: sizes", numbers(row, "width", "height", "length"), (x, z, y), "m", rtol=1e-8)
    middle = numbers(row, "x", "y", "z") - [0, float(row["height"]) / 2, 0]
    close("kitti", "second reader: middles", middle, o.box3d_camera.mean(axis=0), "m", atol=1e-7)
    ahead = o.camera_from_object[:3, :3] @ [0, -1, 0]  # its heading, seen along the camera's y
    yaw = np.arctan2(-ahead[2], ahead[0])
    alpha = yaw - np.arctan2(float(row["x"]), float(row["z"]))
    turns = numbers(row, "rotation_y", "alpha") - (yaw, alpha)
    close("kitti", "second reader: headings", (turns + np.pi) % (2 * np.pi) - np.pi, 0, "rad", atol=1e-7)


def check_velodyne(cloud, motion, sample, left):
    """Points of the LiDAR lie where the left camera's depth is, but for what only one of the two sees."""
    points = cloud[:, :3].astype(float) @ motion[:, :3].T + motion[:, 3]
    points = points[points[:, 2] > 0.1]
    x, y = projected(left.camera.K, points).T
    inside = (x >= 0) & (y >= 0) & (x < left.width) & (y < left.height)
    assert inside.sum() > 100 and sample.lidar.shape[0] == len(cloud)
    # where each point is in the world, from the camera's pose and by the ground that it must lie on, or an object's box
    world = (points - left.camera.t) @ left.camera.R
    ground = np.abs(world[:, 2]) < 1e-4
    near = np.zeros(len(world), bool)
    for o in left.objects:
        local = (np.column_stack([world, np.ones(len(world))]) @ np.linalg.inv(o.world_from_object).T)[:, :3]
        near |= ((local >= o.box3d_object.min(axis=0) - 1e-4) & (local <= o.box3d_object.max(axis=0) + 1e-4)).all(axis=1)
    assert (ground | near).all()
    assert near.sum() > 20
    close("kitti", "second reader: LiDAR on the ground", world[ground & ~near][:, 2], 0, "m", atol=1e-4)


# ---- SYNTHIA -------------------------------------------------------------------------------------------------------------

SWAPPED = np.array([[1, 0, 0], [0, 0, 1], [0, 1, 0]], float)
"""SYNTHIA's world: left-handed, y up."""


def test_synthia_sequences(videos, tmp_path):
    root = written(videos, tmp_path, "synthia", layout="seqs")
    numbers_of: dict[str, set] = {}
    for sequence, samples in scenes(videos).items():
        folder = root / f"SYNTHIA-SEQS-{sequence}"
        focal, cx, cy, baseline = map(float, (folder / "CameraParams" / "intrinsics.txt").read_text().splitlines()[0:7:2])
        K = np.array([[focal, 0, cx], [0, focal, cy], [0, 0, 1]])
        places = {}
        for (instant, camera), sample in samples.items():
            end = Path(("Stereo_Left", "Stereo_Right")[camera]) / "Omni_F" / f"{instant:06d}.png"
            equal("synthia", "second reader: pictures", pixels(folder / "RGB" / end), sample.rgb)
            depth = pixels(folder / "Depth" / end)
            assert depth.dtype == np.uint16 and (depth == depth[..., :1]).all()
            found = np.where(depth[..., 0] == 65535, np.inf, depth[..., 0] / 100)
            found, expected, atol = near_and_far(found, sample, 0.01, 655.34)
            close("synthia", "second reader: depth", found, expected, "m", atol=atol)
            labels = pixels(folder / "GT" / "LABELS" / end)
            assert labels.dtype == np.uint16
            equal("synthia", "second reader: instances", labels[..., 1], sample.instances)
            check_synthia_classes(labels[..., 0], sample, numbers_of)
            motion = np.loadtxt((folder / "CameraParams" / end).with_suffix(".txt")).reshape(4, 4).T
            places[instant, camera] = motion[:3, 3]
            for o in sample.objects:
                local = (o.box3d @ SWAPPED.T - motion[:3, 3]) @ np.linalg.inv(motion[:3, :3]).T
                local = local * [1, -1, 1]
                close("synthia", "second reader: corners in the camera", local, o.box3d_camera, "m", atol=1e-6)
                if known(o):
                    close("synthia", "second reader: projected", projected(K, local), o.box3d_pixels, "px", atol=1e-3)
        for instant in {instant for instant, _ in samples}:
            apart = np.linalg.norm(places[instant, 0] - places[instant, 1])
            close("synthia", "second reader: baseline", apart, baseline, "m", atol=1e-9)
    assert numbers_of["car"] == {8} and all(
        len(found) == 1 and min(found) > 15 for n, found in numbers_of.items() if n != "car"
    )


def check_synthia_classes(found, sample, numbers_of):
    assert set(np.unique(found[sample.semantic == 1])) <= {1}  # Sky
    assert set(np.unique(found[sample.semantic == 2])) <= {0}  # Void
    for o in sample.objects:
        if o.area:
            numbers_of.setdefault(o.category, set()).update(np.unique(found[o.mask]).tolist())


# ---- Render for CNN ------------------------------------------------------------------------------------------------------


def rfc_name(name):
    """`int()` of what follows the letters, and degrees from 0 to 359, as the tools' reader does."""
    synset, md5, *rest = Path(name).stem.split("_")
    angles = [int(part[1:]) for part in rest[:4]]
    assert [part[0] for part in rest[:4]] == list("aetd")
    return synset, md5, [angle % 360 for angle in angles[:3]], angles[3], [int(part) for part in rest[4:6]]


@pytest.mark.parametrize("world", ["poses", pytest.param("tilted", marks=pytest.mark.slow)])
def test_render_for_cnn(world, request, tmp_path):
    dataset = request.getfixturevalue(world)
    root = written(dataset, tmp_path, "render_for_cnn")
    samples = {sample.index: sample for sample in dataset}
    synsets = [line.split()[1] for line in (root / "synsets.txt").read_text().splitlines()]
    models = dict(line.split() for line in (root / "models.txt").read_text().splitlines())
    read: dict[str, list] = {}
    for split in dataset.splits:
        for line in (root / "syn_lmdbs" / f"all_{split}.txt").read_text().splitlines():
            path, number, *angles = line.split()
            _, md5, named, distance, (index, ident) = rfc_name(path)
            (o,) = (o for o in samples[index].objects if o.id == ident)
            assert samples[index].split == split and synsets[int(number)] == o.category and models[md5] == o.key
            assert list(map(int, angles)) == named
            view = o.view
            told = np.array([view.azimuth_deg, view.elevation_deg, view.tilt_deg])
            turns = (np.array(named) - told + 180) % 360 - 180
            close("render_for_cnn", "second reader: angles", turns, 0, "degrees", atol=0.5 + 1e-9)
            assert abs(distance - view.distance) <= 0.5 + 1e-9
            with Image.open(root / path) as picture:
                x0, y0, x1, y1 = o.box2d
                assert picture.size == (x1 - x0, y1 - y0)
                crop = samples[index].rgb[int(y0) : int(y1), int(x0) : int(x1)].astype(int)
                assert np.abs(np.asarray(picture).astype(int) - crop).mean() < 8
            # PASCAL3D+'s camera, from the angles of the name alone: where is the object's up in the picture?
            e, t = np.radians(named[1]), np.radians(named[2])
            upright = about("z", -t) @ np.array([0, -np.cos(e), -np.sin(e)])
            seen = np.array([0, 0, 1]) @ o.camera_from_object[:3, :3].T
            close("render_for_cnn", "second reader: upward in the camera", upright, seen, atol=0.02)
            read.setdefault(o.category, []).append((o, samples[index]))
    for category, found in read.items():
        name = category.replace("_", "-")
        rows = np.loadtxt(root / "view_distribution" / f"{name}.txt", ndmin=2)
        by_index = sorted(found, key=lambda pair: pair[1].index)
        for row, (o, _) in zip(rows, by_index, strict=True):
            v = o.view
            expected = (v.azimuth_deg, v.elevation_deg, -v.tilt_deg, v.distance)
            close("render_for_cnn", "second reader: views", row, expected, "degrees", atol=1e-9)
        rows = np.loadtxt(root / "truncation_distribution" / f"{name}.txt", ndmin=2)
        whole = [pair[0] for pair in by_index if pair[0].box2d_unclipped]
        for row, o in zip(rows, whole, strict=True):
            x0, y0, x1, y1 = o.box2d_unclipped
            expected = (np.array(o.box2d) - o.box2d_unclipped) / [x1 - x0, y1 - y0, x1 - x0, y1 - y0]
            close("render_for_cnn", "second reader: truncation", row, expected, atol=1e-9)


# ---- SSCNet --------------------------------------------------------------------------------------------------------------

GRID = (240, 144, 240)  # along the world's y, z and x, the first the fastest
CELL = 0.02


def sscnet_depth(path):
    found = pixels(path)
    assert found.dtype == np.uint16
    return np.bitwise_or(found >> 3, found << 13) / 1000


def sscnet_grid(path):
    """Its corner, the motion from the camera to the world, and the classes by the world's x, z and y."""
    body = path.read_bytes()
    corner, motion = np.frombuffer(body, "<f4", 3), np.frombuffer(body, "<f4", 16, 12).reshape(4, 4)
    classes, counts = np.frombuffer(body, "<u4", offset=76).reshape(-1, 2).T
    assert counts.sum() == np.prod(GRID)
    return corner.astype(float), motion.astype(float), np.repeat(classes, counts).reshape(GRID[::-1])


def sscnet_class(sample):
    """The class of what each pixel shows; 0: nothing."""
    found = np.where(sample.semantic == 2, 2, 0)
    for o in sample.objects:
        found[sample.instances == o.id] = {"chair": 6}.get(o.category, 36)
    return found


@pytest.mark.slow
def test_sscnet(views, tmp_path):
    root = written(views, tmp_path, "sscnet")
    kinds: set[int] = set()
    for sample in list(views)[:6]:
        path = root / "depthbin" / sample.split / f"{sample.index:08d}_still_fl000_rm0000_0000.png"
        depth = sscnet_depth(path)
        told = np.isfinite(sample.depth) & (sample.depth < 65.5)
        close("sscnet", "second reader: depth", depth[told], sample.depth[told], "m", atol=5.1e-4)
        assert not depth[~np.isfinite(sample.depth)].any()
        corner, motion, classes = sscnet_grid(path.with_suffix(".bin"))
        close("sscnet", "second reader: bottom of the grid", corner[2], -0.05, "m", atol=1e-6)
        close("sscnet", "second reader: upright", motion[2, :3], sample.camera.R.T[2], "", atol=1e-6)
        close("sscnet", "second reader: the camera looks along y", motion[0, 2], 0, "", atol=1e-6)
        assert motion[1, 2] > 0
        close("sscnet", "second reader: height", motion[2, 3], sample.camera.center[2], "m", atol=1e-5)
        points = points_of(sample)[told] @ motion[:3, :3].T + motion[:3, 3]
        cells = (points - corner) / CELL  # along x, y and z
        x, y, z = np.floor(cells).astype(int).T
        inside = (cells >= 0).all(axis=1) & (cells < [GRID[2], GRID[0], GRID[1]]).all(axis=1)
        clear = inside & (np.abs(cells - np.round(cells)) > 0.01).all(axis=1)  # of no other cell
        assert clear.sum() > 100
        there = classes[x[clear], z[clear], y[clear]]
        expected = sscnet_class(sample)[told][clear]
        close("sscnet", "second reader: empty cells of what is seen", (there == 0).mean(), 0, "", atol=0)
        same = there == expected
        close("sscnet", "second reader: other classes than seen", (~same).mean(), 0, "", atol=0.03)
        kinds |= set(np.unique(there[same]).tolist())
        check_before(classes, corner, motion, sample)
    assert kinds >= {36, 6}


def check_before(classes, corner, motion, sample):
    """Cells that lie well before what their pixel shows are empty."""
    i, k, j = np.nonzero(classes)
    points = corner + (np.stack([i, j, k], axis=-1) + 0.5) * CELL
    seen = (points - motion[:3, 3]) @ motion[:3, :3]
    assert (seen[:, 2] > 0.1).all()
    place = projected(sample.camera.K, seen)
    within = np.clip(place, 0, [sample.width - 1e-6, sample.height - 1e-6])
    # What is outside of the picture is empty, but for cells of which the picture's rim shows a point.
    beyond = np.abs(place - within).max(axis=1) * seen[:, 2] / sample.camera.K[0, 0] / CELL
    close("sscnet", "second reader: cells beyond the picture", beyond, 0, "cells", atol=np.sqrt(3) / 2)
    assert (beyond > 0).mean() < 0.005
    x, y = np.floor(within).astype(int).T
    shown = cv2.erode(np.minimum(sample.depth, 100), np.ones((9, 9)))[y, x]
    assert (seen[:, 2] > shown - 0.05).all()


# ---- MOTChallenge --------------------------------------------------------------------------------------------------------


def test_mot(videos, tmp_path):
    root = written(videos, tmp_path, "mot")
    for sequence, samples in scenes(videos).items():
        for camera, sensor in enumerate(("left", "right")):
            mine = [s for (_, number), s in samples.items() if number == camera]
            folder = root / mine[0].split / f"{sequence}-{sensor}"
            told = configparser.ConfigParser()
            told.read(folder / "seqinfo.ini")
            info = told["Sequence"]
            assert (info.getint("seqLength"), info.getfloat("frameRate")) == (len(mine), 10)
            assert (info.getint("imWidth"), info.getint("imHeight")) == (mine[0].width, mine[0].height)
            rows = np.loadtxt(folder / "gt" / "gt.txt", delimiter=",", ndmin=2)
            classes = (folder / "gt" / "labels.txt").read_text().split("\n")
            seen = {(s.instant + 1, o.id): o for s in mine for o in s.objects if o.area}
            assert {(int(row[0]), int(row[1])) for row in rows} == seen.keys() and len(rows) == len(seen)
            for frame, ident, left, top, width, height, conf, number, visibility in rows:
                o = seen[frame, ident]
                x, y = left - 1, top - 1
                close("mot", "second reader: boxes", (x, y, x + width, y + height), o.box2d, "px", atol=1e-9)
                close("mot", "second reader: visibility", visibility, o.visibility, atol=1e-6)
                assert conf == 1 and classes[int(number) - 1] == o.category
            for s in mine:
                name = f"{s.instant + 1:06d}{info['imExt']}"
                equal("mot", "second reader: pictures", pixels(folder / info["imDir"] / name), s.rgb)


# ---- MPI Sintel ----------------------------------------------------------------------------------------------------------


def sintel_map(path, components):
    body = path.read_bytes()
    assert body[:4] == b"PIEH"
    width, height = np.frombuffer(body, "<i4", 2, 4)
    return np.frombuffer(body, "<f4", offset=12).reshape(height, width, components)


def sintel_camera(path):
    """M, and N, of x = M N X."""
    body = path.read_bytes()
    assert body[:4] == b"PIEH" and len(body) == 4 + 21 * 8
    found = np.frombuffer(body, "<f8", offset=4)
    return found[:9].reshape(3, 3), found[9:].reshape(3, 4)


def test_sintel(videos, tmp_path):
    root = written(videos, tmp_path, "sintel", stereo=True)
    for sequence, samples in scenes(videos).items():
        last = max(instant for instant, _ in samples)
        for (instant, camera), sample in samples.items():
            if camera:
                continue

            def at(kind, ending, folder=root / "training", name=f"{sequence}/frame_{instant + 1:04d}"):
                return folder / kind / f"{name}.{ending}"

            equal("sintel", "second reader: pictures", pixels(at("clean", "png")), sample.rgb)
            equal("sintel", "second reader: depth", sintel_map(at("depth", "dpt"), 1)[..., 0], sample.depth)
            ids = pixels(at("segmentation", "png")).astype(int) @ [65536, 256, 1]
            equal("sintel", "second reader: instances", ids, sample.instances)
            M, N = sintel_camera(at("camdata_left", "cam"))
            for o in sample.objects:
                found = projected(M, np.column_stack([o.box3d, np.ones(8)]) @ N.T) + CENTRE
                close("sintel", "second reader: projected", found, o.box3d_pixels, "px", atol=1e-6)
            assert at("flow", "flo").exists() == (instant < last)
            if instant < last:
                check_sintel_flow(sintel_map(at("flow", "flo"), 2), at, sample)
            check_sintel_stereo(lambda kind, at=at: at(kind, "png", root / "stereo" / "training"), sample, samples[instant, 1])


def check_sintel_flow(flow, at, sample):
    unknown = (np.abs(flow) > 1e9).any(axis=-1)
    equal("sintel", "second reader: unknown flow", unknown, np.isnan(sample.flow[..., 0]))
    equal("sintel", "second reader: flow", flow[~unknown], sample.flow[~unknown])
    equal("sintel", "second reader: invalid", pixels(at("invalid", "png")) > 0, unknown)
    hidden = pixels(at("occlusions", "png")) > 0
    equal("sintel", "second reader: occlusions", hidden[~unknown], sample.flow_state[~unknown] > 0)


def check_sintel_stereo(at, left, right):
    equal("sintel", "second reader: pictures", pixels(at("clean_left")), left.rgb)
    equal("sintel", "second reader: pictures", pixels(at("clean_right")), right.rgb)
    red, green, blue = np.moveaxis(pixels(at("disparities")).astype(float), -1, 0)
    disparity = 4 * red + green / 64 + blue / 16384
    outside, hidden = (pixels(at(kind)) > 0 for kind in ("outofframe", "occlusions"))
    told = np.isfinite(left.disparity)
    close("sintel", "second reader: disparity", disparity[told], left.disparity[told], "px", atol=1 / 16384 + 1e-6)
    equal("sintel", "second reader: out of frame", outside[told], left.disparity_state[told] == 2)
    equal("sintel", "second reader: stereo occlusions", hidden[told & ~outside], left.disparity_state[told & ~outside] > 0)
