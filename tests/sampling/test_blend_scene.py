"""Which objects of a .blend file are labelled and shown, told from what is in it alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from viewsphere import Recipe, plan
from viewsphere.assets.scene_file import SceneFile, SceneObject
from viewsphere.errors import RecipeError
from viewsphere.sampling.blend_scene import BlendScenery


def thing(name, parent=None, collections=(), place=(0, 0, 0), shown=True, **properties):
    return SceneObject(name, "MESH", parent, collections, properties, (name,) if shown else (), place, (1, 0, 0, 0))


CAR = (
    thing("Car", shown=False),
    thing("Body", "Car"),
    thing("Car wheel", "Body"),
    thing("Driver", "Body", kind="person"),
    thing("Hat", "Driver"),
    thing("Car toy", "Hat"),
)
SIGNS = (thing("sign1"), thing("sign2"), thing("sign2 post", "sign2"), thing("Spot", place=(1, 2, 3)))


def scenery(*objects, **blend):
    recipe = Recipe(
        models=[{"source": "zoo:chair"}],
        viewpoints={"distance": 5},
        scene={"blend": {"file": "a.blend", **blend}},
        engine="cycles",
    )
    made = BlendScenery(recipe, recipe.scene.blend, len)
    made.__dict__["file"] = SceneFile(Path("a.blend"), objects, 1.0, True, ())
    return made


def labelled(made):
    return {one.root.name: (one.category, set(one.members)) for one in made.labelled}


def test_an_object_is_one_with_what_is_parented_to_it_unless_another_category_begins():
    made = scenery(*CAR, labels=[{"name": "Car*", "category": "car"}, {"property": "kind", "category": "*"}])
    assert labelled(made) == {
        "Car": ("car", {"Body", "Car wheel"}),
        "Driver": ("person", {"Driver", "Hat"}),
        "Car toy": ("car", {"Car toy"}),
    }


def test_a_rule_that_labels_nothing_that_is_seen_is_told():
    made = scenery(*CAR, thing("Ghost", shown=False), labels=[{"name": n, "category": "c"} for n in ("Car", "Ghost")])
    assert made.warnings == ("scene.blend.labels[1]: what it fits is nothing that a render shows",)


def test_what_shows_nothing_at_the_first_frame_is_the_model_of_a_later_one():
    made = scenery(*SIGNS[:2], labels=[{"name": "*", "category": "sign"}])
    made = replace(made, seconds={1: 0.0, 5: 0.5})
    showing = {1: frozenset({"sign1"}), 5: frozenset({"sign2"})}
    made.__dict__["file"] = SceneFile(Path("a.blend"), SIGNS[:2], 1.0, True, (), 1, showing)
    made.__dict__["_stands"] = {frame: {"sign1": np.eye(4), "sign2": np.eye(4)} for frame in (1, 5)}
    one, other = made.models(lambda category, labels: 1)
    assert (one.rest, other.rest) == (1, 5)
    assert [[made.shows(spec, frame) for frame in (1, 5)] for spec in (one, other)] == [[True, False], [False, True]]


def test_the_first_rule_counts():
    rules = [{"name": "Body", "category": "hull"}, {"name": "*", "category": "thing"}]
    assert labelled(scenery(*CAR[:2], labels=rules)) == {"Body": ("hull", {"Body"})}
    assert labelled(scenery(*CAR[:2], labels=rules[::-1])) == {"Car": ("thing", {"Body"})}


def test_scenery_is_all_the_rest():
    made = scenery(
        *CAR, *SIGNS, labels=[{"name": "Car", "category": "car"}], variants={"signs": {"one_of": "sign?", "draw": "fixed"}}
    )
    *own, rest = made.pieces("m", None, lambda category, labels: 7)
    assert [p.labels for p in (*own, rest)] == ["own", "background"]
    hidden = set(made.hidden("m", None))
    assert hidden in ({"sign1"}, {"sign2", "sign2 post"})
    assert set(rest.model.parts.without) == {"Body", "Car wheel", "Driver", "Hat", "Car toy"} | hidden
    assert made.scene("m", None).shown == ("sign1", "sign2")


def test_a_file_of_which_all_is_labelled_has_no_scenery():
    made = scenery(thing("Car"), labels=[{"name": "Car", "category": "car"}])
    assert [p.labels for p in made.pieces("m", None, lambda category, labels: 7)] == ["own"]


def test_targets_stand_at_the_spot():
    made = scenery(*SIGNS, at="Spot")
    assert [row[3] for row in made.world_from_file] == [-1, -2, -3, 1]


def test_other_engines_are_refused_before_blender_is_asked():
    recipe = Recipe(models=[{"source": "zoo:chair"}], viewpoints={"distance": 5}, scene={"blend": "none.blend"})
    with pytest.raises(RecipeError, match=r"^scene.blend: expected engine: cycles, eevee or workbench.*raster.*scene.place$"):
        plan(recipe)
