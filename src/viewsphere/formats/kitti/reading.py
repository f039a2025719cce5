"""KITTI's data sets of objects and of tracks from other sources: pictures, their labels and calibrations."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import StoreError
from viewsphere.formats.kitti.writing import NAMES
from viewsphere.formats.shared.kitti import DONT_CARE
from viewsphere.formats.shared.reading.image_lists import (
    MISTAKES,
    TEST,
    TRAIN,
    Listed,
    listed_dataset,
    lists,
    one_line,
    text_of,
    unposed,
)
from viewsphere.formats.shared.reading.placed_objects import placed
from viewsphere.formats.shared.reading.posed_pictures import picture_inside
from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.rotation import inverse, rigid, transform
from viewsphere.limits import limits
from viewsphere.model.sample import Box, ObjectAnnotation, Sample
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.store import Category
from viewsphere.store.foreign import ForeignDataset, foreign_object
from viewsphere.store.paths import file_inside, is_name
from viewsphere.urls.inside import is_inside

_LEVEL = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
"""The rotation to the axes of KITTI's reference camera, from a world with z up in which this camera is the origin and looks
along y.
"""

_FARTHEST = 1e6
"""Limit of all numbers of a label, pixels or metres."""

_SHORTEST = 1e-3
"""Least focal length, pixels."""

Number = TypeVar("Number", int, float)

_MOST_TRACKS = 10**6
"""Largest number of a frame or track in an imported file; larger ones are mistakes."""

_COLUMNS = 15
"""Columns of an object's line, without a score."""

_DONT_CARE_TYPE = "DontCare"

SUFFIXES = (".png", ".jpg", ".jpeg")
FILES_KEPT = 4
"""Number of label files to keep for the next picture of their sequence."""

Of = Callable[[Path, bool], "_Labels"]


@dataclass(frozen=True)
class _Frame(Listed):
    """A picture and, in a sequence, its number there."""

    sequence: str = ""
    instant: int = 0

    @property
    def is_tracked(self) -> bool:
        """Return whether the picture belongs to a sequence."""
        return bool(self.sequence)


@dataclass(frozen=True)
class _Place:
    """A folder, relative to the root, with labelled pictures of a task."""

    folder: str
    is_tracked: bool

    @property
    def split(self) -> str:
        """The split of its pictures if no list gives one."""
        return TRAIN if self.folder in ("", "training") else self.folder

    def path_of(self, name: str) -> str:
        """The path of an item in the folder, relative to the root."""
        return f"{self.folder}/{name}" if self.folder else name

    @property
    def images(self) -> str:
        """The path of its pictures."""
        return self.path_of("image_02" if self.is_tracked else "image_2")

    @property
    def labels(self) -> str:
        """The path of its labels."""
        return self.path_of("label_02" if self.is_tracked else "label_2")

    def names(self, root: Path) -> list[str]:
        """The names of its pictures."""
        files = (root / self.images).glob("*/*" if self.is_tracked else "*")
        found = (file.relative_to(root / self.images) for file in files if file.suffix.lower() in SUFFIXES)
        return sorted(file.with_suffix("").as_posix() for file in found)


def read(path: Path, *, keep_going: bool = False) -> ForeignDataset:
    """Return every labelled picture of a folder with `training`, or of `training` itself, as viewsphere.formats.kitti
    describes.

    Raises StoreError with every mistake: pictures, labels and calibrations that are missing, broken or outside, and broken
    lines. With `keep_going` these are left out and reported.
    """
    places = tuple(_places(path))
    if not places:
        expected = "training/image_2 and label_2, or image_02 and label_02"
        raise StoreError(f"{path}: expected a KITTI data set ({expected}); found no such folders")
    problems, labels_of = list[str](), lru_cache(FILES_KEPT)(_read_labels)
    pictures = sorted(_pictures(path, places, labels_of, problems), key=lambda one: (one.file.parent, one.name))
    found = {picture.said[0]: picture.is_tracked for picture in pictures}
    kinds, ids, most = set[str](), set[int](), 1
    for file, is_tracked in found.items():
        assert file is not None
        labels = labels_of(file, is_tracked)
        problems += labels.problems
        objects = [[row for row in rows if not row.is_region] for rows in labels.rows.values()]
        kinds |= {row.kind for rows in objects for row in rows}
        ids |= {row.track for rows in objects for row in rows if row.track is not None}
        most = max([most, *map(len, objects)])
    problems += _unpictured(path, places, labels_of)
    ordered = sorted(kinds, key=lambda kind: (NAMES.index(kind) if kind in NAMES else len(NAMES), kind))
    categories = {name: Category(number, name, "") for number, name in enumerate(ordered, 1)}
    first = int(0 in ids)
    shown = partial(_shown, categories, labels_of, first)
    return listed_dataset(path, pictures, categories.values(), max(most, *ids, 0) + first, shown, problems, keep_going)


