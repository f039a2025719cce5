"""The Scene Flow sets' trees, read by OpenCV and readers written from their description, by torchvision and by ptlflow."""

from __future__ import annotations

import numpy as np
import pytest
from changed_samples import empty, files, with_channels
from flow_readers import of, read_pfm, read_picture
from torchvision_readers import torchvision_datasets

from proven import close, equal
from quick import quick
from viewsphere.formats import Scope, flyingthings
from viewsphere.run.exports.exporting import export
from viewsphere.run.exports.scope import scope_of

FRAMES = 6
KINDS = {"flyingthings3d": "FlyingThings3D", "monkaa": "Monkaa", "driving": "Driving"}
UNKNOWN = np.float32(1e10)


@pytest.fixture(scope="module")
def written(videos, tmp_path_factory):
    """A function that gives the folder with an export of a set, under all names that readers ask for."""
    made = {}

    def get(kind):
        if kind not in made:
            place = tmp_path_factory.mktemp(kind)
            export(videos.root, [{"flyingthings": {"set": kind}}], output=place)
            (place / "SceneFlow").mkdir()
            (place / "SceneFlow" / KINDS[kind]).symlink_to(place / "flyingthings")
            (place / "FlyingThings3D").symlink_to(place / "flyingthings")
            made[kind] = place
        return made[kind]

    return get


def scene(sample, kind="flyingthings3d"):
    return {
        "flyingthings3d": f"{'TEST' if sample.split == 'val' else 'TRAIN'}/A/{sample.sequence}",
        "monkaa": sample.sequence,
        "driving": f"34mm_focallength/scene_forwards/{sample.sequence}",
    }[kind]


def known(flow):
    return np.where(np.isnan(flow), UNKNOWN, flow)


@pytest.mark.parametrize("kind", quick(KINDS, "monkaa"))
def test_all_maps_of_both_eyes(videos, written, kind):
    folder, count = written(kind) / "flyingthings", 0
    for sample in videos:
        at, n, side = scene(sample, kind), f"{sample.instant:04d}", sample.sensor
        equal("flyingthings", "Pillow: pictures", read_picture(folder / f"frames_cleanpass/{at}/{side}/{n}.png"), sample.rgb)
        for way, channel in (("future", "flow"), ("past", "flow_backward")):
            name = f"OpticalFlowInto{way.title()}_{n}_{side[0].upper()}.pfm"
            found = read_pfm(folder / f"optical_flow/{at}/into_{way}/{side}/{name}")
            equal("flyingthings", "OpenCV: flow", found[..., :2], known(sample.channels[channel]))
            assert not found[..., 2].any()
            hidden = read_picture(folder / f"occlusions/{at}/into_{way}/{side}/{n}.png") > 0
            equal("flyingthings", "Pillow: occlusions", hidden, np.isin(sample.channels[f"{channel}_state"], (1, 2, 3)))
        found = read_pfm(folder / f"disparity/{at}/{side}/{n}.pfm")
        equal("flyingthings", "OpenCV: disparity", found, np.nan_to_num(sample.disparity))
        found = read_pfm(folder / f"object_index/{at}/{side}/{n}.pfm")
        equal("flyingthings", "OpenCV: object index", found, sample.instances)
        found = read_pfm(folder / f"disparity_change/{at}/into_future/{side}/{n}.pfm")
        equal("flyingthings", "OpenCV: disparity change", found, known(sample.disparity_change))
        with (folder / f"motion_boundaries/{at}/into_future/{side}/{n}.pgm").open("rb") as file:
            assert file.read(2) == b"P5"
        found = read_picture(folder / f"motion_boundaries/{at}/into_future/{side}/{n}.pgm")
        equal("flyingthings", "Pillow: motion boundaries", found, sample.motion_boundaries * 255)
        count += found.any()
    assert count > 10 and not (folder / "material_index").exists()


def blocks(file):
    """Frame -> the matrices (4, 4) of L and R, of a camera_data.txt."""
    found = {}
    for block in file.read_text().strip().split("\n\n"):
        head, *rows = block.split("\n")
        words = [row.split() for row in rows]
        assert [word[0] for word in words] == ["L", "R"]
        found[int(head.removeprefix("Frame "))] = [np.reshape([float(x) for x in word[1:]], (4, 4)) for word in words]
    return found


def test_cameras_take_points_to_their_pixels(videos, written):
    """A camera that looks along -z with y up, and the lens of intrinsics.txt, show each box where it is in the picture."""
    folder, seen = written("flyingthings3d") / "flyingthings" / "camera_data", 0
    for sample in videos:
        found = blocks(folder / scene(sample) / "camera_data.txt")
        assert list(found) == list(range(FRAMES))
        lens = {int(row[0]): row[1:] for row in np.loadtxt(folder / scene(sample) / "intrinsics.txt")}
        fx, fy, cx, cy, baseline = lens[sample.instant]
        world_from_camera = found[sample.instant][sample.sensor == "right"]
        for o in sample.objects:
            points = np.linalg.solve(world_from_camera, np.vstack((o.box3d.T, np.ones(8))))[:3]
            x, y = fx * points[0] / -points[2] + cx + 0.5, fy * -points[1] / -points[2] + cy + 0.5
            close("flyingthings", "own reader: camera_data.txt", np.stack([x, y], 1), o.box3d_pixels, "px", atol=1e-6)
            seen += 1
        assert baseline == pytest.approx(0.1)
    assert seen > 40


