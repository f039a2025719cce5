"""KITTI's data sets made elsewhere: by datumaro, by hand after the development kit, and our own, which go out equal again."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from PIL import Image
from test_kitti import corners, nearest

from proven import close, equal
from small import tree_hash
from viewsphere import Dataset, convert
from viewsphere.check import check
from viewsphere.errors import StoreError, UserError
from viewsphere.report import write_report
from viewsphere.run.datasets.importing import import_dataset
from viewsphere.run.datasets.merging import merge
from viewsphere.run.exports.exporting import export

SIZE = (124, 37)
P2 = "7.215377e+01 0 6.095593e+01 4.485728e+00 0 7.215377e+01 1.728540e+01 2.163791e-02 0 0 1 2.745884e-03"
CALIB = (
    f"P0: {'1 ' * 12}\nP1: {'1 ' * 12}\nP2: {P2}\nP3: {'1 ' * 12}\n"
    "R0_rect: 1 0 0 0 1 0 0 0 1\nTr_velo_to_cam: 0 -1 0 0 0 0 -1 0 1 0 0 0\n"
)
LABELS = {
    "000000": [
        "Pedestrian 0.00 0 -0.20 71.24 14.30 81.07 30.79 1.89 0.48 1.20 1.84 1.47 8.41 0.01",
        "Truck 0.31 2 -1.57 59.94 15.67 62.98 18.94 2.85 2.63 12.34 0.47 1.49 69.44 -1.56",
        "DontCare -1 -1 -10 50.38 16.97 59.06 19.01 -1 -1 -1 -1000 -1000 -1000 -10",
    ],
    "000001": [],
    "000002": ["Car 0.88 3 2.93 0.00 19.20 40.24 36.40 1.60 1.57 3.23 -2.70 1.74 3.68 -1.29"],
    "000004": ["Cyclist 0.00 1 -10 10.00 9.00 12.00 11.00 -1 -1 -1 -1000 -1000 -1000 -10 0.75"],
}
LINE = LABELS["000000"][0]


def picture(file, seed=0):
    file.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(np.random.default_rng(seed).integers(0, 255, (SIZE[1], SIZE[0], 3), np.uint8)).save(file)


def data_set(folder):
    """Pictures as the object benchmark has them."""
    for number, (name, lines) in enumerate(LABELS.items()):
        picture(folder / f"training/image_2/{name}.png", number)
        for kind, text in (("label_2", "".join(f"{line}\n" for line in lines)), ("calib", CALIB)):
            file = folder / f"training/{kind}/{name}.txt"
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
    return folder


TRACKS = """0 -1 DontCare -1 -1 -10.000000 21.931000 18.849000 24.550000 21.856000 -1000 -1000 -1000 -10 -1 -1 -1
0 0 Van 0 0 -1.793451 29.674 16.173 45.522 29.228 2.000000 1.823255 4.433886 -4.552284 1.858523 13.410495 -2.115488
0 12 Cyclist 2 1 -1.936993 73.748 16.129 76.475 26.456 1.739063 0.824591 1.785241 1.640400 1.675660 5.776261 -1.675458
2 0 Van 1 2 -1.796862 29.4 16.1 45.2 29.7 2.000000 1.823255 4.433886 -4.650955 1.766774 13.581085 -2.121565
"""


def tracked(folder):
    """A sequence as the tracking benchmark has it."""
    for instant in range(3):
        picture(folder / f"training/image_02/0011/{instant:06d}.png", instant)
    for kind, text in (("label_02", TRACKS), ("calib", CALIB.replace("R0_rect:", "R_rect"))):
        (folder / f"training/{kind}").mkdir()
        (folder / f"training/{kind}/0011.txt").write_text(text)
    return folder


def whole(dataset):
    report = check(dataset)
    assert report.ok, report.findings
    return dataset


def lines_of(file):
    return [[line.split()[0], *map(float, line.split()[1:])] for line in file.read_text().splitlines()]


@pytest.mark.parametrize("task", ["object", "tracking"])
@pytest.mark.slow
def test_an_export_comes_back_and_goes_out_equal(task, stills, drives, tmp_path):
    own = stills if task == "object" else drives
    export(own.root, [{"kitti": {"task": task}}], output=tmp_path / "one")
    first = tmp_path / "one/kitti"
    before = tree_hash(first)
    import_dataset("kitti", first, tmp_path / "in")
    read = whole(Dataset(tmp_path / "in"))
    export(tmp_path / "in", [{"kitti": {"task": task}}], output=tmp_path / "two")
    second, lost = tmp_path / "two/kitti", {"image_03", "velodyne", "checksums.xxh128"}
    for file in (file.relative_to(first) for file in first.rglob("*") if file.is_file()):
        one, other = (place / file for place in (first, second))
        if task == "tracking" and "calib" in file.parts:  # the right camera's and the LiDAR's are lost
            one, other = ([line for line in at.read_text().splitlines() if line[:3] in ("P0:", "P2:")] for at in (one, other))
            assert one == other and len(one) == 2
        elif not lost & set(file.parts):
            assert one.read_bytes() == other.read_bytes(), file
    assert tree_hash(first) == before and (read.splits, len(read)) == (own.splits, len(own) // (1 if task == "object" else 3))


def test_what_was_ours_is_known_again(drives, tmp_path):
    export(drives.root, [{"kitti": {"task": "tracking"}}], output=tmp_path / "one")
    import_dataset("kitti", tmp_path / "one/kitti", tmp_path / "in")
    read = Dataset(tmp_path / "in")
    for name, number in zip(drives.sequences, read.sequences, strict=True):
        for sample, own in zip(read.sequence(number), drives.sequence(name, "left"), strict=True):
            equal("kitti", "import: colours", sample.rgb, own.rgb)
            close("kitti", "import: K", sample.camera.K, own.camera.K, "px", atol=1e-10)
            assert (sample.split, sample.instant, sample.sequence) == (own.split, own.instant, number)
            shown = [o for o in own.objects if o.box2d]
            assert [o.id for o in sample.objects] == [o.id for o in shown]
            for o, other in zip(sample.objects, shown, strict=True):
                assert o.box2d == other.box2d and o.occlusion_level == other.occlusion_level
                assert o.truncation_level == other.truncation_level and math.isnan(o.visibility)
                close("kitti", "import: sizes", o.size, other.size, "m", atol=1e-8)
                middle = other.box3d_camera.mean(axis=0)
                close("kitti", "import: middles", o.box3d_camera.mean(axis=0), middle, "m", atol=1e-8)


def test_the_development_kits_boxes(tmp_path):
    """The labels of the world are the file's; corners are computeBox3D's; pixels are those of P2, with its fourth column."""
    projection, seen = np.array(P2.split(), float).reshape(3, 4), 0
    import_dataset("kitti", data_set(tmp_path / "mine"), tmp_path / "in")
    dataset = whole(Dataset(tmp_path / "in"))
    assert [category.name for category in dataset.categories] == ["Car", "Truck", "Pedestrian", "Cyclist"]
    for sample, (name, lines) in zip(dataset, LABELS.items(), strict=True):
        assert sample.source["file_name"] == f"{name}.png" and sample.split == "train"
        own = [line.split() for line in lines if not line.startswith("DontCare")]
        for o, line in zip(sample.objects, own, strict=True):
            assert (o.category, o.occlusion_level) == (line[0], int(line[2]))
            close("kitti", "by hand, import: truncation", o.truncation, float(line[1]))
            close(
                "kitti",
                "by hand, import: boxes",
                np.subtract(o.box2d, (0, 0, 1, 1)),
                list(map(float, line[4:8])),
                "px",
                atol=1e-12,
            )
            if o.is_placed:
                seen += 1
                box = corners(*map(float, line[8:15]))
                told = o.box3d[:, [0, 2, 1]] * (1, -1, 1)  # x right, y down, z ahead
                close("kitti", "by hand, computeBox3D: corners", nearest(told, box), 0, "m", atol=1e-12)
                homogeneous = np.column_stack([told, np.ones(8)]) @ projection.T
                pixels = homogeneous[:, :2] / homogeneous[:, 2:] + 0.5
                ahead = o.box3d_in_front
                close("kitti", "by hand, P2: vertices", o.box3d_pixels[ahead], pixels[ahead], "px", atol=1e-8)
                front, turn = o.world_from_object[:2, 1] * (-1, -1), float(line[14])
                close("kitti", "by hand: headings", front, (math.cos(turn), -math.sin(turn)), "", atol=1e-12)
                assert o.world_from_object[2, 2] == 1 and o.pose_category
    assert seen == 3
    assert dataset[0].source["dont_care"] == [[50.38, 16.97, 60.06, 20.01]] and dataset[3].objects[0].source["score"] == 0.75


@pytest.mark.parametrize("calibrated", [True, False])
def test_labels_go_out_as_they_came(calibrated, tmp_path):
    """Without a calibration, or with a P2 whose fourth column is 0, to the last digit."""
    source = data_set(tmp_path / "mine")
    for file in (source / "training/calib").iterdir():
        words = P2.split()
        words[3::4] = "0", "0", "0"
        file.write_text(CALIB.replace(P2, " ".join(words)))
        if not calibrated:
            file.unlink()
    before = tree_hash(source)
    import_dataset("kitti", source / "training", tmp_path / "in")
    assert (Dataset(tmp_path / "in")[0].known_camera is not None) == calibrated
    export(tmp_path / "in", ["kitti", "coco", "voc"])
    for index, (name, lines) in enumerate(LABELS.items()):
        found = lines_of(tmp_path / f"in/kitti/training/label_2/{index:06d}.txt")
        for row, line in zip(found, lines, strict=True):
            words = line.split()
            assert row[0] == words[0]
            close("kitti", "by hand: import and export", row[1:], list(map(float, words[1:15])), "", atol=1e-8)
        image = (source / f"training/image_2/{name}.png").read_bytes()
        assert (tmp_path / f"in/kitti/training/image_2/{index:06d}.png").read_bytes() == image
    assert tree_hash(source) == before
    whole(Dataset(tmp_path / "in"))


def test_omni3d_takes_what_nobody_knows_as_minus_one(tmp_path):
    import_dataset("kitti", data_set(tmp_path / "mine"), tmp_path / "in")
    export(tmp_path / "in", ["omni3d"])
    (file,) = (tmp_path / "in/omni3d").rglob("viewsphere_*.json")
    said, objects = (
        json.loads(file.read_text())["annotations"],
        [o for sample in Dataset(tmp_path / "in") for o in sample.objects],
    )
    assert [one["visibility"] for one in said] == [-1] * len(objects) and {one["valid3D"] for one in said} == {True, False}
    assert [one["valid3D"] for one in said] == [o.is_boxed for o in objects]


def test_tracks_by_hand(tmp_path):
    import_dataset("kitti", tracked(tmp_path / "mine"), tmp_path / "in")
    dataset = whole(Dataset(tmp_path / "in"))
    assert dataset.sequences == ("0011",) and [len(sample.objects) for sample in dataset] == [2, 0, 1]
    assert [[o.id for o in sample.objects] for sample in dataset] == [[1, 13], [], [1]]
    assert [o.source["track_id"] for o in dataset[0].objects] == [0, 12]
    export(tmp_path / "in", [{"kitti": {"task": "tracking"}}])
    found = (tmp_path / "in/kitti/training/label_02/0011.txt").read_text().splitlines()
    assert [line.split()[:5] for line in found] == [
        ["0", "1", "Van", "0", "0"],
        ["0", "13", "Cyclist", "2", "1"],
        ["0", "-1", "DontCare", "-1", "-1"],
        ["2", "1", "Van", "1", "2"],
    ]
    assert (tmp_path / "in/kitti/evaluate_tracking.seqmap.training").read_text() == "0011 empty 000000 000003\n"


def test_a_still_picture_has_no_track(tmp_path):
    import_dataset("kitti", data_set(tmp_path / "mine"), tmp_path / "in")
    with pytest.raises(UserError, match="frame 0: expected one of a sequence; found a still picture"):
        export(tmp_path / "in", [{"kitti": {"task": "tracking"}}])
    assert not (tmp_path / "in/kitti").exists()


def test_lists_are_splits(tmp_path):
    source = data_set(tmp_path / "mine")
    picture(source / "testing/image_2/000000.png")
    (source / "ImageSets").mkdir()
    for split, names in {"val": "000001\n000000\n", "train": "000002\n", "trainval": "000004\n", "test": "000000\n"}.items():
        (source / f"ImageSets/{split}.txt").write_text(names)
    foreign = import_dataset("kitti", source, tmp_path / "in")
    assert (foreign.splits, foreign.count, foreign.left_out) == (("train", "val"), 3, ())
    assert [(sample.split, sample.source["file_name"][:6]) for sample in Dataset(tmp_path / "in")] == [
        ("val", "000000"),
        ("val", "000001"),
        ("train", "000002"),
    ]


def test_datumaros_tree(tmp_path):
    datumaro = pytest.importorskip("datumaro")
    rng = np.random.default_rng(2)
    boxes = {name: np.sort(rng.integers(0, 30, (number, 2, 2)), axis=1) for name, number in (("a", 2), ("b", 0), ("c", 3))}
    items = [
        datumaro.DatasetItem(
            name,
            subset="training",
            media=datumaro.Image.from_numpy(np.full((SIZE[1], SIZE[0], 3), 9, np.uint8)),
            annotations=[
                datumaro.Bbox(x0, y0, x1 - x0, y1 - y0, label=i % 2, attributes={"truncated": i == 0, "occluded": i == 1})
                for i, ((x0, y0), (x1, y1)) in enumerate(own.tolist())
            ],
        )
        for name, own in boxes.items()
    ]
    made = datumaro.Dataset.from_iterable(items, categories=["tram", "sloth"])
    made.export(str(tmp_path / "mine"), "kitti_detection", save_media=True)
    (left_out,) = import_dataset("kitti", tmp_path / "mine", tmp_path / "in", keep_going=True).left_out
    assert "training/label_2/b.txt, empty where there are no objects; found no such file" in left_out
    dataset = whole(Dataset(tmp_path / "in"))
    assert len(dataset) == 2 and {c.name for c in dataset.categories} == {"tram", "sloth"}
    for sample, own in zip(dataset, (boxes["a"], boxes["c"]), strict=True):
        assert [o.category for o in sample.objects] == ["tram", "sloth", "tram"][: len(own)]
        found = [np.subtract(o.box2d, (0, 0, 1, 1)) for o in sample.objects]
        close("kitti", "import of datumaro's: boxes", found, own.reshape(-1, 4), "px")
        assert sample.known_camera is None and not any(o.is_placed for o in sample.objects)


@pytest.mark.slow
def test_it_is_reported_and_merged(stills, tmp_path):
    import_dataset("kitti", data_set(tmp_path / "mine"), tmp_path / "in")
    write_report(Dataset(tmp_path / "in"), tmp_path / "report.html")
    assert b"Pedestrian" in (tmp_path / "report.html").read_bytes()
    joined = merge([stills.root, tmp_path / "in"], tmp_path / "joined", mixed=True)
    assert len(joined) == 4 + len(stills)
    whole(joined)
    export(joined.root, "coco")


BAD = {
    "1 2 3": "expected 15 values, or one more; found 3",
    f"{LINE} 1 2": "expected 15 values, or one more; found 17",
    LINE.replace("1.84", "nan"): "expected finite numbers below 1,000,000; found ",
    LINE.replace("1.84", "1e300"): "expected finite numbers below 1,000,000; found ",
    LINE.replace("1.84", "x"): "expected a number; found 'x'",
    LINE.replace("0.00 0", "1.5 0"): "expected truncated -1, or 0 to 1; found 1.5",
    LINE.replace("0.00 0", "0 7"): "expected occluded -1 to 3; found 7",
    LINE.replace("71.24", "91.24"): "expected left <= right, top <= bottom; found 91.24 14.3 81.07 30.79",
    LINE.replace("1.89", "-1"): "expected height, width and length above 0; found -1 0.48 1.2",
}


def test_broken_lines_are_named_and_left_out(tmp_path):
    source = data_set(tmp_path / "mine")
    file = source / "training/label_2/000001.txt"
    file.write_text("\n".join([LINE, *BAD]))
    with pytest.raises(StoreError) as error:
        import_dataset("kitti", source, tmp_path / "in")
    for number, (line, message) in enumerate(zip(str(error.value).splitlines(), BAD.values(), strict=False), 2):
        assert line.startswith(f"{file}: line {number}: ") and message in line
    assert len(str(error.value).splitlines()) == len(BAD) + 1 and not (tmp_path / "in").exists()
    foreign = import_dataset("kitti", source, tmp_path / "in", keep_going=True)
    assert len(foreign.left_out) == len(BAD) and len(whole(Dataset(tmp_path / "in"))[1].objects) == 1


def test_broken_tracks(tmp_path):
    source, file = tracked(tmp_path / "mine"), tmp_path / "mine/training/label_02/0011.txt"
    line = TRACKS.splitlines()[1]
    bad = {
        line: "expected every track once in a frame; found 0 again",
        line.replace("0 0 Van", "0 -1 Van"): "expected a track; found -1 of a Van",
        line.replace("0 0 Van", "0 9999999 Van"): "expected numbers of a frame and a track; found 0 9999999",
        line.replace("0 0 Van 0", "0 1 Van 0.5"): "expected truncated -1 to 2; found 0.5",
        line.replace("0 0 Van", "-1 0 Van"): "expected numbers of a frame and a track; found -1 0",
        line.replace("0 0 Van", f"{'9' * 5000} 0 Van"): "expected a number; found '" + "9" * 59,
        line.replace("0 0 Van", "8 0 Van"): "expected a picture of frame 8; found none",
    }
    file.write_text(TRACKS + "\n".join(bad))
    with pytest.raises(StoreError) as error:
        import_dataset("kitti", source, tmp_path / "in")
    for line, message in zip(str(error.value).splitlines()[:-1], bad.values(), strict=True):
        assert line.startswith(f"{file}: ") and line.endswith(message), line
    assert import_dataset("kitti", source, tmp_path / "in", keep_going=True).count == 3
    whole(Dataset(tmp_path / "in"))


def test_pictures_labels_and_calibrations_that_cannot_be_used(tmp_path, monkeypatch):
    source = data_set(tmp_path / "mine")
    base, calib = (
        source / "training",
        {
            "no_p2": "P0: 1\n",
            "flat": CALIB.replace(P2, P2.replace("7.2", "-7.2", 1)),
            "nan": "P2:" + 12 * " nan",
            "point": "P2: 1e-300 0 0 1e6 0 1e-300 0 1e6 0 0 1 0",
        },
    )
    Image.new("RGB", SIZE).save(tmp_path / "secret.png")
    (base / "image_2/link.png").symlink_to(tmp_path / "secret.png")
    for name in ("unlabelled", "cut", "bytes", "crowded", *calib):
        picture(base / f"image_2/{name}.png")
    for name in ("link", "cut", "crowded", *calib):
        (base / f"label_2/{name}.txt").write_text("")
    (base / "label_2/bytes.txt").write_bytes(b"\xff\xfe")
    (base / "label_2/crowded.txt").write_text(f"{LINE}\n" * 5)
    (base / "image_2/cut.png").write_bytes((base / "image_2/cut.png").read_bytes()[:20])
    (base / "label_2/alone.txt").write_text(LINE)
    for name, text in calib.items():
        (base / f"calib/{name}.txt").write_text(text)
    expected = {
        "../../secret": "found a path that leads outside",
        "/etc/passwd": "found a path that leads outside",
        "link": "found a link that leads out of it",
        "nowhere": "expected a picture; found no training/image_2/nowhere",
        "unlabelled": "expected training/label_2/unlabelled.txt, empty where there are no objects; found no such file",
        "cut": "Truncated|cannot identify",
        "bytes": "expected lines of labels in bytes.txt; found: 'utf-8' codec can't decode",
        "crowded": "expected at most 4 objects in a picture (limit MAX_IMPORTED_OBJECTS) in crowded.txt; found 5",
        **dict.fromkeys(calib, "expected P2 of a pinhole, 12 numbers, in "),
    }
    monkeypatch.setenv("VIEWSPHERE_MAX_IMPORTED_OBJECTS", "4")
    (source / "ImageSets").mkdir()
    listed = source / "ImageSets/train.txt"
    listed.write_text("\n".join([*expected, "000000"]))
    from viewsphere.formats.kitti import read

    found = read(source, keep_going=True)
    for (name, message), line in zip(expected.items(), found.left_out, strict=False):
        assert line.startswith(f"{listed}: {name}: ") and any(part in line for part in message.split("|")), line
    assert found.left_out[len(expected) :] == (
        f"{base}/label_2/alone.txt: expected pictures of these labels; found none in {base}/image_2",
    )
    with pytest.raises(StoreError, match="mend them, or leave them out with --keep-going"):
        import_dataset("kitti", source, tmp_path / "in")
    assert not (tmp_path / "in").exists()
    assert import_dataset("kitti", source, tmp_path / "in", keep_going=True).count == 1


def test_a_text_that_is_too_large(tmp_path, monkeypatch):
    monkeypatch.setenv("VIEWSPHERE_MAX_ANNOTATION_BYTES", "200")
    source = data_set(tmp_path / "mine")
    with pytest.raises(StoreError) as error:
        import_dataset("kitti", source, tmp_path / "in")
    assert "at most 200 bytes are allowed (limit MAX_ANNOTATION_BYTES)" in str(error.value).splitlines()[0]


def test_what_is_no_data_set_says_so(tmp_path):
    for place in (tmp_path, tmp_path / "no", __file__):
        with pytest.raises(StoreError, match=r"expected a KITTI data set \(training/image_2 .*\); found no such folders"):
            import_dataset("kitti", place, tmp_path / "out")
    (tmp_path / "training/image_2").mkdir(parents=True)
    (tmp_path / "training/label_2").mkdir()
    with pytest.raises(StoreError, match="expected pictures that can be used; found none"):
        import_dataset("kitti", tmp_path, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_two_pictures_of_an_instant_are_told(tmp_path):
    folder = tracked(tmp_path / "mine") / "training/image_02/0011"
    (folder / "2.png").write_bytes((folder / "000002.png").read_bytes())
    with pytest.raises(StoreError, match=r"expected one picture of an instant; found 0011/000002, too"):
        import_dataset("kitti", tmp_path / "mine", tmp_path / "out")
    foreign = import_dataset("kitti", tmp_path / "mine", tmp_path / "out", keep_going=True)
    assert (foreign.count, len(foreign.left_out)) == (3, 1)


def test_what_some_pictures_tell_is_enough(tmp_path):
    """The first picture has no calibration, and the others have one: formats that leave some out take the data set."""
    source = data_set(tmp_path / "mine")
    (source / "training/calib/000000.txt").unlink()
    convert("kitti", source, "pascal3d", tmp_path / "out")
    assert (tmp_path / "out/pascal3d/Annotations").is_dir()
    with pytest.raises(UserError, match="found imported pictures, of which nobody knows when they were taken"):
        convert("kitti", tracked(tmp_path / "moving"), "mot", tmp_path / "mot")


def test_a_damaged_picture_is_named_as_the_source_has_it(tmp_path):
    source = data_set(tmp_path / "mine")
    file = source / "training/image_2/000002.png"
    file.write_bytes(file.read_bytes()[:300])
    with pytest.raises(StoreError, match=r"mine/training/image_2/000002.png: expected a whole picture; found a damaged one"):
        convert("kitti", source, "hdf5", tmp_path / "out")
    assert not (tmp_path / "out").exists()
    for inside in (source, source / "training"):
        with pytest.raises(UserError, match="-o: expected a folder outside of the data set that is read"):
            convert("kitti", source, "kitti", inside)
