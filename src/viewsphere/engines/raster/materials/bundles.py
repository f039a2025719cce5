"""The textures of all materials packed as bundles. Textures of one material that share size, coordinates and wrapping are
stored together, texel by texel, so that one look-up reads all of them.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from heapq import heapify, heapreplace
from itertools import pairwise
from weakref import WeakKeyDictionary, WeakValueDictionary

import numpy as np
import xxhash
from numpy.typing import NDArray

from viewsphere.assets.mesh import WRAPS, Image, Material, Texture
from viewsphere.caches import cache_of
from viewsphere.caches.arrays import Content
from viewsphere.caches.entries import SUFFIX, cached
from viewsphere.caches.joined import Stored, joined
from viewsphere.codecs.srgb import linear
from viewsphere.engines.raster.materials.kernels_filter import PLANES
from viewsphere.engines.raster.materials.kernels_material import BASE, BUMP, COAT_BUMP, GLOW, ROUGHNESS, SPECULAR_COLOR
from viewsphere.engines.raster.materials.kernels_mips import ZERO_NORMAL, fill, fill_normals, halve
from viewsphere.engines.raster.records import Int32, Textures
from viewsphere.rendering.kept_light import digest_of

Words = NDArray[np.uint16]

MOST = 12
"""Maximum number of bundles of a material: one for each of its textures."""
LEVELS = 16
SHARPEST = 4096
"""Longest side, in texels, at which a texture is kept; larger textures are reduced by a whole factor."""
MOST_WORDS = 1 << 28
"""Maximum number of words (uint16) in the bundles of a stage, half a gigabyte; above it, the largest bundles are reduced."""
STORED_BYTES = 1 << 20
"""Bytes from which a content of scenery is stored in the cache; smaller ones are built faster than they are found."""
KEPT_BYTES = 1 << 27
"""Bytes of texels that are cached for the next stage, which often shows the same model."""


@dataclass(frozen=True)
class _Use:
    """The target of a texture's channels: kind of plane, pairs (channel of the image, channel of the plane), whether sRGB."""

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
"""The texture fields of `Material`, and the channels of each that are kept (glTF 2.0, section 3.9, and its extensions)."""


