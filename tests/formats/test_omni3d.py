"""Omni3D, read by pycocotools, as Cube R-CNN does, and by our own reader: boxes that say in each of their forms the same."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image
from pycocotools.coco import COCO

from proven import close, equal
from viewsphere import Dataset, generate
from viewsphere.errors import UserError
from viewsphere.geometry.box3d import Box3d
from viewsphere.run.exports.exporting import export
from worlds import poses as recipe

NAMED = {"back": (0, 3, 4, 7), "front": (1, 2, 5, 6), "top": (0, 1, 4, 5), "bottom": (2, 3, 6, 7), "right": (0, 1, 2, 3),
         "left": (4, 5, 6, 7)}  # fmt: skip
"""Corners of Omni3D's boxes on each side, as the object itself has them."""
SIGNS = {"back": (1, 1), "front": (1, -1), "top": (2, 1), "bottom": (2, -1), "right": (0, -1), "left": (0, 1)}
"""The axis of our objects along which a side lies, and where."""


@pytest.fixture(scope="module", params=["stills", "videos"])
def world(request, tmp_path_factory):
    dataset, out = request.getfixturevalue(request.param), tmp_path_factory.mktemp("omni3d")
    export(dataset.root, "omni3d", output=out)
    return dataset, out / "omni3d"


@pytest.fixture(scope="module")
def read(world):
    """The samples and objects of a data set, each with what the file has of it."""
    dataset, folder = world
    coco = {split: COCO(str(folder / "Omni3D" / f"viewsphere_{split}.json")) for split in dataset.splits}
    pairs = []
    for sample in dataset:
        image = coco[sample.split].imgs[sample.index + 1]
        anns = coco[sample.split].loadAnns(coco[sample.split].getAnnIds(imgIds=[image["id"]]))
        pairs += [(sample, image, o, one) for o, one in zip(sample.objects, anns, strict=True)]
    return pairs


def order():
    """Where each corner of Omni3D's boxes is among ours: on the same three sides."""
    found = []
    for corner in range(8):
        sides = dict(SIGNS[name] for name, corners in NAMED.items() if corner in corners)
        found.append(Box3d.layout()["signs"].index(tuple(sides[axis] for axis in range(3))))
    return found


def test_images(world):
    dataset, folder = world
    for split in dataset.splits:
        told = json.loads((folder / "Omni3D" / f"viewsphere_{split}.json").read_text())
        assert told["info"]["split"] == split
        assert [(c["id"], c["name"]) for c in told["categories"]] == [(c.id, c.name) for c in dataset.categories]
        own = [sample for sample in dataset if sample.split == split]
        for image, sample in zip(told["images"], own, strict=True):
            assert (image["id"], image["width"], image["height"]) == (sample.index + 1, sample.width, sample.height)
            equal("omni3d", "own reader: K", image["K"], sample.camera.K)
            with Image.open(folder / image["file_path"]) as opened:
                equal("omni3d", "own reader: pictures", np.asarray(opened), sample.rgb)
        assert len({one["id"] for one in told["annotations"]}) == sum(len(sample.objects) for sample in own)


def test_corners(read):
    assert len(read) > 20
    for _, _, o, one in read:
        close("omni3d", "pycocotools: corners", one["bbox3D_cam"], o.box3d_camera[order()], "m", atol=1e-9)
        assert one["valid3D"] and not one["behind_camera"]


def test_center_dimensions_and_rotation_say_the_same(read):
    """By the documented cuboid: x along length, y down along height, z along width, in the documented order."""
    x = np.array([-1, 1, 1, -1, -1, 1, 1, -1]) / 2
    y = np.array([-1, -1, 1, 1, -1, -1, 1, 1]) / 2
    z = np.array([-1, -1, -1, -1, 1, 1, 1, 1]) / 2
    for _, _, o, one in read:
        width, height, length = one["dimensions"]
        equal("omni3d", "pycocotools: dimensions", (width, height, length), o.size)
        rotation = np.array(one["R_cam"])
        close("omni3d", "own reader: rotations", rotation @ rotation.T, np.eye(3), atol=1e-9)
        assert np.linalg.det(rotation) > 0
        corners = rotation @ [x * length, y * height, z * width] + np.array(one["center_cam"])[:, None]
        close("omni3d", "own cuboid: corners", corners.T, one["bbox3D_cam"], "m", atol=1e-9)
        close("omni3d", "own reader: front", rotation[:, 0], -o.camera_from_object[:3, 1], atol=1e-9)
        close("omni3d", "own reader: down", rotation[:, 1], -o.camera_from_object[:3, 2], atol=1e-9)


