"""The views of a data set's cameras, reconstructed from the exported models at the poses in the shots."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.exporting.exported import read_exported
from viewsphere.assets.mesh import Mesh
from viewsphere.errors import StoreError
from viewsphere.labels import FollowedPoints, LabelContext, LidarScan, Need, Placement, labels, requires
from viewsphere.model.model_spec import ModelSpec, step_key
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.model.scene import Matrix4
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Motion, Thing, TimeStep
from viewsphere.run.shots.composing import SceneryRecord
from viewsphere.run.shots.scenery import Scenery
from viewsphere.store import Dataset, ModelInfo, Row
from viewsphere.truth.raster.geometry import Geometry, build_geometry, present
from viewsphere.truth.raster.visibility import rasterize
from viewsphere.truth.shot_views import NeighbourViews, ShotViews, views_of

MODELS = 200
"""Number of exported models that are kept in memory."""


class ViewReconstructor:
    """The label contexts of a data set's samples. The last geometry and the last context are kept, because samples of one
    geometry follow one another, and several callers read the same sample.
    """

    def __init__(self, dataset: Dataset, scenery: Scenery, models: Mapping[str, ModelInfo]) -> None:
        self._dataset, self._scenery, self._models = dataset, scenery, models
        self._mesh = lru_cache(maxsize=MODELS)(self._read)
        self._geometry: tuple[object, Geometry | None] = None, None
        self._views: tuple[object, ShotViews | None] = None, None
        self._last: tuple[object, LabelContext | None] | None = None
        self._continued = lru_cache(maxsize=4)(self._joined)
        self._keys: dict[int, str] = {}  # for the objects of the views' shot: merged data sets have their own names

    def is_possible(self, sample: Sample) -> bool:
        """Return whether a sample's view can be reconstructed: its shot is stored, and its objects have poses."""
        known = self._scenery.shot(self._scenery.key_of(sample.index)) is not None
        return known and sample.known_camera is not None and all(o.source is None for o in sample.objects)

    @property
    def notes(self) -> list[str]:
        """The notes about changed scenery."""
        return self._scenery.notes

    def context(
        self, sample: Sample, names: Iterable[str], asked: Iterable[str] = (), continued: bool = False
    ) -> LabelContext | None:
        """Return the view of a sample's sensor, for labels of these names and for the labels on request in `asked`.
        It is None where scenery has changed. `continued`: labels may compare it with instants of the shots before and after.
        """
        known = labels()
        needs = tuple(dict.fromkeys(need for name in (*names, *asked) if name in known for need in known[name].needs))
        key = sample.index, tuple(asked), continued, needs
        if self._last is None or self._last[0] != key:
            self._last = key, self._seen(sample, needs, tuple(asked), continued)
        return self._last[1]

    def _seen(self, sample: Sample, needs: Sequence[Need[Any]], asked: tuple[str, ...], continued: bool) -> LabelContext | None:
        key = self._scenery.key_of(sample.index)
        made = self._continued(key) if continued else self._made(key)
        assert made is not None
        options = {**made.shot.labels, **sample.options}  # including those of channels added later
        around, shot = made.around, made.shot.model_copy(update={"labels": options})
        geometry = self._built(sample, shot, around)
        if geometry is None:
            return None
        camera, by_id = sample.camera, {o.id: o for o in sample.objects}
        placed = tuple(self._placement(by_id.get(i + 1), sample, shot) for i in range(geometry.object_count))
        visibility = rasterize(geometry, camera, keeps_exact=True)
        annotations = tuple(dict.fromkeys((*shot.annotations, *asked)))
        kept = (need for name in shot.annotations for need in labels()[name].needs)
        views = self._compared(key, sample, shot, around, (*needs, *kept))
        return LabelContext(geometry, camera, visibility, placed, views, annotations, shot.labels)

    def _made(self, key: str) -> _Made | None:
        shot = self._scenery.shot(key)
        return shot and _Made(shot, self._scenery.around(key))

    def _joined(self, key: str) -> _Made | None:
        """A shot of a sequence with the last instant of the previous shot and the first instant of the next, if it lacks
        them.
        """
        made, row = self._made(key), self._dataset.plan.find(key)
        if made is None or row is None or not made.shot.sequence:
            return made
        for number, place in ((row.first - 1, -1), (row.first + row.count, 0)):
            other = self._beside(number, row) if 0 <= number < self._dataset.plan.frames else None
            if other is not None and other.shot.sequence == made.shot.sequence:
                made = made.with_instant(other, place)
        return made

    def _beside(self, frame: int, own: Row) -> _Made | None:
        """The shot of a frame; raises StoreError if it belongs to the same sequence as `own` but is not finished."""
        row = self._dataset.plan.row_at(frame)
        if self._dataset.store.has_shot(row.key):
            return self._made(row.key)
        if row.subject == own.subject:
            raise StoreError(
                f"shot {own.key}: expected {row.key} beside it, with which labels compare it, found it unfinished: render the "
                "rest first"
            )
        return None

    def _placement(self, o: ObjectAnnotation | None, sample: Sample, shot: Shot) -> Placement | None:
        if o is None:
            return None
        info = self._models[o.key]
        pose = _matrix(o.world_from_object)
        return Placement(_spec(info), pose, sample.camera, shot.category_deg, lambda: info, _step(info), o.id - 1)

    def _built(self, sample: Sample, shot: Shot, around: SceneryRecord) -> Geometry | None:
        """The geometry that a sample shows; None if scenery has changed."""
        there = {o.id: o for o in sample.objects}
        objects = tuple(self._thing(there.get(thing.id), thing) for thing in shot.objects)
        instant, _ = self._scenery.position(sample, shot)
        behind = tuple(thing.still_at(instant) for thing in around.things)
        ground = shot.scene.ground is not None and shot.scene.ground.is_labelled
        now = objects, behind, ground, shot.label_alpha, shot.scene.floor
        if self._geometry[0] != now:
            meshes = [self._mesh(thing.key) for thing in objects]
            scenery = [self._scenery.mesh(around, thing) for thing in behind]
            whole = [mesh for mesh in scenery if mesh is not None]
            things = (*objects, *behind)
            built = None
            if len(whole) == len(scenery):
                built = build_geometry(things, present(things, [*meshes, *whole]), ground, shot.label_alpha, shot.scene.floor)
            self._geometry = now, built
        return self._geometry[1]

    def _compared(
        self, key: str, sample: Sample, shot: Shot, around: SceneryRecord, needs: tuple[Need[Any], ...]
    ) -> NeighbourViews | None:
        """Return the views that labels of motion and stereo compare a sample with; None without such views, or if scenery
        has changed.

        Points are picked here, before any label requests triangles, which would overwrite them.
        """
        if not needs:
            return None
        keys = {o.id: o.track or o.key for o in sample.objects}
        known = key, len(shot.instants)  # with neighbours or without; shots of merged data sets may share their old key
        if self._views[0] != known:
            self._keys = keys  # before the views are made, which request meshes
            self._views = known, self._shot_views(shot, around)
        self._keys.update(keys)
        views, (instant, sensor) = self._views[1], self._scenery.position(sample, shot)
        if views and requires(needs, FollowedPoints):
            views.followed(sensor)
        return views and views.neighbours(instant, sensor)

    def _shot_views(self, shot: Shot, around: SceneryRecord) -> ShotViews | None:
        """The views of a shot, with its exported models at the poses in the shot."""
        if any(
            self._scenery.mesh(around, thing.still_at(i)) is None for thing in around.things for i in range(len(shot.instants))
        ):
            return None

        def mesh(thing: Thing) -> Mesh:
            if not thing.id:
                return self._scenery.unchanged_mesh(around, thing)
            return self._mesh(step_key(self._keys.get(thing.id, thing.model.key), thing.step and thing.step.frame))

        return views_of(shot.model_copy(update={"things": (*shot.things, *around.things)}), mesh)

    def _thing(self, o: ObjectAnnotation | None, thing: Thing) -> Thing:
        """An object with its pose from a sample, or marked as absent."""
        if o is None:
            return Thing(id=thing.id, model=thing.model, motion=Motion(poses=(None,)))
        info = self._models[o.key]
        return Thing(id=o.id, model=_spec(info), motion=Motion.still(_matrix(o.world_from_object), _step(info)))

    def _read(self, key: str) -> Mesh:
        info = self._models[key]
        kept = (labels().get(name) for name in self._dataset.plan.channels)
        whole = any(requires(label.needs, LidarScan) for label in kept if label)  # its intensity follows from colours
        return read_exported(self._dataset.path(info.glb), info.parts, info.node, whole=whole)


