"""The exact rasteriser's result: the triangle that each pixel's ray meets first, and its distance."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.camera import inverse_camera_matrix, pixel_rays
from viewsphere.geometry.lenses import Window
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.truth.raster.geometry import Geometry, seen_from
from viewsphere.truth.raster.rolling import Active, rolled

LARGEST_AROUND = 4_000_000  # pixels of a ray table that reaches beyond the image (100 MB)

EDGE_ON = 1e-9
"""Height of a camera above the ground that counts as rounding error, relative to its distance from the origin plus a metre."""


OUTSIDE = (-1e9, 0.0, 1.0, 1.0)
"""The `homogeneous` value of a vertex far from the picture."""

_OUTSIDE = np.array(OUTSIDE)

_CORNERS = np.indices((2, 2, 2)).reshape(3, 8).T
"""For each corner of a box, along each axis: 0 for the lowest, 1 for the highest coordinate."""

Runs = NDArray[np.int64]
"""Ranges [first, stop), (n, 2)."""


@dataclass(frozen=True, eq=False)
class Instances:
    """ids (H, W) int32: the visible object, 0 if there is none. By id: area (N + 1,), the number of visible pixels, and box (N
    + 1, 4), the tight half-open box (x0, y0, x1, y1) of the visible pixels. The box is undefined if the area is 0, and for id
    0.
    """

    ids: NDArray[np.int32]
    area: NDArray[np.int64]
    box: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Visibility:
    """triangle (H, W) int32: the visible triangle, -1 if there is none; inverse_depth (H, W) float32: 1/s, 0 if no triangle is
    visible.

    The visible point is `center + R.T @ (origin + s * ray)`, with origin and ray as `geometry.lenses.Lens.origins` and
    `directions` give them. The ray's z is 1 (so s is z-depth) for a pinhole, for Brown-Conrady and for parallel rays. Its
    length is 1 for a fisheye and a scan, whose rays may point sideways or back.
    """

    triangle: NDArray[np.int32]
    inverse_depth: NDArray[np.float32]
    corners: NDArray[np.float64] | None = None  # `homogeneous` of all vertices, which labels and the raster engine use again
    exact: NDArray[np.float64] | None = None  # 1/s before rounding, if requested
    active: Active | None = None  # of a picture under a rolling shutter
    _instances: dict[Geometry, Instances] = field(default_factory=dict[Geometry, Instances], repr=False)

    def instances(self, geometry: Geometry) -> Instances:
        """The visible pixels of each object; `geometry` must be the drawn one. The arrays are cached: do not write to them."""
        if geometry not in self._instances:
            self._instances[geometry] = _count_instances(geometry, self.triangle)
        return self._instances[geometry]


def _count_instances(geometry: Geometry, triangle: NDArray[np.int32]) -> Instances:
    from viewsphere.truth.raster import kernels_channels as kernels

    height, width = triangle.shape
    ids, area = np.empty((height, width), np.int32), np.zeros(geometry.object_count + 1, np.int64)
    box = np.tile(np.array([width, height, 0, 0]), (geometry.object_count + 1, 1))
    kernels.instances(triangle, geometry.triangle_object, ids, area, box)
    ids.setflags(write=False)
    return Instances(ids, area, box)


def rasterize(
    geometry: Geometry,
    camera: Camera,
    subdivision: int = 1,
    object_id: int | None = None,
    window: Window | None = None,
    corners: NDArray[np.float64] | None = None,
    keeps_exact: bool = False,
) -> Visibility:
    """Cast one ray through the centre of each pixel, exactly.

    A later triangle replaces an earlier one only if it is nearer by more than 2^-22 (2.4e-7) of its depth. So the first of
    several coincident surfaces is always visible: an object is drawn in front of the ground it touches.

    A camera in the ground's plane sees none of it (see `is_edge_on`).

    `subdivision` 2 gives the (2H, 2W) buffer of the centres of a pixel's 2 x 2 quarters (edge anti-aliasing). With an
    `object_id` only that object is drawn, without scenery and ground. `window` selects another rectangle of pixels instead of
    the image, and may reach outside it; a pixel without a ray of the lens shows nothing. `corners`: `homogeneous` of all
    vertices, if already computed. `keeps_exact`: also keep 1/s before rounding, which labels that compare pictures need. Still
    pictures do not need that memory.
    """
    if camera.rows is not None:
        nearest, seen, active = rolled(geometry, camera, camera.rows, subdivision, object_id, window)
        is_picture = subdivision == 1 and not object_id and window is None
        return Visibility(seen, nearest.astype(np.float32), None, nearest, active if is_picture else None)
    is_whole = not object_id and window is None
    if object_id:
        part = _range(geometry, object_id)
        q = None if corners is None else _known(corners, part)
    else:
        part, q = (0, _last_drawn(geometry, camera), 0, len(geometry.coordinates)), corners
    if q is None:
        q = homogeneous(geometry, camera) if is_whole else homogeneous(geometry, camera, *part[2:])
    nearest, seen = _draw(geometry, camera, subdivision, part, window, q)
    known = q if is_whole else None
    return Visibility(seen, nearest.astype(np.float32), known, nearest if keeps_exact else None)


def _known(corners: NDArray[np.float64], part: tuple[int, int, int, int]) -> NDArray[np.float64] | None:
    """A part's vertices among all `homogeneous` ones; None for a thing that is left out of these."""
    q = corners[part[2] : part[3]]
    return None if len(q) and (q[0] == OUTSIDE).all() else q


