"""Time steps: the animated models of a recipe, the frames of their files, and the poses at each."""

from __future__ import annotations

import hashlib
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate, chain, groupby, pairwise
from pathlib import Path
from typing import TYPE_CHECKING

from viewsphere.assets.animation.clip import Timeline, no_animation
from viewsphere.composing.viewpoints.poses import Poses, RepeatedPoses
from viewsphere.errors import ModelError, RecipeError, each
from viewsphere.files import written_path
from viewsphere.model.instant import Moment, Viewpoint
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.thing import TimeStep
from viewsphere.plugins.source import file_in
from viewsphere.recipe.cameras.time import Frames, Steps, chosen_frames
from viewsphere.recipe.models import ModelEntry
from viewsphere.recipe.recipe import Recipe

if TYPE_CHECKING:
    from viewsphere.assets.animation.timeline import Blenders


@dataclass(frozen=True)
class Step:
    """A time step of a data set: its time, the time step of the model's file, and the frame of the scene's file; the latter two
    are None without animation.
    """

    moment: Moment
    model: TimeStep | None = None
    scene: int | None = None


@dataclass(frozen=True)
class Timing:
    """The time steps of a model; each has all poses or, if `moving`, the pose of the same number."""

    steps: tuple[Step, ...]
    moving: bool = False


@dataclass(frozen=True)
class Run:
    """Poses [first, stop) of a model at one time step, given by its number; None without animation."""

    first: int
    stop: int
    number: int | None = None
    step: Step | None = None


