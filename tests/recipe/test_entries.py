"""Entries derived from a scene's classes: what is written there once holds in recipes."""

from typing import Literal

import numpy as np
import pytest
from pydantic import Field, ValidationError

from viewsphere import plugins
from viewsphere.model import scene
from viewsphere.model.annotations.procedural_material import ProceduralMaterial
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Length, Portion
from viewsphere.model.fields.omit_none import OmitNone
from viewsphere.model.scene import Color, Picture, Smoother, Srgb
from viewsphere.plugins.light import LightSpec
from viewsphere.recipe.draws import drawn, is_random
from viewsphere.recipe.entries import Entry, concrete, entry_of, pictures_of, words_of
from viewsphere.recipe.lights.shared import lamps
from viewsphere.recipe.world import finish, light, surface, weather


class Halo(Frozen):
    """A part of some scene."""

    kind: Literal["ring", "disc"] = Field(default="ring", description="ring or disc")
    width: float = Field(gt=0, le=30, description="degrees")
    height: Length | None = Field(default=None, description="metres; default: where the sun is")
    rays: int = Field(default=22, ge=3, description="how many rays")
    size: tuple[Portion, Portion] = Field(default=(0.5, 0.25), description="[inner, outer]")
    color: Color = Field(default=(1.0, 0.5, 0.0), description="what it is tinted with")
    paint: Srgb | None = Field(default=None, description="what is behind it")
    mask: Picture | None = Field(default=None, description="path of a picture")
    soft: bool = Field(default=False, description="whether it fades")
    solid: bool = Field(default=False, description="whether it hides what is behind it")
    seed: int = Field(default=0, description="of its noise")


class HaloEntry(entry_of(Halo, without=("seed",), fixed=("solid",), optional=("width",))):
    """A halo that a recipe has."""

    at: str | None = Field(default=None, description="or the name of a place")


class MoreSmooth(Smoother):
    """A smoother with one field more than ours."""

    example: Portion = Field(default=0.25, description="what it is for")


class MoreSmoothEntry(entry_of(MoreSmooth), finish.PerFrame):
    """What a recipe would say of it."""


def properties(entry):
    return entry.model_json_schema()["properties"]


def rng_of(path):
    return np.random.default_rng([*".".join(path).encode()])


def test_a_field_that_is_added_to_the_scene_is_one_of_recipes():
    assert [*MoreSmoothEntry.model_fields] == [*finish.SmootherEntry.model_fields, "example"]
    told = properties(MoreSmoothEntry)
    limits = [{**told["size"]["anyOf"][0], "minimum": 0, "maximum": 1}, *told["size"]["anyOf"][1:]]
    limits[0].pop("exclusiveMinimum")
    assert told["example"] == {"anyOf": limits, "default": 0.25, "description": "what it is for", "title": "Example"}
    assert concrete(drawn(MoreSmoothEntry(), rng_of)) == MoreSmooth()
    made = concrete(drawn(MoreSmoothEntry(example=[0.4, 0.6], size={"choice": [0.1]}), rng_of))
    assert (type(made), made.size) == (MoreSmooth, 0.1)
    assert 0.4 <= made.example <= 0.6
    for beyond in (1.5, [0, 1.5], "0.5", {"normal": [1.5, 1]}):
        with pytest.raises(ValidationError):
            MoreSmoothEntry(example=beyond)


def test_fields_stand_in_the_scene_s_order_behind_those_of_the_body_but_optional_ones_before():
    assert [*HaloEntry.model_fields] == [
        *("width", "at", "kind", "height", "rays", "size", "color", "paint", "mask", "soft", "solid"),
    ]


def test_defaults_are_the_scene_s():
    entry = HaloEntry()
    for name in HaloEntry.model_fields.keys() - {"width", "at"}:
        assert getattr(entry, name) == Halo.model_fields[name].default
    assert entry.width is None
    assert concrete(entry, width=3) == Halo(width=3)


def test_an_optional_field_tells_the_default_that_it_has_in_the_scene():
    told = properties(light.SunEntry)
    assert told["azimuth"]["description"] == "azimuth, degrees, as for cameras; default 40"
    assert properties(surface.GroundEntry)["color"]["description"].endswith("; default [0.62, 0.61, 0.59]")
    assert properties(HaloEntry)["width"]["description"] == "degrees"


