"""Middlebury's and ETH3D's scenes, read by OpenCV and readers written from their description, by torchvision and pycolmap."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pycolmap
import pytest
from changed_samples import empty, files
from flow_readers import of, read_pfm, read_picture
from torchvision_readers import torchvision_datasets

from proven import close, equal
from viewsphere import Dataset, generate
from viewsphere.formats import Scope, middlebury
from viewsphere.run.exports.exporting import export
from viewsphere.run.exports.scope import scope_of
from worlds import stills as stills_recipe


@pytest.fixture(scope="module")
def written(videos, tmp_path_factory):
    """The folders of both sets' exports."""
    place = {}
    for kind in ("middlebury", "eth3d"):
        folder = tmp_path_factory.mktemp(kind)
        export(videos.root, [{"middlebury": {"set": kind}}], output=folder)
        place[kind] = folder / "middlebury"
    return place


def pairs(dataset):
    return [pair for s in dataset.sequences for pair in zip(of(dataset, s), of(dataset, s, "right"), strict=True)]


def name_of(left):
    return f"{left.sequence}_{left.instant:04d}"


def disparity(sample):
    return np.where(np.isnan(sample.disparity), np.inf, sample.disparity)


def calibration(file):
    told = dict(line.split("=") for line in file.read_text().splitlines())
    rows = {name: re.findall(r"[^;\[\]]+", told.pop(name)) for name in ("cam0", "cam1")}
    found = {name: np.array([[float(x) for x in row.split()] for row in value]) for name, value in rows.items()}
    return found, {name: float(value) for name, value in told.items()}


def test_pairs_disparities_and_masks(videos, written):
    for left, right in pairs(videos):
        folder = written["middlebury"] / left.split / f"{name_of(left)}-perfect"
        assert len(list(folder.iterdir())) == 6
        for i, sample in enumerate((left, right)):
            equal("middlebury", "Pillow: pictures", read_picture(folder / f"im{i}.png"), sample.rgb)
            equal("middlebury", "OpenCV: disparity", read_pfm(folder / f"disp{i}.pfm"), disparity(sample))
        equal("middlebury", "Pillow: mask", read_picture(folder / "mask0nocc.png"), 255 * (left.disparity_state == 0))


def test_depth_by_the_calibration(videos, written):
    """Depth is baseline f / (d + doffs), and pixels with it are points that the camera shows there."""
    for left, _ in pairs(videos):
        folder = written["middlebury"] / left.split / f"{name_of(left)}-perfect"
        cameras, told = calibration(folder / "calib.txt")
        assert (told["width"], told["height"], told["doffs"]) == (160, 120, 0)
        assert np.array_equal(cameras["cam0"], cameras["cam1"])
        corner = np.array([[1, 0, 0.5], [0, 1, 0.5], [0, 0, 1]])
        close("middlebury", "calib.txt: K", corner @ cameras["cam0"], left.camera.K, "px", atol=1e-12)
        found = read_pfm(folder / "disp0.pfm")
        with np.errstate(divide="ignore"):
            depth = told["baseline"] / 1000 * cameras["cam0"][0, 0] / (found + told["doffs"])
        seen = np.isfinite(left.depth)
        close("middlebury", "calib.txt: depth", depth[seen], left.depth[seen], "m", rtol=1e-6)
        known = found[np.isfinite(found)]
        assert told["vmin"] <= known.min() and known.max() <= told["vmax"] < told["ndisp"] <= known.max() + 2


def test_eth3d(videos, written):
    for left, right in pairs(videos):
        pictures = written["eth3d"] / "two_view_training" / name_of(left)
        truth = written["eth3d"] / "two_view_training_gt" / name_of(left)
        assert {file.name for file in truth.iterdir()} == {"disp0GT.pfm", "mask0nocc.png"}
        equal("middlebury", "OpenCV: disparity of ETH3D", read_pfm(truth / "disp0GT.pfm"), disparity(left))
        for i, sample in enumerate((left, right)):
            equal("middlebury", "Pillow: pictures", read_picture(pictures / f"im{i}.png"), sample.rgb)
        assert calibration(pictures / "calib.txt")[1]["baseline"] == pytest.approx(100)


def test_pycolmap_reads_the_cameras_of_eth3d(videos, written, tmp_path):
    for left, right in pairs(videos)[::5]:
        folder = tmp_path / name_of(left)
        folder.mkdir()
        for name in ("cameras.txt", "images.txt"):
            (folder / name).write_bytes((written["eth3d"] / "two_view_training" / name_of(left) / name).read_bytes())
        (folder / "points3D.txt").touch()
        found = pycolmap.Reconstruction(str(folder))
        named = {image.name: image for image in found.images.values()}
        for i, sample in enumerate((left, right)):
            image = named[f"im{i}.png"]
            motion = np.column_stack((sample.camera.R, sample.camera.t))
            close("middlebury", "pycolmap: poses", image.cam_from_world().matrix(), motion, atol=1e-9)
            camera = found.cameras[image.camera_id]
            close("middlebury", "pycolmap: lens", camera.calibration_matrix(), sample.camera.K, "px", atol=1e-12)


