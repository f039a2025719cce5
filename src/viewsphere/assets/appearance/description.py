"""The appearance of a mesh: its surface as patches of one basic colour and one material, and the words for the whole."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.appearance.color_names import NAMES, nearest_names
from viewsphere.assets.appearance.pbr import color_of, is_replaceable
from viewsphere.assets.mesh import Material, Mesh, Texture
from viewsphere.assets.primitive import face_normals
from viewsphere.codecs.srgb import linear
from viewsphere.materials import word
from viewsphere.model.annotations.appearance import Appearance, Patch
from viewsphere.model.thing import Repaint

Float = NDArray[np.float64]

POINTS = 20_000
"""Number of sample points on a model, spread evenly by area."""

CELLS = 32
"""Number of cells along a model's diagonal for visibility. Within a cell, points at most about a cell behind the nearest one
are visible.
"""

MOST = 0.55
"""Share of a surface above which a word that applies to this part applies to the whole surface."""

GLASS = 0.5
"""Transmitted share of light from which a patch is glass, without a colour word."""

METAL = 0.5
"""`metallic` from which a patch is metal."""

GLOSSY = 0.3
"""Roughness of a patch, or of its clear coat, up to which the patch is glossy."""

MATTE = 0.7
"""Roughness from which a patch is matte."""

COATED = 0.5
"""Strength of a clear coat from which it makes a patch glossy."""

INVISIBLE = 0.01
"""Alpha below which a texel of a blended material does not count as surface."""

DIGITS = 4
"""Decimal digits of the numbers of patches."""

ROUNDING = 2e-4
"""Greatest difference between numbers of patches that are equal except for rounding."""

MATERIALS = ("glass", "metal", "glossy", "matte")
"""Words for materials."""

PLASTIC = 1.32471795724474602596
"""The plastic number, root of x^3 = x + 1: its powers give evenly spread points in the plane (R2 sequence, M. Roberts,
2018).
"""


def appearance_of(mesh: Mesh, color: str | None = None, material: str | None = None) -> Appearance:
    """Return the appearance of a mesh, seen from all sides and above.

    `color` and `material` are words from its spec or sidecar.
    """
    normals = face_normals(mesh.vertices.astype(np.float64), mesh.triangles)
    areas = np.sqrt((normals**2).sum(axis=1)) / 2
    if not areas.any():
        return Appearance(color=color, material=material)
    triangle, barycentrics = _spread(areas)
    corners = mesh.triangles[triangle]
    weights = _seen(_at(mesh.vertices, corners, barycentrics), normals[triangle] / areas[triangle, None] / 2)
    weights /= weights.sum() or 1.0
    found, materials = list[Patch](), mesh.triangle_material[triangle]
    for number in np.unique(materials).tolist():
        at = materials == number
        found += _patches(mesh.materials[number], _spots(mesh, number, corners[at], barycentrics[at]), weights[at])
    shown = sum(patch.share for patch in found) or 1.0
    rounded = (patch.model_copy(update={"share": min(round(patch.share / shown, DIGITS), 1.0)}) for patch in found)
    return Appearance(patches=tuple(patch for patch in rounded if patch.share), color=color, material=material)


def _spread(areas: Float) -> tuple[NDArray[np.int64], Float]:
    """Sample points with uniform density by area: triangles (N,) and barycentrics (N, 3) from Roberts' sequence R2."""
    number, ends = np.arange(POINTS) + 0.5, np.cumsum(areas)
    triangle = np.searchsorted(ends, number * (ends[-1] / POINTS)).clip(max=len(areas) - 1)
    u, v = number / PLASTIC % 1, number / PLASTIC**2 % 1
    folded = u + v > 1
    u, v = np.where(folded, 1 - u, u), np.where(folded, 1 - v, v)
    return triangle, np.stack([1 - u - v, u, v], axis=1)


def _seen(places: Float, normals: Float) -> Float:
    """Return the visible amount of the surface around each point (N,) from `DIRECTIONS` together, if it faces any of them."""
    step = float(np.sqrt((np.ptp(places, axis=0) ** 2).sum())) / CELLS or 1.0
    weights = np.zeros(len(places))
    for right, up, back in DIRECTIONS:
        columns, rows = (np.floor(_along(places, axis) / step).astype(np.int64) for axis in (right, up))
        cell = (columns - columns.min()) * (np.ptp(rows) + 1) + rows - rows.min()
        depth, nearest = _along(places, back), np.full(int(cell.max()) + 1, -np.inf)
        np.maximum.at(nearest, cell, depth)
        weights += np.where(depth >= nearest[cell] - step, np.abs(_along(normals, back)), 0.0)
    return weights


