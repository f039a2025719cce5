"""An estimate of the cost of a recipe's data set, measured on a few of its frames in a temporary folder.

    seconds = (models x model + scenes x scene + frames x frame) / workers + frames x export
    bytes   = models x model + frames x frame

A scene is built once for each model or random scene (by every worker, if there are fewer). If the recipe draws a scene for
each frame, the scene is built for each frame. Exports are written by one process. Not counted: starting the workers, and
compiling kernels.
"""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.thing import TimeStep
from viewsphere.planning.extension import DatasetPart
from viewsphere.planning.plan import Plan
from viewsphere.plugins.source import model_for
from viewsphere.recipe.formats import FormatEntry
from viewsphere.recipe.recipe import Recipe
from viewsphere.run.exports.exporting import write
from viewsphere.run.exports.unused import Unused, unused
from viewsphere.run.memory import render
from viewsphere.run.opening import prepare, to_render
from viewsphere.run.shots.precompile import is_precompiled, load_kernels, sketched
from viewsphere.run.shots.tasks import Worker
from viewsphere.scratch import temporary
from viewsphere.store import Dataset, Row, Store

REFERENCE_MS = 63.0
"""CPU milliseconds of a frame on the idle machine of docs/performance.md, an AMD EPYC: the largest of five measurements, 59 to
63, in 2026-11.
"""

SPEED_S = 1.0
"""Seconds after which no frame is started. With imports and the first frame, the command then takes less than three."""


SUBJECTS = 3
SHOTS_OF_EACH = 4
SHOT_FRAMES = 2
BLOCK = 4096
"""Allocation unit of most file systems, bytes."""

GOLDEN = 0.6180339887498949
"""The golden ratio less 1: multiples of it, modulo 1, are evenly spread over the shots."""


@dataclass(frozen=True)
class Rates:
    """Seconds of one process and bytes on disk for a model (or each time step of a deforming model), a scene, a frame, and the
    exports of a frame. Also the channels that no format uses but that take much of the bytes.
    """

    model: float
    scene: float
    frame: float
    export: float
    model_bytes: float
    frame_bytes: float  # exports included
    unused: Unused | None = None


@dataclass(frozen=True)
class Estimate:
    """Seconds and bytes for rendering a recipe into an empty folder with a number of worker processes. Also the channels that
    no format uses but that take much of the bytes.
    """

    seconds: float
    bytes: float
    workers: int
    unused: Unused | None = None


def estimate(recipe: Recipe, workers: int = 1, clock: Callable[[], float] = time.perf_counter) -> Estimate:
    """Time and disk space for a whole data set, from at most 24 frames of three of its models or scenes, spread over the poses.

    Takes a few seconds. Raises UserError for everything that `generate` would also refuse, such as an unusable model.
    """
    return extrapolate(prepare(recipe), measure(recipe, clock), workers)


def extrapolate(planned: Plan, rates: Rates, workers: int) -> Estimate:
    """The cost of a whole plan; 0 workers count as one, because the calling process then does the work."""
    crew, models = max(workers, 1), sum(max(1, len(planned.steps_of(spec))) for spec in planned.kept_specs)
    scenes = len(planned.varied_subjects)
    scenes = planned.frames if planned.recipe.is_new_each_frame else max(scenes, min(crew, planned.shot_count))
    shared = models * rates.model + scenes * rates.scene + planned.frames * rates.frame
    seconds = shared / crew + planned.frames * rates.export
    return Estimate(seconds, models * rates.model_bytes + planned.frames * rates.frame_bytes, crew, rates.unused)


def measure(recipe: Recipe, clock: Callable[[], float] = time.perf_counter) -> Rates:
    """Make a few frames as a run would, including exports, in a temporary folder; `clock` returns seconds."""
    planned = prepare(recipe.model_copy(update={"shot_frames": SHOT_FRAMES}))
    with temporary("estimate") as folder, recipe.located():
        return _measure_in(planned, Store(folder / "out"), _Stopwatch(clock))


