"""Falling Things and NDDS, read by torchvision, where it is installed, and by a small reader of its own: points of models come
to their pixels by each of the poses that are said.
"""

from __future__ import annotations

import json
from dataclasses import replace
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from torchvision_readers import torchvision_datasets

from proven import close, equal
from quick import quick
from viewsphere.errors import UserError
from viewsphere.formats import falling_things
from viewsphere.formats.falling_things import FORMAT
from viewsphere.geometry.mask import decode_rle
from viewsphere.model.sensors.rig import Rig, Sensor
from viewsphere.run.exports.exporting import export

P = np.array([[0, 0, 1], [1, 0, 0], [0, -1, 0]])
SIGNS = [[1, -1, 1], [-1, -1, 1], [-1, 1, 1], [1, 1, 1], [1, -1, -1], [-1, -1, -1], [-1, 1, -1], [1, 1, -1]]
"""The readme's corners in the object's axes, x to its right, y down, z out of its front."""


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    made = {}

    def get(dataset, naming="fat"):
        if (dataset.name, naming) not in made:
            place = tmp_path_factory.mktemp(f"{dataset.name}-{naming}")
            export(dataset.root, [{"falling_things": {"naming": naming}}], output=place)
            made[dataset.name, naming] = place / "falling_things"
        return made[dataset.name, naming]

    return get


def stem(folder, sample, single=False, fat=True):
    """Folder and beginning of the names of a sample's files."""
    number = sample.instant if sample.sequence else sample.index
    own = "_".join([sample.split, *([sample.sequence] if sample.sequence else []), "0"])
    kind = [] if not fat else ["FallingThings", "single", sample.objects[0].key] if single else ["FallingThings", "mixed"]
    side = sample.sensor if sample.sequence else "left"
    return folder.joinpath(*kind, own), f"{number:06d}" + (f".{side}" if fat or sample.sequence else "")


def load(file):
    found = cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
    assert found is not None, file
    return found


def camera(folder, side="left"):
    settings = json.loads((folder / "_camera_settings.json").read_text())["camera_settings"]
    k = next(one for one in settings if one["name"] == side)["intrinsic_settings"]
    return np.array([[k["fx"], k["s"], k["cx"]], [0, k["fy"], k["cy"]], [0, 0, 1]])


def project(k, points):
    found = points @ k.T
    return found[..., :2] / found[..., 2:]


def check_object(found, classes, o, sample, k, matrix):
    """All that is said of an object."""
    rotation, location = Rotation.from_quat(found["quaternion_xyzw"]).as_matrix(), np.array(found["location"])
    permuted = np.array(found[matrix])
    assert np.linalg.det(permuted[:3, :3]) < 0
    close("falling_things", "own reader: permuted rotations", permuted[:3, :3].T @ P, rotation, atol=1e-12)
    close("falling_things", "own reader: permuted translations", permuted[3], [*location, 1], "cm", atol=1e-10)
    assert found["class"] == o.key and found["instance_id"] == o.id
    model = classes[o.key]
    y, x = np.nonzero(o.mask)
    fixed = np.array(model["fixed_model_transform"]).T
    points = (sample.coordinates[y, x] @ fixed[:3, :3].T + fixed[:3, 3]) @ rotation.T + location
    close("falling_things", "own reader: pixels", project(k, points), np.stack([x, y], 1) + 0.5, "px", atol=2e-3)
    close("falling_things", "own reader: depth of models", points[:, 2] / 100, sample.depth[y, x], "m", atol=1e-5)
    cuboid = np.array(SIGNS) * model["cuboid_dimensions"] / 2 @ rotation.T + location
    close("falling_things", "own reader: cuboids", found["cuboid"], cuboid, "cm", atol=1e-4)
    close("falling_things", "own reader: projected cuboids", found["projected_cuboid"], project(k, cuboid), "px", atol=1e-4)
    close("falling_things", "own reader: centres", found["cuboid_centroid"], cuboid.mean(axis=0), "cm", atol=1e-4)
    middle = project(k, cuboid.mean(axis=0))
    close("falling_things", "own reader: projected centres", found["projected_cuboid_centroid"], middle, "px", atol=1e-4)
    front = o.box3d_camera[[1, 2, 5, 6]].mean(axis=0) * 100  # our face at -y
    close("falling_things", "own reader: fronts", np.mean(found["cuboid"][:4], axis=0), front, "cm", atol=1e-10)
    (top, left), (bottom, right) = found["bounding_box"]["top_left"], found["bounding_box"]["bottom_right"]
    close("falling_things", "own reader: boxes", [left, top, right, bottom], o.box2d_unclipped, "px", atol=0)
    inside = decode_rle(o.amodal.height, o.amodal.width, o.amodal.counts).sum()
    close("falling_things", "own reader: visibility", found["visibility"], o.area / inside if inside else 0, atol=1e-12)


