"""Pack what the triangles are made of for the shading kernels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from viewsphere.assets.mesh import Mesh
from viewsphere.assets.repaint import repainted
from viewsphere.engines.raster.bundles import BundlePacker
from viewsphere.engines.raster.kernels_rows import place_rows
from viewsphere.engines.raster.material_rows import material_row
from viewsphere.engines.raster.records import Float32, Int32, Surfaces, Textures
from viewsphere.model.scene import Ground
from viewsphere.model.thing import Repaint, Thing
from viewsphere.surroundings.ground import ground_frame, ground_material
from viewsphere.truth.geometry import Geometry


class Lengths(NamedTuple):
    """What the engine's lengths are in, `unit` metres, and where they begin, `origin` (world metres)."""

    origin: tuple[float, float, float]
    unit: float


class Materials(NamedTuple):
    """Materials of a stage, the ground's last. looks and bundles: see `Surfaces`; first: of each mesh, where its own begin;
    made_of: equal for meshes that have the same.
    """

    looks: Float32
    bundles: Int32
    textures: Textures
    first: tuple[int, ...]
    made_of: object


def made_of(meshes: Sequence[Mesh]) -> object:
    """All that materials are packed from."""
    return [(mesh.materials, mesh.images, mesh.uv0 is None, mesh.uv1 is None) for mesh in meshes]


def pack_materials(
    meshes: Sequence[Mesh], ground: Ground | None, lengths: Lengths, targets: int, things: Sequence[Thing] = ()
) -> Materials:
    """The materials of all meshes.

    The first `targets` meshes are what the picture is about, the others scenery. `things[i].repaints` change the materials
    of `meshes[i]`. Raises UserError for a picture of the ground that cannot be read.
    """
    looks: list[list[float]] = []
    bundles: list[list[int]] = []
    packer = BundlePacker()
    first: list[int] = []
    first_row: dict[tuple[int, bool, tuple[Repaint, ...]], int] = {}
    for i, mesh in enumerate(meshes):
        repaints = things[i].repaints if things else ()
        kind = id(mesh), i >= targets, repaints
        if kind not in first_row:
            first_row[kind] = len(looks)
            has_uv = mesh.uv0 is not None, mesh.uv1 is not None
            for original in mesh.materials:
                m, repaint = repainted(original, repaints)
                looks.append(material_row(m, repaint, scenery=i >= targets))
                bundles.append(packer.add(m, mesh.images, has_uv))
        first.append(first_row[kind])
    ground = ground or Ground()
    floor, images = ground_material(ground)
    per_length, _, _ = ground_frame(ground, floor, lengths.origin, lengths.unit)
    looks.append(material_row(floor, ground=True, catcher=ground.catcher, per_length=per_length))
    bundles.append(packer.add(floor, images, (True, False)))
    packed = np.array(looks, np.float32), np.array(bundles, np.int32)
    return Materials(*packed, packer.pack(), tuple(first), made_of(meshes))


def pack_surfaces(geometry: Geometry, meshes: Sequence[Mesh], materials: Materials, lengths: Lengths) -> Surfaces:
    """Arrays for all triangles of a geometry and of the meshes it was built from, made of `pack_materials` of these."""
    vertices = np.zeros((len(geometry.coordinates), 16), np.float32)
    vertices[:, 7:11] = 1.0
    material = np.empty(len(geometry.triangles), np.int32)
    for i, mesh in enumerate(meshes):
        own = slice(geometry.vertex_start[i], geometry.vertex_start[i + 1])
        for first, values in ((3, mesh.uv0), (5, mesh.uv1), (7, mesh.colors)):
            if values is not None:
                vertices[own, first : first + values.shape[1]] = np.nan_to_num(values, nan=0.0, posinf=0.0, neginf=0.0)
        own = slice(geometry.triangle_start[i], geometry.triangle_start[i + 1])
        material[own] = mesh.triangle_material + materials.first[i]
    material[geometry.triangle_start[-1] :] = len(materials.looks) - 1
    for i in range(len(meshes)):
        _place(vertices, geometry, i, lengths)
    _place_ground(vertices, geometry, lengths)
    return Surfaces(
        vertices, geometry.triangles.view(np.uint32), material, geometry.triangle_normals, materials.looks, materials.bundles
    )


def move_surfaces(surfaces: Surfaces, geometry: Geometry, things: Sequence[int], lengths: Lengths) -> Surfaces:
    """The same where these things, and the ground, are elsewhere: their vertices are written in place."""
    for i in things:
        _place(surfaces.vertices, geometry, i, lengths)
    _place_ground(surfaces.vertices, geometry, lengths)
    return surfaces._replace(normals=geometry.triangle_normals)


def _place(rows: Float32, geometry: Geometry, i: int, lengths: Lengths) -> None:
    """Those of thing i. Without numbers for a normal a face is flat."""
    own = slice(geometry.vertex_start[i], geometry.vertex_start[i + 1])
    frame = np.array(lengths.origin), lengths.unit
    place_rows(geometry.poses[i], geometry.coordinates[own], geometry.own_normals[own], *frame, rows[own])


def _place_ground(rows: Float32, geometry: Geometry, lengths: Lengths) -> None:
    start = geometry.vertex_start[-1]
    rows[start:, :3] = geometry.own_normals[start:]
    rows[start:, 11:14] = (geometry.ground - lengths.origin) / lengths.unit
