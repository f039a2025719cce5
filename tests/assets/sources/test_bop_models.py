"""Models of data sets in BOP's format."""

from __future__ import annotations

from asset_trees import faces_front, planned, put

PLY = """ply
format ascii 1.0
element vertex 6
property float x
property float y
property float z
element face 4
property list uchar int vertex_indices
end_header
-50 -50 -50
50 50 -50
50 -50 50
-50 -50 50
0 -60 50
1 -50 50
3 0 1 2
3 0 3 1
3 2 1 3
3 3 4 5
"""


def test_models_are_in_millimetres_and_named_as_in_the_data_set(tmp_path):
    for number in (1, 13):
        put(tmp_path / "lm" / "models" / f"obj_{number:06d}.ply", PLY)
    put(tmp_path / "lm" / "models" / "models_info.json", "{}")
    plan = planned(f"bop:{tmp_path}/lm")
    assert [spec.key for spec in plan.model_specs] == ["lm_obj_000001", "lm_obj_000013"]
    assert [spec.category for spec in plan.model_specs] == ["ape", "iron"]
    assert faces_front(plan.model_specs[0], 0.1)


def test_a_data_set_without_names_has_a_category_an_object_and_other_models_by_their_folder(tmp_path):
    put(tmp_path / "tless" / "models_cad" / "obj_000002.ply", PLY)
    put(tmp_path / "tless" / "models_eval" / "obj_000003.ply", PLY)
    assert [spec.category for spec in planned(f"bop:{tmp_path}/tless").model_specs] == ["obj_000002"]
    assert [spec.category for spec in planned(f"bop:{tmp_path}/tless/models_eval").model_specs] == ["obj_000003"]
    assert planned(f"bop:{tmp_path}/tless/models_cad/obj_000002.ply").models == 1
