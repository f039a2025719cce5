"""Pictures of the tests' own, made by numpy: textures that repeat, a sky with a sun, something like a photograph."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np


def checkerboard(size: int = 256, cells: int = 8, light: int = 220, dark: int = 40) -> np.ndarray:
    """(size, size, 3) uint8; the cell in the upper left corner is light."""
    cell = np.arange(size) * cells // size
    odd = (cell[:, None] + cell) % 2
    return np.repeat(np.where(odd, dark, light).astype(np.uint8)[..., None], 3, axis=2)


@dataclass(frozen=True)
class TextureSet:
    """color (H, W, 3) sRGB, normal (H, W, 3) as glTF has it (red right, green up), roughness (H, W): all uint8, seamless."""

    color: np.ndarray
    normal: np.ndarray
    roughness: np.ndarray

    def save(self, folder: Path) -> dict[str, str]:
        """Write three PNG files; gives the fields of `Ground` that name them."""
        return {
            "image": str(write(folder / "color.png", self.color)),
            "normal_image": str(write(folder / "normal.png", self.normal)),
            "roughness_image": str(write(folder / "roughness.png", self.roughness)),
        }


def bricks(size: int = 512, courses: int = 8, seed: int = 1) -> TextureSet:
    """Paving bricks in running bond with bevelled edges: two courses high as one brick is long."""
    rng = np.random.default_rng(seed)
    y, x = (np.mgrid[:size, :size] + 0.5) / size * courses
    row = np.floor(y).astype(int)
    along = x / 2 + 0.5 * (row % 2)
    column = np.floor(along).astype(int) % (courses // 2)
    to_edge = np.minimum(np.minimum(y - row, row + 1 - y), 2 * np.minimum(along % 1, 1 - along % 1))
    rise = np.clip((to_edge - 0.045) / 0.1, 0, 1)
    is_brick = to_edge > 0.06
    shade = rng.normal(1, 0.13, (courses, courses // 2))[row, column]
    warmth = rng.normal(0, 0.03, (courses, courses // 2))[row, column]
    grain = noise(size, 8, rng)
    tone = shade * (1 + 0.22 * grain)
    brick = np.stack([tone * (0.55 + warmth), tone * 0.33, tone * (0.26 - warmth)], axis=-1)
    mortar = np.repeat((0.52 * (1 + 0.18 * grain))[..., None], 3, axis=-1)
    color = np.where(is_brick[..., None], brick, mortar)
    tilt = rng.normal(0, 0.15, (2, courses, courses // 2))[:, row, column]
    height = rise * rise * (3 - 2 * rise) * (1 + tilt[0] * (y - row - 0.5) + tilt[1] * (along % 1 - 0.5)) + 0.08 * grain
    roughness = np.where(is_brick, 0.72 + 0.12 * grain, 0.95)
    return TextureSet(_bytes(color), normals_of(height, 0.012 * size / courses * 8), _bytes(roughness))


def normals_of(height: np.ndarray, strength: float) -> np.ndarray:
    """The normal map (H, W, 3) uint8 of a height map that repeats; `strength`: texels that height 1 stands for."""
    right = strength * (np.roll(height, -1, 1) - np.roll(height, 1, 1)) / 2
    up = strength * (np.roll(height, 1, 0) - np.roll(height, -1, 0)) / 2
    normal = np.stack([-right, -up, np.ones_like(height)], axis=-1)
    return _bytes(normal / np.linalg.norm(normal, axis=-1, keepdims=True) / 2 + 0.5)


def noise(size: int, cells: int, rng: np.random.Generator) -> np.ndarray:
    """(size, size) within about -1..1, seamless; six octaves from `cells` a side, each weaker than the one before."""
    total, weight = np.zeros((size, size)), 0.0
    for octave in range(6):
        count = cells << octave
        grid, at = rng.uniform(-1, 1, (count, count)), (np.arange(size) + 0.5) / size * count
        first, share = np.floor(at).astype(int), at % 1
        share = share * share * (3 - 2 * share)
        rows = grid[first % count] * (1 - share[:, None]) + grid[(first + 1) % count] * share[:, None]
        total += 0.7**octave * (rows[:, first % count] * (1 - share) + rows[:, (first + 1) % count] * share)
        weight += 0.7**octave
    return total / weight * 1.6


def sunny(height: int = 64, sun: tuple[float, float] = (40.0, 50.0), strength: float = 3.0) -> np.ndarray:
    """A whole sphere, (height, 2 height, 3) float32, linear: blue above, brown below, one texel is the sun.

    The middle of a row looks along +X, a quarter to its left along +Y, as Blender has it; the top is up. `sun` is azimuth and
    elevation in degrees, as for cameras; `strength` the sun's irradiance on what faces it.
    """
    elevation = math.pi * (0.5 - (np.arange(height) + 0.5) / height)
    up = np.clip(np.sin(elevation), 0, 1)[:, None]
    sky = (1 - up) * np.array([0.75, 0.85, 0.95]) + up * np.array([0.18, 0.38, 0.9])
    rows = np.where(elevation[:, None] > 0, sky, np.array([0.16, 0.13, 0.1]))
    picture = np.repeat(rows[:, None], 2 * height, axis=1).astype(np.float32)
    azimuth, above = (math.radians(angle) for angle in sun)
    x, y = math.sin(azimuth), -math.cos(azimuth)
    row = min(int((0.5 - above / math.pi) * height), height - 1)
    column = int((0.5 - math.atan2(y, x) / math.tau) * 2 * height) % (2 * height)
    edges = elevation[row] + math.pi / height * np.array([0.5, -0.5])
    texel = math.pi / height * float(np.sin(edges[0]) - np.sin(edges[1]))  # solid angle
    picture[row, column] += strength * np.array([1.0, 0.96, 0.9]) / texel
    return picture


def photograph(width: int = 640, height: int = 480, seed: int = 0) -> np.ndarray:
    """(height, width, 3) uint8 with what photographs have: a sky, hills one behind the other, a meadow, grain."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:height, :width]
    down = (y / height)[..., None]
    picture = (1 - down) * np.array([0.28, 0.5, 0.86]) + down * np.array([0.93, 0.9, 0.82])
    for i in range(4):
        phases, heights = rng.uniform(0, math.tau, 6), rng.uniform(0.3, 1, 6)
        ridge = sum(
            h / (k + 1) * np.sin((k + 1) * (2.2 + i) * x / width + p)
            for k, (h, p) in enumerate(zip(heights, phases, strict=True))
        )
        line = 0.42 + 0.07 * i + 0.045 * ridge
        hill = np.array([0.5, 0.6, 0.68]) * (1 - i / 3) + np.array([0.2, 0.33, 0.14]) * i / 3
        picture = np.where((y / height > line)[..., None], hill * (1.15 - 0.5 * down), picture)
    side = max(width, height)
    blades = noise(side, 24, rng)[:height, :width, None]
    meadow = y / height > 0.7
    picture = np.where(meadow[..., None], np.array([0.36, 0.45, 0.19]) * (0.75 + 0.5 * down) * (1 + 0.45 * blades), picture)
    return _bytes(picture + rng.normal(0, 0.012, picture.shape))


def write(file: Path, pixels: np.ndarray, **options) -> Path:
    """Write a picture in the format that the file's name asks for."""
    from PIL import Image

    Image.fromarray(pixels).save(file, **options)
    return file


def write_hdr(file: Path, picture: np.ndarray) -> Path:
    """Write a linear picture (H, W, 3) as Radiance RGBE, not compressed (Ward, *Real Pixels*, Graphics Gems II, 1991)."""
    largest = picture.max(axis=-1)
    mantissa, exponent = np.frexp(largest)
    scale = np.where(largest > 1e-32, 256 * mantissa / np.maximum(largest, 1e-38), 0)
    code = np.zeros((*picture.shape[:2], 4), np.uint8)
    code[..., :3] = np.clip(picture * scale[..., None], 0, 255)
    code[..., 3] = np.where(largest > 1e-32, exponent + 128, 0)
    head = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {picture.shape[0]} +X {picture.shape[1]}\n"
    file.write_bytes(head.encode("ascii") + code.tobytes())
    return file


def _bytes(values: np.ndarray) -> np.ndarray:
    return np.round(np.clip(values, 0, 1) * 255).astype(np.uint8)
