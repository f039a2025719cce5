"""Proof that a frame's pictures of 8 bits, of 16 bits and of scene-linear light are one picture."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from viewsphere.model.channel import ALL_PICTURES
from viewsphere.model.sample import Sample
from viewsphere.rendering.background import shows_sky
from viewsphere.rendering.effects import steps_of
from viewsphere.rendering.finish import is_plain
from viewsphere.rendering.view import bytes_of_words, picture_of_light

Bytes = NDArray[np.uint8]

STEP = 1
"""Levels of 256 by which roundings of one picture may differ: a value near a half is rounded in different precision."""

PRECISION = {".exr": 2.0**-11, ".hdr": 2.0**-8}
"""Largest error of stored light, as a share of its pixel's largest channel: half floats, and RGBE. Other files are exact."""

LOSSLESS = (".png", ".qoi")
"""Files of `rgb` that may be compared: lossy ones have other errors, and a file does not state its quality."""


def pictures(sample: Sample) -> Iterator[str]:
    """Yield each pair of a frame's pictures that differ by more than their precision.

    Effects on bytes are in `rgb` alone, smoother and effects in no light, and a background picture is no light either. Such
    pairs are not compared.
    """
    finish = sample.finish
    if finish is None or sum(name in sample.channels for name in ALL_PICTURES) < 2:
        return
    is_exact = sample.files.get("rgb", "").endswith(LOSSLESS) and not steps_of(finish.effects).coded
    words = bytes_of_words(sample.channels["rgb16"]) if "rgb16" in sample.channels else None
    if words is not None and is_exact:
        yield from _outside("rgb", sample.channels["rgb"], "rgb16", words, words)
    if "rgb_linear" in sample.channels and is_plain(finish) and shows_sky(finish.background):
        seen = words
        if seen is None and is_exact:
            seen = sample.channels["rgb"]
        if seen is not None:
            yield from _outside("rgb16" if words is not None else "rgb", seen, "rgb_linear", *_shown(sample))


def _shown(sample: Sample) -> tuple[Bytes, Bytes]:
    """The darkest and the brightest picture of a frame's light, given the precision of its file."""
    assert sample.finish is not None
    light, file = sample.channels["rgb_linear"], sample.files["rgb_linear"]
    error = light.max(axis=2, keepdims=True) * np.float32(PRECISION.get(file[-4:], 0))
    low, high = (picture_of_light(np.maximum(light + part, 0), sample.finish.view) for part in (-error, error))
    return np.minimum(low, high), np.maximum(low, high)


def _outside(name: str, found: Bytes, source: str, low: Bytes, high: Bytes) -> Iterator[str]:
    """Yield a message if a picture leaves the range between two others by more than `STEP`."""
    levels = found.astype(np.int16)
    wrong = ((levels < low.astype(np.int16) - STEP) | (levels > high.astype(np.int16) + STEP)).any(axis=2)
    if wrong.any():
        y, x = (int(i[0]) for i in np.nonzero(wrong))
        wanted = low[y, x].tolist()
        yield (
            f"{name}: expected the picture of {source}, within {STEP} level of 256; found {int(wrong.sum())} other pixels: at "
            f"pixel {(x, y)} expected {wanted}, found {found[y, x].tolist()}"
        )
