"""The points of the world that a COLMAP model has, and the images that show them."""

from __future__ import annotations

from collections.abc import Iterator
from copy import copy
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from viewsphere.formats.colmap.records import SEEN, Point
from viewsphere.formats.shared.cameras import points_of
from viewsphere.labels.tracks import positions
from viewsphere.model.sample import Sample
from viewsphere.store import Dataset

MOST = 10_000_000
"""Factor of the image's number in a point's number, to which the point's place is added; larger than any image's points."""

STILL = 1e-6
"""Greatest motion of a point that counts as static, metres."""


@dataclass(frozen=True, eq=False)
class _Shown:
    """Points that an image shows, (N,) of `SEEN`, and the points that it adds to the model."""

    seen: NDArray[np.void]
    points: tuple[Point, ...]


class Sights:
    """The points that the images of a data set show."""

    def __init__(self, dataset: Dataset) -> None:
        self._dataset = dataset
        self._followed = lru_cache(maxsize=4)(self._follow)

    def shown(self, sample: Sample) -> _Shown:
        """Points followed through the sample's sequence, or points of a coarse grid that only this image has."""
        if sample.sequence and "tracks" in sample.channels:
            return self._of_tracks(sample, self._followed(sample.sequence, sample.sensor))
        found, own = points_of(sample), sample.index + 1
        numbers = own * MOST + np.arange(len(found.world)) + 1
        rows = zip(numbers.tolist(), found.world.tolist(), found.colors.tolist(), strict=True)
        points = tuple(Point(number, place, color, [(own, k)]) for k, (number, place, color) in enumerate(rows))
        return _Shown(_rows(found.pixels, numbers), points)

    def _of_tracks(self, sample: Sample, followed: _Followed) -> _Shown:
        own, rows = followed.images.index(sample.index + 1), sample.channels["tracks"]
        shown = np.flatnonzero(followed.holds[own])
        seen = _rows(positions(sample)[shown], followed.numbers[shown])
        return _Shown(seen, tuple(self._picked(sample, rows, followed)))

    def _picked(self, sample: Sample, rows: NDArray[np.void], followed: _Followed) -> Iterator[Point]:
        """The points picked in this image."""
        places = np.cumsum(followed.holds, axis=1) - 1
        for k in np.flatnonzero((rows["instant"] == sample.instant) & followed.holds.any(axis=0)).tolist():
            column, row = np.floor(rows["query"][k]).astype(int)
            at = min(max(row, 0), sample.height - 1), min(max(column, 0), sample.width - 1)
            track = [(followed.images[i], int(places[i, k])) for i in np.flatnonzero(followed.holds[:, k])]
            place: list[float] = rows["point"][k, :3].tolist()
            yield Point(int(followed.numbers[k]), place, sample.picture[at][:3].tolist(), track)

    def _follow(self, sequence: str, sensor: str) -> _Followed:
        """The followed points of a sensor. Samples are read twice, so that only one sample's rows are in memory."""
        samples = self._dataset.sequence(sequence, sensor)
        places, numbers = np.zeros(0), np.zeros(0, np.int64)
        for sample in samples:
            rows = copy(sample.channels)["tracks"]
            if not len(numbers):
                places, numbers = np.full((len(rows), 3), np.nan), np.arange(len(rows)) + 1
            own = (rows["instant"] == sample.instant) & (rows["point"][:, 3] == 1)
            places[own] = rows["point"][own, :3]
            numbers[own] += (sample.index + 1) * MOST
        holds = np.zeros((len(samples), len(numbers)), np.bool_)
        for i, sample in enumerate(samples):
            rows = copy(sample.channels)["tracks"]
            moved = np.abs(rows["point"][:, :3] - places).max(axis=1, initial=0)
            holds[i] = (rows["state"] == 0) & (moved <= STILL)
        return _Followed([sample.index + 1 for sample in samples], numbers, holds)


@dataclass(frozen=True, eq=False)
class _Followed:
    """Points that a sensor follows: the images of its sequence, the points' numbers (N,), and (T, N) whether each image shows
    each point where it was picked.
    """

    images: list[int]
    numbers: NDArray[np.int64]
    holds: NDArray[np.bool_]


def _rows(pixels: NDArray[np.float64], numbers: NDArray[np.int64]) -> NDArray[np.void]:
    rows = np.empty(len(pixels), SEEN)
    rows["x"], rows["y"], rows["point"] = *pixels.T, numbers
    return rows
