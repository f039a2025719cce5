"""MOTChallenge, read by our own reader and, where they are installed, by motmetrics and datumaro: the same boxes and tracks."""

from __future__ import annotations

import configparser

import numpy as np
import pytest
from PIL import Image

from proven import close, equal
from viewsphere import Dataset, generate
from viewsphere.errors import UserError
from viewsphere.run.exports.exporting import export
from worlds import videos as recipe


@pytest.fixture(scope="module")
def written(videos, tmp_path_factory):
    made = {}

    def get(**options):
        key = tuple(options.items())
        if key not in made:
            made[key] = tmp_path_factory.mktemp("mot")
            export(videos.root, [{"mot": options}], output=made[key])
        return made[key] / "mot"

    return get


def of_sequences(dataset):
    """The samples of each sequence's folder, in the order of instants."""
    found = {}
    for sample in dataset:
        found.setdefault(f"{sample.split}/{sample.sequence}-{sample.sensor}", []).append(sample)
    return found


def rows(file):
    return [tuple(map(float, line.split(","))) for line in file.read_text().splitlines()]


@pytest.mark.parametrize(("boxes", "field"), [("visible", "box2d"), ("whole", "box2d_projected")])
def test_boxes_ids_and_visibility(videos, written, boxes, field):
    folder, count = written(boxes=boxes), 0
    assert {path.parent.relative_to(folder).as_posix() for path in folder.glob("*/*/seqinfo.ini")} == set(of_sequences(videos))
    for name, samples in of_sequences(videos).items():
        found = rows(folder / name / "gt" / "gt.txt")
        expected = [(s.instant + 1, o) for s in samples for o in s.objects if getattr(o, field)]
        equal("mot", "own reader: frames", [row[0] for row in found], [frame for frame, _ in expected])
        equal("mot", "own reader: track ids", [row[1] for row in found], [o.id for _, o in expected])
        left, top, width, height = np.array(found).T[2:6]
        corners = np.stack([left - 1, top - 1, left - 1 + width, top - 1 + height], 1)
        close("mot", "own reader: boxes", corners, [getattr(o, field) for _, o in expected], "px", atol=1e-7)
        equal("mot", "own reader: classes", [row[7] for row in found], [o.category_id for _, o in expected])
        close("mot", "own reader: visibility", [row[8] for row in found], [o.visibility for _, o in expected], atol=1e-6)
        assert {row[6] for row in found} == {1}
        count += len(found)
    assert count >= 30


def test_pictures_and_what_is_said_of_them(videos, written):
    for name, samples in of_sequences(videos).items():
        told = configparser.ConfigParser()
        told.read(written() / name / "seqinfo.ini")
        said = told["Sequence"]
        assert said["name"] == name.partition("/")[2]
        assert [int(said[key]) for key in ("frameRate", "seqLength", "imWidth", "imHeight")] == [10, 6, 160, 120]
        pictures = sorted((written() / name / said["imDir"]).iterdir())
        assert [picture.name for picture in pictures] == [f"{i:06d}{said['imExt']}" for i in range(1, 7)]
        for picture, sample in zip(pictures, samples, strict=True):
            with Image.open(picture) as opened:
                equal("mot", "own reader: pictures", np.asarray(opened), sample.rgb)
        labels = (written() / name / "gt" / "labels.txt").read_text().splitlines()
        assert labels == [category.name for category in videos.categories]


def test_motmetrics_reads_it(videos, written, monkeypatch):
    pytest.importorskip("pandas")
    monkeypatch.setattr(np, "asfarray", lambda values, dtype=float: np.asarray(values, dtype), raising=False)
    motmetrics = pytest.importorskip("motmetrics")
    for name, samples in of_sequences(videos).items():
        read = motmetrics.io.loadtxt(str(written() / name / "gt" / "gt.txt"), fmt="mot16", min_confidence=1)
        expected = {(s.instant + 1, o.id): o for s in samples for o in s.objects if o.box2d}
        assert set(read.index) == set(expected)
        for key, o in expected.items():
            row = read.loc[key]
            box = (row.X, row.Y, row.X + row.Width, row.Y + row.Height)
            close("mot", "motmetrics: boxes", box, o.box2d, "px", atol=1e-9)
            equal("mot", "motmetrics: classes", row.ClassId, o.category_id)
            close("mot", "motmetrics: visibility", row.Visibility, o.visibility, atol=1e-6)
        against = motmetrics.utils.compare_to_groundtruth(read, read, "iou")
        scores = motmetrics.metrics.create().compute(against, metrics=["mota", "idf1"])
        assert scores.to_numpy().tolist() == [[1, 1]]


