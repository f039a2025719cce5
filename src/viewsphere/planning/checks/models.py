"""The checks of a recipe before planning; each raises RecipeError for the first violation."""

from __future__ import annotations

import math
from collections.abc import Mapping
from fnmatch import fnmatchcase
from typing import Any, cast

from pydantic import JsonValue

from viewsphere import plugins
from viewsphere.composing.layouts import check_layout, check_orientation
from viewsphere.composing.motion import check_motions
from viewsphere.composing.redraws import redraws_frames
from viewsphere.composing.scene.draws import check_night
from viewsphere.composing.viewpoints.poses import Poses
from viewsphere.errors import RecipeError
from viewsphere.labels import channels, is_channel, is_on_request, label_named, labels, on_request
from viewsphere.model.channel import MATERIAL_PASSES, PASSES
from viewsphere.model.model_spec import ModelSpec
from viewsphere.planning.models import Listing, count_models
from viewsphere.plugins.engine import EngineSpec
from viewsphere.plugins.format import FormatSpec
from viewsphere.plugins.sampler import SamplerSpec
from viewsphere.printable import printable
from viewsphere.recipe.draws import alternatives, span
from viewsphere.recipe.recipe import Recipe
from viewsphere.recipe.world.light import NightSky
from viewsphere.recipe.world.scenes import SamplerEntry, ScenesEntry
from viewsphere.recipe.world.surface import GroundEntry
from viewsphere.recipe.world.weather import FogEntry
from viewsphere.validation.errors import nearest, one_of, read_options, shown
from viewsphere.validation.suggestions import suggestion


def check_recipe(recipe: Recipe) -> None:
    """Check everything that the recipe alone decides: names, the scene of each condition, splits, redraws and motions."""
    _check_names(recipe)
    _check_blend(recipe)
    for condition in recipe.conditions.values():
        _check_catcher(condition)
        _check_shutter(condition)
        _check_photo(condition)
        check_night(condition)
    _check_splits(recipe)
    _check_redraws(recipe)
    check_motions(recipe)


def check_specs(recipe: Recipe, specs: tuple[ModelSpec, ...]) -> None:
    """Check that the models allow the recipe's listed scenes and its materials."""
    _check_listed(recipe, specs)
    _check_materials(recipe, specs)


def _check_redraws(recipe: Recipe) -> None:
    """Check that a recipe that redraws for visibility has values to redraw, and that only still pictures may be empty."""
    for name in ("min_visibility", "wanted", "empty") if recipe.time is not None else ():
        if getattr(recipe, name) is not None:
            raise RecipeError(f"{name}: expected none beside time, as it is about single pictures; found one: leave it out")
    if recipe.wanted is not None and recipe.min_visibility is not None:
        raise RecipeError("wanted: expected wanted or min_visibility; found both: write wanted: {visibility: [0.3, 1]}")
    for name in ("min_visibility", "wanted"):
        if getattr(recipe, name) is not None and not redraws_frames(recipe):
            raise RecipeError(
                f"{name}: expected something to draw again, viewpoints of kind sphere, normal or jitter, scene.jitter or "
                f"scene.company.draw: per_frame; found viewpoints of kind {cast(Any, recipe.viewpoints).kind} and nothing "
                "drawn for each frame"
            )


def check_distractors(recipe: Recipe) -> None:
    """Check that the recipe has labelled models, and that it has distractors exactly if it requests them."""
    unlabelled = [i for i, entry in enumerate(recipe.models) if not entry.is_labelled]
    asked = span(recipe.scenes.distractors)[1] if isinstance(recipe.scenes, ScenesEntry) else 0
    if len(unlabelled) == len(recipe.models):
        raise RecipeError(
            "models[0].labels: expected models that are labelled beside distractors; found none: leave labels out"
        )
    if unlabelled and not asked:
        raise RecipeError(
            f"models[{unlabelled[0]}].labels: expected scenes.distractors beside background, how many are put among the "
            "others; found none: set scenes: {count: 100, distractors: [1, 5]}"
        )
    if asked and not unlabelled:
        raise RecipeError("scenes.distractors: expected models with labels: background; found none")


