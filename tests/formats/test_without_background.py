"""Data sets that keep the picture without its background alone: formats, report and contact sheet use it."""

from __future__ import annotations

import json

import numpy as np
import pytest
from PIL import Image

from cube_dataset import make
from viewsphere.errors import UserError
from viewsphere.labels import channels
from viewsphere.model.channel import missing, picture_of
from viewsphere.preview import PAPER, draw_sample
from viewsphere.recipe.formats import FormatEntry
from viewsphere.report.frames import frame_data
from viewsphere.report.pictures import SCALES, layers
from viewsphere.run.exports.exporting import write


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    return make(tmp_path_factory.mktemp("clear") / "out", channels=("rgba", "instances"))


def test_which_picture_is_shown():
    assert picture_of({"rgba", "rgb", "depth"}) == "rgb"
    assert picture_of(["depth", "rgba"]) == "rgba"
    assert picture_of(["depth"]) is None
    assert missing(["rgb", "depth"], ["rgba"]) == ("depth",)
    assert missing(["rgba"], ["rgb"]) == ("rgba",)
    assert missing(["rgb"], ["depth"]) == ("rgb",)


def test_the_store_gives_back_what_it_got(dataset):
    for sample in dataset:
        assert sample.rgba.shape == channels()["rgba"].shape(sample.height, sample.width)
        np.testing.assert_array_equal(sample.rgba[..., 3] > 0, sample.instances > 0)
        assert sample.picture is sample.rgba
        assert sample.picture_file == sample.files["rgba"]


def test_coco_links_it(dataset, tmp_path):
    write(dataset, [(FormatEntry(name="coco"), tmp_path)])
    for sample in dataset:
        (image,) = (
            i
            for i in json.loads((tmp_path / "annotations" / f"instances_{sample.split}.json").read_text())["images"]
            if i["id"] == sample.index + 1
        )
        file = tmp_path / "images" / sample.split / image["file_name"]
        assert file.read_bytes() == dataset.path(sample.files["rgba"]).read_bytes()
        with Image.open(file) as opened:
            assert opened.mode == "RGBA"


def test_coco_needs_one(tmp_path):
    with pytest.raises(UserError, match="expected channel rgb, found none"):
        write(make(tmp_path / "out", channels=("instances",)), [(FormatEntry(name="coco"), tmp_path)])


def test_native_links_it(dataset, tmp_path):
    write(dataset, [(FormatEntry(name="native"), tmp_path)])
    poses = json.loads((tmp_path / "dataset1.json").read_text())["poses"]
    for sample in dataset:
        pose = poses[str(sample.pose.index)]
        entry = pose["vehicles_rendered"][sample.objects[0].key]
        file = tmp_path / pose["folder"] / "RGB" / entry["path_rgb"]
        assert file.read_bytes() == dataset.path(sample.files["rgba"]).read_bytes()


def test_rgb_goes_first_where_both_are_kept(tmp_path):
    both = make(tmp_path / "out", channels=("rgba", "rgb", "instances"))
    assert all(sample.picture_file == sample.files["rgb"] for sample in both)
    assert all(sample.picture.shape[2] == 3 for sample in both)


def test_the_report_shows_it(dataset):
    sample = dataset[0]
    assert frame_data(sample)["file"] == sample.files["rgba"]
    assert layers(sample, SCALES[0])["rgb"].startswith("data:image/webp;base64,")


def test_on_a_contact_sheet_it_lies_on_paper(dataset):
    sample = dataset[0]
    drawn = draw_sample(sample)
    assert drawn.shape == (sample.height, sample.width, 3)
    assert (drawn[sample.instances == 0] == PAPER).all()
    np.testing.assert_array_equal(drawn[sample.instances > 0], sample.rgba[sample.instances > 0][:, :3])
