"""A PASCAL VOC data set made elsewhere: lists, pictures, an XML for each, and masks."""

from __future__ import annotations

import hashlib
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
from viewsphere.errors import StoreError, UserError
from viewsphere.geometry.mask import encode_rle, mask_polygons
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.store import Category
from viewsphere.store.foreign import ForeignDataset, ForeignFrame, foreign_object, refuse_broken
from viewsphere.store.paths import file_inside, is_name
from viewsphere.urls.inside import is_inside

SUFFIXES = (".jpg", ".jpeg", ".png", ".webp", ".bmp")
BOX = ("xmin", "ymin", "xmax", "ymax")
FLAGS = ("truncated", "occluded", "difficult")
LARGEST = 10_000_000
"""Bytes of an XML."""

MISTAKES = (OSError, ValueError, SyntaxError, UserError)


@dataclass(frozen=True)
class _Picture:
    """A picture, its annotation, and its map of objects, None if it has none."""

    split: str
    name: str
    file: Path
    size: tuple[int, int]
    xml: Path
    masks: Path | None


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
    listed, digest, most = _listed_names(root), hashlib.sha256(), 1
    names = dict.fromkeys(listed)
    for picture in pictures:
        found = list(_objects(picture, listed, problems))
        names |= dict.fromkeys(o.name for o in found)
        most = max(most, len(found))
        for file in (picture.xml, picture.masks):
            digest.update(hashlib.sha256(file.read_bytes() if file else b"").digest())
        digest.update(f"{picture.split}/{picture.name}\0".encode(errors="backslashreplace"))
    if not keep_going:
        refuse_broken(problems)
    if not pictures or not names:
        raise StoreError(f"{root}: expected pictures and objects that can be used; found none")
    digest.update("\n".join([*listed, *problems]).encode(errors="backslashreplace"))
    ordered = listed or sorted(names)
    categories = {name: Category(number, name, "") for number, name in enumerate(ordered, 1)}
    return ForeignDataset(
        name=path.resolve().name,
        digest=digest.hexdigest(),
        categories=tuple(categories.values()),
        splits=tuple(dict.fromkeys(picture.split for picture in pictures)),
        channels=("rgb",),
        count=len(pictures),
        poses=0,
        max_objects=most,
        frames=partial(_frames, pictures, categories, listed),
        left_out=tuple(problems),
    )


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


def _pictures(root: Path, problems: list[str]) -> Iterator[_Picture]:
    """The pictures of all lists, each in the first that has it."""
    seen = set[str]()
    for split, source, names in _lists(root, problems):
        for name in names:
            if name not in seen:
                seen.add(name)
                try:
                    yield _picture(root, split, name)
                except MISTAKES as error:
                    problems.append(f"{source}: {name}: {' '.join(str(error).split())}")


def _lists(root: Path, problems: list[str]) -> Iterator[tuple[str, Path, Sequence[str]]]:
    """Each split with its list and the names of its pictures; lists of categories, whose lines have a number too, are none."""
    files = {file.stem: file for file in sorted((root / "ImageSets/Main").glob("*.txt"))}
    if {"train", "val"} <= files.keys():
        files.pop("trainval", None)
    order = [name for name in ("train", "val", "test") if name in files]
    any_list = False
    for split in (*order, *(name for name in files if name not in order)):
        try:
            rows = file_inside(root, files[split].relative_to(root).as_posix()).read_text("utf-8").splitlines()
        except MISTAKES as error:
            problems.append(f"{files[split]}: expected names of pictures; found: {' '.join(str(error).split())}")
            continue
        names = [row.strip() for row in rows if row.strip()]
        if is_name(split) and not all(name.rpartition(" ")[2] in ("1", "-1", "0") and " " in name for name in names):
            any_list = True
            yield split, files[split], names
    if not any_list and not problems:
        folder = root / "Annotations"
        found = sorted(folder.rglob("*.xml"))
        yield "train", folder, [file.relative_to(folder).with_suffix("").as_posix() for file in found]


def _picture(root: Path, split: str, name: str) -> _Picture:
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
    return _Picture(split, name, file, size, xml, masks if masks.is_file() else None)


def _parsed(xml: Path) -> ElementTree.Element:
    data = xml.read_bytes()
    if len(data) > LARGEST or b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise StoreError(f"expected a plain annotation in {xml.name}; found one with entities, or of {len(data):,} bytes")
    return ElementTree.fromstring(data)


def _objects(picture: _Picture, listed: Sequence[str], problems: list[str]) -> Iterator[_Object]:
    """The valid objects of an annotation."""
    for place, element in enumerate(_parsed(picture.xml).findall("object"), 1):
        try:
            yield _object(place, element, listed)
        except ValueError as error:
            problems.append(f"{picture.xml}: object {place}: {error}")


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


def _frames(pictures: Sequence[_Picture], categories: Mapping[str, Category], listed: Sequence[str]) -> Iterator[ForeignFrame]:
    for index, picture in enumerate(pictures):
        masks = None
        if picture.masks:
            with opened(picture.masks) as found:
                masks = np.array(found)
        found = _objects(picture, listed, [])
        objects = tuple(_annotation(number, o, categories, picture, masks) for number, o in enumerate(found, 1))
        said = {"file_name": picture.name + picture.file.suffix}
        yield ForeignFrame(Sample(index, picture.split, None, None, objects, {}, {}, picture.size, said), {"rgb": picture.file})


def _annotation(
    number: int, o: _Object, categories: Mapping[str, Category], picture: _Picture, masks: NDArray[Any] | None
) -> ObjectAnnotation:
    """An object with its mask, and as COCO would have it in `source`."""
    x0, y0, x1, y1 = o.box
    source: dict[str, Any] = {"bbox": [x0, y0, x1 - x0, y1 - y0], "area": (x1 - x0) * (y1 - y0), **o.said}
    counts = None
    if masks is not None and (mask := masks == o.place).any():
        counts = encode_rle(mask)
        source |= {"area": int(mask.sum()), "segmentation": [list(map(int, ring)) for ring in mask_polygons(mask)]}
    return foreign_object(number, categories[o.name], picture.size, source, counts, o.box, box2d=o.box)
