"""ModelNet: categories and splits by folder."""

from __future__ import annotations

import pytest

from asset_trees import planned, put
from viewsphere.assets.cache import load
from viewsphere.errors import RecipeError

OFF = "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"


def test_models_have_categories_splits_and_terms(tmp_path):
    for split, number in (("train", 1), ("test", 201)):
        put(tmp_path / "night_stand" / split / f"night_stand_{number:04d}.off", OFF.replace("OFF\n4", "OFF4"))
    put(tmp_path / "README.txt", "ModelNet10")
    plan = planned(f"modelnet:{tmp_path}", splits={"train": "set", "test": "set"})
    assert [spec.key for spec in plan.model_specs] == ["night_stand_0001", "night_stand_0201"]
    assert [plan.split(spec.key, 0) for spec in plan.model_specs] == ["train", "test"]
    assert {spec.category for spec in plan.model_specs} == {"night stand"}
    assert len(load(plan.model_specs[0])[0].triangles) == 4
    assert plan.credits["night_stand_0001"].licence == "LicenseRef-ModelNet"
    assert [spec.key for spec in planned(f"modelnet:{tmp_path}/night_stand/test").model_specs] == ["night_stand_0201"]


def test_splits_of_the_set_that_are_empty_or_missing_have_a_fix(tmp_path):
    for split in ("train", "test"):
        put(tmp_path / "chair" / split / f"chair_{split}.off", OFF)
    plan = planned(f"modelnet:{tmp_path}", splits={"train": "set", "val": "set", "test": "set"})
    assert (
        "split 'val' is empty: no model's set lists it. Leave it out, or give it a share or a list of models" in plan.warnings
    )
    with pytest.raises(RecipeError, match=r"found no split for 'chair_test'\. Add `test: set`$"):
        planned(f"modelnet:{tmp_path}", splits={"train": "set"})
