"""A PASCAL VOC data set from another source: lists, pictures, an XML for each, and masks."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import StoreError
from viewsphere.files import read_bytes, read_text
from viewsphere.formats.shared.reading.exif import shown_size
from viewsphere.formats.shared.reading.image_lists import (
    MISTAKES,
    SUFFIXES,
    TRAIN,
    Listed,
    listed_dataset,
    lists,
    one_line,
    unposed,
)
from viewsphere.formats.shared.reading.voc_maps import boxes_of, check_map, numbered, numbers_of, unannotated
from viewsphere.formats.voc.writing import BOX
from viewsphere.geometry.mask import encode_rle, mask_polygons, rle_of_polygons
from viewsphere.model.sample import Box, ObjectAnnotation, Sample
from viewsphere.store import Category
from viewsphere.store.foreign import ForeignDataset, foreign_object, refuse_broken
from viewsphere.store.paths import file_inside
from viewsphere.urls.inside import is_inside

FLAGS = ("truncated", "occluded", "difficult")
MAPS = ("Object", "Class")
FOLDERS = (("Annotations", "JPEGImages"), ("", "JPEGImages"), ("annotations", "images"), ("labels", "data"))
"""Folders of XML files and of pictures: VOC's (without the first if nothing has a box), supervision's, and FiftyOne's."""

MOST_POLYGONS = 100
"""Greatest number of polygons of an object."""

BESIDE = 10
"""Largest distance of a polygon's corner, in image sizes."""


@dataclass(frozen=True)
class _Kit:
    """A data set's folder, and its folders of annotations (empty if it has none) and of pictures. Also the names in its
    labelmap.txt, and whether a picture needs an annotation. datumaro, which writes labelmap.txt, writes no annotation for a
    picture without boxes.
    """

    root: Path
    xml: str
    pictures: str
    names: tuple[str, ...]

    @property
    def is_strict(self) -> bool:
        return not self.names


@dataclass(frozen=True)
class _Object:
    """An object of an annotation: its place in the XML from 1, its name, its box as given, its polygons with pixels counted
    from 1, and its other fields.
    """

    place: int
    name: str
    box: Box
    said: Mapping[str, Any]
    polygons: tuple[tuple[float, ...], ...] = ()

    def corners(self, first: int) -> Box:
        """The half-open box, if the first pixel has this number."""
        return self.box[0] - first, self.box[1] - first, *self.box[2:]


def read(path: Path, *, keep_going: bool = False) -> ForeignDataset:
    """Return every picture and annotation of a folder with `Annotations` and `JPEGImages`, or with VOCdevkit/VOC<year>. It also
    reads the folders of supervision (`annotations`, `images`) and FiftyOne (`labels`, `data`).

    Boxes count from 1 and end with their last pixel, as in VOC. If any begins before 1, all count from 0 and end after their
    last pixel, as in datumaro and FiftyOne.

    Raises StoreError with every mistake: pictures and annotations that are missing or outside, and broken objects. With
    `keep_going` these are left out and reported.
    """
    kit = _kit(path)
    problems: list[str] = []
    pictures = tuple(_pictures(kit, problems))
    listed, most, first = kit.names, 1, 1
    names = dict.fromkeys(listed)
    for picture in pictures:
        found = list(_objects(picture, listed, problems))
        names |= dict.fromkeys(o.name for o in found)
        most = max(most, len(found))
        if picture.said[0] and any(min(o.box[:2]) < 1 for o in found):
            first = 0
    if not keep_going:
        refuse_broken(problems)
    if not names:
        raise StoreError(f"{kit.root}: expected pictures and objects that can be used; found none")
    ordered = listed or sorted(names)
    categories = {name: Category(number, name, "") for number, name in enumerate(ordered, 1)}
    shown = partial(_shown, categories, listed, first)
    return listed_dataset(path, pictures, categories.values(), most, shown, problems, keep_going, also="\n".join(listed))


def _kit(path: Path) -> _Kit:
    """The folders with the annotations and the pictures."""
    found = [path, *sorted(path.glob("VOC*")), *sorted(path.glob("VOCdevkit/VOC*"))]
    for root in found:
        for xml, pictures in FOLDERS:
            if (xml or (root / "SegmentationObject").is_dir()) and (root / xml).is_dir() and (root / pictures).is_dir():
                return _Kit(root, xml, pictures, tuple(_listed_names(root)))
    raise StoreError(f"{path}: expected a PASCAL VOC data set (Annotations, JPEGImages, ImageSets); found no such folders")


