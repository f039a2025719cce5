"""The cache file of a mesh and the facts of its source file."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any, cast

from viewsphere.assets.mesh import Image, Material, Mesh, Texture
from viewsphere.assets.primitive import TEXTURE_FIELDS, FileFacts
from viewsphere.assets.scene_annotations import Annotation
from viewsphere.caches.arrays import Content, read_arrays, write_arrays
from viewsphere.model.annotations.keypoints import Keypoints

ARRAYS = (
    "vertices",
    "triangles",
    "normals",
    "triangle_material",
    "triangle_part",
    "uv0",
    "uv1",
    "colors",
    "triangle_body_part",
)
FACTS = ("format", "up", "forward", "unit", "origin", "size", "object_from_file")


def write_mesh(path: Path, mesh: Mesh, facts: FileFacts) -> None:
    """Write a mesh with its materials and images, and all facts of its source file except `path` and `files`."""
    content = packed(mesh, facts)
    write_arrays(path, content.about, content.arrays)


def read_mesh(path: Path, source: Path) -> tuple[Mesh, FileFacts]:
    """The mesh and facts of the model `source` as stored by `write_mesh`, bit for bit. Raises ValueError, TypeError or KeyError
    for a damaged file.
    """
    return unpacked(read_arrays(path), source)


def packed(mesh: Mesh, facts: FileFacts) -> Content:
    """A mesh and its facts as plain data."""
    arrays = {name: getattr(mesh, name) for name in ARRAYS if getattr(mesh, name) is not None}
    arrays |= {f"image{i}": image.pixels for i, image in enumerate(mesh.images)}
    about = {
        "materials": [asdict(material) for material in mesh.materials],
        "parts": mesh.parts,
        "body_parts": mesh.body_parts,
        "images": [image.name for image in mesh.images],
        "warnings": mesh.warnings,
        "facts": {name: getattr(facts, name) for name in FACTS},
        "marks": [asdict(mark) for mark in facts.marks],
        "keypoints": None if facts.keypoints is None else facts.keypoints.model_dump(),
    }
    return Content(about, arrays)


def unpacked(content: Content, source: Path) -> tuple[Mesh, FileFacts]:
    """The mesh and the facts of the model `source` from the plain data of `packed`; raises as `read_mesh` does."""
    header: dict[str, Any] = content.about
    arrays = {name: content.arrays[name] for name in ARRAYS if name in content.arrays}
    pixels = [content.arrays[f"image{i}"] for i in range(len(header["images"]))]
    mesh = Mesh(
        **arrays,
        materials=tuple(_material(fields) for fields in header["materials"]),
        parts=tuple(header["parts"]),
        body_parts=tuple(header["body_parts"]),
        images=tuple(Image(name, array) for name, array in zip(header["images"], pixels, strict=True)),
        warnings=tuple(header["warnings"]),
    )
    points = None if header["keypoints"] is None else Keypoints.model_validate(header["keypoints"])
    marks = tuple(Annotation(**{name: _tupled(value) for name, value in mark.items()}) for mark in header["marks"])
    told = {name: _tupled(value) for name, value in header["facts"].items()}
    return mesh, FileFacts(source, **told, keypoints=points, marks=marks)


def _material(fields: dict[str, Any]) -> Material:
    values = {key: _tupled(value) for key, value in fields.items()}
    for name in TEXTURE_FIELDS:
        if fields[name] is not None:
            values[name] = Texture(**{key: _tupled(value) for key, value in fields[name].items()})
    return Material(**values)


def _tupled(value: Any) -> Any:
    return tuple(map(_tupled, cast("list[Any]", value))) if isinstance(value, list) else value
