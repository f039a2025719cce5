"""Which objects of a .blend file are labelled and shown, told from what is in it alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from viewsphere import Recipe, plan
from viewsphere.assets.animation.timeline import Blenders, Timeline
from viewsphere.assets.scene_file import SceneFile, SceneObject
from viewsphere.composing.scene.blend_scene import BlendScenery
from viewsphere.errors import RecipeError
from viewsphere.geometry.box3d import Box3d


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


@pytest.fixture
def planes(tmp_path, monkeypatch):
    """Recipes in a file of two planes that are shown in turn, and that moves; what is in the file is told without Blender."""
    for name in ("a.blend", "walk.fbx"):
        (tmp_path / name).write_bytes(b"x")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Blenders, "timeline", lambda *_: Timeline(1, 24, 24.0, True))
    held = SceneFile(Path("a.blend"), (thing("plane0"), thing("plane1")), 1.0, True, ())

    def told(*_):
        return replace(held, showing={frame: frozenset({"plane0", "plane1"}) for frame in range(1, 25)})

    monkeypatch.setattr("viewsphere.assets.scene_file.scene_file", told)

    def recipe(azimuths, models=("zoo:chair",), blend=None, **fields):
        views = {"azimuth": list(range(azimuths)), "distance": 5}
        variants = {"planes": {"one_of": "plane*", "order": "in_turn"}}
        return Recipe(
            models=[model if isinstance(model, dict) else {"source": model, "count": 1} for model in models],
            **{
                "viewpoints": views,
                "engine": "cycles",
                "scene": {"blend": {"file": "a.blend", "variants": variants, **(blend or {})}},
            },
            **fields,
        )

    return recipe


def in_turn(recipe):
    """The number of the plane that each shot shows, in the data set's order."""
    shots = plan(recipe).shots(lambda spec, step=None: Box3d.between((-0.5, -0.5, 0), (0.5, 0.5, 1)).corners)
    return [("plane1", "plane0").index(name) for shot in shots for name in shot.scene.blend.hidden]


@pytest.mark.parametrize("count", [3, 4])
def test_variants_take_turns_along_poses_that_move(planes, count):
    """Return whether the poses are odd in number or even; the second model goes on where the first ends."""
    blend = {"frames": list(range(1, count + 1)), "poses": "moving"}
    turns = in_turn(planes(count, ("zoo:chair", "zoo:car"), blend))
    assert turns == [k % 2 for k in range(2 * count)]


def test_variants_take_turns_over_models_of_other_time_steps(planes):
    walker = {"source": "walk.fbx", "category": "person", "frames": [1, 5, 9]}
    assert in_turn(planes(3, (walker, "zoo:car"))) == [k % 2 for k in range(9 + 3)]


def test_variants_take_turns_from_sequence_to_sequence(planes):
    assert in_turn(planes(3, ("zoo:chair", "zoo:car"), time={"frames": 2, "fps": 10})) == [0, 1, 0, 1, 0, 1]
