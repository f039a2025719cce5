"""From light to digital numbers: colour filters, photons, electrons, gain and converter; and from these to a picture.

`malvar`: Malvar, He and Cutler, *High-Quality Linear Interpolation for Demosaicing of Bayer-Patterned Color Images* (2004).
`bilinear`: means of the nearest pixels of a colour. Beyond the picture's border, its pixels are mirrored about the outermost
ones, which keeps the pattern.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from viewsphere.model.sensors.imager import Imager

Float32 = NDArray[np.float32]
Mosaic = NDArray[np.uint16]
Taps = tuple[tuple[int, int, float], ...]

STREAM = tuple(b"imager")
"""The name of the noise's random numbers."""

OVERFULL = 4.0
"""Full wells beyond which more light changes nothing: noise is far smaller."""


REACH = 2
"""Pixels to each side that an interpolation reads."""


def _mirrored(quarter: dict[tuple[int, int], float]) -> Taps:
    """Taps (down, across, weight) of a kernel that is even in both directions."""
    signs = ((a, b) for a in (-1, 1) for b in (-1, 1))
    taps = {(down * a, across * b): weight for a, b in signs for (down, across), weight in quarter.items()}
    return tuple((down, across, weight) for (down, across), weight in sorted(taps.items()))


def _turned(taps: Taps) -> Taps:
    return tuple((across, down, weight) for down, across, weight in taps)


_GREEN = _mirrored({(0, 0): 4 / 8, (0, 1): 2 / 8, (1, 0): 2 / 8, (0, 2): -1 / 8, (2, 0): -1 / 8})
_BESIDE = _mirrored({(0, 0): 5 / 8, (0, 1): 4 / 8, (1, 1): -1 / 8, (0, 2): -1 / 8, (2, 0): 0.5 / 8})
_ACROSS = _mirrored({(0, 0): 6 / 8, (1, 1): 2 / 8, (0, 2): -1.5 / 8, (2, 0): -1.5 / 8})
_NEAR_GREEN = _mirrored({(0, 1): 1 / 4, (1, 0): 1 / 4})
_NEAR_BESIDE = _mirrored({(0, 1): 1 / 2})
_NEAR_ACROSS = _mirrored({(1, 1): 1 / 4})

KERNELS = {"malvar": (_GREEN, _BESIDE, _ACROSS), "bilinear": (_NEAR_GREEN, _NEAR_BESIDE, _NEAR_ACROSS)}
"""Taps for green at red and blue; for a colour at a green pixel that has it to its sides; and for red at blue, blue at red."""


def _filters(pattern: str, height: int, width: int) -> NDArray[np.intp]:
    """The colour of each pixel's filter, (H, W): 0 red, 1 green, 2 blue."""
    tile = np.array(["rgb".index(color) for color in pattern]).reshape(2, 2)
    return np.tile(tile, (-(-height // 2), -(-width // 2)))[:height, :width]


def digital_numbers(light: Float32, imager: Imager, iso: float, seed: int) -> Mosaic:
    """The raw picture (H, W) of light (H, W, 3) in linear sRGB, of which 1 is the largest digital number in green.

    A pixel with a mean of m electrons collects Poisson(m), at most the full well. Read noise is added, gain and black level
    follow, and the converter rounds and clips. The same seed gives the same noise.
    """
    height, width = light.shape[:2]
    gain = iso / imager.base_iso
    colors = _recolored(light, _sensor_matrix(imager))
    chosen = _filters(imager.pattern, height, width)
    signal = np.take_along_axis(colors, chosen[..., None], axis=2).reshape(-1)
    mean = np.clip(signal, 0, OVERFULL * gain).astype(np.float64) * (imager.full_well / gain)
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=STREAM))
    electrons = np.minimum(rng.poisson(mean), imager.full_well)
    noise = np.hypot(imager.read_noise, imager.adc_noise / gain)
    electrons = electrons + noise * rng.standard_normal(len(electrons))
    span = imager.white_level - imager.black_level
    numbers = imager.black_level + electrons * (span * gain / imager.full_well)
    return np.clip(np.rint(numbers), 0, imager.white_level).astype(np.uint16).reshape(height, width)


def _recolored(picture: Float32, matrix: NDArray[np.float64]) -> Float32:
    """The picture (H, W, 3) with a matrix applied to its colours; sums have one order, unlike those of matrix products."""
    red, green, blue = np.moveaxis(picture, 2, 0)
    rows = matrix.astype(np.float32)
    return np.stack([row[0] * red + row[1] * green + row[2] * blue for row in rows], axis=2)


def _sensor_matrix(imager: Imager) -> NDArray[np.float64]:
    """Linear sRGB to the signals of red, green and blue pixels, (3, 3); white gives `imager.response`."""
    return np.diag(imager.response) @ np.linalg.inv(np.array(imager.matrix))


def developed(mosaic: Mosaic, imager: Imager, white: Sequence[float] = (1.0, 1.0, 1.0)) -> Float32:
    """The display-linear picture (H, W, 3) float32 in [0, 1] of a raw picture, in which light of this colour is white.

    The balance multiplies each colour of pixels, the weakest most, so that what saturates is white.
    """
    height, width = mosaic.shape
    signals = _sensor_matrix(imager) @ np.array(white)
    balance = (signals.max() / signals).astype(np.float32)[_filters(imager.pattern, height, width)]
    span = np.float32(imager.white_level - imager.black_level)
    signal = (mosaic.astype(np.float32) - np.float32(imager.black_level)) / span
    picture = np.minimum(_demosaiced(np.minimum(signal * balance, 1), imager.pattern, imager.demosaic), 1)
    return np.clip(_recolored(picture, np.array(imager.matrix)), 0, 1)


def _demosaiced(mosaic: Float32, pattern: str, method: str) -> Float32:
    """The picture (H, W, 3) of a mosaic (H, W) of this pattern."""
    green, beside, across = KERNELS[method]
    height, width = mosaic.shape
    padded = np.pad(mosaic, REACH, mode="reflect") if min(height, width) > 1 else np.pad(mosaic, REACH, mode="edge")
    out = np.empty((height, width, 3), np.float32)
    for y in range(2):
        row = pattern[2 * y : 2 * y + 2]
        for x in range(2):
            own = row[x]
            for channel, color in enumerate("rgb"):
                if color == own:
                    taps: Taps = ((0, 0, 1.0),)
                elif color == "g":
                    taps = green
                elif own == "g":
                    taps = beside if color in row else _turned(beside)
                else:
                    taps = across
                out[y::2, x::2, channel] = _sum(padded, taps, y, x, height, width)
    return out


def _sum(padded: Float32, taps: Taps, y: int, x: int, height: int, width: int) -> Float32:
    """The weighted sum of neighbours, for every second pixel of every second row, from pixel (y, x) on."""
    rows, columns = -(-(height - y) // 2), -(-(width - x) // 2)
    total = np.zeros((rows, columns), np.float32)
    for down, across, weight in taps:
        top, left = y + REACH + down, x + REACH + across
        total += np.float32(weight) * padded[top : top + 2 * rows : 2, left : left + 2 * columns : 2]
    return total
