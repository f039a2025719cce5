"""Concrete scenes of a recipe: targets on the floor, and their surroundings."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from viewsphere.composing.filling import shape_of
from viewsphere.composing.layouts import BoxOf, Laid, Remembering, laid, remembered_as, shape, unremembered
from viewsphere.composing.placing import Footprint, Obstacles, Room, footprint, obstacles, standing
from viewsphere.composing.redraws import SAME_MODELS, fewer, least_objects, redraw_names, redraws_place
from viewsphere.composing.scene.blend_scene import BlendScenery
from viewsphere.composing.scene.pictures import IMAGE_SUFFIXES, files_in, proportions
from viewsphere.composing.scene.scenery import (
    TRIES,
    Naming,
    SceneryPiece,
    composed,
    draw_names,
    draw_place,
    free_floor,
    place_bays,
    place_lanes,
    place_pavements,
    place_pieces,
    place_surfaces,
    scenery_key,
)
from viewsphere.composing.seeds import Names, generator, scene_generators, share
from viewsphere.composing.sendable import Sendable
from viewsphere.composing.time_steps import Schedule, TimedPoses
from viewsphere.composing.viewpoints.poses import Poses
from viewsphere.composing.viewpoints.sequence_poses import SequencePoses
from viewsphere.errors import RecipeError
from viewsphere.files import written_path
from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.rotation import transform
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.place import Bay, Lane, Surface
from viewsphere.model.scene import IDENTITY, Matrix4, Vector
from viewsphere.model.thing import Motion, Thing
from viewsphere.recipe.draws import drawn
from viewsphere.recipe.recipe import Recipe
from viewsphere.recipe.world.scenery import Labels, PlaneEntry
from viewsphere.store import Category

__all__ = ["BoxOf", "Composition", "Moved", "Numbering", "center", "center_of_all", "compose", "still"]

Built = Callable[[float, float], Obstacles | None]
"""Returns the parts of a place up to a height, and up to a distance from the middle, metres."""

ABOVE_KERBS = 0.2
"""Metres above a zoo's road up to which its pieces are ground: kerbs, pavements and driveways are 0.14 m high at most."""

Moved = Callable[[Thing, SceneryPiece], Thing]
"""A piece of scenery with its motion."""


def _as_it_stands(thing: Thing, piece: SceneryPiece) -> Thing:
    return thing


