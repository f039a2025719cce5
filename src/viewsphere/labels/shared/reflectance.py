"""The share of light that surfaces reflect: the luminance of their base colours at points."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.appearance.repaint import repainted
from viewsphere.assets.mesh import Image, Material, Mesh, Texture, Wrap
from viewsphere.codecs.srgb import linear
from viewsphere.model.scene import Ground
from viewsphere.model.thing import Repaint
from viewsphere.rendering.ground.material import ground_frame, ground_material
from viewsphere.truth.lidar.sweeping import Hits
from viewsphere.truth.raster.geometry import Geometry
from viewsphere.truth.shot_views import Painted

Float = NDArray[np.float64]

LUMINANCE = (0.2126, 0.7152, 0.0722)
"""Luminance of linear red, green and blue (Rec. 709)."""


def albedo(geometry: Geometry, painted: Painted, hits: Hits) -> Float:
    """The luminance (N,) of the base colour where rays meet surfaces, 0 to 1. The base colour is the product of the material's
    colour, the nearest texel of its picture, and the vertex colours, all linear.
    """
    out, starts = np.ones(len(hits.triangle)), geometry.triangle_start
    for i, (thing, mesh) in enumerate(zip(painted.things, painted.meshes, strict=True)):
        own = np.flatnonzero((hits.triangle >= starts[i]) & (hits.triangle < starts[i + 1]))
        if len(own):
            out[own] = _of_mesh(mesh, thing.repaints, hits.triangle[own] - starts[i], hits.weights[own])
    own = np.flatnonzero(hits.triangle >= starts[-1])
    if painted.ground is not None and len(own):
        out[own] = _of_ground(painted.ground, hits.place[own])
    return out


def _of_mesh(mesh: Mesh, repaints: Sequence[Repaint], triangle: NDArray[np.int32], weights: Float) -> Float:
    out, materials = np.ones(len(triangle)), mesh.triangle_material[triangle]
    for number in np.unique(materials).tolist():
        own = np.flatnonzero(materials == number)
        material, _ = repainted(mesh.materials[number], repaints)
        corners, share = mesh.triangles[triangle[own]], weights[own][..., None]

        def between(values: NDArray[np.float32], corners: NDArray[np.int32] = corners, share: Float = share) -> Float:
            return np.nan_to_num((values[corners].astype(np.float64) * share).sum(axis=1))

        tint = None if mesh.colors is None else between(mesh.colors)[:, :3]
        texture = material.base_color_texture
        uv = None if texture is None else (mesh.uv0, mesh.uv1)[texture.texcoord]
        out[own] = _luminance(material, mesh.images, None if uv is None else between(uv), tint)
    return out


def _of_ground(ground: Ground, place: Float) -> Float:
    material, images = ground_material(ground)
    per_length, u, v = ground_frame(ground, material, (0.0, 0.0, 0.0), 1.0)
    uv = np.stack([u + per_length * place[:, 0], v - per_length * place[:, 1]], axis=1)
    return np.broadcast_to(_luminance(material, images, uv, None), len(place))


def _luminance(material: Material, images: Sequence[Image], uv: Float | None, tint: Float | None) -> Float:
    """The luminance of a material at texture coordinates (N, 2), times colours (N, 3); one number if it has neither."""
    color = np.array([material.base_color[:3]])
    if tint is not None:
        color = color * tint
    texture = material.base_color_texture
    if texture is not None and uv is not None:
        color = color * _texels(images[texture.image].pixels, texture, uv)
    r, g, b = (color[:, i] * share for i, share in enumerate(LUMINANCE))
    return np.clip(r + g + b, 0.0, 1.0)


def _texels(pixels: NDArray[np.uint8], texture: Texture, uv: Float) -> Float:
    """The nearest texels (N, 3), linear."""
    (a, b, x), (c, d, y) = texture.matrix.tolist()
    u, v = uv.T
    height, width = pixels.shape[:2]
    column = _wrapped(a * u + b * v + x, width, texture.wrap_s)
    row = _wrapped(c * u + d * v + y, height, texture.wrap_t)
    return linear(np.arange(256) / 255)[pixels[row, column, :3]]


def _wrapped(place: Float, size: int, wrap: Wrap) -> NDArray[np.intp]:
    """The index of the texel at a coordinate; 1 is the full extent of the picture."""
    if wrap == "repeat":
        return (np.floor((place - np.floor(place)) * size)).astype(np.intp).clip(0, size - 1)
    if wrap == "mirror":
        place = 1.0 - np.abs(place - 2.0 * np.floor(place / 2.0) - 1.0)
    return np.floor(place.clip(0.0, 1.0) * size).astype(np.intp).clip(0, size - 1)
