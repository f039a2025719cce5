"""Pictures and maps of samples, encoded for other formats; encodings shared by several formats are computed once."""

from __future__ import annotations

from pathlib import PurePosixPath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.codecs.exr import encode_exr, half_floats
from viewsphere.codecs.pictures import encode_picture
from viewsphere.codecs.png_tiff import encode_png
from viewsphere.formats.shared.writing.export_files import Coded, Content
from viewsphere.model.channel import picture_of
from viewsphere.model.sample import Sample

JPEG_QUALITY = 95
"""Quality of pictures that a format requires as JPEG and the store keeps in another encoding."""


def suffix_of(sample: Sample, *suffixes: str) -> str:
    """The ending of a sample's picture, with its dot, in a format that supports these; the first one if the stored picture has
    another.
    """
    own = PurePosixPath(sample.picture_file or "").suffix.lower()
    return own if own in suffixes else suffixes[0]


def picture(sample: Sample, *suffixes: str) -> Content:
    """A sample's picture in a file of one of these endings (`.png`, `.jpg`): the stored file if it has one of them, so that it
    can be linked; otherwise a new encoding in the first. Alpha is composited over black.
    """
    file = sample.picture_file
    if file is not None and PurePosixPath(file).suffix.lower() in suffixes:
        return file
    if picture_of(sample.channels) is None:
        raise KeyError("rgb")
    kind = suffixes[0]

    def make() -> bytes:
        pixels = opaque(sample.picture)
        return encode_png(pixels) if kind == ".png" else encode_picture(pixels, "jpeg", JPEG_QUALITY)

    return Coded(sample.index, f"picture{kind}", make)


def light_exr(sample: Sample) -> Content:
    """A sample's scene-linear light as OpenEXR: the stored file if it is one, otherwise a new one of half floats."""
    file = sample.files.get("rgb_linear", "")
    if file.endswith(".exr"):
        return file
    return Coded(sample.index, "light.exr", lambda: encode_exr(half_floats(sample.channels["rgb_linear"])))


def opaque(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """A picture (H, W, 3) with its straight alpha composited over black."""
    if pixels.shape[2] == 3:
        return pixels
    return np.rint(pixels[..., :3] * (pixels[..., 3:] / 255.0)).astype(np.uint8)


def png(sample: Sample, name: str, array: NDArray[Any]) -> Coded:
    """An array as PNG, under a name that identifies how it was derived from the sample."""
    return Coded(sample.index, f"{name}.png", lambda: encode_png(array))


def depth_png(sample: Sample, metres: float, nothing: int = 0, most: int = 65535) -> Coded:
    """Depth along z in steps of this many metres, 16 bits; `nothing` without a surface. Depth beyond `most` steps counts as
    `most`, depth below half a step as one.
    """

    def make() -> bytes:
        return encode_png(depth_steps(sample, metres, nothing, most))

    return Coded(sample.index, f"depth {metres!r} {nothing} {most}.png", make)


def depth_steps(sample: Sample, metres: float, nothing: int = 0, most: int = 65535) -> NDArray[np.uint16]:
    """Depth along z in whole steps, (H, W) uint16, as in `depth_png`."""
    depth = sample.channels["depth"].astype(np.float64)
    seen = np.isfinite(depth) & (depth > 0)
    steps = np.clip(np.rint(np.where(seen, depth, metres) / metres), 1, most)
    return np.where(seen, steps, nothing).astype(np.uint16)