@dataclass(frozen=True, eq=False)
class Composition(Sendable):
    """The contents of the frames of a recipe with a place, company or planes; no mesh is read before `things`.

    `subjects`: the subjects of the frames.
    `groups`: the models that may meet; with splits by model, the models of the same split.
    """

    recipe: Recipe
    subjects: tuple[str, ...]
    groups: dict[str, tuple[ModelSpec, ...]]  # model key -> those of its split
    images: tuple[tuple[str, ...], ...]
    recipe_categories: tuple[Category, ...]
    blend: BlendScenery | None = None

    @cached_property
    def categories(self) -> tuple[Category, ...]:
        """The recipe's categories, then those of labelled scenery in order of appearance."""
        known = {c.name: c for c in self.recipe_categories}
        for name in self._labelled_categories():
            known.setdefault(name, Category(len(known) + 1, name, ""))
        return tuple(known.values())

    def _labelled_categories(self) -> Iterator[str]:
        place = self.recipe.scene.place
        if place is not None and place.labels == "own":
            for names in self._place_draws:
                laid = draw_place(self.recipe, place, names).pieces if place.prefix else ()
                yield from (piece.category for piece in laid)
            if not place.prefix:
                yield place.category
        if self.blend is not None:
            yield from (one.category for one in self.blend.labelled)
        yield from (entry.category for entry in self.recipe.scene.planes if entry.labels == "own")

    @cached_property
    def _place_draws(self) -> tuple[tuple[str, ...], ...]:
        place = self.recipe.scene.place
        return tuple(dict.fromkeys(draw_names(place.draw, subject, None) for subject in self.subjects)) if place else ()

    def _category_id(self, category: str, labels: Labels, /) -> int:
        return self._ids[category] if labels == "own" else 0

    @cached_property
    def _ids(self) -> dict[str, int]:
        return {c.name: c.id for c in self.categories}

    @cached_property
    def models(self) -> tuple[ModelSpec, ...]:
        """The models of labelled scenery, each once: the data set keeps them like the recipe's own."""
        return tuple({spec.key: spec for spec in self._labelled_models()}.values())

    def _labelled_models(self) -> Iterator[ModelSpec]:
        place = self.recipe.scene.place
        if place is not None and place.labels == "own":
            for names in self._place_draws:
                yield from (piece.model for piece in self._place(names))
        if self.blend is not None:
            yield from self.blend.models(self._category_id)
        for entry, files in zip(self.recipe.scene.planes, self.images, strict=True):
            if entry.labels == "own":
                yield from (_plane_spec(self.recipe, entry, file, self._category_id) for file in files)

    @cached_property
    def most_scenery(self) -> int:
        """Most pieces of labelled scenery in one frame."""
        scene = self.recipe.scene
        count = sum(entry.most for entry in scene.planes if entry.labels == "own")
        count += 0 if self.blend is None else len(self.blend.labelled)
        if scene.place is not None and scene.place.labels == "own":
            place = scene.place
            count += max(len(draw_place(self.recipe, place, n).pieces) if place.prefix else 1 for n in self._place_draws)
        return count

    def cast(self, spec: ModelSpec, pose: str | None, redraw: int = 0) -> tuple[ModelSpec, ...]:
        """The targets of a frame: its model, and its random company.

        `pose` is the pose's name; None if nothing is drawn for each frame. `redraw` is the number of the scene's redraw.
        """
        entry = self.recipe.scene.company
        if entry is None:
            return (spec,)
        names = draw_names(entry.draw, spec.key, pose)
        count = entry.number
        if entry.count is not None:
            count = drawn(entry.count, scene_generators(self.recipe.seed, names), ("company", "count"))
            count = max(least_objects(self.recipe, count), count - fewer(self.recipe, redraw))
        names += redraw_names(redraw, SAME_MODELS)
        return (spec, *companions(self.recipe.seed, spec, self.groups[spec.key], count, names))

    def targets(
        self,
        spec: ModelSpec,
        pose: str | None,
        box_of: BoxOf,
        again: Names = (),
        memory: Remembering = unremembered,
        seen_from: tuple[float, float] | None = None,
        redraw: int = 0,
    ) -> tuple[Thing, ...]:
        """The placed targets, with the frame's model at the origin; raises RecipeError if there is not enough room. `again`
        names another draw of the company's places; `seen_from`: azimuth and elevation, degrees, of the frame's camera.
        """
        own = standing(box_of(spec))
        company = self.company(spec, pose, box_of, own, again, memory, seen_from, redraw)
        return still((spec,), [own]) if company is None else still((spec, *company.members), [own, *company.poses])

    def company(
        self,
        spec: ModelSpec,
        pose: str | None,
        box_of: BoxOf,
        own: Matrix4,
        again: Names,
        memory: Remembering,
        seen_from: tuple[float, float] | None = None,
        redraw: int = 0,
    ) -> Laid | None:
        """Return the objects placed next to a frame's model, which has the pose `own`; None if there are none."""
        entry = self.recipe.scene.company
        if entry is None:
            return None
        cast, names = self.cast(spec, pose, redraw)[1:], (*draw_names(entry.draw, spec.key, pose), *again)
        taken = ((shape(spec, box_of), own),)
        keep = partial(memory, remembered_as(entry, cast, ("company", spec.key, *names)))
        free, moves = self.free_floor(spec.key, pose, redraw), self.recipe.time is not None
        built = self.built(spec.key, pose, redraw, IDENTITY)
        room = Room(free, entry.gap, entry.spots, taken, seen_from=seen_from, memory=keep, moves=moves, built=built)
        rng = partial(generator, self.recipe.seed, "layout", *names)
        return laid(entry.layout, entry.orientation, cast, room, box_of, rng)

    def place_names(self, subject: str, pose: str | None, redraw: int = 0) -> Names:
        """The names that seed the draw of a scene's place."""
        place = self.recipe.scene.place
        names = draw_names(place.draw, subject, pose) if place else ()
        return names + redraw_names(redraw) if redraw and redraws_place(self.recipe) else names

    def free_floor(self, subject: str, pose: str | None, redraw: int = 0) -> Footprint | None:
        """The free floor of the place, None for an unlimited floor."""
        place = self.recipe.scene.place
        return free_floor(self.recipe, place, self.place_names(subject, pose, redraw)) if place else None

    def built(self, subject: str, pose: str | None, redraw: int, world_from_room: Matrix4) -> Built | None:
        """A function that returns the parts of a place file's mesh up to a height above a floor; None for a zoo's place, whose
        free floor and surfaces are clear.
        """
        place = self.recipe.scene.place
        if place is None or place.prefix:
            return None
        piece = self._place(self.place_names(subject, pose, redraw))[0]
        room_from_piece = composed(_inverse(world_from_room), piece.world_from_piece)
        return lambda height, reach: _built_of((piece.model, None), room_from_piece, height, reach)

    def furniture(self, subject: str, pose: str | None, redraw: int) -> Built | None:
        """A function that returns the objects on the roads, bays and pavements of a zoo's place, such as lamp posts and parked
        cars, up to a height above the floor; None for other places.
        """
        place = self.recipe.scene.place
        if place is None or not place.prefix:
            return None
        pieces = self._place(self.place_names(subject, pose, redraw))
        placed = tuple(sorted(((p.model, p.world_from_piece) for p in pieces), key=lambda one: one[0].key))
        return lambda height, reach: _furniture_of(placed, height, reach)

    def lanes(self, subject: str, pose: str | None, redraw: int = 0) -> tuple[Lane, ...]:
        """The lanes of the place, in world axes; empty for places without."""
        place = self.recipe.scene.place
        return place_lanes(self.recipe, place, self.place_names(subject, pose, redraw)) if place else ()

    def bays(self, subject: str, pose: str | None, redraw: int = 0) -> tuple[Bay, ...]:
        """The parking bays of the place, in world axes; empty for places without."""
        place = self.recipe.scene.place
        return place_bays(self.recipe, place, self.place_names(subject, pose, redraw)) if place else ()

    def pavements(self, subject: str, pose: str | None, redraw: int = 0) -> tuple[Lane, ...]:
        """The pavements of the place, in world axes; empty for places without."""
        place = self.recipe.scene.place
        return place_pavements(self.recipe, place, self.place_names(subject, pose, redraw)) if place else ()

    def surfaces(self, subject: str, pose: str | None, redraw: int = 0) -> tuple[Surface, ...]:
        """Return the surfaces of the place for objects above its floor, world axes; empty where the place has none."""
        place = self.recipe.scene.place
        return place_surfaces(self.recipe, place, self.place_names(subject, pose, redraw)) if place else ()

    def things(
        self,
        subject: str,
        targets: Sequence[Thing],
        pose: str | None,
        box_of: BoxOf,
        moved: Moved = _as_it_stands,
        redraw: int = 0,
    ) -> tuple[Thing, ...]:
        """Return all placed things: targets, labelled scenery, then the scenery that is background.

        `moved` returns pieces of scenery with the motions from the recipe (`piece.motion`).
        """
        pieces = self._pieces(subject, targets, pose, box_of, redraw)
        labelled = [p for p in pieces if p.labels == "own"]
        rest = [p for p in pieces if p.labels != "own"]
        ids = [*range(len(targets) + 1, len(targets) + len(labelled) + 1), *[0] * len(rest)]
        return tuple(targets) + tuple(
            moved(Thing(id=i, model=p.model, motion=Motion.still(p.world_from_piece), scenery=True), p)
            for i, p in zip(ids, labelled + rest, strict=True)
        )

    def _pieces(
        self, subject: str, targets: Sequence[Thing], pose: str | None, box_of: BoxOf, redraw: int
    ) -> list[SceneryPiece]:
        place = self.recipe.scene.place
        pieces: list[SceneryPiece] = []
        if place is not None:
            pieces += self._place(self.place_names(subject, pose, redraw))
        if self.blend is not None:
            pieces += self.blend.pieces(subject, pose, self._category_id)
        prints = [footprint(box_of(t.model), t.world_from_object) for t in targets]
        return pieces + list(
            _plane_pieces(self.recipe, self.images, subject, pose, prints, self._category_id, redraw_names(redraw))
        )

    @cached_property
    def _place(self) -> Callable[[Names], tuple[SceneryPiece, ...]]:
        """The place's pieces for a draw; the last draws are cached, because many shots share one."""
        entry = self.recipe.scene.place
        assert entry is not None

        @lru_cache(maxsize=4)
        def pieces(names: Names) -> tuple[SceneryPiece, ...]:
            return place_pieces(self.recipe, entry, names, self._category_id)

        return pieces

    def center(self, targets: Sequence[Thing], box_of: BoxOf) -> Vector | None:
        """Return the point the camera looks at: the centre of the box around all targets.
        For a single target it is None, which means the same point.
        """
        return None if len(targets) == 1 else center_of_all(targets, box_of)