@pytest.mark.parametrize("naming", ["fat", "ndds"])
@pytest.mark.parametrize("world", quick(["stills", "poses", "videos"], "stills"))
def test_objects_cameras_depth_and_classes(written, world, naming, request):
    dataset, fat = request.getfixturevalue(world), naming == "fat"
    root, single = written(dataset, naming), world == "poses" and fat
    for sample in dataset:
        folder, name = stem(root, sample, single, fat)
        objects = json.loads((folder / "_object_settings.json").read_text())
        classes = {one["class"]: one for one in objects["exported_objects"]}
        assert objects["exported_object_classes"] == list(classes) and (not single or len(classes) == 1)
        k = camera(folder, sample.sensor if sample.sequence else "left")
        equal("falling_things", "own reader: K", k, sample.camera.K)
        said = json.loads((folder / f"{name}.json").read_text())
        matrix = "pose_transform_permuted" if fat else "pose_transform"
        for found, o in zip(said["objects"], sample.objects, strict=True):
            check_object(found, classes, o, sample, k, matrix)
        turn = Rotation.from_quat(said["camera_data"]["quaternion_xyzw_worldframe"]).as_matrix()
        close("falling_things", "own reader: cameras' axes", turn, sample.camera.R.T, atol=1e-9)
        place = np.array(said["camera_data"]["location_worldframe"]) / 100
        close("falling_things", "own reader: cameras' places", place, sample.camera.center, "m", atol=1e-12)
        unit, kind, seg = (1e-4, "depth.png", "seg.png") if fat else (1e-3, "depth.mm.16.png", "cs.png")
        steps, within = load(folder / f"{name}.{kind}"), sample.depth < 65534 * unit
        assert steps.dtype == np.uint16 and (steps[sample.depth > 65536 * unit] == 65535).all()
        metres, kept = steps[within] * unit, sample.depth[within]
        close("falling_things", f"own reader: depth, {naming}", metres, kept, "m", atol=unit * 0.51)
        wanted = np.zeros((sample.height, sample.width), int)
        for o in sample.objects:
            wanted[o.mask] = classes[o.key]["segmentation_class_id"]
            number = 255 if single else dataset.plan.models.index(o.key) + 1
            assert classes[o.key]["segmentation_class_id"] == number
        equal("falling_things", "own reader: classes", load(folder / f"{name}.{seg}"), wanted)
        if not fat:
            b, g, r = np.moveaxis(load(folder / f"{name}.is.png").astype(int), -1, 0)
            equal("falling_things", "own reader: instances", r * 65536 + g * 256 + b, sample.instances)
            equal("falling_things", "own reader: colours", load(folder / f"{name}.png")[..., ::-1], sample.rgb)


def test_ndds_of_one_object_has_classes_of_their_own(poses, written):
    folder, _ = stem(written(poses, "ndds"), poses[0], fat=False)
    objects = json.loads((folder / "_object_settings.json").read_text())["exported_objects"]
    assert [one["class"] for one in objects] == list(poses.plan.models)


