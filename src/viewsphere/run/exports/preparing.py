"""The preparation of samples for formats. Samples are read once for all formats; several processes share long preparations."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import AbstractContextManager, closing, contextmanager
from dataclasses import dataclass
from functools import cache, cached_property, partial
from itertools import chain, repeat
from pathlib import Path
from typing import TYPE_CHECKING, Any

from viewsphere import plugins
from viewsphere.errors import UserError
from viewsphere.model.channel import missing
from viewsphere.model.sample import Sample
from viewsphere.model.sensors.rig import CAMERA
from viewsphere.plugins.format import FormatSpec
from viewsphere.recipe.formats import FormatEntry
from viewsphere.run.workers.in_order import in_order
from viewsphere.store import Dataset, Exported

if TYPE_CHECKING:
    from viewsphere.run.exports.completed import Completed

PATIENCE_S, WORTH_S = 2.0, 8.0
"""Seconds after which this process estimates its remaining time, and the remaining seconds from which other processes help,
each of which takes one or two seconds to start.
"""

LOT, LONGEST = 32, 256
"""Minimum number of frames that a worker gets at once, if enough are left, and maximum number from one shot, whose records are
read again for the next lot."""

Lot = tuple[tuple[str, Sequence[int]], ...]
"""Shots by their keys, each with the indices of frames."""

Entries = Sequence[tuple[FormatEntry, Path]]
"""Formats with their output folders."""


class Views:
    """Views of a data set for formats. Formats that need the same annotations and labels share one view."""

    def __init__(self, dataset: Dataset) -> None:
        self._dataset = dataset
        self._seen = cache(self._made)
        self._completed: Completed | None = None

    def for_format(self, entry: FormatEntry, least: float | None) -> Dataset:
        """The data set with the labels that a format needs, without annotations of objects whose visibility is at most `least`.
        A format that writes scenes keeps all annotations. Raises UserError for needs that cannot be met.
        """
        from viewsphere.run.exports.completed import lacking  # which loads what reads and draws models

        spec = plugins.load(FormatSpec, entry.name)
        cuts = not spec.holds_seam and self._has_seam
        return self._seen(None if spec.keeps_all_objects else least, lacking(self._dataset, spec, entry), cuts)

    @cached_property
    def _has_seam(self) -> bool:
        """Return whether pictures of a full turn are among those of the data set."""
        rigs = (shot.rig for shot in self._dataset.shots_of_parts if shot is not None)
        return any(sensor.intrinsics.lens.period is not None for rig in rigs for sensor in rig.sensors)

    def _made(self, least: float | None, names: tuple[str, ...], cuts: bool) -> Dataset:
        if least is None and not names and not cuts:
            return self._dataset
        from viewsphere.run.exports.completed import Completed

        root, choice = self._dataset.root, self._dataset.choice
        if names:
            shown = Completed(root, choice, least, names, cuts)
            self._completed = self._completed or shown
            shown.reconstructor = self._completed.reconstructor  # shared, so that views are reconstructed once
        else:
            shown = Exported(root, choice, least, cuts)
        shown.link_kinds, shown.made = self._dataset.link_kinds, self._dataset.made
        return shown


@dataclass(frozen=True, eq=False)
class Target:
    """A format with its output folder and its view of the data set."""

    entry: FormatEntry
    folder: Path
    spec: FormatSpec
    view: Dataset

    def writer(self, note: Callable[[str], None]) -> AbstractContextManager[Callable[[Any], None]]:
        """Return the format's writer: a context whose value is a function, which receives the prepared data of each sample."""
        assert self.spec.writer is not None
        return self.spec.writer(self.view, self.folder, note, *self.entry.arguments())

    @property
    def prepares(self) -> bool:
        """Return whether the format prepares samples before they are added."""
        return self.spec.preparer is not None

    def preparer(self) -> Callable[[Sample], Any]:
        """The function that prepares a sample for the format; if the format prepares nothing, it returns the format's view of
        it.
        """
        preparer = self.spec.preparer
        with self._named():
            make = preparer(self.view, self.folder, *self.entry.arguments()) if preparer else None

        def prepare(sample: Sample) -> Any:
            with self._named():
                return make(self._seen(sample)) if make else self._seen(sample)

        return prepare

    @contextmanager
    def _named(self) -> Generator[None]:
        """Add the data set and the format to the user's errors, whose origin may lack them; errors of stored files do not
        change.
        """
        try:
            yield
        except UserError as error:
            where, name = f"{self.view.root}: ", self.entry.name
            problem = str(error).removeprefix(where).removeprefix(f"format {name}: ").removeprefix(f"{name}: ")
            if problem.startswith(str(self.view.root)):
                raise
            raise type(error)(f"{where}format {name}: {problem}") from None

    def _seen(self, sample: Sample) -> Sample:
        """The format's view of the sample; raises UserError if the sample's sensor lacks a channel that the format needs for
        every frame.
        """
        shown = self.view.shown(sample)
        lens = None if sample.known_camera is None else sample.known_camera.lens
        needed = self.spec.channels or ()
        absent = missing(lens.channels(needed) if lens else needed, {*shown.channels, *shown.requested})
        is_exempt = self.spec.lidar and lens is not None and lens.is_scan
        if sample.sensor != CAMERA and absent and not is_exempt:
            raise UserError(
                f"expected channel {absent[0]} of every frame, found none of sensor {sample.sensor} (frame {sample.index}): "
                f"leave {self.entry.name} out, or render that sensor with {absent[0]}"
            )
        return shown


