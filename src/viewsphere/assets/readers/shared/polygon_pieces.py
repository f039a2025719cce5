"""Polygons with colours and texture coordinates of vertices, corners or faces, as pieces of triangles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from viewsphere.assets.mesh import Material
from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.primitive import Float, Int, Primitive, compact
from viewsphere.assets.readers.shared.coordinates import check_coordinates
from viewsphere.assets.readers.shared.polygon_proof import cut_polygons
from viewsphere.assets.readers.shared.smoothing import creased
from viewsphere.codecs.srgb import linear

BYTE = 255.0
BEYOND_ONE = 2.0
"""Float colours with a value above this are in the range 0 to 255, which some programs use, instead of 0 to 1. Renders of
bright light slightly exceed 1.
"""


@dataclass(frozen=True, eq=False)
class Polygons:
    """Polygons one after another: `corners` (C,) are indices of vertices, `counts` (N,) their number per polygon.

    Arrays per vertex: `positions`, `normals`, `colors` (linear, with alpha), `uv` (v downwards). `corner_uv` (C, 2) and
    `face_colors` (N, 4) replace `uv` and `colors`. `material` (N,) is per polygon.
    """

    positions: Float
    corners: Int
    counts: Int
    material: Int
    normals: Float | None = None
    colors: Float | None = None
    uv: Float | None = None
    corner_uv: Float | None = None
    face_colors: Float | None = None


def pieces_of(folder: ModelFolder, polygons: Polygons) -> list[Primitive]:
    """A piece for each material, all of one part; normals are smooth up to a crease if the polygons have none."""
    polygons = _whole(folder, polygons)
    if not len(polygons.counts):
        return []
    folder.check("MAX_TRIANGLES", int((polygons.counts - 2).sum()), "triangles")
    cut, owner = cut_polygons(folder, polygons.positions, polygons.corners, polygons.counts)
    whole = _piece(polygons, cut)
    if whole.normals is None:
        whole = creased(whole)
    material = polygons.material[owner]
    used = np.unique(material).tolist()
    if len(used) == 1:
        return [replace(whole, material=used[0])]
    return [compact(replace(whole, material=m, triangles=whole.triangles[material == m])) for m in used]


def with_alpha(
    folder: ModelFolder, pieces: Sequence[Primitive], materials: Sequence[Material]
) -> tuple[list[Primitive], list[Material]]:
    """The pieces, and materials that blend if colours are transparent; completely transparent colours count as opaque."""
    alphas = [piece.colors[:, 3] for piece in pieces if piece.colors is not None and len(piece.colors)]
    if alphas and max(float(alpha.max()) for alpha in alphas) == 0.0:
        folder.warn("all its colours have alpha 0; they are taken as opaque")
        return [_opaque(piece) for piece in pieces], list(materials)
    clear = {piece.material for piece in pieces if piece.colors is not None and (piece.colors[:, 3] < 1.0).any()}
    return list(pieces), [replace(m, alpha_mode="BLEND") if i in clear else m for i, m in enumerate(materials)]


def _opaque(piece: Primitive) -> Primitive:
    return (
        piece
        if piece.colors is None
        else replace(piece, colors=np.column_stack([piece.colors[:, :3], np.ones(len(piece.colors))]))
    )


def _piece(polygons: Polygons, cut: Int) -> Primitive:
    """The triangles as one piece; with values per corner or face, every corner becomes a separate vertex."""
    is_split = polygons.corner_uv is not None or polygons.face_colors is not None
    at = polygons.corners if is_split else slice(None)

    def selected(values: Float | None) -> Float | None:
        return None if values is None else values[at]

    faces = polygons.face_colors
    return Primitive(
        part="object",
        material=0,
        positions=polygons.positions[at],
        triangles=cut if is_split else polygons.corners[cut],
        normals=selected(polygons.normals),
        uv0=selected(polygons.uv) if polygons.corner_uv is None else polygons.corner_uv,
        colors=selected(polygons.colors) if faces is None else np.repeat(faces, polygons.counts, axis=0),
    )


def _whole(folder: ModelFolder, polygons: Polygons) -> Polygons:
    """The polygons of at least three corners, after a check of their indices."""
    corners, total = polygons.corners, len(polygons.positions)
    if corners.size and (corners.min() < 0 or corners.max() >= total):
        wrong = corners.min() if corners.min() < 0 else corners.max()
        raise folder.error(f"a face names vertex {wrong}, expected 0 to {total - 1}; the file may be truncated")
    check_coordinates(folder, polygons.positions, corners)
    kept = polygons.counts >= 3
    if kept.all():
        return polygons
    folder.warn(f"{np.count_nonzero(~kept):,} faces of fewer than three corners left out")
    of_corners = np.repeat(kept, polygons.counts)
    uv, faces = polygons.corner_uv, polygons.face_colors
    return replace(
        polygons,
        corners=corners[of_corners],
        counts=polygons.counts[kept],
        material=polygons.material[kept],
        corner_uv=None if uv is None else uv[of_corners],
        face_colors=None if faces is None else faces[kept],
    )


def linear_colors(channels: Sequence[Float], brightest: float) -> Float:
    """Linear colours (N, 4) from sRGB channels, three, or four with alpha, in which `brightest` represents 1."""
    unit = [np.clip(np.nan_to_num(channel / brightest), 0.0, 1.0) for channel in channels]
    return np.column_stack([*(linear(channel) for channel in unit[:3]), unit[3] if len(unit) > 3 else np.ones(len(unit[0]))])


def brightest_of(channels: Sequence[Float], depth: float | None) -> float:
    """The value of full colour: `depth`, the greatest value of its type, or 255 if no value exceeds a byte.

    `depth` is None for floating-point types.
    """
    most = max((float(np.nanmax(channel, initial=0.0)) for channel in channels), default=0.0)
    if depth is None:
        return BYTE if most > BEYOND_ONE else 1.0
    return BYTE if most <= BYTE else depth


def upright(uv: Float) -> Float:
    """Texture coordinates with v downwards, as in glTF, from coordinates with v upwards."""
    return np.column_stack([uv[:, 0], 1.0 - uv[:, 1]])
