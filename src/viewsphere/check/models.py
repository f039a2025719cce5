"""Proof that a model's files agree: the OBJ with its materials and textures, the GLB, and the model's record."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from itertools import islice, zip_longest
from pathlib import Path

import numpy as np

from viewsphere.assets.appearance.description import appearance_of, is_alike
from viewsphere.assets.exporting.export import export_obj
from viewsphere.assets.exporting.exported import read_exported
from viewsphere.assets.mesh import Mesh
from viewsphere.assets.metadata.model_metadata import far_points
from viewsphere.assets.metadata.surface import Surface
from viewsphere.assets.metadata.symmetries import lacking
from viewsphere.check.failure import failure
from viewsphere.codecs.png_tiff import decode_png
from viewsphere.errors import UserError
from viewsphere.files import open_text, read_bytes
from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.diameter import diameter
from viewsphere.scratch import temporary
from viewsphere.store import Category, Dataset, ModelInfo
from viewsphere.store.shots.manifest import MANIFEST

PRECISION = 1e-12
"""Relative difference allowed between numbers in texts: a GLB stores brightness above 1 as a product."""

Finding = tuple[str, str]
"""A model's key, and its error."""


def differing(dataset: Dataset, notes: list[str]) -> Iterator[Finding]:
    """Models whose files contradict one another; models that were exported elsewhere are added to `notes`."""
    is_imported = any(not part.settings for part in dataset.plan.parts)
    categories = {category.id: category for category in dataset.categories}
    named: dict[str, set[str]] = {}
    for info in dataset.models:
        if is_imported and not info.parts:
            notes.append(f"models: the files of {info.key} are not compared, they were exported elsewhere")
            continue
        names = named.setdefault(_owner(info), {"model.json", MANIFEST, Path(info.glb).name})
        try:
            problems = list(_problems(dataset, info, categories, names))
        except Exception as error:
            problems = [failure("files that can be compared", error)]
        yield from ((_owner(info), f"model {info.key}: {message}") for message in problems)
    for key, names in named.items():
        for file in sorted(dataset.store.model_folder(key).iterdir()):
            if file.name not in names:
                yield key, f"model {key}: expected no such file, because nothing in the data set names it: delete {file}"


def _owner(info: ModelInfo) -> str:
    """The key of the model that a time step belongs to; otherwise the model's own key."""
    return info.track or info.key


def _problems(dataset: Dataset, info: ModelInfo, categories: dict[int, Category], names: set[str]) -> Iterator[str]:
    """Contradictions between a model's files; the names of its files are added to `names`."""
    folder, known = dataset.path(info.obj).parent, categories.get(info.category_id)
    mesh = read_exported(dataset.path(info.glb), info.parts, info.node, whole=True)
    yield from _facts(info, mesh)
    places = [(dataset.path(file).parent, Path(file).suffix) for file in (info.obj, info.glb)]
    if places != [(dataset.store.model_folder(_owner(info)), suffix) for suffix in (".obj", ".glb")]:
        yield f"expected files in its folder, found {info.obj} and {info.glb}"
    if known is None or (known.name, known.supercategory) != (info.category, info.supercategory):
        yield f"expected a category of the plan, found {info.category_id} {info.category!r} ({info.supercategory!r})"
    library = _library(dataset.path(info.obj), Path(info.glb).stem) if info.step else Path(info.obj).stem
    if library is None:
        yield f"{Path(info.obj).name}: expected materials of the model, found others"
        return
    with temporary("check") as scratch_folder:
        export_obj(mesh, scratch_folder, Path(info.obj).stem, library)
        for file in sorted(scratch_folder.iterdir()):
            names.add(file.name)
            yield from _compared(file, folder / file.name)


def _library(obj: Path, name: str) -> str | None:
    """The file of materials that a time step's OBJ names, without its suffix: the model's or a step's; None for any other."""
    with open_text(obj) as file:
        match = re.fullmatch(r"mtllib (.+)\.mtl\n", next(islice(file, 1, None), ""))
    known = re.compile(rf"{re.escape(name)}(-f-?\d+)?")
    return match[1] if match and known.fullmatch(match[1]) else None


def _facts(info: ModelInfo, mesh: Mesh) -> Iterator[str]:
    box, materials = Box3d.between(*mesh.bounds).corners, tuple(material.name for material in mesh.materials)
    if info.materials not in ((), materials):
        yield f"expected the materials {', '.join(materials)} of the GLB, found {', '.join(info.materials)}"
    if info.body_parts != mesh.body_parts:
        parts = ", ".join(info.body_parts) or "none"
        yield f"expected the parts of a body {', '.join(mesh.body_parts) or 'none'}, as the GLB has, found {parts}"
    if info.triangles != len(mesh.triangles):
        yield f"expected {len(mesh.triangles)} triangles, as the GLB has, found {info.triangles}"
    if not np.array_equal(info.box3d_object, box):
        yield "expected the 3D box of the GLB, found another"
    if info.size != Box3d(box).size:
        yield f"expected size {Box3d(box).size} of the GLB, found {info.size}"
    if info.diameter is None:
        return
    if info.diameter != (across := diameter(mesh.corners)):
        yield f"expected a diameter of {across} m, as the GLB has, found {info.diameter}"
    if info.symmetries is not None:
        yield from lacking(Surface.from_mesh(mesh), info.symmetries)
    if info.looks is not None and not is_alike(info.looks, appearance_of(mesh)):
        yield "expected looks of the GLB, found others"
    if info.keypoints is not None:
        yield from (f"keypoints.{problem}" for problem in far_points(mesh, across, info.keypoints))


def _compared(wanted: Path, found: Path) -> Iterator[str]:
    """The first difference of a file from the one made from the GLB's mesh."""
    if not found.is_file():
        yield f"{found.name}: expected the file that the GLB's mesh gives, found none"
    elif read_bytes(wanted) != read_bytes(found):
        yield from _pixels(wanted, found) if found.suffix == ".png" else _lines(wanted, found)


def _lines(wanted: Path, found: Path) -> Iterator[str]:
    with open_text(wanted, newline="\n") as one, open_text(found, newline="\n") as other:
        for number, (a, b) in enumerate(zip_longest(one, other, fillvalue=""), 1):
            if a != b and not _is_same_line(a, b):
                yield f"{found.name}, line {number}: expected {a.strip()!r:.80} of the GLB, found {b.strip()!r:.80}"
                return


def _is_same_line(one: str, other: str) -> bool:
    """Return whether two lines have the same words and, except for rounding, the same numbers."""
    words = one.split(), other.split()
    return len(words[0]) == len(words[1]) and all(a == b or _is_same_number(a, b) for a, b in zip(*words, strict=True))


def _is_same_number(one: str, other: str) -> bool:
    try:
        return math.isclose(float(one), float(other), rel_tol=PRECISION)
    except ValueError:
        return False


def _pixels(wanted: Path, found: Path) -> Iterator[str]:
    """The first difference of two textures' pixels, because another version of the encoder may write different bytes."""
    try:
        same = np.array_equal(decode_png(read_bytes(wanted)), decode_png(read_bytes(found)))
        if not same:
            yield f"{found.name}: expected the texture of the GLB, found another"
    except UserError as error:
        yield f"{found.name}: expected the texture of the GLB, found: {error}"
