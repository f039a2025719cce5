"""PASCAL3D+'s CAD models from other sources, for import into a store."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import Mesh
from viewsphere.errors import StoreError
from viewsphere.formats.pascal3d.records import FARTHEST, structs_of, variables
from viewsphere.formats.shared.reading.image_lists import MISTAKES, one_line
from viewsphere.formats.shared.reading.source_models import foreign_model
from viewsphere.formats.shared.viewpoint_mat import OWN
from viewsphere.model.annotations.keypoints import Keypoints, Place
from viewsphere.store import Category
from viewsphere.store.foreign import ForeignModel
from viewsphere.store.paths import file_inside

Float = NDArray[np.float64]


def read_cads(root: Path, categories: Mapping[str, Category], problems: list[str]) -> dict[str, list[ForeignModel]]:
    """The models of each category with a readable file, in their order; the problems of other files are appended."""
    found: dict[str, list[ForeignModel]] = {}
    for name, category in categories.items():
        file = root / f"CAD/{name}.mat"
        if file.is_file():
            try:
                found[name] = list(_models(file_inside(root, f"CAD/{name}.mat"), category))
            except MISTAKES as error:
                problems.append(f"{file}: {one_line(error)}")
    return found


def _models(file: Path, category: Category) -> Iterator[ForeignModel]:
    for number, said in enumerate(structs_of(variables(file).get(category.name), f"a struct array {category.name}"), 1):
        try:
            yield _model(said, category, f"{category.name}_{number:02}")
        except ValueError as error:
            raise ValueError(f"model {number}: {error}") from None


def _model(said: Mapping[str, Any], category: Category, key: str) -> ForeignModel:
    mesh, points = _mesh(said.get("vertices"), said.get("faces")), dict(_points(said))
    return foreign_model(mesh, key, category, keypoints=Keypoints(points=points) if points else None)


def read_shapes(file: Path, category: str) -> tuple[tuple[Float, NDArray[np.int32]], ...]:
    """Vertices (V, 3) and triangles (T, 3) of a category's models; raises StoreError for a file without models."""
    try:
        structs = structs_of(variables(file).get(category), f"a struct array {category}")
        return tuple(_shape(one.get("vertices"), one.get("faces")) for one in structs)
    except MISTAKES as error:
        raise StoreError(f"{file}: expected CAD models of {category}; found: {one_line(error)}") from None


def _shape(vertices: Any, faces: Any) -> tuple[Float, NDArray[np.int32]]:
    """Vertices (V, 3) and triangles (T, 3) of faces, which count from 1."""
    if not (_is_table(vertices) and _is_table(faces) and len(vertices) and len(faces)):
        raise ValueError("vertices or faces do not have three columns")
    if not (np.abs(vertices) < FARTHEST).all():
        raise ValueError(f"a vertex is not finite, or beyond {FARTHEST:,.0f}")
    if not ((faces == np.floor(faces)) & (faces >= 1) & (faces <= len(vertices))).all():
        raise ValueError(f"a face names a vertex outside 1 to {len(vertices)}")
    return vertices.astype(np.float64), faces.astype(np.int32) - np.int32(1)


def _mesh(vertices: Any, faces: Any) -> Mesh:
    exact, triangles = _shape(vertices, faces)
    places = exact.astype(np.float32)
    if not np.ptp(places, axis=0).any():
        raise ValueError("expected vertices that are apart; found all at one place")
    nothing = np.zeros(len(triangles), np.int32)
    return Mesh(places, triangles, _normals(places, triangles), nothing, nothing.copy())


def _is_table(array: Any) -> bool:
    return isinstance(array, np.ndarray) and array.ndim == 2 and array.shape[1] == 3


def _normals(vertices: NDArray[np.float32], triangles: NDArray[np.int32]) -> NDArray[np.float32]:
    """The normal of each vertex, (V, 3): the area-weighted mean of its triangles' normals; up if that is zero."""
    a, b, c = (vertices[triangles[:, i]].astype(np.float64) for i in range(3))
    found, across = np.zeros((len(vertices), 3)), np.cross(b - a, c - a)
    for corner in range(3):
        np.add.at(found, triangles[:, corner], across)
    length = np.linalg.norm(found, axis=1, keepdims=True)
    return np.where(length > 0, found / np.where(length > 0, length, 1), (0.0, 0.0, 1.0)).astype(np.float32)


def _points(said: Mapping[str, Any]) -> Iterator[tuple[str, Place]]:
    """The named points of a model."""
    for name, value in said.items():
        if name not in OWN and isinstance(value, np.ndarray) and value.size == 3:
            if not (np.abs(value) < FARTHEST).all():
                raise ValueError(f"the point {name:.60} is not at a finite place")
            x, y, z = value.ravel().astype(np.float64).tolist()
            yield name, (x, y, z)
