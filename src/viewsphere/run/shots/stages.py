"""From a shot to its samples: load the models, keep the stage warm, render frame by frame."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from viewsphere import plugins
from viewsphere.assets.appearance.looks import looks_of
from viewsphere.assets.appearance.opaque import Stamp
from viewsphere.assets.appearance.repaint import repaint_stamps
from viewsphere.assets.cache import frame_of, load, read_ahead
from viewsphere.assets.mesh import Mesh
from viewsphere.assets.metadata.traits import traits_of, with_body_parts
from viewsphere.assets.parts import taken
from viewsphere.assets.primitive import FileFacts
from viewsphere.composing.redraws import is_redrawn
from viewsphere.composing.viewpoints.camera import inside_box
from viewsphere.errors import ModelError, RecipeError
from viewsphere.geometry.box import box_size, box_vertices
from viewsphere.geometry.rotation import transform
from viewsphere.labels import annotated, labels, observe, sample_values, sight_of
from viewsphere.model.channel import PASSES
from viewsphere.model.model_spec import ModelSpec, Size, step_key
from viewsphere.model.sample import Float, Sample, Taken
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Thing, TimeStep
from viewsphere.model.traits import Traits
from viewsphere.plugins.engine import EngineSpec
from viewsphere.rendering.ground.material import ground_stamps
from viewsphere.run.shots.camera_collisions import Step, check_rooms, check_way
from viewsphere.store import ModelInfo, Store
from viewsphere.truth.raster.visibility import with_ground
from viewsphere.truth.shot_views import ShotViews
from viewsphere.truth.sky_visibility import sky_occlusion
from viewsphere.zoo import build_zoo_model, rooms_of

if TYPE_CHECKING:
    from viewsphere.engines import Stage  # which takes a third of a worker's start
    from viewsphere.planning.plan import Plan

WARM_BYTES = 400_000_000
"""Of models that are kept, the last ones used."""

MOST_CAMERAS = 1000
"""Cameras that are looked at before rendering; the others are when their turn comes."""

MOST_SKY = 0.8
"""Share of the sky that scenery may hide from a camera that is not inside of it."""


def model_files(key: str, frame: int | None = None) -> tuple[str, str]:
    """Paths of a model's OBJ and GLB, relative to the data set; a deforming model has an OBJ for each `frame` of its file."""
    return f"store/models/{key}/{step_key(key, frame)}.obj", f"store/models/{key}/{key}.glb"


@dataclass(frozen=True, eq=False)
class StoredBoxes:
    """The boxes (8, 3) of a data set's finished models; raises ModelError for another."""

    store: Store
    _known: dict[str, ModelInfo] = field(default_factory=dict[str, ModelInfo])

    def __call__(self, spec: ModelSpec, step: TimeStep | None = None) -> Float:
        """The box of this model at a time step."""
        if spec.key not in self._known:
            info = self.store.model_info(spec.key)
            if info is None:
                raise ModelError(f"model {spec.key}: expected a finished model in {self.store.root}, found none: render again")
            self._known[spec.key] = info
        try:
            return self._known[spec.key].at(step and step.frame).box3d_object
        except ValueError as error:
            raise ModelError(f"{self.store.root}: {error}: render again") from None


@dataclass(frozen=True, eq=False)
class _Stand:
    """The place of a still thing: its box (8, 3), and those of its rooms, world metres."""

    box: Float
    rooms: tuple[Float, ...]


NONE_KNOWN: Mapping[int, _Stand] = MappingProxyType({})
"""No known places."""