@dataclass(frozen=True, eq=False)
class Numbering:
    """The number of the subject, frame or sequence of a draw, in the data set's order. `schedules` are the subjects' own, empty
    if every subject has all poses.
    """

    subjects: tuple[str, ...]
    views: Poses
    schedules: tuple[Schedule, ...] = ()

    def __call__(self, names: Names) -> int:
        """The number for a subject's name, or for the names of a subject and a frame or sequence."""
        subject = self._subjects[names[0]]
        if len(names) == 1:
            return subject
        pose = self._poses[names[1]]
        if isinstance(self.views, SequencePoses):  # whose subjects are the inner loop
            return pose * len(self.subjects) + subject
        if not self.schedules:
            return subject * len(self.views) + pose
        return sum(schedule.count for schedule in self.schedules[:subject]) + self.schedules[subject].position(pose)

    @cached_property
    def _subjects(self) -> dict[str, int]:
        return {subject: i for i, subject in enumerate(self.subjects)}

    @cached_property
    def _poses(self) -> dict[str, int]:
        drawn = self.views.base if isinstance(self.views, SequencePoses) else self.views
        return {drawn.name(i): i for i in range(len(drawn))}


def compose(
    recipe: Recipe,
    subjects: tuple[str, ...],
    specs: tuple[ModelSpec, ...],
    own: tuple[Category, ...],
    splits: Sequence[str],
    numbering: Numbering,
) -> Composition:
    """The composition of a recipe with these subjects and this numbering. Only models with equal `splits[i]` share a frame: the
    split of `specs[i]`, or one name for all.

    Raises RecipeError for missing pictures and places, and if there are too few models for company.
    """
    members: defaultdict[str, list[ModelSpec]] = defaultdict(list)
    for spec, split in zip(specs, splits, strict=True):
        members[split].append(spec)
    entry, place = recipe.scene.company, recipe.scene.place
    for split, found in members.items() if entry else ():
        if entry and len(found) <= entry.number:
            of = f" of split {split!r}" if split else ""
            raise RecipeError(
                f"scene.company.count: expected at most {len(found) - 1}, as there are {len(found)} models{of}; "
                f"found {entry.number}: add models, or ask for less company"
            )
    composition = Composition(
        recipe,
        subjects,
        {spec.key: tuple(members[split]) for spec, split in zip(specs, splits, strict=True)},
        _plane_images(recipe),
        own,
        _blend(recipe, numbering),
    )
    if place is not None:
        place_pieces(recipe, place, draw_names(place.draw, subjects[0], ""), lambda category, labels: 1)
    return composition


