"""Pack textures with their mip levels, in linear light."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import WRAPS, Image, Texture
from viewsphere.engines.raster.records import Textures
from viewsphere.engines.raster.tone import linear_words

_LEVELS = 16
_LARGEST = 8192  # texels; larger images start at a smaller level


class TexturePacker:
    """Collects texture uses; equal uses of one image share a slot."""

    def __init__(self) -> None:
        self._slots: dict[tuple[int, bool, Texture], int] = {}
        self._images: dict[tuple[int, bool], list[tuple[int, int, int]]] = {}
        self._texels: list[NDArray[np.uint16]] = []
        self._count = 0

    def slot(self, images: Sequence[Image], texture: Texture | None, is_color: bool) -> int:
        """This use's index in `Textures`, -1 for no texture; colours are decoded from sRGB, data are not.

        The images must outlive the packer: it tells them apart by identity.
        """
        if texture is None:
            return -1
        image = images[texture.image]
        key = (id(image), is_color)
        if key not in self._images:
            self._images[key] = [self._store(level) for level in _mip_levels(image, is_color)]
        return self._slots.setdefault((*key, texture), len(self._slots))

    def _store(self, level: NDArray[np.uint16]) -> tuple[int, int, int]:
        start = self._count
        self._texels.append(level.reshape(-1, 4))
        self._count += level.shape[0] * level.shape[1]
        return start, level.shape[1], level.shape[0]

    def pack(self) -> Textures:
        """All slots as arrays."""
        count = max(len(self._slots), 1)
        levels = np.zeros((count, _LEVELS, 3), np.int32)
        modes = np.zeros((count, 5), np.int32)
        transforms = np.zeros((count, 6), np.float32)
        for (image, is_color, texture), slot in self._slots.items():
            mips = self._images[image, is_color]
            levels[slot, : len(mips)] = mips
            wraps = WRAPS.index(texture.wrap_s), WRAPS.index(texture.wrap_t)
            modes[slot] = len(mips), *wraps, texture.nearest, texture.texcoord
            transforms[slot] = texture.matrix.reshape(-1)
        texels = np.concatenate(self._texels) if self._texels else np.zeros((1, 4), np.uint16)
        return Textures(np.ascontiguousarray(texels), levels, modes, transforms)


@lru_cache(maxsize=128)
def _mip_levels(image: Image, is_color: bool) -> list[NDArray[np.uint16]]:
    """The image and its halvings, (H, W, 4) uint16 linear; colours weighted by alpha: hidden ones do not bleed.

    Kept, because the next model often stands in the same place.
    """
    pixels = image.pixels
    base = pixels.astype(np.uint16) * np.uint16(257)
    if is_color:
        base[..., :3] = linear_words()[pixels[..., :3]]
    levels = [base]
    current = base.astype(np.float32)
    while max(current.shape[:2]) > 1 and len(levels) < _LEVELS:
        current = _halved(current, is_color)
        levels.append(np.round(current).astype(np.uint16))
    return [level for level in levels if max(level.shape[:2]) <= _LARGEST]


def _halved(image: NDArray[np.float32], is_color: bool) -> NDArray[np.float32]:
    height, width = image.shape[:2]
    padded = np.pad(image, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
    quarters = padded.reshape(padded.shape[0] // 2, 2, padded.shape[1] // 2, 2, 4)
    if not is_color:
        return quarters.mean(axis=(1, 3))
    weight = quarters[..., 3:] + np.float32(1)
    color = (quarters[..., :3] * weight).sum(axis=(1, 3)) / weight.sum(axis=(1, 3))
    return np.concatenate([color, quarters[..., 3:].mean(axis=(1, 3))], axis=-1)