def test_descriptions_are_the_scene_s_and_tell_of_colours_names():
    told = {name: value["description"] for name, value in properties(HaloEntry).items()}
    assert told["height"] == "metres; default: where the sun is"
    assert told["color"] == "what it is tinted with, a name or '#rrggbb'"
    assert told["paint"] == "what is behind it, a name or '#rrggbb'"


def test_limits_are_the_scene_s_in_the_schema_too():
    told = properties(HaloEntry)
    assert told["width"]["anyOf"][0] == {"type": "number", "exclusiveMinimum": 0, "maximum": 30}
    assert told["rays"]["anyOf"][0] == {"type": "integer", "minimum": 3}
    (part, *_) = told["size"]["anyOf"][0]["prefixItems"][0]["anyOf"]
    assert part == {"type": "number", "minimum": 0, "maximum": 1}


READ = [
    ({"width": 30}, {"width": 30.0}),
    ({"rays": 4.0}, {"rays": 4}),
    ({"color": "#808080"}, {"color": (0.2158605, 0.2158605, 0.2158605)}),
    ({"color": [4, 0, 0]}, {"color": (4.0, 0.0, 0.0)}),
    ({"paint": "red"}, {"paint": (1.0, 0.0, 0.0)}),
    ({"kind": "disc", "soft": True, "solid": True, "mask": "a.png"}, {}),
]


@pytest.mark.parametrize(("fields", "values"), READ)
def test_values_are_read_as_recipes_are(fields, values):
    entry = HaloEntry(**fields)
    assert {name: getattr(entry, name) for name in fields} == fields | values
    assert not is_random(entry)


DRAWN = [
    {"kind": {"choice": ["ring", "disc"]}},
    {"width": [1, 2]},
    {"height": {"normal": [2, 1]}},
    {"rays": {"uniform": [3, 9]}},
    {"size": [[0, 0.5], 1]},
    {"color": {"uniform": ["#202020", "white"]}},
    {"paint": [[0, 1], 0, 0]},
    {"mask": {"choice": ["a.png", "b.png"]}},
    {"soft": {"choice": [True, False]}},
]


@pytest.mark.parametrize("fields", DRAWN, ids=lambda fields: next(iter(fields)))
def test_every_kind_of_field_may_be_drawn(fields):
    entry = HaloEntry(**{"width": 1, **fields})
    assert is_random(entry)
    assert Halo.model_validate(concrete(drawn(entry, rng_of)).model_dump())
    assert drawn(entry, rng_of) == drawn(HaloEntry.model_validate(entry.model_dump(mode="json")), rng_of)


REFUSED = [
    {"seed": 1},
    {"solid": {"choice": [True, False]}},
    {"solid": 1},
    {"soft": "yes"},
    {"width": 31},
    {"width": "3"},
    {"height": 0},
    {"rays": 2},
    {"rays": {"uniform": [2, 5]}},
    {"rays": 3.5},
    {"size": [[0, 2], 1]},
    {"paint": [0, 0, 1.1]},
    {"color": [-1, 0, 0]},
    {"color": "grene"},
    {"mask": ""},
    {"kind": "square"},
]


@pytest.mark.parametrize("fields", REFUSED, ids=str)
def test_what_the_scene_would_refuse_is_refused(fields):
    with pytest.raises(ValidationError):
        HaloEntry(**fields)


def test_what_is_drawn_may_be_beyond_no_limit_of_the_scene():
    for value in (-1, 0, 31):
        with pytest.raises(ValidationError):
            Halo(width=value)


def test_all_parts_of_a_scene_have_an_entry():
    modules = (finish, light, surface, weather, lamps)
    entries = [kind for module in modules for kind in vars(module).values() if isinstance(kind, type)]
    entries += [plugins.load(LightSpec, name).options for name in plugins.names("lights")]
    derived = {kind.part for kind in entries if issubclass(kind, Entry) and kind is not Entry}
    parts = {kind for kind in vars(scene).values() if isinstance(kind, type) and issubclass(kind, Frozen)}
    assert parts - derived == {
        *(Frozen, OmitNone, ProceduralMaterial),  # what they are made of
        scene.MountedImager,  # which is a camera's
        *(scene.Finish, scene.BlendScene, scene.Floor, scene.Scene),
        scene.Effects,  # whose fields are those of plug-ins
    }


def test_pictures_and_words_of_a_part_are_known():
    assert pictures_of(Halo) == ("mask",)
    assert pictures_of(scene.Ground) == ("image", "roughness_image", "normal_image")
    assert words_of(Halo, "kind") == ["ring", "disc"]