@dataclass(frozen=True)
class _Made:
    """A shot as it was rendered, and the scenery around its objects."""

    shot: Shot
    around: SceneryRecord

    def with_instant(self, other: _Made, place: int) -> _Made:
        """A copy with the first recorded instant (0) or the last (-1) of a neighbour in its sequence; unchanged if it has that
        instant already.
        """
        at = [i for i, instant in enumerate(other.shot.instants) if instant.recorded][place]
        instant, own = other.shot.instants[at], self.shot.instants
        if any(one.index == instant.index for one in own):
            return self
        where = sum(one.index < instant.index for one in own)  # followed points also add distant instants

        def inserted(values: Iterable[Any], one: Any) -> tuple[Any, ...]:
            known = tuple(values)
            return (*known[:where], one, *known[where:])

        def moved(thing: Thing, then: Thing) -> Thing:
            if thing.motion == then.motion and thing.motion.is_still:
                return thing
            poses = inserted(map(thing.motion.pose_at, range(len(own))), then.motion.pose_at(at))
            steps = inserted(map(thing.motion.step_at, range(len(own))), then.motion.step_at(at))
            return thing.model_copy(update={"motion": Motion(poses=poses, steps=steps, moves=True)})

        shot = self.shot.model_copy(
            update={
                "instants": inserted(own, instant.model_copy(update={"recorded": False})),
                "things": tuple(map(moved, self.shot.things, other.shot.things)),
                "exposures": inserted(self.shot.exposures, other.shot.exposures[at]) if self.shot.exposures else (),
            }
        )
        behind = tuple(map(moved, self.around.things, other.around.things))
        return _Made(shot, self.around.model_copy(update={"things": behind}))


def _spec(info: ModelInfo) -> ModelSpec:
    """The model's spec for labels, from the data set's metadata."""
    return ModelSpec(
        key=info.track or info.key,
        source="",
        category=info.category,
        supercategory=info.supercategory,
        category_id=info.category_id,
        faces=info.faces,
    )


def _step(info: ModelInfo) -> TimeStep | None:
    """The time step that the key of a model names."""
    return info.step if info.track else None


def _matrix(values: NDArray[np.float64]) -> Matrix4:
    a, b, c, d = ((w, x, y, z) for w, x, y, z in values.tolist())
    return a, b, c, d
