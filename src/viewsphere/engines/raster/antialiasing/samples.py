"""Samples of edge pixels and layers of see-through surfaces, computed by rasterising only the pixels that need them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.raster.antialiasing import kernels_chosen, kernels_edges, kernels_lines
from viewsphere.engines.raster.antialiasing import kernels_samples as kernels
from viewsphere.geometry.camera import pixel_rays
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.model.sensors.rolling import RowPoses
from viewsphere.truth.raster.geometry import Geometry, seen_from
from viewsphere.truth.raster.rolling import Active, edge_on, rolled_world, single_of
from viewsphere.truth.raster.visibility import (
    RayTable,
    Runs,
    Visibility,
    homogeneous,
    in_picture,
    index_rays,
    lens_table,
    things_in,
)

OFFSETS = ((0.375, 0.125), (0.875, 0.375), (0.625, 0.875), (0.125, 0.625))
"""Positions of the four samples in a pixel: a rotated grid, in which each row and each column of quarters has one sample."""

MOST_LAYERS = 8
POINTS_AT_ONCE = 1 << 20
"""Number of points that are sorted by depth in one pass (100 MB of lists)."""

_CENTER = np.full((2, 4), 0.5)
_ROTATED = np.array(OFFSETS).T.copy()
_CENTER_REACH, _ROTATED_REACH = (0.5, 0.5), (0.125, 0.875)
_NO_PIXELS = np.zeros(0, np.int32)
NOWHERE = np.zeros(0, np.uint8)
"""The marks of a picture without marked pixels."""

Int32 = NDArray[np.int32]
Float32 = NDArray[np.float32]
Bool = NDArray[np.bool_]
Marks = NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Samples:
    """Four samples of each edge pixel.

    pixels (E,) int32: flat indices, each once. The others have four rows per pixel: position (4E, 2) float32 in pixels; rays
    (4E, 3) float32, camera axes, empty for a pinhole and for parallel rays; triangle (4E,) int32, -1 if none; inverse_depth
    (4E,) float32 as in `Visibility`.
    """

    pixels: Int32
    position: Float32
    rays: Float32
    triangle: Int32
    inverse_depth: Float32


@dataclass(frozen=True, eq=False)
class Layer:
    """One surface at each of some points: slot (n,) int32, triangle (n,) int32, inverse_depth (n,) float32."""

    slot: Int32
    triangle: Int32
    inverse_depth: Float32


def edge_samples(
    geometry: Geometry, camera: Camera, visibility: Visibility, owner: Int32, behind: Marks = NOWHERE
) -> Samples | None:
    """The pixels whose samples do not all show the surface at the centre, with their samples; None if there are none.

    `visibility` is truth's buffer for this camera; owner (T,): equal for neighbouring triangles that look alike. Candidates are
    the pixels that differ from a neighbour and, with a pinhole, the pixels in which a surface passes between the centres. This
    surface is nearer (thin wires), or equally far (thin lines on a surface, `kernels_lines`). Pixels marked in behind (H * W,),
    if `behind` is not empty, are always returned. With a distorted lens, each sample is exactly the result of truth's
    rasteriser at that point. With a pinhole, nearly all samples are. A triangle is left out if no centre nearby shows it and it
    has no corner in such a pixel (`kernels_edges`). The sample then shows the surface behind it, or the one at the centre.
    """
    rows = camera.rows
    q = np.empty((0, 4)) if rows is not None else visibility.corners
    q = homogeneous(geometry, camera) if q is None else q
    geometry = geometry if rows is not None else seen_from(geometry, q)
    normals = geometry.triangle_normals_of(things_in(geometry, camera, visibility))
    look = visibility.triangle, visibility.inverse_depth, owner, normals
    marks = _differs_from_neighbour(*look)
    if camera.lens.period is not None:
        _mark_across_seam(marks, *look)
    marks[: len(behind)] |= behind
    if camera.lens.is_linear and rows is None:
        pixels, position, triangle, inverse = _pinhole_edges(geometry, visibility, marks, q, owner, normals, behind)
        samples = Samples(pixels, position, np.zeros((0, 3), np.float32), triangle, inverse)
    else:
        points = _Points.from_marks(
            camera, marks[: visibility.triangle.size].reshape(visibility.triangle.shape), 4, 1, visibility.active
        )
        _draw_all(points, geometry, q, visibility.triangle)
        known = np.zeros(0, np.float32)
        found = points.pixels[:-1], points.nearest.astype(np.float32), points.seen, known, _ROTATED
        pixels, position, triangle, inverse = _differing(len(points.seen), *found, *look, behind)
        samples = Samples(pixels, position, _sample_rays(camera, pixels), triangle, inverse)
    return samples if len(samples.pixels) else None


def _draw_all(points: _Points, geometry: Geometry, q: NDArray[np.float64], triangle: Int32) -> None:
    """Draw all triangles, those that the centres around the points show (`triangle`) before the others, which they hide."""
    is_first = np.zeros(len(geometry.triangles), np.bool_)
    kernels_chosen.shown_around(triangle, points.pixels, is_first.view(np.uint8))
    opaque = np.zeros(len(geometry.triangles) + 1, np.bool_)
    for which in (is_first, ~is_first):
        points.draw(geometry, q, opaque, np.flatnonzero(which))


def differs_behind(visibility: Visibility, stack: Sequence[Layer], owner: Int32, normals: Float32, radiance: Float32) -> Marks:
    """Marks (H * W,) of pixels that look like a neighbour in front, but not behind a see-through surface; empty if nothing is
    see-through.

    `stack` is the result of `layers` for the pixels' centres, and radiance (H * W, 4) has their colours: if two pixels have
    equal colours, a difference behind is invisible.
    """
    if not stack:
        return NOWHERE
    marks = np.zeros(visibility.triangle.size, np.uint8)
    shown = visibility.triangle, visibility.inverse_depth
    behind, depth = shown[0].flatten(), shown[1].flatten()  # the see-through surface if there is no solid one
    for i, layer in enumerate(stack):
        if i > 0:
            behind[:] = -1  # beyond the end of a see-through surface this layer is empty
        behind[layer.slot], depth[layer.slot] = layer.triangle, layer.inverse_depth
        kernels_chosen.compare_behind(layer.slot, behind, depth, *shown, owner, normals, radiance, marks)
    return marks


def layers(
    geometry: Geometry,
    camera: Camera,
    triangle: Int32,
    inverse_depth: Float32,
    see_through: Bool,
    pixels: Int32 | None = None,
    corners: NDArray[np.float64] | None = None,
    active: Active | None = None,
) -> list[Layer]:
    """Surfaces at the points that see through something: the solid surfaces behind, then the see-through ones, back to front.

    The points, with the triangle that each shows (N,), are all pixels' centres in order, or the four samples of each of
    `pixels`; a slot is a point's index. see_through (T + 1,): the last entry, for triangle -1, is False; `corners` is
    `Visibility.corners`, if known, and `active` is `Visibility.active`.

    The first layer has the nearest solid surfaces (nothing if there is none), the second the farthest see-through surface of
    every such point. The third has the next surface of points with two, and so on up to 8; farther surfaces are left out. The
    list is empty if nothing is see-through.

    A see-through surface that coincides with a solid one (1/z equal within 1e-5) is in front of it. Of two coincident
    see-through surfaces, the later triangle is in front: decals are on top.
    """
    if not see_through.any():
        return []
    if camera.rows is not None:
        q, clear = np.empty((0, 4)), np.flatnonzero(see_through)
    else:
        q = homogeneous(geometry, camera) if corners is None else corners
        geometry = seen_from(geometry, q)
        clear = _within(in_picture(geometry, q)[1], see_through)
    shape, count = (camera.height, camera.width), 1 if pixels is None else 4
    shown = triangle.reshape(-1, count), inverse_depth.reshape(-1, count)
    farthest = kernels_chosen.shown_farthest(*shown, _NO_PIXELS if pixels is None else pixels, *shape)
    row_of = _NO_PIXELS
    if pixels is not None:
        row_of = np.zeros(shape[0] * shape[1], np.int32)
        row_of[pixels] = np.arange(len(pixels))
    if camera.lens.is_linear and camera.rows is None:
        reach = _CENTER_REACH if count == 1 else _ROTATED_REACH
        chosen = np.flatnonzero(kernels.touched_boxes(q, clear, geometry.triangles, reach, farthest))
    else:
        chosen = _touched(
            _Points.from_marks(camera, (farthest != kernels_chosen.CLOSED).view(np.uint8), count, 1, active),
            geometry,
            q,
            see_through,
        )
    stacks: list[list[Layer]] = []
    step = POINTS_AT_ONCE // count
    for begin in range(0, len(chosen), step):
        part = chosen[begin : begin + step]
        rows = part if pixels is None else row_of[part]
        marks = np.zeros(shape, np.uint8)
        marks.reshape(-1)[part] = 1
        points = _Points.from_marks(camera, marks, count, MOST_LAYERS, active)
        _pile(points, geometry, q, see_through, clear, (shown[0][rows], shown[1][rows]))
        slots = (rows[:, None] * count + np.arange(count)).reshape(-1).astype(np.int32)
        stacks.append(_sorted(points, slots))
    depth = max((len(stack) for stack in stacks), default=0)
    return [_joined([stack[i] for stack in stacks if i < len(stack)]) for i in range(depth)]


def _touched(points: _Points, geometry: Geometry, q: NDArray[np.float64], see_through: Bool) -> NDArray[np.intp]:
    """Pixels of a distorted lens with points at which a see-through surface may be in front."""
    points.draw(geometry, q, see_through, np.flatnonzero(see_through))
    return points.pixels[:-1][points.counts.any(axis=1)].astype(np.intp)


def _pile(
    points: _Points,
    geometry: Geometry,
    q: NDArray[np.float64],
    see_through: Bool,
    clear: NDArray[np.int64],
    shown: tuple[Int32, Float32],
) -> None:
    """Draw see-through surfaces in front of the solid ones that the points show, then the solid surfaces behind see-through
    ones.
    """
    is_solid = ~see_through[shown[0]] & (shown[0] >= 0)
    points.seen[:] = np.where(is_solid, shown[0], -1)
    points.nearest[:] = np.where(is_solid, shown[1], 0)
    points.draw(geometry, q, see_through, clear)
    behind = ((points.counts > 0) & ~is_solid).any(axis=1)
    points.farthest[:] = kernels_chosen.CLOSED
    points.farthest.reshape(-1)[points.pixels[:-1][behind]] = 0
    if behind.any():
        if points.camera.lens.is_linear and points.camera.rows is None:
            y, x = np.divmod(points.pixels[:-1][behind], points.camera.width)
            window = x.min(), y.min(), x.max(), y.max()
            surfaces = geometry.triangles, in_picture(geometry, q), geometry.triangle_cutout
            solid = kernels.around(q, *surfaces, see_through, tuple(map(float, window)))
        else:
            solid = np.flatnonzero(~see_through[:-1])
        points.draw(geometry, q, see_through, solid)


def _sorted(points: _Points, slots: Int32) -> list[Layer]:
    nearest, seen, counts = points.nearest.reshape(-1), points.seen.reshape(-1), points.counts.reshape(-1)
    used = np.flatnonzero(counts)
    slots, nearest, seen, counts = slots[used], nearest[used], seen[used], counts[used]
    capacity = points.listed.shape[-1]
    inverses, listed = points.inverses.reshape(-1, capacity)[used], points.listed.reshape(-1, capacity)[used]
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


@dataclass(frozen=True, eq=False)
class _Points:
    """Chosen pixels and the surfaces drawn at their points, as `kernels_samples` describes them."""

    camera: Camera
    grid: Int32
    pixels: Int32
    nearest: NDArray[np.float64]
    seen: Int32
    farthest: Int32
    inverses: NDArray[np.float64]
    listed: Int32
    counts: NDArray[np.uint8]
    active: Active | None

    @classmethod
    def from_marks(cls, camera: Camera, marks: NDArray[np.uint8], count: int, capacity: int, active: Active | None) -> _Points:
        """The marked pixels, with `count` points each, and room for up to `capacity` see-through surfaces per point."""
        grid, pixels = kernels_chosen.numbered(marks)
        n = len(pixels) - 1
        return cls(
            camera,
            grid,
            pixels,
            np.zeros((n, count)),
            np.full((n, count), -1, np.int32),
            np.where(marks, np.int32(0), kernels_chosen.CLOSED),
            np.empty((n, count, capacity)),
            np.empty((n, count, capacity), np.int32),
            np.zeros((n, count), np.uint8),
            active,
        )

    @cached_property
    def table(self) -> tuple[int, RayTable]:
        """The points along a side of a pixel, and the rays of a lens whose rays are neither straight nor parallel."""
        if self.nearest.shape[1] == 1:
            return 1, lens_table(self.camera)
        return 2, _sample_table(self.camera.intrinsics.model_dump_json())

    @cached_property
    def rays(self) -> NDArray[np.float64]:
        """The rays of such a lens through the points, (K, 3, M)."""
        side, table = self.table
        rays = np.empty((len(self.nearest), 3, side * side))
        kernels.gather_rays(table.rays, self.pixels, side, rays)
        return rays

    def draw(self, geometry: Geometry, q: NDArray[np.float64], see_through: Bool, order: NDArray[np.int64]) -> None:
        """Draw these triangles."""
        count, lens = self.nearest.shape[1], self.camera.lens
        if self.camera.rows is not None:
            self._draw_rows(geometry, self.camera.rows, see_through, order)
            return
        fragments = self.inverses, self.listed, self.counts, q
        surfaces = order, geometry.triangles, geometry.triangle_cutout, geometry.alpha_masks.arrays, see_through
        solid = self.nearest, self.seen, self.farthest, kernels_chosen.tiled(self.farthest)
        if lens.is_straight:
            offsets, reach = (_CENTER, _CENTER_REACH) if count == 1 else (_ROTATED, _ROTATED_REACH)
            draw = kernels.draw_parallel if lens.is_parallel else kernels.draw
            draw(q, *surfaces, (self.grid, self.pixels, offsets, reach), solid, fragments)
            return
        side, table = self.table
        points = self.grid, self.rays, side, *table.placed(q)
        kernels.draw_rays(q, *surfaces, lens.has_unit_rays, table.arrays, points, solid, fragments)

    def _draw_rows(self, geometry: Geometry, rows: RowPoses, see_through: Bool, order: NDArray[np.int64]) -> None:
        """Draw these triangles under a rolling shutter."""
        offsets, reach = (_CENTER, _CENTER_REACH) if self.nearest.shape[1] == 1 else (_ROTATED, _ROTATED_REACH)
        chosen = np.zeros(len(geometry.triangles), np.bool_)
        chosen[order] = True
        q, active = np.empty((len(geometry.coordinates), 4)), self.active
        assert active is not None
        surfaces = chosen, geometry.triangle_cutout, geometry.alpha_masks.arrays, see_through
        solid = self.nearest, self.seen, self.farthest, kernels_chosen.tiled(self.farthest)
        kernels.draw_rolling(
            tuple(rolled_world(geometry, self.camera, rows)),
            *(geometry.triangles, single_of(geometry), *surfaces, edge_on(geometry, rows), *active),
            *((self.grid, self.pixels, offsets, reach), solid, (self.inverses, self.listed, self.counts, q), q),
        )


def _differs_from_neighbour(triangle: Int32, depth: Float32, owner: Int32, normals: Float32) -> NDArray[np.uint8]:
    """Pixels that look different from the neighbour beside, above or below: uint8, in order, padded to whole words of 8
    bytes.
    """
    height, width = triangle.shape
    beside, above = np.empty((2, height * width + 8), np.uint8)
    room, owners = np.zeros((8, width + 16), np.float32), np.zeros((4, width + 16), np.int32)
    kernels_chosen.compare(triangle, depth, owner, normals, room, owners, beside, above)
    size = height * width
    beside[:size:width] = 0
    above[:width] = 0
    marks = np.zeros((size + 7) // 8 * 8, np.uint8)
    marks[:size] = beside[:size] | above[:size]
    marks[: size - 1] |= beside[1:size]
    marks[: size - width] |= above[width:size]
    return marks


def _mark_across_seam(marks: Marks, triangle: Int32, depth: Float32, owner: Int32, normals: Float32) -> None:
    """Mark the pixels of the first and the last column that look different from their neighbour across the seam."""
    height, width = triangle.shape
    ends = [np.ascontiguousarray(picture[:, [-1, 0]]) for picture in (triangle, depth)]
    columns, room = np.zeros((2, height * 2 + 8), np.uint8), (np.zeros((8, 18), np.float32), np.zeros((4, 18), np.int32))
    kernels_chosen.compare(*ends, owner, normals, *room, *columns)
    differs = columns[0][1 : 2 * height : 2]
    pixels = marks[: height * width].reshape(height, width)
    pixels[:, 0] |= differs
    pixels[:, -1] |= differs


def _pinhole_edges(
    geometry: Geometry,
    visibility: Visibility,
    marks: Marks,
    q: NDArray[np.float64],
    owner: Int32,
    normals: Float32,
    behind: Marks,
) -> tuple[Int32, Float32, Int32, Float32]:
    """The arrays pixels, position, triangle and inverse_depth of `Samples`, for a pinhole."""
    shown, (height, width) = (visibility.triangle, visibility.inverse_depth), visibility.triangle.shape
    wanted, chosen = np.zeros((2, len(geometry.triangles)), np.uint8)
    are_wanted, are_chosen = wanted.view(np.bool_), chosen.view(np.bool_)  # numpy searches booleans faster
    runs = in_picture(geometry, q)
    surfaces = q, geometry.triangles, runs
    kernels_lines.on_others(*surfaces, geometry.triangle_cutout, owner, *shown, np.empty(len(q), np.int32), chosen)
    kernels_lines.mark(_within(runs[1], are_chosen), q, geometry.triangles, owner, _ROTATED, *shown, marks, wanted)
    marked = np.flatnonzero(marks != 0)
    most = len(marked) + height * width // 8  # room for pixels that are found while drawing
    pixels = np.empty(most, np.int32)
    pixels[: len(marked)] = marked
    starts = np.empty(height * -(-width // kernels_edges.CELL) + 1, np.int32)
    grid, limit = np.full((height, width), -1, np.int32), shown[1] * np.float32(1 + kernels_edges.SLACK)
    bound, nearest, seen = np.empty(len(marked), np.float32), np.empty((most, 4), np.float32), np.empty((most, 4), np.int32)
    kernels_edges.begin(pixels, len(marked), *shown, grid, limit, starts, bound, nearest, seen, wanted)
    surfaces = q, geometry.triangles, geometry.triangle_cutout, geometry.alpha_masks.arrays
    canvas = _room(width), _ROTATED, *shown, grid, limit, pixels, starts
    count = kernels_edges.draw(_within(runs[1], are_wanted), *surfaces, *canvas, len(bound), nearest, seen)
    around = limit.copy()
    kernels_edges.spread(pixels, count, limit, around)
    kernels_edges.with_corners_before(q, geometry.triangles, runs, wanted, around, np.empty(len(q), np.uint8), chosen)
    count = kernels_edges.draw(_within(runs[1], are_chosen), *surfaces, *canvas, count, nearest, seen)
    return _differing(count, pixels, nearest, seen, bound, _ROTATED, *shown, owner, normals, behind)


def _within(runs: Runs, marks: Bool) -> NDArray[np.int64]:
    """The marked ones among runs of triangles, in their order."""
    found = [first + marks[first:stop].nonzero()[0] for first, stop in runs.tolist()]
    return found[0] if len(found) == 1 else np.concatenate([np.empty(0, np.int64), *found])


def _room(width: int) -> tuple[NDArray[np.uint32], Marks, Float32]:
    """Scratch of `kernels_edges.draw`: pixels of a triangle, the samples inside it, and 1/z at the samples."""
    count = max(width, kernels_edges.NARROW**2) + 1
    return np.empty(count, np.uint32), np.empty(count, np.uint8), np.empty((count, 4), np.float32)


def _differing(count: int, *known: NDArray[Any]) -> tuple[Int32, Float32, Int32, Float32]:
    """Those of `count` pixels whose samples do not all look like the centre, as `kernels_edges.finish` returns them."""
    pixels, position = np.empty(count, np.int32), np.empty((4 * count, 2), np.float32)
    triangle, inverse = np.empty(4 * count, np.int32), np.empty(4 * count, np.float32)
    n = kernels_edges.finish(count, *known, pixels, position, triangle, inverse)
    return pixels[:n], position[: 4 * n], triangle[: 4 * n], inverse[: 4 * n]


def _sample_rays(camera: Camera, pixels: Int32) -> Float32:
    if camera.lens.is_straight:
        return np.zeros((0, 3), np.float32)
    y, x = np.divmod(pixels, camera.width)
    table, quarter = _sample_table(camera.intrinsics.model_dump_json()).rays, np.arange(4)
    return table[2 * y[:, None] + quarter // 2, 2 * x[:, None] + quarter % 2].reshape(-1, 3).astype(np.float32)


@lru_cache(maxsize=2)
def _sample_table(lens: str) -> RayTable:
    """Rays of a distorted lens' samples, (2H, 2W, 3): sample i of a pixel in row i // 2 and column i % 2 of its four."""
    intrinsics = Intrinsics.model_validate_json(lens)
    rays = np.empty((2 * intrinsics.height, 2 * intrinsics.width, 3))
    for i, (x, y) in enumerate(OFFSETS):
        shifted = intrinsics.model_copy(update={"cx": intrinsics.cx - (x - 0.5), "cy": intrinsics.cy - (y - 0.5)})
        rays[i // 2 :: 2, i % 2 :: 2] = pixel_rays(shifted)
    return index_rays(intrinsics, rays, 1, 2)
