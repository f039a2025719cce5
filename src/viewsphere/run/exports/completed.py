"""A data set with labels that it does not store: they are computed from its shots and models at the first access."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import cached_property, partial
from typing import Any

from numpy.typing import NDArray

from viewsphere.errors import StoreError, UserError
from viewsphere.labels import LabelContext, annotated, channel_labels, computed_channel, labels, on_request, sample_values
from viewsphere.model.channel import PASSES, missing
from viewsphere.model.sample import Sample
from viewsphere.plugins.format import FormatSpec
from viewsphere.recipe.formats import FormatEntry
from viewsphere.run.exports.scope import is_computed, needs_of
from viewsphere.run.shots.reconstruct import ViewReconstructor
from viewsphere.run.shots.scenery import Scenery
from viewsphere.store import Choice, Dataset, Exported


def lacking(dataset: Dataset, spec: FormatSpec, entry: FormatEntry) -> tuple[str, ...]:
    """The labels that a format needs, that a part of a data set does not store, and that its shots allow to compute. There are
    none for a data set without shots, such as an imported one, from which formats take the existing labels.

    Raises UserError for labels that cannot be computed: passes, which an engine has to paint; points, which a recipe has to
    name; and any label if only some of the pictures were imported.
    """
    wanted, names, unknown = needs_of(spec, entry), dict[str, None](), dict[str, None]()
    shots = dataset.shots_of_parts
    for part, shot in zip(dataset.plan.parts, shots, strict=True):
        asked = set(part.recipe.get("annotations", ()))
        if shot is None:
            unknown |= dict.fromkeys(missing(wanted, {*part.channels, *asked}))
            continue
        for sensor in shot.rig.sensors:
            needed = sensor.intrinsics.lens.channels(wanted)
            absent = missing(needed, {*sensor.kept_channels(part.channels), *asked})
            names |= dict.fromkeys(name for name in absent if sensor.lidar is None or name not in PASSES)
    painted = [name for name in names if name in PASSES and name not in dataset.plan.channels]
    where = f"{dataset.root}: format {entry.name}"
    if painted:
        raise UserError(
            f"{where}: expected channel {', '.join(painted)}, found none: an engine has to paint it: add it to the recipe's "
            "channels, and render with --append"
        )
    for name in names:
        if name not in PASSES and not is_computed(name):
            raise UserError(f"{where}: expected label {name}, found none: add it to the recipe, and render")
    if unknown and any(shots):
        raise UserError(f"{where}: expected label {next(iter(unknown))} of all pictures; found imported ones that lack it")
    return tuple(name for name in names if name not in PASSES)


class Completed(Exported):
    """A data set whose samples also have the named labels, without annotations of objects whose visibility is at most
    `least`.
    """

    def __init__(
        self, root: str | os.PathLike[str], choice: Choice | None, least: float | None, names: tuple[str, ...], cuts: bool
    ) -> None:
        super().__init__(root, choice, least, cuts)
        self._names = names

    def __reduce__(self) -> tuple[Any, ...]:  # pyright: ignore[reportIncompatibleMethodOverride]
        return type(self), (self.root, self.choice, self.least, self._names, self.cuts)

    def shown(self, sample: Sample) -> Sample:
        """A sample with the computed labels."""
        wanted = [name for name in self._names if name not in sample.channels and name not in sample.requested]
        return super().shown(self._with(sample, wanted) if wanted else sample)

    @cached_property
    def reconstructor(self) -> ViewReconstructor:
        """The reconstructed views of the data set's sensors; several data sets of one root may share them."""
        whole = Dataset(self.root)  # all frames, with hidden annotations
        return ViewReconstructor(whole, Scenery(whole), {info.key: info for info in whole.models})

    def _with(self, sample: Sample, names: list[str]) -> Sample:
        if not self.reconstructor.is_possible(sample):
            raise StoreError(
                f"frame {sample.index}: expected a shot of which {names[0]} is computed; found an imported picture"
            )
        asked = tuple(name for name in names if name in on_request())
        channels = _Computed(
            sample.channels, [n for n in names if n in channel_labels()], partial(self._context, sample, names)
        )
        if not asked:
            return replace(sample, channels=channels)
        context = self._context(sample, names)
        objects = annotated(context)
        more = {**sample.extra, **sample_values(context, objects)}
        return replace(sample, channels=channels, objects=objects, extra=more, requested=(*sample.requested, *asked))

    def _context(self, sample: Sample, names: list[str]) -> LabelContext:
        asked = [name for name in names if name in on_request()]
        compares = any(labels()[name].pose_offsets for name in names)
        context = self.reconstructor.context(sample, names, asked, continued=compares)
        if context is None:
            raise StoreError(
                f"frame {sample.index}: expected scenery as it was rendered: {'; '.join(self.reconstructor.notes)}"
            )
        return context


class _Computed(Mapping[str, NDArray[Any]]):
    """A sample's channels, and other channels, which are computed at the first access."""

    def __init__(self, kept: Mapping[str, NDArray[Any]], names: list[str], context: Callable[[], LabelContext]) -> None:
        self._kept, self._names, self._context = kept, names, context
        self._made: dict[str, NDArray[Any]] = {}

    def __getitem__(self, name: str) -> NDArray[Any]:
        if name not in self._names:
            return self._kept[name]
        if name not in self._made:
            self._made[name] = computed_channel(channel_labels()[name], self._context())
        return self._made[name]

    def __contains__(self, name: object) -> bool:
        """Return whether there is such a channel, without reading or computing it."""
        return name in self._kept or name in self._names

    def __iter__(self) -> Iterator[str]:
        yield from self._kept
        yield from self._names

    def __len__(self) -> int:
        return len(self._kept) + len(self._names)
