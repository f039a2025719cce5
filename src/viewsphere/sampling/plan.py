"""The plan: which frames a recipe means, in which order, split and unit of work. Meshes are not touched."""

from __future__ import annotations

import hashlib
import json
import math
from bisect import bisect_right
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import accumulate, chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from viewsphere import plugins
from viewsphere.errors import RecipeError
from viewsphere.geometry.camera import orbit_center
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
from viewsphere.sampling.camera import distance_problem, inside_box, looking
from viewsphere.sampling.checks import (
    check_blend,
    check_catcher,
    check_frames,
    check_listed,
    check_materials,
    check_moments,
    check_names,
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
from viewsphere.sampling.scenes import Scenes, is_night
from viewsphere.sampling.seeds import share
from viewsphere.sampling.viewpoints import Poses, poses
from viewsphere.store import Category

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
        return self._firsts[-1]

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

    @cached_property
    def _firsts(self) -> tuple[int, ...]:
        """First frame of each model, and the number of all frames."""
        return tuple(accumulate((schedule.count for schedule in self.schedules), initial=0))

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
        """Split -> number of its frames."""
        by = self.recipe.splits.by
        if by == "model":
            found = Counter({s: 0 for s in self.splits})
            for spec, schedule in zip(self.model_specs, self.schedules, strict=True):
                found[self.split(spec, 0)] += schedule.count
        elif by == "pose" and not self.timings:
            found = Counter(self.split(self.model_specs[0], i) for i in range(self.poses))
            found = Counter({name: count * self.models for name, count in found.items()})
        else:
            both = zip(self.model_specs, self.schedules, strict=True)
            found = Counter(self.split(spec, i) for spec, schedule in both for i in schedule.poses)
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
        """The split of a frame; it follows from the seed and the names of what is kept together, and nothing else."""
        if spec.key in self._listed:
            return self._listed[spec.key]
        names = {
            "model": (spec.key,),
            "pose": (self.pose_list.place(pose),),
            "frame": (spec.key, self.pose_list.name(pose)),
        }
        by = self.recipe.splits.by
        edges, shared = self._edges
        return shared[min(bisect_right(edges, share(self.recipe.seed, "split", *names[by])), len(shared) - 1)]

    @cached_property
    def _listed(self) -> dict[str, str]:
        shares = self.recipe.splits.shares.items()
        return {key: name for name, keys in shares if isinstance(keys, tuple) for key in keys}

    @cached_property
    def _edges(self) -> tuple[tuple[float, ...], tuple[str, ...]]:
        """Upper ends of the intervals of [0, 1) that the splits with a share take, and their names."""
        shares = {name: part for name, part in self.recipe.splits.shares.items() if not isinstance(part, tuple) and part}
        return tuple(accumulate(shares.values())), tuple(shares)

    @cached_property
    def _chunks(self) -> tuple[tuple[tuple[int, int], ...], ...]:
        """Of each model, the poses [first, stop) of its shots."""
        known = {id(schedule): schedule.chunks(self.shot_frames) for schedule in self.schedules}
        return tuple(known[id(schedule)] for schedule in self.schedules)

    @cached_property
    def _shots(self) -> tuple[int, ...]:
        """First shot of each model, and the number of all shots."""
        return tuple(accumulate(map(len, self._chunks), initial=0))

    @property
    def shot_count(self) -> int:
        """Number of shots."""
        return self._shots[-1]

    def shots_of(self, model: int) -> range:
        """Indices of a model's shots."""
        return range(self._shots[model], self._shots[model + 1])

    def shot_model(self, index: int) -> int:
        """Index of the model of a shot."""
        return bisect_right(self._shots, index) - 1

    def _shot_poses(self, index: int) -> tuple[int, int]:
        model = self.shot_model(index)
        return self._chunks[model][index - self._shots[model]]

    def shot_key(self, index: int) -> str:
        """`<model key>-<first pose>`: stable, unique, fit for a folder's name."""
        return f"{self.model_specs[self.shot_model(index)].key}-{self._shot_poses(index)[0]:06d}"

    def shot_table(self) -> Iterator[tuple[str, int, int]]:
        """Key, first frame and number of frames of every shot, in order."""
        frame = 0
        for index in range(self.shot_count):
            first, stop = self._shot_poses(index)
            yield self.shot_key(index), frame, stop - first
            frame += stop - first

    def shot(self, index: int, box_of: BoxOf) -> Shot:
        """One shot; raises IndexError past the end.

        `box_of` gives a model's box: cameras look at its centre, and what stands on the floor depends on its size.
        Raises RecipeError where there is no room for all that is to stand there, and what `box_of` raises.
        """
        if not 0 <= index < self.shot_count:
            raise IndexError(f"expected a shot of 0..{self.shot_count - 1}, got {index}")
        return self.take(self.shot_model(index), range(*self._shot_poses(index)), box_of, self.shot_key(index))

    def take(self, model: int, chosen: Sequence[int], box_of: BoxOf, key: str = "") -> Shot:
        """A shot of some poses of a model (their indices), of one time step: of one pose where the recipe draws scenes for each
        frame.
        """
        spec, pose = self.model_specs[model], self.pose_list.name(chosen[0])
        things, target = (Thing(id=1, model=spec),), None
        if self.composition is not None:
            with self.recipe.located():
                things = self.composition.things(spec, self._scene_pose(chosen[0]), box_of)
            company = self.recipe.scene.company
            target = self.composition.center(things[: 1 + (company.number if company else 0)], box_of)
        if self.recipe.scene.materials:
            things = tuple(self._repainted(p, spec, pose) for p in things)
        run = self.schedules[model].run_of(chosen[0])
        target, placed = self._target(things[0], run, target, box_of), self._at(things, run)
        focus = target or center(placed[0], box_of)
        return Shot(
            key=key or spec.key,
            things=placed,
            rig=Rig.of(self.intrinsics),
            scene=self._scene(spec, pose, run).model_copy(update=self._floor(spec, things, box_of)),
            first=self._firsts[model] + self.schedules[model].position(chosen[0]),
            instants=tuple(self.instant(model, i, target, focus) for i in chosen),
            engine=self.recipe.engine.name,
            engine_options=self.recipe.engine.options,
            channels=self.recipe.channels,
            files=self.recipe.files,
            label_alpha=self.recipe.label_alpha,
            category_deg=self.recipe.viewpoints.bins,
        )

    def _target(self, first: Thing, run: Run, target: Vector | None, box_of: BoxOf) -> Vector | None:
        """What cameras look at that have no target of their own, None for the first object's centre: where that stands at the
        first frame, or follows it.
        """
        moves = run.step is not None and run.step.model is not None
        if moves and self.recipe.viewpoints.target == "follow":
            target, first = None, self._at((first,), run)[0]
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

    def _at(self, things: Sequence[Thing], run: Run) -> tuple[Thing, ...]:
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
        return (self.shot(i, box_of) for i in range(self.shot_count))

    def instant(self, model: int, pose: int, target: Vector | None, focus: Vector) -> Instant:
        """The instant of a model (its index) and a pose; the camera looks at `target` unless the pose has its own, and where
        there is neither at `focus`.
        """
        spec, finish = self.model_specs[model], None
        if self.scenes.has_finish_per_frame:
            finish = self.scenes.finish(spec.key, self.pose_list.name(pose))
        number = self._firsts[model] + self.schedules[model].position(pose)
        return looking(self._pose(spec, pose, target), focus, index=number, split=self.split(spec, pose), finish=finish)

    def _pose(self, spec: ModelSpec, index: int, target: Vector | None) -> Viewpoint:
        """The pose of a model's frame, which looks at `target` unless it has a target of its own."""
        pose = self.pose_list[index]
        if target is not None and pose.target is None:
            pose = pose.model_copy(update={"target": target})
        return self.scenes.jittered(pose, spec.key, self.pose_list.place(index)) if self.scenes.is_jittered else pose

    def distance_problem(self, spec: ModelSpec, box_of: BoxOf) -> RecipeError | None:
        """The first pose whose camera would stand inside a target's box, in words; None if there is none.

        Company that is drawn for each frame is not looked at: that is left to whoever renders the frame.
        """
        things, target = (Thing(id=1, model=spec),), None
        if self.composition is not None and not self.recipe.scene.is_moved_each_frame:
            things = self.composition.targets(spec, None, box_of)
            target = self.composition.center(things, box_of)
        fixed = None if self.timings else self.cameras(things, box_of)
        for run in self.schedules[self._position[spec.key]].runs:
            at = self._target(things[0], run, target, box_of)
            moved = self._at(things, run)
            cameras = fixed if fixed is not None else self.cameras(moved, box_of, at)
            for thing in moved:
                box = transform(thing.world_from_object, box_of(thing.model))
                inside = inside_box(box, cameras[run.first : run.stop])
                if inside.any():
                    pose = self._pose(spec, run.first + int(np.flatnonzero(inside)[0]), at)
                    problem = distance_problem(pose, box)
                    return RecipeError(f"viewpoints.distance: {problem} (model {thing.model.key})")
        return None

    @cached_property
    def _position(self) -> dict[str, int]:
        return {spec.key: i for i, spec in enumerate(self.model_specs)}

    def cameras(self, things: Sequence[Thing], box_of: BoxOf, target: Vector | None = None) -> NDArray[np.float64]:
        """Where the cameras of all poses stand, (poses, 3) world metres, when these are placed; they look at `target`, by
        default at the middle of what is placed.
        """
        targets = [p for p in things if p.id and not p.scenery]
        corners = np.concatenate([transform(t.world_from_object, box_of(t.model)) for t in targets])
        middle = corners.mean(axis=0) if len(targets) == 1 else (corners.min(axis=0) + corners.max(axis=0)) / 2
        middle = middle if target is None else np.array(target)
        if not self.scenes.is_jittered:
            return self._offsets + np.where(np.isnan(self._targets), middle, self._targets)
        x, y, z = middle.tolist()
        spec = targets[0].model
        base = self.model_specs[self._position[spec.track or spec.key]]
        moved = (self._pose(base, i, (x, y, z)) for i in range(self.poses))
        return np.array([_stand(pose) for pose in moved])

    @cached_property
    def _offsets(self) -> NDArray[np.float64]:
        """From what the cameras look at to where they stand, (poses, 3)."""
        views = (self.pose_list.view(i) for i in range(self.poses))
        flat = np.fromiter((x for v in views for x in (v.azimuth, v.elevation, v.distance)), np.float64, 3 * self.poses)
        azimuth, elevation = np.radians(flat.reshape(-1, 3)[:, :2]).T
        level = np.cos(elevation)
        direction = np.stack([level * np.sin(azimuth), -level * np.cos(azimuth), np.sin(elevation)], axis=1)
        return flat.reshape(-1, 3)[:, 2:] * direction

    @cached_property
    def _targets(self) -> NDArray[np.float64]:
        """What the cameras look at, (poses, 3); NaN where that is the models' centre."""
        targets = (self.pose_list.target(i) or (math.nan,) * 3 for i in range(self.poses))
        return np.fromiter((x for t in targets for x in t), np.float64, 3 * self.poses).reshape(-1, 3)

    @cached_property
    def digest(self) -> str:
        """SHA-256 of all that a store of this plan holds: the recipe, the models, the backgrounds and the chunks.

        Files count by their names, so that folders can move; what is in a model's file, the store itself watches.
        """
        models = [m.model_dump(mode="json") | {"source": Path(m.source).name} for m in self.kept_specs]
        planes = () if self.composition is None else self.composition.images
        images = [Path(i).name for files in (self.images, *planes) for i in files]
        value = [self.recipe.digest, models, self.pose_list.digest, images, self._chunks]
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
        if not recipe.scene.is_composed:
            return planned
        apart = recipe.splits.by == "model"
        splits = [planned.split(spec, 0) if apart else "" for spec in specs]
        composition = compose(recipe, specs, planned.categories, splits, views)
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


def _stand(pose: Viewpoint) -> NDArray[np.float64]:
    """Where the camera of a pose with a target stands, (3,) world metres."""
    assert pose.target is not None
    return np.array(pose.target) + orbit_center(math.radians(pose.azimuth_deg), math.radians(pose.elevation_deg), pose.distance)


def _lens(recipe: Recipe, views: Poses) -> Intrinsics:
    if not recipe.camera.of_viewpoints:
        return recipe.camera.intrinsics
    if views.intrinsics is None:
        raise RecipeError("camera.of_viewpoints: expected a file of poses that names a lens; found none: give fov_deg or K")
    return views.intrinsics