def _listed_names(root: Path) -> list[str]:
    """The categories of a labelmap.txt, in the order of their numbers; none without one."""
    file = root / "labelmap.txt"
    if not file.is_file():
        return []
    try:
        rows = [
            row.split(":")[0] for row in read_text(file, "MAX_ANNOTATION_BYTES").splitlines() if row and not row.startswith("#")
        ]
    except (OSError, ValueError) as error:
        raise StoreError(f"{file}: expected a line for each category; found: {error}") from None
    return list(dict.fromkeys(name for name in rows if name and name != "background"))


def _pictures(kit: _Kit, problems: list[str]) -> Iterator[Listed]:
    """The pictures of all lists, each in the first list that contains it."""
    seen = set[str]()
    for split, source, names in _lists(kit, problems):
        for name in names:
            if name not in seen:
                seen.add(name)
                try:
                    yield _picture(kit, split, name)
                except MISTAKES as error:
                    problems.append(f"{source}: {name}: {one_line(error)}")


def _lists(kit: _Kit, problems: list[str]) -> Iterator[tuple[str, Path, Sequence[str]]]:
    """Each split with its list and the names of its pictures; lists of categories, whose lines also have a number, are
    skipped.
    """
    any_list, folder = False, "ImageSets/Main"
    if not (kit.root / folder).is_dir():
        folder = "ImageSets/Segmentation"
    for split, file, names in lists(kit.root, folder, problems):
        if not all(name.rpartition(" ")[2] in ("1", "-1", "0") and " " in name for name in names):
            any_list = True
            yield split, file, names
    if not any_list and not problems:
        place = kit.root / kit.xml
        found = sorted(place.rglob("*.xml"))
        yield TRAIN, place, [file.relative_to(place).as_posix().removesuffix(".xml") for file in found]


def _picture(kit: _Kit, split: str, name: str) -> Listed:
    if not is_inside(name):
        raise StoreError("expected a picture below the folder; found a path that leads outside")
    root, xml = kit.root, file_inside(kit.root, f"{kit.xml or 'Annotations'}/{name}.xml")
    if kit.is_strict and not xml.is_file():
        raise StoreError(f"expected {xml}; found no such file")
    paths = [f"{kit.pictures}/{name}{suffix}" for suffix in SUFFIXES]
    path = next((one for one in paths if (root / one).is_file()), None)
    if path is None:
        raise StoreError(f"expected a picture {paths[0]}; found no such file")
    file, maps = file_inside(root, path), [file_inside(root, f"Segmentation{kind}/{name}.png") for kind in MAPS]
    said = (0, 0)
    if xml.is_file():
        said = tuple(int(float(_parsed(xml).findtext(f"size/{key}") or 0)) for key in ("width", "height"))
    size = shown_size(file, said)
    if all(said) and said != size:
        raise StoreError(f"expected {said[0]} x {said[1]} pixels, as {xml.name} says; found {size[0]} x {size[1]}")
    there = tuple(one if one.is_file() else None for one in (xml, *maps))
    for one in filter(None, there[1:]):
        check_map(one, size)
    return Listed(split, name, file, size, there)


def _parsed(xml: Path) -> ElementTree.Element:
    data = read_bytes(xml, "MAX_ANNOTATION_BYTES")
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise StoreError(f"expected a plain annotation in {xml.name}; found one with entities")
    return ElementTree.fromstring(data)


def _objects(picture: Listed, listed: Sequence[str], problems: list[str]) -> Iterator[_Object]:
    """The valid objects of an annotation or, for a picture without one, of its maps."""
    xml = picture.said[0]
    if xml is None:
        yield from _unannotated(picture, listed, problems)
        return
    for place, element in enumerate(_parsed(xml).findall("object"), 1):
        try:
            yield _object(place, element, listed, BESIDE * max(picture.size))
        except ValueError as error:
            problems.append(f"{xml}: object {place}: {error}")


