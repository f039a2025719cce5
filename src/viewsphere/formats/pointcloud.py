"""Coloured point clouds: a binary PLY file for each picture, for Open3D, MeshLab, CloudCompare and trimesh.

    <split>/<index>.ply

Each point has x, y, z (metres), red, green, blue, and, if the data set keeps the channels behind them, nx, ny, nz, object (0
for none) and category. Comments in the header name the axes. Pictures of unknown cameras, which imported data sets may have,
are left out.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Generator, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field

from viewsphere.codecs.ply import encode_ply
from viewsphere.errors import UserError
from viewsphere.files import read_bytes
from viewsphere.formats import Scope
from viewsphere.formats.shared.writing.export_files import check_files
from viewsphere.formats.shared.writing.refusals import any_camera
from viewsphere.model.channel import missing
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.sample import Sample
from viewsphere.plugins.format import FormatSpec, Remark
from viewsphere.store import Dataset

FOLDER_SIZE = 10_000
AXES = {
    "camera": "camera axes: x right, y down, z ahead; metres",
    "world": "world axes: z up; metres",
}


class _Options(Frozen):
    """The choice of points, and their axes."""

    axes: Literal["camera", "world"] = Field(
        default="camera", description="`camera`: x right, y down, z ahead; `world`: those of all pictures of a scene, z up"
    )
    surface: Literal["visible", "complete"] = Field(
        default="visible",
        description="`visible`: a point for each pixel; `complete`: those of the channel `surface_samples`, which have "
        "`visible` (1 or 0) instead of colours",
    )


def _needs(options: _Options) -> tuple[str, ...]:
    """The channels that these options require."""
    return ("surface_samples",) if options.surface == "complete" else ()


def _refuses(scope: Scope, options: _Options) -> Iterator[str]:
    """Yield an error if no picture has a known camera."""
    yield from any_camera(scope)


def _preparer(dataset: Dataset, folder: Path, options: _Options) -> Callable[[Sample], None]:
    """Write a sample's cloud."""

    def prepare(sample: Sample) -> None:
        if sample.known_camera is not None:
            file = folder / _name(dataset, sample)
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(_content(sample, options))

    return prepare


@contextmanager
def _writer(
    dataset: Dataset, folder: Path, note: Callable[[str], None], options: _Options
) -> Generator[Callable[[None], None]]:
    """A writer that adds nothing: the clouds are the whole export."""
    for name in missing(_needs(options), dataset.plan.channels):
        raise UserError(
            f"pointcloud: expected a data set with the channel {name}, of which complete clouds are made; found none"
        )
    yield lambda done: None


def _verify(dataset: Dataset, folder: Path, sampled: Collection[int], options: _Options) -> Iterator[Remark]:
    """Yield clouds that differ from the current export."""
    names = [_name(dataset, sample) for sample in dataset if sample.known_camera is not None]
    yield from check_files(dataset, folder, (), (), names)
    for sample in dataset:
        file = folder / _name(dataset, sample)
        if sample.known_camera is not None and file.is_file() and read_bytes(file) != _content(sample, options):
            yield sample.index, f"{_name(dataset, sample)}: expected the points of its picture, found others: export again"


def _name(dataset: Dataset, sample: Sample) -> str:
    number = dataset.plan.folder_of(sample.index, FOLDER_SIZE)
    parts = (sample.split or "all", *([] if number is None else [f"{number:04d}"]), f"{sample.index:08d}.ply")
    return "/".join(parts)


def _content(sample: Sample, options: _Options) -> bytes:
    cloud = sample.point_cloud(options.axes, options.surface)
    columns = dict(zip("xyz", cloud.points.astype(np.float32).T, strict=True))
    if cloud.colors is not None:
        columns |= dict(zip(("red", "green", "blue"), cloud.colors.T, strict=True))
    if cloud.normals is not None:
        columns |= dict(zip(("nx", "ny", "nz"), cloud.normals.T, strict=True))
    if cloud.instances is not None and cloud.categories is not None:
        columns |= {"object": cloud.instances, "category": cloud.categories}
    if options.surface == "complete":
        columns["visible"] = cloud.visible.astype(np.uint8)
    rows = np.empty(len(cloud), [(name, column.dtype) for name, column in columns.items()])
    for name, column in columns.items():
        rows[name] = column
    return encode_ply(rows, (f"viewsphere, frame {sample.index}", AXES[options.axes], "object: 0 is none"))


FORMAT = FormatSpec(
    parallel_rays=True,
    about=__doc__,
    holds=("coloured points", "normals", "objects"),
    read_by=("Open3D", "trimesh", "MeshLab", "CloudCompare"),
    options=_Options,
    channels=("depth", "instances"),
    names_credits=False,
    needs=_needs,
    refuses=_refuses,
    writer=_writer,
    preparer=_preparer,
    verify=_verify,
)
