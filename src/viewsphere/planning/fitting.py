"""The check that a recipe's additions fit the existing data set."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator

from pydantic import JsonValue

from viewsphere.errors import RecipeError
from viewsphere.planning.engine_digest import engine_digest, script_digest
from viewsphere.planning.plan import Plan
from viewsphere.recipe.recipe import Splits
from viewsphere.recipe.variations import PAIRED
from viewsphere.store import Part, PlanRecord
from viewsphere.validation.errors import shown

FITTING = "appended frames have to fit those that are there; choose another output folder for others"

RIG = "rig"
"""Name of the setting that only recipes with several sensors have."""

SHOWN = ("min_visibility", "wanted", "empty")
"""Names of the settings for the visibility of models in pictures; only recipes with such settings have them."""

LOOK = "the engine's program"
"""Name of the setting for the engine's rendering."""


OF = " of "
"""Separator between a model's field and its key in names of settings; no other name contains it."""

VARIED = "variations."
"""Prefix of a variation's settings; no other name contains it."""

MOVES = ("motion", "clip", "fps")
"""Fields of a model for its motion in sequences, and for the animation that it plays."""

Settings = dict[str, str]
"""Names of settings, and digests of their values."""


def check_fit(planned: Plan, there: PlanRecord) -> None:
    """Raise RecipeError if the recipe's pictures, splits or models do not fit the existing ones."""
    settings_of_plan = settings(planned)
    for part in there.parts:
        _check_sampler(planned, part)
        _check_settings(planned, settings_of_plan, part)
        _check_movements(planned, settings_of_plan, part)
        _check_splits(planned, part)
    _check_models(planned, there)


def settings(planned: Plan) -> Settings:
    """Digests of the settings that all frames of a data set share, by the names of the recipe's fields; random fields count
    with their distributions.
    """
    recipe = planned.recipe
    value = recipe.model_dump(mode="json", include={"seed", "scene", "engine", "label_alpha", "viewpoints"})
    viewpoints = value.pop("viewpoints")
    planes = () if planned.composition is None else planned.composition.images
    lens = recipe.camera if recipe.camera.is_random else planned.intrinsics
    value |= {
        "camera": lens.model_dump(mode="json"),
        **({} if planned.own_rig is None else {RIG: planned.own_rig.model_dump(mode="json")}),
        **recipe.model_dump(mode="json", include=set(SHOWN), exclude_none=True),
        "viewpoints.target": viewpoints.get("target", recipe.viewpoints.target),
        "viewpoints.bins": viewpoints.get("bins"),
        "scene's images": [file.rpartition("/")[2] for files in (planned.images, *planes) for file in files],
    }
    script = script_digest(recipe)
    if script is not None:
        value["engine.script"] = script
    if recipe.scenes is not None:
        options = recipe.scenes.model_dump(mode="json", exclude={"count"})
        value |= {f"scenes.{name}": options[name] for name in options}
    if recipe.time is not None:
        value["time"] = recipe.time.model_dump(mode="json")
        value["viewpoints.shake"] = viewpoints.get("shake")
    if recipe.tracks is not None:
        value["tracks"] = recipe.tracks.model_dump(mode="json")
    if recipe.variations is not None:
        value |= {f"{VARIED}{name}": change for name, change in recipe.model_dump(mode="json")["variations"].items()}
        value[f"{VARIED}{PAIRED}"] = recipe.variations.paired
    value |= _movements(planned)
    digests = {name: hashlib.sha256(json.dumps(value[name]).encode()).hexdigest()[:16] for name in value}
    return digests | {LOOK: engine_digest(recipe.engine.name)}


def _movements(planned: Plan) -> Iterator[tuple[str, JsonValue]]:
    """Yield each model's motion in sequences, and the clip and rate an animated model plays, by names of settings."""
    entries = [entry.model_dump(mode="json", include=set(MOVES)) for entry in planned.recipe.models]
    for spec, number in zip(planned.model_specs, planned.entries, strict=True):
        is_meant = {"motion": planned.recipe.time is not None, "clip": spec.rest is not None, "fps": spec.rest is not None}
        yield from ((f"{field}{OF}{spec.key}", entries[number].get(field)) for field in MOVES if is_meant[field])


def _check_sampler(planned: Plan, part: Part) -> None:
    """Check that scenes are added to scenes, and models x poses to models x poses."""
    if part.is_sampled and part.sampler != planned.recipe.sampler:
        raise RecipeError(
            f"scenes: expected frames of sampler {part.sampler}, as the data set has; found {planned.recipe.sampler}: {FITTING}"
        )


def _check_settings(planned: Plan, own: Settings, part: Part) -> None:
    added = [name for name in own if part.settings and name not in part.settings and name in (RIG, *SHOWN)]
    for name in (*part.settings, *added):
        if OF not in name and own.get(name) != part.settings.get(name) and (name in own or not name.startswith(VARIED)):
            settings = planned.recipe.model_dump(mode="json")
            values = [_value(recipe, name) for recipe in (part.recipe, settings)]
            differ = f"{values[0]}, as the data set has; found {values[1]}"
            if values[0] == values[1]:
                differ = "what the data set has; found another"
            raise RecipeError(f"{name}: expected {differ}: {FITTING}")


def _check_movements(planned: Plan, own: Settings, part: Part) -> None:
    """Check that models move as before: only a model's name and a viewpoint identify its sequences."""
    for spec, number in zip(planned.model_specs, planned.entries, strict=True):
        for field in MOVES:
            name = f"{field}{OF}{spec.key}"
            if own.get(name) != part.settings.get(name, own.get(name)):
                raise RecipeError(
                    f"models[{number}].{field}: expected the {name} that the data set has; found another: give the model "
                    "another name, under which it has frames of its own, or choose another output folder"
                )


def _value(recipe: object, name: str) -> str:
    for field in name.split("."):
        recipe = recipe.get(field) if isinstance(recipe, dict) else None
    return shown(recipe)


def _check_splits(planned: Plan, part: Part) -> None:
    """Check that splits are unchanged, except for lists of new models."""
    if not part.is_sampled:
        return
    before, now = Splits.model_validate(part.recipe["splits"]), planned.recipe.splits
    if _shares(before) != _shares(now):
        raise RecipeError(f"splits: expected {_shares(before)}, as the data set has; found {_shares(now)}: {FITTING}")
    listed = now.listed({spec.key: spec.split for spec in planned.model_specs if spec.split is not None})
    for key, split in part.dealt_splits.items():
        if listed.get(key, split) != split:
            raise RecipeError(
                f"splits: expected model {key!r} in {split!r}, where the data set has it; found it in {listed[key]!r}"
            )


def _shares(splits: Splits) -> str:
    parts = (f"{name} {f'{part:g}' if isinstance(part, (int, float)) else 'listed'}" for name, part in splits.shares.items())
    return f"{', '.join(parts)} by {splits.by}"


def _check_models(planned: Plan, there: PlanRecord) -> None:
    """Refuse models whose keys differ only in case, which some file systems would confuse."""
    known = {key.casefold(): key for key in there.models}
    for key, spec in planned.kept_keys:
        other = known.get(key.casefold(), key)
        if other != key:
            raise RecipeError(f"models: expected keys that differ in more than capitals; found {key!r} beside {other!r}")
        if key != spec.key and key in there.models:
            raise RecipeError(f"models: expected another name for {spec.key!r}; found {key!r}, a model of the data set")
