"""The coverings of floors, walls and ceilings, and the paint of doors and windows; colours sRGB 0..1."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Image, Material
from viewsphere_zoo.shapes.paint import Color
from viewsphere_zoo.townscape import textures
from viewsphere_zoo.townscape.textures import textured

FloorKind = Literal["planks", "parquet", "tiles", "carpet"]
WallKind = Literal["paint", "stripes", "tiles"]


@dataclass(frozen=True)
class Floor:
    """The covering of a floor."""

    kind: FloorKind = "planks"
    color: Color = (0.6, 0.43, 0.27)


@dataclass(frozen=True)
class Wall:
    """The covering of a room's walls; `accent` is the colour of the stripes or the joints."""

    kind: WallKind = "paint"
    color: Color = (0.9, 0.88, 0.84)
    accent: Color = (0.84, 0.82, 0.77)


PLANKS, PAINT = Floor(), Wall()


def floor(rng: np.random.Generator, own: Floor, image: int) -> tuple[Material, Image]:
    """The floor's material, which shows the image of this number, and the image."""
    metres, roughness = {"planks": (1.6, 0.45), "parquet": (1.2, 0.4), "tiles": (1.2, 0.25), "carpet": (0.8, 1.0)}[own.kind]
    picture = {"planks": _planks, "parquet": _parquet, "tiles": _tiles, "carpet": _carpet}[own.kind](rng, own.color)
    return textured(f"{own.kind}_floor", image, metres, roughness), picture


def wall(rng: np.random.Generator, own: Wall, image: int) -> tuple[Material, Image]:
    """The walls' material, which shows the image of this number, and the image."""
    if own.kind == "tiles":
        picture = textures.bricks(rng, "wall_tiles", own.color, own.accent, (8, 8), (0.02, 0.02), 0.015, 0.0)
        return textured("wall_tiles", image, 1.2, 0.2), picture
    picture = textures.plaster(rng, "wall", own.color, 0.012)
    if own.kind == "stripes":
        picture = Image("wallpaper", _striped(picture.pixels, own.accent))
    return textured("wallpaper" if own.kind == "stripes" else "wall_paint", image, 0.64, 0.9), picture


def _striped(
    pixels: np.ndarray[tuple[int, ...], np.dtype[np.uint8]], color: Color
) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    made = pixels.copy()
    columns = np.arange(made.shape[1]) * 8 // made.shape[1] % 2 == 1
    grain = pixels[..., :3] / pixels[..., :3].mean(axis=(0, 1))
    made[:, columns, :3] = np.clip(grain * np.array(color) * 255, 0, 255)[:, columns].astype(np.uint8)
    return made


def _planks(rng: np.random.Generator, color: Color, rows: int = 10, size: int = 512) -> Image:
    """Boards along the picture's width, with staggered joints."""
    at = (np.arange(size) + 0.5) / size
    row = np.broadcast_to(np.floor(at[:, None] * rows).astype(np.int64), (size, size))
    cuts = rng.random(rows)
    along = (at[None, :] * 1.0 + cuts[row]) % 1.0
    half = np.floor(along * 2).astype(np.int64)
    edge_y = np.abs(at[:, None] * rows - np.round(at[:, None] * rows)) / rows * size
    edge_x = np.abs(along * 2 - np.round(along * 2)) / 2 * size
    gap = np.clip(np.minimum(edge_y, edge_x) - 0.4, 0, 1)
    return _grained(rng, "planks", color, row * 2 + half, 2 * rows, gap, False)


def _parquet(rng: np.random.Generator, color: Color, cells: int = 4, size: int = 512) -> Image:
    """Squares of five staves, laid across and along in turn."""
    at = (np.arange(size) + 0.5) / size * cells
    x, y = np.broadcast_to(at[None, :], (size, size)), np.broadcast_to(at[:, None], (size, size))
    column, row = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    turned = (column + row) % 2 == 1
    across = np.where(turned, x - column, y - row) * 5
    stave = np.floor(across).astype(np.int64)
    rim = np.minimum(np.abs(x - np.round(x)), np.abs(y - np.round(y))) / cells * size
    gap = np.clip(np.minimum(np.abs(across - np.round(across)) / 5 / cells * size, rim) - 0.3, 0, 1)
    cell = (row * cells + column) * 5 + stave
    lying = _grained(rng, "parquet", color, cell, cells * cells * 5, gap, False)
    return Image(
        "parquet",
        np.where(turned[..., None], _grained(rng, "parquet", color, cell, cells * cells * 5, gap, True).pixels, lying.pixels),
    )


def _grained(
    rng: np.random.Generator,
    name: str,
    color: Color,
    cell: np.ndarray[tuple[int, ...], np.dtype[np.int64]],
    count: int,
    gap: textures.Float,
    upright: bool,
) -> Image:
    """Wood whose pieces differ a little, dark in the gaps."""
    size = cell.shape[0]
    grain = textures.noise(rng, size, 0.9, 14.0)
    rings = textures.noise(rng, size, 3.0, 10.0)
    if upright:
        grain, rings = grain.T, rings.T
    tone = rng.standard_normal(count)[cell]
    shade = (1 + 0.05 * tone + 0.045 * grain + 0.05 * rings) * (0.45 + 0.55 * gap)
    return textures.painted(name, color, np.clip(shade, 0.2, 1.5))


def _tiles(rng: np.random.Generator, color: Color) -> Image:
    red, green, blue = (0.75 * c for c in color)
    return textures.bricks(rng, "floor_tiles", color, (red, green, blue), (4, 4), (0.012, 0.012), 0.02, 0.0)


def _carpet(rng: np.random.Generator, color: Color, size: int = 256) -> Image:
    shade = 1 + 0.13 * textures.noise(rng, size, 0.8) + 0.05 * textures.noise(rng, size, 6)
    return textures.painted("carpet", color, np.clip(shade, 0.5, 1.5))