def targets(dataset: Dataset, formats: Entries) -> tuple[Target, ...]:
    """The formats to be written from a data set."""
    views, least = Views(dataset), dataset.plan.keep_annotations_above
    specs = ((entry, folder, plugins.load(FormatSpec, entry.name)) for entry, folder in formats)
    return tuple(Target(entry, folder, spec, views.for_format(entry, least)) for entry, folder, spec in specs)


def prepared(dataset: Dataset, found: Sequence[Target], workers: int = 0) -> Generator[dict[str, Any]]:
    """For each sample in frame order the prepared data of each format, by its name. If this takes long, `workers` processes
    share the preparation; the result is the same.
    """
    alone, own = _Preparation(dataset, found), _Preparation(dataset, [one for one in found if not one.prepares])
    shared = [(one.entry, one.folder) for one in found if one.prepares]
    workers = workers if shared and dataset.store.place.is_shared() else 0
    begun, lots, done, total = time.monotonic(), _lots(dataset.shots()), 0, len(dataset)
    for lot in lots:
        yield from map(alone.parts, _samples(dataset, lot))
        done += sum(len(places) for _, places in lot)
        spent = time.monotonic() - begun
        if workers > 1 and spent >= PATIENCE_S and spent * (total - done) / done >= WORTH_S:
            break
    with closing(in_order(workers, partial(_preparation, dataset, shared), lots)) as made:
        for lot, (parts, kinds) in made:
            dataset.link_kinds |= kinds
            samples = _samples(dataset, lot) if own.preparers else repeat(None)
            yield from (part | own.parts(sample) for part, sample in zip(parts, samples, strict=False))


class _Preparation:
    """Prepares samples for formats."""

    def __init__(self, dataset: Dataset, found: Sequence[Target]) -> None:
        self.preparers = {target.entry.name: target.preparer() for target in found}
        self._dataset = dataset

    def parts(self, sample: Any) -> dict[str, Any]:
        """Return the prepared data of a sample for each format."""
        return {name: prepare(sample) for name, prepare in self.preparers.items()}

    def __call__(self, lot: Lot) -> tuple[list[dict[str, Any]], set[str]]:
        """Return each format's prepared data for each sample of a lot, and the kinds of file links so far."""
        return [self.parts(sample) for sample in _samples(self._dataset, lot)], self._dataset.link_kinds


def _preparation(dataset: Dataset, formats: Entries) -> _Preparation:
    return _Preparation(dataset, targets(dataset, formats))


def _samples(dataset: Dataset, lot: Lot) -> Iterator[Sample]:
    return chain.from_iterable(dataset.samples_of(key, places) for key, places in lot)


def _lots(shots: Iterator[tuple[str, Sequence[int]]]) -> Iterator[Lot]:
    """The shots in lots of at least `LOT` frames; long shots are cut."""
    lot: list[tuple[str, Sequence[int]]] = []
    for key, places in shots:
        for at in range(0, len(places), LONGEST):
            lot.append((key, places[at : at + LONGEST]))
            if sum(len(some) for _, some in lot) >= LOT:
                yield tuple(lot)
                lot = []
    if lot:
        yield tuple(lot)
