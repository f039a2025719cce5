"""A PASCAL VOC data set made elsewhere: lists, pictures, an XML for each, and masks."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from viewsphere.codecs.size import opened
from viewsphere.errors import StoreError
from viewsphere.formats._listed import MISTAKES, SUFFIXES, TRAIN, Listed, check_bytes, listed_dataset, lists, one_line, unposed
from viewsphere.geometry.mask import encode_rle, mask_polygons
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.store import Category
from viewsphere.store.foreign import ForeignDataset, foreign_object, refuse_broken
from viewsphere.store.paths import file_inside
from viewsphere.urls.inside import is_inside

BOX = ("xmin", "ymin", "xmax", "ymax")
FLAGS = ("truncated", "occluded", "difficult")


@dataclass(frozen=True)
class _Object:
    """An object of an annotation: its place in the XML from 1 on, name, half-open box, and what else is said of it."""

    place: int
    name: str
    box: tuple[float, float, float, float]
    said: Mapping[str, Any]


def read(path: Path, *, keep_going: bool = False) -> ForeignDataset:
    """All pictures and annotations of a folder with `Annotations` and `JPEGImages`, or of one that has VOCdevkit/VOC<year>.

    Raises StoreError with every mistake: pictures and annotations that are missing or outside, and broken objects; with
    `keep_going` these are left out and reported.
    """
    root = _kit(path)
    problems: list[str] = []
    pictures = tuple(_pictures(root, problems))
    listed, most = _listed_names(root), 1
    names = dict.fromkeys(listed)
    for picture in pictures:
        found = list(_objects(picture, listed, problems))
        names |= dict.fromkeys(o.name for o in found)
        most = max(most, len(found))
    if not keep_going:
        refuse_broken(problems)
    if not names:
        raise StoreError(f"{root}: expected pictures and objects that can be used; found none")
    ordered = listed or sorted(names)
    categories = {name: Category(number, name, "") for number, name in enumerate(ordered, 1)}
    shown = partial(_shown, categories, listed)
    return listed_dataset(path, pictures, categories.values(), most, shown, problems, keep_going, also="\n".join(listed))


def _kit(path: Path) -> Path:
    """The folder that has the annotations."""
    found = [path, *sorted(path.glob("VOC*")), *sorted(path.glob("VOCdevkit/VOC*"))]
    root = next((folder for folder in found if (folder / "Annotations").is_dir()), None)
    if root is None:
        raise StoreError(f"{path}: expected a PASCAL VOC data set (Annotations, JPEGImages, ImageSets); found no such folders")
    return root


def _listed_names(root: Path) -> list[str]:
    """The categories of a labelmap.txt, in the order of their numbers; none without one."""
    file = root / "labelmap.txt"
    if not file.is_file():
        return []
    try:
        rows = [row.split(":")[0] for row in file.read_text("utf-8").splitlines() if row and not row.startswith("#")]
    except (OSError, ValueError) as error:
        raise StoreError(f"{file}: expected a line for each category; found: {error}") from None
    return list(dict.fromkeys(name for name in rows if name and name != "background"))


def _pictures(root: Path, problems: list[str]) -> Iterator[Listed]:
    """The pictures of all lists, each in the first that has it."""
    seen = set[str]()
    for split, source, names in _lists(root, problems):
        for name in names:
            if name not in seen:
                seen.add(name)
                try:
                    yield _picture(root, split, name)
                except MISTAKES as error:
                    problems.append(f"{source}: {name}: {one_line(error)}")


def _lists(root: Path, problems: list[str]) -> Iterator[tuple[str, Path, Sequence[str]]]:
    """Each split with its list and the names of its pictures; lists of categories, whose lines have a number too, are none."""
    any_list = False
    for split, file, names in lists(root, "ImageSets/Main", problems):
        if not all(name.rpartition(" ")[2] in ("1", "-1", "0") and " " in name for name in names):
            any_list = True
            yield split, file, names
    if not any_list and not problems:
        folder = root / "Annotations"
        found = sorted(folder.rglob("*.xml"))
        yield TRAIN, folder, [file.relative_to(folder).with_suffix("").as_posix() for file in found]


def _picture(root: Path, split: str, name: str) -> Listed:
    if not is_inside(name):
        raise StoreError("expected a picture below the folder; found a path that leads outside")
    xml = file_inside(root, f"Annotations/{name}.xml")
    if not xml.is_file():
        raise StoreError(f"expected {xml}; found no such file")
    paths = [f"JPEGImages/{name}{suffix}" for suffix in SUFFIXES]
    path = next((one for one in paths if (root / one).is_file()), None)
    if path is None:
        raise StoreError(f"expected a picture JPEGImages/{name}{SUFFIXES[0]}; found no such file")
    file, masks = file_inside(root, path), file_inside(root, f"SegmentationObject/{name}.png")
    with opened(file) as found:
        size = found.size
    said = tuple(int(float(_parsed(xml).findtext(f"size/{key}") or 0)) for key in ("width", "height"))
    if all(said) and said != size:
        raise StoreError(f"expected {said[0]} x {said[1]} pixels, as {xml.name} says; found {size[0]} x {size[1]}")
    if masks.is_file():
        with opened(masks) as found:
            if found.size != size or found.mode not in ("P", "L"):
                raise StoreError(f"expected objects' numbers in {masks.name}, of the picture's size; found other pixels")
    return Listed(split, name, file, size, (xml, masks if masks.is_file() else None))


def _parsed(xml: Path) -> ElementTree.Element:
    check_bytes(xml, xml.stat().st_size)
    data = xml.read_bytes()
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise StoreError(f"expected a plain annotation in {xml.name}; found one with entities")
    return ElementTree.fromstring(data)


def _objects(picture: Listed, listed: Sequence[str], problems: list[str]) -> Iterator[_Object]:
    """The valid objects of an annotation."""
    xml = picture.said[0]
    assert xml is not None
    for place, element in enumerate(_parsed(xml).findall("object"), 1):
        try:
            yield _object(place, element, listed)
        except ValueError as error:
            problems.append(f"{xml}: object {place}: {error}")


def _object(place: int, element: ElementTree.Element, listed: Sequence[str]) -> _Object:
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
    return _Object(place, name, (x0 - 1, y0 - 1, x1, y1), said)


def _shown(categories: Mapping[str, Category], listed: Sequence[str], picture: Listed, index: int) -> Sample:
    masks = None
    if picture.said[1]:
        with opened(picture.said[1]) as found:
            masks = np.array(found)
    found = _objects(picture, listed, [])
    objects = [_annotation(number, o, categories, picture, masks) for number, o in enumerate(found, 1)]
    return unposed(picture, index, objects, {"file_name": picture.name + picture.file.suffix})


def _annotation(
    number: int, o: _Object, categories: Mapping[str, Category], picture: Listed, masks: NDArray[Any] | None
) -> ObjectAnnotation:
    """An object with its mask, and as COCO would have it in `source`."""
    x0, y0, x1, y1 = o.box
    source: dict[str, Any] = {"bbox": [x0, y0, x1 - x0, y1 - y0], "area": (x1 - x0) * (y1 - y0), **o.said}
    counts = None
    if masks is not None and (mask := masks == o.place).any():
        counts = encode_rle(mask)
        source |= {"area": int(mask.sum()), "segmentation": [list(map(int, ring)) for ring in mask_polygons(mask)]}
    return foreign_object(number, categories[o.name], picture.size, source, counts, o.box, box2d=o.box)
