"""Draws keep their values whatever the fields, classes and modules of a recipe are called."""

import json
import typing
from pathlib import Path

import pytest

from viewsphere import plugins
from viewsphere.composing.seeds import generator, share
from viewsphere.model.fields.frozen import Frozen
from viewsphere.plugins.effect import EffectSpec
from viewsphere.plugins.light import LightSpec
from viewsphere.plugins.motion import MotionSpec
from viewsphere.plugins.placer import PlacerSpec
from viewsphere.recipe.draws import Distribution, OrDrawn, drawn
from viewsphere.recipe.kinds import ByKind
from viewsphere.recipe.models import ModelEntry
from viewsphere.recipe.seed_names import SEED_NAMES
from viewsphere.recipe.world.effects import EffectsEntry
from viewsphere.recipe.world.scene import CameraEntry, SceneEntry
from viewsphere.recipe.world.scenes import ScenesEntry

PINNED = Path(__file__).parent / "seed_names.json"
"""First number drawn by the seed 7 for each path of seed names. Only new lines may come."""

SHIPPED = "viewsphere."


def parts(kind):
    """The classes of plain data that a field's type allows, and whether it allows a distribution itself."""
    if isinstance(kind, OrDrawn):
        return {Distribution}
    if kind is EffectsEntry:
        return {type(EffectsEntry.of_defaults())}
    if isinstance(kind, type) and issubclass(kind, Frozen):
        return {kind}
    if isinstance(kind, ByKind):
        specs = (plugins.load(kind.spec, name) for name in plugins.names(kind.spec.KIND))
        return {spec.options for spec in specs if spec.options.__module__.startswith(SHIPPED)}
    inner = (*typing.get_args(kind), *getattr(kind, "__metadata__", ()))
    return set().union(*(parts(part) for part in inner if part is not kind)) if inner else set()


def random_entries(kind, above=()):
    """Yield entries of a class with one random field each, with the names of the fields on the way."""
    for name, field in kind.model_fields.items():
        for part in sorted(parts(field.annotation).union(*map(parts, field.metadata)), key=lambda part: part.__name__):
            if part is Distribution:
                yield kind.model_construct(**{name: Distribution(choice=(0,))}), (name,)
            elif part not in above:
                for entry, names in random_entries(part, (*above, kind)):
                    yield kind.model_construct(**{name: entry}), (name, *names)


def options():
    for spec in (MotionSpec, PlacerSpec):
        for name in plugins.names(spec.KIND):
            kind = plugins.load(spec, name).options
            if kind is not None and kind.__module__.startswith(SHIPPED):
                yield kind


ROOTS = (SceneEntry, CameraEntry, ModelEntry, ScenesEntry, *options())


def seed_paths():
    """The paths of seed names that the draws of all random fields ask for."""
    asked = set()

    def rng_of(path):
        asked.add(".".join(path))
        return generator(7, ".".join(path))

    for root in ROOTS:
        for entry, _ in random_entries(root):
            drawn(entry, rng_of)
    return asked


def fields():
    return {name for root in ROOTS for _, names in random_entries(root) for name in names}


def of_plugins():
    """The random fields of plug-ins, which a new plug-in adds to: without a name here, its own name seeds a field."""
    lights = (plugins.load(LightSpec, name).options for name in plugins.shipped("lights"))
    kinds = (*options(), *lights, type(EffectsEntry.of_defaults()))
    return {name for kind in kinds for _, names in random_entries(kind) for name in names}


def test_exactly_the_random_fields_have_a_frozen_seed_name():
    assert fields() - of_plugins() == set(SEED_NAMES) - of_plugins()
    assert set(SEED_NAMES) <= fields()
    assert {"fov_deg", "puddles", "spin_deg", "restitution"} <= fields()


def test_no_draw_has_another_seed_or_value_than_the_pinned():
    pinned, known = json.loads(PINNED.read_text()), of_plugins()
    now = {path: round(share(7, "scene", path), 12) for path in sorted(seed_paths())}
    assert {path: now.get(path) for path in pinned} == pinned
    added = {path for path in set(now) - set(pinned) if known.isdisjoint(path.split("."))}
    assert not added, "add new draws to seed_names.json"


def test_the_draws_of_every_recorded_effect_are_pinned():
    """A field with another name would draw other values, which changes the pictures of recipes that have it."""
    pinned = {path.partition(".")[2] for path in json.loads(PINNED.read_text()) if path.startswith("effects.")}
    specs = (plugins.load(EffectSpec, name) for name in plugins.shipped("effects"))
    assert pinned == {name for spec in specs if spec.record is not None for name in spec.options.model_fields}
    assert {f"effects.{name}" for name in pinned} <= seed_paths()


def test_a_renamed_field_keeps_its_draw(monkeypatch):
    class Before(Frozen):
        azimuth_deg: typing.Any

    class After(Frozen):
        heading: typing.Any

    monkeypatch.setitem(SEED_NAMES, "heading", "azimuth_deg")
    rng_of = lambda path: generator(7, "scene", ".".join(path))  # noqa: E731
    draw = Distribution(uniform=(0.0, 360.0))
    before = drawn(Before(azimuth_deg=draw), rng_of, ("sun",))
    assert drawn(After(heading=draw), rng_of, ("sun",)).heading == before.azimuth_deg
    assert before.azimuth_deg == pytest.approx(360 * generator(7, "scene", "sun.azimuth_deg").random())
