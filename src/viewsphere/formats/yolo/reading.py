"""A YOLO data set from another source: data.yaml, pictures, and a file of labels for each."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path, PurePosixPath
from typing import Any, cast

import numpy as np
import yaml
from numpy.typing import NDArray

from viewsphere.errors import StoreError
from viewsphere.files import read_bytes, read_text
from viewsphere.formats.shared.reading.exif import shown_size
from viewsphere.formats.shared.reading.image_lists import MISTAKES, TRAIN, Listed, listed_dataset, one_line, text_of, unposed
from viewsphere.geometry.mask import rle_of_polygons
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.store import Category
from viewsphere.store.foreign import ForeignDataset, foreign_object
from viewsphere.store.paths import file_inside, is_name
from viewsphere.urls.inside import is_inside

_Float = NDArray[np.float64]

_BEYOND = 0.01
"""Share of the picture by which labels may extend beyond it, as in Ultralytics."""

_MOST_POINTS = 1000

NAMES = "obj.names"
"""Darknet's file of classes, a line each (https://github.com/AlexeyAB/darknet#how-to-train-to-detect-your-custom-objects)."""

DARKNET = "data/"
"""The beginning of paths in Darknet's lists. They are relative to the program's folder, and this is the data set's folder
there.
"""

IMAGES = "images"


PICTURES = (".png", ".jpg", ".jpeg", ".webp", ".bmp", ".tif", ".tiff")
SPLITS = ("train", "val", "test")
NO_SPLITS = frozenset({"path", "names", "nc", "kpt_shape", "flip_idx", "kpt_names", "download", "channels"})
LARGEST_FILE = 10_000_000
"""Greatest size of a data.yaml, bytes."""


def read(path: Path, *, keep_going: bool = False) -> ForeignDataset:
    """Return every picture and label of a folder with data.yaml, or of one such file, as viewsphere.formats.yolo describes. It
    also reads a folder with obj.names and lists, as in Darknet, and a data.yaml without splits beside `images`.

    Raises StoreError with every mistake: splits and pictures that are missing or outside, broken lines, classes that have no
    name. With `keep_going` these are left out and reported.
    """
    file = _described(path)
    told = _load(file)
    root, problems = file.parent, list[str]()
    categories = tuple(Category(number + 1, name, "") for number, name in enumerate(_names(told, file)))
    kind = _kind_of(told, file)
    pictures, most = tuple(_pictures(root, told, file, problems)), 1
    for picture in pictures:
        most = max(most, sum(1 for _ in _rows(picture, kind, len(categories), problems)))
    also = hashlib.sha256(read_bytes(file, "MAX_ANNOTATION_BYTES")).hexdigest()
    found = listed_dataset(file, pictures, categories, most, partial(_shown, categories, kind), problems, keep_going, also=also)
    named = {"keypoints": list(kind.names), "skeleton": list[Any]()}
    return replace(found, said={"categories": {one.name: named for one in categories}}) if kind.names else found


def _described(path: Path) -> Path:
    """The file that describes the data set."""
    named = [path / "data.yaml", *sorted(path.glob("*.yaml")), *sorted(path.glob("*.yml")), path / NAMES]
    found = [path] if path.is_file() else named
    file = next((one for one in found if one.is_file()), None)
    if file is None:
        raise StoreError(f"{path}: expected a YOLO data set (data.yaml); found no such file")
    return file


def _load(file: Path) -> dict[str, Any]:
    if file.name == NAMES:
        return _darknet(file)
    try:
        data = read_bytes(file, "MAX_ANNOTATION_BYTES")
        told = yaml.safe_load(data) if len(data) <= LARGEST_FILE else None
    except (OSError, ValueError, yaml.YAMLError, RecursionError) as error:
        raise StoreError(f"{file}: expected YOLO's YAML; found: {one_line(error)}") from None
    if not isinstance(told, dict):
        raise StoreError(f"{file}: expected names and folders of pictures; found something else")
    said = cast(dict[str, Any], told)
    return said if any(name not in NO_SPLITS and place for name, place in said.items()) else {**said, **_unsaid(file.parent)}


