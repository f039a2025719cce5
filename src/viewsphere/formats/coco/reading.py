"""A COCO data set from another source: instances files and their images (https://cocodataset.org/#format-data)."""

from __future__ import annotations

import hashlib
import json
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, cast

import numpy as np

from viewsphere.errors import StoreError, UserError
from viewsphere.files import read_bytes
from viewsphere.formats.coco.categories import KEYPOINTS, named_points
from viewsphere.formats.coco.source_metadata import licences_by_id, licensed, metadata_of_splits
from viewsphere.formats.shared.reading.exif import shown_size, upright
from viewsphere.geometry.mask import rle_of_polygons, rle_of_runs, rle_runs
from viewsphere.model.sample import Box, Sample
from viewsphere.store import Category
from viewsphere.store.foreign import ForeignDataset, ForeignFrame, foreign_object, refuse_broken
from viewsphere.store.paths import file_inside, is_name
from viewsphere.store.texts import parsed
from viewsphere.urls.inside import is_inside

KINDS = ("instances_", "person_keypoints_")
"""Possible starts of annotation file names, before the split; the first one present in a folder is used."""

BARE = "image_info_"
"""The start of file names for pictures without annotations."""

NAMELESS = ("labels", "annotations", "_annotations.coco", "coco_annotations")
"""File names of FiftyOne, supervision, Roboflow and BlenderProc, one for each split and named by its folder."""

ONLY = "train"
"""The split of such a file outside a folder of splits."""

FOLDERS = ("", "data", "images")
"""The possible picture folders beside such a file."""


LARGEST_ID = 2**63
LARGEST_CATEGORY = 2**31
"""Ids must be below these limits; COCO's own crowds have annotation ids of twelve digits."""

LARGEST_NUMBER = 2**53
MOST_IMAGES_BESIDE = 10
"""Largest distance of a polygon's corner from the image, in image sizes."""

HEAD = ("info", "licenses", "categories")
"""The parts of a file that describe the file itself."""


def read(path: Path, *, keep_going: bool = False) -> ForeignDataset:
    """Return every image and annotation of a folder with instances files, or of one such file.

    Every file becomes a split, named like the file without `instances_`, or like its folder. Its images are looked up in the
    folders that COCO and related data sets use (see `_annotation_files`). Ids of categories are kept. Raises StoreError with
    every mistake: dangling and repeated ids, missing images, invalid boxes and segmentations. With `keep_going` broken entries
    are left out and reported.
    """
    files = _annotation_files(path)
    root = path if path.is_dir() else path.parent
    if path.is_file() and root.resolve().name == "annotations":
        root = root.resolve().parent
    parts = [_read_split(split, file, root) for split, file in files]
    problems = [problem for part in parts for problem in part.problems]
    problems += _clashes(parts)
    if not keep_going:
        refuse_broken(problems)
    count = sum(len(part.images) for part in parts)
    if not count:
        raise StoreError(f"{path}: expected images that can be used; found none")
    categories = {c.id: c for part in parts for c in part.categories.values()}
    return ForeignDataset(
        name=path.resolve().stem,
        digest=_digest(files, problems),
        categories=tuple(categories[i] for i in sorted(categories)),
        splits=tuple(part.split for part in parts),
        channels=("rgb",),
        count=count,
        poses=0,
        max_objects=max(1, *(len(found) for part in parts for found in part.annotations.values()), 1),
        frames=partial(_frames, parts),
        left_out=tuple(problems),
        said=metadata_of_splits((part.split, part.head) for part in parts),
    )


def _digest(files: Sequence[tuple[str, Path]], left_out: Sequence[str]) -> str:
    """SHA-256 of the files' contents, and of the messages about entries that were left out."""
    digest = hashlib.sha256()
    for split, file in files:
        digest.update(f"{split}\0{file.name}\0{hashlib.sha256(read_bytes(file, 'MAX_RECORD_BYTES')).hexdigest()}".encode())
    for problem in left_out:
        digest.update(problem.encode(errors="backslashreplace"))
    return digest.hexdigest()


