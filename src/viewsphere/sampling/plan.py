"""The plan: which frames a recipe means, in which order, split and unit of work. Meshes are not touched."""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from itertools import chain, groupby
from pathlib import Path
from typing import Any

from viewsphere import plugins
from viewsphere.errors import RecipeError
from viewsphere.geometry.rotation import transform
from viewsphere.model.camera import Intrinsics
from viewsphere.model.instant import Instant, Viewpoint
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.rig import Rig
from viewsphere.model.scene import Scene, Vector
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Thing
from viewsphere.recipe.draws import alternatives, span
from viewsphere.recipe.recipe import Recipe
from viewsphere.sampling.blend_scene import BlendScenery
from viewsphere.sampling.camera import looking
from viewsphere.sampling.checks import (
    check_blend,
    check_catcher,
    check_frames,
    check_listed,
    check_materials,
    check_moments,
    check_names,
    check_splits,
)
from viewsphere.sampling.composition import BoxOf, Composition, compose
from viewsphere.sampling.doubts import hidden_by_exposure, no_light, out_of_view
from viewsphere.sampling.models import categories, numbered_specs
from viewsphere.sampling.moments import (
    Run,
    Schedule,
    TimedPoses,
    Timing,
    at_frame,
    at_step,
    check_keys,
    schedules,
    timed,
)
from viewsphere.sampling.pictures import Pictures, check_pictures, proportions, scene_pictures
from viewsphere.sampling.scenery import draw_names
from viewsphere.sampling.scenes import Scenes, is_night
from viewsphere.sampling.splits import expected, hashed, model_splits
from viewsphere.sampling.viewpoints import Poses, poses
from viewsphere.store import Block, Category, Row
from viewsphere.store.index import Index, numbers

COUNTED = 200_000
"""Frames whose splits are counted one by one."""

SHOT_FRAMES = 16
"""Most frames of a shot, unless the recipe or the caller says otherwise."""


