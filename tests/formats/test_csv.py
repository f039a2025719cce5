"""The format `csv`, read by Python's csv module: values are those of the samples, to the last bit."""

import csv
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from cube_dataset import make
from viewsphere.formats.csv import FORMAT, HEAD, _rows
from viewsphere.recipe.formats import FormatEntry
from viewsphere.run.exports.exporting import write


@pytest.fixture(scope="module", params=[False, True], ids=["one object", "three objects"])
def exported(request, tmp_path_factory):
    root = tmp_path_factory.mktemp("csv")
    dataset = make(root / "out", request.param, ground=True)
    (root / "csv").mkdir()
    write(dataset, [(FormatEntry(name="csv"), root / "csv")])
    with (root / "csv" / "objects.csv").open(newline="", encoding="utf-8") as file:
        return dataset, root / "csv", list(csv.DictReader(file))


def numbers(row, name, parts):
    cells = [row[f"{name}_{part}"] for part in parts]
    return None if cells == [""] * len(parts) else tuple(map(float, cells))


def test_rows_are_the_objects(exported):
    dataset, folder, rows = exported
    objects = [(sample, o) for sample in dataset for o in sample.objects]
    assert len(rows) == len(objects)
    for row, (sample, o) in zip(rows, objects, strict=True):
        assert list(row) == list(HEAD)
        assert (int(row["index"]), row["split"], row["sensor"]) == (sample.index, sample.split, "camera")
        assert (int(row["width"]), int(row["height"])) == Image.open(folder / row["image"]).size
        assert np.array_equal(Image.open(folder / row["image"]), sample.picture)
        for name in ("category", "supercategory", "key", "track", "pose_category"):
            assert row[name] == getattr(o, name)
        for name in ("id", "category_id", "area", "visibility", "truncation"):
            assert float(row[name]) == getattr(o, name)
        for name in ("azimuth_deg", "elevation_deg", "distance", "tilt_deg"):
            assert float(row[name]) == getattr(o.view, name)
        for name in ("box2d", "box2d_projected", "box2d_unclipped"):
            assert numbers(row, name, ("x0", "y0", "x1", "y1")) == getattr(o, name)
        assert numbers(row, "size", ("width", "height", "length")) == tuple(o.size)
        assert numbers(row, "quaternion", "wxyz") == o.quaternion
        assert numbers(row, "translation", "xyz") == tuple(o.camera_from_object[:3, 3])


def test_its_proof_names_the_frame(exported):
    dataset, folder, rows = exported
    assert list(FORMAT.verify(dataset, folder, (), FORMAT.options())) == []
    table = folder / "objects.csv"
    text = table.read_text("utf-8")
    head, last = text.rstrip().rsplit("\n", 1)
    table.write_text(f"{head}\n{last.replace(rows[-1]['area'], '1234567')}\n", "utf-8", newline="\n")
    (frame, line), *more = FORMAT.verify(dataset, folder, (), FORMAT.options())
    assert more == []
    assert frame == int(rows[-1]["index"])
    assert "objects.csv: row" in line
    table.write_text(text, "utf-8", newline="\n")


@pytest.mark.parametrize("text", ["=cmd|'/c calc'!A1", "+1+1", "-2+3", "@SUM(1)", "\tx", "\r=1"])
def test_no_text_is_a_formula_unless_asked_for(exported, text):
    dataset, _, _ = exported
    sample = dataset[0]
    evil = replace(sample, split=text, objects=tuple(replace(o, category=text) for o in sample.objects))
    (row, *_), (plain, *_) = _rows(evil, FORMAT.options()), _rows(evil, FORMAT.options(safe=False))
    at = HEAD.index("split"), HEAD.index("category")
    assert [row[i] for i in at] == [f"'{text}"] * 2
    assert [plain[i] for i in at] == [text] * 2
    for name in ("translation_x", "azimuth_deg", "id"):  # numbers, also negative ones, stay numbers
        assert row[HEAD.index(name)] == plain[HEAD.index(name)]
