"""Detection of the alpha mode of base-colour textures whose file format cannot state it."""

from __future__ import annotations

from collections.abc import Container, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.appearance.shown import shown_texels
from viewsphere.assets.mesh import Image, Material
from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.primitive import Primitive

SOLID = 250
"""Texels with at least this alpha count as opaque."""

SLIGHT_SHARE = 0.001
"""Greatest share of non-solid visible texels in an opaque material: specks do not make a shape."""

BINARY_SHARE = 0.02
"""Greatest share of visible texels that are neither clear nor solid in a cut-out material (MASK)."""


CUT_OUT_SHARE = 0.25
"""Share of texels between clear and solid above which undeclared alpha is treated as gloss or height, not opacity. Soft edges
of discs reach a fifth in tests; no real textures were measured.
"""


def with_alpha_modes(
    folder: ModelFolder, pieces: Sequence[Primitive], materials: Sequence[Material], stated: Container[int] = ()
) -> list[Material]:
    """The materials; opaque ones get the alpha mode that fits the texels visible on their triangles.

    Texels between the islands of an atlas are not visible and do not count. Texels on the rim of an island do not count either,
    unless all texels are there, since the edges of island and picture rarely match to the texel. A completely clear texture
    counts as opaque, as it is an exporter's mistake. `stated` are the indices of materials for which the file states that alpha
    is opacity. For the others, only alpha that is mostly clear or solid (a cut-out) counts as opacity, and a warning reports
    the choice.
    """
    return [
        material if material.alpha_mode != "OPAQUE" else _with_mode(folder, index, material, pieces, stated=index in stated)
        for index, material in enumerate(materials)
    ]


def _with_mode(folder: ModelFolder, index: int, material: Material, pieces: Sequence[Primitive], *, stated: bool) -> Material:
    shown = _shown_alpha(index, material, pieces, folder.images)
    if shown is None or np.count_nonzero(shown < SOLID) <= SLIGHT_SHARE * shown.size:
        return material
    between = np.count_nonzero((shown > 8) & (shown < 247)) / shown.size
    if stated:
        return replace(material, alpha_mode="MASK" if between <= BINARY_SHARE else "BLEND")
    clear = np.count_nonzero(shown <= 8) / shown.size
    is_cut_out = between <= CUT_OUT_SHARE and clear >= between
    texture = material.base_color_texture
    name = "" if texture is None else folder.images[texture.image].name
    chosen = "mostly clear or solid, so it cuts holes" if is_cut_out else "no cut-out, so it is ignored"
    folder.warn(f"the file does not state that the alpha of texture {name!r} is opacity; it is {chosen}")
    return replace(material, alpha_mode="MASK") if is_cut_out else material


def _shown_alpha(
    index: int, material: Material, pieces: Sequence[Primitive], images: Sequence[Image]
) -> NDArray[np.uint8] | None:
    """Alpha of the texels that triangles of a material show; None if all are solid or all are clear."""
    texture = material.base_color_texture
    if texture is None:
        return None
    alpha = images[texture.image].pixels[..., 3]
    uv = [piece.uv0[piece.triangles] for piece in pieces if piece.material == index and piece.uv0 is not None]
    if alpha.min() >= SOLID or alpha.max() == 0 or not uv:
        return None
    return alpha[_without_rim(shown_texels(texture, np.concatenate(uv), alpha.shape))]


def _without_rim(texels: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The texels whose four neighbours are also in the set; all texels if no such texel exists."""
    inner = texels.copy()
    for axis in (0, 1):
        inner &= np.roll(texels, 1, axis) & np.roll(texels, -1, axis)
    return inner if inner.any() else texels
