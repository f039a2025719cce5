"""USD's implicit shapes (cube, sphere, cylinder, cone, capsule, plane) as polygons."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from viewsphere.assets.primitive import Float, Int

AROUND, RINGS = 48, 24
"""Segments around an axis, and from pole to pole: a sphere's volume is then 1.1 % too small."""

AXES = {"X": [2, 0, 1], "Y": [1, 2, 0], "Z": [0, 1, 2]}
"""Columns of the coordinates that turn a shape about z into one about another axis, right-handed."""

CUBE = [[0, 2, 6, 4], [1, 5, 7, 3], [0, 4, 5, 1], [2, 3, 7, 6], [0, 1, 3, 2], [4, 6, 7, 5]]


def polygons_of(prim: Any, time: Any) -> tuple[Float, Int, Int] | None:
    """Points, corners and corners of each polygon, outward; None for other prims."""
    kind = str(prim.GetTypeName())

    def value(name: str) -> float:
        return float(prim.GetAttribute(name).Get(time))

    if kind == "Cube":
        half = value("size") / 2
        points = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * 2.0 - 1
        return points * half, np.array(CUBE).reshape(-1), np.full(6, 4)
    if kind == "Plane":
        width, length = value("width") / 2, value("length") / 2
        points = np.array([[-width, -length, 0], [width, -length, 0], [width, length, 0], [-width, length, 0]])
        return _about(points, np.arange(4), np.array([4]), prim, time)
    profile = _profile(kind, value)
    return None if profile is None else _about(*_turned(profile), prim, time)


def _profile(kind: str, value: Any) -> Float | None:
    """Radii and heights of a shape's outline, from bottom to top; its first and last radius is 0."""
    if kind == "Sphere":
        return _arc(value("radius"), -0.5, 0.5, 0.0, RINGS)
    if kind == "Cylinder":
        radius, half = value("radius"), value("height") / 2
        return np.array([[0, -half], [radius, -half], [radius, half], [0, half]])
    if kind == "Cone":
        radius, half = value("radius"), value("height") / 2
        return np.array([[0, -half], [radius, -half], [0, half]])
    if kind == "Capsule":
        radius, half = value("radius"), value("height") / 2
        arcs = _arc(radius, -0.5, 0, -half, RINGS // 2), _arc(radius, 0, 0.5, half, RINGS // 2)
        return np.concatenate(arcs)
    return None


def _arc(radius: float, start: float, end: float, height: float, steps: int) -> Float:
    """A circle's arc between two angles in half turns from the horizontal."""
    angle = np.linspace(start, end, steps + 1) * np.pi
    arc = np.column_stack([np.cos(angle), np.sin(angle)]) * radius + [0, height]
    arc[np.abs(arc[:, 0]) < radius * 1e-12, 0] = 0
    return arc


def _turned(profile: Float) -> tuple[Float, Int, Int]:
    """The polygons of an outline turned about z: triangles at poles, quadrilaterals elsewhere."""
    angle = np.arange(AROUND) * (2 * np.pi / AROUND)
    around = np.column_stack([np.cos(angle), np.sin(angle)])
    rings = [np.column_stack([around * radius, np.full(AROUND, height)]) for radius, height in profile]
    points, corners, counts = np.concatenate(rings), list[list[int]](), list[int]()
    for ring, (low, high) in enumerate(pairwise(profile[:, 0].tolist())):
        for i in range(AROUND):
            a, b = ring * AROUND + i, ring * AROUND + (i + 1) % AROUND
            face = [*([a] if low == 0 else [a, b]), *([b + AROUND] if high == 0 else [b + AROUND, a + AROUND])]
            corners.append(face)
            counts.append(len(face))
    return points, np.array([corner for face in corners for corner in face]), np.array(counts)


def _about(points: Float, corners: Int, counts: Int, prim: Any, time: Any) -> tuple[Float, Int, Int]:
    axis = prim.GetAttribute("axis")  # for all shapes except spheres
    return points[:, AXES[str(axis.Get(time)) if axis else "Z"]], corners, counts
