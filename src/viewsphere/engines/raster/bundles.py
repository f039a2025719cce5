"""Pack the textures of all materials as bundles: those of one material that share size, coordinates and wrapping are stored
together, texel by texel, so that one look-up reads them all.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import WRAPS, Image, Material, Texture
from viewsphere.assets.srgb import linear
from viewsphere.engines.raster.kernels_filter import PLANES
from viewsphere.engines.raster.kernels_material import BASE, BUMP, COAT_BUMP, GLOW, ROUGHNESS, SPECULAR_COLOR
from viewsphere.engines.raster.kernels_mips import ZERO_NORMAL, fill, fill_normals, halve
from viewsphere.engines.raster.records import Int32, Textures

Words = NDArray[np.uint16]

MOST = 12
"""Bundles of a material at most: one for each of its textures."""
LEVELS = 16
SHARPEST = 4096
"""Longest side, in texels, of what is kept of a texture; larger ones are reduced by a whole factor."""
MOST_WORDS = 1 << 28
"""Words of all bundles of a stage, half a gigabyte: beyond, the largest are reduced."""
KEPT_BYTES = 1 << 27
"""Bundles that are kept for the next stage, which often shows the same model."""


@dataclass(frozen=True)
class _Use:
    """Where a texture's channels go: kind of plane, (channel of the image, channel of the plane), which of them are sRGB."""

    kind: int
    channels: tuple[tuple[int, int], ...] = ()
    is_color: bool = False
    is_normal: bool = False


_COLOR = ((0, 0), (1, 1), (2, 2))
USES = {
    "base_color_texture": _Use(BASE, (*_COLOR, (3, 3)), is_color=True),
    "normal_texture": _Use(BUMP, is_normal=True),
    "occlusion_texture": _Use(BUMP, ((0, 3),)),
    "metallic_roughness_texture": _Use(ROUGHNESS, ((1, 0), (2, 1))),
    "clearcoat_texture": _Use(ROUGHNESS, ((0, 2),)),
    "transmission_texture": _Use(ROUGHNESS, ((0, 3),)),
    "emissive_texture": _Use(GLOW, _COLOR, is_color=True),
    "specular_texture": _Use(GLOW, ((3, 3),)),
    "specular_color_texture": _Use(SPECULAR_COLOR, _COLOR, is_color=True),
    "clearcoat_roughness_texture": _Use(SPECULAR_COLOR, ((1, 3),)),
    "clearcoat_normal_texture": _Use(COAT_BUMP, is_normal=True),
}
"""Material's texture fields, and what of them is kept (glTF 2.0, section 3.9, and its extensions)."""