def _along(places: Float, axis: tuple[float, float, float]) -> Float:
    return places[:, 0] * axis[0] + places[:, 1] * axis[1] + places[:, 2] * axis[2]


Axes = tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]


def _directions() -> Iterator[Axes]:
    """Views from eight sides, both level and from half-way up, and one from above; each as right, up, and back to the
    viewer.
    """
    yield (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
    half = 0.5**0.5
    for x, y in ((1, 0), (half, half), (0, 1), (-half, half), (-1, 0), (-half, -half), (0, -1), (half, -half)):
        yield (-y, x, 0.0), (0.0, 0.0, 1.0), (x, y, 0.0)
        yield (-y, x, 0.0), (-x * half, -y * half, half), (x * half, y * half, half)


DIRECTIONS = tuple(_directions())
"""The directions from which a model is viewed."""


def is_alike(one: Appearance, other: Appearance) -> bool:
    """Return whether two models look the same except for rounding; words from specs or sidecars do not count."""
    if [patch.material for patch in one.patches] != [patch.material for patch in other.patches]:
        return False
    pairs = zip(map(_numbers, one.patches), map(_numbers, other.patches), strict=True)
    return all(abs(a - b) <= ROUNDING for both in pairs for a, b in zip(*both, strict=True))


def _numbers(patch: Patch) -> tuple[float, ...]:
    return patch.share, *patch.color, patch.metallic, patch.roughness, patch.clear, float(patch.coated)


@dataclass(frozen=True)
class _Spots:
    """Points of one material: linear colour (N, 3), metallic, roughness, transmitted share of light (N,), and which points
    count.
    """

    color: Float
    metallic: Float
    roughness: Float
    clear: Float
    is_surface: NDArray[np.bool_]


def _patches(m: Material, spots: _Spots, weights: Float) -> Iterator[Patch]:
    """The patches of one material, from its points; shares are sums of point weights."""
    coated = m.clearcoat >= COATED and m.clearcoat_roughness <= GLOSSY
    first = nearest_names(spots.color[:1])
    names = np.repeat(first, len(weights)) if _is_plain(spots) else nearest_names(spots.color)
    kinds = _kinds(spots, coated)
    for name in range(len(NAMES)):
        for kind in range(len(MATERIALS) + 1):
            at = np.flatnonzero((names == name) & (kinds == kind) & spots.is_surface & (weights > 0))
            if len(at):
                means = (float(values[at].mean()) for values in (*spots.color.T, spots.metallic, spots.roughness, spots.clear))
                r, g, b, metallic, roughness, clear = (round(value, DIGITS) for value in means)
                yield Patch(
                    material=m.name,
                    share=min(float(weights[at].sum()), 1.0),
                    color=(r, g, b),
                    metallic=metallic,
                    roughness=roughness,
                    clear=clear,
                    coated=coated,
                    stays=None if is_replaceable(m) else True,
                )


def _is_plain(spots: _Spots) -> bool:
    """Return whether all points have one colour, so that its name is needed only once."""
    return bool((spots.color == spots.color[0]).all())


def _spots(mesh: Mesh, number: int, corners: NDArray[np.int32], weights: Float) -> _Spots:
    """A material at points of triangles with these corners (N, 3), by their barycentrics."""
    m = mesh.materials[number]
    base = np.broadcast_to(np.array(m.base_color, np.float64), (len(corners), 4)).copy()
    if mesh.colors is not None:
        base *= _at(mesh.colors, corners, weights)
    texels = _texels(mesh, m.base_color_texture, corners, weights)
    base[:, :3] *= linear(texels[:, :3])
    alpha = base[:, 3] * texels[:, 3]
    rough = _texels(mesh, m.metallic_roughness_texture, corners, weights)
    clear = m.transmission * _texels(mesh, m.transmission_texture, corners, weights)[:, 0]
    if m.alpha_mode == "BLEND":
        clear = np.maximum(clear, 1 - alpha)
    least = {"OPAQUE": -np.inf, "MASK": m.alpha_cutoff, "BLEND": INVISIBLE}[m.alpha_mode]
    return _Spots(
        color=np.clip(base[:, :3], 0.0, 1.0),
        metallic=np.clip(m.metallic * rough[:, 2], 0.0, 1.0),
        roughness=np.clip(m.roughness * rough[:, 1], 0.0, 1.0),
        clear=np.clip(clear, 0.0, 1.0),
        is_surface=(alpha >= least) | (m.transmission > 0),
    )


def _at(values: NDArray[np.float32], corners: NDArray[np.int32], weights: Float) -> Float:
    """Values of vertices at points, (N, components)."""
    a, b, c = (values[corners[:, i]].astype(np.float64) for i in range(3))
    return weights[:, :1] * a + weights[:, 1:2] * b + weights[:, 2:] * c


def _texels(mesh: Mesh, texture: Texture | None, corners: NDArray[np.int32], weights: Float) -> Float:
    """The nearest texels at points, (N, 4), 0 to 1; 1 without a texture or coordinates for it."""
    uv = None if texture is None else (mesh.uv0, mesh.uv1)[texture.texcoord]
    if texture is None or uv is None:
        return np.ones((len(corners), 4))
    places, turn = np.nan_to_num(_at(uv, corners, weights)), texture.matrix
    pixels = mesh.images[texture.image].pixels
    u = turn[0, 0] * places[:, 0] + turn[0, 1] * places[:, 1] + turn[0, 2]
    v = turn[1, 0] * places[:, 0] + turn[1, 1] * places[:, 1] + turn[1, 2]
    rows, columns = _index(v, texture.wrap_t, pixels.shape[0]), _index(u, texture.wrap_s, pixels.shape[1])
    return pixels[rows, columns] / 255.0


def _index(place: Float, wrap: str, size: int) -> NDArray[np.int64]:
    if wrap == "mirror":
        place = 1 - np.abs(place % 2 - 1)
    elif wrap == "repeat":
        place = place % 1
    return np.floor(np.clip(place, 0.0, 1.0) * size).clip(0, size - 1).astype(np.int64)


def _kinds(spots: _Spots, coated: NDArray[np.bool_] | bool) -> NDArray[np.int64]:
    """For each point, the index of its word in `MATERIALS`, or `len(MATERIALS)` for no word."""
    holds = [
        spots.clear >= GLASS,
        spots.metallic >= METAL,
        coated | (spots.roughness <= GLOSSY),
        spots.roughness >= MATTE,
    ]
    return np.select(holds, range(len(MATERIALS)), len(MATERIALS))


def words(looks: Appearance, repaints: Sequence[Repaint] = ()) -> tuple[str | None, str | None]:
    """The words for the colour and the material of most of a surface with these repaints; None if no word applies to most of
    it.

    Words from the spec or sidecar take precedence unless repainted. A patch with a new picture has no known colour. Glass and
    other patches that transmit half of the light have none either, and their area does not count for the colour. An opaque
    patch that becomes a substance has the substance's word and most frequent colour.
    """
    colors, materials = dict[str | None, float](), dict[str | None, float]()
    found = [next((r for r in reversed(repaints) if fnmatchcase(p.material, r.material)), None) for p in looks.patches]
    now = [patch if own is None else _repainted(patch, own) for patch, own in zip(looks.patches, found, strict=True)]
    names = nearest_names([patch.color for patch in now]).tolist() if now else ()
    for patch, own, kind, name in zip(now, found, _materials_of(now), names, strict=True):
        substance = None if own is None or patch.stays else own.texture
        made = word(substance.name) if substance else kind
        materials[made] = materials.get(made, 0.0) + patch.share
        if kind != "glass":
            color = None if own is not None and own.image is not None else NAMES[name]
            color = color_of(substance, own and own.tint) if substance else color
            colors[color] = colors.get(color, 0.0) + patch.share
    said = (None, None) if any(found) else (looks.color, looks.material)
    return said[0] or _most(colors), said[1] or _most(materials)


def _repainted(patch: Patch, repaint: Repaint) -> Patch:
    tint = repaint.tint or (1.0, 1.0, 1.0)
    red, green, blue = (min(own * factor, 1.0) for own, factor in zip(patch.color, tint, strict=True))
    return patch.model_copy(
        update={
            "color": (red, green, blue),
            "metallic": patch.metallic if repaint.metallic is None else repaint.metallic,
            "roughness": patch.roughness if repaint.roughness is None else repaint.roughness,
        }
    )


def _materials_of(patches: Sequence[Patch]) -> list[str | None]:
    """The words for patches' materials."""
    values = np.array([(p.metallic, p.roughness, p.clear) for p in patches]).reshape(-1, 3)
    spots = _Spots(np.zeros((len(patches), 3)), *values.T, is_surface=np.ones(len(patches), np.bool_))
    named = (*MATERIALS, None)
    return [named[number] for number in _kinds(spots, np.array([p.coated for p in patches], np.bool_)).tolist()]


def _most(shares: dict[str | None, float]) -> str | None:
    """The word that applies to more than `MOST` of the total share, or None."""
    name = max(shares, key=lambda one: shares[one], default=None)
    return name if name is not None and shares[name] > MOST * sum(shares.values()) else None