def _measure_in(planned: Plan, store: Store, stopwatch: _Stopwatch) -> Rates:
    portion = to_render(planned, store)
    store.open_for(portion.record)
    rows = list(_spread(planned))
    specs = {spec.key: spec for row in rows for spec in portion.cast(row)}.values()
    shown = [(spec, _shown(planned, spec, rows)) for spec in specs]
    made = sum(max(1, len(steps)) for _, steps in shown)
    model = stopwatch.mean([_model_work(store, portion, *one) for one in shown]) * len(shown) / made
    worker = Worker(store.root, portion)  # a new one: in a run, the worker that renders models has seldom made them
    shots = [worker.composer.shot(row) for row in rows]
    load_kernels(shots[0])
    begun = frame = 0.0
    for row, shot in zip(rows, shots, strict=True):
        begun += stopwatch(lambda shot=shot: next(worker.stages.render(shot)))
        frame += stopwatch(lambda row=row: worker.make_shot(row, lambda _: None))
    frames = sum(len(shot.instants) * len(shot.rig.sensors) for shot in shots)
    frame /= frames
    scenes = len({shot.stage_key for shot in shots})
    scene = max(begun - len(shots) * frame, 0.0) / scenes  # additional time of a first frame
    export = _export(store, planned.recipe.formats, stopwatch)
    model_bytes = disk_bytes([store.folder / "models"])
    outputs = [store.folder / "models", store.folder / "shots", *(store.root / entry.name for entry in planned.recipe.formats)]
    frame_bytes = (disk_bytes(outputs) - model_bytes) / frames
    left = unused(store, planned.recipe.formats)
    return Rates(model, scene, frame, export / frames, model_bytes / made, frame_bytes, left)


def _shown(planned: Plan, spec: ModelSpec, rows: Sequence[Row]) -> tuple[TimeStep, ...]:
    """The time steps of a model in the shots."""
    steps, moments = planned.steps_of(spec), (planned.pose_list[row.positions[0][0]].time for row in rows)
    shown = {moment.frame for moment in moments if moment is not None}
    return tuple(step for step in steps if step.frame in shown) or steps


def _model_work(store: Store, portion: DatasetPart, spec: ModelSpec, steps: Sequence[TimeStep]) -> Callable[[], object]:
    return lambda: Worker(store.root, portion).models.make(spec, steps)


def _export(store: Store, formats: Sequence[FormatEntry], stopwatch: _Stopwatch) -> float:
    """Write the formats; returns the seconds that this took, without the search for frames in the whole plan."""
    dataset = Dataset(store.root)
    assert len(dataset) > 0
    written = [(entry, store.root / entry.name) for entry in formats]
    for _, folder in written:
        folder.mkdir()
    return stopwatch(lambda: write(dataset, written))


def _spread(planned: Plan) -> Iterator[Row]:
    """Some shots of subjects spread evenly over the plan; together they are spread evenly over the poses."""
    count = min(SUBJECTS, len(planned.varied_subjects))
    for i in range(count):
        subject = planned.varied_subjects[i * (len(planned.varied_subjects) - 1) // max(count - 1, 1)]
        shots = planned.rows.count_of(subject)
        parts = {int((i * SHOTS_OF_EACH + k + 1) * GOLDEN % 1 * shots) for k in range(SHOTS_OF_EACH)}
        yield from (planned.rows.row_of(subject, part) for part in sorted(parts))


def disk_bytes(folders: Sequence[Path]) -> int:
    """Return the disk space of the files in these folders, bytes in whole blocks; hard-linked files count once."""
    sizes = {(s.st_dev, s.st_ino): s.st_size for s in _stats(folders)}
    return sum(-(-size // BLOCK) * BLOCK for size in sizes.values())


def _stats(folders: Sequence[Path]) -> Iterator[os.stat_result]:
    return (path.stat() for folder in folders for path in folder.rglob("*") if path.is_file())


@dataclass(frozen=True)
class _Stopwatch:
    """Measures seconds."""

    clock: Callable[[], float]

    def __call__(self, work: Callable[[], object]) -> float:
        begun = self.clock()
        work()
        return self.clock() - begun

    def mean(self, works: Sequence[Callable[[], object]]) -> float:
        return sum(map(self, works)) / len(works)


@dataclass(frozen=True)
class _Speed:
    """CPU milliseconds of a frame, and the speed of this machine relative to the reference."""

    frame_ms: float
    relative: float


def speed_recipe() -> Recipe:
    """The scene that `measure_speed` renders."""
    viewpoints = {"azimuth": {"start": 0, "stop": 345, "step": 15}, "elevation": [20], "distance": 4}
    models = [{"source": model_for("example")}]
    return Recipe.model_validate({"models": models, "viewpoints": viewpoints, "camera": {"size": [640, 480]}})


def measure_speed() -> _Speed | None:
    """The median over some frames without the first one; None if kernels would have to be compiled."""
    recipe = speed_recipe()
    if not is_precompiled(sketched(recipe)):
        return None
    begun, before, spent = time.monotonic(), 0.0, list[float]()
    for number, _ in enumerate(render(recipe)):
        now = time.process_time()
        if number:
            spent.append(now - before)
        if number > 1 and time.monotonic() > begun + SPEED_S:
            break
        before = now
    frame_ms = 1000 * statistics.median(spent)
    return _Speed(frame_ms, REFERENCE_MS / frame_ms)
