"""NOCS, read as the loader of Wang et al. does it: masks, coordinates, classes and extents; and poses, by alignment."""

from __future__ import annotations

import pickle
from pathlib import Path

import cv2
import numpy as np
import pytest

from proven import close, equal
from viewsphere import Dataset, generate
from viewsphere.errors import UserError
from viewsphere.formats.nocs import FORMAT
from viewsphere.run.exports.exporting import export
from viewsphere.run.exports.scope import scope_of
from worlds import stills as recipe


@pytest.fixture(scope="module", params=["stills", "videos"])
def world(request, tmp_path_factory):
    dataset, out = request.getfixturevalue(request.param), tmp_path_factory.mktemp("nocs")
    export(dataset.root, "nocs", output=out)
    return dataset, out / "nocs"


def stem(sample):
    if sample.sequence:
        return f"{sample.split}/{sample.sequence}-{sample.sensor}/{sample.instant:04d}"
    return f"{sample.split}/scene_1/{sample.index:04d}"


def loaded(folder, sample):
    """What the documented loader makes of a picture of REAL275: by id, the class, the mask, the coordinates, the extents."""
    path = str(folder / "real" / stem(sample))
    mask = cv2.imread(path + "_mask.png")[:, :, 2]
    coord = cv2.imread(path + "_coord.png")[:, :, (2, 1, 0)].astype(np.float32) / 255
    coord[:, :, 2] = 1 - coord[:, :, 2]
    ids = sorted(np.unique(mask).tolist())
    assert ids.pop() == 255
    found, scales = {}, []
    lines = [line.split(" ") for line in Path(path + "_meta.txt").read_text().splitlines()]
    for _, _, model in lines:
        extents = np.loadtxt(folder / "obj_models" / f"real_{sample.split}" / f"{model}.txt")
        scales.append(extents / np.linalg.norm(extents))
    classes = {int(number): int(category) for number, category, _ in lines if category != "0"}
    for number in (number for number in ids if number in classes):
        own = mask == number
        found[number] = (classes[number], own, coord[own], scales[number - 1], lines[number - 1][2])
    return found


def poses(folder, sample):
    split, scene, number = stem(sample).split("/")
    return pickle.loads((folder / "gts" / f"real_{split}" / f"results_real_{split}_{scene}_{number}.pkl").read_bytes())


def turned(places):
    """Places in objects' own axes (front -y, up z) in those of NOCS: y up, z to the front."""
    return np.stack([places[..., 0], places[..., 2], -places[..., 1]], axis=-1)


def test_masks_coordinates_and_classes(world):
    dataset, folder = world
    for sample in dataset:
        found = loaded(folder, sample)
        assert set(found) == {o.id for o in sample.objects if o.area}
        for o in sample.objects:
            if o.area:
                category, mask, coord, extents, model = found[o.id]
                assert (category, model) == (o.category_id, o.key)
                equal("nocs", "own reader: masks", mask, o.mask)
                shares = turned(sample.nocs[mask] - 0.5) + 0.5
                close("nocs", "own reader: coordinates", coord, shares, "diagonals", atol=0.5 / 255 + 1e-6)
                close("nocs", "own reader: extents", extents * np.linalg.norm(o.size), o.size, "m", atol=1e-12)


def test_pictures_and_depth(world):
    dataset, folder = world
    for sample in dataset:
        path = str(folder / "real" / stem(sample))
        equal("nocs", "OpenCV: pictures", cv2.imread(path + "_color.png")[:, :, ::-1], sample.rgb)
        depth = cv2.imread(path + "_depth.png", -1)
        assert depth.dtype == np.uint16 and depth.ndim == 2
        seen = np.isfinite(sample.depth)
        equal("nocs", "OpenCV: where depth is", depth > 0, seen)
        close("nocs", "OpenCV: depth", depth[seen] / 1000, np.minimum(sample.depth[seen], 65.535), "m", atol=0.0005 + 1e-6)


