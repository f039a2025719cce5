"""The rendering of a data set's part: its skies checked, its models made, its shots rendered by a pool of workers."""

from __future__ import annotations

import json
from collections.abc import Callable, Container, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from viewsphere.errors import ModelError, RecipeError, ViewsphereError, WorkerDied, joined
from viewsphere.planning.distances import Distances
from viewsphere.planning.extension import DatasetPart
from viewsphere.plugins.source import from_set
from viewsphere.rendering.sky.environment_file import environment_notes
from viewsphere.run.executors import Job, Listed, Outcome, Work, WorkerPool
from viewsphere.run.missing import Missing
from viewsphere.run.opening import commit
from viewsphere.run.progress import Listener, Progress
from viewsphere.run.shots.camera_collisions import CameraChecks
from viewsphere.run.shots.precompile import is_compiled, precompile, told_to
from viewsphere.run.shots.stages import Stages, StoredBoxes
from viewsphere.run.shots.tasks import KernelTask, Kind, ModelTask
from viewsphere.store import Store
from viewsphere.store.shots.heartbeat import HeartbeatWriter

MOST_SUBJECTS = 10_000
"""Number of models or scenes, evenly over all, whose cameras are checked before rendering; the rest are checked in their turn.
"""

MOST_SKIES = 64
"""Number of files decoded before rendering, in half a second each of 4,096 x 2,048 texels; the rest are decoded in their turn.
"""


