"""The rendering of a shot's samples: load the models, keep the stage warm, render frame by frame."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING

from viewsphere import plugins
from viewsphere.assets.appearance.description import appearance_of
from viewsphere.assets.appearance.opaque import Stamp
from viewsphere.assets.appearance.repaint import repaint_stamps
from viewsphere.assets.cache import frame_of, load, read_ahead
from viewsphere.assets.mesh import Mesh
from viewsphere.assets.metadata.model_metadata import metadata_of, with_body_parts
from viewsphere.assets.parts import selected_parts
from viewsphere.assets.primitive import FileFacts
from viewsphere.errors import ModelError
from viewsphere.geometry.box3d import Box3d
from viewsphere.labels import FollowedPoints, annotated, context_of, labels, observe, requires, sample_values
from viewsphere.model.annotations.metadata import ModelMetadata
from viewsphere.model.channel import PASSES
from viewsphere.model.model_spec import ModelSpec, Size, step_key
from viewsphere.model.sample import Float, Origin, Sample
from viewsphere.model.shot import Shot
from viewsphere.model.thing import TimeStep
from viewsphere.plugins.engine import EngineSpec
from viewsphere.rendering.ground.material import ground_stamps
from viewsphere.store import ModelInfo, Store
from viewsphere.truth.raster.visibility import with_ground
from viewsphere.truth.shot_views import ShotViews

if TYPE_CHECKING:
    from viewsphere.engines import Stage  # takes a third of a worker's start
    from viewsphere.planning.plan import Plan

WARM_BYTES = 400_000_000
"""Maximum size of the cache of recently used models, bytes."""


def model_files(key: str, frame: int | None = None) -> tuple[str, str]:
    """Paths of a model's OBJ and GLB, relative to the data set; a deforming model has an OBJ for each `frame` of its file."""
    return f"store/models/{key}/{step_key(key, frame)}.obj", f"store/models/{key}/{key}.glb"


@dataclass(frozen=True, eq=False)
class StoredBoxes:
    """The boxes (8, 3) of a data set's finished models; raises ModelError for any other model."""

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
            return self._known[spec.key].at_frame(step and step.frame).box3d_object
        except ValueError as error:
            raise ModelError(f"{self.store.root}: {error}: render again") from None


@dataclass(eq=False)
class Stages:
    """Renders shots; caches the last shot's stage and the recently used models."""

    _stage: Stage | None = None
    _stage_key: tuple[str, tuple[Stamp, ...]] = ("", ())
    _models: dict[str, Mesh] = field(default_factory=dict[str, Mesh])
    _boxes: dict[str, Float] = field(default_factory=dict[str, Float])
    _sizes: dict[str, Size] = field(default_factory=dict[str, Size])
    _facts: dict[str, FileFacts] = field(default_factory=dict[str, FileFacts])
    _metadata: dict[str, ModelMetadata] = field(default_factory=dict[str, ModelMetadata])

    def model(self, spec: ModelSpec, step: TimeStep | None = None) -> Mesh:
        """The normalised model at a time step (None: its rest pose); raises ModelError if its file cannot be used."""
        name = _name(spec, step)
        known = self._models.pop(name, None)
        mesh = known or self._loaded(spec, step)
        self._models[name] = mesh  # the most recently used comes last
        if known:
            return known
        if name not in self._boxes:
            self._boxes[name] = Box3d.between(*mesh.bounds).corners
        held = sum(map(_size, self._models.values()))
        while held > WARM_BYTES and len(self._models) > 1:
            held -= _size(self._models.pop(next(iter(self._models))))
        return mesh

    def _loaded(self, spec: ModelSpec, step: TimeStep | None) -> Mesh:
        """The loaded model; a file with many parts is loaded once for all of them."""
        if spec.parts is None:
            mesh, self._facts[_name(spec, step)] = load(spec, step=step)
            return with_body_parts(mesh, spec)
        frame = frame_of(spec, step)
        return selected_parts(self.model(spec.whole, None if frame is None else TimeStep(frame=frame)), spec, step)

    def box(self, spec: ModelSpec, step: TimeStep | None = None) -> Float:
        """The 3D box (8, 3) of the normalised model at a time step in its own axes; raises ModelError as `model` does."""
        name = _name(spec, step)
        if name not in self._boxes:
            self.model(spec, step)
        return self._boxes[name]

    def metadata(self, spec: ModelSpec, step: TimeStep | None = None) -> ModelMetadata:
        """Return the metadata of a model at a time step; raises ModelError as `model` and `metadata_of` do."""
        name = _name(spec, step)
        if name not in self._metadata:
            mesh = self.model(spec, step)
            facts = self._facts.get(name) or FileFacts(Path(spec.source), "parts", "+z", "-y", 1.0)
            said = metadata_of(spec, mesh, facts, step)
            looks = cache(lambda: appearance_of(self.model(spec, step), said.color, said.material))
            self._metadata[name] = replace(said, looks=looks)
        return self._metadata[name]

    def real_size(self, spec: ModelSpec, step: TimeStep | None = None) -> Size | None:
        """The model's true (width, height, length) in metres; None if unknown."""
        if spec.real_size != "file":
            return spec.real_size
        name = _name(spec, step)
        if name not in self._sizes:
            self._sizes[name] = Box3d(self.box(spec.model_copy(update={"scale": "as_is"}), step)).size
        return self._sizes[name]

    def read_ahead(self, planned: Plan, specs: Sequence[ModelSpec]) -> None:
        """Read all time steps of each animated model of the plan at once, instead of one after another."""
        for spec in specs:
            frames = {step.frame for step in planned.steps_of(spec)}
            if frames and spec.rest is not None:
                read_ahead(spec, frames | {spec.rest})

    def stage(self, shot: Shot) -> Stage:
        """The engine's stage for this shot, rebuilt only if the scene is a different one or a picture in it has changed."""
        key = shot.stage_key, _stamps(shot)
        if self._stage is None or self._stage_key != key:
            stage: Stage = plugins.load(EngineSpec, shot.engine).staged(shot, self.model)
            self._stage_key = key
        else:
            stage = self._stage.for_shot(shot)
        self._stage = stage
        return stage

    def render(self, shot: Shot) -> Iterator[Sample]:
        """The shot's samples in order, channels in memory; `CameraChecks` checks its cameras beforehand."""
        stage = self.stage(shot)
        views = ShotViews(shot, stage.at, lambda thing: self.model(thing.model, thing.step))
        shown: tuple[TimeStep | None, ...] | None = None
        boxes, sizes, metadata = list[Float](), list[Size | None](), list[Callable[[], ModelMetadata]]()
        for sample in shot.samples:
            steps = tuple(thing.motion.step_at(sample[1]) for thing in shot.objects)
            if steps != shown:
                both = list(zip(shot.objects, steps, strict=True))
                boxes = [self.box(thing.model, step) for thing, step in both]
                sizes = [self.real_size(thing.model, step) for thing, step in both]
                metadata = [partial(self.metadata, thing.model, step) for thing, step in both]
                shown = steps
            yield render_sample(views, sample, stage, boxes, sizes, metadata)


