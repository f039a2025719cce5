"""The import of models from other tools' data sets into a store."""

from __future__ import annotations

import hashlib
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from viewsphere.assets.exporting.export import export_glb, export_obj
from viewsphere.assets.mesh import Mesh
from viewsphere.geometry.box3d import Box3d
from viewsphere.store import Category, ModelInfo
from viewsphere.store.foreign import ForeignModel


def foreign_model(mesh: Mesh, key: str, category: Category, **said: Any) -> ForeignModel:
    """A model of a category in its object's axes, metres, with its other data in `said`, such as `keypoints`."""
    vertices = mesh.vertices.astype(np.float64)
    box, digest = Box3d.around(vertices).corners, hashlib.sha256(repr(said).encode())
    for array in (mesh.vertices, mesh.triangles):
        digest.update(array.tobytes())
    info = ModelInfo(
        key=key,
        category=category.name,
        supercategory=category.supercategory,
        category_id=category.id,
        obj=f"{key}.obj",
        glb=f"{key}.glb",
        box3d_object=box,
        size=Box3d(box).size,
        real_size=None,
        parts=mesh.parts,
        triangles=len(mesh.triangles),
        digest=digest.hexdigest(),
        **said,
    )
    return ForeignModel(info, (), partial(_write, mesh, key))


def _write(mesh: Mesh, key: str, folder: Path) -> None:
    """The files of a model."""
    export_obj(mesh, folder, key)
    export_glb(mesh, folder / f"{key}.glb")
