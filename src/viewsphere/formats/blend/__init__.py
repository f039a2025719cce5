"""Blender's own files, to open and change: a scene with its models, lights and ground, the camera on the viewing sphere.

    <model>.blend                 the frames of a model, one after another on the timeline
    <model>-<first frame>.blend   one of several scenes, if the model's frames need several
    <the same>/0001.png, ...      the backgrounds of its frames, if they change

Frames share a file while they share a scene: models and their positions, light, ground. Pictures are packed. Blender writes
memory addresses, so equal data sets give equal scenes but not equal bytes. Frames of unknown cameras or models, which imported
data sets may have, are left out.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Generator, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import lru_cache, partial
from hashlib import sha256
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from viewsphere import plugins
from viewsphere.assets.cache import load_normalised
from viewsphere.assets.load import load_model
from viewsphere.assets.mesh import Mesh
from viewsphere.assets.normalise import normalise
from viewsphere.errors import StoreError, UserError
from viewsphere.formats import Scope
from viewsphere.formats.shared.writing.refusals import any_view
from viewsphere.geometry.rotation import compose, rigid
from viewsphere.model.fields.files import Files
from viewsphere.model.instant import Instant
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.model.scene import Matrix4, Scene
from viewsphere.model.sensors.rig import Rig
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Motion, Thing, TimeStep
from viewsphere.plugins.engine import EngineSpec
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset
from viewsphere.urls import here
from viewsphere.validation.quantity import quantity

ENGINE = "cycles"
"""The engine that builds and saves the scenes."""


def _check() -> None:
    """Raise UserError if Blender is missing."""
    plugins.load(EngineSpec, ENGINE).check({})


def _refuses(scope: Scope) -> Iterator[str]:
    """Reasons to refuse: no picture has a known camera and viewpoint."""
    yield from any_view(scope)


@contextmanager
def _writer(dataset: Dataset, folder: Path, note: Callable[[str], None]) -> Generator[Callable[[Sample], None]]:
    """Write the frames that have a camera; notes name everything that Blender's files cannot hold.

    Blender needs all frames of a scene at once. The writer therefore first notes only each frame's place. After the last frame
    it reads the samples again, scene by scene. Raises UserError if Blender cannot be used or no frame can be written,
    ModelError for scenery that has become unreadable.
    """
    groups: dict[object, _Group] = {}
    places = ((key, place) for key, places in dataset.shots() for place in places)
    stored = lru_cache(maxsize=1)(partial(_stored, dataset))

    def add(sample: Sample) -> None:
        key, place = next(places)
        if is_camera_view(sample):
            group = groups.setdefault(_scene(*stored(key), key, place, sample), _Group(sample.objects[0].key))
            group.places.setdefault(key, []).append(place)

    yield add
    for line in dict.fromkeys((*_left_out(dataset, groups.values()), *_save(dataset, folder, groups.values()))):
        note(f"format blend: {line}")


def is_camera_view(sample: Sample) -> bool:
    """Return whether a frame can be written: its sensor is a camera, not a LiDAR, and the camera, the models and their
    positions are known.
    """
    if not (sample.known_camera and sample.known_pose and sample.objects):
        return False
    return not sample.known_camera.lens.is_scan and all(o.model for o in sample.objects)


def _left_out(dataset: Dataset, groups: Collection[_Group]) -> Iterator[str]:
    """Notes about frames that are left out or differ from their rendering."""
    total = len(dataset)
    written = sum(len(places) for group in groups for places in group.places.values())
    needs = "cameras, models and where they stand"
    if total and not written:
        raise UserError(f"{dataset.root}: format blend: expected frames with known {needs}; found none")
    if written < total:
        left = f"{total - written:,} of {quantity(total, 'frame')} are left out"
        yield f"{left}: their {needs} are not known, or they are a LiDAR's"
    unlit = sum(len(group.places[key]) for group in groups for key in group.places if dataset.store.shot(key) is None)
    if unlit:
        yield f"nothing is known of the light of {quantity(unlit, 'frame')}: they have the default sun and sky"


def _save(dataset: Dataset, folder: Path, groups: Collection[_Group]) -> Iterator[str]:
    """Write a file for each group; yields notes about everything that Blender's files cannot hold."""
    counts = Counter(group.model for group in groups)
    for group in groups:
        shots, instants, samples = zip(*_views(dataset, group), strict=True)
        name = group.model if counts[group.model] == 1 else f"{group.model}-{samples[0].index:06d}"
        own = shots[0].model_copy(update={"instants": instants})
        load = StoredModels.for_sample(dataset, own, samples[0])
        save = plugins.load(EngineSpec, ENGINE).save
        assert save is not None
        yield from save(own, samples, load, folder / f"{name}.blend", dataset.name)


@dataclass(eq=False)
class _Group:
    """Frames that share a file: the model's key, and for each shot the frames' places in it."""

    model: str
    places: dict[str, list[int]] = field(default_factory=dict[str, list[int]])


def _views(dataset: Dataset, group: _Group) -> Iterator[tuple[Shot, Instant, Sample]]:
    """Shot, instant and sample of each frame of a group."""
    for key, places in group.places.items():
        known = dataset.store.shot(key)
        for place, sample in zip(places, dataset.samples_of(key, places), strict=True):
            shot, instant = _taken(known, key, place, sample)
            yield shot.model_copy(update={"things": shot.things_at(instant)}), shot.instants[instant], sample


def _stored(dataset: Dataset, key: str) -> tuple[Shot | None, bytes]:
    """A shot (None if unknown), and a digest that is equal for all shots of one scene."""
    shot = dataset.store.shot(key)
    return shot, _alike(shot) if shot else b""


