"""Writes pictures, masks, depth and `dataset1.json`."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Collection, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, Any, NamedTuple

from viewsphere.formats.shared.json_proof import check_json
from viewsphere.formats.shared.json_rows import Where
from viewsphere.formats.shared.writing.export_files import Expected, check_files, models, put
from viewsphere.formats.shared.writing.paper import faces, json_bytes, transformation_matrix, vehicles
from viewsphere.model.channel import picture_of
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.plugins.format import Remark
from viewsphere.scratch import temporary
from viewsphere.store import Dataset

FOLDER_SIZE = 10_000
"""Largest number of entries in a folder: file managers and object stores list more of them slowly."""

OPENED: tuple[Where, ...] = (
    *((), ("vehicles",), ("poses",)),
    *(("poses", "*"), ("poses", "*", "vehicles_rendered")),
)
"""The parts of the JSON that the proof compares item by item."""


FILE_NAME = "dataset1.json"
Place = tuple[int, int, int, int]
"""An object's entry in the waiting file: pose, position of the pose's keys, position of the entry, and its end."""


def preparer(dataset: Dataset, folder: Path) -> Callable[[Sample], list[Entry]]:
    """Puts a sample's picture, masks and depth in place, and makes its entries of `dataset1.json`."""

    def prepare(sample: Sample) -> list[Entry]:
        for _, name, content in _files(dataset, sample):
            put(dataset, content, folder / name)
        return _entries_of(dataset, sample)

    return prepare


@contextmanager
def writer(dataset: Dataset, folder: Path, note: Callable[[str], None]) -> Generator[Callable[[list[Entry]], None]]:
    """Write `dataset1.json`, and models."""
    with _poses(dataset, folder) as append:
        yield append
    dataset.link_models(folder / "MODELS")


@contextmanager
def _poses(dataset: Dataset, folder: Path) -> Generator[Callable[[Sequence[Entry]], None]]:
    """Write the file into this folder. Yields a function that appends a frame's entries.

    Entries wait in a temporary file, and their positions in an SQLite table, which moves to disk once it is long.
    """
    with TemporaryFile(dir=folder) as waiting, closing(sqlite3.connect("")) as table:
        table.execute("PRAGMA journal_mode = OFF")
        table.execute("CREATE TABLE places (pose INTEGER, head INTEGER, start INTEGER, stop INTEGER)")

        def append(entries: Sequence[Entry]) -> None:
            table.executemany("INSERT INTO places VALUES (?, ?, ?, ?)", _places(entries, waiting))

        yield append
        with (folder / FILE_NAME).open("wb") as file:
            file.write(b'{"vehicles":' + json_bytes(vehicles(dataset.models)) + b',\n"poses":{')
            _write_poses(file, waiting, table.execute("SELECT * FROM places ORDER BY pose, start"))
            file.write(b"\n}}\n")


def _places(entries: Sequence[Entry], waiting: IO[bytes]) -> Iterator[Place]:
    """Write a frame's entries, each after the keys of its pose."""
    for entry in entries:
        head = waiting.tell()
        start = head + waiting.write(entry.keys)
        yield entry.pose, head, start, start + waiting.write(entry.own)


def _write_poses(file: IO[bytes], waiting: IO[bytes], places: Iterable[Place]) -> None:
    """Copy the entries, gathered by pose; a pose has the keys of its first frame."""
    last = None
    for number, head, start, stop in places:
        waiting.seek(head)
        if number != last:
            file.write((b"}},\n" if last is not None else b"\n") + waiting.read(start - head))
        else:
            file.write(b",\n")
            waiting.seek(start)
        file.write(waiting.read(stop - start))
        last = number
    if last is not None:
        file.write(b"}}")


def verify(dataset: Dataset, folder: Path, sampled: Collection[int]) -> Iterator[Remark]:
    """Yield every difference from the current export; no proof is limited to the `sampled` frames."""
    with temporary("native") as scratch_folder:
        with _poses(dataset, scratch_folder) as append:
            again = _expected(dataset, lambda entries: None)
            yield from check_files(dataset, folder, _expected(dataset, append), again, [FILE_NAME])
        yield from check_json(scratch_folder / FILE_NAME, folder / FILE_NAME, OPENED, lambda where, value: None)


def _expected(dataset: Dataset, append: Callable[[Sequence[Entry]], None]) -> Iterator[Expected]:
    """Yield every file but the JSON; for the JSON, `append` receives each frame."""
    for sample in dataset:
        append(_entries_of(dataset, sample))
        yield from _files(dataset, sample)
    yield from models(dataset)


class Entry(NamedTuple):
    """An object's entry, JSON: the number of its pose, the pose's keys, and the object's own."""

    pose: int
    keys: bytes
    own: bytes


def _entries_of(dataset: Dataset, sample: Sample) -> list[Entry]:
    """The entries of a sample's objects; none if the layout has no place for the sample."""
    if not _is_of_a_pose(sample):
        return []
    number = sample.pose.index
    keys = json_bytes(str(number)) + b":" + json_bytes({**_pose(dataset, sample), "vehicles_rendered": {}})[:-2]
    own = ((json_bytes(name), json_bytes(entry)) for name, entry in _objects(dataset, sample))
    return [Entry(number, keys, name + b":" + entry) for name, entry in own]


