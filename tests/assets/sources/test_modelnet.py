"""ModelNet: categories and splits by folder."""

from __future__ import annotations

from asset_trees import planned, put
from viewsphere.assets.cache import load

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
