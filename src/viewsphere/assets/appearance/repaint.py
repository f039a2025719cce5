"""A recipe's changes to a model's materials."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.appearance.opaque import Stamp, opaque_picture, stamp_of
from viewsphere.assets.appearance.pbr import is_replaceable, made_of, pictures_of
from viewsphere.assets.mesh import Image, Material, Mesh, Texture
from viewsphere.assets.primitive import face_normals
from viewsphere.materials import is_grained, metres
from viewsphere.model.thing import Repaint

_Float = NDArray[np.float64]

_RIGHT = np.array([[0, 1, 0], [0, -1, 0], [-1, 0, 0], [1, 0, 0], [1, 0, 0], [-1, 0, 0]], np.float64)

_UP = np.array([[0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 1, 0], [0, 1, 0]], np.float64)
"""The right and up directions of a viewer that faces the sides +x, -x, +y, -y, +z, -z of a box."""

_GOLDEN = 0.6180339887498949
"""The golden ratio less 1: multiples of it, modulo 1, shift the parts' textures by evenly spread amounts."""

FIELD = "scene.materials"
"""The recipe's field that names repaints' pictures."""


def repainted(material: Material, repaints: Sequence[Repaint]) -> tuple[Material, Repaint | None]:
    """The material with its new tint, and the last repaint whose pattern matches the material's name, None if none does."""
    found = next((r for r in reversed(repaints) if fnmatchcase(material.name, r.material)), None)
    if found is None or found.tint is None:
        return material, found
    red, green, blue, alpha = material.base_color
    tint = found.tint
    return replace(material, base_color=(red * tint[0], green * tint[1], blue * tint[2], alpha)), found


def textured(mesh: Mesh, repaints: Sequence[Repaint], rest: Mesh | None = None) -> Mesh:
    """The mesh whose opaque materials have the picture or substance of the repaint that matches them; the mesh itself if none
    matches. Other materials keep their textures, because their clear texels are holes that labels depend on.

    For pictures, a mesh without texture coordinates gets box coordinates: each vertex is projected along the axis that its
    normal faces most, and the picture spans the model's longest side. Substances always use box coordinates in metres, on a
    deforming model those at `rest`. Glass stays glass. Raises RecipeError for a picture that cannot be read.
    """
    found = [_found(material, repaints) for material in mesh.materials]
    if not any(one.image or one.texture for one in found):
        return mesh
    images, materials = list(mesh.images), list(mesh.materials)
    for i, (material, own) in enumerate(zip(mesh.materials, found, strict=True)):
        if own.texture is not None:
            substance = own.texture
            materials[i] = _scaled(made_of(material, substance, len(images)), metres(substance.name, substance.seed))
            images += pictures_of(substance)
        elif own.image is not None:
            texcoord = 0 if material.base_color_texture is None else material.base_color_texture.texcoord
            texture = Texture(len(images), texcoord=texcoord)
            materials[i] = replace(material, base_color=(1.0, 1.0, 1.0, material.base_color[3]), base_color_texture=texture)
            images.append(_picture(own.image, stamp_of(own.image, FIELD)))
    uv0 = _box_coordinates(mesh) if mesh.uv0 is None and any(own.image for own in found) else mesh.uv0
    painted = replace(mesh, images=tuple(images), materials=tuple(materials), uv0=uv0)
    made = np.array([own.texture is not None for own in found])
    if not made.any():
        return painted
    grained = np.array([own.texture is not None and is_grained(own.texture.name) for own in found])
    return box_mapped(painted, made[mesh.triangle_material], grained[mesh.triangle_material], rest)


def _found(material: Material, repaints: Sequence[Repaint]) -> Repaint:
    """The last matching repaint, reduced to the picture or substance that it gives the material."""
    found = next((r for r in reversed(repaints) if fnmatchcase(material.name, r.material)), None)
    if found is None or material.alpha_mode != "OPAQUE":
        return Repaint()
    return found if is_replaceable(material) else found.model_copy(update={"texture": None})


def repaint_stamps(repaints: Iterable[Repaint]) -> tuple[Stamp, ...]:
    """The stamps of the files that repaints name; raises RecipeError if one is missing."""
    return tuple(stamp_of(path, FIELD) for path in dict.fromkeys(repaint.image for repaint in repaints) if path is not None)


@lru_cache(maxsize=16)
def _picture(path: str, stamp: Stamp) -> Image:
    """The picture in a file, cached while the file is unchanged; the cache holds the last ones."""
    return Image(Path(path).name, opaque_picture(path, FIELD, upright=True))