def _scene(known: Shot | None, alike: bytes, key: str, place: int, sample: Sample) -> object:
    """A value that is equal for frames that can share a file."""
    shot, instant = _taken(known, key, place, sample)
    return alike or _alike(shot), sample.sensor, shot.poses_at(instant), *_seen(shot, instant, sample)


def _taken(known: Shot | None, key: str, place: int, sample: Sample) -> tuple[Shot, int]:
    """The shot of a sample, with its rig reduced to the sample's sensor, and the sample's instant in it."""
    if known is None:
        return _lit_anyhow(key, sample), 0
    _, instant, number = next(islice(known.samples, place, None))
    sensor = known.rig.sensors[number]
    if len(known.rig.sensors) == 1:
        return known, instant
    zooms = sensor.intrinsics == known.rig.sensors[0].intrinsics
    lenses = (now.intrinsics if zooms else None for now in known.instants)
    poses = (compose(now.world_from_rig, sensor.rig_from_sensor) for now in known.instants)
    instants = tuple(
        now.model_copy(update={"world_from_rig": _plain(pose), "viewpoint": known.viewpoint(i, number), "intrinsics": lens})
        for i, (now, pose, lens) in enumerate(zip(known.instants, poses, lenses, strict=True))
    )
    return known.model_copy(update={"rig": Rig.single(sensor.intrinsics), "instants": instants}), instant


def _alike(shot: Shot) -> bytes:
    scene = shot.model_copy(update={"key": "", "first": 0, "instants": (), "channels": (), "files": Files()})
    return sha256(scene.model_dump_json().encode()).digest()


def _seen(shot: Shot, instant: int, sample: Sample) -> tuple[object, ...]:
    """The properties of a frame, besides the scene, that frames of one file share."""
    sees_sky = plugins.load(EngineSpec, ENGINE).shows_sky
    assert sees_sky is not None
    shows_sky = sees_sky(shot, shot.finish(instant))
    lens = sample.camera.intrinsics
    models = tuple(o.key for o in sample.objects)
    return models, shows_sky, lens.width, lens.height, lens.fx / lens.fy


def _lit_anyhow(key: str, sample: Sample) -> Shot:
    """A shot in the default light, for an imported frame with only its objects and camera known."""
    return Shot(
        key=key,
        things=tuple(Thing(id=o.id, model=_spec(o.key, ""), motion=Motion.still(_matrix(o))) for o in sample.objects),
        rig=Rig.single(sample.camera.intrinsics),
        scene=Scene(),
        instants=(_as_taken(sample),),
        channels=("rgb",),
    )


def _as_taken(sample: Sample) -> Instant:
    """An instant made from an imported sample's camera and pose."""
    camera = sample.camera
    a, b, c, d = ((x, y, z, w) for x, y, z, w in rigid(camera.R.T, camera.center).tolist())
    x, y, z = (camera.center + sample.pose.distance * camera.R[2]).tolist()
    return Instant(index=sample.index, world_from_rig=(a, b, c, d), focus=(x, y, z), viewpoint=sample.pose, split=sample.split)


def _matrix(o: ObjectAnnotation) -> Matrix4:
    return _plain(o.world_from_object)


def _plain(matrix: NDArray[np.float64]) -> Matrix4:
    a, b, c, d = ((x, y, z, w) for x, y, z, w in matrix.tolist())
    return a, b, c, d


def _spec(key: str, source: str) -> ModelSpec:
    """The specification of a normalised model file: in metres, with its own origin."""
    return ModelSpec(key=key, source=source, category="model", category_id=1, centring="as_is")


@dataclass(frozen=True, eq=False)
class StoredModels:
    """Normalised meshes. Objects use the data set's stored mesh by `keys` (the key of a model, and the key of its shown time
    step); scenery uses the mesh from its source.
    """

    dataset: Dataset
    keys: Mapping[tuple[ModelSpec, TimeStep | None], tuple[str, str]]

    @classmethod
    def for_sample(cls, dataset: Dataset, shot: Shot, sample: Sample) -> StoredModels:
        """Return the models that a sample of a shot shows."""
        there = {o.id: o for o in sample.objects}  # a sample of a sequence lacks objects that are not present
        shown = ((thing, there[thing.id]) for thing in shot.objects if thing.id in there)
        return cls(dataset, {(thing.model, thing.step): (o.track or o.key, o.key) for thing, o in shown})

    def __call__(self, spec: ModelSpec, step: TimeStep | None = None, /) -> Mesh:
        """The normalised mesh; raises StoreError for a model that the store has lost, ModelError for a file of scenery."""
        if (spec, step) not in self.keys:
            return load_normalised(spec, step=step)
        key, own = self.keys[spec, step]
        model = self.dataset.store.model_info(key)
        info = model and next((one for one in (model, *model.steps) if one.key == own), None)
        if info is None:
            raise StoreError(f"{self.dataset.root}: expected model {own!r} in the store, found none: render again")
        with here(self.dataset.path(info.glb).absolute()) as file:
            if info.node is None:
                return load_normalised(_spec(own, str(file)))
            return normalise(*load_model(file, node=info.node), _spec(own, str(file)))


FORMAT = FormatSpec(
    about=__doc__,
    holds=("the scene itself",),
    read_by=("Blender",),
    channels=(),
    keeps_all_objects=True,  # hidden objects are part of a scene, too
    names_credits=False,
    refuses=_refuses,
    check=_check,
    writer=_writer,
)
