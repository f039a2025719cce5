"""ShapeNetCore in versions 1 and 2."""

from __future__ import annotations

import json

import pytest

from asset_trees import faces_front, planned, pointer, put
from viewsphere.errors import RecipeError

CAR, CHAIR, MODEL = "02958343", "03001627", "1a2b3c"


def test_models_of_version_2_have_their_synsets_names_axes_and_terms(tmp_path):
    put(tmp_path / CAR / MODEL / "models" / "model_normalized.obj", pointer("+y", "-z"))
    put(tmp_path / CHAIR / MODEL / "models" / "model_normalized.obj", pointer("+y", "-z"))
    (tmp_path / CHAIR / "empty").mkdir()
    plan = planned(f"shapenet:{tmp_path}")
    assert [(spec.key, spec.category) for spec in plan.model_specs] == [
        (f"{CAR}_{MODEL}", "car"),
        (f"{CHAIR}_{MODEL}", "chair"),
    ]
    assert all(faces_front(spec) and spec.real_size is None for spec in plan.model_specs)
    assert plan.credits[f"{CAR}_{MODEL}"].licence == "LicenseRef-ShapeNet"
    assert planned(f"shapenet:{tmp_path}/{CHAIR}").model_specs[0].key == f"{CHAIR}_{MODEL}"
    assert planned(f"shapenet:{tmp_path}/{CHAIR}/{MODEL}").models == 1


def test_models_of_version_1_face_along_x(tmp_path):
    put(tmp_path / CAR / MODEL / "model.obj", pointer("+y", "+x"))
    assert faces_front(planned(f"shapenet:{tmp_path}").model_specs[0])


def test_the_folders_taxonomy_names_further_synsets(tmp_path):
    put(tmp_path / "09999999" / MODEL / "models" / "model_normalized.obj", pointer("+y", "-z"))
    assert planned(f"shapenet:{tmp_path}").model_specs[0].category == "09999999"
    put(tmp_path / "taxonomy.json", json.dumps([{"synsetId": "09999999", "name": "hovercraft,air-cushion vehicle"}]))
    assert planned(f"shapenet:{tmp_path}").model_specs[0].category == "hovercraft"
    put(tmp_path / "taxonomy.json", "[{")
    assert planned(f"shapenet:{tmp_path}").models == 1


def test_models_have_the_splits_of_the_folders_table(tmp_path):
    for name in ("a", "b", "c"):
        put(tmp_path / CAR / name / "models" / "model_normalized.obj", pointer("+y", "-z"))
    put(tmp_path / "all.csv", f"id,synsetId,subSynsetId,modelId,split\n1,{CAR},{CAR},a,val\n2,{CAR},{CAR},b,train\nbroken\n")
    plan = planned(f"shapenet:{tmp_path}", splits={"train": 1, "val": "set"})
    assert [plan.split(spec.key, 0) for spec in plan.model_specs] == ["val", "train", "train"]
    with pytest.raises(RecipeError, match=rf"splits: expected every model to be listed; found no split for '{CAR}_c'"):
        planned(f"shapenet:{tmp_path}", splits={"train": "set", "val": "set"})
    with pytest.raises(RecipeError, match=r"splits.val: expected a share of 0 to 1, a list of model keys, or set"):
        planned(f"shapenet:{tmp_path}", splits={"train": 1, "val": {"a": 1}})
