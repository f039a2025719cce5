"""Labels computed again: from the exported models, where shots say that they stand, and compared with those that are kept."""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.exported import read_exported
from viewsphere.assets.mesh import Mesh
from viewsphere.check.scenery import Scenery
from viewsphere.errors import RecipeError, ViewsphereError
from viewsphere.labels import (
    ChannelLabel,
    Placement,
    Sight,
    annotated,
    channel_labels,
    labels,
    labels_of,
    sample_labels,
    sample_values,
)
from viewsphere.model.model_spec import ModelSpec, step_key
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.model.scene import Matrix4
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Motion, Thing, TimeStep
from viewsphere.store import Dataset, ModelInfo, depth_step
from viewsphere.store.channel_files import MOST_STEPS
from viewsphere.truth.geometry import Geometry, build_geometry, present
from viewsphere.truth.shot_views import SampleViews, ShotViews, views_of
from viewsphere.truth.visibility import rasterize

Findings = Iterator[tuple[str, str]]
"""Names of labels, and what is wrong with them."""

MODELS = 200
"""Exported models that are kept in memory."""


class Again:
    """Computes labels of a data set again; the last geometry is kept, because samples of one follow one another."""

    def __init__(self, dataset: Dataset, scenery: Scenery, models: Mapping[str, ModelInfo]) -> None:
        self._dataset, self._scenery, self._models = dataset, scenery, models
        self._mesh = lru_cache(maxsize=MODELS)(self._read)
        self._geometry: tuple[object, Geometry | None] = None, None
        self._views: tuple[str, ShotViews | None] = "", None
        self._keys: dict[int, str] = {}  # of the objects of the views' shot: merged data sets have names of their own

    def is_possible(self, sample: Sample) -> bool:
        """Whether it is known what was seen: the shot is kept, and the objects are placed."""
        known = self._scenery.shot(self._scenery.key_of(sample.index)) is not None
        return known and sample.known_camera is not None and all(o.source is None for o in sample.objects)

    def differences(self, sample: Sample) -> Findings:
        """What is kept of a sample and what is computed again, where they differ; nothing where scenery is not what it was."""
        key = self._scenery.key_of(sample.index)
        shot = self._scenery.shot(key)
        assert shot is not None
        shot = shot.model_copy(update={"labels": {**shot.labels, **sample.options}})  # those of channels added later, too
        geometry = self._built(sample, shot, key)
        if geometry is None:
            return
        camera, by_id = sample.camera, {o.id: o for o in sample.objects}
        placed = tuple(self._placement(by_id.get(i + 1), sample, shot) for i in range(geometry.object_count))
        visibility = rasterize(geometry, camera, keeps_exact=True)
        sight = Sight(geometry, camera, visibility, placed, self._compared(sample, shot, key), shot.annotations, shot.labels)
        for name, label in channel_labels().items():
            if name in sample.files:
                yield from ((name, problem) for problem in self._pixels(sample, name, self._computed(label, sight)))
        objects = annotated(sight)
        for o, again in zip(sample.objects, objects, strict=True):
            yield from _fields(o, again, shot.annotations)
        yield from _of_picture(sample.more, sample_values(sight, objects))

    def _computed(self, label: ChannelLabel, sight: Sight) -> NDArray[Any] | None:
        """A channel, computed again; None where a picture of the scene is no longer there: it is no part of the data set."""
        try:
            return label.compute(sight)
        except RecipeError as error:
            note = f"{label.name} not checked: {error}"
            if note not in self._scenery.notes:
                self._scenery.notes.append(note)
            return None

    def _pixels(self, sample: Sample, name: str, again: NDArray[Any] | None) -> Iterator[str]:
        """Where a channel is not what it should be; what cannot be read, or has another size, is said elsewhere."""
        if again is None:
            return
        try:
            kept = sample.channels[name]
        except ViewsphereError:
            return
        if kept.shape != again.shape:
            if kept.dtype.names:  # of rows nothing else says how many there are
                yield f"expected {len(again):,} rows, found {len(kept):,}"
            return
        step = depth_step(self._dataset.read(sample.files[name])) if name == "depth" else 0.0
        wrong = _beyond(kept, again, step) if step else _unequal(kept, again)
        if wrong.any():
            where = tuple(int(i[0]) for i in np.nonzero(wrong))
            what, at = ("pixels", f"pixel {where[::-1]}") if wrong.ndim == 2 else ("rows", f"row {where[0]}")
            yield (
                f"{wrong.sum()} of {wrong.size} {what} are not those of the exported models: at {at} expected "
                f"{again[where].tolist()}, found {kept[where].tolist()}"
            )

    def _placement(self, o: ObjectAnnotation | None, sample: Sample, shot: Shot) -> Placement | None:
        if o is None:
            return None
        info = self._models[o.key]
        pose = _matrix(o.world_from_object)
        return Placement(_spec(info), pose, sample.camera, shot.category_deg, lambda: info, _step(info))

    def _built(self, sample: Sample, shot: Shot, key: str) -> Geometry | None:
        """The geometry that a sample shows; None where scenery is not what it was."""
        around = self._scenery.around(key)
        there = {o.id: o for o in sample.objects}
        objects = tuple(self._thing(there.get(thing.id), thing) for thing in shot.objects)
        instant, _ = self._scenery.taken(sample, shot)
        behind = tuple(thing.at(instant) for thing in around.things)
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

    def _compared(self, sample: Sample, shot: Shot, key: str) -> SampleViews | None:
        """What labels of motion and stereo compare a sample with; None without one, and where scenery is not what it was.

        Points are picked here, before any label asks for triangles, which would be written over.
        """
        known = labels()
        needs = [known[name].needs for name in (*sample.files, *shot.annotations) if name in known]
        if not any(need.is_some for need in needs):
            return None
        names = {o.id: o.track or o.key for o in sample.objects}
        if self._views[0] != key:
            self._keys = names  # before the views are made, which ask for meshes
            self._views = key, self._shot_views(shot, key)
        self._keys.update(names)
        views, (instant, sensor) = self._views[1], self._scenery.taken(sample, shot)
        if views and any(need.tracks for need in needs):
            views.followed(sensor)
        return views and views.around(instant, sensor)

    def _shot_views(self, shot: Shot, key: str) -> ShotViews | None:
        """The views of a shot whose things stand where the shot says, in the exported models."""
        around = self._scenery.around(key)
        if any(self._scenery.mesh(around, thing.at(i)) is None for thing in around.things for i in range(len(shot.instants))):
            return None

        def mesh(thing: Thing) -> Mesh:
            if not thing.id:
                return self._scenery.known(around, thing)
            return self._mesh(step_key(self._keys.get(thing.id, thing.model.key), thing.step and thing.step.frame))

        return views_of(shot.model_copy(update={"things": (*shot.things, *around.things)}), mesh)

    def _thing(self, o: ObjectAnnotation | None, thing: Thing) -> Thing:
        """An object as a sample says that it stands, or not there."""
        if o is None:
            return Thing(id=thing.id, model=thing.model, motion=Motion(poses=(None,)))
        info = self._models[o.key]
        return Thing(id=o.id, model=_spec(info), motion=Motion.still(_matrix(o.world_from_object), _step(info)))

    def _read(self, key: str) -> Mesh:
        info = self._models[key]
        whole = "lidar" in self._dataset.plan.channels  # its intensity follows from colours, too
        return read_exported(self._dataset.path(info.glb), info.parts, info.node, whole=whole)


