"""The material for shots: a recipe's models, viewpoints, splits and pictures. No mesh is read."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from itertools import chain
from typing import Any, Self

from pydantic import JsonValue

from viewsphere.assets.animation.clip import Timeline
from viewsphere.composing.composition import Composition
from viewsphere.composing.layouts import Remembering, unremembered
from viewsphere.composing.redraws import redraw_names
from viewsphere.composing.scene.blend_scene import BlendScenery
from viewsphere.composing.scene.draws import Scenes
from viewsphere.composing.scene.pictures import Pictures
from viewsphere.composing.scene.scenery import draw_names
from viewsphere.composing.seeds import Names, generator
from viewsphere.composing.sendable import Sendable
from viewsphere.composing.time_steps import Schedule, Timing, schedules
from viewsphere.composing.viewpoints.camera import looking
from viewsphere.composing.viewpoints.poses import Poses
from viewsphere.composing.viewpoints.sequence_poses import SequencePoses
from viewsphere.errors import RecipeError
from viewsphere.labels import label_named
from viewsphere.model.annotations.tracks import Tracks
from viewsphere.model.instant import Instant, Viewpoint
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Finish, Scene, Vector
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.sensors.rig import Rig
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Thing, TimeStep
from viewsphere.planning.clips import shown_steps
from viewsphere.planning.engine_digest import engine_options
from viewsphere.planning.imagers import with_imager
from viewsphere.planning.splits import dealt, drawn_split, shared
from viewsphere.recipe.draws import drawn
from viewsphere.recipe.recipe import Recipe, Splits


@dataclass(frozen=True, eq=False)
class SamplingContext(Sendable):
    """The material from which a sampler makes shots; its memory does not grow with the number of frames.

    `subjects`: the subjects of the frames, as the sampler defines them: models' keys, or scenes' names.
    """

    recipe: Recipe
    model_specs: tuple[ModelSpec, ...]
    pose_list: Poses
    pictures: Pictures  # of the scene
    subjects: tuple[str, ...]
    composition: Composition | None = None  # of place, company and planes
    timings: tuple[Timing | None, ...] = ()  # of each model; empty if nothing moves
    kept_splits: Mapping[str, str] = field(default_factory=dict[str, str])  # of models and scenes that exist in the data set
    own_rig: Rig | None = None  # the recipe's; None: one camera
    entries: tuple[int, ...] = ()  # of each model, the number of its entry in the recipe
    tracks: Tracks | None = None  # the points that every sequence's sensors follow
    timelines: tuple[Timeline | None, ...] = ()  # of each model, the animation of its file that it plays in sequences
    redraws: Mapping[int, int] = field(default_factory=dict[int, int])  # of poses, how often each is redrawn
    original: SamplingContext | None = None  # the same without these redraws
    redraw: int = 0  # how often its scenes' random values are drawn again
    distractors: tuple[tuple[ModelSpec, int], ...] = ()  # models that are not labelled, and the numbers of their entries
    memory: Remembering = unremembered  # of simulation results
    variation: str = ""  # the recipe's variation that light and finish belong to
    sequence_numbers: tuple[int, ...] = ()  # of each viewpoint of sequences, a data set's number; none where it has the same

    def with_redraws(self, redraws: Mapping[int, int]) -> Self:
        """The same context with poses redrawn this often; the two share computed values, none of which depends on redraws."""
        return self._sharing(redraws=redraws)

    def redrawn(self, number: int) -> Self:
        """The context with this redraw of its scenes; the two share computed values, none of which depends on redraws."""
        return self if number == self.redraw else self._sharing(redraw=number)

    def _sharing(self, **changes: Any) -> Self:
        context = replace(self, **changes, original=self.original or self)
        known = {field.name for field in fields(self)}
        vars(context).update({name: value for name, value in vars(self).items() if name not in known})
        return context

    @property
    def root(self) -> SamplingContext:
        """The context without any redraws."""
        return self.original or self

    @property
    def views(self) -> Poses:
        """The viewpoints; for poses over time, those of whole sequences."""
        return self.pose_list.base if isinstance(self.pose_list, SequencePoses) else self.pose_list

    @cached_property
    def view_names(self) -> tuple[str, ...]:
        """The names of all viewpoints."""
        return tuple(map(self.views.name, range(len(self.views))))

    @cached_property
    def rig(self) -> Rig:
        """The sensors of all shots."""
        return with_imager(self.recipe, self.own_rig or Rig.single(lens(self.recipe, self.pose_list)))

    @property
    def intrinsics(self) -> Intrinsics:
        """The lens of the rig's first sensor."""
        return self.rig.sensors[0].intrinsics

    @cached_property
    def scenes(self) -> Scenes:
        """The draws of light, ground, materials, finishes and jitter."""
        variations = (self.original or self).recipe.variations
        alone = variations.drawn_alone(self.variation) if self.variation and variations else frozenset[str]()
        return Scenes(self.recipe, self.pictures, self.variation, alone)

    @property
    def models(self) -> int:
        """Number of models."""
        return len(self.model_specs)

    @cached_property
    def schedules(self) -> tuple[Schedule, ...]:
        """The poses of each model, with their times."""
        return schedules(self.timings or (None,) * self.models, self.pose_list)

    def schedule(self, spec: ModelSpec) -> Schedule:
        """Return the poses of a model, with their times."""
        return self.schedules[self.position[spec.key]]

    def steps_of(self, spec: ModelSpec) -> tuple[TimeStep, ...]:
        """The time steps of a model's file that the data set keeps, ascending; empty if it does not move."""
        place = self.position.get(spec.key)
        line = self.timelines[place] if self.timelines and place is not None else None
        if place is not None and line is not None:
            return shown_steps(self.recipe, self.entries[place], spec, line)
        timing = self.timings[self.position[spec.key]] if self.timings and spec.key in self.position else None
        steps = (step.model for step in (timing.steps if timing else ()))
        blend = () if self.blend is None else self.blend.steps(spec)
        return tuple(chain((step for step in steps if step is not None), blend))

    def with_company(self, key: str, pose: int | None) -> tuple[ModelSpec, ...]:
        """The model of this key and its company; without a pose, only the model if company is drawn for each frame."""
        spec = self.spec(key)
        if self.composition is None or (pose is None and self.recipe.scene.is_moved_each_frame):
            return (spec,)
        return self.composition.cast(spec, None if pose is None else self.scene_pose(pose), self.redraw)

    def spec(self, key: str) -> ModelSpec:
        """The model of this key."""
        return self.model_specs[self.position[key]]

    @cached_property
    def position(self) -> dict[str, int]:
        """The number of each model by its key."""
        return {spec.key: i for i, spec in enumerate(self.model_specs)}

    @property
    def blend(self) -> BlendScenery | None:
        """The .blend file around the targets, if there is one."""
        return None if self.composition is None else self.composition.blend

    @cached_property
    def dealt_splits(self) -> dict[str, str]:
        """The split of every model, scene or sequence, if splits are by one of these; else empty."""
        by = self.recipe.splits.by
        names: Mapping[str, Sequence[str]] = {"model": tuple(self.position), "scene": self.subjects}
        if by == "sequence":
            names = {by: tuple(chain.from_iterable(self._sequences))}
        of_sets = {spec.key: spec.split for spec in self.model_specs if spec.split is not None}
        return dealt(self.recipe.splits, self.recipe.lasting_seed, names.get(by, ()), self.kept_splits, of_sets)

    @property
    def _sequences(self) -> Iterator[Iterator[str]]:
        """The names of the sequences of each subject."""
        assert isinstance(self.pose_list, SequencePoses)
        starts = range(0, len(self.pose_list), self.pose_list.instants)
        return ((self.sequence(subject, start) for start in starts) for subject in self.subjects)

    def sequences_of(self, subject: str) -> SequencePoses:
        """The poses of a subject's sequences."""
        views = self.pose_list.for_subject(subject)
        assert isinstance(views, SequencePoses)
        return views.drawn_for(*redraw_names(self.redraw)) if self.redraw else views

    def sequence(self, subject: str, pose: int) -> str:
        """The name of the sequence that a pose belongs to: the subject's name and, if it has several sequences, the viewpoint's
        number.
        """
        assert isinstance(self.pose_list, SequencePoses)
        view = pose // self.pose_list.instants
        number = self.sequence_numbers[view] if self.sequence_numbers else view
        return f"{subject}-{number:06d}" if number or len(self.pose_list.base) > 1 else subject

    def hashed_split(self, subject: str, pose: int) -> str:
        """The split of a frame, where splits are by pose, place or frame."""
        splits = self.recipe.splits
        match splits.by:
            case "pose":
                names = (self.pose_list.place(pose),)
            case "place":
                place = self.recipe.scene.place
                names = ("place", *(draw_names(place.draw, subject, self.pose_list.name(pose)) if place else ()))
            case _:
                names = (subject, self.pose_list.name(pose))
        return _hashed(splits, self.recipe.lasting_seed, names)

    def scene(self, subject: str, pose: str) -> Scene:
        """Light and ground of a subject's frames, and the .blend file around them; `pose` is a pose's name."""
        scene = self.scenes.scene(subject, pose)
        if self.blend is None:
            return scene
        blend = self.blend.scene(subject, pose)
        return scene.model_copy(update={"blend": blend, "sun": None if blend.is_lit else scene.sun})

    def scene_pose(self, pose: int) -> str | None:
        """Name of the pose if the surroundings are drawn for each frame, or each sequence."""
        return self.scene_name(pose) if self.recipe.scene.is_moved_each_frame else None

    def scene_name(self, pose: int) -> str:
        """Name of the frame or sequence that a scene belongs to; no scene is shared beyond it."""
        return self.pose_list.name(pose) if self.recipe.time is None else self.pose_list.place(pose)

    def repainted(self, things: Sequence[Thing], subject: str, pose: int) -> tuple[Thing, ...]:
        """The things with the changes to their materials."""
        if not self.recipe.scene.materials:
            return tuple(things)
        return tuple(self._repainted(thing, subject, self.scene_name(pose)) for thing in things)

    def _repainted(self, thing: Thing, subject: str, pose: str) -> Thing:
        repaints = () if thing.scenery else self.scenes.repaints(thing.model, subject, pose)
        return thing.model_copy(update={"repaints": repaints}) if repaints else thing

    def view(self, views: Poses, pose: int) -> Viewpoint:
        """The viewpoint of a pose; random ones are drawn for the pose's redraw."""
        again = self.redraws.get(pose)
        return (views.drawn_for(f"try {again}") if again else views)[pose]

    def layout_names(self, pose: int) -> Names:
        """Further names that seed the placing of company: the redraws of a pose and of its scene."""
        again = self.redraws.get(pose)
        is_redrawn = again and self.recipe.scene.company is not None and self.recipe.scene.company.draw == "per_frame"
        return ((f"try {again}",) if is_redrawn else ()) + redraw_names(self.redraw)

    def viewpoint(self, subject: str, view: Viewpoint, target: Vector | None) -> Viewpoint:
        """The viewpoint of a subject's frame, jittered; it looks at `target` unless it has a target of its own."""
        if target is not None and view.target is None:
            view = view.model_copy(update={"target": target})
        if not self.scenes.is_jittered:
            return view
        return self.scenes.jittered(view, subject, self.jitter_name(view.index))

    def jitter_name(self, pose: int) -> str:
        """Return the name for the draw of a pose's jitter; for jitter of each frame: the frame's name, and its redraw."""
        is_per_frame = self.recipe.scene.jitter.draw == "per_frame"
        name = self.pose_list.name if self.recipe.time is not None and is_per_frame else self.pose_list.place
        again = self.redraws.get(pose) if is_per_frame else None
        return f"{name(pose)} try {again}" if again else name(pose)

    def instant(self, subject: str, view: Viewpoint, target: Vector | None, focus: Vector, split: str, number: int) -> Instant:
        """The instant of a subject and a viewpoint; the camera looks at the viewpoint's own target, else at `target`, else at
        `focus`. `number` is the number of the instant.
        """
        seen = {"finish": self.finish(subject, view.index), "intrinsics": self.drawn_lens(subject, view.index)}
        return looking(self.viewpoint(subject, view, target), focus, index=number, split=split, **seen)

    def drawn_lens(self, subject: str, pose: int) -> Intrinsics | None:
        """The lens of a subject's frame, or sequence, from a pose: drawn, or the pose's own; None if all share one lens."""
        if self.recipe.camera.of_viewpoints:
            return self.pose_list.lens(pose)
        if not self.recipe.camera.is_random:
            return None
        return _lens(self.recipe, subject, self.scene_name(pose))

    def finish(self, subject: str, pose: int) -> Finish | None:
        """The finish of a subject's frame, None if all frames of a shot share one."""
        if not self.scenes.has_finish_per_frame:
            return None
        return self.scenes.finish(subject, self.pose_list.name(pose), self.pose_list.place(pose))

    def finished(self, key: str, first: int, things: Sequence[Thing], scene: Scene, instants: Sequence[Instant]) -> Shot:
        """A shot with the recipe's settings that are equal for all shots."""
        return Shot(
            key=key,
            redraw=self.redraw,
            things=tuple(things),
            rig=self.rig,
            scene=scene,
            first=first,
            instants=tuple(instants),
            engine=self.recipe.engine.name,
            engine_options=engine_options(self.recipe),
            channels=self.recipe.channels,
            annotations=self.recipe.annotations,
            labels=_options(self.recipe),
            files=self.recipe.files,
            label_alpha=self.recipe.label_alpha,
            category_deg=self.recipe.viewpoints.bins,
        )


