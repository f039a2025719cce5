"""FiftyOne's data set, read by FiftyOne where it is installed, and as JSON: the same boxes, masks, points, maps."""

from __future__ import annotations

import json

import numpy as np
import pytest
from PIL import Image

from proven import close, equal
from quick import quick
from viewsphere import Dataset, generate
from viewsphere.run.exports.exporting import export
from worlds import MODELS
from worlds import poses as poses_recipe


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    made = {}

    def get(dataset):
        if dataset.name not in made:
            place = tmp_path_factory.mktemp(f"fiftyone-{dataset.name}")
            export(dataset.root, "fiftyone", output=place)
            made[dataset.name] = place / "fiftyone"
        return made[dataset.name]

    return get


def turned(x, y, z):
    """Rx Ry Rz."""
    (cx, cy, cz), (sx, sy, sz) = np.cos([x, y, z]), np.sin([x, y, z])
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return about_x @ about_y @ about_z


def compare(by, sample, detections, points, labels):
    """Objects as (label, box, index, mask, location, dimensions, rotation), points as (index, points, occluded)."""
    seen = [o for o in sample.objects if o.box2d]
    size = np.array([sample.width, sample.height] * 2)
    for (label, box, index, mask, location, dimensions, rotation), o in zip(detections, seen, strict=True):
        assert (label, index) == (o.category, o.id)
        x, y, w, h = box * size
        close("fiftyone", f"{by}: boxes", [x, y, x + w, y + h], o.box2d, "px", atol=1e-9)
        x0, y0, x1, y1 = map(int, o.box2d)
        whole = np.zeros((sample.height, sample.width), bool)
        whole[y0:y1, x0:x1] = mask
        equal("fiftyone", f"{by}: masks", whole, o.mask)
        corners = np.array([[a, b, c] for c in (-1, 1) for a, b in ((1, 1), (1, -1), (-1, -1), (-1, 1))]) / 2 * dimensions
        found = corners @ turned(*rotation).T + location
        close("fiftyone", f"{by}: 3D boxes", found, o.box3d, "m", atol=1e-6)
    marked = {index: (places, occluded) for index, places, occluded in points}
    for o in seen:
        for name, place, state in zip(o.keypoint_names, o.keypoints, o.keypoint_states, strict=True):
            places, occluded = marked[o.id]
            found = places[labels.index(name)] * [sample.width, sample.height]
            if int(state) < 2:
                close("fiftyone", f"{by}: points", found, place, "px", atol=1e-9)
            else:
                assert np.isnan(found).all()
            assert bool(occluded[labels.index(name)]) == (int(state) == 1)


@pytest.mark.parametrize("world", quick(["stills", "videos"], "stills"))
def test_entries_say_what_the_data_set_says(world, written, request):
    dataset = request.getfixturevalue(world)
    folder = written(dataset)
    info = json.loads((folder / "metadata.json").read_text("utf-8"))["info"]
    samples = json.loads((folder / "samples.json").read_text("utf-8"))["samples"]
    assert info["default_classes"] == [category.name for category in dataset.categories]
    assert info["mask_targets"]["segmentation"]["32"] == "car"
    for entry, sample in zip(samples, dataset, strict=True):
        assert entry["tags"] == [sample.split] and (entry["sequence"], entry["sensor"]) == (sample.sequence, sample.sensor)
        assert Image.open(folder / entry["filepath"]).size == (sample.width, sample.height)
        equal("fiftyone", "Pillow: classes", np.array(Image.open(folder / entry["segmentation"]["mask_path"])), sample.semantic)
        depth = np.array(Image.open(folder / entry["depth"]["map_path"])) / 1000
        hit = np.isfinite(sample.depth) & (sample.depth < 65.5)
        close("fiftyone", "Pillow: depth", depth[hit], sample.depth[hit], "m", atol=5.1e-4)
        assert not depth[~np.isfinite(sample.depth)].any()
        found = [
            (d["label"], np.array(d["bounding_box"]), d["index"], np.array(Image.open(folder / d["mask_path"])) > 0,
             d["location"], d["dimensions"], d["rotation"])
            for d in entry["ground_truth"]["detections"]
        ]  # fmt: skip
        points = [(p["index"], np.array(p["points"]), p["occluded"]) for p in entry["keypoints"]["keypoints"]]
        compare("json", sample, found, points, info["default_skeleton"]["labels"])
        motion = np.array(entry["world_from_camera"])
        close("fiftyone", "json: cameras", motion[:3, :3].T @ -motion[:3, 3], sample.camera.t, "m", atol=1e-9)
        equal("fiftyone", "json: K", entry["K"], sample.camera.K)


