"""KITTI's objects and tracks, read by datumaro and torchvision where they are installed, and by a reader of its own text: the
same boxes, headings, calibrations and points.
"""

from __future__ import annotations

import math
import shutil

import numpy as np
import pytest
from PIL import Image

from proven import close, equal, told
from viewsphere import Dataset, generate
from viewsphere.errors import UserError
from viewsphere.plugins.format import FormatSpec
from viewsphere.run.datasets.importing import import_dataset
from viewsphere.run.exports.exporting import export
from viewsphere.store import Choice

TYPES = {"car": "Car", "chair": "chair", "post_box": "post_box"}


@pytest.fixture(scope="module")
def written(request, tmp_path_factory):
    made = {}

    def get(world, task="object"):
        if (world, task) not in made:
            made[world, task] = tmp_path_factory.mktemp(f"{world}-{task}") / "out"
            dataset = request.getfixturevalue(world)
            export(dataset.root, [{"kitti": {"task": task}}], output=made[world, task])
        return made[world, task] / "kitti"

    return get


def rows(text):
    return [line.split(" ") for line in text.splitlines()]


def calibrated(file):
    """The matrices of a calibration, by their names without colons."""
    found = {}
    for line in file.read_text().splitlines():
        name, *values = line.split()
        found[name.rstrip(":")] = np.array(list(map(float, values))).reshape(3, -1)
    return found


def corners(height, width, length, x, y, z, turn):
    """The corners of a box as the development kit's computeBox3D has them, (8, 3): front left bottom, ..."""
    own = np.array(
        [
            [length / 2, length / 2, -length / 2, -length / 2] * 2,
            [0, 0, 0, 0, -height, -height, -height, -height],
            [width / 2, -width / 2, -width / 2, width / 2] * 2,
        ]
    )
    c, s = math.cos(turn), math.sin(turn)
    return (np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]) @ own).T + np.array([x, y, z])


def seen(sample):
    return [o for o in sample.objects if o.box2d]


def boxes_of(sample):
    """First and last columns and rows of what is seen."""
    return [np.subtract(o.box2d, (0, 0, 1, 1)) for o in seen(sample)]


def types_of(sample):
    return [TYPES[o.category] for o in seen(sample)]


def level(**changes):
    """Pictures of a camera that looks level at cars that stand upright, turned at random."""
    from worlds import stills

    viewpoints = {"azimuth": [10, 130, 250], "elevation": [0], "distance": 3.5}
    return stills(**{"viewpoints": viewpoints, "scenes": {"count": 2, "objects": 3, "layout": "scatter"}, **changes})


@pytest.fixture(scope="module")
def levelled(tmp_path_factory):
    out = tmp_path_factory.mktemp("level") / "out"
    generate(level(), out)
    export(out, "kitti", output=out.parent / "export")
    return Dataset(out), out.parent / "export" / "kitti"


def nearest(found, expected):
    """How far each of some corners is from the nearest of others."""
    return np.linalg.norm(found[:, None] - expected[None], axis=2).min(axis=1)


@pytest.mark.slow
def test_boxes_of_a_level_camera(levelled):
    dataset, folder = levelled
    for sample in dataset:
        lines = rows((folder / f"training/label_2/{sample.index:06d}.txt").read_text())
        assert len(lines) == len(seen(sample))
        for line, o in zip(lines, seen(sample), strict=True):
            box = corners(*map(float, line[8:]))
            close("kitti", "computeBox3D: corners, level camera", nearest(box, o.box3d_camera), 0, "m", atol=1e-6)
            front = box[[0, 1, 4, 5]].mean(axis=0) - box[[2, 3, 6, 7]].mean(axis=0)
            assert np.dot(front, -o.camera_from_object[:3, 1]) > 0.999 * np.linalg.norm(front)
            x, z, turn, alpha = (float(line[i]) for i in (11, 13, 14, 3))
            close("kitti", "alpha", math.remainder(turn - math.atan2(x, z) - alpha, 2 * math.pi), 0, "rad", atol=1e-6)
            assert -math.pi <= alpha <= math.pi and -math.pi <= turn <= math.pi


def test_what_a_camera_that_looks_down_loses(stills, written):
    folder = written("stills")
    for sample in stills:
        for line, o in zip(rows((folder / f"training/label_2/{sample.index:06d}.txt").read_text()), seen(sample), strict=True):
            values = list(map(float, line[8:]))
            box = corners(*values)
            close("kitti", "middle and size", box.mean(axis=0), o.box3d_camera.mean(axis=0), "m", atol=1e-6)
            np.testing.assert_allclose(values[:3], np.array(o.size)[[1, 0, 2]], atol=1e-6)
            told("kitti", "corners, camera 15 degrees down (lost)", nearest(box, o.box3d_camera), "m")
            tilt = math.acos(-o.camera_from_object[1, 2])
            assert nearest(box, o.box3d_camera).max() <= 2 * math.sin(tilt / 2) * np.linalg.norm(o.size) / 2 * math.sqrt(2)


