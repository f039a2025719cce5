"""Expected labels of a picture from rays of a published formula: Embree finds surfaces, float64 settles what Embree cannot.

Nothing here calls viewsphere's rasteriser or lenses. It shares the triangles, their poses, and the camera's R, t and K.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numba import njit

from published import Optics, unit

GRAZED = 1e-9
"""Barycentric weight up to which rounding decides on which side of an edge a ray passes."""
EQUAL = 1e-6
"""Share of the distance by which surfaces are apart that count as one, as float32 stores distances."""
NEARER = 1 - 2.0**-22
"""A later triangle is seen instead of an earlier one if its distance is below this share: the documented rule for surfaces in
one place.
"""
BESIDE = 1e-5
"""Barycentric weight up to which float64 settles the triangle that Embree, in float32, finds beside an edge."""
TURNED = 1e-6
"""Difference of the cosine from 1 of normals that are not of one triangle; float64 then settles which."""
ROUNDED = 1e-9
"""Square metres, and metres, by which a ray may pass the ball around a triangle that it meets."""
NONE = -1


@njit
def passes(origin, direction, ball):
    """Whether a ray passes a ball (x, y, z, r) by, as almost all do."""
    x, y, z = ball[0] - origin[0], ball[1] - origin[1], ball[2] - origin[2]
    along = x * direction[0] + y * direction[1] + z * direction[2]
    return x * x + y * y + z * z - along * along > ball[3] * ball[3] + ROUNDED or along < -ball[3] - ROUNDED


@njit
def nearest(origins, directions, corners, balls):
    """For each ray, of triangles (T, 3, 3) in balls (T, 4): the first triangle, its distance, and the distance of the first one
    that it meets clear of edges. Of surfaces in one place, it is the first in order.
    """
    count = len(origins)
    first, distance, clear = np.full(count, -1), np.full(count, np.inf), np.full(count, np.inf)
    for i in range(count):
        for t in range(len(corners)):
            if passes(origins[i], directions[i], balls[t]):
                continue
            least, s = met(origins[i], directions[i], corners[t])
            if least >= 0.0 and 0.0 < s < distance[i] * NEARER:
                first[i], distance[i] = t, s
            if least >= GRAZED and 0.0 < s < clear[i]:
                clear[i] = s
    return first, distance, clear


@njit
def meets_at(origins, directions, corners, balls, owners, wanted, distances):
    """Whether each ray meets, edges included, a triangle of the wanted owner at a distance."""
    found = np.zeros(len(origins), np.bool_)
    for i in range(len(origins)):
        for t in range(len(corners)):
            if owners[t] == wanted[i] and not passes(origins[i], directions[i], balls[t]):
                least, s = met(origins[i], directions[i], corners[t])
                if least >= -GRAZED and abs(s - distances[i]) <= EQUAL * distances[i]:
                    found[i] = True
                    break
    return found


@njit
def met(origin, direction, corner):
    """Moller and Trumbore 1997: the smallest barycentric weight where a ray meets a triangle's plane, and the distance."""
    e1x, e1y, e1z = corner[1, 0] - corner[0, 0], corner[1, 1] - corner[0, 1], corner[1, 2] - corner[0, 2]
    e2x, e2y, e2z = corner[2, 0] - corner[0, 0], corner[2, 1] - corner[0, 1], corner[2, 2] - corner[0, 2]
    dx, dy, dz = direction[0], direction[1], direction[2]
    px, py, pz = dy * e2z - dz * e2y, dz * e2x - dx * e2z, dx * e2y - dy * e2x
    det = px * e1x + py * e1y + pz * e1z
    if det == 0.0:
        return -1.0, np.inf
    tx, ty, tz = origin[0] - corner[0, 0], origin[1] - corner[0, 1], origin[2] - corner[0, 2]
    u = (px * tx + py * ty + pz * tz) / det
    if u < -0.1 or u > 1.1:
        return -1.0, np.inf
    qx, qy, qz = ty * e1z - tz * e1y, tz * e1x - tx * e1z, tx * e1y - ty * e1x
    v = (qx * dx + qy * dy + qz * dz) / det
    return min(u, v, 1.0 - u - v), (qx * e2x + qy * e2y + qz * e2z) / det