@dataclass(frozen=True)
class _Content:
    """What a bundle stores: images and the fields that use them. Colours count by their alpha if `weighted`."""

    uses: tuple[tuple[Image, str], ...]
    weighted: bool
    factor: int = 1

    @property
    def kinds(self) -> tuple[int, ...]:
        return tuple(sorted({USES[name].kind for _, name in self.uses}))

    @property
    def shape(self) -> tuple[int, int]:
        height, width = self.uses[0][0].pixels.shape[:2]
        return -(-height // self.factor), -(-width // self.factor)

    @property
    def words(self) -> int:
        """About as many as there are, all levels."""
        height, width = self.shape
        return height * width * 4 * len(self.kinds) * 4 // 3


@dataclass(eq=False)
class BundlePacker:
    """Collects the bundles of materials; equal ones share a place."""

    _slots: dict[tuple[_Content, Texture], int] = field(default_factory=dict[tuple[_Content, Texture], int])

    def add(self, material: Material, images: Sequence[Image], has_uv: tuple[bool, bool]) -> list[int]:
        """Indices of the material's bundles, -1 after the last, MOST of them; textures without coordinates are left out."""
        groups: dict[tuple[tuple[int, ...], Texture], list[tuple[Image, str]]] = {}
        for name in USES:
            texture: Texture | None = getattr(material, name)
            if texture is None or not has_uv[texture.texcoord] or _is_idle(material, name):
                continue
            image = images[texture.image]
            groups.setdefault((image.pixels.shape, replace(texture, image=0)), []).append((image, name))
        found: list[int] = []
        for (_, texture), uses in groups.items():
            base = [image for image, name in uses if name == "base_color_texture"]
            weighted = material.alpha_mode != "OPAQUE" and any(image.pixels[..., 3].min() < 255 for image in base)
            found.append(self._slots.setdefault((_Content(tuple(uses), weighted), texture), len(self._slots)))
        return found + [-1] * (MOST - len(found))

    def pack(self) -> Textures:
        """All bundles."""
        count = max(len(self._slots), 1)
        levels = np.zeros((count, LEVELS, 3), np.int32)
        modes = np.zeros((count, 14), np.int32)
        transforms = np.zeros((count, 6), np.float32)
        contents = _affordable({content for content, _ in self._slots})
        built: dict[_Content, tuple[int, Words, Int32]] = {}
        start = 0
        for (content, texture), slot in self._slots.items():
            if content not in built:
                words, own = _kept().get(contents[content])
                built[content] = start, words, own
                start += len(words)
            first, _, own = built[content]
            levels[slot, : len(own)] = own
            levels[slot, : len(own), 0] += first
            kinds, names = content.kinds, {name for _, name in content.uses}
            wraps = WRAPS.index(texture.wrap_s), WRAPS.index(texture.wrap_t)
            modes[slot, :6] = len(own), *wraps, texture.nearest, texture.texcoord, len(kinds)
            modes[slot, 6 : 6 + len(kinds)] = kinds
            modes[slot, 12:] = "normal_texture" in names, "clearcoat_normal_texture" in names
            transforms[slot] = texture.matrix.reshape(-1)
        texels = np.concatenate([*(words for _, words, _ in built.values()), np.zeros(4 * PLANES, np.uint16)])
        return Textures(texels, levels, modes, transforms)


def _is_idle(material: Material, name: str) -> bool:
    """Whether a texture multiplies nothing."""
    return {
        "occlusion_texture": material.occlusion_strength == 0,
        "normal_texture": material.normal_scale == 0,
        "emissive_texture": max(material.emissive) == 0,
        "transmission_texture": material.transmission == 0,
        "specular_texture": material.specular == 0,
        "specular_color_texture": max(material.specular_color) == 0 or material.specular == 0,
    }.get(name, name.startswith("clearcoat") and material.clearcoat == 0)


def _affordable(contents: set[_Content]) -> dict[_Content, _Content]:
    """Each content reduced as far as its size and the room for all of them ask."""
    reduced = {content: replace(content, factor=-(-max(content.shape) // SHARPEST)) for content in contents}
    while sum(content.words for content in reduced.values()) > MOST_WORDS:
        largest = max(reduced, key=lambda content: reduced[content].words)
        reduced[largest] = replace(reduced[largest], factor=reduced[largest].factor * 2)
    return reduced


class _Kept:
    """The last bundles built, up to KEPT_BYTES of them."""

    def __init__(self) -> None:
        self._kept: OrderedDict[_Content, tuple[Words, Int32]] = OrderedDict()

    def get(self, content: _Content) -> tuple[Words, Int32]:
        """Words of all levels, and each level's first word, width and height."""
        if content not in self._kept:
            self._kept[content] = _build(content)
        self._kept.move_to_end(content)
        found = self._kept[content]
        while sum(words.nbytes for words, _ in self._kept.values()) > KEPT_BYTES:
            self._kept.popitem(last=False)
        return found


@cache
def _kept() -> _Kept:
    return _Kept()


@cache
def _tables() -> tuple[Words, Words]:
    """Words of the 256 bytes: as they are, and linear light of sRGB."""
    return np.arange(256, dtype=np.uint16) * np.uint16(257), np.round(linear(np.arange(256) / 255) * 65535).astype(np.uint16)


def _build(content: _Content) -> tuple[Words, Int32]:
    height, width = content.shape
    kinds = content.kinds
    channels = 4 * len(kinds)
    sizes = [(width, height)]
    while max(sizes[-1]) > 1 and len(sizes) < LEVELS:
        sizes.append((max(sizes[-1][0] // 2, 1), max(sizes[-1][1] // 2, 1)))
    starts = np.cumsum([0, *(w * h * channels for w, h in sizes)])
    words = np.empty(int(starts[-1]), np.uint16)
    first = words[: starts[1]].reshape(height, width, channels)
    for i, kind in enumerate(kinds):
        neutral = ZERO_NORMAL if kind in (BUMP, COAT_BUMP) else 65535
        first[..., 4 * i : 4 * i + 3] = neutral
        first[..., 4 * i + 3] = 65535
    plain, light = _tables()
    for image, name in content.uses:
        use = USES[name]
        at = 4 * kinds.index(use.kind)
        if use.is_normal:
            fill_normals(first, at, image.pixels, content.factor)
        for source, target in use.channels:
            table = light if use.is_color and source < 3 else plain
            fill(first, at + target, image.pixels, source, table, content.factor)
    levels = np.array([(start, *size) for start, size in zip(starts, sizes, strict=False)], np.int32)
    for before, after in pairwise(levels):
        halve(words, before, after, channels, content.weighted)
    return words, levels
