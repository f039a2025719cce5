"""Samples of edge pixels and layers of see-through surfaces, by rasterising only the pixels that need them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.raster import kernels_chosen
from viewsphere.engines.raster import kernels_samples as kernels
from viewsphere.geometry.camera import pixel_rays
from viewsphere.model.camera import Camera, Intrinsics
from viewsphere.truth.geometry import Geometry
from viewsphere.truth.visibility import RayTable, Visibility, homogeneous, index_rays, lens_table

OFFSETS = ((0.375, 0.125), (0.875, 0.375), (0.625, 0.875), (0.125, 0.625))
"""Places of the four samples in a pixel: a rotated grid, whose every row and column of quarters holds one."""

MOST_LAYERS = 8
POINTS_AT_ONCE = 1 << 20
"""How many points are sorted by depth in one pass (14 MB, and 100 MB for those that see through something)."""

_CENTER = np.full((2, 4), 0.5)
_ROTATED = np.array(OFFSETS).T.copy()

Int32 = NDArray[np.int32]
Float32 = NDArray[np.float32]
_Results = tuple[Int32, NDArray[np.float64], Int32]


@dataclass(frozen=True, eq=False)
class Samples:
    """Four samples of each edge pixel.

    pixels (E,) int32: flat indices, ascending. Then, four rows a pixel: position (4E, 2) float32 in pixels; rays (4E, 3)
    float32, camera axes, empty for a pinhole; triangle (4E,) int32, -1 where none; inverse_depth (4E,) float32 as in
    `Visibility`.
    """

    pixels: Int32
    position: Float32
    rays: Float32
    triangle: Int32
    inverse_depth: Float32


@dataclass(frozen=True, eq=False)
class Layer:
    """One surface each of some points: slot (n,) int32, triangle (n,) int32, inverse_depth (n,) float32."""

    slot: Int32
    triangle: Int32
    inverse_depth: Float32


def edge_samples(geometry: Geometry, camera: Camera, visibility: Visibility, owner: Int32) -> Samples | None:
    """The pixels whose samples do not all show the surface at the centre, with their samples; None if there are none.

    `visibility` is truth's buffer for this camera; owner (T,): equal where neighbouring triangles look alike. Each sample shows
    exactly what truth's rasteriser would see there. Looked at are the pixels that differ from a neighbour and, with a pinhole,
    those in which something nearer comes between the centres (thin wires).
    """
    look = visibility.triangle, visibility.inverse_depth, owner, geometry.triangle_normals
    marks = kernels_chosen.differing(*look)
    q = homogeneous(geometry, camera) if visibility.corners is None else visibility.corners
    nothing = np.zeros(len(geometry.triangles) + 1, np.bool_)
    if camera.distortion is not None:
        points = _Points.of(camera, marks, 4, 1)
        points.draw(geometry, q, nothing)
        parts = [points.results()]
    else:
        first = _Points.of(camera, marks, 4, 1, kernels_chosen.bounded(visibility.inverse_depth, marks))
        bound = first.farthest.copy()
        cell = first.cells(q)
        first.draw(geometry, q, nothing, visibility.triangle, cell=cell)
        again = kernels_chosen.undecided(first.grid, first.nearest, bound, first.missed)
        parts = [first.results(again)]
        if again.any():
            second = _Points.of(camera, again, 4, 1)
            second.draw(geometry, q, nothing, cell=cell)
            parts.append(second.results())
    return _edges(camera, parts, look)


def layers(
    geometry: Geometry,
    camera: Camera,
    triangle: Int32,
    inverse_depth: Float32,
    see_through: NDArray[np.bool_],
    pixels: Int32 | None = None,
) -> list[Layer]:
    """What is seen at the points that see through something: the solid surfaces behind, then see-through ones, back to front.

    The points, with what each shows (N,), are all pixels' centres in order, or the four samples of each of `pixels`
    (ascending); a slot is a point's index. see_through (T + 1,): the last entry, for triangle -1, is False. The first layer
    holds the nearest solid surfaces (nothing where there is none), the second the farthest see-through one of every such
    point, the third the next of those that have two, up to 8; farther ones are left out. Empty where nothing is see-through.

    A see-through surface that lies on a solid one (1/z the same within 1e-5) is in front of it, and of two that lie on one
    another the later triangle is in front: decals are on top.
    """
    if not see_through.any():
        return []
    count = 1 if pixels is None else 4
    everything = np.arange(camera.width * camera.height, dtype=np.int32) if pixels is None else pixels
    q = homogeneous(geometry, camera)
    stacks: list[list[Layer]] = []
    step = POINTS_AT_ONCE // count
    for begin in range(0, len(everything), step):
        part = everything[begin : begin + step]
        shown = triangle[begin * count :][: len(part) * count], inverse_depth[begin * count :][: len(part) * count]
        stacks.append(_layers_of(geometry, camera, q, part, shown, see_through, begin))
    depth = max((len(stack) for stack in stacks), default=0)
    return [_joined([stack[i] for stack in stacks if i < len(stack)]) for i in range(depth)]


def _layers_of(
    geometry: Geometry,
    camera: Camera,
    q: NDArray[np.float64],
    pixels: Int32,
    shown: tuple[Int32, Float32],
    see_through: NDArray[np.bool_],
    begin: int,
) -> list[Layer]:
    """Of some of the pixels, `begin` of them left out before."""
    count = len(shown[0]) // len(pixels)
    farthest = np.full(camera.width * camera.height, kernels_chosen.CLOSED, np.int32)
    farthest[pixels] = shown[1].reshape(-1, count).min(axis=1).view(np.int32)
    touched = _Points.of(camera, _marked(camera, pixels), count, 1, farthest.reshape(camera.height, camera.width))
    touched.show(*shown)
    touched.draw(geometry, q, see_through, only=True)
    chosen = np.flatnonzero(touched.counts.any(axis=1))
    if len(chosen) == 0:
        return []
    points = _Points.of(camera, _marked(camera, pixels[chosen]), count, MOST_LAYERS)
    points.draw(geometry, q, see_through)
    first = ((begin + chosen) * count).astype(np.int32)
    slots = (first[:, None] + np.arange(count, dtype=np.int32)).reshape(-1)
    return _sorted(points, slots)


def _sorted(points: _Points, slots: Int32) -> list[Layer]:
    nearest, seen, counts = points.nearest.reshape(-1), points.seen.reshape(-1), points.counts.reshape(-1)
    inverses, listed = points.inverses.reshape(len(seen), -1), points.listed.reshape(len(seen), -1)
    is_there = np.arange(inverses.shape[1]) < counts[:, None]
    number = (is_there & (inverses >= nearest[:, None] * (1 - kernels.TIE))).sum(axis=1)
    behind = np.flatnonzero((number > 0) & (seen >= 0))
    found = [Layer(slots[behind], seen[behind], nearest[behind].astype(np.float32))]
    for i in range(1, int(number.max(initial=0)) + 1):
        own = np.flatnonzero(number >= i)
        at = own, number[own] - i
        found.append(Layer(slots[own], listed[at], inverses[at].astype(np.float32)))
    return found if len(found) > 1 else []


def _joined(parts: Sequence[Layer]) -> Layer:
    return Layer(*(np.concatenate([getattr(p, name) for p in parts]) for name in ("slot", "triangle", "inverse_depth")))


def _marked(camera: Camera, pixels: Int32) -> NDArray[np.uint8]:
    marks = np.zeros(camera.width * camera.height, np.uint8)
    marks[pixels] = 1
    return marks.reshape(camera.height, camera.width)


@dataclass(frozen=True, eq=False)
class _Points:
    """Chosen pixels and what is drawn at their points, as `kernels_samples` describes it."""

    camera: Camera
    grid: Int32
    pixels: Int32
    nearest: NDArray[np.float64]
    seen: Int32
    farthest: Int32
    missed: NDArray[np.uint8]
    inverses: NDArray[np.float64]
    listed: Int32
    counts: NDArray[np.uint8]

    @classmethod
    def of(cls, camera: Camera, marks: NDArray[np.uint8], count: int, capacity: int, farthest: Int32 | None = None) -> _Points:
        """Of the marked pixels, `count` points each, which list up to `capacity` see-through surfaces."""
        grid, pixels = kernels_chosen.numbered(marks)
        n = len(pixels) - 1
        return cls(
            camera,
            grid,
            pixels,
            np.zeros((n, count)),
            np.full((n, count), -1, np.int32),
            kernels_chosen.closed(marks) if farthest is None else farthest,
            np.zeros(marks.shape, np.uint8),
            np.zeros((n, count, capacity)),
            np.zeros((n, count, capacity), np.int32),
            np.zeros((n, count), np.uint8),
        )

    def show(self, triangle: Int32, inverse_depth: Float32) -> None:
        """Begin with what the points are known to show."""
        self.nearest[:] = inverse_depth.reshape(self.nearest.shape)
        self.seen[:] = triangle.reshape(self.seen.shape)

    def cells(self, q: NDArray[np.float64]) -> Int32:
        """Pixels of each vertex whose points it may bound."""
        cell = np.empty((len(q), 4), np.int32)
        reach = (0.5, 0.5) if self.nearest.shape[1] == 1 else (0.125, 0.875)
        kernels.cells(q, *reach, self.camera.width, self.camera.height, cell)
        return cell

    def draw(
        self,
        geometry: Geometry,
        q: NDArray[np.float64],
        see_through: NDArray[np.bool_],
        triangle: Int32 | None = None,
        only: bool = False,
        cell: Int32 | None = None,
    ) -> None:
        """Draw the geometry, what `triangle` (H, W) shows around the points first; `only` what is see-through if asked.

        `cell` is `cells(q)`, where it is known.
        """
        count, lens = self.nearest.shape[1], self.camera.distortion
        fragments = self.inverses, self.listed, self.counts, geometry.vertices
        surfaces = geometry.triangles, geometry.triangle_cutout, geometry.cutouts.arrays, see_through, only
        if lens is not None:
            side = 1 if count == 1 else 2
            table = lens_table(self.camera) if side == 1 else _sample_table(self.camera.intrinsics.model_dump_json())
            solid = self.nearest, self.seen
            unit = lens.model == "fisheye"
            kernels.draw_rays(q, *surfaces, unit, table.arrays, (self.grid, self.pixels, side), solid, fragments)
            return
        offsets, reach = (_CENTER, (0.5, 0.5)) if count == 1 else (_ROTATED, (0.125, 0.875))
        if cell is None:
            cell = self.cells(q)
        total = len(geometry.triangles)
        order = np.arange(total, dtype=np.int32)
        if triangle is not None:
            order = kernels_chosen.front_first(triangle, self.grid, self.pixels, total)
        tiles = kernels_chosen.tiled(self.farthest)
        solid = self.nearest, self.seen, self.farthest, tiles, self.missed
        kernels.draw(q, cell, order, *surfaces, (self.grid, self.pixels, offsets, reach), solid, fragments)

    def results(self, left_out: NDArray[np.uint8] | None = None) -> _Results:
        """pixels, nearest and seen of all chosen pixels but those marked."""
        pixels = self.pixels[:-1]
        if left_out is None:
            return pixels, self.nearest, self.seen
        kept = np.flatnonzero(left_out.reshape(-1)[pixels] == 0)
        return pixels[kept], self.nearest[kept], self.seen[kept]


def _edges(camera: Camera, parts: Sequence[_Results], look: tuple[Any, ...]) -> Samples | None:
    """The pixels of `parts` whose samples look different from their centre."""
    triangle, depth, owner, normals = look
    chosen: list[_Results] = []
    for pixels, nearest, seen in parts:
        kept = kernels_chosen.distinct(pixels, triangle.reshape(-1), depth.reshape(-1), seen, nearest, owner, normals)
        chosen.append((pixels[kept], nearest[kept], seen[kept]))
    pixels, nearest, seen = (np.concatenate(arrays) for arrays in zip(*chosen, strict=True))
    if len(pixels) == 0:
        return None
    if len(chosen) > 1:
        order = np.argsort(pixels)
        pixels, nearest, seen = pixels[order], nearest[order], seen[order]
    y, x = np.divmod(pixels, camera.width)
    position = np.stack([x, y], axis=1)[:, None] + _ROTATED.T
    rays = np.zeros((0, 3), np.float32)
    if camera.distortion is not None:
        table = _sample_table(camera.intrinsics.model_dump_json()).rays
        quarter = np.arange(4)
        rays = table[2 * y[:, None] + quarter // 2, 2 * x[:, None] + quarter % 2].reshape(-1, 3).astype(np.float32)
    return Samples(
        pixels, position.reshape(-1, 2).astype(np.float32), rays, seen.reshape(-1), nearest.reshape(-1).astype(np.float32)
    )


@lru_cache(maxsize=2)
def _sample_table(lens: str) -> RayTable:
    """Rays of a distorted lens' samples, (2H, 2W, 3): sample i of a pixel in row i // 2 and column i % 2 of its four."""
    intrinsics = Intrinsics.model_validate_json(lens)
    rays = np.empty((2 * intrinsics.height, 2 * intrinsics.width, 3))
    for i, (x, y) in enumerate(OFFSETS):
        shifted = intrinsics.model_copy(update={"cx": intrinsics.cx - (x - 0.5), "cy": intrinsics.cy - (y - 0.5)})
        rays[i // 2 :: 2, i % 2 :: 2] = pixel_rays(shifted)
    return index_rays(intrinsics, rays, 2)