def test_projected_by_k_corners_are_where_boxes_are(read):
    for sample, image, o, one in read:
        seen = np.array(one["bbox3D_cam"]) @ np.transpose(image["K"])
        pixels = seen[:, :2] / seen[:, 2:]
        close("omni3d", "own projection: corners", pixels, o.box3d_pixels[order()], "px", atol=1e-6)
        low, high = pixels.min(axis=0), pixels.max(axis=0)
        close("omni3d", "own projection: boxes", one["bbox2D_proj"], [*low, *high], "px", atol=1e-9)
        size = [sample.width, sample.height]
        inside = [*np.clip(low, 0, size), *np.clip(high, 0, size)]
        assert inside[0] < inside[2] and inside[1] < inside[3]
        close("omni3d", "own projection: clipped boxes", one["bbox2D_trunc"], inside, "px", atol=1e-9)
        around = o.box2d_unclipped
        assert low[0] <= around[0] + 1e-6 and around[2] <= high[0] + 1e-6  # a model lies in its box


def test_what_is_seen(read):
    for _, image, o, one in read:
        assert (one["image_id"], one["category_id"], one["category_name"]) == (image["id"], o.category_id, o.category)
        assert (one["track_id"], one["segmentation_pts"], one["lidar_pts"], one["depth_error"]) == (o.id, o.area, -1, -1)
        equal("omni3d", "pycocotools: boxes", one["bbox2D_tight"], o.box2d or [-1] * 4)
        equal("omni3d", "pycocotools: visibility", (one["visibility"], one["truncation"]), (o.visibility, o.truncation))


def test_hostile_names_and_objects_behind_the_camera(tmp_path):
    name = 'é "x" /\n'
    said = recipe(
        rig={"sensors": {"ahead": {}, "behind": {"rotation": [0, 180, 0]}, "beside": {"position": [2, 0, 2.5]}}},
        models=[{"source": "zoo:post_box", "category": name, "scale": {"length": 0.5}}],
        viewpoints={"azimuth": [0], "elevation": [20], "distance": 2.5},
        scene={}, channels=["rgb", "instances"], annotations=[], splits={},
    )  # fmt: skip
    generate(said, tmp_path / "out")
    data = Dataset(tmp_path / "out")
    export(data.root, "omni3d", output=tmp_path)
    (file,) = (tmp_path / "omni3d" / "Omni3D").iterdir()
    told = json.loads(file.read_text())
    assert [c["name"] for c in told["categories"]] == [name]
    ahead, behind, beside = told["annotations"]
    assert not ahead["behind_camera"] and behind["behind_camera"] and beside["behind_camera"]
    assert behind["bbox2D_proj"] == beside["bbox2D_proj"] == behind["bbox2D_trunc"] == behind["bbox2D_tight"] == [-1] * 4
    assert behind["segmentation_pts"] == 0 and ahead["segmentation_pts"] > 0
    for one, sample in zip(told["annotations"], data, strict=True):
        assert one["category_name"] == name
        close("omni3d", "own reader: corners", one["bbox3D_cam"], sample.objects[0].box3d_camera[order()], "m", atol=1e-9)


def test_objects_whose_place_is_not_known(stills):
    from viewsphere.formats.omni3d import Omni3d

    sample = stills[0]
    nowhere = np.full((4, 4), np.nan)
    lost = replace(sample, objects=tuple(replace(o, world_from_object=nowhere, visibility=np.nan) for o in sample.objects))
    _, _, *pieces = Omni3d(stills).sample_files(lost)
    for piece, o in zip(pieces, sample.objects, strict=True):
        one = json.loads(piece.data)
        assert not one["valid3D"] and one["visibility"] == -1 and one["bbox2D_tight"] == list(o.box2d)
        assert np.shape(one["bbox3D_cam"]) == (8, 3) and np.shape(one["R_cam"]) == (3, 3)
        assert one["center_cam"] == one["dimensions"] == [-1] * 3


def test_what_it_refuses(tmp_path):
    lens = {"model": "fisheye", "coefficients": [0.1, 0, 0, 0]}
    said = recipe(
        models=[{"source": "zoo:post_box"}], viewpoints={"azimuth": [0], "elevation": [20], "distance": 2.5},
        camera={"size": [32, 24], "fov_deg": 50, "distortion": lens}, channels=["rgb"], annotations=[], splits={},
    )  # fmt: skip
    generate(said, tmp_path / "out")
    with pytest.raises(UserError, match="format omni3d: expected pinhole cameras; found the lens of camera"):
        export(tmp_path / "out", "omni3d", output=tmp_path)
    assert not (tmp_path / "omni3d").exists()
