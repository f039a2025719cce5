"""Recipes and records are written without what they do not say: what was written before a field came is what is written now."""

import pytest

from viewsphere import Recipe
from viewsphere.model.annotations.appearance import Patch
from viewsphere.model.fields.omit_none import OmitNone
from viewsphere.model.instant import Viewpoint
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Finish, Ground
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.sensors.rig import Sensor
from viewsphere.model.thing import Repaint
from viewsphere.recipe.cameras.viewpoints import PoseList
from viewsphere.recipe.draws import Distribution, Gaussian
from viewsphere.recipe.models import ModelEntry, ScaleEntry
from viewsphere.recipe.world.scenery import CompanyEntry, PlaceEntry
from viewsphere.recipe.world.surface import GroundEntry, MaterialEntry

CLASSES = [
    *(Viewpoint, ModelSpec, Intrinsics, Sensor, Repaint, Finish, Ground, Patch, Distribution, Gaussian),
    *(ModelEntry, ScaleEntry, PlaceEntry, CompanyEntry, GroundEntry, MaterialEntry, PoseList),
]


def test_all_of_them_are_looked_at():
    assert {kind for kind in OmitNone.__subclasses__() if kind.__module__.startswith("viewsphere.")} == set(CLASSES)


@pytest.mark.parametrize("kind", CLASSES)
def test_what_may_be_unsaid_is_left_out_where_it_is_none_and_nothing_else_is(kind):
    fields = {name: None for name in kind.model_fields}
    written = kind.model_construct(**fields).model_dump(warnings=False)
    assert 0 < len(kind.OMIT_IF_NONE) == len(fields) - len(written)
    assert list(written) == [name for name in fields if name not in kind.OMIT_IF_NONE]


def test_a_recipe_says_what_it_is_told():
    entry = {
        "source": "a.glb",
        "category": "car",
        "scale": {"length": {"normal": {"mean": 4, "deviation": 1, "min": 3}}},
        "fps": 12,
        "frames": "all",
    }
    recipe = Recipe(
        models=[{"source": "zoo:chair"}, entry],
        viewpoints={"kind": "file", "path": "poses.csv"},
        scene={"materials": [{"roughness": {"uniform": [0, 1]}}, {"image": "a.png"}], "company": 1},
    )
    chair, car = recipe.model_dump(mode="json")["models"]
    assert not {"motion", "fps"} & chair.keys() and "unit" in chair
    assert car["fps"] == 12 and "motion" not in car
    assert car["scale"] == {"length": {"normal": {"mean": 4, "deviation": 1, "min": 3}}}
    matt, printed = recipe.model_dump(mode="json")["scene"]["materials"]
    assert matt["roughness"] == {"uniform": [0, 1]}
    assert "image" not in matt and "images" not in matt and matt["tint"] is None
    assert printed["image"] == "a.png" and "images" not in printed
    assert "fps" not in recipe.model_dump()["viewpoints"]
    assert Recipe.model_validate(recipe.model_dump(mode="json")).digest == recipe.digest
