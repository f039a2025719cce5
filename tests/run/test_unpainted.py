"""A change to materials that changes nothing is said, once a model."""

from small import small_recipe
from viewsphere.assets.exporting.glb import glb_bytes, material_names
from viewsphere.model.model_spec import ModelSpec
from viewsphere.run.generate import generate
from viewsphere_zoo import build_zoo_model

BOXES = [{"source": "zoo:post_box", "category": "box", "count": 2, "scale": {"length": 0.18}}]
BENCH = {"source": "zoo:bench", "category": "bench", "scale": {"length": 0.18}}


def test_the_names_are_read_back_from_a_glb(tmp_path):
    mesh = build_zoo_model(ModelSpec(key="a", source="zoo:post_box", seed=3, category="a", category_id=1))
    (tmp_path / "a.glb").write_bytes(glb_bytes(mesh))
    assert material_names(tmp_path / "a.glb") == tuple(material.name for material in mesh.materials)


def said(out, *materials, models=BOXES):
    recipe = small_recipe(
        models=models, scene={"materials": materials}, channels=["rgb"], viewpoints={"azimuth": 0, "distance": 1}
    )
    warnings = generate(recipe, out, formats=[]).warnings
    assert warnings.files == {}
    return warnings.models


def test_a_change_that_fits_no_material_is_said(tmp_path):
    found = said(tmp_path / "a", {"material": "laquer*", "tint": "red"}, {"material": "plate", "tint": "red"}, {"metallic": 1})
    assert found.keys() == {"post_box_000", "post_box_001"}
    for (warning,) in found.values():
        assert warning.startswith("scene.materials[0].material: expected a pattern of its materials' names (")
        assert "plate" in warning and warning.endswith("; found 'laquer*', which fits none: it changes nothing")
    again = said(tmp_path / "a", {"material": "laquer*", "tint": "red"}, {"material": "plate", "tint": "red"}, {"metallic": 1})
    assert again == found


def test_a_change_for_all_that_fits_some_is_meant_so(tmp_path):
    models = [BOXES[0] | {"count": 1}, BENCH]
    assert said(tmp_path / "a", {"material": "plate", "tint": "red"}, models=models) == {}
    found = said(tmp_path / "b", {"models": "*_000", "material": "plate", "tint": "red"}, models=models)
    assert found.keys() == {"bench_000"}
