"""OpenCV's calibrations, read by cv2.FileStorage: cv2 projects, and lifts disparities, as the data set does."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from cube_dataset import FEW, LENS, make
from proven import close, equal
from small import small_recipe
from truth_scenes import LENSES
from viewsphere import Dataset, generate
from viewsphere.errors import UserError
from viewsphere.geometry.camera import project
from viewsphere.planning.rig_files import read_rig
from viewsphere.run.exports.exporting import export


def written(dataset, place):
    export(dataset.root, ["opencv"], output=place)
    return place / "opencv"


def loaded(file):
    found = cv2.FileStorage(str(file), cv2.FILE_STORAGE_READ)
    assert found.isOpened()

    def value(node):
        if node.isString():
            return node.string()
        return node.mat() if node.isMap() else int(node.real())

    return {name: value(found.getNode(name)) for name in found.root().keys()}  # noqa: SIM118, a FileNode is no mapping


def projected(points, found):
    see = cv2.fisheye.projectPoints if found["fisheye_model"] else cv2.projectPoints
    lens = found["distortion_coefficients"]
    return see(points[:, None], found["rvec"], found["tvec"], found["camera_matrix"], lens)[0][:, 0] + 0.5


FIVE = LENSES["barrel"]
FOUR = FIVE.model_copy(update={"coefficients": FIVE.coefficients[:4]})


@pytest.mark.parametrize("name", [*LENSES, "four"])
def test_cv2_projects_alike(name, tmp_path):
    lens = LENS.model_copy(update={"distortion": {**LENSES, "four": FOUR}[name], "cx": 47.25, "fy": 81.5})
    dataset = make(tmp_path / "out", several=True, intrinsics=lens, channels=FEW)
    folder = written(dataset, tmp_path / "made")
    for sample in dataset:
        found = loaded(folder / "pictures" / sample.split / f"{sample.index:08d}.yaml")
        points = np.random.default_rng(sample.index).uniform(-0.6, 0.6, (300, 3))
        camera = sample.camera
        expected = project(camera.intrinsics, points @ camera.R.T + camera.t)[0]
        assert np.isfinite(expected).all()
        close("opencv", f"cv2: {name} lens", projected(points, found), expected, "px", atol=1e-6)
        equal("opencv", "cv2.FileStorage: R", found["R"], camera.R)
        equal("opencv", "cv2.FileStorage: tvec", found["tvec"][:, 0], camera.t)
        one = loaded(folder / "cameras" / "camera.yaml")
        assert (one["image_width"], one["image_height"]) == (96, 72)
        for key, value in one.items():
            equal("opencv", "cv2.FileStorage: cameras", value, found[key])


def test_rectified_pairs(videos, tmp_path):
    found = loaded(written(videos, tmp_path) / "stereo" / "left" / "right.yaml")
    assert (found.pop("image_width"), found.pop("image_height")) == (160, 120)
    sizes = {"M1": (3, 3), "D1": (1, 5), "M2": (3, 3), "D2": (1, 5), "R": (3, 3), "T": (3, 1), "R1": (3, 3), "R2": (3, 3)}
    assert {name: value.shape for name, value in found.items()} == {**sizes, "P1": (3, 4), "P2": (3, 4), "Q": (4, 4)}
    for sample in (sample for sample in videos if sample.sensor == "left"):
        right = videos[sample.index + 1].camera
        points = sample.point_cloud("world").points[::53]
        inside = points @ sample.camera.R.T + sample.camera.t
        moved = inside @ found["R"].T + found["T"][:, 0]
        close("opencv", "T: the second camera's points", moved, points @ right.R.T + right.t, "m", atol=1e-9)
        there = np.column_stack((inside, np.ones(len(inside)))) @ found["P2"].T
        pixels = project(right.intrinsics, moved)[0]
        close("opencv", "P2: pixels", there[:, :2] / there[:, 2:] + 0.5, pixels, "px", atol=1e-9)
        lifted = cv2.reprojectImageTo3D(sample.disparity.astype(np.float32), found["Q"])
        seen = np.isfinite(sample.depth) & (sample.depth < 20)
        error = np.abs(lifted[seen] - sample.point_cloud().points[(sample.depth < 20)[np.isfinite(sample.depth)]])
        close("opencv", "cv2.reprojectImageTo3D: Q", error, 0, "m", atol=1e-3)


def test_q_p1_and_p2_are_those_of_stereo_rectify(videos, tmp_path):
    found = loaded(written(videos, tmp_path) / "stereo" / "left" / "right.yaml")
    args = (found["M1"], found["D1"], found["M2"], found["D2"], (160, 120), found["R"], found["T"])
    R1, R2, P1, P2, Q, *_ = cv2.stereoRectify(*args, flags=cv2.CALIB_ZERO_DISPARITY, alpha=-1)
    for name, value in (("R1", R1), ("R2", R2), ("P1", P1), ("P2", P2), ("Q", Q)):
        close("opencv", f"cv2.stereoRectify: {name}", found[name], value, atol=1e-6)


BENT = {"model": "fisheye", "coefficients": LENSES["fisheye"].coefficients}


@pytest.mark.slow
@pytest.mark.parametrize("first", ["pinhole", "fisheye"])
def test_any_pair_and_that_rigs_take_it(first, tmp_path):
    sensors = {
        "front": {"distortion": BENT} if first == "fisheye" else {},
        "side": {"position": [0.2, -0.1, 0.05], "rotation": [5, 20, -10], "distortion": BENT, "size": [80, 60], "focal_px": 60},
    }
    recipe = small_recipe(rig={"sensors": sensors}, channels=["rgb", "depth"], formats=[])
    generate(recipe, tmp_path / "out", workers=0)
    dataset = Dataset(tmp_path / "out")
    folder = written(dataset, tmp_path / "made")
    found = loaded(folder / "stereo" / "front" / "side.yaml")
    one, other = dataset[0].camera, dataset[1].camera
    points = np.random.default_rng(0).uniform(-1, 1, (50, 3))
    moved = (points @ one.R.T + one.t) @ found["R"].T + found["T"][:, 0]
    close("opencv", "R and T of any pair", moved, points @ other.R.T + other.t, "m", atol=1e-12)
    assert found.get("model") == ("fisheye" if first == "fisheye" else None) and "Q" not in found
    if first == "fisheye":
        left, right = read_rig([folder / "stereo" / "front" / "side.yaml"])
        assert left.size == (96, 72) and right.distortion == other.distortion
        close("opencv", "recipes: rigs", right.rig_from_sensor[:3, :3], one.R @ other.R.T, atol=1e-12)
        assert right.lens == pytest.approx({"fx": 60, "fy": 60, "cx": 40, "cy": 30})


def test_lidars_have_no_files(drives, tmp_path):
    folder = written(drives, tmp_path)
    assert sorted(file.stem for file in (folder / "cameras").iterdir()) == ["left", "right"]
    assert len(list((folder / "pictures").rglob("*.yaml"))) == sum(sample.sensor != "top" for sample in drives)


def test_small_and_negative_numbers_are_read_exactly(tmp_path):
    small = FIVE.model_copy(update={"coefficients": (1e-7, -2.5e-11, 3e-300, -0.0, 12345.678e-9)})
    dataset = make(tmp_path / "out", intrinsics=LENS.model_copy(update={"distortion": small}), channels=FEW)
    found = loaded(written(dataset, tmp_path / "made") / "cameras" / "camera.yaml")
    equal("opencv", "small numbers", found["distortion_coefficients"][0], small.coefficients)


def test_what_it_refuses(tmp_path):
    dataset = make(tmp_path / "out", intrinsics=LENS.model_copy(update={"skew": 2.5}), channels=FEW)
    with pytest.raises(UserError, match=r"format opencv: expected cameras without skew; found 2\.5 of camera"):
        written(dataset, tmp_path / "made")
    assert not (tmp_path / "made").exists()
