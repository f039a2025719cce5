"""Pack what the triangles are made of for the shading kernels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import Mesh
from viewsphere.assets.repaint import repainted
from viewsphere.engines.raster.bundles import BundlePacker
from viewsphere.engines.raster.looks import look
from viewsphere.engines.raster.records import Surfaces, Textures
from viewsphere.model.scene import Ground
from viewsphere.model.thing import Repaint, Thing
from viewsphere.surroundings.ground import ground_frame, ground_material
from viewsphere.truth.geometry import Geometry


def pack_surfaces(
    geometry: Geometry,
    meshes: Sequence[Mesh],
    ground: Ground | None,
    origin: NDArray[np.float64],
    unit: float,
    targets: int,
    things: Sequence[Thing] = (),
) -> tuple[Surfaces, Textures]:
    """Arrays for all triangles of a geometry and of the meshes it was built from; positions from `origin` in `unit`s.

    The first `targets` meshes are what the picture is about, the others scenery. `things[i].repaints` change the materials
    of `meshes[i]`. The ground's material is the last. Raises UserError for a picture of the ground that cannot be read.
    """
    vertices = np.zeros((len(geometry.vertices), 16), np.float32)
    vertices[:, :3] = geometry.normals
    vertices[:, 7:11] = 1.0
    vertices[:, 11:14] = (geometry.vertices - origin) / unit
    material = np.zeros(len(geometry.triangles), np.int32)
    looks: list[list[float]] = []
    bundles: list[list[int]] = []
    packer = BundlePacker()
    first_row: dict[tuple[int, bool, tuple[Repaint, ...]], int] = {}
    for i, mesh in enumerate(meshes):
        own = slice(geometry.vertex_start[i], geometry.vertex_start[i + 1])
        for column, uv in ((3, mesh.uv0), (5, mesh.uv1)):
            if uv is not None:
                vertices[own, column : column + 2] = uv
        if mesh.colors is not None:
            vertices[own, 7:11] = mesh.colors
        vertices[own] = np.nan_to_num(vertices[own], nan=0.0, posinf=0.0, neginf=0.0)  # a face without normals is flat
        repaints = things[i].repaints if things else ()
        kind = id(mesh), i >= targets, repaints
        if kind not in first_row:
            first_row[kind] = len(looks)
            has_uv = mesh.uv0 is not None, mesh.uv1 is not None
            for original in mesh.materials:
                m, repaint = repainted(original, repaints)
                looks.append(look(m, repaint, scenery=i >= targets))
                bundles.append(packer.add(m, mesh.images, has_uv))
        own = slice(geometry.triangle_start[i], geometry.triangle_start[i + 1])
        material[own] = mesh.triangle_material + first_row[kind]
    material[geometry.triangle_start[-1] :] = len(looks)
    ground = ground or Ground()
    floor, images = ground_material(ground)
    per_length, _, _ = ground_frame(ground, floor, origin, unit)
    looks.append(look(floor, ground=True, catcher=ground.catcher, per_length=per_length))
    bundles.append(packer.add(floor, images, (True, False)))
    triangles = geometry.triangles.astype(np.uint32)
    surfaces = Surfaces(
        vertices,
        triangles,
        material,
        geometry.triangle_normals,
        np.array(looks, np.float32),
        np.array(bundles, np.int32),
    )
    return surfaces, packer.pack()
