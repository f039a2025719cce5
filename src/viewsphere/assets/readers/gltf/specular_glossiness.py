"""KHR_materials_pbrSpecularGlossiness as metallic-roughness, texel by texel.

The formulas are from the extension's own examples:
https://github.com/KhronosGroup/glTF/tree/main/extensions/2.0/Archived/KHR_materials_pbrSpecularGlossiness
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import Image, Material, Texture
from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.codecs.srgb import linear, srgb_bytes

Float = NDArray[np.float64]
Bytes = NDArray[np.uint8]

DIELECTRIC = 0.04
"""Reflectance at normal incidence of ior 1.5."""

TINY = 1e-6
LUMINANCE = np.array([0.299, 0.587, 0.114])
BAND = 1 << 18
"""Texels converted at once: some 50 MB of working memory."""


@dataclass(frozen=True)
class SpecularGlossiness:
    """The extension's fields; colours linear."""

    diffuse: tuple[float, ...]
    alpha: float
    diffuse_texture: Texture | None
    specular: tuple[float, ...]
    glossiness: float
    texture: Texture | None  # sRGB specular colour, linear glossiness in alpha


def as_metallic_roughness(folder: ModelFolder, material: Material, look: SpecularGlossiness) -> Material:
    """The material with the metallic-roughness fields of the most similar appearance.

    Textures become two new ones, of the larger one's size. If both exist with different mappings, the mean of the
    specular-glossiness texture is used, with a warning.
    """
    if look.diffuse_texture is not None and look.texture is not None and not _lie_alike(look.diffuse_texture, look.texture):
        folder.warn(
            f"material {material.name!r}: its diffuse and specular-glossiness textures use different coordinates, the mean "
            "of the latter is used"
        )
        look = _with_mean(folder, look)
    if look.texture is None and (look.diffuse_texture is None or _brightness(np.array(look.specular)) < DIELECTRIC):
        return _of_factors(material, look)
    return _of_texels(folder, material, look)


def _converted(diffuse: Float, specular: Float) -> tuple[Float, Float]:
    """Base colours (N, 3) and metallic factors (N,) of diffuse and specular colours (N, 3), all linear."""
    strength = 1.0 - specular.max(axis=-1)
    metallic = _metallic(_brightness(diffuse), _brightness(specular), strength)[:, None]
    from_diffuse = diffuse * strength[:, None] / (1 - DIELECTRIC) / np.maximum(1 - metallic, TINY)
    from_specular = (specular - DIELECTRIC * (1 - metallic)) / np.maximum(metallic, TINY)
    mixed = from_diffuse + (from_specular - from_diffuse) * metallic**2
    return np.clip(mixed, 0.0, 1.0), metallic[:, 0]


def _metallic(diffuse: Float, specular: Float, strength: Float) -> Float:
    """Metallic factors with the same diffuse and specular brightness: the roots of a quadratic equation."""
    b = diffuse * strength / (1 - DIELECTRIC) + specular - 2 * DIELECTRIC
    root = np.sqrt(np.maximum(b * b - 4 * DIELECTRIC * (DIELECTRIC - specular), 0.0))
    return np.where(specular < DIELECTRIC, 0.0, np.clip((root - b) / (2 * DIELECTRIC), 0.0, 1.0))


def _brightness(color: Float) -> Float:
    return np.sqrt((LUMINANCE * np.square(color)).sum(axis=-1))


def _lie_alike(first: Texture, second: Texture) -> bool:
    return replace(first, image=0, nearest=False) == replace(second, image=0, nearest=False)


def _with_mean(folder: ModelFolder, look: SpecularGlossiness) -> SpecularGlossiness:
    assert look.texture is not None
    texels = folder.images[look.texture.image].pixels.reshape(-1, 4)
    color = linear(np.arange(256) / 255)[texels[:, :3]].mean(axis=0) * look.specular
    glossiness = float(texels[:, 3].mean() / 255) * look.glossiness
    return replace(look, specular=tuple(color.tolist()), glossiness=glossiness, texture=None)


def _of_factors(material: Material, look: SpecularGlossiness) -> Material:
    base, metallic = _converted(np.array([look.diffuse]), np.array([look.specular]))
    red, green, blue = base[0].tolist()
    return replace(
        material,
        base_color=(red, green, blue, look.alpha),
        base_color_texture=look.diffuse_texture,
        metallic=float(metallic[0]),
        roughness=1.0 - look.glossiness,
        metallic_roughness_texture=None,
    )


def _of_texels(folder: ModelFolder, material: Material, look: SpecularGlossiness) -> Material:
    """The material with a texture of base colours and one of roughness and metallic factors; its factors are 1."""
    texture = look.diffuse_texture or look.texture
    assert texture is not None
    key = f"specular-glossiness {look}"
    made: list[tuple[Bytes, Bytes]] = []

    def texels(which: int) -> Image:
        if not made:
            made.append(_texels(folder, look))
        return Image(f"{material.name or 'material'}, {('base colour', 'metallic-roughness')[which]}", made[0][which])

    return replace(
        material,
        base_color=(1.0, 1.0, 1.0, look.alpha),
        base_color_texture=replace(texture, image=folder.derived(f"{key} 0", lambda: texels(0))),
        metallic=1.0,
        roughness=1.0,
        metallic_roughness_texture=replace(texture, image=folder.derived(f"{key} 1", lambda: texels(1))),
    )


def _texels(folder: ModelFolder, look: SpecularGlossiness) -> tuple[Bytes, Bytes]:
    """Both new pictures (H, W, 4)."""
    sources = [None if t is None else folder.images[t.image].pixels for t in (look.diffuse_texture, look.texture)]
    height, width = np.max([source.shape[:2] for source in sources if source is not None], axis=0).tolist()
    diffuse, specular = (None if s is None else _enlarged(s, height, width).reshape(-1, 4) for s in sources)
    base = np.full((height * width, 4), 255, np.uint8)
    rough_metal = np.full((height * width, 4), 255, np.uint8)
    for start in range(0, len(base), BAND):
        band = slice(start, start + BAND)
        count = len(base[band])
        of_diffuse = _colors(None if diffuse is None else diffuse[band], look.diffuse, count)
        of_specular = _colors(None if specular is None else specular[band], look.specular, count)
        colors, metallic = _converted(of_diffuse, of_specular)
        base[band, :3] = srgb_bytes(colors)
        if diffuse is not None:
            base[band, 3] = diffuse[band, 3]
        gloss = look.glossiness * (1.0 if specular is None else specular[band, 3] / 255.0)
        rough_metal[band, 1] = np.rint((1.0 - gloss) * 255)
        rough_metal[band, 2] = np.rint(metallic * 255)
    return base.reshape(height, width, 4), rough_metal.reshape(height, width, 4)


def _colors(texels: Bytes | None, factor: tuple[float, ...], count: int) -> Float:
    if texels is None:
        return np.tile(np.array(factor), (count, 1))
    return linear(np.arange(256) / 255)[texels[:, :3]] * factor


def _enlarged(pixels: Bytes, height: int, width: int) -> Bytes:
    """The picture at another size, by nearest-neighbour sampling."""
    rows, columns = (np.arange(n) * have // n for n, have in zip((height, width), pixels.shape[:2], strict=True))
    return pixels if pixels.shape[:2] == (height, width) else pixels[rows[:, None], columns]
