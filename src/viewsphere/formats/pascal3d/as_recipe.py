"""PASCAL3D+'s pictures with the CAD models that they show, for rendering them again."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import chain, count
from pathlib import Path

from viewsphere.errors import StoreError
from viewsphere.formats.pascal3d.cads import read_shapes
from viewsphere.formats.pascal3d.pictures import FILES_KEPT, Told, objects_of, picture_of, told_pictures
from viewsphere.formats.pascal3d.posed import Posed, pinhole, posed
from viewsphere.formats.pascal3d.records import Record, read_record
from viewsphere.formats.shared.reading.as_recipe import pose_of
from viewsphere.formats.shared.reading.image_lists import MISTAKES, one_line
from viewsphere.formats.shared.viewpoint_mat import off_bytes
from viewsphere.geometry.rotation import compose, rigid, transform
from viewsphere.model.listed import ListedObject, ListedShot
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.store.paths import file_inside, is_name
from viewsphere.store.source_cameras import Drafted, SourceCameras, SourceModel, refuse_any

ALIKE = 1e-6
"""Pixels by which the lenses of two objects of one picture may differ."""


@dataclass(frozen=True)
class _Group:
    """Objects of a picture that one lens shows."""

    lens: Intrinsics
    objects: list[Posed]


def source_cameras(path: Path) -> SourceCameras:
    """Return every picture with objects of known viewpoint, in the folder of a release, and the CAD models that they show.

    A picture is one shot if its objects share one lens, as they do if the record gives K. Otherwise it is one shot for each
    lens, because the format's projection has the principal point at an object's origin in the picture. The world is the world
    of a shot's first object. Raises StoreError for invalid records, and for objects without a CAD model.
    """
    if not any(path.glob("Annotations/*/*.mat")):
        raise StoreError(f"{path}: expected PASCAL3D+ (Annotations/<category>_pascal/<index>.mat); found no such file")
    problems, record_of = list[str](), lru_cache(FILES_KEPT)(read_record)
    models, found = _Models(path, {}, {}), list[ListedShot]()
    others = divided = resized = 0
    for told in told_pictures(path, record_of, problems):
        try:
            record = record_of(told.files[0])
            size = _size(path, told, record)
            objects = objects_of(told, record_of)
            own = None if record.lens is None else pinhole(record.lens, size)
            seen = tuple(posed(objects, own, size))
            resized += record.size not in (None, size)
            groups = tuple(_groups(seen))
            others += len(objects) - len(seen)
            divided += len(groups) > 1
            named = f"{told.files[0].parent.name}/{record.filename or told.name}"
            for i, group in enumerate(groups):
                name = f"{told.name}-{i}" if len(groups) > 1 else told.name
                found.append(_shot(models, group, name, named, told.split))
        except MISTAKES as error:
            problems.append(f"{told.files[0]}: {one_line(error)}")
    refuse_any(problems)
    if not found:
        raise StoreError(f"{path}: expected pictures with objects of known viewpoint; found none")
    return SourceCameras(
        name=path.resolve().name,
        shots=tuple(found),
        models=models.found,
        formats=({"pascal3d": {"anchors": False}},),
        notes=tuple(_notes(others, divided, resized)),
    )


def _size(root: Path, told: Told, record: Record) -> tuple[int, int]:
    """The width and height of a picture; from its record if the picture is missing."""
    there = picture_of(root, told, record)
    size = there[1] if there else record.size
    if size is None:
        raise ValueError("expected a picture, or imgsize width height; found neither")
    return size


def _notes(others: int, divided: int, resized: int) -> Iterator[str]:
    if others:
        yield f"{others:,} objects have no exact viewpoint or no CAD model, and are left out"
    if divided:
        yield (
            f"{divided:,} pictures show objects that have lenses of their own in the format's projection: each lens is a shot, "
            "so that these do not hide one another"
        )
    if resized:
        yield f"{resized:,} pictures have another size than their record's imgsize, and are taken for right"


def _groups(objects: Iterable[Posed]) -> Iterator[_Group]:
    """The objects of each lens, in the record's order."""
    found: list[_Group] = []
    for seen in objects:
        own = next((group for group in found if _is_alike(group.lens, seen.lens)), None)
        if own is None:
            own = _Group(seen.lens, [])
            found.append(own)
        own.objects.append(seen)
    yield from found


def _is_alike(one: Intrinsics, other: Intrinsics) -> bool:
    return all(abs(getattr(one, name) - getattr(other, name)) <= ALIKE for name in ("fx", "fy", "cx", "cy", "skew"))


def _shot(models: _Models, group: _Group, name: str, image: str, split: str) -> ListedShot:
    first = group.objects[0].camera_from_object
    world_from_camera = rigid(first[:3, :3].T, -transform(first[:3, :3].T, first[:3, 3]))
    return ListedShot(
        name=re.sub(r"[^A-Za-z0-9_-]", "_", name).lstrip("-")[:100] or None,
        split=split,
        image=image[:1000],
        world_from_camera=pose_of(world_from_camera),
        camera=group.lens,
        objects=tuple(
            ListedObject(
                model=models.key(seen.category, seen.cad),
                world_from_object=pose_of(compose(world_from_camera, seen.camera_from_object)),
            )
            for seen in group.objects
        ),
    )


@dataclass(frozen=True)
class _Models:
    """The requested CAD models: OFF files, or else the models of a category's MATLAB file."""

    root: Path
    found: dict[str, SourceModel]
    words: dict[str, str]

    def key(self, category: str, number: int) -> str:
        """The key of a model, counted from 1. Raises StoreError if there is no such model."""
        if not is_name(category):
            raise ValueError(f"found a category {category!r:.60}")
        key = f"{category} {number}"
        if key not in self.found:
            word = self._word(category)
            self.found[key] = SourceModel(self._source(category, number, word), category, name=word)
        return key

    def _word(self, category: str) -> str:
        """A category's unique name in letters, digits, `_` and `-`."""
        if category not in self.words:
            plain = re.sub(r"[^A-Za-z0-9_-]", "_", category).lstrip("_-")[:90] or "model"
            taken = {word.casefold() for word in self.words.values()}
            ways = chain((plain,), (f"{plain}_{i}" for i in count(2)))
            self.words[category] = next(way for way in ways if way.casefold() not in taken)
        return self.words[category]

    def _source(self, category: str, number: int, word: str) -> Path | Drafted:
        file = file_inside(self.root, f"CAD/{category}/{number:02}.off")
        if file.is_file():
            return file
        whole = file_inside(self.root, f"CAD/{category}.mat")
        cads = read_shapes(whole, category) if whole.is_file() else ()
        if not 1 <= number <= len(cads):
            raise StoreError(
                f"{self.root}: expected CAD/{category}/{number:02}.off, or it in CAD/{category}.mat; found neither"
            )
        return Drafted(f"{word}/{number:02}.off", off_bytes(*cads[number - 1]))
