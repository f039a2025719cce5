"""COLMAP's sparse models, text or binary, for COLMAP, pycolmap and Gaussian splatting.

    <world>/images/<sensor>/<index>.png   the pictures; without <sensor> if there is one
    <world>/sparse/0/cameras.txt          lenses: all of COLMAP's models; EQUIRECTANGULAR shows all directions
    <world>/sparse/0/rigs.txt             mounts of sensors: sensor_from_rig
    <world>/sparse/0/frames.txt           rig_from_world at each instant, and the images of that instant
    <world>/sparse/0/images.txt           cam_from_world, camera, file and points of each image
    <world>/sparse/0/points3D.txt         points, their colours, and the images that show them
    <world>/sparse/0/<split>.txt          names of the images of a split

A world is static while cameras look at it: a sequence, a scene, or a model of still pictures. With `kind: binary` the five
files end in `.bin`. Lengths are metres, z up; cameras look along z, x right, y down; quaternions are w, x, y, z. Pixels count
from the image's corner, so the centre of the first is (0.5, 0.5), as in COLMAP.

Sequences with the channel `tracks` use its static points, with all images that show them. Other pictures use pixels of a coarse
grid, lifted by their depth; one image shows each. All are exact: their errors are 0. COLMAP's world is static: only the
pictures show moving objects. Numbers follow the plan: an image's is its frame + 1; a frame's that of its first image. A picture
with another lens than the data set's first, for example in zooms, has its own camera and rig. Skew is not supported. `import`
reads the folder of one world, without its points.

Not verified: that versions before 3.12, without rigs, accept the other three files. The first program of Gaussian splatting
accepts only PINHOLE and pictures without <sensor>/, that is, of one sensor. Source: COLMAP's documentation,
https://colmap.github.io/format.html.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator, Mapping
from copy import copy
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.formats import Scope
from viewsphere.formats.colmap.reading import read, source_cameras
from viewsphere.formats.colmap.records import KINDS, SEEN, Camera, Frame, Image, Point, Record, Rig, pose_of
from viewsphere.formats.shared.cameras import Moment, Rigs, points_of, world_of
from viewsphere.formats.shared.writing.pictures import picture, suffix_of
from viewsphere.formats.shared.writing.refusals import known_cameras, lenses, no_skew
from viewsphere.formats.shared.writing.tree import File, Layout, Piece, Tree, functions
from viewsphere.geometry.rotation import transform
from viewsphere.labels.tracks import positions
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.sample import Sample
from viewsphere.plugins.format import FormatSpec
from viewsphere.store import Dataset

_MOST = 10_000_000
"""Factor of the image's number in a point's number, to which the point's place is added; larger than any image's points."""

_STILL = 1e-6
"""Greatest motion of a point that counts as static, metres."""

SHARED = 1
"""The number of the rig shared by all frames with the first frame's lenses."""


class _Options(Frozen):
    """The encoding of the model."""

    kind: Literal["text", "binary"] = Field(default="text", description="`text`: .txt files; `binary`: .bin files")


def _refuses(scope: Scope, options: _Options) -> Iterator[str]:
    """Reasons to refuse: unknown cameras, skew, lenses that COLMAP lacks, and splits named like a model's files."""
    yield from known_cameras(scope)
    yield from no_skew(scope)
    for name, lens in lenses(scope):
        if lens.lens.colmap is None:
            yield f"expected lenses of COLMAP's models; found {lens.lens.name} of {name}"
    for name in (name for name in scope.splits if name in KINDS):
        yield f"expected splits of other names than {', '.join(KINDS)}; found {name}"


