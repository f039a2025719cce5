"""TUM's RGB-D sequences, read by their documentation: depth lifted by lens and pose is where the data set's points are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from cube_dataset import LENS, make
from proven import close, equal
from small import small_recipe
from truth_scenes import LENSES
from viewsphere import Dataset, generate
from viewsphere.errors import UserError
from viewsphere.run.exporting import export

STEP = 0.0002


def written(dataset, place, kind="tum"):
    export(dataset.root, [{"tum": {"kind": kind}}], output=place)
    return place / "tum"


def rows(file):
    """Words of lines that are no comments; no line ends with a space."""
    lines = [line for line in file.read_text().splitlines() if not line.startswith("#")]
    assert all(line == line.strip() for line in lines)
    return [line.split(" ") for line in lines if line]


def lifted(folder, depth, pose):
    """Points of the pixels that have depth, by the calibration and a pose (seconds tx ty tz qx qy qz qw); and their rays."""
    fx, fy, cx, cy, *lens = map(float, rows(folder / "calibration.txt")[0])
    assert not any(lens)
    steps = np.array(Image.open(folder / depth))
    assert steps.dtype in (np.uint16, np.int32)
    v, u = np.nonzero(steps)
    rays = np.column_stack(((u - cx) / fx, (v - cy) / fy, np.ones(len(u))))
    numbers = np.array(pose[1:], float)
    return steps, (rays * steps[v, u, None] * STEP) @ Rotation.from_quat(numbers[3:]).as_matrix().T + numbers[:3], rays


def folder_of(folder, dataset, sample):
    several = len({one.sensor for one in dataset}) > 1
    world = folder / (sample.sequence or dataset.plan.row_at(sample.index).subject)
    return world / sample.sensor if several else world


def compare(sample, steps, points, rays, kind):
    held = (sample.depth > 0) & (sample.depth < 65535.5 * STEP)
    equal("tum", "depth: where there is none", steps == 0, ~held)
    cloud = sample.point_cloud("world").points[held[np.isfinite(sample.depth)]]
    over = np.abs(points - cloud) - STEP / 2 * np.linalg.norm(rays, axis=1)[:, None]
    assert len(cloud) > 500
    close("tum", f"{kind}, own reader: lifted points beyond rounding", np.maximum(over, 0), 0, "m", atol=1e-6)
    assert np.abs(points - cloud).max() < 2e-4


@pytest.mark.parametrize("world", ["stills", "poses", "videos"])
def test_depth_lifts_to_the_worlds_points(world, request, tmp_path):
    dataset = request.getfixturevalue(world)
    folder = written(dataset, tmp_path)
    for sample in dataset:
        own = folder_of(folder, dataset, sample)
        time = sample.time if sample.sequence else sample.index
        (pose,) = (row for row in rows(own / "groundtruth.txt") if abs(float(row[0]) - time) < 1e-6)
        (pair,) = (row for row in rows(own / "associations.txt") if abs(float(row[0]) - time) < 1e-6)
        assert pair[:2] in rows(own / "rgb.txt") and pair[2:] in rows(own / "depth.txt") and pair[0] == pair[2] == pose[0]
        assert pair[1] == f"rgb/{pair[0]}.png" and pair[3] == f"depth/{pair[0]}.png"
        assert (own / pair[1]).samefile(dataset.path(sample.files["rgb"]))
        close("tum", "positions", np.array(pose[1:4], float), sample.camera.center, "m", atol=1e-12)
        compare(sample, *lifted(own, pair[3], pose), "tum")


@pytest.mark.parametrize("world", ["stills", "videos"])
def test_icl_nuim_is_mirrored(world, request, tmp_path):
    dataset = request.getfixturevalue(world)
    folder = written(dataset, tmp_path, "icl-nuim")
    for sample in dataset:
        own = folder_of(folder, dataset, sample)
        number = str(sample.instant if sample.sequence else sample.index)
        name = own.parent.name if sample.sequence else own.name
        poses, blocks = rows(own / f"{name}.gt.freiburg"), np.loadtxt(own / f"{name}.gt.sim").reshape(-1, 3, 4)
        place = [row[0] for row in poses].index(number)
        assert rows(own / "associations.txt")[place] == [number, f"depth/{number}.png", number, f"rgb/{number}.png"]
        assert float(rows(own / "calibration.txt")[0][1]) == -sample.camera.intrinsics.fy
        steps, points, rays = lifted(own, f"depth/{number}.png", poses[place])
        turned = Rotation.from_quat(np.array(poses[place][4:], float)).as_matrix()
        close("tum", "icl-nuim: matrices", blocks[place][:, :3], turned, atol=1e-12)
        close("tum", "icl-nuim: positions", blocks[place][:, 3], np.array(poses[place][1:4], float), "m")
        compare(sample, steps, points[:, [0, 2, 1]], rays, "icl-nuim")


def test_seconds_ascend_in_every_sequence(videos, tmp_path):
    folder = written(videos, tmp_path)
    files = list(folder.rglob("groundtruth.txt"))
    assert len(files) == 4
    for file in files:
        seconds = [float(row[0]) for row in rows(file)]
        np.testing.assert_allclose(seconds, np.arange(6) / 10, atol=1e-6)
        assert all(len(row) == 8 for row in rows(file))


def test_lenses_and_what_it_refuses(tmp_path):
    def made(name, **lens):
        return make(tmp_path / name, intrinsics=LENS.model_copy(update=lens))

    barrel = made("barrel", distortion=LENSES["barrel"])
    for file in written(barrel, tmp_path / "made").rglob("calibration.txt"):
        assert list(map(float, rows(file)[0])) == [80, 80, 47.5, 35.5, *LENSES["barrel"].coefficients]
    for dataset, kind, message in (
        (made("fisheye", distortion=LENSES["fisheye"]), "tum", "expected lenses of k1 k2 p1 p2 k3; found another of camera"),
        (made("rational", distortion=LENSES["rational"]), "tum", "expected lenses of k1 k2 p1 p2 k3; found another of camera"),
        (barrel, "icl-nuim", "expected pinhole cameras; found the lens of camera"),
        (made("skew", skew=1.5), "tum", "expected cameras without skew; found 1.5 of camera"),
    ):
        with pytest.raises(UserError, match=f"format tum: {message}"):
            written(dataset, tmp_path / "none", kind)
    assert not Path(tmp_path / "none").exists()


def test_lenses_that_change(tmp_path):
    camera = {"size": [96, 72], "fov_deg": {"uniform": [30, 50]}}
    generate(small_recipe(camera=camera, channels=["rgb", "depth"], formats=[]), tmp_path / "out", workers=0)
    with pytest.raises(UserError, match="expected one lens for all pictures of a sensor; found several"):
        written(Dataset(tmp_path / "out"), tmp_path / "made")