def _names(told: Mapping[str, Any], file: Path) -> list[str]:
    """The classes' names, by their numbers from 0."""
    names = told.get("names")
    if isinstance(names, dict):
        numbered = cast(dict[Any, Any], names)
        names = [numbered[i] for i in range(len(numbered))] if all(i in numbered for i in range(len(numbered))) else None
    found = cast(list[Any], names) if isinstance(names, list) else []
    if not found or not all(isinstance(name, str) and name for name in found) or len({*found}) < len(found):
        raise StoreError(
            f"{file}: expected names, a list of different texts or a mapping from 0 on; found {told.get('names')!r:.60}"
        )
    return found


def _pictures(root: Path, told: Mapping[str, Any], file: Path, problems: list[str]) -> Iterator[Listed]:
    """The pictures of all splits, each in the first split that contains it."""
    seen = set[str]()
    base = str(told.get("path") or "")
    inside = base if base and is_inside(base) and (root / base).is_dir() else ""
    for split, said in told.items():
        places = cast(list[Any], said) if isinstance(said, list) else [said]
        if split in NO_SPLITS or not isinstance(split, str) or said is None:
            continue
        for place in places:
            relative = _relative(root, inside, place) if isinstance(place, str) and place else None
            if relative is None or not is_name(split):
                if split in SPLITS:
                    problems.append(f"{file}: {split}: expected a folder or a list of pictures below; found {place!r:.100}")
                continue
            if relative not in seen:
                seen.add(relative)
                for name in _listed(root, relative, split, file, problems):
                    picture = _picture(root, split, name, file, problems) if name not in seen else None
                    seen.add(name)
                    if picture:
                        yield picture


def _relative(root: Path, inside: str, place: str) -> str | None:
    """A split's folder or list, from the root: below `path`, or else the root; a leading `../`, which Roboflow writes, is
    skipped, as in Ultralytics. None if it does not exist.
    """
    for prefix in (inside, ""):
        for said in (place, place.removeprefix("../")):
            path = PurePosixPath(prefix, said)
            if is_inside(said) and (root / path).exists():
                return path.as_posix()
    return None


def _listed(root: Path, relative: str, split: str, file: Path, problems: list[str]) -> Iterator[str]:
    """The paths of a folder's pictures, or of a list's pictures, relative to the root."""
    try:
        place = file_inside(root, relative)
        if place.is_dir():
            found = sorted(path for path in place.rglob("*") if path.suffix.lower() in PICTURES)
            yield from (path.relative_to(root).as_posix() for path in found)
            yield from _unpictured(root, relative, problems)
            return
        lines = read_text(place, "MAX_ANNOTATION_BYTES").splitlines()
    except (StoreError, OSError, ValueError) as error:
        problems.append(f"{file}: {split}: {one_line(error)}")
        return
    for said in filter(None, map(str.strip, lines)):
        names = [(PurePosixPath(relative).parent / path).as_posix() for path in (said, said.removeprefix(DARKNET))]
        name = next((name for name in names if is_inside(said) and (root / name).is_file()), None)
        if name is not None:
            yield name
        else:
            problems.append(f"{place}: expected a picture below the folder; found no {said!r:.100}")


def _unpictured(root: Path, relative: str, problems: list[str]) -> Iterator[str]:
    """Problems: labels without a picture."""
    labels = root / _labels_of(relative + "/x").rpartition("/")[0]
    for file in sorted(labels.rglob("*.txt")) if labels.is_dir() and labels != root / relative else ():
        beside = root / relative / file.relative_to(labels)
        if not any(beside.with_suffix(kind).exists() or beside.with_suffix(kind.upper()).exists() for kind in PICTURES):
            problems.append(f"{file}: expected a picture of these labels; found none in {root / relative}")
    yield from ()


def _labels_of(picture: str) -> str:
    """Return the path of a picture's labels: the last folder `images` of its path becomes `labels`."""
    head, images, tail = f"/{picture}".rpartition("/images/")
    return str(PurePosixPath(f"{head}/labels/{tail}" if images else f"/{picture}").with_suffix(".txt"))[1:]


def _picture(root: Path, split: str, name: str, file: Path, problems: list[str]) -> Listed | None:
    try:
        place, labels = file_inside(root, name), file_inside(root, _labels_of(name))
        return Listed(split, name, place, shown_size(place), (labels if labels.is_file() else None,))
    except MISTAKES as error:
        problems.append(f"{file}: {split}: expected a picture that can be read; found {name}: {one_line(error)}")
        return None