@dataclass(frozen=True, eq=False)
class Scene:
    """The triangles of an instant, from a `Geometry`'s arrays, in float64.

    corners (T, 3, 3): world metres, without the ground. owner (T,): object ids, 0 for scenery.
    """

    geometry: Any

    @cached_property
    def triangles(self) -> np.ndarray:
        return self.geometry.triangles[: self.geometry.triangle_start[-1]]

    @cached_property
    def vertices(self) -> np.ndarray:
        g = self.geometry
        spans = zip(g.poses, g.vertex_start, g.vertex_start[1:], strict=False)
        return np.concatenate([g.coordinates[a:b].astype(np.float64) @ pose[:3, :3].T + pose[:3, 3] for pose, a, b in spans])

    @cached_property
    def corners(self) -> np.ndarray:
        return self.vertices[self.triangles]

    @cached_property
    def owner(self) -> np.ndarray:
        return self.geometry.triangle_object[: len(self.triangles)].astype(np.int64)

    @cached_property
    def identity(self) -> np.ndarray:
        """Of each triangle (T,), the ground and nothing: the object's id, of the background the negative class."""
        classes = self.geometry.triangle_class[: len(self.triangles)].astype(np.int64)
        ground = -int(self.geometry.triangle_class[-1]) if self.geometry.ground_z is not None else 0
        return np.append(np.where(self.owner > 0, self.owner, -classes), [ground, 0])

    @cached_property
    def facing(self) -> np.ndarray:
        """World normals (T + 2, 3) of the triangles by winding, of the ground and of nothing."""
        corners = self.corners
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        length = np.linalg.norm(normals, axis=1)
        return np.concatenate([normals / np.where(length > 0, length, 1.0)[:, None], [[0.0, 0.0, 1.0], [0.0, 0.0, 0.0]]])

    @cached_property
    def normals(self) -> np.ndarray:
        """World unit normals of the vertices."""
        g = self.geometry
        turned = [mesh.normals @ np.linalg.inv(pose[:3, :3]) for mesh, pose in zip(g.meshes, g.poses, strict=True)]
        return unit(np.concatenate(turned))

    def whole(self) -> Caster:
        """The caster at everything."""
        return self._casters[0]

    def alone(self, object_id: int) -> Caster:
        """The caster at one object, without the ground."""
        return self._casters[object_id]

    @cached_property
    def _casters(self) -> dict[int, Caster]:
        casters = {0: Caster(self.corners, self.geometry.ground_z)}
        for i in range(1, self.geometry.object_count + 1):
            casters[i] = Caster(self.corners[self.owner == i], None)
        return casters