def test_lines(stills, written):
    folder = written("stills")
    for sample in stills:
        lines = rows((folder / f"training/label_2/{sample.index:06d}.txt").read_text())
        for line, o in zip(lines, seen(sample), strict=True):
            assert len(line) == 15
            equal("kitti", "types", line[0], TYPES[o.category])
            close("kitti", "truncation", float(line[1]), o.truncation, "", atol=1e-5)
            equal("kitti", "occlusion", int(line[2]), o.occlusion_level)
            columns, found = np.nonzero(o.mask)[::-1], list(map(float, line[4:8]))
            equal("kitti", "boxes", found, [columns[0].min(), columns[1].min(), columns[0].max(), columns[1].max()])
    listed = {f"{s.split}": [f"{t.index:06d}" for t in stills if t.split == s.split] for s in stills}
    for split, names in listed.items():
        assert (folder / f"ImageSets/{split}.txt").read_text().split() == names
    for sample in stills:
        equal("kitti", "PIL: pictures", np.array(Image.open(folder / f"training/image_2/{sample.index:06d}.png")), sample.rgb)


@pytest.mark.slow
def test_calibrations_and_points_of_a_drive(drives, written):
    folder = written("drives") / "training"
    for sample in drives:
        name = f"{sample.index - {'left': 0, 'right': 1, 'top': 2}[sample.sensor]:06d}"
        if sample.sensor != "top":
            place = "image_2" if sample.sensor == "left" else "image_3"
            equal("kitti", "PIL: pictures", np.array(Image.open(folder / place / f"{name}.png")), sample.rgb)
            projection = calibrated(folder / "calib" / f"{name}.txt")["P2" if sample.sensor == "left" else "P3"]
            left = drives[int(name)]
            for own, o in zip(sample.objects, left.objects, strict=True):
                homogeneous = np.column_stack([o.box3d_camera, np.ones(8)]) @ projection.T
                pixels = homogeneous[:, :2] / homogeneous[:, 2:] + 0.5
                close("kitti", "P2, P3: vertices", pixels, own.box3d_pixels, "px", atol=1e-6)
            continue
        points = np.fromfile(folder / "velodyne" / f"{name}.bin", np.float32).reshape(-1, 4)
        equal("kitti", "numpy: LiDAR points", points, np.column_stack([sample.lidar["xyz"], sample.lidar["intensity"]]))
        found = calibrated(folder / "calib" / f"{name}.txt")
        camera, lidar = drives[int(name)].camera, sample.camera
        axes = np.array([[0, -1, 0], [0, 0, -1], [1, 0, 0]])
        world = (points[:, :3] @ axes.T - lidar.t) @ lidar.R
        chained = np.column_stack([points[:, :3], np.ones(len(points))]) @ found["Tr_velo_to_cam"].T @ found["R0_rect"].T
        close("kitti", "Tr_velo_to_cam", chained, world @ camera.R.T + camera.t, "m", atol=1e-6)
        pixels = chained @ found["P2"][:, :3].T
        u, v = np.rint(pixels[:, :2] / pixels[:, 2:]).T.astype(int)
        inside = (u >= 0) & (u < camera.width) & (v >= 0) & (v < camera.height)
        depth = drives[int(name)].depth[v[inside], u[inside]]
        assert np.median(np.abs(depth - chained[inside, 2])) < 0.02  # the LiDAR stands elsewhere, and edges differ


def test_tracks(drives, written):
    folder = written("drives", "tracking")
    numbers = {name: f"{i:04d}" for i, name in enumerate(drives.sequences)}
    assert (folder / "evaluate_tracking.seqmap.training").read_text().splitlines() == [
        f"{number} empty 000000 000005" for number in numbers.values()
    ]
    found = {n: rows((folder / f"training/label_02/{n}.txt").read_text()) for n in numbers.values()}
    for sample in drives:
        number = numbers[sample.sequence]
        if sample.sensor == "left":
            lines = [line for line in found[number] if int(line[0]) == sample.instant]
            assert all(len(line) == 17 for line in lines)
            equal("kitti", "tracks", [int(line[1]) for line in lines], [o.id for o in seen(sample)])
            equal("kitti", "truncation levels", [int(line[3]) for line in lines], [o.truncation_level for o in seen(sample)])
            close("kitti", "tracks: boxes", [list(map(float, line[6:10])) for line in lines], boxes_of(sample), "px")
            assert f"{number}/{sample.instant:06d}" in (folder / f"ImageSets/{sample.split}.txt").read_text().split()
        kind = {"left": "image_02", "right": "image_03", "top": "velodyne"}[sample.sensor]
        file = folder / "training" / kind / number / f"{sample.instant:06d}{'.bin' if kind == 'velodyne' else '.png'}"
        assert file.is_file()
    found = calibrated(folder / "training/calib/0000.txt")
    other = calibrated(written("drives") / "training/calib/000000.txt")
    for name, same in {
        "P2": "P2",
        "R_rect": "R0_rect",
        "Tr_velo_cam": "Tr_velo_to_cam",
        "Tr_imu_velo": "Tr_imu_to_velo",
    }.items():
        np.testing.assert_array_equal(found[name], other[same])


