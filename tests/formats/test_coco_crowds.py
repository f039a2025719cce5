"""COCO's annotations cost what their text is long, not what their picture is large."""

import json
import tracemalloc

import numpy as np
from PIL import Image

from viewsphere.check import check
from viewsphere.geometry.mask import encode_rle
from viewsphere.labels.mask import prove
from viewsphere.run.datasets.importing import import_dataset
from viewsphere.store import Dataset

SIDE = 6000
SQUARE = [10, 20, 110, 20, 110, 220, 10, 220]
"""100 x 200 pixels."""


def crowd(root, side=SIDE):
    """One picture with outlines of every kind, all of one square but the last."""
    (root / "annotations").mkdir(parents=True)
    Image.new("1", (side, side)).save(root / "a.png")
    before, between = 10 * side + 20, side - 200
    runs = [before, *([200, between] * 99), 200, side * side - before - 99 * side - 200]
    outlines = [[SQUARE], {"size": [side, side], "counts": runs}, {"size": [side, side], "counts": [side * side]}, None]
    annotations = [
        {"id": i, "image_id": 1, "category_id": 1, "bbox": [10, 20, 100, 200], "segmentation": outline}
        for i, outline in enumerate(outlines, 1)
    ]
    value = {
        "images": [{"id": 1, "file_name": "a.png", "width": side, "height": side}],
        "annotations": annotations,
        "categories": [{"id": 1, "name": "car"}],
    }
    (root / "annotations" / "instances_train.json").write_text(json.dumps(value), "utf-8")
    return root


def test_no_mask_of_an_imported_object_is_drawn(tmp_path):
    import_dataset("coco", crowd(tmp_path / "small", 400), tmp_path / "warm")  # compiles what is compiled once
    assert not list(prove(Dataset(tmp_path / "warm")[0], {}))
    source = crowd(tmp_path / "coco")
    tracemalloc.start()
    try:
        import_dataset("coco", source, tmp_path / "out")
        sample = Dataset(tmp_path / "out")[0]
        assert not list(prove(sample, {}))
        assert tracemalloc.get_traced_memory()[1] < SIDE * SIDE / 4
    finally:
        tracemalloc.stop()
    assert [o.area for o in sample.objects] == [20_000, 20_000, 0, 0]
    assert [o.box2d for o in sample.objects] == [(10, 20, 110, 220)] * 4
    assert len({o.rle.counts for o in sample.objects}) == 2


def test_codes_are_those_of_the_masks(tmp_path):
    import_dataset("coco", crowd(tmp_path / "coco", 300), tmp_path / "out")
    mask = np.zeros((300, 300), np.bool_)
    mask[20:220, 10:110] = True
    for o, wanted in zip(Dataset(tmp_path / "out")[0].objects, (mask, mask, ~mask & mask, ~mask & mask), strict=True):
        assert o.rle.counts == encode_rle(wanted)


def test_a_wrong_area_of_an_imported_object_is_found(tmp_path):
    import_dataset("coco", crowd(tmp_path / "coco", 300), tmp_path / "out")
    file = next((tmp_path / "out").glob("store/shots/*/*/frames.json"))
    records = json.loads(file.read_text("utf-8"))
    records[0]["objects"][0]["area"] = 7
    file.write_text(json.dumps(records), "utf-8")
    found = check(Dataset(tmp_path / "out")).findings
    assert any("object 1: expected area 20000, found 7" in finding.message for finding in found)