@dataclass(eq=False)
class Stages:
    """Renders shots; keeps the last shot's stage, and the models used last, warm."""

    _stage: Stage | None = None
    _stage_key: tuple[str, tuple[Stamp, ...]] = ("", ())
    _models: dict[str, Mesh] = field(default_factory=dict[str, Mesh])
    _boxes: dict[str, Float] = field(default_factory=dict[str, Float])
    _sizes: dict[str, Size] = field(default_factory=dict[str, Size])
    _facts: dict[str, FileFacts] = field(default_factory=dict[str, FileFacts])
    _traits: dict[str, Traits] = field(default_factory=dict[str, Traits])

    def model(self, spec: ModelSpec, step: TimeStep | None = None) -> Mesh:
        """The normalised model at a time step (None: as it rests); raises ModelError if its file cannot be used."""
        name = _name(spec, step)
        known = self._models.pop(name, None)
        mesh = known or self._loaded(spec, step)
        self._models[name] = mesh  # the last used comes last
        if known:
            return known
        if name not in self._boxes:
            self._boxes[name] = box_vertices(*mesh.bounds)
        held = sum(map(_size, self._models.values()))
        while held > WARM_BYTES and len(self._models) > 1:
            held -= _size(self._models.pop(next(iter(self._models))))
        return mesh

    def _loaded(self, spec: ModelSpec, step: TimeStep | None) -> Mesh:
        """Many may be parts of one model, which is loaded once."""
        if spec.parts is None:
            mesh, self._facts[_name(spec, step)] = load(spec, build_zoo_model, step=step)
            return with_body_parts(mesh, spec)
        frame = frame_of(spec, step)
        return taken(self.model(spec.whole, None if frame is None else TimeStep(frame=frame)), spec, step)

    def box(self, spec: ModelSpec, step: TimeStep | None = None) -> Float:
        """The 3D box (8, 3) of the normalised model at a time step in its own axes; raises ModelError as `model` does."""
        name = _name(spec, step)
        if name not in self._boxes:
            self.model(spec, step)
        return self._boxes[name]

    def traits(self, spec: ModelSpec, step: TimeStep | None = None) -> Traits:
        """Return the metadata of a model at a time step; raises ModelError as `model` and `traits_of` do."""
        name = _name(spec, step)
        if name not in self._traits:
            mesh = self.model(spec, step)
            facts = self._facts.get(name) or FileFacts(Path(spec.source), "parts", "+z", "-y", 1.0)
            said = traits_of(spec, mesh, facts, step)
            looks = cache(lambda: looks_of(self.model(spec, step), said.color, said.material))
            self._traits[name] = replace(said, looks=looks)
        return self._traits[name]

    def real_size(self, spec: ModelSpec, step: TimeStep | None = None) -> Size | None:
        """The model's true (width, height, length) in metres, None if nobody said."""
        if spec.real_size != "file":
            return spec.real_size
        name = _name(spec, step)
        if name not in self._sizes:
            self._sizes[name] = box_size(self.box(spec.model_copy(update={"scale": "as_is"}), step))
        return self._sizes[name]

    def read_ahead(self, planned: Plan, specs: Sequence[ModelSpec]) -> None:
        """Read all time steps of each model of the plan at once, where it moves, instead of one after another."""
        for spec in specs:
            frames = {step.frame for step in planned.steps_of(spec)}
            if frames and spec.rest is not None:
                read_ahead(spec, frames | {spec.rest}, build=build_zoo_model)

    def check_distances(self, planned: Plan, subject: str) -> None:
        """Raise RecipeError if a pose's camera would stand inside what stands in a subject's frames."""
        from viewsphere.planning.distances import Distances

        problem = Distances(planned, self.box).problem(subject)
        with planned.recipe.located():
            if problem:
                raise problem

    def check_scenery(self, planned: Plan) -> None:
        """Raise RecipeError if a pose's camera would stand in a house, where all models have the same around them.

        Scenery that is drawn for each model or frame is looked at when its shot is rendered.
        """
        from viewsphere.planning.distances import Distances

        scene = planned.recipe.scene
        if planned.composition is None or not scene.has_fixed_scenery or is_redrawn(planned.recipe):
            return
        subject = planned.subjects[0]
        there = next(iter(planned.standing(subject, self.box)), None)
        if there is None or not there.views.are_known:  # where the camera is, is known with its shot
            return
        things = planned.composition.things(subject, there.things, None, self.box)
        poses = range(0, planned.poses, -(-planned.poses // MOST_CAMERAS))
        cameras = Distances(planned, self.box).cameras(things, poses, views=there.views)
        with planned.recipe.located():
            self._check_cameras(things, cameras)

    def _check_cameras(self, things: Sequence[Thing], cameras: Float, known: Mapping[int, _Stand] = NONE_KNOWN) -> None:
        """Raise RecipeError for the first of the cameras (N, 3) that is inside of something; known: where some of the things
        stand, by their identity.

        Inside of a target means its box. Inside of scenery means that it hides the sky from the camera, but not from the
        frame's model: under a tree, among hills or in the room where the model stands a camera may well be. So cameras are not
        looked at where no target is there.
        """
        own = next((i for i, thing in enumerate(things) if not thing.scenery), None)
        if own is None:
            return
        stands = [known.get(id(thing)) or self._stand(thing) for thing in things]
        boxes, model = np.array([stand.box for stand in stands]), stands[own].box.mean(axis=0)
        check_rooms([room for stand in stands for room in stand.rooms], model, cameras)
        low, high = cameras.min(axis=0), cameras.max(axis=0)
        for k in np.flatnonzero(((boxes.min(axis=1) <= high) & (boxes.max(axis=1) >= low)).all(axis=1)).tolist():
            thing = things[k]
            for i in np.flatnonzero(inside_box(boxes[k], cameras)):
                if not thing.scenery or (self._roofs(thing, cameras[i]) and not self._roofs(thing, model)):
                    what = f"{thing.model.category or 'piece'} {thing.key}"
                    x, y = np.array(thing.world_from_object)[:2, 3]
                    raise RecipeError(
                        f"viewpoints: expected the camera outside of all that is placed; found it at "
                        f"({', '.join(f'{v:.3g}' for v in cameras[i])}) inside {what}, which stands at ({x:.3g}, {y:.3g}): go "
                        f"farther away, or, where distance is a share to fill, fill less; with min_visibility, frames that are "
                        f"drawn at random are drawn again"
                    )

    def check_shot(self, shot: Shot) -> None:
        """Raise RecipeError where a camera of a shot is inside of something, or a trajectory leads through a wall; what stands
        still is looked at once.
        """
        instants, sensors = range(len(shot.instants)), range(len(shot.rig.sensors))
        still = {id(thing): self._stand(thing) for thing in shot.things if thing.motion.is_still}
        for poses in dict.fromkeys(map(shot.poses_at, instants)):
            together = [instant for instant in instants if shot.poses_at(instant) == poses]
            cameras = [shot.camera(instant, sensor).center for instant in together for sensor in sensors]
            there = [thing for thing in shot.things_at(together[0]) if thing.is_there]
            self._check_cameras(there, np.array(cameras), still)
        if shot.sequence:
            fixed = [(thing, still[id(thing)].box) for thing in shot.things if id(thing) in still]
            check_way(fixed, lambda thing: self.model(thing.model, thing.step), _steps(shot))

    def _stand(self, thing: Thing) -> _Stand:
        pose = thing.world_from_object
        rooms = tuple(transform(pose, box) for box in rooms_of(thing.model.source, thing.model.seed)) if thing.scenery else ()
        return _Stand(transform(pose, self.box(thing.model, thing.step)), rooms)

    def check_instant(self, shot: Shot, instant: int) -> None:
        """Raise RecipeError where a camera of a shot is inside of something at an instant, counted from 0 in the shot."""
        self.check_shot(shot.model_copy(update={"instants": (shot.instants[instant],), "things": shot.things_at(instant)}))

    def _roofs(self, thing: Thing, point: Float) -> bool:
        """Return whether scenery hides most of the sky from a point in the world."""
        mesh = self.model(thing.model, thing.step)
        inside = transform(np.linalg.inv(np.array(thing.world_from_object)), point)
        return sky_occlusion(mesh.vertices.astype(np.float64), mesh.triangles, inside) > MOST_SKY

    def stage(self, shot: Shot) -> Stage:
        """The engine's stage for this shot, built anew only when the scene is another one, or a picture in it has changed."""
        key = shot.stage_key, _stamps(shot)
        if self._stage is None or self._stage_key != key:
            stage: Stage = plugins.load(EngineSpec, shot.engine).staged(shot, self.model)
            self._stage_key = key
        else:
            stage = self._stage.of(shot)
        self._stage = stage
        return stage

    def render(self, shot: Shot) -> Iterator[Sample]:
        """The shot's samples in order, channels in memory; `check_shot` says beforehand whether its cameras can stand there."""
        stage = self.stage(shot)
        views = ShotViews(shot, stage.at, lambda thing: self.model(thing.model, thing.step))
        shown: tuple[TimeStep | None, ...] | None = None
        boxes, sizes, traits = list[Float](), list[Size | None](), list[Callable[[], Traits]]()
        for sample in shot.samples:
            steps = tuple(thing.motion.step_at(sample[1]) for thing in shot.objects)
            if steps != shown:
                both = list(zip(shot.objects, steps, strict=True))
                boxes = [self.box(thing.model, step) for thing, step in both]
                sizes = [self.real_size(thing.model, step) for thing, step in both]
                traits = [partial(self.traits, thing.model, step) for thing, step in both]
                shown = steps
            yield render_sample(views, sample, stage, boxes, sizes, traits)


def _name(spec: ModelSpec, step: TimeStep | None) -> str:
    """Equal for equal models."""
    return spec.model_dump_json() + (step.model_dump_json() if step else "")


def _steps(shot: Shot) -> list[Step]:
    """From each frame to the next one, where the shot has both."""
    pairs = enumerate(pairwise(shot.instants))
    return [(a.index, shot.camera(i, 0).center, shot.camera(i + 1, 0).center) for i, (a, b) in pairs if b.index == a.index + 1]


def _stamps(shot: Shot) -> tuple[Stamp, ...]:
    """Of the files that the surfaces of a shot show."""
    ground = () if shot.scene.ground is None else ground_stamps(shot.scene.ground)
    return ground + repaint_stamps(repaint for thing in shot.things for repaint in thing.repaints)


def _size(mesh: Mesh) -> int:
    """Bytes, about."""
    per_vertex = sum(a.nbytes for a in (mesh.vertices, mesh.normals, mesh.uv0, mesh.uv1, mesh.colors) if a is not None)
    return per_vertex + 5 * mesh.triangles.nbytes // 3 + sum(i.pixels.nbytes for i in mesh.images)


def render_sample(
    views: ShotViews,
    sample: tuple[int, int, int],
    stage: Stage,
    boxes: Sequence[Float],
    sizes: Sequence[Size | None],
    traits: Sequence[Callable[[], Traits]],
) -> Sample:
    """One of the samples of the views' shot: colour from the engine, every label from truth, for which a shadow catcher may not
    be there.

    `boxes`, `sizes` and `traits`: each object's 3D box then in its own axes, its real size if known, and what gives what its
    model says of itself.
    """
    shot, (number, instant, sensor) = views.shot, sample
    kept = shot.kept(sensor)
    names = [name for name in kept if name not in PASSES]
    _arrange(views, instant, sensor, [*names, *shot.annotations])
    view, geometry = views.view(instant, sensor), stage.at(instant)
    now, camera, labelled, visibility = shot.instants[instant], view.camera, view.geometry, view.visibility
    around = views.around(instant, sensor)
    observed = observe(labelled, camera, visibility, names, around, shot.labels)
    passes = [name for name in PASSES if name in kept]
    if passes:
        painted = visibility if labelled is geometry else with_ground(geometry, camera, visibility)
        observed |= stage.paint(instant, sensor, painted, passes)
    steps = [thing.motion.step_at(instant) for thing in shot.objects]
    files = [model_files(p.model.key, step and step.frame)[0] for p, step in zip(shot.objects, steps, strict=True)]
    sight = sight_of(shot, instant, camera, labelled, visibility, boxes, files, sizes, around, traits)
    objects = annotated(sight)
    return Sample(
        index=number,
        split=now.split,
        known_camera=camera,
        known_pose=shot.viewpoint(instant, sensor),
        objects=objects,
        channels={name: observed[name] for name in kept},
        files={},
        sequence=shot.sequence,
        variation=shot.variation,
        sensor=shot.rig.sensors[sensor].name,
        instant=now.index,
        time=now.seconds,
        taken=Taken(instant, sensor, shot),
        asked=shot.annotations,
        more=sample_values(sight, objects),
        options=shot.labels,
    )


def _arrange(views: ShotViews, instant: int, sensor: int, names: Sequence[str]) -> None:
    """Ask for the triangles of all instants that labels compare, in their order, which reuses those of the sample before.

    Before that the points that the sensor follows are picked: at so many instants that these triangles would be written over.
    """
    needs = [labels()[name].needs for name in names]
    if any(need.tracks for need in needs):
        views.followed(sensor)
    offsets = sorted({0, *(offset for need in needs for offset in need.instants)})
    compared = [other for other in (views.shot.instant_after(instant, offset) for offset in offsets) if other is not None]
    views.keep(compared)
    for other in compared:
        views.labelled(other)
