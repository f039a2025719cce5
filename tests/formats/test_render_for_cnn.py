"""Render for CNN, read as its tools do: angles from names, their renderer's camera, and lists of labels."""

from __future__ import annotations

import hashlib
import re

import cv2
import numpy as np
import pytest

from proven import close, equal
from viewsphere import Dataset, generate
from viewsphere.errors import UserError
from viewsphere.run.exports.exporting import export
from worlds import MODELS
from worlds import poses as poses_recipe


@pytest.fixture(scope="module")
def written(stills, tmp_path_factory):
    place = tmp_path_factory.mktemp("render_for_cnn")
    export(stills.root, "render_for_cnn", output=place)
    return place / "render_for_cnn"


def path2label(path):
    """As view_estimation/data_prep_helper.py does it."""
    parts = path.rpartition("/")[2].split("_")
    return tuple(int(part[1:]) % 360 for part in parts[2:5])


def rendered(azimuth, elevation, tilt, distance):
    """The camera of render_pipeline/render_model_views.py, camera to world (Blender's axes): place and rotation."""
    phi, theta = np.radians([elevation, azimuth])
    place = distance * np.array([np.cos(theta) * np.cos(phi), np.sin(theta) * np.cos(phi), np.sin(phi)])
    x, y, z = place / np.linalg.norm(place)
    flat = np.hypot(x, y)
    yaw = 2 * np.pi - np.arccos(y / flat) if x > 0 else np.arccos(y / flat)
    roll = np.arccos(np.clip((x * x + y * y) / flat, -1, 1)) * (-1 if z < 0 else 1)
    turned = np.array([
        np.cos(yaw / 2) * np.cos(roll / 2), np.cos(yaw / 2) * np.sin(roll / 2),
        np.sin(yaw / 2) * np.sin(roll / 2), np.sin(yaw / 2) * np.cos(roll / 2),
    ])  # fmt: skip
    looking = product(turned, np.array([0, 0, np.sqrt(0.5), np.sqrt(0.5)]))
    half = np.radians(tilt) / 2
    rolled = np.array([np.cos(half), *(np.array([x, y, z]) * np.sin(half))])
    return place, rotation(product(rolled, looking))


def product(one, other):
    (a, *v), (b, *w) = one, other
    return np.array([a * b - np.dot(v, w), *(a * np.array(w) + b * np.array(v) + np.cross(v, w))])


def rotation(quaternion):
    w, x, y, z = quaternion
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


def rows(folder, pattern):
    return [row.split() for file in sorted(folder.glob(pattern)) for row in file.read_text().splitlines()]


def seen_in(dataset):
    return {f"{sample.index:08}_{o.id}": (sample, o) for sample in dataset for o in sample.objects if o.box2d}


def test_names_and_lists_tell_the_views(stills, written):
    classes = [row.split() for row in (written / "synsets.txt").read_text().splitlines()]
    assert classes == [["02958343", "car"], ["03001627", "chair"], ["post-box", "post_box"]]
    models = dict(row.split(maxsplit=1) for row in (written / "models.txt").read_text().splitlines())
    assert models == {hashlib.md5(info.key.encode()).hexdigest(): info.key for info in stills.models}
    seen, files = seen_in(stills), {str(file.relative_to(written)) for file in written.rglob("*.jpg")}
    assert len(files) == len(seen)
    for split in stills.splits:
        listed = rows(written, f"syn_lmdbs/all_{split}.txt")
        assert sorted(listed) == sorted(
            row for _, name in classes for row in rows(written, f"syn_lmdbs/{name.replace('_', '-')}_{split}.txt")
        )
        for path, number, *angles in listed:
            sample, o = seen[re.fullmatch(r".*_d\d{3}_(\d{8}_\d+)\.jpg", path)[1]]
            files.remove(path)
            assert sample.split == split and classes[int(number)][1] == o.category and models[path.split("/")[2]] == o.key
            equal("render_for_cnn", "path2label: whole degrees", path2label(path), list(map(int, angles)))
            off = np.subtract(path2label(path), (o.view.azimuth_deg, o.view.elevation_deg, o.view.tilt_deg))
            close("render_for_cnn", "path2label: angles", (off + 180) % 360 - 180, 0, "deg", atol=0.5)
    assert not files


