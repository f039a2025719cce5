"""KITTI's stereo, flow and scene flow, read by OpenCV and Pillow as the development kit says, by torchvision and by ptlflow."""

from __future__ import annotations

import numpy as np
import pytest
from changed_samples import empty, files, with_channels
from flow_readers import of, read_flow_png, read_picture
from torchvision_readers import torchvision_datasets

from proven import close, equal
from viewsphere.formats import Scope, kitti_flow
from viewsphere.run.exports.exporting import export
from viewsphere.run.exports.scope import scope_of

FRAMES = 6
HALF = 1 / 512 + 1e-9
"""Of a step of disparity."""


@pytest.fixture(scope="module")
def written(videos, tmp_path_factory):
    """A function that gives the folder of an export."""
    made = {}

    def get(kind):
        if kind not in made:
            place = tmp_path_factory.mktemp(kind)
            export(videos.root, [{"kitti_flow": {"set": kind}}], output=place)
            made[kind] = place / "kitti_flow"
        return made[kind]

    return get


@pytest.fixture(scope="module")
def pairs(videos):
    """The left samples that begin a pair, by the name of its files."""
    return {f"{left.index:06d}": left for s in videos.sequences for left in of(videos, s)[:-1]}


def match(sample):
    """Where a pixel's point is in the second picture, (H, W) of x, and whether it is inside."""
    y, x = np.mgrid[: sample.height, : sample.width] + 0.5
    there = sample.flow + np.dstack((x, y))
    inside = (there[..., 0] >= 0) & (there[..., 0] < sample.width) & (there[..., 1] >= 0) & (there[..., 1] < sample.height)
    return there[..., 0], inside


@pytest.mark.slow
def test_pictures(videos, written, pairs):
    for kind, folders in {"scene_flow_2015": ("image_2", "image_3"), "stereo_flow_2012": ("colored_0", "colored_1")}.items():
        for folder, sensor in zip(folders, ("left", "right"), strict=True):
            root = written(kind) / "training" / folder
            assert len(list(root.iterdir())) == 2 * len(pairs)
            for name, left in pairs.items():
                first, second = of(videos, left.sequence, sensor)[left.instant : left.instant + 2]
                equal("kitti_flow", "Pillow: pictures", read_picture(root / f"{name}_10.png"), first.rgb)
                equal("kitti_flow", "Pillow: pictures", read_picture(root / f"{name}_11.png"), second.rgb)


@pytest.mark.parametrize("kind", ["scene_flow_2015", "stereo_flow_2012"])
def test_flow(written, pairs, kind):
    outside = 0
    for name, left in pairs.items():
        for folder in ("flow_occ", "flow_noc"):
            flow, valid = read_flow_png(written(kind) / "training" / folder / f"{name}_10.png")
            expected = np.isfinite(left.flow[..., 0]) & (match(left)[1] | (folder == "flow_occ"))
            equal("kitti_flow", "OpenCV: validity of flow", valid, expected)
            close("kitti_flow", "OpenCV: flow", flow[valid], left.flow[valid], "px", atol=1 / 128)
        outside += (~match(left)[1]).sum()
    assert outside > 1000


@pytest.mark.parametrize("kind", ["scene_flow_2015", "stereo_flow_2012"])
def test_disparity(written, pairs, kind):
    end = "_0" if kind == "scene_flow_2015" else ""
    for name, left in pairs.items():
        x = np.arange(left.width) + 0.5 - left.disparity
        for which, inside in (("occ", x > -np.inf), ("noc", x >= 0)):
            found = read_picture(written(kind) / "training" / f"disp_{which}{end}" / f"{name}_10.png") / 256
            equal("kitti_flow", "Pillow: validity of disparity", found > 0, (left.disparity > 0) & inside)
            close("kitti_flow", "Pillow: disparity", found[found > 0], left.disparity[found > 0], "px", atol=HALF)


def test_disparity_then(written, pairs):
    """The seen points' disparity an instant later follows from their depth and scene flow."""
    folder = written("scene_flow_2015") / "training"
    for name, left in pairs.items():
        lens = left.camera.intrinsics
        then = lens.fx * 0.1 / (left.depth + left.scene_flow[..., 2]).astype(float)
        x, inside = match(left)
        known = np.isfinite(left.depth) & (left.depth + left.scene_flow[..., 2] > 0)
        for which in ("occ", "noc"):
            found = read_picture(folder / f"disp_{which}_1" / f"{name}_10.png") / 256
            expected = known & ((inside & (x - then >= 0)) if which == "noc" else known)
            assert (found > 0).sum() > 8000
            assert ((found > 0) != expected).sum() <= 2  # rounding at the border
            close("kitti_flow", "depth + scene flow: disparity then", found[found > 0], then[found > 0], "px", atol=HALF + 1e-4)