def with_ground(geometry: Geometry, camera: Camera, visibility: Visibility) -> Visibility:
    """A new buffer: `visibility`, which shows all other triangles, with the ground of this geometry drawn into it."""
    ground = geometry.triangle_start[-1], _last_drawn(geometry, camera), geometry.vertex_start[-1], len(geometry.coordinates)
    shown = visibility.inverse_depth.astype(np.float64), visibility.triangle.copy()
    nearest, seen = _draw(geometry, camera, 1, ground, None, homogeneous(geometry, camera, *ground[2:]), shown)
    return Visibility(seen, nearest.astype(np.float32))


def is_edge_on(geometry: Geometry, camera: Camera) -> bool:
    """Return whether the camera is in the plane of the ground, within rounding error. Rays then meet the ground, if at all, at
    the camera's own centre. Parallel rays must be along the ground instead.
    """
    center = camera.center
    if geometry.ground_z is None:
        return False
    if camera.lens.is_parallel:
        return abs(float(camera.R[2, 2])) <= EDGE_ON
    return abs(float(center[2]) - geometry.ground_z) <= EDGE_ON * (1.0 + float(np.linalg.norm(center)))


def _last_drawn(geometry: Geometry, camera: Camera) -> int:
    """The end of the triangles that are drawn. The ground, which comes last, is left out if it is seen edge-on."""
    return geometry.triangle_start[-1] if is_edge_on(geometry, camera) else len(geometry.triangles)


def _range(geometry: Geometry, object_id: int) -> tuple[int, int, int, int]:
    """Triangles [a, b) and vertices [c, d) of an object."""
    if not 1 <= object_id <= geometry.object_count:
        raise ValueError(f"object_id: expected 1..{geometry.object_count}, got {object_id}")
    t, v = geometry.triangle_start, geometry.vertex_start
    return t[object_id - 1], t[object_id], v[object_id - 1], v[object_id]


def homogeneous(geometry: Geometry, camera: Camera, base: int = 0, stop: int | None = None) -> NDArray[np.float64]:
    """Vertices [base, stop) before the perspective division, and the inverse of their third coordinate, (n, 4).

    They are K (R X + t) for a pinhole, and R X + t (camera axes) for a distorted lens. The inverse is infinite unless positive.
    For parallel rays they are (u, v, 1, z): pixels, and metres along the axis.
    If all vertices are requested, things outside a pinhole's picture are left out: the first vertex of such a thing is
    `OUTSIDE`, and the others are arbitrary. `in_picture` gives the remaining ones.
    """
    lens = camera.lens
    if lens.is_parallel:
        return _along_parallel_rays(geometry, camera, base, stop)
    k = camera.K if lens.is_linear else np.eye(3)
    moved = np.empty((3, 4))
    moved[:, :3], moved[:, 3] = camera.R, camera.t
    m = k[:, :1] * moved[0] + k[:, 1:2] * moved[1] + k[:, 2:] * moved[2]
    if base or stop is not None or not lens.is_linear:
        return projected(geometry, m, base, stop)
    end, without = len(geometry.coordinates), _outside(geometry, camera, m)
    q = geometry.spare.array((end, 4), np.float64)
    starts = zip(geometry.vertex_start, without.tolist(), strict=False)
    q[[start for start, is_left_out in starts if is_left_out and start < end]] = OUTSIDE
    for first, last in _shown(without, geometry.vertex_start, end).tolist():
        _project(geometry, m, first, last, q[first:last])
    return q