def _is_of_a_pose(sample: Sample) -> bool:
    """Return whether a sample has a known camera and pose, which the layout needs: it sorts everything by pose."""
    return sample.known_camera is not None and sample.known_pose is not None


def _files(dataset: Dataset, sample: Sample) -> Iterator[Expected]:
    """The files of a sample: picture, depth and masks, with their paths from the export's folder; none if the layout has no
    place for the sample.
    """
    if not _is_of_a_pose(sample):
        return
    folder = _pose_folder(dataset, sample)
    names = _shared_files(dataset, sample)
    for channel, kind in ((picture_of(names), "RGB"), ("depth", "DEPTH")):
        if channel in names:
            yield sample.index, f"{folder}/{kind}/{names[channel]}", sample.files[channel]
    for o in sample.objects:
        yield sample.index, f"{folder}/MASK/{_stem(dataset, sample, o)}.png", o.mask


def _objects(dataset: Dataset, sample: Sample) -> Iterator[tuple[str, dict[str, Any]]]:
    """Name and JSON entry of every object."""
    files = _shared_files(dataset, sample)
    for o in sample.objects:
        yield _object_name(dataset, sample, o), _rendered(sample, o, f"{_stem(dataset, sample, o)}.png", files)


def _shared_files(dataset: Dataset, sample: Sample) -> dict[str, str]:
    """Names of a frame's files by channel; all objects share these files, which are named after the first object."""
    if not sample.objects:
        return {}
    stem = _stem(dataset, sample, sample.objects[0])
    return {channel: stem + Path(file).suffix for channel, file in sample.files.items()}


def _stem(dataset: Dataset, sample: Sample, o: ObjectAnnotation) -> str:
    return f"{_group(dataset, sample)}{_object_name(dataset, sample, o)}-{sample.pose.index:04d}"


def _object_name(dataset: Dataset, sample: Sample, o: ObjectAnnotation) -> str:
    """An object's name in its pose: its model's key, with numbers if the key is not unique."""
    plan = dataset.plan
    is_product = all(part.is_product or not part.is_sampled for part in plan.parts)
    one_a_pose = is_product and dataset.max_objects == 1 and plan.frames <= len(plan.models) * plan.poses
    return o.key if one_a_pose else f"{o.key}_{sample.index + 1}_{o.id}"


def _pose_folder(dataset: Dataset, sample: Sample) -> str:
    index = sample.pose.index
    group = f"Poses-{index // FOLDER_SIZE:04d}/" if dataset.plan.poses > FOLDER_SIZE - 2 else ""
    return f"{group}Pose-{index}"


def _group(dataset: Dataset, sample: Sample) -> str:
    """Sub-folder in a pose's folders, empty unless they would hold too many files."""
    plan = dataset.plan
    number, count = (n * dataset.max_objects // max(plan.poses, 1) for n in (sample.index, plan.frames))
    return f"{number // FOLDER_SIZE:04d}/" if count > FOLDER_SIZE else ""


def _pose(dataset: Dataset, sample: Sample) -> dict[str, Any]:
    """The JSON keys of a sample's pose, except the list of rendered objects. If models have separate viewpoints at a pose, the
    keys describe its first frame.
    """
    viewpoint = sample.pose
    return {
        **_viewpoint(sample),
        **({"frame": viewpoint.time.frame, "seconds": viewpoint.time.seconds} if viewpoint.time else {}),
        "folder": _pose_folder(dataset, sample),
        "transformation_matrix": transformation_matrix(sample.camera),
    }


def _viewpoint(sample: Sample) -> dict[str, Any]:
    """The viewpoint of a frame."""
    viewpoint = sample.pose
    return {
        "distance": viewpoint.distance,
        "elevation": viewpoint.elevation_deg,
        "azimuth": viewpoint.azimuth_deg,
        "tilt": viewpoint.tilt_deg,
        "pose_category": viewpoint.category,
    }


def _rendered(sample: Sample, o: ObjectAnnotation, mask: str, files: Mapping[str, str]) -> dict[str, Any]:
    """An object's entry; all objects of a frame share the files of the first one, except the mask."""
    bent = sample.camera.lens.record
    return {
        "path_rgb": files.get(picture_of(files) or ""),
        "path_mask": mask,
        "path_depth": files.get("depth"),
        "render_resolution": [sample.camera.width, sample.camera.height],
        "render_scale": 1.0,
        "bbox_3D_pxs": faces(o.box3d_pixels),
        "bbox_2D": o.box2d,
        "visibility": o.visibility,
        "truncation": o.truncation,
        "viewpoint": _viewpoint(sample),
        "id_model": o.key,
        **({"id_track": o.track} if o.track else {}),
        "split": sample.split,
        "transformation_matrix": transformation_matrix(sample.camera),
        **({"distortion": bent} if bent else {}),
        **sample.camera.shutter_record,
    }