@lru_cache(maxsize=4)
def _built_of(shown: tuple[ModelSpec, None], room_from_piece: Matrix4, height: float, reach: float) -> Obstacles | None:
    """The triangles of a model up to a height above a room's floor; the last results are kept."""
    mesh = shape_of(shown)
    return obstacles(transform(np.array(room_from_piece), mesh.vertices), mesh.triangles, height, reach)


@lru_cache(maxsize=4)
def _furniture_of(pieces: tuple[tuple[ModelSpec, Matrix4], ...], height: float, reach: float) -> Obstacles | None:
    """The triangles of a place's pieces between its kerbs and a height; the last results are cached. Pieces of one model follow
    one another, so that each mesh is read once.
    """
    vertices, triangles, count = list[NDArray[np.float64]](), list[NDArray[np.int32]](), 0
    for spec, world_from_piece in pieces:
        mesh = shape_of((spec, None))
        placed = transform(np.array(world_from_piece), mesh.vertices)
        if (placed[:, :2].min(axis=0) <= reach).all() and (placed[:, :2].max(axis=0) >= -reach).all():
            vertices.append(placed)
            triangles.append(mesh.triangles + np.int32(count))
            count += len(placed)
    return obstacles(np.concatenate(vertices), np.concatenate(triangles), height, reach, ABOVE_KERBS) if count else None