def _check_names(recipe: Recipe) -> None:
    """Check that the engine, the formats, the sampler, the placer and the channels are known, and work with still pictures if
    the recipe has no time.
    """
    _check_plugin("engine", "engines", recipe.engine.name)
    for i, entry in enumerate(recipe.formats):
        _check_plugin(f"formats[{i}]", "formats", entry.name)
        if plugins.is_third_party("formats", entry.name):
            plugins.load(FormatSpec, entry.name)  # raises for a faulty one; our own are loaded when they are written
        if entry.options:
            entry.arguments(f"formats[{i}].{entry.name}")
    company = recipe.scene.company
    if company is not None:
        check_layout(company.layout, "scene.company")
        check_orientation(company.orientation, "scene.company")
    _check_plugin("scenes.sampler", "samplers", recipe.sampler)
    if isinstance(recipe.scenes, SamplerEntry):
        plugins.load(SamplerSpec, recipe.sampler).read_options(recipe.sampler, recipe.scenes.options, "scenes")
    if isinstance(recipe.scenes, ScenesEntry):
        check_layout(recipe.scenes.layout, "scenes")
        check_orientation(recipe.scenes.orientation, "scenes")
    for i, name in enumerate(recipe.channels):
        if is_on_request(name):
            raise RecipeError(f"channels[{i}]: expected a channel; found {name}, which is one of annotations")
        if not is_channel(name):
            raise RecipeError(f"channels[{i}]: {_unknown(name, tuple(channels()))}")
        check_needs(recipe, f"channels[{i}]", name)
        _check_painted(recipe, f"channels[{i}]", name)
    deep = recipe.files.deep
    if deep and "rgba" in recipe.channels and not {"rgb", deep} & set(recipe.channels):
        raise RecipeError(
            "files.rgb: expected png, jpeg, webp, qoi or jxl with scene.background: transparent, whose pictures have eight "
            f"bits; found {recipe.files.rgb}: name {deep} in channels, which has the sky, or set a background"
        )
    for i, name in enumerate(recipe.annotations):
        _check_annotation(recipe, f"annotations[{i}]", name)
    for name, given in recipe.labels.items():
        _check_options(recipe, name, given)


def _check_plugin(field: str, kind: plugins.Kind, name: str) -> None:
    """Check that a plug-in is known."""
    known = plugins.names(kind)
    if name not in known:
        raise RecipeError(f"{field}: {one_of(name, known)}")


def _check_annotation(recipe: Recipe, where: str, name: str) -> None:
    """Check that a label is available, and that the recipe has its requirements."""
    if is_channel(name):
        raise RecipeError(f"{where}: expected a label of objects or of pictures; found {name}, which is one of channels")
    if label_named(name) and not is_on_request(name):
        raise RecipeError(f"{where}: expected a label on request; found {name}, which every data set has: leave it out")
    if not is_on_request(name):
        of = [label.name for label in on_request().values() if name in {field.name for field in label.fields}]
        known = f"expected a label; found {name}, a field of {of[0]}: name that" if of else _unknown(name, tuple(on_request()))
        raise RecipeError(f"{where}: {known}")
    check_needs(recipe, where, name)


def _unknown(name: str, known: tuple[str, ...]) -> str:
    """The message for an unknown label, with a note if the name means a label that every data set has."""
    meant = None if suggestion(name, known) else suggestion(name, labels())
    if meant is None or meant in on_request() or meant in channels():
        return one_of(name, known)
    return f"{shown(name)} is unknown; `{meant}` is in every data set: leave it out. Valid: {', '.join(known)}"