@pytest.mark.parametrize("split", ["train", "val"])
def test_torchvision_reads_middlebury(videos, written, split, tmp_path):
    datasets = torchvision_datasets()
    (tmp_path / "Middlebury2014" / "train" / "Adirondack").mkdir(parents=True)
    for scene in (written["middlebury"] / split).iterdir():
        (tmp_path / "Middlebury2014" / "train" / scene.name).symlink_to(scene)
    found = datasets.Middlebury2014Stereo(tmp_path, split="train", calibration="perfect")
    own = [(left, right) for left, right in pairs(videos) if left.split == split]
    assert len(found) == len(own)
    for (left, right), i in zip(own, range(len(found)), strict=True):
        seen_left, seen_right, numbers, valid = found[i]
        equal("middlebury", "torchvision: pairs", [np.asarray(seen_left), np.asarray(seen_right)], [left.rgb, right.rgb])
        equal("middlebury", "torchvision: disparity", numbers[0], np.nan_to_num(left.disparity))
        equal("middlebury", "torchvision: validity", valid, left.disparity > 0)


def test_torchvision_reads_eth3d(videos, written, tmp_path):
    datasets = torchvision_datasets()
    (tmp_path / "ETH3D").symlink_to(written["eth3d"])
    found = datasets.ETH3DStereo(tmp_path)
    assert len(found) == len(pairs(videos))
    for (left, right), i in zip(pairs(videos), range(len(found)), strict=True):
        seen_left, seen_right, numbers, valid = found[i]
        equal("middlebury", "torchvision: pairs", [np.asarray(seen_left), np.asarray(seen_right)], [left.rgb, right.rgb])
        equal("middlebury", "torchvision: disparity of ETH3D", numbers[0], disparity(left))
        equal("middlebury", "torchvision: validity of ETH3D", valid, left.disparity_state == 0)


@pytest.mark.slow
def test_still_pairs(tmp_path):
    """Every picture of a rig is a scene, whose number is that of the frame."""
    scenes = {"count": 1, "objects": [2, 2], "layout": "scatter"}
    recipe = stills_recipe(
        rig={"kind": "stereo", "baseline": 0.1}, scenes=scenes, channels=["rgb"], annotations=[], splits={"by": "pose"}
    )
    generate(recipe, tmp_path / "out", workers=0)
    dataset = Dataset(tmp_path / "out")
    export(dataset.root, "middlebury", output=tmp_path)
    for first in range(0, len(dataset), 2):
        folder = tmp_path / "middlebury" / dataset[first].split / f"{dataset[first].index:08d}-perfect"
        for i in (0, 1):
            equal("middlebury", "Pillow: pictures", read_picture(folder / f"im{i}.png"), dataset[first + i].rgb)
            assert (read_pfm(folder / f"disp{i}.pfm") > 0).any()


def test_a_picture_of_nothing(videos, tmp_path):
    tree = middlebury.Middlebury(videos, middlebury.FORMAT.options())
    made = files(tree, empty(videos[0]))
    for path, value in made.items():
        if path.endswith(".pfm"):
            (tmp_path / "a.pfm").write_bytes(value)
            assert np.isposinf(read_pfm(tmp_path / "a.pfm")).all()
        if path.endswith("calib.txt"):
            assert b"ndisp=1\n" in value and b"vmin=0\nvmax=0\n" in value


def test_the_split_test_of_eth3d(videos):
    tree = middlebury.Middlebury(videos, middlebury.FORMAT.options(set="eth3d"))
    roots = {path.split("/")[0] for path in files(tree, replace(videos[0], split="test"))}
    assert roots == {"two_view_test", "two_view_test_gt"}


def test_what_is_refused(videos, stills):
    scope, options = scope_of(videos), middlebury.FORMAT.options()
    third = scope.rig.sensors[1].model_copy(update={"name": "third"})
    three = Scope(**{**vars(scope), "rig": scope.rig.model_copy(update={"sensors": (*scope.rig.sensors, third)})})
    assert list(middlebury.FORMAT.refuses(scope, options)) == []
    assert list(middlebury.FORMAT.refuses(scope_of(stills), options)) == [
        "expected two rectified cameras (rig: {kind: stereo, baseline: 0.1}); found camera"
    ]
    assert list(middlebury.FORMAT.refuses(three, options)) == [
        "expected one camera, or two that are rectified; found left, right, third"
    ]