def _inverse(pose: Matrix4) -> Matrix4:
    rows: list[list[float]] = np.linalg.inv(np.array(pose)).tolist()
    return tuple(map(tuple, rows))  # type: ignore[return-value]


def still(cast: Sequence[ModelSpec], poses: Sequence[Matrix4]) -> tuple[Thing, ...]:
    """Objects 1, 2, ... that stand still."""
    return tuple(Thing(id=i, model=m, motion=Motion.still(w)) for i, (m, w) in enumerate(zip(cast, poses, strict=True), 1))


def center(thing: Thing, box_of: BoxOf) -> Vector:
    """The default point a camera looks at: the centre of the object's box, world metres."""
    x, y, z = transform(thing.world_from_object, box_of(thing.model, thing.step).mean(axis=0)).tolist()
    return x, y, z


def center_of_all(things: Sequence[Thing], box_of: BoxOf) -> Vector:
    """The centre of the box around all of them, world metres."""
    corners = np.concatenate([transform(t.world_from_object, box_of(t.model, t.step)) for t in things])
    x, y, z = ((corners.min(axis=0) + corners.max(axis=0)) / 2).tolist()
    return x, y, z


def _blend(recipe: Recipe, numbering: Numbering) -> BlendScenery | None:
    """The recipe's .blend file; its variants alternate in the order of frame numbers. Raises RecipeError if recipe and file do
    not match.
    """
    entry, views = recipe.scene.blend, numbering.views
    if entry is None:
        return None

    moments = views.moments if isinstance(views, TimedPoses) and entry.frames is not None else ()
    seconds = {moment.frame: moment.seconds for moment in moments if moment is not None}
    scenery = BlendScenery(recipe, entry, numbering, dict(sorted(seconds.items())))
    scenery.check()
    return scenery


def _plane_images(recipe: Recipe) -> tuple[tuple[str, ...], ...]:
    """Absolute paths of the pictures of each entry of planes, sorted; raises RecipeError if there are none."""
    images: list[tuple[str, ...]] = []
    for i, entry in enumerate(recipe.scene.planes):
        if entry.image is not None:
            path = recipe.folder / written_path(entry.image)
            files = (path.as_posix(),) if path.is_file() else ()
            problem = f"scene.planes[{i}].image: expected an image file; found none at {path}"
        else:
            folder = recipe.folder / written_path(entry.images or "")
            files = files_in(folder)
            endings = ", ".join(IMAGE_SUFFIXES)
            problem = f"scene.planes[{i}].images: expected a folder with images ({endings}); found none in {folder}"
        if not files:
            raise RecipeError(problem)
        images.append(files)
    return tuple(images)