def _places(root: Path) -> Iterator[_Place]:
    """The folders with pictures and labels."""
    for folder in ("", *sorted(one.name for one in root.glob("*") if one.is_dir())):
        for place in (_Place(folder, False), _Place(folder, True)):
            if (root / place.images).is_dir() and (root / place.labels).is_dir():
                yield place


def _pictures(root: Path, places: tuple[_Place, ...], labels_of: Of, problems: list[str]) -> Iterator[_Frame]:
    """The pictures of all lists, each in its first list; without lists, the pictures of all folders."""
    camera_of, seen = lru_cache(FILES_KEPT)(_read_camera), set[tuple[_Place, str]]()
    frames: dict[tuple[str, int], str] = {}
    for split, source, place, name in _named(root, places, problems):
        if (place, name) not in seen:
            seen.add((place, name))
            try:
                frame = _picture(root, place, split, name, labels_of, camera_of)
                first = frames.setdefault((frame.sequence, frame.instant), name) if place.is_tracked else name
                if first != name:
                    raise ValueError(f"expected one picture of an instant; found {first}, too")
                yield frame
            except MISTAKES as error:
                problems.append(f"{source}: {name}: {one_line(error)}")


def _named(root: Path, places: tuple[_Place, ...], problems: list[str]) -> Iterator[tuple[str, Path, _Place, str]]:
    """Yield the split, the file or folder that defines it, the place and the name of each picture."""
    own = {place: dict.fromkeys(place.names(root)) for place in places}
    has_lists, is_tested = False, (root / "testing").is_dir() and "testing" not in {place.folder for place in places}
    for split, file, names in lists(root, "ImageSets", problems):
        has_lists = True
        for name in () if is_tested and split == TEST else names:
            place = next((place for place in places if name in own[place]), places[0])
            yield split, file, place, name
    if not has_lists and not problems:
        for place, names in own.items():
            yield from ((place.split, root / place.images, place, name) for name in names)


def _picture(
    root: Path, place: _Place, split: str, name: str, labels_of: Of, camera_of: Callable[[Path, tuple[int, int]], Camera]
) -> _Frame:
    """A picture with readable labels and calibration."""
    if not is_inside(name):
        raise StoreError("expected a picture below the folder; found a path that leads outside")
    file, size = picture_inside(root, f"{place.images}/{name}", *SUFFIXES)
    sequence, _, number = name.rpartition("/")
    if place.is_tracked and not (is_name(sequence) and number.isdecimal() and int(number) < _MOST_TRACKS):
        raise ValueError("expected a picture's name of a sequence and a number")
    own = sequence if place.is_tracked else name
    labels, calibrated = (file_inside(root, f"{at}/{own}.txt") for at in (place.labels, place.path_of("calib")))
    if not labels.is_file():
        raise ValueError(f"expected {place.labels}/{own}.txt, empty where there are no objects; found no such file")
    if unusable := labels_of(labels, place.is_tracked).unusable:
        raise ValueError(unusable)
    if calibrated.is_file():
        camera_of(calibrated, size)
    said = labels, calibrated if calibrated.is_file() else None
    instant = int(number) if place.is_tracked else 0
    return _Frame(split, name, file, size, said, sequence if place.is_tracked else "", instant)


def _unpictured(root: Path, places: tuple[_Place, ...], labels_of: Of) -> Iterator[str]:
    """Problems: labels, and frames of labels, without pictures."""
    for place in places:
        known: defaultdict[str, set[int]] = defaultdict(set)
        for name in place.names(root):
            sequence, _, number = name.rpartition("/")
            known[sequence if place.is_tracked else name].add(int(number) if place.is_tracked and number.isdecimal() else 0)
        for file in sorted((root / place.labels).glob("*.txt")):
            if file.stem not in known:
                yield f"{file}: expected pictures of these labels; found none in {root / place.images}"
                continue
            if place.is_tracked:
                frames = labels_of(file, True).rows
                yield from (f"{file}: expected a picture of frame {n}; found none" for n in frames if n not in known[file.stem])


