"""Pictures of materials: their files, or their bytes or pixels if viewsphere cannot read a file of theirs."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

from .opening import is_within

BY_BLENDER = {".bw", ".cin", ".dpx", ".exr", ".hdr", ".iris", ".j2c", ".jp2", ".psd", ".rgb", ".rgba", ".sgi"}
"""File suffixes that only Blender decodes."""

FIRST_TILE = "1001"


class Pictures:
    """The pictures that materials use, listed in `told`.

    Each entry has a `name`, `is_srgb`, and one of `path`, `data` (a file with the bytes of a packed picture) and `pixels`
    (an array (H, W, 4) uint8, the first row on top). A picture that cannot be read has none of the three.
    """

    def __init__(self, folder, root):
        self.told = []
        self._folder = folder
        self._root = root
        self._known = {}

    def index(self, image, lose):
        """The picture's index in `told`; a new picture is added. Calls `lose` with the name of a picture that cannot be
        kept.
        """
        key = image.as_pointer()
        if key not in self._known:
            self._known[key] = len(self.told)
            self.told.append({"name": image.name, "is_srgb": self._is_srgb(image), **self._found(image, lose)})
        return self._known[key]

    def _is_srgb(self, image):
        settings = image.colorspace_settings
        return not (settings.is_data or settings.name in ("Non-Color", "Raw") or settings.name.startswith("Linear"))

    def _found(self, image, lose):
        if image.source == "TILED":
            lose(f"all tiles but the first of the image {image.name!r}")
        elif image.source in ("SEQUENCE", "MOVIE"):
            lose(f"all frames but the first of the image {image.name!r}")
        if image.source == "GENERATED":
            return self._decoded(image)
        path = bpy.path.abspath(image.filepath, library=image.library).replace("<UDIM>", FIRST_TILE)
        is_foreign = Path(path).suffix.lower() in BY_BLENDER
        if image.packed_file is not None:
            return self._decoded(image) if is_foreign else {"data": self._packed(image.packed_file.data)}
        if not is_foreign or image.source == "MOVIE":
            return {"path": path}
        if Path(path).is_file() and (self._root is None or is_within(path, self._root)):
            return self._decoded(image)
        return {"path": path}

    def _packed(self, data):
        file = Path(self._folder, f"picture{len(self.told)}")
        file.write_bytes(data)
        return str(file)

    def _decoded(self, image):
        """An image's pixels as Blender decodes them."""
        width, height = image.size
        if not width or not height:
            return {}
        pixels = np.empty(width * height * image.channels, np.float32)
        image.pixels.foreach_get(pixels)
        pixels = np.nan_to_num(pixels.reshape(height, width, image.channels)[::-1])
        if image.channels < 4:
            color = pixels[..., :3] if image.channels == 3 else np.repeat(pixels[..., :1], 3, axis=2)
            pixels = np.concatenate([color, np.ones((height, width, 1), np.float32)], axis=2)
        if image.is_float and self._is_srgb(image):
            pixels[..., :3] = _encoded(pixels[..., :3].clip(0, 1))
        file = Path(self._folder, f"picture{len(self.told)}.npy")
        np.save(file, np.rint(pixels.clip(0, 1) * 255).astype(np.uint8))
        return {"pixels": str(file)}


def _encoded(light):
    """sRGB of linear light (IEC 61966-2-1)."""
    return np.where(light <= 0.0031308, light * 12.92, 1.055 * np.maximum(light, 1e-9) ** (1 / 2.4) - 0.055)
