"""Solids as fields: functions that approximate the distance to a surface, metres, negative inside; and their meshes."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from viewsphere_zoo.shapes.solids import Float, Solid, curve

Field = Callable[[Float], Float]
"""Maps points (N, 3) to values (N,)."""


def ball(center: ArrayLike, radii: ArrayLike, turn: Float | None = None) -> Field:
    """An ellipsoid; `turn` (3, 3) has its axes as rows."""
    c, r = np.asarray(center, np.float64), np.broadcast_to(np.asarray(radii, np.float64), 3)

    def value(p: Float) -> Float:
        q = p - c
        if turn is not None:
            q = np.stack([(q * row).sum(axis=1) for row in turn], axis=1)
        near = _length(q / r)
        return near * (near - 1) / np.maximum(_length(q / (r * r)), 1e-9)

    return value


def limb(start: ArrayLike, end: ArrayLike, radii: ArrayLike, bulge: ArrayLike = ((0, 0), (1, 0)), flat: float = 1.0) -> Field:
    """A limb around a bone: knots (share of the length, radius), and knots (share, metres) of its offset behind the bone (+Y).
    It is `flat` times as thick from front to back as it is wide.
    """
    a, b = np.asarray(start, np.float64), np.asarray(end, np.float64)
    way = b - a
    square = float((way * way).sum())

    def value(p: Float) -> Float:
        t = ((p - a) * way).sum(axis=1) / square
        inside = np.clip(t, 0, 1)
        q = p - a - inside[:, None] * way
        q[:, 1] = (q[:, 1] - curve(inside, bulge)) / flat
        return (_length(q) - curve(inside, radii)) * min(flat, 1.0)

    return value


def trunk(sections: Float, power: float = 2.4) -> Field:
    """A body around the z axis: rows of height, half width, depth in front and behind, and its middle's y, metres."""
    z, wide, front, behind, middle = np.asarray(sections, np.float64).T

    def at(height: Float, column: Float) -> Float:
        return curve(height, np.stack([z, column], axis=1))

    def value(p: Float) -> Float:
        h = np.clip(p[:, 2], z[0], z[-1])
        x, y = np.abs(p[:, 0]), p[:, 1] - at(h, middle)
        a = at(h, wide)
        d = np.where(y < 0, at(h, front), at(h, behind))
        near = ((x / a) ** power + (np.abs(y) / d) ** power) ** (1 / power)
        steep = np.sqrt((x / (a * a)) ** 2 + (y / (d * d)) ** 2)
        side = near * (near - 1) / np.maximum(steep, 1e-6)
        beyond = np.abs(p[:, 2] - h)
        return np.where(beyond > 0, np.sqrt(np.maximum(side, 0) ** 2 + beyond**2), np.maximum(side, -np.minimum(a, d)))

    return value


def joined(k: float, *fields: Field) -> Field:
    """Return the union of the fields, with fillets of about k metres where they meet (polynomial smooth minimum, Quilez)."""

    def value(p: Float) -> Float:
        found = fields[0](p)
        for field in fields[1:]:
            found = _blend(found, field(p), k)
        return found

    return value


def without(field: Field, taken: Field, k: float) -> Field:
    """The first field minus the second, with an edge rounded by about k metres."""
    return lambda p: -_blend(-field(p), taken(p), k)


def within(field: Field, other: Field, k: float) -> Field:
    """Return the intersection of both fields, with an edge rounded by about k metres."""
    return lambda p: -_blend(-field(p), -other(p), k)


def grown(field: Field, by: float | Field) -> Field:
    """The solid with its surface moved outwards by this distance, metres."""
    return lambda p: field(p) - (by(p) if callable(by) else by)


def plane(point: ArrayLike, normal: ArrayLike) -> Field:
    """Return the half-space behind a plane."""
    c, n = np.asarray(point, np.float64), np.asarray(normal, np.float64)
    n = n / np.sqrt((n * n).sum())
    return lambda p: ((p - c) * n).sum(axis=1)


def mirror(field: Field) -> Field:
    """The field's half at x > 0, and its mirror image."""
    return lambda p: field(np.stack([np.abs(p[:, 0]), p[:, 1], p[:, 2]], axis=1))


def _blend(a: Float, b: Float, k: float) -> Float:
    h = np.maximum(k - np.abs(a - b), 0) / k
    return np.minimum(a, b) - h * h * k / 4


def _length(q: Float) -> Float:
    return np.sqrt(q[:, 0] ** 2 + q[:, 1] ** 2 + q[:, 2] ** 2)


def gradient(field: Field, points: Float, step: float) -> Float:
    """Unit vectors (N, 3) out of the solid, by differences."""
    out = np.stack([field(points + step * axis) - field(points - step * axis) for axis in np.eye(3)], axis=1)
    return out / np.maximum(_length(out), 1e-12)[:, None]


def steps(low: float, high: float, cell: float, fine: tuple[float, float, float] | None = None) -> Float:
    """Coordinates from low to about high in steps of `cell`; between the first two numbers of `fine`, in steps of the third."""
    edges = [(low, high, cell)] if fine is None else [(low, fine[0], cell), fine, (fine[1], high, cell)]
    found = [a + (b - a) / (n := max(round((b - a) / c), 1)) * np.arange(n) for a, b, c in edges if b > a]
    return np.append(np.concatenate(found), high)


