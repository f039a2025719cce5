"""The compilation of a shot's kernels before workers start, which then find them in the cache."""

from __future__ import annotations

import hashlib
import json
import math
import os
import sys
from collections.abc import Generator, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from pydantic import JsonValue

from viewsphere import plugins
from viewsphere.assets.mesh import Image, Material, Mesh, Texture
from viewsphere.composing.viewpoints.camera import looking
from viewsphere.errors import UserError
from viewsphere.geometry.box3d import Box3d
from viewsphere.kernels import entries
from viewsphere.kernels.digests import package_digest
from viewsphere.kernels.garbage import pause_collection
from viewsphere.kernels.overloads import needed, table
from viewsphere.kernels.precompile import Told, compile_all
from viewsphere.labels import channels
from viewsphere.model.annotations.metadata import ModelMetadata
from viewsphere.model.annotations.tracks import Tracks
from viewsphere.model.instant import Instant, Viewpoint
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import IDENTITY, Matrix4
from viewsphere.model.sensors.exposure import Exposure, Sweep
from viewsphere.model.sensors.rig import Rig, Sensor
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Motion, Thing, TimeStep
from viewsphere.planning.engine_digest import engine_digest
from viewsphere.plugins.engine import EngineSpec
from viewsphere.recipe.recipe import Recipe
from viewsphere.run.opening import prepare
from viewsphere.run.progress import Listener, Progress
from viewsphere.run.shots.stages import render_sample
from viewsphere.store import encode
from viewsphere.truth.shot_views import ShotViews

SIZE = 16
BESIDE: Matrix4 = ((1.0, 0.0, 0.0, 0.1), *IDENTITY[1:])
FLOOR: Matrix4 = ((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, -1.0, 0.0, -1.0), IDENTITY[3])
ROOF: Matrix4 = ((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, -1.0, 0.0), (0.0, 1.0, 0.0, 1.0), IDENTITY[3])
MARKS = "marks"
"""The folder for lists of kernels."""

PACKAGE = Path(plugins.__file__).parent.parent


def precompile(shot: Shot, tell: Told) -> None:
    """Compile on all cores the kernels that a shot's frames call, unless they are compiled. `tell` receives the number of
    compiled kernels and the total. Kernels that the table lacks are compiled when they are called.
    """
    if is_compiled(shot):
        return
    with _alone(entries.kernel_folder()):
        done = _compiled_before()
        waiting = [overload for overload in needed(features(shot)) if overload.name not in done]
        if waiting and not is_compiled(shot):
            compile_all(waiting, tell)
            done |= {overload.name for overload in waiting}
            entries.save(_list_of("compiled"), "\n".join(sorted(done)).encode())


def precompile_for(recipe: Recipe, tell: Told) -> None:
    """`precompile` for the first shot of a recipe, without reading models. Does nothing for a recipe with errors, which the
    reader of the recipe reports.
    """
    mark = _list_of(recipe.digest[:16])
    if has_all() or entries.load(mark) is not None:
        return
    with suppress(UserError), recipe.located():
        precompile(sketched(recipe), tell)
        entries.save(mark, b"")


def sketched(recipe: Recipe) -> Shot:
    """The first shot of a recipe as if all models were one metre large. It calls the same kernels and needs no model files."""
    return next(iter(prepare(recipe).shots(lambda key, step=None: Box3d.between((-0.5,) * 3, (0.5,) * 3).corners)))


def told_to(listener: Listener) -> Told:
    """A function that passes the progress of compilation to a run's listener."""
    return lambda done, total: listener(Progress("kernels", done, total))


def compile_table(tell: Told) -> int:
    """Compile the whole table, as for a wheel, and note that nothing is left to compile; returns the number of kernels that
    failed to compile.
    """
    left = len(table()) - len(compile_all(table(), tell))
    if not left:
        entries.save(_list_of("all"), b"")
    return left


def is_precompiled(shot: Shot) -> bool:
    """True if the kernels that a shot's frames call are compiled, as far as the table lists them."""
    known = {overload.name for overload in needed(features(shot))}
    return is_compiled(shot) or (bool(known) and known <= _compiled_before())


def _compiled_before() -> set[str]:
    listed = entries.load(_list_of("compiled"))
    return set() if listed is None else set(listed.decode().splitlines())