def _shown(categories: Mapping[str, Category], labels_of: Of, first: int, picture: _Frame, index: int) -> Sample:
    """A picture with its objects; `first` is added to the numbers of tracks."""
    labels, calibrated = picture.said
    assert labels is not None
    rows = labels_of(labels, picture.is_tracked).rows.get(picture.instant, ())
    camera = _read_camera(calibrated, picture.size) if calibrated else None
    objects = [
        _object(number if row.track is None else row.track + first, row, categories[row.kind], picture, camera)
        for number, row in enumerate((row for row in rows if not row.is_region), 1)
    ]
    source: dict[str, Any] = {"file_name": picture.name + picture.file.suffix}
    if regions := [list(row.box) for row in rows if row.is_region]:
        source[DONT_CARE] = regions
    sample = unposed(picture, index, sorted(objects, key=lambda o: o.id), source)
    instant = picture.instant if picture.is_tracked else index
    sample = replace(sample, sequence=picture.sequence, instant=instant)
    return sample if camera is None else replace(sample, known_camera=camera, image_size=None)


def _object(number: int, row: _Row, category: Category, picture: _Frame, camera: Camera | None) -> ObjectAnnotation:
    """An object with its box and its pose; its `source` holds its COCO annotation."""
    x0, y0, x1, y1 = row.box
    source = {"bbox": [x0, y0, x1 - x0, y1 - y0], "area": (x1 - x0) * (y1 - y0), **row.said}
    known: dict[str, Any] = {} if row.solid is None else _standing(row.solid, camera)
    outside, hidden = row.said["truncated"], row.said["occluded"]
    more = {"occlusion_level": hidden} if hidden >= 0 else {}
    if picture.is_tracked and outside >= 0:
        more["truncation_level"] = int(outside)
    elif outside >= 0:
        known["truncation"] = float(outside)
    return foreign_object(number, category, picture.size, source, None, row.box, **known, extra=more)


def _standing(solid: tuple[float, ...], camera: Camera | None) -> dict[str, Any]:
    """Return the fields that follow from a 3D box: it is upright, and its front (-Y) is turned about the reference camera's y
    axis.
    """
    height, width, length, x, y, z, turn = solid
    half = np.array([width, length, height]) / 2
    c, s = np.cos(turn), np.sin(turn)
    world_from_object = rigid([[s, -c, 0], [c, s, 0], [0, 0, 1]], [x, z, height / 2 - y])
    camera_from_world = rigid(_LEVEL, np.zeros(3)) if camera is None else rigid(camera.R, camera.t)
    return placed(Box3d.between(-half, half).corners, world_from_object, camera_from_world, camera and camera.intrinsics)


@dataclass(frozen=True)
class _Row:
    """A line: its track (None in files of pictures); its numbers in `said`; its half-open box; its 3D box as height, width,
    length, the middle of its bottom and its turn about y (metres, radians), None if it has no 3D box.
    """

    kind: str
    track: int | None
    box: Box
    solid: tuple[float, ...] | None
    said: Mapping[str, float | int]

    @property
    def is_region(self) -> bool:
        """Return whether the line is a region that evaluations leave out."""
        return self.kind == _DONT_CARE_TYPE


@dataclass(frozen=True)
class _Labels:
    """A file's lines by frame (frame 0 in the file of a picture), the problems of invalid lines, and the reason why the file
    is unusable.
    """

    rows: Mapping[int, Sequence[_Row]] = field(default_factory=dict[int, Sequence[_Row]])
    problems: tuple[str, ...] = ()
    unusable: str = ""


def _read_labels(file: Path, is_tracked: bool) -> _Labels:
    """The lines of a file."""
    try:
        texts = text_of(file)
    except MISTAKES as error:
        return _Labels(unusable=f"expected lines of labels in {file.name}; found: {one_line(error)}")
    rows: defaultdict[int, list[_Row]] = defaultdict(list)
    problems, tracks = list[str](), set[tuple[int, int | None]]()
    for number, text in enumerate(texts, 1):
        if text.strip():
            try:
                frame, row = _parsed(text.split(), is_tracked)
                if is_tracked and not row.is_region and (frame, row.track) in tracks:
                    raise ValueError(f"expected every track once in a frame; found {row.track} again")
                tracks.add((frame, row.track))
                rows[frame].append(row)
            except ValueError as error:
                problems.append(f"{file}: line {number}: {error}")
    if (most := max(map(len, rows.values()), default=0)) > limits.MAX_IMPORTED_OBJECTS:
        told = f"{limits.MAX_IMPORTED_OBJECTS:,} objects in a picture (limit MAX_IMPORTED_OBJECTS)"
        return _Labels(unusable=f"expected at most {told} in {file.name}; found {most:,}")
    return _Labels(rows, tuple(problems))