@dataclass(frozen=True)
class _Split:
    """One instances file: its valid entries, and the problems of the others. `head`: the file's metadata."""

    split: str
    file: Path
    head: dict[str, Any]
    categories: dict[int, Category]
    images: tuple[tuple[dict[str, Any], Path], ...]
    annotations: dict[int, list[dict[str, Any]]]
    problems: tuple[str, ...]


def _read_split(split: str, file: Path, root: Path) -> _Split:
    try:
        data = parsed(read_bytes(file, "MAX_RECORD_BYTES"))
    except (OSError, ValueError) as error:
        raise StoreError(f"{file}: expected COCO's JSON; found: {error}") from None
    if not isinstance(data, dict) or not all(isinstance(data.get(k), list) for k in ("images", "annotations", "categories")):
        raise StoreError(f"{file}: expected lists of images, annotations and categories; found something else")
    lists, head = cast(dict[str, list[Any]], data), {key: data[key] for key in HEAD if key in data}
    problems: list[str] = []
    try:
        json.dumps(head, allow_nan=False)
    except ValueError:
        problems.append(f"{file}: expected finite numbers in {', '.join(HEAD)}; found NaN or infinity")
        head = {}
    categories = {
        c["id"]: Category(c["id"], str(c["name"]), str(c.get("supercategory") or ""))
        for c in _with_ids(lists["categories"], "category", file, problems, LARGEST_CATEGORY)
        if isinstance(c.get("name"), str) or problems.append(f"{file}: category {c['id']}: expected a name; found none")
    }
    images: list[tuple[dict[str, Any], Path]] = []
    for image in _with_ids(lists["images"], "image", file, problems):
        try:
            place = _picture_file(image, root, split, file.parent)
            problem = _image_problem(image, place)
        except StoreError as error:
            place, problem = None, str(error)
        if problem or place is None:
            problems.append(f"{file}: image {image['id']}: {problem}")
        else:
            images.append(({**image, "width": int(image["width"]), "height": int(image["height"])}, place))
    sizes = {image["id"]: (image["width"], image["height"]) for image, _ in images}
    points = _points(head)
    known = {image["id"] for image in lists["images"] if isinstance(image, dict) and _is_id(image.get("id"))}
    annotations: defaultdict[int, list[dict[str, Any]]] = defaultdict(list)
    for annotation in _with_ids(lists["annotations"], "annotation", file, problems):
        problem = _annotation_problem(annotation, categories, known, sizes) or _points_problem(annotation, points)
        if problem:
            problems.append(f"{file}: annotation {annotation['id']}: {problem}")
        elif annotation["image_id"] in sizes:
            annotations[annotation["image_id"]].append(annotation)
    return _Split(split, file, head, categories, tuple(images), annotations, tuple(problems))


def _is_id(value: object, largest: int = LARGEST_ID) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value < largest


def _with_ids(
    values: Sequence[Any], what: str, file: Path, problems: list[str], largest: int = LARGEST_ID
) -> Iterator[dict[str, Any]]:
    """The entries that are mappings with a valid and unique id; the problems of the others are appended."""
    seen: set[int] = set()
    for i, value in enumerate(values):
        number = value.get("id") if isinstance(value, dict) else None
        if not _is_id(number, largest):
            problems.append(f"{file}: {what} number {i}: expected a whole number as id; found {number!r}")
        elif number in seen:
            problems.append(f"{file}: {what} {number}: expected every id once; found it again")
        else:
            seen.add(cast(int, number))
            yield cast(dict[str, Any], value)


def _image_problem(image: dict[str, Any], place: Path | None) -> str | None:
    if place is None:
        return f"expected its file below the folder; found no {image.get('file_name')!r}"
    try:
        size = shown_size(place, (image.get("width"), image.get("height")))
    except (OSError, ValueError, SyntaxError, UserError) as error:
        return f"expected a readable image; found: {error}"
    told = image.get("width"), image.get("height")
    try:
        json.dumps(image, allow_nan=False)
    except ValueError:
        return "expected finite numbers; found NaN or infinity"
    return None if size == told else f"expected {place.name} of {told[0]} x {told[1]} pixels; found {size[0]} x {size[1]}"