@dataclass(frozen=True)
class _Content:
    """The content of a bundle: images and the material's fields that use them. If `weighted`, colours are weighted by their
    alpha. Large contents of scenery are stored in the cache, because other shots and workers have the same place.
    """

    uses: tuple[tuple[Image, str], ...]
    weighted: bool
    is_scenery: bool
    factor: int = 1

    @property
    def kinds(self) -> tuple[int, ...]:
        return tuple(sorted({USES[name].kind for _, name in self.uses}))

    @property
    def shape(self) -> tuple[int, int]:
        height, width = self.uses[0][0].pixels.shape[:2]
        return -(-height // self.factor), -(-width // self.factor)

    @cached_property
    def levels(self) -> Int32:
        """First word, width and height of each mip level, (L, 3)."""
        height, width = self.shape
        sizes = [(0, width, height)]
        while max(width, height) > 1 and len(sizes) < LEVELS:
            first = sizes[-1][0] + width * height * 4 * len(self.kinds)
            width, height = max(width // 2, 1), max(height // 2, 1)
            sizes.append((first, width, height))
        return np.array(sizes, np.int32)

    @property
    def words(self) -> int:
        """Number of words of all levels together."""
        first, width, height = self.levels[-1].tolist()
        return first + width * height * 4 * len(self.kinds)


@dataclass(eq=False)
class BundlePacker:
    """Collects the bundles of materials; equal bundles are stored once."""

    _slots: dict[tuple[_Content, Texture], int] = field(default_factory=dict[tuple[_Content, Texture], int])

    def add(
        self, material: Material, images: Sequence[Image], has_uv: tuple[bool, bool], is_scenery: bool = False
    ) -> list[int]:
        """Indices of the material's bundles, padded to MOST of them with -1; textures without coordinates are left out."""
        groups: dict[tuple[tuple[int, ...], Texture], list[tuple[Image, str]]] = {}
        for name in USES:
            texture: Texture | None = getattr(material, name)
            if texture is None or not has_uv[texture.texcoord] or _is_idle(material, name):
                continue
            image = images[texture.image]
            groups.setdefault((image.pixels.shape, replace(texture, image=0)), []).append((image, name))
        numbers: list[int] = []
        for (_, texture), uses in groups.items():
            base = [image for image, name in uses if name == "base_color_texture"]
            weighted = material.alpha_mode != "OPAQUE" and any(image.pixels[..., 3].min() < 255 for image in base)
            numbers.append(self._slots.setdefault((_Content(tuple(uses), weighted, is_scenery), texture), len(self._slots)))
        return numbers + [-1] * (MOST - len(numbers))

    def pack(self) -> Textures:
        """Return the packed bundles. Do not write to the arrays: the next stage with the same textures shares them."""
        count = max(len(self._slots), 1)
        levels = np.zeros((count, LEVELS, 3), np.int32)
        modes = np.zeros((count, 14), np.int32)
        transforms = np.zeros((count, 6), np.float32)
        contents = _affordable(content for content, _ in self._slots)
        texels, starts = _kept().get(tuple(contents.values()))
        firsts = dict(zip(contents, starts, strict=True))
        for (content, texture), slot in self._slots.items():
            own = contents[content].levels
            levels[slot, : len(own)] = own
            levels[slot, : len(own), 0] += firsts[content]
            kinds, names = content.kinds, {name for _, name in content.uses}
            wraps = WRAPS.index(texture.wrap_s), WRAPS.index(texture.wrap_t)
            modes[slot, :6] = len(own), *wraps, texture.nearest, texture.texcoord, len(kinds)
            modes[slot, 6 : 6 + len(kinds)] = kinds
            modes[slot, 12:] = "normal_texture" in names, "clearcoat_normal_texture" in names
            transforms[slot] = texture.matrix.reshape(-1)
        return Textures(texels, levels, modes, transforms)


def _is_idle(material: Material, name: str) -> bool:
    """Return whether the material's own factor is 0, so that the texture changes nothing."""
    return {
        "occlusion_texture": material.occlusion_strength == 0,
        "normal_texture": material.normal_scale == 0,
        "emissive_texture": max(material.emissive) == 0,
        "transmission_texture": material.transmission == 0,
        "specular_texture": material.specular == 0,
        "specular_color_texture": max(material.specular_color) == 0 or material.specular == 0,
    }.get(name, name.startswith("clearcoat") and material.clearcoat == 0)


def _affordable(contents: Iterable[_Content]) -> dict[_Content, _Content]:
    """Each content reduced to SHARPEST, then the largest ones until all fit in MOST_WORDS; of equally large ones the first."""
    reduced = {content: replace(content, factor=-(-max(content.shape) // SHARPEST)) for content in contents}
    total = sum(content.words for content in reduced.values())
    largest = [(-content.words, i, original) for i, (original, content) in enumerate(reduced.items())]
    heapify(largest)
    while total > MOST_WORDS:
        words, i, original = largest[0]
        reduced[original] = replace(reduced[original], factor=reduced[original].factor * 2)
        heapreplace(largest, (-reduced[original].words, i, original))
        total += words + reduced[original].words
    return reduced


class _Kept:
    """Texels of earlier stages: up to KEPT_BYTES of the latest ones, and those of every stage that is still in use."""

    def __init__(self) -> None:
        self._last: OrderedDict[tuple[_Content, ...], Words] = OrderedDict()
        self._held: WeakValueDictionary[tuple[_Content, ...], Words] = WeakValueDictionary()
        self._starts: dict[tuple[_Content, ...], list[int]] = {}
        self._digests: WeakKeyDictionary[Image, str] = WeakKeyDictionary()

    def get(self, contents: tuple[_Content, ...]) -> tuple[Words, list[int]]:
        """Return the levels of these contents with room at the end to read PLANES planes at once, and the first word of
        each.
        """
        texels = self._held.get(contents)
        if texels is None:
            texels, starts = self._packed(contents)
            self._held[contents] = texels
            self._starts = {held: self._starts[held] for held in self._held if held in self._starts} | {contents: starts}
        if texels.nbytes <= KEPT_BYTES:
            self._last[contents] = texels
            self._last.move_to_end(contents)
        while sum(texels.nbytes for texels in self._last.values()) > KEPT_BYTES:
            self._last.popitem(last=False)
        return texels, self._starts[contents]

    def _packed(self, contents: tuple[_Content, ...]) -> tuple[Words, list[int]]:
        """Texels built in their final array: a second copy would cost more than the texels themselves."""
        known = {
            content: texels[first:]
            for others, texels in self._held.items()
            for content, first in zip(others, self._starts[others], strict=True)
        }
        parts = [self._stored(content, known.get(content)) for content in contents]
        texels, starts = joined(parts, np.uint16, 4 * PLANES)
        texels[-4 * PLANES :] = 0
        for content, part, first in zip(contents, parts, starts, strict=True):
            if isinstance(part, int):
                _write(content, texels[first : first + part], known.get(content))
        return texels, starts

    def _stored(self, content: _Content, known: Words | None) -> Stored | int:
        """The content's levels in the cache, or their number of words if they are not to be cached."""
        if not content.is_scenery or content.words * 2 < STORED_BYTES:
            return content.words
        images = [(self._digest(image), image.pixels.shape, name) for image, name in content.uses]
        digest = digest_of(("texels", images, content.weighted, content.factor))

        def make() -> Words:
            words = np.empty(content.words, np.uint16)
            _write(content, words, known)
            return words

        def unpack(held: Content) -> Words:
            words = held.arrays["words"]
            if words.shape != (content.words,) or words.dtype != np.uint16:
                raise ValueError("other words")
            return words

        words = cached("textures", digest, make, lambda words: Content(None, {"words": words}), unpack)
        return Stored(words, cache_of("textures") / f"{digest}{SUFFIX}")

    def _digest(self, image: Image) -> str:
        if image not in self._digests:
            self._digests[image] = xxhash.xxh3_128_hexdigest(np.ascontiguousarray(image.pixels).data)
        return self._digests[image]


@cache
def _kept() -> _Kept:
    return _Kept()


@cache
def _tables() -> tuple[Words, Words]:
    """The words (uint16) of the 256 byte values: one table for plain numbers, and one that converts sRGB to linear light."""
    return np.arange(256, dtype=np.uint16) * np.uint16(257), np.round(linear(np.arange(256) / 255) * 65535).astype(np.uint16)


def _write(content: _Content, words: Words, known: Words | None) -> None:
    """Write all mip levels of a content into `words`, copied if they are known."""
    if known is None:
        _build(content, words)
    else:
        words[:] = known[: content.words]


def _build(content: _Content, words: Words) -> None:
    """Write all mip levels of a content into `words`."""
    kinds, levels = content.kinds, content.levels
    channels = 4 * len(kinds)
    first = words[: levels[0, 1] * levels[0, 2] * channels].reshape(*content.shape, channels)
    plain, light = _tables()
    filled: set[int] = set()
    for image, name in content.uses:
        use = USES[name]
        at = 4 * kinds.index(use.kind)
        if use.is_normal:
            fill_normals(first, at, image.pixels, content.factor)
            filled |= {at, at + 1, at + 2}
        for source, target in use.channels:
            table = light if use.is_color and source < 3 else plain
            fill(first, at + target, image.pixels, source, table, content.factor)
            filled.add(at + target)
    for channel in set(range(channels)) - filled:
        is_normal = kinds[channel // 4] in (BUMP, COAT_BUMP) and channel % 4 < 3
        first[..., channel] = ZERO_NORMAL if is_normal else 65535
    for before, after in pairwise(levels):
        halve(words, before, after, channels, content.weighted)
