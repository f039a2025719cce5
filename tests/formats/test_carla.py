"""CARLA's files, read by OpenCV and as its documentation says: the same depth, tags, instances, cameras and boxes."""

from __future__ import annotations

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest

from proven import close, equal
from viewsphere.formats.carla import FORMAT, TAGS, Carla, transform
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.sensors.rig import Rig
from viewsphere.run.exports.exporting import export
from viewsphere.run.exports.scope import scope_of

NAMED = {"sky": 11, "ground": 25, "car": 14, "chair": 21, "post_box": 21}
FLIP = np.diag([1, -1, 1])


@pytest.fixture(scope="module", params=["stills", "videos"])
def both(request, tmp_path_factory):
    dataset = request.getfixturevalue(request.param)
    place = tmp_path_factory.mktemp("carla")
    export(dataset.root, "carla", output=place)
    return dataset, place / "carla"


def matrix(told):
    """As carla.Transform.get_matrix: from an actor's axes (x ahead, y right, z up) to the world's."""
    p, y, r = np.radians([told["rotation"][name] for name in ("pitch", "yaw", "roll")])
    cp, sp, cy, sy, cr, sr = np.cos(p), np.sin(p), np.cos(y), np.sin(y), np.cos(r), np.sin(r)
    axes = [
        [cp * cy, cy * sp * sr - sy * cr, -cy * sp * cr - sy * sr],
        [cp * sy, sy * sp * sr + cy * cr, -sy * sp * cr + cy * sr],
        [sp, -cp * sr, cp * cr],
    ]
    return np.array(axes), np.array([told["location"][name] for name in "xyz"])


def rgb(file):
    return cv2.imread(str(file), cv2.IMREAD_UNCHANGED)[..., ::-1]


def test_maps(both):
    dataset, folder = both
    tags = {c.id: NAMED.get(c.name, 0) for c in dataset.classes}
    for sample in dataset:
        root, name = folder / (sample.sequence or sample.split) / sample.sensor, f"{sample.index:08d}.png"
        name = f"{sample.instant:06d}.png" if sample.sequence else name
        equal("carla", "OpenCV: pictures", rgb(root / "rgb" / name), sample.rgb)
        r, g, b = np.moveaxis(rgb(root / "depth" / name).astype(float), 2, 0)
        found = 1000 * (r + 256 * g + 65536 * b) / (256**3 - 1)
        close("carla", "OpenCV: depth", found, np.minimum(sample.depth, 1000), "m", atol=3.1e-5)
        expected = np.vectorize(tags.get)(sample.semantic)
        for kind in ("semantic", "instance"):
            r, g, b = np.moveaxis(rgb(root / f"{kind}_segmentation" / name).astype(int), 2, 0)
            equal("carla", "OpenCV: tags", r, expected)
            equal("carla", "OpenCV: instances", g + 256 * b, sample.instances if kind == "instance" else 0 * g)


def test_cameras_and_boxes(both):
    dataset, folder = both
    told = {
        file.parent: {one["frame"]: one for one in json.loads(file.read_text())} for file in folder.rglob("transforms.json")
    }
    for sample in dataset:
        root = folder / (sample.sequence or sample.split) / sample.sensor
        frame = sample.instant if sample.sequence else sample.index
        camera = told[root][frame]
        assert camera["timestamp"] == sample.time
        w, h, axes = camera["image_size_x"], camera["image_size_y"], matrix(camera["transform"])
        focal = w / (2 * np.tan(np.radians(camera["fov"]) / 2))
        k = np.array([[focal, 0, w / 2], [0, focal, h / 2], [0, 0, 1]])
        close("carla", "intrinsics", k, sample.camera.K, "px", atol=1e-9)
        boxes = json.loads((root / f"bounding_boxes/{frame:0{6 if sample.sequence else 8}d}.json").read_text())
        assert [one["id"] for one in boxes] == [o.id for o in sample.objects]
        for one, o in zip(boxes, sample.objects, strict=True):
            assert (one["type_id"], one["semantic_tag"]) == (o.category, NAMED[o.category])
            turn, place = matrix(one["transform"])
            x, y, z = (one["extent"][name] for name in "xyz")
            low = [[x, -y, -z], [-x, -y, -z], [x, y, -z], [-x, y, -z]]
            ends = np.array([*low, *([a, b, -c] for a, b, c in low)]) @ turn.T + place
            close("carla", "boxes, sorted", np.sort(ends @ FLIP, axis=0), np.sort(o.box3d, axis=0), "m", atol=1e-6)
            front = np.mean(o.box3d[[1, 5, 6, 2]], axis=0)
            close("carla", "fronts of boxes", (turn @ [x, 0, 0] + place) @ FLIP, front, "m", atol=1e-6)
            seen = (ends - axes[1]) @ axes[0]  # x ahead, y right, z up of the camera: (y, -z, x) are those of pictures
            ours = np.stack([seen[:, 1], -seen[:, 2], seen[:, 0]], axis=1)
            close("carla", "boxes before the camera, sorted", np.sort(ours, 0), np.sort(o.box3d_camera, 0), "m", atol=1e-6)


@pytest.mark.parametrize("sign", [1, -1])
def test_what_looks_straight_down_or_up(sign):
    ahead, right = np.array([0.0, 0, -sign]), np.array([np.cos(0.3), np.sin(0.3), 0])
    up = np.cross(right, ahead)
    found, _ = matrix(transform(np.zeros(3), ahead, right, up))
    np.testing.assert_allclose(FLIP @ found, np.stack([ahead, right, up], axis=1), atol=1e-9)


def test_all_tags():
    assert len(TAGS) == 29 and TAGS[28] == "GuardRail" and TAGS[22] == "Other"


def test_nothing_but_sky(stills):
    empty = {"depth": np.full((2, 2), np.inf, np.float32), "semantic": np.ones((2, 2), np.int32)}
    empty |= {"instances": np.zeros((2, 2), np.int32), "rgb": np.zeros((2, 2, 3), np.uint8)}
    files = list(Carla(stills).sample_files(replace(stills[0], objects=(), channels=empty, files={})))
    decoded = {one.path.split("/")[2]: one.content for one in files[:-1]}
    assert decoded["bounding_boxes"] == b"[]\n"
    depth = cv2.imdecode(np.frombuffer(decoded["depth"].make(), np.uint8), cv2.IMREAD_UNCHANGED)
    assert (depth == 255).all()


def test_what_it_refuses(stills):
    scope = scope_of(stills)
    assert list(FORMAT.refuses(scope)) == []
    lens = Intrinsics(width=4, height=4, fx=1, fy=1, cx=2.5, cy=2)
    told = "expected square pixels and a principal point in the picture's middle; found others of camera"
    assert list(FORMAT.refuses(replace(scope, rig=Rig.single(lens)))) == [told]
    assert list(FORMAT.refuses(replace(scope, most_objects=70000))) == [
        "expected at most 65,535 objects in a picture; found 70,000"
    ]