@dataclass(frozen=True, eq=False)
class Plan:
    """What will be rendered: of every model, in order, its poses, by time steps where something moves (else frame index =
    model index * poses + pose index). Nothing here grows with the frames.
    """

    recipe: Recipe
    model_specs: tuple[ModelSpec, ...]
    pose_list: Poses
    categories: tuple[Category, ...]
    pictures: Pictures  # of the scene
    shot_frames: int
    composition: Composition | None = None  # of place, company and planes
    timings: tuple[Timing | None, ...] = ()  # of each model; none at all where nothing moves
    kept_splits: Mapping[str, str] = field(default_factory=dict[str, str])  # of models that a data set has already

    def __getstate__(self) -> dict[str, Any]:
        """What other processes are sent: not what was computed so far."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @cached_property
    def intrinsics(self) -> Intrinsics:
        """The lens of all frames."""
        return _lens(self.recipe, self.pose_list)

    @cached_property
    def scenes(self) -> Scenes:
        """Where light, ground, materials, finishes and jitter are drawn."""
        return Scenes(self.recipe, self.pictures)

    @property
    def images(self) -> tuple[str, ...]:
        """Absolute paths of the scene's picture files, by field; those of planes are the composition's."""
        return tuple(file for files in self.pictures.values() for file in files)

    @property
    def models(self) -> int:
        """Number of models."""
        return len(self.model_specs)

    @property
    def poses(self) -> int:
        """Number of poses of each model; of all time steps together where something moves."""
        return len(self.pose_list)

    @property
    def frames(self) -> int:
        """Number of frames: models x poses, or as many as their time steps have."""
        return sum(schedule.count for schedule in self.schedules)

    @cached_property
    def schedules(self) -> tuple[Schedule, ...]:
        """Which poses each model is taken from, and when."""
        return schedules(self.timings or (None,) * self.models, self.pose_list)

    @property
    def time_steps(self) -> int | None:
        """Time steps that all models have, 0 if nothing moves; None if they have different numbers."""
        counts = {len(timing.steps) if timing else 0 for timing in self.timings}
        return counts.pop() if len(counts) == 1 else None if counts else 0

    @property
    def factors(self) -> str:
        """What its frames are the product of, in words."""
        if not self.timings:
            return f"{self.models:,} models x {self.poses:,} poses"
        base = self.pose_list.base if isinstance(self.pose_list, TimedPoses) else self.pose_list
        if self.time_steps is None:
            return f"{self.models:,} models of different time steps, {len(base):,} poses"
        moving = [timing.moving for timing in self.timings if timing]
        poses = "a pose each" if all(moving) else f"{len(base):,} poses{', of some a pose each' if any(moving) else ''}"
        return f"{self.models:,} models x {self.time_steps:,} time steps x {poses}"

    @property
    def max_objects(self) -> int:
        """Most objects in one frame."""
        return 1 if self.composition is None else self.composition.max_objects

    @property
    def blend(self) -> BlendScenery | None:
        """The .blend file around the targets, if there is one."""
        return None if self.composition is None else self.composition.blend

    @property
    def kept_specs(self) -> tuple[ModelSpec, ...]:
        """All models that the data set keeps: the recipe's, then labelled scenery's, each as it moves behind it."""
        scenery = () if self.composition is None else self.composition.models
        if not self.timings:
            return self.model_specs + scenery
        own = ((spec, *self.moments_of(spec)) for spec in self.model_specs)
        moved = ((spec, *self._moments_of_scenery(spec)) for spec in scenery)
        return tuple(chain.from_iterable((*own, *moved)))

    def moments_of(self, spec: ModelSpec) -> tuple[ModelSpec, ...]:
        """A model of the recipe at each frame of its file that is asked for."""
        timing = self.timings[self._position[spec.key]] if self.timings else None
        return tuple(at_frame(spec, step.model) for step in (timing.steps if timing else ()) if step.model is not None)

    def _moments_of_scenery(self, spec: ModelSpec) -> Iterator[ModelSpec]:
        if self.blend is not None and spec.parts is not None:
            yield from (self.blend.model_at(spec, frame) for frame in self.blend.frames if self.blend.shows(spec, frame))

    @property
    def splits(self) -> tuple[str, ...]:
        """Names of the splits, in the recipe's order."""
        return tuple(self.recipe.splits.shares)

    @cached_property
    def split_counts(self) -> dict[str, int]:
        """Split -> number of its frames; of hashed ones what is expected, where there are more than `COUNTED` to hash."""
        by = self.recipe.splits.by
        both = list(zip(self.model_specs, self.schedules, strict=True))
        if by == "model":
            found = Counter({s: 0 for s in self.splits})
            for spec, schedule in both:
                found[self.split(spec, 0)] += schedule.count
        elif by == "pose" and not self.timings and self.poses <= COUNTED:
            found = Counter(self.split(self.model_specs[0], i) for i in range(self.poses))
            found = Counter({name: count * self.models for name, count in found.items()})
        elif self.frames <= COUNTED:
            found = Counter(self.split(spec, i) for spec, schedule in both for i in schedule.poses)
        else:
            found = Counter(expected(self.recipe.splits, self.frames))
        return {name: found[name] for name in self.splits}

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """What may be meant otherwise."""
        by = self.recipe.splits.by
        found = [
            f"split {name!r} is empty: too few {by}s for its share; list models for it, or split by something else"
            for name, count in self.split_counts.items()
            if count == 0
        ]
        scene = self.recipe.scene
        lowest = self.pose_list.lowest_elevation + min(span(scene.jitter.elevation_deg)[0], 0.0)
        if lowest < 0 and (scene.has_ground or scene.place is not None):
            found.append(
                f"elevations go down to {lowest:g}: from below, the ground hides the models; set scene.ground: off to see them"
            )
        if any(is_night(sun) for sun in alternatives(scene.sun)):
            found.append("scene.sun: at this date, time and place the sun is below the horizon: there is none, and no daylight")
        doubts = chain(no_light(scene), hidden_by_exposure(scene), out_of_view(scene, self.pose_list, self.intrinsics))
        if self.blend is not None:
            found += self.blend.warnings
        return tuple(map(self.recipe.locate, (*found, *doubts)))

    def split(self, spec: ModelSpec, pose: int) -> str:
        """The split of a frame."""
        splits = self.recipe.splits
        match splits.by:
            case "model":
                return self.model_splits[spec.key]
            case "pose":
                return hashed(splits, self.recipe.seed, (self.pose_list.place(pose),))
            case "place":
                place = self.recipe.scene.place
                names = draw_names(place.draw, spec.key, self.pose_list.name(pose)) if place else ()
                return hashed(splits, self.recipe.seed, ("place", *names))
            case "frame":
                return hashed(splits, self.recipe.seed, (spec.key, self.pose_list.name(pose)))

    @cached_property
    def model_splits(self) -> dict[str, str]:
        """The split of every model, where splits are by model; else none."""
        if self.recipe.splits.by != "model":
            return {}
        keys = (spec.key for spec in self.model_specs)
        return model_splits(self.recipe.splits, self.recipe.seed, keys, self.kept_splits)

    def keeping(self, splits: Mapping[str, str]) -> Plan:
        """The same plan for a data set that has some of its models in these splits already."""
        kept = {key: name for key, name in splits.items() if key in self._position}
        return _composed(replace(self, kept_splits=kept)) if kept else self

    @cached_property
    def blocks(self) -> tuple[Block, ...]:
        """Which models are taken from which poses, time step by time step."""
        found: list[Block] = []
        for schedule, members in groupby(range(self.models), lambda model: self.schedules[model]):
            keys = tuple(self.model_specs[model].key for model in members)
            runs = [((run.first, run.stop),) for run in schedule.runs]
            if len(runs) == 1:
                found.append(Block(keys, runs[0]))
            else:
                found += (Block((key,), poses) for key in keys for poses in runs)
        return tuple(found)

    @cached_property
    def rows(self) -> Index:
        """All shots."""
        return Index(self.blocks, 0, self.shot_frames, 0)

    @property
    def shot_count(self) -> int:
        """Number of shots."""
        return len(self.rows)

    def schedule(self, spec: ModelSpec) -> Schedule:
        """Which poses a model is taken from, and when."""
        return self.schedules[self._position[spec.key]]

    def spec(self, key: str) -> ModelSpec:
        """The model of this key."""
        return self.model_specs[self._position[key]]

    def shot(self, row: Row | int, box_of: BoxOf) -> Shot:
        """The shot of a row, or of its number; raises IndexError past the end.

        `box_of` gives the sizes of what stands on the floor and of what the cameras look at. Raises RecipeError where there is
        no room for all that is to stand there, and what `box_of` raises.
        """
        row = self.rows[row] if isinstance(row, int) else row
        return self.take(row.subject, tuple(numbers(row.positions)), box_of, row.key, row.first)

    def take(self, subject: str, chosen: Sequence[int], box_of: BoxOf, key: str = "", first: int = 0) -> Shot:
        """A shot of some poses (their indices) of the model of this key, of one time step: of one pose where the recipe draws
        scenes for each frame. `first` is the number of its first sample.
        """
        spec, pose = self.spec(subject), self.pose_list.name(chosen[0])
        things, target = (Thing(id=1, model=spec),), None
        if self.composition is not None:
            with self.recipe.located():
                things = self.composition.things(spec, self._scene_pose(chosen[0]), box_of)
            company = self.recipe.scene.company
            target = self.composition.center(things[: 1 + (company.number if company else 0)], box_of)
        if self.recipe.scene.materials:
            things = tuple(self._repainted(p, spec, pose) for p in things)
        run = self.schedule(spec).run_of(chosen[0])
        target, placed = self.target(things[0], run, target, box_of), self.at(things, run)
        focus = target or center(placed[0], box_of)
        return Shot(
            key=key or spec.key,
            things=placed,
            rig=Rig.of(self.intrinsics),
            scene=self._scene(spec, pose, run).model_copy(update=self._floor(spec, things, box_of)),
            first=first,
            instants=tuple(self.instant(spec, pose, target, focus, first + i) for i, pose in enumerate(chosen)),
            engine=self.recipe.engine.name,
            engine_options=self.recipe.engine.options,
            channels=self.recipe.channels,
            files=self.recipe.files,
            label_alpha=self.recipe.label_alpha,
            category_deg=self.recipe.viewpoints.bins,
        )

    def target(self, first: Thing, run: Run, target: Vector | None, box_of: BoxOf) -> Vector | None:
        """What cameras look at that have no target of their own, None for the first object's centre: where that stands at the
        first frame, or follows it.
        """
        moves = run.step is not None and run.step.model is not None
        if moves and self.recipe.viewpoints.target == "follow":
            target, first = None, self.at((first,), run)[0]
        elif target is None and moves:
            return center(first, box_of)
        if target is None and self.scenes.is_target_moved:
            target = center(first, box_of)
        return target

    def _floor(self, spec: ModelSpec, things: Sequence[Thing], box_of: BoxOf) -> dict[str, float]:
        """How high the ground is at most, in a scene's field: at the lowest that a model comes at its time steps."""
        moments = self.moments_of(spec)
        if not moments or self.recipe.scene.ground == "off":
            return {}
        world = things[0].world_from_object
        return {"floor": min(float(transform(world, box_of(moment))[:, 2].min()) for moment in moments)}

    def at(self, things: Sequence[Thing], run: Run) -> tuple[Thing, ...]:
        """What is placed, as it is at a time step; company is at its own of the same number. What of the scene's file shows
        nothing then is left out, so that others have other ids.
        """
        if run.step is None:
            return tuple(things)
        timing_of = self._timing_of
        found: list[Thing] = []
        for thing in things:
            model = at_step(timing_of.get(thing.model.key), thing.model, run.number)
            moved = thing if model is thing.model else thing.model_copy(update={"model": model})
            if self.blend is not None and run.step.scene is not None:
                if not self.blend.shows(moved.model, run.step.scene):
                    continue
                moved = self.blend.at_frame(moved, run.step.scene)
            found.append(moved)
        if len(found) == len(things):
            return tuple(found)
        return tuple(p.model_copy(update={"id": i}) if p.id else p for i, p in enumerate(found, 1))

    @cached_property
    def _timing_of(self) -> dict[str, Timing | None]:
        return {spec.key: timing for spec, timing in zip(self.model_specs, self.timings, strict=True)}

    def _scene(self, spec: ModelSpec, pose: str, run: Run) -> Scene:
        scene = self.scenes.scene(spec.key, pose)
        if self.blend is None:
            return scene
        blend = self.blend.scene(spec.key, pose)
        if run.step is not None and run.step.scene is not None:
            blend = blend.model_copy(update={"frame": run.step.scene})
        return scene.model_copy(update={"blend": blend, "sun": None if blend.is_lit else scene.sun})

    def _repainted(self, thing: Thing, spec: ModelSpec, pose: str) -> Thing:
        repaints = () if thing.scenery else self.scenes.repaints(thing.model, spec.key, pose)
        return thing.model_copy(update={"repaints": repaints}) if repaints else thing

    def _scene_pose(self, pose: int) -> str | None:
        """Name of the pose, where what stands around is drawn for each frame."""
        return self.pose_list.name(pose) if self.recipe.scene.is_moved_each_frame else None

    def cast(self, spec: ModelSpec, pose: int | None = None) -> tuple[ModelSpec, ...]:
        """A model and those that stand beside it, in a pose (its index) where they are drawn for each frame.

        Without a pose, only the model itself then.
        """
        if self.composition is None or (pose is None and self.recipe.scene.is_moved_each_frame):
            return (spec,)
        return self.composition.cast(spec, None if pose is None else self._scene_pose(pose))

    def shots(self, box_of: BoxOf) -> Iterator[Shot]:
        """All shots in order, made one by one."""
        return (self.shot(row, box_of) for row in self.rows)

    def instant(self, spec: ModelSpec, pose: int, target: Vector | None, focus: Vector, number: int) -> Instant:
        """The instant of a model and a pose; the camera looks at `target` unless the pose has its own, and where there is
        neither at `focus`. `number` is the instant's own.
        """
        finish = self.scenes.finish(spec.key, self.pose_list.name(pose)) if self.scenes.has_finish_per_frame else None
        return looking(self.pose(spec, pose, target), focus, index=number, split=self.split(spec, pose), finish=finish)

    def pose(self, spec: ModelSpec, index: int, target: Vector | None) -> Viewpoint:
        """The pose of a model's frame, which looks at `target` unless it has a target of its own."""
        pose = self.pose_list[index]
        if target is not None and pose.target is None:
            pose = pose.model_copy(update={"target": target})
        return self.scenes.jittered(pose, spec.key, self.pose_list.place(index)) if self.scenes.is_jittered else pose

    @cached_property
    def _position(self) -> dict[str, int]:
        return {spec.key: i for i, spec in enumerate(self.model_specs)}

    @cached_property
    def digest(self) -> str:
        """SHA-256 of all that a store of this plan holds: the recipe, the models, the backgrounds and the chunks.

        Files count by their names, so that folders can move; what is in a model's file, the store itself watches.
        """
        models = [m.model_dump(mode="json") | {"source": Path(m.source).name} for m in self.kept_specs]
        planes = () if self.composition is None else self.composition.images
        images = [Path(i).name for files in (self.images, *planes) for i in files]
        value = [self.recipe.digest, models, self.pose_list.digest, images, self.shot_frames]
        value += [] if self.blend is None else [self.blend.digest]
        return hashlib.sha256(json.dumps(value, separators=(",", ":")).encode()).hexdigest()


