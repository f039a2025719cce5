"""Objaverse: GLB files, flat or in shards, with annotations that strangers wrote."""

from __future__ import annotations

import gzip
import json

import pytest

from asset_trees import faces_front, planned, pointer, put
from viewsphere.assets.cache import load_normalised
from viewsphere.assets.exporting.glb import glb_bytes
from viewsphere.model.model_spec import ModelSpec

UID, OTHER = "0a1b2c", "3d4e5f"
ENTRY = {
    "name": "Red mug",
    "license": "by-nc-sa",
    "user": {"displayName": "A. Maker", "username": "maker"},
    "viewerUrl": "https://sketchfab.com/3d-models/0a1b2c",
    "categories": [{"name": "Food-drink"}],
}


@pytest.fixture
def glb(tmp_path):
    """The bytes of a GLB file that points to the front."""
    file = put(tmp_path / "pointer.obj", pointer("+y", "+z"))
    spec = ModelSpec(key="a", source=str(file), category="a", category_id=1, up="+y", forward="+z")
    return glb_bytes(load_normalised(spec))


def test_shards_have_categories_of_lvis_and_credits_of_metadata(tmp_path, glb):
    root = tmp_path / "objaverse"
    for uid in (UID, OTHER):
        put(root / "glbs" / "000-023" / f"{uid}.glb", "").write_bytes(glb)
    put(root / "metadata" / "000-023.json.gz", "").write_bytes(gzip.compress(json.dumps({UID: ENTRY}).encode()))
    put(root / "lvis-annotations.json.gz", "").write_bytes(gzip.compress(json.dumps({"coffee_mug": [OTHER]}).encode()))
    plan = planned(f"objaverse:{root}")
    assert [(spec.key, spec.category) for spec in plan.model_specs] == [(UID, "food-drink"), (OTHER, "coffee mug")]
    assert all(faces_front(spec) and spec.real_size is None for spec in plan.model_specs)
    credit = plan.credits[UID]
    assert (credit.licence, credit.attribution) == ("CC-BY-NC-SA-4.0", '"Red mug" by A. Maker')
    assert credit.source_url == "https://sketchfab.com/3d-models/0a1b2c"
    assert planned(f"objaverse:{root}/glbs/000-023/{UID}.glb").models == 1


@pytest.mark.parametrize(
    "annotations",
    [
        "[1, 2]",
        "{",
        json.dumps({UID: 3, OTHER: None}),
        json.dumps({UID: {"name": "\x1b[2J", "license": ["by"], "user": 1, "viewerUrl": "javascript:0", "categories": [1]}}),
    ],
)
def test_a_flat_folder_is_read_whatever_its_annotations_hold(tmp_path, glb, annotations):
    root = tmp_path / "flat"
    put(root / f"{UID}.glb", "").write_bytes(glb)
    put(root / "annotations.json", annotations)
    (spec,) = planned(f"objaverse:{root}").model_specs
    assert (spec.key, spec.category) == (UID, "object")


def test_annotations_that_unpack_to_more_than_the_limit_are_passed_over(tmp_path, glb, monkeypatch):
    root = tmp_path / "flat"
    put(root / f"{UID}.glb", "").write_bytes(glb)
    put(root / "annotations.json.gz", "").write_bytes(gzip.compress(json.dumps({UID: ENTRY}).encode() + b" " * 100_000))
    monkeypatch.setenv("VIEWSPHERE_MAX_RECORD_BYTES", "50000")
    assert planned(f"objaverse:{root}").model_specs[0].category == "object"