@dataclass(frozen=True)
class TimedPoses(RepeatedPoses):
    """Poses at moments; the moment is the outer loop. Without moments (None), they are the poses themselves."""

    moments: tuple[Moment | None, ...]

    @property
    def digest(self) -> str:
        """SHA-256 of the moments, and of the content of a pose file."""
        return hashlib.sha256(repr((self.base.digest, self.moments)).encode()).hexdigest()

    @property
    def counts(self) -> dict[str, int]:
        """Number of moments, then the counts of the poses."""
        return {"time steps": len(self.moments), **self.base.counts}

    def base_number(self, index: int) -> int:
        """The number of the pose without its moment."""
        return index % len(self.base)

    def name(self, index: int) -> str:
        """The names of the pose and the moment."""
        moment = self._moment(index)
        name = self.base.name(self.base_number(index))
        return name if moment is None else f"{name} at frame {moment.frame}, {moment.seconds!r} s"

    def _pose(self, index: int) -> Viewpoint:
        return self.base[self.base_number(index)].model_copy(update={"index": index, "time": self._moment(index)})

    def _moment(self, index: int) -> Moment | None:
        return self.moments[index // len(self.base)]

    @cached_property
    def numbers(self) -> dict[Moment | None, int]:
        """The number of each moment."""
        return {moment: i for i, moment in enumerate(self.moments)}


def is_animated(recipe: Recipe) -> bool:
    """Return whether the recipe requests frames of any file."""
    return _scene_frames(recipe) is not None or any(entry.frames is not None for entry in recipe.models)


def timed(
    recipe: Recipe, models: Sequence[tuple[ModelSpec, int]], views: Poses
) -> tuple[tuple[ModelSpec, ...], tuple[Timing | None, ...], Poses]:
    """The models at their first frame, their time steps, and the poses at all moments; `models` are specifications with the
    number of their entry.

    Raises RecipeError, for all models together, for missing frames and for files without movement; also if the numbers of poses
    or of the scene's time steps differ where they must be equal.
    """
    if not is_animated(recipe):
        return tuple(spec for spec, _ in models), (None,) * len(models), views
    from viewsphere.assets.animation.timeline import Blenders  # which loads readers of models

    with Blenders.none_yet() as blenders:
        scene = tuple(_scene_steps(recipe, blenders))

        def moving(one: tuple[ModelSpec, int]) -> tuple[ModelSpec, Timing | None]:
            spec, number = one
            entry = recipe.models[number]
            if entry.frames is None:
                return spec, _timing(recipe, spec, entry, number, None, scene)
            line, steps = _model_steps(spec, entry, f"models[{number}]", blenders)
            return resting(spec, entry, line), _timing(recipe, spec, entry, number, steps, scene)

        made = each(moving, models)
    specs, timings = (spec for spec, _ in made), [timing for _, timing in made]
    for timing, (spec, number) in zip(timings, models, strict=True):
        if timing is not None and timing.moving and len(timing.steps) != len(views):
            where = f"models[{number}]" if recipe.models[number].frames is not None else "scene.blend"
            raise RecipeError(
                f"{where}.poses: expected as many poses as time steps, for moving; found {len(views):,} poses and "
                f"{len(timing.steps):,} time steps of {spec.key}: ask for others of either, or set poses: each"
            )
    moments = dict.fromkeys(step.moment for timing in timings if timing for step in timing.steps)
    still = (None,) if any(timing is None for timing in timings) else ()
    return tuple(specs), tuple(timings), TimedPoses(views.viewpoints, views.seed, views, (*still, *moments))


def _timing(
    recipe: Recipe,
    spec: ModelSpec,
    entry: ModelEntry,
    number: int,
    own: Sequence[tuple[int, Moment]] | None,
    scene: Sequence[tuple[int, Moment]],
) -> Timing | None:
    """A model's time steps: its own, or the scene's; if both move, their k-th steps go together."""
    if not scene:
        steps = tuple(Step(moment, _shown(moment)) for _, moment in own or ())
        return Timing(steps, entry.poses == "moving") if steps else None
    moving = _scene_poses(recipe) == "moving"
    if own is None:
        return Timing(tuple(Step(moment, None, frame) for frame, moment in scene), moving)
    if len(own) != len(scene):
        raise RecipeError(
            f"models[{number}].frames: expected as many time steps as scene.blend has, {len(scene)}; found {len(own)} "
            f"of {spec.key}"
        )
    pairs = zip(own, scene, strict=True)
    return Timing(tuple(Step(moment, _shown(shown), at) for (_, shown), (at, moment) in pairs), moving)


def resting(spec: ModelSpec, entry: ModelEntry, line: Timeline) -> ModelSpec:
    """An animated model at the first frame of the animation that its entry selects."""
    return spec.model_copy(update={"rest": line.first, "clip": entry.clip, "fps": entry.fps})


def _shown(moment: Moment) -> TimeStep:
    return TimeStep(frame=moment.frame, seconds=moment.seconds)


def _model_steps(
    spec: ModelSpec, entry: ModelEntry, where: str, blenders: Blenders
) -> tuple[Timeline, tuple[tuple[int, Moment], ...]]:
    assert entry.frames is not None
    return _steps(animated_file(spec, f"{where}.frames"), entry.confined, entry.frames, where, blenders, entry.clip, entry.fps)


def _scene_frames(recipe: Recipe) -> Frames | None:
    return getattr(recipe.scene.blend, "frames", None)


def _scene_poses(recipe: Recipe) -> Steps:
    return getattr(recipe.scene.blend, "poses", "each")


def _scene_steps(recipe: Recipe, blenders: Blenders) -> Iterator[tuple[int, Moment]]:
    frames, blend = _scene_frames(recipe), recipe.scene.blend
    if frames is not None and blend is not None:
        path = recipe.folder / written_path(blend.file)
        yield from _steps(path, blend.confined, frames, "scene.blend", blenders)[1]


def _steps(
    path: Path,
    confined: bool,
    frames: Frames,
    where: str,
    blenders: Blenders,
    clip: str | None = None,
    fps: float | None = None,
) -> tuple[Timeline, tuple[tuple[int, Moment], ...]]:
    """Return the file's timeline, and its requested frames with their moments."""
    line = animation(path, confined, clip, f"{where}.frames", blenders, fps)
    chosen = chosen_frames(frames, line.first, line.last)
    beyond = [frame for frame in chosen if not line.first <= frame <= line.last]
    if beyond or not chosen:
        found = f"{beyond[0]}" if beyond else "none of them"
        raise RecipeError(f"{where}.frames: expected frames of {line.first} to {line.last}, as {path} has; found {found}")
    return line, tuple((frame, Moment(frame=frame, seconds=line.seconds(frame))) for frame in chosen)


def animated_file(spec: ModelSpec, field: str) -> Path:
    """The file of a model that is to move; raises RecipeError, which begins with the field, for a source's model without
    animation.
    """
    try:
        file = file_in(spec)
    except OSError as error:
        raise RecipeError(
            f"{field}: {spec.source}: expected to write its file into the cache ({error}); set VIEWSPHERE_CACHE"
        ) from None
    if file is None:
        raise RecipeError(f"{field}: expected a file, or a model that moves; found {spec.source}, which does not move")
    return file


def animation(
    path: Path, confined: bool, clip: str | None, field: str, blenders: Blenders, fps: float | None = None
) -> Timeline:
    """Return the timeline of a file while this clip plays; None is the file's first clip.
    Raises RecipeError, which begins with the field, for an unreadable file, an unknown clip, and a file without movement.
    """
    try:
        line = blenders.timeline(path, confined, clip, fps)
    except ModelError as error:
        raise RecipeError(f"{field}: {error}") from None
    if not line.moves:
        raise RecipeError(f"{field}: {no_animation(path)}")
    return line


def at_step(timing: Timing | None, number: int | None) -> TimeStep | None:
    """The state of a model at the time step of this number.
    A model with fewer steps keeps its last step; a model without animation has None.
    """
    return None if timing is None or number is None else timing.steps[min(number, len(timing.steps) - 1)].model


@dataclass(frozen=True, eq=False)
class Schedule:
    """The poses of a model, in the order of its frames, divided by its time steps."""

    runs: tuple[Run, ...]

    @cached_property
    def count(self) -> int:
        """Number of poses."""
        return sum(run.stop - run.first for run in self.runs)

    @property
    def poses(self) -> Iterator[int]:
        """The indices of the poses, in order."""
        return chain.from_iterable(range(run.first, run.stop) for run in self.runs)

    def run_of(self, pose: int) -> Run:
        """The run that holds a pose (its index)."""
        return self.runs[self._number(pose)]

    def position(self, pose: int) -> int:
        """Return the number of poses before this one."""
        number = self._number(pose)
        return self._before[number] + pose - self.runs[number].first

    def together(self, poses: Sequence[int]) -> list[list[int]]:
        """The poses, divided where the time step changes."""
        return [list(group) for _, group in groupby(poses, self._number)]

    def chunks(self, most: int) -> tuple[tuple[int, int], ...]:
        """Poses [first, stop) of each shot, at most `most` each: sizes within a time step differ by one at most."""
        ranges: list[tuple[int, int]] = []
        for run in self.runs:
            count = run.stop - run.first
            parts = -(-count // most)
            edges = [run.first + i * count // parts for i in range(parts + 1)]
            ranges += pairwise(edges)
        return tuple(ranges)

    def _number(self, pose: int) -> int:
        number = self._order[bisect_right(self._firsts, pose) - 1]
        if not self.runs[number].first <= pose < self.runs[number].stop:
            raise IndexError(f"expected a pose of the model, got {pose}")
        return number

    @cached_property
    def _order(self) -> list[int]:
        return sorted(range(len(self.runs)), key=lambda i: self.runs[i].first)

    @cached_property
    def _firsts(self) -> list[int]:
        return [self.runs[i].first for i in self._order]

    @cached_property
    def _before(self) -> list[int]:
        return list(accumulate((run.stop - run.first for run in self.runs), initial=0))


def schedules(timings: Sequence[Timing | None], views: Poses) -> tuple[Schedule, ...]:
    """The schedule of each model; models that share their time steps share it."""
    known: dict[Timing | None, Schedule] = {}
    for timing in timings:
        if timing not in known:
            known[timing] = Schedule(_runs_of(timing, views))
    return tuple(known[timing] for timing in timings)


def _runs_of(timing: Timing | None, views: Poses) -> tuple[Run, ...]:
    if not isinstance(views, TimedPoses):
        return (Run(0, len(views)),)
    count = len(views.base)
    if timing is None:
        first = views.numbers[None] * count
        return (Run(first, first + count),)
    runs: list[Run] = []
    for k, step in enumerate(timing.steps):
        first = views.numbers[step.moment] * count
        runs.append(Run(first + k, first + k + 1, k, step) if timing.moving else Run(first, first + count, k, step))
    return tuple(runs)


def check_keys(keys: Iterable[tuple[str, ModelSpec]]) -> None:
    """Raise RecipeError if a time step of one model has the key of another model; `keys` are all, with their models."""
    seen: dict[str, ModelSpec] = {}
    for key, spec in keys:
        if seen.setdefault(key.casefold(), spec).key != spec.key:
            raise RecipeError(f"models: expected every key once; found {key!r} twice: give an entry another name")
