"""A recipe's changes to a model's materials."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.appearance.box_mapping import box_mapped
from viewsphere.assets.appearance.opaque import Stamp, opaque_picture, stamp_of
from viewsphere.assets.appearance.pbr import is_replaceable, made_of, pictures_of, scaled
from viewsphere.assets.mesh import Image, Material, Mesh, Texture
from viewsphere.materials import is_grained, metres
from viewsphere.model.thing import Repaint

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
            materials[i] = scaled(made_of(material, substance, len(images)), metres(substance.name, substance.seed))
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
