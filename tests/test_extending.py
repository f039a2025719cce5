"""The worked example of docs/extending.md is real: its code is taken from the page and run."""

import csv
import re
import sys
import types
from importlib.metadata import EntryPoint
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from viewsphere import Dataset, plugins
from viewsphere.check import check
from viewsphere.run.exporting import export

PAGE = Path(__file__).parent.parent / "docs" / "extending.md"


@pytest.fixture
def csv_boxes(monkeypatch: pytest.MonkeyPatch) -> None:
    code = re.search(r"```python\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
    assert code is not None
    module = types.ModuleType("my_csv_boxes")
    exec(code[1], module.__dict__)
    monkeypatch.setitem(sys.modules, "my_csv_boxes", module)
    entry = EntryPoint("csv_boxes", "my_csv_boxes", "viewsphere.formats")
    monkeypatch.setattr(plugins, "entry_points", lambda group: (entry,) if group == entry.group else ())


@pytest.mark.usefixtures("csv_boxes")
def test_a_format_is_one_file(small_dataset, tmp_path):
    assert "csv_boxes" in plugins.names("formats")
    export(small_dataset.root, ["csv_boxes"])
    folder = small_dataset.root / "csv_boxes"
    with (folder / "boxes.csv").open() as file:
        rows = list(csv.DictReader(file))
    seen = [(s, o) for s in small_dataset for o in s.objects if o.box2d is not None]
    assert len(rows) == len(seen) > 0
    for row, (sample, o) in zip(rows, seen, strict=True):
        assert tuple(float(row[k]) for k in ("x0", "y0", "x1", "y1")) == o.box2d
        assert row["category"] == o.category
        assert np.array_equal(np.asarray(Image.open(folder / row["image"])), sample.rgb)


@pytest.mark.usefixtures("csv_boxes")
@pytest.mark.parametrize("name", ["boxes.csv", "{split}/{index:06d}.png"])
def test_it_proves_itself(small_dataset, name):
    export(small_dataset.root, ["csv_boxes"])
    assert check(small_dataset, rays=False).checked["csv_boxes"] == len(small_dataset)
    sample = small_dataset[1]
    file = small_dataset.root / "csv_boxes" / name.format(split=sample.split, index=sample.index)
    data = file.read_bytes()
    file.unlink()
    file.write_bytes(data[:-3])
    assert [f.check for f in check(small_dataset, rays=False).findings] == ["csv_boxes"]


@pytest.mark.usefixtures("csv_boxes")
def test_every_sample_is_read_once_for_all_formats(small_dataset, tmp_path, monkeypatch):
    read = []
    samples = Dataset._sample
    monkeypatch.setattr(Dataset, "_sample", lambda self, *args: read.append(args) or samples(self, *args))
    export(small_dataset.root, ["csv_boxes", "coco", "native"])
    assert len(read) == len(small_dataset)
