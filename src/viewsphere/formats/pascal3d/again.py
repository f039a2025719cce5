"""PASCAL3D+'s pictures with the CAD models that they show, to be rendered again."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import StoreError
from viewsphere.formats._again import pose_of
from viewsphere.formats._listed import MISTAKES, one_line
from viewsphere.formats.pascal3d.cads import read_shapes
from viewsphere.formats.pascal3d.posed import Posed, posed
from viewsphere.formats.pascal3d.records import read_record
from viewsphere.geometry.rotation import compose, rigid, transform
from viewsphere.limits import limits
from viewsphere.model.camera import Intrinsics
from viewsphere.model.listed import ListedObject, ListedShot
from viewsphere.store.again import Again, AgainModel, Drafted, refuse_any
from viewsphere.store.paths import file_inside, is_name

Float = NDArray[np.float64]

MAIN = "PASCAL/VOCdevkit/VOC2012/ImageSets/Main"
LISTS = (MAIN, "Image_sets")
"""Where files list the pictures of a split."""

ALIKE = 1e-6
"""Pixels by which the lenses of two objects of one picture may differ."""


@dataclass(frozen=True)
class _Group:
    """Objects of a picture that one lens shows."""

    lens: Intrinsics
    objects: list[Posed]


def again(path: Path) -> Again:
    """All pictures with objects whose viewpoint is known, in the folder of a release, and the CAD models that they show.

    A picture is one shot where its objects have one lens, as where it says K, else one for each lens: the format's projection
    has the principal point where it sees an object's origin. The world is that of a shot's first object. Raises StoreError for
    records that are none, and for objects without a CAD model.
    """
    files = sorted(path.glob("Annotations/*/*.mat"))
    if not files:
        raise StoreError(f"{path}: expected PASCAL3D+ (Annotations/<category>_pascal/<index>.mat); found no such file")
    splits, problems = _splits(path), list[str]()
    models, shots = _Models(path, {}), dict[tuple[str, str], list[ListedShot]]()
    others = divided = 0
    for file in files:
        source = file.parent.name.rpartition("_")[2]
        if (source, file.stem) in shots:
            continue  # a picture lies in the folders of all categories that it shows
        try:
            record = read_record(file_inside(path, file.relative_to(path).as_posix()))
            seen = tuple(posed(record))
            groups = list(_groups(seen))
            problems += record.problems
            others += len(record.objects) - len(seen)
            divided += len(groups) > 1
            named = f"{file.parent.name}/{record.filename or file.stem}"
            shots[source, file.stem] = [
                _shot(
                    models, group, f"{file.stem}-{i}" if len(groups) > 1 else file.stem, named, splits.get(file.stem, "train")
                )
                for i, group in enumerate(groups)
            ]
        except MISTAKES as error:
            problems.append(f"{file}: {one_line(error)}")
    refuse_any(problems)
    found = tuple(shot for one in shots.values() for shot in one)
    if not found:
        raise StoreError(f"{path}: expected pictures with objects of known viewpoint; found none")
    return Again(
        name=path.resolve().name,
        shots=found,
        models=models.found,
        formats=({"pascal3d": {"anchors": False}},),
        notes=tuple(_notes(others, divided)),
    )


def _notes(others: int, divided: int) -> Iterator[str]:
    if others:
        yield f"{others:,} objects have no exact viewpoint or no CAD model, and are left out"
    if divided:
        yield (
            f"{divided:,} pictures show objects that have lenses of their own in the format's projection: each lens is a shot, "
            "so that these do not hide one another"
        )


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
    """The CAD models that are asked for: OFF files, else those of a category's MATLAB file."""

    root: Path
    found: dict[str, AgainModel]

    def key(self, category: str, number: int) -> str:
        """The key of a model, counted from 1; raises StoreError where there is none."""
        if not is_name(category):
            raise ValueError(f"found a category {category!r:.60}")
        key = f"{category} {number}"
        if key not in self.found:
            word = re.sub(r"[^A-Za-z0-9_-]", "_", category).lstrip("_-")[:90] or "model"
            self.found[key] = AgainModel(self._source(category, number, word), category, name=word)
        return key

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
        return Drafted(f"{word}/{number:02}.off", _off_bytes(*cads[number - 1]))


def _off_bytes(vertices: Float, triangles: NDArray[np.int32]) -> bytes:
    """A model as OFF text."""
    rows = [f"OFF\n{len(vertices)} {len(triangles)} 0"]
    rows += [f"{x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
    rows += [f"3 {a} {b} {c}" for a, b, c in triangles.tolist()]
    return ("\n".join(rows) + "\n").encode()


def _splits(root: Path) -> dict[str, str]:
    """The split of each picture that a list names."""
    categories = {folder.name.rpartition("_")[0] for folder in (root / "Annotations").iterdir()}
    found: dict[str, str] = {}
    for file in (file for name in LISTS for file in sorted((root / name).glob("*.txt"))):
        own = file_inside(root, file.relative_to(root).as_posix())
        split = _split_of(file.stem, categories)
        if own.stat().st_size > limits.MAX_POSES_BYTES:
            raise StoreError(f"{own}: expected at most {limits.MAX_POSES_BYTES:,} bytes (limit MAX_POSES_BYTES); found more")
        for words in map(str.split, own.read_text("utf-8", errors="replace").splitlines()):
            if words and split and split != "trainval":
                found.setdefault(words[0], split)
    return found


def _split_of(stem: str, categories: Iterable[str]) -> str:
    """The split that a list's name ends with, behind the category and, of release lists, the source."""
    for category in sorted(categories, key=len, reverse=True):
        if category and stem.startswith(f"{category}_"):
            return stem.removeprefix(f"{category}_").removeprefix("imagenet_").removeprefix("pascal_")
    return stem