def test_angles_of_all_rotations():
    from viewsphere.formats.fiftyone import _angles
    from viewsphere.geometry.rotation import random_rotation

    rng = np.random.default_rng(5)
    quarter = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    for turn in [*(random_rotation(rng) for _ in range(50)), np.eye(3), quarter, quarter.T, quarter @ turned(0.3, 0, 0)]:
        close("fiftyone", "closed form: angles", turned(*_angles(turn)), turn, atol=1e-9)


def empty(place):
    viewpoints = {"azimuth": [0], "elevation": [20], "distance": 2.5, "target": [0, 0, 9]}
    model = {**MODELS[2], "count": 1, "category": 'd\'été "à" l/x'}
    generate(poses_recipe(name="empty", models=[model], viewpoints=viewpoints), place, workers=0)
    export(place, "fiftyone", output=place)
    return Dataset(place), place / "fiftyone"


def test_a_picture_without_objects(tmp_path):
    _, folder = empty(tmp_path)
    (entry,) = json.loads((folder / "samples.json").read_text("utf-8"))["samples"]
    assert entry["ground_truth"]["detections"] == [] and "keypoints" not in entry
    info = json.loads((folder / "metadata.json").read_text("utf-8"))["info"]
    assert info["default_classes"] == ['d\'été "à" l/x'] and not (folder / "fields/ground_truth.detections").exists()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("world", ["stills", "videos"])
def test_fiftyone_loads_it(world, written, request, tmp_path):
    fiftyone = pytest.importorskip("fiftyone")
    dataset = request.getfixturevalue(world)
    read = fiftyone.Dataset.from_dir(dataset_dir=str(written(dataset)), dataset_type=fiftyone.types.FiftyOneDataset)
    labels = read.default_skeleton.labels
    assert (
        read.default_classes == [category.name for category in dataset.categories]
        and read.mask_targets["segmentation"][32] == "car"
    )
    by_path = {one.filepath.rpartition("/")[2]: one for one in read}
    assert len(by_path) == len(dataset)
    for sample in dataset:
        one = by_path[f"{sample.index:08d}.png"]
        assert one.tags == [sample.split] and (one.sequence, one.instant) == (sample.sequence, sample.instant)
        equal("fiftyone", "FiftyOne: K", one.K, sample.camera.K)
        equal("fiftyone", "FiftyOne: classes", one.segmentation.get_mask(), sample.semantic)
        depth = one.depth.get_map() / 1000
        hit = np.isfinite(sample.depth) & (sample.depth < 65.5)
        close("fiftyone", "FiftyOne: depth", depth[hit], sample.depth[hit], "m", atol=5.1e-4)
        found = [
            (d.label, np.array(d.bounding_box), d.index, d.get_mask() > 0, d.location, d.dimensions, d.rotation)
            for d in one.ground_truth.detections
        ]
        points = [(p.index, np.array(p.points, float), p.occluded) for p in one.keypoints.keypoints]
        compare("FiftyOne", sample, found, points, labels)
    _, folder = empty(tmp_path)
    (one,) = fiftyone.Dataset.from_dir(dataset_dir=str(folder), dataset_type=fiftyone.types.FiftyOneDataset)
    assert one.ground_truth.detections == []
    read.delete()