def _check_options(recipe: Recipe, name: str, given: Mapping[str, JsonValue]) -> None:
    """Check the options of a requested label."""
    label = label_named(name)
    if label is None:
        raise RecipeError(f"labels: {one_of(name, tuple(name for name, label in labels().items() if label.options))}")
    options = label.options
    if options is None:
        raise RecipeError(f"labels.{name}: expected no options, {name} has none; found {', '.join(given) or 'a mapping'}")
    if name not in (*recipe.channels, *recipe.annotations):
        raise RecipeError(
            f"labels: expected labels that the recipe names; found {name!r}: name it in channels or annotations, too"
        )
    read_options(options, given, f"labels.{name}")


def check_needs(recipe: Recipe, where: str, name: str) -> None:
    """Check that the recipe has the inputs of a label: instants, sensors, a LiDAR, tracks; raises RecipeError."""
    label = label_named(name)
    for need in label.needs if label else ():
        if need.is_missing(recipe):
            section = need.SECTION
            raise RecipeError(f"{where}: expected {section} beside {name}, {need.PURPOSE}; found none: set {section}")


def _check_painted(recipe: Recipe, where: str, name: str) -> None:
    """Check that the engine supports a pass; passes of materials also need materials made by viewsphere."""
    paints = _engine(recipe).paints
    if name in PASSES and name not in paints:
        raise RecipeError(
            f"{where}: expected a label, or what engine: {recipe.engine.name} paints ({', '.join(paints)}); found {name}: "
            "leave it out, or take engine: raster or cycles"
        )
    if name in MATERIAL_PASSES and recipe.scene.blend is not None:
        raise RecipeError(
            f"{where}: expected no {name} with scene.blend, whose materials may be any nodes; found it: leave it out, or take "
            "the file's meshes alone by scene.place"
        )


def _check_blend(recipe: Recipe) -> None:
    """Check that the engine renders .blend files, if the scene is one."""
    if recipe.scene.blend is not None and not _engine(recipe).opens_scenes:
        raise RecipeError(
            f"scene.blend: expected engine: cycles, eevee or workbench, which render the file; found {recipe.engine.name}: "
            "name one of these, or take the file's meshes alone by scene.place"
        )


def _check_catcher(recipe: Recipe) -> None:
    """Check that the engine supports shadow catchers, if the ground may be one."""
    scene = recipe.scene
    grounds = [scene.automatic_ground if ground == "auto" else ground for ground in alternatives(scene.ground)]
    catches = any(ground == "catcher" or (isinstance(ground, GroundEntry) and ground.catcher) for ground in grounds)
    if catches and not _engine(recipe).catches_shadows:
        raise RecipeError(
            f"scene.ground: expected on, off or a material for engine: {recipe.engine.name}; found catcher, which auto is "
            "before background: environment: set it to off, or take engine: cycles or raster"
        )


def _engine(recipe: Recipe) -> EngineSpec:
    return plugins.load(EngineSpec, recipe.engine.name)


def check_frames(recipe: Recipe, views: Poses, listing: Listing) -> None:
    """Check that models x poses do not exceed the limit, if the sampler renders their product."""
    if recipe.scenes is not None:
        return
    models, count = count_models(listing), math.prod(views.counts.values())
    if models * count > recipe.max_frames:
        factors = " x ".join(f"{n:,} {what}" for what, n in {"models": models, **views.counts}.items())
        raise RecipeError(
            f"viewpoints: expected at most {recipe.max_frames:,} frames; found {models * count:,} ({factors}): "
            f"set max_frames: {models * count} in the recipe if that is meant"
        )


def check_sizes(recipe: Recipe, views: Poses, sampler: SamplerSpec) -> None:
    """Check that pictures with lenses from a file have one size, unless the sampler supports several."""
    if not recipe.camera.of_viewpoints or sampler.of_any_size:
        return
    sizes = {f"{lens.width} x {lens.height}" for i in range(len(views)) if (lens := views.lens(i))}
    if len(sizes) > 1:
        raise RecipeError(
            f"camera.of_viewpoints: expected lenses of one size; found {', '.join(sorted(sizes)[:3])}: list what they show, "
            "with scenes: {sampler: listed}"
        )


