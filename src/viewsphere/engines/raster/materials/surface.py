"""The materials and vertices of triangles, packed for the shading kernels."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.appearance.repaint import repainted
from viewsphere.assets.mesh import Mesh
from viewsphere.engines.raster.materials.bundles import BundlePacker
from viewsphere.engines.raster.materials.kernels_rows import place_rows
from viewsphere.engines.raster.materials.material_rows import material_row
from viewsphere.engines.raster.records import Float32, Int32, Surfaces, Textures
from viewsphere.model.scene import Ground
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.thing import Repaint, Thing
from viewsphere.rendering.ground.material import ground_frame, ground_material
from viewsphere.truth.raster.geometry import UP, Geometry, read_only
from viewsphere.truth.raster.sparse import sparse
from viewsphere.truth.raster.visibility import Visibility, things_in


class Lengths(NamedTuple):
    """The frame of the engine's lengths: `unit` in metres, and `origin` in world metres."""

    origin: tuple[float, float, float]
    unit: float


class Materials(NamedTuple):
    """Materials of a stage, the ground's last. looks and bundles: see `Surfaces`; first: the index of each mesh's first
    material; made_of: equal for meshes with equal materials.
    """

    looks: Float32
    bundles: Int32
    textures: Textures
    first: tuple[int, ...]
    made_of: object


def made_of(meshes: Sequence[Mesh]) -> object:
    """Return the mesh data from which materials are packed."""
    return [(mesh.materials, mesh.images, mesh.uv0 is None, mesh.uv1 is None) for mesh in meshes]


def pack_materials(
    meshes: Sequence[Mesh], ground: Ground | None, lengths: Lengths, targets: int, things: Sequence[Thing] = ()
) -> Materials:
    """The materials of all meshes.

    The first `targets` meshes are the targets of the picture, the others are scenery. `things[i].repaints` change the materials
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
                bundles.append(packer.add(m, mesh.images, has_uv, is_scenery=i >= targets))
        first.append(first_row[kind])
    ground = ground or Ground()
    floor, images = ground_material(ground)
    per_length, _, _ = ground_frame(ground, floor, lengths.origin, lengths.unit)
    looks.append(material_row(floor, ground=True, catcher=ground.catcher, per_length=per_length))
    bundles.append(packer.add(floor, images, (True, False)))
    packed = np.array(looks, np.float32), np.array(bundles, np.int32)
    return Materials(*packed, packer.pack(), tuple(first), made_of(meshes))


@dataclass(eq=False)
class Rows:
    """The vertices of a stage's surfaces; those of a thing are written when it is first seen. Most things of a town are never
    in a picture: they only cast shadows, for which temporary rows are enough.
    """

    surfaces: Surfaces
    geometry: Geometry
    meshes: Sequence[Mesh]
    lengths: Lengths
    _written: NDArray[np.bool_]

    @classmethod
    def from_geometry(cls, geometry: Geometry, meshes: Sequence[Mesh], materials: Materials, lengths: Lengths) -> Rows:
        """The rows of all triangles of a geometry and of the meshes it was built from; `materials` is the result of
        `pack_materials` for these.
        """
        vertices = sparse((len(geometry.coordinates), 16), np.float32)
        material = np.empty(len(geometry.triangles), np.int32)
        for i, mesh in enumerate(meshes):
            own = slice(geometry.triangle_start[i], geometry.triangle_start[i + 1])
            material[own] = mesh.triangle_material + materials.first[i]
        material[geometry.triangle_start[-1] :] = len(materials.looks) - 1
        triangles, normals = geometry.triangles.view(np.uint32), geometry.triangle_normals
        surfaces = Surfaces(vertices, triangles, material, normals, materials.looks, materials.bundles)
        rows = cls(surfaces, geometry, meshes, lengths, np.zeros(len(meshes), np.bool_))
        rows._write_ground()
        return rows

    def write(self, things: Iterable[int]) -> None:
        """Write the rows of these things that are not yet written."""
        for i in things:
            if not self._written[i]:
                self._write(i, self.surfaces.vertices[self._own(i)])
                self._written[i] = True

    def write_seen(self, camera: Camera, visibility: Visibility, geometry: Geometry) -> None:
        """Write the rows, and the facing, of triangles that may be in a picture."""
        seen = things_in(geometry, camera, visibility)
        self.write(seen)
        self.geometry.triangle_normals_of(seen)

    def move(self, geometry: Geometry, meshes: Sequence[Mesh], things: Iterable[int]) -> None:
        """Move or deform these things and the ground: their rows are overwritten in place.

        Their facing is written when they are seen, because most things that drive through a town are in no picture.
        """
        self.geometry, self.meshes = geometry, meshes
        self.surfaces = self.surfaces._replace(normals=geometry.triangle_normals_of(()))
        for i in things:
            if self._written[i]:
                self._place(i, self.surfaces.vertices[self._own(i)])
        self._write_ground()

    def part(self, i: int) -> Surfaces:
        """The surfaces of thing i alone, or of the ground, whose index is after the last."""
        starts = (*self.geometry.triangle_start, len(self.geometry.triangles))
        own = part_of(self.surfaces, starts[i], starts[i + 1])
        if i == len(self._written) or self._written[i]:
            return own
        span = self._own(i)
        rows = np.empty((span.stop - span.start, 16), np.float32)
        self._write(i, rows)
        return own._replace(vertices=rows, triangles=own.triangles - np.uint32(span.start))

    def _own(self, i: int) -> slice:
        return slice(self.geometry.vertex_start[i], self.geometry.vertex_start[i + 1])

    def _write(self, i: int, rows: Float32) -> None:
        """Write the rows of thing i."""
        mesh = self.meshes[i]
        rows[:] = 0.0
        rows[:, 7:11] = 1.0
        for first, values in ((3, mesh.uv0), (5, mesh.uv1), (7, mesh.colors)):
            if values is not None:
                rows[:, first : first + values.shape[1]] = np.nan_to_num(values, nan=0.0, posinf=0.0, neginf=0.0)
        self._place(i, rows)

    def _place(self, i: int, rows: Float32) -> None:
        """Write the place of thing i, and its normals. A face without valid normals is flat."""
        g, frame = self.geometry, (np.array(self.lengths.origin), self.lengths.unit)
        place_rows(g.poses[i], g.coordinates[self._own(i)], read_only(self.meshes[i].normals), *frame, rows)

    def _write_ground(self) -> None:
        g, rows = self.geometry, self.surfaces.vertices[self.geometry.vertex_start[-1] :]
        rows[:, 3:] = 0.0
        rows[:, :3], rows[:, 7:11] = UP, 1.0
        rows[:, 11:14] = (g.ground - self.lengths.origin) / self.lengths.unit


def part_of(surfaces: Surfaces, first: int, stop: int | None = None) -> Surfaces:
    """The surfaces of triangles [first, stop) alone."""
    return surfaces._replace(triangles=surfaces.triangles[first:stop], material=surfaces.material[first:stop])
