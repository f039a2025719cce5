"""Sequences as films: the samples shown together, and their durations."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Container, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from viewsphere.errors import StoreError
from viewsphere.labels import TAIL
from viewsphere.model.channel import picture_of
from viewsphere.model.sample import Sample
from viewsphere.model.shot import Shot
from viewsphere.store.samples.dataset import Dataset
from viewsphere.validation.errors import one_of

ALONE = 1.0
"""Seconds for which a film with a single instant shows it."""


@dataclass(frozen=True)
class Film:
    """One sequence: its shown sensors, and for each instant its number, its time in seconds, and the place of each sensor's
    sample among all samples.
    """

    sequence: str
    sensors: tuple[str, ...]
    instants: tuple[int, ...]
    times: tuple[float, ...]
    places: tuple[tuple[int, ...], ...]

    @property
    def shown_for(self) -> tuple[float, ...]:
        """Seconds from each instant to the next; the last one lasts as long as the shortest of the others."""
        if len(self.times) == 1:
            return (ALONE,)
        steps = np.diff(self.times).tolist()
        return (*steps, min(steps))

    def spread(self, count: int) -> tuple[int, ...]:
        """Return evenly spaced instants, counted from 0: the first, the last and others between; all if there are no more than
        `count`.
        """
        last = len(self.instants) - 1
        return tuple(np.unique(np.linspace(0, last, min(count, last + 1)).round().astype(int)).tolist())


Seen = tuple[str, int, str, int, float]
"""Sequence, instant, sensor, place among all samples, and time in seconds of a sample."""


IsShown = Callable[[Container[str]], Any]
"""Test whether samples with these channels have a picture to show."""


def films_of(samples: Sequence[Sample], is_shown: IsShown = picture_of) -> list[Film]:
    """The sequences of samples, in order; empty for still pictures. Sensors and instants with nothing to show, by default those
    without pictures, are left out.

    If `samples` is a data set, no sample is read.
    """
    return _films(_in_shots(samples, is_shown) if isinstance(samples, Dataset) else _in_memory(samples, is_shown))


def _in_memory(samples: Iterable[Sample], is_shown: IsShown) -> Iterator[Seen]:
    for place, sample in enumerate(samples):
        if sample.sequence and is_shown(sample.channels):
            yield sample.sequence, sample.instant, sample.sensor, place, sample.time


def _in_shots(dataset: Dataset, is_shown: IsShown) -> Iterator[Seen]:
    """The samples of sequences in a data set. Parts without `time` have no sequences; their shots are not read."""
    start = 0
    parts = dataset.plan.parts
    for key, places in dataset.shots():
        row = dataset.plan.find(key)
        if row is not None and row.part < len(parts) and parts[row.part].recipe.get("time"):
            yield from _in_shot(dataset.labelled(key), places, start, is_shown)
        start += len(places)


def _in_shot(shot: Shot | None, places: Sequence[int], start: int, is_shown: IsShown) -> Iterator[Seen]:
    if shot is None or not shot.sequence:
        return
    samples_of_shot = list(shot.samples)
    for number, place in enumerate(places, start):
        _, instant, sensor = samples_of_shot[place]
        if is_shown(shot.kept_channels(sensor)):
            now = shot.instants[instant]
            yield shot.sequence, now.index, shot.rig.sensors[sensor].name, number, now.seconds


def _films(seen: Iterable[Seen]) -> list[Film]:
    films: dict[str, dict[int, dict[str, tuple[int, float]]]] = {}
    for sequence, instant, sensor, place, seconds in seen:
        films.setdefault(sequence, {}).setdefault(instant, {})[sensor] = (place, seconds)
    return [_film(sequence, instants) for sequence, instants in films.items()]


def _film(sequence: str, seen: dict[int, dict[str, tuple[int, float]]]) -> Film:
    """The film of a sequence, without instants that lack a sensor, such as those of a selection."""
    sensors = tuple(max(seen.values(), key=len))
    whole = {number: [own[name] for name in sensors] for number, own in sorted(seen.items()) if set(sensors) <= set(own)}
    return Film(
        sequence,
        sensors,
        tuple(whole),
        tuple(own[0][1] for own in whole.values()),
        tuple(tuple(place for place, _ in own) for own in whole.values()),
    )


def film_named(films: Sequence[Film], name: str) -> Film:
    """The film of a sequence; raises StoreError for another name."""
    for film in films:
        if film.sequence == name:
            return film
    known = tuple(film.sequence for film in films)
    raise StoreError(f"--sequence: {one_of(name, known)}")


@dataclass(frozen=True, eq=False)
class Earlier:
    """The earlier samples of a sample's own sensor, at up to `labels.TAIL` instants before it, in order."""

    samples: Sequence[Sample]
    films: Sequence[Film]

    def __call__(self, sample: Sample) -> list[Sample]:
        """The samples before this one."""
        film = self._by_name.get(sample.sequence)
        if film is None or sample.sensor not in film.sensors:
            return []
        sensor, now = film.sensors.index(sample.sensor), bisect_left(film.instants, sample.instant)
        return [self.samples[film.places[i][sensor]] for i in range(max(0, now - TAIL), now)]

    @cached_property
    def _by_name(self) -> dict[str, Film]:
        return {film.sequence: film for film in self.films}
