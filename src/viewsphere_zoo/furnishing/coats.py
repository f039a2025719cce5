"""Woods with grain, cloths and panes of furniture: pictures drawn by code, and the materials that show them (uv in metres)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Image, Material, Mesh, Texture
from viewsphere_zoo.joinery.coats import WOODS, drawn_color
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.paint import Color, linear
from viewsphere_zoo.townscape.textures import Float, noise, painted

Pattern = Literal["plain", "stripes", "check", "dots", "leaves", "zigzag"]
GRAIN = (1.5, 0.75)
"""Size of a picture of wood along and across the grain, metres."""


@dataclass(frozen=True)
class Wood:
    """A wood, or paint on wood. figure: how strongly the grain shows; gloss: share of clear lacquer."""

    color: Color = WOODS["oak"]
    figure: float = 1.0
    gloss: float = 0.25

    def timber(self, image: int, name: str = "wood") -> Timber:
        """The wood's materials, with the grain's picture at this index."""
        wide, high = (1 / metres for metres in GRAIN)

        def sawn(end: str, rotation: float) -> Material:
            # Rotation applies after the scale and before the offset, so a turned picture scales the other axis.
            scale = (wide, high) if rotation == 0 else (high, wide)
            texture = Texture(image, scale=scale, rotation=rotation)
            rough = 0.55 - 0.2 * self.gloss
            white = (1.0, 1.0, 1.0, 1.0)
            return Material(name + end, white, texture, roughness=rough, clearcoat=self.gloss, clearcoat_roughness=0.3)

        return Timber(sawn("", 0.0), sawn("_upright", np.pi / 2))


@dataclass(frozen=True)
class Timber:
    """Materials of one wood: grain along x (across, on fronts and tops), and grain upright or along y."""

    along: Material
    upright: Material


def furnished(pieces: Sequence[Piece], images: Sequence[Image], crease_deg: float = 40.0, whole: Sequence[str] = ()) -> Mesh:
    """The pieces as one Mesh whose uv are metres, seen from the side that a triangle faces most: from above (x, -y), from the
    front (x, -z), from the side (y, -z). Parts named in `whole` take one side only, so that their pattern has no seam.
    """
    mesh = assemble(pieces, crease_deg)
    a, b, c = mesh.vertices.astype(np.float64)[mesh.triangles].transpose(1, 0, 2)
    area = np.abs(np.cross(b - a, c - a))
    facing = area.argmax(axis=1)
    for part in whole:
        if part in mesh.parts:
            own = mesh.triangle_part == mesh.parts.index(part)
            facing[own] = area[own].sum(axis=0).argmax()
    key, index = np.unique(mesh.triangles * 3 + facing[:, None], return_inverse=True)
    vertex, axis = np.divmod(key, 3)
    points = mesh.vertices[vertex]
    uv = np.where((axis == 0)[:, None], points[:, [1, 2]], np.where((axis == 1)[:, None], points[:, [0, 2]], points[:, [0, 1]]))
    return replace(
        mesh,
        vertices=points,
        normals=mesh.normals[vertex],
        triangles=index.reshape(-1, 3).astype(np.int32),
        uv0=uv * np.array((1, -1), np.float32),
        images=tuple(images),
    )


def grain(rng: np.random.Generator, wood: Wood, planks: int = 0, size: int = 512) -> Image:
    """Wood whose grain runs across the picture: late wood, pores, clouds; planks: boards glued side by side, 0 for one."""
    y = np.broadcast_to((np.arange(size) + 0.5)[:, None] / size, (size, size))
    bend = 0.9 * noise(rng, size, 34, 6) + 0.07 * noise(rng, size, 4, 16)
    late = (0.5 + 0.5 * np.cos(2 * np.pi * (11 * y + bend))) ** 2.2
    pores = np.clip(noise(rng, size, 0.7, 22) - 1.0, 0, 1.5)
    clouds, fibres = noise(rng, size, 30, 5), noise(rng, size, 0.9, 40)
    shade = 0.055 * clouds + 0.045 * fibres - 0.17 * late - 0.12 * pores
    if planks:
        shade = _glued(rng, shade, planks)
    warm = np.array([0.25, 0.0, -0.25]) * (0.3 * wood.figure * shade)[..., None]
    return painted("wood", np.asarray(wood.color) * (1 + warm), 1.05 + wood.figure * shade)


def _glued(rng: np.random.Generator, shade: Float, planks: int) -> Float:
    """The shade cut into boards from different places of the log, each with its own tone, with fine joints between them."""
    size = len(shade)
    row = np.arange(size) * planks // size
    column = (np.arange(size) + rng.integers(size, size=planks)[row, None]) % size
    edge = np.diff(row, append=row[-1] + 1) > 0
    cut = shade[np.arange(size)[:, None], column] + 0.06 * rng.standard_normal(planks)[row, None]
    return np.where(edge[:, None], cut - 0.3, cut)


@dataclass(frozen=True)
class Cloth:
    """A woven cloth: its ground, the colour of its pattern, and the width of one repeat, metres."""

    color: Color = (0.42, 0.46, 0.5)
    second: Color = (0.9, 0.88, 0.84)
    pattern: Pattern = "plain"
    repeat: float = 0.3

    def material(self, image: int, name: str = "fabric", roughness: float = 0.95) -> Material:
        """The material that shows the cloth's picture at this index."""
        texture = Texture(image, scale=(1 / self.repeat, 1 / self.repeat))
        return Material(name, (1.0, 1.0, 1.0, 1.0), texture, roughness=roughness)