def test_torchvision_reads_stereo(videos, written):
    found = torchvision_datasets().FallingThingsStereo(written(videos), variant="mixed")
    pairs = {}
    for sample in videos:
        folder, name = stem(written(videos), sample)
        pairs.setdefault(str(folder / name).rpartition(".")[0], {})[sample.sensor] = sample
    assert len(found) == len(pairs) == 12
    for (left, right), (depth, _), (image_left, image_right, disparity) in zip(
        found._images, found._disparities, found, strict=True
    ):
        own = pairs[left.rpartition(".left")[0]]
        assert right.rpartition(".right")[0] == left.rpartition(".left")[0] == depth.rpartition(".left")[0]
        assert np.abs(np.asarray(image_left, int) - own["left"].rgb).mean() < 3  # JPEG
        assert np.abs(np.asarray(image_right, int) - own["right"].rgb).mean() < 3
        near = own["left"].depth < 6.5
        disparities = 0.06 * own["left"].camera.K[0, 0] / own["left"].depth[near]
        close("falling_things", "torchvision: disparity", disparity[0][near], disparities, "px", atol=1e-3)
        both = near & (own["left"].disparity_state == 0)
        scaled = disparity[0][both] * 0.1 / 0.06  # videos' cameras are 10 cm apart
        close("falling_things", "torchvision: disparity of the rig", scaled, own["left"].disparity[both], "px", atol=2e-3)


def made(dataset, folder, sample, **options):
    falling_things.preparer(dataset, folder, FORMAT.options(**options))(sample)
    (said,) = [file for file in folder.rglob("*.json") if not file.name.startswith("_")]
    return json.loads(said.read_text())


def test_a_picture_of_nothing(stills, poses, tmp_path):
    said = made(stills, tmp_path / "mixed", replace(stills[0], objects=()))
    assert said["objects"] == []
    made(poses, tmp_path / "single", replace(poses[0], objects=()))
    assert (tmp_path / "single" / "FallingThings" / "single" / "none" / "train_0" / "000000.left.jpg").is_file()


def test_what_is_behind_the_camera_or_outside(stills, tmp_path):
    sample = stills[0]
    o = sample.objects[0]
    away = o.box3d_camera.copy()
    away[6, 2] = -1.0
    outside = replace(o, box3d_camera=away, visibility=0.0, truncation=1.0, box2d_unclipped=None, box2d_projected=(1, 2, 3, 4))
    unseen = replace(o, box2d_unclipped=None, box2d_projected=None)
    (said,) = made(stills, tmp_path, replace(sample, objects=(outside, unseen)))["objects"]
    assert said["projected_cuboid"][0] == [-1, -1] and said["projected_cuboid"][1] != [-1, -1]
    assert said["visibility"] == 0 and said["bounding_box"] == {"top_left": [2, 1], "bottom_right": [4, 3]}


def test_refusals(stills, drives):
    lens = stills[0].camera.intrinsics
    side = Sensor(name="side", intrinsics=lens, rig_from_sensor=[[0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 1]])
    rig = Rig(sensors=(Sensor(name="front", intrinsics=lens), side))
    (found,) = falling_things.FORMAT.refuses(SimpleNamespace(rig=rig, pictures=()), FORMAT.options())
    assert found == "expected one camera or a rectified pair; found front, side"
    assert list(falling_things.FORMAT.refuses(SimpleNamespace(rig=None, pictures=()), FORMAT.options())) == []
    with pytest.raises(UserError, match=r"falling_things: expected .*; found"):
        export(drives.root, "falling_things", output=drives.root.parent / "refused")
    many = SimpleNamespace(plan=SimpleNamespace(models=tuple(map(str, range(300)))))
    with pytest.raises(UserError, match=r"expected fewer than 255 models; found 300"):
        falling_things.FallingThings(many, FORMAT.options())
