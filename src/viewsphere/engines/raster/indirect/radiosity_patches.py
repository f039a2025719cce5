"""Patches of the surfaces around probes: ray hits grouped by place, material and side."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.raster.indirect import kernels_probes as kernels
from viewsphere.engines.raster.records import Float32, Int32, PictureRays, Surfaces, Textures
from viewsphere.engines.raster.reflections.tracing import Tree
from viewsphere.engines.raster.shadows.shadow_maps import Lights

ROOM = 1 << 17
"""Initial number of places in a table; it is doubled until all patches fill less than half of it."""


class Table(NamedTuple):
    """An open-addressing table of S places, and the first hits of up to S / 2 patches. keys (S,) uint64; patch (S,) int32, -1
    for empty; known (S / 2,) int32: the number of stored hits; triangle, far (S / 2, HITS); place, way, normal (S / 2, HITS,
    3): the place of a hit, the ray's direction, and the normal on the side that the ray sees.
    """

    keys: NDArray[np.uint64]
    patch: Int32
    known: Int32
    triangle: Int32
    far: Float32
    place: Float32
    way: Float32
    normal: Float32


class Rays(NamedTuple):
    """Rays from origins (N, 3) in the K directions (W, K, 3) of each origin's turn (N,), and their hits: triangles (K, N), -1
    for none, and distances.
    """

    origins: Float32
    directions: Float32
    turn: Int32
    met: Int32
    far: Float32


class _Lit(NamedTuple):
    """The light that patches emit or reflect directly.

    Its fields are reflectance (M, 3), emitted radiance (M, 3), and irradiance of lamps and sun (M, 3).
    """

    reflectance: Float32
    emitted: Float32
    arrived: Float32


@dataclass(frozen=True, eq=False)
class Patches:
    """M patches and their hits, as in `Table`; ids: for each bundle of rays, the patches that they hit (K, N) int32."""

    table: Table
    count: int
    ids: tuple[Int32, ...]

    def trimmed(self) -> Patches:
        """The patches without the room for further ones."""
        kept = {name: getattr(self.table, name)[: self.count].copy() for name in Table._fields[2:]}
        return Patches(self.table._replace(**kept), self.count, self.ids)

    @property
    def is_ground(self) -> NDArray[np.bool_]:
        """A mask of the patches that lie on the ground, (M,)."""
        return self.table.triangle[: self.count, 0] == kernels.GROUND

    @property
    def triangles(self) -> Int32:
        """One triangle of each patch, (M,); negative on the ground."""
        return self.table.triangle[: self.count, 0]

    @property
    def places(self) -> Float32:
        """The middles of the patches, (M, 3)."""
        return self._mean(self.table.place)

    @property
    def normals(self) -> Float32:
        """The normals of the patches, (M, 3)."""
        mean = self._mean(self.table.normal)
        return mean / np.maximum(np.sqrt((mean * mean).sum(axis=1, keepdims=True)), np.float32(1e-6))

    def _mean(self, values: Float32) -> Float32:
        known = self.table.known[: self.count]
        is_known = np.arange(kernels.HITS) < known[:, None]
        total = np.where(is_known[..., None], values[: self.count], np.float32(0)).sum(axis=1, dtype=np.float32)
        return total / known[:, None].astype(np.float32)

    def lit(
        self,
        which: Int32,
        surfaces: Surfaces,
        textures: Textures,
        floor: Float32,
        albedo: Float32,
        tree: Tree,
        lights: Lights,
        off: float,
    ) -> _Lit:
        """Return the patches' materials, and the light of lamps and sun on them.

        which (T,): the indices of the surfaces' triangles that rays meet; `off`: the distance from surfaces at which shadows
        begin; `albedo`: see `Surrounding`.
        """
        table = self.table
        rows, columns = np.nonzero(np.arange(kernels.HITS) < table.known[: self.count, None])
        triangle = table.triangle[rows, columns]
        whole = np.where(triangle >= 0, which[np.maximum(triangle, 0)], triangle)
        width = np.float32(np.sqrt(4 * np.pi / len(self.ids[0])) / 2)
        answers, arrived = np.zeros((len(rows), 6), np.float32), np.zeros((len(rows), 3), np.float32)
        for is_ground in (False, True):
            own = np.flatnonzero((triangle == kernels.GROUND) == is_ground)
            at = rows[own], columns[own]
            place, way, pixel = table.place[at], table.way[at], table.far[at] * width
            part = np.zeros((len(own), 6), np.float32), np.zeros((len(own), 3), np.float32)
            kernels.shade_hits(
                ANY_VIEW, surfaces, textures, floor, albedo, tree, lights, np.float32(off), whole[own], place, way, pixel,
                is_ground, True, *part,
            )  # fmt: skip
            answers[own], arrived[own] = part
        hits = np.zeros((self.count, kernels.HITS, 9), np.float32)
        hits[rows, columns] = np.concatenate([answers, arrived], axis=1)
        mean = self._mean(hits)
        return _Lit(mean[:, :3], mean[:, 3:6], mean[:, 6:])


ANY_VIEW = PictureRays(
    eye=np.zeros(3, np.float32),
    rotation=np.eye(3, dtype=np.float32),
    lens=np.zeros((2, 3), np.float32),
    rays=np.zeros((1, 3), np.float32),
    columns=np.uint32(1),
    pixel=np.float32(0),
    scale=np.float32(1),
)
"""A view whose rays have no grid: footprints are taken across each ray, see `kernels_material`."""


def patches_of(
    bundles: list[Rays],
    normals: Float32,
    materials: Int32,
    box: Float32,
    cells: float,
    ground: Float32,
    begun: Patches | None = None,
) -> Patches:
    """The patches that all these rays hit, in their order. `begun` has the patches of the first bundles; its table is reused
    and must not be used any more. Other arguments as in `kernels_probes.patch`.
    """
    done = begun or Patches(_empty(ROOM), 0, ())
    while True:
        table, count, ids = done.table, done.count, list(done.ids)
        for rays in bundles[len(ids) :]:
            own = np.empty(rays.met.shape, np.int32)
            if count >= 0:
                met = rays.met, rays.far, rays.origins, rays.directions, rays.turn
                count = kernels.patch(*met, normals, materials, box, np.float32(cells), ground, table, count, own)
            ids.append(own)
        if count >= 0:
            return Patches(table, count, tuple(ids))
        done = Patches(_empty(2 * len(table.keys)), 0, ())


def _empty(size: int) -> Table:
    half = size // 2 + 1
    vectors = (np.empty((half, kernels.HITS, 3), np.float32) for _ in range(3))
    return Table(
        np.zeros(size, np.uint64),
        np.full(size, -1, np.int32),
        np.zeros(half, np.int32),
        np.zeros((half, kernels.HITS), np.int32),
        np.zeros((half, kernels.HITS), np.float32),
        *vectors,
    )
