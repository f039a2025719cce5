"""Every frame and object of a data set as columns of numbers: what a report counts, some 40 bytes an object."""

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
    """All finished frames in order and their objects, rows of `FRAME` and `OBJECT`, and the names that indices stand for."""

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

    def code(self, name: str) -> int:
        return self.codes.setdefault(name, len(self.codes))

    def translation(self, names: Iterable[str]) -> NDArray[np.int32]:
        return np.array([self.code(name) for name in names], np.int32)


def read_table(dataset: Dataset, *, workers: int = 0, listener: Listener | None = None) -> FrameTable:
    """The columns of all finished frames; `workers` 0 reads in this process.

    Memory is bounded by the columns and one chunk of records a process. Raises StoreError for records that cannot be read.
    """
    chunks = [(at, min(at + CHUNK, len(dataset))) for at in range(0, len(dataset), CHUNK)]
    read: list[FrameTable] = []
    for table in _tables(dataset, chunks, workers):
        read.append(table)
        if listener is not None:
            listener(chunks[len(read) - 1][1], len(dataset))
    return _joined(read)


def _tables(dataset: Dataset, chunks: list[tuple[int, int]], workers: int) -> Iterator[FrameTable]:
    if workers < 2 or len(chunks) < 2:
        yield from map(partial(_table, dataset), chunks)
        return
    with ProcessPoolExecutor(min(workers, len(chunks)), multiprocessing.get_context("spawn")) as pool:
        yield from pool.map(partial(_table, dataset), chunks)


def _table(dataset: Dataset, chunk: tuple[int, int]) -> FrameTable:
    """The columns of frames [start, stop)."""
    splits, subjects, models, poses = _Names(), _Names(), _Names(), _Names()
    frames: list[tuple[float, ...]] = []
    objects: list[tuple[float, ...]] = []
    for row, sample in enumerate(dataset[i] for i in range(*chunk)):
        seen = sum(o.area > 0 for o in sample.objects)
        frames.append((splits.code(sample.split), subjects.code(_subject(sample)), *_camera_columns(sample, seen)))
        objects += [(row, models.code(o.key), o.category_id, poses.code(o.pose_category), *_columns(o)) for o in sample.objects]
    return FrameTable(
        np.array(frames, FRAME),
        np.array(objects, OBJECT),
        tuple(splits.codes),
        tuple(subjects.codes),
        tuple(models.codes),
        tuple(poses.codes),
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


def _joined(tables: list[FrameTable]) -> FrameTable:
    """Tables one behind the other, with one numbering of names."""
    splits, subjects, models, poses = _Names(), _Names(), _Names(), _Names()
    start = 0
    for table in tables:
        for column, names, own in (("split", splits, table.splits), ("subject", subjects, table.subjects)):
            table.frames[column] = names.translation(own)[table.frames[column]]
        if len(table.objects):
            for column, names, own in (("model", models, table.models), ("pose", poses, table.poses)):
                table.objects[column] = names.translation(own)[table.objects[column]]
        table.objects["frame"] += start
        start += len(table.frames)
    return FrameTable(
        np.concatenate([t.frames for t in tables]) if tables else np.zeros(0, FRAME),
        np.concatenate([t.objects for t in tables]) if tables else np.zeros(0, OBJECT),
        tuple(splits.codes),
        tuple(subjects.codes),
        tuple(models.codes),
        tuple(poses.codes),
    )
