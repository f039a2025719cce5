"""Each format holds panoramas, or refuses them in one line; objects across the seam are two annotations with one id."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from viewsphere import Dataset, Recipe, generate, plugins
from viewsphere.check.exports import export_report
from viewsphere.errors import UserError
from viewsphere.plugins.format import FormatSpec
from viewsphere.run.exports.exporting import export
from viewsphere.store.samples.seam_pieces import cut_at_seam

WRITTEN = [name for name, spec in plugins.loadable(FormatSpec).items() if spec.writer is not None]


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    """Three models around a camera; one of them behind it, across the seam."""
    recipe = {
        "name": "around",
        "models": [{"source": "zoo:post_box", "category": "post_box", "count": 1}],
        "scenes": {"count": 1, "objects": 6, "repeat": True, "layout": "scatter"},
        "viewpoints": {"azimuth": [0, 70, 140], "elevation": 10, "distance": 0.3},
        "camera": {"projection": "equirectangular", "size": [128, 64]},
        "engine": {"name": "raster", "ambient_occlusion": "off"},
        "channels": ["rgb", "instances", "depth_ray", "normals", "categories", "semantic", "panoptic"],
        "annotations": ["amodal", "obb", "contour", "keypoints"],
        "splits": {"by": "scene"},
        "formats": [],
    }
    folder = tmp_path_factory.mktemp("around") / "out"
    generate(Recipe.model_validate(recipe), folder, workers=0)
    return Dataset(folder)


def across(dataset):
    return [(sample, o) for sample in dataset for o in sample.objects if o.box2d and o.box2d[2] > sample.width]


def test_an_object_across_the_seam_is_two_with_one_id(dataset):
    assert across(dataset)
    for sample in dataset:
        cut = cut_at_seam(sample)
        for o in sample.objects:
            pieces = [one for one in cut.objects if one.id == o.id]
            masks = [one.mask for one in pieces]
            np.testing.assert_array_equal(np.sum(masks, axis=0), o.mask)
            assert sum(one.area for one in pieces) == o.area
            assert len(pieces) == (2 if o.box2d and o.box2d[2] > sample.width else 1)
            for one, mask in zip(pieces, masks, strict=True):
                if one.box2d is None:
                    continue
                rows, columns = np.nonzero(mask)
                assert one.box2d == (columns.min(), rows.min(), columns.max() + 1, rows.max() + 1)
                assert one.box2d_projected[2] <= sample.width
                assert one.extra.get("seam_piece") == (None if len(pieces) == 1 else 1 + (one is pieces[1]))


def test_a_keypoint_is_labelled_in_the_piece_at_whose_side_it_is(dataset):
    sample, o = across(dataset)[0]
    begin, end = o.box2d[0], o.box2d[2] - sample.width
    x = np.array([begin + 0.5, sample.width - 0.5, 0.5, end - 0.5, begin - 1, end + 1, begin + 1, np.nan])
    points = {"keypoints": np.stack([x, x], axis=1), "keypoint_states": np.array([0, 1, 0, 1, 1, 1, 2, 3])}
    cut = cut_at_seam(replace(sample, objects=(replace(o, extra={**o.extra, **points}),)))
    assert [piece.keypoint_states.tolist() for piece in cut.objects] == [[0, 1, 2, 2, 1, 2, 2, 3], [2, 2, 0, 1, 2, 1, 2, 3]]


@pytest.mark.parametrize("name", WRITTEN)
def test_each_format_holds_panoramas_or_refuses_them_in_one_line(name, dataset):
    if not plugins.load(FormatSpec, name).panoramas:
        with pytest.raises(UserError, match=r"expected .*; found the panorama \(equirectangular\)") as error:
            export(dataset.root, [name])
        assert "\n" not in str(error.value)
        return
    export(dataset.root, [name])
    report = export_report(Dataset(dataset.root), range(len(dataset)), name)
    assert not report.findings


def test_coco_has_two_annotations_of_an_object_across_the_seam(dataset):
    if not (dataset.root / "coco").exists():
        export(dataset.root, ["coco"])
    files = (dataset.root / "coco" / "annotations").glob("*.json")
    whole = [json.loads(file.read_text("utf-8")) for file in files]
    annotations = [one for part in whole for one in part["annotations"]]
    matrices = [image["transformation_matrix"].keys() for part in whole for image in part["images"]]
    assert len(matrices) == len(dataset) and all(names == {"K", "RT"} for names in matrices)  # P, of pinholes, has no meaning
    assert len({one["id"] for one in annotations}) == len(annotations)
    for sample, o in across(dataset):
        mine = [one for one in annotations if one["image_id"] == sample.index + 1 and one["id_object"] == o.id]
        assert len(mine) == 2 and sum(one["area"] for one in mine) == o.area
        assert {one["bbox"][0] + one["bbox"][2] for one in mine} >= {float(sample.width)}
        assert min(one["bbox"][0] for one in mine) == 0
        right, left = sorted(mine, key=lambda one: one["id"])
        in_right, in_left = (np.reshape(one["keypoints"], (-1, 3))[:, 2] > 0 for one in (right, left))
        labelled = o.keypoint_states < 2
        assert not (in_right & in_left).any() and (in_right | in_left).sum() == labelled.sum()
        assert (right["num_keypoints"], left["num_keypoints"]) == (in_right.sum(), in_left.sum())
        assert all(x > sample.width / 2 for x in np.reshape(right["keypoints"], (-1, 3))[in_right, 0])
        assert all(x < sample.width / 2 for x in np.reshape(left["keypoints"], (-1, 3))[in_left, 0])