def _plane_pieces(
    recipe: Recipe,
    images: Sequence[Sequence[str]],
    model: str,
    pose: str | None,
    targets: Sequence[Footprint],
    category_id: Naming,
    redraw: Names = (),
) -> Iterator[SceneryPiece]:
    """The planes of one model, or of one frame, clear of the targets and of one another; `redraw` names another draw.

    Raises RecipeError if that cannot be.
    """
    standing_there = list(targets)
    for i, entry in enumerate(recipe.scene.planes):
        names = (*draw_names(entry.draw, model, pose), *redraw)
        count = drawn(entry.count, scene_generators(recipe.seed, names), ("planes", str(i), "count"))
        for j in range(count):
            purpose = (*names, str(i), str(j))
            if share(recipe.seed, "plane shown", *purpose) >= entry.share:
                continue
            rng = generator(recipe.seed, "plane", *purpose)
            path = images[i][int(rng.integers(len(images[i])))]
            half = entry.height * proportions(path) / 2
            box = Box3d.between((-half, 0.0, 0.0), (half, 0.0, entry.height)).corners
            move = _plane_spot(f"scene.planes[{i}]", entry, rng, box, standing_there)
            standing_there.append(footprint(box, move))
            yield SceneryPiece(_plane_spec(recipe, entry, path, category_id), move, entry.labels)


def _plane_spot(
    where: str, entry: PlaneEntry, rng: np.random.Generator, box: NDArray[np.float64], others: Sequence[Footprint]
) -> Matrix4:
    if entry.at is not None:
        move = standing(box, *entry.at)
        if not all(footprint(box, move).apart(other, 0.0) for other in others):
            raise RecipeError(
                f"{where}.at: expected the plane clear of the models and of other planes; found it in one: move it"
            )
        return move
    assert entry.around is not None
    (near, far), (low, high) = entry.around.distance, entry.around.azimuth
    for _ in range(TRIES):
        distance, azimuth = near + rng.random() * (far - near), low + rng.random() * (high - low)
        x, y = distance * math.sin(math.radians(azimuth)), -distance * math.cos(math.radians(azimuth))
        move = standing(box, x, y, azimuth + 180.0)
        if all(footprint(box, move).apart(other, 0.0) for other in others):
            return move
    raise RecipeError(
        f"{where}.around: expected room for the plane clear of the models and of other planes; found none: "
        "ask for fewer, or for a larger distance"
    )


def _plane_spec(recipe: Recipe, entry: PlaneEntry, path: str, category_id: Naming) -> ModelSpec:
    """The model of a plane with this picture."""
    file = Path(path)
    inside = file.relative_to(recipe.folder) if file.is_relative_to(recipe.folder) else file.name
    return ModelSpec(
        key=scenery_key(file.stem, f"{inside} {entry.height!r}"),
        source=path,
        category=entry.category,
        category_id=category_id(entry.category, entry.labels),
        unit=entry.height,
        centring="floor",
    )


def companions(seed: int, spec: ModelSpec, others: Iterable[ModelSpec], count: int, names: Names) -> tuple[ModelSpec, ...]:
    """`count` models of `others` as company of a model, which is not among them.

    Each place goes to the model with the lowest hash for it (rendezvous hashing): another model in the recipe changes only the
    places that it gets.
    """
    left = {other.key: other for other in others if other.key != spec.key}
    chosen: list[ModelSpec] = []
    for slot in range(count):
        key = min(left, key=lambda k: (share(seed, "company", *names, str(slot), k), k))
        chosen.append(left.pop(key))
    return tuple(chosen)