def _rows(picture: Listed, kind: _Kind, classes: int, problems: list[str]) -> Iterator[_Row]:
    """The valid lines of a picture's labels."""
    (labels,) = picture.said
    if labels is None:
        return
    try:
        lines = text_of(labels)
    except MISTAKES as error:
        problems.append(f"{labels}: expected lines of numbers; found: {error}")
        return
    for number, text in enumerate(lines, 1):
        if text.strip():
            try:
                yield _parsed_line(text, kind, classes)
            except ValueError as error:
                problems.append(f"{labels}: line {number}: {error}")


def _shown(categories: Sequence[Category], kind: _Kind, picture: Listed, index: int) -> Sample:
    rows = _rows(picture, kind, len(categories), [])
    objects = [_object(number, row, categories, picture, kind) for number, row in enumerate(rows, 1)]
    flips = {"flip_idx": list(kind.flips)} if kind.flips else {}
    return unposed(picture, index, objects, {"file_name": picture.name, **flips})


def _object(number: int, row: _Row, categories: Sequence[Category], picture: Listed, kind: _Kind) -> ObjectAnnotation:
    """An object with the data of its line; its `source` holds its COCO annotation."""
    source = _coco_of(row, picture.size)
    more: dict[str, Any] = {}
    if row.points is not None:
        seen = row.points[:, 2]
        places = np.where(seen[:, None] > 0, row.points[:, :2] * picture.size, math.nan)
        states = np.select([seen > 1, seen > 0], [0, 1], 3)
        more = {"keypoint_names": kind.names, "keypoints": places, "keypoint_states": states.astype(np.int64)}
    if row.corners is not None and len(row.corners) == 4:
        more["obb"] = row.corners * picture.size
    x, y, width, height = source["bbox"]
    outline, box = source.get("segmentation"), (x, y, x + width, y + height)
    mask = rle_of_polygons(picture.size[1], picture.size[0], outline) if outline else None
    return foreign_object(number, categories[row.number], picture.size, source, mask, box, **({"extra": more} if more else {}))


def _darknet(file: Path) -> dict[str, Any]:
    """Return a data.yaml for a folder with `obj.names` and lists of pictures: `<split>.txt`, or `images.txt`, which FiftyOne
    writes. Raises StoreError if the names cannot be read.
    """
    try:
        names = [line.strip() for line in text_of(file) if line.strip()]
    except MISTAKES as error:
        raise StoreError(f"{file}: expected a line for each class; found: {one_line(error)}") from None
    lists = {path.stem: path.name for path in sorted(file.parent.glob("*.txt"))}
    if IMAGES in lists:
        lists.setdefault(TRAIN, lists.pop(IMAGES))
    return {"names": names, **lists}


def _unsaid(root: Path) -> dict[str, Any]:
    """The splits of a folder whose data.yaml names none: the folders in `images`, or `images` itself."""
    splits = {split: f"{IMAGES}/{split}" for split in ("train", "val", "test") if (root / IMAGES / split).is_dir()}
    return splits or {TRAIN: IMAGES}


@dataclass(frozen=True)
class _Kind:
    """The properties of points in data.yaml: their names (or numbers if it has no names), and their swaps in a mirror image.
    `each` point has 2 numbers, x and y, or 3, with its visibility.
    """

    names: tuple[str, ...] = ()
    each: int = 3
    flips: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class _Row:
    """A line: class, and, as shares of the picture, box (centre x, y, width, height), polygon (N, 2), points (N, 3)."""

    number: int
    box: tuple[float, float, float, float] | None = None
    corners: _Float | None = None
    points: _Float | None = None