def _name(spec: ModelSpec, step: TimeStep | None) -> str:
    """A name that is equal for equal models."""
    return spec.model_dump_json() + (step.model_dump_json() if step else "")


def _stamps(shot: Shot) -> tuple[Stamp, ...]:
    """The stamps of the files on the surfaces of a shot."""
    ground = () if shot.scene.ground is None else ground_stamps(shot.scene.ground)
    return ground + repaint_stamps(repaint for thing in shot.things for repaint in thing.repaints)


def _size(mesh: Mesh) -> int:
    """The approximate size in bytes."""
    per_vertex = sum(a.nbytes for a in (mesh.vertices, mesh.normals, mesh.uv0, mesh.uv1, mesh.colors) if a is not None)
    return per_vertex + 5 * mesh.triangles.nbytes // 3 + sum(i.pixels.nbytes for i in mesh.images)


def render_sample(
    views: ShotViews,
    sample: tuple[int, int, int],
    stage: Stage,
    boxes: Sequence[Float],
    sizes: Sequence[Size | None],
    metadata: Sequence[Callable[[], ModelMetadata]],
) -> Sample:
    """One of the samples of the views' shot, with colour from the engine and every label from exact geometry. A shadow catcher
    may be absent in the labels.

    `boxes`, `sizes` and `metadata` are, for each object, its 3D box at that instant in its own axes, its real size if known,
    and a function that returns its model's metadata.
    """
    shot, (number, instant, sensor) = views.shot, sample
    kept = shot.kept_channels(sensor)
    names = [name for name in kept if name not in PASSES]
    _arrange(views, instant, sensor, [*names, *shot.annotations])
    view, geometry = views.view(instant, sensor), stage.at(instant)
    now, camera, labelled, visibility = shot.instants[instant], view.camera, view.geometry, view.visibility
    neighbours = views.neighbours(instant, sensor)
    observed = observe(labelled, camera, visibility, names, neighbours, shot.labels)
    passes = [name for name in PASSES if name in kept]
    if passes:
        painted = visibility if labelled is geometry else with_ground(geometry, camera, visibility)
        observed |= stage.paint(instant, sensor, painted, passes)
    steps = [thing.motion.step_at(instant) for thing in shot.objects]
    files = [model_files(p.model.key, step and step.frame)[0] for p, step in zip(shot.objects, steps, strict=True)]
    context = context_of(shot, instant, camera, labelled, visibility, boxes, files, sizes, neighbours, metadata)
    objects = annotated(context)
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
        origin=Origin(instant, sensor, shot),
        requested=shot.annotations,
        extra=sample_values(context, objects),
        options=shot.labels,
        finish=shot.finish(instant, sensor),
    )


def _arrange(views: ShotViews, instant: int, sensor: int, names: Sequence[str]) -> None:
    """Request the triangles of all instants that labels compare, in order, which reuses those of the previous sample.

    The points that the sensor follows are picked first, because that visits many instants and would overwrite these triangles.
    """
    known = [labels()[name] for name in names]
    if any(requires(label.needs, FollowedPoints) for label in known):
        views.followed(sensor)
    offsets = sorted({0, *(offset for label in known for offset in label.view_offsets)})
    compared = [other for other in (views.shot.instant_after(instant, offset) for offset in offsets) if other is not None]
    views.keep(compared)
    for other in compared:
        views.labelled(other)
