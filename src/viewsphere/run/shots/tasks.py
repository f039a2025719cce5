"""The two main tasks of a run: to normalise and export a model, and to render a shot."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from viewsphere import plugins
from viewsphere.kernels.build import PAINTER
from viewsphere.kernels.garbage import importing
from viewsphere.model.credit import Credit
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.sample import Sample
from viewsphere.model.shot import Shot
from viewsphere.model.thing import TimeStep
from viewsphere.planning.extension import DatasetPart
from viewsphere.plugins.engine import EngineSpec
from viewsphere.run.shots.composing import Composer
from viewsphere.run.shots.models import Models
from viewsphere.run.shots.precompile import compile_kernels
from viewsphere.run.shots.stages import Stages, StoredBoxes
from viewsphere.run.workers.allocator import release_freed_memory
from viewsphere.store import Row, Store

Kind = Literal["model", "same model", "damaged model"]


@dataclass(frozen=True)
class ModelTask:
    """A model, with its time steps if it deforms, and its credit. A "same model" has to match the store's, if that exists; a
    remade "damaged model" replaces the stored one.
    """

    kind: Kind
    spec: ModelSpec
    steps: tuple[TimeStep, ...] = ()
    credit: Credit | None = None


@dataclass(frozen=True)
class Damaged:
    """An existing shot that has to be remade."""

    row: Row


@dataclass(frozen=True)
class KernelTask:
    """The kernels of a shot, to be compiled before other tasks need them."""

    shot: Shot


class Worker:
    """Does tasks for a part of a data set."""

    def __init__(self, root: Path, portion: DatasetPart) -> None:
        self.store = Store(root)
        self.stages = Stages()
        self.models = Models(self.store, self.stages, portion.record)
        self._portion = portion.remembering(self.store)
        self._boxes = StoredBoxes(self.store)
        self.composer = Composer(self._portion, self._boxes, self.stages)

    def do(self, task: ModelTask | KernelTask | Row | Damaged, tell: Callable[[int], None]) -> int:
        """Make models, kernels, or the shot of a row; returns the number of frames made. `tell` receives the number
        so far after each frame.
        """
        if isinstance(task, Row):
            return self.make_shot(task, tell)
        if isinstance(task, Damaged):
            return self.make_shot(task.row, tell, again=True)
        if isinstance(task, KernelTask):
            compile_kernels(task.shot)
            return 0
        if task.kind == "damaged model":
            self.models.mend(task.spec, task.steps, task.credit)
        else:
            self.models.make(task.spec, task.steps, task.credit, trusted=task.kind == "model")
        return 0

    def compile_for(self, row: Row) -> None:
        """Compile the kernels that the shot of a row needs, if this machine lacks them."""
        with self._portion.plan.recipe.located():
            compile_kernels(self._portion.shot(row, self._boxes))

    def make_shot(self, row: Row, tell: Callable[[int], None], again: bool = False) -> int:
        """Make the shot of a row and render it into the store; returns the number of its frames; `tell` receives the number
        so far after each. With `again`, it replaces a damaged shot and raises errors as `Store.scratch_folder`.
        """
        shot = self.composer.shot(row)
        with importing():
            plugins.load(EngineSpec, shot.engine)
        samples = _counted(self.stages.render(shot), tell)
        scenery = self.composer.scenery(shot)
        return self.store.write_shot(shot.key, samples, scenery, shot.files, shot, again, PAINTER)


def _counted(samples: Iterable[Sample], tell: Callable[[int], None]) -> Iterator[Sample]:
    """The samples. `tell` receives their number so far at the request for the next one, when the previous one is written."""
    for number, sample in enumerate(samples, 1):
        yield sample
        tell(number)
        if number == 1:  # the stage is complete
            release_freed_memory()
