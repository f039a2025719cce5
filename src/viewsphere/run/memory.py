"""The rendering of a recipe into samples in memory, without a disk."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import chain, count
from os import PathLike
from typing import Any

from viewsphere.composing.seeds import generator
from viewsphere.errors import UserError
from viewsphere.model.fields.notebook import Shown
from viewsphere.model.sample import Sample
from viewsphere.model.shard import Shard
from viewsphere.model.shot import Shot
from viewsphere.planning.plan import Plan, plan
from viewsphere.recipe.recipe import Recipe
from viewsphere.run.opening import prepare
from viewsphere.run.progress import shown_on_terminal
from viewsphere.run.shards import shard_of
from viewsphere.run.shots.camera_collisions import CameraChecks
from viewsphere.run.shots.framing import Framing
from viewsphere.run.shots.precompile import precompile, told_to
from viewsphere.run.shots.stages import Stages
from viewsphere.store import Row
from viewsphere.store.index import Index
from viewsphere.validation.errors import shown
from viewsphere.validation.quantity import quantity


class Frames(Shown, Iterable[Sample]):
    """A recipe's frames, rendered on demand; returned by `viewsphere.render`.

    Each loop over the frames renders the requested epochs; the next loop continues with the following epoch. `next` returns
    frames one by one and turns the object into an iterator, which ends once. PyTorch's DataLoader accepts it as an
    IterableDataset.

    Args:
        recipe: The recipe.
        shard: The share to render; None: that of the process's rank, or all.
        shuffle: Draws an order for each epoch.
        epochs: Epochs in a loop; None: endless.
        redraw: Redraws random values in all epochs but the first.

    Attributes:
        plan: The plan of the recipe.
        epoch: The epoch with which the next loop begins, counted from 0.
    """

    def __init__(self, recipe: Recipe, shard: Shard | None, shuffle: bool, epochs: int | None, redraw: bool) -> None:
        self.plan = prepare(recipe)
        self.epoch = 0
        self._shard, self._shuffle, self._epochs, self._redraw = shard, shuffle, epochs, redraw
        self._stages = Stages()
        self._taken: Iterator[Sample] | None = None
        self._is_compiled = False
        _register_for_loaders(type(self))

    def __getstate__(self) -> dict[str, Any]:
        """The state sent to workers of data loaders: this process's rank, but no warm caches."""
        cold = {"_stages": Stages(), "_taken": None, "_is_compiled": False}
        return {**self.__dict__, "_shard": self._shard or _shard_of_rank(), **cold}

    def __repr__(self) -> str:
        loops = "endless" if self._epochs is None else f"epochs {self._epochs}"
        return f"<Frames of {self.plan.recipe.name}: {quantity(self.plan.frames, 'frame')}, {loops}, next epoch {self.epoch}>"

    def __len__(self) -> int:
        """Number of frames in a loop, for this shard or rank only; raises TypeError if loops are endless."""
        if self._epochs is None:
            raise TypeError("frames of epochs=None have no end, and no length")
        units = _RenderUnits(self.plan)
        shard = self._shard or _shard_of_rank()
        return self._epochs * (self.plan.frames if shard.of == 1 else shard.size(len(units)) * (self.plan.frames // len(units)))

    def __iter__(self) -> Iterator[Sample]:
        return self._taken or self._pass()

    def __next__(self) -> Sample:
        self._taken = self._taken or self._pass()
        return next(self._taken)

    def set_epoch(self, epoch: int) -> None:
        """Set the epoch with which the next loop begins. Loaders that restart their workers for each epoch need this, like
        PyTorch's DistributedSampler.

        Args:
            epoch: The epoch, counted from 0.
        """
        self.epoch = epoch

    def _pass(self) -> Iterator[Sample]:
        """This process's frames in one loop."""
        shard = (self._shard or _shard_of_rank()).parted(_shard_of_worker(self))
        epochs = count(self.epoch) if self._epochs is None else range(self.epoch, self.epoch + self._epochs)
        self.epoch += self._epochs or 0
        for epoch in epochs:
            yield from self._epoch(epoch, shard)

    def _epoch(self, epoch: int, shard: Shard) -> Iterator[Sample]:
        planned = self._drawn(epoch)
        whole = shard.of == 1 and not self._shuffle
        units, seen = _RenderUnits(planned, planned.shot_frames if whole else 1), set[str]()
        framing = Framing(planned, planned, self._stages, self._stages.box)
        order = units.shuffled(epoch) if self._shuffle else units.in_order()
        for unit in shard(order):
            if unit.subject not in seen:
                seen.add(unit.subject)
                self._stages.read_ahead(planned, planned.cast(unit.subject))
                CameraChecks(self._stages).check_distances(planned, unit.subject)
            for row in units.rows(unit):
                shot = framing.shot(row)
                self._compile_for(shot)
                yield from self._stages.render(shot)

    def _compile_for(self, shot: Shot) -> None:
        """Compile the kernels of the first shot on all cores; a terminal shows a line that counts them."""
        if not self._is_compiled:
            precompile(shot, told_to(shown_on_terminal))
            self._is_compiled = True

    def _drawn(self, epoch: int) -> Plan:
        """The plan; with `redraw`, its random choices are redrawn for each epoch."""
        if not (self._redraw and epoch):
            return self.plan
        recipe = self.plan.recipe
        return plan(recipe.redrawn(int(generator(recipe.seed, "epoch", str(epoch)).integers(2**63))))


def render(
    recipe: Recipe | str | PathLike[str],
    shard: tuple[int, int] | None = None,
    shuffle: bool = False,
    epochs: int | None = 1,
    redraw: bool = False,
) -> Frames:
    """The frames of a recipe, rendered one after another in the process that loops over them; nothing is written.

    Each worker of a PyTorch DataLoader renders a share; together they render every frame once per epoch. Poses are shuffled
    one by one (all sensors of a pose together), sequences as a whole.

    Args:
        recipe: The recipe, or the path or URL of its file.
        shard: (k, n) renders the k-th of n shares, counted from 0. By default it is the share of the process's rank if
            `torch.distributed` is initialised, else all frames. Workers divide the frames of their rank or shard.
        shuffle: Draws an order for each epoch from the recipe's seed.
        epochs: The number of times that a loop renders all frames; None: loops are endless.
        redraw: Redraws the recipe's random values in all epochs but the first. Models and splits stay.

    Returns:
        An iterable of `Sample`, which has a length unless it is endless.

    Raises:
        UserError: The recipe or an argument is invalid. Errors of models are raised when a loop needs the model.
    """
    if epochs is not None and not (isinstance(epochs, int) and epochs > 0):
        raise UserError(f"epochs: expected a number of 1 or more, or None for endless frames; found {shown(epochs)}")
    return Frames(Recipe.ensure(recipe), None if shard is None else shard_of(shard), shuffle, epochs, redraw)


@dataclass(frozen=True, eq=False)
class _RenderUnits:
    """The units in which loaders distribute and shuffle a plan: up to `most` poses of one subject, by all sensors, or a whole
    sequence, whose instants stay in order.
    """

    plan: Plan
    most: int = 1

    @cached_property
    def _index(self) -> Index:
        time = self.plan.recipe.time
        return Index(self.plan.blocks, 0, self.most if time is None else time.count, 0)

    def __len__(self) -> int:
        return len(self._index)

    def in_order(self) -> Iterator[Row]:
        """Yield all units, subject by subject."""
        return chain.from_iterable(map(self._index.rows_of, self.plan.varied_subjects))

    def shuffled(self, epoch: int) -> Iterator[Row]:
        """Yield all units in an order that the recipe's seed and the epoch draw."""
        rng = generator(self.plan.recipe.lasting_seed, "turns", str(epoch))
        return (self._index[int(number)] for number in rng.permutation(len(self)))

    def rows(self, unit: Row) -> Iterator[Row]:
        """The shots of a unit; a sequence has the shots into which the plan cuts it."""
        if self.plan.recipe.time is None:
            yield unit
            return
        first, end = unit.first, unit.first + unit.count
        while first < end:
            row = self.plan.rows.row_at(first)
            yield row
            first = row.first + row.count


def _shard_of_rank() -> Shard:
    """The shard of this process among the ranks of PyTorch's default process group; all frames without a group."""
    distributed: Any = sys.modules.get("torch.distributed")
    if distributed is None or not distributed.is_available() or not distributed.is_initialized():
        return Shard()
    return Shard(distributed.get_rank(), distributed.get_world_size())


def _shard_of_worker(frames: object) -> Shard:
    """The shard of this process among the workers of a PyTorch DataLoader that iterates over its data set. It is all frames
    outside such a worker, or if the loader itself chooses the items of each worker.

    `frames` may be the loader's data set itself.
    """
    data: Any = sys.modules.get("torch.utils.data")
    if data is None:
        return Shard()
    info = data.get_worker_info()
    if info is None or not (info.dataset is frames or isinstance(info.dataset, data.IterableDataset)):
        return Shard()
    return Shard(info.id, info.num_workers)


def _register_for_loaders(kind: type) -> None:
    """Register a class as an iterable data set of PyTorch's DataLoader."""
    data: Any = sys.modules.get("torch.utils.data")
    if data is not None:
        data.IterableDataset.register(kind)
