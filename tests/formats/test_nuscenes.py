"""nuScenes, read by its development kit where it is installed, and by a small reader of its tables: the same boxes, sensors,
points, chains and tracks.
"""

from __future__ import annotations

import json

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from proven import close, equal
from viewsphere import Dataset, generate, plugins
from viewsphere.errors import UserError
from viewsphere.formats.nuscenes import FORMAT
from viewsphere.plugins.format import FormatSpec
from viewsphere.run.exports.exporting import export
from viewsphere.store import Choice

TABLES = (
    "category", "attribute", "visibility", "instance", "sensor", "calibrated_sensor", "ego_pose", "log", "scene", "sample",
    "sample_data", "sample_annotation", "map",
)  # fmt: skip
CAMERAS = {"left": "CAM_LEFT", "right": "CAM_RIGHT"}
OURS = (5, 6, 2, 1, 4, 7, 3, 0)
"""Our vertices in the order of the development kit's corners: front left top, ..., the front first."""


@pytest.fixture(scope="module")
def written(request, tmp_path_factory):
    made = {}

    def get(world):
        if world not in made:
            made[world] = tmp_path_factory.mktemp(world)
            export(request.getfixturevalue(world).root, "nuscenes", output=made[world])
        return made[world] / "nuscenes"

    return get


class Tables:
    """The tables of a version by their tokens."""

    def __init__(self, root, version="v1.0-mini"):
        rows = {name: json.loads((root / version / f"{name}.json").read_text()) for name in TABLES}
        self.rows, self.root = rows, root
        self.by_token = {name: {row["token"]: row for row in rows[name]} for name in TABLES}
        assert all(len(self.by_token[name]) == len(rows[name]) for name in TABLES)

    def get(self, table, token):
        return self.by_token[table][token]

    def scene_of(self, sequence):
        return next(scene for scene in self.rows["scene"] if scene["description"] == sequence)

    def chain(self, table, token):
        """A record and all behind it; each knows the one before."""
        found, before = [], ""
        while token:
            row = self.get(table, token)
            assert row["prev"] == before
            found.append(row)
            before, token = row["token"], row["next"]
        return found


def matrix(record):
    pose = np.eye(4)
    w, x, y, z = record["rotation"]
    pose[:3, :3], pose[:3, 3] = Rotation.from_quat([x, y, z, w]).as_matrix(), record["translation"]
    return pose


def corners(record):
    """The corners of a box as the schema has them: width, length, height; x ahead, y left, z up."""
    width, length, height = record["size"]
    signs = np.array([[1, 1, 1], [1, -1, 1], [1, -1, -1], [1, 1, -1], [-1, 1, 1], [-1, -1, 1], [-1, -1, -1], [-1, 1, -1]])
    return signs * np.array([length, width, height]) / 2 @ matrix(record)[:3, :3].T + record["translation"]


