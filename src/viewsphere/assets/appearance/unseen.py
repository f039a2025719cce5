"""Models of which no picture shows anything."""

from __future__ import annotations

import numpy as np

from viewsphere.assets.appearance.shown import shown_texels
from viewsphere.assets.mesh import Mesh

FAINTEST = 0.01
"""Alpha below which blended texels are no surface for labels: the default of a recipe's `label_alpha`."""


def is_unseen(mesh: Mesh) -> bool:
    """Return whether every triangle is clear all over: by its material, its texels or its vertices' colours."""
    return all(_is_clear(mesh, index) for index in np.unique(mesh.triangle_material).tolist())


def _is_clear(mesh: Mesh, index: int) -> bool:
    material = mesh.materials[index]
    if material.alpha_mode == "OPAQUE" or material.transmission > 0:
        return False
    triangles = mesh.triangles[mesh.triangle_material == index]
    vertices = 1.0 if mesh.colors is None else float(mesh.colors[triangles, 3].max())
    least = material.alpha_cutoff if material.alpha_mode == "MASK" else FAINTEST
    most = material.base_color[3] * vertices
    return most < least or most * _texels(mesh, index) < least


def _texels(mesh: Mesh, index: int) -> float:
    """The highest alpha of a texel that triangles of a material show; of a rotated or mirrored texture, of any texel."""
    texture = mesh.materials[index].base_color_texture
    uv = None if texture is None else (mesh.uv0, mesh.uv1)[texture.texcoord]
    if texture is None or uv is None:
        return 1.0
    alpha = mesh.images[texture.image].pixels[..., 3]
    if alpha.min() == 255:
        return 1.0
    if not texture.rotation and min(texture.scale) > 0:
        corners = uv[mesh.triangles[mesh.triangle_material == index]].astype(np.float64)
        alpha = alpha[shown_texels(texture, corners, alpha.shape)]
    return float(alpha.max(initial=0)) / 255.0
