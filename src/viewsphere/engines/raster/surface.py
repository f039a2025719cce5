"""Pack what the triangles are made of for the shading kernels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.assets.srgb import linear
from viewsphere.engines.raster.records import Float32, Surfaces, Textures
from viewsphere.engines.raster.textures import TexturePacker
from viewsphere.model.scene import Ground
from viewsphere.truth.geometry import Geometry

# Columns of Surfaces.materials: base colour and alpha (4), roughness, metallic, emission (3), reflectance at normal
# incidence, clear coat and its roughness, unlit, ground, blended, transmission, alpha from which it casts a shadow
# (0: always, above 1: never), scenery. Columns of Surfaces.slots: base colour, metallic-roughness, emission.
BLENDED, TRANSMISSION, CASTS_FROM = 14, 15, 16
NO_SHADOW = 2.0


def pack_surfaces(
    geometry: Geometry,
    meshes: Sequence[Mesh],
    ground: Ground | None,
    origin: NDArray[np.float64],
    unit: float,
    exposure: float,
    targets: int,
) -> tuple[Surfaces, Textures]:
    """Arrays for all triangles of a geometry and of the meshes it was built from; positions from `origin` in `unit`s.

    The first `targets` meshes are what the picture is about, the others scenery.
    """
    vertices = np.zeros((len(geometry.vertices), 16), np.float32)
    vertices[:, :3] = geometry.normals
    vertices[:, 7:11] = 1.0
    vertices[:, 11:14] = (geometry.vertices - origin) / unit
    material = np.zeros(len(geometry.triangles), np.int32)
    rows: list[list[float]] = []
    slots: list[list[int]] = []
    packer = TexturePacker()
    first_row: dict[tuple[int, bool], int] = {}
    for i, mesh in enumerate(meshes):
        own = slice(geometry.vertex_start[i], geometry.vertex_start[i + 1])
        for column, uv in ((3, mesh.uv0), (5, mesh.uv1)):
            if uv is not None:
                vertices[own, column : column + 2] = uv
        if mesh.colors is not None:
            vertices[own, 7:11] = mesh.colors
        kind = id(mesh), i >= targets
        if kind not in first_row:
            first_row[kind] = len(rows)
            for m in mesh.materials:
                rows.append([*_material_row(m, exposure), float(i >= targets)])
                slots.append(_material_slots(m, mesh, packer))
        own = slice(geometry.triangle_start[i], geometry.triangle_start[i + 1])
        material[own] = mesh.triangle_material + first_row[kind]
    material[geometry.triangle_start[-1] :] = len(rows)
    rows.append(_ground_row(ground or Ground()))
    slots.append([-1] * 3)
    triangles = geometry.triangles.astype(np.uint32)
    surfaces = Surfaces(
        vertices,
        triangles,
        material,
        _uv_density(vertices, geometry.triangles),
        geometry.triangle_normals,
        np.array(rows, np.float32),
        np.array(slots, np.int32),
    )
    return surfaces, packer.pack()


def _material_row(m: Material, exposure: float) -> list[float]:
    reflectance = min(((m.ior - 1) / (m.ior + 1)) ** 2 * m.specular, 1.0)
    emission = [exposure * e for e in m.emissive]
    coat = [m.clearcoat, m.clearcoat_roughness]
    flags = [float(m.unlit), 0.0, float(m.alpha_mode == "BLEND"), m.transmission * (1 - m.metallic)]
    shadow = {"OPAQUE": 0.0, "MASK": m.alpha_cutoff, "BLEND": 0.5}[m.alpha_mode]
    shadow = NO_SHADOW if m.transmission > 0.5 else shadow
    return [*m.base_color, m.roughness, m.metallic, *emission, reflectance, *coat, *flags, shadow]


def _material_slots(m: Material, mesh: Mesh, packer: TexturePacker) -> list[int]:
    uses = ((m.base_color_texture, True), (m.metallic_roughness_texture, False), (m.emissive_texture, True))
    slots: list[int] = []
    for texture, is_color in uses:
        uv = None if texture is None else (mesh.uv0, mesh.uv1)[texture.texcoord]
        slots.append(-1 if uv is None else packer.slot(mesh.images, texture, is_color))
    return slots


def _ground_row(ground: Ground) -> list[float]:
    color = linear(ground.color).tolist()
    return [*color, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, NO_SHADOW, 0.0]


def _uv_density(vertices: Float32, triangles: NDArray[np.int32]) -> Float32:
    """Squared gradients of u and v of both uv sets on each triangle, (T, 4) per square metre."""
    density = np.zeros((len(triangles), 4), np.float32)
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    p, q = b[:, 11:14] - a[:, 11:14], c[:, 11:14] - a[:, 11:14]
    pp, pq, qq = (p * p).sum(1), (p * q).sum(1), (q * q).sum(1)
    area = pp * qq - pq * pq
    safe = np.where(area > 0, area, 1)
    for k in range(4):
        s, t = b[:, 3 + k] - a[:, 3 + k], c[:, 3 + k] - a[:, 3 + k]
        squared = qq * s * s - 2 * pq * s * t + pp * t * t
        density[:, k] = np.where(area > 0, np.maximum(squared, 0) / safe, 0)
    return density