def _object(place: int, element: ElementTree.Element, listed: Sequence[str], reach: int) -> _Object:
    name = (element.findtext("name") or "").strip()
    if not name or (listed and name not in listed):
        raise ValueError(f"expected a name{' of labelmap.txt' if listed else ''}; found {name!r:.60}")
    texts = [element.findtext(f"bndbox/{key}") for key in BOX]
    try:
        x0, y0, x1, y1 = (float(text or "nan") for text in texts)
    except ValueError:
        raise ValueError(f"expected numbers as bndbox; found {texts}") from None
    if not (math.isfinite(x0 + y0 + x1 + y1) and x0 <= x1 and y0 <= y1 and max(map(abs, (x0, y0, x1, y1))) < 1e9):
        raise ValueError(f"expected bndbox with xmin <= xmax, ymin <= ymax; found {texts}")
    flags = {key: element.findtext(key) for key in FLAGS}
    if wrong := next((key for key, text in flags.items() if text not in (None, "0", "1")), None):
        raise ValueError(f"expected {wrong} 0 or 1; found {flags[wrong]!r:.60}")
    said: dict[str, Any] = {key: int(text) for key, text in flags.items() if text is not None}
    if pose := element.findtext("pose"):
        said["pose"] = pose
    polygons = tuple(_polygon(one, reach) for one in islice(element.findall("polygon"), MOST_POLYGONS))
    return _Object(place, name, (x0, y0, x1, y1), said, polygons)


def _polygon(element: ElementTree.Element, reach: int) -> tuple[float, ...]:
    """The corners x1, y1, x2, y2, ... of a polygon, none of them farther than `reach` from the first pixel."""
    texts = [corner.text or "" for corner in element]
    try:
        found = tuple(map(float, texts))
    except ValueError:
        raise ValueError(f"expected numbers as polygon; found {texts!r:.60}") from None
    if len(found) < 6 or len(found) % 2 or not all(abs(number) <= reach for number in found):
        raise ValueError(f"expected a polygon of three corners or more; found {texts!r:.60}")
    return found


def _unannotated(picture: Listed, listed: Sequence[str], problems: list[str]) -> Iterator[_Object]:
    _, objects, classes = picture.said
    if objects and classes:
        try:
            for number, name, box in unannotated(numbers_of(objects), numbers_of(classes), listed):
                yield _Object(number, name, box, {})
        except ValueError as error:
            problems.append(f"{classes}: {error}")


def _shown(categories: Mapping[str, Category], listed: Sequence[str], first: int, picture: Listed, index: int) -> Sample:
    xml, file, _ = picture.said
    found, ids = list(_objects(picture, listed, [])), numbers_of(file) if file else None
    places = [(o.place, o.corners(first if xml else 0)) for o in found]
    numbers = [0] * len(found) if ids is None else numbered(places, boxes_of(ids)) if xml else [place for place, _ in places]
    objects: list[ObjectAnnotation] = []
    for o, number, (_, box) in zip(found, numbers, places, strict=True):
        mask = None if ids is None or not number else ids == number
        objects.append(_annotation(len(objects) + 1, o, categories[o.name], picture.size, box, first, mask))
    return unposed(picture, index, objects, {"file_name": picture.name + picture.file.suffix})


def _annotation(
    number: int, o: _Object, category: Category, size: tuple[int, int], box: Box, first: int, mask: NDArray[np.bool_] | None
) -> ObjectAnnotation:
    """An object with its mask; its `source` holds its COCO annotation and, if it differs from VOC's, the box as given in its
    data set, whose first pixel has this number.
    """
    x0, y0, x1, y1 = box
    source: dict[str, Any] = {"bbox": [x0, y0, x1 - x0, y1 - y0], "area": (x1 - x0) * (y1 - y0), **o.said}
    if first != 1 or any(value != round(value) for value in box):
        source["bndbox"] = [x0 + first, y0 + first, x1, y1]
    counts = None
    if mask is not None:
        counts = encode_rle(mask)
        source |= {"area": int(mask.sum()), "segmentation": [list(map(int, ring)) for ring in mask_polygons(mask)]}
    elif o.polygons:
        outline = [[value - 1 for value in polygon] for polygon in o.polygons]
        counts = rle_of_polygons(size[1], size[0], outline)
        source |= {"segmentation": outline, "polygon": True}
    return foreign_object(number, category, size, source, counts, box, box2d=box)
