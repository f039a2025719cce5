"""Random scenes for several samplers: their models, the models' split, and their places.

Scene k depends only on the seed, its name and the models, not on the number of scenes.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from functools import lru_cache, partial
from heapq import nsmallest

from viewsphere.composing.composition import BoxOf, still
from viewsphere.composing.layouts import Laid, laid, remembered_as
from viewsphere.composing.placing import Piece, Room, footprint
from viewsphere.composing.redraws import SAME_MODELS, fewer, least_objects, redraw_names, redraws_place
from viewsphere.composing.scene.scenery import draw_names, place_surfaces, scenery_key
from viewsphere.composing.seeds import Names, generator, share, shares
from viewsphere.errors import RecipeError
from viewsphere.geometry.box3d import Box3d
from viewsphere.limits import limits
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.place import Surface
from viewsphere.model.scene import IDENTITY
from viewsphere.model.thing import Motion, Thing
from viewsphere.planning.samplers.shared.sampling_context import SamplingContext
from viewsphere.planning.splits import drawn_split, shared
from viewsphere.plugins.source import model_for
from viewsphere.recipe.draws import drawn
from viewsphere.recipe.recipe import Recipe
from viewsphere.recipe.world.layout import SurfaceEntry
from viewsphere.recipe.world.scenes import ScenesEntry
from viewsphere.validation.errors import one_of
from viewsphere.validation.quantity import quantity

LOOKS = 8
"""Number of different looks of one piece of scenery."""


def scenes_entry(recipe: Recipe) -> ScenesEntry:
    """The recipe's random scenes."""
    assert isinstance(recipe.scenes, ScenesEntry)
    return recipe.scenes


def scene_names(recipe: Recipe) -> tuple[str, ...]:
    """The scenes' names; raises RecipeError if they have company, or are more than the limit of frames."""
    count = scenes_entry(recipe).count
    if recipe.scene.company is not None:
        raise RecipeError("scene.company: expected none beside scenes, which have several models each; found one: leave it out")
    if count > recipe.max_frames:
        raise RecipeError(
            f"scenes.count: expected at most {recipe.max_frames:,} frames; found {count:,} scenes: set max_frames: {count} in "
            "the recipe if that is meant"
        )
    _check_surface(recipe)
    return tuple(f"scene-{number:06d}" for number in range(count))


def scene_cast(context: SamplingContext, subject: str) -> tuple[ModelSpec, ...]:
    """The models of a scene; with splits by model, all of one split."""
    recipe, entry = context.recipe, scenes_entry(context.recipe)
    models = _models_for(context, _group(context, subject))
    names = (subject, *redraw_names(context.redraw, SAME_MODELS))
    if entry.balance == "models":
        return _mixed(recipe.seed, models, _size(recipe, subject, context.redraw), names, entry.repeat)
    cast: list[ModelSpec] = []
    for category, count in _categories(context.root)[subject]:
        specs_of_category = tuple(spec for spec in models if spec.category == category)
        cast += _mixed(recipe.seed, specs_of_category, count, names, entry.repeat)
    return tuple(sorted(cast, key=lambda spec: share(recipe.seed, "slot", subject, spec.key)))


def _size(recipe: Recipe, subject: str, redraw: int = 0) -> int:
    """The number of models in a scene; late redraws drop some, as far as the recipe allows."""
    count = drawn(scenes_entry(recipe).objects, lambda path: generator(recipe.seed, *path, subject), ("scenes", "objects"))
    return max(least_objects(recipe, count), count - fewer(recipe, redraw))


def _group(context: SamplingContext, subject: str) -> str:
    """The split of a scene's models if splits are by model; else an empty name, which means all."""
    return scene_split(context, subject) if context.recipe.splits.by == "model" else ""


def _models_for(context: SamplingContext, group: str) -> tuple[ModelSpec, ...]:
    """The models that may share a scene of a group."""
    return tuple(spec for spec in context.model_specs if not group or context.dealt_splits[spec.key] == group)


@lru_cache(maxsize=2)
def _categories(context: SamplingContext) -> dict[str, tuple[tuple[str, int], ...]]:
    """Return the number of objects of each category in each scene."""
    recipe, repeat = context.recipe, scenes_entry(context.recipe).repeat
    groups: defaultdict[str, list[str]] = defaultdict(list)
    for subject in context.subjects:
        groups[_group(context, subject)].append(subject)
    categories: dict[str, tuple[tuple[str, int], ...]] = {}
    for group, subjects in groups.items():
        there = Counter(spec.category for spec in _models_for(context, group))
        categories |= _balanced(recipe.seed, {name: _size(recipe, name) for name in subjects}, there, repeat)
    return categories


def scene_split(context: SamplingContext, subject: str) -> str:
    """The split of a scene if splits are by model: the scene draws its split first, then models of this split. If some models
    are listed, shares follow from the numbers of models.
    """
    return drawn_split(_shares(context.root), context.recipe.lasting_seed, (subject,))


