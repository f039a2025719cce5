"""Recipes whose scene is a .blend file."""

from __future__ import annotations

import pytest

from viewsphere import Recipe
from viewsphere.errors import RecipeError
from viewsphere.recipe.world.scene import SceneEntry


def test_short_forms_mean_the_long_ones():
    assert SceneEntry(blend="a.blend") == SceneEntry(blend={"file": "a.blend"})
    short, long = ({"file": "a.blend", "variants": {"signs": v}} for v in ("sign*", {"one_of": "sign*"}))
    assert SceneEntry(blend=short) == SceneEntry(blend=long)


def test_there_is_no_ground_but_the_files():
    assert SceneEntry(blend="a.blend").automatic_ground == "off"
    assert SceneEntry(blend="a.blend", ground=False).blend.file == "a.blend"


def test_what_is_drawn_per_frame_makes_a_scene_for_each():
    drawn = [
        SceneEntry(blend={"file": "a", "variants": {"v": {"one_of": "x*", "draw": d}}}) for d in ("per_frame", "per_model")
    ]
    assert [s.is_new_each_frame for s in drawn] == [True, False]
    assert not SceneEntry(blend="a").is_new_each_frame
    assert SceneEntry(blend="a").has_fixed_scenery


@pytest.mark.parametrize(
    ("scene", "words"),
    [
        ({"sun": "on"}, ["scene.sun", "beside blend"]),
        ({"sky": {"strength": 2.0}}, ["scene.sky", "beside blend"]),
        ({"ground": "on"}, ["scene.ground", "beside blend"]),
        ({"place": "zoo:neighbourhood"}, ["scene.place", "beside blend"]),
        ({"lights": [{"kind": "hemisphere", "strength": 1}]}, ["scene.lights[0]", "hemisphere"]),
        ({"blend": {"file": "a", "labels": [{"name": "a", "collection": "b", "category": "c"}]}}, ["labels[0]", "one of"]),
        ({"blend": {"file": "a.blend", "labels": [{"name": "a", "category": "*"}]}}, ["labels[0]", "property"]),
        ({"blend": {"file": "a.blend", "variants": {"a": {"one_of": "b", "order": "in_turn", "draw": "fixed"}}}}, ["in_turn"]),
    ],
)
def test_what_does_not_fit_a_file_is_refused(scene, words):
    given = {"blend": "a.blend"} | scene
    with pytest.raises(RecipeError) as caught:
        Recipe(models=[{"source": "zoo:chair"}], viewpoints={"distance": 5}, scene=given)
    assert all(word in str(caught.value) for word in words), caught.value
