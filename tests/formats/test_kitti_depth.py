"""KITTI's depth, read by Pillow and OpenCV as its development kit says."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from changed_samples import empty, files, with_channels
from flow_readers import read_picture

from proven import close, equal
from viewsphere.formats import Scope, kitti_depth
from viewsphere.run.exports.exporting import export
from viewsphere.run.exports.scope import scope_of


@pytest.fixture(scope="module")
def written(videos, tmp_path_factory):
    place = tmp_path_factory.mktemp("kitti_depth")
    export(videos.root, "kitti_depth", output=place)
    return place / "kitti_depth"


def test_pictures_and_depth(videos, written):
    for sample in videos:
        folder, camera = written / sample.split / sample.sequence, {"left": "image_02", "right": "image_03"}[sample.sensor]
        name = f"{sample.instant:010d}.png"
        equal("kitti_depth", "Pillow: pictures", read_picture(folder / camera / "data" / name), sample.rgb)
        found = cv2.imread(str(folder / "proj_depth" / "groundtruth" / camera / name), cv2.IMREAD_UNCHANGED)
        assert found.dtype == np.uint16
        seen = np.isfinite(sample.depth) & (sample.depth < 255.99)
        equal("kitti_depth", "OpenCV: where there is depth", found > 0, seen)
        close("kitti_depth", "OpenCV: depth", found[seen] / 256, sample.depth[seen], "m", atol=1 / 512 + 1e-9)


def test_calibration_takes_depth_to_the_other_eye(videos, written):
    """Depth of the left camera by P_rect_02, seen by P_rect_03, is as far left as the disparity says."""
    left = videos[0]
    folder = written / left.split / left.sequence
    told = dict(line.split(": ") for line in (folder / "calib_cam_to_cam.txt").read_text().splitlines())
    p2, p3 = (np.reshape(np.fromstring(told[f"P_rect_0{i}"], sep=" "), (3, 4)) for i in (2, 3))
    y, x = np.nonzero(np.isfinite(left.depth))
    points = np.linalg.inv(p2[:, :3]) @ (np.stack((x, y, np.ones(len(x)))) * left.depth[y, x])
    found = p3 @ np.vstack((points, np.ones(len(x))))
    close("kitti_depth", "calibration: disparity", x - found[0] / found[2], left.disparity[y, x], "px", atol=1e-5)
    assert told["S_rect_02"] == told["S_rect_03"] == "160 120"


def depth_of(tree, sample, tmp_path):
    (name,) = (name for name in files(tree, sample) if "proj_depth" in name)
    (tmp_path / "a.png").write_bytes(files(tree, sample)[name])
    return name, read_picture(tmp_path / "a.png")


def test_what_is_too_far_has_none(videos, tmp_path):
    tree, depth = kitti_depth.KittiDepth(videos), np.full((120, 160), 0.001, np.float32)
    depth[0, :3] = (255.998, 255.999, np.inf)
    name, found = depth_of(tree, with_channels(replace(videos[0], split="test"), depth=depth), tmp_path)
    assert found[0, :4].tolist() == [65535, 0, 0, 1] and name.startswith("test/")
    assert not depth_of(tree, empty(videos[0]), tmp_path)[1].any()


def test_a_lone_camera_is_the_left_one(videos, monkeypatch):
    tree, rig = kitti_depth.KittiDepth(videos), scope_of(videos).rig
    monkeypatch.setattr(tree._eyes, "_rig_of", lambda key: rig.model_copy(update={"sensors": rig.sensors[:1]}))
    made = files(tree, videos[0])
    assert all("image_02" in path or path.endswith("calib_cam_to_cam.txt") for path in made)
    assert b"P_rect_03" not in next(made[path] for path in made if path.endswith(".txt"))


def test_what_is_refused(videos, stills):
    scope = scope_of(videos)
    third = scope.rig.sensors[1].model_copy(update={"name": "third"})
    three = Scope(**{**vars(scope), "rig": scope.rig.model_copy(update={"sensors": (*scope.rig.sensors, third)})})
    assert list(kitti_depth.FORMAT.refuses(scope)) == []
    assert "expected sequences" in next(kitti_depth.FORMAT.refuses(scope_of(stills)))
    assert list(kitti_depth.FORMAT.refuses(three)) == [
        "expected one camera, or two that are rectified; found left, right, third"
    ]