def test_a_part_of_a_sequence(drives, tmp_path):
    export(drives.root, [{"kitti": {"task": "tracking"}}], output=tmp_path, choice=Choice(frames=((21, 30),)))
    assert sorted(p.name for p in (tmp_path / "kitti/training/image_02/0001").iterdir()) == [
        "000002.png",
        "000003.png",
        "000004.png",
    ]
    assert [p.name for p in (tmp_path / "kitti/training/calib").iterdir()] == ["0001.txt"]
    assert {line[0] for line in rows((tmp_path / "kitti/training/label_02/0001.txt").read_text())} == {"2", "3", "4"}


@pytest.mark.slow
def test_an_empty_picture_has_an_empty_file(tmp_path):
    generate(level(viewpoints={"azimuth": 0, "elevation": 0, "distance": 3, "target": [90, 0, 0]}, formats=["kitti"]), tmp_path)
    assert {file.read_text() for file in (tmp_path / "kitti/training/label_2").iterdir()} == {""}


def test_still_pictures_have_no_tracks(stills, tmp_path):
    with pytest.raises(UserError, match=r"kitti: expected sequences \(a recipe's time\); found still pictures"):
        export(stills.root, [{"kitti": {"task": "tracking"}}], output=tmp_path / "no")


def refused(recipe, message, tmp_path):
    with pytest.raises(UserError, match=message):
        generate(recipe, tmp_path / "no")
    assert not (tmp_path / "no").exists()


def test_refusals(tmp_path):
    from worlds import MODELS, drives, poses

    def named(*names):
        models = [{**MODELS[i], "count": 1, "category": name} for i, name in enumerate(names)]
        return poses(models=models, formats=["kitti"])

    refused(named("post box"), r"kitti: expected names of categories without spaces; found 'post box'", tmp_path)
    alike = "expected categories of different types; found person, Pedestrian, all of type Pedestrian"
    refused(named("person", "Pedestrian"), alike, tmp_path)
    sensors = {"left": {}, "right": {"position": [0.1, 0, 0]}, "rear": {"position": [0, 0, 0.1]}}
    wide = drives(rig={"sensors": sensors}, channels=["rgb"], annotations=[], formats=["kitti"])
    refused(wide, "kitti: expected a camera or a rectified pair, and one LiDAR at most; found left, right, rear", tmp_path)


@pytest.mark.slow
def test_quoted_and_foreign_names(tmp_path):
    from worlds import MODELS, poses

    generate(poses(models=[{**MODELS[0], "count": 1, "category": "a\"ö'"}], formats=["kitti"]), tmp_path)
    file = next((tmp_path / "kitti/training/label_2").iterdir())
    assert rows(file.read_text("utf-8"))[0][0] == "a\"ö'"


def test_a_zoom_has_no_calibration(videos, tmp_path, monkeypatch):
    from viewsphere.formats.shared.writing.timeline import Timeline

    def zooming(timeline, course):
        for shot in shots(timeline, course):
            lens = shot.camera(0).intrinsics
            other = lens.model_copy(update={"fx": 2 * lens.fx})
            yield shot.model_copy(update={"instants": [now.model_copy(update={"intrinsics": other}) for now in shot.instants]})

    shots = Timeline.shots
    monkeypatch.setattr(Timeline, "shots", zooming)
    with pytest.raises(UserError, match="kitti: expected one lens all through a sequence; found another in frame 0"):
        export(videos.root, [{"kitti": {"task": "tracking"}}], output=tmp_path)
    assert not (tmp_path / "kitti").exists()


def test_tracking_is_proved(drives, written):
    from viewsphere import plugins
    from viewsphere.formats.kitti import Options

    folder = written("drives", "tracking")
    verify = plugins.load(FormatSpec, "kitti").verify
    assert list(verify(drives, folder, range(len(drives)), Options(task="tracking"))) == []
    file = folder / "training/label_02/0001.txt"
    kept = file.read_bytes()
    file.write_bytes(kept.replace(b"Car", b"Van"))
    found = [message for _, message in verify(drives, folder, range(len(drives)), Options(task="tracking"))]
    file.write_bytes(kept)
    assert len(found) == 1 and "0001.txt: line 2" in found[0]


