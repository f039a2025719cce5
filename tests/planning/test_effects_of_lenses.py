"""Lenses refuse the effects that they rule out, by fields of the effects: those of other packages, too."""

import pytest

from installed import installed
from small import small_recipe
from viewsphere import plan, plugins
from viewsphere.errors import RecipeError
from viewsphere.plugins.effect import EffectSpec

SMEAR = """
from pydantic import Field
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Signed
from viewsphere.plugins.effect import EffectSpec

class Smear(Frozen):
    smear: Signed = Field(default=0.0, description="light of the left or the right")

def apply(picture, options, context):
    return picture.copy()

EFFECT = EffectSpec(name="smear", options=Smear, strongest="all light", stage="lens", order=1, apply=apply)
"""
AROUND = {"projection": "equirectangular", "size": [128, 64]}
PARALLEL = {"projection": "orthographic", "size": [64, 48], "width_m": 1.0}
RULED = {"shows_seam": (AROUND, "as it would show the seam"), "needs_pinhole": (PARALLEL, "as it is made for a pinhole")}


def planned(camera, effects):
    return plan(small_recipe(camera=camera, scene={"effects": effects}, channels=["rgb"], formats=[]))


def test_the_shipped_effects_state_what_rules_them_out():
    specs = [plugins.load(EffectSpec, name) for name in plugins.shipped("effects")]
    pinholes = {"depth_of_field", "edge_highlight"}
    assert {spec.name for spec in specs if spec.needs_pinhole} == pinholes
    seams = pinholes | {"chromatic_aberration", "vignetting"}
    assert {spec.name for spec in specs if spec.shows_seam} == seams


@pytest.mark.parametrize("field", RULED)
def test_a_lens_refuses_the_shipped_effects_that_it_rules_out(field):
    camera, why = RULED[field]
    for spec in (plugins.load(EffectSpec, name) for name in plugins.shipped("effects")):
        if getattr(spec, field):
            for strength in (0.2, [0, 0.2], {"choice": [0, 0.2]}):
                with pytest.raises(RecipeError, match=rf"scene\.effects\.{spec.name}: .*{why}"):
                    planned(camera, {spec.name: strength})
        elif spec.name in spec.options.model_fields:
            assert planned(camera, {spec.name: 0.2}).frames


@pytest.mark.parametrize("field", RULED)
def test_a_lens_refuses_an_effect_of_another_package_that_it_rules_out(tmp_path, field):
    camera, why = RULED[field]
    with installed(tmp_path / "free", "effects", "smear", SMEAR):
        assert planned(camera, {"smear": 0.5}).frames
    with installed(tmp_path / "ruled", "effects", "smear", SMEAR.replace("order=1", f"order=1, {field}=True")):
        for strength in (0.5, -0.5, [-0.5, 0], {"choice": [0, -0.2]}):
            with pytest.raises(RecipeError, match=rf"scene\.effects\.smear: .*{why}"):
                planned(camera, {"smear": strength})
        assert planned(camera, {"smear": 0}).frames
        assert planned({"size": [64, 48], "fov_deg": 40}, {"smear": 0.5}).frames