def weave(rng: np.random.Generator, cloth: Cloth, size: int = 256) -> Image:
    """The picture of the cloth: its pattern, and warp and weft that differ a little."""
    at = (np.arange(size) + 0.5) / size
    x, y = np.meshgrid(at, at)
    share = _PATTERNS[cloth.pattern](x, y)[..., None]
    color = np.asarray(cloth.color) * (1 - share) + np.asarray(cloth.second) * share
    threads = noise(rng, size, 0.6, 9) + noise(rng, size, 0.6, 9).T
    return painted("fabric", color, 1 + 0.04 * threads + 0.02 * noise(rng, size, 14))


def _sharp(value: Float) -> Float:
    """The values clipped to 0..1."""
    return np.minimum(np.maximum(value, 0.0), 1.0)


def _plain(x: Float, _y: Float) -> Float:
    return np.zeros_like(x)


def _stripes(x: Float, _y: Float) -> Float:
    return _sharp(8.0 * np.cos(4 * np.pi * x) - 2)


def _check(x: Float, y: Float) -> Float:
    return 0.5 * _sharp(20.0 * np.cos(2 * np.pi * x)) + 0.5 * _sharp(20.0 * np.cos(2 * np.pi * y))


def _dots(x: Float, y: Float) -> Float:
    first = np.hypot(x - 0.25, y - 0.25)
    return _sharp(40.0 * (0.13 - np.minimum(first, np.hypot(x - 0.75, y - 0.75))))


def _leaves(x: Float, y: Float) -> Float:
    """Leaves in pairs on stems."""
    s = 0.5 - np.abs((2 * x) % 1 - 0.5)
    t = (4 * y + 2 * s) % 1 - 0.5
    leaf = 0.07 * np.sin(np.pi * np.clip(s / 0.45, 0, 1)) * 4 - np.abs(t)
    return _sharp(12.0 * np.maximum(leaf, (0.02 - s) * 2))


def _zigzag(x: Float, y: Float) -> Float:
    return _sharp(12.0 * np.cos(2 * np.pi * (3 * y + 0.6 * np.abs(2 * ((2 * x) % 1) - 1))))


_PATTERNS = {"plain": _plain, "stripes": _stripes, "check": _check, "dots": _dots, "leaves": _leaves, "zigzag": _zigzag}

GLASS = Material("glass", (0.86, 0.93, 0.91, 0.35), roughness=0.03, alpha_mode="BLEND", clearcoat=1.0)
"""A transparent pane."""

BLACK_STEEL = Material("black_steel", linear((0.09, 0.09, 0.095)), metallic=0.3, roughness=0.5)
WHITE_STEEL = Material("white_steel", linear((0.88, 0.88, 0.87)), roughness=0.4, clearcoat=0.3)
PAPER = Material("paper", linear((0.93, 0.9, 0.82)), roughness=0.9)

PAINTS: tuple[Color, ...] = (
    (0.92, 0.91, 0.88),
    (0.9, 0.9, 0.9),
    (0.56, 0.62, 0.55),
    (0.3, 0.38, 0.47),
    (0.14, 0.15, 0.17),
    (0.72, 0.7, 0.66),
    (0.2, 0.31, 0.27),
    (0.78, 0.62, 0.55),
    (0.82, 0.66, 0.25),
)
_BARE = tuple(WOODS[name] for name in ("beech", "oak", "ash", "teak", "cherry", "walnut", "mahogany"))
DYES: tuple[Color, ...] = (
    (0.36, 0.38, 0.41),
    (0.7, 0.65, 0.56),
    (0.17, 0.25, 0.38),
    (0.14, 0.36, 0.33),
    (0.75, 0.55, 0.2),
    (0.62, 0.27, 0.18),
    (0.58, 0.66, 0.6),
    (0.78, 0.55, 0.5),
    (0.45, 0.17, 0.24),
    (0.86, 0.83, 0.77),
    (0.16, 0.16, 0.17),
    (0.42, 0.56, 0.7),
    (0.4, 0.45, 0.27),
    (0.45, 0.37, 0.48),
)
"""Colours of cloths."""


def drawn_wood(rng: np.random.Generator, painted_share: float = 0.25) -> Wood:
    """A random wood, or with this probability a painted one."""
    if rng.random() < painted_share:
        return Wood(drawn_color(PAINTS, rng, 0.01), 0.12, float(rng.uniform(0.1, 0.5)))
    return Wood(drawn_color(_BARE, rng, 0.008), float(rng.uniform(0.8, 1.3)), float(rng.uniform(0.1, 0.45)))


def drawn_cloth(rng: np.random.Generator, patterned: float = 0.25) -> Cloth:
    """A random cloth, with this probability of two colours."""
    pattern: Pattern = "plain"
    if rng.random() < patterned:
        pattern = ("stripes", "check", "dots", "leaves", "zigzag")[int(rng.integers(5))]
    color, second = drawn_color(DYES, rng), drawn_color(DYES, rng)
    if abs(sum(color) - sum(second)) < 0.6:
        second = (0.92, 0.9, 0.86) if sum(color) < 1.7 else (0.2, 0.24, 0.3)
    return Cloth(color, second, pattern, float(rng.uniform(0.2, 0.45)))
