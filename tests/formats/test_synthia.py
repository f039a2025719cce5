"""SYNTHIA, read by datumaro where it is installed, and by OpenCV and numpy as its readmes say: the same classes, objects, depth
and cameras.
"""

from __future__ import annotations

import shutil
from dataclasses import replace

import cv2
import numpy as np
import pytest

from proven import close, equal
from viewsphere.errors import UserError
from viewsphere.formats.synthia import COLORS, FORMAT, Synthia
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.sensors.rig import Rig, Sensor
from viewsphere.run.exports.exporting import export
from viewsphere.run.exports.scope import scope_of
from viewsphere.store import Category

CLASSES = {"sky": 1, "ground": 0, "car": 8, "chair": 0, "post_box": 0}
SWAP = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])


@pytest.fixture(scope="module")
def rand(stills, tmp_path_factory):
    place = tmp_path_factory.mktemp("rand")
    export(stills.root, [{"synthia": {"layout": "rand"}}], output=place)
    return place / "synthia"


@pytest.fixture(scope="module")
def seqs(videos, tmp_path_factory):
    place = tmp_path_factory.mktemp("seqs")
    export(videos.root, [{"synthia": {"layout": "seqs"}}], output=place)
    return place / "synthia"


def numbers(dataset, first):
    """The number of each class, by our own number of it."""
    found = {c.id: CLASSES.get(c.name, 0) for c in dataset.classes}
    unknown = [c for c in dataset.classes if c.is_thing and c.name != "car"]
    return found | {c.id: first + i for i, c in enumerate(unknown)}


def named(dataset, sample, first):
    table = numbers(dataset, first)
    return np.vectorize(table.get)(sample.semantic)


def any_depth(file):
    return cv2.imread(str(file), cv2.IMREAD_ANYCOLOR | cv2.IMREAD_ANYDEPTH)[..., ::-1]


def test_random_pictures(stills, rand):
    listed = (rand / "ALL.txt").read_text().split()
    assert listed == [f"{sample.index:07d}.png" for sample in stills]
    colors = [line.split() for line in (rand / "label_colors.txt").read_text().splitlines()]
    assert [color[3] for color in colors] == [*COLORS, "TrafficLight", "chair", "post_box"]
    assert len({tuple(color[:3]) for color in colors}) == len(colors)
    for sample in stills:
        name, expected = f"{sample.index:07d}", named(stills, sample, 14)
        equal("synthia", "numpy: classes of rand", np.loadtxt(rand / f"GTTXT/{name}.txt"), expected)
        painted = np.array(colors)[:, :3].astype(int)[expected]
        equal("synthia", "OpenCV: colours of rand", any_depth(rand / f"GT/{name}.png"), painted)
        equal("synthia", "OpenCV: pictures", any_depth(rand / f"RGB/{name}.png"), sample.rgb)


@pytest.mark.parametrize("kind", ["GTTXT", "GT"])
def test_datumaro_reads_random_pictures(stills, rand, tmp_path, kind):
    datumaro = pytest.importorskip("datumaro")
    copy = shutil.copytree(rand, tmp_path / "rand")
    if kind == "GT":
        shutil.rmtree(copy / "GTTXT")
    read = {item.id: item for item in datumaro.Dataset.import_from(str(copy), "synthia_rand")}
    assert len(read) == len(stills)
    for sample in stills:
        found, item = np.full(sample.semantic.shape, -1), read[f"{sample.index:07d}"]
        for annotation in item.annotations:
            found[annotation.image.astype(bool)] = int(annotation.label)
        equal("synthia", f"datumaro: classes of {kind}", found, named(stills, sample, 14))
        equal("synthia", "datumaro: pictures", item.media.data[..., ::-1], sample.rgb)


