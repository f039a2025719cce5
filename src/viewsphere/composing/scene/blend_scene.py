"""A .blend file around the targets: its labelled objects, its shown objects, and the place of the targets."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from viewsphere.composing.scene.scenery import Naming, SceneryPiece, draw_names, scenery_key
from viewsphere.composing.seeds import Names, share
from viewsphere.composing.sendable import Sendable
from viewsphere.errors import ModelError, RecipeError
from viewsphere.files import open_file, written_path
from viewsphere.geometry.rotation import Float, compose, transform
from viewsphere.model.model_spec import ModelSpec, Parts
from viewsphere.model.scene import BlendScene, Matrix4
from viewsphere.model.thing import Motion, Thing, TimeStep
from viewsphere.recipe.recipe import Recipe
from viewsphere.recipe.world.blend import VALUE, BlendEntry, LabelRule, VariantEntry
from viewsphere.recipe.world.scenery import Labels
from viewsphere.validation.errors import nearest

if TYPE_CHECKING:
    from viewsphere.assets.scene_file import SceneFile, SceneObject

NAMES_SAID = 5
"""Largest number of names in a message, which is one line."""

Turn = Callable[[Names], int]
"""Returns the number of the model or frame of a draw, in the data set's order."""


@dataclass(frozen=True)
class _Labelled:
    """An object that is labelled, the names of all objects that are part of it, and its category."""

    root: SceneObject
    members: tuple[str, ...]
    category: str