def _annotation_problem(
    annotation: dict[str, Any], categories: dict[int, Category], images: set[int], sizes: dict[int, tuple[int, int]]
) -> str | None:
    if not _is_id(annotation.get("image_id")) or annotation["image_id"] not in images:
        return f"expected the id of an image; found {annotation.get('image_id')!r}"
    if not _is_id(annotation.get("category_id")) or annotation["category_id"] not in categories:
        return f"expected the id of a category; found {annotation.get('category_id')!r}"
    box, outline = annotation.get("bbox"), annotation.get("segmentation")
    if box is not None and not (_are_numbers(box, 4) and box[2] >= 0 <= box[3]):
        return f"expected bbox [x, y, width, height]; found {box!r:.60}"
    if not box and not outline:
        return "expected a bbox or a segmentation; found neither"
    if annotation.get("area") is not None and not _are_numbers([annotation["area"]], 1):
        return f"expected a number as area; found {annotation['area']!r:.60}"
    try:
        json.dumps(annotation, allow_nan=False)
    except ValueError:
        return "expected finite numbers; found NaN or infinity"
    size = sizes.get(annotation["image_id"])
    if outline and size:
        try:
            _rle(outline, size)
        except Exception as error:  # pycocotools' C code raises errors of many kinds
            return f"expected a segmentation of COCO; found {outline!r:.60} ({error})"
    return None


def _points(head: dict[str, Any]) -> dict[int, tuple[str, ...]]:
    """Names of the points of each category with points."""
    named = metadata_of_splits([("", head)]).get("categories", {})
    categories = (c for c in head.get("categories", ()) if isinstance(c, dict) and _is_id(c.get("id")))
    points = {c["id"]: named.get(str(c.get("name")), {}).get(KEYPOINTS) for c in categories}
    return {number: tuple(names) for number, names in points.items() if names}


def _points_problem(annotation: dict[str, Any], points: dict[int, tuple[str, ...]]) -> str | None:
    found, names = annotation.get(KEYPOINTS), points.get(annotation["category_id"])
    if names is None or found is None or _are_numbers(found, 3 * len(names)):
        return None
    return f"expected keypoints [x, y, v, ...] of the category's {len(names)} points; found {found!r:.60}"


def _are_numbers(value: Any, count: int | None) -> bool:
    values = cast(list[Any], value) if isinstance(value, list) else []
    return len(values) == (count or len(values)) and all(
        isinstance(v, (int, float)) and abs(v) < LARGEST_NUMBER for v in values
    )