def test_sequences(videos, seqs):
    for sample in videos:
        root, camera = seqs / f"SYNTHIA-SEQS-{sample.sequence}", f"Stereo_{sample.sensor.capitalize()}/Omni_F"
        name = f"{camera}/{sample.instant:06d}"
        equal("synthia", "OpenCV: pictures", any_depth(root / f"RGB/{name}.png"), sample.rgb)
        labels = any_depth(root / f"GT/LABELS/{name}.png")
        assert labels.dtype == np.uint16 and not labels[..., 2].any()
        equal("synthia", "OpenCV: classes", labels[..., 0], named(videos, sample, 16))
        equal("synthia", "OpenCV: objects", labels[..., 1], sample.instances)
        color = any_depth(root / f"GT/COLOR/{name}.png")
        equal("synthia", "OpenCV: colours", (color == COLORS["Car"]).all(-1), labels[..., 0] == 8)
        depth, seen = any_depth(root / f"Depth/{name}.png"), np.isfinite(sample.depth) & (sample.depth < 655.34)
        assert depth.dtype == np.uint16 and (depth == depth[..., :1]).all()
        equal("synthia", "OpenCV: where depth is", depth[..., 0] != 65535, seen)
        close("synthia", "OpenCV: depth", depth[..., 0][seen] / 100, sample.depth[seen], "m", atol=0.00501)
        numbers = np.loadtxt(root / f"CameraParams/{name}.txt")
        matrix = numbers.reshape(4, 4, order="F")
        ours = SWAP @ matrix @ np.diag([1, -1, 1, 1])  # world from camera, both as we have them
        close("synthia", "numpy: cameras", ours[:3, :3], sample.camera.R.T, "1", atol=1e-12)
        close("synthia", "numpy: cameras", ours[:3, 3], sample.camera.center, "m", atol=1e-12)
        x, up, y = numbers[12:15]  # as public readers take its place
        close("synthia", "numpy: places", (x, y, up), sample.camera.center, "m", atol=1e-12)
        lens, k = (root / "CameraParams/intrinsics.txt").read_text().splitlines(), sample.camera.intrinsics
        assert len(lens) == 7 and not any(lens[1::2])
        close("synthia", "lenses", [float(value) for value in lens[::2]], [k.fx, k.cx, k.cy, 0.1], atol=1e-12)


def test_two_lenses_in_a_sequence_are_an_error(videos):
    tree = Synthia(videos, FORMAT.options(layout="seqs"))
    with pytest.raises(UserError, match="expected one lens in each sequence; found 2 in SYNTHIA-SEQS-a"):
        tree.layout("SYNTHIA-SEQS-a/CameraParams/intrinsics.txt", {"1": 1, "2": 1})


def test_four_sides(videos):
    tree = Synthia(videos, FORMAT.options(layout="seqs"))
    paths = [one.path for one in tree.sample_files(replace(videos[0], sensor="right_B"))]
    assert any("/Stereo_Right/Omni_B/000000.png" in path for path in paths)


def test_what_it_refuses(stills, videos):
    scope, seqs, rand = scope_of(videos), FORMAT.options(layout="seqs"), FORMAT.options(layout="rand")
    assert list(FORMAT.refuses(scope, seqs)) == [] == list(FORMAT.refuses(scope, rand))
    assert list(FORMAT.refuses(scope_of(stills), seqs)) == ["expected sequences (a recipe's time); found still pictures"]
    named = replace(scope, categories=(Category(1, "a 'b\"", ""), Category(2, "Bäume", "")))
    assert list(FORMAT.refuses(named, rand)) == ["expected names of categories without spaces; found 'a \\'b\"'"]
    lens = Intrinsics(width=4, height=4, fx=1, fy=1, cx=2, cy=2)
    four = tuple(Sensor(name=name, intrinsics=lens) for name in ("left_f", "right_f", "left_b"))
    assert list(FORMAT.refuses(replace(scope, rig=Rig(sensors=four)), seqs)) == []
    odd = (four[0], Sensor(name="right_f", intrinsics=lens.model_copy(update={"fx": 2.0})))
    assert list(FORMAT.refuses(replace(scope, rig=Rig(sensors=odd)), seqs)) == [
        "expected cameras of one lens and one focal length; found left_f, right_f"
    ]
    other = tuple(Sensor(name=name, intrinsics=lens) for name in ("a", "b", "c"))
    assert list(FORMAT.refuses(replace(scope, rig=Rig(sensors=other)), seqs)) == [
        "expected one camera, or two that are rectified; found a, b, c"
    ]


def test_a_picture_without_objects(stills):
    sample = replace(stills[0], objects=(), channels={**stills[0].channels, "semantic": np.full((120, 160), 1, np.int32)})
    files = {one.path: one for one in Synthia(stills, FORMAT.options()).sample_files(sample)}
    assert set(files["GTTXT/0000000.txt"].content.make().split()) == {b"1"}