@dataclass(frozen=True, eq=False)
class BlendScenery(Sendable):
    """The .blend file of a recipe's scene, at the requested frames (none: its first), each with its `seconds`. `turn_of`
    returns the number by which variants alternate.
    """

    recipe: Recipe
    entry: BlendEntry
    turn_of: Turn
    seconds: Mapping[int, float] = field(default_factory=dict[int, float])

    @property
    def frames(self) -> tuple[int, ...]:
        """The requested frames, ascending."""
        return tuple(self.seconds)

    @property
    def path(self) -> Path:
        """The file."""
        return self.recipe.folder / written_path(self.entry.file)

    @cached_property
    def file(self) -> SceneFile:
        """The contents of the file, which Blender reads once."""
        if not self.path.is_file():
            raise RecipeError(f"scene.blend.file: expected a .blend file; found none at {self.path}")
        try:
            from viewsphere.assets.scene_file import scene_file  # which loads the modules that run Blender

            patterns = tuple(v.one_of for v in self.entry.variants.values())
            return scene_file(self.path, self.entry.confined, patterns, self.frames)
        except ModelError as error:
            raise RecipeError(f"scene.blend.file: {error}") from None

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """The warnings about the file."""
        dark = f"{self.path.name}: no light and no world; lit by the default sun and sky"
        lines = [f"scene.blend: {line}" for line in (*self.file.warnings, *([] if self.file.is_lit else [dark]))]
        seen = {name for one in self.labelled for name in (one.root.name, *one.members)}
        for i, rule in enumerate(self.entry.labels):
            if not any(_fits(rule, one) and one.name in seen for one in self.file.objects):
                lines.append(f"scene.blend.labels[{i}]: what it fits is nothing that a render shows")
        return tuple(lines)

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the file."""
        with open_file(self.path) as file:
            return hashlib.file_digest(file, "sha256").hexdigest()

    @cached_property
    def labelled(self) -> tuple[_Labelled, ...]:
        """The labelled objects that are visible in renders at any time, ordered by name."""
        category = {one.name: self._category(one) for one in self.file.objects}
        root_of = {one.name: self._root(one, category) for one in self.file.objects}
        members: dict[str, list[str]] = {}
        for one in self.file.objects:
            if (root := root_of[one.name]) is not None and one.parts:
                members.setdefault(root.name, []).append(one.name)
        by_name = self.file.by_name
        return tuple(_Labelled(by_name[name], tuple(found), category[name] or "") for name, found in sorted(members.items()))

    def _category(self, one: SceneObject) -> str | None:
        """Return the category of an object itself; None if no rule fits."""
        for rule in self.entry.labels:
            if _fits(rule, one):
                return str(one.properties[rule.property]) if rule.property and rule.category == VALUE else rule.category
        return None

    def _root(self, one: SceneObject, category: Mapping[str, str | None]) -> SceneObject | None:
        """The object that `one` is a part of: its farthest parent with the same label, without other labels in between."""
        root = None
        for member in (one, *self.file.ancestors(one)):
            own = category[member.name]
            if own and (root is None or own == category[root.name]):
                root = member
            elif own:
                break
        return root

    @cached_property
    def groups(self) -> Mapping[str, tuple[tuple[str, ...], ...]]:
        """The members of each group of variants, by name: an object and its children."""
        members: dict[str, tuple[tuple[str, ...], ...]] = {}
        for name, entry in self.entry.variants.items():
            roots = [one for one in self.file.objects if fnmatchcase(one.name, entry.one_of)]
            inside = {one.name for one in roots}
            tops = [one for one in roots if not any(a.name in inside for a in self.file.ancestors(one))]
            members[name] = tuple((top.name, *self._below(top)) for top in tops)
        return members

    def _below(self, top: SceneObject) -> Iterator[str]:
        return (one.name for one in self.file.objects if top in self.file.ancestors(one))

    def hidden(self, model: str, pose: str | None) -> tuple[str, ...]:
        """Names of the objects that a model's shot, or a pose's, does not show."""
        return tuple(
            name
            for group, members in self.groups.items()
            for i, member in enumerate(members)
            if i != self._chosen(group, self.entry.variants[group], len(members), model, pose)
            for name in member
        )

    def _chosen(self, group: str, entry: VariantEntry, count: int, model: str, pose: str | None) -> int:
        names = draw_names(entry.draw, model, pose)
        if entry.order == "in_turn":
            return self.turn_of(names) % count
        return int(share(self.recipe.seed, "variant", group, *names) * count)

    def scene(self, model: str, pose: str | None) -> BlendScene:
        """Return the scene that the engine receives for the file."""
        return BlendScene(
            file=str(self.path),
            world_from_file=self.world_from_file,
            unit=self.file.unit,
            shown=self._shown,
            hidden=self.hidden(model, pose),
            is_lit=self.file.is_lit,
            confined=self.entry.confined,
        )

    @cached_property
    def _shown(self) -> tuple[str, ...]:
        return tuple(member[0] for members in self.groups.values() for member in members)

    @cached_property
    def world_from_file(self) -> Matrix4:
        """The rigid motion that moves the targets' spot to the world's origin."""
        return _rows(_inverse(np.eye(4) if self.entry.at is None else self.file.by_name[self.entry.at].file_from_object))

    def pieces(self, model: str, pose: str | None, category_id: Naming) -> tuple[SceneryPiece, ...]:
        """The labelled objects that are shown, then the whole background as one piece."""
        return self._pieces(frozenset(self.hidden(model, pose)), category_id)

    @cached_property
    def _pieces(self) -> Callable[[frozenset[str], Naming], tuple[SceneryPiece, ...]]:
        """The pieces for a set of hidden objects; the last results are cached, because many shots share one."""

        @lru_cache(maxsize=16)
        def pieces(hidden: frozenset[str], category_id: Naming) -> tuple[SceneryPiece, ...]:
            own = [self._piece(one, category_id) for one in self.labelled if not hidden.issuperset(one.members)]
            labelled = {name for one in self.labelled for name in one.members}
            shown = [one.name for one in self.file.objects if one.parts and one.name not in labelled | hidden]
            if not shown:
                return tuple(own)
            without = tuple(sorted(labelled | {n for n in hidden if self.file.by_name[n].parts}))
            rest = self._spec("", "scenery", Parts(without=without), 0, "/".join(sorted(hidden)))
            return (*own, SceneryPiece(rest, self.world_from_file, "background"))

        return pieces

    def shows(self, spec: ModelSpec, frame: int) -> bool:
        """Return whether a model from the file is visible at one of the frames; True for other models."""
        if spec.parts is None:
            return True
        showing = self.file.showing[frame]
        if spec.parts.only is None:
            return not showing.issubset(spec.parts.without)
        return not showing.isdisjoint(spec.parts.only)

    def at_frame(self, thing: Thing, frame: int) -> Thing:
        """Return a thing of the file as it is at one of the frames; a labelled object moves with its axes."""
        if thing.model.parts is None:
            return thing
        step = self._step(thing.model.parts, frame)
        if not thing.id:
            return thing.showing(step)
        moved = compose(np.array(self.world_from_file), np.array(step.file_from_axes or thing.model.parts.file_from_axes))
        return thing.model_copy(update={"motion": Motion.still(_rows(moved), step)})

    def steps(self, spec: ModelSpec) -> tuple[TimeStep, ...]:
        """The frames at which a model from the file is visible; empty for other models."""
        if spec.parts is None:
            return ()
        return tuple(self._step(spec.parts, frame) for frame in self.frames if self.shows(spec, frame))

    def _step(self, parts: Parts, frame: int) -> TimeStep:
        """Return the time step of the file at one of the frames; the axes of a labelled object move with it."""
        stands = None if parts.only is None else _rows(self._stands[frame][self._root_of[parts.only].name])
        return TimeStep(frame=frame, seconds=self.seconds[frame], file_from_axes=stands)

    @cached_property
    def _root_of(self) -> Mapping[tuple[str, ...], SceneObject]:
        return {one.members: one.root for one in self.labelled}

    @cached_property
    def _stands(self) -> Mapping[int, Mapping[str, Float]]:
        names = tuple(one.root.name for one in self.labelled)
        from viewsphere.assets.scene_file import places

        try:
            return places(self.path, self.entry.confined, names, self.frames)
        except ModelError as error:
            raise RecipeError(f"scene.blend.file: {error}") from None

    def models(self, category_id: Naming) -> Iterator[ModelSpec]:
        """The labelled objects' models, of all variants."""
        return (self._piece(one, category_id).model for one in self.labelled)

    def _piece(self, one: _Labelled, category_id: Naming) -> SceneryPiece:
        labels: Labels = "own"
        axes = one.root.file_from_object
        parts = Parts(only=one.members, file_from_axes=_rows(axes))
        spec = self._spec(one.category, one.root.name, parts, category_id(one.category, labels), "")
        if self.frames and not self.shows(spec, self.file.first):
            seen = self.steps(spec)[0]
            parts = parts.model_copy(update={"file_from_axes": seen.file_from_axes})
            spec = spec.model_copy(update={"rest": seen.frame, "parts": parts})
        return SceneryPiece(spec, _rows(compose(np.array(self.world_from_file), axes)), labels)

    def _spec(self, category: str, name: str, parts: Parts, category_id: int, rest: str) -> ModelSpec:
        return ModelSpec(
            key=scenery_key(f"{self.path.stem}-{name}", f"{self.path.name}/{name}/{rest}"),
            source=str(self.path),
            category=category,
            category_id=category_id,
            centring="as_is",
            confined=self.entry.confined,
            shown=self._shown,
            parts=parts,
            rest=self.file.first if self.frames else None,
        )

    def check(self) -> None:
        """Raise RecipeError for names and patterns of the recipe that match nothing in the file."""
        for i, rule in enumerate(self.entry.labels):
            if not any(_fits(rule, one) for one in self.file.objects):
                kind, known = self._known(rule)
                found = getattr(rule, kind)
                raise RecipeError(f"scene.blend.labels[{i}].{kind}: {_none_fits(kind, known, found)}")
        names = tuple(self.file.by_name)
        for name, members in self.groups.items():
            if not members:
                entry = self.entry.variants[name]
                raise RecipeError(f"scene.blend.variants.{name}: {_none_fits('name', names, entry.one_of)}")
        if self.entry.at is not None and self.entry.at not in names:
            raise RecipeError(
                f"scene.blend.at: expected the name of an object in {self.path.name}, such as {_listed(names)}; found "
                f"{self.entry.at!r}{nearest(self.entry.at, names)}"
            )

    def _known(self, rule: LabelRule) -> tuple[str, tuple[str, ...]]:
        """Return the kind of name that a rule matches, and the names of this kind in the file."""
        objects = self.file.objects
        if rule.name is not None:
            return "name", tuple(self.file.by_name)
        if rule.collection is not None:
            return "collection", tuple(sorted({name for one in objects for name in one.collections}))
        return "property", tuple(sorted({name for one in objects for name in one.properties}))


def _fits(rule: LabelRule, one: SceneObject) -> bool:
    if rule.name is not None:
        return fnmatchcase(one.name, rule.name)
    if rule.collection is not None:
        return any(fnmatchcase(name, rule.collection) for name in one.collections)
    return bool(rule.property in one.properties and str(one.properties[rule.property or ""]).strip())


def _none_fits(kind: str, known: Sequence[str], found: str) -> str:
    of = {"name": "an object's name", "collection": "a collection", "property": "a custom property of objects"}[kind]
    there = f"{_listed(known)}" if known else "there is none"
    return f"expected {of} in the file ({there}); found {found!r}, which fits none"


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - NAMES_SAID} more" if len(names) > NAMES_SAID else ""
    return ", ".join(names[:NAMES_SAID]) + more


def _rows(matrix: Float) -> Matrix4:
    rows: Any = tuple(tuple(row) for row in (matrix + 0.0).tolist())
    return rows


def _inverse(matrix: Float) -> Float:
    """The inverse of a rigid motion."""
    inverse = np.eye(4)
    inverse[:3, :3] = matrix[:3, :3].T
    inverse[:3, 3] = -transform(matrix[:3, :3].T, matrix[:3, 3])
    return inverse