def _list_of(what: str) -> str:
    """The cache entry for a list that is valid for this state of viewsphere and this build."""
    return f"{MARKS}/{what}-{package_digest(PACKAGE)[:16]}{entries.SUFFIX}"


def compile_kernels(shot: Shot) -> None:
    """Compile the kernels that a shot needs, if they are not compiled.

    The first time on a machine this takes one process about 20 CPU-seconds; other processes wait. It leaves a mark beside the
    kernels: the list of their cache entries. Later calls load nothing, as long as these entries exist and viewsphere, numba,
    Python, the processor and the shot's features (with values of similar magnitude) are the same.
    """
    if is_compiled(shot):
        return
    small = _small(shot)
    mark = _mark(small)
    with _alone(entries.kernel_folder()):
        if _is_true(mark):
            return
        _render(small)
        entries.save(mark, "\n".join(sorted(_names())).encode())


def _names() -> set[str]:
    """The entries of all kernels that this process has loaded or compiled."""
    from numba.extending import is_jitted  # slow to load; a process that renders has it loaded

    modules = [vars(module) for module in list(sys.modules.values()) if isinstance(module, ModuleType)]
    kernels = (value for names in modules for value in list(names.values()) if is_jitted(value))
    return {name for kernel in kernels for name in getattr(getattr(kernel, "_cache", None), "names", ())}


@contextmanager
def _alone(folder: Path) -> Generator[None]:
    """Lock a folder against other processes for the duration of the block, if the system supports locks of folders."""
    descriptor = -1
    with suppress(ImportError, OSError):
        import fcntl

        folder.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(folder, os.O_RDONLY)
        fcntl.flock(descriptor, fcntl.LOCK_EX)
    try:
        yield
    finally:
        if descriptor >= 0:
            os.close(descriptor)


def is_compiled(shot: Shot) -> bool:
    """True if the kernels that a shot needs are compiled; loads none. Wheels include all kernels."""
    return has_all() or _is_true(_mark(_small(shot)))


def has_all() -> bool:
    """True if all kernels are compiled for this state of viewsphere: they come with wheels or from `compile_table`."""
    return entries.load(_list_of("all")) is not None


def load_kernels(shot: Shot) -> None:
    """Render one tiny frame of two cards (plus two for a place) with the shot's engine, channels, scene and lens; the picture
    is discarded.
    """
    _render(_small(shot))


def _small(shot: Shot) -> Shot:
    tiny = {"width": SIZE, "height": SIZE, "fx": SIZE, "fy": SIZE, "cx": SIZE / 2, "cy": SIZE / 2, "skew": 0.0}
    kinds = dict.fromkeys((sensor.intrinsics.model_copy(update=tiny), sensor.lidar) for sensor in shot.rig.sensors)
    sensors = [Sensor(name=f"{i}", intrinsics=lens, lidar=lidar) for i, (lens, lidar) in enumerate(kinds)]
    if len(shot.rig.sensors) > 1:
        sensors.append(Sensor(name="beside", intrinsics=sensors[0].intrinsics, rig_from_sensor=BESIDE))
    spec = ModelSpec(key="card", source="card", category="card", category_id=1)
    things = tuple(Thing(id=i, model=spec) for i in (1, 2))
    if any(thing.scenery for thing in shot.things):  # a place is a floor and a roof
        level = (Motion.still(pose) for pose in (FLOOR, ROOF))
        things += tuple(Thing(id=0, model=spec, motion=motion, scenery=True) for motion in level)
    above = Viewpoint(index=0, azimuth_deg=0, elevation_deg=20, distance=2)
    first = looking(above, (0.0, 0.0, 0.0), index=0, finish=shot.finish(0))
    alike = {"key": "", "first": 0, "sequence": "", "rig": Rig(sensors=tuple(sensors)), "labels": {}}
    shown = {"things": things, "instants": (first,)} | (_sequence(shot, first, things) if shot.sequence else {})
    return shot.model_copy(update=alike | shown)


