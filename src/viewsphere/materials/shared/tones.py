"""Colours of tones."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from viewsphere.materials.shared.kernels_noise import lay_colors
from viewsphere.materials.shared.surface import BRIGHTEST, DARKEST, Color, Light, Map


def colored(tone: Map, *stops: tuple[float, Color]) -> Light:
    """The colours of tones, interpolated between ascending stops."""
    out = np.empty((*tone.shape, 3), np.float32)
    places, colors = (np.array(values, np.float32) for values in zip(*stops, strict=True))
    lay_colors(out, np.ascontiguousarray(tone, np.float32), places, colors)
    return out


def mixed(one: Light | Color, other: Light | Color, share: Map) -> Light:
    """The mix of one colour with a share of another."""
    a, b = np.asarray(one, np.float32), np.asarray(other, np.float32)
    return a + (b - a) * share[..., None]


def shaded(color: Light | Color, shade: Map) -> Light:
    """A colour times a shade, clipped to the limits of surfaces."""
    return np.clip(np.asarray(color, np.float32) * shade[..., None], DARKEST, BRIGHTEST)


def times(color: Color, factor: float | Sequence[float]) -> Color:
    """A colour times a number, or times one number per component."""
    r, g, b = (np.array(color) * np.array(factor)).clip(DARKEST, BRIGHTEST).tolist()
    return r, g, b