def cells(low: ArrayLike, high: ArrayLike, cell: float) -> tuple[Float, Float, Float]:
    """The axes of a grid of even cells."""
    pairs = zip(np.asarray(low, np.float64).tolist(), np.asarray(high, np.float64).tolist(), strict=True)
    x, y, z = (steps(a, b, cell) for a, b in pairs)
    return x, y, z


def surface(field: Field, axes: tuple[Float, Float, Float]) -> Solid:
    """The closed surface of a field in quads about the size of the cells of an enclosing grid: surface nets (Gibson 1998),
    with vertices then projected onto the surface.
    """
    cell = float(max(np.diff(axis).max() for axis in axes))
    near = float(min(np.diff(axis).min() for axis in axes))
    values = _sampled(field, axes, cell)
    shape = values.shape
    corners = [values[tuple(slice(o, n - 1 + o) for o, n in zip(c, shape, strict=True))] for c in product((0, 1), repeat=3)]
    inside = np.stack([c < 0 for c in corners])
    active = inside.any(axis=0) & ~inside.all(axis=0)
    index = np.full(active.shape, -1)
    index[active] = np.arange(np.count_nonzero(active))
    at, part = np.argwhere(active), _crossings([c[active] for c in corners])
    low = np.stack([axis[at[:, k]] for k, axis in enumerate(axes)], axis=1)
    size = np.stack([np.diff(axis)[at[:, k]] for k, axis in enumerate(axes)], axis=1)
    points = low + part * size
    quads = _quads(values < 0, index)
    out = gradient(field, points, 0.3 * near)
    for _ in range(2):
        points = points - 0.85 * np.clip(field(points), -0.5 * near, 0.5 * near)[:, None] * out
    return Solid(points, _split(points, quads))


COARSE = 3
"""Stride of the first, coarse pass over the grid points along an axis."""


def _sampled(field: Field, axes: tuple[Float, Float, Float], cell: float) -> NDArray[np.float64]:
    """The field at all points of a grid: first at a few of them, then where the surface may be near."""
    shape = tuple(map(len, axes))
    chosen = [np.unique(np.append(np.arange(0, n, COARSE), n - 1)) for n in shape]
    rough_axes = [axis[c] for axis, c in zip(axes, chosen, strict=True)]
    rough = field(np.stack(np.meshgrid(*rough_axes, indexing="ij"), axis=-1).reshape(-1, 3)).reshape(*map(len, chosen))
    nearest = [np.abs(np.arange(n)[:, None] - c).argmin(axis=1) for n, c in zip(shape, chosen, strict=True)]
    values = rough[np.ix_(*nearest)]
    near = np.abs(values) < 4 * cell
    place = np.argwhere(near)
    values[near] = field(np.stack([axes[k][place[:, k]] for k in range(3)], axis=1))
    return values


def _crossings(corners: list[Float]) -> Float:
    """The mean (N, 3) of each cell's edge crossings with the surface, in cells."""
    places = list(product((0, 1), repeat=3))
    total, count = np.zeros((len(corners[0]), 3)), np.zeros(len(corners[0]))
    for i, a in enumerate(places):
        for j, b in enumerate(places):
            if i < j and sum(x != y for x, y in zip(a, b, strict=True)) == 1:
                u, v = corners[i], corners[j]
                cross = (u < 0) != (v < 0)
                share = np.where(cross, u / np.where(cross, u - v, 1.0), 0.0)[:, None]
                total += np.where(cross[:, None], np.array(a) + share * (np.array(b) - np.array(a)), 0.0)
                count += cross
    return total / count[:, None]


def _quads(inside: NDArray[np.bool_], index: NDArray[np.int64]) -> NDArray[np.int64]:
    """A quad (N, 4) of cells around every edge that crosses the surface, counter-clockwise seen from outside."""
    found = list[NDArray[np.int64]]()
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        first, second = ([slice(1, -1)] * 3 for _ in range(2))
        first[axis], second[axis] = slice(0, -1), slice(1, None)
        a, b = inside[tuple(first)], inside[tuple(second)]
        edges = np.argwhere(a != b)
        edges[:, [u, v]] += 1
        steps = np.zeros((4, 3), int)
        steps[1, u] = steps[2, u] = steps[2, v] = steps[3, v] = -1
        quad = np.stack([index[tuple((edges + step).T)] for step in steps], axis=1)
        leaves = a[a != b]
        found.append(np.where(leaves[:, None], quad, quad[:, ::-1]))
    return np.concatenate(found)


def _split(points: Float, quads: NDArray[np.int64]) -> NDArray[np.int64]:
    """Two triangles for each quad, cut along the shorter diagonal."""
    a, b, c, d = quads.T
    short = _length(points[a] - points[c]) <= _length(points[b] - points[d])
    one = np.where(short[:, None], np.stack([a, b, c], 1), np.stack([b, c, d], 1))
    two = np.where(short[:, None], np.stack([a, c, d], 1), np.stack([b, d, a], 1))
    return np.concatenate([one, two])
