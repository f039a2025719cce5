"""The mapping of pictures to surfaces: texture coordinates by corner, so that seams stay sharp."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from viewsphere.assets.mesh import Image, Material, Mesh, Texture
from viewsphere_zoo.shapes.solids import Float

Chart = Callable[[Float, Float], Float]
"""Maps corners (T, 3, 3) and unit face normals (T, 3) of triangles to their uv (T, 3, 2)."""


def printed(name: str, image: int, roughness: float = 0.6, clearcoat: float = 0.0) -> Material:
    """Paper, plastic or glaze with one picture on it."""
    return Material(
        name,
        base_color_texture=Texture(image),
        roughness=roughness,
        clearcoat=clearcoat,
        clearcoat_roughness=0.05 * (clearcoat > 0),
    )


def charted(mesh: Mesh, charts: Mapping[str, Chart], images: Sequence[Image]) -> Mesh:
    """The mesh with pictures on its materials; vertices are split where two of their triangles differ in uv."""
    if not charts:
        return mesh
    corners = mesh.vertices[mesh.triangles].astype(np.float64)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    uv = np.zeros((len(corners), 3, 2))
    for i, material in enumerate(mesh.materials):
        if material.name in charts:
            own = mesh.triangle_material == i
            uv[own] = charts[material.name](corners[own], normals[own])
    key = np.column_stack([mesh.triangles.reshape(-1, 1), np.round(uv.reshape(-1, 2) * 1e5).astype(np.int64)])
    _, first, index = np.unique(key, axis=0, return_index=True, return_inverse=True)
    source = mesh.triangles.ravel()[first]
    return replace(
        mesh,
        vertices=mesh.vertices[source],
        normals=mesh.normals[source],
        triangles=index.reshape(-1, 3).astype(np.int32),
        uv0=uv.reshape(-1, 2)[first].astype(np.float32),
        colors=None if mesh.colors is None else mesh.colors[source],
        images=tuple(images),
    )


def wound(low: float, high: float) -> Chart:
    """A chart once around the z axis between two heights; the middle of the picture faces -Y."""

    def chart(corners: Float, _normals: Float) -> Float:
        u = np.arctan2(corners[..., 0], -corners[..., 1]) / (2 * np.pi) + 0.5
        beyond = (np.ptp(u, axis=1) > 0.5)[:, None] & (u < 0.5)
        return np.stack([u + beyond, (high - corners[..., 2]) / (high - low)], axis=-1)

    return chart


def flat(low: tuple[float, float], high: tuple[float, float], axes: tuple[int, int] = (0, 1)) -> Chart:
    """A chart straight onto two axes, between two corners (lower left, upper right); swapped corners mirror it."""

    def chart(corners: Float, _normals: Float) -> Float:
        u, v = ((corners[..., axis] - low[k]) / (high[k] - low[k]) for k, axis in enumerate(axes))
        return np.stack([u, 1 - v], axis=-1)

    return chart


def plane(corner: ArrayLike, across: ArrayLike, up: ArrayLike) -> Chart:
    """A chart onto any rectangle: its lower left corner, and its edges to the right and up, (3,)."""
    origin, u, v = (np.asarray(p, np.float64) for p in (corner, across, up))

    def chart(corners: Float, _normals: Float) -> Float:
        rest = corners - origin
        return np.stack([rest @ u / (u @ u), 1 - rest @ v / (v @ v)], axis=-1)

    return chart


def sides(charts: Mapping[tuple[int, int], Chart]) -> Chart:
    """A chart for each side, (axis, sign) of the largest component of a triangle's normal; uv 0 on sides without a chart."""

    def chart(corners: Float, normals: Float) -> Float:
        axis = np.abs(normals).argmax(axis=1)
        sign = np.sign(normals[np.arange(len(axis)), axis])
        uv = np.zeros((*corners.shape[:2], 2))
        for (a, s), own in charts.items():
            here = (axis == a) & (sign == s)
            uv[here] = own(corners[here], normals[here])
        return uv

    return chart