def test_imported_boxes_have_unknown_values(stills, tmp_path):
    export(stills.root, "coco", output=tmp_path / "made")
    import_dataset("coco", tmp_path / "made" / "coco", tmp_path / "imported")
    export(tmp_path / "imported", "kitti", output=tmp_path)
    for sample in Dataset(tmp_path / "imported"):
        lines = rows((tmp_path / f"kitti/training/label_2/{sample.index:06d}.txt").read_text())
        assert [line[0] for line in lines] == [TYPES[o.category] for o in sample.objects]
        for line, o in zip(lines, sample.objects, strict=True):
            assert line[1:4] == ["-1", "3", "-10"] and line[8:] == ["-1"] * 3 + ["-1000"] * 3 + ["-10"]
            assert list(map(float, line[4:8])) == np.subtract(o.box2d, (0, 0, 1, 1)).tolist()
    assert not (tmp_path / "kitti/training/calib").exists()


def test_merged_pictures(stills, poses, written, tmp_path):
    """They have no shots, but cameras and boxes: all is as it was, but for the numbers of frames."""
    from viewsphere.run.datasets.merging import merge

    merge([stills.root, poses.root], tmp_path / "merged", mixed=True)
    export(tmp_path / "merged", "kitti", output=tmp_path)
    for sample in stills:
        for kind in ("label_2", "calib"):
            file = f"training/{kind}/{sample.index:06d}.txt"
            assert (tmp_path / "kitti" / file).read_text() == (written("stills") / file).read_text()


@pytest.mark.slow
def test_merged_rigs_are_refused(videos, drives, tmp_path):
    from viewsphere.run.datasets.merging import merge

    merge([videos.root, drives.root], tmp_path / "merged", mixed=True)
    told = "expected shots with their rigs, which imported and merged data sets do not have; found none"
    for entry in ({"kitti": {"task": "tracking"}}, "kitti_odometry", "nuscenes"):
        with pytest.raises(UserError, match=told):
            export(tmp_path / "merged", [entry], output=tmp_path / "no")
    with pytest.raises(UserError, match=f"frame 0: {told}"):
        export(tmp_path / "merged", "kitti", output=tmp_path / "no")
    assert not (tmp_path / "no" / "kitti").exists()


def test_datumaro_reads_it(stills, written):
    datumaro = pytest.importorskip("datumaro")
    folder = written("stills")
    for name, path in (("kitti3d", folder / "training"), ("kitti_detection", folder)):
        read = datumaro.Dataset.import_from(str(path), name)
        labels = read.categories()[datumaro.AnnotationType.label]
        items = {item.id: item for item in read}
        assert len(items) == len(stills)
        for sample in stills:
            boxes = items[f"{sample.index:06d}"].annotations
            expected = boxes_of(sample)
            close("kitti", f"datumaro {name}: boxes", [box.points for box in boxes], expected, "px")
            equal("kitti", f"datumaro {name}: types", [labels[b.label].name for b in boxes], types_of(sample))
            for box, o in zip(boxes if name == "kitti3d" else (), seen(sample), strict=name == "kitti3d"):
                height, width, length = box.attributes["dimensions"]
                close("kitti", "datumaro kitti3d: sizes", (width, height, length), o.size, "m", atol=1e-6)
                x, y, z = box.attributes["location"]
                middle = o.box3d_camera.mean(axis=0)
                close("kitti", "datumaro kitti3d: middles", (x, y - height / 2, z), middle, "m", atol=1e-6)
                assert box.attributes["occluded"] == o.occlusion_level


def test_torchvision_reads_it(stills, written, tmp_path):
    from torchvision_readers import torchvision_datasets

    datasets = torchvision_datasets()
    shutil.copytree(written("stills"), tmp_path / "Kitti" / "raw")
    read = datasets.Kitti(str(tmp_path))
    by_name = {file.rpartition("/")[2]: i for i, file in enumerate(read.images)}
    for sample in stills:
        image, targets = read[by_name[f"{sample.index:06d}.png"]]
        equal("kitti", "torchvision Kitti: pictures", np.array(image), sample.rgb)
        expected = boxes_of(sample)
        close("kitti", "torchvision Kitti: boxes", [target["bbox"] for target in targets], expected, "px")
        turns = [target["rotation_y"] for target in targets]
        fronts = [-o.camera_from_object[:3, 1] for o in seen(sample)]
        close("kitti", "torchvision Kitti: headings", turns, [math.atan2(-f[2], f[0]) for f in fronts], "rad", atol=1e-8)