def _options(recipe: Recipe) -> dict[str, dict[str, JsonValue]]:
    """The options of the labels that a recipe names; options with random choices get the recipe's seed."""
    named = ((name, label_named(name)) for name in (*recipe.channels, *recipe.annotations))
    kinds = {name: label.options for name, label in named if label}
    drawn = {name: {"seed": recipe.seed} for name, kind in kinds.items() if kind and "seed" in kind.model_fields}
    return {name: {**drawn.get(name, {}), **recipe.labels.get(name, {})} for name in {**recipe.labels, **drawn}}


def _lens(recipe: Recipe, *names: str) -> Intrinsics:
    """The lens of the recipe's camera, drawn for these names; without names, one example of all."""
    return drawn(recipe.camera, lambda path: generator(recipe.seed, "camera", ".".join(path), *names)).intrinsics


def lens(recipe: Recipe, views: Poses | None) -> Intrinsics:
    """The lens of a recipe with these poses (None: no pose file was read); if it draws several lenses, one of them.

    Raises RecipeError if the pose file has no lens.
    """
    if not recipe.camera.of_viewpoints:
        return _lens(recipe)
    if views is None or views.intrinsics is None:
        raise RecipeError("camera.of_viewpoints: expected a file of poses that names a lens; found none: give fov_deg or K")
    return views.intrinsics


def _hashed(splits: Splits, seed: int, names: tuple[str, ...]) -> str:
    """The split for these names: each split gets about its share of all names, and no name affects the others."""
    return drawn_split(shared(splits), seed, names)