@pytest.mark.parametrize("kind", KINDS)
def test_torchvision_reads_stereo(videos, written, kind):
    found = torchvision_datasets().SceneFlowStereo(written(kind), variant=KINDS[kind], pass_name="clean")
    assert len(found) == len(videos) // 2
    for i in range(len(found)):
        first, second, disparity = found[i]
        left = next(s for s in videos if s.sensor == "left" and np.array_equal(s.rgb, np.asarray(first)))
        equal("flyingthings", "torchvision: pairs", np.asarray(second), of(videos, left.sequence, "right")[left.instant].rgb)
        equal("flyingthings", "torchvision: disparity", disparity[0], np.nan_to_num(left.disparity))


@pytest.mark.parametrize("split", ["train", "test"])
def test_torchvision_reads_flow(videos, written, split):
    found = torchvision_datasets().FlyingThings3D(written("flyingthings3d"), split=split, camera="both")
    assert len(found) == 2 * 2 * (FRAMES - 1)
    for i in range(len(found)):
        first, second, flow = found[i]
        a, b = (next(s for s in videos if np.array_equal(s.rgb, np.asarray(one))) for one in (first, second))
        assert (a.sequence, a.sensor, abs(b.instant - a.instant)) == (b.sequence, b.sensor, 1)
        expected = a.flow if b.instant > a.instant else a.flow_backward
        equal("flyingthings", "torchvision: flow", flow.transpose(1, 2, 0), known(expected))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_ptlflow_reads_flow_and_occlusions(videos, written):
    torchvision_datasets()
    datasets = pytest.importorskip("ptlflow.data.datasets")
    found = datasets.FlyingThings3DDataset(written("flyingthings3d") / "flyingthings", split="trainval", side_names="right")
    assert len(found) == len(videos.sequences) * 2 * (FRAMES - 1)
    for item in (found[i] for i in range(len(found))):
        a, b = (next(s for s in videos if np.array_equal(s.rgb, np.asarray(image)[..., ::-1])) for image in item["images"])
        channel = "flow" if b.instant > a.instant else "flow_backward"
        flow, expected = np.asarray(item["flows"][0]), a.channels[channel]
        seen = np.isfinite(expected[..., 0])
        equal("flyingthings", "ptlflow: flow", flow[seen], expected[seen])
        equal("flyingthings", "ptlflow: valid", np.asarray(item["valids"][0])[..., 0] > 0, seen)
        hidden = np.isin(a.channels[f"{channel}_state"], (1, 2, 3))
        equal("flyingthings", "ptlflow: occlusions", np.asarray(item["occs"][0])[..., 0] > 0, hidden)


def test_material_indices_where_they_are_kept(videos, tmp_path):
    tree = flyingthings.FlyingThings(videos, flyingthings.FORMAT.options(set="monkaa"))
    numbers = np.arange(160 * 120, dtype=np.int32).reshape(120, 160) % 7
    made = files(tree, with_channels(videos[0], materials=numbers))
    (tmp_path / "m.pfm").write_bytes(made[f"material_index/{videos[0].sequence}/left/0000.pfm"])
    equal("flyingthings", "OpenCV: material index", read_pfm(tmp_path / "m.pfm"), numbers)


def test_a_picture_of_nothing(videos, tmp_path):
    tree = flyingthings.FlyingThings(videos, flyingthings.FORMAT.options(set="monkaa"))
    for path, made in files(tree, empty(videos[0])).items():
        if path.endswith(".pfm"):
            (tmp_path / "a.pfm").write_bytes(made)
            unknown = path.startswith(("optical_flow", "disparity_change"))
            assert (read_pfm(tmp_path / "a.pfm")[..., :2] == (UNKNOWN if unknown else 0)).all(), path


def test_what_is_refused(videos, stills):
    options, scope = flyingthings.FORMAT.options(), scope_of(videos)
    lone = scope.rig.model_copy(update={"sensors": scope.rig.sensors[:1]})
    third = scope.rig.sensors[1].model_copy(update={"name": "third"})
    three = scope.rig.model_copy(update={"sensors": (*scope.rig.sensors, third)})
    assert list(flyingthings.FORMAT.refuses(scope, options)) == []
    assert "expected sequences" in next(flyingthings.FORMAT.refuses(scope_of(stills), options))
    one, other = (list(flyingthings.FORMAT.refuses(Scope(**{**vars(scope), "rig": rig}), options)) for rig in (lone, three))
    assert one == ["expected two rectified cameras (rig: {kind: stereo, baseline: 0.1}); found left"]
    assert other == ["expected one camera, or two that are rectified; found left, right, third"]
