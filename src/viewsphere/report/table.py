"""Every frame and object of a data set as columns of numbers for a report's counts, about 40 bytes per object."""

from __future__ import annotations

import math
import multiprocessing
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.store import Dataset

FRAME = np.dtype(
    [
        ("split", "i4"),
        ("subject", "i4"),
        ("azimuth", "f4"),
        ("elevation", "f4"),
        ("distance", "f4"),
        ("objects", "i4"),
        ("seen", "i4"),
        ("width", "i4"),
        ("height", "i4"),
    ]
)
"""A finished frame: `split` and `subject` (its first object's model, else category) index names; degrees, metres, pixels; an
unknown camera is NaN, an unknown size 0.
"""

OBJECT = np.dtype(
    [
        ("frame", "i4"),
        ("model", "i4"),
        ("category", "i4"),
        ("pose", "i4"),
        ("seen", "?"),
        ("side", "f4"),
        ("visibility", "f4"),
        ("truncation", "f4"),
        ("azimuth", "f4"),
        ("elevation", "f4"),
        ("distance", "f4"),
    ]
)
"""An object of a frame: `frame` is the row of its frame, `model` and `pose` index names, `category` is the category's id.

`side` is the square root of the 2D box's area in pixels; the view's angles are degrees, its distance metres; NaN where an
object has no such value.
"""

CHUNK = 2048
"""Frames that a process reads in one piece."""

Listener = Callable[[int, int], None]


@dataclass(frozen=True, eq=False)
class FrameTable:
    """The finished frames in order and their objects, rows of `FRAME` and `OBJECT`, and the names that indices stand for."""

    frames: NDArray[Any]
    objects: NDArray[Any]
    splits: tuple[str, ...]
    subjects: tuple[str, ...]
    models: tuple[str, ...]
    poses: tuple[str, ...]


@dataclass(frozen=True)
class _Names:
    """Names in order of appearance, and the number of each."""

    codes: dict[str, int] = field(default_factory=dict[str, int])

    @property
    def names(self) -> tuple[str, ...]:
        """The names, in the order of their numbers."""
        return tuple(self.codes)

    def code(self, name: str) -> int:
        """The number of a name; a new name gets a new number."""
        return self.codes.setdefault(name, len(self.codes))

    def translation(self, names: Iterable[str]) -> NDArray[np.int32]:
        """The numbers of names."""
        return np.array([self.code(name) for name in names], np.int32)


class Rows:
    """A growing array of rows of one kind; existing rows do not change when others are added."""

    def __init__(self, kind: np.dtype[Any]) -> None:
        self._held = np.zeros(1024, kind)
        self._count = 0

    @property
    def array(self) -> NDArray[Any]:
        """The rows so far."""
        return self._held[: self._count]

    def extend(self, rows: NDArray[Any]) -> None:
        """Append rows; the capacity doubles when it is used up."""
        count = self._count + len(rows)
        if count > len(self._held):
            held = np.zeros(max(count, 2 * len(self._held)), self._held.dtype)
            held[: self._count] = self.array
            self._held = held
        self._held[self._count : count] = rows
        self._count = count


class Columns:
    """A growing table: tables one after another, with one numbering of names."""

    def __init__(self) -> None:
        self._frames, self._objects = Rows(FRAME), Rows(OBJECT)
        self._splits, self._subjects, self._models, self._poses = _Names(), _Names(), _Names(), _Names()

    @property
    def table(self) -> FrameTable:
        """The table of the rows so far."""
        names = (self._splits.names, self._subjects.names, self._models.names, self._poses.names)
        return FrameTable(self._frames.array, self._objects.array, *names)

    def extend(self, table: FrameTable) -> None:
        """Append the rows of a table."""
        frames, objects = table.frames.copy(), table.objects.copy()
        for column, names, own in (("split", self._splits, table.splits), ("subject", self._subjects, table.subjects)):
            frames[column] = names.translation(own)[frames[column]] if len(frames) else 0
        for column, names, own in (("model", self._models, table.models), ("pose", self._poses, table.poses)):
            objects[column] = names.translation(own)[objects[column]] if len(objects) else 0
        objects["frame"] += len(self._frames.array)
        self._objects.extend(objects)
        self._frames.extend(frames)


def read_table(dataset: Dataset, *, workers: int = 0, listener: Listener | None = None) -> FrameTable:
    """The columns of all finished frames; `workers` 0 reads in this process.

    Memory is bounded by the columns and one chunk of records a process. Raises StoreError for records that cannot be read.
    """
    chunks = [(at, min(at + CHUNK, len(dataset))) for at in range(0, len(dataset), CHUNK)]
    columns = Columns()
    for (_, stop), table in zip(chunks, _tables(dataset, chunks, workers), strict=True):
        columns.extend(table)
        if listener is not None:
            listener(stop, len(dataset))
    return columns.table


def _tables(dataset: Dataset, chunks: list[tuple[int, int]], workers: int) -> Iterator[FrameTable]:
    if workers < 2 or len(chunks) < 2:
        yield from map(partial(_table, dataset), chunks)
        return
    with ProcessPoolExecutor(min(workers, len(chunks)), multiprocessing.get_context("spawn")) as pool:
        yield from pool.map(partial(_table, dataset), chunks)


def _table(dataset: Dataset, chunk: tuple[int, int]) -> FrameTable:
    """The columns of frames [start, stop)."""
    return table_of(dataset[i] for i in range(*chunk))


def table_of(samples: Iterable[Sample]) -> FrameTable:
    """The columns of some samples."""
    splits, subjects, models, poses = _Names(), _Names(), _Names(), _Names()
    frames: list[tuple[float, ...]] = []
    objects: list[tuple[float, ...]] = []
    for row, sample in enumerate(samples):
        seen = sum(o.area > 0 for o in sample.objects)
        frames.append((splits.code(sample.split), subjects.code(_subject(sample)), *_camera_columns(sample, seen)))
        objects += [(row, models.code(o.key), o.category_id, poses.code(o.pose_category), *_columns(o)) for o in sample.objects]
    return FrameTable(
        np.array(frames, FRAME), np.array(objects, OBJECT), splits.names, subjects.names, models.names, poses.names
    )


def _subject(sample: Sample) -> str:
    first = sample.objects[0] if sample.objects else None
    return "" if first is None else first.key or first.category


def _camera_columns(sample: Sample, seen: int) -> tuple[float, ...]:
    pose, camera = sample.known_pose, sample.known_camera
    orbit = (math.nan,) * 3 if pose is None else (pose.azimuth_deg % 360, pose.elevation_deg, pose.distance)
    size = (0, 0) if camera is None else (camera.width, camera.height)
    return (*orbit, len(sample.objects), seen, *size)


def _columns(o: ObjectAnnotation) -> tuple[float, ...]:
    side = math.nan if o.box2d is None else math.sqrt((o.box2d[2] - o.box2d[0]) * (o.box2d[3] - o.box2d[1]))
    view = o.view
    return (
        o.area > 0,
        side,
        o.visibility,
        o.truncation,
        view.azimuth_deg % 360,
        view.elevation_deg,
        view.distance,
    )