def _box_coordinates(mesh: Mesh) -> NDArray[np.float32]:
    """Texture coordinates (V, 2) of a mesh that has none."""
    low, high = mesh.bounds
    places = (mesh.vertices - low) / max(float((high - low).max()), 1e-9)
    facing = np.abs(mesh.normals).argmax(axis=1)
    across = np.where(facing == 0, 1, 0)  # y where a face looks along x, else x
    up = np.where(facing == 2, 1, 2)
    rows = np.arange(len(places))
    return np.stack([places[rows, across], 1 - places[rows, up]], axis=1).astype(np.float32)


def box_mapped(mesh: Mesh, chosen: NDArray[np.bool_], grained: NDArray[np.bool_], rest: Mesh | None = None) -> Mesh:
    """The mesh in which each chosen triangle (T,) has coordinates uv0 in metres, v down, on the box side that it faces most.

    grained (T,): u runs along the longer side of the triangle's part, and each part has a different offset, like pieces cut
    from one material. rest: the same triangles at rest, whose positions and normals are used for a deforming model.

    The number and order of triangles stay the same. A vertex with several coordinates is split into several at one position.
    Vertex colours become white there.
    """
    still = mesh if rest is None or rest.triangles.shape != mesh.triangles.shape else rest
    vertices = still.vertices.astype(np.float64)
    normals = face_normals(vertices, still.triangles)
    axis = np.abs(normals).argmax(axis=1)
    side = 2 * axis + (np.take_along_axis(normals, axis[:, None], axis=1)[:, 0] < 0)
    turned = grained & _is_turned(still, vertices, side)
    part = np.where(grained, mesh.triangle_part.astype(np.int64) + 1, 0)
    mapping = np.where(chosen, 1 + side + 6 * turned + 12 * part, 0)
    count = int(mapping.max()) + 1
    keys = mesh.triangles.astype(np.int64) * count + mapping[:, None]
    found, triangles = np.unique(keys, return_inverse=True)
    origin, way = found // count, found % count
    own = way > 0
    uv = np.zeros((len(found), 2), np.float32) if mesh.uv0 is None else mesh.uv0[origin]
    uv[own] = _coordinates(vertices[still.triangles.reshape(-1)[_first(triangles, len(found))]][own], way[own] - 1)
    colors = None if mesh.colors is None else np.where(own[:, None], np.float32(1), mesh.colors[origin])
    return replace(
        mesh,
        vertices=mesh.vertices[origin],
        normals=mesh.normals[origin],
        triangles=triangles.reshape(-1, 3).astype(np.int32),
        uv0=uv,
        uv1=None if mesh.uv1 is None else mesh.uv1[origin],
        colors=colors,
    )


def _first(index: NDArray[np.intp], count: int) -> NDArray[np.intp]:
    """For each number below `count`, a position in `index` that holds it."""
    places = np.empty(count, np.intp)
    places[index.reshape(-1)] = np.arange(index.size)
    return places


def _is_turned(mesh: Mesh, vertices: _Float, side: NDArray[np.int64]) -> NDArray[np.bool_]:
    """A mask (T,) of the triangles whose part extends farther up than right on the triangle's side."""
    low, high = (np.full((len(mesh.parts), 3), fill) for fill in (np.inf, -np.inf))
    corners, parts = vertices[mesh.triangles], mesh.triangle_part
    np.minimum.at(low, parts, corners.min(axis=1))
    np.maximum.at(high, parts, corners.max(axis=1))
    extent = np.where(high >= low, high - low, 0.0)[parts]
    return (extent * np.abs(_UP[side])).sum(axis=1) > (extent * np.abs(_RIGHT[side])).sum(axis=1)


def _coordinates(places: _Float, way: NDArray[np.int64]) -> NDArray[np.float32]:
    """Coordinates (N, 2) of positions (N, 3), each mapped by its `way`: one of 6 sides, upright or turned, shifted by its
    part's number.
    """
    side, turned, part = way % 6, way // 6 % 2 == 1, way // 12
    right, up = (places * _RIGHT[side]).sum(axis=1), (places * _UP[side]).sum(axis=1)
    u, v = np.where(turned, up, right), np.where(turned, right, -up)
    shift = part * _GOLDEN
    return np.stack([u + 0.3 * shift, v + shift], axis=1).astype(np.float32)


def _scaled(material: Material, metres: float) -> Material:
    """The same material for uv in metres; its pictures span `metres`."""
    names = ("base_color_texture", "metallic_roughness_texture", "normal_texture")
    return replace(material, **{name: replace(getattr(material, name), scale=(1 / metres, 1 / metres)) for name in names})
