"""Pictures and maps of samples as files of other formats have them; what several formats encode alike is made once."""

from __future__ import annotations

from pathlib import PurePosixPath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.codecs.pictures import encode_picture
from viewsphere.codecs.png_tiff import encode_png
from viewsphere.formats.shared.writing.export_files import Coded, Content
from viewsphere.model.channel import picture_of
from viewsphere.model.sample import Sample

JPEG_QUALITY = 95
"""Of pictures that a format wants as JPEG and the store keeps as something else."""


def suffix_of(sample: Sample, *suffixes: str) -> str:
    """The ending of a sample's picture, with its dot, in a format that takes these; the first where the store has another."""
    own = PurePosixPath(sample.picture_file or "").suffix.lower()
    return own if own in suffixes else suffixes[0]


def picture(sample: Sample, *suffixes: str) -> Content:
    """A sample's picture in a file of one of these endings (`.png`, `.jpg`): the stored file where it is one, so that it can be
    linked, else encoded anew, as the first; alpha is laid over black.
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


def opaque(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """A picture (H, W, 3), its straight alpha laid over black."""
    if pixels.shape[2] == 3:
        return pixels
    return np.rint(pixels[..., :3] * (pixels[..., 3:] / 255.0)).astype(np.uint8)


def png(sample: Sample, name: str, array: NDArray[Any]) -> Coded:
    """An array as PNG, under a name that says how it was made of the sample."""
    return Coded(sample.index, f"{name}.png", lambda: encode_png(array))


def depth_png(sample: Sample, metres: float, nothing: int = 0, most: int = 65535) -> Coded:
    """Depth along z in steps of so many metres, 16 bits, `nothing` where there is no surface; farther than `most` steps counts
    as `most`, and what is nearer than half a step as one.
    """

    def make() -> bytes:
        return encode_png(depth_steps(sample, metres, nothing, most))

    return Coded(sample.index, f"depth {metres!r} {nothing} {most}.png", make)


def depth_steps(sample: Sample, metres: float, nothing: int = 0, most: int = 65535) -> NDArray[np.uint16]:
    """Depth along z in whole steps, (H, W) uint16, as `depth_png` keeps it."""
    depth = sample.channels["depth"].astype(np.float64)
    seen = np.isfinite(depth) & (depth > 0)
    steps = np.clip(np.rint(np.where(seen, depth, metres) / metres), 1, most)
    return np.where(seen, steps, nothing).astype(np.uint16)


def ids_png(sample: Sample, bits: int = 8) -> Coded:
    """The ids of objects, 0 for none, in a grey PNG of 8 or 16 bits."""
    kind = np.uint8 if bits == 8 else np.uint16
    return Coded(sample.index, f"ids {bits}.png", lambda: encode_png(sample.channels["instances"].astype(kind)))