def _rle(outline: Any, size: tuple[int, int]) -> str | None:
    """The run-length code of polygons or run lengths, as pycocotools draws them; None without an outline. No pixel is drawn,
    because a few characters may encode a huge picture.

    Raises ValueError for outlines on which pycocotools, which does not check its input, could crash.
    """
    width, height = size
    if not outline:
        return None
    if isinstance(outline, list):
        polygons = cast(list[Any], outline)
        reach = MOST_IMAGES_BESIDE * max(size)
        if not all(_are_numbers(p, None) and len(p) >= 6 and max(map(abs, p)) <= reach for p in polygons):
            raise ValueError("expected polygons of three corners or more, near the image")
        return rle_of_polygons(height, width, [p[: len(p) // 2 * 2] for p in polygons])
    if outline["size"] != [height, width]:
        raise ValueError(f"expected run lengths of size {[height, width]}")
    counts = outline["counts"]
    if isinstance(counts, str):
        return rle_of_runs(height, width, rle_runs(height, width, counts))
    if not all(_is_id(c) for c in counts) or sum(counts) != width * height:
        raise ValueError("expected run lengths that fill the image")
    return rle_of_runs(height, width, np.array(counts, np.int64))


def _clashes(parts: Sequence[_Split]) -> Iterator[str]:
    """Problems: categories with the same id that differ between files."""
    first: dict[int, tuple[Category, Path]] = {}
    for part in parts:
        for category in part.categories.values():
            other, file = first.setdefault(category.id, (category, part.file))
            if other != category:
                yield f"{part.file}: category {category.id}: expected {other.name!r}, as in {file}; found {category.name!r}"


def _frames(parts: Sequence[_Split]) -> Iterator[ForeignFrame]:
    index = 0
    for part in parts:
        points, licences = _points(part.head), licences_by_id(part.head)
        for image, file in part.images:
            sample = _sample(part, points, licensed(image, licences), index)
            yield ForeignFrame(sample, {"rgb": upright(file, (sample.width, sample.height))})
            index += 1


def _sample(part: _Split, points: Mapping[int, tuple[str, ...]], image: dict[str, Any], index: int) -> Sample:
    size = image["width"], image["height"]
    objects = tuple(
        foreign_object(
            number,
            part.categories[source["category_id"]],
            size,
            source,
            _rle(source.get("segmentation"), size),
            _corners(source),
            **_more(points.get(source["category_id"]), source),
        )
        for number, source in enumerate(part.annotations.get(image["id"], ()), 1)
    )
    told = {name: value for name, value in image.items() if name not in {"id", "width", "height"}}
    return Sample(index, part.split, None, None, objects, {}, {}, size, told)


def _more(names: tuple[str, ...] | None, source: dict[str, Any]) -> dict[str, Any]:
    """The label of an annotation's points, if it has any."""
    return {"extra": named_points(names, source[KEYPOINTS])} if names and source.get(KEYPOINTS) else {}


def _corners(source: dict[str, Any]) -> Box | None:
    """The annotation's box, else the box around its polygons; None if it has neither."""
    if box := source.get("bbox"):
        return box[0], box[1], box[0] + box[2], box[1] + box[3]
    outline = source.get("segmentation")
    if not isinstance(outline, list):
        return None
    numbers = [float(v) for polygon in cast(list[list[float]], outline) for v in polygon[: len(polygon) // 2 * 2]]
    return min(numbers[::2]), min(numbers[1::2]), max(numbers[::2]), max(numbers[1::2])


def _annotation_files(path: Path) -> list[tuple[str, Path]]:
    """The files of a folder, or this one file, each with its split. Raises StoreError if there are none."""
    if path.is_file():
        return [(_split_of(path), path)]
    for folder in (path / "annotations", path):
        kinds = (sorted(folder.glob(f"{kind}*.json")) for kind in KINDS)
        if found := next(filter(None, kinds), None) or sorted(folder.glob("*.json")):
            told = [(_split_of(file) if len(found) == 1 else _stem(file), file) for file in found]
            return told + _bare(path, folder, [split for split, _ in told])
    parts = ((folder.name, folder / f"{name}.json") for folder in sorted(path.glob("*")) for name in NAMELESS)
    if nested := {split: file for split, file in parts if file.is_file() and is_name(split)}:
        return list(nested.items())
    raise StoreError(f"{path}: expected a COCO data set (annotations/instances_<split>.json); found no such file")


def _picture_file(image: dict[str, Any], root: Path, split: str, beside: Path) -> Path | None:
    """The file of a picture: below the root, where COCO and related data sets keep it, or below `beside`, the folder of the
    annotations; None if there is none. Raises StoreError for a path that leads outside.
    """
    name = image.get("file_name")
    if not isinstance(name, str) or not name or not is_inside(name):
        return None
    below = [(root, f"{split}/{name}"), (root, f"images/{split}/{name}"), (root, f"images/{name}"), (root, name)]
    for folder, path in (*below, *((beside, f"{inner}/{name}" if inner else name) for inner in FOLDERS)):
        with suppress(OSError):  # the name may be too long for the file system
            if (folder / path).is_file():
                return file_inside(folder, path)
    return None


def _stem(file: Path) -> str:
    return next((file.stem.removeprefix(kind) for kind in (*KINDS, BARE) if file.stem.startswith(kind)), file.stem)


def _split_of(file: Path) -> str:
    """The split of a file that is the only one of its folder."""
    return ONLY if file.stem in NAMELESS else _stem(file)


def _bare(root: Path, folder: Path, splits: Sequence[str]) -> list[tuple[str, Path]]:
    """Splits with pictures but without annotations, as datumaro writes them."""
    found = [(_stem(file), file) for file in sorted(folder.glob(f"{BARE}*.json"))]
    return [
        (split, file)
        for split, file in found
        if split not in splits and any((root / place / split).is_dir() for place in ("images", ""))
    ]