def test_objects_and_calibration(videos, written, pairs):
    folder, seen = written("scene_flow_2015") / "training", 0
    for name, left in pairs.items():
        equal("kitti_flow", "Pillow: objects", read_picture(folder / "obj_map" / f"{name}_10.png"), left.instances)
        told = dict(line.split(": ") for line in (folder / "calib_cam_to_cam" / f"{name}.txt").read_text().splitlines())
        assert told["S_rect_02"] == told["S_rect_03"] == "160 120"
        old = (written("stereo_flow_2012") / "training" / "calib" / f"{name}.txt").read_text().splitlines()
        for i, sensor in ((2, "left"), (3, "right")):
            matrix = np.reshape(np.fromstring(told[f"P_rect_0{i}"], sep=" "), (3, 4))
            assert np.array_equal(matrix, np.reshape(np.fromstring(old[i].removeprefix(f"P{i}: "), sep=" "), (3, 4)))
            assert old[i - 2].removeprefix(f"P{i - 2}: ") == told[f"P_rect_0{i}"]
            shown = {o.id: o for o in of(videos, left.sequence, sensor)[left.instant].objects}
            for o in left.objects:
                x, y, w = matrix @ np.vstack((o.box3d_camera.T, np.ones(8)))
                found = np.stack((x / w, y / w), axis=1) + 0.5
                close("kitti_flow", "own reader: calibration", found, shown[o.id].box3d_pixels, "px", atol=1e-6)
                seen += 1
    assert seen > 30


def links(place, source, names, end):
    """A folder with links to those files that torchvision takes for the others' partners."""
    for name in names:
        (place / name).mkdir(parents=True)
        for file in (source / name).glob(end):
            (place / name / file.name).symlink_to(file)


def test_torchvision_reads_flow(videos, written, pairs, tmp_path, monkeypatch):
    datasets = torchvision_datasets()
    (tmp_path / "KittiFlow").symlink_to(written("scene_flow_2015"))
    found = datasets.KittiFlow(tmp_path)
    decode_sixteen_bits(monkeypatch)
    assert len(found) == len(pairs)
    for left, i in zip(pairs.values(), range(len(found)), strict=True):
        first, second, flow, valid = found[i]
        equal("kitti_flow", "torchvision: pictures", np.asarray(first), left.rgb)
        equal("kitti_flow", "torchvision: pictures", np.asarray(second), of(videos, left.sequence)[left.instant + 1].rgb)
        equal("kitti_flow", "torchvision: validity of flow", valid, np.isfinite(left.flow[..., 0]))
        close("kitti_flow", "torchvision: flow", flow.transpose(1, 2, 0)[valid], left.flow[valid], "px", atol=1 / 128)


def decode_sixteen_bits(monkeypatch):
    """OpenCV in place of torchvision's decoder of PNG, where that is not built for the torch that is installed."""
    import cv2
    import torch
    from torchvision.datasets import _optical_flow

    monkeypatch.setattr(_optical_flow, "read_file", str)
    monkeypatch.setattr(
        _optical_flow,
        "decode_png",
        lambda file: torch.from_numpy(cv2.imread(file, cv2.IMREAD_UNCHANGED)[..., ::-1].transpose(2, 0, 1).astype(np.int32)),
    )


