"""The scenery around the targets: the pieces of a place, and flat planes with pictures."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from functools import lru_cache
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from viewsphere.assets.paths.inside import split_source
from viewsphere.composing.placing import Footprint, footprint, standing
from viewsphere.composing.scene.place_file import FileOffers, offers_of
from viewsphere.composing.seeds import Names, generator, scene_generators
from viewsphere.errors import ModelError, RecipeError
from viewsphere.files import written_path
from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.rotation import compose, transform
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.place import Bay, Lane, Place, Surface, Traffic
from viewsphere.model.scene import Matrix4
from viewsphere.plugins.source import place_names, place_of, suggested
from viewsphere.recipe.draws import drawn
from viewsphere.recipe.models import unit_metres
from viewsphere.recipe.recipe import Recipe
from viewsphere.recipe.world.motion import Motions
from viewsphere.recipe.world.scenery import Labels, PlaceEntry
from viewsphere.validation.errors import nearest, one_of

TRIES = 200
"""Spots that are tried for one plane."""

SCENERY = "scenery-"
"""Prefix of scenery's keys."""


class Naming(Protocol):
    """The function that gives a piece of scenery the id of its category: 0 for the background's."""

    def __call__(self, category: str, labels: Labels, /) -> int:
        """The id."""
        ...


@dataclass(frozen=True)
class SceneryPiece:
    """A model and its pose; `labels` is true for an object of its own. name: unique in its place; motion: its motion under
    time, from the recipe's `field`.
    """

    model: ModelSpec
    world_from_piece: Matrix4
    labels: Labels
    name: str = ""
    motion: Motions | None = None
    field: str = ""


def draw_names(draw: str, model: str, pose: str | None) -> Names:
    """The names that a draw depends on.
    `pose` is only needed for a draw per frame or per sequence: the name of the frame or of the sequence.
    """
    if draw == "fixed":
        return ()
    return (model,) if draw == "per_model" or pose is None else (model, pose)


def place_pieces(recipe: Recipe, entry: PlaceEntry, names: Names, category_id: Naming) -> tuple[SceneryPiece, ...]:
    """The place's pieces, rotated by the entry's angle; a file is one piece.

    Raises RecipeError for an unknown place, for a file that is not there, and for motions of pieces that it does not have.
    """
    if entry.prefix:
        return _moving(entry, _laid_pieces(recipe, entry, _turned(recipe, entry, names), names, category_id))
    return _moving(entry, (_place_file(recipe, entry, names, category_id),))


def _laid_pieces(
    recipe: Recipe, entry: PlaceEntry, world_from_place: Matrix4, names: Names, category_id: Naming
) -> tuple[SceneryPiece, ...]:
    laid = draw_place(recipe, entry, names)
    pieces: list[SceneryPiece] = []
    for piece in laid.pieces:
        spec = ModelSpec(
            key=scenery_key(piece.family, f"{piece.seed}"),
            source=f"{entry.prefix}:{piece.family}",
            seed=piece.seed,
            category=piece.category,
            category_id=category_id(piece.category, entry.labels),
            centring="as_is",
        )
        pieces.append(SceneryPiece(spec, composed(world_from_place, piece.world_from_piece), entry.labels, piece.name))
    return tuple(pieces)


def _moving(entry: PlaceEntry, pieces: tuple[SceneryPiece, ...]) -> tuple[SceneryPiece, ...]:
    """The pieces with their motions: the first pattern that a piece's name matches counts."""
    motions = entry.motion or {}
    for pattern in motions:
        if not any(fnmatchcase(piece.name, pattern) for piece in pieces):
            patterns = sorted({piece.name.rstrip("0123456789") + "*" for piece in pieces})
            raise RecipeError(
                f"scene.place.motion: expected patterns of its pieces' names, such as {', '.join(patterns)}; found {pattern!r}"
                f"{nearest(pattern, patterns)}"
            )
    return tuple(_with_motion(piece, motions) for piece in pieces)


