"""Automatic exposure, ISO and white balance, which follow from the light of a picture.

The key of a picture is the log-average of its luminance (Reinhard et al., *Photographic Tone Reproduction for Digital Images*,
2002), which neither the sun nor a lamp decides. Automatic exposure maps the key to 18 % of saturation: first by a longer
exposure, then by gain. Automatic white balance is the grey world: the log-averages of red, green and blue become equal.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from viewsphere.model.sensors.imager import SATURATION, MountedImager
from viewsphere.rendering.white import LUMINANCE, white_balance

Float = NDArray[np.float64]

KEY = 0.18
"""Share of saturation that the key of a picture becomes."""

BOUND = 4.0
"""Stops from the median beyond which a pixel counts as just that far: black pixels and the sun do not decide the key."""

DARK = 1e-9
"""Light at or below which a pixel is not lit, and not metered."""


class Reading(NamedTuple):
    """Light of a picture: log2 of its key, and of the log-averages of red, green and blue."""

    key: float
    colors: tuple[float, float, float]

    @staticmethod
    def of(light: NDArray[np.float32]) -> Reading | None:
        """The reading of scene-linear light (H, W, 3); None in darkness."""
        pixels = light.reshape(-1, 3).astype(np.float64)
        luminance = (pixels * LUMINANCE).sum(axis=1)
        is_lit = luminance > DARK
        if not is_lit.any():
            return None
        red, green, blue = (_log_average(pixels[is_lit, i]) for i in range(3))
        return Reading(_log_average(luminance[is_lit]), (red, green, blue))

    @staticmethod
    def mean(readings: Sequence[Reading | None], weights: Sequence[float]) -> Reading | None:
        """The weighted mean; readings in darkness do not count."""
        lit = [(reading, weight) for reading, weight in zip(readings, weights, strict=True) if reading is not None]
        if not lit:
            return None
        total = sum(weight for _, weight in lit)
        key = sum(reading.key * weight for reading, weight in lit) / total
        red, green, blue = (sum(reading.colors[i] * weight for reading, weight in lit) / total for i in range(3))
        return Reading(key, (red, green, blue))


class Settings(NamedTuple):
    """The settings of one picture: seconds, ISO, `scale` from scene-linear light to shares of saturation, and the colour in
    linear sRGB that becomes white.
    """

    seconds: float
    iso: float
    scale: float
    white: tuple[float, float, float]

    @staticmethod
    def of(imager: MountedImager, reading: Reading | None) -> Settings:
        """The settings for metered light; automatic ones in darkness are the longest exposure and the largest ISO."""
        unit = imager.luminance / (SATURATION * imager.f_number**2)  # saturation by unit light, in a second at ISO 1
        wanted = np.inf if reading is None else KEY * 2.0 ** (imager.compensation - reading.key) / unit
        seconds, iso = imager.fixed_exposure, imager.fixed_iso
        if seconds is None:
            seconds = min(wanted / (imager.base_iso if iso is None else iso), imager.longest_exposure)
        if iso is None:
            iso = min(max(wanted / seconds, imager.base_iso), max(imager.most_iso, imager.base_iso))
        return Settings(float(seconds), float(iso), float(unit * seconds * iso), _white(imager, reading))


def _log_average(values: Float) -> float:
    stops = np.log2(np.maximum(values, DARK))
    middle = float(np.median(stops))
    return float(np.clip(stops, middle - BOUND, middle + BOUND).mean())


def _white(imager: MountedImager, reading: Reading | None) -> tuple[float, float, float]:
    if imager.white_balance == "auto":
        red, green, blue = (0.0, 0.0, 0.0) if reading is None else reading.colors
        return 2.0 ** (red - green), 1.0, 2.0 ** (blue - green)
    if imager.white_balance == "daylight":
        return 1.0, 1.0, 1.0
    red, green, blue = np.linalg.solve(white_balance(imager.white_balance, 0.0), np.ones(3)).tolist()
    return max(red, DARK), max(green, DARK), max(blue, DARK)