@pytest.mark.parametrize("world", ["videos", "drives"])
@pytest.mark.slow
def test_sensors_and_chains(request, written, world):
    dataset, tables = request.getfixturevalue(world), Tables(written(world))
    for name in dataset.sequences:
        scene = tables.scene_of(name)
        samples = tables.chain("sample", scene["first_sample_token"])
        assert samples[-1]["token"] == scene["last_sample_token"] and len(samples) == scene["nbr_samples"]
        for sensor in {sample.sensor for sample in dataset}:
            channel = CAMERAS.get(sensor, "LIDAR_TOP")
            own = dataset.sequence(name, sensor)
            first = next(
                row
                for row in tables.rows["sample_data"]
                if row["sample_token"] == samples[0]["token"] and f"/{channel}/" in row["filename"]
            )
            data = tables.chain("sample_data", first["token"])
            assert [row["sample_token"] for row in data] == [row["token"] for row in samples]
            start = samples[0]["timestamp"]
            for row, sample in zip(data, own, strict=True):
                close("nuscenes", "times", (row["timestamp"] - start) / 1e6, sample.time, "s", atol=1e-6)
                calibrated = tables.get("calibrated_sensor", row["calibrated_sensor_token"])
                assert tables.get("sensor", calibrated["sensor_token"])["channel"] == channel
                pose = matrix(tables.get("ego_pose", row["ego_pose_token"])) @ matrix(calibrated)
                expected = np.eye(4)
                axes = np.eye(3) if sensor in CAMERAS else np.array([[0, -1, 0], [0, 0, -1], [1, 0, 0]])
                expected[:3, :3], expected[:3, 3] = sample.camera.R.T @ axes, sample.camera.center
                close("nuscenes", "poses of sensors", pose, expected, "m", atol=1e-9)
                if sensor in CAMERAS:
                    moved = sample.camera.K - [[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]]
                    equal("nuscenes", "K", calibrated["camera_intrinsic"], moved)
                    assert (row["width"], row["height"], row["fileformat"]) == (160, 120, "png")
                    equal("nuscenes", "PIL: pictures", np.array(Image.open(tables.root / row["filename"])), sample.rgb)
                else:
                    assert calibrated["camera_intrinsic"] == []
                    points = np.fromfile(tables.root / row["filename"], np.float32).reshape(-1, 5)
                    own_points = sample.lidar
                    expected = np.column_stack([own_points["xyz"], own_points["intensity"], own_points["ring"]])
                    equal("nuscenes", "numpy: LiDAR points", points, expected)


@pytest.mark.parametrize("world", ["videos", "drives"])
def test_annotations(request, written, world):
    dataset, tables = request.getfixturevalue(world), Tables(written(world))
    names = {"car": "vehicle.car", "chair": "chair", "post_box": "post_box"}
    by_sample = {}
    for row in tables.rows["sample_annotation"]:
        by_sample.setdefault(row["sample_token"], []).append(row)
    for name in dataset.sequences:
        samples = tables.chain("sample", tables.scene_of(name)["first_sample_token"])
        instances = {}
        for number, row in enumerate(samples):
            left, right = dataset.sequence(name, "left")[number], dataset.sequence(name, "right")[number]
            lidar = dataset.sequence(name, "top")[number].lidar if world == "drives" else None
            for found, o, other in zip(by_sample[row["token"]], left.objects, right.objects, strict=True):
                close("nuscenes", "boxes in the world", corners(found), o.box3d[list(OURS)], "m", atol=1e-9)
                share = max(o.visibility, other.visibility)
                level = tables.get("visibility", found["visibility_token"])["level"]
                assert level == (
                    "v0-40" if share < 0.4 else "v40-60" if share < 0.6 else "v60-80" if share < 0.8 else "v80-100"
                )
                count = 0 if lidar is None else int((lidar["instance"] == o.id).sum())
                equal("nuscenes", "points on objects", found["num_lidar_pts"], count)
                instance = tables.get("instance", found["instance_token"])
                assert tables.get("category", instance["category_token"])["name"] == names[o.category]
                instances.setdefault(o.id, instance)
                assert instances[o.id] is instance
        for instance in instances.values():
            own = tables.chain("sample_annotation", instance["first_annotation_token"])
            assert own[-1]["token"] == instance["last_annotation_token"] and len(own) == instance["nbr_annotations"]
            assert [row["sample_token"] for row in own] == [row["token"] for row in samples]


def test_splits(drives, written):
    told = json.loads((written("drives") / "v1.0-mini/splits.json").read_text())
    scenes = {f"scene-{i + 1:04d}": name for i, name in enumerate(drives.sequences)}
    found = {split: [scenes[scene] for scene in own] for split, own in told.items()}
    expected = {split: [] for split in found}
    for name in drives.sequences:
        expected[drives.sequence(name, "left")[0].split].append(name)
    assert found == expected