@pytest.mark.filterwarnings("ignore")
def test_datumaro_reads_it(videos, written):
    datumaro = pytest.importorskip("datumaro")
    for name, samples in of_sequences(videos).items():
        read = datumaro.Dataset.import_from(str(written() / name), "mot_seq")
        names = [label.name for label in read.categories()[datumaro.AnnotationType.label].items]
        items = {int(item.id): item for item in read}
        assert len(items) == len(samples)
        for sample in samples:
            item, seen = items[sample.instant + 1], [o for o in sample.objects if o.box2d]
            boxes = np.array([one.points for one in item.annotations]) - 1  # it leaves boxes 1-based
            close("mot", "datumaro: boxes", boxes, [o.box2d for o in seen], "px", atol=1e-2)
            equal("mot", "datumaro: classes", [names[one.label] for one in item.annotations], [o.category for o in seen])
            equal("mot", "datumaro: track ids", [one.attributes["track_id"] for one in item.annotations], [o.id for o in seen])
            equal("mot", "datumaro: pictures", item.media.data[..., ::-1], sample.rgb)


def test_names_pictures_without_objects_and_odd_frame_rates(tmp_path):
    """A sensor that looks away; names with commas, quotes and letters of others; more frames a second than whole ones."""
    name = 'aço, "1" a=b'
    said = recipe(
        rig={"sensors": {"ahead": {}, "behind": {"rotation": [0, 180, 0]}}},
        models=[{"source": "zoo:post_box", "category": name}],
        time={"frames": 3, "fps": 12.5},
        scene={"ground": True},
        channels=["rgb", "instances"],
        annotations=[],
        tracks=None,
        splits={},
    )
    generate(said, tmp_path / "out")
    data = Dataset(tmp_path / "out")
    export(data.root, "mot", output=tmp_path)
    for folder in (path.parent for path in (tmp_path / "mot").glob("*/*/seqinfo.ini")):
        own = data.sequence("post_box_000", folder.name.removeprefix("post_box_000-"))
        assert "frameRate=12.5\n" in (folder / "seqinfo.ini").read_text()
        assert (folder / "gt" / "labels.txt").read_text("utf-8") == name + "\n"
        boxes = [(s.instant + 1, *o.box2d) for s in own for o in s.objects if o.box2d]
        assert len(boxes) == (3 if own[0].sensor == "ahead" else 0)
        lines = [f"{i},1,{x + 1:g},{y + 1:g},{u - x:g},{v - y:g},1,1,1" for i, x, y, u, v in boxes]
        assert (folder / "gt" / "gt.txt").read_text().splitlines() == lines


def test_what_it_refuses(stills, tmp_path):
    with pytest.raises(UserError, match=r"format mot: expected sequences .a recipe's time.; found still pictures"):
        export(stills.root, "mot", output=tmp_path)


@pytest.mark.parametrize("name", ["a\nb", " a", "a\r"])
def test_names_of_more_than_a_line_are_refused(videos, name):
    from dataclasses import replace

    from viewsphere.formats.mot import FORMAT
    from viewsphere.run.exports.scope import scope_of

    scope = scope_of(videos)
    odd = replace(scope, categories=(replace(scope.categories[0], name=name),))
    assert list(FORMAT.refuses(scope, FORMAT.options())) == []
    (problem,) = FORMAT.refuses(odd, FORMAT.options())
    assert problem.endswith(f"found {name!r}")