def check_skies(work: Missing, tell: Listener) -> tuple[str, ...]:
    """Decode the skies' pictures once, if any shot is left to render; returns the repairs that they needed.

    Raises RecipeError for the first picture that is damaged, truncated, black, or mostly NaN.
    """
    if next(work.rows(), None) is None:
        return ()
    pictures = work.portion.plan.pictures
    files = dict.fromkeys(file for (kind, _), files in pictures.items() if kind == "hdri" for file in files)
    chosen = list(files)[:: -(-len(files) // MOST_SKIES) or 1]
    notes: list[str] = []
    for done, file in enumerate(chosen):
        tell(Progress("skies", done, len(chosen)))
        notes += environment_notes(Path(file))
        tell(Progress("skies", done + 1, len(chosen)))
    return tuple(notes)


def render_part(
    work: Missing, pool: WorkerPool, keep_going: bool, tell: Listener, pulse: HeartbeatWriter
) -> tuple[int, dict[str, str]]:
    """Make the part's models, add the part to the data set and render its shots; returns the rendered frames, and the left
    out models and shots.
    """
    portion, store = work.portion, work.store
    if portion.number:
        store.drop_unnamed_models()  # from an append that stopped before its part was added
    try:
        work.skipped.update(_prepare_models(portion, store, pool, keep_going, tell))
        commit(portion, store)
    except ViewsphereError:
        if portion.number:
            store.drop_unnamed_models()
        raise
    _note_skipped(portion, store, work.skipped)  # for those who watch the run
    rendered = _render_shots(work, pool, keep_going, tell, pulse)
    _note_skipped(portion, store, work.skipped)
    return rendered, work.skipped


def _prepare_models(portion: DatasetPart, store: Store, pool: WorkerPool, keep_going: bool, tell: Listener) -> dict[str, str]:
    """Normalise and export every model; returns the keys left out, with the reasons. Of sets of thousands of models a few are
    always damaged, so that those are left out without `keep_going`, too.
    """
    planned = portion.plan
    jobs = _model_jobs("same model" if portion.number else "model", portion)
    total = len(jobs.all)
    failed: dict[str, ViewsphereError] = {}
    tell(Progress("models", 0, total))
    for done, outcome in enumerate(pool.run(jobs), 1):
        if outcome.error is not None:
            failed[outcome.key] = outcome.error
        tell(Progress("models", done, total))
    for key, problem in _distance_problems(portion, store, failed):
        failed.setdefault(key, problem)
    own = {m.key for m in planned.model_specs} | set(planned.varied_subjects)
    may_fail = own if keep_going else {m.key for m in planned.model_specs if from_set(m.source)}
    stops = [e for k, e in failed.items() if not (k in may_fail and isinstance(e, (ModelError, RecipeError)))]
    elsewhere = {} if portion.shard.is_all else store.skipped()
    if stops or (failed and own <= failed.keys() | elsewhere.keys()):
        raise joined(stops or list(failed.values()))
    return {key: str(error) for key, error in failed.items()}


def _model_jobs(kind: Kind, portion: DatasetPart) -> Listed:
    """A job for each model, with its time steps and its credit."""
    credit_of = portion.plan.credits.get
    tasks = (ModelTask(kind, spec, steps, credit_of(spec.key)) for spec, steps in portion.models)
    return Listed(tuple(Job(task.spec.key, task.spec.key, task) for task in tasks))


def compare_models(portion: DatasetPart, store: Store, pool: WorkerPool) -> None:
    """Raise StoreError if a model no longer matches the one in the data set."""
    held = (job for job in _model_jobs("same model", portion).all if store.model_info(job.key) is not None)
    errors = [outcome.error for outcome in pool.run(Listed(tuple(held))) if outcome.error]
    if errors:
        raise joined(errors)


def _distance_problems(portion: DatasetPart, store: Store, failed: Container[str]) -> Iterator[tuple[str, ViewsphereError]]:
    """Models or scenes with a pose's camera inside them, or without enough room; each is named once."""
    distances, subjects = Distances(portion.plan, StoredBoxes(store)), portion.subjects
    for subject in subjects[:: -(-len(subjects) // MOST_SUBJECTS) or 1]:
        if any(member.key in failed for member in portion.plan.cast(subject)):
            continue
        try:
            problem = distances.problem(subject)
        except RecipeError as error:
            problem = error
        if problem:
            yield subject, problem


def _render_shots(work: Missing, pool: WorkerPool, keep_going: bool, tell: Listener, pulse: HeartbeatWriter) -> int:
    """Render the shots that the store lacks; returns the number of frames made. Failed shots are added to those left out."""
    portion, store, skipped = work.portion, work.store, work.skipped
    total, resumed, rendered = work.total, work.resumed, 0
    first = next(work.rows(), None)
    if first is not None:
        CameraChecks(Stages()).check_scenery(portion.plan)
        with portion.plan.recipe.located():
            shot = portion.shot(first, StoredBoxes(store))
        if not is_compiled(shot):
            precompile(shot, told_to(tell))
            for outcome in pool.run(Listed((Job("kernels", first.subject, KernelTask(shot)),))):
                _accept(outcome, False, skipped)

    def report() -> None:
        tell(Progress("frames", resumed + rendered, total, resumed, pool.under_way, pool.nodes))

    report()
    lost: list[ViewsphereError] = []
    for outcome in _watched(pool, work, pulse, report) if first is not None else ():
        if isinstance(outcome.error, WorkerDied) and not keep_going:
            lost.append(outcome.error)  # the other shots are still made
        else:
            _accept(outcome, keep_going, skipped)
            if outcome.error is not None and len(skipped).bit_count() == 1:  # the list is not written for each of thousands
                _note_skipped(portion, store, skipped)
        rendered += outcome.frames
        report()
    if lost:
        raise joined(lost)
    return rendered


def _accept(outcome: Outcome, keep_going: bool, skipped: dict[str, str]) -> None:
    if outcome.error is None:
        return
    if not (keep_going and isinstance(outcome.error, ModelError | WorkerDied)):
        raise outcome.error
    skipped[outcome.key] = str(outcome.error)


def _note_skipped(portion: DatasetPart, store: Store, skipped: dict[str, str]) -> None:
    """Store the left out models and shots, together with those of other parts and shards."""
    own = {spec.key for spec, _ in portion.models} | set(portion.subjects)
    with store.locked():
        others = {key: why for key, why in store.skipped().items() if key not in own and portion.find(key) is None}
        others = others if portion.number or not portion.shard.is_all else {}
        store.write_file("skipped.json", json.dumps(others | skipped, indent=1, sort_keys=True))


def tee(pulse: HeartbeatWriter, listener: Listener) -> Listener:
    """A listener that passes progress on to the heartbeat, then to another listener."""

    def listen(progress: Progress) -> None:
        pulse.enters(progress.phase)
        counts = {"done": progress.done, "total": progress.total, "resumed": progress.resumed}
        pulse.now = replace(pulse.now, **counts, under_way=progress.under_way)
        listener(progress)

    return listen


def _watched(pool: WorkerPool, work: Work, pulse: HeartbeatWriter, report: Callable[[], None]) -> Iterator[Outcome]:
    """Yield the outcomes of `pool.run`; meanwhile the heartbeat reports jobs that are handed out but not done."""
    for outcome in pool.run(_NotedWork(work, pulse.working_on), report):
        pulse.working_on.pop(outcome.key, None)
        yield outcome


@dataclass(frozen=True)
class _NotedWork:
    """Work whose jobs are noted when they are handed out."""

    work: Work
    working_on: dict[str, None]

    def lines(self) -> Iterable[tuple[str, int]]:
        """Return the lines of the work."""
        return self.work.lines()

    def jobs(self, line: str) -> Iterator[Job]:
        """Yield the jobs of a line of the work."""
        for job in self.work.jobs(line):
            self.working_on[job.key] = None
            yield job