def test_some_instants_and_sensors(drives, tmp_path):
    """The second sequence's instants 1 to 4, of the first of them only the LiDAR."""
    export(drives.root, "nuscenes", output=tmp_path, choice=Choice(frames=((20, 30),)))
    tables = Tables(tmp_path / "nuscenes")
    (scene,) = tables.rows["scene"]
    samples = tables.chain("sample", scene["first_sample_token"])
    assert scene["name"] == "scene-0002" and len(samples) == scene["nbr_samples"] == 4
    starts = [row for row in tables.rows["sample_data"] if not row["prev"]]
    assert sorted(len(tables.chain("sample_data", row["token"])) for row in starts) == [3, 3, 4]
    for instance in tables.rows["instance"]:
        assert len(tables.chain("sample_annotation", instance["first_annotation_token"])) == instance["nbr_annotations"] == 4
    whole = tmp_path / "whole"
    export(drives.root, "nuscenes", output=whole)
    tokens = Tables(whole / "nuscenes").by_token["sample_annotation"]
    assert all(row["token"] in tokens for row in tables.rows["sample_annotation"])
    verify = plugins.load(FormatSpec, "nuscenes").verify
    chosen = Dataset(drives.root, Choice(frames=((20, 30),)))
    assert list(verify(chosen, tmp_path / "nuscenes", range(len(chosen)), FORMAT.options())) == []


def passing(**changes):
    """Pictures of one camera that an object leaves, or that shows none."""
    from worlds import videos

    said = {"rig": None, "channels": ["rgb"], "annotations": [], "tracks": None, "time": {"frames": 3, "fps": 10}}
    return videos(**{**said, "formats": [{"nuscenes": {"version": "v1.0-own"}}], **changes})


@pytest.mark.slow
def test_a_version_of_its_own_and_hostile_names(tmp_path):
    from worlds import MODELS

    models = [{**MODELS[0], "count": 1, "category": 'a "b" ö\''}, {**MODELS[1], "category": "CAR"}]
    generate(passing(models=models), tmp_path)
    tables = Tables(tmp_path / "nuscenes", "v1.0-own")
    assert [row["name"] for row in tables.rows["category"]] == ['a "b" ö\'', "vehicle.car"]
    assert [row["channel"] for row in tables.rows["sensor"]] == ["CAM_FRONT"]
    with pytest.raises(UserError, match="version"):
        export(tmp_path, [{"nuscenes": {"version": "../up"}}], output=tmp_path / "no")


def test_refusals(stills, tmp_path):
    from worlds import MODELS

    with pytest.raises(UserError, match=r"nuscenes: expected sequences \(a recipe's time\); found still pictures"):
        export(stills.root, "nuscenes", output=tmp_path / "no")
    models = [{**MODELS[0], "count": 1, "category": "person"}, {**MODELS[1], "category": "pedestrian"}]
    told = "expected categories of different names in nuScenes; found person, pedestrian, all human.pedestrian.adult"
    with pytest.raises(UserError, match=f"nuscenes: {told}"):
        generate(passing(models=models), tmp_path / "no")
    sensors = {"a-b": {}, "a_b": {"position": [0.1, 0, 0]}}
    with pytest.raises(
        UserError, match="nuscenes: expected sensors of different names in nuScenes; found a-b, a_b, all CAM_A_B"
    ):
        generate(passing(rig={"sensors": sensors}), tmp_path / "no")


def test_a_lidar_without_points(tmp_path):
    lidar = {"rings": 4, "elevation": [-20, 0], "azimuth": [-30, 30], "azimuth_step": 5, "range": [0.5, 20]}
    for name in ("nuscenes", "kitti", "kitti_odometry"):
        sensors = {"left": {}, "top": {"channels": ["instances"], "lidar": lidar}}
        recipe = passing(rig={"sensors": sensors}, channels=["rgb", "instances"], formats=[name])
        with pytest.raises(UserError, match=f"{name}: expected channel lidar of every LiDAR; found none of top"):
            generate(recipe, tmp_path / "no")