def check_all_frames(recipe: Recipe, frames: int, factors: str) -> None:
    """Check that the number of frames, with all time steps or scenes, does not exceed the limit."""
    if frames > recipe.max_frames:
        raise RecipeError(
            f"models: expected at most {recipe.max_frames:,} frames; found {frames:,} ({factors}): "
            f"set max_frames: {frames} in the recipe if that is meant"
        )


def _check_listed(recipe: Recipe, specs: tuple[ModelSpec, ...]) -> None:
    """Check that models listed in splits exist and are listed once; if no split has a share, all models must be listed."""
    keys, seen = {spec.key for spec in specs}, dict[str, str]()
    for name, listed in recipe.splits.shares.items():
        for key in listed if isinstance(listed, tuple) else ():
            if key not in keys:
                raise RecipeError(f"splits.{name}: expected keys of models; found {key!r}{nearest(key, keys)}")
            if key in seen:
                raise RecipeError(
                    f"splits.{name}: expected every model in one split; found {key!r}, listed in {seen[key]!r} too"
                )
            seen[key] = name
    of_sets = {spec.key: spec.split for spec in specs if spec.split is not None}
    seen |= recipe.splits.listed(of_sets)
    if not recipe.splits.numbers and keys - seen.keys():
        first = min(keys - seen.keys())
        fix = (
            f"`{printable(of_sets[first])}: set`" if first in of_sets else "it to the list of a split, or a split with a share"
        )
        raise RecipeError(f"splits: expected every model to be listed; found no split for {first!r}. Add {fix}")


def _check_photo(recipe: Recipe) -> None:
    """Refuse fog and night with a photograph as the background, which has its own weather and hour."""
    scene = recipe.scene
    if not any(entry.image is not None or entry.images is not None for entry in scene.backgrounds):
        return
    is_foggy = any(isinstance(fog, FogEntry) for fog in alternatives(scene.fog))
    is_dark = any(isinstance(sky, NightSky) for sky in alternatives(scene.sky))
    if is_foggy or is_dark:
        field, what = ("scene.fog", "fog") if is_foggy else ("scene.sky", "night")
        raise RecipeError(
            f"{field}: {what} does not reach the photographs of `scene.background`, which would stay clear and bright behind "
            f"the models. Leave out {what}, or use `background: sky` or photographs of such weather with `scene.sun: off`"
        )


def _check_shutter(recipe: Recipe) -> None:
    """Refuse a recipe that blurs moving things twice: by an open shutter, and by an effect."""
    if recipe.time is None or not recipe.time.shutter:
        return
    for spec, _ in recipe.scene.effects.strengths:
        if spec.shows_motion:
            raise RecipeError(
                f"time.shutter: expected 0 beside scene.effects.{spec.name}, which blurs pictures, too; found "
                f"{recipe.time.shutter:g}: leave one of them out"
            )


def _check_splits(recipe: Recipe) -> None:
    """Check that a recipe with splits by place has a place."""
    if recipe.splits.by == "place" and recipe.scene.place is None:
        raise RecipeError(
            "splits.by: expected scene.place, whose draws it tells apart; found none: set one, or split by model, pose or frame"
        )


def _check_materials(recipe: Recipe, specs: tuple[ModelSpec, ...]) -> None:
    """Check that every change of materials matches some model."""
    for i, entry in enumerate(recipe.scene.materials):
        if not any(fnmatchcase(spec.key, entry.models) for spec in specs):
            raise RecipeError(
                f"scene.materials[{i}].models: expected a pattern of models' keys, such as {specs[0].key}; "
                f"found {entry.models!r}, which fits none"
            )