def _with_motion(piece: SceneryPiece, motions: Mapping[str, Motions]) -> SceneryPiece:
    for pattern, motion in motions.items():
        if fnmatchcase(piece.name, pattern):
            return replace(piece, motion=motion, field=f"scene.place.motion.{pattern}")
    return piece


def place_lanes(recipe: Recipe, entry: PlaceEntry | None, names: Names) -> tuple[Lane, ...]:
    """The lanes of a placed place, world axes; empty if it has none. Raises RecipeError for a file's lane that cannot be
    one.
    """
    if entry is None:
        return ()
    world_from_place = np.array(_world_from_place(recipe, entry, names))
    return tuple(_carried(lane, world_from_place) for lane in _offered(recipe, entry, names).lanes)


def place_surfaces(recipe: Recipe, entry: PlaceEntry | None, names: Names) -> tuple[Surface, ...]:
    """Return the surfaces of a place for objects above its floor, world axes; empty where the place has none.
    Raises RecipeError for an invalid surface of a file.
    """
    if entry is None:
        return ()
    world_from_place = _world_from_place(recipe, entry, names)
    laid = getattr(_offered(recipe, entry, names), "surfaces", ())
    return tuple(replace(one, world_from_surface=composed(world_from_place, one.world_from_surface)) for one in laid)


def is_indoors(recipe: Recipe, entry: PlaceEntry | None) -> bool:
    """Return whether targets are in a room, as the place or its file states."""
    return entry is not None and (entry.is_room if entry.prefix else _file_offers(recipe, entry).indoors)


def _offered(recipe: Recipe, entry: PlaceEntry, names: Names) -> Any:
    """Return the offers of a place, in its own axes: a `Place`, or the `FileOffers` of a file."""
    return draw_place(recipe, entry, names) if entry.prefix else _file_offers(recipe, entry)


def _file_offers(recipe: Recipe, entry: PlaceEntry) -> FileOffers:
    return offers_of(_file_spec(recipe, entry))


def _world_from_place(recipe: Recipe, entry: PlaceEntry, names: Names) -> Matrix4:
    """World from the axes of a place: those of its layout, or of its file's mesh, of which `origin` is at the world's."""
    world_from_place = _turned(recipe, entry, names)
    if entry.prefix:
        return world_from_place
    x, y, z = entry.origin
    moved = ((1.0, 0.0, 0.0, -x), (0.0, 1.0, 0.0, -y), (0.0, 0.0, 1.0, -z), (0.0, 0.0, 0.0, 1.0))
    return composed(world_from_place, moved)


def _carried(lane: Lane, world_from_place: NDArray[np.float64]) -> Lane:
    points: Any = tuple(map(tuple, transform(world_from_place, lane.points).tolist()))
    return replace(lane, points=points)


def place_bays(recipe: Recipe, entry: PlaceEntry | None, names: Names) -> tuple[Bay, ...]:
    """The parking bays of a placed place, in world axes; empty for places without."""
    if entry is None:
        return ()
    world_from_place = _world_from_place(recipe, entry, names)
    bays = getattr(_offered(recipe, entry, names), "bays", ())
    return tuple(replace(bay, world_from_bay=composed(world_from_place, bay.world_from_bay)) for bay in bays)


def place_pavements(recipe: Recipe, entry: PlaceEntry | None, names: Names) -> tuple[Lane, ...]:
    """The pavements of a placed place, in world axes; empty for places without."""
    if entry is None:
        return ()
    world_from_place = np.array(_world_from_place(recipe, entry, names))
    return tuple(_carried(way, world_from_place) for way in getattr(_offered(recipe, entry, names), "pavements", ()))


def draw_place(recipe: Recipe, entry: PlaceEntry, names: Names) -> Place:
    """The layout that a recipe's seed and these names draw; raises RecipeError for an unknown place."""
    if entry.parked is None and entry.walkers is None:
        return _drawn_place(recipe.seed, entry.source, names, None)
    rngs = scene_generators(recipe.seed, names)
    parked = None if entry.parked is None else drawn(entry.parked, rngs, ("place", "parked"))
    walkers = 0 if entry.walkers is None else drawn(entry.walkers, rngs, ("place", "walkers"))
    return _drawn_place(recipe.seed, entry.source, names, Traffic(parked, walkers))