def _kind_of(told: Mapping[str, Any], file: Path) -> _Kind:
    """Return the properties of points in a data.yaml; raises StoreError for invalid ones."""
    shape, flips, names = told.get("kpt_shape"), told.get("flip_idx") or [], told.get("kpt_names") or {}
    if shape is None:
        return _Kind()
    if not (_whole(shape) and len(shape) == 2 and 0 < shape[0] <= _MOST_POINTS and shape[1] in (2, 3)):
        raise StoreError(f"{file}: expected kpt_shape [number, 2 or 3]; found {shape!r:.60}")
    if flips and not (_whole(flips) and sorted(flips) == list(range(shape[0]))):
        raise StoreError(f"{file}: expected flip_idx, every point's number once; found {flips!r:.60}")
    named = cast(dict[Any, Any], names) if isinstance(names, dict) else {}
    known = {tuple(map(str, own)) for own in named.values() if isinstance(own, list)}
    if not all(len({*own}) == shape[0] for own in known):
        raise StoreError(f"{file}: expected kpt_names, {shape[0]} different names for each class; found {names!r:.60}")
    numbered = tuple(map(str, range(shape[0])))
    return _Kind(known.pop() if len(known) == 1 else numbered, shape[1], tuple(flips))


def _whole(values: Any) -> bool:
    return isinstance(values, list) and all(type(value) is int for value in cast(list[Any], values))


def _parsed_line(text: str, kind: _Kind, classes: int) -> _Row:
    """Return the row of a line; raises ValueError for an invalid line."""
    try:
        number, *values = map(float, text.split())
    except ValueError:
        raise ValueError(f"expected numbers; found {text!r:.60}") from None
    if number not in range(classes):
        raise ValueError(f"expected a class from 0 to {classes - 1}; found {text.split(maxsplit=1)[0]!r:.60}")
    found = np.array(values)
    if not np.isfinite(found).all():
        raise ValueError(f"expected finite numbers; found {text!r:.60}")
    row = _row(int(number), found, kind)
    for shares in (np.array(row.box or ()), row.corners, None if row.points is None else row.points[:, :2]):
        if shares is not None and not ((shares >= -_BEYOND) & (shares <= 1 + _BEYOND)).all():
            raise ValueError(f"expected shares of the picture, 0 to 1; found {text!r:.60}")
    return row


def _row(number: int, values: _Float, kind: _Kind) -> _Row:
    count, pointed = len(values), 4 + len(kind.names) * kind.each
    if count == 4 or (kind.names and count == pointed):
        x, y, width, height = values[:4].tolist()
        if width < 0 or height < 0:
            raise ValueError(f"expected a width and a height from 0 on; found {width:g}, {height:g}")
        points = values[4:].reshape(-1, kind.each) if count > 4 else None
        if points is not None and kind.each == 2:
            seen = np.where(points.any(axis=1), 2.0, 0.0)
            points = np.column_stack([points, seen])
        if points is not None and not np.isin(points[:, 2], (0, 1, 2)).all():
            raise ValueError(f"expected points that are 0, 1 or 2; found {points[:, 2].tolist()!r:.60}")
        return _Row(number, (x, y, width, height), None, points)
    if kind.names:
        raise ValueError(f"expected a class and 4 or {pointed} numbers; found {count}")
    if count < 6 or count % 2:
        raise ValueError(f"expected a class and 4 numbers, or x and y of three corners or more; found {count} numbers")
    return _Row(number, None, values.reshape(-1, 2))


def _coco_of(row: _Row, size: tuple[int, int]) -> dict[str, Any]:
    """A line as COCO's annotation, in pixels."""
    if row.corners is not None:
        corners = row.corners * size
        (x0, y0), (x1, y1) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
        turned = np.roll(corners, -1, axis=0)
        area = abs(float((corners[:, 0] * turned[:, 1] - corners[:, 1] * turned[:, 0]).sum())) / 2
        return {"bbox": [x0, y0, x1 - x0, y1 - y0], "area": area, "segmentation": [corners.ravel().tolist()]}
    assert row.box is not None
    x, y, width, height = (share * side for share, side in zip(row.box, size * 2, strict=True))
    said: dict[str, Any] = {"bbox": [x - width / 2, y - height / 2, width, height], "area": width * height}
    if row.points is not None:
        places = np.where(row.points[:, 2:] > 0, row.points[:, :2] * size - 0.5, 0.0)  # of pixels' centres, as in COCO
        marked = zip(places.tolist(), row.points[:, 2].tolist(), strict=True)
        said["keypoints"] = [number for (x, y), seen in marked for number in (x, y, int(seen))]
        said["num_keypoints"] = int((row.points[:, 2] > 0).sum())
    return said