def scene_laid(context: SamplingContext, subject: str, pose: str | None, box_of: BoxOf) -> Laid:
    """The models of a scene as its layout places them; the last results are cached, independent of redraws of frames."""
    return _laid(context.root, context.redraw, subject, pose, box_of)


@lru_cache(maxsize=4)
def _laid(root: SamplingContext, redraw: int, subject: str, pose: str | None, box_of: BoxOf) -> Laid:
    context, recipe, entry = root.redrawn(redraw), root.recipe, scenes_entry(root.recipe)
    models = (*scene_cast(context, subject), *_distractors(context, subject))
    stand = _surface(context, subject, pose)
    if stand is None:
        free = None if context.composition is None else context.composition.free_floor(subject, pose, redraw)
    else:
        free = footprint(
            Box3d.between((-stand.size[0] / 2, -stand.size[1] / 2, 0), (stand.size[0] / 2, stand.size[1] / 2, 0)).corners,
            IDENTITY,
        )
    world_from_room = IDENTITY if stand is None else stand.world_from_surface
    built = None if context.composition is None else context.composition.built(subject, pose, redraw, world_from_room)
    again = redraw_names(redraw)
    names = ("scene", subject, *again) if pose is None else ("scene", subject, pose, *again)
    roads = None if stand is not None else context.composition
    room = Room(
        free,
        entry.gap,
        entry.spots,
        field="scenes",
        below=0.0 if stand is None else stand.world_from_surface[2][3],
        clearance=None if stand is None else stand.clearance,
        memory=partial(context.memory, remembered_as(entry, models, names)),
        moves=recipe.time is not None,
        built=built,
        lanes=roads.lanes(subject, pose, redraw) if roads else (),
        bays=roads.bays(subject, pose, redraw) if roads else (),
        pavements=roads.pavements(subject, pose, redraw) if roads else (),
        furniture=roads.furniture(subject, pose, redraw) if roads else None,
    )
    rng = partial(generator, recipe.seed, "layout", subject, *again)
    return laid(entry.layout, entry.orientation, models, room, box_of, rng, world_from_room)


def scene_things(context: SamplingContext, subject: str, pose: str | None, box_of: BoxOf) -> tuple[Thing, ...]:
    """The placed models of a scene; raises RecipeError if there is not enough room."""
    layout, cast = scene_laid(context, subject, pose, box_of), scene_cast(context, subject)
    return still(cast, layout.poses[: len(cast)])


def scene_distractors(context: SamplingContext, subject: str, pose: str | None, box_of: BoxOf) -> tuple[Thing, ...]:
    """The placed models of a scene that are not labelled."""
    layout, count = scene_laid(context, subject, pose, box_of), len(scene_cast(context, subject))
    placed = zip(layout.members[count:], layout.poses[count:], strict=True)
    return tuple(Thing(id=0, model=spec, motion=Motion.still(at), scenery=True) for spec, at in placed)


def _distractors(context: SamplingContext, subject: str) -> tuple[ModelSpec, ...]:
    entry, models = scenes_entry(context.recipe), [spec for spec, _ in context.distractors]
    if not models:
        return ()
    count = drawn(entry.distractors, lambda path: generator(context.recipe.seed, *path, subject), ("scenes", "distractors"))
    names = (subject, "distractors", *redraw_names(context.redraw, SAME_MODELS))
    return _mixed(context.recipe.seed, models, count, names, repeat=True)


def scene_around(context: SamplingContext, subject: str, pose: str | None, box_of: BoxOf) -> tuple[Thing, ...]:
    """Return the background pieces that a scene's layout adds, such as the table or box for its models."""
    pieces = list(scene_laid(context, subject, pose, box_of).around)
    on, seed = scenes_entry(context.recipe).surface, context.recipe.seed
    if isinstance(on, SurfaceEntry):
        pieces.append(Piece(model_for("table"), (on.size[0], on.height, on.size[1]), IDENTITY))
    return tuple(
        Thing(id=0, model=_spec(piece, seed, subject), motion=Motion.still(piece.world_from_piece), scenery=True)
        for piece in pieces
    )


def _spec(piece: Piece, seed: int, subject: str) -> ModelSpec:
    """The model of a piece of scenery, in one of a few looks drawn for the scene."""
    name = piece.source.partition(":")[2]
    look = int(generator(seed, "piece", subject, name).integers(LOOKS))
    return ModelSpec(
        key=scenery_key(name, f"{piece.size} {look}"),
        source=piece.source,
        seed=look,
        category=name,
        category_id=0,
        centring="as_is",
        size=piece.size,
    )


def _check_surface(recipe: Recipe) -> None:
    """Raise RecipeError if models are to stand on a surface that no draw of the place has."""
    on, place = scenes_entry(recipe).surface, recipe.scene.place
    if isinstance(on, str):
        names = () if place is None else draw_names(place.draw, "scene-000000", "")
        draws = limits.MAX_REDRAWS if redraws_place(recipe) else 1
        surfaces: dict[str, Surface] = {}
        for redraw in range(draws):
            if on not in surfaces:
                surfaces |= {
                    surface.name: surface for surface in place_surfaces(recipe, place, (*names, *redraw_names(redraw)))
                }
        _named(on, tuple(surfaces.values()))


