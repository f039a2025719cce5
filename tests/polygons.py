"""Random polygons whose area is known without cutting them."""

import numpy as np


def star(rng, corners, least=0.3):
    """A star-shaped polygon (N, 2) around the origin, counter-clockwise, within the unit circle."""
    angles = (np.arange(corners) + rng.uniform(-0.3, 0.3, corners)) * 2 * np.pi / corners
    radii = rng.uniform(least, 1.0, corners)
    return np.column_stack([radii * np.cos(angles), radii * np.sin(angles)])


def comb(teeth):
    """A comb (4 teeth + 2, 2): no star, its fan from any corner folds. Its area is 4 teeth - 1."""
    top = [(x, y) for i in range(teeth) for x, y in ((2 * i, 0), (2 * i, 2), (2 * i + 1, 2), (2 * i + 1, 0))]
    return np.array([(0.0, -1.0), *top, (2 * teeth - 1, -1.0)])[::-1]


def shoelace(polygon):
    """Signed area of a polygon (N, 2)."""
    x, y = polygon.T
    return float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2)


def turned(rng, flat):
    """Points (N, 2) on a random plane in space, (N, 3)."""
    axes, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return np.column_stack([flat, np.zeros(len(flat))]) @ axes.T + rng.normal(size=3)


def is_inside(polygon, points):
    """Which points (P, 2) lie inside of a polygon (N, 2), by the number of its edges to their right."""
    x, y = points[:, :1], points[:, 1:]
    (x0, y0), (x1, y1) = polygon.T, np.roll(polygon, -1, axis=0).T
    spans = (y0 > y) != (y1 > y)
    at = x0 + (y - y0) * (x1 - x0) / np.where(y1 == y0, 1.0, y1 - y0)
    return (spans & (at > x)).sum(axis=1) % 2 == 1


def triangle_areas(mesh):
    """Area of each triangle of a mesh."""
    a, b, c = (mesh.vertices[mesh.triangles[:, i]].astype(float) for i in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