def _along_parallel_rays(geometry: Geometry, camera: Camera, base: int, stop: int | None) -> NDArray[np.float64]:
    """`homogeneous` vertices for parallel rays."""
    m = camera.P
    m[2, :3], m[2, 3] = camera.R[2], camera.t[2]
    q = projected(geometry, m, base, stop)
    q[:, 3] = q[:, 2]
    q[:, 2] = 1.0
    return q


def in_picture(geometry: Geometry, q: NDArray[np.float64], end: int | None = None) -> tuple[Runs, Runs]:
    """The vertices and the triangles, up to `end`, that are not left out of `homogeneous` vertices q of all things: equally
    many runs of both, in matching order.
    """
    without, last = left_out(geometry, q), len(geometry.triangles) if end is None else end
    return _shown(without, geometry.vertex_start, len(q)), _shown(without, geometry.triangle_start, last)


def left_out(geometry: Geometry, q: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return a mask of the things that are left out of their `homogeneous` vertices q."""
    first = _first_vertices(geometry.vertex_start, len(q))
    return (q[first] == _OUTSIDE).all(axis=1) if len(q) else first < 0


def things_in(geometry: Geometry, camera: Camera, visibility: Visibility) -> list[int]:
    """The things that may be in a camera's picture."""
    if visibility.active is not None:
        there = np.zeros(len(geometry.poses) + 1, np.bool_)
        there[visibility.active.rows[:, 1]] = True
        return np.flatnonzero(there[:-1]).tolist()
    q = homogeneous(geometry, camera) if visibility.corners is None else visibility.corners
    return np.flatnonzero(~left_out(geometry, q)).tolist()


@lru_cache(maxsize=4)
def _first_vertices(starts: tuple[int, ...], end: int) -> NDArray[np.intp]:
    """The first vertex of each thing, limited to `end` vertices; the last vertex of all if there are fewer."""
    return np.minimum(np.array(starts[:-1], np.intp), max(end - 1, 0))


def _shown(without: NDArray[np.bool_], starts: tuple[int, ...], end: int) -> Runs:
    """Runs, up to the end, owned by things that are not left out, from these starts on, and the ground's run. Do not write to
    the array: several frames share it.
    """
    return _known_runs(without.tobytes(), starts, end)


@lru_cache(maxsize=16)
def _known_runs(without: bytes, starts: tuple[int, ...], end: int) -> Runs:
    """The result of `_shown`, for the bytes of its flags."""
    is_shown = np.array([False, *~np.frombuffer(without, np.bool_), True, False])
    borders = np.flatnonzero(is_shown[1:] != is_shown[:-1])
    return np.array([*starts, end], np.int64)[borders].reshape(-1, 2)


def projected(geometry: Geometry, m: NDArray[np.float64], base: int = 0, stop: int | None = None) -> NDArray[np.float64]:
    """(n, 4): m (x, y, z, 1) of the vertices [base, stop), and the inverse of its third coordinate, as in `homogeneous`."""
    end = len(geometry.coordinates) if stop is None else stop
    q = np.empty((end - base, 4))
    _project(geometry, m, base, end, q)
    return q


def _project(geometry: Geometry, m: NDArray[np.float64], base: int, stop: int, q: NDArray[np.float64]) -> None:
    """Write the result of `projected`."""
    from viewsphere.truth.raster import kernels_draw, kernels_place

    starts = np.array(geometry.vertex_start, np.int64)
    kernels_place.project(geometry.coordinates, starts, geometry.poses, m, base, stop, q)
    first = max(geometry.vertex_start[-1], base)
    if first < stop:
        low, high = first - geometry.vertex_start[-1], stop - geometry.vertex_start[-1]
        kernels_draw.transform(geometry.ground, low, high, m, q[first - base :])


def _outside(geometry: Geometry, camera: Camera, pixels_from_world: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return a mask of the things that are wholly outside a pinhole's picture, by at least a pixel, or behind the camera.

    For such a thing, all corners of its box are beyond the same side.
    """
    corners = geometry.bounds[:, _CORNERS, np.arange(3)]  # (N, 8, 3)
    with np.errstate(invalid="ignore"):  # the box of a thing without triangles
        u, v, w = (corners[..., 0] * m[0] + corners[..., 1] * m[1] + corners[..., 2] * m[2] + m[3] for m in pixels_from_world)
        sides = u < -w, u > (camera.width + 1) * w, v < -w, v > (camera.height + 1) * w, w < 0
        return np.logical_or.reduce([side.all(axis=1) for side in sides])


def pixels_of(geometry: Geometry, corners: NDArray[np.float64], size: tuple[int, int]) -> NDArray[np.int32]:
    """The range of pixels that each vertex may touch in a pinhole's picture of this (width, height), (n, 4), as defined in
    `kernels_points.boxes`. `corners` are `homogeneous` vertices.
    """
    from viewsphere.truth.surface_points import kernels_points as kernels

    box, nowhere = np.empty((len(corners), 4), np.int32), np.empty((1, 4), np.int32)
    kernels.boxes(np.array([OUTSIDE]), 1, *size, nowhere)
    done = 0
    for first, stop in in_picture(geometry, corners)[0].tolist():
        box[done:first] = nowhere
        kernels.boxes(corners[first:stop], geometry.vertex_start[-1] - first, *size, box[first:stop])
        done = stop
    box[done:] = nowhere
    return box


def lens_rays(camera: Camera) -> NDArray[np.float64] | None:
    """The image's ray table, (H, W, 3); None if rays are pixels (x, y, 1). It is cached for the next frame, so do not write to
    it.
    """
    image = (0, 0, camera.width, camera.height)
    return None if camera.lens.is_straight else _ray_table(camera.intrinsics.model_dump_json(), 1, image).rays


def direction_matrix(camera: Camera) -> NDArray[np.float64]:
    """Matrix (3, 3) from rays to their directions in camera axes: K^-1 for a pinhole, whose rays are pixels (x, y, 1); the axis
    for parallel rays, which also are pixels; else the identity.
    """
    lens = camera.lens
    if lens.is_parallel:
        return np.diag((0.0, 0.0, 1.0))
    return inverse_camera_matrix(camera.intrinsics) if lens.is_linear else np.eye(3)


def lens_table(camera: Camera) -> RayTable:
    """`lens_rays` of a distorted lens, with their spatial indices."""
    return _ray_table(camera.intrinsics.model_dump_json(), 1, (0, 0, camera.width, camera.height))


@dataclass(frozen=True, eq=False)
class RayTable:
    """Rays of a lens, and the spatial indices that `kernels_rays` builds for them."""

    rays: NDArray[np.float64]
    levels: NDArray[np.int64]
    boxes: NDArray[np.float64]
    cells: NDArray[np.int32]

    @property
    def arrays(self) -> tuple[NDArray[Any], ...]:
        """(rays, levels, boxes, cells), in the form that the kernels take."""
        return self.rays, self.levels, self.boxes, self.cells

    def placed(self, q: NDArray[np.float64]) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
        """The cells of vertices q (V, 3 or more) in camera axes, and their inverse distances, as `kernels_rays.place` gives
        them.
        """
        from viewsphere.truth.raster import kernels_rays as kernels

        places, inverses = np.empty(len(q), np.int32), np.empty(len(q), np.float32)
        kernels.place(q, self.cells, places, inverses)
        return places, inverses


def _canvas(camera: Camera, window: Window) -> Window:
    """The rectangle of pixels to tabulate for this window, chosen from a few, so that a table serves many
    windows and frames.
    """
    w, h = camera.width, camera.height
    image, around = (0, 0, w, h), (-w, -h, 2 * w, 2 * h)
    if _within(window, image):
        return image
    return around if _within(window, around) and 9 * w * h <= LARGEST_AROUND else window


def _within(a: Window, b: Window) -> bool:
    return a[0] >= b[0] and a[1] >= b[1] and a[2] <= b[2] and a[3] <= b[3]


@lru_cache(maxsize=4)
def _ray_table(lens: str, samples: int, canvas: Window) -> RayTable:
    """The table for the intrinsics in this JSON, with `samples` x `samples` rays for each pixel of the canvas."""
    intrinsics = Intrinsics.model_validate_json(lens)
    return index_rays(intrinsics, pixel_rays(intrinsics, samples, canvas), samples)


def index_rays(intrinsics: Intrinsics, rays: NDArray[np.float64], samples: int, side: int = 1) -> RayTable:
    """The ray table of a distorted lens with its spatial indices: rays (H, W, 3), `samples` x `samples` of them per pixel, and
    `side` x `side` per pixel of the cells.
    """
    from viewsphere.truth.raster import kernels_rays as kernels

    rays.setflags(write=False)
    levels = kernels.tree_levels(rays.shape[0], rays.shape[1])
    lens = intrinsics.lens
    size = lens.ray_cells or min(max(int(intrinsics.fx * samples), 16), 512)  # cells of about two pixels
    cells = kernels.build_faces(rays, 6 if lens.has_unit_rays else 1, size, side)
    return RayTable(rays, levels, kernels.build_tree(rays, levels), cells)


def _draw(
    geometry: Geometry,
    camera: Camera,
    samples: int,
    part: tuple[int, int, int, int],
    window: Window | None,
    q: NDArray[np.float64],
    shown: tuple[NDArray[np.float64], NDArray[np.int32]] | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Draw a part's triangles, whose vertices are `homogeneous` in q, over the window: 1/s (0 if none) and triangle (-1 if
    none).

    If the arrays `shown` are given, the triangles are drawn into them.
    """
    from viewsphere.truth.raster import kernels_draw as kernels
    from viewsphere.truth.raster import kernels_rays

    window = window or (0, 0, camera.width, camera.height)
    x0, y0, x1, y1 = (samples * edge for edge in window)
    nearest, seen = shown or (np.zeros((y1 - y0, x1 - x0)), np.full((y1 - y0, x1 - x0), -1, np.int32))
    first, last, base, stop = part
    span = (first, last, base)
    cut = (seen_from(geometry, q, base).triangle_cutout, geometry.alpha_masks.arrays)
    if camera.lens.is_parallel:
        _draw_parallel(geometry, q, span, (samples, x0, y0), cut, nearest, seen)
        return nearest, seen
    if not camera.lens.is_linear:
        canvas = _canvas(camera, window)
        t = _ray_table(camera.intrinsics.model_dump_json(), samples, canvas)
        origin = (x0 - samples * canvas[0], y0 - samples * canvas[1])
        table, unit = (*t.arrays, *t.placed(q)), camera.lens.has_unit_rays
        kernels_rays.draw(q, geometry.triangles, span, table, origin, unit, *cut, nearest, seen)
        return nearest, seen
    canvas, parts = (x0, y0, x1 - x0, y1 - y0), [(base, stop, first, last)]
    if 0 < len(q) == len(geometry.coordinates):  # things may be left out
        vertices, triangles = in_picture(geometry, q, last)
        parts = np.column_stack((vertices, triangles)).tolist()
    for begin, end, first, last in parts:
        own, cell = q[begin - base : end - base], np.empty((end - begin, 4), np.int32)
        kernels.cells(own, samples, *canvas, cell)
        cell[max(geometry.vertex_start[-1] - begin, 0) :] = kernels.BEHIND
        kernels.draw(own, cell, geometry.triangles, (first, last, begin), (samples, x0, y0), *cut, nearest, seen)
    return nearest, seen


def _draw_parallel(
    geometry: Geometry,
    q: NDArray[np.float64],
    span: tuple[int, int, int],
    canvas: tuple[int, int, int],
    cut: tuple[NDArray[np.int32], tuple[NDArray[Any], ...]],
    nearest: NDArray[np.float64],
    seen: NDArray[np.int32],
) -> None:
    """`_draw` along parallel rays."""
    from viewsphere.truth.raster import kernels_parallel as kernels

    with np.errstate(divide="ignore"):
        np.divide(1.0, nearest, out=nearest)
        kernels.draw(q, geometry.triangles, span, canvas, *cut, nearest, seen)
        np.divide(1.0, nearest, out=nearest)


def lens_rays_to(camera: Camera, inverse_depth: NDArray[np.floating]) -> NDArray[np.float64] | None:
    """Rays r (H, W, 3) in camera axes from the camera's centre to the seen points: each point is r / inverse_depth.

    They are `lens_rays`, or None for a pinhole. For parallel rays, which begin elsewhere, they depend on 1/s (H, W), and are
    the axis where nothing is seen.
    """
    if not camera.lens.is_parallel:
        return lens_rays(camera)
    rays = camera.lens.origins() * inverse_depth[..., None]
    rays[..., 2] = 1.0
    return rays