def _sequence(shot: Shot, first: Instant, things: tuple[Thing, ...]) -> dict[str, Any]:
    """Two instants between which one of the things moves, with blur if the shutter is open, and in rows if it rolls."""
    there_and_back = Motion(poses=(IDENTITY, BESIDE))
    moved = things[0].model_copy(update={"motion": there_and_back})
    sweeps = (Sweep(moments=(-0.5, 0.5), motion=there_and_back), *[None] * (len(things) - 1))
    readout = next((lens.rolling.readout for lens in (one.intrinsics for one in shot.rig.sensors) if lens.rolling), None)
    exposures = (Exposure(things=sweeps, interval=readout),) * 2 if shot.shutter or readout else ()
    tracks = shot.tracks and Tracks(at=(0,), count=4, on="objects")
    instants = (first, first.model_copy(update={"index": 1, "seconds": 1.0}))
    return {"sequence": "tiny", "things": (moved, *things[1:]), "instants": instants, "tracks": tracks, "exposures": exposures}


def _mark(small: Shot) -> str:
    """The cache entry that marks this shot's kernels as compiled; its name depends on their sources and on the shot's
    features.
    """
    scene = _outline(small.model_dump(mode="json", exclude={"engine_options"}))
    used = json.dumps([scene, small.engine_options], sort_keys=True)
    engine = engine_digest(small.engine)
    named = hashlib.sha256("\0".join((package_digest(PACKAGE), engine, used)).encode()).hexdigest()[:16]
    return f"{MARKS}/{named}{entries.SUFFIX}"


def _is_true(mark: str) -> bool:
    """True if the kernels in the mark's list exist."""
    listed = entries.load(mark)
    return listed is not None and all(map(entries.has, listed.decode().splitlines()))


def _outline(value: JsonValue) -> JsonValue:
    """The value with each number reduced to its sign and power of ten, which show the features in use."""
    if isinstance(value, dict):
        return {name: _outline(part) for name, part in value.items()}
    if isinstance(value, list):
        return [_outline(part) for part in value]
    if isinstance(value, int | float) and value and not isinstance(value, bool):
        return [value > 0, math.floor(math.log10(abs(value)))]
    return value


def features(shot: Shot) -> frozenset[str]:
    """Features of a shot that decide which kernels its frames call: the paths of its fields, with values that are words, and
    the engine's options.
    """
    small = _small(shot)
    told = small.model_dump(mode="json", exclude={"engine_options"})
    options = (f"engine_options.{name}={value}" for name, value in sorted(small.engine_options.items()))
    return frozenset((*_paths("", told), *options))


def _paths(path: str, value: JsonValue) -> Iterator[str]:
    if isinstance(value, dict):
        for name, part in value.items():
            yield from _paths(f"{path}.{name}" if path else name, part)
    elif isinstance(value, list):
        for part in value:
            yield from _paths(f"{path}[]", part)
    elif isinstance(value, str):
        yield f"{path}={value}"
    elif value:
        yield path


@pause_collection()
def _render(shot: Shot) -> None:
    card = _card()
    engine = plugins.load(EngineSpec, shot.engine)

    def load(spec: ModelSpec, step: TimeStep | None = None, /) -> Mesh:
        return card

    stage = engine.staged(shot, load)
    boxes = [Box3d.between(*card.bounds).corners] * len(shot.objects)
    views = ShotViews(shot, stage.at, lambda thing: card)
    for number in shot.samples:
        sample = render_sample(views, number, stage, boxes, [None] * len(boxes), [lambda: ModelMetadata(1.0)] * len(boxes))
        for name, array in sample.channels.items():
            encode(channels()[name], array, shot.files)


def _card() -> Mesh:
    """A card with a hole: textured, cut out, coloured by vertex."""
    corners = np.array([[-0.5, 0, -0.5], [0.5, 0, -0.5], [0.5, 0, 0.5], [-0.5, 0, 0.5]], np.float32)
    uv = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)
    pixels = np.full((4, 4, 4), 255, np.uint8)
    pixels[1:3, 1:3, 3] = 0
    # The floor of a place is such a card; its mirror image is drawn where light bounces.
    mirror = Material(base_color_texture=Texture(0), alpha_mode="MASK", roughness=0.05)
    return Mesh(
        vertices=corners,
        triangles=np.array([[0, 1, 2], [0, 2, 3]], np.int32),
        normals=np.tile(np.array([0, -1, 0], np.float32), (4, 1)),
        triangle_material=np.zeros(2, np.int32),
        triangle_part=np.zeros(2, np.int32),
        materials=(mirror,),
        uv0=uv,
        colors=np.ones((4, 4), np.float32),
        images=(Image("card", pixels),),
    )