def _surface(context: SamplingContext, subject: str, pose: str | None) -> Surface | None:
    """Return the surface under a scene's models, world axes; None for the floor. Raises RecipeError for an absent surface."""
    on = scenes_entry(context.recipe).surface
    if on is None:
        return None
    if isinstance(on, SurfaceEntry):
        return Surface("on", ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, on.height), (0, 0, 0, 1)), on.size)
    return _named(on, () if context.composition is None else context.composition.surfaces(subject, pose, context.redraw))


def _named(name: str, found: Sequence[Surface]) -> Surface:
    names = {surface.name: surface for surface in found}
    if not names:
        raise RecipeError(
            f"scenes.surface: expected a scene.place that has surfaces, or {{size: [1.2, 0.8], height: 0.75}}; found {name!r}"
        )
    if name not in names:
        raise RecipeError(f"scenes.surface: {one_of(name, tuple(names))}")
    return names[name]


def scene_views(context: SamplingContext, subject: str) -> Sequence[int]:
    """Numbers of a scene's viewpoints, ascending: if they are drawn, those with the lowest hashes."""
    if not are_views_drawn(context):
        return range(len(context.views))
    hashed = shares(context.recipe.seed, "scene's views", subject, each=context.view_names)
    return sorted(sorted(range(len(hashed)), key=hashed.__getitem__)[: scenes_entry(context.recipe).views])


def are_views_drawn(context: SamplingContext) -> bool:
    """Return whether each scene uses only some of the viewpoints."""
    count = scenes_entry(context.recipe).views
    return count is not None and count < len(context.views)


def check_scene_models(context: SamplingContext) -> None:
    """Raise RecipeError if a scene may need more models than exist, or, with splits by model, than one split has."""
    entry = scenes_entry(context.recipe)
    groups, names = {"": context.models}, [""]
    if context.recipe.splits.by == "model":
        groups, names = Counter(context.dealt_splits.values()), list(_shares(context))
    for name in names:
        if groups[name] < (1 if entry.repeat else entry.most_objects):
            raise RecipeError(f"scenes.objects: {_too_few(entry, groups[name], context.models, name)}")


def _too_few(entry: ScenesEntry, there: int, models: int, split: str) -> str:
    """The error about scenes that need more models than exist, with its fix."""
    wanted = "at least one model" if entry.repeat else f"up to {quantity(entry.most_objects, 'model')}"
    if not split:
        return (
            f"a scene needs {wanted}, and the recipe has {quantity(there, 'model')}. Add models, ask for fewer, or set "
            "`scenes.repeat: true`."
        )
    others = ("set `scenes.repeat: true`", "ask for fewer") if there and not entry.repeat else ()
    remedies = ", ".join(("Set `splits: {by: scene}`", *others, "or add models"))
    return (
        f"splits are by model, so a scene of split {split!r} needs {wanted} of that split, which has {there} of "
        f"{quantity(models, 'model')}. {remedies}."
    )


@lru_cache(maxsize=2)
def _shares(context: SamplingContext) -> dict[str, float]:
    """The share of the scenes in each split, if splits are by model."""
    splits = context.recipe.splits
    if len(splits.numbers) == len(splits.shares):
        return shared(splits)
    return {name: count / context.models for name, count in sorted(Counter(context.dealt_splits.values()).items())}


def _mixed(seed: int, models: Sequence[ModelSpec], count: int, names: Names, repeat: bool) -> tuple[ModelSpec, ...]:
    """`count` of the models for one scene, each at most once unless they may `repeat`.

    The models with the lowest hashes are chosen: another model in the recipe changes only the places that it gets, at most one
    without repeats.
    """
    if not repeat:
        return tuple(nsmallest(count, models, key=lambda spec: (share(seed, "cast", *names, spec.key), spec.key)))
    return tuple(
        min(models, key=lambda spec: (share(seed, "cast", *names, str(slot), spec.key), spec.key)) for slot in range(count)
    )


def _balanced(
    seed: int, sizes: Mapping[str, int], models: Mapping[str, int], repeat: bool
) -> dict[str, tuple[tuple[str, int], ...]]:
    """Return the number of objects of each category in each scene.

    Over the scenes up to any one, the categories have equal numbers, within one object, while they have enough models.
    `sizes`: the number of objects of each scene, in scene order. `models`: the number of models of each category.
    A model appears at most once in a scene unless `repeat` is set. A scene's result depends on earlier scenes, never on later
    ones.
    """
    had = dict.fromkeys(models, 0)
    members: dict[str, tuple[tuple[str, int], ...]] = {}
    for scene, size in sizes.items():
        counts, order = Counter[str](), sorted(models, key=lambda name: share(seed, "category", scene, name))
        for _ in range(size):
            free = [name for name in order if repeat or counts[name] < models[name]]
            least = min(free, key=lambda name: (had[name], counts[name]))
            had[least] += 1
            counts[least] += 1
        members[scene] = tuple(counts.items())
    return members
