"""Tileable pictures of building materials, drawn by numpy: (N, N, 4) uint8 sRGB, row 0 on top, opaque.

Every function takes the generator for its grain and returns one tile; `textured` sets a tile's size in metres.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from viewsphere.assets.mesh import Image, Material, Texture
from viewsphere_zoo.shapes.paint import Color

Float = NDArray[np.float64]


def textured(name: str, image: int, metres: float, roughness: float = 0.9, tint: float = 1.0) -> Material:
    """A material that repeats one image every `metres`, given uv in metres."""
    texture = Texture(image, scale=(1 / metres, 1 / metres))
    return Material(name, (tint, tint, tint, 1.0), base_color_texture=texture, roughness=roughness)


def noise(rng: np.random.Generator, size: int, grain: float, stretch: float = 1.0) -> Float:
    """Tileable noise (size, size), mean 0, deviation 1; grain: radius of blobs, pixels; stretch: how many times longer the
    blobs are across.
    """
    f = np.fft.fftfreq(size)
    u, v = f[: size // 2 + 1] * stretch, f[:, None]
    u = np.abs(u)
    low = np.exp(-2 * (np.pi * grain) ** 2 * (u * u + v * v))
    field = np.fft.irfft2(np.fft.rfft2(rng.standard_normal((size, size))) * low, s=(size, size))
    field -= field.mean()
    return field / field.std()


def painted(name: str, color: ArrayLike, shade: ArrayLike) -> Image:
    """sRGB colour ((3,) or (N, N, 3)) times a shade (N, N)."""
    rgb = np.asarray(color, np.float64) * np.asarray(shade)[..., None]
    pixels = np.full((*rgb.shape[:2], 4), 255, np.uint8)
    pixels[..., :3] = np.clip(rgb * 255 + 0.5, 0, 255).astype(np.uint8)
    return Image(name, pixels)


def asphalt(rng: np.random.Generator, color: Color, size: int = 512) -> Image:
    """Grey with light and dark grit."""
    grit, soft = noise(rng, size, 0.8), noise(rng, size, 12)
    shade = 1 + 0.05 * soft + 0.07 * grit + 0.16 * np.clip(grit - 1.6, 0, 1.2) - 0.1 * np.clip(-grit - 1.7, 0, 1)
    return painted("asphalt", color, shade)


def plaster(rng: np.random.Generator, name: str, color: Color, depth: float = 0.05, size: int = 256) -> Image:
    """One colour with fine grain and faint clouds."""
    shade = 1 - depth + depth * (0.5 * noise(rng, size, 1.0) + 0.2 * noise(rng, size, 18))
    return painted(name, color, shade)


def grass(rng: np.random.Generator, color: Color, size: int = 512) -> Image:
    """Short grass: fine blades, tufts, a few dry stalks."""
    blades, tufts, patches = noise(rng, size, 1.0), noise(rng, size, 4.0), noise(rng, size, 30.0)
    shade = 0.97 + 0.15 * blades + 0.08 * tufts + 0.03 * patches
    dry = np.clip(0.1 * tufts + 0.12 * noise(rng, size, 1.5) + 0.05 * patches, -0.25, 0.4)[..., None]
    tone = np.asarray(color) * (1 - dry) + np.array([0.56, 0.54, 0.3]) * dry
    return painted("grass", tone, np.clip(shade, 0.35, 1.6))


def _cells(size: int, columns: int, rows: int, shift: float) -> tuple[Float, Float, NDArray[np.int64]]:
    """Place inside the cell, 0..1 across and down (size, size), and each pixel's cell; odd rows shift by this share."""
    at = (np.arange(size) + 0.5) / size
    y = np.broadcast_to(at[:, None] * rows, (size, size))
    row = np.floor(y).astype(np.int64)
    x = np.broadcast_to(at * columns, (size, size)) + shift * (row % 2)
    column = np.floor(x).astype(np.int64)
    return x - column, y - row, row * columns + column % columns