def test_poses_take_coordinates_to_what_depth_shows(world):
    """Back-projected as NOCS does it, by whole pixels: no farther off than the steps of 8 and 16 bits."""
    dataset, folder = world
    for sample in dataset:
        told = poses(folder, sample)
        seen = [o for o in sample.objects if o.area]
        equal("nocs", "pickle: classes", told["gt_class_ids"], [o.category_id for o in seen])
        y0, x0, y1, x1 = told["gt_bboxes"].T
        equal("nocs", "pickle: boxes", np.stack([x0, y0, x1, y1], 1).reshape(-1, 4), [o.box2d for o in seen])
        depth = cv2.imread(str(folder / "real" / stem(sample)) + "_depth.png", -1) / 1000
        found = loaded(folder, sample)
        for o, pose, scale in zip(seen, told["gt_RTs"], told["gt_scales"], strict=True):
            _, mask, coord, extents, _ = found[o.id]
            diagonal = np.cbrt(np.linalg.det(pose[:3, :3]))
            close("nocs", "pickle: sizes", scale * diagonal, o.size, "m", atol=1e-9)
            close("nocs", "pickle: extents", scale, extents, atol=1e-12)
            rotation = pose[:3, :3] / diagonal
            close("nocs", "pickle: rotations", turned(rotation.T @ o.camera_from_object[:3, :3]), np.eye(3), atol=1e-9)
            y, x = np.nonzero(mask)
            rays = np.linalg.solve(told["intrinsics"], np.stack([x, y, np.ones_like(x)]))
            points = (coord.astype(float) - 0.5) @ pose[:3, :3].T + pose[:3, 3]
            step = diagonal * 0.5 / 255 * np.sqrt(3) + 0.001 * np.linalg.norm(rays, axis=0).max()
            close("nocs", "own alignment: points", points, (rays * depth[y, x]).T, "m", atol=step)


@pytest.mark.slow
def test_meshes_fill_their_extents(world):
    dataset, folder = world
    for info in dataset.models:
        for split in dataset.splits:
            text = (folder / "obj_models" / f"real_{split}" / f"{info.key}.obj").read_text().splitlines()
            corners = np.array([line.split()[1:] for line in text if line[0] == "v"], float)
            faces = np.array([line.split()[1:] for line in text if line[0] == "f"], int) - 1
            used = corners[np.unique(faces)]
            close("nocs", "own reader: meshes", np.ptp(used, axis=0), info.size, "m", atol=1e-5)
            close("nocs", "own reader: meshes", used.min(axis=0) + used.max(axis=0), 0, "m", atol=1e-5)
            assert len(faces) == info.triangles


def test_any_numpy_reads_the_poses(world):
    dataset, folder = world
    split, scene, number = stem(dataset[0]).split("/")
    data = (folder / "gts" / f"real_{split}" / f"results_real_{split}_{scene}_{number}.pkl").read_bytes()
    assert b"_core" not in data and b"numpy" in data
    assert {name: (value.dtype.kind, value.shape[1:]) for name, value in poses(folder, dataset[0]).items()} == {
        "gt_class_ids": ("i", ()),
        "gt_bboxes": ("i", (4,)),
        "gt_RTs": ("f", (4, 4)),
        "gt_scales": ("f", (3,)),
        "handle_visibility": ("i", ()),
        "intrinsics": ("f", (3,)),
    }


@pytest.fixture(scope="module")
def odd(tmp_path_factory):
    """A category of a hostile name, pictures of nothing, and annotations of what is hidden for the most part left out."""
    out = tmp_path_factory.mktemp("odd") / "out"
    said = recipe(
        rig={"sensors": {"ahead": {}, "behind": {"rotation": [0, 180, 0]}}},
        models=[{"source": "zoo:post_box", "category": 'é "x" /\n0', "count": 2}],
        scenes={"count": 3, "objects": 2, "layout": "scatter"},
        keep_annotations_above=0.8, channels=["rgb", "instances"], annotations=[], splits={"by": "scene", "train": 1},
    )  # fmt: skip
    generate(said, out)
    return Dataset(out)


@pytest.mark.slow
def test_objects_without_annotations_are_distractors(odd, tmp_path):
    export(odd.root, "nocs", output=tmp_path)
    left_out = 0
    for sample in odd:
        found = loaded(tmp_path / "nocs", sample)
        kept = {o.id for o in sample.objects if o.visibility > 0.8}
        assert set(found) == kept
        assert all((found[o.id][4], found[o.id][0]) == (o.key, o.category_id) for o in sample.objects if o.id in kept)
        told = poses(tmp_path / "nocs", sample)
        assert len(told["gt_RTs"]) == len(kept) and told["gt_RTs"].shape[1:] == (4, 4)
        left_out += bool(kept) and len(kept) < len(sample.objects)
        assert not kept or sample.sensor == "ahead"
    assert left_out


def test_what_it_refuses(stills, tmp_path):
    from dataclasses import replace

    from viewsphere.formats.nocs import Nocs

    assert list(FORMAT.refuses(replace(scope_of(stills), most_objects=255))) == [
        "expected at most 254 objects in a picture; found 255"
    ]
    with pytest.raises(UserError, match="nocs: expected channel nocs; found none of frame 0"):
        list(Nocs(stills).sample_files(replace(stills[0], channels={"rgb": stills[0].rgb})))