def plan(recipe: Recipe, shot_frames: int | None = None) -> Plan:
    """What a recipe means, frame by frame, without touching a mesh.

    `shot_frames`: most frames of a shot, where the recipe does not say.
    Raises RecipeError for files that are not there, unknown engines and formats, more frames than `max_frames`.
    """
    with recipe.located():
        check_names(recipe)
        check_blend(recipe)
        check_catcher(recipe)
        check_splits(recipe)
        views = poses(recipe.viewpoints, recipe.seed, recipe.folder)
        _lens(recipe, views)
        check_frames(recipe, views)
        specs, timings, views = timed(recipe, numbered_specs(recipe), views)
        check_listed(recipe, specs)
        check_materials(recipe, specs)
        frames = 1 if recipe.scene.is_new_each_frame else recipe.shot_frames or shot_frames or SHOT_FRAMES
        timings = timings if any(timings) else ()
        planned = Plan(recipe, specs, views, categories(recipe), scene_pictures(recipe), frames, timings=timings)
        if timings:
            check_moments(recipe, planned.frames)
            check_keys(planned.kept_specs)
        return _composed(planned)


def _composed(planned: Plan) -> Plan:
    """The plan with all that stands around its models: only those of one split are seen together, where splits are by model."""
    recipe, specs = planned.recipe, planned.model_specs
    if not recipe.scene.is_composed:
        return planned
    splits = [planned.model_splits.get(spec.key, "") for spec in specs]
    composition = compose(recipe, specs, categories(recipe), splits, planned.pose_list)
    return replace(planned, categories=composition.categories, composition=composition)