@lru_cache(maxsize=16)
def _drawn_place(seed: int, source: str, names: Names, traffic: Traffic | None) -> Place:
    place, (_, _, name) = place_of(source), source.partition(":")
    if place is None:
        raise RecipeError(f"scene.place: {one_of(source, place_names())}")
    return place.drawn(generator(seed, "place", name, *names), traffic)


def free_floor(recipe: Recipe, entry: PlaceEntry | None, names: Names) -> Footprint | None:
    """The floor that a place leaves to its targets, None if it is unknown. Raises RecipeError for a file whose `origin` is
    not on its floor.
    """
    if entry is None:
        return None
    if not entry.prefix:
        return _floor_of_file(recipe, entry, names)
    rectangle = draw_place(recipe, entry, names).free
    if rectangle is None:
        return None
    x0, y0, x1, y1 = rectangle
    return footprint(Box3d.between((x0, y0, 0.0), (x1, y1, 0.0)).corners, _turned(recipe, entry, names))


def _floor_of_file(recipe: Recipe, entry: PlaceEntry, names: Names) -> Footprint | None:
    floor = _file_offers(recipe, entry).floor
    if floor is None:
        return None
    if not floor.has(entry.origin):
        raise RecipeError(
            f"scene.place.origin: expected a point on {floor.name!r}, the floor of {Path(entry.source).name}, such as "
            f"{[round(v, 3) for v in floor.middle]}; found {list(entry.origin)}: set origin, or call the object another name"
        )
    return footprint(floor.box, composed(_world_from_place(recipe, entry, names), floor.place_from_floor))


def _turned(recipe: Recipe, entry: PlaceEntry, names: Names) -> Matrix4:
    """World from place."""
    turn = drawn(entry.turn, scene_generators(recipe.seed, names), ("place", "turn"))
    return standing(np.zeros((8, 3)), azimuth_deg=turn)


def composed(a: ArrayLike, b: ArrayLike) -> Matrix4:
    """The rigid motion (4, 4) that does `b`, then `a`, as things keep it."""
    rows: Any = tuple(tuple(row) for row in compose(np.array(a), np.array(b)).tolist())
    return rows


def _place_file(recipe: Recipe, entry: PlaceEntry, names: Names, category_id: Naming) -> SceneryPiece:
    spec = _file_spec(recipe, entry).model_copy(update={"category_id": category_id(entry.category, entry.labels)})
    return SceneryPiece(spec, _world_from_place(recipe, entry, names), entry.labels, Path(spec.source).stem)


def _file_spec(recipe: Recipe, entry: PlaceEntry) -> ModelSpec:
    """The model of a file; raises RecipeError for one that is not there."""
    path = recipe.folder / written_path(entry.source)
    try:
        file, inside = split_source(path)
    except ModelError as error:
        raise RecipeError(f"scene.place: {error}") from None
    if not file.is_file():
        example, hint = place_names()[:1], suggested(entry.source, place_names)
        expected = "".join(("expected a place", *(f", such as {name}," for name in example), " or a model file"))
        raise RecipeError(f"scene.place: {expected}; found none at {file}{hint}")
    return ModelSpec(
        key=scenery_key(path.stem, "/".join((file.name, *inside))),
        source=path.as_posix(),
        category=entry.category,
        category_id=0,
        up=entry.up,
        forward=entry.forward,
        unit=None if entry.unit is None else unit_metres(entry.unit),
        centring="as_is",
    )


def scenery_key(name: str, rest: str) -> str:
    """A readable key that differs for other scenery."""
    safe = "".join(c if c.isalnum() or c in "-_" else "_" for c in name)[:60]
    return f"{SCENERY}{safe}-{hashlib.sha256(f'{name}/{rest}'.encode()).hexdigest()[:10]}"