def _parsed(words: Sequence[str], is_tracked: bool) -> tuple[int, _Row]:
    """The frame and the row of a line's words. Raises ValueError for impossible words."""
    begins = 2 if is_tracked else 0
    if len(words) - begins not in (_COLUMNS, _COLUMNS + 1):
        raise ValueError(f"expected {_COLUMNS + begins} values, or one more; found {len(words)}")
    frame, track = (_number(word, int) for word in words[:2]) if is_tracked else (0, None)
    if not 0 <= frame < _MOST_TRACKS or (track is not None and not -1 <= track < _MOST_TRACKS):
        raise ValueError(f"expected numbers of a frame and a track; found {words[0]:.20} {words[1]:.20}")
    kind, values = words[begins], [_number(word, float) for word in words[begins + 1 :]]
    if not all(abs(value) < _FARTHEST for value in values):
        raise ValueError(f"expected finite numbers below {_FARTHEST:,.0f}; found {' '.join(words[begins + 1 :]):.60}")
    outside, hidden, alpha, x0, y0, x1, y1 = values[:7]
    if kind != _DONT_CARE_TYPE and track is not None and track < 0:
        raise ValueError(f"expected a track; found {track} of a {kind:.40}")
    if not (outside in (-1, 0, 1, 2) if is_tracked else outside == -1 or 0 <= outside <= 1):
        raise ValueError(f"expected truncated {'-1 to 2' if is_tracked else '-1, or 0 to 1'}; found {outside:g}")
    if hidden not in (-1, 0, 1, 2, 3):
        raise ValueError(f"expected occluded -1 to 3; found {hidden:g}")
    if not (x0 <= x1 and y0 <= y1):
        raise ValueError(f"expected left <= right, top <= bottom; found {x0:g} {y0:g} {x1:g} {y1:g}")
    said = {"truncated": outside, "occluded": int(hidden), "alpha": alpha}
    if len(words) - begins > _COLUMNS:
        said["score"] = values[14]
    if track is not None:
        said["track_id"] = track
    return frame, _Row(kind, track, (x0, y0, x1 + 1, y1 + 1), _solid(values[7:14]), said)


def _number(word: str, kind: Callable[[str], Number]) -> Number:
    try:
        return kind(word)
    except ValueError:
        raise ValueError(f"expected a number; found {word!r:.60}") from None


def _solid(values: Sequence[float]) -> tuple[float, ...] | None:
    """A 3D box; None if all its sides are -1, the value for an unknown box."""
    if all(side <= 0 for side in values[:3]):
        return None
    if not all(side > 0 for side in values[:3]):
        raise ValueError(f"expected height, width and length above 0; found {' '.join(f'{side:g}' for side in values[:3])}")
    return tuple(values)


def _read_camera(file: Path, size: tuple[int, int]) -> Camera:
    """The left colour camera of a calibration; raises ValueError for a P2 that is not a pinhole's."""
    words = next((line.split() for line in text_of(file) if line.startswith(("P2:", "P2 "))), [])
    try:
        found = np.array(words[1:], np.float64)
    except ValueError:
        found = np.zeros(0)
    if found.shape != (12,) or not (np.abs(found) < _FARTHEST**2).all() or not _is_pinhole(found.reshape(3, 4)):
        raise ValueError(f"expected P2 of a pinhole, 12 numbers, in {file.name}; found {' '.join(words):.60}")
    k = found.reshape(3, 4)
    (fx, skew, cx, _), (_, fy, cy, _), _ = k.tolist()
    lens = Intrinsics(width=size[0], height=size[1], fx=fx, fy=fy, cx=cx + 0.5, cy=cy + 0.5, skew=skew)
    shift = transform(inverse(np.ascontiguousarray(k[:, :3])), k[:, 3]) + 0.0
    if not (np.abs(shift) < _FARTHEST).all():
        raise ValueError(f"expected P2 of a camera near the reference camera in {file.name}; found {' '.join(words):.60}")
    return Camera(lens, _LEVEL, shift)


def _is_pinhole(projection: NDArray[np.float64]) -> bool:
    """Return whether the left three columns are K of a pinhole with focal lengths of at least `SHORTEST`."""
    k = projection[:, :3]
    return bool(min(k[0, 0], k[1, 1]) >= _SHORTEST and k[1, 0] == 0 and (k[2] == (0, 0, 1)).all())