def bricks(
    rng: np.random.Generator,
    name: str,
    color: Color,
    mortar: Color,
    grid: tuple[int, int] = (8, 24),
    joint: tuple[float, float] = (0.022, 0.07),
    spread: float = 0.1,
    shift: float = 0.5,
    size: int = 512,
) -> Image:
    """Bricks or slabs, `grid` columns and rows of them; joint: half its width as shares of a cell; spread of their tones."""
    x, y, cell = _cells(size, *grid, shift)
    edge = np.minimum(np.minimum(x, 1 - x) / joint[0], np.minimum(y, 1 - y) / joint[1])
    count = grid[0] * grid[1]
    tone = np.asarray(color) * (1 + spread * rng.standard_normal((count, 1)) + 0.25 * spread * rng.standard_normal((count, 3)))
    filled = np.clip(edge - 0.6, 0, 1)[..., None]
    shade = 1 + 0.05 * noise(rng, size, 1.0) + 0.035 * noise(rng, size, 10)
    return painted(name, tone[cell] * filled + np.asarray(mortar) * (1 - filled), shade)


def roof_tiles(
    rng: np.random.Generator, color: Color, grid: tuple[int, int] = (8, 6), wave: float = 0.35, size: int = 512
) -> Image:
    """Overlapping tiles: each course throws a shadow on the one below; wave: 0 flat slates to 0.5 deep pantiles."""
    x, y, cell = _cells(size, *grid, 0.0 if wave > 0.2 else 0.5)
    count = grid[0] * grid[1]
    tone = 1 + 0.08 * rng.standard_normal(count)
    profile = 1 + wave * (np.sin(2 * np.pi * x) - 0.35 * np.abs(np.sin(np.pi * x)))
    lip = 1 - 0.55 * np.exp(-(((1 - y) / 0.07) ** 2)) - 0.3 * np.exp(-y / 0.09)
    gap = 1 - (0.5 - 0.3 * (wave > 0.2)) * np.exp(-((np.minimum(x, 1 - x) / 0.03) ** 2))
    grain = 1 + 0.06 * noise(rng, size, 1.2) + 0.04 * noise(rng, size, 14)
    return painted("roof_tiles", color, tone[cell] * profile * lip * gap * grain)


def boards(rng: np.random.Generator, name: str, color: Color, count: int = 8, size: int = 256) -> Image:
    """Horizontal boards, each with a shadow under its lower edge and grain along it."""
    y = np.broadcast_to((np.arange(size) + 0.5)[:, None] / size * count, (size, size))
    row = np.floor(y).astype(np.int64)
    tone = (1 + 0.025 * rng.standard_normal(count))[row]
    lip = 1 - 0.5 * np.exp(-(((1 - (y - row)) / 0.06) ** 2)) - 0.12 * np.exp(-(y - row) / 0.12)
    return painted(name, color, tone * lip * (1 + 0.03 * noise(rng, size, 1.0, 12.0)))


def leafage(rng: np.random.Generator, color: Color, count: int = 1700, size: int = 256) -> Image:
    """A wall of small leaves, later ones over earlier ones and lighter."""
    shade = np.full((size, size), 0.35)
    reach = np.arange(-8, 9)
    dx, dy = np.meshgrid(reach, reach)
    for k in range(count):
        x, y = rng.integers(size, size=2)
        c, s = (float(f(a)) for a in [rng.uniform(0, 2 * np.pi)] for f in (np.cos, np.sin))
        along, across = (c * dx + s * dy) / 7.0, (c * dy - s * dx) / 3.6
        r = along * along + across * across
        light = (0.62 + 0.7 * k / count) * float(rng.uniform(0.8, 1.15))
        rows, columns = (y + dy) % size, (x + dx) % size
        leaf = light * (1 - 0.3 * r + 0.12 * np.sign(across) - 0.2 * np.exp(-((across / 0.12) ** 2)))
        shade[rows, columns] = np.where(r < 1, leaf, shade[rows, columns])
    tone = np.asarray(color) * (1 + 0.06 * noise(rng, size, 6)[..., None] * np.array([1.0, 0.4, -0.5]))
    return painted("leafage", tone, np.clip(shade, 0.2, 1.7))