def test_torchvision_reads_disparity(videos, written, pairs, tmp_path):
    datasets = torchvision_datasets()
    names = ("image_2", "image_3", "disp_occ_0", "disp_occ_1")
    links(tmp_path / "Kitti2015" / "training", written("scene_flow_2015") / "training", names, "*_10.png")
    (tmp_path / "Kitti2012").symlink_to(written("stereo_flow_2012"))
    for found, inside in ((datasets.Kitti2015Stereo(tmp_path), False), (datasets.Kitti2012Stereo(tmp_path), True)):
        assert len(found) == len(pairs)
        for left, i in zip(pairs.values(), range(len(found)), strict=True):
            seen_left, seen_right, disparity, _ = found[i]
            right = of(videos, left.sequence, "right")[left.instant]
            equal("kitti_flow", "torchvision: pairs", [np.asarray(seen_left), np.asarray(seen_right)], [left.rgb, right.rgb])
            expected = (left.disparity > 0) & (~inside | (left.disparity_state < 2))
            equal("kitti_flow", "torchvision: validity of disparity", disparity[0] > 0, expected)
            known = disparity[0] > 0
            close("kitti_flow", "torchvision: disparity", disparity[0][known], left.disparity[known], "px", atol=HALF)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_ptlflow_reads_flow(written, pairs):
    torchvision_datasets()
    datasets = pytest.importorskip("ptlflow.data.datasets")
    folders = {"root_dir_2015": written("scene_flow_2015"), "root_dir_2012": written("stereo_flow_2012")}
    found = datasets.KittiDataset(**folders, split="trainval", versions=["2015", "2012"])
    assert len(found) == 2 * len(pairs)
    for left, i in zip([*pairs.values()] * 2, range(len(found)), strict=True):
        flow, valid = (np.asarray(found[i][name][0]) for name in ("flows", "valids"))
        known = np.isfinite(left.flow[..., 0])
        equal("kitti_flow", "ptlflow: valid", valid[..., 0] > 0, known)
        close("kitti_flow", "ptlflow: flow", flow[known], left.flow[known], "px", atol=1 / 128)


def read(tree, sample, name, tmp_path, reader):
    (tmp_path / "a.png").write_bytes(files(tree, sample)[f"training/{name}/000000_10.png"])
    return reader(tmp_path / "a.png")


def test_what_has_no_number_is_not_valid(videos, tmp_path):
    tree, still = kitti_flow.KittiFlow(videos, kitti_flow.FORMAT.options()), np.zeros((120, 160, 2), np.float32)
    still[0, :4, 0] = (-512, 511.984375, 511.99, -512.1)
    changed = with_channels(videos[0], flow=still, flow_state=np.zeros((120, 160), np.uint8))
    flow, valid = read(tree, changed, "flow_occ", tmp_path, read_flow_png)
    assert valid[0, :5].tolist() == [True, True, True, False, True] and flow[0, :2, 0].tolist() == [-512, 511.984375]
    near = np.full((120, 160), 0.0001, np.float32)
    near[0, :4] = (0, 255.998, 255.999, 300)
    seen = with_channels(videos[0], disparity=near, disparity_state=np.zeros((120, 160), np.uint8))
    found = read(tree, seen, "disp_occ_0", tmp_path, read_picture)
    assert found[0, :5].tolist() == [0, 65535, 0, 0, 1]


def test_a_picture_of_nothing(videos, tmp_path):
    tree, nothing = kitti_flow.KittiFlow(videos, kitti_flow.FORMAT.options()), empty(videos[0])
    for name in ("disp_occ_0", "disp_noc_0", "disp_occ_1", "disp_noc_1", "obj_map"):
        assert not read(tree, nothing, name, tmp_path, read_picture).any()
    assert not read(tree, nothing, "flow_occ", tmp_path, read_flow_png)[1].any()


def test_the_split_test_is_for_testing(videos):
    from dataclasses import replace

    tree = kitti_flow.KittiFlow(videos, kitti_flow.FORMAT.options())
    assert all(path.startswith("testing/") for path in files(tree, replace(videos[0], split="test")))


def test_what_is_refused(videos, stills):
    new, old, scope = kitti_flow.FORMAT.options(), kitti_flow.FORMAT.options(set="stereo_flow_2012"), scope_of(videos)
    lone, many = ({"rig": scope.rig.model_copy(update={"sensors": scope.rig.sensors[:1]})}, {"most_objects": 256})
    assert list(kitti_flow.FORMAT.refuses(scope, new)) == []
    assert "expected sequences" in next(kitti_flow.FORMAT.refuses(scope_of(stills), new))
    assert "expected two rectified cameras" in next(kitti_flow.FORMAT.refuses(Scope(**{**vars(scope), **lone}), old))
    crowd = Scope(**{**vars(scope), **many})
    assert list(kitti_flow.FORMAT.refuses(crowd, new)) == ["expected at most 255 objects in a picture; found 256"]
    assert list(kitti_flow.FORMAT.refuses(crowd, old)) == []