@pytest.mark.slow
def test_objects_come_and_go(tmp_path):
    """What is there at some instants only has annotations then, and its instance begins and ends with them."""
    from worlds import MODELS

    motion = {"kind": "constant", "velocity": [0.3, 0.1, 0], "enter": 0.1, "leave": 0.3}
    models = [{**MODELS[0], "count": 1, "motion": motion}, MODELS[1]]
    generate(passing(models=models, time={"frames": 5, "fps": 10}, shot_frames=2), tmp_path)
    dataset, tables = Dataset(tmp_path), Tables(tmp_path / "nuscenes", "v1.0-own")
    assert {len(sample.objects) for sample in dataset} == {1, 2}
    for name in dataset.sequences:
        samples = tables.chain("sample", tables.scene_of(name)["first_sample_token"])
        there = {}
        for row, sample in zip(samples, dataset.sequence(name), strict=True):
            for o in sample.objects:
                there.setdefault(o.id, []).append(row["token"])
        found = {}
        for instance in tables.rows["instance"]:
            own = tables.chain("sample_annotation", instance["first_annotation_token"])
            assert len(own) == instance["nbr_annotations"] and own[-1]["token"] == instance["last_annotation_token"]
            found[instance["token"]] = [row["sample_token"] for row in own]
        assert all(tokens in found.values() for tokens in there.values())
    equal("nuscenes", "instances", len(tables.rows["instance"]), 2 * len(dataset.sequences))


def test_the_development_kit_reads_it(drives, written):
    pytest.importorskip("nuscenes.nuscenes")
    from nuscenes.nuscenes import NuScenes
    from nuscenes.utils.data_classes import LidarPointCloud
    from nuscenes.utils.geometry_utils import BoxVisibility, view_points

    kit = NuScenes("v1.0-mini", str(written("drives")), verbose=False)
    assert len(kit.scene) == 2 and len(kit.sample) == 10 and len(kit.sample_data) == 30
    kit.list_scenes()
    for name in drives.sequences:
        scene = next(scene for scene in kit.scene if scene["description"] == name)
        token, number = scene["first_sample_token"], 0
        while token:
            sample = kit.get("sample", token)
            for sensor, channel in (*CAMERAS.items(), ("top", "LIDAR_TOP")):
                own = drives.sequence(name, sensor)[number]
                path, boxes, k = kit.get_sample_data(sample["data"][channel], BoxVisibility.NONE)
                assert len(boxes) == len(own.objects)
                for box, o in zip(boxes, own.objects, strict=True):
                    found, camera = box.corners().T, o.box3d_camera[list(OURS)]
                    if sensor == "top":
                        lidar = camera @ np.array([[0, -1, 0], [0, 0, -1], [1, 0, 0]])
                        close("nuscenes", "nuscenes-devkit: boxes, LiDAR's axes", found, lidar, "m", atol=1e-9)
                        points = LidarPointCloud.from_file(path).points
                        expected = np.column_stack([own.lidar["xyz"], own.lidar["intensity"]]).T
                        equal("nuscenes", "nuscenes-devkit: LiDAR points", points, expected)
                        continue
                    close("nuscenes", "nuscenes-devkit: boxes, camera's axes", found, camera, "m", atol=1e-9)
                    pixels = view_points(box.corners(), k, normalize=True)[:2].T + 0.5
                    close("nuscenes", "nuscenes-devkit: vertices", pixels, o.box3d_pixels[list(OURS)], "px", atol=1e-6)
            for annotation, o in zip(sample["anns"], drives.sequence(name, "left")[number].objects, strict=True):
                record = kit.get("sample_annotation", annotation)
                assert record["prev"] or not number
                if 0 < number < 4:
                    velocity = kit.box_velocity(annotation)
                    close("nuscenes", "nuscenes-devkit: velocities", velocity, o.velocity, "m/s", atol=1e-5)
            token, number = sample["next"], number + 1
        assert number == 5
