"""Procedural materials as pictures, the same for every engine."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from viewsphere import materials
from viewsphere.assets.appearance.color_names import NAMES, nearest_names
from viewsphere.assets.mesh import Image, Material, Texture
from viewsphere.codecs.srgb import encoded, linear
from viewsphere.model.annotations.procedural_material import ProceduralMaterial
from viewsphere.model.scene import WHITE, Color

KEPT = 8
"""Number of substances whose pictures are cached: 3 MB each at 512 texels a side, 13 MB at 1024."""

STRIDE = 251
"""Stride between the texels sampled for a colour: a prime, so that it does not align with a brick pattern."""

_LEVELS = 65535
"""Levels of light in the table of sRGB values: the darkest byte covers 20 of them."""

Pictures = tuple[Image, Image, Image]
"""Colour; roughness in green and metallic in blue; normals, green up."""


def is_replaceable(material: Material) -> bool:
    """Return whether a material can be replaced by a substance: glass and materials with holes cannot."""
    return material.alpha_mode == "OPAQUE" and not material.transmission


def made_of(material: Material, substance: ProceduralMaterial, first: int) -> Material:
    """An opaque material of this substance; its pictures are images `first` and later, one repeat per unit of uv."""
    color, rough, bumps = (Texture(first + i) for i in range(3))
    return Material(
        name=material.name,
        base_color=(1.0, 1.0, 1.0, material.base_color[3]),
        base_color_texture=color,
        metallic=1.0,
        roughness=1.0,
        metallic_roughness_texture=rough,
        normal_texture=bumps,
        double_sided=material.double_sided,
    )


def pictures_of(substance: ProceduralMaterial) -> Pictures:
    """The pictures of a substance; the most recent ones are cached. Raises UserError for an unknown material name."""
    return _pictures(substance.name, substance.seed, substance.size)


@lru_cache(maxsize=KEPT)
def _pictures(name: str, seed: int, size: int) -> Pictures:
    surface = materials.surface(name, seed, size)
    light = np.rint(surface.color.clip(0, 1) * np.float32(_LEVELS)).astype(np.uint16)
    data = np.zeros((*surface.roughness.shape, 3), np.float32)
    data[..., 1], data[..., 2] = surface.roughness, surface.metallic
    return (
        Image(name, _opaque(_table()[light])),
        Image(f"{name}_roughness", _opaque(_bytes(data))),
        Image(f"{name}_normals", _opaque(_bytes(surface.normals * np.float32(0.5) + np.float32(0.5)))),
    )


def color_of(substance: ProceduralMaterial, tint: Color | None) -> str | None:
    """The basic colour of most of a substance with this tint; None if no colour covers most of it."""
    return _color(substance.name, substance.seed, substance.size, tint or WHITE)


@lru_cache(maxsize=256)
def _color(name: str, seed: int, size: int, tint: Color) -> str | None:
    pixels = _pictures(name, seed, size)[0].pixels.reshape(-1, 4)[::STRIDE, :3]
    counts = np.bincount(nearest_names(linear(pixels / 255) * tint), minlength=len(NAMES))
    return NAMES[int(counts.argmax())] if 2 * counts.max() > len(pixels) else None


def _bytes(values: NDArray[np.float32]) -> NDArray[np.uint8]:
    return np.floor(np.clip(values, 0, 1) * np.float32(255) + np.float32(0.5)).astype(np.uint8)


def _opaque(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    whole = np.full((*pixels.shape[:2], 4), 255, np.uint8)
    whole[..., :3] = pixels
    return whole


@lru_cache(maxsize=1)
def _table() -> NDArray[np.uint8]:
    return np.rint(encoded(np.arange(_LEVELS + 1) / _LEVELS) * 255).astype(np.uint8)
