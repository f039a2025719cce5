"""A recipe's changes to a model's materials."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.folder import SHARPEST, UnreadableError, decode_image, reduced
from viewsphere.assets.mesh import Image, Material, Mesh, Texture
from viewsphere.errors import RecipeError
from viewsphere.model.thing import Repaint


def repainted(material: Material, repaints: Sequence[Repaint]) -> tuple[Material, Repaint | None]:
    """The material with its new tint, and the last repaint whose pattern matches the material's name, None if none does."""
    found = next((r for r in reversed(repaints) if fnmatchcase(material.name, r.material)), None)
    if found is None or found.tint is None:
        return material, found
    red, green, blue, alpha = material.base_color
    tint = found.tint
    return replace(material, base_color=(red * tint[0], green * tint[1], blue * tint[2], alpha)), found


def textured(mesh: Mesh, repaints: Sequence[Repaint]) -> Mesh:
    """The mesh whose opaque materials have the pictures of the repaints that match them as their colour; the mesh itself where
    none does. Others keep theirs: their clear texels are holes, of which labels know.

    A mesh without texture coordinates gets those of a box: of each vertex its place along the two axes that its normal faces
    least, the model's longest side once over the picture. Raises RecipeError for a picture that cannot be read.
    """
    images, materials = list(mesh.images), list(mesh.materials)
    for i, material in enumerate(mesh.materials):
        found = next((r for r in reversed(repaints) if fnmatchcase(material.name, r.material)), None)
        if found is not None and found.image is not None and material.alpha_mode == "OPAQUE":
            texcoord = 0 if material.base_color_texture is None else material.base_color_texture.texcoord
            texture = Texture(len(images), texcoord=texcoord)
            materials[i] = replace(material, base_color=(1.0, 1.0, 1.0, material.base_color[3]), base_color_texture=texture)
            images.append(_picture(found.image))
    if len(images) == len(mesh.images):
        return mesh
    uv0 = _box_coordinates(mesh) if mesh.uv0 is None else mesh.uv0
    return replace(mesh, images=tuple(images), materials=tuple(materials), uv0=uv0)


@lru_cache(maxsize=16)
def _picture(path: str) -> Image:
    """A picture that hides all that is behind it; the last ones are kept."""
    try:
        pixels = reduced(decode_image(Path(path).read_bytes(), path, upright=True), SHARPEST).copy()
    except (OSError, UnreadableError) as error:
        raise RecipeError(f"scene.materials: expected a readable image; found: {error}") from None
    pixels[..., 3] = 255
    return Image(Path(path).name, pixels)


def _box_coordinates(mesh: Mesh) -> NDArray[np.float32]:
    """Texture coordinates (V, 2) of a mesh that has none."""
    low, high = mesh.bounds
    places = (mesh.vertices - low) / max(float((high - low).max()), 1e-9)
    facing = np.abs(mesh.normals).argmax(axis=1)
    across = np.where(facing == 0, 1, 0)  # y where a face looks along x, else x
    up = np.where(facing == 2, 1, 2)
    rows = np.arange(len(places))
    return np.stack([places[rows, across], 1 - places[rows, up]], axis=1).astype(np.float32)