def _spec(info: ModelInfo) -> ModelSpec:
    """The model as labels know it: what the data set says of it."""
    return ModelSpec(
        key=info.track or info.key,
        source="",
        category=info.category,
        supercategory=info.supercategory,
        category_id=info.category_id,
    )


def _step(info: ModelInfo) -> TimeStep | None:
    """The time step that the key of a model names."""
    return info.step if info.track else None


def _matrix(values: NDArray[np.float64]) -> Matrix4:
    a, b, c, d = ((w, x, y, z) for w, x, y, z in values.tolist())
    return a, b, c, d


def _unequal(kept: NDArray[Any], again: NDArray[Any]) -> NDArray[np.bool_]:
    """(H, W): where any component differs; NaN equals itself. Of rows (N,): which differ in any byte."""
    if kept.dtype.names:
        return (_bytes(kept) != _bytes(again)).any(axis=1)
    different = kept != again
    if np.issubdtype(kept.dtype, np.floating):
        different &= ~(np.isnan(kept) & np.isnan(again))
    return different if different.ndim == 2 else different.any(axis=2)


def _bytes(rows: NDArray[Any]) -> NDArray[np.uint8]:
    """The bytes of each row, (N, bytes)."""
    return np.ascontiguousarray(rows).view(np.uint8).reshape(len(rows), rows.dtype.itemsize)


def _beyond(kept: NDArray[Any], again: NDArray[Any], step: float) -> NDArray[np.bool_]:
    """(H, W): where a depth kept in whole steps is not the nearest one; what is behind the camera is kept as nothing."""
    seen = np.isfinite(again) & (again > 0)
    rounded = np.clip(np.rint(np.where(seen, again, 1.0).astype(np.float64) / step), 1, MOST_STEPS)
    return np.where(seen, kept != (rounded * step).astype(np.float32), np.isfinite(kept))


def _of_picture(kept: Mapping[str, Any], again: Mapping[str, Any]) -> Findings:
    for label in sample_labels().values():
        for field in label.fields:
            if field.name in again and not field.equals(kept[field.name], again[field.name]):
                expected, found = again[field.name], kept[field.name]
                yield label.name, f"expected {field.name} {expected!r} of the exported models, found {found!r}"


def _fields(o: ObjectAnnotation, again: ObjectAnnotation, asked: Container[str]) -> Findings:
    for label in labels_of(asked):
        for known in label.fields:
            kept, computed = getattr(o, known.name), getattr(again, known.name)
            if not known.equals(kept, computed):
                yield label.name, f"object {o.id}: expected {known.name} {computed!r} of the exported models, found {kept!r}"