def check_engine(recipe: Recipe) -> None:
    """See that the engine takes its options; raises UserError where it does not, or lacks its extra."""
    engine = plugins.load("engines", recipe.engine.name)
    with recipe.located():
        engine.check(recipe.engine.options)


def check_images(planned: Plan) -> None:
    """See that the pictures of the scene and its planes are pictures; raises RecipeError for the first that is not."""
    with planned.recipe.located():
        check_pictures(planned.recipe, planned.pictures)
        for i, files in enumerate(() if planned.composition is None else planned.composition.images):
            field = "images" if planned.recipe.scene.planes[i].image is None else "image"
            for path in files:
                proportions(path, f"scene.planes[{i}].{field}")


def center(thing: Thing, box_of: BoxOf) -> Vector:
    """What a camera looks at that has no target of its own: the centre of the first object's box, world metres."""
    x, y, z = transform(thing.world_from_object, box_of(thing.model).mean(axis=0)).tolist()
    return x, y, z


def _lens(recipe: Recipe, views: Poses) -> Intrinsics:
    if not recipe.camera.of_viewpoints:
        return recipe.camera.intrinsics
    if views.intrinsics is None:
        raise RecipeError("camera.of_viewpoints: expected a file of poses that names a lens; found none: give fov_deg or K")
    return views.intrinsics