class _Colmap(Tree):
    """A model for each world."""

    def __init__(self, dataset: Dataset, options: _Options) -> None:
        super().__init__(dataset)
        self._binary = options.kind == "binary"
        self._rigs, self._sights = Rigs(dataset), _Sights(dataset)

    def sample_files(self, sample: Sample) -> Iterator[File | Piece]:
        """A picture, its image record and points and, with the first picture of an instant, the frame."""
        now, world, own = self._rigs.moment(sample), world_of(self.dataset, sample), sample.index + 1
        part = self.dataset.plan.part_of(sample.index)
        name = self.stem(sample).partition("/")[2] + suffix_of(sample, ".png", ".jpg")
        name = f"{now.folder}/{name}" if now.folder else name
        yield File(f"{world}/images/{name}", picture(sample, ".png", ".jpg"))
        sparse = f"{world}/sparse/0"
        yield Piece(f"{sparse}/{sample.split or 'all'}.txt", f"{name}\n".encode())

        cameras, rig = self._numbers(now, part)
        if now.is_first:
            lenses = [] if rig == SHARED else list(map(Camera, cameras, now.lenses))
            yield self._piece(sparse, "cameras", lenses, part)
            yield self._piece(sparse, "rigs", [] if rig == SHARED else [_rig(rig, cameras, now.mounts)], part)
            images = [(cameras[sensor], now.first + sensor + 1) for sensor in now.there]
            pose = pose_of(now.pose.R, now.pose.t)
            yield self._piece(sparse, "frames", [Frame(now.first + 1, rig, pose, images)])
        shown, camera = self._sights.shown(sample), sample.camera
        image = Image(own, pose_of(camera.R, camera.t), cameras[now.sensor], name, shown.seen)
        yield self._piece(sparse, "images", [image])
        yield self._piece(sparse, "points3D", shown.points)

    def layout(self, path: str, counts: Mapping[str, int]) -> Layout:
        """Return the parts of a file: the records that all frames of a part share, and the other records. Binary files begin
        with the number of records.
        """
        file = path.rpartition("/")[2].partition(".")[0]
        if file not in KINDS:
            return ("",)
        section = next(iter(counts))
        shared = self._shared(file, int(section)) if section else []
        title = f"# {KINDS[file].COLUMNS}\n".encode()
        head = struct.pack("<Q", len(shared) + counts[section]) if self._binary else title
        return (head, self._bytes(shared), section)

    def _shared(self, file: str, part: int) -> list[Record]:
        """Cameras and rig of a part's first shot."""
        rig = self._rigs.usual(part)
        if rig is None:
            return []
        numbers = range(1, len(rig.sensors) + 1)
        if file == "cameras":
            return [Camera(number, sensor.intrinsics) for number, sensor in zip(numbers, rig.sensors, strict=True)]
        return [_rig(SHARED, numbers, [np.array(sensor.rig_from_sensor) for sensor in rig.sensors])]

    def _numbers(self, now: Moment, part: int) -> tuple[list[int], int]:
        """Numbers of a moment's cameras and rig: the shared numbers if the cameras and rig are equal."""
        usual = self._rigs.usual(part)
        sensors = () if usual is None else usual.sensors
        if now.lenses == tuple(sensor.intrinsics for sensor in sensors) and all(
            np.array_equal(mount, sensor.rig_from_sensor) for mount, sensor in zip(now.mounts, sensors, strict=True)
        ):
            return list(range(1, len(sensors) + 1)), SHARED
        return [len(sensors) + now.first + number + 1 for number in range(len(now.lenses))], now.first + 1 + SHARED

    def _piece(self, folder: str, file: str, records: Iterable[Record], part: int | str = "") -> Piece:
        """Records of one of the five files, which exists even without records."""
        own = list(records)
        return Piece(f"{folder}/{file}{'.bin' if self._binary else '.txt'}", self._bytes(own), str(part), count=len(own))

    def _bytes(self, records: Iterable[Record]) -> bytes:
        return b"".join(record.binary() if self._binary else record.text().encode() for record in records)


def _rig(number: int, cameras: Iterable[int], mounts: Iterable[np.ndarray[Any, Any]]) -> Rig:
    """A rig of sensors with these mounts, `rig_from_sensor`, (4, 4)."""
    turned = [(mount[:3, :3].T, mount[:3, 3]) for mount in mounts]
    return Rig(number, list(cameras), [pose_of(R, -transform(R, place)) for R, place in turned])


preparer, writer, verify = functions(_Colmap)


@dataclass(frozen=True, eq=False)
class _Shown:
    """Points that an image shows, (N,) of `SEEN`, and the points that it adds to the model."""

    seen: NDArray[np.void]
    points: tuple[Point, ...]


class _Sights:
    """The points that the images of a data set show."""

    def __init__(self, dataset: Dataset) -> None:
        self._dataset = dataset
        self._followed = lru_cache(maxsize=4)(self._follow)

    def shown(self, sample: Sample) -> _Shown:
        """Points followed through the sample's sequence, or points of a coarse grid that only this image has."""
        if sample.sequence and "tracks" in sample.channels:
            return self._of_tracks(sample, self._followed(sample.sequence, sample.sensor))
        found, own = points_of(sample), sample.index + 1
        numbers = own * _MOST + np.arange(len(found.world)) + 1
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
            numbers[own] += (sample.index + 1) * _MOST
        holds = np.zeros((len(samples), len(numbers)), np.bool_)
        for i, sample in enumerate(samples):
            rows = copy(sample.channels)["tracks"]
            moved = np.abs(rows["point"][:, :3] - places).max(axis=1, initial=0)
            holds[i] = (rows["state"] == 0) & (moved <= _STILL)
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


FORMAT = FormatSpec(
    about=__doc__,
    holds=("cameras", "poses", "rigs", "points"),
    read_by=("pycolmap", "COLMAP", "Gaussian splatting"),
    options=_Options,
    channels=("rgb", "depth"),
    panoramas=True,
    names_credits=False,
    refuses=_refuses,
    writer=writer,
    preparer=preparer,
    verify=verify,
    read=read,
    as_recipe=source_cameras,
)
