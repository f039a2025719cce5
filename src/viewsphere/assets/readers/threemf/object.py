"""Objects of a 3MF model file: their meshes and components."""

from __future__ import annotations

import posixpath
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.primitive import Float, Int
from viewsphere.assets.readers.shared.coordinates import check_coordinates

NOTHING = -1
"""Index of a triangle's property if the file omits it."""


@dataclass(frozen=True, eq=False)
class Part:
    """A build item or component: an object's model file and id, and its transform (4, 4)."""

    key: tuple[str, str]
    matrix: Float

    @staticmethod
    def from_element(element: Any, path: str) -> Part:
        """The part that an `<item>` or `<component>` of the model file `path` names."""
        attributes = element.attrib
        place = posixpath.normpath(attributes.get("path", path).replace("\\", "/")).lstrip("/")
        return Part((place, attributes.get("objectid", "")), _matrix(attributes.get("transform", "")))


@dataclass(frozen=True, eq=False)
class Triangles:
    """A mesh: `vertices` (V, 3), `corners` (T, 3); `groups` (T,) holds each triangle's property group, "" for none, and
    `properties` (T, 3) the index of each corner's property in it.
    """

    vertices: Float
    corners: Int
    groups: Sequence[str]
    properties: Int


@dataclass(frozen=True, eq=False)
class Object:
    """An `<object>`: its name, and a mesh or components."""

    name: str
    mesh: Triangles | None
    components: tuple[Part, ...]


def objects_of(folder: ModelFolder, model: Any, path: str) -> dict[str, Object]:
    """The objects of a model file by their ids."""
    objects: dict[str, Object] = {}
    for element in model.iter("object"):
        mesh = next(element.iterfind("mesh"), None)
        components = tuple(Part.from_element(part, path) for part in element.iterfind("components/component"))
        triangles = None if mesh is None else _triangles(folder, element, mesh)
        objects[str(element.get("id"))] = Object(str(element.get("name") or "").strip()[:80], triangles, components)
    return objects


def _triangles(folder: ModelFolder, element: Any, mesh: Any) -> Triangles:
    vertices = [(v.get("x"), v.get("y"), v.get("z")) for v in mesh.iterfind("vertices/vertex")]
    rows = list(mesh.iterfind("triangles/triangle"))
    folder.check("MAX_VERTICES", len(vertices), "vertices")
    folder.check("MAX_TRIANGLES", len(rows), "triangles")
    if next(mesh.iterfind("beamlattice"), None) is not None:
        folder.warn("beam lattices are left out")
    where = f"object {element.get('id')}"
    positions = _numbers(folder, vertices, np.float64, where)
    corners = _numbers(folder, [(t.get("v1"), t.get("v2"), t.get("v3")) for t in rows], np.int64, where)
    if corners.size and not (corners.min() >= 0 and corners.max() < len(positions)):
        raise folder.error(f"{where}: a triangle names vertex {corners.max()}, expected 0 to {len(positions) - 1}")
    check_coordinates(folder, positions, corners, f"{where}: ")
    group, index = str(element.get("pid") or ""), element.get("pindex", NOTHING)
    groups = [str(t.get("pid") or group) for t in rows]
    # If only the first corner has a property, it applies to all three.
    firsts = [t.get("p1", index) for t in rows]
    properties = [(p, t.get("p2", p), t.get("p3", p)) for p, t in zip(firsts, rows, strict=True)]
    return Triangles(positions, corners, groups, _numbers(folder, properties, np.int64, where))


def _numbers(folder: ModelFolder, rows: Sequence[tuple[Any, ...]], kind: type[np.generic], where: str) -> Any:
    """Rows of three numbers; raises ModelError if one is missing or malformed."""
    try:
        return np.array(rows, dtype=str).reshape(-1, 3).astype(kind)
    except ValueError as error:
        raise folder.error(f"{where}: expected three numbers in each vertex and triangle ({error}): damaged") from None


def _matrix(text: str) -> Float:
    """The transform from its twelve numbers: rows of a matrix that multiplies from the right."""
    matrix = np.eye(4)
    if text.strip():
        matrix[:3] = np.array(text.split(), dtype=str).astype(np.float64).reshape(4, 3).T
    return matrix