class Caster:
    """Rays at triangles (T, 3, 3) and, unless None, the endless plane at a height, which counts as triangle T."""

    def __init__(self, corners: np.ndarray, ground: float | None) -> None:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        self.corners, self.ground, self.scene = corners, ground, EmbreeScene(robust=True)
        self.middle = corners.reshape(-1, 3).mean(axis=0)
        centres = corners.mean(axis=1)
        reach = np.linalg.norm(corners - centres[:, None], axis=2).max(axis=1)
        self.balls = np.column_stack([centres, reach])
        TriangleMesh(self.scene, (corners - self.middle).astype(np.float32))

    def level(self, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Distances (N,) to the ground."""
        if self.ground is None:
            return np.full(len(origins), np.inf)
        with np.errstate(all="ignore"):
            s = (self.ground - origins[:, 2]) / directions[:, 2]
        return np.where(s > 0, s, np.inf)

    def guess(self, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Triangles that Embree finds (N,), -1 for none, and their distances in float64."""
        starts = np.ascontiguousarray(origins - self.middle, np.float32)
        found = self.scene.run(starts, np.ascontiguousarray(directions, np.float32), output=True)
        triangle = np.asarray(found["primID"], np.int64)
        s = np.where(triangle < 0, np.inf, plane(origins, directions, self.corners[triangle]))
        return self._with_ground(origins, directions, triangle, s)

    def settled(self, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The first triangle by float64 brute force, its distance, and that of the first surface clear of edges."""
        triangle, s, clear = nearest(origins, directions, self.corners, self.balls)
        level = self.level(origins, directions)
        return *self._with_ground(origins, directions, triangle, s), np.minimum(clear, level)

    def _with_ground(
        self, origins: np.ndarray, directions: np.ndarray, triangle: np.ndarray, s: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        level = self.level(origins, directions)
        is_level = level < s * NEARER
        return np.where(is_level, len(self.corners), triangle), np.where(is_level, level, s)

    def is_beside_edge(self, origins: np.ndarray, directions: np.ndarray, triangle: np.ndarray, s: np.ndarray) -> np.ndarray:
        """Return whether rays meet these triangles at their very edges; False where they meet none, or the ground."""
        is_on = (triangle >= 0) & (triangle < len(self.corners))
        out = np.zeros(len(triangle), np.bool_)
        places = origins[is_on] + s[is_on, None] * directions[is_on]
        with np.errstate(all="ignore"):
            out[is_on] = ~(weights(places, self.corners[triangle[is_on]]).min(axis=1) > BESIDE)
        return out

    def mask(self, origins: np.ndarray, directions: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
        """The rays of a picture (H, W) that meet anything; float64 settles those along the outline."""
        seen = np.zeros(len(origins), np.bool_)
        has_ray = ~np.isnan(directions[:, 0])
        seen[has_ray] = self.guess(origins[has_ray], directions[has_ray])[0] >= 0
        near = edges(seen.reshape(shape)).ravel() & has_ray
        seen[near] = nearest(origins[near], directions[near], self.corners, self.balls)[0] >= 0
        return seen.reshape(shape)


def edges(mask: np.ndarray) -> np.ndarray:
    """The pixels of which a neighbour, across a seam too, differs."""
    out = np.zeros(mask.shape, np.bool_)
    for axis in (0, 1):
        differs = mask != np.roll(mask, 1, axis=axis)
        out |= differs | np.roll(differs, -1, axis=axis)
    return out


def plane(origins: np.ndarray, directions: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Distances (N,) at which rays meet the planes of triangles (N, 3, 3)."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    with np.errstate(all="ignore"):
        return (normal * (corners[:, 0] - origins)).sum(axis=1) / (normal * directions).sum(axis=1)


def weights(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Barycentric weights (N, 3) of points in the planes of triangles (N, 3, 3)."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    normal = np.cross(b - a, c - a)
    square = (normal * normal).sum(axis=1)
    second = (normal * np.cross(a - c, points - c)).sum(axis=1) / square
    third = (normal * np.cross(b - a, points - a)).sum(axis=1) / square
    return np.stack([1 - second - third, second, third], axis=-1)


@lru_cache(maxsize=4)
def rays_of(optics: Optics, window: tuple[int, int, int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Origins and unit directions (N, 3), camera axes, of a window's pixels; NaN beyond a panorama's full turn and poles."""
    x0, y0, x1, y1 = window
    xy = np.stack(np.meshgrid(np.arange(x0, x1) + 0.5, np.arange(y0, y1) + 0.5), axis=-1).reshape(-1, 2)
    origins, directions = optics.rays(xy)
    if optics.formula.highest is not None:
        azimuth, elevation = (np.abs(xy - optics.K[:2, 2]) / np.diag(optics.K)[:2]).T
        directions[(azimuth > math.pi) | (elevation > optics.formula.highest)] = np.nan
    return origins, directions


@dataclass(frozen=True, eq=False)
class Frame:
    """A scene seen through a published lens from R and t; size: width and height in pixels."""

    scene: Scene
    optics: Optics
    R: np.ndarray
    t: np.ndarray
    size: tuple[int, int]

    def world_rays(self, window: tuple[int, int, int, int]) -> tuple[np.ndarray, np.ndarray]:
        """Origins and unit directions, world, of the pixels [x0, x1) x [y0, y1) of (x0, y0, x1, y1)."""
        origins, directions = rays_of(self.optics, window)
        return (origins - self.t) @ self.R, directions @ self.R

    @cached_property
    def rays(self) -> tuple[np.ndarray, np.ndarray]:
        return self.world_rays((0, 0, *self.size))

    @property
    def period(self) -> int | None:
        """The picture's width, if it shows a full turn."""
        is_panorama = self.optics.formula.highest is not None
        return self.size[0] if is_panorama and abs(2 * math.pi * self.optics.K[0, 0] - self.size[0]) < 1e-6 else None

    def pixels(self, places: np.ndarray) -> np.ndarray:
        """Positions (N, 2) of places in the world (N, 3)."""
        return self.optics.pixels(places @ self.R.T + self.t)


@dataclass(frozen=True, eq=False)
class Seen:
    """The surfaces that pixels' rays meet: triangles (N,) (-1 none, T the ground) and distances (N,).

    is_tie (N,): rounding decides. is_wrong (N,): float64 sees something else than the stored labels.
    """

    triangle: np.ndarray
    distance: np.ndarray
    is_tie: np.ndarray
    is_wrong: np.ndarray


def compared(frame: Frame, channels: Mapping[str, np.ndarray]) -> Seen:
    """Compare the stored ids, classes, triangles and distances along rays of a picture with the caster's."""
    scene, (origins, directions) = frame.scene, frame.rays
    caster, own, identity = scene.whole(), np.append(scene.owner, [0, 0]), scene.identity
    ids, classes = channels["instances"].ravel().astype(np.int64), channels["semantic"].ravel().astype(np.int64)
    kept, shown = channels["depth_ray"].ravel().astype(np.float64), np.where(ids > 0, ids, -classes)
    chosen, start = channels["triangles"].ravel().astype(np.int64), np.array([0, *scene.geometry.triangle_start])

    def is_equal(triangle: np.ndarray, s: np.ndarray, at: np.ndarray) -> np.ndarray:
        owner = np.where(triangle < 0, 0, own[triangle])
        number = np.where(owner > 0, triangle - start[owner], -1)
        with np.errstate(invalid="ignore"):
            near = (s == kept[at]) | (np.abs(s - kept[at]) <= EQUAL * kept[at])
        return ((triangle < 0) | (identity[triangle] == shown[at])) & (number == chosen[at]) & (owner == ids[at]) & near

    triangle, s = np.full(len(ids), NONE), np.full(len(ids), np.inf)
    has_ray = np.flatnonzero(~np.isnan(directions[:, 0]))
    triangle[has_ray], s[has_ray] = caster.guess(origins[has_ray], directions[has_ray])
    turned = (channels["normals_geometric"].reshape(-1, 3) @ frame.R * scene.facing[triangle]).sum(axis=1)
    doubtful = (np.abs(turned) < 1 - TURNED) & (triangle >= 0) | caster.is_beside_edge(origins, directions, triangle, s)
    left = np.flatnonzero(~is_equal(triangle, s, np.arange(len(ids))) | doubtful)
    is_tie, is_wrong = np.zeros(len(ids), np.bool_), np.zeros(len(ids), np.bool_)
    is_wrong[left] = np.isnan(directions[left, 0])  # a lens shows something where the formula has no ray
    left = left[~is_wrong[left]]
    triangle[left], s[left], clear = caster.settled(origins[left], directions[left])
    good = is_equal(triangle[left], s[left], left)
    left, clear = left[~good], clear[~good]
    there = meets_at(origins[left], directions[left], caster.corners, caster.balls, identity, shown[left], kept[left])
    level = caster.level(origins[left], directions[left])
    with np.errstate(invalid="ignore"):
        there |= (shown[left] == identity[-2]) & (np.abs(level - kept[left]) <= EQUAL * kept[left])
    there |= np.isinf(kept[left]) & (ids[left] == 0)
    is_first = kept[left] <= clear * (1 + EQUAL)
    is_tie[left] = there & is_first
    is_wrong[left] = ~(there & is_first)
    return Seen(triangle, s, is_tie, is_wrong)


def shortest(values: np.ndarray, period: float | None) -> tuple[float, float]:
    """The shortest interval that holds numbers; of a circle, it may end beyond the period."""
    if period is None:
        return float(values.min()), float(values.max())
    ordered = np.sort(values % period)
    gaps = np.diff(ordered, append=ordered[0] + period)
    last = int(np.argmax(gaps))
    start = ordered[(last + 1) % len(ordered)]
    end = ordered[last]
    return float(start), float(end if end >= start else end + period)


def mask_box(mask: np.ndarray, period: int | None) -> tuple[float, ...] | None:
    """The half-open box of a mask; None if it is empty."""
    if not mask.any():
        return None
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    x0, x1 = shortest(columns.astype(np.float64), period)
    if period is None or columns[-1] - columns[0] + 1 <= x1 - x0 + 1:
        x0, x1 = float(columns[0]), float(columns[-1])
    return x0, float(rows[0]), x1 + 1, float(rows[-1] + 1)


def projected_box(frame: Frame, vertices: np.ndarray, triangles: np.ndarray) -> tuple[float, ...] | None:
    """The box of projected triangles by their edges, each in many parts where it may reach furthest; None where the lens does
    not show all, and for things around more than half of a panorama.
    """
    used = np.unique(triangles)
    at = np.full((len(vertices), 2), np.nan)
    at[used] = frame.pixels(vertices[used])
    if np.isnan(at[used]).any():
        return None
    pairs = np.unique(
        np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1), axis=0
    )
    middle = 0.0
    if frame.period is not None:
        x0, x1 = shortest(at[used, 0], frame.period)
        if x1 - x0 > frame.period / 2:
            return None
        middle = (x0 + x1) / 2
    box = []
    for axis, sign in ((0, -1), (1, -1), (0, 1), (1, 1)):
        box.append(sign * _furthest(frame, vertices, at, pairs, axis, sign, middle))
    return tuple(box)


def _furthest(frame: Frame, vertices, at, pairs, axis: int, sign: int, middle: float) -> float:
    """The largest `sign` x coordinate on edges, by a search along those that may have it."""

    def value(places: np.ndarray) -> np.ndarray:
        positions = places[:, axis]
        if axis == 0 and frame.period is not None:
            positions = (positions - middle + frame.period / 2) % frame.period + middle - frame.period / 2
        return sign * positions

    ends = value(at)[pairs]
    bulge = 2 * np.abs(ends[:, 0] - ends[:, 1]) + np.abs(at[pairs[:, 0], 1 - axis] - at[pairs[:, 1], 1 - axis])
    chosen = pairs[ends.max(axis=1) + bulge % (frame.period or math.inf) >= ends.max()]
    low, high, best = np.zeros(len(chosen)), np.ones(len(chosen)), float(ends.max())
    for _ in range(7):
        shares = low[:, None] + (high - low)[:, None] * np.linspace(0, 1, 9)
        a, b = (vertices[chosen[:, k]][:, None] for k in range(2))
        places = frame.pixels((a + shares[..., None] * (b - a)).reshape(-1, 3))
        found = np.nan_to_num(value(places).reshape(shares.shape), nan=-np.inf)
        best = max(best, float(found.max()))
        top = found.argmax(axis=1)
        rows = np.arange(len(chosen))
        low, high = shares[rows, np.maximum(top - 1, 0)], shares[rows, np.minimum(top + 1, 8)]
    return best


def in_turn(difference: np.ndarray, period: float | None) -> np.ndarray:
    """Differences of columns the shorter way around."""
    return difference if period is None else (difference + period / 2) % period - period / 2