def test_pictures_are_the_objects_boxes(stills, written):
    seen = seen_in(stills)
    for file in written.rglob("*.jpg"):
        sample, o = seen["_".join(file.stem.split("_")[-2:])]
        x0, y0, x1, y1 = map(int, o.box2d)
        found = cv2.imread(str(file))[..., ::-1].astype(float)
        assert found.shape == (y1 - y0, x1 - x0, 3) and np.abs(found - sample.rgb[y0:y1, x0:x1]).mean() < 8


@pytest.mark.slow
def test_its_renderer_would_see_the_same(tmp_path):
    """Its models look along x where ours look along -y."""
    recipe = poses_recipe(
        models=[{**MODELS[0], "count": 1}],
        viewpoints={"azimuth": [10, 200, 300], "elevation": [-25, 40], "tilt": [0, 30, -75], "distance": 3},
        scene={"ground": False},
    )
    generate(recipe, tmp_path / "out", workers=0)
    export(tmp_path / "out", "render_for_cnn", output=tmp_path)
    views = rows(tmp_path / "render_for_cnn", "view_distribution/car.txt")
    assert len(views) == 18 and len(list((tmp_path / "render_for_cnn").rglob("*_e-25_*.jpg"))) == 9
    for sample, view in zip(Dataset(tmp_path / "out"), views, strict=True):
        place, turned = rendered(*map(float, view))
        ours = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
        (o,) = sample.objects
        found = np.diag([1, -1, -1]) @ turned.T @ ours
        close("render_for_cnn", "render_model_views: rotation", found, o.camera_from_object[:3, :3], atol=1e-7)
        center = o.camera_from_object[:3, :3] @ o.box3d_object.mean(axis=0) + o.camera_from_object[:3, 3]
        close("render_for_cnn", "render_model_views: place", np.diag([1, -1, -1]) @ turned.T @ -place, center, "m", atol=1e-7)


def test_truncations(stills, written):
    for category in ("car", "chair", "post_box"):
        found = np.array(rows(written, f"truncation_distribution/{category.replace('_', '-')}.txt"), float)
        boxes = [
            (o.box2d, o.box2d_unclipped)
            for sample in stills
            for o in sample.objects
            if o.box2d and o.box2d_unclipped and o.category == category
        ]
        seen, whole = np.array(boxes).transpose(1, 0, 2)
        size = whole[:, 2:] - whole[:, :2]
        close("render_for_cnn", "truncations", found * np.hstack([size, size]) + whole, seen, "px", atol=1e-9)


def test_a_picture_without_objects_has_none(tmp_path):
    viewpoints = {"azimuth": [0], "elevation": [20], "distance": 2.5, "target": [0, 0, 9]}
    model = {**MODELS[2], "count": 1, "category": 'd\'été "à" l/x'}
    generate(poses_recipe(models=[model], viewpoints=viewpoints), tmp_path / "out", workers=0)
    export(tmp_path / "out", "render_for_cnn", output=tmp_path)
    assert (tmp_path / "render_for_cnn/synsets.txt").read_text("utf-8") == 'd--t------l-x d\'été "à" l/x\n'
    assert not list((tmp_path / "render_for_cnn").rglob("*.jpg"))


def test_names_that_meet_are_refused(tmp_path):
    models = [{**MODELS[2], "count": 1, "category": name, "name": f"m{i}"} for i, name in enumerate(("a b", "a_b"))]
    with pytest.raises(UserError, match=r"format render_for_cnn: expected names .* letters and digits; found 'a b', 'a_b'"):
        generate(poses_recipe(models=models, formats=["render_for_cnn"]), tmp_path / "out", workers=0)
