"""TUM's RGB-D sequences, read by their documentation: depth lifted by lens and pose is where the data set's points are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from cube_dataset import FEW, LENS, make
from proven import close, equal
from quick import quick
from small import small_recipe
from truth_scenes import LENSES
from viewsphere import Dataset, generate
from viewsphere.check import check
from viewsphere.errors import StoreError, UserError
from viewsphere.run.datasets.importing import import_dataset
from viewsphere.run.exports.exporting import export

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


@pytest.mark.parametrize("world", quick(["stills", "poses", "videos"], "stills", "poses"))
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


@pytest.mark.parametrize("world", quick(["stills", "videos"], "stills"))
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


@pytest.mark.slow
def test_lenses_and_what_it_refuses(tmp_path):
    def made(name, **lens):
        return make(tmp_path / name, intrinsics=LENS.model_copy(update=lens), channels=FEW)

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


@pytest.mark.parametrize("kind", ["tum", "icl-nuim"])
@pytest.mark.slow
def test_a_sequence_comes_in_as_it_went_out(videos, kind, tmp_path):
    folder = written(videos, tmp_path / "made", kind)
    for world in videos.sequences:
        place = folder / world / "right"
        import_dataset("tum", place, tmp_path / f"{world}-in")
        imported = Dataset(tmp_path / f"{world}-in")
        own = videos.sequence(world, "right")
        assert imported.sequences == ("right",) and len(imported) == len(own)
        for sample, was in zip(imported, own, strict=True):
            close("tum", f"import of {kind}: positions", sample.camera.center, was.camera.center, "m", atol=1e-12)
            close("tum", f"import of {kind}: rotations", sample.camera.R, was.camera.R, atol=1e-12)
            equal("tum", "import: lenses", sample.camera.K, was.camera.K)
            equal("tum", "import: pictures", sample.rgb, was.rgb)
            near = was.depth < 13.1
            close("tum", "import: depth", sample.depth[near], was.depth[near], "m", atol=0.000101)
            assert np.isinf(sample.depth[was.depth > 13.108]).all()
            assert sample.instant == was.instant
            assert kind == "icl-nuim" or sample.time == pytest.approx(was.time, abs=1e-6)
    assert check(imported, rays=False).ok
    export(imported.root, [{"tum": {"kind": kind}}], output=tmp_path / "again")
    name = "*.gt.freiburg" if kind == "icl-nuim" else "groundtruth.txt"
    before, after = (min(root.rglob(name)) for root in (place, tmp_path / "again"))
    close("tum", "import: out again", np.array(rows(after), float), np.array(rows(before), float), atol=1e-9)


def test_lenses_come_in(tmp_path):
    dataset = make(
        tmp_path / "out", several=True, intrinsics=LENS.model_copy(update={"distortion": LENSES["barrel"]}), channels=FEW
    )
    import_dataset("tum", written(dataset, tmp_path / "made") / "several", tmp_path / "in")
    assert all(sample.camera.distortion == LENSES["barrel"] for sample in Dataset(tmp_path / "in"))


def test_times_need_not_be_equal(videos, tmp_path):
    """Pictures, depths and poses of a real sensor are taken one after another; without a near one there is none."""
    place = written(videos, tmp_path / "made") / "car_000" / "left"
    file = place / "groundtruth.txt"
    lines = [[f"{float(row[0]) + 0.015:.3f}", *row[1:]] for row in rows(file)][:4]
    file.unlink()
    file.write_text("".join(" ".join(line) + "\n" for line in reversed(lines)))
    import_dataset("tum", place, tmp_path / "in")
    imported, own = Dataset(tmp_path / "in"), videos.sequence("car_000", "left")
    assert len(imported) == 4
    for sample, was in zip(imported, own, strict=False):
        close("tum", "import: positions", sample.camera.center, was.camera.center, "m", atol=1e-12)


def test_what_is_broken_is_told(videos, tmp_path):
    place = written(videos, tmp_path / "made") / "car_000" / "left"

    def told(name, change):
        file = place / name
        whole = file.read_text()
        file.unlink()
        if change is not None:
            file.write_text(change(whole))
        with pytest.raises(StoreError) as caught:
            import_dataset("tum", place, tmp_path / "in")
        file.unlink(missing_ok=True)
        file.write_text(whole)
        assert not (tmp_path / "in").exists()
        return str(caught.value)

    assert "expected a line of fx fy cx cy k1 k2 p1 p2 k3; found none" in told("calibration.txt", lambda text: "# none\n")
    assert "expected 4, 8 or 9 numbers in calibration.txt; found 6" in told("calibration.txt", lambda text: "1 1 1 1 1 1")
    assert "calibration.txt: expected a text of a line each; found" in told("calibration.txt", None)
    assert "expected seconds at the beginning of each line; found: " in told("rgb.txt", lambda text: text + "soon rgb/1.png\n")
    assert "a line does not begin with seconds" in told("rgb.txt", lambda text: text + "nan a\n")
    assert "picture of 0.1 s: expected a picture; found no rgb/none.png" in told(
        "rgb.txt", lambda text: text.replace("rgb/0.100000.png", "rgb/none.png")
    )
    assert "picture of 0 s: " in told("rgb.txt", lambda text: text.replace("rgb/0.0", "../../../../rgb/0.0"))
    assert "expected pictures that can be used; found none" in told("groundtruth.txt", lambda text: "")
    assert "picture of 0.2 s: " in told("groundtruth.txt", lambda text: text + "0.2 1 2 3\n")
