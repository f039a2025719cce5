"""Cut-outs: the places where a triangle with a see-through material is surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import WRAPS, Material, Mesh, Texture, Wrap

SURFACE, NEVER = -1, -2
ENDLESS = (-3, -4)
"""Half of an endless plane: only the edge opposite corner 1 (or 2) counts, and all of it is surface."""
SEEN = 1 / 512  # smallest alpha of a texel that is not clear
_BORDERS: dict[Wrap, Literal["wrap", "symmetric", "edge"]] = {"repeat": "wrap", "mirror": "symmetric", "clamp": "edge"}


@dataclass(frozen=True, eq=False)
class AlphaMasks:
    """The cut-out materials of a stage and the triangles that use them, packed for the kernels.

    A point is surface if `texel / 255 * factor * a >= threshold`, with the nearest texel at its (u, v) and the interpolated
    vertex alpha a. texels (N,) uint8: the alpha of all textures, row by row. layout (M, 5) int64 per material: offset into
    `texels`, width, height, wrap of u, wrap of v (indices of WRAPS). levels (M, 2) float64: factor, threshold. material (C,)
    int32 per cut-out triangle: a row of `layout`. corners (C, 3, 3) float64: (u, v, a) of its corners, after the texture
    transform.
    """

    texels: NDArray[np.uint8]
    layout: NDArray[np.int64]
    levels: NDArray[np.float64]
    material: NDArray[np.int32]
    corners: NDArray[np.float64]

    @property
    def arrays(self) -> tuple[NDArray[Any], ...]:
        """(texels, layout, levels, material, corners), in the form that the kernels take."""
        return self.texels, self.layout, self.levels, self.material, self.corners


NO_CUTOUTS = AlphaMasks(
    np.zeros(0, np.uint8),
    np.zeros((0, 5), np.int64),
    np.zeros((0, 2), np.float64),
    np.zeros(0, np.int32),
    np.zeros((0, 3, 3), np.float64),
)


def _mesh_cutouts(mesh: Mesh, label_alpha: float | None) -> tuple[AlphaMasks, NDArray[np.int32]]:
    """The mesh's cut-outs and, for each triangle (T,), SURFACE, NEVER or its row of `corners`.

    Without `label_alpha`, a BLEND material is surface wherever it has a colour, plus one texel beyond, which filtering colours.
    """
    rows = np.full(len(mesh.triangles), SURFACE, np.int32)
    alpha_masks = NO_CUTOUTS
    for index, material in enumerate(mesh.materials):
        chosen = np.flatnonzero(mesh.triangle_material == index)
        if len(chosen) == 0 or material.alpha_mode == "OPAQUE" or material.transmission > 0:
            continue
        is_spread = material.alpha_mode == "BLEND" and label_alpha is None
        threshold = material.alpha_cutoff if material.alpha_mode == "MASK" else label_alpha or SEEN
        own = _material_cutouts(mesh, material, chosen, threshold, is_spread)
        alpha = own.corners[:, :, 2]
        lowest, highest = own.texels.min() / 255 * own.levels[0, 0], own.texels.max() / 255 * own.levels[0, 0]
        mixed = (lowest * alpha.min(axis=1) < threshold) & (highest * alpha.max(axis=1) >= threshold)
        rows[chosen[highest * alpha.max(axis=1) < threshold]] = NEVER
        if mixed.any():
            rows[chosen[mixed]] = len(alpha_masks.corners) + np.arange(mixed.sum())
            kept = AlphaMasks(own.texels, own.layout, own.levels, own.material[mixed], own.corners[mixed])
            alpha_masks = _joined([alpha_masks, kept])
    return alpha_masks, rows


def alpha_masks_of(meshes: Sequence[Mesh], label_alpha: float | None) -> list[tuple[AlphaMasks, NDArray[np.int32]]]:
    """`_mesh_cutouts` of each mesh; a mesh shared by several things is processed once."""
    known = {id(mesh): _mesh_cutouts(mesh, label_alpha) for mesh in {id(mesh): mesh for mesh in meshes}.values()}
    return [known[id(mesh)] for mesh in meshes]


def stack_cutouts(parts: Sequence[tuple[AlphaMasks, NDArray[np.int32]]]) -> tuple[AlphaMasks, NDArray[np.int32]]:
    """The cut-outs of all meshes combined, and for each triangle (T,) SURFACE, NEVER or its row of the combined `corners`.

    Repeated cut-outs, such as those of a mesh that several things share, are stored once.
    """
    firsts, distinct, count = dict[int, int](), list[AlphaMasks](), 0
    rows = [np.zeros(0, np.int32)]
    for own, own_rows in parts:
        if id(own) not in firsts:
            firsts[id(own)] = count
            distinct.append(own)
            count += len(own.corners)
        first = np.int32(firsts[id(own)])
        rows.append(np.where(own_rows >= 0, own_rows + first, own_rows) if len(own.corners) and first else own_rows)
    return _joined(distinct), np.concatenate(rows)


def _joined(parts: Sequence[AlphaMasks]) -> AlphaMasks:
    """The cut-outs of all parts, one after another; offsets and numbers count in the whole."""
    texels = np.cumsum([0, *(len(part.texels) for part in parts)]).tolist()
    layouts = np.cumsum([0, *(len(part.layout) for part in parts)]).tolist()
    placed = [part.layout + np.array([first, 0, 0, 0, 0]) for part, first in zip(parts, texels, strict=False)]
    numbered = [part.material + np.int32(first) for part, first in zip(parts, layouts, strict=False)]
    return AlphaMasks(
        np.concatenate([NO_CUTOUTS.texels, *(part.texels for part in parts)]),
        np.concatenate([NO_CUTOUTS.layout, *placed]),
        np.concatenate([NO_CUTOUTS.levels, *(part.levels for part in parts)]),
        np.concatenate([NO_CUTOUTS.material, *numbered]),
        np.concatenate([NO_CUTOUTS.corners, *(part.corners for part in parts)]),
    )


def _material_cutouts(
    mesh: Mesh, material: Material, chosen: NDArray[np.intp], threshold: float, is_spread: bool
) -> AlphaMasks:
    texture = material.base_color_texture
    uv = None if texture is None else (mesh.uv0, mesh.uv1)[texture.texcoord]
    corners = np.zeros((len(chosen), 3, 3))
    used = mesh.triangles[chosen]
    corners[:, :, 2] = 1.0 if mesh.colors is None else mesh.colors[used][:, :, 3]
    texels, wraps = np.full((1, 1), 255, np.uint8), (0, 0)
    if texture is not None and uv is not None:
        corners[:, :, :2] = _transformed(texture.matrix, uv[used].astype(np.float64))
        texels = mesh.images[texture.image].pixels[:, :, 3]
        texels = _spread(texels, texture) if is_spread and not texture.nearest else texels
        wraps = (WRAPS.index(texture.wrap_s), WRAPS.index(texture.wrap_t))
    return AlphaMasks(
        np.ascontiguousarray(texels).reshape(-1),
        np.array([[0, texels.shape[1], texels.shape[0], *wraps]], np.int64),
        np.array([[material.base_color[3], threshold]]),
        np.zeros(len(chosen), np.int32),
        corners,
    )


def _spread(texels: NDArray[np.uint8], texture: Texture) -> NDArray[np.uint8]:
    """The greatest alpha of each texel and its eight neighbours, (H, W), with the texture's wrapping."""
    tall = np.pad(texels, ((1, 1), (0, 0)), _BORDERS[texture.wrap_t])
    most = np.maximum(np.maximum(tall[:-2], tall[1:-1]), tall[2:])
    wide = np.pad(most, ((0, 0), (1, 1)), _BORDERS[texture.wrap_s])
    return np.maximum(np.maximum(wide[:, :-2], wide[:, 1:-1]), wide[:, 2:])


def _transformed(matrix: NDArray[np.float64], uv: NDArray[np.float64]) -> NDArray[np.float64]:
    """`uv` (..., 2) transformed by the matrix (2, 3). The products are written out, because BLAS rounds differently from
    processor to processor.
    """
    u, v = uv[..., 0], uv[..., 1]
    return np.stack([a * u + b * v + c for a, b, c in matrix], axis=-1)
