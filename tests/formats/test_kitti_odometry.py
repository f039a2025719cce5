"""KITTI's odometry benchmark, read by pykitti: the same poses, calibrations, times, pictures and points."""

from __future__ import annotations

import warnings

import numpy as np
import pykitti
import pytest

from proven import close, equal
from viewsphere import Dataset, generate
from viewsphere.errors import UserError
from viewsphere.run.exports.exporting import export
from viewsphere.store import Choice

FORMAT = "kitti_odometry"


@pytest.fixture(scope="module")
def written(request, tmp_path_factory):
    made = {}

    def get(world):
        if world not in made:
            made[world] = tmp_path_factory.mktemp(world)
            export(request.getfixturevalue(world).root, FORMAT, output=made[world])
        return made[world] / FORMAT

    return get


def loaded(folder, number):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it reads numbers as old versions of numpy did
        return pykitti.odometry(str(folder), number)


def world_from(sample):
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = sample.camera.R.T, sample.camera.center
    return pose


@pytest.mark.parametrize("world", ["videos", "drives"])
def test_pykitti_reads_it(request, written, world):
    dataset, folder = request.getfixturevalue(world), written(world)
    for place, name in enumerate(dataset.sequences):
        read = loaded(folder, f"{place:02d}")
        left, right = dataset.sequence(name, "left"), dataset.sequence(name, "right")
        assert len(read) == len(left) == len(read.poses) == len(read.cam2_files) == len(read.cam3_files)
        equal(FORMAT, "pykitti: times", [time.total_seconds() for time in read.timestamps], [sample.time for sample in left])
        start = np.linalg.inv(world_from(left[0]))
        close(FORMAT, "pykitti: poses", read.poses, [start @ world_from(sample) for sample in left], "m", atol=1e-11)
        centre = left[0].camera.K - [[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]]
        close(FORMAT, "pykitti: K", [read.calib.K_cam2, read.calib.K_cam3], [centre, centre], "px", atol=1e-9)
        close(FORMAT, "pykitti: baseline", read.calib.b_rgb, 0.1, "m", atol=1e-12)
        between = np.linalg.inv(world_from(right[0])) @ world_from(left[0])
        found = read.calib.T_cam3_velo @ np.linalg.inv(read.calib.T_cam2_velo)
        close(FORMAT, "pykitti: right camera", found, between, "m", atol=1e-12)
        for i, (one, other) in enumerate(zip(left, right, strict=True)):
            equal(FORMAT, "pykitti: pictures", np.array(read.get_cam2(i)), one.rgb)
            equal(FORMAT, "pykitti: pictures", np.array(read.get_cam3(i)), other.rgb)


def test_points_are_where_the_camera_sees_them(drives, written):
    axes = np.array([[0, -1, 0], [0, 0, -1], [1, 0, 0]])
    for place, name in enumerate(drives.sequences):
        read = loaded(written("drives"), f"{place:02d}")
        left, top = drives.sequence(name, "left"), drives.sequence(name, "top")
        for i, (camera, lidar) in enumerate(zip(left, top, strict=True)):
            points = read.get_velo(i)
            expected = np.column_stack([lidar.lidar["xyz"], lidar.lidar["intensity"]])
            equal(FORMAT, "pykitti: LiDAR points", points, expected)
            homogeneous = np.column_stack([points[:, :3], np.ones(len(points))])
            found = homogeneous @ (read.poses[i] @ read.calib.T_cam2_velo).T
            world = (points[:, :3] @ axes.T - lidar.camera.t) @ lidar.camera.R
            expected = world @ left[0].camera.R.T + left[0].camera.t
            close(FORMAT, "pykitti: points along the way", found[:, :3], expected, "m", atol=1e-10)
            assert camera.instant == lidar.instant


def test_splits_are_listed(drives, written):
    numbers = {name: f"{place:02d}" for place, name in enumerate(drives.sequences)}
    for split in drives.splits:
        own = [f"{numbers[s.sequence]}/{s.instant:06d}" for s in drives if s.split == split and s.sensor == "left"]
        assert (written("drives") / f"ImageSets/{split}.txt").read_text().split() == own


@pytest.mark.slow
def test_one_camera_is_its_own_partner(tmp_path):
    from worlds import videos

    alone = videos(rig=None, channels=["rgb"], annotations=[], tracks=None, formats=[FORMAT], time={"frames": 2, "fps": 10})
    generate(alone.model_copy(update={"shot_frames": 1}), tmp_path)
    read = loaded(tmp_path / FORMAT, "00")
    left = Dataset(tmp_path).sequence("car_000")
    assert len({sample.origin.key for sample in left}) == 2  # shots, which a pose's sequence begins before
    np.testing.assert_allclose(read.poses[1], np.linalg.inv(world_from(left[0])) @ world_from(left[1]), atol=1e-12)
    assert len(read) == len(read.cam2_files) == 2 and read.cam3_files == read.velo_files == []
    np.testing.assert_array_equal(read.calib.P_rect_20, read.calib.P_rect_30)
    np.testing.assert_array_equal(read.calib.T_cam2_velo[:3, :3], [[0, -1, 0], [0, 0, -1], [1, 0, 0]])


def test_a_part_of_a_sequence(videos, tmp_path):
    export(videos.root, FORMAT, output=tmp_path, choice=Choice(frames=((16, 24),)))
    read, name = loaded(tmp_path / FORMAT, "01"), videos.sequences[1]
    left = videos.sequence(name, "left")
    start = np.linalg.inv(world_from(left[0]))
    np.testing.assert_allclose(read.poses, [start @ world_from(sample) for sample in left[2:]], atol=1e-11)
    assert [file[-10:] for file in read.cam2_files] == [f"{i:06d}.png" for i in range(2, 6)]
    assert not (tmp_path / FORMAT / "sequences/00").exists()


def test_refusals(stills, tmp_path):
    with pytest.raises(UserError, match=r"expected sequences \(a recipe's time\); found still pictures"):
        export(stills.root, FORMAT, output=tmp_path / "no")


def test_a_zoom_has_no_calibration(videos, tmp_path, monkeypatch):
    from viewsphere.formats.shared.writing.timeline import Timeline

    def zooming(timeline, course):
        for shot in shots(timeline, course):
            lens = shot.camera(0).intrinsics
            other = lens.model_copy(update={"fx": 2 * lens.fx})
            yield shot.model_copy(update={"instants": [now.model_copy(update={"intrinsics": other}) for now in shot.instants]})

    shots = Timeline.shots
    monkeypatch.setattr(Timeline, "shots", zooming)
    with pytest.raises(UserError, match="kitti_odometry: expected one lens all through a sequence; found another in frame 0"):
        export(videos.root, FORMAT, output=tmp_path)
    assert not (tmp_path / FORMAT).exists()
